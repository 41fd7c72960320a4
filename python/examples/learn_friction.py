"""Learn the friction of a pendulum from its angle, and keep both laws in every rollout.

The friction of the true pendulum grows with its speed, γ(p) = 0.1 + 0.4 p². What is measured is the angle, with noise. A network of eight
neurons stands for γ ≥ 0 in the friction K = γ b bᵀ of the model, with b ⊥ dH, so that the energy is constant and the entropy never falls
whatever its weights are. The loss has its gradient by the discrete adjoint of each rollout; the search is L-BFGS of SciPy.

Run it from the folder ``python``: it writes ``learn_friction.png``.
"""

from __future__ import annotations

import sys

import numpy as np
from scipy.optimize import minimize

import metriplectic as mp

NEURONS = 8
STARTS = [[2.2, 0.0, 0.0], [-1.0, 1.6, 0.0]]
POISSON = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 0]])


def pendulum(rate, weights):
    """A pendulum with the entropy of its heat: x = (q, p, s), H = ½p² − cos q + s, S = s, p' = −sin q − γ p, s' = γ p²."""

    def friction(x, w, weights):
        return [(rate(x[1], weights), np.stack([0.0 * w[0], -w[2], w[1]]))]

    return mp.System(
        mp.R(3), energy=lambda x: 0.5 * x[1] ** 2 - np.cos(x[0]) + x[2], entropy=lambda x: x[2], poisson=POISSON, friction=friction,
        parameters={"weights": weights},
    )


def true_rate(p, weights):
    return weights[0] + weights[1] * p * p


def network(p, weights):
    """γ(p) = ln(1 + exp(a·tanh(b p + c) + d)), which is positive."""
    a, b, c = weights[:NEURONS], weights[NEURONS : 2 * NEURONS], weights[2 * NEURONS : 3 * NEURONS]
    return np.log1p(np.exp(np.sum(a * np.tanh(b * p + c)) + weights[3 * NEURONS]))


def learn(iterations=60, seed=0):
    """Returns the true and the learnt system, the data, and the losses."""
    rng, times = np.random.default_rng(seed), np.linspace(0.3, 6.0, 20)
    truth = pendulum(true_rate, [0.1, 0.4])
    data = [truth.run(x, t=6.0, tol=1e-9, at=times).y[1:, 0] + 0.005 * rng.standard_normal(20) for x in STARTS]
    weights = 0.5 * rng.standard_normal(3 * NEURONS + 1)
    weights[-1] = -1.0
    model, losses = pendulum(network, weights), []

    def loss(theta):
        member, value, slope = model(weights=theta), 1e-5 * theta @ theta, 2e-5 * theta
        for start, angles in zip(STARTS, data):
            one, _, along = member.gradient(
                lambda y, angles=angles: np.sum((y[1:, 0] - angles) ** 2), start, t=6.0, h=0.1, at=times, method="dp5"
            )
            value, slope = value + one, slope + along["weights"]
        losses.append(value)
        return value, slope

    found = minimize(loss, weights, jac=True, method="L-BFGS-B", options={"maxiter": iterations})
    return truth, model(weights=found.x), (times, data), losses


def draw(truth, learnt, measured, losses, path):
    from matplotlib.figure import Figure

    times, data = measured
    figure = Figure(figsize=(10, 6.5), layout="constrained")
    (rollout, rates), (energy, entropy) = figure.subplots(2, 2)
    runs = [(system.run(STARTS[0], t=20.0, tol=1e-9, every=0.05), name) for system, name in ((truth, "true"), (learnt, "learnt"))]
    for (run, name), style in zip(runs, ("-", "--")):
        rollout.plot(run.t, run.y[:, 0], style, label=name)
        energy.plot(run.t, run.energy - run.energy[0], style, label=name)
        entropy.plot(run.t, run.entropy, style, label=name)
    rollout.plot(times, data[0], "k.", markersize=4, label="measured")
    rollout.set(ylabel="angle", xlabel="t")
    rollout.legend()
    energy.set(ylabel="$H - H_0$", xlabel="t")
    entropy.set(ylabel="$S$", xlabel="t")
    p = np.linspace(-2.0, 2.0, 200)
    rates.plot(p, true_rate(p, truth.parameters["weights"]), label="true")
    rates.plot(p, [network(x, learnt.parameters["weights"]) for x in p], "--", label="learnt")
    rates.set(xlabel="momentum", ylabel=r"$\gamma$")
    figure.suptitle(f"loss {losses[0]:.3f} → {min(losses):.5f}")
    figure.savefig(path)


if __name__ == "__main__":
    parts = learn(int(sys.argv[1]) if len(sys.argv) > 1 else 60)
    print(f"loss {parts[3][0]:.4f} -> {min(parts[3]):.6f} after {len(parts[3])} gradients")
    run = parts[1].run(STARTS[0], t=20.0, tol=1e-9)
    print(run.certificate)
    draw(*parts, "learn_friction.png")
    print("the picture is learn_friction.png")
