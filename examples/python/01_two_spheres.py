# SPDX-License-Identifier: BSD-3-Clause
"""1. When do two moving shapes first meet?"""

import dyop

# A ball of radius 1 rests at the origin; one of radius 0.5 starts at x = 5.5 and flies to the left,
# two units of length per unit of time, spinning.
a, b = dyop.Sphere(1.0), dyop.Sphere(0.5)
X_WA = dyop.RestMotion()
start = dyop.RigidPose(position=(5.5, 0, 0))
X_WB = dyop.ConstantTwistMotion(start, dyop.Twist(v_WB=(-2, 0, 0), w_WB=(0, 0, 9)))

result = dyop.time_of_impact(a, X_WA, b, X_WB, interval=(0, 10))
print(result.status.name, f"at t = {result.t_safe:.4f}")
print("normal from A to B:", result.contact.nhat_AB_W)

# Until t = 1 nothing can happen, and that is proven.
early = dyop.time_of_impact(a, X_WA, b, X_WB, (0, 1))
print(early.status.name, f"until t = {early.t_safe:g}")

# The distance at one time, between proven bounds.
gap = dyop.distance(a, X_WA.pose(1), b, X_WB.pose(1))
print(f"{gap.lower:.6f} <= distance at t = 1 <= {gap.upper:.6f}")
# Prints:
# Impact at t = 2.0000
# normal from A to B: [1. 0. 0.]
# Separated until t = 1
# 2.000000 <= distance at t = 1 <= 2.000000
