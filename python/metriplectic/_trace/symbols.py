"""Symbols that stand for arrays and numbers while a function is recorded.

A ``SymbolArray`` wraps an array of register numbers, with the views and copies that NumPy makes of it; a ``SymbolNumber`` is an entry, as
immutable as NumPy's own scalars, so that ``s += x`` binds a name anew. Neither has a value: everything that asks for one is refused.
"""

from __future__ import annotations

import re
from typing import Any, Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from .errors import TraceError
from .operations import Op
from .places import place
from .recording import Recording, Registers

UFUNCS: dict[str, Callable[..., Any]] = {}
"""Elementwise functions by the names of NumPy's: from a recording and operands to a symbol."""

REDUCTIONS: dict[str, Callable[..., Any]] = {}
"""The reductions of NumPy's elementwise functions, by name."""

FUNCTIONS: dict[Any, Callable[..., Any]] = {}
"""Functions of NumPy: from a recording and NumPy's arguments to a symbol."""


class Symbolic(np.lib.mixins.NDArrayOperatorsMixin):
    """A symbol of a recording: its operators and methods are NumPy's, and it has no value."""

    __slots__ = ("is_condition", "recording")

    recording: Recording
    is_condition: bool
    """Whether it is the result of a comparison, a boolean in NumPy."""

    @property
    def ids(self) -> Registers:
        """The register numbers."""
        raise NotImplementedError

    @property
    def real(self) -> Symbolic:
        return self

    @property
    def imag(self) -> Any:
        return computed(self.recording, np.zeros(self.ids.shape, np.int64) + self.recording.constant(0.0))

    def conjugate(self) -> Symbolic:
        return self

    conj = conjugate

    # NumPy's protocols.

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *operands: Any, out: Any = None, **options: Any) -> Any:
        recording, name = self.recording, ufunc.__name__
        if out is not None:
            return _in_place(recording, ufunc, method, operands, out[0], options)
        if options.pop("dtype", None) not in (None, float, np.dtype(np.float64)) or options.pop("where", True) is not True:
            raise recording.refusal(f"np.{name} is called with `dtype` or `where`", "leave it out, or use np.where on the result")
        if method == "__call__" and name in UFUNCS and not options:
            return UFUNCS[name](recording, *operands)
        if method == "reduce" and name in REDUCTIONS:
            return REDUCTIONS[name](recording, *operands, **{"axis": 0, **options})
        if method == "outer" and name in UFUNCS and not options:
            a, b = (symbol(recording, x) for x in operands)
            return ufunc(a.reshape(a.shape + (1,) * b.ndim), b)
        if method == "accumulate" and name in ("add", "multiply"):
            return (np.cumsum if name == "add" else np.cumprod)(*operands, **{"axis": 0, **options})
        shown = f"np.{name}" if hasattr(np, name) else name
        shown += "" if method == "__call__" else f".{method}"
        with_options = f" with {', '.join(options)}" if options else ""
        raise recording.refusal(f"{shown} is not recorded{with_options}", _REMEDIES.get(name, _GENERAL_REMEDY))

    def __array_function__(self, function: Any, types: Any, arguments: Any, options: Any) -> Any:
        if function in FUNCTIONS:
            return FUNCTIONS[function](self.recording, *arguments, **options)
        module = function.__module__.removeprefix("numpy").strip(".")
        shown = ".".join(["np", *([module] if module in ("linalg", "fft") else []), function.__name__])
        remedy = _REMEDIES.get(module, _REMEDIES.get(function.__name__, _GENERAL_REMEDY))
        raise self.recording.refusal(f"{shown} is not recorded", remedy)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        """Returns an array of objects, the symbols of the entries: NumPy's operators work on it entry by entry."""
        recording = self.recording
        if dtype is not None and np.dtype(dtype) != object:
            raise recording.refusal(f"an array of the type {np.dtype(dtype)} cannot hold symbols", _REMEDIES["dtype"])
        if self.is_condition:  # The sum of an array of objects would be a disjunction, where that of booleans counts.
            raise recording.refusal("NumPy makes an array of objects from conditions", self._remedy("write np.stack([..]) of conditions"))
        if recording.converted is None:
            recording.converted = place()[0]
        entries = np.empty(self.ids.size, object)
        for k, register in enumerate(self.ids.ravel().tolist()):
            entries[k] = SymbolNumber(recording, register)
        # A view of the state in NumPy is a copy here, which must not be written to in its place.
        entries.flags.writeable = copy is True
        return entries.reshape(self.ids.shape)

    # No values.

    def __bool__(self) -> bool:
        remedy = self._remedy(_BRANCH_REMEDY)
        if self.recording.converted is not None:
            remedy += (
                f"; {self.recording.converted} made an array of objects, which NumPy compares entry by entry:"
                " metriplectic.array makes one that is recorded"
            )
        raise self.recording.refusal("a branch depends on the state, and one recording holds for all states", remedy)

    def _remedy(self, otherwise: str) -> str:
        """The remedy for the line that is running."""
        line = place()[1]
        return next((text for pattern, text in _BRANCHES if re.search(pattern, line)), otherwise)

    def _number(self, *_: Any) -> Any:
        line = place()[1]
        if re.search(r"\]\s*([-+*/@]|\*\*)?=[^=]", line):
            raise self.recording.refusal("an array of numbers cannot hold a part of the state", _REMEDIES["writing"])
        if "dtype" in line:
            raise self.recording.refusal("an array with a `dtype` of numbers cannot hold symbols", _REMEDIES["dtype"])
        function = re.search(r"\bmath\.(\w+)", line)
        if function:
            remedy = f"write np.{_MATH.get(function[1], function[1])} for math.{function[1]}"
        else:
            remedy = "leave float(..), int(..) and .item() out, and use NumPy's functions"
        raise self.recording.refusal("a number is asked of the state, which has none while it is recorded", remedy)

    def __float__(self) -> float:
        raise self._number()

    def __int__(self) -> int:
        raise self._number()

    def __complex__(self) -> complex:
        raise self._number()

    def __round__(self, digits: Any = None) -> Any:
        raise self._number()

    __trunc__ = __floor__ = __ceil__ = item = tolist = _number

    def __index__(self) -> int:
        raise self.recording.refusal("an index or a range depends on the state", "use np.where, or a sum over all entries with weights")

    def __hash__(self) -> int:
        raise self.recording.refusal("a key of a cache, a dictionary or a set depends on the state", "call the function without a cache")

    def __reduce__(self) -> Any:
        raise self.recording.refusal("the state is pickled, or sent to another process", "compute it in the function itself")

    def __format__(self, form: str) -> str:
        return repr(self)

    def __copy__(self) -> Any:
        return self.copy()

    def __deepcopy__(self, memo: Any) -> Any:
        return self.copy()

    def __getattr__(self, name: str) -> Any:
        # A method of arrays that is not recorded is refused where it is called: asking whether there is one is allowed.
        if name.startswith("__") or not callable(getattr(np.float64, name, getattr(np.ndarray, name, None))):
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")

        def refuse(*_: Any, **__: Any) -> Any:
            raise self.recording.refusal(f"the method .{name}() is not recorded", _REMEDIES.get(name, _GENERAL_REMEDY))

        return refuse

    # Methods of arrays that are functions of NumPy.

    def _shaped(self, *shape: Any) -> Any:
        return shape[0] if len(shape) == 1 and not isinstance(shape[0], (int, np.integer)) else shape

    @property
    def shape(self) -> tuple[int, ...]:
        return self.ids.shape

    @property
    def ndim(self) -> int:
        return self.ids.ndim

    @property
    def size(self) -> int:
        return self.ids.size

    @property
    def T(self) -> Any:
        return moved(self, self.ids.T)

    @property
    def mT(self) -> Any:
        return moved(self, self.ids.swapaxes(-1, -2))

    @property
    def flat(self) -> Iterator[Any]:
        return iter(moved(self, self.ids.ravel()))

    def reshape(self, *shape: Any, order: Any = "C") -> Any:
        return moved(self, self.ids.reshape(self._shaped(*shape), order=order))

    def ravel(self, order: Any = "C") -> Any:
        return moved(self, self.ids.ravel(order))

    def flatten(self, order: Any = "C") -> Any:
        return moved(self, self.ids.flatten(order))

    def transpose(self, *axes: Any) -> Any:
        return moved(self, self.ids.transpose(*axes))

    def swapaxes(self, a: int, b: int) -> Any:
        return moved(self, self.ids.swapaxes(a, b))

    def squeeze(self, axis: Any = None) -> Any:
        return np.squeeze(self, axis=axis)

    def diagonal(self, *arguments: Any, **options: Any) -> Any:
        return np.diagonal(self, *arguments, **options)

    def take(self, indices: Any, axis: Any = None) -> Any:
        return np.take(self, indices, axis=axis)

    def repeat(self, repeats: Any, axis: Any = None) -> Any:
        return np.repeat(self, repeats, axis=axis)

    def copy(self, order: Any = "C") -> Any:
        return moved(self, self.ids.copy(order))

    def astype(self, dtype: Any, order: Any = "K", casting: Any = None, subok: Any = True, copy: bool = True) -> Any:
        to_condition = self.is_condition and np.dtype(dtype) == np.bool_
        if np.dtype(dtype) != np.float64 and not to_condition:
            raise self.recording.refusal(f"the state is turned into numbers of the type {np.dtype(dtype)}", "leave .astype(..) out")
        if not copy and to_condition == self.is_condition:
            return self
        return computed(self.recording, self.ids.copy(order), to_condition)

    def sum(self, *arguments: Any, **options: Any) -> Any:
        return np.sum(self, *arguments, **options)

    def prod(self, *arguments: Any, **options: Any) -> Any:
        return np.prod(self, *arguments, **options)

    def mean(self, *arguments: Any, **options: Any) -> Any:
        return np.mean(self, *arguments, **options)

    def var(self, *arguments: Any, **options: Any) -> Any:
        return np.var(self, *arguments, **options)

    def std(self, *arguments: Any, **options: Any) -> Any:
        return np.std(self, *arguments, **options)

    def max(self, *arguments: Any, **options: Any) -> Any:
        return np.max(self, *arguments, **options)

    def min(self, *arguments: Any, **options: Any) -> Any:
        return np.min(self, *arguments, **options)

    def any(self, *arguments: Any, **options: Any) -> Any:
        return np.any(self, *arguments, **options)

    def all(self, *arguments: Any, **options: Any) -> Any:
        return np.all(self, *arguments, **options)

    def cumsum(self, *arguments: Any, **options: Any) -> Any:
        return np.cumsum(self, *arguments, **options)

    def cumprod(self, *arguments: Any, **options: Any) -> Any:
        return np.cumprod(self, *arguments, **options)

    def trace(self, *arguments: Any, **options: Any) -> Any:
        return np.trace(self, *arguments, **options)

    def clip(self, *arguments: Any, **options: Any) -> Any:
        return np.clip(self, *arguments, **options)

    def dot(self, other: Any) -> Any:
        return np.dot(self, other)


