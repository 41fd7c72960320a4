"""Writes fput.json: some positions at the end of a long run of the chain of Fermi, Pasta, Ulam and Tsingou.

32 masses between fixed ends, H = sum p^2/2 + r^2/2 + r^3/12 with the extensions r of 33 springs, start from rest at
q_i = sin(pi i/33). The solution is its Taylor series of order 26 in steps of 1/4, in numbers of 80 bits (numpy's
longdouble), and shares nothing with the library. Steps of 1/5 give the same 12 digits.
"""

import json
import math

import numpy as np

MASSES, ALPHA, END, STEP, ORDER = 32, 0.25, 10_000.0, 0.25, 26
SITES = [1, 2, 8, 16, 24, 31, 32]
real = np.longdouble


def coefficients(q, p):
    """The Taylor coefficients of positions and momenta."""
    positions, momenta = (np.zeros((ORDER + 1, MASSES + 2), dtype=real) for _ in "qp")
    springs = np.zeros((ORDER + 1, MASSES + 1), dtype=real)
    positions[0], momenta[0] = q, p
    for k in range(ORDER):
        springs[k] = positions[k, 1:] - positions[k, :-1]
        square = sum(springs[j] * springs[k - j] for j in range(k + 1))
        force = springs[k] + real(ALPHA) * square
        momenta[k + 1, 1:-1] = (force[1:] - force[:-1]) / (k + 1)
        positions[k + 1, 1:-1] = momenta[k, 1:-1] / (k + 1)
    return positions, momenta


def summed(series, h):
    total = series[ORDER]
    for term in series[ORDER - 1 :: -1]:
        total = total * h + term
    return total


def run(step):
    q = np.array([math.sin(math.pi * i / (MASSES + 1)) for i in range(MASSES + 2)], dtype=real)
    q[-1] = 0
    p = np.zeros_like(q)
    for _ in range(round(END / step)):
        q, p = (summed(series, real(step)) for series in coefficients(q, p))
    return q


if __name__ == "__main__":
    q = run(STEP)
    positions = [[i, round(float(q[i]), 12)] for i in SITES]
    case = {"source": "fput.py", "masses": MASSES, "alpha": ALPHA, "end": END, "positions": positions}
    with open("fput.json", "w") as file:
        json.dump(case, file, indent=2)
        file.write("\n")
