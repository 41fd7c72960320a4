"""Writes logarithms.json: points of S^n and of SO(3) in double precision, and their logarithms in 25 digits.

On S^n the exact logarithm is that of the points as they are rounded, each divided by its norm,

    v = theta (y - cos(theta) x) / sin(theta),      cos(theta) = x.y,

in the frame of the library at x: the columns 1 - a a^T / (1 + |x_n|), a = x +- e_n, of the reflection that
takes the last axis to -+x, all but the last, the first one turned so that det[x, E] = 1. On SO(3) it is the
vector theta u of the exact rotation exp(theta u^), whose matrix

    cos(theta) + sin(theta) u^ + (1 - cos(theta)) u u^T

is rounded entry by entry. No formula of the library that could lose a digit is used here: every number has
60 digits.

    python3 logarithms.py > logarithms.json        (mpmath; a second)
    python3 logarithms.py 40                       (forty points for each angle, for a survey)
"""

import json
import random
import sys

from mpmath import mp, mpf, acos, cos, fabs, nstr, pi, sin, sqrt

mp.dps = 60

NEAR = [mpf(10) ** -k for k in (15, 12, 9, 6, 4, 2)]
MIDDLE = [mpf(k) / 10 for k in (3, 7, 10, 14, 15, 17, 20, 25, 29)]
FAR = [pi - mpf(10) ** -k for k in (1, 2, 3, 4, 6, 8, 10)]


def dot(a, b):
    return sum(p * q for p, q in zip(a, b))


def unit(a):
    norm = sqrt(dot(a, a))
    return [p / norm for p in a]


def rounded(a):
    return [float(p) for p in a]


def exact(a):
    """As text, which every reader rounds to the same number."""
    return [repr(p) for p in a]


def digits(a):
    return [nstr(p, 25) for p in a]


def direction(rng, size):
    return unit([mpf(rng.gauss(0, 1)) for _ in range(size)])


def frame(x):
    """The columns of E(x), for a unit vector x."""
    n = len(x) - 1
    sign = 1 if x[n] >= 0 else -1
    a = list(x)
    a[n] += sign
    scale = 1 / (1 + fabs(x[n]))
    columns = []
    for j in range(n):
        column = [(1 if i == j else 0) - scale * a[i] * a[j] for i in range(n + 1)]
        columns.append(column)
    oriented = sign if n % 2 == 0 else -sign
    columns[0] = [oriented * entry for entry in columns[0]]
    return columns


def on_a_sphere(rng, n, theta):
    x = rounded(direction(rng, n + 1))
    start = unit([mpf(p) for p in x])
    tangent = direction(rng, n + 1)
    tangent = unit([t - dot(tangent, start) * p for t, p in zip(tangent, start)])
    y = rounded([cos(theta) * p + sin(theta) * t for p, t in zip(start, tangent)])
    end = unit([mpf(p) for p in y])
    cosine = dot(start, end)
    angle = acos(cosine)
    v = [angle * (q - cosine * p) / sin(angle) for p, q in zip(start, end)]
    log = [dot(column, v) for column in frame(start)]
    gap = nstr(pi - angle, 25)
    return {"x": exact(x), "y": exact(y), "angle": nstr(angle, 25), "gap": gap, "log": digits(log)}


def on_the_rotations(axis, theta):
    u = unit([mpf(p) for p in axis])
    cross = [[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]]
    entry = lambda i, j: (
        (cos(theta) if i == j else 0) + sin(theta) * cross[i][j] + 2 * sin(theta / 2) ** 2 * u[i] * u[j]
    )
    rows = [float(entry(i, j)) for i in range(3) for j in range(3)]
    return {"rows": exact(rows), "log": digits([theta * p for p in u])}


def main():
    rng = random.Random(2401)
    many = int(sys.argv[1]) if len(sys.argv) > 1 else 2
    angles = NEAR + MIDDLE + FAR
    spheres = {
        str(n): [on_a_sphere(rng, n, theta) for theta in angles for _ in range(many)]
        for n in (1, 2, 3, 5, 7)
    }
    # One axis for each pivot of the quaternion, two between them, and a random one.
    axes = [[5, 1, -2], [-1, 4, 1], [1, -2, -6], [1, 1, 1], [0, 1, -1]]
    rotations = [
        on_the_rotations(axis, theta)
        for theta in angles
        for axis in axes + [direction(rng, 3) for _ in range(many - 1)]
    ]
    lines = [f'"{n}": [\n' + ",\n".join(map(json.dumps, cases)) + "\n]" for n, cases in spheres.items()]
    lines.append('"rotations": [\n' + ",\n".join(map(json.dumps, rotations)) + "\n]")
    print("{\n" + ",\n".join(lines) + "\n}")


if __name__ == "__main__":
    main()
