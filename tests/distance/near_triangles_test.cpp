// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/distance/near_triangles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>
#include <utility>

#include "dyop/core/error.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/oracles/triangle_oracle.h"

namespace dyop::testing {
namespace {

using PairSet = std::set<std::pair<std::int32_t, std::int32_t>>;

PairSet set_of(const NearTriangleList& list) {
  PairSet pairs;
  for (const NearTriangles& pair : list.pairs) pairs.emplace(pair.a, pair.b);
  EXPECT_EQ(pairs.size(), list.pairs.size());
  return pairs;
}

// Every pair within the distance is listed, and none that is clearly farther.
TEST(NearTriangles, AreThoseOfAllPairs) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const TriangleMesh a = random_soup(24, 0.6, seed).mesh();
    const TriangleMesh b = random_soup(24, 0.6, seed + 10).mesh();
    for (const Scalar reach : {0.0, 0.1}) {
      const NearTriangleList list = near_triangles(a, RigidPose(), b, RigidPose(), reach);
      EXPECT_TRUE(list.is_complete);
      const PairSet pairs = set_of(list);
      int near = 0;
      for (std::int32_t s = 0; s < 24; ++s) {
        for (std::int32_t t = 0; t < 24; ++t) {
          const OracleDistance exact = oracle_triangle_distance(a.triangle(s), b.triangle(t));
          const bool is_near = reach > 0 ? exact.upper() <= static_cast<long double>(reach)
                                         : oracle_triangles_intersect(a.triangle(s), b.triangle(t));
          near += is_near;
          const bool is_listed = pairs.count({s, t}) > 0;
          EXPECT_TRUE(is_listed || !is_near) << s << ' ' << t;
          EXPECT_TRUE(!is_listed || exact.lower() <= static_cast<long double>(reach) + 1e-12L)
              << s << ' ' << t;
        }
      }
      EXPECT_GT(near, 2);
    }
  }
}

TEST(NearTriangles, OfAMeshWithItselfShareNoVertex) {
  const TriangleMesh soup = random_soup(40, 0.6, 3).mesh();
  const PairSet pairs = set_of(near_own_triangles(soup, 0));
  int crossing = 0;
  for (std::int32_t s = 0; s < 40; ++s) {
    for (std::int32_t t = s + 1; t < 40; ++t) {
      const auto& u = soup.triangles()[std::size_t(s)];
      const auto& v = soup.triangles()[std::size_t(t)];
      bool shares = false;
      for (const std::int32_t x : u) shares |= std::find(v.begin(), v.end(), x) != v.end();
      const bool meets = !shares && oracle_triangles_intersect(soup.triangle(s), soup.triangle(t));
      crossing += meets;
      EXPECT_TRUE(!meets || pairs.count({s, t}) > 0) << s << ' ' << t;
      EXPECT_TRUE(!shares || pairs.count({s, t}) == 0) << s << ' ' << t;
    }
  }
  EXPECT_GT(crossing, 5);
  EXPECT_TRUE(near_own_triangles(icosphere(3).mesh(), 0).pairs.empty());
  EXPECT_TRUE(near_own_triangles(torus(1, 0.4, 24, 12).mesh(), 0).pairs.empty());
}

TEST(NearTriangles, OfMovedMeshesAreTheSame) {
  std::mt19937_64 random(2);
  const TriangleMesh a = torus(1, 0.4, 16, 8).mesh();
  const TriangleMesh b = gear(9, 0.8, 1, 0.2).mesh();
  const RigidPose X_AB = random_pose(0.7, random);
  const PairSet at_home = set_of(near_triangles(a, RigidPose(), b, X_AB, 0.05));
  EXPECT_GT(at_home.size(), 10u);
  const RigidPose X_WA(random_rotation(random), Vector3(1e3, 0, 2e3));
  EXPECT_EQ(set_of(near_triangles(a, X_WA, b, X_WA * X_AB, 0.05)), at_home);
}

TEST(NearTriangles, SayWhenALimitEndedThem) {
  const TriangleMesh a = torus(1, 0.4, 16, 8).mesh();
  const NearTriangleList few =
      near_triangles(a, RigidPose(), a, RigidPose(), 0.1, {.max_pairs = 7});
  EXPECT_EQ(few.pairs.size(), 7u);
  EXPECT_FALSE(few.is_complete);
  std::stop_source source;
  source.request_stop();
  EXPECT_FALSE(near_own_triangles(a, 0.1, {.stop = source.get_token()}).is_complete);
  EXPECT_THROW(near_triangles(a, RigidPose(), a, RigidPose(), -1), InvalidArgument);
  EXPECT_THROW(near_own_triangles(a, std::numeric_limits<Scalar>::quiet_NaN()), InvalidArgument);
  EXPECT_THROW(near_own_triangles(a, kInfinity), InvalidArgument);
}

}  // namespace
}  // namespace dyop::testing
