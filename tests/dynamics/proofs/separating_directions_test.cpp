// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/separating_directions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <set>
#include <vector>

#include "distance/piece_distance.h"
#include "dynamics/step/track.h"
#include "dyop/geometry/primitives.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop::dynamics_internal {
namespace {

using namespace testing;

BodyRecord body_of(const std::shared_ptr<const Shape>& shape, const Vector3& p_BoBcm) {
  BodyRecord body;
  body.definition.shape = shape;
  body.definition.mass_properties.p_BoBcm = p_BoBcm;
  body.radius = p_BoBcm.norm() + shape->bounding_radius();
  return body;
}

std::vector<BoxPair> all_pairs(const Shape& a, const Shape& b) {
  const auto leaves = [](const Shape& shape) {
    const ShapeTree tree(shape);
    std::vector<std::int32_t> found;
    std::vector<std::int32_t> open{ShapeTree::kRoot};
    while (!open.empty()) {
      const std::int32_t box = open.back();
      open.pop_back();
      if (tree.is_leaf(box)) {
        found.push_back(box);
        continue;
      }
      for (int k = 0; k < tree.node(tree.child(box)).count(); ++k) {
        open.push_back(ShapeTree::box_number(tree.child(box), k));
      }
    }
    return found;
  };
  std::vector<BoxPair> pairs;
  for (const std::int32_t leaf_a : leaves(a)) {
    for (const std::int32_t leaf_b : leaves(b)) pairs.push_back({0, leaf_a, leaf_b});
  }
  return pairs;
}

// Two bodies that go on with about the same twists for some steps.
struct Passing {
  BodyRecord record_a, record_b;
  CentralState state_a, state_b;
  Twist twist_a, twist_b;
  SeparatingDirections directions;

