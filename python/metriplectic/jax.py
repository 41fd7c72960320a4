"""Runs inside of programs of JAX, whose derivatives are those of the discrete steps. It needs JAX when it is called."""

from __future__ import annotations

from typing import Any, Mapping

import numpy as np

from .system import System


def solve(system: System, y0: Any, parameters: Mapping[str, Any] | None = None, *, at: Any, **options: Any) -> Any:
    """Runs a system, as a function of JAX with derivatives along the start and the parameters.

    The derivative in reverse is the discrete adjoint of the run, so that both laws hold in the rollout whatever the parameters are. It has
    64-bit numbers inside; JAX rounds them to its own.

    Parameters
    ----------
    y0 : array (n,)
        The entries of the start, on a vector space.
    parameters : dict, optional
        Values of parameters of the system, which may be traced by JAX.
    at : array (m,)
        The times of the states, each behind the start.
    options
        Those of ``System.run``, such as ``method``, ``tol`` and ``h``.

    Returns
    -------
    array (m, n)
        The entries of the states at the times.
    """
    import jax
    import jax.numpy as jnp

    if not system.space.is_vector_space:
        raise ValueError("derivatives along the entries of a start are those of a vector space")
    times = np.asarray(at, dtype=float).ravel()
    options = {"t": float(times[-1]), **options}
    n, names = system.space.entries, tuple(parameters or {})
    y0 = jnp.asarray(y0, dtype=float)
    shape = jax.ShapeDtypeStruct((len(times), n), y0.dtype)

    def member(theta):
        return system(**{name: np.asarray(value, dtype=float) for name, value in theta.items()})

    def places(t):
        return np.searchsorted(t, times)

    def forward(start, theta):
        run = member(theta).run(np.asarray(start, dtype=float), at=times, **options)
        return run.y[places(run.t)].astype(shape.dtype)

    def backward(start, theta, weights):
        def weigh(run):
            all_weights = np.zeros_like(run["y"])
            all_weights[places(run["t"])] = np.asarray(weights, dtype=float)
            return 0.0, all_weights

        _, along, rest = member(theta)._pull_back(
            weigh, along=list(names), y0=np.asarray(start, dtype=float), at=times, **options
        )
        return along.astype(y0.dtype), {name: np.asarray(rest[name], dtype=jnp.result_type(theta[name])) for name in names}

    @jax.custom_vjp
    def run(start, theta):
        return jax.pure_callback(forward, shape, start, theta, vmap_method="sequential")

    def run_forward(start, theta):
        return run(start, theta), (start, theta)

    def run_backward(kept, weights):
        start, theta = kept
        like = jax.tree.map(lambda x: jax.ShapeDtypeStruct(jnp.shape(x), jnp.result_type(x)), (start, theta))
        return jax.pure_callback(backward, like, start, theta, weights, vmap_method="sequential")

    run.defvjp(run_forward, run_backward)
    return run(y0, {name: jnp.asarray(value, dtype=float) for name, value in (parameters or {}).items()})
