"""Functions of NumPy as they are recorded, against NumPy's own: shapes, entries, and the numbers of IEEE 754."""

from __future__ import annotations

import inspect
import math
import re
import warnings
from typing import Any, Callable

import numpy as np
import pytest
from tracer import FOLDER, differences, extension, jacobian, tracing

Op = tracing.Op
RNG = np.random.default_rng(5)
A = RNG.uniform(0.2, 0.9, (2, 3)) * np.array([[1, -1, 1], [1, 1, -1]])
SPARSE = np.array([[2.0, -1, 0], [-1, 2, -1], [0, -1, 2]])


def recorded(f: Callable[..., Any], x: Any) -> Any:
    """The value of a recording, in the shape of NumPy's."""
    want = np.asarray(f(np.array(x)))
    program = tracing.trace(f, [np.shape(x)], want.shape)
    values = program.evaluate(np.ravel(x).tolist())
    if extension is not None:
        rows = extension.evaluate(program, np.ravel(x)[None, :])
        np.testing.assert_allclose(np.ravel(rows), values, rtol=1e-12, atol=1e-13)
    return np.reshape(values, want.shape), want


UNARY = (
    "negative reciprocal sqrt cbrt exp exp2 expm1 log log2 log10 log1p sin cos tan arcsin arccos arctan sinh cosh tanh arcsinh arccosh"
    " arctanh absolute fabs sign square positive deg2rad rad2deg radians degrees conjugate"
).split()
BINARY = "add subtract multiply divide power arctan2 hypot minimum maximum fmin fmax logaddexp heaviside".split()
COMPARISONS = "less less_equal equal greater greater_equal not_equal logical_and logical_or logical_xor".split()
SPECIAL = [0.0, -0.0, 1.0, -1.0, 0.5, -2.0, 3.0, 1e300, 1e-300, np.inf, -np.inf, np.nan]


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("name", UNARY)
def test_an_elementwise_function_has_the_numbers_of_numpy(name: str) -> None:
    f = getattr(np, name)
    got, want = recorded(f, np.array(SPECIAL))
    np.testing.assert_allclose(got, want, rtol=1e-15 if name in ("negative", "absolute", "sign") else 3e-15)
    x = np.array([1.3, 2.1] if name == "arccosh" else [0.3, 0.8])
    program = tracing.trace(f, [(2,)], (2,))
    np.testing.assert_allclose(jacobian(program, x), differences(f, x), rtol=1e-9, atol=1e-11)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("name", [*BINARY, *COMPARISONS])
def test_a_function_of_two_arrays_has_the_numbers_of_numpy(name: str) -> None:
    f = getattr(np, name)
    a, b = (x.ravel() for x in np.meshgrid(SPECIAL, SPECIAL))
    if name in ("hypot", "logaddexp"):  # The squares of large numbers overflow, and equal infinities have no difference.
        usual = ~(np.isin(np.abs(a), [1e300, 1e-300, np.inf]) | np.isin(np.abs(b), [1e300, 1e-300, np.inf]))
        a, b = a[usual], b[usual]
    n = len(a)
    number = (lambda c: np.where(c, 1.0, 0.0)) if name in COMPARISONS else (lambda c: c)
    got, want = recorded(lambda x: number(f(x[:n], x[n:])), np.concatenate([a, b]))
    np.testing.assert_allclose(got, want, rtol=1e-14)
    for k, value in enumerate(SPECIAL):  # A constant on either side, which is the operand of an instruction.
        if name in ("hypot", "logaddexp") and abs(value) in (1e300, 1e-300, np.inf):
            continue
        x = np.unique(a)
        if name == "power" and value == 0.5:  # Some versions take the root of −0 and −∞, some the power.
            x = x[(x != 0) & (x != -np.inf)]
        for one in (lambda x: number(f(x, value)), lambda x: number(f(value, x))):
            got, want = recorded(one, x)
            np.testing.assert_allclose(got, want, rtol=1e-14, err_msg=f"{name} with {value}")


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("exponent", [0, -0.0, 1, 2, 3, -1, -4, 7, 0.5, -0.5, 1 / 3, 2.0, 1024, 1025, -1025.0])
def test_a_constant_exponent_has_the_numbers_of_numpy(exponent: float) -> None:
    x = np.array([0.0, 1.0, -1.0, 1.001, 0.7, -0.7, 2.0, np.nan])
    exponents = np.full(8, float(exponent))
    for f in (lambda x: x**exponent, lambda x: x**exponents, lambda x: np.stack([v**exponent for v in x])):
        got, want = recorded(f, x)
        np.testing.assert_allclose(got, want, rtol=1e-12)
        program = tracing.trace(f, [(8,)], (8,))
        is_integer = program.ops == Op.POWI
        assert is_integer.any() == (exponent == int(exponent) and abs(exponent) <= 1024)
        assert (np.abs(program.constants[is_integer]) <= 1024).all() and not np.signbit(program.constants[is_integer & (exponent == 0)]).any()


