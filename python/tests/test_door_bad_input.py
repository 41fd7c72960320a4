"""Bad input: clear errors, and never the end of the interpreter."""

import gc
import random
import resource
import time

import numpy as np
import pytest

import metriplectic as mp
from models import body

ENTROPY = lambda p: 0.5 * p @ p


@pytest.mark.parametrize("start, error", [
    ([np.nan, 1.0, 2.0], mp.ModelError), ([np.inf, 1.0, 2.0], mp.ModelError), ([1.0, 2.0], ValueError), ([1.0] * 4, ValueError),
    (["a", 1.0, 2.0], ValueError), (None, (TypeError, ValueError)), ([[1.0, 2.0, 3.0]] * 2, ValueError),
])
def test_a_start_that_is_no_state(start, error):
    with pytest.raises(error):
        body().run(start, t=1.0)


def test_a_start_off_the_sphere():
    with pytest.raises(mp.ModelError):
        mp.System(mp.sphere(2), energy=lambda n: n[2]).run([1.0, 1.0, 1.0], t=1.0)


def test_a_function_that_raises_is_a_trace_error_with_its_cause():
    def energy(p):
        raise KeyError("no such inertia")

    with pytest.raises(mp.TraceError, match="no such inertia") as caught:
        mp.System(mp.so3_dual(), energy=energy, entropy=ENTROPY)
    assert isinstance(caught.value.__cause__, KeyError) and "test_door_bad_input.py" in str(caught.value)


@pytest.mark.parametrize("energy", [
    lambda p: p, lambda p: "energy", lambda p: None, lambda p: {"H": p[0]}, lambda p: 1j * p[0], lambda p: p[0] if p[0] > 0 else p[1],
    lambda p: p @ np.eye(2) @ p, lambda p: random.random() * p[0], lambda p: np.random.rand() * p[0], lambda p: time.perf_counter() * p[0],
])
def test_what_cannot_be_recorded_is_a_trace_error(energy):
    with pytest.raises(mp.TraceError):
        mp.System(mp.so3_dual(), energy=energy, entropy=ENTROPY)


def test_a_function_that_counts_its_calls_is_refused():
    calls = []

    def energy(p):
        calls.append(1)
        return len(calls) * p @ p

    with pytest.raises(mp.TraceError):
        mp.System(mp.so3_dual(), energy=energy, entropy=ENTROPY)


def test_a_function_that_writes_into_its_argument_is_refused():
    def energy(p):
        p *= 2.0
        return 0.125 * p @ (p / np.array([3.0, 2.0, 1.0]))

    with pytest.raises(mp.TraceError, match="copy"):
        mp.System(mp.so3_dual(), energy=energy, entropy=ENTROPY)

    def on_a_copy(p):
        p = p.copy()
        p *= 2.0
        return 0.125 * p @ (p / np.array([3.0, 2.0, 1.0]))

    changed = mp.System(mp.so3_dual(), energy=on_a_copy, entropy=ENTROPY)
    plain = mp.System(mp.so3_dual(), energy=lambda p: 0.5 * p @ (p / np.array([3.0, 2.0, 1.0])), entropy=ENTROPY)
    start = np.array([0.4, -1.0, 0.3])
    assert np.allclose(changed.run(start, t=2.0, h=0.1).y, plain.run(start, t=2.0, h=0.1).y, atol=1e-12)
    assert start.tolist() == [0.4, -1.0, 0.3]


@pytest.mark.parametrize("arguments, error", [
    (dict(space=3), TypeError), (dict(energy=3.0), TypeError), (dict(friction=-1.0), mp.ModelError),
    (dict(friction=float("nan")), mp.ModelError), (dict(poisson=np.eye(2)), ValueError), (dict(poisson="Poisson"), ValueError),
    (dict(poisson=np.zeros((3, 3)), almost_poisson=np.zeros((3, 3))), ValueError), (dict(parameters={"t": 1.0}), ValueError),
    (dict(parameters={"a": np.nan}), mp.ModelError), (dict(energy=lambda p, a: p @ p), mp.TraceError),
    (dict(friction=lambda p, w: w), mp.TraceError), (dict(metric=np.eye(4)), ValueError),
])
def test_a_part_that_makes_no_sense(arguments, error):
    arguments = {"space": mp.so3_dual(), "energy": lambda p: p @ p, "entropy": ENTROPY, **arguments}
    with pytest.raises(error):
        mp.System(**arguments)


def test_structure_constants_that_are_no_algebra():
    with pytest.raises(mp.Error):
        mp.System(mp.lie_dual(np.ones((3, 3, 3))), energy=lambda p: p @ p)
    with pytest.raises(ValueError, match="shape"):
        mp.lie_dual(np.zeros((3, 3)))


def test_names_that_do_not_exist():
    with pytest.raises(ValueError, match="dp8"):
        body().run([0.4, -1.0, 0.3], t=1.0, method="rk4")
    with pytest.raises(ValueError, match="mean-value"):
        body().run([0.4, -1.0, 0.3], t=1.0, h=0.1, method="midpoint", gradient="best")
    with pytest.raises(ValueError, match="no discrete gradient"):
        body().run([0.4, -1.0, 0.3], t=1.0, method="dp8", gradient="gonzalez")
    with pytest.raises(TypeError, match="no parameter"):
        body()(mass=1.0)
    with pytest.raises(TypeError):
        body().run([0.4, -1.0, 0.3], t=1.0, tolerance=1.0)


def test_a_recording_that_was_tampered_with_is_refused():
    system = body()
    state = system.__getstate__()
    program = state["_definition"].energy
    copy = type("Broken", (), {name: getattr(program, name) for name in ("inputs", "ops", "operands", "constants", "outputs")})()
    copy.operands = np.full_like(np.asarray(program.operands), 10**6)
    with pytest.raises(mp.Error):
        mp._metriplectic.evaluate(copy, np.zeros((1, program.inputs)))


def test_systems_that_are_dropped_leave_no_memory():
    def many(count):
        for _ in range(count):
            mp.System(mp.so3_dual(), energy=lambda p: 0.5 * p @ p, entropy=ENTROPY)
        gc.collect()

    many(300)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    many(2000)
    # In kilobytes: 2000 systems of some ten kilobytes each would be 20 MB.
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 4_000


def test_a_recording_of_many_instructions_runs():
    from metriplectic._trace import Op, Program

    # ½q² + ½p² + a function of q that is so many sines of another one: a recursion along them would end the stack.
    count = 300_000
    ops = [Op.MULTIPLICATION, Op.MULTIPLICATION, Op.ADDITION, Op.SCALE] + [Op.SIN] * count + [Op.MULTIPLY_ADD]
    operands = [(0, 0, 0), (1, 1, 0), (3, 4, 0), (5, 0, 0), (0, 0, 0)]
    operands += [(7 + k, 0, 0) for k in range(count - 1)] + [(7, 7 + count - 1, 6)]
    constants = np.zeros(len(ops))
    constants[3] = 0.5
    energy = Program(3, np.array(ops, dtype=np.uint32), np.array(operands, dtype=np.uint32), constants, [3 + len(ops) - 1])
    run = mp.System(mp.R(2), energy=energy, poisson="symplectic").run([0.1, 0.2], h=0.1, steps=1, method="dp5")
    assert run.certificate.keeps_energy and run.y[-1, 0] == pytest.approx(0.1 * np.cos(0.1) + 0.2 * np.sin(0.1), abs=2e-3)
