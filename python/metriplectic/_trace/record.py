"""Recording a function, and comparing a recording with the function."""

from __future__ import annotations

import math
import random
from typing import Any, Callable, Sequence

import numpy as np

from . import functions  # noqa: F401  It fills the tables of what NumPy's functions record.
from .errors import TraceError
from .places import call, place_of
from .program import Program
from .recording import Recording, Registers
from .symbols import SymbolArray, Symbolic, SymbolNumber, lift

Function = Callable[..., Any]


def trace(f: Function, inputs: Sequence[tuple[int, ...]], out: tuple[int, ...] | None = (), name: str = "function") -> Program:
    """Records a function of arrays.

    The function is called two times, with symbols; numbers that it captures are those of the recording.

    Parameters
    ----------
    f : function
        It takes one argument for each shape in ``inputs``, and returns an array of the shape ``out``.
    inputs : sequence of tuple of int
        The shapes of the arguments; ``()`` is a number. Inputs of the program are their entries, one argument after another, rows first.
    out : tuple of int, optional
        The shape of the result; ``()`` is a number, and ``None`` admits every shape. Outputs are the entries of the result, rows first.
    name : str
        The name of the function in messages.

    Raises
    ------
    TraceError
        If the function does what is not recorded, such as a branch on the state; if it raises an exception, which is the cause; if its
        result has another shape; or if the two recordings differ, as with random numbers. The message has the line and the remedy.
    """
    first = _record(f, inputs, out, name)
    if _record(f, inputs, out, name) != first:
        raise TraceError(
            f"{name} cannot be recorded: two calls of it compute different things, as with a random number, a clock or a counter\n"
            "  remedy: compute such a number before, and capture it"
        )
    return first


def _record(f: Function, inputs: Sequence[tuple[int, ...]], out: tuple[int, ...] | None, name: str) -> Program:
    recording = Recording(name, sum(math.prod(shape) for shape in inputs))
    arguments: list[Symbolic] = []
    at = 0
    for shape in inputs:
        ids = np.arange(at, at + math.prod(shape), dtype=np.int64).reshape(shape)
        ids.flags.writeable = False
        arguments.append(SymbolArray(recording, ids) if shape else SymbolNumber(recording, at))
        at += ids.size
    try:
        value = call(f, *arguments)
    except Exception as error:
        if recording.refused is not None:
            raise TraceError(recording.refused) from None
        raise _raised(recording, error) from error
    if recording.refused is None:
        outputs = _outputs(recording, value, out)
    if recording.refused is not None:
        # The function has caught the exception, and went on in another way than with numbers.
        raise TraceError(recording.refused)
    return recording.program(outputs)


def _raised(recording: Recording, error: Exception) -> Exception:
    where, line = place_of(error)
    text = f"{where}: `{line}`" if line else where
    message = f"{recording.name} cannot be recorded: it raises {type(error).__name__}: {error}\n  {text}"
    if recording.converted is not None:
        message += (
            f"\n  remedy: {recording.converted} made an array of objects, which some functions do not take: metriplectic.array makes"
            " one that is recorded"
        )
    return TraceError(message)


def _outputs(recording: Recording, value: Any, out: tuple[int, ...] | None) -> Registers:
    """Returns the registers of a result of the shape ``out``."""

    def wrong(reason: str, remedy: str) -> Exception:
        return TraceError(f"{recording.name} cannot be recorded: it returns {reason}\n  remedy: {remedy}")

    needed = "an array of numbers" if out is None else "a number" if out == () else f"an array of the shape {out}"
    if not isinstance(value, (Symbolic, float, int, np.ndarray, np.number, list, tuple)):
        reason = "nothing (None)" if value is None else f"an object of the type {type(value).__name__}"
        raise wrong(f"{reason}, and {needed} is needed", f"return {needed}")
    try:
        ids, is_condition = lift(recording, value)
    except ValueError as error:
        raise wrong(f"lists of different lengths, and {needed} is needed: {error}", f"return {needed}") from None
    if out is not None and ids.shape != out:
        remedy = "write value[0] for the one entry" if out == () and ids.size == 1 else f"return {needed}"
        raise wrong(f"an array of the shape {ids.shape}, and {needed} is needed", remedy)
    if is_condition and ids.size:
        raise wrong(f"conditions, and {needed} is needed", "write np.where(condition, 1.0, 0.0) for numbers")
    return ids


def check(
    program: Program, f: Function, inputs: Sequence[tuple[int, ...]], points: Sequence[Any], name: str = "function"
) -> None:  # fmt: skip
    """Compares a recording with the function called on numbers.

    It finds what a recording cannot see: a branch on the type of an argument, or a function that computes with the values of its
    arguments behind NumPy's back. A difference counts if it is more than round-off, which is estimated from evaluations of the recording
    with noise in each operation.

    Parameters
    ----------
    program : Program
        The recording.
    f : function
        The function, which takes one argument for each shape in ``inputs``.
    inputs : sequence of tuple of int
        The shapes of the arguments.
    points : sequence of arrays of the shape (n,)
        Values of the n inputs of the program, argument after argument.
    name : str
        The name of the function in messages.

    Raises
    ------
    TraceError
        If the values differ beyond round-off, or if the function raises an exception or changes its arguments at a point.
    """
    for point in points:
        x = np.array(point, dtype=float).ravel()
        arguments = _parted(x, inputs)
        kept = [np.array(argument) for argument in arguments]
        try:
            with np.errstate(all="ignore"):
                value = np.asarray(call(f, *arguments), dtype=float).ravel()
        except Exception as error:
            where, line = place_of(error)
            raise TraceError(f"{name} raises {type(error).__name__} at {x.tolist()}: {error}\n  {where}: `{line}`") from error
        if any(a.tobytes() != np.asarray(b).tobytes() for a, b in zip(kept, arguments)):
            raise TraceError(f"{name} writes into its argument\n  remedy: work on a copy: y = x.copy()")
        if len(value) != len(program.outputs):
            raise TraceError(f"{name} returns {len(value)} numbers at {x.tolist()}, and its recording {len(program.outputs)}")
        recorded = program.evaluate(x.tolist())
        for k, (want, got, tolerance) in enumerate(zip(value.tolist(), recorded, _round_off(program, x, recorded))):
            if want == got or (want != want and got != got) or abs(want - got) <= tolerance:
                continue
            raise TraceError(
                f"{name} was recorded as another function: its entry {k} is {want!r} at {x.tolist()}, and {got!r} by the recording\n"
                "  remedy: look for branches on types, such as isinstance(x, np.ndarray), and for values that change between calls"
            )


def _parted(x: Any, inputs: Sequence[tuple[int, ...]]) -> list[Any]:
    arguments, at = [], 0
    for shape in inputs:
        size = math.prod(shape)
        arguments.append(x[at : at + size].reshape(shape).copy() if shape else np.float64(x[at]))
        at += size
    return arguments


def _round_off(program: Program, x: Any, recorded: Sequence[float]) -> list[float]:
    """Estimates the round-off of each output: 64 times the spread of three evaluations with noise."""
    noise = random.Random(0)
    tolerances = [2.0**-46 * abs(value) for value in recorded]
    for _ in range(3):
        noisy = program.evaluate(x.tolist(), noise=noise)
        for k, (value, other) in enumerate(zip(recorded, noisy)):
            spread = 64.0 * abs(value - other)
            if spread > tolerances[k]:
                tolerances[k] = spread
    return tolerances
