"""Systems that several tests use."""

import numpy as np

import metriplectic as mp

INERTIA = np.array([10.0, 5.0, 1.0])


def body() -> mp.System:
    """A rigid body whose friction turns it to its axis of the largest inertia."""
    return mp.System(mp.so3_dual(), energy=lambda p: 0.5 * np.sum(p * p / INERTIA), entropy=lambda p: 0.5 * p @ p)


def pendulum(gamma: float = 0.3, length: float = 1.0) -> mp.System:
    """A damped pendulum with the entropy of its heat at the temperature 1: x = (q, p, s), H = ½p² − cos(q)/l + s, S = s.

    The friction K = γ b bᵀ with b = (0, −w_s, w_p) gives p' = −γ p and s' = γ p²."""

    def friction(x, w, gamma):
        b = np.stack([0.0 * w[0], -w[2], w[1]])
        return gamma * np.outer(b, b)

    return mp.System(
        mp.R(3),
        energy=lambda x, length: 0.5 * x[1] ** 2 - np.cos(x[0]) / length + x[2],
        entropy=lambda x: x[2],
        poisson=np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 0]]),
        friction=friction,
        parameters={"gamma": gamma, "length": length},
    )


def ball() -> mp.System:
    """A ball under gravity: x = (height, momentum)."""
    return mp.System(mp.R(2), energy=lambda x, g: 0.5 * x[1] ** 2 + g * x[0], poisson="symplectic", parameters={"g": 1.0})


def oscillator() -> mp.System:
    """A mass on a spring whose stiffness is a parameter, pushed, in air of the temperature 0.7."""
    return mp.System(
        mp.R(2),
        energy=lambda x, k: 0.5 * (x[1] ** 2 + k * x[0] ** 2),
        poisson="symplectic",
        parameters={"k": 1.5, "rate": 0.2, "push": 0.4},
        work={"push": lambda x, t, push: np.stack([0.0 * x[0], push * np.sin(1.3 * t)])},
        baths={"air": (0.7, lambda x, w, rate: [(rate, np.array([0.0, 1.0]))])},
    )
