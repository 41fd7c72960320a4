"""The compiled part of the package: systems of recorded functions, and their runs."""

from typing import Any, Callable, Sequence

import numpy as np
from numpy.typing import NDArray

class Error(Exception): ...
class ModelError(Error): ...
class SpanError(Error): ...

class RunError(Error):
    partial: Any

class TraceError(Error): ...

class RawSystem:
    def __new__(
        cls,
        definition: Any,
        theta: list[float],
        ports: list[tuple[str, Any]],
        baths: list[tuple[str, Any, Any]],
        is_open: bool,
        noise: float | None,
        is_verified: bool,
    ) -> RawSystem: ...
    @property
    def lengths(self) -> tuple[int, int]: ...
    def at(self, theta: list[float]) -> RawSystem: ...
    def verified(self, start: NDArray[np.float64], time: float) -> RawSystem: ...
    def report(
        self, start: NDArray[np.float64], time: float
    ) -> tuple[list[tuple[str, float, float, list[float]]], str | None, str]: ...
    def laws(self, states: NDArray[np.float64], times: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def run(
        self, chosen: Any, start: NDArray[np.float64], times: Any, events: list[Any], progress: Callable[[float], Any] | None
    ) -> dict[str, Any]: ...
    def runs(
        self, chosen: Any, starts: NDArray[np.float64], times: Any, events: list[Any], threads: int
    ) -> list[dict[str, Any] | BaseException]: ...

def tangent(
    system: RawSystem,
    chosen: Any,
    start: NDArray[np.float64],
    times: Any,
    events: list[Any],
    along: list[int],
    sizes: list[float],
    accuracy: float | None,
    progress: Callable[[float], Any] | None,
) -> dict[str, Any]: ...
def pull_back(
    system: RawSystem,
    chosen: Any,
    start: NDArray[np.float64],
    times: Any,
    events: list[Any],
    weigh: Callable[[dict[str, Any]], tuple[float, NDArray[np.float64]]],
    along: list[int],
    sizes: list[float],
) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]: ...
def gradient(program: Any, x: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]: ...
def evaluate(program: Any, x: NDArray[np.float64]) -> NDArray[np.float64]: ...
def jacobian(program: Any, x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
def least_squares(
    function: Callable[[NDArray[np.float64]], tuple[NDArray[np.float64], NDArray[np.float64]] | None],
    guess: Sequence[float],
    limits: Sequence[float],
    iterations: int,
) -> tuple[NDArray[np.float64], bool]: ...
