"""The same problems by SciPy's DOP853, by diffrax's Dopri8, and by a Gonzalez step written in JAX.

    python3 -m venv venv && venv/bin/pip install scipy jax diffrax
    venv/bin/python peers.py

prints the table of docs/peers.md. Evaluations are of the right-hand side; for the Gonzalez step they
are Newton sweeps, each with the residual and its Jacobian. Compilation is not in the times: every
run is repeated, and the second counts. The exact solutions come from

    cargo run --release --bin reference
"""

import math
import time

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import DOP853

jax.config.update("jax_enable_x64", True)

INERTIA = (10.0, 5.0, 1.0)
WEIGHTS = (1.0, 0.5, 0.25)
EPSILON = np.finfo(float).eps


class RelaxingBody:
    """p' = p x w + w x (p x w), w = p/I; S = |p|^2/2."""

    name = "relaxing rigid body, so(3)*"
    start = (0.001, -1.0, 0.001)
    exact = {}

    @staticmethod
    def velocity(p, xp):
        w = p / xp.asarray(INERTIA)
        gyration = xp.cross(p, w)
        return gyration + xp.cross(w, gyration)

    @staticmethod
    def energy(p, xp):
        return 0.5 * xp.sum(p * p / xp.asarray(INERTIA), axis=-1)

    @staticmethod
    def entropy(p, xp):
        return 0.5 * xp.sum(p * p, axis=-1)

    @staticmethod
    def entropy_scale(p):
        return np.sum(p * p, axis=-1)

    @staticmethod
    def discrete(z, w):
        """Pi(z) w + K_w dS(z)"""
        return jnp.cross(z, w) + jnp.cross(w, jnp.cross(z, w))


class SpinningTop:
    """x' = x x dH on the sphere, embedded in space; a Gonzalez step there keeps |x| too."""

    name = "spinning top, S²"
    start = (1 / math.sqrt(3),) * 3
    entropy = None
    exact = {}

    @staticmethod
    def velocity(x, xp):
        return xp.cross(x, xp.asarray(WEIGHTS) * x * (1 + x))

    @staticmethod
    def energy(x, xp):
        return 0.5 * xp.sum(xp.asarray(WEIGHTS) * (x**2 + 2 / 3 * x**3), axis=-1)

    @staticmethod
    def discrete(z, w):
        return jnp.cross(z, w)


class Gas:
    """Two gas containers with a moving wall between them; x = (q, p, U1, U2)."""

    start = (1.0, 2.0, 2.0, 2.0)

    def __init__(self, alpha, exact):
        self.alpha, self.exact = alpha, exact
        self.name = f"gas containers, α = {alpha}"

    def velocity(self, x, xp):
        q, p, left, right = x
        pressures = 2 / 3 * left / q, 2 / 3 * right / (2 - q)
        leak = 1.5 * self.alpha * (1 / left - 1 / right)
        force = pressures[0] - pressures[1]
        return xp.stack([p, force, -pressures[0] * p + leak, pressures[1] * p - leak])

    @staticmethod
    def energy(x, xp):
        return 0.5 * x[..., 1] ** 2 + x[..., 2] + x[..., 3]

    @staticmethod
    def entropy(x, xp):
        q, left, right = x[..., 0], x[..., 2], x[..., 3]
        return xp.log(q * (2 - q)) + 1.5 * xp.log(left * right)

    @staticmethod
    def entropy_scale(x):
        q, left, right = x[..., 0], x[..., 2], x[..., 3]
        slope = np.stack([1 / q - 1 / (2 - q), 1.5 / left, 1.5 / right])
        return np.linalg.norm(slope, axis=0) * np.linalg.norm(x, axis=-1)

    def discrete(self, z, w):
        q, left, right = z[0], z[2], z[3]
        a, b = -2 / 3 * left / q, 2 / 3 * right / (2 - q)
        flow = jnp.stack([w[1], -w[0] - a * w[2] - b * w[3], a * w[1], b * w[1]])
        ds = 1.5 * (w[3] / left - w[2] / right)
        return flow + self.alpha * ds * jnp.stack([0.0, 0.0, w[3], -w[2]])


def scipy_dop853(problem, end, tolerance):
    velocity = lambda _, x: problem.velocity(x, np)
    solver = DOP853(velocity, 0.0, np.array(problem.start), end, rtol=tolerance, atol=tolerance)
    path = [solver.y.copy()]
    while solver.status == "running":
        message = solver.step()
        if solver.status == "failed":
            raise RuntimeError(message)
        path.append(solver.y.copy())
    return np.array(path), solver.nfev


