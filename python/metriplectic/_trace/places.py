"""The line of a user's function that is running, or that raised an exception."""

from __future__ import annotations

import linecache
import os
import sys
import sysconfig
from types import FrameType
from typing import Any, Callable, Iterable

import numpy as np

_PACKAGE = os.path.dirname(os.path.dirname(os.path.abspath(__file__))) + os.sep
_NUMPY = os.path.dirname(os.path.abspath(np.__file__)) + os.sep
_LIBRARIES = tuple(
    path + os.sep for key, path in sysconfig.get_paths().items() if key in ("stdlib", "platstdlib", "purelib", "platlib")
)


def call(f: Callable[..., Any], *arguments: Any) -> Any:
    """Calls a function. The frames inside this one are those of the user's function."""
    return f(*arguments)


def place() -> tuple[str, str]:
    """Returns the place of the user's line that is running, such as ``model.py:12``, and its text, which may be empty."""
    frame: FrameType | None = sys._getframe(1)
    lines = []
    while frame is not None and frame.f_code is not call.__code__:
        lines.append((frame.f_code.co_filename, frame.f_lineno))
        frame = frame.f_back
    return _user_line(lines)


def place_of(error: BaseException) -> tuple[str, str]:
    """Returns the place and the text of the user's line that raised an exception."""
    lines, inside, traceback = [], False, error.__traceback__
    while traceback is not None:
        if inside:
            lines.append((traceback.tb_frame.f_code.co_filename, traceback.tb_lineno))
        inside = inside or traceback.tb_frame.f_code is call.__code__
        traceback = traceback.tb_next
    return _user_line(reversed(lines))


def _user_line(lines: Iterable[tuple[str, int]]) -> tuple[str, str]:
    """Chooses the innermost line outside this package, NumPy and, if there is one, outside all libraries."""
    outside = [line for line in lines if not line[0].startswith((_PACKAGE, _NUMPY))]
    if not outside:
        return "unknown line", ""
    file, number = next((line for line in outside if not line[0].startswith(_LIBRARIES)), outside[0])
    return f"{os.path.basename(file)}:{number}", linecache.getline(file, number).strip()
