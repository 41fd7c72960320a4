"""Products of arrays, and the linear algebra of small matrices."""

from __future__ import annotations

from typing import Any

import numpy as np

from .operations import Op
from .recording import Recording, Registers
from .symbols import UFUNCS, computed, lift, symbol

MOST_ROWS = 16
"""The largest matrix that is solved or whose determinant is formed: an elimination takes about 2 n³ instructions."""


def _mismatch(recording: Recording, a: Registers, b: Registers) -> Exception:
    return recording.refusal(f"the shapes {a.shape} and {b.shape} do not fit in a product", "compare the shapes")


def _numbers(recording: Recording, *arrays: Any) -> list[Registers]:
    """Lifts the factors of a product; that of booleans alone is a disjunction in NumPy, and refused."""
    lifted = [lift(recording, array) for array in arrays]
    if all(is_condition for _, is_condition in lifted):
        raise recording.refusal("a product of conditions alone is a condition in NumPy", "write np.where(condition, 1.0, 0.0) for numbers")
    return [ids for ids, _ in lifted]


def matmul(recording: Recording, a: Any, b: Any) -> Any:
    """The product ``a @ b``, (..., n, k) by (..., k, m)."""
    left, right = _numbers(recording, a, b)
    if left.ndim == 0 or right.ndim == 0:
        raise recording.refusal("a number stands in `a @ b`", "write a * b")
    rows = left if left.ndim > 1 else left[None, :]
    columns = right.swapaxes(-1, -2) if right.ndim > 1 else right[None, :]
    if rows.shape[-1] != columns.shape[-1]:
        raise _mismatch(recording, left, right)
    result = recording.contraction(rows[..., :, None, :], columns[..., None, :, :])
    if right.ndim == 1:
        result = result[..., 0]
    if left.ndim == 1:
        result = result[..., 0] if right.ndim == 1 else result[..., 0, :]
    return computed(recording, result)


def dot(recording: Recording, a: Any, b: Any, out: None = None) -> Any:
    """NumPy's ``dot``: the sum over the last axis of ``a`` and the last but one of ``b``."""
    left, right = _numbers(recording, a, b)
    if left.ndim == 0 or right.ndim == 0:
        return symbol(recording, a) * symbol(recording, b)
    if right.ndim > 1:
        right = np.moveaxis(right, -2, -1)
    return _paired(recording, left, right)


def inner(recording: Recording, a: Any, b: Any) -> Any:
    """NumPy's ``inner``: the sum over the last axes."""
    left, right = _numbers(recording, a, b)
    if left.ndim == 0 or right.ndim == 0:
        return symbol(recording, a) * symbol(recording, b)
    return _paired(recording, left, right)


def _paired(recording: Recording, left: Registers, right: Registers) -> Any:
    """The sums over the last axes, for all pairs of rows of ``left`` and of ``right``."""
    if left.shape[-1] != right.shape[-1]:
        raise _mismatch(recording, left, right)
    gap = (1,) * (right.ndim - 1)
    return computed(recording, recording.contraction(left.reshape(left.shape[:-1] + gap + left.shape[-1:]), right))


def vdot(recording: Recording, a: Any, b: Any) -> Any:
    return inner(recording, symbol(recording, a).ravel(), symbol(recording, b).ravel())


def vecdot(recording: Recording, a: Any, b: Any, axis: int = -1) -> Any:
    left, right = (np.moveaxis(ids, axis, -1) for ids in _numbers(recording, a, b))
    if left.shape[-1] != right.shape[-1]:
        raise _mismatch(recording, left, right)
    return computed(recording, recording.contraction(left, right))


def matvec(recording: Recording, a: Any, x: Any) -> Any:
    return vecdot(recording, a, symbol(recording, x)[..., None, :])


def vecmat(recording: Recording, x: Any, a: Any) -> Any:
    return vecdot(recording, symbol(recording, a).mT, symbol(recording, x)[..., None, :])


UFUNCS |= {"matmul": matmul, "vecdot": vecdot, "matvec": matvec, "vecmat": vecmat}


def outer(recording: Recording, a: Any, b: Any) -> Any:
    return symbol(recording, a).ravel()[:, None] * symbol(recording, b).ravel()[None, :]


