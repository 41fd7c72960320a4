"""Systems of recorded functions, and what is asked of them."""

from __future__ import annotations

import inspect
import math
import os
import threading
from dataclasses import dataclass
from typing import Any, Callable, Iterable, Mapping

import numpy as np

from . import _metriplectic as _door
from ._metriplectic import ModelError, RunError
from ._trace import Program, arguments, array, trace
from .run import Certificate, Run, Tangent
from .spaces import Space

Function = Callable[..., Any]

_METHODS = ("dp8", "dp5", "chebyshev", "midpoint", "exponential", "chart-midpoint", "gauss1", "gauss2", "gauss3", "gauss4", "radau2",
            "radau3", "radau4")


@dataclass(frozen=True)
class Event:
    """A function g of the state whose change of sign is an event of a run, with what happens there.

    Parameters
    ----------
    function : function
        ``g(x)``, or ``g(x, t, ..)`` with the time and parameters by their names.
    direction : int
        1 if it has to rise through zero, −1 if it has to fall, 0 for both.
    stop : bool or int
        Whether the run ends there, or the number of the event at which it does: 10 for ten revolutions. With ``jump`` it ends before the
        jump of that number.
    jump : function, optional
        The state behind the event, ``jump(x)`` or ``jump(x, t, ..)``. The change of the energy is work, and heat with ``heat_at``.
    heat_at : float, optional
        The temperature of surroundings from which the change of the energy comes as heat, in units of H/S.
    may_lower_entropy : bool
        Whether a jump may lower the entropy of the system and its surroundings.
    resolution : float, optional
        The longest time between two looks at the function, for what has one sign but for a short time.
    """

    function: Function
    direction: int = 0
    stop: bool | int = False
    jump: Function | None = None
    heat_at: float | None = None
    may_lower_entropy: bool = False
    resolution: float | None = None


@dataclass(frozen=True)
class Report:
    """The residual of each law around a start: rows ``(law, residual, allowed, entries of the worst state)``. ``verdict`` is the message
    of the first law that is broken, or None."""

    laws: list[tuple[str, float, float, list[float]]]
    verdict: str | None
    text: str

    def __str__(self) -> str:
        return self.text

    __repr__ = __str__


@dataclass(frozen=True)
class Definition:
    """The parts of a system as the extension reads them."""

    factors: list[tuple[str, int, list[float]]]
    parameters: list[str]
    energy: Program
    entropy: Program | None
    invariants: list[tuple[str, Program]]
    bracket: tuple[str, Any]
    friction: tuple[str, Program | None]
    metric: Program | None


def _number_to_stop_at(name: str, stop: bool | int) -> int:
    """The number of the event that ends a run; 0 if none does."""
    if stop is False or (isinstance(stop, (bool, int, np.integer)) and stop >= 1):
        return int(stop)
    raise ValueError(f"event {name} has stop = {stop!r}; it is True, False, or the number of the event that ends the run, from 1 on")


@dataclass
class _Event:
    """An event as the extension reads it."""

    name: str
    function: Program
    direction: int
    stop: int
    jump: Program | None
    heat_at: float | None
    may_lower_entropy: bool
    resolution: float | None


@dataclass
class _Chosen:
    """A method as the extension reads it."""

    method: str
    gradient: str | None
    sampler: str | None
    seed: int
    path: int
    three_point: bool


@dataclass
class _Times:
    """The times of a run as the extension reads them."""

    start: float
    end: float | None
    h: float | None
    steps: int | None
    tol: float
    every: float | None
    at: list[float] | None
    each: int | None
    at_most: int | None
    rest: float | None
    corners: list[float]
    sampled: float | None
    first_step: float | None
    least_step: float | None
    largest_step: float | None
    scale: list[float] | None
    absolute: list[float] | None
    backward: bool


