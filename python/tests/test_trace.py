"""Recordings: what they hold, when they are refused, and that nothing is kept of them."""

from __future__ import annotations

import copy
import functools
import gc
import math
import pickle
import random
import sys
import time
import tracemalloc
from typing import Any

import numpy as np
import pytest
from tracer import extension, jacobian, tracing

Op = tracing.Op
TraceError = tracing.TraceError
trace = tracing.trace


def refusal(f: Any, inputs: Any = ((3,),), out: Any = (), name: str = "energy") -> str:
    with pytest.raises(TraceError) as caught:
        trace(f, inputs, out, name)
    return str(caught.value)


def test_a_program_has_the_parts_of_a_tape() -> None:
    program = trace(lambda x, t: np.where(x[0] > t, 2.0 * x[0], np.sin(x[1]) ** 3), [(2,), ()])
    assert program.inputs == 3
    assert [Op(code).name for code in program.ops] == ["LESS", "LITERAL", "SCALE", "SIN", "POWI", "SELECT"]
    assert program.operands.tolist() == [[2, 0, 0], [0, 0, 0], [0, 0, 0], [1, 0, 0], [6, 0, 0], [3, 5, 7]]
    assert program.constants.tolist() == [0, 2, 2, 0, 3, 0]
    assert program.outputs.tolist() == [8]
    assert program.ops.dtype == program.operands.dtype == program.outputs.dtype == np.uint32
    assert program.evaluate([2.0, 1.0, 0.5]) == [4.0]
    assert program.evaluate([0.0, 1.0, 0.5]) == [math.sin(1.0) ** 3]
    with pytest.raises(ValueError, match="3 inputs, and 2 numbers"):
        program.evaluate([1.0, 2.0])
    with pytest.raises(ValueError, match="read-only"):
        program.ops[0] = 0


def test_a_program_pickles_and_compares_by_bits() -> None:
    def made(k: float) -> Any:
        return trace(lambda x: k * x @ x, [(3,)])

    program = made(0.1)
    again = pickle.loads(pickle.dumps(program))
    assert again == program and hash(again) == hash(program) and copy.deepcopy(program) == program
    assert made(np.nextafter(0.1, 1.0)) != program and made(0.0) != made(-0.0) and made(math.nan) == made(math.nan)
    assert trace(lambda x: 0.1 * x[:3] @ x[:3], [(4,)]) != program and program != 1


def test_inputs_and_outputs_are_in_order() -> None:
    program = trace(lambda x, m, t: [[t, x[1], m[1, 0]], [x[0], 7.0, m[0, 1]]], [(2,), (2, 2), ()], (2, 3))
    assert program.evaluate([1, 2, 3, 4, 5, 6, 9]) == [9, 2, 5, 1, 7, 4]
    assert trace(lambda x: np.eye(2), [(2,)], (2, 2)).evaluate([0, 0]) == [1, 0, 0, 1]
    assert trace(lambda x: x, [(2,)], None).outputs.tolist() == [0, 1]
    assert trace(lambda: 3.5, [], ()).evaluate([]) == [3.5]


# Two calls.


def test_a_function_that_changes_is_refused() -> None:
    seeds, counter = np.random.default_rng(0), iter(range(100))
    for f in (
        lambda x: seeds.normal() * x[0], lambda x: time.perf_counter_ns() * x[0], lambda x: next(counter) * x[0],
        lambda x: np.random.random(3) @ x,
        lambda x: x @ x if next(counter) % 2 else x[0],
    ):  # fmt: skip
        assert "two calls of it compute different things" in refusal(f)
    trace(lambda x: np.random.default_rng(0).normal() * x[0], [(3,)])  # A seed within the function is no chance.


def test_constants_are_those_of_the_recording() -> None:
    captured = [2.0]
    program = trace(lambda x: captured[0] * x[0], [(1,)])
    captured[0] = 5.0
    assert program.evaluate([3.0]) == [6.0]


# Writing.