  const Shape& a() const { return *record_a.definition.shape; }
  const Shape& b() const { return *record_b.definition.shape; }
  Scalar noise() const { return 1e-13; }
};

Twist changed(const Twist& twist, std::mt19937_64& random) {
  const Twist change = random_twist(0.1, 0.1, random);
  return {twist.v_WB + change.v_WB, twist.w_WB + change.w_WB};
}

// One step; returns how many of the pairs that stay apart were proven to. By the definition: all
// pairs that were left out are measured at many times.
Scalar check_step(Passing& passing, Scalar tau, Scalar least, std::mt19937_64& random) {
  const TimeInterval interval{1, 1 + tau};
  const auto move = [&](const BodyRecord& body, const CentralState& state, const Twist& twist) {
    return twist_move(body, state, interval.begin, twist.v_WB, twist.w_WB);
  };
  const BodyMove a = move(passing.record_a, passing.state_a, passing.twist_a);
  const BodyMove b = move(passing.record_b, passing.state_b, passing.twist_b);
  const std::vector<BoxPair> all = all_pairs(passing.a(), passing.b());
  BoxPairStack left = all;
  passing.directions.keep_unproven(passing.a(), passing.b(), *chord_motion(a, b, interval), least,
                                   passing.noise(), left);
  std::set<std::pair<std::int32_t, std::int32_t>> unproven;
  for (const BoxPair& pair : left) unproven.insert({pair.a, pair.b});
  EXPECT_EQ(unproven.size(), left.size());
  const ShapeTree tree_a(passing.a());
  const ShapeTree tree_b(passing.b());
  int apart = 0;
  for (const BoxPair& pair : all) {
    Scalar nearest = kInfinity;
    for (int k = 0; k <= 16; ++k) {
      const Scalar t = interval.begin + tau * k / 16;
      const RigidPose X_AB = a.motion->pose(t).inverse() * b.motion->pose(t);
      nearest = std::min(nearest, piece_distance(tree_a, pair.a, tree_b, pair.b, X_AB, 0).upper);
    }
    if (unproven.count({pair.a, pair.b}) == 0) {
      EXPECT_GT(nearest, least);
    }
    if (nearest > least) ++apart;
  }
  const auto go_on = [&](const BodyMove& m, CentralState& state, Twist& twist) {
    state.X_WM = central_pose(*m.body, m.motion->pose(interval.end));
    twist = changed(twist, random);
  };
  go_on(a, passing.state_a, passing.twist_a);
  go_on(b, passing.state_b, passing.twist_b);
  return apart == 0 ? Scalar{1} : Scalar(all.size() - left.size()) / apart;
}

std::vector<std::shared_ptr<const Shape>> passing_shapes() {
  return {std::make_shared<TriangleMesh>(icosphere(1).mesh()),
          std::make_shared<TriangleMesh>(torus(0.7, 0.25, 6, 4).mesh()),
          std::make_shared<Sphere>(0.8), std::make_shared<Capsule>(0.3, 0.5),
          std::make_shared<Box>(Vector3(0.5, 0.8, 0.4))};
}

TEST(SeparatingDirections, LeaveOutOnlyWhatStaysApart) {
  std::mt19937_64 random(17);
  const auto shapes = passing_shapes();
  Scalar slow = 0, fast = 0;
  int count = 0;
  for (int k = 0; k < 120; ++k) {
    Passing passing;
    passing.record_a = body_of(shapes[std::size_t(k) % 2], random_vector(0.3, random));
    passing.record_b = body_of(shapes[std::size_t(k / 2) % 5], random_vector(0.3, random));
    if (k % 7 == 0) std::swap(passing.record_a, passing.record_b);
    passing.state_a.X_WM = random_pose(2, random);
    const Vector3 apart = random_number(1, 2.5, random) * random_direction(random);
    passing.state_b.X_WM = RigidPose(random_rotation(random).toRotationMatrix(),
                                     passing.state_a.X_WM.translation() + apart);
    const Scalar turning = k % 3 ? 10 : 1;
    passing.twist_a = random_twist(2, turning, random);
    passing.twist_b =
        k % 4 ? random_twist(2, turning, random) : Twist{Vector3::Zero(), Vector3::Zero()};
    const Scalar least = random_magnitude(-4, -1, random);
    const bool is_fast = k % 2 != 0;
    Scalar part = 0;
    constexpr int kSteps = 3;
    for (int step = 0; step < kSteps; ++step) {
      part += check_step(passing, is_fast ? 0.1 : 1e-3, least, random) / kSteps;
    }
    (is_fast ? fast : slow) += part;
    ++count;
  }
  // Most pairs need nothing else.
  EXPECT_GT(slow, 0.98 * count / 2);
  EXPECT_GT(fast, 0.5 * count / 2);
}

// A ball that rolls on a plate: the nearest pair is known in every step, with the plate's normal.
TEST(SeparatingDirections, ProveABallThatRolls) {
  Passing passing;
  passing.record_a =
      body_of(std::make_shared<TriangleMesh>(plate_grid(4, 1, 3, 1).mesh()), Vector3::Zero());
  passing.record_b = body_of(std::make_shared<Sphere>(0.1), Vector3::Zero());
  constexpr Scalar kGap = 1e-4, kTau = 1e-3;
  passing.state_b.X_WM = RigidPose(Vector3(-1, 0.1, 0.1 + kGap));
  for (int step = 0; step < 20; ++step) {
    const BodyMove plate =
        twist_move(passing.record_a, passing.state_a, 0, Vector3::Zero(), Vector3::Zero());
    const BodyMove ball = twist_move(passing.record_b, passing.state_b, 0, {1, 0, 0}, {0, 10, 0});
    const TimeInterval interval{0, kTau};
    for (const Scalar part : {0.8, 1.01}) {
      BoxPairStack left = all_pairs(passing.a(), passing.b());
      passing.directions.keep_unproven(passing.a(), passing.b(),
                                       *chord_motion(plate, ball, interval), part * kGap, 0, left);
      EXPECT_EQ(left.empty(), part < 1);
    }
    passing.state_b.X_WM = central_pose(passing.record_b, ball.motion->pose(kTau));
  }
}

}  // namespace
}  // namespace dyop::dynamics_internal