class System:
    """A system x' = Π dH + K dS whose functions are recorded once.

    A function has the state first: an array of the shape of a state of the space (a tuple of arrays for a product). Behind it come, by
    their names, the time ``t`` and parameters. ``friction`` and the contacts of baths have the covector ``w`` = dH second.

    Parameters
    ----------
    space : Space
        Where the states live, such as ``mp.R(3)``.
    energy : function
        H(x), in a unit of your own. With an argument ``t`` the work of the time is booked.
    entropy : function, optional
        S(x), a Casimir of the bracket.
    parameters : dict, optional
        Names of parameters with their values, numbers or arrays. ``system(gamma=0.3)`` has other values.
    poisson, almost_poisson : array or function, optional
        The Poisson tensor Π(x), of the shape ``(velocities, velocities)``; ``almost_poisson`` need not satisfy Jacobi's identity.
        ``"symplectic"`` is the canonical one of positions and momenta, or of T*SO(3); ``"area"`` that of the sphere; ``"none"`` is zero;
        a tuple of such words has one for each factor of a product. Without either it is ``"own"``: that of Lie and Poisson on the dual of
        a Lie algebra, the canonical one on T*SO(3), and zero elsewhere.
    friction : number, function or None
        A number, or a function κ(x, ..), scales the dissipation of the metric, 1 without it. A function K(x, w, ..) with a second argument
        returns a symmetric matrix with K w = 0, of the shape ``(velocities, velocities)``, or a list of contacts ``(rate, b)`` with b·w = 0
        that add up to it. None is no friction.
    metric : array or function, optional
        The matrix g(x) of the metric, of the shape ``(velocities, velocities)``.
    casimirs, momenta : list of functions
        Further invariants that every run keeps.
    work : dict of functions
        Ports: velocities F(x, ..), of the shape ``(velocities,)``, that do work and carry no entropy.
    baths : dict of pairs
        For each bath its temperature, a number or a function of ``t`` and parameters, and a function of ``(x, w, ..)`` that returns a list
        of contacts ``(rate, b)`` with ``b`` of the shape ``(velocities,)``.
    noise : float, optional
        Boltzmann's constant k_B, in the unit of the entropy: the friction has its thermal noise.

    Raises
    ------
    TraceError
        If a function cannot be recorded.
    ModelError
        If a part makes no sense.

    Examples
    --------
    >>> import numpy as np, metriplectic as mp
    >>> ball = mp.System(mp.R(2), energy=lambda x, g: 0.5 * x[1] ** 2 + g * x[0], poisson="symplectic", parameters={"g": 9.81})
    >>> run = ball(g=1.0).run([1.0, 0.0], t=1.0, tol=1e-10)
    >>> float(round(run.y[-1, 0], 9))
    0.5
    """

    def __init__(
        self,
        space: Space,
        energy: Function,
        entropy: Function | None = None,
        *,
        parameters: Mapping[str, Any] | None = None,
        poisson: Any = None,
        almost_poisson: Any = None,
        friction: Any = 1.0,
        metric: Any = None,
        casimirs: Iterable[Function] = (),
        momenta: Iterable[Function] = (),
        work: Mapping[str, Function] | None = None,
        baths: Mapping[str, tuple[Any, Function]] | None = None,
        noise: float | None = None,
    ):
        if not isinstance(space, Space):
            raise TypeError(f"a space such as mp.R(3) is expected first, not {type(space).__name__}")
        if poisson is not None and almost_poisson is not None:
            raise ValueError("give `poisson=` or `almost_poisson=`, not both")
        self.space = space
        self._values = {name: _value(name, value) for name, value in (parameters or {}).items()}
        self._verified = False
        self._noise = None if noise is None else float(noise)
        n = space.velocities
        moving = [energy, *(f for f in (poisson, almost_poisson, friction) if callable(f))]
        self._takes_time = any("t" in _names(f) for f in moving)
        self._definition = Definition(
            factors=[(factor.kind, factor.directions, list(factor.constants)) for factor in space.factors],
            parameters=self._flat_names(),
            energy=self._record(energy, "energy"),
            entropy=None if entropy is None else self._record(entropy, "entropy"),
            invariants=[("casimir", self._record(f, "casimir")) for f in casimirs]
            + [("momentum", self._record(f, "momentum")) for f in momenta],
            bracket=self._bracket(poisson, almost_poisson),
            friction=self._friction(friction, entropy),
            metric=None if metric is None else self._matrix(metric, "metric"),
        )
        if (work or baths) and space.velocities != space.directions:
            raise ModelError("ports and baths are not on spheres: a velocity of theirs has no numbers in a chart there; leave them out")
        self._ports = [(name, self._record(f, f"port {name}", (n,))) for name, f in (work or {}).items()]
        self._baths = [(name, *self._bath(name, bath)) for name, bath in (baths or {}).items()]
        self._build()

    # Parameters.

    @property
    def parameters(self) -> dict[str, Any]:
        """The parameters with their values."""
        return {name: value.copy() if value.ndim else float(value) for name, value in self._values.items()}

    def __call__(self, **parameters: Any) -> "System":
        """Returns the system at other values of its parameters; no function is recorded again."""
        values = dict(self._values)
        for name, value in parameters.items():
            if name not in values:
                raise TypeError(f"there is no parameter {name!r}; there are {', '.join(values) or 'none'}")
            new = _value(name, value)
            if new.shape != values[name].shape:
                raise ValueError(f"the parameter {name!r} has the shape {values[name].shape}, not {new.shape}")
            values[name] = new
        other = object.__new__(System)
        other.__dict__.update(self.__dict__)
        other._values, other._verified = values, False
        other._raw = self._raw.at(other._theta())
        return other

    def _theta(self) -> list[float]:
        return [float(x) for value in self._values.values() for x in value.ravel()]

    def _flat_names(self) -> list[str]:
        names = []
        for name, value in self._values.items():
            if value.ndim == 0:
                names.append(name)
            else:
                names += [f"{name}[{', '.join(map(str, k))}]" for k in np.ndindex(value.shape)]
        return names

    # Recording.

    def _record(self, f: Function, name: str, out: tuple[int, ...] = (), covector: bool = False) -> Program:
        if isinstance(f, Program):
            return f
        if not callable(f):
            raise TypeError(f"{name}: a function is expected, not {type(f).__name__}")
        space, values = self.space, self._values
        taken = arguments(f, parameters=values, factors=len(space.shapes), covector=covector, name=name)

        def recorded(x, *rest):
            w, rest = (rest[0], rest[1:]) if covector else (None, rest)
            named = dict(zip(["t", *values], rest))
            return taken.call(space.shaped(x), w=w, t=named["t"], parameters=named)

        shapes = [(space.entries,)] + ([(space.velocities,)] if covector else []) + [()]
        shapes += [value.shape for value in values.values()]
        return trace(recorded, shapes, out=out, name=name)

    def _matrix(self, f: Any, name: str, covector: bool = False) -> Program:
        n = self.space.velocities
        if not callable(f):
            matrix = np.asarray(f, dtype=float)
            if matrix.shape != (n, n):
                raise ValueError(f"{name}: a matrix of the shape {(n, n)} is expected, not {matrix.shape}")
            return self._record(lambda x: matrix, name, (n, n))
        return self._record(f, name, (n, n), covector)

    def _bracket(self, poisson: Any, almost: Any) -> tuple[str, Any]:
        if almost is not None:
            return "almost", self._matrix(almost, "almost_poisson")
        if poisson is None or isinstance(poisson, str):
            poisson = (poisson or "own",) * len(self.space.factors)
        if isinstance(poisson, tuple) and all(isinstance(name, str) for name in poisson):
            for name in poisson:
                if name not in ("own", "symplectic", "area", "none"):
                    raise ValueError(f"there is no bracket {name!r}; there are 'own', 'symplectic', 'area', 'none'")
            if len(poisson) != len(self.space.factors):
                raise ValueError(f"{len(poisson)} brackets are named, and {self.space!r} has {len(self.space.factors)} factors")
            return "named", list(poisson)
        if callable(poisson):
            return "poisson", self._matrix(poisson, "poisson")
        n, matrix = self.space.velocities, np.asarray(poisson, dtype=float)
        if matrix.shape != (n, n):
            raise ValueError(f"poisson: a matrix of the shape {(n, n)} is expected, not {matrix.shape}")
        return "constant", [float(x) for x in matrix.ravel()]

    def _friction(self, friction: Any, entropy: Any) -> tuple[str, Program | None]:
        if entropy is None or friction is None:
            return "none", None
        if not callable(friction):
            number = float(friction)
            if not (number >= 0.0 and math.isfinite(number)):
                raise ModelError(f"the friction is {number}; it must be a finite number that is not negative")
            if number in (0.0, 1.0):
                return ("metric", None) if number else ("none", None)
            return "metric", self._record(lambda x: number, "friction")
        factors = len(self.space.shapes)
        if not arguments(friction, parameters=self._values, factors=factors, covector=True, name="friction").covector:
            return "metric", self._record(friction, "friction")
        # A list of contacts, or a matrix: the recording says which.
        contacts: list[int] = []

        def noted(*arguments, **named):
            found = friction(*arguments, **named)
            if not isinstance(found, (list, tuple)):
                return found
            contacts.append(len(found))
            return self._contacts(found, "the friction")

        noted.__signature__ = inspect.signature(friction)  # type: ignore[attr-defined]
        program, n = self._record(noted, "friction", None, covector=True), self.space.velocities  # type: ignore[arg-type]
        if contacts:
            return "contacts", program
        return "matrix", self._record(friction, "friction", (n, n), covector=True)

    def _contacts(self, found: Any, name: str) -> Any:
        """Lists the rate and the direction of each contact."""
        n, numbers = self.space.velocities, []
        for contact in [found] if isinstance(found, tuple) and len(found) == 2 else found:
            rate, b = contact
            if np.shape(b) != (n,):
                raise ValueError(f"the direction of a contact of {name} has the shape {(n,)}, not {np.shape(b)}")
            numbers += [rate, *(b[i] for i in range(n))]
        return array(numbers)

    def _bath(self, name: str, bath: Any) -> tuple[Any, Program]:
        temperature, contacts = bath

        def listed(*arguments, **named):
            return self._contacts(contacts(*arguments, **named), f"the bath {name!r}")

        listed.__signature__ = inspect.signature(contacts)  # type: ignore[attr-defined]
        program = self._record(listed, f"bath {name}", None, covector=True)  # type: ignore[arg-type]
        if callable(temperature):
            f = temperature

            def warm(x, **named):
                return f(**named)

            rest = [p.replace(kind=p.KEYWORD_ONLY) for p in inspect.signature(f).parameters.values()]
            first = inspect.Parameter("x", inspect.Parameter.POSITIONAL_ONLY)
            warm.__signature__ = inspect.Signature([first, *rest])  # type: ignore[attr-defined]
            return self._record(warm, f"temperature of {name}"), program
        return float(temperature), program

    def _observed(self, program: Program, t: np.ndarray, y: np.ndarray) -> np.ndarray:
        theta = np.tile(self._theta(), (len(t), 1)).reshape(len(t), -1)
        rows = _door.evaluate(program, np.ascontiguousarray(np.hstack([y, t[:, None], theta])))
        return rows[:, 0] if rows.shape[1] == 1 else rows

    def _build(self) -> None:
        self._raw = _door.RawSystem(
            self._definition, self._theta(), self._ports, self._baths, self._takes_time, self._noise, self._verified
        )

    # Programs are numbers, so a system goes to other processes though its functions were lambdas.

    def __getstate__(self) -> dict[str, Any]:
        return {key: value for key, value in self.__dict__.items() if key != "_raw"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._build()

    def __repr__(self) -> str:
        parts = [f"energy: {_size_of(self._definition.energy)}"]
        if self._definition.entropy is not None:
            parts.append(f"entropy: {_size_of(self._definition.entropy)}")
        if self._definition.friction[1] is not None:
            parts.append(f"friction: {_size_of(self._definition.friction[1])}")
        parts += [f"port {name}" for name, _ in self._ports] + [f"bath {name}" for name, *_ in self._baths]
        if self._values:
            parts.append(", ".join(f"{name} = {np.array2string(value, threshold=6)}" for name, value in self._values.items()))
        return f"<System on {self.space!r}; {'; '.join(parts)}>"

    # Verification.

    def verify(self, y0: Any, t0: float = 0.0) -> None:
        """Checks every law around a state. A run does this first.

        Raises
        ------
        ModelError
            That names the law, the state and the size of the violation.
        """
        self._raw.verified(self.space.flat(y0), float(t0))

    def verified(self, y0: Any, t0: float = 0.0) -> "System":
        """Checks every law around a state, and returns the system with this certificate: its runs check their start alone."""
        other = object.__new__(System)
        other.__dict__.update(self.__dict__)
        other._verified, other._raw = True, self._raw.verified(self.space.flat(y0), float(t0))
        return other

    def report(self, y0: Any, t0: float = 0.0) -> Report:
        """Lists the residual of each law around a state. Read it when a new system misbehaves."""
        rows, verdict, text = self._raw.report(self.space.flat(y0), float(t0))
        return Report(list(rows), verdict, text)

    def laws(self, y: Any, t: Any = 0.0) -> np.ndarray:
        """Evaluates H, S and the further invariants at states: rows of y, of the shape (m, n), give an array of the shape (m, laws)."""
        y = np.atleast_2d(np.asarray(y, dtype=float))
        times = np.broadcast_to(np.asarray(t, dtype=float), (len(y),))
        return self._raw.laws(np.ascontiguousarray(y), np.ascontiguousarray(times))

    # Runs.

    def run(
        self,
        y0: Any,
        t: float | None = None,
        *,
        tol: float = 1e-6,
        h: float | None = None,
        steps: int | None = None,
        t0: float = 0.0,
        method: str = "dp8",
        gradient: str | None = None,
        every: float | None = None,
        at: Any = None,
        each: int | None = None,
        at_most: int | None = None,
        rest: float | None = None,
        events: Mapping[str, Any] | None = None,
        observables: Mapping[str, Function] | None = None,
        corners: Any = (),
        sampled: float | None = None,
        first_step: float | None = None,
        least_step: float | None = None,
        largest_step: float | None = None,
        scale: Any = None,
        absolute: Any = None,
        backward: bool = False,
        sampler: str | None = None,
        seed: int = 0,
        path: int = 0,
        three_point: bool = False,
        progress: Any = False,
    ) -> Run:
        """Verifies the model, and runs it from ``y0`` to the time ``t``, without the interpreter.

        Parameters
        ----------
        y0 : array or tuple
            The start, in the shape of a state or as a list of its entries.
        t : float
            The time at which the run ends, in your unit. It begins at ``t0``.
        tol : float
            The error that steps follow: that of the motion in about a turn, relative to the sizes of the entries.
        h, steps : float and int, optional
            Steps of one size in place of a tolerance, up to ``t`` or so many.
        method : str
            ``"dp8"``, ``"dp5"``, ``"chebyshev"`` (explicit); ``"midpoint"``, ``"exponential"``, ``"chart-midpoint"`` (implicit, with a
            discrete ``gradient``); ``"gauss1"`` … ``"gauss4"``, ``"radau2"`` … ``"radau4"`` (implicit, with stages).
        gradient : str, optional
            Of a scheme: ``"gonzalez"`` (without another one), ``"mean-value"``, ``"itoh-abe"``, ``"symmetric-itoh-abe"``.
        every, at : float, or array of floats, optional
            Records the states at multiples of a time, or at these times, in place of the ends of steps; the last state always.
        each, at_most : int, optional
            Records each so many-th step, or at most so many states.
        rest : float, optional
            Ends the run where the speed is below this part of the largest one.
        events : dict, optional
            Names with functions of the state, or with ``mp.Event``.
        observables : dict, optional
            Names with functions of the state that are evaluated at the recorded states.
        corners, sampled : array and float, optional
            Times at which the law of motion jumps or has a kink, or the interval between them.
        first_step, least_step, largest_step : float, optional
            Sizes of steps that follow a tolerance.
        scale, absolute : array, optional
            The sizes of the entries that errors are relative to, or the errors that are allowed; zero is the automatic one.
        backward : bool
            Whether the run goes back in time, to an end ``t`` before ``t0``: of a closed system without an entropy.
        sampler, seed, path, three_point
            Of a system with noise: ``"random-flow"`` or ``"ninomiya-victoir"``, its random numbers and their kind.
        progress : bool or function
            Shows a bar by tqdm, if it is installed; a function is called with the time that is reached.

        Returns
        -------
        Run

        Raises
        ------
        ModelError, SpanError
            Before the run.
        RunError
            If a step fails; ``partial`` is the run so far. KeyboardInterrupt has it too.
        """
        request = {key: value for key, value in locals().items() if key not in ("self", "progress", "observables")}
        watched = {name: self._record(f, f"observable {name}", None) for name, f in (observables or {}).items()}  # type: ignore[arg-type]
        chosen, start, times, found = self._asked(**request)
        request["events"] = found
        end = times.end if times.end is not None else t0 + (-1.0 if backward else 1.0) * (h or 0.0) * (steps or 0)
        with _progress(progress, t0, end) as look:
            try:
                raw = self._raw.run(chosen, start, times, found, look)
            except (RunError, KeyboardInterrupt) as error:
                partial = getattr(error, "partial", None)
                error.partial = None if partial is None else Run.of(partial, self, request, watched)  # type: ignore[union-attr]
                raise
        return Run.of(raw, self, request, watched)

    def _asked(
        self, y0, t=None, tol=1e-6, h=None, steps=None, t0=0.0, method="dp8", gradient=None, every=None, at=None, each=None,
        at_most=None, rest=None, events=None, corners=(), sampled=None, first_step=None, least_step=None, largest_step=None,
        scale=None, absolute=None, backward=False, sampler=None, seed=0, path=0, three_point=False,
    ):
        def numbers(values):
            return None if values is None else [float(x) for x in np.asarray(values, dtype=float).ravel()]

        def number(value):
            return None if value is None else float(value)

        chosen = _Chosen(str(method), gradient, sampler, int(seed), int(path), bool(three_point))
        times = _Times(
            float(t0), number(t), number(h), None if steps is None else int(steps), float(tol), number(every), numbers(at), each, at_most,
            number(rest), numbers(corners) or [], number(sampled), number(first_step), number(least_step), number(largest_step),
            numbers(scale), numbers(absolute), bool(backward),
        )
        found = events if isinstance(events, list) else [self._event(name, event) for name, event in (events or {}).items()]
        return chosen, self.space.flat(y0), times, found

    def _event(self, name: str, event: Any) -> _Event:
        event = event if isinstance(event, Event) else Event(event)
        if event.direction not in (-1, 0, 1):
            raise ValueError(f"the direction of the event {name!r} is 1, −1 or 0, not {event.direction!r}")
        jump = None
        if event.jump is not None:
            map_, space = event.jump, self.space

            def entries(*arguments, **named):
                after = map_(*arguments, **named)
                parts = after if isinstance(after, tuple) and len(space.shapes) > 1 else (after,)
                return array([x for part in parts for x in _listed(part)])

            entries.__signature__ = inspect.signature(map_)  # type: ignore[attr-defined]
            jump = self._record(entries, f"jump of {name}", (space.entries,))
        return _Event(
            name, self._record(event.function, f"event {name}"), event.direction, _number_to_stop_at(name, event.stop), jump,
            None if event.heat_at is None else float(event.heat_at), bool(event.may_lower_entropy),
            None if event.resolution is None else float(event.resolution),
        )

    def paths(self, y0: Any, count: int, t: float | None = None, *, threads: int | None = None, **options: Any) -> list[Run]:
        """Runs many paths of a system with noise from one start, on all cores: the numbers of path k are those of ``path=k``.

        Parameters
        ----------
        count : int
            How many paths.
        threads : int, optional
            How many threads; all cores without it. The runs do not depend on it.
        options
            Those of ``run``.
        """
        start = self.space.flat(y0)
        return self.runs(np.tile(start, (int(count), 1)), t, threads=threads, **options)

    def runs(self, starts: Any, t: float | None = None, *, threads: int | None = None, **options: Any) -> list[Run]:
        """Runs from many starts, the rows of an array of the shape (count, n), on all cores. Each run of a system with noise has a path of
        its own.

        Raises
        ------
        RunError, ModelError
            Of the first run that failed.
        """
        starts = np.ascontiguousarray(np.atleast_2d(np.asarray(starts, dtype=float)))
        if starts.shape[1] != self.space.entries:
            raise ValueError(f"starts are rows of {self.space.entries} numbers, not of {starts.shape[1]}")
        if not len(starts):
            return []
        request = {"y0": starts[0], "t": t, **options}
        watched = {
            name: self._record(f, f"observable {name}", None)  # type: ignore[arg-type]
            for name, f in (request.pop("observables", None) or {}).items()
        }
        chosen, _, times, found = self._asked(**request)
        outcomes = self._raw.runs(chosen, starts, times, found, threads or os.cpu_count() or 1)
        runs = []
        for k, outcome in enumerate(outcomes):
            asked = {**request, "y0": starts[k], "events": found, "path": chosen.path + k}
            if isinstance(outcome, BaseException):
                partial = getattr(outcome, "partial", None)
                outcome.partial = None if partial is None else Run.of(partial, self, asked, watched)  # type: ignore[attr-defined]
                raise outcome
            runs.append(Run.of(outcome, self, asked, watched))
        return runs

    # Derivatives.

    def tangent(
        self, y0: Any, t: float | None = None, *, along: Iterable[str] | None = None, sizes: Mapping[str, Any] | None = None,
        accuracy: float | None = None, progress: Any = False, **options: Any,
    ) -> Tangent:
        """Runs with the derivatives of the states along the start and the parameters.

        Steps that follow a tolerance are frozen. Without parameters the derivatives of a closed system on a vector space are those of the
        discrete steps to round-off; along parameters they are differences of steps beside each step, with some ten digits.

        Parameters
        ----------
        along : list of str, optional
            The parameters; all of them without it, and none for ``[]``.
        sizes : dict, optional
            Sizes of parameters that are zero: differences are a part of them.
        accuracy : float, optional
            Repeats the run with shorter steps until the derivatives at the ends of two runs agree to it.
        options
            Those of ``run``.
        """
        chosen, start, times, found = self._asked(y0=y0, t=t, **options)
        names, places, widths = self._along(along, sizes)
        end = times.end if times.end is not None else times.start
        with _progress(progress, times.start, end) as look:
            raw = _door.tangent(self._raw, chosen, start, times, found, places, widths, accuracy, look)
        events = [
            {**{key: value for key, value in event.items() if "parameters" not in key},
             **({} if "error" in event else {
                 "along": self._parted(event["along_parameters"], names),
                 "time_along": self._parted(event["time_along_parameters"], names),
             })}
            for event in raw["events"]
        ]
        ledger = {name: (start_, self._parted(rest, names)) for name, (start_, rest) in raw["ledger"].items()}
        return Tangent(
            raw["t"], raw["y"], raw["along_start"], self._parted(raw["along_parameters"], names), ledger, events,
            Certificate(raw["certificate"]), raw["sensitivity"],
        )

    def gradient(
        self, loss: Function, y0: Any, t: float | None = None, *, along: Iterable[str] | None = None,
        sizes: Mapping[str, Any] | None = None, **options: Any,
    ) -> tuple[float, np.ndarray, dict[str, Any]]:
        """Evaluates a loss over the recorded states of a run, and its derivatives, by the transposed discrete steps: also where an event jumps
        or ends the run, whose time depends on the start.

        Parameters
        ----------
        loss : function
            A number from the states, an array of the shape (m, n); it is recorded. The states are the start, the outputs and the end.
        along, sizes
            As in ``tangent``.

        Returns
        -------
        value : float
        start : array (directions,)
            The derivative along the start, in the frame there: along its entries on a vector space.
        parameters : dict
            The derivative along each parameter.
        """
        def weigh(run: Mapping[str, Any]) -> tuple[float, np.ndarray]:
            y = run["y"]
            program = trace(loss, [y.shape], out=(), name="loss")
            value, slope = _door.gradient(program, np.ascontiguousarray(y.ravel()))
            return value, np.ascontiguousarray(slope.reshape(y.shape))

        return self._pull_back(weigh, along=along, sizes=sizes, y0=y0, t=t, **options)

    def _pull_back(self, weigh, *, along=None, sizes=None, **options):
        chosen, start, times, found = self._asked(**options)
        names, places, widths = self._along(along, sizes)
        value, start_, rest = _door.pull_back(self._raw, chosen, start, times, found, weigh, places, widths)
        parts = self._parted(rest, names)
        return value, start_, {name: float(x) if np.ndim(x) == 0 else x for name, x in parts.items()}

    def _along(self, along, sizes):
        names = list(self._values) if along is None else [along] if isinstance(along, str) else list(along)
        sizes = dict(sizes or {})
        places, widths, at = [], [], 0
        where = {}
        for name, value in self._values.items():
            where[name] = at
            at += value.size
        for name in [*names, *sizes]:
            if name not in where:
                raise TypeError(f"there is no parameter {name!r}; there are {', '.join(where) or 'none'}")
        for name in names:
            value = np.abs(self._values[name]).ravel()
            typical = math.sqrt(float(np.mean(value**2))) if value.size else 0.0
            size = np.broadcast_to(np.asarray(sizes.get(name, np.where(value > 0, value, typical).reshape(self._values[name].shape)),
                                              dtype=float), self._values[name].shape).ravel()
            if not (np.isfinite(size).all() and (size > 0).all()):
                raise ModelError(
                    f"the parameter {name} is zero, so that a difference along it has no size; name one by `sizes={{\"{name}\": ..}}`"
                )
            places += [where[name] + k for k in range(value.size)]
            widths += [float(x) for x in size]
        return names, places, widths

    def _parted(self, rows: np.ndarray, names: list[str]) -> dict[str, np.ndarray]:
        parts, at = {}, 0
        for name in names:
            shape, size = self._values[name].shape, self._values[name].size
            parts[name] = rows[..., at : at + size].reshape(rows.shape[:-1] + shape)
            at += size
        return parts


def _value(name: str, value: Any) -> np.ndarray:
    if name in ("t", "x", "w"):
        raise ValueError(f"a parameter cannot be called {name!r}, which is the name of another argument")
    number = np.array(value, dtype=float)
    if not np.isfinite(number).all():
        raise ModelError(f"the parameter {name} is {value!r}; it must be finite")
    return number


def _names(f: Function) -> list[str]:
    """The names of the arguments of a function."""
    if isinstance(f, Program):
        return []
    try:
        parameters = inspect.signature(f).parameters.values()
    except (TypeError, ValueError):
        return ["x"]
    return [p.name for p in parameters if p.kind not in (p.VAR_POSITIONAL, p.VAR_KEYWORD)]


def _listed(part: Any) -> list[Any]:
    return [part.reshape(-1)[k] for k in range(math.prod(part.shape))] if hasattr(part, "reshape") else list(np.ravel(np.asarray(part, dtype=object)))


def _size_of(program: Program) -> str:
    return f"{len(program.ops)} operations"


class _progress:
    """A function of the time that is reached, which moves a bar."""

    def __init__(self, asked: Any, start: float, end: float):
        self.asked, self.start, self.end, self.bar = asked, start, end, None

    def __enter__(self):
        if callable(self.asked):
            return self.asked
        if not self.asked:
            return None
        try:
            from tqdm.auto import tqdm
        except ImportError:
            return None
        self.bar = tqdm(total=self.end - self.start, unit="t", bar_format="{l_bar}{bar}| {n:.4g}/{total:.4g} [{elapsed}<{remaining}]")
        return lambda time: self.bar.update(time - self.start - self.bar.n)

    def __exit__(self, kind, *_):
        if self.bar is not None:
            if kind is None:
                self.bar.update(self.bar.total - self.bar.n)
            self.bar.close()
