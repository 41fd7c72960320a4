"""Pickles, tables, figures, sweeps, types, and what is said of objects."""

import multiprocessing
import pickle
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import metriplectic as mp
from models import body, oscillator, pendulum

START = [0.4, -1.0, 0.3]
GRID = {"gamma": [0.1, 0.2, 0.4], "length": [0.5, 1.0]}


def test_systems_and_runs_pickle_though_their_functions_were_lambdas():
    for system, start in ((body(), START), (pendulum()(gamma=0.7), [1.0, 0.0, 0.0]), (oscillator(), [1.0, 0.0])):
        copy = pickle.loads(pickle.dumps(system))
        run, again = system.run(start, t=2.0), copy.run(start, t=2.0)
        assert (run.y == again.y).all() and repr(copy) == repr(system)
        read = pickle.loads(pickle.dumps(run))
        assert (read.y == run.y).all() and str(read.certificate) == str(run.certificate)
        assert (read.tangent(h=0.1, along=[]).y == run.tangent(h=0.1, along=[]).y).all()
    checked = pickle.loads(pickle.dumps(body().verified(START)))
    assert checked.run(START, t=1.0).certificate.verified_before


def test_tables_and_figures(tmp_path):
    pandas = pytest.importorskip("pandas")
    run = oscillator().run([1.0, 0.0], t=2.0, every=0.5, observables={"q": lambda x: x[0]})
    table = run.to_pandas()
    assert isinstance(table, pandas.DataFrame) and table.index.name == "t" and len(table) == 5
    assert {"y0", "y1", "energy", "entropy", "work of push", "heat of air", "q"} <= set(table.columns)
    pytest.importorskip("matplotlib")
    path = tmp_path / "run.png"
    run.plot(str(path))
    assert path.stat().st_size > 10_000


def test_what_is_said_of_objects():
    assert repr(mp.so3_dual() * mp.R(1)) == "so3_dual() * R(1)"
    assert repr(pendulum()).startswith("<System on R(3); energy: ") and "gamma = 0.3" in repr(pendulum())
    run = body().run(START, t=1.0, every=0.5)
    assert repr(run).startswith("<Run of 3 states, t = 0 … 1, 0 events, ending: end>\nfirst law:")
    with pytest.raises(AttributeError, match="keeps_energy"):
        run.certificate.keeps_enrgy


def test_a_sweep_does_not_depend_on_threads_or_processes():
    options = dict(y0=[1.2, 0.0, 0.0], t=3.0, tol=1e-8)
    one = mp.sweep(pendulum(), GRID, threads=1, **options)
    assert len(one) == 6 and one["gamma"].tolist() == [0.1, 0.1, 0.2, 0.2, 0.4, 0.4] and one["energy_error"].max() < 1e-14
    assert mp.sweep(pendulum(), GRID, threads=3, **options).rows == one.rows
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        assert mp.sweep(pendulum(), GRID, map=pool.map, **options).rows == one.rows


def test_a_cluster_of_dask_has_the_same_table():
    dask = pytest.importorskip("dask")
    distributed = pytest.importorskip("distributed")
    options = dict(y0=[1.2, 0.0, 0.0], t=3.0, tol=1e-8)
    one = mp.sweep(pendulum(), GRID, threads=1, **options)
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        with distributed.Client(cluster):
            many = mp.sweep(pendulum(), GRID, map=lambda f, rows: dask.compute(*[dask.delayed(f)(row) for row in rows]), **options)
    assert many.rows == one.rows


def test_joblib_has_the_same_table():
    joblib = pytest.importorskip("joblib")
    options = dict(y0=[1.2, 0.0, 0.0], t=3.0, tol=1e-8)
    one = mp.sweep(pendulum(), GRID, threads=1, **options)
    many = mp.sweep(pendulum(), GRID, map=lambda f, rows: joblib.Parallel(n_jobs=2)(joblib.delayed(f)(row) for row in rows), **options)
    assert many.rows == one.rows


def test_ray_has_the_same_table():
    ray = pytest.importorskip("ray")
    options = dict(y0=[1.2, 0.0, 0.0], t=3.0, tol=1e-8)
    one = mp.sweep(pendulum(), GRID, threads=1, **options)
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    try:
        many = mp.sweep(
            pendulum(), GRID, map=lambda f, rows: ray.get([ray.remote(lambda row: f(row)).remote(row) for row in rows]), **options
        )
    finally:
        ray.shutdown()
    assert many.rows == one.rows


def test_a_journal_takes_a_sweep_up_again(tmp_path):
    path, options = tmp_path / "sweep.jsonl", dict(y0=[1.2, 0.0, 0.0], t=3.0)
    whole = mp.sweep(pendulum(), GRID, journal=path, **options)
    lines = path.read_text().splitlines()
    # Three rows are done, and the fourth was cut off.
    path.write_text("\n".join(lines[:3]) + "\n" + lines[3][:40])
    runs = []

    def counted(run):
        runs.append(1)
        return mp.sweeps.last(run)

    again = mp.sweep(pendulum(), GRID, journal=path, observe=counted, **options)
    assert len(runs) == 3 and again.rows == whole.rows
    with pytest.raises(ValueError, match="another sweep"):
        mp.sweep(pendulum(), {"gamma": [0.9]}, journal=path, **options)


def test_a_row_that_fails_says_why():
    table = mp.sweep(pendulum(), {"length": [1.0, -1.0]}, y0=lambda row: [1.0, np.nan if row["length"] < 0 else 0.0, 0.0], t=1.0)
    assert "error" in table.rows[1] and "error" not in table.rows[0] and np.isnan(table["y0"][1])


def test_the_types_are_those_of_the_stubs(tmp_path):
    pytest.importorskip("mypy")
    package = Path(mp.__file__).parent
    assert (package / "py.typed").exists()
    program = tmp_path / "program.py"
    program.write_text(
        "import metriplectic as mp\n"
        "run = mp.System(mp.R(2), energy=lambda x: x @ x).run([1.0, 0.0], t=1.0)\n"
        "reveal_type(run.y)\n"
        "mp.R('3')\n"
    )
    command = [sys.executable, "-m", "mypy", "--config-file=", "--ignore-missing-imports", str(package), str(program)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    errors = [line for line in done.stdout.splitlines() if ": error:" in line]
    assert len(errors) == 1 and "program.py:4" in errors[0] and "incompatible type" in errors[0], done.stdout
    assert "ndarray" in done.stdout


def test_the_examples_of_the_docstrings_hold():
    import doctest

    import metriplectic.system

    assert doctest.testmod(metriplectic.system).failed == 0
