// SPDX-License-Identifier: BSD-3-Clause

// Contacts that boxes of the hierarchy would step over if their bounds lacked a term. Each is
// missed, or met too late, as soon as the term is dropped (tests/mutation_check.sh).

#include <gtest/gtest.h>

#include <cmath>

#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/mesh_generators.h"

namespace dyop {
namespace {

using testing::MeshArrays;

void append(MeshArrays& all, const MeshArrays& part) {
  const auto first = static_cast<std::int32_t>(all.vertices.size());
  all.vertices.insert(all.vertices.end(), part.vertices.begin(), part.vertices.end());
  for (const TriangleIndices& t : part.triangles) {
    all.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
}

// When a function that falls from positive values reaches zero, by bisection.
template <typename Function>
Scalar root_of(const Function& f, Scalar low, Scalar high) {
  for (int k = 0; k < 60; ++k) {
    const Scalar middle = (low + high) / 2;
    (f(middle) > 0 ? low : high) = middle;
  }
  return low;
}

// A small piece at (0, -1, 0) of a body that turns about z at rate 1 and flies along -x at speed 1:
// its height over the wall x = 0 is 0.01 - t + sin t. Up to second order it does not change at all.
TEST(TurningBoxes, AreBoundedToThirdOrder) {
  const MeshArrays grid = testing::plate_grid(0.5, 0.5, 6, 6);
  const Matrix3 upright = rotation_from_vector(Vector3(0, -std::acos(0.0), 0));  // normal along x
  const TriangleMesh wall = grid.moved(upright, Vector3(0, -1, 0)).mesh();
  const TriangleMesh piece =
      testing::icosphere(1, 1e-4).moved(Matrix3::Identity(), Vector3(0, -1, 0)).mesh();
  const RestMotion rest;
  const ConstantTwistMotion rolling(RigidPose(Vector3(0.0101, 0, 0)), Twist{{-1, 0, 0}, {0, 0, 1}});
  const ToiResult result = time_of_impact(wall, rest, piece, rolling, {0, 0.6});
  const Scalar contact = root_of([](Scalar t) { return 0.01 - t + std::sin(t); }, 0, 0.6);
  ASSERT_EQ(result.status, ToiStatus::Impact);
  EXPECT_LE(result.t_safe, contact + 1e-4);
  EXPECT_GE(result.t_safe, contact - 1e-2);
}

// The cube around the body's origin begins to turn with an angular acceleration of 0.5 about
// (0, 1, -1): its corner (1, 1, 1) is sqrt(2) from the axis, which is more than any half extent,
// and moves along x towards a point. Seven more cubes far away make it a box of its own.
TEST(TurningBoxes, AreAsLargeAsTheirDiagonals) {
  MeshArrays cubes;
  for (int k = 0; k < 8; ++k) {
    append(
        cubes,
        testing::box_mesh(Vector3(1, 1, 1)).moved(Matrix3::Identity(), Vector3(-100.0 * k, 0, 0)));
  }
  const TriangleMesh body = cubes.mesh();
  const Vector3 p(1.02, 0.98, 0.98);
  const TriangleMesh point({p}, {{0, 0, 0}});
  const Vector3 acceleration = 0.5 * Vector3(0, 1, -1).normalized();
  const RestMotion rest;
  const HermiteMotion turning =
      HermiteMotion::from_chart({0, 1}, Matrix3(Matrix3::Identity()), {},
                                {Vector3::Zero(), Vector3::Zero(), acceleration / 2, acceleration});
  const ToiResult result =
      time_of_impact(point, rest, body, turning, {0, 1}, {.distance_tolerance = 1e-6});
  // The height of the point over the face x = 1 of the turned cube.
  const auto height = [&](Scalar t) { return (turning.pose(t).inverse() * p).x() - 1; };
  const Scalar contact = root_of(height, 0, 1);
  ASSERT_EQ(result.status, ToiStatus::Impact);
  EXPECT_LE(result.t_safe, contact);
  EXPECT_GE(result.t_safe, contact - 1e-3);
}

}  // namespace
}  // namespace dyop
