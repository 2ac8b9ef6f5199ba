// SPDX-License-Identifier: BSD-3-Clause
// Queries of bodies that follow logs of many poses.
#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <vector>

#include "dyop/geometry/primitives.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/motion/sampled_motion.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/pose_logs.h"
#include "support/inputs/random_inputs.h"
#include "support/oracles/toi_promises.h"

namespace dyop::testing {
namespace {

// Keeps everything but the stretches to itself, as a motion of a user does.
class StampByStamp final : public Motion {
 public:
  explicit StampByStamp(const Motion& motion) : motion_(motion) {}
  RigidPose pose(Scalar t) const override { return motion_.pose(t); }
  Twist twist(Scalar t) const override { return motion_.twist(t); }
  TwistBound twist_bound(const TimeInterval& interval) const override {
    return motion_.twist_bound(interval);
  }
  PoseScale pose_scale(const TimeInterval& interval) const override {
    return motion_.pose_scale(interval);
  }
  TimeInterval domain() const override { return motion_.domain(); }
  Scalar smooth_until(Scalar t) const override { return motion_.smooth_until(t); }

 private:
  const Motion& motion_;
};

// Both must say the same of a gap that is not within the tolerance of the target.
void expect_agreement(const ToiResult& x, const ToiResult& y, Scalar speed, Scalar tolerance) {
  ASSERT_EQ(x.status, y.status);
  if (x.status != ToiStatus::Impact) return;
  // Each is the first contact to within the tolerance: neither is after a time of proven contact.
  EXPECT_LE(x.t_safe, y.t_hit.value_or(kInfinity));
  EXPECT_LE(y.t_safe, x.t_hit.value_or(kInfinity));
  if (x.contact->closing_speed > 0.1 * speed && y.contact->closing_speed > 0.1 * speed) {
    EXPECT_NEAR(x.t_safe, y.t_safe, 40 * tolerance / speed);
  }
}

TEST(PoseLogImpact, KeepsItsPromisesAndAgreesWithTheSearchStampByStamp) {
  std::mt19937_64 random(28);
  const TriangleMesh ball = icosphere(2, 0.5).mesh();
  const TriangleMesh ring = torus(0.5, 0.15, 16, 8).mesh();
  const TriangleMesh brick = box_mesh(Vector3(0.5, 0.3, 0.2)).mesh();
  const TriangleMesh* const shapes[] = {&ball, &ring, &brick};
  int impacts = 0;
  int misses = 0;
  for (int i = 0; i < 30; ++i) {
    SCOPED_TRACE(::testing::Message() << "query " << i);
    const std::size_t count = i % 2 == 0 ? 60 : 250;
    PoseLog log = smooth_log(count, random_number(0.9, 1.8, random), random_number(0, 9, random), 0,
                             1, random_vector(0.4, random));
    if (i % 3 == 0) log = noisy(std::move(log), 1e-4, 1e-4, random);
    if (i % 3 == 1) {
      log = erratic_log(count, 3 / std::sqrt(Scalar(count)), 0.1, 0, 1, Vector3(2, 0, 1), random);
    }
    const PoseLog other = noisy(smooth_log(count, 0.2, 2), 1e-3, 1e-3, random);
    const SampledMotion steady(log);
    const SequenceMotion smooth = smooth_sampled_motion(log);
    const SampledMotion moving(other);
    const ComposedMotion held(
        std::make_shared<SampledMotion>(log),
        std::make_shared<RestMotion>(RigidPose(Matrix3::Identity(), random_vector(0.3, random))));
    const RestMotion rest;
    const Motion* const carried[] = {&steady, &smooth, &held};
    ToiQuery query;
    query.a = shapes[i % 3];
    query.X_WA = carried[i % 4 % 3];
    query.b = shapes[(i / 3) % 3];
    query.X_WB = i % 5 == 0 ? static_cast<const Motion*>(&moving) : &rest;
    query.interval = {0, std::min(1.0, query.X_WA->domain().end)};
    query.options.distance_tolerance = 1e-5;
    query.options.max_node_pairs = 10'000'000;
    const ToiResult result =
        time_of_impact(*query.a, *query.X_WA, *query.b, *query.X_WB, query.interval, query.options);
    const char* const broken_member = broken_form(query, result);
    ASSERT_EQ(broken_member, nullptr) << broken_member;
    const char* const broken = ToiJudge(query).broken_distance(result, 400);
    ASSERT_EQ(broken, nullptr) << broken;
    const StampByStamp slow_a(*query.X_WA);
    const StampByStamp slow_b(*query.X_WB);
    const ToiResult slow =
        time_of_impact(*query.a, slow_a, *query.b, slow_b, query.interval, query.options);
    expect_agreement(result, slow, 5, 1e-5);
    EXPECT_LE(result.statistics.node_pairs, slow.statistics.node_pairs * 11 / 10 + 100);
    impacts += result.status == ToiStatus::Impact;
    misses += result.status == ToiStatus::Separated;
  }
  EXPECT_GT(impacts, 5);
  EXPECT_GT(misses, 5);
}

TEST(PoseLogImpact, AgreesForConvexShapes) {
  std::mt19937_64 random(29);
  const Box box(Vector3(0.4, 0.3, 0.2));
  const Sphere ball(0.4);
  const Capsule capsule(0.2, 0.4);
  const ConvexShape* const shapes[] = {&box, &ball, &capsule};
  int impacts = 0;
  for (int i = 0; i < 90; ++i) {
    SCOPED_TRACE(::testing::Message() << "query " << i);
    const PoseLog log =
        noisy(smooth_log(300, random_number(0.6, 1.8, random), random_number(0, 9, random), 0, 1,
                         random_vector(0.6, random)),
              i % 2 * 1e-4, i % 2 * 1e-4, random);
    const SampledMotion motion(log);
    const StampByStamp slow_motion(motion);
    const RestMotion rest;
    const ToiOptions options{.distance_tolerance = 1e-5};
    const Shape& a = *shapes[i % 3];
    const Shape& b = *shapes[(i / 3) % 3];
    const ToiResult result = time_of_impact(a, motion, b, rest, {0, 1}, options);
    const ToiResult slow = time_of_impact(a, slow_motion, b, rest, {0, 1}, options);
    expect_agreement(result, slow, 5, 1e-5);
    impacts += result.status == ToiStatus::Impact;
  }
  EXPECT_GT(impacts, 20);
}

std::int64_t work(const Motion& motion, const Shape& shape, const Shape& obstacle) {
  const ToiResult result = time_of_impact(shape, motion, obstacle, RestMotion(), {0, 1});
  EXPECT_EQ(result.status, ToiStatus::Separated);
  return result.statistics.node_pairs + result.statistics.box_tests + result.statistics.leaf_tests;
}

// What passes at a distance is proven apart across most of the stamps at once.
TEST(PoseLogImpact, WorkDoesNotGrowWithTheNumberOfPoses) {
  std::mt19937_64 random(31);
  const TriangleMesh mesh = icosphere(4, 0.5).mesh();
  for (const Scalar radius : {1.05, 1.5, 10.0}) {
    for (const Scalar noise : {0.0, 1e-4}) {
      SCOPED_TRACE(::testing::Message() << "radius " << radius << ", noise " << noise);
      const auto work_of = [&](std::size_t count) {
        const PoseLog log = noisy(smooth_log(count, radius, 1), noise, noise, random);
        const std::int64_t steady = work(SampledMotion(log), mesh, mesh);
        const std::int64_t smooth = work(smooth_sampled_motion(log), mesh, mesh);
        return std::max(steady, smooth);
      };
      const std::int64_t few = work_of(300);
      const std::int64_t many = work_of(30'000);
      EXPECT_LE(many, few * 3 / 2 + 20);
    }
  }
}

}  // namespace
}  // namespace dyop::testing
