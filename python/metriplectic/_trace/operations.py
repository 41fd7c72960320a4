"""The operations of a tape, with the codes that they have in Rust."""

from __future__ import annotations

from enum import IntEnum

MOST_REGISTERS = 1 << 24
"""The largest number of registers of a tape, inputs and instructions together."""

MOST_EXPONENT = 1024
"""The largest exponent of ``Op.POWI``, with either sign."""


class Op(IntEnum):
    """An operation on registers a, b, c and a constant k. A comparison gives 1 or 0; a condition holds where it is not 0."""

    LITERAL = 0
    NEGATION = 1
    RECIP = 2
    SQRT = 3
    CBRT = 4
    EXP = 5
    EXP_M1 = 6
    LN = 7
    LN_1P = 8
    SIN = 9
    COS = 10
    TAN = 11
    ASIN = 12
    ACOS = 13
    ATAN = 14
    SINH = 15
    COSH = 16
    TANH = 17
    ASINH = 18
    ACOSH = 19
    ATANH = 20
    ABS = 21
    SIGN = 22
    LOGICAL_NOT = 23
    ADDITION = 24
    SUBTRACTION = 25
    MULTIPLICATION = 26
    DIVISION = 27
    POWER = 28
    ATAN2 = 29
    MIN = 30
    MAX = 31
    LESS = 32
    LESS_EQUAL = 33
    EQUAL = 34
    LOGICAL_AND = 35
    LOGICAL_OR = 36
    ADD_CONSTANT = 37
    CONSTANT_SUB = 38
    SCALE = 39
    DIV_CONSTANT = 40
    CONSTANT_DIV = 41
    POWI = 42
    POWF = 43
    SELECT = 44
    MULTIPLY_ADD = 45
    SCALE_ADD = 46

    @property
    def reads(self) -> int:
        """The number of registers that it reads."""
        return _READS.get(self, 1)

    @property
    def has_constant(self) -> bool:
        """Whether it reads the constant of its instruction."""
        return self in _WITH_CONSTANT


_READS = {
    Op.LITERAL: 0,
    **{op: 2 for op in Op if Op.ADDITION <= op <= Op.LOGICAL_OR},
    Op.SELECT: 3, Op.MULTIPLY_ADD: 3, Op.SCALE_ADD: 2,
}  # fmt: skip
_WITH_CONSTANT = frozenset([Op.LITERAL, Op.SCALE_ADD, *(op for op in Op if Op.ADD_CONSTANT <= op <= Op.POWF)])
