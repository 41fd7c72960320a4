"""Fits of parameters to data by least squares, with standard errors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Iterable, Mapping

import numpy as np

from . import _metriplectic as _door
from ._metriplectic import ModelError, RunError
from .system import Function, System

#: The part of the largest singular value below which the data do not see a combination of the unknowns.
UNSEEN = 1e-7
#: The longest step of a logarithm.
STEEP = 3.0


@dataclass(frozen=True)
class Estimate:
    """An estimate of a parameter: its name, its value and its standard error, in the unit of the parameter.

    ``positive`` says whether its logarithm was fitted, and ``at_bound`` whether the data do not tell it from zero then.
    """

    name: str
    value: float
    standard_error: float
    positive: bool = False
    at_bound: bool = False

    def interval(self, q: float = 2.0) -> tuple[float, float]:
        """The interval of q standard errors; θ exp(±q s/θ) if the logarithm was fitted."""
        if self.positive:
            width = q * self.standard_error / self.value
            return self.value * math.exp(-width), self.value * math.exp(width)
        return self.value - q * self.standard_error, self.value + q * self.standard_error


@dataclass(frozen=True)
class Fit:
    """The result of a fit. ``print`` it for each parameter with its standard error, and for what the data do not tell apart.

    Attributes
    ----------
    estimates : list of Estimate
        The free parameters, entry by entry, and then the coordinates of a free start.
    parameters : dict
        All parameters, fixed ones too.
    start : array
        The entries of the start.
    system : System
        The system at the parameters that were found.
    chi_squared : float
        The sum of squares of the residuals in units of the noise; of the residuals themselves if it is not known.
    degrees : int
        The numbers that were measured less the unknowns.
    noise : float
        √(χ²/degrees): near 1 if the noise was given and the model is right, and an estimate of the noise otherwise.
    covariance : array
        That of the unknowns: of logarithms for parameters that are fitted so.
    runs : int
        Runs with derivatives that were made.
    ending : str
        ``"minimum"``, or ``"unfinished"`` if the iterations ran out.
    """

    estimates: list[Estimate]
    parameters: dict[str, Any]
    start: np.ndarray
    system: System
    chi_squared: float
    degrees: int
    noise: float
    noise_is_known: bool
    covariance: np.ndarray
    unseen: list[str]
    correlated: list[tuple[str, str, float]]
    runs: int
    ending: str

    def __str__(self) -> str:
        lines = []
        for estimate in self.estimates:
            bound = "; not told from zero" if estimate.at_bound else ""
            lines.append(f"{estimate.name:<12} {estimate.value:.6g} ± {estimate.standard_error:.1e}{bound}")
        lines += [f"correlated:  {a} and {b}, {r:+.3f}" for a, b, r in self.correlated]
        lines += [f"not seen:    {combination}" for combination in self.unseen]
        known = "in units of the noise that was given" if self.noise_is_known else "estimated"
        lines.append(f"noise:       {self.noise:.3g} ({known}), {self.degrees} degrees of freedom")
        lines.append(f"ending:      {self.ending} after {self.runs} runs")
        return "\n".join(lines)

    __repr__ = __str__


def fit(
    system: System,
    times: Any,
    data: Any,
    *,
    start: Any,
    observe: Function | None = None,
    free: Iterable[str] | None = None,
    positive: Iterable[str] | bool = (),
    free_start: bool = False,
    noise: Any = None,
    iterations: int = 100,
    sizes: Mapping[str, Any] | None = None,
    **options: Any,
) -> Fit:
    """Finds the parameters with which a run comes nearest to data, by the method of Levenberg and Marquardt.

    The parameters of the system are the guess. A trial is one run with its derivatives. Runs should be more accurate than the noise: an
    error of the runs is an error of the parameters that no standard error shows.

    Parameters
    ----------
    times : array (m,)
        The times of the rows, in rising order, from the start of the run on.
    data : array (m, k)
        What was measured, a row for each time; NaN is a number that is missing.
    start : array or tuple
        The state at the start; a guess with ``free_start``.
    observe : function, optional
        What is measured of a state, ``observe(x, ..)`` of the shape ``(k,)``; all entries without it.
    free : list of str, optional
        The parameters that are fitted; all without it.
    positive : list of str, or True for all
        Parameters whose logarithms are fitted.
    noise : number or array (k,), optional
        The standard deviation of the data; estimated from the residuals without it.
    options
        Those of ``System.run``, such as ``method`` and ``tol``; 1e-8 without one.

    Raises
    ------
    ModelError, RunError
        If there is no run at the guess, or no minimum is found.
    """
    times = np.asarray(times, dtype=float).ravel()
    data = np.asarray(data, dtype=float)
    data = data[:, None] if data.ndim == 1 else data
    if len(times) != len(data) or not len(times):
        raise ValueError(f"there are {len(times)} times and {len(data)} rows of data")
    if (np.diff(times) <= 0).any():
        raise ValueError("the times of the data must rise")
    space, n = system.space, system.space.entries
    if free_start and not space.is_vector_space:
        raise ValueError("a start is fitted on a vector space alone")
    start = space.flat(start)
    names = list(system.parameters) if free is None else list(free)
    logs = set(names if positive is True else (() if positive is False else positive))
    for name in [*names, *logs]:
        if name not in system.parameters:
            raise TypeError(f"there is no parameter {name!r}; there are {', '.join(system.parameters) or 'none'}")
    program = None if observe is None else system._record(observe, "observe", None)  # type: ignore[arg-type]
    width = n if program is None else len(program.outputs)
    if data.shape[1] != width:
        raise ValueError(f"the data have {data.shape[1]} columns, and {width} numbers are observed")
    sigma = np.broadcast_to(np.asarray(1.0 if noise is None else noise, dtype=float), (width,))
    if not ((sigma > 0).all() and np.isfinite(sigma).all()):
        raise ValueError("the noise must be positive and finite")
    seen = np.isfinite(data)
    shapes = {name: np.shape(system.parameters[name]) for name in names}
    guess = {name: np.asarray(system.parameters[name], dtype=float) for name in names}
    for name in logs & set(names):
        if (guess[name] <= 0).any():
            raise ModelError(f"the guess of the parameter {name} is not positive; its logarithm is fitted")
    flat = [(name, k) for name in names for k in range(guess[name].size)]
    is_log = np.array([name in logs for name, _ in flat] + [False] * (n if free_start else 0), dtype=bool)
    first = np.concatenate([guess[name].ravel() for name in names] + [start if free_start else np.zeros(0)])
    unknowns = len(first)
    if int(seen.sum()) <= unknowns:
        raise ValueError(f"{int(seen.sum())} numbers were measured, too few for {unknowns} unknowns")
    options = {"tol": 1e-8, **options}
    options.setdefault("t", None if "steps" in options else float(times[-1]))
    begin = float(options.get("t0", 0.0))
    runs = 0

    def at(phi: np.ndarray) -> tuple[System, np.ndarray, np.ndarray]:
        theta = np.where(is_log, np.exp(phi), phi)
        values, k = {}, 0
        for name in names:
            size = guess[name].size
            values[name] = theta[k : k + size].reshape(shapes[name])
            k += size
        return system(**values), theta[k:] if free_start else start, theta

    def squares(phi: np.ndarray, raises: bool = False):
        nonlocal runs
        runs += 1
        try:
            with np.errstate(over="ignore"):
                there, x0, theta = at(phi)
            found = there.tangent(x0, at=times, along=names, sizes=sizes, **options)
        except (ModelError, RunError):
            if raises:
                raise
            return None
        places = np.searchsorted(found.t, times)
        if (places >= len(found.t)).any() or np.any(found.t[np.minimum(places, len(found.t) - 1)] != times):
            if raises:
                raise RunError(f"the run ends at t = {found.t[-1]:g}, before the last row of the data")
            return None
        y = found.y[places]
        slope = np.concatenate([found.along[name][places].reshape(len(times), n, -1) for name in names]
                               + ([found.along_start[places]] if free_start else []) + [np.zeros((len(times), n, 0))], axis=2)
        if program is None:
            values, jacobian = y, slope
        else:
            rest = np.tile(there._theta(), (len(times), 1)).reshape(len(times), -1)
            values, along = _door.jacobian(program, np.ascontiguousarray(np.hstack([y, times[:, None], rest])))
            jacobian = np.einsum("mki,mij->mkj", along[:, :, :n], slope)
            at_theta = along[:, :, n + 1 :]
            column = 0
            for name in names:
                place = there._along([name], {name: 1.0})[1]
                jacobian[:, :, column : column + len(place)] += at_theta[:, :, place]
                column += len(place)
        residuals = ((values - data) / sigma)[seen]
        jacobian = (jacobian / sigma[:, None])[seen] * np.where(is_log, theta, 1.0)
        if not (np.isfinite(residuals).all() and np.isfinite(jacobian).all()):
            return None
        return np.ascontiguousarray(residuals), np.ascontiguousarray(jacobian)

    if begin > times[0]:
        raise ValueError("a time of the data is before the start of the run")
    phi0 = np.where(is_log, np.log(np.where(is_log, first, 1.0)), first)
    squares(phi0, raises=True)
    limits = [STEEP if log else math.inf for log in is_log]
    best, converged = _door.least_squares(squares, [float(x) for x in phi0], limits, int(iterations))
    at_best = squares(best, raises=True)
    if at_best is None:
        raise RunError("the residuals are not finite at the parameters that were found")
    residuals, jacobian = at_best
    chi, degrees = float(residuals @ residuals), len(residuals) - unknowns
    labels = system._flat_names()
    label = {name: labels[system._along([name], {name: 1.0})[1][0] :] for name in names}
    titles = [label[name][k] for name, k in flat] + ([f"start[{k}]" for k in range(n)] if free_start else [])
    covariance, unseen = _covariance(jacobian, 1.0 if noise is not None else chi / degrees, titles)
    found, x0, theta = at(best)
    errors = np.sqrt(np.diag(covariance))
    estimates = [
        Estimate(titles[k], float(theta[k]), float(errors[k] * (theta[k] if is_log[k] else 1.0)), bool(is_log[k]),
                 bool(is_log[k] and not errors[k] <= 1.0))
        for k in range(unknowns)
    ]
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = covariance / np.outer(errors, errors)
    correlated = [
        (titles[i], titles[j], float(correlation[i, j])) for i in range(unknowns) for j in range(i) if abs(correlation[i, j]) > 0.95
    ]
    return Fit(
        estimates, found.parameters, np.array(x0), found, chi, degrees, math.sqrt(chi / degrees), noise is not None, covariance, unseen,
        correlated, runs, "minimum" if converged else "unfinished",
    )


def _covariance(jacobian: np.ndarray, variance: float, titles: list[str]) -> tuple[np.ndarray, list[str]]:
    """Computes s² (JᵀJ)⁻¹ by the singular values of the columns at length one, infinite along what the data do not see."""
    lengths = np.linalg.norm(jacobian, axis=0)
    lengths = np.where(lengths > 0, lengths, np.finfo(float).tiny)
    _, values, v = np.linalg.svd(jacobian / lengths, full_matrices=False)
    blind = ~(values > UNSEEN * values.max())
    rows = v.T
    with np.errstate(divide="ignore", invalid="ignore"):
        weights = np.where(blind, 0.0, 1.0 / values**2)
        covariance = variance * (rows * weights) @ rows.T / np.outer(lengths, lengths)
    unseen = []
    for k in np.flatnonzero(blind):
        parts = np.abs(rows[:, k]) > UNSEEN
        covariance[np.ix_(parts, parts)] = math.inf
        named = [f"{rows[i, k]:+.2f} {titles[i]}" for i in np.argsort(-np.abs(rows[:, k])) if abs(rows[i, k]) > 1e-3]
        unseen.append(" ".join(named))
    return covariance, unseen
