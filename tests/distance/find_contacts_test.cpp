// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/distance/find_contacts.h"

#include <gtest/gtest.h>

#include "dyop/core/error.h"
#include "dyop/geometry/sphere.h"
#include "support/inputs/mesh_generators.h"

namespace dyop::testing {
namespace {

const TriangleMesh& ball() {
  static const TriangleMesh mesh = icosphere(3).mesh();
  return mesh;
}
const RigidPose kBeside(Vector3(2.1, 0.05, 0.02));

TEST(FindContacts, LimitsThatAreNotReachedChangeNothing) {
  const std::vector<Contact> all = find_contacts(ball(), RigidPose(), ball(), kBeside, 0.3);
  ContactSearchLimits limits;
  limits.max_triangle_pairs = 1'000'000;
  std::stop_source stop;
  limits.stop = stop.get_token();
  const auto limited = find_contacts(ball(), RigidPose(), ball(), kBeside, 0.3, limits);
  ASSERT_TRUE(limited);
  ASSERT_EQ(limited->size(), all.size());
  ASSERT_FALSE(all.empty());
  for (std::size_t k = 0; k < all.size(); ++k) {
    EXPECT_EQ((*limited)[k].lower, all[k].lower);
    EXPECT_EQ((*limited)[k].p_WCa, all[k].p_WCa);
  }
}

TEST(FindContacts, TheLimitIsTheNumberOfTrianglePairsWithinReach) {
  ContactSearchLimits limits;
  const auto is_answered = [&](std::int64_t pairs) {
    limits.max_triangle_pairs = pairs;
    return find_contacts(ball(), RigidPose(), ball(), kBeside, 0.15, limits).has_value();
  };
  EXPECT_FALSE(is_answered(0));
  std::int64_t enough = 1;
  while (!is_answered(enough)) enough *= 2;
  EXPECT_GT(enough, 1);
  EXPECT_LT(enough, std::int64_t{1} << 20);
  // Nothing is in reach, so none is counted.
  limits.max_triangle_pairs = 0;
  EXPECT_TRUE(find_contacts(ball(), RigidPose(), ball(), kBeside, 0.01, limits)->empty());
  EXPECT_THROW(is_answered(-1), InvalidArgument);
}

TEST(FindContacts, AStopEndsTheSearch) {
  std::stop_source stop;
  stop.request_stop();
  ContactSearchLimits limits;
  limits.stop = stop.get_token();
  EXPECT_FALSE(find_contacts(ball(), RigidPose(), ball(), kBeside, 10, limits));
}

}  // namespace
}  // namespace dyop::testing
