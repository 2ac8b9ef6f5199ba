# SPDX-License-Identifier: BSD-3-Clause
"""4. Arrays in, arrays out: many queries at once, on all cores, the same bytes for any number."""

import numpy as np

import dyop

# A ball is shot at a turning box in 1000 directions.
count = 1000
box, ball = dyop.Box([1, 0.5, 0.25]), dyop.Sphere(0.1)
turning = dyop.ConstantTwistMotion(dyop.RigidPose(), ((0, 0, 0), (0, 0, 3)))
positions = np.zeros((count, 3))
positions[:, 0] = -4
positions[:, 1] = 0.002 * np.arange(count) - 1
quaternions = np.tile([1.0, 0, 0, 0], (count, 1))
velocity = np.tile([2.0, 0, 0], (count, 1))
shots = dyop.constant_twist_motions((quaternions, positions), velocity, np.zeros((count, 3)))

rows = dyop.time_of_impact_batch(box, turning, ball, shots, (0, 4))
hits = rows["status"] == int(dyop.ToiStatus.Impact)
print(f"{hits.sum()} of {count} shots hit, the first at t = {rows['t_safe'][hits].min():.4f}")
print("fields:", *list(rows.dtype.fields or ())[:6], "...")

# A slice of the signed distance of the box. Contiguous points are read where they are.
points = np.zeros((5, 3))
points[:, 0] = 0.5 * np.arange(5)
signed = dyop.PointDistanceOptions(is_signed=True)
distances = dyop.point_distance_batch(box, np.eye(4), points, signed, copy=False)
print("signed distances:", np.round(distances["upper"], 4) + 0.0)
# Prints:
# 812 of 1000 shots hit, the first at t = 1.6239
# fields: t_safe t_hit lower upper p_WCa p_WCb ...
# signed distances: [-0.25 -0.25  0.    0.5   1.  ]