CALLS: list[Callable[..., Any]] = [
    lambda x: x.sum(axis=0), lambda x: x.sum(axis=1, keepdims=True), lambda x: np.sum(x, axis=(0, 1)), lambda x: np.sum(x, axis=-1, initial=2),
    lambda x: np.sum(x, keepdims=True), lambda x: np.sum([x[0], x[1]], axis=0), lambda x: np.sum(x[:, :0], axis=1), lambda x: x.prod(axis=1),
    lambda x: np.prod(x[:, :0], axis=1), lambda x: np.max(x, axis=0), lambda x: np.min(x, axis=1, initial=0.1), lambda x: np.ptp(x, axis=0),
    lambda x: x.mean(axis=0), lambda x: np.var(x, axis=1, ddof=1), lambda x: np.std(x, axis=0, keepdims=True), lambda x: x.var(),
    lambda x: np.average(x, weights=A), lambda x: np.average(x, axis=1, weights=A**2), lambda x: np.cumsum(x, axis=0), lambda x: x.cumsum(),
    lambda x: np.cumprod(x, axis=1), lambda x: np.add.accumulate(x, axis=1), lambda x: np.add.reduce(x), lambda x: np.multiply.reduce(x, axis=1),
    lambda x: np.maximum.reduce(x, axis=None), lambda x: np.subtract.outer(x[0], x[1]), lambda x: np.multiply.outer(x, [1.0, 2]),
    lambda x: np.where(np.any(x > 0.5, axis=0), 1.0, 2.0), lambda x: np.where((x > 0).all(axis=1), x[:, 0], -1.0), lambda x: (x > 0).sum() + 0.0,
    lambda x: (x > 0) * x, lambda x: np.where((x > 0) + (x < 0.4), x, 0), lambda x: np.where(~(x > 0) ^ (x < 0.4), x, 0), lambda x: (x > 0) * 1.0 + (x > 0.5),
    lambda x: np.where(np.any(x), 1.0, 0.0), lambda x: np.any(x[:1, :1]) * 1.0, lambda x: np.where(x[0] * x[1] - 0.2, 3.0, 4.0), lambda x: np.where([True, False, True], x[0], x[1]),
    lambda x: x @ x.T, lambda x: x @ SPARSE, lambda x: SPARSE @ x[0], lambda x: x[0] @ x[1], lambda x: x[:, None, :] @ x[:, :, None],
    lambda x: np.matmul(np.ones((4, 1, 2)), x), lambda x: np.dot(x, x.T), lambda x: np.dot(np.ones((2, 3, 2)), np.stack([x, x])[0]), lambda x: np.dot(3, x),
    lambda x: np.dot(np.ones((2, 2)), np.stack([x, 2 * x])), lambda x: np.inner(x, x), lambda x: np.inner(np.stack([x, x]), x), lambda x: np.vdot(x, A),
    lambda x: np.outer(x, x[0]), lambda x: np.tensordot(x, x, axes=([0, 1], [0, 1])), lambda x: np.tensordot(x, np.ones((3, 2, 4)), axes=([1, 0], [0, 1])),
    lambda x: np.tensordot(x, x, 0), lambda x: np.einsum("ij,kj->ik", x, x), lambda x: np.einsum("ij->ji", x), lambda x: np.einsum("ij", x),
    lambda x: np.einsum("ba", x), lambda x: np.einsum("ij,jk,lk->il", x, SPARSE, x), lambda x: np.einsum("ii->i", x @ x.T), lambda x: np.einsum("ii", x @ x.T),
    lambda x: np.einsum("ij,ij,ij->j", x, x, x), lambda x: np.einsum("i,j->ij", x[0], x[1]), lambda x: np.einsum("ij->", x), lambda x: np.einsum("i,ij->", [1.0, 2], x),
    lambda x: np.einsum("i,i", x[0], x[1]), lambda x: np.einsum("ij,k->k", x, x[0]),
    lambda x: np.kron(x, x[:, :2]), lambda x: np.kron(x[0], x), lambda x: np.cross(x, x[::-1]), lambda x: np.cross(x[0], A), lambda x: np.cross(x.T, A.T, axis=0),
    lambda x: np.linalg.norm(x, axis=1), lambda x: np.linalg.norm(x), lambda x: np.linalg.norm(x, "fro"), lambda x: np.linalg.norm(x[0], 1),
    lambda x: np.linalg.norm(x[0], np.inf), lambda x: np.linalg.norm(x, axis=0, keepdims=True), lambda x: np.linalg.norm(x, ord=2, axis=1),
    lambda x: np.linalg.matrix_power(x[:, :2], 3), lambda x: np.linalg.matrix_power(x[:, :2], -2), lambda x: np.linalg.multi_dot([x, SPARSE, x.T]),
    lambda x: np.trace(x), lambda x: np.trace(np.stack([x @ x.T] * 3), axis1=1, axis2=2), lambda x: np.diagonal(x, 1), lambda x: np.diag(x[0]),
    lambda x: np.diag(x[0], -1), lambda x: np.diag(x @ x.T), lambda x: np.diagflat(x), lambda x: np.triu(x, 1), lambda x: np.tril(np.stack([x, x])),
    lambda x: np.diff(x), lambda x: np.diff(x, axis=0), lambda x: np.diff(x, n=2), lambda x: np.diff(x[0], prepend=0.0, append=x[1, :1]),
    lambda x: np.polyval(x[0], x[1]), lambda x: np.polyval([1, 2], x), lambda x: np.clip(x, None, 0.3), lambda x: x.clip(-0.3, x[0]), lambda x: np.clip(x, a_min=0, a_max=None),
    lambda x: np.select([x > 0.5, x < -0.5], [x, 2 * x], default=x**2), lambda x: np.select([x[0] > 0.5, True], [1.0, x[1]]),
    lambda x: np.piecewise(x, [x < 0, x >= 0.5], [lambda v: -v, lambda v: v**2, 7.0]), lambda x: np.piecewise(x, [x < 0], [1.0]),
    lambda x: np.concatenate([x, A], axis=1), lambda x: np.concatenate([x[0], [1, 2]]), lambda x: np.concatenate(x), lambda x: np.stack([x[0, 0], 1.0, x[1, 2]]),
    lambda x: np.hstack([x[0, 0], x[1]]), lambda x: np.vstack(x.T), lambda x: np.dstack([x, A]), lambda x: np.column_stack([x[0], x[1]]), lambda x: np.block([[x, A], [A, x]]),
    lambda x: np.append(x, 1.0), lambda x: np.append(x, A, axis=0), lambda x: np.insert(x[0], 1, 9.0), lambda x: np.insert(x[0], 1, x[1, 0]), lambda x: np.delete(x, 1, axis=1),
    lambda x: np.pad(x, 1), lambda x: np.pad(x[0], 2, mode="wrap"), lambda x: np.pad(x, ((0, 0), (1, 0)), constant_values=2.5), lambda x: np.pad(x[0], 1, "edge"),
    lambda x: np.roll(x, 1, axis=1), lambda x: np.flip(x, 0), lambda x: np.rot90(x), lambda x: np.tile(x, (2, 2)), lambda x: np.repeat(x, 2, axis=0), lambda x: x.repeat([1, 0, 2], axis=1),
    lambda x: np.take(x, [2, 0], axis=1), lambda x: x.take(4), lambda x: np.compress([True, False, True], x, axis=1), lambda x: np.extract(A > 0, x),
    lambda x: np.moveaxis(np.stack([x] * 2), 0, -1), lambda x: np.swapaxes(x, 0, 1), lambda x: x.swapaxes(0, 1), lambda x: np.expand_dims(x, 1), lambda x: np.squeeze(x[:, None, :]),
    lambda x: np.reshape(x, (3, 2)), lambda x: x.reshape(-1), lambda x: x.reshape(3, -1), lambda x: x.reshape((6,), order="F"), lambda x: x.ravel("F"), lambda x: x.flatten(),
    lambda x: x.T, lambda x: np.transpose(x), lambda x: np.broadcast_to(x[0], (2, 3)), lambda x: np.atleast_2d(x[0]), lambda x: np.broadcast_arrays(x, x[0])[1], lambda x: np.resize(x, 8),
    lambda x: np.split(x, [1], axis=1)[1], lambda x: np.array_split(x.ravel(), 4)[1], lambda x: x[..., None], lambda x: x[1], lambda x: x[A > 0], lambda x: x[[0, 1], [2, 0]],
    lambda x: x[::-1, 1:], lambda x: x[:, [2, 1]], lambda x: x[1, 2], lambda x: list(x.flat), lambda x: [list(row) for row in x], lambda x: [[1, x[0, 0]], [x[1, 1], 2]],
    lambda x: np.full_like(x, 2.0) * x, lambda x: np.ones_like(x[0]) + x, lambda x: np.full_like(x, x[0, 0]), lambda x: np.eye(2, like=x) @ x, lambda x: np.full((2, 3), 0.5, like=x) * x,
    lambda x: np.ones((2, 2), like=x) @ x, lambda x: np.array([x[0, 0], 2.0], like=x), lambda x: np.identity(2, like=x) @ x, lambda x: x.astype(float), lambda x: np.copy(x), lambda x: +x,
    lambda x: np.array([x[0, 0], x[1, 1]]) ** 2, lambda x: np.exp(np.array([[x[0, 0], x[0, 1]], [x[1, 0], x[1, 1]]])), lambda x: np.array([x[0, 0], x[1, 1]]).std(), lambda x: np.array([x[0], x[1]]) @ SPARSE, lambda x: np.array(x) + 1,
    lambda x: np.linalg.norm(np.array([x[0, 0], x[1, 1]])), lambda x: np.array([x[0, 0], x[1, 1]]).mean(), lambda x: np.arctan2(np.array([x[0, 0]]), 2.0), lambda x: np.sqrt(np.asarray(x) ** 2),
    lambda x: np.cross(np.stack([x[0, 0], 0.0, 1.0]), [1.0, 2, 3]), lambda x: np.outer(np.array([x[0, 0], 2]), x[1]), lambda x: x.real + x.imag, lambda x: np.real(x), lambda x: divmod(1, 2)[1] * x,
    lambda x: -x, lambda x: 3 - x, lambda x: 2 / x, lambda x: [1.0, 2, 3] * x, lambda x: np.float64(2) * x[0, 0], lambda x: np.float32(2) ** x, lambda x: x[0, 0] ** x[0, 2], lambda x: 2 ** x[0, 0],
    lambda x: x[0, 0] - 1, lambda x: 1 - x[0, 0], lambda x: 1 / x[0, 0], lambda x: x[0, 0] / 3, lambda x: x[0, 0] / x[0, 1], lambda x: x[0, 0] * A, lambda x: A - x[0, 0], lambda x: True * x, lambda x: x[0, 0] * True,
]  # fmt: skip


