"""Runs by every method, their outputs, certificates and errors."""

import signal
import threading
import time

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import metriplectic as mp
from models import INERTIA, body, pendulum

START = [0.4, -1.0, 0.3]
METHODS = ["dp8", "dp5", "chebyshev", "midpoint", "exponential", "chart-midpoint", "gauss1", "gauss2", "gauss3", "gauss4", "radau2",
           "radau3", "radau4"]


def reference(start, end):
    """The body by another method, from equations by hand: p' = p × ω + |ω|² p − (ω·p) ω."""

    def rate(_, p):
        w = p / INERTIA
        return np.cross(p, w) + (w @ w) * p - (w @ p) * w

    return solve_ivp(rate, (0.0, end), start, method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]


def test_the_program_of_the_page_keeps_both_laws():
    run = body().run([0.001, -1.0, 0.001], t=100.0, tol=1e-9, method="dp8", every=0.1)
    assert run.y.shape == (1001, 3) and run.t[7] == 0.7000000000000001 and run.t[-1] == 100.0
    assert abs(run.energy - run.energy[0]).max() < 1e-15
    assert np.diff(run.entropy).min() >= 0 and run.certificate.keeps_entropy
    text = str(run.certificate)
    assert text.startswith("first law:   |H − H₀| ≤") and "it never fell" in text
    assert np.allclose(run.y[-1], reference([0.001, -1.0, 0.001], 100.0), atol=1e-6)


@pytest.mark.parametrize("method", ["dp8", "midpoint", "gauss2"])
def test_a_run_back_in_time_comes_to_its_start(method):
    free = mp.System(mp.so3_dual(), energy=lambda p: 0.5 * np.sum(p * p / INERTIA))
    there = free.run(START, t=5.0, h=0.1, method=method)
    back = free.run(there.y[-1], t0=5.0, t=0.0, h=0.1, method=method, backward=True)
    assert back.t[0] == 5.0 and abs(back.t[-1]) < 1e-14 and np.allclose(back.y[-1], START, atol=1e-12 if method != "dp8" else 1e-6)
    followed = free.run(there.y[-1], t0=5.0, t=0.0, tol=1e-10, backward=True, every=1.0, progress=lambda _: None)
    assert np.allclose(followed.t, [5.0, 4.0, 3.0, 2.0, 1.0, 0.0])
    with pytest.raises(mp.SpanError, match="entropy"):
        body().run(START, t=-5.0, backward=True, method=method)


@pytest.mark.parametrize("method", METHODS)
def test_every_method_reaches_the_reference(method):
    end = 2.0
    exact = reference(START, end)
    errors = []
    for h in (0.1, 0.05):
        run = body().run(START, t=end, h=h, method=method)
        assert len(run) == round(end / h) + 1
        assert run.certificate.keeps_energy and run.certificate.keeps_entropy
        errors.append(np.abs(run.y[-1] - exact).max())
    # A method of order 2 or more gains a factor of at least 3.4 unless it is at round-off; the exponential scheme has order 1.
    gain = 1.8 if method == "exponential" else 3.4
    assert errors[1] < max(errors[0] / gain, 1e-12) and errors[0] < 2e-2, errors


@pytest.mark.parametrize("gradient", ["gonzalez", "mean-value", "itoh-abe", "symmetric-itoh-abe"])
def test_every_discrete_gradient_keeps_the_laws(gradient):
    run = body().run(START, t=4.0, h=0.05, method="midpoint", gradient=gradient)
    assert run.certificate.keeps_energy and run.certificate.keeps_entropy
    # Itoh and Abe's gradient has order 1.
    assert np.allclose(run.y[-1], reference(START, 4.0), atol=0.1 if gradient == "itoh-abe" else 1e-3)


def test_the_runs_of_discrete_gradients_differ():
    ends = {g: body().run(START, t=1.0, h=0.1, method="midpoint", gradient=g).y[-1].tobytes() for g in ("gonzalez", "mean-value", "itoh-abe")}
    assert len(set(ends.values())) >= 2


