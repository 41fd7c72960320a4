"""Sweeps of many runs: a table of what was observed, a row for each set of parameters."""

from __future__ import annotations

import itertools
import json
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Callable, Iterable, Mapping

import numpy as np

from ._metriplectic import Error
from .run import Run
from .system import System, _progress


@dataclass
class Sweep:
    """The table of a sweep: ``rows`` are dicts of the parameters and the numbers that were observed; one that failed has ``error``."""

    rows: list[dict[str, Any]]

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, column: str) -> np.ndarray:
        """A column as an array; NaN where a row has none."""
        return np.array([row.get(column, np.nan) for row in self.rows])

    def to_pandas(self) -> Any:
        """Makes a table of pandas."""
        import pandas

        return pandas.DataFrame(self.rows)

    def __repr__(self) -> str:
        failed = sum("error" in row for row in self.rows)
        return f"<Sweep of {len(self)} runs, {failed} failed>"


def sweep(
    system: System,
    grid: Mapping[str, Iterable[Any]] | Iterable[Mapping[str, Any]],
    y0: Any,
    t: float | None = None,
    *,
    observe: Callable[[Run], Mapping[str, Any]] | None = None,
    threads: int | None = None,
    journal: str | os.PathLike[str] | None = None,
    progress: Any = False,
    map: Callable[..., Iterable[Any]] | None = None,
    **options: Any,
) -> Sweep:
    """Runs a system at many values of its parameters, and makes a table.

    Parameters
    ----------
    grid : dict of lists, or list of dicts
        The values of each parameter, all combinations of which are run, or the rows themselves.
    y0 : array or function
        The start, or a function of the dict of a row.
    observe : function, optional
        Numbers of a run, as a dict; without it the last state, its laws and the steps. With ``map`` to other processes it must pickle.
    threads : int, optional
        All cores without it. The table does not depend on it.
    journal : path, optional
        A file to which each row is written when it is done. A sweep that begins again with it runs the rows that are missing.
    map : function, optional
        Maps a function over a list, in the order of the list, in place of threads: that of a pool of processes, or
        ``lambda f, rows: dask.compute(*[dask.delayed(f)(row) for row in rows])``. The page has those of joblib and ray.
    options
        Those of ``System.run``.

    Returns
    -------
    Sweep
    """
    if isinstance(grid, Mapping):
        rows: list[dict[str, Any]] = [dict(zip(grid, values)) for values in itertools.product(*grid.values())]
    else:
        rows = [dict(row) for row in grid]
    work = _Row(system, y0, t, observe or last, options)
    done = _read(journal, rows)
    left = [k for k in range(len(rows)) if k not in done]

    with _progress(progress, 0, len(rows)) as look, _Journal(journal, rows) as write:
        def take(k: int, row: dict[str, Any]) -> None:
            done[k] = row
            write(k, row)
            if look is not None:
                look(float(len(done)))

        if map is not None:
            for k, row in zip(left, map(work, [rows[k] for k in left])):
                take(k, row)
        else:
            pool = ThreadPoolExecutor(threads or os.cpu_count() or 1)
            try:
                for k, row in zip(left, pool.map(work, [rows[k] for k in left])):
                    take(k, row)
            finally:
                # After an interrupt the runs that have begun are the last ones.
                pool.shutdown(cancel_futures=True)
    return Sweep([{**rows[k], **done[k]} for k in range(len(rows))])


def last(run: Run) -> dict[str, float]:
    """The last state of a run, its laws, and what the laws say."""
    row = {"t": float(run.t[-1])} | {f"y{k}": float(y) for k, y in enumerate(run.y[-1])}
    return row | {
        "energy": float(run.energy[-1]), "entropy": float(run.entropy[-1]), "steps": int(run.certificate.steps),
        "energy_error": float(run.certificate.max_energy_error), "entropy_falls": int(run.certificate.entropy_falls),
    }


class _Row:
    """Runs a row: a class, so that it goes to other processes."""

    def __init__(self, system, y0, t, observe, options):
        self.system, self.y0, self.t, self.observe, self.options = system, y0, t, observe, options

    def __call__(self, row: dict[str, Any]) -> dict[str, Any]:
        try:
            start = self.y0(row) if callable(self.y0) else self.y0
            return dict(self.observe(self.system(**row).run(start, self.t, **self.options)))
        except Error as error:
            return {"error": str(error)}


def _key(k: int, row: Mapping[str, Any]) -> str:
    return json.dumps([k, {name: np.asarray(value, dtype=float).tolist() for name, value in row.items()}], sort_keys=True)


def _read(journal, rows) -> dict[int, dict[str, Any]]:
    """The rows of a journal that belong to this sweep. A last line that was cut off is left out."""
    if journal is None or not os.path.exists(journal):
        return {}
    keys, done = {_key(k, row): k for k, row in enumerate(rows)}, {}
    with open(journal, encoding="utf-8") as file:
        for line in file:
            try:
                key, row = json.loads(line)
            except ValueError:
                continue
            if key not in keys:
                raise ValueError(f"the journal {os.fspath(journal)!r} is that of another sweep: it has the row {key}")
            done[keys[key]] = row
    return done


class _Journal:
    """Writes rows to a file, if there is one."""

    def __init__(self, path, rows):
        self.path, self.rows, self.file = path, rows, None

    def __enter__(self):
        if self.path is not None:
            is_cut = os.path.exists(self.path) and os.path.getsize(self.path) > 0
            if is_cut:
                with open(self.path, "rb") as file:
                    file.seek(-1, os.SEEK_END)
                    is_cut = file.read(1) != b"\n"
            self.file = open(self.path, "a", encoding="utf-8")
            if is_cut:
                self.file.write("\n")
        return self.write

    def write(self, k: int, row: Mapping[str, Any]) -> None:
        if self.file is not None:
            plain = {name: value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value for name, value in row.items()}
            self.file.write(json.dumps([_key(k, self.rows[k]), plain]) + "\n")
            self.file.flush()

    def __exit__(self, *_):
        if self.file is not None:
            self.file.close()