def test_a_function_that_writes_into_its_argument_is_refused() -> None:
    def doubled(x: Any) -> Any:
        x *= 2
        return x @ x

    def through_a_view(x: Any) -> Any:
        x[1:][0] = 1.0
        return x @ x

    def reshaped(x: Any) -> Any:
        x.reshape(3, 1)[0, 0] = 2.0
        return x[0]

    def transposed(x: Any) -> Any:
        np.fill_diagonal(x[None, :].T, 1.0)
        return x[0]

    def out(x: Any) -> Any:
        np.sin(x, out=x)
        return x[0]

    for f in (doubled, through_a_view, reshaped, transposed, out, lambda x: x.fill(0), lambda x: np.copyto(x, 1)):
        assert "writes into its argument" in refusal(f)

    def converted(x: Any) -> Any:
        y = np.asarray(x)  # A view in NumPy.
        y[0] = 5.0
        return x[0]

    assert "read-only" in refusal(converted)


def test_views_and_copies_are_those_of_numpy() -> None:
    def f(x: Any) -> Any:
        y = 2 * x
        view, row, fancy, number = y[1:], y.reshape(2, 2)[0], y[[0, 1]], y[3]
        view[0] += 10.0
        row[0] = -1.0
        fancy[:] = 99.0
        number += 5.0
        number **= 2
        y[1:3] *= y[:2].copy()
        zero = y[2, ...]
        zero += 1.0
        flat, copied = y.ravel(), y.flatten()
        flat[3] = 0.25
        copied[0] = 77.0
        y.T[1] -= 3.0
        np.fill_diagonal(y.reshape(2, 2)[:, ::-1], 4.0)
        s = np.zeros_like(y)
        s[...] = y
        s[1] = number
        return np.concatenate([y, s, view, row, fancy])

    x = np.array([0.5, -1.0, 2.0, 3.0])
    want = f(x)
    assert trace(f, [(4,)], want.shape).evaluate(x.tolist()) == want.tolist()


def test_what_is_a_view_in_memory_is_one_in_a_recording() -> None:
    # The transposed order of an array goes on to results, of which `ravel` is then a copy.
    def f(x: Any) -> Any:
        m, values = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]), []
        for y in (
            np.sin(x.T), x.T + x.T, x.T * m.T, 2.0 * x, np.where(x.T > 0, x.T, m.T), np.zeros_like(x.T), np.sum(np.stack([x, x]).T, axis=2),
            x.T.copy(), np.copy(x.T), x.T.astype(float), np.maximum(x.T, 0), x.T @ x, np.asarray(x.T, like=x) + 1, (x.T > 0) * 1.0,
        ):  # fmt: skip
            flat, shaped = y.ravel(), y.reshape(-1)
            flat[1], shaped[2] = 50.0, 60.0
            values.append(y.flatten())
        same = (2.0 * x).astype(float, copy=False)
        same[0] = 3.0
        return np.concatenate([*values, same.ravel()])

    x = np.array([[0.3, -0.2, 0.7], [0.1, 0.9, -0.5]])
    want = f(x)
    np.testing.assert_allclose(trace(f, [(2, 3)], want.shape).evaluate(x.ravel().tolist()), want, rtol=1e-15)

    def unchanged(x: Any) -> Any:
        y = x.astype(float, copy=False)
        y[0] = 1.0
        return x[0]

    assert "writes into its argument" in refusal(unchanged)


def test_conditions_are_the_booleans_of_numpy() -> None:
    def f(x: Any) -> Any:
        a, b = x > 0, x < 0.5
        both = [a[0], b[1]]
        return np.stack([
            (a + b).sum(), (a * b).sum(), (a | b)[0] + (a & b)[0], sum(both), a.max() + b.max(), np.atleast_1d(a[0])[0] + b[0],
            (a.mean() + a[0]) * 1.0, np.where(a, b, a).sum(), (a + 1.0 + b).sum(), (a / 2 + b).sum(), np.stack(both).sum(), np.cumsum(a)[-1],
            a @ x, (a == b).sum(), (a != b).sum(), np.minimum(a, b).sum(), np.trace(np.stack([a, b, a])),
        ])  # fmt: skip

    for x in (np.array([0.3, -0.2, 0.7]), np.array([-0.3, 0.2, 0.1]), np.array([0.3, 0.2, 0.7])):
        want = f(x)
        got = trace(f, [(3,)], want.shape).evaluate(x.tolist())
        np.testing.assert_allclose(got, want.astype(float), rtol=1e-15)
    for g in (
        lambda x: (x > 0) @ (x > 1), lambda x: np.array([x[0] > 0, x[1] > 0]).sum(), lambda x: np.zeros_like(x > 0), lambda x: np.diff(x > 0),
        lambda x: np.where([x[0] > 0, x[1] > 0], 1.0, 2.0),
        lambda x: np.einsum("i,i", x > 0, x > 0), lambda x: abs(x > 0),
    ):  # fmt: skip
        assert "remedy" in refusal(g, out=None)


