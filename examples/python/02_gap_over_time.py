# SPDX-License-Identifier: BSD-3-Clause
"""2. The gap of two turning boxes over time, as a picture."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import dyop

a, b = dyop.Box([1, 0.4, 0.3]), dyop.Box([0.8, 0.2, 0.2])
X_WA = dyop.ConstantTwistMotion(dyop.RigidPose(), ((0, 0, 0), (0, 0, 4)))
X_WB = dyop.ConstantTwistMotion(((1, 0, 0, 0), (4, 0.2, 0)), ((-1, 0, 0), (0, 3, 1)))

times = np.linspace(0, 3, 301)
poses_a = np.array([X_WA.pose(t).matrix for t in times])
poses_b = np.array([X_WB.pose(t).matrix for t in times])
rows = dyop.distance_batch(a, poses_a, b, poses_b)
impact = dyop.time_of_impact(a, X_WA, b, X_WB, (0, 3))

figure, axes = plt.subplots(figsize=(6, 3.5))
axes.plot(times, rows["upper"], label="distance")
axes.axvspan(0, impact.t_safe, color="tab:green", alpha=0.15, label="proven apart")
axes.axvline(impact.t_safe, color="tab:red", label=f"impact, t = {impact.t_safe:.3f}")
axes.set(xlabel="time", ylabel="distance")
axes.legend()
figure.tight_layout()
figure.savefig("gap_over_time.png", dpi=120)
print(f"{len(rows)} distances, impact at t = {impact.t_safe:.4f}")
print("least distance sampled before it:", rows["upper"][times < impact.t_safe].min() > 0)
# Prints:
# 301 distances, impact at t = 2.8289
# least distance sampled before it: True
