"""Writes hard_corpus.json: hard starts of one step of the exact scheme, each with its solution if there is one.

The equation of a step is written here from its definition, in 60 digits, and shares nothing with the
library: on an arc with base z, displacement d and ends x, x',

    d = h (P Pi P^T w_H + K(z; w_H) w_S),      w_F = dF(z) + (F(x') - F(x) - dF(z) d) g d / (d g d),

P^T a = a - w_S G*(w_S, a) / G*(w_S, w_S). The unknown is the initial displacement u of the arc.

Each start is labelled by continuation: the branch u(t) of the equation of the step of size t is
followed from u(0) = 0 to t = h by a tangent predictor and Newton's method. A start is solvable if the
branch reaches h inside the domain without a change of sign of det dF/du. It is not if it folds back,
leaves the domain, or runs to infinity before. What a solver makes of a start plays no part in its choice.

    python3 hard_corpus.py > hard_corpus.json        (mpmath; three minutes on two cores)
"""

import json
import random
import sys
from multiprocessing import Pool

from mpmath import mp, mpf, matrix, lu_solve, det, eig, exp, log, sqrt, sin, cos, power, pi

mp.dps = 60
ONE = mpf(1)


class OutOfDomain(Exception):
    """A field or an arc is not defined there."""


def dot(a, b):
    return sum(p * q for p, q in zip(a, b))


def add(a, b, s=ONE):
    return [p + s * q for p, q in zip(a, b)]


def times(a, s):
    return [p * s for p in a]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def norm(a):
    return sqrt(dot(a, a))


def positive(*numbers):
    if any(n <= 0 for n in numbers):
        raise OutOfDomain
    return numbers


def metric_dissipation(sharp, w, s):
    """K = G*(w, w) G* - (♯w)(♯w)^T, applied to s."""
    w_sharp, s_sharp = sharp(w), sharp(s)
    return add(times(s_sharp, dot(w, w_sharp)), w_sharp, -dot(w_sharp, s))


class Family:
    """A system on a flat space with a constant metric; the others override its geometry."""

    n = 3
    entropic = True

    def __init__(self, **parameters):
        self.p = {k: mpf(v) for k, v in parameters.items()}

    # Geometry: points, arcs, metric.
    def point(self, x):
        return [mpf(v) for v in x]

    def arc(self, x, u):
        """The base point z, the displacement d there, and the end."""
        return add(x, u, ONE / 2), list(u), add(x, u)

    def sharp(self, z, w):
        return list(w)

    def flat(self, z, d):
        return list(d)

    def entries(self, x):
        return list(x)

    # Dynamics.
    def bracket(self, z, s, w):
        return [mpf(0)] * self.n

    nambu = False

    def dissipation(self, z, w, s):
        return metric_dissipation(lambda a: self.sharp(z, a), w, s)

    def S(self, x):
        return mpf(0)

    def dS(self, x):
        return [mpf(0)] * self.n

    def velocity(self, z, w_h, w_s):
        alpha = w_h
        if self.entropic and not self.nambu:
            sharp = self.sharp(z, w_s)
            square = dot(sharp, w_s)
            alpha = add(w_h, w_s, -dot(sharp, w_h) / square)
            v = self.bracket(z, w_s, alpha)
            v = add(v, sharp, -dot(w_s, v) / square)
        else:
            v = self.bracket(z, w_s, alpha)
        return add(v, self.dissipation(z, w_h, w_s)) if self.entropic else v

    def at(self, x):
        return self.velocity(x, self.dH(x), self.dS(x))

    def discrete(self, f, df, x, arc):
        z, d, end = arc
        w, flat = df(z), self.flat(z, d)
        return add(w, flat, (f(end) - f(x) - dot(w, d)) / dot(flat, d))

    def displacement(self, x, u):
        """The displacement d of the arc, and the velocity along it."""
        arc = self.arc(x, u)
        w_h = self.discrete(self.H, self.dH, x, arc)
        w_s = self.discrete(self.S, self.dS, x, arc) if self.entropic else self.dS(arc[0])
        return arc[1], self.velocity(arc[0], w_h, w_s)

    def nearby(self, x, q):
        """The velocity at the coordinates q around x, for the rate."""
        return self.at(add(x, q))

    def rate(self, x):
        """The fastest rate of the motion at x: max of |eigenvalue| of dX, |dX X|/|X|, and the turning."""
        v, eps = self.nearby(x, [mpf(0)] * self.n), mpf(10) ** -25
        columns = [times(add(self.nearby(x, [eps if i == k else mpf(0) for i in range(self.n)]), v, -ONE), 1 / eps)
                   for k in range(self.n)]
        slope = matrix(self.n, self.n)
        for k, column in enumerate(columns):
            for i in range(self.n):
                slope[i, k] = column[i]
        size = max(abs(e) for e in eig(slope, left=False, right=False))
        along = [sum(slope[i, k] * v[k] for k in range(self.n)) for i in range(self.n)]
        return max(size, norm(along) / norm(v), self.turning(v))

    def turning(self, v):
        return mpf(0)


