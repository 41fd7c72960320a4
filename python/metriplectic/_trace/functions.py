"""The functions of NumPy that are no elementwise ones."""

from __future__ import annotations

import inspect
from operator import attrgetter
from typing import Any, Callable

import numpy as np

from . import linear, ufuncs  # noqa: F401  ufuncs fills its tables
from .operations import Op
from .recording import Recording
from .symbols import FUNCTIONS, REDUCTIONS, UFUNCS, SymbolArray, Symbolic, SymbolNumber, computed, laid_out, lift, moved, symbol


def _enter(names: str, record: Callable[..., Any]) -> None:
    """Enters a function under names in NumPy, where this version of NumPy has them."""
    signature = inspect.signature(record)

    def checked(recording: Recording, *arguments: Any, **options: Any) -> Any:
        given = {key: value for key, value in options.items() if value is not np._NoValue}
        for name in ("out", "device"):
            if given.get(name, 0) is None:
                del given[name]
        if "dtype" in given and given["dtype"] in (None, float, np.dtype(np.float64)):
            del given["dtype"]
        try:
            signature.bind(recording, *arguments, **given)
        except TypeError as error:
            shown = f"np.{names.split()[0]}"
            remedy = "leave the other arguments out"
            raise recording.refusal(f"{shown} is not recorded with these arguments: {error}", remedy) from None
        return record(recording, *arguments, **given)

    for name in names.split():
        try:
            FUNCTIONS[attrgetter(name)(np)] = checked
        except AttributeError:
            continue


# Functions that move entries about: NumPy's own, on register numbers.


def _data(recording: Recording, value: Any) -> tuple[Any, bool]:
    """Register numbers in place of symbols and of the numbers beside them, in lists as they stand, and whether all are conditions."""
    if not isinstance(value, (list, tuple)):
        return lift(recording, value)
    entries = [_data(recording, entry) for entry in value]
    return [ids for ids, _ in entries], bool(entries) and all(is_condition for _, is_condition in entries)


def _move(names: str, data: tuple[int, ...] = (0,)) -> None:
    """Enters functions whose arguments at the places ``data`` are arrays, or lists of arrays, to be moved."""
    for name in names.split():
        try:
            function = attrgetter(name)(np)
        except AttributeError:
            continue
        FUNCTIONS[function] = _mover(function, data)


def _mover(function: Any, data: tuple[int, ...]) -> Callable[..., Any]:
    def record(recording: Recording, *arguments: Any, **options: Any) -> Any:
        if len(arguments) <= max(data):
            raise recording.refusal(f"np.{function.__name__} is called with its arrays by name", "give them first, without names")
        entries = [_data(recording, arguments[k]) for k in data]
        given = list(arguments)
        for k, (ids, _) in zip(data, entries):
            given[k] = ids
        if any(isinstance(value, Symbolic) for value in [*given, *options.values()]):
            raise recording.refusal(f"an argument of np.{function.__name__} depends on the state", "give numbers for places and counts")
        return _wrapped(recording, function(*given, **options), all(is_condition for _, is_condition in entries))

    return record


def _wrapped(recording: Recording, result: Any, is_condition: bool) -> Any:
    if isinstance(result, (list, tuple)):
        return type(result)(_wrapped(recording, one, is_condition) for one in result)
    if isinstance(result, np.ndarray):
        return SymbolArray(recording, result, is_condition)
    return SymbolNumber(recording, int(result), is_condition)


_move(
    "reshape ravel transpose permute_dims matrix_transpose linalg.matrix_transpose roll flip fliplr flipud rot90 tile repeat split"
    " array_split hsplit vsplit dsplit unstack squeeze expand_dims moveaxis rollaxis swapaxes broadcast_to take take_along_axis delete"
    " diagonal linalg.diagonal copy resize"
)
_move("compress extract", (1,))
_move("append", (0, 1))
_move("insert", (0, 2))
_move("concatenate concat stack hstack vstack dstack column_stack block")