class SymbolArray(Symbolic):
    """An array of symbols. Slices are views of it, as in NumPy, and the arguments of the function are read-only."""

    __slots__ = ("_ids",)

    def __init__(self, recording: Recording, ids: Registers, is_condition: bool = False) -> None:
        self.recording, self._ids, self.is_condition = recording, ids, is_condition

    @property
    def ids(self) -> Registers:
        return self._ids

    # An entry has no `dtype`: NumPy's mean of an array of objects would ask for a number of this type.
    @property
    def dtype(self) -> np.dtype[Any]:
        return np.dtype(np.bool_ if self.is_condition else np.float64)

    def __repr__(self) -> str:
        return f"SymbolArray(shape={self.shape})"

    def __len__(self) -> int:
        return len(self._ids)

    def __iter__(self) -> Iterator[Any]:
        if self._ids.ndim == 1:
            return (SymbolNumber(self.recording, k, self.is_condition) for k in self._ids.tolist())
        return (moved(self, ids) for ids in self._ids)

    def __getitem__(self, key: Any) -> Any:
        if _has_symbols(key):
            raise self.recording.refusal("an index depends on the state", "use np.where, or a sum over all entries with weights")
        return moved(self, self._ids[key])

    def __setitem__(self, key: Any, value: Any) -> None:
        recording = self.recording
        self.check_writeable()
        ids, is_condition = lift(recording, value)
        if self.is_condition and not is_condition:
            raise recording.refusal("a number is written into an array of conditions", "start from an array of floats")
        if _has_symbols(key):
            condition = symbol(recording, key)
            if not condition.is_condition or condition.shape != self.shape or ids.ndim:
                raise recording.refusal("an index depends on the state", "use np.where(condition, a, b)")
            ids = recording.put_all(Op.SELECT, condition.ids, ids, self._ids)
            key = ...
        self._ids[key] = ids

    def check_writeable(self) -> None:
        """Refuses to write into the arguments of the function."""
        if not self._ids.flags.writeable:
            raise self.recording.refusal(
                "the function writes into its argument, or into a read-only view", "work on a copy: y = x.copy()"
            )

    def fill(self, value: Any) -> None:
        self[...] = value