class Body(Family):
    """so(3)*: inertia (10, 5, 1), S = |p|²/2, the metric 1/√σ, so that K is σ times the canonical one."""

    inertia = [mpf(10), mpf(5), mpf(1)]

    def H(self, p):
        return sum(a * a / i for a, i in zip(p, self.inertia)) / 2

    def dH(self, p):
        return [a / i for a, i in zip(p, self.inertia)]

    def S(self, p):
        return dot(p, p) / 2

    def dS(self, p):
        return list(p)

    def bracket(self, z, s, w):
        return cross(z, w)

    def sharp(self, z, w):
        return times(w, sqrt(self.p["sigma"]))

    def flat(self, z, d):
        return times(d, 1 / sqrt(self.p["sigma"]))


class Climbing(Body):
    """so(3)* with the entropy |p|⁴, which climbs without bound along H = p₁²/2 + p₂²/4 + exp p₃ and blows up."""

    def __init__(self):
        super().__init__(sigma=1)

    def H(self, p):
        return p[0] ** 2 / 2 + p[1] ** 2 / 4 + exp(p[2])

    def dH(self, p):
        return [p[0], p[1] / 2, exp(p[2])]

    def S(self, p):
        return dot(p, p) ** 2

    def dS(self, p):
        return times(p, 4 * dot(p, p))


class Doomed(Family):
    """H = ln x + y, S = -x: the flow reaches the edge x = 0 in finite time."""

    n = 2

    def H(self, x):
        positive(x[0])
        return log(x[0]) + x[1]

    def dH(self, x):
        positive(x[0])
        return [1 / x[0], ONE]

    def S(self, x):
        return -x[0]

    def dS(self, x):
        return [-ONE, mpf(0)]


class Gas(Family):
    """Two gas containers (q, p, U₁, U₂) with a wall that moves and conducts (Shang and Öttinger 2020)."""

    n = 4

    def H(self, x):
        return x[1] ** 2 / 2 + x[2] + x[3]

    def dH(self, x):
        return [mpf(0), x[1], ONE, ONE]

    def S(self, x):
        q, _, a, b = x
        positive(q, 2 - q, a, b)
        return log(q) + log(2 - q) + (log(a) + log(b)) * 3 / 2

    def dS(self, x):
        q, _, a, b = x
        positive(q, 2 - q, a, b)
        return [1 / q - 1 / (2 - q), mpf(0), 3 / (2 * a), 3 / (2 * b)]

    def bracket(self, z, s, w):
        q, _, a, b = z
        left, right = -2 * a / (3 * q), 2 * b / (3 * (2 - q))
        return [w[1], -w[0] - left * w[2] - right * w[3], left * w[1], right * w[1]]

    def dissipation(self, z, w, s):
        b = [mpf(0), mpf(0), w[3], -w[2]]
        return times(b, self.p["alpha"] * dot(b, s))


class Exchange(Family):
    """Two bodies with energies e that exchange heat, with the entropies ln e, 2√e or e^0.3/0.3."""

    n = 2

    def H(self, e):
        return e[0] + e[1] * 2 + e[0] * e[1] / 10

    def dH(self, e):
        return [1 + e[1] / 10, 2 + e[0] / 10]

    def S(self, e):
        positive(*e)
        kind = int(self.p["kind"])
        if kind == 0:
            return log(e[0]) + 3 * log(e[1])
        if kind == 1:
            return 2 * sqrt(e[0]) + 6 * sqrt(e[1])
        return (power(e[0], mpf(0.3)) + 3 * power(e[1], mpf(0.3))) / mpf(0.3)

    def dS(self, e):
        positive(*e)
        slope = [-ONE, -ONE / 2, mpf(0.3) - 1][int(self.p["kind"])]
        return [power(e[0], slope), 3 * power(e[1], slope)]


