// SPDX-License-Identifier: BSD-3-Clause

// Searches for the ends of contacts are bounded: by the caller's limits, and where bodies move so
// far that most of their triangles would be looked at.
#include <gtest/gtest.h>

#include "dynamics/step/end_gap.h"
#include "support/inputs/mesh_generators.h"

namespace dyop::dynamics_internal {
namespace {

using namespace testing;

// Two tori of 8,000 triangles, one in the hole of the other, a contact between them.
struct FineTori {
  const TriangleMesh outer = torus(1, 0.25, 80, 50).mesh();
  const TriangleMesh inner = torus(0.5, 0.2, 80, 50).mesh();
  const PairLengths lengths{0.001, 0.004, 0.7};
  std::vector<ContactPoint> found = generate_contacts(outer, {}, inner, {}, 0.06);
  NeighbourList neighbours;
  ContactWorkspace workspace;

  auto ends(Scalar sliding, const QueryLimits& limits) {
    const RigidPose X_WA;
    const RigidPose X_WB;
    const CurvedContact contact{&found.front(), {found.front().gap, sliding, 0, 0}};
    const std::vector<Vector3> points_W{found.front().p_WCa};
    return measured_end_gaps({lengths, outer, X_WA, inner, X_WB, points_W}, {&contact, 1},
                             neighbours, limits, workspace);
  }
};

TEST(FarEnds, AreMeasuredWhileTheyAreNear) {
  FineTori tori;
  ASSERT_FALSE(tori.found.empty());
  const auto ends = tori.ends(0.02, {});
  ASSERT_TRUE(ends);
  ASSERT_EQ(ends->size(), 1u);
  ASSERT_TRUE(ends->front());
  EXPECT_LE(ends->front()->gap, tori.found.front().gap + 1e-12);
}

TEST(FarEnds, AreGivenUpWhereMostOfTheTrianglesWouldBeLookedAt) {
  FineTori tori;
  EXPECT_FALSE(tori.ends(1, {}));
}

TEST(FarEnds, AreGivenUpWhenTheCallerStops) {
  FineTori tori;
  std::stop_source source;
  source.request_stop();
  QueryLimits limits;
  limits.stop = source.get_token();
  EXPECT_FALSE(tori.ends(0.3, limits));
}

}  // namespace
}  // namespace dyop::dynamics_internal