def _each(function: Any) -> Callable[..., Any]:
    def record(recording: Recording, *arrays: Any, **options: Any) -> Any:
        lifted = [lift(recording, a) for a in arrays]
        ids = function(*(ids for ids, _ in lifted), **options)
        if isinstance(ids, np.ndarray):
            return SymbolArray(recording, ids, lifted[0][1])
        return type(ids)(SymbolArray(recording, one, is_condition) for one, (_, is_condition) in zip(ids, lifted))

    return record


for _name in ("broadcast_arrays", "atleast_1d", "atleast_2d", "atleast_3d"):
    FUNCTIONS[getattr(np, _name)] = _each(getattr(np, _name))


def _pad(recording: Recording, a: Any, pad_width: Any, mode: str = "constant", constant_values: Any = 0.0) -> Any:
    ids = lift(recording, a)[0]
    if mode == "constant":
        if np.ndim(constant_values):
            raise recording.refusal("np.pad with several constants is not recorded", "use np.concatenate")
        return moved(a, np.pad(ids, pad_width, constant_values=int(lift(recording, constant_values)[0])))
    if mode not in ("edge", "reflect", "symmetric", "wrap"):
        raise recording.refusal(f"np.pad with mode={mode!r} is not recorded", "use np.concatenate")
    return moved(a, np.pad(ids, pad_width, mode=mode))  # type: ignore[call-overload]


def _diag(recording: Recording, v: Any, k: int = 0) -> Any:
    ids = lift(recording, v)[0]
    if ids.ndim != 1:
        return moved(v, np.diag(ids, k))
    # Register numbers may be 0, so that what is off the diagonal is told by a mask.
    return moved(v, np.where(np.diag(np.ones(ids.shape, np.bool_), k), np.diag(ids, k), recording.constant(0.0)))


def _triangle(mask: Callable[..., Any]) -> Callable[..., Any]:
    def record(recording: Recording, m: Any, k: int = 0) -> Any:
        ids = lift(recording, m)[0]
        return moved(m, np.where(mask(np.ones(ids.shape[-2:], np.bool_), k), ids, recording.constant(0.0)))

    return record


def _fill_diagonal(recording: Recording, a: Any, val: Any, wrap: bool = False) -> None:
    if not isinstance(a, SymbolArray):
        raise recording.refusal("an array of numbers cannot hold a part of the state", "start from np.zeros(shape, like=x)")
    a.check_writeable()
    np.fill_diagonal(a.ids, lift(recording, val)[0], wrap)


def _copyto(recording: Recording, dst: Any, src: Any) -> None:
    if not isinstance(dst, SymbolArray):
        raise recording.refusal("an array of numbers cannot hold a part of the state", "start from np.zeros(shape, like=x)")
    dst[...] = src


_enter("pad", _pad)
_enter("diag", _diag)
_enter("diagflat", lambda r, v, k=0: _diag(r, symbol(r, v).ravel(), k))
_enter("tril", _triangle(np.tril))
_enter("triu", _triangle(np.triu))
_enter("fill_diagonal", _fill_diagonal)
_enter("copyto", _copyto)


# New arrays, `np.zeros_like(x)` or `np.zeros(shape, like=x)`: symbols that are constants, and can be written to.


def _new(recording: Recording, shape: Any, value: Any) -> Any:
    if _is_symbolic_shape(shape):
        raise recording.refusal("the shape of an array depends on the state", "give numbers, such as len(x)")
    return SymbolArray(recording, np.array(np.broadcast_to(lift(recording, value)[0], shape), order="C"))


def _new_like(recording: Recording, a: Any, value: Any, order: Any, shape: Any) -> Any:
    like, is_condition = lift(recording, a)
    if is_condition:
        raise recording.refusal("an array like conditions would hold booleans", "write np.zeros(shape, like=x) for numbers")
    if _is_symbolic_shape(shape):
        return _new(recording, shape, value)
    ids = np.empty_like(like, order=order, shape=shape)
    ids[...] = lift(recording, value)[0]
    return SymbolArray(recording, ids)


def _is_symbolic_shape(shape: Any) -> bool:
    return isinstance(shape, Symbolic) or (isinstance(shape, (tuple, list)) and any(isinstance(n, Symbolic) for n in shape))


