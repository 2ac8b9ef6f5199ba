// SPDX-License-Identifier: BSD-3-Clause

// 5. Bounded time: a query that runs out of budget still proves something, and can be resumed.
#include <dyop/dyop.h>

#include <cmath>
#include <cstdio>
#include <vector>

// A bowl of triangles: z = (x² + y²) / 4 over a square.
dyop::TriangleMesh bowl() {
  constexpr int n = 60;
  std::vector<dyop::Vector3> vertices;
  std::vector<dyop::TriangleIndices> triangles;
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) {
      const double x = 4.0 * i / n - 2;
      const double y = 4.0 * j / n - 2;
      vertices.push_back({x, y, (x * x + y * y) / 4});
      if (i == n || j == n) continue;
      const int k = i * (n + 1) + j;
      triangles.push_back({k, k + n + 1, k + 1});
      triangles.push_back({k + 1, k + n + 1, k + n + 2});
    }
  }
  return dyop::TriangleMesh(vertices, triangles);
}

int main() {
  const dyop::TriangleMesh lower = bowl();
  const dyop::TriangleMesh upper = bowl();
  const dyop::RestMotion at_rest{dyop::RigidPose()};
  const dyop::ConstantTwistMotion falling(dyop::RigidPose({0.3, 0.1, 2}),
                                          {{0, 0, -1}, {0.5, 0, 2}});

  // A budget of node pairs gives the same result on every machine; a deadline is a point in time.
  dyop::ToiOptions options;
  options.max_node_pairs = 15;
  dyop::ToiWorkspace workspace;  // keeps the remaining work; one per thread
  dyop::ToiResult result =
      dyop::time_of_impact(lower, at_rest, upper, falling, {0, 3}, options, workspace);
  while (workspace.can_resume()) {
    std::printf("budget spent: apart until %.4f, undecided after\n", result.t_safe);
    result =
        dyop::resume_time_of_impact(lower, at_rest, upper, falling, {0, 3}, options, workspace);
  }
  std::printf("%s: apart until %.4f\n",
              result.status == dyop::ToiStatus::Impact ? "impact" : "no impact", result.t_safe);
}
// Prints:
// budget spent: apart until 0.3484, undecided after
// budget spent: apart until 0.5513, undecided after
// budget spent: apart until 0.6098, undecided after
// budget spent: apart until 0.6479, undecided after
// impact: apart until 0.6494