def test_arrays_of_objects_are_recorded_or_refused() -> None:
    def f(x: Any) -> Any:
        z = np.array([x[0], 1.0, x[1]])
        z += 1
        z *= x
        z[1] = x[2]
        rows = np.array([[x[0], x[1]], [2, x[2]]])
        return np.stack([z.sum(), np.linalg.norm(rows, axis=1)[1], z @ z, (rows @ rows)[0, 1], z.dot(x), np.mean(rows), z[::-1][0] ** 2, rows.T[0, 1],
                         np.var(z), np.trace(rows), z.max() if isinstance(z, float) else z[0]])  # fmt: skip

    x = np.array([0.3, -0.2, 0.7])
    want = f(x)
    np.testing.assert_allclose(trace(f, [(3,)], want.shape).evaluate(x.tolist()), want, rtol=1e-14)


# Results.


@pytest.mark.parametrize(
    ("f", "text"),
    [
        (lambda x: None, "it returns nothing (None), and a number is needed"),
        (lambda x: "x", "an object of the type str"),
        (lambda x: x, "an array of the shape (3,), and a number is needed"),
        (lambda x: x[:1], "write value[0] for the one entry"),
        (lambda x: x[0] > 0, "it returns conditions"),
        (lambda x: True, "it returns conditions"),
        (lambda x: [x[0], [x[1]]], "it returns lists of different lengths"),
        (lambda x: x[0] + 1j, "a complex number meets the state"),
        (lambda x: np.array(["a"]), "numbers of the type <U1 meet the state"),
        (lambda x: (y for y in x), "an object of the type generator"),
    ],
)
def test_a_result_of_another_kind_is_refused(f: Any, text: str) -> None:
    message = refusal(f)
    assert message.startswith("energy cannot be recorded: ") and text in message and "remedy: " in message


# Exceptions.


def test_an_exception_of_the_function_is_the_cause() -> None:
    def inner(x: Any) -> Any:
        return x[7]

    def f(x: Any) -> Any:
        return inner(x) + 1.0

    with pytest.raises(TraceError, match=r"energy cannot be recorded: it raises IndexError: index 7 is out of .*\n  test_trace.py:\d+: `return x\[7\]`") as caught:
        trace(f, [(3,)], (), "energy")
    assert isinstance(caught.value.__cause__, IndexError)
    assert "the shapes (3,) and (2,) do not fit in np.add" in refusal(lambda x: x + np.ones(2))
    assert "it raises ValueError: all the input array dimensions" in refusal(lambda x: np.concatenate([x[None, :], np.ones((2, 2))]))
    assert "the shapes (3,) and (2, 2) do not fit in a product" in refusal(lambda x: x @ np.eye(2))
    with pytest.raises(KeyboardInterrupt):
        trace(_interrupted, [(3,)])


def _interrupted(x: Any) -> Any:
    raise KeyboardInterrupt


def test_a_refusal_that_is_caught_is_a_refusal() -> None:
    def caught(x: Any) -> Any:
        try:
            return math.sin(x[0])
        except TypeError:
            return x[0]
        except Exception:
            return x[1]

    assert "write np.sin for math.sin" in refusal(caught)


def test_symbols_of_another_call_are_refused() -> None:
    kept: list[Any] = []

    def f(x: Any) -> Any:
        kept.append(x[0])
        return kept[0] * x[1]

    assert "an array of another call is used" in refusal(f)
    assert "a key of a cache" in refusal(lambda x: functools.lru_cache(lambda y: y * 2)(x[0]))