# Looked up once: members of an enumeration are slow to find.
_ADD, _SUB, _MUL, _DIV = Op.ADDITION, Op.SUBTRACTION, Op.MULTIPLICATION, Op.DIVISION


class SymbolNumber(Symbolic):
    """A number without a value."""

    __slots__ = ("id",)

    def __init__(self, recording: Recording, register: int, is_condition: bool = False) -> None:
        self.recording, self.id, self.is_condition = recording, register, is_condition

    @property
    def ids(self) -> Registers:
        ids = np.array(self.id, np.int64)
        ids.flags.writeable = False
        return ids

    def __repr__(self) -> str:
        return "SymbolNumber()"

    def copy(self, order: Any = "C") -> Any:
        return self

    # Operators on numbers, of which a loop in Python has many, without NumPy's dispatch.

    def _register(self, other: Any) -> int | None:
        """The register of a plain operand; `None` if NumPy must look at it."""
        kind = type(other)
        if kind is SymbolNumber and other.recording is self.recording and not other.is_condition:
            register: int = other.id
            return register
        if kind is float or kind is int:
            return self.recording.constant(float(other))
        return None

    def _with(self, op: Op, ufunc: np.ufunc, other: Any) -> Any:
        register = self._register(other)
        if register is None:
            return ufunc(self, other)
        return SymbolNumber(self.recording, self.recording.arithmetic_of_two(op, self.id, register))

    def _after(self, op: Op, ufunc: np.ufunc, other: Any) -> Any:
        register = self._register(other)
        if register is None:
            return ufunc(other, self)
        return SymbolNumber(self.recording, self.recording.arithmetic_of_two(op, register, self.id))

    def __add__(self, other: Any) -> Any:
        return self._with(_ADD, np.add, other)

    def __radd__(self, other: Any) -> Any:
        return self._after(_ADD, np.add, other)

    def __sub__(self, other: Any) -> Any:
        return self._with(_SUB, np.subtract, other)

    def __rsub__(self, other: Any) -> Any:
        return self._after(_SUB, np.subtract, other)

    def __mul__(self, other: Any) -> Any:
        return self._with(_MUL, np.multiply, other)

    def __rmul__(self, other: Any) -> Any:
        return self._after(_MUL, np.multiply, other)

    def __truediv__(self, other: Any) -> Any:
        return self._with(_DIV, np.true_divide, other)

    def __rtruediv__(self, other: Any) -> Any:
        return self._after(_DIV, np.true_divide, other)

    def __pow__(self, other: Any) -> Any:
        if type(other) not in (int, float):
            return np.power(self, other)
        return SymbolNumber(self.recording, self.recording.power_of_one(self.id, float(other)))

    __iadd__, __isub__, __imul__, __itruediv__ = __add__, __sub__, __mul__, __truediv__


