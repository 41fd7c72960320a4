"""Idioms of NumPy: each works, with the value and the slopes of NumPy's own function, or is refused with line, reason and remedy.

The page IDIOMS.md is this table. `BLESS=1` writes it anew.
"""

from __future__ import annotations

import inspect
import itertools
import math
import os
from typing import Any, Callable

import numpy as np
import pytest
from tracer import FOLDER, differences, extension, jacobian, tracing

K = np.arange(36.0).reshape(6, 6) / 10
K = K + K.T
MASK = np.array([True, True, True, False, False, False])
POINTS = [
    np.array([0.3, -1.2, 0.7, 0.52, 0.2, -0.4]),
    np.array([0.81, 0.37, -0.55, -0.23, 0.64, 0.92]),
    np.array([0.46, -0.71, 0.13, 1.7, -0.86, 0.29]),
]
WORKS: dict[str, Callable[..., Any]] = {}
REFUSED: dict[str, tuple[Callable[..., Any], str, str]] = {}


def works(name: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    def enter(f: Callable[..., Any]) -> Callable[..., Any]:
        WORKS[name] = f
        return f

    return enter


def refused(name: str, reason: str, remedy: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    def enter(f: Callable[..., Any]) -> Callable[..., Any]:
        REFUSED[name] = f, reason, remedy
        return f

    return enter


# What works. The line that shows in the page is the last one of each function.
WORKS |= {
    "quadratic form": lambda p: 0.5 * p @ K @ p,
    "np.dot": lambda p: np.dot(p, K @ p),
    "np.einsum": lambda p: np.einsum("i,ij,j->", p, K, p),
    "sum of a generator": lambda p: sum(pi**2 for pi in p),
    "np.linalg.norm": lambda p: np.linalg.norm(p),
    "norms along an axis": lambda p: np.linalg.norm(p.reshape(2, 3), axis=1).sum(),
    "np.cross": lambda p: np.cross(p[:3], p[3:]) @ np.array([1.0, 2, 3]),
    "np.where": lambda p: np.where(p > 0, p**2, -p).sum(),
    "np.maximum and np.clip": lambda p: np.maximum(p, 0).sum() + np.clip(p, -0.5, 0.5).sum(),
    "abs(p), p.sum()": lambda p: abs(p).sum(),
    "2**p and p**0.5": lambda p: (2**p).sum() + p[0] ** 0.5,
    "np.exp and np.tanh": lambda p: np.exp(-(p**2)).sum() + np.tanh(p[0]),
    "np.log, np.arctan2, np.hypot": lambda p: np.log(p[0]) + np.arctan2(p[1], p[2]) + np.hypot(p[3], p[4]),
    "np.logaddexp": lambda p: np.logaddexp(p[0], p[1]),
    "np.linalg.solve": lambda p: p[:3] @ np.linalg.solve(np.eye(3) + np.outer(p[:3], p[:3]), p[3:]),
    "np.linalg.det": lambda p: np.linalg.det(np.eye(2) + np.outer(p[:2], p[:2])),
    "np.linalg.inv and np.trace": lambda p: np.trace(np.linalg.inv(np.eye(2) + np.outer(p[:2], p[:2]))),
    "np.roll, np.diff": lambda p: np.sum((np.roll(p, 1) - p) ** 2) + np.sum(np.diff(p) ** 2),
    "np.concatenate": lambda p: (np.concatenate([p, p[:2], [1.0, 2.0]]) ** 2).sum(),
    "np.stack, p.prod()": lambda p: np.stack([p[:3], p[3:]]).sum(axis=0).prod(),
    "a, b, c = p[:3]": lambda p: (lambda a, b, c: a * b + c)(*p[:3]),
    "p[[0, 2]], p[-1], p[::2]": lambda p: p[[0, 2]].sum() + p[-1] * p[::2].sum(),
    "a mask of numbers": lambda p: (p[MASK] ** 2).sum(),
    "np.mean": lambda p: np.mean((p - np.mean(p)) ** 2),
    "np.var": lambda p: np.var(p),
    "np.std": lambda p: np.std(p),
    "np.max": lambda p: np.max(p),
    "np.array([p0, p1])": lambda p: np.sin(np.array([p[0], p[1]])).sum(),
    "np.array of rows": lambda p: np.array([[p[0], 1.0], [0.0, p[1]]]) @ p[2:4] @ p[4:],
    "metriplectic.array": lambda p: (tracing.array([[p[0], 1.0], [0.0, p[1]]]) ** 3).sum(),
    "np.kron": lambda p: (np.kron(p[:2], p[:3]) ** 2).sum(),
    "np.polyval": lambda p: np.polyval([1.0, 2, 3], p[0]),
    "np.average": lambda p: np.average(p**2),
    "p.sum() / p.size": lambda p: p.sum() / p.size,
    "np.power, np.square": lambda p: np.power(p, 2).sum() + np.square(p[0]),
    "np.cumsum": lambda p: np.cumsum(p)[-1] * np.cumsum(p)[2],
    "p.max()": lambda p: p.max(),
    "p.min(axis=0)": lambda p: p.reshape(2, 3).min(axis=0).sum(),
    "enumerate": lambda p: sum(k * v for k, v in enumerate(p)),
    "zip": lambda p: sum(a * b for a, b in zip(p[:3], p[3:])),
    "itertools.combinations": lambda p: sum((a - b) ** 2 for a, b in itertools.combinations(p, 2)),
    "np.vstack, .ravel()": lambda p: np.vstack([p[:3], p[3:]]).ravel() @ K[0],
    "np.tensordot": lambda p: np.tensordot(p, K, axes=1) @ p,
    "np.split": lambda p: np.split(p, 2)[0] @ np.split(p, 2)[1],
    "np.vectorize": lambda p: np.vectorize(lambda v: v * v)(p).sum(),
    "p.T @ p, p.dot(p)": lambda p: p.T @ p + p.dot(p),
    "np.triu": lambda p: np.triu(np.outer(p, p)).sum(),
    "a float32 number": lambda p: (np.float32(2) * p).sum(),
    "an array of integers": lambda p: (np.arange(6) * p).sum(),
    "(p > 0) & (p < 1)": lambda p: np.where((p > 0) & (p < 1), p, 0).sum(),
    "np.asarray(p)": lambda p: np.asarray(p) @ K[1] * p[0],
}


@works("a loop with s = 0; s += ..")
def loop(p: Any) -> Any:
    s = 0
    for i in range(len(p) - 1):
        s += (p[i + 1] - p[i]) ** 2 / 2
    return s


@works("for v in p: s += v * v")
def plain(p: Any) -> Any:
    s = 0.0
    for v in p:
        s += v * v
    return s


@works("q = p.copy(); q[0] = ..; q[1:] += ..")
def changed_copy(p: Any) -> Any:
    q = p.copy()
    q[0] = q[0] * 2
    q[1:] += 1.0
    return q @ q


@works("np.zeros_like(p), then entries")
def zeros_like(p: Any) -> Any:
    y = np.zeros_like(p)
    y[0] = p[0]
    y[1:3] = p[3:5] ** 2
    return y @ y


@works("np.zeros(shape, like=p), then entries")
def zeros_like_of_another_shape(p: Any) -> Any:
    a = np.zeros((2, 2), like=p)
    a[0, 1], a[1, 0] = p[0], -p[0]
    return p[1:3] @ a @ p[3:5]


@works("p = p * 1.0; p *= 2")
def in_place(p: Any) -> Any:
    p = p * 1.0
    p *= 2
    return p @ p


@works("q[q < 0] = 0")
def assigned_where(p: Any) -> Any:
    q = p * 2.0
    q[q < 0] = 0
    return q @ K @ q


@works("A[i, j] in loops")
def entries(p: Any) -> Any:
    a, s = np.outer(p, p), 0.0
    for i in range(6):
        for j in range(i):
            s += a[i, j] * K[i, j]
    return s


@works("a distance of two bodies")
def distance(p: Any) -> Any:
    r = p.reshape(2, 3)
    d = r[0] - r[1]
    return 1 / np.sqrt(np.sum(d**2))


@works("Lennard-Jones in loops")
def lennard_jones(p: Any) -> Any:
    r, e = p.reshape(3, 2), 0
    for i in range(3):
        for j in range(i):
            d2 = np.sum((r[i] - r[j]) ** 2)
            e += d2**-6 - d2**-3
    return e


@works("distances by broadcasting")
def broadcast(p: Any) -> Any:
    r = p.reshape(3, 2)
    i, j = np.triu_indices(3, 1)
    return np.exp(-np.sum((r[:, None, :] - r[None, :, :]) ** 2, axis=-1))[i, j].sum()


@works("f'{p[0]}'")
def printed(p: Any) -> Any:
    f"{p[0]:.3f} {p}"
    return p[0] * 2


@works("try: .. except: ..")
def tried(p: Any) -> Any:
    try:
        return p.sum() ** 2
    except ValueError:
        return p[0]


BRANCH = "a branch depends on the state, and one recording holds for all states"
NUMBER = "a number is asked of the state, which has none while it is recorded"
WRITING = "start from np.zeros_like(x) or np.zeros(shape, like=x), or build it with np.stack([..]) or metriplectic.array([..])"
WHERE = "write np.where(condition, a, b); or np.maximum, np.minimum, np.clip, np.abs"
INVARIANTS = "write the function by invariants of the matrix, such as traces and determinants"
GENERAL = "write it with arithmetic, sums, np.where and the other functions of metriplectic.supported()"
FLOAT = "leave float(..), int(..) and .item() out, and use NumPy's functions"
NO_ORDER = "write the function without an order of the entries"
REFUSED |= {
    "x if p[0] > 0 else y": (lambda p: p[0] if p[0] > 0 else p[1], BRANCH, WHERE),
    "max(p[0], p[1])": (lambda p: max(p[0], p[1]), BRANCH, "write np.maximum(a, b) or np.minimum(a, b) for max and min"),
    "sorted(p)": (lambda p: sorted(p)[0], BRANCH, NO_ORDER),
    "np.any(p < 0) as a guard": (lambda p: p[0] if np.any(p < 0) else p[1], BRANCH, WHERE),
    "np.isclose as a guard": (lambda p: p[0] if np.isclose(p[1], 0) else p[1], "np.isclose is not recorded", WHERE),
    "math.exp": (lambda p: math.exp(p[0]), NUMBER, "write np.exp for math.exp"),
    "math.atan2": (lambda p: math.atan2(p[0], p[1]), NUMBER, "write np.arctan2 for math.atan2"),
    "float(p[0])": (lambda p: float(p[0]) ** 2, NUMBER, FLOAT),
    "np.float64(p[0])": (lambda p: np.float64(p[0]), NUMBER, FLOAT),
    "p.tolist()": (lambda p: p.tolist()[0], NUMBER, FLOAT),
    "p[int(p[0])]": (lambda p: p[int(p[0])], NUMBER, FLOAT),
    "range(p[0])": (
        lambda p: [p[1] for _ in range(p[0])][0],
        "an index or a range depends on the state", "use np.where, or a sum over all entries with weights",
    ),
    "p[p > 0]": (
        lambda p: p[p > 0].sum(),
        "an index depends on the state", "use np.where, or a sum over all entries with weights",
    ),
    "1j * p": (
        lambda p: (1j * p[0]).imag,
        "a complex number meets the state", "write the real and the imaginary part as two real numbers",
    ),
    "np.array(.., dtype=float)": (
        lambda p: np.array([p[0], 1.0], dtype=float).sum(),
        "an array of the type float64 cannot hold symbols", "leave `dtype` out, or write metriplectic.array([..]) or np.stack([..])",
    ),
    "np.linalg.eigvalsh": (lambda p: np.linalg.eigvalsh(np.outer(p, p)).sum(), "np.linalg.eigvalsh is not recorded", INVARIANTS),
    "np.linalg.eigh": (lambda p: np.linalg.eigh(np.outer(p, p))[0].sum(), "np.linalg.eigh is not recorded", INVARIANTS),
    "np.linalg.cholesky": (lambda p: np.linalg.cholesky(np.eye(6) + np.outer(p, p))[0, 0], "np.linalg.cholesky is not recorded", GENERAL),
    "np.interp": (
        lambda p: np.interp(p[0], [0, 1], [0, 1]),
        "np.interp is not recorded", "write np.where(x < b, a0 + a1 * x, ..) for the pieces, or fit a polynomial",
    ),
    "np.gradient": (
        lambda p: np.gradient(p).sum(),
        "np.gradient is not recorded", "write the differences by slices: (x[2:] - x[:-2]) / (2 * dx)",
    ),
    "np.convolve": (
        lambda p: np.convolve(p, [1.0, -1.0]).sum(),
        "np.convolve is not recorded", "write the sum by slices, or as a product with a matrix",
    ),
    "np.fft.fft": (
        lambda p: np.fft.fft(p).real.sum(),
        "np.fft.fft is not recorded", "write the transform as a product with matrices of cosines and sines",
    ),
    "np.sort": (lambda p: np.sort(p)[0], "np.sort is not recorded", NO_ORDER),
    "np.sinc": (lambda p: np.sinc(p[0]), "np.sinc is not recorded", "write np.sin(x) / x, with np.where and a series near 0"),
    "np.apply_along_axis": (
        lambda p: np.apply_along_axis(np.sum, 0, p),
        "np.apply_along_axis is not recorded", "call the function on slices, and np.stack the results",
    ),
    "p[0] // 0.1": (lambda p: p[0] // 0.1, "np.floor_divide is not recorded", "write x / y: a quotient without a remainder has no slope"),
    "scipy.special.erf": (
        lambda p: pytest.importorskip("scipy.special").erf(p[0]),
        "erf is not recorded", "write it by functions that are recorded: np.exp, np.tanh, or a rational approximation",
    ),
}  # fmt: skip


@refused("while p[0] > 5", BRANCH, "write a loop with a fixed number of rounds, and np.where for what depends on the state")
def halved(p: Any) -> Any:
    s = p[0]
    while s > 5:
        s = s / 2
    return s


@refused("assert p[0] > 0", BRANCH, "leave the assertion out: a recorded function cannot check the state")
def asserted(p: Any) -> Any:
    assert p[0] > 0
    return p[0]


@refused("y = np.zeros(3); y[0] = p[0]", "an array of numbers cannot hold a part of the state", WRITING)
def written(p: Any) -> Any:
    y = np.zeros(3)
    y[0] = p[0]
    return y @ y


@refused("s = np.zeros(6); s += p", "np.add writes a part of the state into an array of numbers", WRITING)
def added(p: Any) -> Any:
    s = np.zeros(6)
    s += p
    return s @ s


@refused("p *= 2 on the argument", "the function writes into its argument, or into a read-only view", "work on a copy: y = x.copy()")
def changed(p: Any) -> Any:
    p *= 2
    return p @ p


@refused("a branch under try: .. except: ..", BRANCH, WHERE)
def hidden(p: Any) -> Any:
    try:
        return p[0] if p[0] > 0 else p[1]
    except Exception:  # noqa: BLE001
        return p[2]


@pytest.mark.parametrize("name", WORKS)
def test_an_idiom_has_the_value_and_the_slopes_of_numpy(name: str) -> None:
    f = WORKS[name]
    program = tracing.trace(f, [(6,)], (), name)
    tracing.check(program, f, [(6,)], POINTS, name)
    for x in POINTS:
        want = float(f(x.copy()))
        assert program.evaluate(x.tolist())[0] == pytest.approx(want, rel=1e-13, abs=1e-14)
        slopes = differences(f, x)
        size = 1.0 + abs(want) + np.abs(slopes).max()
        np.testing.assert_allclose(jacobian(program, x), slopes, atol=1e-9 * size, rtol=1e-7)
        if extension is not None:
            value, slope = extension.gradient(program, x)
            assert value == pytest.approx(want, rel=1e-13, abs=1e-14)
            np.testing.assert_allclose(slope, jacobian(program, x)[0], rtol=1e-12, atol=1e-14 * size)


@pytest.mark.parametrize("name", REFUSED)
def test_a_refusal_says_the_line_the_reason_and_the_remedy(name: str) -> None:
    f, reason, remedy = REFUSED[name]
    with pytest.raises(tracing.TraceError) as caught:
        tracing.trace(f, [(6,)], (), "energy")
    message = str(caught.value)
    lines, first = inspect.getsourcelines(f)
    place = next(line for line in message.splitlines() if line.startswith("  test_idioms.py:"))
    number = int(place.split(":")[1])
    text = inspect.getsource(inspect.getmodule(f)).splitlines()[number - 1].strip()  # type: ignore[arg-type]
    assert first <= number < first + len(lines)
    assert message == f"energy cannot be recorded: {reason}\n  test_idioms.py:{number}: `{text}`\n  remedy: {remedy}"


def _source(f: Callable[..., Any]) -> list[str]:
    """The text of an idiom: that behind `lambda p:`, or the body of a function."""
    lines = inspect.getsourcelines(f)[0]
    if f.__name__ == "<lambda>":
        return [lines[0].split("lambda p: ", 1)[1].strip().rstrip(",")]
    return [line.rstrip().removeprefix("    ") for line in lines if not line.startswith(("@", "def "))]


def page() -> str:
    rows = ["# Idioms of NumPy", "", __doc__.splitlines()[0].replace("Idioms of NumPy: each", "Each"), ""]
    rows += ["## What works", "", "| idiom | example |", "|---|---|"]
    short = {name: f for name, f in WORKS.items() if f.__name__ == "<lambda>"}
    rows += [f"| {_cell(name)} | `{_source(f)[0]}` |" for name, f in short.items()]
    for name, f in WORKS.items():
        if name not in short:
            rows += ["", f"{_cell(name)}:", "", "```python", *_source(f), "```"]
    rows += ["", "## What is refused", "", "| idiom | reason | remedy |", "|---|---|---|"]
    rows += [f"| {_cell(name)} | {_cell(reason)} | {_cell(remedy)} |" for name, (_, reason, remedy) in REFUSED.items()]
    rows += ["", "## Functions of NumPy that are recorded", "", ", ".join(f"`{name}`" for name in tracing.supported()) + "."]
    return "\n".join(rows) + "\n"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("*", "\\*").replace("_", "\\_")


def test_the_page_is_this_table() -> None:
    file = FOLDER / "IDIOMS.md"
    if "BLESS" in os.environ:
        file.write_text(page(), encoding="utf-8")
    if np.lib.NumpyVersion(np.__version__) >= "2.4.0":  # Earlier ones have fewer functions.
        assert file.read_text(encoding="utf-8") == page(), "BLESS=1 pytest tests/test_idioms.py writes the page anew"