def tensordot(recording: Recording, a: Any, b: Any, axes: Any = 2) -> Any:
    left, right = _numbers(recording, a, b)
    if isinstance(axes, (int, np.integer)):
        axes = (range(left.ndim - int(axes), left.ndim), range(int(axes)))
    along_a, along_b = ([int(k) for k in np.atleast_1d(one)] for one in axes)
    along_a, along_b = [k % left.ndim for k in along_a], [k % right.ndim for k in along_b]
    rest_a = [k for k in range(left.ndim) if k not in along_a]
    rest_b = [k for k in range(right.ndim) if k not in along_b]
    if [left.shape[k] for k in along_a] != [right.shape[k] for k in along_b]:
        raise _mismatch(recording, left, right)
    shape = [left.shape[k] for k in rest_a] + [right.shape[k] for k in rest_b]
    count = int(np.prod([left.shape[k] for k in along_a], dtype=int))
    rows = left.transpose(rest_a + along_a).reshape(-1, count)
    columns = right.transpose(rest_b + along_b).reshape(-1, count)
    return computed(recording, recording.contraction(rows[:, None, :], columns[None, :, :]).reshape(shape))


def einsum(recording: Recording, subscripts: Any, *operands: Any, optimize: Any = False) -> Any:
    """NumPy's ``einsum`` with letters. Operands are contracted from left to right, and an index is summed where it occurs last."""
    if not isinstance(subscripts, str) or "." in subscripts:
        raise recording.refusal("np.einsum is called with lists of axes, or with `...`", "write all indices as letters")
    inputs, arrow, output = subscripts.replace(" ", "").partition("->")
    terms = inputs.split(",")
    if not arrow:
        output = "".join(sorted(c for c in set(inputs) - {","} if inputs.count(c) == 1))
    arrays = _numbers(recording, *operands)
    # NumPy raises what is wrong with the letters or the shapes.
    np.einsum(f"{inputs}->{output}", *(np.broadcast_to(0.0, ids.shape) for ids in arrays), optimize=True)
    letters, result = "", recording.constants(1.0)
    for k, (term, ids) in enumerate(zip(terms, arrays)):
        unique = "".join(dict.fromkeys(term))
        ids = np.einsum(f"{term}->{unique}", ids)  # the diagonal, for a repeated letter
        every = "".join(dict.fromkeys(letters + unique))
        later = set(output).union(*terms[k + 1 :])
        kept, summed = [c for c in every if c in later], [c for c in every if c not in later]
        a, b = _spread(result, letters, kept, summed), _spread(ids, unique, kept, summed)
        if k == 0:
            a = np.broadcast_to(a, b.shape)
            one = recording.total(Op.ADDITION, b.reshape(*b.shape[: len(kept)], -1), 0.0) if summed else b
        else:
            shape = np.broadcast_shapes(a.shape, b.shape)
            flat = (*shape[: len(kept)], int(np.prod(shape[len(kept) :], dtype=int)))
            one = recording.contraction(np.broadcast_to(a, shape).reshape(flat), np.broadcast_to(b, shape).reshape(flat))
        letters, result = "".join(kept), one
    return computed(recording, np.einsum(f"{letters}->{output}", result))


def _spread(ids: Registers, letters: str, kept: list[str], summed: list[str]) -> Registers:
    """Orders the axes by their letters, with an axis of length 1 for each letter that is missing."""
    order = [letters.index(c) for c in [*kept, *summed] if c in letters]
    return ids.transpose(order)[tuple(slice(None) if c in letters else None for c in [*kept, *summed])]


def multi_dot(recording: Recording, arrays: Any, *, out: None = None) -> Any:
    result = symbol(recording, arrays[0])
    for array in arrays[1:]:
        result = matmul(recording, result, array)
    return result


def matrix_power(recording: Recording, a: Any, n: int) -> Any:
    matrix = symbol(recording, a)
    if n < 0:
        matrix, n = inv(recording, matrix), -n
    result = symbol(recording, np.broadcast_to(np.eye(matrix.shape[-1]), matrix.shape))
    for _ in range(n):
        result = matmul(recording, result, matrix)
    return result