@pytest.mark.parametrize("k", range(len(CALLS)))
def test_a_call_has_the_value_of_numpy(k: int) -> None:
    f = CALLS[k]
    want = np.asarray(f(A.copy()), float)
    program = tracing.trace(f, [(2, 3)], want.shape)
    got = np.reshape(program.evaluate(A.ravel().tolist()), want.shape)
    np.testing.assert_allclose(got, want, rtol=1e-13, atol=1e-15)


@pytest.mark.parametrize("n", range(1, 7))
def test_linear_algebra_of_small_matrices(n: int) -> None:
    rng = np.random.default_rng(n)
    dense, right = rng.normal(size=(n, n)), rng.normal(size=(n, 2))
    shifted = np.roll(np.eye(n), 1, axis=0) + 1e-3 * np.triu(dense)  # It needs exchanges of rows.
    shifted[0, 0] = 0.0
    for matrix in (dense, shifted) if n > 1 else (dense,):
        for f in (
            np.linalg.det,
            np.linalg.inv,
            lambda a: np.linalg.solve(a, right),
            lambda a: np.linalg.solve(a, right[:, 0]),
            lambda a: np.linalg.solve(right @ right.T + np.eye(n), a),
        ):
            got, want = recorded(f, matrix)
            np.testing.assert_allclose(got, want, rtol=1e-9, atol=1e-11 * max(1, np.abs(want).max()))
        program = tracing.trace(np.linalg.det, [(n, n)])
        slopes = np.linalg.det(matrix) * np.linalg.inv(matrix).T  # Jacobi
        np.testing.assert_allclose(jacobian(program, matrix.ravel())[0], slopes.ravel(), rtol=1e-9, atol=1e-11)
    batch = rng.normal(size=(3, n, n))
    for f in (np.linalg.det, np.linalg.inv, lambda a: np.linalg.solve(a, np.ones((3, n, 2)))):
        got, want = recorded(f, batch)
        np.testing.assert_allclose(got, want, rtol=1e-8, atol=1e-10)


