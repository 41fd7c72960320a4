"""Tangents, gradients and fits."""

import numpy as np
import pytest

import metriplectic as mp
from models import INERTIA, ball, body, oscillator, pendulum

START = [1.2, 0.0, 0.0]


def differences(f, x, step):
    """Central differences of a function of a list of numbers, of order 4."""
    x = np.asarray(x, dtype=float)
    columns = []
    for k in range(x.size):
        def at(e, k=k):
            y = x.copy()
            y[k] += e
            return np.asarray(f(y))
        columns.append((8 * (at(step) - at(-step)) - (at(2 * step) - at(-2 * step))) / (12 * step))
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("method", ["dp8", "dp5", "midpoint", "gauss2", "radau2"])
def test_a_tangent_is_the_derivative_of_the_steps(method):
    options = dict(t=2.0, h=0.1, method=method)
    found = pendulum().tangent(START, **options)
    assert found.along_start.shape == (21, 3, 3) and found.along["gamma"].shape == (21, 3)
    start = differences(lambda x: pendulum().run(x, **options).y[-1], START, 1e-3)
    assert np.allclose(found.along_start[-1], start, atol=2e-8)
    theta = differences(lambda p: pendulum(*p).run(START, **options).y[-1], [0.3, 1.0], 1e-3)
    assert np.allclose(np.stack([found.along["gamma"][-1], found.along["length"][-1]], axis=1), theta, atol=2e-8)
    assert found.sensitivity["energy"] < 1e-8


def test_a_tangent_along_the_start_alone_is_exact():
    # A linear system: the tangent is the matrix of the flow.
    system = mp.System(mp.R(2), energy=lambda x: 0.5 * (x[1] ** 2 + 4.0 * x[0] ** 2), poisson="symplectic")
    found = system.tangent([0.3, 0.2], t=1.0, tol=1e-12, along=[])
    c, s = np.cos(2.0), np.sin(2.0)
    assert np.allclose(found.along_start[-1], [[c, s / 2], [-2 * s, c]], atol=1e-10)
    assert found.along == {}


def oscillation(k, n, h):
    """The position of an oscillator after n midpoint steps from q = 1, and its derivative along the stiffness k: a step turns q + i p/ω by
    2 atan(ωh/2)."""
    omega = np.sqrt(k)
    angle, slope = 2 * np.arctan(omega * h / 2), h / (1 + (omega * h / 2) ** 2) / (2 * omega)
    return np.cos(n * angle), -n * np.sin(n * angle) * slope


@pytest.mark.parametrize("unit", [1.0, 1e-9, 1e11])
def test_gradients_along_parameters_are_those_of_a_closed_form(unit):
    system = mp.System(
        mp.R(2), energy=lambda x, k: 0.5 * (x[1] ** 2 + k * x[0] ** 2), poisson="symplectic", parameters={"k": 2.3}
    )
    options = dict(t=2.0, h=0.1, method="midpoint")
    exact, slope = oscillation(2.3, 20, 0.1)
    start = [unit, 0.0]
    found = system.tangent(start, **options)
    assert found.y[-1, 0] == pytest.approx(unit * exact, rel=1e-12)
    assert found.along["k"][-1, 0] == pytest.approx(unit * slope, rel=1e-12)
    value, _, parameters = system.gradient(lambda y: y[-1, 0] ** 2 / unit**2, start, **options)
    assert value == pytest.approx(exact**2, rel=1e-12)
    assert parameters["k"] == pytest.approx(2 * exact * slope, rel=1e-12)
    weights = np.zeros((21, 2))
    weights[-1, 0] = 1.0 / unit
    _, slopes = system.run(start, **options).vjp(weights)
    assert slopes["k"] == pytest.approx(slope, rel=1e-12)


