"""The elementwise functions of NumPy and their reductions."""

from __future__ import annotations

import math
from typing import Any, Callable

import numpy as np

from .operations import Op
from .recording import Recording, Registers
from .symbols import REDUCTIONS, UFUNCS, computed, laid_out, lift

_Rule = Callable[..., Registers]


def _elementwise(name: str, rule: _Rule, *, to_condition: bool = False, of_conditions: str = "refuse") -> None:
    """Enters the rule of a function of NumPy, from a recording and registers to registers.

    ``of_conditions`` says what becomes of operands that are all conditions, booleans in NumPy: "refuse" where NumPy raises an exception or
    computes in half precision, "number" for a number, "condition" for a condition, and "only" if nothing else is admitted.
    """

    def record(recording: Recording, *operands: Any) -> Any:
        lifted = [lift(recording, operand) for operand in operands]
        are_conditions = all(is_condition for _, is_condition in lifted)
        if are_conditions and of_conditions == "refuse":
            remedy = "write np.where(condition, 1.0, 0.0) for a number"
            raise recording.refusal(f"np.{name} is called with conditions alone", remedy)
        if not are_conditions and of_conditions == "only":
            remedy = "write np.where, or comparisons on both sides: (a > 0) & (b > 0)"
            raise recording.refusal(f"np.{name} is called with numbers, and takes conditions", remedy)
        try:
            ids = np.broadcast_arrays(*(ids for ids, _ in lifted))
        except ValueError:
            shapes = " and ".join(str(ids.shape) for ids, _ in lifted)
            raise recording.refusal(f"the shapes {shapes} do not fit in np.{name}", "compare the shapes") from None
        is_condition = to_condition or (are_conditions and of_conditions in ("condition", "only"))
        chosen = _OF_CONDITIONS.get(name, rule) if are_conditions else rule
        result = chosen(recording, *ids)
        registers = [ids for ids, _ in lifted]
        if not all(one.flags.c_contiguous for one in registers):
            result = laid_out(result, lambda: sum(registers[1:], registers[0].copy("K")))
        return computed(recording, result, is_condition)

    UFUNCS[name] = record


def _arithmetic(op: Op) -> _Rule:
    return lambda r, a, b: r.arithmetic(op, a, b)


def _one(op: Op) -> _Rule:
    return lambda r, a: r.put_all(op, a)


def _two(op: Op) -> _Rule:
    return lambda r, a, b: r.put_all(op, a, b)


def _not(rule: _Rule) -> _Rule:
    return lambda r, *ids: r.put_all(Op.LOGICAL_NOT, rule(r, *ids))


def _swapped(rule: _Rule) -> _Rule:
    return lambda r, a, b: rule(r, b, a)


def _extremum(op: Op) -> _Rule:
    """The larger or smaller of two numbers, and not a number if one of them is none, as in NumPy.

    The operation on tapes gives its first operand if the second one is not a number: a constant goes there, and a choice looks at others.
    """

    def rule(r: Recording, a: Registers, b: Registers) -> Registers:
        (is_a, value_a), (is_b, value_b) = r.known(a), r.known(b)
        swap = is_a & (value_a == value_a) & ~is_b
        a, b = np.where(swap, b, a), np.where(swap, a, b)
        result = r.put_all(op, a, b)
        is_number = swap | (is_b & (value_b == value_b))
        if is_number.all():
            return result
        result = np.array(result)
        x, y = b[~is_number], result[~is_number]
        result[~is_number] = r.put_all(Op.SELECT, r.put_all(Op.EQUAL, x, x), y, x)
        return result

    return rule


def _lenient_extremum(op: Op) -> _Rule:
    """The larger or smaller of two numbers, and the other one if one of them is not a number."""
    return lambda r, a, b: r.put_all(Op.SELECT, r.put_all(Op.EQUAL, a, a), r.put_all(op, a, b), b)


def _sign(r: Recording, a: Registers) -> Registers:
    """The sign, 0 for 0; that of tapes is ±1 there."""
    zero = r.constants(0.0)
    return r.put_all(Op.SELECT, r.put_all(Op.EQUAL, a, zero), zero, r.put_all(Op.SIGN, a))


def _power(r: Recording, a: Registers, b: Registers) -> Registers:
    return r.power(a, b)


def _square(r: Recording, a: Registers) -> Registers:
    return r.arithmetic(Op.MULTIPLICATION, a, a)