_enter("zeros", lambda r, shape, order="C": _new(r, shape, 0.0))
_enter("ones", lambda r, shape, order="C": _new(r, shape, 1.0))
# What is read before it is written is not a number, where NumPy's is anything.
_enter("empty", lambda r, shape, order="C": _new(r, shape, np.nan))
_enter("full", lambda r, shape, fill_value, order="C": _new(r, shape, fill_value))
_enter("zeros_like", lambda r, a, order="K", subok=True, shape=None: _new_like(r, a, 0.0, order, shape))
_enter("ones_like", lambda r, a, order="K", subok=True, shape=None: _new_like(r, a, 1.0, order, shape))
_enter("empty_like", lambda r, a, order="K", subok=True, shape=None: _new_like(r, a, np.nan, order, shape))
_enter("full_like", lambda r, a, v, order="K", subok=True, shape=None: _new_like(r, a, v, order, shape))
_enter("eye", lambda r, N, M=None, k=0, order="C": _new(r, (N, N if M is None else M), np.eye(N, M, k)))
_enter("identity", lambda r, n: _new(r, (n, n), np.eye(n)))
_enter("array", lambda r, object, copy=True: _converted(r, object, copy))
_enter("asarray asanyarray ascontiguousarray", lambda r, a, copy=None: _converted(r, a, copy))


def _converted(recording: Recording, nested: Any, copy: Any) -> Any:
    if isinstance(nested, SymbolArray) and not copy:
        return nested
    ids, is_condition = lift(recording, nested)
    return SymbolArray(recording, np.array(ids), is_condition)


# Shapes.

FUNCTIONS[np.shape] = lambda r, a: a.shape
FUNCTIONS[np.ndim] = lambda r, a: a.ndim
FUNCTIONS[np.size] = lambda r, a, axis=None: a.size if axis is None else a.shape[axis]
FUNCTIONS[np.iscomplexobj] = lambda r, x: False
FUNCTIONS[np.isrealobj] = lambda r, x: True
FUNCTIONS[np.real] = lambda r, val: val
FUNCTIONS[np.imag] = lambda r, val: val.imag
FUNCTIONS[np.result_type] = lambda r, *operands: np.result_type(*(float if isinstance(x, Symbolic) else x for x in operands))


# Sums, products and what is made of them.


def _reduces(names: str, ufunc: str) -> None:
    reduce = REDUCTIONS[ufunc]
    if ufunc.startswith("logical"):
        _enter(names, lambda r, a, axis=None, keepdims=False: reduce(r, a, axis=axis, keepdims=keepdims))
    else:
        _enter(names, lambda r, a, axis=None, keepdims=False, initial=None: reduce(r, a, axis=axis, keepdims=keepdims, initial=initial))


_reduces("sum", "add")
_reduces("prod", "multiply")
_reduces("max amax", "maximum")
_reduces("min amin", "minimum")
_reduces("any", "logical_or")
_reduces("all", "logical_and")


def _mean(recording: Recording, a: Any, axis: Any = None, keepdims: Any = False) -> Any:
    total = np.sum(symbol(recording, a), axis=axis, keepdims=keepdims)
    return total / (np.size(a) / total.size)


def _var(recording: Recording, a: Any, axis: Any = None, ddof: float = 0, keepdims: Any = False) -> Any:
    x = symbol(recording, a)
    middle = np.mean(x, axis=axis, keepdims=True)
    total = np.sum((x - middle) ** 2, axis=axis, keepdims=keepdims)
    return total / (x.size / total.size - ddof)


def _average(recording: Recording, a: Any, axis: Any = None, weights: Any = None) -> Any:
    if weights is None:
        return _mean(recording, a, axis)
    x, w = symbol(recording, a), symbol(recording, weights)
    if x.shape != w.shape:
        raise recording.refusal("np.average with weights of another shape is not recorded", "write np.sum(w * x) / np.sum(w)")
    return np.sum(x * w, axis=axis) / np.sum(w, axis=axis)