class Sphere(Family):
    """The spinning top on S² under the area form, without an entropy; or relaxing under an entropy alone.

    Points and covectors are 3-vectors; the unknown is in an orthonormal frame at x.
    """

    n = 2
    weights = [ONE, ONE / 2, ONE / 4]

    def __init__(self, **parameters):
        super().__init__(**parameters)
        self.entropic = int(self.p["kind"]) == 1

    def point(self, x):
        x = [mpf(v) for v in x]
        return times(x, 1 / norm(x))

    def frame(self, x):
        k = min(range(3), key=lambda i: abs(x[i]))
        a = [mpf(i == k) for i in range(3)]
        a = add(a, x, -dot(a, x))
        a = times(a, 1 / norm(a))
        return [a, cross(x, a)]

    def arc(self, x, u):
        first, second = self.frame(x)
        v = add(times(first, u[0]), second, u[1])
        angle = norm(v)
        if angle >= pi:
            raise OutOfDomain
        unit = times(v, 1 / angle)
        at = lambda t: add(times(x, cos(t * angle)), unit, sin(t * angle))
        d = times(add(times(unit, cos(angle / 2)), x, -sin(angle / 2)), angle)
        return at(ONE / 2), d, at(ONE)

    def tangent(self, x, v):
        return add(v, x, -dot(x, v))

    def H(self, x):
        return sum(w * (a ** 2 + a ** 3 * 2 / 3) for a, w in zip(x, self.weights)) / 2

    def dH(self, x):
        return self.tangent(x, [w * (a + a ** 2) for a, w in zip(x, self.weights)])

    def S(self, x):
        return x[2] + x[0] * x[1] * 3 / 10

    def dS(self, x):
        return self.tangent(x, [x[1] * 3 / 10, x[0] * 3 / 10, ONE])

    def velocity(self, z, w_h, w_s):
        if not self.entropic:
            return cross(z, w_h)
        return self.dissipation(z, w_h, w_s)

    def displacement(self, x, u):
        """In the frame carried from x to z along the arc, in which a displacement keeps its components."""
        d, v = super().displacement(x, u)
        z = self.arc(x, u)[0]
        angle = norm(u)
        along = times(d, 1 / angle)
        across = cross(z, along)
        unit = [u[0] / angle, u[1] / angle]
        back = lambda a: [dot(a, along) * unit[0] - dot(a, across) * unit[1],
                          dot(a, along) * unit[1] + dot(a, across) * unit[0]]
        return back(d), back(v)

    def nearby(self, x, q):
        first, second = self.frame(x)
        y = add(add(x, first, q[0]), second, q[1])
        v = self.at(times(y, 1 / norm(y)))
        return [dot(v, first), dot(v, second)]

    def turning(self, v):
        return norm(v)


class Rotation(Family):
    """SO(3), bi-invariant metric, Nambu bracket; points are matrices by rows, vectors are body vectors."""

    nambu = True

    def point(self, x):
        # The rounded matrix, orthonormalised by rows.
        a, b = [mpf(v) for v in x[:3]], [mpf(v) for v in x[3:6]]
        a = times(a, 1 / norm(a))
        b = add(b, a, -dot(a, b))
        b = times(b, 1 / norm(b))
        return a + b + cross(a, b)

    def turned(self, r, u):
        angle = norm(u)
        if angle == 0:
            return list(r)
        a = times(u, 1 / angle)
        s, c = sin(angle), 1 - cos(angle)
        hat = [[mpf(0), -a[2], a[1]], [a[2], mpf(0), -a[0]], [-a[1], a[0], mpf(0)]]
        turn = [[(i == j) + s * hat[i][j] + c * sum(hat[i][k] * hat[k][j] for k in range(3)) for j in range(3)]
                for i in range(3)]
        return [sum(r[3 * i + k] * turn[k][j] for k in range(3)) for i in range(3) for j in range(3)]

    def arc(self, x, u):
        if norm(u) >= pi:
            raise OutOfDomain
        return self.turned(x, times(u, ONE / 2)), list(u), self.turned(x, u)

    def body(self, r, slope):
        """The body covector of a function with the matrix `slope` of partial derivatives."""
        m = [[sum(r[3 * k + i] * slope[3 * k + j] for k in range(3)) for j in range(3)] for i in range(3)]
        return [m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]]

    def H(self, r):
        return r[0] + r[4] * 2 + r[8] * 3 + r[1] * r[5] / 2

    def dH(self, r):
        return self.body(r, [ONE, r[5] / 2, mpf(0), mpf(0), mpf(2), r[1] / 2, mpf(0), mpf(0), mpf(3)])

    def S(self, r):
        return r[2] - r[3] / 2 + (r[6] + r[7]) ** 2 / 4

    def dS(self, r):
        b = (r[6] + r[7]) / 2
        return self.body(r, [mpf(0), mpf(0), ONE, -ONE / 2, mpf(0), mpf(0), b, b, mpf(0)])

    def bracket(self, z, s, w):
        return cross(s, w)

    def nearby(self, x, q):
        return self.at(self.turned(x, q))

    def turning(self, v):
        return norm(v)