def test_copies_of_symbols_stay_in_their_recording() -> None:
    program = trace(lambda x: copy.deepcopy(x) @ copy.copy(x), [(3,)])
    assert program.evaluate([1, 2, 3]) == [14]


def test_a_recording_has_a_limit() -> None:
    assert "more than 16777216 registers" in refusal(lambda x: np.sum(x[:, None] * x[None, :]), [(5000,)])
    assert "16777217 inputs" in refusal(lambda x: x[0], [((1 << 24) + 1,)])


# Arguments.


def test_names_say_what_an_argument_is() -> None:
    def read(f: Any, **options: Any) -> Any:
        return tracing.arguments(f, parameters=("gamma", "k"), **options)

    both = {"gamma": 2.0, "k": 3.0}
    one = read(lambda p, *, gamma: (p, gamma))
    assert (one.state, one.by_factors, one.time, one.covector, one.parameters) == (("p",), False, False, False, ("gamma",))
    assert one.call("state", parameters=both) == ("state", 2.0)
    timed = read(lambda x, w, t: x, covector=True)
    assert timed.time and timed.covector and not timed.parameters and not timed.by_factors
    assert read(lambda p, k, t, gamma: (p, k, t, gamma)).call(1, t=5.0, parameters=both) == (1, 3.0, 5.0, 2.0)
    assert read(lambda x, w, gamma: (x, w, gamma), covector=True).call(1, w=4.0, parameters=both) == (1, 4.0, 2.0)
    assert read(lambda x, i=7: (x, i)).call(1) == (1, 7)
    assert read(lambda x, i=7, k=1.0: (x, i, k)).call(1, parameters=both) == (1, 7, 3.0)
    assert read(lambda x, gamma=9.0, /, *, k=1.0: (x, gamma, k)).call(1, parameters=both) == (1, 2.0, 3.0)
    factors = read(lambda q, s: (q, s), factors=2)
    assert factors.by_factors and factors.call((1, 2)) == (1, 2)
    assert read(lambda q, s, w, *, t: (q, s, w, t), factors=2, covector=True).call((1, 2), w=3, t=4) == (1, 2, 3, 4)
    whole = read(lambda x: x, factors=2)
    assert not whole.by_factors and whole.call((1, 2)) == (1, 2)
    assert read(functools.partial(lambda x, k, c: (x, k, c), c=5)).call(1, parameters=both) == (1, 3.0, 5)
    assert read(np.linalg.norm).call(np.array([3.0, 4.0])) == 5.0
    for f, options, text in (
        (lambda p, mu: p, {}, "has the argument `mu`, which is no parameter; after the state, there are t, gamma, k"),
        (lambda p, *, mu: p, {}, "`mu`"), (lambda p, gamma, mu: p, {}, "`mu`"), (lambda x, w: x, {}, "`w`"),
        (lambda a, b, c: a, {"factors": 2}, "`c`"), (lambda a, *, b: a, {"factors": 2}, "`b`"), (lambda a, b: a, {"factors": 3}, "the space has 3 factors"),
        (lambda *x: x, {}, "*x"), (lambda t: t, {}, "no argument for the state"), (lambda: 1.0, {}, "no argument for the state"),
    ):  # fmt: skip
        with pytest.raises(TraceError) as caught:
            read(f, **options, name="energy")
        assert str(caught.value).startswith("energy ") and text in str(caught.value) and "remedy: " in str(caught.value)


# Checks of a recording.


def test_a_recording_is_checked_against_the_function() -> None:
    def f(x: Any) -> Any:
        return np.exp(x @ x) / (1 + np.sum(np.cos(x) ** 2)) - 1e6

    points = np.random.default_rng(1).normal(size=(5, 3))
    program = trace(f, [(3,)])
    tracing.check(program, f, [(3,)], points)
    with pytest.raises(TraceError, match=r"energy was recorded as another function: its entry 0 is .* at \["):
        tracing.check(program, lambda x: f(x) * (1 + 1e-9), [(3,)], points, "energy")

    def by_type(x: Any) -> Any:
        return x[0] if isinstance(x, np.ndarray) else x[1]

    with pytest.raises(TraceError, match="look for branches on types"):
        tracing.check(trace(by_type, [(3,)]), by_type, [(3,)], points)
    with pytest.raises(TraceError, match="raises ZeroDivisionError at"):
        tracing.check(program, lambda x: 1 / 0, [(3,)], points)
    with pytest.raises(TraceError, match="returns 3 numbers"):
        tracing.check(program, lambda x: x, [(3,)], points)

    def writes(x: Any) -> Any:
        value = f(x)
        x[0] = 0.0
        return value

    with pytest.raises(TraceError, match="writes into its argument"):
        tracing.check(program, writes, [(3,)], points)