def _cumulative(op: Op) -> Callable[..., Any]:
    def record(recording: Recording, a: Any, axis: Any = None) -> Any:
        ids = lift(recording, a)[0]
        ids, axis = (ids.ravel(), -1) if axis is None else (ids, axis)
        return computed(recording, np.moveaxis(recording.running(op, np.moveaxis(ids, axis, -1)), -1, axis))

    return record


def _diff(recording: Recording, a: Any, n: int = 1, axis: int = -1, prepend: Any = None, append: Any = None) -> Any:
    x = symbol(recording, a)
    for end, at in ((prepend, 0), (append, 1)):
        if end is not None:
            piece = symbol(recording, end)
            shape = list(x.shape)
            shape[axis] = 1
            piece = np.broadcast_to(piece, shape) if piece.ndim == 0 else piece
            x = np.concatenate([x, piece] if at else [piece, x], axis=axis)
    rows = np.moveaxis(x, axis, -1)
    for _ in range(n):
        rows = rows[..., 1:] - rows[..., :-1]
    return np.moveaxis(rows, -1, axis)


def _ptp(recording: Recording, a: Any, axis: Any = None, keepdims: Any = False) -> Any:
    return np.max(a, axis=axis, keepdims=keepdims) - np.min(a, axis=axis, keepdims=keepdims)


def _trace(recording: Recording, a: Any, offset: int = 0, axis1: int = 0, axis2: int = 1) -> Any:
    return np.sum(np.diagonal(symbol(recording, a), offset, axis1, axis2), axis=-1)


def _polyval(recording: Recording, p: Any, x: Any) -> Any:
    at = symbol(recording, x)
    total = at * 0.0
    for coefficient in symbol(recording, p):
        total = total * at + coefficient
    return total


def _nothing_missing(function: Any) -> Callable[..., Any]:
    """NumPy's functions that leave out what is not a number: an entry of the state is one, but a result may be none."""

    def record(recording: Recording, *_: Any, **__: Any) -> Any:
        name = function.__name__
        raise recording.refusal(f"np.{name} is not recorded", f"write np.{name.removeprefix('nan')}: a state has no entries that are missing")

    return record


for _name in ("nansum", "nanprod", "nanmean", "nanmax", "nanmin", "nanstd", "nanvar"):
    FUNCTIONS[getattr(np, _name)] = _nothing_missing(getattr(np, _name))
_enter("mean", _mean)
_enter("var", _var)
_enter("std", lambda r, a, axis=None, ddof=0, keepdims=False: np.sqrt(_var(r, a, axis, ddof, keepdims)))
_enter("average", _average)
_enter("cumsum", _cumulative(Op.ADDITION))
_enter("cumprod", _cumulative(Op.MULTIPLICATION))
_enter("diff", _diff)
_enter("ptp", _ptp)
_enter("trace", _trace)
_enter("linalg.trace", lambda r, x, offset=0: _trace(r, x, offset, -2, -1))
_enter("polyval", _polyval)


# Choices.


def _where(recording: Recording, condition: Any, x: Any = None, y: Any = None) -> Any:
    if x is None or y is None:
        raise recording.refusal("np.where with one argument has a result whose size depends on the state", "give both values")
    return _chosen(recording, condition, x, y)


def _chosen(recording: Recording, condition: Any, x: Any, y: Any) -> Any:
    (yes, is_yes), (no, is_no) = lift(recording, x), lift(recording, y)
    if not isinstance(condition, Symbolic) and np.asarray(condition).dtype != object:
        ids = np.where(condition, yes, no)
    else:
        ids = recording.put_all(Op.SELECT, lift(recording, condition)[0], yes, no)
    if not (yes.flags.c_contiguous and no.flags.c_contiguous):
        ids = laid_out(ids, lambda: np.where(condition.ids if isinstance(condition, Symbolic) else condition, yes, no))
    return computed(recording, ids, is_yes and is_no)