def diffrax_dopri8(problem, end, tolerance):
    term = diffrax.ODETerm(lambda _, x, __: problem.velocity(x, jnp))
    controller = diffrax.PIDController(rtol=tolerance, atol=tolerance)

    @jax.jit
    def solve(start):
        return diffrax.diffeqsolve(
            term,
            diffrax.Dopri8(),
            0.0,
            end,
            None,
            start,
            stepsize_controller=controller,
            saveat=diffrax.SaveAt(steps=True, t0=True),
            max_steps=2**13 if end < 1000 else 2**19,
        )

    start = jnp.asarray(problem.start)

    def run():
        solution = solve(start)
        count = int(solution.stats["num_accepted_steps"])
        # Thirteen new stages in a step; the fourteenth is the first of the next.
        return np.asarray(solution.ys)[: count + 1], 13 * int(solution.stats["num_steps"])

    return run


def jax_gonzalez(problem, end, h):
    count = round(end / h)
    energy = lambda x: problem.energy(x, jnp)

    def residual(x1, x0):
        z, d = 0.5 * (x0 + x1), x1 - x0
        slope = jax.grad(energy)(z)
        square = jnp.dot(d, d)
        defect = energy(x1) - energy(x0) - jnp.dot(slope, d)
        # The correction is round-off over round-off where the state hardly moves.
        w = slope + jnp.where(square > 1e-20, defect / jnp.where(square > 0, square, 1), 0.0) * d
        return d - h * problem.discrete(z, w)

    def step(x0, _):
        def sweep(state):
            x1, _, sweeps = state
            r = residual(x1, x0)
            change = jnp.linalg.solve(jax.jacfwd(residual)(x1, x0), r)
            return x1 - change, jnp.max(jnp.abs(change)), sweeps + 1

        guess = x0 + h * problem.velocity(x0, jnp)
        going = lambda state: (state[1] > 1e-14) & (state[2] < 8)
        x1, _, sweeps = jax.lax.while_loop(going, sweep, (guess, jnp.inf, 0))
        return x1, (x1, sweeps)

    scan = jax.jit(lambda x: jax.lax.scan(step, x, None, length=count)[1])
    start = jnp.asarray(problem.start)

    def run():
        path, sweeps = scan(start)
        return np.concatenate([start[None], np.asarray(path)]), int(np.sum(np.asarray(sweeps)))

    return run


def row(problem, end, method, setting, run):
    clock = time.perf_counter()
    path, evaluations = run()
    seconds = time.perf_counter() - clock
    if seconds < 60:
        clock = time.perf_counter()
        path, evaluations = run()
        seconds = time.perf_counter() - clock
    energy = problem.energy(path, np)
    cells = [
        method,
        setting,
        str(len(path) - 1),
        str(evaluations),
        f"{1e3 * seconds:.1f}",
        f"{np.linalg.norm(path[-1] - np.array(problem.exact[end])):.2e}",
        f"{np.max(np.abs(energy / energy[0] - 1)):.2e}",
    ]
    if problem.entropy is None:
        cells += ["–", "–", f"{np.max(np.abs(np.linalg.norm(path, axis=1) - 1)):.2e}"]
    else:
        entropy = problem.entropy(path, np)
        rise = np.diff(entropy)
        scale = np.maximum(np.abs(entropy), 1) + problem.entropy_scale(path)
        falls = np.sum(rise < -4 * EPSILON * scale[:-1])
        cells += [f"{np.min(rise):.2e}", str(falls), "–"]
    print("| " + " | ".join(cells) + " |", flush=True)


def main():
    header = "method|setting|steps|evaluations|ms|error at T|energy error|least ΔS|falls of S"
    header = header.split("|") + ["\\|\\|x\\| − 1\\|"]
    problems = [RelaxingBody(), SpinningTop(), Gas(1e-3, GAS)]
    for end in [100.0, 1e4]:
        for problem in problems:
            print(f"\n### {problem.name}, T = {end:.0f}\n")
            print("| " + " | ".join(header) + " |")
            print("|" + "---|" * len(header))
            for tolerance in [1e-4, 1e-8, 1e-12]:
                run = lambda: scipy_dop853(problem, end, tolerance)
                row(problem, end, "SciPy DOP853", f"{tolerance:.0e}", run)
            for tolerance in [1e-4, 1e-8, 1e-12]:
                run = diffrax_dopri8(problem, end, tolerance)
                row(problem, end, "diffrax Dopri8", f"{tolerance:.0e}", run)
            for h in [0.2, 0.05, 0.0125]:
                row(problem, end, "JAX, Gonzalez", f"h = {h}", jax_gonzalez(problem, end, h))


RelaxingBody.exact = {
    100.0: (-1.414216390141319, 0.0012205904773756496, -4.7088671655431455e-5),
    1e4: (-1.414217451455044, 0.0, 0.0),
}
SpinningTop.exact = {
    100.0: (0.6307233497566689, 0.29721296122758833, 0.7168350659322233),
    1e4: (0.3647875270665311, 0.8802276392986509, 0.3035281916254391),
}
GAS = {
    100.0: (0.29173678584677315, 0.08855629771482633, 4.585008421079186, 1.4110704699883356),
    1e4: (0.6973729072447762, 0.5432617894867133, 3.5269593970337265, 2.3254739170081202),
}

if __name__ == "__main__":
    main()
