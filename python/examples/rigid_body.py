"""A rigid body whose friction turns it to its axis of the largest inertia: both laws hold on every step.

Run it from the folder ``python``: it prints the certificate of the run, and writes ``rigid_body.png``.
"""

import numpy as np

import metriplectic as mp

inertia = np.array([10.0, 5.0, 1.0])
body = mp.System(mp.so3_dual(), energy=lambda p: 0.5 * np.sum(p * p / inertia), entropy=lambda p: 0.5 * p @ p)
run = body.run([0.001, -1.0, 0.001], t=100.0, tol=1e-9, method="dp8", every=0.1)
print(run.certificate)
print(f"\nthe energy of {len(run)} states differs by at most {abs(run.energy - run.energy[0]).max():.1e} from that of the first")
try:
    run.plot("rigid_body.png")
    print("the picture is rigid_body.png")
except ImportError:
    print("install matplotlib for the picture")
