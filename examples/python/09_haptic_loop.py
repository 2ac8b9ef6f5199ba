# SPDX-License-Identifier: BSD-3-Clause
"""9. A haptic loop: a ball follows a device onto a sheet that breathes."""

import time

import numpy as np
from numpy.typing import NDArray

import dyop
from dyop import haptics

# Millimetres, newtons, seconds. A 41 x 41 grid.
n = 41
x, y = np.meshgrid(np.linspace(-40, 40, n), np.linspace(-40, 40, n), indexing="ij")
first = np.arange(n * n).reshape(n, n)[:-1, :-1].ravel()
corners = np.concatenate(
    [np.stack([first, first + n, first + n + 1], 1), np.stack([first, first + n + 1, first + 1], 1)]
)


def sheet(height: float) -> NDArray[np.float64]:
    z = height * np.exp(-(x**2 + y**2) / 800)
    return np.column_stack([x.ravel(), y.ravel(), z.ravel()])


scene = haptics.HapticScene(
    tool=[haptics.ToolPart(shape=dyop.Sphere(2.0))],
    obstacles=[haptics.ToolObstacle(name="sheet", vertices=sheet(0), triangles=corners, friction=0.2)],
    X_WT=dyop.RigidPose(position=(0, 0, 10)),
)
options = haptics.HapticOptions(rest_offset=0.02, recovery_speed=50)
options.coupling.stiffness = [1, 1, 1]  # N/mm
options.coupling.rotational_stiffness = [200, 200, 200]
session = haptics.HapticSession(scene, options)

upright = np.array([1.0, 0, 0, 0])
for tick in range(601):
    if tick % 20 == 0:  # 50 snapshots a second; usually from a thread of the simulation
        session.give_snapshot(0, sheet(3 * np.sin(1.57 * (tick + 20) / 1000)), 0.02)
    down = min(1.0, tick / 300)
    result = session.update((upright, np.array([0.0, 0, 10 - 10 * down])), 0.001)
    if tick % 150 == 0:
        force = result.wrench.force_W[2]
        print(f"{result.time:.2f} s: {result.status.name}, {force:.2f} N up, "
              f"{len(result.contacts)} contacts {[c.state.name for c in result.contacts]}")

# The same session in a thread that never waits for Python.
runner = haptics.HapticRunner(session, haptics.RunnerOptions(ticks=200, is_paced=False))
runner.set_device((upright, np.array([0.0, 0, 12])))
runner.start()
while runner.is_running:
    time.sleep(0.001)
print(runner.stop().ticks, "ticks, then", runner.read_ticks()[-1].tick.status.name)
# Prints:
# 0.00 s: Free, 0.00 N up, 0 contacts []
# 0.15 s: Free, 0.00 N up, 0 contacts []
# 0.30 s: Held, 3.39 N up, 1 contacts ['Stick']
# 0.45 s: Held, 3.97 N up, 1 contacts ['Stick']
# 0.60 s: Held, 4.45 N up, 1 contacts ['Stick']
# 200 ticks, then Free