def test_outputs_are_recorded_in_place_of_steps():
    system = body()
    run = system.run(START, t=3.0, at=[0.5, 2.0])
    assert run.t.tolist() == [0.0, 0.5, 2.0, 3.0]
    assert np.allclose(system.run(START, t=2.0, tol=1e-10).y[-1], run.y[2], atol=1e-5)
    assert len(system.run(START, t=3.0, h=0.1, each=10)) == 4
    assert len(system.run(START, h=0.1, steps=30, at_most=4)) == 4
    assert system.run(START, t=3.0, t0=2.0).t[0] == 2.0
    rest = system.run(START, t=1e4, rest=1e-6)
    assert rest.ending == "rest" and rest.t[-1] < 1e4


def test_parameters_change_the_run_and_not_the_recording():
    calls = []

    def energy(x, length):
        calls.append(1)
        return 0.5 * x[1] ** 2 - np.cos(x[0]) / length

    system = mp.System(mp.R(2), energy=energy, poisson="symplectic", parameters={"length": 1.0})
    recorded = len(calls)
    runs = [system(length=length).run([1.0, 0.0], t=5.0, tol=1e-10) for length in (1.0, 2.0)]
    assert len(calls) == recorded and abs(runs[0].y[-1] - runs[1].y[-1]).max() > 0.1
    other = mp.System(mp.R(2), energy=lambda x: 0.5 * x[1] ** 2 - np.cos(x[0]) / 2.0, poisson="symplectic")
    assert np.allclose(runs[1].y[-1], other.run([1.0, 0.0], t=5.0, tol=1e-10).y[-1], atol=1e-9)
    assert system.parameters == {"length": 1.0} and system(length=2.0).parameters == {"length": 2.0}


