# SPDX-License-Identifier: BSD-3-Clause
"""3. An impact lies between t_safe and t_hit: how the bracket shrinks with the tolerance."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import dyop

a, b = dyop.Capsule(0.3, 1), dyop.Box([0.5, 0.5, 0.5])
X_WA = dyop.ConstantTwistMotion(dyop.RigidPose(), ((0, 0, 0), (2, 1, 0)))
X_WB = dyop.ConstantTwistMotion(((1, 0, 0, 0), (0, 0, 4)), ((0, 0.1, -1), (0, 1, 2)))

tolerances = [10.0**-k for k in range(1, 10)]
brackets = []
for tolerance in tolerances:
    options = dyop.ToiOptions(distance_tolerance=tolerance)
    result = dyop.time_of_impact(a, X_WA, b, X_WB, (0, 4), options)
    brackets.append((result.t_safe, result.t_hit, result.statistics.node_pairs))
    print(f"{tolerance:.0e}: {result.t_safe:.10f} < t < {result.t_hit:.10f}")

best = (brackets[-1][0] + brackets[-1][1]) / 2
figure, axes = plt.subplots(figsize=(6, 3.5))
axes.loglog(tolerances, [best - safe for safe, _, _ in brackets], "o-", label="t - t_safe")
axes.loglog(tolerances, [max(hit - best, 1e-16) for _, hit, _ in brackets], "s-", label="t_hit - t")
axes.set(xlabel="distance tolerance", ylabel="time")
axes.legend()
figure.tight_layout()
figure.savefig("bracket_of_an_impact.png", dpi=120)
# Prints:
# 1e-01: 2.4320905040 < t < 2.4370574293
# 1e-02: 2.4479024441 < t < 2.4483969439
# 1e-03: 2.4493261253 < t < 2.4493755653
# 1e-04: 2.4494685075 < t < 2.4494734514
# 1e-05: 2.4494836101 < t < 2.4494841044
# 1e-06: 2.4494850339 < t < 2.4494850833
# 1e-07: 2.4494851763 < t < 2.4494851812
# 1e-08: 2.4494851905 < t < 2.4494851910
# 1e-09: 2.4494851919 < t < 2.4494851920
