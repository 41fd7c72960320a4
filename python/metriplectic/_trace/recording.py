"""A list of instructions that grows while a function runs on symbols."""

from __future__ import annotations

import math
from array import array as numbers
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import TraceError
from .operations import MOST_EXPONENT, MOST_REGISTERS, Op
from .places import place
from .program import Program

Registers = NDArray[np.int64]
"""An array of register numbers."""

_LITERAL, _SUBTRACTION = Op.LITERAL, Op.SUBTRACTION  # Members of an enumeration are slow to find.
_INPUT = 255
"""The mark of a register that is an input."""

# The operation with a constant that stands for `a op constant`, and the one for `constant op a`.
_CONSTANT_FORMS = {
    Op.ADDITION: (Op.ADD_CONSTANT, Op.ADD_CONSTANT),
    Op.SUBTRACTION: (Op.ADD_CONSTANT, Op.CONSTANT_SUB),
    Op.MULTIPLICATION: (Op.SCALE, Op.SCALE),
    Op.DIVISION: (Op.DIV_CONSTANT, Op.CONSTANT_DIV),
}
_FEW = 64
"""The number of constants beyond which an array of them is not looked up among those that are there."""

_BLOCK = 128
"""The longest sum that is formed term by term; longer ones are sums of such sums, as in NumPy, for the sake of round-off."""