def computed(recording: Recording, ids: Registers, is_condition: bool = False) -> Any:
    """Wraps the result of a computation: a number if it has no axes, as in NumPy."""
    if ids.ndim == 0:
        return SymbolNumber(recording, int(ids), is_condition)
    return SymbolArray(recording, ids, is_condition)


def moved(source: Symbolic, ids: Any) -> Any:
    """Wraps entries that NumPy moved: arrays, also those without axes, stay arrays."""
    if isinstance(ids, np.ndarray):
        return SymbolArray(source.recording, ids, source.is_condition)
    return SymbolNumber(source.recording, int(ids), source.is_condition)


def lift(recording: Recording, value: Any) -> tuple[Registers, bool]:
    """Returns the registers of a symbol, or of numbers as constants, and whether they are conditions."""
    if isinstance(value, Symbolic):
        if value.recording is not recording:
            raise recording.refusal("an array of another call is used", "keep no state in a global, a default or a cache")
        return value.ids, value.is_condition
    if type(value) in (float, int, bool):
        return np.array(recording.constant(float(value)), np.int64), type(value) is bool
    if isinstance(value, (list, tuple)) and _first_symbol(value) is not None:
        parts = [lift(recording, entry) for entry in value]
        return np.stack([ids for ids, _ in parts]), all(is_condition for _, is_condition in parts)
    array = np.asarray(value)
    kind = array.dtype.kind
    if kind == "O":
        return _lift_objects(recording, array.ravel().tolist(), array.shape)
    if kind == "c":
        raise recording.refusal("a complex number meets the state", "write the real and the imaginary part as two real numbers")
    if kind not in "fiub":
        raise recording.refusal(f"numbers of the type {array.dtype} meet the state", "use floats")
    return recording.constants(array), kind == "b"


