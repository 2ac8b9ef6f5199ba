// SPDX-License-Identifier: BSD-3-Clause

// 1. When do two shapes touch? And what is a mesh: a surface, or a solid?
#include <dyop/dyop.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

// A closed tube of radius 1 around a circle of radius 3.
dyop::TriangleMesh torus() {
  constexpr int n = 48;
  std::vector<dyop::Vector3> vertices;
  std::vector<dyop::TriangleIndices> triangles;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const double u = 2 * std::numbers::pi * i / n;
      const double v = 2 * std::numbers::pi * j / n;
      const double r = 3 + std::cos(v);
      vertices.push_back({r * std::cos(u), r * std::sin(u), std::sin(v)});
      const auto at = [](int a, int b) { return (a % n) * n + b % n; };
      triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return dyop::TriangleMesh(vertices, triangles);
}

int main() {
  // Two balls of radius 1, centres 6 apart; B approaches at speed 2 for 4 units of time.
  const dyop::Sphere ball(1);
  const dyop::RestMotion at_rest{dyop::RigidPose()};
  const dyop::ConstantTwistMotion coming(dyop::RigidPose({6, 0, 0}), {{-2, 0, 0}, {0, 0, 0}});
  const dyop::ToiResult hit = dyop::time_of_impact(ball, at_rest, ball, coming, {0, 4});
  if (hit.status == dyop::ToiStatus::Impact) {
    const dyop::Vector3 p = hit.contact->p_WCa;
    std::printf("balls: proven apart until %.5f, where (%.3f, %.3f, %.3f) touches\n", hit.t_safe,
                p.x(), p.y(), p.z());
  }

  // A small ball rests inside the tube of the torus, touching nothing. A mesh is a surface ...
  const dyop::TriangleMesh tube = torus();
  const dyop::Sphere marble(0.25);
  const dyop::RestMotion inside{dyop::RigidPose({3, 0, 0})};
  const dyop::ToiResult surface = dyop::time_of_impact(tube, at_rest, marble, inside, {0, 1});
  std::printf("torus as a surface: %s\n",
              surface.status == dyop::ToiStatus::Separated ? "separated" : "in contact");

  // ... unless you declare it a solid.
  dyop::ToiOptions options;
  options.solid_a = true;
  const dyop::ToiResult solid =
      dyop::time_of_impact(tube, at_rest, marble, inside, {0, 1}, options);
  std::printf("torus as a solid: %s\n",
              solid.status == dyop::ToiStatus::Separated ? "separated" : "in contact");
}
// Prints:
// balls: proven apart until 2.00000, where (1.000, 0.000, 0.000) touches
// torus as a surface: separated
// torus as a solid: in contact