def test_a_check_admits_round_off_alone() -> None:
    # A difference of large numbers: its round-off is 1e-4 of it, in NumPy's order of the sum as in that of the recording.
    def f(x: Any) -> Any:
        return np.sum(x**3) - np.sum((x**3)[::-1])

    x = np.random.default_rng(2).normal(size=300) * 1e4
    program = trace(f, [(300,)])
    tracing.check(program, f, [(300,)], [x])
    with pytest.raises(TraceError):
        tracing.check(program, lambda x: f(x) + 100.0, [(300,)], [x])
    log = trace(np.log, [()])
    tracing.check(log, np.log, [()], [[0.0], [-1.0], [math.inf], [math.nan]])


# SymPy.


def test_functions_of_sympy_are_recorded() -> None:
    sympy = pytest.importorskip("sympy")
    p = sympy.symbols("p1:4")
    a, b, c = p
    scalars = [
        sum(x**2 / k for x, k in zip(p, (10, 5, 1))) / 2 + sympy.exp(-(a**2 + b**2)) * sympy.cos(a**2 + b**2),
        sympy.Piecewise((c, c > 0), (a**2, b > 0), (0, True)) + sympy.Max(a, b, sympy.Rational(1, 3)) + sympy.Min(a, c),
        sympy.sqrt(a**2 + 1) + sympy.Abs(b) + sympy.sign(c) + sympy.atan2(a, b) + sympy.log(2 + c**2, 2) + (1 + a**2) ** sympy.Rational(1, 3),
        sympy.Heaviside(a) + sympy.tanh(b) ** 2 + sympy.cot(1 + b**2),
    ]
    for expression in scalars:
        f = sympy.lambdify([p], expression, modules="numpy", cse=True)
        program = trace(f, [(3,)])
        for x in ([0.3, -0.7, 0.2], [-0.4, 0.9, -1.1]):
            assert program.evaluate(x)[0] == pytest.approx(float(expression.subs(dict(zip(p, x))).evalf()), rel=1e-13)
    energy = scalars[0]
    slopes = [float(sympy.diff(energy, s).subs(dict(zip(p, (0.3, -0.7, 0.2)))).evalf()) for s in p]
    program = trace(sympy.lambdify([p], energy, modules="numpy", cse=True), [(3,)])
    np.testing.assert_allclose(jacobian(program, [0.3, -0.7, 0.2])[0], slopes, rtol=1e-13)
    matrix = sympy.Matrix([[0, a * b, 1], [-a * b, 0, c**2], [-1, -(c**2), 0]])
    program = trace(sympy.lambdify([p], matrix, modules="numpy", cse=True), [(3,)], (3, 3))
    assert program.evaluate([2, 3, 5]) == [0, 6, 1, -6, 0, 25, -1, -25, 0]
    both = sympy.Piecewise((a, (a > 0) & (b > 0)), (b, True))
    assert "nested Piecewise" in refusal(sympy.lambdify([p], both, modules="numpy", cse=True))


# Size and memory.