def test_a_friction_of_ones_own_damps_as_it_says():
    run = pendulum().run([1.2, 0.0, 0.0], t=20.0, tol=1e-10)

    def rate(_, x):
        return [x[1], -np.sin(x[0]) - 0.3 * x[1], 0.3 * x[1] ** 2]

    exact = solve_ivp(rate, (0.0, 20.0), [1.2, 0.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    assert np.allclose(run.y[-1], exact, atol=1e-7)
    assert abs(run.energy - run.energy[0]).max() < 1e-14 and (np.diff(run.entropy) >= 0).all()


def test_verification_names_the_law():
    with pytest.raises(mp.ModelError, match="Casimir"):
        mp.System(mp.so3_dual(), energy=lambda p: p @ p, entropy=lambda p: p[0]).run([1.0, 2.0, 3.0], t=1.0)
    broken = mp.System(
        mp.R(3), energy=lambda x: 0.5 * x @ x, entropy=lambda x: x[2], friction=lambda x, w: np.eye(3), poisson="none"
    )
    with pytest.raises(mp.ModelError, match="does not keep the energy"):
        broken.verify([1.0, 2.0, 3.0])
    report = broken.report([1.0, 2.0, 3.0])
    assert report.verdict is not None and any(size > allowed for _, size, allowed, _ in report.laws)
    sound = body().report(START)
    assert sound.verdict is None and len(sound.laws) > 3
    assert body().verified(START).run(START, t=1.0).certificate.verified_before
    # A certificate is that of the values of the parameters.
    damped = pendulum().verified([1.0, 0.0, 0.0])
    assert damped.run([0.5, 0.0, 0.0], t=1.0).certificate.verified_before
    assert not damped(gamma=0.5).run([0.5, 0.0, 0.0], t=1.0).certificate.verified_before
    with pytest.raises(mp.ModelError, match="destroys entropy"):
        damped(gamma=-0.5).run([0.5, 0.4, 0.0], t=1.0)


def test_messages_speak_python():
    messages = []
    for make in (
        lambda: mp.System(mp.so3_dual(), energy=lambda p: p @ p, entropy=lambda p: p[0]).run([1.0, 2.0, 3.0], t=1.0),
        lambda: body().run(START, t=1.0, h=0.1, each=0),
        lambda: body().run(START, t=1.0, tol=1e-30),
        lambda: body().run(START, t=-1.0),
        lambda: body().run(START, t=1.0, every=-1.0),
        lambda: body().run(START, h=-0.1, steps=3),
    ):
        with pytest.raises(mp.Error) as caught:
            make()
        messages.append(str(caught.value))
    assert all("::" not in message and "`." not in message for message in messages), messages


@pytest.mark.parametrize("options", [
    {"t": -1.0}, {"t": 0.0}, {"t": float("nan")}, {"t": float("inf")}, {"t": 1.0, "h": -0.1}, {"h": 0.1}, {"steps": 3}, {},
    {"t": 1.0, "h": 0.3}, {"t": 1.0, "tol": 0.0}, {"t": 1.0, "tol": float("nan")}, {"t": 1.0, "at": [2.0]}, {"t": 1.0, "every": 0.0},
    {"t": 1.0, "rest": 2.0},
])
def test_a_span_that_cannot_be_run_is_a_span_error(options):
    with pytest.raises(mp.SpanError):
        body().run(START, **options)


def test_a_run_that_fails_has_the_states_before():
    # The square root has no value below 0, and the state moves there.
    system = mp.System(mp.R(2), energy=lambda x: x[1] + np.sqrt(x[0]) * 0.0 + 0.0 * np.log(x[0]), poisson="symplectic")
    backwards = mp.System(mp.R(2), energy=lambda x: -x[1] + 1e-3 * np.log(x[0]), poisson="symplectic")
    with pytest.raises(mp.RunError) as caught:
        backwards.run([1.0, 0.0], t=2.0, h=0.05, method="midpoint")
    partial = caught.value.partial
    assert 3 < len(partial) < 41 and 0 < partial.y[-1, 0] < 0.3 and partial.ending == "stopped"
    assert system is not None


def test_an_interrupt_gives_the_run_so_far():
    # A shell ignores the signal for what it starts in the background.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.4, lambda: signal.raise_signal(signal.SIGINT))
    timer.start()
    begin = time.monotonic()
    try:
        with pytest.raises(KeyboardInterrupt) as caught:
            body().run(START, h=1e-3, steps=10**9, each=10**5, method="dp5")
    finally:
        signal.signal(signal.SIGINT, before)
    assert time.monotonic() - begin < 20
    partial = caught.value.partial
    assert partial.certificate.steps > 100 and "first law" in str(partial.certificate)


def test_progress_calls_a_function_with_rising_times():
    seen = []
    body().run(START, t=800.0, h=0.01, each=10**6, method="dp8", progress=seen.append)
    assert len(seen) >= 2 and (np.diff(seen) > 0).all() and 0.0 < seen[0] < 800.0

    def stop(_):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        body().run(START, h=1e-3, steps=10**9, each=10**6, progress=stop)


def test_sizes_of_any_number_of_entries_are_taken():
    ring = mp.System(mp.R(34), energy=lambda x: 0.5 * x @ x, poisson="symplectic")
    start, options = np.eye(34)[0], dict(t=3.0, tol=1e-6)
    sized = ring.run(start, scale=np.full(34, 1e-3), **options)
    assert len(sized) > len(ring.run(start, scale=np.ones(34), **options))
    assert len(ring.run(start, absolute=np.full(34, 1e-2), **options)) < len(sized)
    with pytest.raises(mp.Error, match="33"):
        ring.run(start, scale=np.ones(33), **options)


def test_a_bar_is_shown(capsys):
    body().run(START, t=500.0, h=0.01, each=10**6, progress=True)
    assert "500/500" in capsys.readouterr().err


def test_other_threads_go_on_during_a_run():
    ticks, done = [0], threading.Event()

    def work():
        body().run(START, h=0.01, steps=100_000, each=10**6)
        done.set()

    threading.Thread(target=work).start()
    while not done.is_set():
        ticks[0] += 1
        time.sleep(0.001)
    assert ticks[0] > 20


def test_runs_from_many_starts_do_not_depend_on_threads():
    starts = np.array([[0.4, -1.0, 0.3 + 0.01 * k] for k in range(12)])
    one, two = (body().runs(starts, t=3.0, threads=threads) for threads in (1, 4))
    assert all((a.y == b.y).all() for a, b in zip(one, two))
    assert (one[5].y == body().run(starts[5], t=3.0).y).all()


@pytest.mark.parametrize("space, start, energy, entropy, options", [
    (mp.sphere(2), [0.48, 0.36, -0.8], lambda n: 0.5 * n[0] ** 2 + 0.25 * n[1] ** 2, lambda n: n[2] + 0.3 * n[0] * n[1], {}),
    (mp.half_line() * mp.R(1), [1.0, 0.0], lambda x: x[0][0] + x[1][0], lambda x: np.log(x[0][0]) + 2.0 * np.log(x[1][0] + 3.0), {}),
    (mp.SO3(), np.eye(3), lambda r: r[0, 1] * 0.5 + r[2, 2] ** 2, lambda r: r[0, 0] + 0.3 * r[1, 2], {}),
    (mp.cotangent_so3(), (np.eye(3), [0.9, 0.4, -0.7]), lambda x: 0.5 * x[1] @ (x[1] / INERTIA) + 0.3 * x[0][2, 2], None,
     {"poisson": "symplectic"}),
    (mp.se3_dual(), [0.1, 0.2, 3.0, 0.0, 0.6, 0.8], lambda x: 0.5 * x[:3] @ (x[:3] / INERTIA) + x[5], None, {}),
    (mp.so3_dual() * mp.R(1), [0.4, -1.0, 0.3, 0.0], lambda x: 0.5 * x[0] @ (x[0] / INERTIA) + np.exp(x[1][0]), lambda x: x[1][0], {}),
])
@pytest.mark.parametrize("method", ["dp8", "midpoint", "gauss2"])
def test_spaces_and_products(space, start, energy, entropy, options, method):
    system = mp.System(space, energy=energy, entropy=entropy, **options)
    run = system.run(start, t=1.0, h=0.05, method=method)
    assert run.y.shape == (21, space.entries) and run.certificate.keeps_energy and run.certificate.keeps_entropy
    fine = system.run(start, t=1.0, tol=1e-11)
    assert np.allclose(run.y[-1], fine.y[-1], atol=5e-3)
    assert np.abs(fine.y[-1] - fine.y[0]).max() > 1e-3


def test_sizes_are_known_at_run_time():
    for n in (1, 2, 7, 40, 120):
        springs = lambda x, n=n: 0.5 * np.sum(x[n:] ** 2) + 0.5 * np.sum(np.diff(x[:n]) ** 2) + 0.5 * x[0] ** 2
        system = mp.System(mp.R(2 * n), energy=springs, poisson="symplectic")
        start = np.concatenate([np.sin(np.arange(n) + 1.0), np.zeros(n)])
        run = system.run(start, t=3.0, tol=1e-8)
        # The exact motion by the eigenvectors of the stiffness.
        stiffness = np.diag(np.r_[np.full(max(n - 1, 0), 2.0), 1.0]) - np.eye(n, k=1) - np.eye(n, k=-1)
        square, modes = np.linalg.eigh(stiffness)
        exact = modes @ (np.cos(np.sqrt(square) * 3.0) * (modes.T @ start[:n]))
        assert np.allclose(run.y[-1, :n], exact, atol=1e-6), n
        assert run.certificate.keeps_energy


def test_observables_are_functions_of_the_recorded_states():
    run = pendulum().run([1.0, 0.0, 0.0], t=3.0, every=0.5, observables={
        "speed": lambda x: np.abs(x[1]), "pair": lambda x, t, gamma: np.stack([x[0] + t, gamma * x[1]]),
    })
    assert np.allclose(run.observables["speed"], np.abs(run.y[:, 1]))
    assert np.allclose(run.observables["pair"], np.stack([run.y[:, 0] + run.t, 0.3 * run.y[:, 1]], axis=1))


def test_functions_of_a_product_take_its_factors_one_by_one():
    space = mp.sphere(2) * mp.R(1)
    taken = mp.System(space, energy=lambda m, s: m[2] + np.exp(s[0]), entropy=lambda m, s: s[0], friction=lambda m, s, rate: rate,
                      parameters={"rate": 0.3})
    tuples = mp.System(space, energy=lambda x: x[0][2] + np.exp(x[1][0]), entropy=lambda x: x[1][0], friction=0.3)
    start = [[0.6, 0.0, 0.8], [0.1]]
    runs = [system.run(start, t=2.0, tol=1e-9) for system in (taken, tuples)]
    assert np.allclose(runs[0].y, runs[1].y, rtol=0.0, atol=1e-14)