def kron(recording: Recording, a: Any, b: Any) -> Any:
    x, y = symbol(recording, a), symbol(recording, b)
    rank = max(x.ndim, y.ndim)
    x, y = x.reshape((1,) * (rank - x.ndim) + x.shape), y.reshape((1,) * (rank - y.ndim) + y.shape)
    places = [(slice(None), None), (None, slice(None))]
    product = x[sum([places[0]] * rank, ())] * y[sum([places[1]] * rank, ())]
    return product.reshape([m * n for m, n in zip(x.shape, y.shape)])


def cross(recording: Recording, a: Any, b: Any, axisa: int = -1, axisb: int = -1, axisc: int = -1, axis: Any = None) -> Any:
    """The vector product of vectors with 3 entries."""
    axisa, axisb, axisc = (axisa, axisb, axisc) if axis is None else (axis, axis, axis)
    x, y = np.moveaxis(symbol(recording, a), axisa, -1), np.moveaxis(symbol(recording, b), axisb, -1)
    if x.shape[-1] != 3 or y.shape[-1] != 3:
        raise recording.refusal("np.cross is called with vectors that do not have 3 entries", "write a[0] * b[1] - a[1] * b[0]")
    parts = [x[..., i] * y[..., j] - x[..., j] * y[..., i] for i, j in ((1, 2), (2, 0), (0, 1))]
    return np.moveaxis(np.stack(parts, axis=-1), -1, axisc)


def norm(recording: Recording, x: Any, ord: Any = None, axis: Any = None, keepdims: bool = False) -> Any:
    """The 2-norm of vectors, the norm of Frobenius of matrices, and the 1-norm and the largest entry of vectors."""
    a = symbol(recording, x)
    is_vector = (a.ndim == 1 and axis is None) or isinstance(axis, (int, np.integer))
    if ord is None or (ord == 2 and is_vector) or (ord == "fro" and not is_vector):
        return np.sqrt(np.sum(a * a, axis=axis, keepdims=keepdims))
    if is_vector and ord in (1, np.inf):
        reduce = np.sum if ord == 1 else np.max
        return reduce(np.abs(a), axis=axis, keepdims=keepdims)
    raise recording.refusal(f"np.linalg.norm with ord={ord!r} is not recorded", "write the sum of powers")


def _square(recording: Recording, a: Any, name: str) -> Any:
    matrix = symbol(recording, a)
    if matrix.ndim < 2 or matrix.shape[-1] != matrix.shape[-2] or matrix.shape[-1] == 0:
        raise recording.refusal(f"np.linalg.{name} is called with the shape {matrix.shape}", "give a square matrix")
    if matrix.shape[-1] > MOST_ROWS:
        raise recording.refusal(
            f"np.linalg.{name} of a matrix of {matrix.shape[-1]} rows is not recorded, with more than {MOST_ROWS}",
            "use its structure, such as blocks; or compute with NumPy what does not depend on the state, and capture it",
        )
    return matrix


def _entries(matrix: Any) -> list[list[Any]]:
    return [[matrix[..., i, j] for j in range(matrix.shape[-1])] for i in range(matrix.shape[-2])]


def _eliminated(rows: list[list[Any]], n: int) -> Any:
    """Makes the first n columns of rows upper triangular, and returns the sign of the exchanges of rows.

    The pivot is the largest entry of its column (Golub and Van Loan, algorithm 3.4.1): exchanges are choices on the tape.
    """
    sign: Any = 1.0
    for k in range(n):
        for i in range(k + 1, n):
            swap = np.abs(rows[i][k]) > np.abs(rows[k][k])
            pairs = [(np.where(swap, y, x), np.where(swap, x, y)) for x, y in zip(rows[k][k:], rows[i][k:])]
            rows[k][k:], rows[i][k:] = [x for x, _ in pairs], [y for _, y in pairs]
            sign = np.where(swap, -sign, sign)
        for i in range(k + 1, n):
            factor = rows[i][k] / rows[k][k]
            rows[i][k + 1 :] = [y - factor * x for x, y in zip(rows[k][k + 1 :], rows[i][k + 1 :])]
    return sign