@pytest.mark.parametrize("method", ["dp8", "dp5", "chebyshev", "midpoint", "gauss2", "radau2"])
def test_every_part_of_a_recorded_system_has_exact_derivatives_along_parameters(method):
    # The bracket is β J, the friction a recorded matrix, and the entropy c ln u. A parameter that is not asked for stays as it is.
    def friction(x, w, gamma):
        b = np.stack([0.0, w[2], -w[1]])
        return gamma * x[2] * np.outer(b, b)

    def form(x, beta):
        return beta * np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])

    theta = {"gamma": 0.3, "beta": 1.2, "c": 2.0}
    system = mp.System(
        mp.R(3), energy=lambda x, beta: 0.5 * x[1] ** 2 - np.cos(beta * x[0]) + x[2], entropy=lambda x, c: c * np.log(x[2]),
        poisson=form, friction=friction, parameters=theta,
    )
    options = dict(t=1.0, h=0.1, method=method)
    start, names = [1.2, 0.1, 1.5], ["c", "gamma"]
    found = system.tangent(start, along=names, **options)
    exact = differences(
        lambda p: system(c=p[0], gamma=p[1]).run(start, **options).y[-1], [theta[name] for name in names], 1e-3
    )
    assert np.allclose(np.stack([found.along[name][-1] for name in names], axis=1), exact, atol=1e-10)
    every = system.tangent(start, **options)
    exact = differences(lambda p: system(beta=p[0]).run(start, **options).y[-1], [1.2], 1e-3)
    assert np.allclose(every.along["beta"][-1], exact[:, 0], atol=1e-10)
    assert every.sensitivity["energy"] < 1e-12


def test_a_tangent_of_a_sphere_has_entries_as_rows():
    system = mp.System(mp.sphere(2), energy=lambda n: n[2], poisson="area")
    # The area form turns a spin about the third axis, with the angle t: so do tangents.
    found = system.tangent([0.6, 0.0, 0.8], t=0.7, tol=1e-10)
    assert found.along_start.shape[1:] == (3, 2)
    assert np.allclose(np.einsum("mi,mij->mj", found.y, found.along_start), 0.0, atol=1e-7)
    grown = np.linalg.svd(found.along_start[-1], compute_uv=False)
    before = np.linalg.svd(found.along_start[0], compute_uv=False)
    assert np.allclose(grown, before, atol=1e-6)


def test_the_time_of_an_event_and_the_state_behind_a_jump_have_derivatives():
    # It falls from the height h under g: t = √(2h/g).
    wall = {"wall": mp.Event(lambda x: x[0], -1, jump=lambda x: np.stack([x[0], -0.9 * x[1]]))}
    found = ball()(g=2.0).tangent([1.0, 0.0], t=1.5, tol=1e-11, events=wall)
    event = found.events[0]
    assert event["time_along"]["g"] == pytest.approx(-0.5 * np.sqrt(2 / 8.0), abs=1e-7)
    assert event["time_along_start"][0] == pytest.approx(0.5 * np.sqrt(2 / 2.0), abs=1e-7)
    along = differences(lambda g: ball()(g=g[0]).run([1.0, 0.0], t=1.5, tol=1e-11, events=wall).y[-1], [2.0], 1e-3)
    assert np.allclose(found.along["g"][-1], along[:, 0], atol=1e-6)


def test_the_ledger_of_an_open_system_has_derivatives():
    system, options = oscillator(), dict(t=3.0, tol=1e-10)
    found = system.tangent([1.0, 0.0], **options)
    theta = [1.5, 0.2, 0.4]

    def at(p):
        run = system(k=p[0], rate=p[1], push=p[2]).run([1.0, 0.0], **options)
        return np.r_[run.y[-1], run.ledger["work of push"][-1], run.ledger["heat of air"][-1]]

    exact = differences(at, theta, 1e-3)
    names = ("k", "rate", "push")
    rows = [np.stack([found.along[name][-1] for name in names], axis=1)]
    for column in ("work of push", "heat of air"):
        rows.append(np.array([[found.ledger[column][1][name][-1] for name in names]]))
    assert np.allclose(np.concatenate(rows), exact, atol=1e-6)


def test_a_parameter_that_is_zero_needs_a_size():
    system = mp.System(
        mp.R(2), energy=lambda x, stiffer: 0.5 * x @ x + stiffer * x[0] ** 4, poisson="symplectic", parameters={"stiffer": 0.0}
    )
    with pytest.raises(mp.ModelError, match="sizes="):
        system.tangent([1.0, 0.0], t=1.0, h=0.1)
    found = system.tangent([1.0, 0.0], t=1.0, h=0.1, sizes={"stiffer": 0.1})
    exact = differences(lambda p: system(stiffer=p[0]).run([1.0, 0.0], t=1.0, h=0.1).y[-1], [0.0], 1e-3)
    assert np.allclose(found.along["stiffer"][-1], exact[:, 0], atol=1e-8)


