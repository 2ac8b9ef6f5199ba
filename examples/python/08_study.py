# SPDX-License-Identifier: BSD-3-Clause
"""8. A study: one question for many cases, on worker processes if there are any.

    python3 08_study.py                         here
    python3 08_study.py tcp://scheduler:8786    on the workers of a Dask scheduler
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

import dyop
from dyop import study


def least_gap(case: int, tool: dyop.Shape, vessel: dyop.Shape) -> float:
    """How near a tool that wobbles at random comes to a vessel."""
    generator = np.random.default_rng(case)
    start = dyop.RigidPose(position=(-2, 0.6 + 0.2 * generator.normal(), 0))
    motion = dyop.ConstantTwistMotion(start, ((1, 0, 0), generator.normal(size=3)))
    result = dyop.least_distance(tool, motion, vessel, dyop.RestMotion(), (0, 4))
    return result.lower


shared = {"tool": dyop.Capsule(0.05, 0.3), "vessel": dyop.Capsule(0.1, 2)}
client = None
if len(sys.argv) > 1:
    from distributed import Client

    client = Client(sys.argv[1])

with tempfile.TemporaryDirectory() as folder:
    # Results are kept in a file; a study that was stopped goes on from it.
    store = Path(folder) / "gaps.sqlite"
    first = study.imap(least_gap, range(50), client=client, shared=shared, chunk=10, store=store)
    print("stopped after case", next(first)[0])
    first.close()
    gaps = np.array(
        study.map(least_gap, range(50), client=client, shared=shared, chunk=10, store=store)
    )
print(f"{len(gaps)} cases, {np.sum(gaps < 0.1)} nearer than 0.1, least gap {gaps.min():.4f}")
# Prints:
# stopped after case 0
# 50 cases, 7 nearer than 0.1, least gap 0.0000
