"""The exception of functions that cannot be recorded."""

from __future__ import annotations


def _exception() -> type[Exception]:
    try:
        from .._metriplectic import TraceError as compiled
    except ImportError:  # The tracer works, and is tested, without the extension.
        text = "A function that cannot be recorded. The message has the line, the reason and the remedy."
        return type("TraceError", (TypeError,), {"__module__": __name__, "__doc__": text})
    found: type[Exception] = compiled
    return found


TraceError: type[Exception] = _exception()
"""A function that cannot be recorded. The message has the line, the reason and the remedy."""