def test_a_run_that_is_differentiated_again():
    run = pendulum().run(START, t=1.0, h=0.1)
    assert (run.tangent().y == run.y).all()
    found = pendulum().tangent(START, t=3.0, tol=1e-6, accuracy=1e-8, along=[])
    assert found.sensitivity["frozen"]


@pytest.mark.parametrize("options", [dict(h=0.1, method="dp8"), dict(tol=1e-8, method="dp5"), dict(h=0.1, method="midpoint"),
                                     dict(h=0.1, method="gauss2")])
def test_a_gradient_is_the_transpose_of_the_tangent(options):
    options = dict(t=2.0, at=[0.5, 1.3, 2.0], **options)
    data = np.array([[1.0, -0.5], [0.2, -1.0], [-0.3, -0.8]])
    value, start, parameters = pendulum().gradient(lambda y: np.sum((y[1:, :2] - data) ** 2), START, **options)
    found = pendulum().tangent(START, **options)
    weights = np.zeros_like(found.y)
    weights[1:, :2] = 2 * (found.y[1:, :2] - data)
    assert value == pytest.approx(np.sum((found.y[1:, :2] - data) ** 2), rel=1e-12)
    assert np.allclose(start, np.einsum("mi,mij->j", weights, found.along_start), atol=1e-7)
    for name in ("gamma", "length"):
        assert parameters[name] == pytest.approx(np.sum(weights * found.along[name]), abs=1e-7)
    run = pendulum().run(START, **options)
    again, slopes = run.vjp(weights)
    assert np.allclose(again, start, atol=1e-12) and slopes["gamma"] == pytest.approx(parameters["gamma"], abs=1e-12)
    with pytest.raises(ValueError, match="shape"):
        run.vjp(weights[1:])


def test_arrays_of_parameters_have_gradients():
    def energy(p, inertia):
        return 0.5 * np.sum(p * p / inertia)

    system = mp.System(mp.so3_dual(), energy=energy, entropy=lambda p, inertia: 0.5 * p @ p, parameters={"inertia": INERTIA})
    value, start, parameters = system.gradient(lambda y: np.sum(y[-1] ** 3), [0.4, -1.0, 0.3], t=2.0, h=0.1)
    exact = differences(lambda p: np.sum(system(inertia=p).run([0.4, -1.0, 0.3], t=2.0, h=0.1).y[-1] ** 3), INERTIA, 1e-3)
    assert parameters["inertia"].shape == (3,) and np.allclose(parameters["inertia"], exact, atol=1e-7)
    assert value == pytest.approx(np.sum(system.run([0.4, -1.0, 0.3], t=2.0, h=0.1).y[-1] ** 3)) and start.shape == (3,)


def test_a_fit_finds_the_parameters_within_their_errors():
    rng = np.random.default_rng(5)
    times = np.linspace(0.25, 10.0, 40)
    truth = {"gamma": 0.3, "length": 1.2}
    clean = pendulum()(**truth).run(START, at=times, t=10.0, tol=1e-9).y[1:, :2]
    scores = []
    for _ in range(6):
        data = clean + 1e-3 * rng.standard_normal(clean.shape)
        found = mp.fit(
            pendulum()(gamma=0.2, length=1.0), times, data, start=START, observe=lambda x: x[:2], positive=["gamma"], noise=1e-3
        )
        assert found.ending == "minimum" and found.noise == pytest.approx(1.0, abs=0.3)
        scores += [(e.value - truth[e.name]) / e.standard_error for e in found.estimates]
    assert np.abs(scores).max() < 4.5 and 0.4 < np.sqrt(np.mean(np.square(scores))) < 1.8, scores
    assert "gamma" in str(found) and found.system.parameters["gamma"] == found.parameters["gamma"]
    low, high = found.estimates[0].interval(2)
    assert 0 < low < found.estimates[0].value < high