class Anisotropic(Family):
    """R³ with a constant metric of condition 10^k in a turned frame, Nambu bracket, nothing quadratic."""

    nambu = True
    frame = [[mpf(2) / 3, mpf(1) / 3, mpf(2) / 3], [-mpf(2) / 3, mpf(2) / 3, mpf(1) / 3], [mpf(1) / 3, mpf(2) / 3, -mpf(2) / 3]]

    def __init__(self, **parameters):
        super().__init__(**parameters)
        c = self.p["condition"]
        # As the other side forms it: in double precision, from the same numbers.
        self.g = [[mpf(float(self.entry(float(c), i, j))) for j in range(3)] for i in range(3)]
        m = matrix(self.g)
        self.inverse = m ** -1
        self.volume = sqrt(det(m))

    @staticmethod
    def entry(c, i, j):
        thirds = [[2, 1, 2], [-2, 2, 1], [1, 2, -2]]
        eigen = [1.0, c ** -0.5, 1.0 / c]
        return sum(thirds[k][i] * thirds[k][j] * eigen[k] for k in range(3)) / 9.0

    def sharp(self, z, w):
        return [sum(self.inverse[i, j] * w[j] for j in range(3)) for i in range(3)]

    def flat(self, z, d):
        return [sum(self.g[i][j] * d[j] for j in range(3)) for i in range(3)]

    def H(self, x):
        return sum(a ** 2 / 2 + a ** 4 / 4 for a in x) + x[0] * x[1] / 3

    def dH(self, x):
        return [x[0] + x[0] ** 3 + x[1] / 3, x[1] + x[1] ** 3 + x[0] / 3, x[2] + x[2] ** 3]

    def S(self, x):
        return x[2] + x[0] ** 2 / 2 - exp(x[1]) / 4

    def dS(self, x):
        return [x[0], -exp(x[1]) / 4, ONE]

    def bracket(self, z, s, w):
        return times(cross(s, w), 1 / self.volume)


class Degenerate(Family):
    """R² with the metric diag(f(a)², 1), f = δ + a², which nearly degenerates at a = 0."""

    n = 2

    def f(self, a):
        return self.p["delta"] + a * a

    def length(self, a):
        return self.p["delta"] * a + a ** 3 / 3

    def inverse_length(self, s, a):
        """The root a of length(a) = s: increasing, and convex on either side of 0."""
        for _ in range(500):
            step = (self.length(a) - s) / self.f(a)
            a -= step
            if abs(step) <= mpf(10) ** -57 * abs(a) + mpf(10) ** -200:
                return a
        raise OutOfDomain

    def arc(self, x, u):
        speed, start = self.f(x[0]) * u[0], self.length(x[0])
        # Newton's method converges from the far side of the root.
        far = lambda t: self.inverse_length(start + t * speed, self.beyond(start + t * speed))
        middle, end = far(ONE / 2), far(ONE)
        return [middle, x[1] + u[1] / 2], [speed / self.f(middle), u[1]], [end, x[1] + u[1]]

    def beyond(self, s):
        size = min(abs(s) / self.p["delta"], mp.cbrt(3 * abs(s)))
        return size if s > 0 else -size

    def sharp(self, z, w):
        return [w[0] / self.f(z[0]) ** 2, w[1]]

    def flat(self, z, d):
        return [d[0] * self.f(z[0]) ** 2, d[1]]

    def H(self, x):
        return x[0] ** 2 / 2 + x[1] ** 2 + x[0] * x[1] * 3 / 10

    def dH(self, x):
        return [x[0] + x[1] * 3 / 10, 2 * x[1] + x[0] * 3 / 10]

    def S(self, x):
        return x[0] - x[1] / 2 + x[0] * x[1] ** 2 / 4

    def dS(self, x):
        return [1 + x[1] ** 2 / 4, -ONE / 2 + x[0] * x[1] / 2]


