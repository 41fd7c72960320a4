"""Writes robust_fits.json: fits of x(t; r, c) = c + (2 - c) exp(-r t) by `scipy.optimize.least_squares`, in bounds and with robust losses.

The data are the curve of r = 0.8 and c = 0.5 at t = 0.25, 0.5, .. 6 with Gaussian noise of 0.02, and every sixth of them is 0.4 too high.
A row has the loss and its scale, the bounds of r and of c (null: none), where SciPy ends, and the least cost.

    python3 robust_fits.py > robust_fits.json        (numpy, scipy 1.17)
"""

import json

import numpy as np
from scipy.optimize import least_squares

rng = np.random.default_rng(20)
times = 0.25 * np.arange(1, 25)
curve = lambda p: p[1] + (2.0 - p[1]) * np.exp(-p[0] * times)
data = np.round(curve([0.8, 0.5]) + 0.02 * rng.standard_normal(24) + 0.4 * (np.arange(24) % 6 == 4), 6)
residuals = lambda p: curve(p) - data
slope = lambda p: np.stack(
    [-times * (2.0 - p[1]) * np.exp(-p[0] * times), 1.0 - np.exp(-p[0] * times)], axis=1
)

cases = []
for loss, scale in [("linear", 1.0), ("huber", 0.05), ("soft_l1", 0.05), ("cauchy", 0.05)]:
    for bounds in [
        [[None, None], [None, None]],
        [[0.2, 0.7], [0.0, None]],
        [[None, None], [0.6, 3.0]],
        [[0.9, 5.0], [0.1, 0.45]],
        [[0.1, 3.0], [-1.0, 2.0]],
    ]:
        low = [-np.inf if a is None else a for a, _ in bounds]
        high = [np.inf if b is None else b for _, b in bounds]
        start = np.clip([1.0, 0.42], np.array(low) + 0.01, np.array(high) - 0.01)
        found = least_squares(
            residuals, start, slope, bounds=(low, high), loss=loss, f_scale=scale,
            ftol=1e-15, xtol=1e-15, gtol=1e-15, max_nfev=10000,
        )
        # SciPy stays strictly inside: an active bound is that bound.
        best = [b if k == 1 else a if k == -1 else x
                for x, k, a, b in zip(found.x, found.active_mask, low, high)]
        cases.append({"loss": loss, "scale": scale, "bounds": bounds, "start": start.tolist(),
                      "active": found.active_mask.tolist(), "parameters": best, "scipy": found.x.tolist(), "cost": found.cost})

print(json.dumps({"times": times.tolist(), "data": data.tolist(), "cases": cases}, indent=1))
