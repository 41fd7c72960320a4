"""SciPy's DOP853, diffrax and this package on three problems: time, error, drift of H and falls of S, as a table.

Each solver takes the tolerances from 1e-4 to 1e-12, and the table has the fastest run whose error at the end is below 1e-7. Times are CPU
milliseconds of one run, the best of several; compiling is said apart. The reference is DOP853 at 1e-13 of equations by hand.

``python examples/compare.py`` prints the table, and with ``--readme`` writes it into README.md.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

import metriplectic as mp

GOAL = 1e-7
TOLERANCES = [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12]
# The comments of README.md between which the table is written.
BEGIN, END = "<!-- examples/compare.py --readme writes from here -->", "<!-- to here -->"
INERTIA = np.array([10.0, 5.0, 1.0])
SPRINGS = np.array([1.0, 0.5, 0.25])


def body():
    """A rigid body with friction: p' = p × ω + |ω|² p − (ω·p) ω."""

    def rate(_, p):
        a, b, c = p
        x, y, z = a / 10, b / 5, c
        square, dot = x * x + y * y + z * z, x * a + y * b + z * c
        return (b * z - c * y + square * a - dot * x, c * x - a * z + square * b - dot * y, a * y - b * x + square * c - dot * z)

    system = mp.System(mp.so3_dual(), energy=lambda p: 0.5 * np.sum(p * p / INERTIA), entropy=lambda p: 0.5 * p @ p)

    def jax_rate(jnp, _):
        inertia = jnp.array(INERTIA)

        def f(t, p, args):
            w = p / inertia
            return jnp.cross(p, w) + (w @ w) * p - w * (w @ p)

        return f

    return "rigid body with friction, n = 3", system, rate, jax_rate, np.array([0.001, -1.0, 0.001]), 100.0


def spin():
    """A spin on the sphere: n' = n × dH."""
    system = mp.System(mp.sphere(2), energy=lambda n: 0.5 * np.sum(SPRINGS * n * n), poisson="area")

    def jax_rate(jnp, sign):
        springs = jnp.array(SPRINGS)
        return lambda t, n, args: sign * jnp.cross(n, springs * n)

    start = np.ones(3) / np.sqrt(3.0)
    # The sign of the area form is that of the package.
    early = system.run(start, t=0.01, tol=1e-10).y[-1] - start
    sign = float(np.sign(early @ np.cross(start, SPRINGS * start)))

    def rate(_, n):
        a, b, c = n
        return (sign * (0.25 - 0.5) * b * c, sign * (1.0 - 0.25) * a * c, sign * (0.5 - 1.0) * a * b)

    return "spin on the sphere S²", system, rate, lambda jnp, jax: jax_rate(jnp, sign), start, 20.0


def chain(sites=8):
    """A ring of masses on springs with heat: (q, p, s) of each site, whose friction is that of the metric."""
    n = 3 * sites
    poisson = np.zeros((n, n))
    for k in range(sites):
        poisson[3 * k, 3 * k + 1], poisson[3 * k + 1, 3 * k] = 1.0, -1.0

    def energy_of(np):
        def energy(x):
            q, p, s = x.reshape(sites, 3).T
            r = np.roll(q, -1) - q
            springs = 0.5 * r**2 + r**3 / 12.0 + 0.25 * r**4 - 0.01 * r * (s + np.roll(s, -1))
            return np.sum(0.5 * p**2 + 2.0 * np.exp(s / 2.0)) + np.sum(springs)

        return energy

    def slope(x):
        q, p, s = x.reshape(sites, 3).T
        r, both = np.roll(q, -1) - q, s + np.roll(s, -1)
        force = r + r**2 / 4 + r**3 - 0.01 * both
        return np.stack([np.roll(force, 1) - force, p, np.exp(s / 2) - 0.01 * (r + np.roll(r, 1))], 1).ravel()

    heat = np.tile([0.0, 0.0, 1.0], sites)

    def rate(_, x):
        g = slope(x)
        return poisson @ g + 1e-3 * ((g @ g) * heat - g * (g @ heat))

    system = mp.System(mp.R(n), energy=energy_of(np), entropy=lambda x: np.sum(x[2::3]), poisson=poisson, friction=1e-3)

    def jax_rate(jnp, jax):
        energy, pj, hj = jax.grad(energy_of(jnp)), jnp.array(poisson), jnp.array(heat)

        def f(t, x, args):
            g = energy(x)
            return pj @ g + 1e-3 * ((g @ g) * hj - g * (g @ hj))

        return f

    start = np.array([[np.sin(k) * 0.3, np.cos(k) * 0.5, 0.1 * (k / 3)][k % 3] for k in range(n)])
    return f"ring of masses with heat, n = {n}", system, rate, jax_rate, start, 10.0