class Recording:
    """The instructions of one call of a function.

    Constants are registers too; arithmetic with a constant becomes the operation that holds it. Equal
    instructions, operations on constants alone and dead code are left to the simplification of tapes in Rust.

    Parameters
    ----------
    name : str
        The name of the function in messages.
    inputs : int
        The number of inputs.
    """

    __slots__ = ("_constants", "_literals", "_operands", "_ops", "converted", "inputs", "name", "refused")

    def __init__(self, name: str, inputs: int) -> None:
        if inputs > MOST_REGISTERS:
            raise TraceError(f"{name} has {inputs} inputs, and a recording has at most {MOST_REGISTERS} registers")
        self.name, self.inputs = name, inputs
        self._ops = numbers("B", bytes([_INPUT]) * inputs)
        self._operands = numbers("I", bytes(12 * inputs))
        self._constants = numbers("d", bytes(8 * inputs))
        self._literals: dict[Any, int] = {}
        self.refused: str | None = None
        """The first refusal, which a user's `except` must not hide."""
        self.converted: str | None = None
        """The line where NumPy made an array of objects from symbols."""

    def refusal(self, reason: str, remedy: str) -> Exception:
        """Returns the exception for what cannot be recorded, and keeps its message until the call ends."""
        where, line = place()
        return self.refusal_at(reason, remedy, where, line)

    def refusal_at(self, reason: str, remedy: str, where: str, line: str) -> Exception:
        """Returns the exception for what cannot be recorded on a known line."""
        text = f"{where}: `{line}`" if line else where
        message = f"{self.name} cannot be recorded: {reason}\n  {text}\n  remedy: {remedy}"
        if self.refused is None:
            self.refused = message
        return TraceError(message)

    # Single instructions.

    def put(self, op: int, a: int = 0, b: int = 0, c: int = 0, k: float = 0.0) -> int:
        """Adds an instruction and returns its register."""
        register = len(self._ops)
        self._check_room(1)
        self._ops.append(op)
        self._operands.extend((a, b, c))
        self._constants.append(k)
        return register

    def constant(self, value: float) -> int:
        """Returns the register of a constant."""
        key: Any = value
        if value == 0.0:
            key = "0" if math.copysign(1.0, value) > 0.0 else "-0"
        elif value != value:
            key = "nan"
        register = self._literals.get(key)
        if register is None:
            register = self.put(Op.LITERAL, k=value)
            self._literals[key] = register
        return register

    def arithmetic_of_two(self, op: Op, a: int, b: int) -> int:
        """Adds a sum, difference, product or quotient of two registers."""
        right, left = _CONSTANT_FORMS[op]
        if self._ops[b] == _LITERAL:
            value = self._constants[b]
            return self.put(right, a, k=-value if op is _SUBTRACTION else value)
        if self._ops[a] == _LITERAL:
            return self.put(left, b, k=self._constants[a])
        return self.put(op, a, b)

    def power_of_one(self, a: int, exponent: float) -> int:
        """Adds a power of a register, with a constant exponent: a square root for 1/2, ``Op.POWI`` for a small integer."""
        if exponent == 0.5:
            return self.put(Op.SQRT, a)
        # Adding 0 makes 0 of −0, which is no integer for a tape.
        is_small_integer = abs(exponent) <= MOST_EXPONENT and exponent.is_integer()
        return self.put(Op.POWI if is_small_integer else Op.POWF, a, k=exponent + 0.0)

    # Many instructions at once, on arrays of registers that broadcast.

    def put_all(self, op: Any, a: Registers, b: Any = 0, c: Any = 0, k: Any = 0.0) -> Registers:
        """Adds an instruction for each entry of operands that broadcast, and returns their registers in this shape.

        ``op`` and ``k`` are numbers, or arrays that broadcast to it.
        """
        shape = np.broadcast(a, b, c).shape
        first, count = len(self._ops), math.prod(shape)
        self._check_room(count)
        operands = np.empty((*shape, 3), np.uint32)
        operands[..., 0], operands[..., 1], operands[..., 2] = a, b, c
        self._ops.frombytes(np.broadcast_to(np.asarray(op, np.uint8), shape).tobytes())
        self._operands.frombytes(operands.tobytes())
        self._constants.frombytes(np.broadcast_to(np.asarray(k, np.float64), shape).tobytes())
        return np.arange(first, first + count).reshape(shape)

    def constants(self, values: Any) -> Registers:
        """Returns the registers of an array of constants, in its shape."""
        array = np.asarray(values, np.float64)
        if array.size == 1:
            return np.full(array.shape, self.constant(float(array.reshape(-1)[0])))
        bits, places = np.unique(np.ascontiguousarray(array).view(np.int64).ravel(), return_inverse=True)
        values = bits.view(np.float64)
        if values.size > _FEW:
            registers = self.put_all(Op.LITERAL, np.zeros(values.shape, np.int64), k=values)
        else:
            registers = np.array([self.constant(value) for value in values.tolist()], np.int64)
        result = np.empty_like(array, np.int64)  # in the order of the array in memory
        result[...] = registers[places.reshape(-1)].reshape(array.shape)
        return result

    def known(self, registers: Registers) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
        """Returns which registers are constants, and their values (0 for the others)."""
        is_known: NDArray[np.bool_] = np.frombuffer(self._ops, np.uint8)[registers] == Op.LITERAL
        values = np.frombuffer(self._constants, np.float64)[registers]
        return is_known, np.where(is_known, values, 0.0)

    def arithmetic(self, op: Op, a: Registers, b: Registers) -> Registers:
        """Adds sums, differences, products or quotients entry by entry."""
        a, b = np.broadcast_arrays(a, b)
        self._check_room(a.size)
        is_a, value_a = self.known(a)
        is_b, value_b = self.known(b)
        if not (is_a.any() or is_b.any()):
            return self.put_all(op, a, b)
        right, left = _CONSTANT_FORMS[op]
        is_a &= ~is_b
        ops = np.where(is_b, right, np.where(is_a, left, op))
        k = np.where(is_b, -value_b if op is Op.SUBTRACTION else value_b, value_a)
        return self.put_all(ops, np.where(is_a, b, a), np.where(is_a | is_b, 0, b), k=k)

    def power(self, a: Registers, b: Registers) -> Registers:
        """Adds powers entry by entry, as ``power_of_one`` where the exponent is a constant."""
        a, b = np.broadcast_arrays(a, b)
        is_known, k = self.known(b)
        is_root = is_known & (k == 0.5)
        is_small_integer = is_known & (np.abs(k) <= MOST_EXPONENT) & (k == np.round(k))
        ops = np.select([is_root, is_small_integer, is_known], [Op.SQRT, Op.POWI, Op.POWF], Op.POWER)
        return self.put_all(ops, a, np.where(is_known, 0, b), k=np.where(is_root, 0.0, k + 0.0))

    def total(self, op: Op, terms: Registers, neutral: float, keep: NDArray[np.bool_] | None = None) -> Registers:
        """Adds the sums or products over the last axis.

        Parameters
        ----------
        op : Op
            ``ADDITION``, ``MULTIPLICATION``, ``LOGICAL_AND`` or ``LOGICAL_OR``.
        terms : array of registers, shape (..., n)
        neutral : float
            The result without terms.
        keep : array of bool, shape (..., n), optional
            The terms that count.
        """
        *shape, n = terms.shape
        if n > _BLOCK:
            blocks = -(-n // _BLOCK)
            padding = [(0, 0)] * len(shape) + [(0, blocks * _BLOCK - n)]
            is_kept = np.ones(terms.shape, np.bool_) if keep is None else keep
            terms = np.pad(terms, padding).reshape(*shape, blocks, _BLOCK)
            is_kept = np.pad(is_kept, padding).reshape(terms.shape)
            return self.total(op, self.total(op, terms, neutral, is_kept), neutral, np.asarray(is_kept.any(axis=-1)))
        result = np.zeros(math.prod(shape), np.int64)
        if keep is None:
            rows, counts = terms.ravel(), np.full(result.shape, n)
        else:
            rows, counts = terms[keep], np.count_nonzero(keep, axis=-1).ravel()
        has_terms = counts > 0
        if not has_terms.all():
            result[:] = self.constant(neutral)
        ends = np.cumsum(counts)[has_terms]
        if ends.size:
            is_first = np.zeros(rows.shape, np.bool_)
            is_first[ends - counts[has_terms]] = True
            result[has_terms] = self._running(op, rows, is_first)[ends - 1]
        return result.reshape(shape)

    def running(self, op: Op, terms: Registers) -> Registers:
        """Adds the running sums or products over the last axis, shape (..., n)."""
        if not terms.size:
            return terms
        is_first = np.zeros(terms.shape, np.bool_)
        is_first[..., 0] = True
        return self._running(op, terms.ravel(), is_first.ravel()).reshape(terms.shape)

    def _running(self, op: Op, terms: Registers, is_first: NDArray[np.bool_]) -> Registers:
        """Adds running sums of rows that stand one after another: `result[k] = result[k − 1] op terms[k]` within a row."""
        new = np.cumsum(~is_first) - 1
        registers = np.where(is_first, terms, len(self._ops) + new)
        later = np.flatnonzero(~is_first)
        self.put_all(op, registers[later - 1], terms[later])
        return registers

    def contraction(self, a: Registers, b: Registers) -> Registers:
        """Adds the sums of products over the last axis, `Σ_k a[..., k] b[..., k]`.

        A term with a factor that is the constant 0 is left out, so that a product with a sparse matrix of numbers costs as much as its
        entries. It differs from NumPy's only where the other factor is infinite or not a number.
        """
        a, b = np.broadcast_arrays(a, b)
        self._check_room(a.size)
        (is_a, value_a), (is_b, value_b) = self.known(a), self.known(b)
        is_zero = (is_a & (value_a == 0.0) & np.isfinite(value_b)) | (is_b & (value_b == 0.0) & np.isfinite(value_a))
        keep = ~is_zero
        products = np.zeros(a.shape, np.int64)
        products[keep] = self.arithmetic(Op.MULTIPLICATION, a[keep], b[keep])
        return self.total(Op.ADDITION, products, 0.0, keep)

    def program(self, outputs: Registers) -> Program:
        """Returns the recording with these outputs."""
        n = self.inputs
        return Program(
            n,
            np.frombuffer(self._ops, np.uint8)[n:],
            np.frombuffer(self._operands, np.uint32).reshape(-1, 3)[n:],
            np.frombuffer(self._constants, np.float64)[n:],
            outputs.ravel(),
        )

    def _check_room(self, count: int) -> None:
        if len(self._ops) + count > MOST_REGISTERS:
            raise self.refusal(
                f"it has more than {MOST_REGISTERS} registers, inputs and instructions together",
                "record a part of it, or write it with fewer operations",
            )