class Oscillator(Family):
    """A damped oscillator (q, p, s) with the bath's energy e^s; K = (γ/w_s) b bᵀ, b = (0, w_s, -w_p)."""

    def H(self, x):
        return (x[0] ** 2 + x[1] ** 2) / 2 + exp(x[2])

    def dH(self, x):
        return [x[0], x[1], exp(x[2])]

    def S(self, x):
        return x[2]

    def dS(self, x):
        return [mpf(0), mpf(0), ONE]

    def bracket(self, z, s, w):
        return [w[1], -w[0], mpf(0)]

    def dissipation(self, z, w, s):
        b = [mpf(0), w[2], -w[1]]
        return times(b, self.p["gamma"] / w[2] * dot(b, s))


FAMILIES = {
    "stiff body": Body, "body near rest": Body, "climbing body": Climbing, "doomed logarithm": Doomed, "gas containers": Gas, "heat exchange": Exchange, "sphere": Sphere,
    "rotation": Rotation, "anisotropic metric": Anisotropic, "degenerate metric": Degenerate, "oscillator": Oscillator,
}
COUNT = 22
# A sensible step is this by the fastest rate of the motion.
SENSIBLE = 0.3


def starts():
    """COUNT starts of each family: the step goes from 1 to 100 times the sensible one, which is h · rate = SENSIBLE."""
    draw = random.Random(2024)
    for name in FAMILIES:
        for k in range(COUNT):
            tameness = SENSIBLE * 10 ** (2 * k / (COUNT - 1))
            yield dict(family=name, tameness=tameness, **start(name, k, draw))


def start(name, k, draw):
    gauss = lambda n: [draw.gauss(0, 1) for _ in range(n)]
    unit = lambda v: [a / sum(b * b for b in v) ** 0.5 for a in v]
    if name == "stiff body":
        # Every other step is measured by the rotation alone, and the friction is far faster than that.
        x = [a * 10 ** draw.uniform(-1, 1) for a in unit(gauss(3))]
        return dict(parameters=dict(sigma=10.0 ** (2 * (k % 4))), x=x, slow=k % 8 in (1, 3, 6))
    if name == "body near rest":
        axis = k % 3
        off = 10.0 ** -draw.uniform(1, 12)
        x = [float(i == axis) + off * a for i, a in enumerate(gauss(3))]
        return dict(parameters=dict(sigma=[1.0, 100.0][k % 2]), x=x)
    if name == "climbing body":
        return dict(parameters={}, x=[a * 10 ** draw.uniform(-0.5, 0.5) for a in unit(gauss(3))])
    if name == "doomed logarithm":
        return dict(parameters={}, x=[10.0 ** -draw.uniform(-1, 4), draw.gauss(0, 1)])
    if name == "gas containers":
        near = lambda: 10.0 ** -draw.uniform(0, 5)
        q = [near() * 0.9, 2.0 - near() * 0.9, draw.uniform(0.3, 1.7)][k % 3]
        energies = [2.0, 2.0] if k % 3 != 2 else [near(), 2.0]
        return dict(parameters=dict(alpha=[1e-3, 0.5, 50.0, 0.0][k % 4]), x=[q, draw.gauss(0, 2)] + energies)
    if name == "heat exchange":
        cold = 10.0 ** -draw.uniform(0, 8)
        x = [cold, draw.uniform(0.5, 2)] if k % 2 else [draw.uniform(0.5, 2), cold]
        return dict(parameters=dict(kind=float(k % 3)), x=x)
    if name == "sphere":
        return dict(parameters=dict(kind=float(k % 2)), x=unit(gauss(3)))
    if name == "rotation":
        a, b = unit(gauss(3)), gauss(3)
        inner = sum(p * q for p, q in zip(a, b))
        b = unit([q - inner * p for p, q in zip(a, b)])
        r = Rotation().point(a + b + [0, 0, 0])
        return dict(parameters={}, x=[float(v) for v in r])
    if name == "anisotropic metric":
        return dict(parameters=dict(condition=10.0 ** draw.uniform(6, 12)), x=gauss(3))
    if name == "degenerate metric":
        a = draw.choice([-1, 1]) * 10.0 ** -draw.uniform(0, 3)
        return dict(parameters=dict(delta=10.0 ** -draw.uniform(0.5, 3)), x=[a, draw.gauss(0, 1)])
    if name == "oscillator":
        return dict(parameters=dict(gamma=[0.01, 1.0, 100.0][k % 3]), x=[draw.gauss(0, 2), draw.gauss(0, 2), draw.uniform(-5, 1)])
    raise ValueError(name)


