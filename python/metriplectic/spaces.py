"""Spaces: their states as arrays, and the structure constants of Lie algebras.

A state of a space is an array; that of a product is a tuple of the states of its factors. Runs list the entries of a state one after
another, rows first: ``Space.flat`` and ``Space.shaped`` go from one form to the other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Sequence

import numpy as np


@dataclass(frozen=True)
class Factor:
    """A space that is no product: its kind, the shapes of the parts of a state, the directions of a chart, and the numbers of a velocity."""

    kind: str
    shapes: tuple[tuple[int, ...], ...]
    directions: int
    velocities: int
    text: str
    constants: tuple = ()

    @property
    def entries(self) -> int:
        return sum(math.prod(shape) for shape in self.shapes)


@dataclass(frozen=True)
class Space:
    """A space of states; ``a * b`` is the product of two of them.

    Attributes
    ----------
    entries : int
        The numbers of a state.
    directions : int
        The dimension: the numbers of a displacement in a chart.
    velocities : int
        The numbers of a velocity or a covector: those of the ambient space on a sphere, three on SO(3).
    """

    factors: tuple[Factor, ...]

    @property
    def entries(self) -> int:
        return sum(factor.entries for factor in self.factors)

    @property
    def directions(self) -> int:
        return sum(factor.directions for factor in self.factors)

    @property
    def shapes(self) -> tuple[tuple[int, ...], ...]:
        """The shapes of the parts of a state."""
        return tuple(shape for factor in self.factors for shape in factor.shapes)

    @property
    def velocities(self) -> int:
        return sum(factor.velocities for factor in self.factors)

    @property
    def is_vector_space(self) -> bool:
        return all(factor.kind in ("R", "dual") for factor in self.factors)

    def __mul__(self, other: "Space") -> "Space":
        return Space(self.factors + other.factors)

    def __repr__(self) -> str:
        return " * ".join(factor.text for factor in self.factors)

    def shaped(self, x: Any) -> Any:
        """Parts the entries on the last axis: an array of the shape of a state, or a tuple of such for a product."""
        parts, at = [], 0
        for shape in self.shapes:
            size = math.prod(shape)
            parts.append(x[..., at : at + size].reshape(tuple(x.shape[:-1]) + shape))
            at += size
        return parts[0] if len(parts) == 1 else tuple(parts)

    def flat(self, state: Any) -> np.ndarray:
        """Lists the entries of a state: the inverse of ``shaped`` for one state. A list of all entries stays what it is."""
        parts: Sequence[Any] = (state,)
        if len(self.shapes) > 1 and isinstance(state, (tuple, list)) and len(state) == len(self.shapes):
            if any(np.ndim(part) > 0 for part in state):
                parts = state
        flat = np.concatenate([np.asarray(part, dtype=float).reshape(-1) for part in parts])
        if flat.size != self.entries:
            shapes = ", ".join(map(str, self.shapes))
            raise ValueError(f"a state of {self!r} has {self.entries} numbers, of the shape {shapes}; {flat.size} were given")
        return np.ascontiguousarray(flat)


def R(n: int) -> Space:
    """The vector space Rⁿ. A state is an array of the shape ``(n,)``."""
    return Space((Factor("R", ((_size(n),),), n, n, f"R({n})"),))


def lie_dual(constants: Any, name: str = "lie_dual(..)") -> Space:
    """The dual of a Lie algebra with the Lie-Poisson bracket {f, g}(p) = Σ_k p_k c[i, j, k] ∂_if ∂_jg.

    Parameters
    ----------
    constants : array of the shape (n, n, n)
        The structure constants, [e_i, e_j] = Σ_k c[i, j, k] e_k.
    """
    c = np.asarray(constants, dtype=float)
    if c.ndim != 3 or len(set(c.shape)) != 1:
        raise ValueError(f"structure constants have the shape (n, n, n), not {c.shape}")
    n = c.shape[0]
    return Space((Factor("dual", ((n,),), n, n, name, tuple(c.ravel().tolist())),))


def so3_dual() -> Space:
    """The dual of so(3): angular momenta in the frame of a body, p' = p × ω. A state has the shape ``(3,)``."""
    return lie_dual(_levi_civita(), "so3_dual()")


def se3_dual() -> Space:
    """The dual of se(3): angular momentum and momentum, or angular momentum and the direction of gravity. A state has the shape
    ``(6,)``."""
    e, c = _levi_civita(), np.zeros((6, 6, 6))
    c[:3, :3, :3], c[:3, 3:, 3:], c[3:, :3, 3:] = e, e, e
    return lie_dual(c, "se3_dual()")


def sphere(n: int = 2) -> Space:
    """The unit sphere Sⁿ in Rⁿ⁺¹, n = 1 … 7. A state and a velocity have the shape ``(n + 1,)``."""
    return Space((Factor("sphere", ((_size(n) + 1,),), n, n + 1, f"sphere({n})"),))


def SO3() -> Space:
    """The rotations of space. A state is a matrix of the shape ``(3, 3)``; a covector has three numbers, in the frame of the body."""
    return Space((Factor("SO3", ((3, 3),), 3, 3, "SO3()"),))


def half_line() -> Space:
    """The positive numbers, whose steps do not leave them. A state has the shape ``(1,)``."""
    return Space((Factor("half_line", ((1,),), 1, 1, "half_line()"),))


def cotangent_so3() -> Space:
    """T*SO(3): the attitude of a body, a matrix, and its angular momentum in the frame of the body. A state is a tuple of arrays of the
    shapes ``(3, 3)`` and ``(3,)``."""
    return Space((Factor("cotangent_so3", ((3, 3), (3,)), 6, 6, "cotangent_so3()"),))


def product(*spaces: Space) -> Space:
    """The product of spaces. A state is the tuple of their states."""
    return Space(tuple(factor for space in spaces for factor in space.factors))


def _size(n: int) -> int:
    if not isinstance(n, (int, np.integer)) or n < 1:
        raise ValueError(f"a space has a whole number of dimensions from 1 on, not {n!r}")
    return int(n)


def _levi_civita() -> np.ndarray:
    e = np.zeros((3, 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        e[i, j, k], e[j, i, k] = 1.0, -1.0
    return e