def best(f, tries=3):
    """The least CPU time of several calls, in milliseconds, and the result."""
    least, result = np.inf, None
    for _ in range(tries):
        begin = time.process_time()
        result = f()
        least = min(least, time.process_time() - begin)
    return 1e3 * least, result


def fastest(solve, exact):
    """The fastest run that reaches the goal: its time, its error and its states."""
    found = None
    for tol in TOLERANCES:
        took, (t, y) = best(lambda: solve(tol))
        error = float(np.abs(y[-1] - exact).max())
        if error < GOAL and (found is None or took < found[0]):
            found = took, error, y, len(t) - 1
        if found is not None and took > 3 * found[0]:
            break
    return found


def diffrax_solver(jax_rate, start, end):
    """Runs of diffrax at a tolerance, and the CPU seconds that each of them took to compile; None where it is not installed."""
    try:
        import diffrax
        import jax
    except ImportError:
        return None, []
    jax.config.update("jax_enable_x64", True)
    field, compiled, compiling = jax_rate(jax.numpy, jax), {}, []

    def solve(tol):
        if tol not in compiled:
            controller = diffrax.PIDController(rtol=tol, atol=1e-2 * tol)
            compiled[tol] = jax.jit(lambda x: diffrax.diffeqsolve(
                diffrax.ODETerm(field), diffrax.Dopri8(), 0.0, end, 0.01, x, saveat=diffrax.SaveAt(steps=True, t0=True),
                stepsize_controller=controller, max_steps=8192,
            ))
            begin = time.process_time()
            jax.block_until_ready(compiled[tol](jax.numpy.array(start)).ys)
            compiling.append(time.process_time() - begin)
        run = jax.block_until_ready(compiled[tol](jax.numpy.array(start)))
        count = int(run.stats["num_accepted_steps"]) + 1
        return np.array(run.ts)[:count], np.array(run.ys)[:count]

    return solve, compiling


def compared(problem):
    """Lines of the table for one problem, and the CPU time of each solver."""
    name, system, rate, jax_rate, start, end = problem
    exact = solve_ivp(rate, (0.0, end), start, method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
    checked, times, lines = system.verified(start), {}, [f"| **{name}** | | | | | |"]

    def add(solver, solve):
        times[solver], error, y, steps = fastest(solve, exact)
        laws = system.laws(y)
        drift = np.abs(laws[:, 0] - laws[0, 0]).max()
        has_entropy = system._definition.entropy is not None
        falls = int((np.diff(laws[:, 1]) < 0).sum()) if has_entropy else "–"
        lines.append(f"| {solver} | {times[solver]:.2f} | {steps} | {error:.1e} | {drift:.1e} | {falls} |")

    def ours(tol):
        run = checked.run(start, t=end, tol=tol, method="dp8")
        return run.t, run.y

    def scipy(tol):
        run = solve_ivp(rate, (0.0, end), start, method="DOP853", rtol=tol, atol=1e-2 * tol)
        return run.t, run.y.T

    add("this package, dp8", ours)
    times["check"], _ = best(lambda: system.verify(start), tries=20)
    lines.append(f"| … its check of the model, once: {times['check']:.2f} ms | | | | | |")
    add("SciPy, DOP853", scipy)
    solve, compiling = diffrax_solver(jax_rate, start, end)
    if solve is None:
        lines.append("| diffrax is not installed | | | | | |")
    else:
        add("diffrax, Dopri8", solve)
        lines.append(f"| … compiling it: {min(compiling):.1f} s of CPU | | | | | |")
    return lines, times


def table():
    """The table in Markdown, and what it says of this package beside the others."""
    lines = ["| | CPU ms | steps | error at the end | drift of H | falls of S |", "|---|--:|--:|--:|--:|--:|"]
    found = []
    for problem in (body(), spin(), chain()):
        of_problem, times = compared(problem)
        lines += of_problem
        found.append(times)
    for solver in ("SciPy, DOP853", "diffrax, Dopri8"):
        if all(solver in times for times in found):
            alone = [times[solver] / times["this package, dp8"] for times in found]
            checked = [times[solver] / (times["this package, dp8"] + times["check"]) for times in found]
            # An empty line ends the table.
            lines += ([""] if solver.startswith("SciPy") else []) + [
                f"- {solver.split(',')[0]} takes {min(alone):.1f} to {max(alone):.1f} times the CPU time of a run of this package, and "
                f"{min(checked):.1f} to {max(checked):.1f} times that of a run with its check."
            ]
    return "\n".join(lines)


def write(page, text):
    """Replaces what is between the comments of a page."""
    before, rest = page.read_text(encoding="utf-8").split(BEGIN)
    page.write_text(f"{before}{BEGIN}\n{text}\n{END}{rest.split(END)[1]}", encoding="utf-8")


if __name__ == "__main__":
    print(found := table())
    if "--readme" in sys.argv[1:]:
        write(Path(__file__).parents[1] / "README.md", found)