def _select(recording: Recording, condlist: Any, choicelist: Any, default: Any = 0) -> Any:
    if len(condlist) != len(choicelist):
        raise recording.refusal("np.select is called with lists of different lengths", "give a choice for each condition")
    result = default
    for condition, choice in reversed(list(zip(condlist, choicelist))):
        result = _chosen(recording, condition, choice, result)
    shape = np.broadcast_shapes(*(np.shape(x) for x in [*condlist, *choicelist]))
    return np.broadcast_to(result, shape).copy() if shape else result


def _piecewise(recording: Recording, x: Any, condlist: Any, funclist: Any, *arguments: Any, **options: Any) -> Any:
    at = symbol(recording, x)
    conditions = [condlist] if isinstance(condlist, Symbolic) and condlist.ndim == at.ndim else list(condlist)
    if len(funclist) not in (len(conditions), len(conditions) + 1):
        raise recording.refusal("np.piecewise is called with too few or too many functions", "give one for each condition")
    values = [f(at, *arguments, **options) if callable(f) else f for f in funclist]
    result = values.pop() if len(values) > len(conditions) else 0.0
    # The last condition that holds counts, as in NumPy.
    for condition, value in zip(conditions, values):
        result = _chosen(recording, condition, value, result)
    return result


def _clip(recording: Recording, a: Any, a_min: Any = None, a_max: Any = None, min: Any = None, max: Any = None) -> Any:
    low, high = a_min if min is None else min, a_max if max is None else max
    x = symbol(recording, a)
    x = x if low is None else np.maximum(x, low)
    return x if high is None else np.minimum(x, high)


_enter("where", _where)
_enter("select", _select)
_enter("piecewise", _piecewise)
_enter("clip", _clip)


# Products and linear algebra.

_enter("dot", linear.dot)
_enter("inner", linear.inner)
_enter("vdot", linear.vdot)
_enter("outer linalg.outer", linear.outer)
_enter("tensordot linalg.tensordot", linear.tensordot)
_enter("einsum", linear.einsum)
_enter("kron", linear.kron)
_enter("cross", linear.cross)
_enter("linalg.cross", lambda r, x1, x2, axis=-1: linear.cross(r, x1, x2, axis=axis))
_enter("linalg.matmul", lambda r, x1, x2: linear.matmul(r, x1, x2))
_enter("linalg.vecdot", lambda r, x1, x2, axis=-1: linear.vecdot(r, x1, x2, axis))
_enter("linalg.multi_dot", linear.multi_dot)
_enter("linalg.matrix_power", linear.matrix_power)
_enter("linalg.norm", linear.norm)
_enter("linalg.vector_norm", lambda r, x, axis=None, ord=2: linear.norm(r, x if axis is not None else symbol(r, x).ravel(), ord, axis))
_enter("linalg.det", linear.det)
_enter("linalg.inv", linear.inv)
_enter("linalg.solve", linear.solve)


# An array of objects, `np.array([x[0], x[1]])`, asks its entries for methods: np.sin(entries) calls entry.sin().


def _method(name: str) -> Callable[..., Any]:
    def method(self: SymbolNumber, *others: Any) -> Any:
        return UFUNCS[name](self.recording, self, *others)

    return method


for _name in (
    "arccos arccosh arcsin arcsinh arctan arctan2 arctanh cbrt cos cosh deg2rad degrees exp exp2 expm1 fabs hypot log log10 log1p log2"
    " rad2deg radians sin sinh sqrt square tan tanh logical_not"
).split():
    setattr(SymbolNumber, _name, _method(_name))


def supported() -> list[str]:
    """Lists the functions of NumPy that are recorded, such as ``np.sin`` and ``np.linalg.solve``."""
    refused = {np.nansum, np.nanprod, np.nanmean, np.nanmax, np.nanmin, np.nanstd, np.nanvar}
    names = {f"np.{name}" for name in UFUNCS if hasattr(np, name)}
    for function in set(FUNCTIONS) - refused:
        is_linear = function.__module__ == "numpy.linalg" or not hasattr(np, function.__name__)
        names.add(f"np.{'linalg.' if is_linear else ''}{function.__name__}")
    return sorted(names)