def _hypot(r: Recording, a: Registers, b: Registers) -> Registers:
    # The squares are not scaled: those of numbers beyond 1e±150 leave the range of floats, as in `np.sqrt(a * a + b * b)`.
    return r.put_all(Op.SQRT, r.arithmetic(Op.ADDITION, _square(r, a), _square(r, b)))


def _logaddexp(r: Recording, a: Registers, b: Registers) -> Registers:
    """`max(a, b) + ln(1 + exp(−|a − b|))`."""
    gap = r.put_all(Op.NEGATION, r.put_all(Op.ABS, r.arithmetic(Op.SUBTRACTION, a, b)))
    return r.arithmetic(Op.ADDITION, _extremum(Op.MAX)(r, a, b), r.put_all(Op.LN_1P, r.put_all(Op.EXP, gap)))


def _heaviside(r: Recording, a: Registers, b: Registers) -> Registers:
    zero, one = r.constants(0.0), r.constants(1.0)
    above = r.put_all(Op.SELECT, r.put_all(Op.LESS, zero, a), one, a)
    below = r.put_all(Op.SELECT, r.put_all(Op.LESS, a, zero), zero, above)
    return r.put_all(Op.SELECT, r.put_all(Op.EQUAL, a, zero), b, below)


def _scaled(rule: _Rule, op: Op, factor: float) -> _Rule:
    return lambda r, a: r.arithmetic(op, rule(r, a), r.constants(factor))


def _itself(r: Recording, a: Registers) -> Registers:
    return a.copy()


_OF_CONDITIONS: dict[str, _Rule] = {"add": _two(Op.LOGICAL_OR), "multiply": _two(Op.LOGICAL_AND)}

for _name, _op in {
    "reciprocal": Op.RECIP, "sqrt": Op.SQRT, "cbrt": Op.CBRT, "exp": Op.EXP, "expm1": Op.EXP_M1, "log": Op.LN,
    "log1p": Op.LN_1P, "sin": Op.SIN, "cos": Op.COS, "tan": Op.TAN, "arcsin": Op.ASIN, "arccos": Op.ACOS, "arctan": Op.ATAN,
    "sinh": Op.SINH, "cosh": Op.COSH, "tanh": Op.TANH, "arcsinh": Op.ASINH, "arccosh": Op.ACOSH, "arctanh": Op.ATANH,
    "negative": Op.NEGATION, "absolute": Op.ABS, "fabs": Op.ABS,
}.items():  # fmt: skip
    _elementwise(_name, _one(_op))
for _name, _op in {"subtract": Op.SUBTRACTION, "divide": Op.DIVISION}.items():
    _elementwise(_name, _arithmetic(_op), of_conditions="refuse" if _name == "subtract" else "number")
for _name, _op in {"add": Op.ADDITION, "multiply": Op.MULTIPLICATION}.items():
    _elementwise(_name, _arithmetic(_op), of_conditions="condition")
_elementwise("power", _power)
for _name, _rule in {
    "less": _two(Op.LESS), "less_equal": _two(Op.LESS_EQUAL), "equal": _two(Op.EQUAL),
    "greater": _swapped(_two(Op.LESS)), "greater_equal": _swapped(_two(Op.LESS_EQUAL)), "not_equal": _not(_two(Op.EQUAL)),
    "logical_and": _two(Op.LOGICAL_AND), "logical_or": _two(Op.LOGICAL_OR), "logical_not": _one(Op.LOGICAL_NOT),
    "logical_xor": _not(lambda r, a, b: r.put_all(Op.EQUAL, r.put_all(Op.LOGICAL_NOT, a), r.put_all(Op.LOGICAL_NOT, b))),
}.items():  # fmt: skip
    _elementwise(_name, _rule, to_condition=True, of_conditions="condition")
for _name, _rule in {
    "bitwise_and": _two(Op.LOGICAL_AND), "bitwise_or": _two(Op.LOGICAL_OR), "bitwise_xor": _not(_two(Op.EQUAL)),
    "invert": _one(Op.LOGICAL_NOT),
}.items():  # fmt: skip
    _elementwise(_name, _rule, of_conditions="only")
for _name, _rule in {
    "minimum": _extremum(Op.MIN), "maximum": _extremum(Op.MAX),
    "fmin": _lenient_extremum(Op.MIN), "fmax": _lenient_extremum(Op.MAX),
}.items():  # fmt: skip
    _elementwise(_name, _rule, of_conditions="condition")
