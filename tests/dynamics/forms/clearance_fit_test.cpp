// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/clearance_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "support/inputs/random_inputs.h"

namespace dyop::dynamics_internal {
namespace {

using namespace dyop::testing;

Vector3 random_point(std::mt19937_64& random, Scalar size) {
  return size * Vector3(random_number(-1, 1, random), random_number(-1, 1, random),
                        random_number(-1, 1, random));
}

// At any size, and far from the origin.
struct Place {
  explicit Place(std::mt19937_64& random)
      : size(std::pow(10, random_number(-4, 4, random))), center(random_point(random, 10 * size)) {}
  GapDemand demand(std::mt19937_64& random) const {
    return {random_point(random, 1).normalized(), center + random_point(random, size), 0};
  }
  Scalar size;
  Vector3 center;
};

TEST(ClearanceFit, FindsAMotionWhereOneIsKnown) {
  std::mt19937_64 random(5);
  for (int k = 0; k < 20000; ++k) {
    const Place place(random);
    const Vector3 v = random_point(random, 1);
    const Vector3 w = random_point(random, 1) / place.size;
    std::vector<GapDemand> demands;
    const int count = 1 + int(random() % 40);
    for (int i = 0; i < count; ++i) {
      GapDemand& demand = demands.emplace_back(place.demand(random));
      demand.missing =
          demand.nhat_W.dot(v + w.cross(demand.p_W - place.center)) - random_number(0.1, 1, random);
    }
    EXPECT_TRUE(can_meet(demands)) << k;
  }
}

// Pushes that balance, whose demands add up to more than nothing, among others.
TEST(ClearanceFit, FindsNoneWhereBalancedPushesAskForWork) {
  std::mt19937_64 random(6);
  for (int k = 0; k < 20000; ++k) {
    const Place place(random);
    std::vector<GapDemand> demands;
    const int pairs = 1 + int(random() % 4);
    for (int i = 0; i < pairs; ++i) {
      GapDemand one = place.demand(random);
      GapDemand other = one;
      other.nhat_W = -one.nhat_W;
      other.p_W += random_number(0, 1, random) * place.size * one.nhat_W;
      one.missing = random_number(-1, 1, random);
      other.missing = i == 0 ? -one.missing + random_number(0.01, 1, random) : -2 - one.missing;
      demands.push_back(one);
      demands.push_back(other);
    }
    for (int i = int(random() % 20); i > 0; --i) {
      demands.push_back(place.demand(random));
      demands.back().missing = random_number(-3, 0.5, random);
    }
    std::shuffle(demands.begin(), demands.end(), random);
    EXPECT_FALSE(can_meet(demands)) << k;
  }
}

TEST(ClearanceFit, ALoosePinHasRoomAndATightOneHasNone) {
  for (const bool is_tight : {false, true}) {
    std::vector<GapDemand> demands;
    for (int k = 0; k < 48; ++k) {
      const Scalar angle = 2 * std::numbers::pi * k / 48;
      const Vector3 n(std::cos(angle), std::sin(angle), 0);
      for (const Scalar z : {-1., 1.}) {
        demands.push_back({n, Vector3(-n + z * Vector3::UnitZ()), is_tight ? 1e-5 : -1e-5});
      }
      demands.back().missing += 1e-3 * n.x();  // pressed to one side
    }
    EXPECT_EQ(can_meet(demands), !is_tight);
  }
}

TEST(ClearanceFit, NothingIsAskedOfABodyWithoutContacts) {
  EXPECT_TRUE(can_meet({}));
}

// Random demands that a random motion meets, if joints allow that motion; a demand that only
// motions along a held direction could meet is never met.
TEST(ClearanceFit, JointsLeaveTheMotionsThatTheyAllow) {
  std::mt19937_64 random(7);
  for (int k = 0; k < 2000; ++k) {
    const auto vector = [&] {
      return Vector3(random_number(-1, 1, random), random_number(-1, 1, random),
                     random_number(-1, 1, random));
    };
    const Vector3 v = 1e-5 * vector();
    const Vector3 w = 1e-5 * vector();
    std::vector<GapDemand> demands;
    for (int i = 0; i < 8; ++i) {
      const Vector3 n = vector().normalized();
      const Vector3 p = vector();
      demands.push_back({n, p, n.dot(v + w.cross(p))});
    }
    std::vector<MotionHold> holds;
    for (int i = 0; i < 2; ++i) {
      const Vector3 j_v = vector();
      // j_v . v + j_w . w = 0
      const Vector3 j_w = -w * (j_v.dot(v) / w.squaredNorm()) + w.cross(vector()) / w.norm();
      holds.push_back({j_v, j_w});
    }
    EXPECT_TRUE(can_meet(demands, holds)) << k;
    const Vector3 axis = vector().normalized();
    const std::vector<GapDemand> along{{axis, Vector3::Zero(), 1e-5}};
    const std::vector<MotionHold> held{{axis, Vector3::Zero()}};
    EXPECT_TRUE(can_meet(along)) << k;
    EXPECT_FALSE(can_meet(along, held)) << k;
  }
}

}  // namespace
}  // namespace dyop::dynamics_internal
