"""Events with direction, stop and jump."""

import numpy as np
import pytest

import metriplectic as mp
from models import ball


def test_a_ball_bounces_at_the_times_of_the_formula():
    wall = mp.Event(lambda x: x[0], direction=-1, jump=lambda x: np.stack([x[0], -x[1]]))
    run = ball().run([0.5, 0.0], t=10.0, tol=1e-10, events={"wall": wall})
    assert np.allclose([event.t for event in run.events], [1.0, 3.0, 5.0, 7.0, 9.0], atol=1e-8)
    event = run.events[0]
    assert event.name == "wall" and not event.rises and event.y[1] < 0 < event.after[1]
    assert run.certificate.keeps_energy and abs(event.work) < 1e-15
    assert str(event) == "wall falls at t = 1"


def test_directions_and_stops():
    events = lambda direction: {"top": mp.Event(lambda x: x[1], direction=direction), "bell": mp.Event(lambda x, t: t - 5.0, stop=True)}
    wall = mp.Event(lambda x: x[0], -1, jump=lambda x: np.stack([x[0], -x[1]]))
    falling = ball().run([0.5, 0.0], t=10.0, tol=1e-10, events={**events(-1), "wall": wall})
    assert falling.ending == "event" and falling.t[-1] == pytest.approx(5.0, abs=1e-12)
    assert [event.name for event in falling.events][-1] == "bell"
    assert np.allclose([e.t for e in falling.events if e.name == "top"], [2.0, 4.0], atol=1e-8)
    rising = ball().run([0.5, 0.0], t=10.0, tol=1e-10, events={**events(1), "wall": wall})
    assert not [e for e in rising.events if e.name == "top"]


def test_a_run_ends_at_the_event_of_a_number():
    # It meets the wall at 1, 3, 5, …
    wall = lambda stop: {"wall": mp.Event(lambda x: x[0], -1, jump=lambda x: np.stack([x[0], -x[1]]), stop=stop)}
    run = ball().run([0.5, 0.0], t=100.0, tol=1e-10, events=wall(4), progress=lambda _: None)
    assert run.ending == "event" and run.t[-1] == pytest.approx(7.0, abs=1e-8)
    assert run.certificate.events == {"wall": 4}
    assert "events:      wall 4 times\n" in str(run.certificate)
    for number in (-1, 0, 2.5, None):
        with pytest.raises(ValueError, match="number of the event"):
            ball().run([0.5, 0.0], t=1.0, events=wall(number))


def test_parameters_are_those_of_the_run():
    # It falls to the height c under the gravity g: t = √(2(1 − c)/g).
    system = mp.System(mp.R(2), energy=lambda x, g: 0.5 * x[1] ** 2 + g * x[0], poisson="symplectic", parameters={"g": 1.0, "c": 0.5})
    floor = {"floor": lambda x, c: x[0] - c}
    for g, c in ((1.0, 0.5), (9.81, 0.2)):
        run = system(g=g, c=c).run([1.0, 0.0], t=2.0, tol=1e-11, events=floor)
        assert run.events[0].t == pytest.approx(np.sqrt(2 * (1 - c) / g), abs=1e-9)


def test_a_jump_that_loses_energy_is_work_or_heat():
    lossy = lambda **more: {"wall": mp.Event(lambda x: x[0], -1, jump=lambda x: np.stack([x[0], -0.9 * x[1]]), **more)}
    run = ball().run([0.5, 0.0], t=2.5, tol=1e-10, events=lossy())
    assert run.events[0].work == pytest.approx((0.81 - 1.0) * 0.5, abs=1e-8)
    heated = ball().run([0.5, 0.0], t=2.5, tol=1e-10, events=lossy(heat_at=300.0))
    assert heated.events[0].heat == pytest.approx(-0.095, abs=1e-8)
    assert "jumps:       wall 1 time" in str(run.certificate)


def test_bad_events_are_refused():
    with pytest.raises(ValueError, match="direction"):
        ball().run([0.5, 0.0], t=1.0, events={"wall": mp.Event(lambda x: x[0], direction=2)})
    with pytest.raises(mp.SpanError, match="resolution"):
        ball().run([0.5, 0.0], t=1.0, events={"wall": mp.Event(lambda x: x[0], resolution=-1.0)})
    with pytest.raises(mp.TraceError, match="shape"):
        ball().run([0.5, 0.0], t=1.0, events={"wall": mp.Event(lambda x: x[0], jump=lambda x: x[:1])})