def test_a_fit_of_the_start_and_of_a_part_of_the_parameters():
    times = np.linspace(0.2, 4.0, 20)
    data = pendulum().run(START, at=times, t=4.0, tol=1e-10).y[1:, :1]
    found = mp.fit(
        pendulum()(gamma=0.2), times, data, start=[1.1, 0.1, 0.0], observe=lambda x: x[:1], free=["gamma"], free_start=True
    )
    assert found.parameters["gamma"] == pytest.approx(0.3, abs=1e-5) and np.allclose(found.start[:2], START[:2], atol=1e-5)
    # The heat at the start changes neither the angle nor the momentum: the data do not see it.
    assert any("start[2]" in combination for combination in found.unseen)


def test_a_meter_with_a_parameter_of_its_own():
    system = mp.System(mp.R(2), energy=lambda x: 0.5 * x @ x, poisson="symplectic", parameters={"scale": 2.0})
    times = np.linspace(0.3, 5.0, 12)
    data = 3.5 * np.cos(times)
    found = mp.fit(system, times, data, start=[1.0, 0.0], observe=lambda x, scale: np.stack([scale * x[0]]))
    assert found.parameters["scale"] == pytest.approx(3.5, abs=1e-7)


def test_bad_data_are_refused():
    times = [1.0, 2.0]
    with pytest.raises(ValueError, match="rise"):
        mp.fit(pendulum(), [2.0, 1.0], np.zeros((2, 3)), start=START)
    with pytest.raises(ValueError, match="columns"):
        mp.fit(pendulum(), times, np.zeros((2, 5)), start=START)
    with pytest.raises(ValueError, match="too few"):
        mp.fit(pendulum(), [1.0], np.array([[1.0, np.nan, np.nan]]), start=START)
    with pytest.raises(TypeError, match="no parameter"):
        mp.fit(pendulum(), times, np.zeros((2, 3)), start=START, free=["mass"])


def test_a_program_of_jax_has_the_gradient_of_the_steps():
    jax = pytest.importorskip("jax")
    jax.config.update("jax_enable_x64", True)
    jnp = jax.numpy
    times = np.array([0.5, 1.0, 2.0])

    def loss(start, gamma, length):
        y = mp.jax.solve(pendulum(), start, {"gamma": gamma, "length": length}, at=times, h=0.1, method="dp8")
        return jnp.sum(jnp.sin(y[:, :2]) ** 2)

    value, slopes = jax.jit(jax.value_and_grad(loss, argnums=(0, 1, 2)))(jnp.array(START), 0.3, 1.0)
    exact = differences(
        lambda z: np.sum(np.sin(pendulum(*z[3:]).run(z[:3], t=2.0, h=0.1, at=times).y[1:, :2]) ** 2), [*START, 0.3, 1.0], 1e-3
    )
    assert float(value) == pytest.approx(float(loss(jnp.array(START), 0.3, 1.0)))
    assert np.allclose(np.r_[slopes[0], slopes[1], slopes[2]], exact, atol=1e-7)


def test_gradients_go_back_across_events():
    # From the height q under the gravity g it hits the floor with the momentum −√(2 g q).
    system, start = ball()(g=2.0), [1.5, 0.0]
    floor = {"floor": mp.Event(lambda x: x[0], -1, stop=True)}
    value, along, rest = system.gradient(lambda y: y[-1, 1], start, t=10.0, tol=1e-11, events=floor)
    assert value == pytest.approx(-np.sqrt(6.0), abs=1e-9)
    assert along[0] == pytest.approx(-np.sqrt(2.0 / 3.0), abs=1e-8) and rest["g"] == pytest.approx(-np.sqrt(1.5 / 4.0), abs=1e-7)
    # A bounce that keeps the part e of the speed: at t = 2, from the height 1/2 under the gravity 1, x = e − 1/2 and p = e − 1.
    bouncing = mp.System(mp.R(2), energy=lambda x: 0.5 * x[1] ** 2 + x[0], poisson="symplectic", parameters={"e": 0.9})
    wall = {"wall": mp.Event(lambda x: x[0], -1, jump=lambda x, e: np.stack([x[0], -e * x[1]]))}
    run = bouncing.run([0.5, 0.0], t=2.0, tol=1e-11, events=wall)
    weights = np.zeros_like(run.y)
    weights[-1] = [1.0, 3.0]
    _, parameters = run.vjp(weights)
    assert parameters["e"] == pytest.approx(4.0, abs=1e-7)
