"""A recorded function as plain numbers."""

from __future__ import annotations

import math
import random
from typing import Any, Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from .operations import Op


class Program:
    """A function Rⁿ → Rᵐ as a list of k instructions: the parts of a tape.

    Registers 0 … n − 1 are the inputs, and each instruction defines the next one from registers before it.

    Attributes
    ----------
    inputs : int
        The number n of inputs.
    ops : array of uint32, shape (k,)
        The codes of the operations.
    operands : array of uint32, shape (k, 3)
        The registers that each instruction reads, and 0 where it reads less than three.
    constants : array of float64, shape (k,)
        The constant of each instruction, and 0 where it has none.
    outputs : array of uint32, shape (m,)
        The registers of the outputs.

    Notes
    -----
    Two programs are equal if all their bits are. They hold instructions as they were recorded, with those that no output needs: the tape
    that Rust makes of them is simplified there.
    """

    __slots__ = ("constants", "inputs", "operands", "ops", "outputs")

    inputs: int
    ops: NDArray[np.uint32]
    operands: NDArray[np.uint32]
    constants: NDArray[np.float64]
    outputs: NDArray[np.uint32]

    def __init__(self, inputs: int, ops: Any, operands: Any, constants: Any, outputs: Any) -> None:
        self.inputs = int(inputs)
        self.ops = _fixed(ops, np.uint32)
        self.operands = _fixed(operands, np.uint32).reshape(-1, 3)
        self.constants = _fixed(constants, np.float64)
        self.outputs = _fixed(outputs, np.uint32)

    def __repr__(self) -> str:
        return f"<Program: {self.inputs} inputs, {len(self.ops)} instructions, {len(self.outputs)} outputs>"

    def _bits(self) -> tuple[int, bytes, bytes, bytes, bytes]:
        return self.inputs, self.ops.tobytes(), self.operands.tobytes(), self.constants.tobytes(), self.outputs.tobytes()

    def __eq__(self, other: object) -> bool:
        return self._bits() == other._bits() if isinstance(other, Program) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._bits())

    def __reduce__(self) -> tuple[Any, ...]:
        return Program, (self.inputs, self.ops, self.operands, self.constants, self.outputs)

    def evaluate(self, x: Sequence[float], *, noise: random.Random | None = None) -> list[float]:
        """Evaluates the outputs at the inputs ``x``, n numbers, without NumPy.

        With ``noise``, each result is changed by a relative amount of up to two units of round-off: the spread of several evaluations
        shows how much of a result is round-off (Parker 1997, Monte Carlo arithmetic).
        """
        if len(x) != self.inputs:
            raise ValueError(f"the program has {self.inputs} inputs, and {len(x)} numbers were given")
        registers = [float(value) for value in x]
        for op, (a, b, c), k in zip(self.ops.tolist(), self.operands.tolist(), self.constants.tolist()):
            value = _EVALUATE[op](registers, a, b, c, k)
            if noise is not None and op not in _EXACT:
                value *= 1.0 + 2.0**-52 * noise.uniform(-1.0, 1.0)
            registers.append(value)
        return [registers[k] for k in self.outputs.tolist()]


def _fixed(numbers: Any, dtype: type[Any]) -> NDArray[Any]:
    array = np.array(numbers, dtype=dtype)
    array.flags.writeable = False
    return array


# Operations with the results of IEEE 754 where Python's raise exceptions.


def _guarded(f: Callable[[float], float], outside: Callable[[float], float]) -> Callable[[float], float]:
    def guarded(a: float) -> float:
        try:
            return f(a)
        except (ValueError, OverflowError):
            return outside(a)

    return guarded


def _divide(a: float, b: float) -> float:
    if b != 0.0:
        return a / b
    return math.nan if a == 0.0 or a != a else math.copysign(math.inf, a) * math.copysign(1.0, b)


def _power(a: float, b: float) -> float:
    try:
        return math.pow(a, b)
    except OverflowError:
        is_odd = b == int(b) and int(b) % 2 == 1
        return -math.inf if a < 0.0 and is_odd else math.inf
    except ValueError:
        if a != 0.0:
            return math.nan
        is_odd = b == int(b) and int(b) % 2 == 1
        return math.copysign(math.inf, a) if is_odd else math.inf


def _cube_root(a: float) -> float:
    if a == 0.0 or not math.isfinite(a):
        return a
    y = math.copysign(abs(a) ** (1.0 / 3.0), a)
    return y - (y - a / (y * y)) / 3.0


