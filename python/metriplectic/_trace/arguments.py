"""Which argument of a function is which.

A function names its arguments, and their names say what they are:

- ``t`` is the time;
- ``w``, in a friction or a bath, is the covector dH of the energy, an array of the shape (directions,);
- a name of a parameter of the system is that parameter;
- what remains is the state: one argument is the whole state, and as many arguments as the space has factors are its factors, in their
  order. ``lambda x: ..`` on a product takes the tuple of factors, ``lambda q, p: ..`` takes them one by one.

An argument with a default that is none of these keeps its default, which is a constant of the recording: ``lambda x, i=i: x[i]``. The state
stands before ``*``; the others stand anywhere: ``lambda p, gamma: ..`` and ``lambda p, *, gamma: ..`` are the same.
"""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from typing import Any, Callable, Collection, Mapping

from .errors import TraceError


@dataclass(frozen=True)
class Arguments:
    """The arguments of a function.

    Attributes
    ----------
    state : tuple of str
        One name for the whole state, or one for each factor.
    by_factors : bool
        Whether the function takes the factors one by one.
    covector, time : bool
        Whether it takes the covector and the time.
    parameters : tuple of str
        The parameters that it takes.
    """

    function: Callable[..., Any]
    state: tuple[str, ...]
    by_factors: bool
    covector: bool
    time: bool
    parameters: tuple[str, ...]
    _keywords: frozenset[str]
    _order: tuple[str, ...]

    def call(self, state: Any, *, w: Any = None, t: Any = None, parameters: Mapping[str, Any] | None = None) -> Any:
        """Calls the function with a state, a tuple of factors for a product, and with what it takes of the rest."""
        values = dict(zip(self.state, state if self.by_factors else (state,)))
        values |= {name: value for name, value in (("w", w), ("t", t)) if name in self._order and name not in values}
        values |= {name: (parameters or {})[name] for name in self.parameters}
        positional = [values[name] for name in self._order if name not in self._keywords]
        return self.function(*positional, **{name: values[name] for name in self._order if name in self._keywords})


def arguments(
    f: Callable[..., Any], *, parameters: Collection[str] = (), factors: int = 1, covector: bool = False, name: str = "function"
) -> Arguments:  # fmt: skip
    """Says which argument of a function is which.

    Parameters
    ----------
    f : function
    parameters : collection of str
        The names of the parameters of the system.
    factors : int
        The number of factors of the space.
    covector : bool
        Whether ``w`` is the covector of the energy; otherwise it is a name like any other.
    name : str
        The name of the function in messages.

    Raises
    ------
    TraceError
        If an argument is neither state, nor time, nor covector, nor a parameter.
    """
    try:
        found = list(inspect.signature(f).parameters.values())
    except (TypeError, ValueError):  # A function in C may have none.
        return Arguments(f, ("x",), False, False, False, (), frozenset(), ("x",))
    special = {"t", *parameters, *(["w"] if covector else [])}
    state: list[str] = []
    order: list[str] = []
    keywords: set[str] = set()
    for one in found:
        if one.kind is one.VAR_POSITIONAL:
            raise TraceError(f"{name} has the argument *{one.name}\n  remedy: name its arguments")
        if one.kind is one.VAR_KEYWORD:
            continue
        if one.name not in special:
            if one.default is not one.empty:
                if one.kind is not one.KEYWORD_ONLY and one.kind is not one.POSITIONAL_ONLY:
                    keywords.update(later.name for later in found[found.index(one) + 1 :])
                continue
            if one.kind is one.KEYWORD_ONLY:
                raise _unknown(name, one.name, parameters, covector)
            state.append(one.name)
        if one.kind is one.KEYWORD_ONLY:
            keywords.add(one.name)
        order.append(one.name)
    if len(state) not in (1, factors):
        if not state:
            raise TraceError(f"{name} has no argument for the state\n  remedy: take it first: lambda x: ..")
        if factors == 1 or len(state) > factors:
            raise _unknown(name, state[1 if factors == 1 else factors], parameters, covector)
        raise TraceError(
            f"{name} takes {', '.join(state)} for the state, and the space has {factors} factors\n"
            "  remedy: take the whole state as one argument, or one argument for each factor"
        )
    return Arguments(
        f, tuple(state), len(state) == factors > 1, covector and "w" in order, "t" in order,
        tuple(one for one in order if one in parameters), frozenset(keywords & set(order)), tuple(order),
    )  # fmt: skip


def _unknown(name: str, argument: str, parameters: Collection[str], covector: bool) -> Exception:
    known = ", ".join(["t", *(["w"] if covector else []), *parameters])
    return TraceError(
        f"{name} has the argument `{argument}`, which is no parameter; after the state, there are {known}\n"
        "  remedy: name it among the parameters of the system, or give it a default"
    )