def test_a_long_sum_has_the_round_off_of_numpy() -> None:
    x = np.random.default_rng(0).normal(size=100_000) * 1e3 + 1e6
    program = tracing.trace(np.sum, [x.shape])
    assert abs(program.evaluate(x.tolist())[0] - math.fsum(x)) < 1e-14 * math.fsum(np.abs(x))
    for n in (127, 128, 129, 256, 300, 16_385):
        program = tracing.trace(lambda x: np.stack([x, -2 * x]).sum(axis=1), [(n,)], (2,))
        assert np.count_nonzero(program.ops != Op.LITERAL) == n + 2 * (n - 1)
        assert program.evaluate(range(n)) == [n * (n - 1) / 2, -float(n * (n - 1))]
        assert tracing.trace(np.cumsum, [(n,)], (n,)).evaluate([1.0] * n) == list(range(1, n + 1))


def test_the_zeros_of_a_matrix_of_numbers_cost_nothing() -> None:
    n = 40
    chain = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    for f in (lambda x: chain @ x, lambda x: x @ chain, lambda x: np.einsum("ij,j->i", chain, x), lambda x: np.tensordot(chain, x, 1)):
        program = tracing.trace(f, [(n,)], (n,))
        literals = np.count_nonzero(program.ops == Op.LITERAL)
        assert len(program.ops) - literals == (3 * n - 2) + (2 * n - 2)
        np.testing.assert_allclose(program.evaluate(range(n)), chain @ np.arange(n))
    # A row of zeros is 0, and an entry that is infinite counts.
    assert tracing.trace(lambda x: np.zeros((2, 3)) @ x, [(3,)], (2,)).evaluate([1, 2, 3]) == [0, 0]
    program = tracing.trace(lambda x: np.stack([x[0] * 0, np.inf]) @ np.array([0.0, 0.0]), [(1,)])
    assert np.isnan(program.evaluate([1.0])[0])
    program = tracing.trace(lambda x: np.array([0.0, 0.0]) @ np.stack([x[0] * 0, np.inf]), [(1,)])
    assert np.isnan(program.evaluate([1.0])[0])