def _never(_: float) -> float:
    return math.nan


def _pole(at: float, value: float) -> Callable[[float], float]:
    return lambda a: value if a == at else math.nan


def _infinite(_: float) -> float:
    return math.inf


_UNARY: dict[Op, Callable[[float], float]] = {
    Op.NEGATION: lambda a: -a,
    Op.RECIP: lambda a: _divide(1.0, a),
    Op.SQRT: _guarded(math.sqrt, _never),
    Op.CBRT: _cube_root,
    Op.EXP: _guarded(math.exp, _infinite),
    Op.EXP_M1: _guarded(math.expm1, _infinite),
    Op.LN: _guarded(math.log, _pole(0.0, -math.inf)),
    Op.LN_1P: _guarded(math.log1p, _pole(-1.0, -math.inf)),
    Op.SIN: _guarded(math.sin, _never),
    Op.COS: _guarded(math.cos, _never),
    Op.TAN: _guarded(math.tan, _never),
    Op.ASIN: _guarded(math.asin, _never),
    Op.ACOS: _guarded(math.acos, _never),
    Op.ATAN: math.atan,
    Op.SINH: _guarded(math.sinh, lambda a: math.copysign(math.inf, a)),
    Op.COSH: _guarded(math.cosh, _infinite),
    Op.TANH: math.tanh,
    Op.ASINH: math.asinh,
    Op.ACOSH: _guarded(math.acosh, _never),
    Op.ATANH: _guarded(math.atanh, lambda a: math.copysign(math.inf, a) if abs(a) == 1.0 else math.nan),
    Op.ABS: abs,
    Op.SIGN: lambda a: math.copysign(1.0, a) if a == a else a,
    Op.LOGICAL_NOT: lambda a: float(a == 0.0),
}
_BINARY: dict[Op, Callable[[float, float], float]] = {
    Op.ADDITION: lambda a, b: a + b,
    Op.SUBTRACTION: lambda a, b: a - b,
    Op.MULTIPLICATION: lambda a, b: a * b,
    Op.DIVISION: _divide,
    Op.POWER: _power,
    Op.ATAN2: math.atan2,
    Op.MIN: lambda a, b: b if b < a else a,
    Op.MAX: lambda a, b: b if b > a else a,
    Op.LESS: lambda a, b: float(a < b),
    Op.LESS_EQUAL: lambda a, b: float(a <= b),
    Op.EQUAL: lambda a, b: float(a == b),
    Op.LOGICAL_AND: lambda a, b: float(a != 0.0 and b != 0.0),
    Op.LOGICAL_OR: lambda a, b: float(a != 0.0 or b != 0.0),
}
_Rule = Callable[[list[float], int, int, int, float], float]


def _unary(f: Callable[[float], float]) -> _Rule:
    return lambda r, a, b, c, k: f(r[a])


def _binary(f: Callable[[float, float], float]) -> _Rule:
    return lambda r, a, b, c, k: f(r[a], r[b])


_RULES: dict[Op, _Rule] = {
    Op.LITERAL: lambda r, a, b, c, k: k,
    **{op: _unary(f) for op, f in _UNARY.items()},
    **{op: _binary(f) for op, f in _BINARY.items()},
    Op.ADD_CONSTANT: lambda r, a, b, c, k: r[a] + k,
    Op.CONSTANT_SUB: lambda r, a, b, c, k: k - r[a],
    Op.SCALE: lambda r, a, b, c, k: r[a] * k,
    Op.DIV_CONSTANT: lambda r, a, b, c, k: _divide(r[a], k),
    Op.CONSTANT_DIV: lambda r, a, b, c, k: _divide(k, r[a]),
    Op.POWI: lambda r, a, b, c, k: _power(r[a], k),
    Op.POWF: lambda r, a, b, c, k: _power(r[a], k),
    Op.SELECT: lambda r, a, b, c, k: r[b] if r[a] != 0.0 else r[c],
    Op.MULTIPLY_ADD: lambda r, a, b, c, k: r[a] * r[b] + r[c],
    Op.SCALE_ADD: lambda r, a, b, c, k: r[a] * k + r[b],
}
_EVALUATE = [_RULES[op] for op in Op]
_EXACT = frozenset(
    [Op.LITERAL, Op.NEGATION, Op.ABS, Op.SIGN, Op.LOGICAL_NOT, Op.SELECT, *(op for op in Op if Op.MIN <= op <= Op.LOGICAL_OR)]
)
