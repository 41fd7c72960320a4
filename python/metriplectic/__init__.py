"""Integrate metriplectic (GENERIC) systems: the first law to round-off, the second law kept.

A system x' = Π dH + K dS is said by functions of NumPy: the energy H, the entropy S, and what else it has. Each function is recorded
once, and runs need no interpreter::

    import numpy as np, metriplectic as mp

    inertia = np.array([10.0, 5.0, 1.0])
    body = mp.System(mp.so3_dual(), energy=lambda p: 0.5 * np.sum(p * p / inertia), entropy=lambda p: 0.5 * p @ p)
    run = body.run([0.001, -1.0, 0.001], t=100.0, tol=1e-9, method="dp8", every=0.1)
    print(run.certificate)
"""

from . import jax
from ._metriplectic import Error, ModelError, RunError, SpanError, TraceError
from ._trace import array, supported
from .fitting import Estimate, Fit, fit
from .run import Certificate, FoundEvent, Run, Tangent
from .spaces import R, SO3, Space, cotangent_so3, half_line, lie_dual, product, se3_dual, so3_dual, sphere
from .sweeps import Sweep, sweep
from .system import Event, Report, System

__version__ = "0.1.0"

__all__ = [
    "Certificate", "Error", "Estimate", "Event", "Fit", "FoundEvent", "ModelError", "R", "Report", "Run", "RunError", "SO3", "Space",
    "SpanError", "Sweep", "System", "Tangent", "TraceError", "array", "cotangent_so3", "fit", "half_line", "jax", "lie_dual", "product",
    "se3_dual", "so3_dual", "sphere", "supported", "sweep",
]
