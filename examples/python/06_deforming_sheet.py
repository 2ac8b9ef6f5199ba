# SPDX-License-Identifier: BSD-3-Clause
"""6. A sheet whose vertices move sinks onto a ball: impact, and the next interval."""

import numpy as np
from numpy.typing import NDArray

import dyop

# A 21 x 21 grid; its middle sinks faster than its border.
n = 21
x, y = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n), indexing="ij")
first = np.arange(n * n).reshape(n, n)[:-1, :-1].ravel()
corners = np.concatenate(
    [np.stack([first, first + n, first + n + 1], 1), np.stack([first, first + n + 1, first + 1], 1)]
)


def sheet(depth: float) -> NDArray[np.float64]:
    z = 1.5 - depth * np.exp(-2 * (x**2 + y**2))
    return np.column_stack([x.ravel(), y.ravel(), z.ravel()])


ball = dyop.place_mesh(dyop.TriangleMesh([[0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]],
                                         [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]]), scale=0.8)
mesh = dyop.DeformingMesh(sheet(0), sheet(0.3), corners)
for step in range(1, 5):
    result = dyop.time_of_impact(mesh, ball, dyop.RestMotion(), (0.0, 1.0))
    print(f"step {step}: {result.status.name}, proven until {result.t_safe:.4f} of it")
    if result.status == dyop.ToiStatus.Impact:
        print("triangle of the ball:", result.contact.triangle_b)
        break
    mesh.advance(sheet(0.3 * (step + 1)))
# Prints:
# step 1: Separated, proven until 1.0000 of it
# step 2: Separated, proven until 1.0000 of it
# step 3: Impact, proven until 0.3333 of it
# triangle of the ball: 2
