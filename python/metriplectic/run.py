"""Runs, their certificates and their derivatives: arrays that pickle."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Mapping

import numpy as np

if TYPE_CHECKING:
    from .system import System


class Certificate:
    """The balance of a run: what became of both laws. ``print`` it for its words.

    Attributes
    ----------
    steps, rejected : int
        Steps taken, and steps that were tried and given up.
    keeps_energy, keeps_entropy, keeps_invariants : bool
        Whether each law holds to round-off, on every step.
    initial_energy, max_energy_error, max_relative_energy_error : float
        H(x₀), the largest \\|H − H₀\\| and the same relative to \\|H₀\\|, in the unit of the energy and without one.
    entropy_gained, min_entropy_increment : float
        S(x_n) − S(x₀) and the least change in a step, in the unit of the entropy.
    entropy_falls : int
        Steps on which the entropy fell by more than its round-off.
    events : dict
        How often each event has happened, by its name.
    """

    def __init__(self, numbers: Mapping[str, Any]):
        self.__dict__.update(numbers)

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(f"a certificate has no {name!r}; it has {', '.join(sorted(self.__dict__))}")

    def __reduce__(self):
        return Certificate, (dict(self.__dict__),)

    def __str__(self) -> str:
        return self.__dict__["text"]

    __repr__ = __str__


@dataclass(frozen=True)
class FoundEvent:
    """An event of a run: its name, whether its function rises through zero, the time ``t`` and the entries ``y`` of the state there.
    A jump leads to ``after``, and brings ``work`` and ``heat`` into the system."""

    name: str
    t: float
    rises: bool
    y: np.ndarray
    after: np.ndarray | None = None
    work: float = 0.0
    heat: float = 0.0

    def __str__(self) -> str:
        return f"{self.name} {'rises' if self.rises else 'falls'} at t = {self.t:.7g}"


@dataclass
class Run:
    """The recorded states of a run: m of them, with n entries each.

    Attributes
    ----------
    t : array (m,)
        The times.
    y : array (m, n)
        The entries of the states.
    energy, entropy : array (m,)
        H and S of the system at them.
    balance, total_entropy : array (m,)
        H − W − Q, which stays what it was, and S with the entropy of the baths; those of a closed system are H and S.
    ledger : dict of arrays (m,)
        Work and heat that have flowed in since the start: ``work`` of the time in the energy, ``work of <port>``, ``heat of <bath>``,
        ``entropy of <bath>``; empty for a closed system.
    observables : dict of arrays
        The functions that were asked for, at the states.
    events : list of FoundEvent
    certificate : Certificate
    ending : str
        ``"end"``, ``"rest"``, ``"event"`` or ``"stopped"``.
    """

    t: np.ndarray
    y: np.ndarray
    energy: np.ndarray
    entropy: np.ndarray
    balance: np.ndarray
    total_entropy: np.ndarray
    step: np.ndarray
    ledger: dict[str, np.ndarray]
    events: list[FoundEvent]
    certificate: Certificate
    ending: str
    system: "System"
    request: dict[str, Any] = field(repr=False, default_factory=dict)
    observables: dict[str, np.ndarray] = field(default_factory=dict)

    @classmethod
    def of(cls, raw: Mapping[str, Any], system: "System", request: dict[str, Any], observables=None) -> "Run":
        events = [
            FoundEvent(e["name"], e["t"], e["rises"], e["y"], e["after"], e["work"], e["heat"]) for e in raw["events"]
        ]
        arrays = {name: raw[name] for name in ("t", "y", "energy", "entropy", "balance", "total_entropy", "step")}
        run = cls(
            **arrays, ledger=raw["ledger"], events=events, certificate=Certificate(raw["certificate"]), ending=raw["ending"][0],
            system=system, request=request,
        )
        for name, program in (observables or {}).items():
            run.observables[name] = system._observed(program, run.t, run.y)
        return run

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        head = f"<Run of {len(self)} states, t = {self.t[0]:g} … {self.t[-1]:g}, {len(self.events)} events, ending: {self.ending}>"
        return f"{head}\n{self.certificate}"

    @property
    def state(self) -> Any:
        """The states in the shape of the space: for a product a tuple of arrays of the shapes ``(m, ...)``."""
        return self.system.space.shaped(self.y)

    def tangent(self, **changes: Any) -> "Tangent":
        """Runs again, with the derivatives along the start and the parameters; see ``System.tangent``."""
        return self.system.tangent(**{**self.request, **changes})

    def vjp(self, weights: Any, along: Any = None, sizes: Any = None) -> tuple[np.ndarray, dict[str, Any]]:
        """Pulls weights on the recorded states back to the start and the parameters, by the transposed discrete steps.

        Parameters
        ----------
        weights : array (m, n)
            The derivatives of a number along the entries ``y``.

        Returns
        -------
        start : array (directions,)
            The derivative along the start, in the frame there: along its entries on a vector space.
        parameters : dict
            The derivative along each parameter, in the shape of the parameter.
        """
        weights = np.ascontiguousarray(weights, dtype=float)
        if weights.shape != self.y.shape:
            raise ValueError(f"the weights have the shape {weights.shape}, and the states {self.y.shape}")

        def weigh(again: Mapping[str, Any]) -> tuple[float, np.ndarray]:
            return float(np.sum(weights * again["y"])), weights

        _, start, parameters = self.system._pull_back(weigh, along=along, sizes=sizes, **self.request)
        return start, parameters

    def to_pandas(self) -> Any:
        """Makes a table of pandas: the index is the time; columns are the entries ``y0``, ``y1``, …, the laws, the ledger and the
        observables."""
        import pandas

        columns = {f"y{k}": self.y[:, k] for k in range(self.y.shape[1])}
        columns |= {"energy": self.energy, "entropy": self.entropy}
        columns |= self.ledger
        for name, values in self.observables.items():
            flat = values.reshape(len(self), -1)
            columns |= {name: flat[:, 0]} if flat.shape[1] == 1 else {f"{name}{k}": flat[:, k] for k in range(flat.shape[1])}
        return pandas.DataFrame(columns, index=pandas.Index(self.t, name="t"))

    def plot(self, path: str | None = None) -> Any:
        """Draws the entries, the error of the energy and the entropy over the time, by matplotlib, and returns the figure.

        Parameters
        ----------
        path : str, optional
            A file to which the figure is written.
        """
        from matplotlib.figure import Figure

        figure = Figure(figsize=(7, 6.5), layout="constrained")
        entries, laws, entropy = figure.subplots(3, 1, sharex=True, height_ratios=[2, 1, 1])
        for k in range(self.y.shape[1]):
            entries.plot(self.t, self.y[:, k], label=f"$x_{{{k}}}$" if self.y.shape[1] <= 10 else None)
        if self.y.shape[1] <= 10:
            entries.legend(loc="upper right", ncols=2, fontsize="small")
        for event in self.events[:200]:
            entries.axvline(event.t, color="0.8", linewidth=0.6, zorder=0)
        entries.set_ylabel("state")
        laws.plot(self.t, self.balance - self.balance[0], color="C3")
        laws.set_ylabel("$H - H_0$" if not self.ledger else "$\\Delta H - W - Q$")
        entropy.plot(self.t, self.total_entropy, color="C2")
        entropy.set_ylabel("$S$" if not self.ledger else "$S$ with baths")
        entropy.set_xlabel("t")
        if path is not None:
            figure.savefig(path)
        return figure


@dataclass
class Tangent:
    """A run with the derivatives of its states: m states with n entries, d directions at the start and p parameters.

    Attributes
    ----------
    t, y : arrays (m,), (m, n)
        The times, and the entries of the states.
    along_start : array (m, n, d)
        ∂y/∂x₀, from the frame of the chart at the start: along its entries on a vector space.
    along : dict
        ∂y/∂θ for each parameter, of the shape ``(m, n, ...)`` with the shape of the parameter behind.
    ledger : dict
        For each column of the ledger the pair of its derivatives ``(along_start, along)``.
    events : list of dict
        ``name``, ``t``, ``time_along_start``, ``time_along``, ``along_start`` and ``along``; ``error`` if it has no derivative.
    sensitivity : dict
        The errors of the laws of the tangent, dH(x_k) T_k = dH(x₀) T_0, relative to their terms; ``text`` has its words.
    """

    t: np.ndarray
    y: np.ndarray
    along_start: np.ndarray
    along: dict[str, np.ndarray]
    ledger: dict[str, Any]
    events: list[dict[str, Any]]
    certificate: Certificate
    sensitivity: dict[str, Any]

    def __repr__(self) -> str:
        return f"<Tangent of {len(self.t)} states along the start and {', '.join(self.along) or 'no parameter'}>\n{self.sensitivity['text']}"
