// SPDX-License-Identifier: BSD-3-Clause
#include "toi/deforming/standing_pair.h"

#include <gtest/gtest.h>

#include "dyop/distance/distance.h"
#include "support/inputs/mesh_generators.h"

namespace dyop {
namespace {

using distance_internal::BoxPairStack;
using toi_internal::StandingPair;

// A ball over a sheet in the middle of its motion.
TEST(StandingPair, IsApartByAnythingLessThanItsDistanceAndByNothingMore) {
  const auto arrays = testing::plate_grid(4, 4, 5, 5);
  std::vector<Vector3> end = arrays.vertices;
  for (Vector3& p : end) p.z() += 0.3 * p.x();
  const DeformingMesh sheet(arrays.vertices, end, arrays.triangles);
  const TriangleMesh ball = testing::icosphere(1).mesh();
  BoxPairStack stack;
  for (const Scalar height : {0.5, 1.3, 2.0, 5.0}) {
    const RigidPose X_WB(rotation_from_vector({0.3, 0.2, 0.1}), Vector3(0.2, 0.1, height));
    const StandingPair sides(sheet, 0.5, ball, X_WB);
    const DistanceResult truth =
        distance(sheet.snapshot(0.5), RigidPose(), ball, X_WB, DistanceOptions{});
    const auto is_apart_by = [&](Scalar least) {
      return sides.is_apart_by(
          least, [] { return false; }, stack);
    };
    EXPECT_EQ(is_apart_by(0), truth.lower > 0) << height;
    EXPECT_EQ(is_apart_by(0.99 * truth.lower), truth.lower > 0) << height;
    EXPECT_EQ(is_apart_by(1.01 * truth.upper + 0.01), false) << height;
    EXPECT_EQ(sides.is_apart_by(
                  0, [] { return true; }, stack),
              std::nullopt)
        << height;
  }
}

}  // namespace
}  // namespace dyop