def test_a_million_instructions_are_recorded_in_bounded_memory() -> None:
    n = 1000
    k = np.random.default_rng(3).normal(size=(n, n // 2))
    gc.collect()
    tracemalloc.start()
    begin = time.process_time()
    program = trace(lambda x: np.sum(np.tanh(x @ k) ** 2), [(n,)])
    seconds, (_, peak) = time.process_time() - begin, tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(program.ops) > 1.4e6
    bytes_each = peak / len(program.ops)
    print(f"\n{len(program.ops)} instructions: {seconds:.2f} CPU s, {bytes_each:.0f} bytes each at the peak")
    # Two recordings of 24 bytes an instruction, and the arrays of the largest operation.
    assert bytes_each < 400
    program = trace(_bonds, [(10_000,)])
    assert len(program.ops) > 6e4


def _bonds(x: Any) -> Any:
    s = 0
    for a, b in zip(x[1:], x[:-1]):
        d = a - b
        s += d * d / 2 + d**4 / 4
    return s


def test_ten_thousand_recordings_leave_nothing() -> None:
    def f(x: Any) -> Any:
        return np.exp(-x @ x) + np.linalg.norm(x) + np.array([x[0], x[1]]).sum()

    def refused(x: Any) -> Any:
        return math.sin(x[0])

    def wrong(x: Any) -> Any:
        return x[7]

    def rounds(count: int) -> None:
        for k in range(count):
            trace(lambda x: x[0] * x[1] - 1.0, [(3,)])
            if k % 20 == 0:
                trace(f, [(3,)])
                for g in (refused, wrong):
                    with pytest.raises(TraceError):
                        trace(g, [(3,)])

    def kept() -> int:
        ours = (tracing.recording.Recording, tracing.symbols.Symbolic, tracing.Program)
        return sum(issubclass(type(thing), ours) for thing in gc.get_objects())

    gc.collect()
    before, collecting = kept(), gc.isenabled()
    gc.disable()  # Nothing waits for the collector: there are no cycles.
    try:
        rounds(1000)
        blocks = sys.getallocatedblocks()
        rounds(10_000)
        more = sys.getallocatedblocks() - blocks
    finally:
        if collecting:
            gc.enable()
    assert kept() == before
    assert more < 5000  # One block kept of each recording would be 10 000 of them.


# Chance.


def test_chance_expressions_have_the_values_of_numpy() -> None:
    chance = random.Random(11)
    unary = [np.sin, np.tanh, np.exp, np.abs, np.square, np.negative, np.cos, lambda a: a.T, lambda a: a[::-1], lambda a: a.copy(),
             lambda a: np.where(a > 0.1, a, 0.5 * a), lambda a: np.roll(a, 1), lambda a: np.clip(a, -1, 1), lambda a: a - a.mean(),
             lambda a: a / (1 + np.sum(a * a)), lambda a: a.reshape(a.shape), lambda a: np.cumsum(a, axis=0), np.sign, np.arctan]  # fmt: skip
    binary = [np.add, np.subtract, np.multiply, np.maximum, np.minimum, np.matmul, np.arctan2, lambda a, b: a * (b > 0),
              lambda a, b: np.where(a < b, a, b), lambda a, b: a @ b.T, lambda a, b: np.einsum("ij,kj->ik", a, b), lambda a, b: a / (2 + b * b),
              lambda a, b: (a > 0) * (b > 0) + a, lambda a, b: np.linalg.solve(4 * np.eye(3) + np.tanh(a), b)]  # fmt: skip
    constants = np.random.default_rng(4).normal(size=(4, 3, 3))
    constants[0, 0] = 0.0
    x = np.random.default_rng(5).normal(size=(3, 3))
    for _ in range(100):
        steps = [(chance.randrange(3), chance.randrange(100), chance.randrange(100), chance.randrange(100)) for _ in range(8)]

        def f(x: Any, steps: Any = steps) -> Any:
            stack = [x, *constants]
            for kind, which, i, j in steps:
                a, b = stack[i % len(stack)], stack[j % len(stack)]
                if kind == 0:
                    stack.append(unary[which % len(unary)](a))
                elif kind == 1:
                    stack.append(binary[which % len(binary)](a, b))
                else:
                    y = stack[-1] + 0.0 * x
                    y[which % 3] += x[i % 3] * b[j % 3]
                    stack.append(y)
            return sum(np.tanh(one) for one in stack[5:])

        want = f(x.copy())
        program = trace(f, [(3, 3)], (3, 3))
        np.testing.assert_allclose(np.reshape(program.evaluate(x.ravel().tolist()), (3, 3)), want, rtol=1e-9, atol=1e-11)
        if extension is not None:
            rows = extension.evaluate(program, x.reshape(1, 9))
            np.testing.assert_allclose(rows.reshape(3, 3), want, rtol=1e-9, atol=1e-11)
