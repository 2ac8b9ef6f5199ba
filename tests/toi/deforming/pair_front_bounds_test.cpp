// SPDX-License-Identifier: BSD-3-Clause

// Bounds that a front takes over: from triangles it has measured, and from their neighbours.
#include <gtest/gtest.h>

#include <algorithm>

#include "support/inputs/mesh_generators.h"
#include "toi/deforming/pair_front.h"

namespace dyop {
namespace {

using distance_internal::PieceDistance;
using toi_internal::PairFront;
using toi_internal::StandingPair;

template <typename Check>
void visit_all(PairFront& front, const StandingPair& sides, const Check& check) {
  const auto never = [] { return false; };
  EXPECT_TRUE(front.refine(sides, kInfinity, never,
                           [&](const PieceDistance& piece, std::int32_t a, std::int32_t b) {
                             check(piece, a, b);
                             return kInfinity;
                           }));
}

// Far from the origin, where rounding is not lost in the margins of what is computed from a bound.
TEST(PairFrontBounds, TheFrontPromisesNoMoreThanItsTrianglesDo) {
  constexpr Scalar kFar = 1e6;
  auto arrays = testing::plate_grid(4, 4, 5, 5);
  for (Vector3& p : arrays.vertices) p += Vector3(kFar, 0, 0);
  const DeformingMesh sheet(arrays.vertices, arrays.vertices, arrays.triangles);
  const TriangleMesh ball = testing::icosphere(1).mesh();
  for (const Scalar height : {1.05, 1.5, 4.0}) {
    const RigidPose X_WB(rotation_from_vector({0.3, 0.2, 0.1}), Vector3(kFar, 0.1, height));
    const StandingPair sides(sheet, 0, ball, X_WB);
    PairFront front;
    Scalar least = kInfinity;
    visit_all(front, sides, [&](const PieceDistance& piece, std::int32_t, std::int32_t) {
      least = std::min(least, piece.lower);
    });
    EXPECT_GT(front.lower(), 0) << height;
    EXPECT_LE(front.lower(), least) << height;
  }
}

// One triangle of the sheet goes through the rigid one, or touches it; the others do not, though
// measured after it.
TEST(PairFrontBounds, TrianglesThatTouchTellNothingAboutOthers) {
  const TriangleMesh rigid({{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}}, {{{0, 1, 2}}});
  for (const Scalar depth : {0.0, 0.5}) {
    const std::vector<Vector3> vertices{{0, 0, -depth}, {0.2, 0, 1}, {0, 0.2, 1},  // touches
                                        {0, 0, 3},      {1, 0, 3},   {0, 1, 3}};
    for (const bool is_first : {true, false}) {
      std::vector<TriangleIndices> triangles{{0, 1, 2}, {3, 4, 5}};
      if (!is_first) std::swap(triangles[0], triangles[1]);
      const DeformingMesh sheet(vertices, vertices, triangles);
      const StandingPair sides(sheet, 0, rigid, RigidPose());
      PairFront front;
      int visits = 0;
      visit_all(front, sides, [&](const PieceDistance& piece, std::int32_t a, std::int32_t) {
        const Scalar truth = sides.a.triangle_W(a)[0].z() > 2 ? 3 : 0;
        EXPECT_LE(piece.lower, truth);
        EXPECT_GE(piece.upper, truth);
        EXPECT_LE(piece.upper - piece.lower, 1e-9);
        ++visits;
      });
      EXPECT_EQ(visits, 2);
    }
  }
}

}  // namespace
}  // namespace dyop