def _small_det(m: list[list[Any]]) -> Any:
    """The determinant of up to three rows, along the first one."""
    if len(m) == 1:
        return m[0][0]
    if len(m) == 2:
        return m[0][0] * m[1][1] - m[0][1] * m[1][0]
    return sum(m[0][j] * _cofactor(m, 0, j) for j in range(3))


def _cofactor(m: list[list[Any]], i: int, j: int) -> Any:
    """The cofactor of an entry, by a cyclic order of the rest: the sign is in this order."""
    n = len(m)
    if n == 1:
        return 1.0
    if n == 2:
        return m[1 - i][1 - j] if i == j else -m[1 - i][1 - j]
    a, b, c, d = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
    return m[a][c] * m[b][d] - m[a][d] * m[b][c]


def det(recording: Recording, a: Any) -> Any:
    """Determinants: by cofactors up to three rows, otherwise by elimination."""
    matrix = _square(recording, a, "det")
    n, rows = matrix.shape[-1], _entries(matrix)
    if n <= 3:
        return symbol(recording, _small_det(rows))
    sign = _eliminated(rows, n)
    result = rows[0][0] * sign
    for k in range(1, n):
        result = result * rows[k][k]
    return result


def _solved(matrix: Any, columns: list[list[Any]]) -> list[list[Any]]:
    """Solves for the entries of columns: by cofactors up to three rows, otherwise by elimination."""
    n, rows = matrix.shape[-1], _entries(matrix)
    if n <= 3:
        determinant = _small_det(rows)
        cofactors = [[_cofactor(rows, i, j) for j in range(n)] for i in range(n)]
        terms = [[i for i in range(n) if not (isinstance(b[i], float) and b[i] == 0.0)] for b in columns]
        return [[sum(cofactors[i][j] * b[i] for i in used) / determinant for j in range(n)] for b, used in zip(columns, terms)]
    augmented = [row + [b[i] for b in columns] for i, row in enumerate(rows)]
    _eliminated(augmented, n)
    solutions = []
    for at in range(n, n + len(columns)):
        x: list[Any] = [0.0] * n
        for i in reversed(range(n)):
            rest = augmented[i][at]
            for j in range(i + 1, n):
                rest = rest - augmented[i][j] * x[j]
            x[i] = rest / augmented[i][i]
        solutions.append(x)
    return solutions


def solve(recording: Recording, a: Any, b: Any) -> Any:
    """Solutions of ``a x = b``: ``b`` is a vector, or it has as many axes as ``a`` and holds columns."""
    matrix, right = _square(recording, a, "solve"), symbol(recording, b)
    if 1 < right.ndim < matrix.ndim:
        # Version 2 of NumPy takes it for a matrix, and version 1 for a stack of vectors.
        raise recording.refusal(
            f"np.linalg.solve is called with the shapes {matrix.shape} and {right.shape}, which mean other things in other versions of NumPy",
            "write b[..., None] for vectors, and b[None, ...] for a matrix",
        )
    n = matrix.shape[-1]
    if right.ndim == 0 or right.shape[-1 if right.ndim == 1 else -2] != n:
        raise _mismatch(recording, matrix.ids, right.ids)
    if right.ndim == 1:
        return _stacked(recording, _solved(matrix, [[right[i] for i in range(n)]])[0])
    columns = [[right[..., i, j] for i in range(n)] for j in range(right.shape[-1])]
    solutions = [_stacked(recording, x) for x in _solved(matrix, columns)]
    return np.stack(solutions, axis=-1)


def inv(recording: Recording, a: Any) -> Any:
    """Inverses, by the solutions for the columns of the unit matrix."""
    matrix = _square(recording, a, "inv")
    unit = np.eye(matrix.shape[-1]).tolist()
    return np.stack([_stacked(recording, x) for x in _solved(matrix, unit)], axis=-1)


def _stacked(recording: Recording, entries: list[Any]) -> Any:
    shape = np.broadcast_shapes(*(np.shape(entry) for entry in entries))
    return np.stack([np.broadcast_to(symbol(recording, entry), shape) for entry in entries], axis=-1)
