"""Record functions of NumPy as lists of instructions.

A function is called with symbols in place of its arrays and recorded: entries are moved about by NumPy's own work on arrays of register
numbers, and operations become instructions. The recording is a ``Program``, whose parts are those of a tape in Rust::

    program = trace(lambda p: 0.5 * p @ p, [(3,)], out=(), name="energy")
    program.evaluate([1.0, 2.0, 2.0])       # [4.5]

- ``trace(f, inputs, out, name)`` calls ``f`` with one argument for each shape in ``inputs``, two times, and refuses it if the recordings
  differ. ``out`` is the shape of its result; ``None`` admits every shape.
- ``check(program, f, inputs, points, name)`` compares a recording with the function called on numbers.
- ``arguments(f, ...)`` says by names which arguments are the state, the covector, the time and the parameters: see its module.
- ``array(nested)`` makes an array from nested lists with symbols in them.
- ``supported()`` lists the functions of NumPy that are recorded.

Numbers that a function captures are those of the recording. A function that cannot be recorded raises a ``TraceError`` with the line, the
reason and the remedy; no operation gives a plain number in place of a symbol.
"""

from .arguments import Arguments, arguments
from .errors import TraceError
from .functions import supported
from .operations import MOST_EXPONENT, MOST_REGISTERS, Op
from .program import Program
from .record import check, trace
from .symbols import array

__all__ = [
    "Arguments", "MOST_EXPONENT", "MOST_REGISTERS", "Op", "Program", "TraceError", "arguments", "array", "check", "supported", "trace",
]
