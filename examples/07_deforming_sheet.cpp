// SPDX-License-Identifier: BSD-3-Clause

// 7. A deforming surface: every vertex moves on a straight line from snapshot to snapshot.
#include <dyop/dyop.h>

#include <cmath>
#include <cstdio>
#include <vector>

constexpr int kCells = 20;

// A sheet over [-1, 1]² with a wave of this height at this phase.
std::vector<dyop::Vector3> sheet(double height, double phase) {
  std::vector<dyop::Vector3> vertices;
  for (int i = 0; i <= kCells; ++i) {
    for (int j = 0; j <= kCells; ++j) {
      const double x = 2.0 * i / kCells - 1;
      const double y = 2.0 * j / kCells - 1;
      vertices.push_back({x, y, height * std::sin(4 * x + phase)});
    }
  }
  return vertices;
}

int main() {
  std::vector<dyop::TriangleIndices> triangles;
  for (int k = 0; k < kCells * (kCells + 1); ++k) {
    if (k % (kCells + 1) == kCells) continue;
    triangles.push_back({k, k + kCells + 1, k + 1});
    triangles.push_back({k + 1, k + kCells + 1, k + kCells + 2});
  }
  // A needle: segments and points are legal triangles.
  const dyop::TriangleMesh needle({{0, 0, 0}, {0, 0, 1}}, {{0, 1, 1}});
  const dyop::ConstantTwistMotion pushed(dyop::RigidPose({0.1, 0.05, 0.5}),
                                         {{0, 0, -0.2}, {0, 0, 0}});

  // Snapshots come every 0.5. The tree of boxes is built once; advance() refits it to the next one.
  dyop::DeformingMesh tissue(sheet(0.1, 0), sheet(0.12, 0.3), triangles);
  for (int step = 0; step < 6; ++step) {
    const dyop::TimeInterval interval{0.5 * step, 0.5 * (step + 1)};
    const dyop::ToiResult result = dyop::time_of_impact(tissue, needle, pushed, interval);
    if (result.status == dyop::ToiStatus::Impact) {
      std::printf("the needle meets triangle %d at t = %.4f\n", *result.contact->triangle_a,
                  result.t_safe);
      break;
    }
    std::printf("apart until t = %.1f\n", result.t_safe);
    tissue.advance(sheet(0.1 + 0.02 * (step + 2), 0.3 * (step + 2)));
  }
}
// Prints:
// apart until t = 0.5
// apart until t = 1.0
// apart until t = 1.5
// the needle meets triangle 460 at t = 1.6822
