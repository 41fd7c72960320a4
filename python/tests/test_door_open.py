"""Ports, baths, a clock, the ledger, and thermal noise."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import metriplectic as mp
from models import oscillator

METHODS = [{"method": "dp8", "tol": 1e-10}, {"method": "dp5", "tol": 1e-9}, {"method": "midpoint", "h": 0.005},
           {"method": "gauss2", "h": 0.05}, {"method": "radau2", "h": 0.02}, {"method": "chebyshev", "tol": 1e-8}]


@pytest.mark.parametrize("options", METHODS)
def test_the_balance_of_an_open_system_closes(options):
    run = oscillator().run([1.0, 0.0], t=6.0, **options)

    # x' = (p, −k q − γ p + 0.4 sin 1.3t), W' = p·push, Q' = −γ p².
    def rate(t, z):
        q, p, *_ = z
        push = 0.4 * np.sin(1.3 * t)
        return [p, -1.5 * q - 0.2 * p + push, p * push, -0.2 * p * p, 0.2 * p * p / 0.7]

    exact = solve_ivp(rate, (0.0, 6.0), [1.0, 0.0, 0.0, 0.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    assert np.allclose(run.y[-1], exact[:2], atol=1e-4)
    booked = [run.ledger[name][-1] for name in ("work of push", "heat of air", "entropy of air")]
    assert np.allclose(booked, exact[2:], atol=1e-4)
    gained = run.energy[-1] - run.energy[0]
    assert gained == pytest.approx(booked[0] + booked[1], abs=1e-13)
    assert abs(run.balance - run.balance[0]).max() < 1e-13 and (np.diff(run.total_entropy) >= 0).all()
    assert run.certificate.keeps_energy and "heat:        air" in str(run.certificate)


def test_a_clock_in_the_energy_books_its_work():
    spring = mp.System(mp.R(2), energy=lambda x, t: 0.5 * x[1] ** 2 + 0.5 * (x[0] - np.sin(t)) ** 2, poisson="symplectic")
    run = spring.run([0.2, 0.2], t=8.0, tol=1e-10)

    def rate(t, z):
        q, p, _ = z
        return [p, np.sin(t) - q, -(q - np.sin(t)) * np.cos(t)]

    exact = solve_ivp(rate, (0.0, 8.0), [0.2, 0.2, 0.0], method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    assert np.allclose(run.y[-1], exact[:2], atol=1e-7) and run.ledger["work"][-1] == pytest.approx(exact[2], abs=1e-7)
    assert run.energy[-1] - run.energy[0] == pytest.approx(run.ledger["work"][-1], abs=1e-13)


def test_a_corner_is_passed_exactly():
    spring = mp.System(
        mp.R(2), energy=lambda x, t: 0.5 * (x[1] ** 2 + np.where(t < 0.5, 1.0, 4.0) * x[0] ** 2), poisson="symplectic"
    )
    run = spring.run([1.0, 0.0], t=1.0, tol=1e-10, corners=[0.5])
    q, p = np.cos(0.5), -np.sin(0.5)
    assert run.y[-1, 0] == pytest.approx(q * np.cos(1.0) + p * 0.5 * np.sin(1.0), abs=1e-9)
    assert run.ledger["work"][-1] == pytest.approx(1.5 * q * q, abs=1e-9)


def test_the_temperature_of_a_bath_may_be_a_function_of_the_time():
    system = mp.System(
        mp.R(1), energy=lambda s: np.exp(s[0]), entropy=lambda s: s[0], friction=None, parameters={"mean": 2.0},
        baths={"sun": (lambda t, mean: mean + np.sin(t), lambda x, w: [(0.1 / w[0], np.ones(1))])},
    )
    run = system.run([0.0], t=10.0, tol=1e-9)

    # s' = (0.1/T)(T_b − T) with T = eˢ.
    def rate(t, s):
        return 0.1 / np.exp(s) * (2.0 + np.sin(t) - np.exp(s))

    exact = solve_ivp(rate, (0.0, 10.0), [0.0], method="DOP853", rtol=1e-12, atol=1e-13).y[0, -1]
    assert run.y[-1, 0] == pytest.approx(exact, abs=1e-7)
    assert run.ledger["heat of sun"][-1] == pytest.approx(run.energy[-1] - run.energy[0], abs=1e-12)


def test_a_port_that_carries_entropy_is_refused():
    system = mp.System(
        mp.R(3), energy=lambda x: 0.5 * x[1] ** 2 + 0.5 * x[0] ** 2 + x[2], entropy=lambda x: x[2], friction=None,
        poisson=np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 0]]), work={"pump": lambda x: np.array([0.0, 0.0, 1.0])},
    )
    with pytest.raises(mp.ModelError, match="`pump` carries entropy"):
        system.run([1.0, 0.0, 0.0], t=1.0)


def langevin(noise):
    """A mass in a bath: p has the variance k_B T at rest."""
    return mp.System(
        mp.R(2), energy=lambda x: 0.5 * (x[1] ** 2 + x[0] ** 2), poisson="symplectic", noise=noise,
        baths={"air": (2.0, lambda x, w: [(1.0, np.array([0.0, 1.0]))])},
    )


def test_noise_has_the_variance_of_the_bath():
    runs = langevin(0.5).paths([0.0, 0.0], 1200, h=0.1, steps=80, each=80, method="dp5", seed=3, threads=2)
    ends = np.array([run.y[-1] for run in runs])
    assert len({end.tobytes() for end in ends}) == 1200
    # k_B T = 1, with the standard error √(2/1200) of a variance.
    for variance in (ends**2).mean(axis=0):
        assert variance == pytest.approx(1.0, abs=5 * np.sqrt(2 / 1200))
    assert abs(runs[0].balance - runs[0].balance[0]).max() < 1e-12
    assert "second law:  in the mean" in str(runs[0].certificate)


def test_a_path_is_that_of_its_seed():
    options = dict(h=0.05, steps=20, method="dp5")
    system = langevin(0.5)
    a, b, c = (system.run([0.0, 0.0], seed=1, path=k, **options) for k in (0, 0, 1))
    assert (a.y == b.y).all() and (a.y[-1] != c.y[-1]).any()
    other = system.run([0.0, 0.0], seed=1, sampler="ninomiya-victoir", **options)
    assert (other.y[-1] != a.y[-1]).any()
    assert (system.paths([0.0, 0.0], 2, seed=1, **options)[1].y == c.y).all()
    with pytest.raises(mp.Error):
        system.run([0.0, 0.0], t=1.0, tol=1e-6, method="dp5")


def test_a_closed_system_with_noise_keeps_its_energy():
    system = mp.System(
        mp.so3_dual(), energy=lambda p: 0.5 * p @ (p / np.array([3.0, 2.0, 1.0])), entropy=lambda p: 0.5 * p @ p, noise=0.1, friction=0.2
    )
    run = system.run([0.4, -1.0, 0.3], h=0.02, steps=300, method="dp5", seed=2)
    assert run.certificate.keeps_energy and (np.diff(run.entropy) < 0).any()


def test_a_friction_may_depend_on_time():
    def friction(x, w, t):
        return [(0.2 * (1.0 + np.sin(t)), np.stack([0.0 * w[0], -w[2], w[1]]))]

    system = mp.System(
        mp.R(3), energy=lambda x: 0.5 * x[1] ** 2 + 0.5 * x[0] ** 2 + x[2], entropy=lambda x: x[2], friction=friction,
        poisson=np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 0]]),
    )
    run = system.run([1.0, 0.0, 0.0], t=5.0, tol=1e-10)
    exact = solve_ivp(
        lambda t, x: [x[1], -x[0] - 0.2 * (1 + np.sin(t)) * x[1]], (0.0, 5.0), [1.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-13
    ).y[:, -1]
    assert np.allclose(run.y[-1, :2], exact, atol=1e-7) and run.certificate.keeps_energy


def test_contacts_without_a_covector_may_have_the_time_second():
    system = mp.System(
        mp.R(1), energy=lambda p: 0.5 * p @ p, friction=None, poisson="none",
        baths={"air": (1.0, lambda p, t: [(0.3 * t, np.ones(1))])},
    )
    # p' = −0.3 t p.
    run = system.run([1.0], t=2.0, tol=1e-10)
    assert run.y[-1, 0] == pytest.approx(np.exp(-0.6), abs=1e-8)


def test_ports_and_baths_on_spheres_are_refused():
    with pytest.raises(mp.ModelError, match="spheres"):
        mp.System(mp.sphere(2), energy=lambda n: n[2], work={"push": lambda n: n})