class Branch:
    """The solutions u(t) of the equation of a step of size t from one point."""

    def __init__(self, family, x):
        self.family, self.x = family, x

    def residual(self, u, t):
        d, v = self.family.displacement(self.x, u)
        return add(d, v, -t), v

    def jacobian(self, u, t, residual):
        n, size = self.family.n, norm(u) * mpf(10) ** -14
        slope = matrix(n, n)
        for k in range(n):
            moved = [a + (size if i == k else 0) for i, a in enumerate(u)]
            column = times(add(self.residual(moved, t)[0], residual, -ONE), 1 / size)
            for i in range(n):
                slope[i, k] = column[i]
        return slope

    def correct(self, u, t, allowed):
        """Newton's method from a predicted point; None if its corrections are not small against `allowed`."""
        for sweep in range(12):
            residual, v = self.residual(u, t)
            slope = self.jacobian(u, t, residual)
            try:
                step = list(lu_solve(slope, matrix(residual)))
            except ZeroDivisionError:
                return None
            size = norm(step)
            if not size <= allowed:
                return None
            u = add(u, step, -ONE)
            if size <= mpf(10) ** -30 * norm(u):
                return u, slope, v
            allowed = max(size / 2, mpf(10) ** -31 * norm(u))
        return None

    def follow(self, h):
        """The solution at h; or why there is none, and where the branch ends."""
        rate = self.family.rate(self.x)
        t, here = min(mpf(h), mpf(10) ** -4 / rate), None
        while here is None and t > mpf(10) ** -12 * h:
            t /= 16
            u = times(self.family.nearby(self.x, [mpf(0)] * self.family.n), t)
            here = self.correct(u, t, norm(u) / 10)
        sign, step, count, outside = mp.sign(det(here[1])), t, 0, False
        while t < h:
            u, slope, v = here
            count += 1
            if step < mpf(10) ** -9 * t or count > 20000:
                return None, ("domain" if outside else "fold", float(t / h))
            tangent = list(lu_solve(slope, matrix(v)))
            step = min(step, h - t)
            ahead, outside = None, False
            try:
                moved = times(tangent, step)
                # The predictor may not bend by more than a tenth of its own length.
                ahead = self.correct(add(u, moved), t + step, norm(moved) / 10)
            except (OutOfDomain, ZeroDivisionError):
                outside = True
            if ahead is None or mp.sign(det(ahead[1])) != sign:
                step /= 2
                continue
            here, t = ahead, (h if h - t <= step else t + step)
            step *= 2
        return here, (None, 1.0)


def label(case):
    family = FAMILIES[case["family"]](**case["parameters"])
    x = family.point(case["x"])
    slow = Body(sigma=1).rate(x) if case.get("slow") else family.rate(x)
    h = float(case["tameness"] / slow)
    here, (why, reached) = Branch(family, x).follow(mpf(h))
    record = dict(family=case["family"], **case["parameters"], x=case["x"], h=h,
                  tameness=float("%.4g" % (h * family.rate(x))),
                  solvable=here is not None)
    if here is None:
        record.update(ends_by=why, ends_at=float("%.4g" % reached))
    else:
        u, slope, _ = here
        end = family.entries(family.arc(x, u)[2])
        record.update(end=[float(v) for v in end])
    print(case["family"], "%.3g" % case["tameness"], why, "%.3g" % reached, file=sys.stderr, flush=True)
    return record


if __name__ == "__main__":
    only = sys.argv[1:]
    cases = [c for c in starts() if not only or c["family"] in only]
    with Pool(2) as pool:
        records = pool.map(label, cases, chunksize=1)
    print("[\n" + ",\n".join(json.dumps(r) for r in records) + "\n]")