def test_a_bound_costs_one_instruction() -> None:
    for f in (lambda x: np.maximum(x, 0), lambda x: np.maximum(0, x), lambda x: np.clip(x, None, 1)):
        assert np.count_nonzero(tracing.trace(f, [()]).ops != Op.LITERAL) == 1


@pytest.mark.parametrize(
    "f",
    [
        lambda x: np.sum(x, where=A > 0), lambda x: np.sum(x, dtype=np.float32), lambda x: np.einsum("...i->...", x), lambda x: np.sin(x > 0),
        lambda x: (x > 0) - (x < 0), lambda x: -(x > 0), lambda x: x & 1, lambda x: ~x, lambda x: (x > 0) & 1, lambda x: np.linalg.norm(x, 2),
        lambda x: np.where(x > 0), lambda x: np.nansum(x), lambda x: x.argmax(), lambda x: np.argsort(x), lambda x: x % 2, lambda x: np.floor(x),
        lambda x: np.round(x), lambda x: np.linalg.det(np.ones((17, 17)) * x[0, 0]), lambda x: np.linalg.svd(x), lambda x: x.astype(int),
        lambda x: x.astype(np.float32), lambda x: np.take(x, x[0]), lambda x: np.roll(x, x[0, 0]), lambda x: np.zeros((x[0, 0],), like=x),
        lambda x: np.add(A, x, out=np.zeros((2, 3))), lambda x: np.add(x, 1, where=A > 0), lambda x: x == None,  # noqa: E711
        lambda x: {x[0, 0]: 1}, lambda x: hash(x), lambda x: x.item(), lambda x: complex(x[0, 0]), lambda x: round(x[0, 0]), lambda x: x * "a",
        lambda x: __import__("math").floor(x[0, 0]), lambda x: x * object(), lambda x: np.isnan(x), lambda x: np.fill_diagonal(np.zeros((2, 2)), x[0, 0]),
        lambda x: np.copyto(np.zeros((2, 3)), x), lambda x: np.add.at(np.zeros(3), [0], x[0, 0]), lambda x: 0.5 in x, lambda x: bool(x[0, 0] == x[0, 0]),
        lambda x: x.tobytes(), lambda x: np.array_equal(x, x), lambda x: np.allclose(x, 1), lambda x: np.unique(x), lambda x: np.linalg.inv(x),
        lambda x: np.max(np.array([x[0, 0], x[1, 1]])), lambda x: np.array([x[0, 0], 1]) > 0, lambda x: np.sign(np.array([x[0, 0]])),
        lambda x: np.array([x[0, 0], 1]).astype(float), lambda x: np.asarray(x, dtype=float), lambda x: __import__("pickle").dumps(x),
        lambda x: np.exp(np.array([x[0, 0], 1.0])), lambda x: np.linalg.det(np.array([[x[0, 0]]])),
        lambda x: 1 if x[0, 0] else 2, lambda x: not x[0, 0], lambda x: x[0, 0] and 1, lambda x: 0 < x[0, 0] < 1, lambda x: int(x.sum()),
        lambda x: x[0, 0].is_integer(), lambda x: float(np.array([x[0, 0]])[0]), lambda x: (x[0, 0] + 1j).real, lambda x: np.frompyfunc(abs, 1, 1)(x),
        lambda x: np.linalg.solve(np.stack([x[:, :2]] * 2), np.ones((2, 2))),
    ],
)  # fmt: skip
def test_what_is_not_recorded_is_refused(f: Callable[..., Any]) -> None:
    with warnings.catch_warnings(), pytest.raises(tracing.TraceError) as caught:
        warnings.simplefilter("ignore")
        tracing.trace(f, [(2, 3)], None, "field")
    message = str(caught.value)
    assert re.match(r"field cannot be recorded: .*\n  test_trace_numpy\.py:\d+: `.*`\n  remedy: .+", message), message


def test_the_operations_are_those_of_rust() -> None:
    file = FOLDER.parent / "crates" / "recording" / "src" / "op.rs"
    if not file.exists():
        pytest.skip("the sources of the tapes are not here")
    rows = re.findall(r'^    (\w+) (\d+) (\d) (true|false) "\w+",$', file.read_text(encoding="utf-8"), re.MULTILINE)
    here = [(op.name.replace("_", ""), int(op), op.reads, op.has_constant) for op in Op]
    assert here == [(name.upper(), int(code), int(reads), constant == "true") for name, code, reads, constant in rows]
    limits = (file.parent / "tape.rs").read_text(encoding="utf-8")
    assert "MOST_REGISTERS: usize = 1 << 24;" in limits and tracing.MOST_REGISTERS == 1 << 24
    assert f"MOST_EXPONENT: i32 = {tracing.MOST_EXPONENT};" in limits


def test_each_function_is_documented_as_recorded_once() -> None:
    names = tracing.supported()
    assert len(set(names)) == len(names) > 150
    for name in names:
        value: Any = np
        for part in name.split(".")[1:]:
            value = getattr(value, part)
        assert callable(value) and not inspect.isclass(value)