_COMPOSED: dict[str, _Rule] = {
    "positive": _itself, "conjugate": _itself, "square": _square, "sign": _sign, "arctan2": _two(Op.ATAN2), "hypot": _hypot,
    "logaddexp": _logaddexp, "heaviside": _heaviside,
    "exp2": lambda r, a: r.power(np.broadcast_to(r.constants(2.0), a.shape), a),
    "log2": _scaled(_one(Op.LN), Op.DIVISION, math.log(2.0)), "log10": _scaled(_one(Op.LN), Op.DIVISION, math.log(10.0)),
    "deg2rad": _scaled(_itself, Op.MULTIPLICATION, math.pi / 180.0), "radians": _scaled(_itself, Op.MULTIPLICATION, math.pi / 180.0),
    "rad2deg": _scaled(_itself, Op.MULTIPLICATION, 180.0 / math.pi), "degrees": _scaled(_itself, Op.MULTIPLICATION, 180.0 / math.pi),
}  # fmt: skip
for _name, _rule in _COMPOSED.items():
    _elementwise(_name, _rule)


# Reductions.


def reduction(
    recording: Recording, a: Any, ufunc: np.ufunc, total: Callable[[Registers], Registers], *, axis: Any = None, keepdims: Any = False,
    initial: Any = None,
) -> Registers:  # fmt: skip
    """Records a reduction of NumPy's: ``total`` reduces the last axis of an array of registers."""
    ids = lift(recording, a)[0]
    keepdims = bool(keepdims) and keepdims is not np._NoValue
    # NumPy itself says what the shape is, and raises what is wrong with the axes or with a maximum of nothing.
    shape = np.shape(ufunc.reduce(np.broadcast_to(0.0, ids.shape), axis=axis, keepdims=keepdims))
    along = tuple(range(ids.ndim)) if axis is None else tuple(np.atleast_1d(axis) % max(ids.ndim, 1))[: ids.ndim]
    rest = [k for k in range(ids.ndim) if k not in along]
    terms = ids.transpose([*rest, *along])
    terms = terms.reshape(*terms.shape[: len(rest)], math.prod(terms.shape[len(rest) :]))
    if initial is not None and initial is not np._NoValue:
        start = np.broadcast_to(lift(recording, initial)[0], terms.shape[:-1])
        terms = np.concatenate([start[..., None], terms], axis=-1)
    result = total(terms).reshape(shape)
    return result if ids.flags.c_contiguous else laid_out(result, lambda: ufunc.reduce(ids, axis=axis, keepdims=keepdims))


def _reduced(op: Op, neutral: float, ufunc: np.ufunc) -> Callable[..., Any]:
    def record(recording: Recording, a: Any, *, axis: Any = None, keepdims: Any = False, initial: Any = None) -> Any:
        def total(terms: Registers) -> Registers:
            return recording.total(op, terms, neutral)

        return computed(recording, reduction(recording, a, ufunc, total, axis=axis, keepdims=keepdims, initial=initial))

    return record


def _reduced_condition(op: Op, neutral: float, ufunc: np.ufunc) -> Callable[..., Any]:
    def record(recording: Recording, a: Any, *, axis: Any = None, keepdims: Any = False) -> Any:
        def total(terms: Registers) -> Registers:
            # A number is a condition by not being 0; with one term, no operation would make it one.
            return recording.total(op, _not(_one(Op.LOGICAL_NOT))(recording, terms), neutral)

        return computed(recording, reduction(recording, a, ufunc, total, axis=axis, keepdims=keepdims), True)

    return record


def _reduced_extremum(op: Op, ufunc: np.ufunc) -> Callable[..., Any]:
    def record(recording: Recording, a: Any, *, axis: Any = None, keepdims: Any = False, initial: Any = None) -> Any:
        def total(terms: Registers) -> Registers:
            found = terms[..., 0]
            for k in range(1, terms.shape[-1]):
                found = _extremum(op)(recording, found, terms[..., k])
            return found

        result = reduction(recording, a, ufunc, total, axis=axis, keepdims=keepdims, initial=initial)
        return computed(recording, result, lift(recording, a)[1] and initial in (None, np._NoValue))

    return record


REDUCTIONS |= {
    "add": _reduced(Op.ADDITION, 0.0, np.add),
    "multiply": _reduced(Op.MULTIPLICATION, 1.0, np.multiply),
    "logical_and": _reduced_condition(Op.LOGICAL_AND, 1.0, np.logical_and),
    "logical_or": _reduced_condition(Op.LOGICAL_OR, 0.0, np.logical_or),
    "maximum": _reduced_extremum(Op.MAX, np.maximum),
    "minimum": _reduced_extremum(Op.MIN, np.minimum),
}
