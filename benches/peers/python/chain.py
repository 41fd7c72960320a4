"""The chain of `benches/peers/src/chain.rs` by SciPy's DOP853, with a right-hand side in NumPy.

    python3 -m venv venv && venv/bin/pip install scipy
    venv/bin/python chain.py

prints rows of docs/peers.md. The error is relative to a run at the tolerance 1e-13.
"""

import time

import numpy as np
from scipy.integrate import DOP853

SITES, END = 1000, 20.0
EPSILON = np.finfo(float).eps


def start():
    phase = 2 * np.pi * (np.arange(SITES) % 40) / 40
    q = 0.3 * np.sin(phase)
    p = 0.4 * np.cos(3 * phase) + 0.1 * np.sin(7 * phase)
    return np.concatenate([q, p, 0.2 * np.sin(2 * phase)])


def velocity(_, x):
    q, p, s = x.reshape(3, SITES)
    r, heat = np.roll(q, -1) - q, s + np.roll(s, -1)
    force = r * (1 + r * (0.25 + r)) - 0.025 * heat
    t = np.exp(0.5 * s) - 0.025 * (r + np.roll(r, 1))
    u = np.roll(t, -1)
    slip, flux = 0.5 * (np.roll(p, -1) - p), 0.1 * (u - t)
    push = force + 0.2 * slip
    heat = 0.2 * slip * slip
    ds = (heat + flux) / t + np.roll((heat - flux) / u, 1)
    return np.concatenate([p, push - np.roll(push, 1), ds])


def energy(x):
    q, p, s = x.reshape(3, SITES)
    r, heat = np.roll(q, -1) - q, s + np.roll(s, -1)
    bond = r * r * (r * r * 0.25 + r * (0.25 / 3) + 0.5) - r * heat * 0.025
    return np.sum(0.5 * p * p + 2 * np.exp(0.5 * s)) + np.sum(bond)


def run(tolerance):
    solver = DOP853(velocity, 0.0, start(), END, rtol=tolerance, atol=tolerance)
    states = [solver.y.copy()]
    clock = time.process_time()
    while solver.status == "running":
        solver.step()
        states.append(solver.y.copy())
    return states, solver.nfev, time.process_time() - clock


def main():
    exact = run(1e-13)[0][-1]
    print("| setting | evaluations | ms | error at T | energy error | falls of S |")
    for exponent in [4, 7, 10]:
        states, evaluations, seconds = run(10.0**-exponent)
        energies = np.array([energy(x) for x in states])
        entropies = np.array([x[2 * SITES :].sum() for x in states])
        sizes = np.array([np.abs(x[2 * SITES :]).sum() for x in states])
        off = np.max(np.abs(energies / energies[0] - 1))
        falls = np.sum(np.diff(entropies) < -4 * EPSILON * sizes[1:])
        error = np.max(np.abs(states[-1] - exact))
        print(f"| 1e-{exponent:02} | {evaluations} | {1e3 * seconds:.0f} | {error:.2e} | {off:.2e} | {falls} |")


if __name__ == "__main__":
    main()
