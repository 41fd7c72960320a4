"""The tracer, with or without the compiled extension, and the slopes of a recording by complex steps."""

from __future__ import annotations

import cmath
import importlib.util
import pathlib
import sys
from typing import Any

import numpy as np

FOLDER = pathlib.Path(__file__).resolve().parents[1]


def _load() -> tuple[Any, Any]:
    try:
        from metriplectic import _metriplectic, _trace
    except ImportError:  # The tracer needs no extension: it is loaded as a package of its own.
        file = FOLDER / "metriplectic" / "_trace" / "__init__.py"
        spec = importlib.util.spec_from_file_location("_trace", file, submodule_search_locations=[str(file.parent)])
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules["_trace"] = module
        spec.loader.exec_module(module)
        return module, None
    return _trace, _metriplectic


tracing, extension = _load()
Op = tracing.Op


def _chosen(op: Any, a: complex, b: complex) -> complex:
    is_second = b.real < a.real if op == Op.MIN else b.real > a.real
    return b if is_second else a


def _power(a: complex, b: complex) -> complex:
    if a == 0:
        return 1.0 if b == 0 else 0.0 if b.real > 0 else complex("nan")
    return a**b


_FUNCTIONS = {
    Op.SQRT: cmath.sqrt, Op.EXP: cmath.exp, Op.LN: cmath.log, Op.SIN: cmath.sin, Op.COS: cmath.cos, Op.TAN: cmath.tan, Op.ASIN: cmath.asin,
    Op.ACOS: cmath.acos, Op.ATAN: cmath.atan, Op.SINH: cmath.sinh, Op.COSH: cmath.cosh, Op.TANH: cmath.tanh, Op.ASINH: cmath.asinh,
    Op.ACOSH: cmath.acosh, Op.ATANH: cmath.atanh, Op.NEGATION: lambda a: -a, Op.RECIP: lambda a: 1 / a,
    Op.CBRT: lambda a: a / abs(a.real) * abs(a.real) ** (1 / 3) * (1 + (a.imag / a.real) * -2j / 3),
    Op.EXP_M1: lambda a: complex(np.expm1(a)), Op.LN_1P: lambda a: complex(np.log1p(a)),
    Op.ABS: lambda a: a if a.real >= 0 else -a, Op.SIGN: lambda a: complex(np.copysign(1.0, a.real)),
    Op.LOGICAL_NOT: lambda a: complex(a.real == 0),
}  # fmt: skip
_PAIRS = {
    Op.ADDITION: lambda a, b: a + b, Op.SUBTRACTION: lambda a, b: a - b, Op.MULTIPLICATION: lambda a, b: a * b,
    Op.DIVISION: lambda a, b: a / b, Op.POWER: _power, Op.LESS: lambda a, b: complex(a.real < b.real),
    Op.LESS_EQUAL: lambda a, b: complex(a.real <= b.real), Op.EQUAL: lambda a, b: complex(a.real == b.real),
    Op.LOGICAL_AND: lambda a, b: complex(bool(a.real) and bool(b.real)), Op.LOGICAL_OR: lambda a, b: complex(bool(a.real) or bool(b.real)),
    Op.MIN: lambda a, b: _chosen(Op.MIN, a, b), Op.MAX: lambda a, b: _chosen(Op.MAX, a, b),
    Op.ATAN2: lambda a, b: np.arctan2(a.real, b.real) + 1j * (b.real * a.imag - a.real * b.imag) / (a.real**2 + b.real**2),
}  # fmt: skip
_CONSTANT = {
    Op.ADD_CONSTANT: lambda a, k: a + k, Op.CONSTANT_SUB: lambda a, k: k - a, Op.SCALE: lambda a, k: a * k,
    Op.DIV_CONSTANT: lambda a, k: a / k, Op.CONSTANT_DIV: lambda a, k: k / a, Op.POWI: _power, Op.POWF: _power,
}  # fmt: skip


def evaluate(program: Any, x: Any) -> list[complex]:
    """Evaluates a recording at complex numbers, with comparisons of real parts: an evaluator of its own, for slopes."""
    r = [complex(value) for value in x]
    for code, (a, b, c), k in zip(program.ops.tolist(), program.operands.tolist(), program.constants.tolist()):
        op = Op(code)
        if op == Op.LITERAL:
            r.append(complex(k))
        elif op in _FUNCTIONS:
            r.append(_FUNCTIONS[op](r[a]))
        elif op in _PAIRS:
            r.append(_PAIRS[op](r[a], r[b]))
        elif op in _CONSTANT:
            r.append(_CONSTANT[op](r[a], k))
        elif op == Op.SELECT:
            r.append(r[b] if r[a].real != 0 else r[c])
        else:
            raise AssertionError(f"the tracer makes no {op!r}")
    return [r[k] for k in program.outputs.tolist()]


def jacobian(program: Any, x: Any) -> Any:
    """The slopes (m, n) of a recording by complex steps (Squire and Trapp 1998): exact to round-off."""
    x = np.asarray(x, float)
    step = 1e-30
    columns = [[value.imag / step for value in evaluate(program, x + 1j * step * e)] for e in np.eye(len(x))]
    return np.array(columns).T


def differences(f: Any, x: Any, h: float = 2e-5) -> Any:
    """The slopes (m, n) of a function of numbers by central differences of the fourth order."""
    x = np.asarray(x, float)

    def at(step: Any) -> Any:
        return np.asarray(f((x + step).copy()), float).ravel()

    columns = [(8 * (at(h * e) - at(-h * e)) - (at(2 * h * e) - at(-2 * h * e))) / (12 * h) for e in np.eye(len(x))]
    return np.array(columns).T