def _lift_objects(recording: Recording, entries: Any, shape: tuple[int, ...]) -> tuple[Registers, bool]:
    registers = []
    are_conditions = bool(len(entries))
    for entry in entries:
        if isinstance(entry, Symbolic) and entry.ndim == 0:
            ids, is_condition = lift(recording, entry)
            registers.append(int(ids))
        elif isinstance(entry, (bool, int, float, np.bool_, np.integer, np.floating)):
            is_condition = isinstance(entry, (bool, np.bool_))
            registers.append(recording.constant(float(entry)))
        elif isinstance(entry, (complex, np.complexfloating)):
            raise recording.refusal("a complex number meets the state", "write the real and the imaginary part as two real numbers")
        else:
            kind = type(entry).__name__
            remedy = "write .toarray() for a sparse matrix" if hasattr(entry, "toarray") else "use floats and arrays of floats"
            raise recording.refusal(f"an object of the type {kind} meets the state", remedy)
        are_conditions = are_conditions and is_condition
    return np.array(registers, np.int64).reshape(shape), are_conditions


def laid_out(ids: Registers, like: Any) -> Registers:
    """Gives registers the order in memory of NumPy's result, which says whether `ravel` and `reshape` make views of it or copies.

    ``like`` makes an array of this layout; it is called if the operands are not in the order of rows.
    """
    if ids.ndim < 2:
        return ids
    result: Registers = np.empty_like(like())
    result[...] = ids
    return result


def symbol(recording: Recording, value: Any) -> Any:
    """Returns a symbol, or numbers as symbols that are constants."""
    return value if isinstance(value, Symbolic) and value.recording is recording else computed(recording, *lift(recording, value))


def array(nested: Any) -> Any:
    """Makes an array from nested lists that may hold parts of the state.

    Without such parts it is an array of floats. In a list of entries, ``np.array`` also works, and makes an array of objects: NumPy's
    operators are recorded on it, while comparisons and some functions are refused.
    """
    found = _first_symbol(nested)
    return np.asarray(nested, float) if found is None else SymbolArray(found.recording, lift(found.recording, nested)[0].copy())


