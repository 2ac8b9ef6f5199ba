// SPDX-License-Identifier: BSD-3-Clause

// Lists of neighbours for the end of a substep.
#include <gtest/gtest.h>

#include "dynamics/pair_state.h"
#include "support/inputs/mesh_generators.h"

namespace dyop::dynamics_internal {
namespace {

using namespace testing;

// Two tori, one in the hole of the other, 0.05 apart at most places.
struct NestedTori {
  const TriangleMesh outer = torus(1, 0.25, 24, 12).mesh();
  const TriangleMesh inner = torus(0.5, 0.2, 24, 12).mesh();
  PairState pair;

  NestedTori() {
    pair.lengths = {0.001, 0.004, 0.7};
    pair.reach = 0.06;
    pair.pivot.p_W = Vector3(0.72, 0, 0);
  }
  bool covers(const RigidPose& X_WB, Scalar reach) const {
    const auto placement = pair.neighbours.place(outer, {}, inner, X_WB);
    return pair.neighbours.covers(placement, {reach});
  }
};

TEST(EndList, IsMadeWhereOneForSeveralStepsWasTooLong) {
  NestedTori tori;
  list_end(tori.pair, tori.outer, {}, tori.inner, {});
  EXPECT_FALSE(tori.pair.neighbours.is_built());
  tori.pair.searches_to_skip = 2;
  list_end(tori.pair, tori.outer, {}, tori.inner, {});
  EXPECT_TRUE(tori.covers({}, tori.pair.reach));
  EXPECT_EQ(tori.pair.searches_to_skip, 1);
}

TEST(EndList, ServesWhereTheSubstepEndsAlmostThereAndIsMadeAgainElsewhere) {
  NestedTori tori;
  tori.pair.searches_to_skip = 64;
  list_end(tori.pair, tori.outer, {}, tori.inner, {});
  const RigidPose beside(rotation_from_vector(Vector3(0, 0, 0.01)), Vector3(0.005, 0, 0.003));
  list_end(tori.pair, tori.outer, {}, tori.inner, beside);
  EXPECT_EQ(tori.pair.searches_to_skip, 63);
  ASSERT_TRUE(tori.covers(beside, tori.pair.reach));

  // The nearest pairs that the list gives are those of a search of the trees.
  DistanceOptions options;
  options.max_distance = tori.pair.reach;
  const DistanceResult by_tree = distance(tori.outer, {}, tori.inner, beside, options);
  ASSERT_EQ(by_tree.status, DistanceStatus::Separated);
  ASSERT_TRUE(tori.pair.list_near(tori.outer, {}, tori.inner, beside, {tori.pair.reach}));
  const DistanceResult by_list = listed_distance(tori.outer, {}, tori.inner, beside, options,
                                                 tori.pair.first_pairs, tori.pair.seed);
  EXPECT_EQ(by_list.lower, by_tree.lower);
  EXPECT_EQ(by_list.upper, by_tree.upper);

  const RigidPose away(rotation_from_vector(Vector3(0, 0, 0.2)), Vector3::Zero());
  list_end(tori.pair, tori.outer, {}, tori.inner, away);
  EXPECT_EQ(tori.pair.searches_to_skip, 62);
  EXPECT_TRUE(tori.covers(away, tori.pair.reach));
}

}  // namespace
}  // namespace dyop::dynamics_internal