def _first_symbol(nested: Any) -> Symbolic | None:
    if isinstance(nested, Symbolic):
        return nested
    if isinstance(nested, np.ndarray):
        nested = nested.ravel().tolist() if nested.dtype == object else []
    if isinstance(nested, (list, tuple)):
        for entry in nested:
            found = _first_symbol(entry)
            if found is not None:
                return found
    return None


def _has_symbols(key: Any) -> bool:
    return _first_symbol(key) is not None


def _in_place(recording: Recording, ufunc: np.ufunc, method: str, operands: Any, target: Any, options: Any) -> Any:
    """Writes the result of an elementwise function into an array: `x += y`."""
    result = getattr(ufunc, method)(*operands, **options)
    if isinstance(target, SymbolNumber):
        return result
    if isinstance(target, np.ndarray) and target.dtype == object:
        target[...] = np.asarray(result)
        return target
    if not isinstance(target, SymbolArray):
        raise recording.refusal(f"np.{ufunc.__name__} writes a part of the state into an array of numbers", _REMEDIES["writing"])
    target.check_writeable()
    if np.broadcast_shapes(target.shape, result.shape) != target.shape:
        raise recording.refusal(f"an array of the shape {result.shape} is written into the shape {target.shape}", "compare the shapes")
    target[...] = result
    return target


_BRANCH_REMEDY = "write np.where(condition, a, b); or np.maximum, np.minimum, np.clip, np.abs"
_BRANCHES = [
    (r"^assert\b", "leave the assertion out: a recorded function cannot check the state"),
    (r"^while\b|\biter\(", "write a loop with a fixed number of rounds, and np.where for what depends on the state"),
    (r"(?<![\w.])(max|min)\(", "write np.maximum(a, b) or np.minimum(a, b) for max and min"),
    (r"\blogical_(and|or)\.reduce\(", "write nested np.where(..), or nested Piecewise(..) in SymPy, for conditions joined by and, or"),
    (r"(?<![\w.])sorted\(", "write the function without an order of the entries"),
    (r"\b(any|all)\(|\bnp\.(isclose|allclose|array_equal)\(", _BRANCH_REMEDY),
]  # fmt: skip
_GENERAL_REMEDY = "write it with arithmetic, sums, np.where and the other functions of metriplectic.supported()"
_REMEDIES = {
    "dtype": "leave `dtype` out, or write metriplectic.array([..]) or np.stack([..])",
    "writing": "start from np.zeros_like(x) or np.zeros(shape, like=x), or build it with np.stack([..]) or metriplectic.array([..])",
    "fft": "write the transform as a product with matrices of cosines and sines",
    "eigh": "write the function by invariants of the matrix, such as traces and determinants",
    "eigvalsh": "write the function by invariants of the matrix, such as traces and determinants",
    "interp": "write np.where(x < b, a0 + a1 * x, ..) for the pieces, or fit a polynomial",
    "sort": "write the function without an order of the entries",
    "gradient": "write the differences by slices: (x[2:] - x[:-2]) / (2 * dx)",
    "convolve": "write the sum by slices, or as a product with a matrix",
    "sinc": "write np.sin(x) / x, with np.where and a series near 0",
    "apply_along_axis": "call the function on slices, and np.stack the results",
    "isclose": _BRANCH_REMEDY,
    "allclose": _BRANCH_REMEDY,
    "array_equal": _BRANCH_REMEDY,
    "floor_divide": "write x / y: a quotient without a remainder has no slope",
    "erf": "write it by functions that are recorded: np.exp, np.tanh, or a rational approximation",
}
_MATH = {
    "asin": "arcsin", "acos": "arccos", "atan": "arctan", "atan2": "arctan2", "asinh": "arcsinh", "acosh": "arccosh", "atanh": "arctanh",
    "fabs": "abs", "pow": "power", "fsum": "sum", "dist": "linalg.norm", "ldexp": "exp2",
}  # fmt: skip
