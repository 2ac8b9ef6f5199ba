// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/deforming_time_of_impact.h"

#include <gtest/gtest.h>

#include <chrono>
#include <random>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "dyop/core/error.h"
#include "dyop/motion/sampled_motion.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using testing::MeshArrays;

DeformingMesh translating(const MeshArrays& arrays, const Vector3& by) {
  std::vector<Vector3> end = arrays.vertices;
  for (Vector3& p : end) p += by;
  return DeformingMesh(arrays.vertices, end, arrays.triangles);
}

MeshArrays plate_at(Scalar height) {
  return testing::plate_grid(2, 2, 4, 4).moved(Matrix3::Identity(), {0, 0, height});
}

TEST(DeformingTimeOfImpact, FindsTheTimeOneVertexReachesASheet) {
  // All vertices of A rest at height 1 except one, which falls, with the height 1 - 2 s in its
  // middle.
  MeshArrays arrays = plate_at(1);
  std::vector<Vector3> end = arrays.vertices;
  std::size_t middle = 0;
  for (std::size_t i = 0; i < end.size(); ++i) {
    if (end[i].head<2>().norm() < end[middle].head<2>().norm()) middle = i;
  }
  end[middle].z() = -1;
  const DeformingMesh a(arrays.vertices, end, arrays.triangles);
  const DeformingMesh b = translating(plate_at(0), Vector3::Zero());
  const ToiResult result = time_of_impact(a, b, {10, 14});
  ASSERT_EQ(result.status, ToiStatus::Impact);
  EXPECT_NEAR(result.t_safe, 12, 1e-5);
  EXPECT_LT(result.t_safe, 12);
  ASSERT_TRUE(result.t_hit.has_value());
  EXPECT_GT(*result.t_hit, result.t_safe);
  EXPECT_NEAR(*result.t_hit, 12, 1e-4);
  EXPECT_EQ(result.contact->feature_a,
            (Feature{FeatureKind::Vertex, {static_cast<std::int32_t>(middle)}}));
  EXPECT_NEAR(result.contact->closing_speed, 0.5, 1e-9);
  EXPECT_NEAR((result.contact->nhat_AB_W - Vector3(0, 0, -1)).norm(), 0, 1e-9);

  // B sinks out of reach by the same amount: no impact.
  const DeformingMesh sinking = translating(plate_at(0), {0, 0, -2});
  EXPECT_EQ(time_of_impact(a, sinking, {10, 14}).status, ToiStatus::Separated);
}

TEST(DeformingTimeOfImpact, AgreesWithTheRigidQueryForTranslations) {
  std::mt19937_64 random(1);
  const MeshArrays sphere = testing::icosphere(2);
  const MeshArrays gear = testing::gear(7, 0.8, 1.0, 0.3);
  const TriangleMesh rigid_sphere = sphere.mesh();
  const TriangleMesh rigid_gear = gear.mesh();
  int impacts = 0;
  for (int i = 0; i < 40; ++i) {
    const Vector3 from = 3 * testing::random_direction(random);
    const Vector3 way = 1.4 * (testing::random_vector(2.2, random) - from);
    const Matrix3 R = testing::random_rotation(random).toRotationMatrix();
    const DeformingMesh a = translating(sphere, Vector3(0.5, 0, 0));
    const DeformingMesh b = translating(gear.moved(R, from), way);
    const ConstantTwistMotion X_WA(RigidPose(), {{0.5, 0, 0}, Vector3::Zero()});
    const ConstantTwistMotion X_WB(RigidPose(R, from), {way, Vector3::Zero()});
    const ToiResult rigid = time_of_impact(rigid_sphere, X_WA, rigid_gear, X_WB, {0, 1});
    const ToiResult both = time_of_impact(a, b, {0, 1});
    const ToiResult mixed = time_of_impact(a, rigid_gear, X_WB, {0, 1});
    const ToiResult swapped = time_of_impact(b, a, {0, 1});
    EXPECT_EQ(both.status, rigid.status);
    EXPECT_EQ(mixed.status, rigid.status);
    EXPECT_EQ(swapped.status, rigid.status);
    EXPECT_NEAR(both.t_safe, rigid.t_safe, 1e-5);
    EXPECT_NEAR(mixed.t_safe, rigid.t_safe, 1e-5);
    EXPECT_NEAR(swapped.t_safe, rigid.t_safe, 1e-5);
    impacts += rigid.status == ToiStatus::Impact ? 1 : 0;
  }
  EXPECT_GT(impacts, 10);
  EXPECT_LT(impacts, 35);
}

// As TimeOfImpact.HitsAfterTheStartWhateverTheGapThere.
TEST(DeformingTimeOfImpact, HitsAfterTheStartWhateverTheGapThere) {
  const DeformingMesh floor = translating(plate_at(0), Vector3::Zero());
  ToiOptions options{.distance_tolerance = 1e-6};
  options.distance_tolerance = 1;
  for (const Scalar gap : {0.26, 0.4, 0.49}) {
    const ToiResult result =
        time_of_impact(translating(plate_at(gap), {0, 0, -1}), floor, {0, 1}, options);
    ASSERT_EQ(result.status, ToiStatus::Impact) << gap;
    EXPECT_EQ(result.t_safe, 0) << gap;
    ASSERT_TRUE(result.t_hit.has_value()) << gap;
    EXPECT_GT(*result.t_hit, std::max(0.0, gap - 0.5)) << gap;
    EXPECT_LT(*result.t_hit, 0.5) << gap;
  }
}

TEST(DeformingTimeOfImpact, SaysWhatBeginsWithinTheTargetAndLetsItLeave) {
  const DeformingMesh floor = translating(plate_at(0), Vector3::Zero());
  EXPECT_EQ(time_of_impact(translating(plate_at(0), {0, 0, 1}), floor, {0, 1}).status,
            ToiStatus::InitiallyWithinTarget);
  EXPECT_EQ(time_of_impact(translating(plate_at(5e-7), {0, 0, 1}), floor, {0, 1}).status,
            ToiStatus::Separated);
  ToiOptions options{.distance_tolerance = 1e-6};
  options.target_distance = 0.5;
  const ToiResult result =
      time_of_impact(translating(plate_at(1), {0, 0, -1}), floor, {0, 1}, options);
  ASSERT_EQ(result.status, ToiStatus::Impact);
  EXPECT_NEAR(result.t_safe, 0.5, 1e-5);
}

TEST(DeformingTimeOfImpact, TreatsAnIntervalOfNoLengthAsRest) {
  const DeformingMesh floor = translating(plate_at(0), Vector3::Zero());
  const DeformingMesh falling = translating(plate_at(1), {0, 0, -2});
  const ToiResult result = time_of_impact(falling, floor, {3, 3});
  EXPECT_EQ(result.status, ToiStatus::Separated);
  EXPECT_EQ(result.t_safe, 3);
}

TEST(DeformingTimeOfImpact, GivesASafeTimeWhenItIsStopped) {
  std::mt19937_64 random(2);
  const MeshArrays sphere = testing::icosphere(3);
  const DeformingMesh a = translating(sphere, {0.1, 0, 0});
  const DeformingMesh b = translating(sphere.moved(Matrix3::Identity(), {3, 0.2, 0.1}), {-2, 0, 0});
  const ToiResult whole = time_of_impact(a, b, {0, 1});
  ASSERT_EQ(whole.status, ToiStatus::Impact);
  ToiOptions options{.distance_tolerance = 1e-6};
  options.max_node_pairs = 5;
  const ToiResult spent = time_of_impact(a, b, {0, 1}, options);
  EXPECT_EQ(spent.status, ToiStatus::BudgetExhausted);
  EXPECT_GT(spent.t_safe, 0);
  EXPECT_LE(spent.t_safe, whole.t_safe);
  options = {};
  options.deadline = std::chrono::steady_clock::now();
  EXPECT_EQ(time_of_impact(a, b, {0, 1}, options).status, ToiStatus::BudgetExhausted);
  options = {};
  std::stop_source stop;
  stop.request_stop();
  options.stop = stop.get_token();
  EXPECT_EQ(time_of_impact(a, b, {0, 1}, options).status, ToiStatus::Cancelled);
}

TEST(DeformingTimeOfImpact, SaysThatRoundingForbidsATolerance) {
  ToiOptions options{.distance_tolerance = 1e-6};
  options.distance_tolerance = 1e-30;
  const DeformingMesh floor = translating(plate_at(0), Vector3::Zero());
  const ToiResult result =
      time_of_impact(translating(plate_at(1), {0, 0, -2}), floor, {0, 1}, options);
  EXPECT_TRUE(result.status == ToiStatus::NumericalLimit || result.status == ToiStatus::Impact);
  EXPECT_NEAR(result.t_safe, 0.5, 1e-9);
  EXPECT_GT(result.rounding_allowance, 1e-16);
}

TEST(DeformingTimeOfImpact, RefusesInvalidInput) {
  const DeformingMesh mesh = translating(plate_at(0), Vector3::Zero());
  ToiOptions options{.distance_tolerance = 1e-6};
  options.distance_tolerance = -1;
  EXPECT_THROW(time_of_impact(mesh, mesh, {0, 1}, options), InvalidArgument);
  EXPECT_THROW(time_of_impact(mesh, mesh, {1, 0}), InvalidArgument);
  options = {};
  options.max_node_pairs = 0;
  EXPECT_THROW(time_of_impact(mesh, mesh, {0, 1}, options), InvalidArgument);
  options = {};
  options.target_distance = -1;
  EXPECT_THROW(time_of_impact(mesh, mesh, {0, 1}, options), InvalidArgument);
  const SampledMotion brief({{0, RigidPose()}, {0.5, RigidPose()}});
  EXPECT_THROW(time_of_impact(mesh, plate_at(1).mesh(), brief, {0, 1}), InvalidArgument);
}

// Points beside the long sides of two triangles, within their boxes: gaps 0.18 and 0.01 or 0.19 at
// the start, closing at speed 1, with a tolerance of 0.3: all of them are in contact.
TEST(DeformingTimeOfImpact, ExaminesAllPairsAtTheStart) {
  ToiOptions options{.distance_tolerance = 1e-6};
  options.distance_tolerance = 0.3;
  const MeshArrays triangles{
      {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {100, 0, 0}, {104, 0, 0}, {100, 4, 0}},
      {{0, 1, 2}, {3, 4, 5}}};
  const DeformingMesh a = translating(triangles, {0, 0, 0});
  const Vector3 outward = Vector3(1, 1, 0).normalized();
  const auto before = [&](Scalar first, Scalar second) {
    const MeshArrays points{
        {Vector3(2, 2, 0) + first * outward, Vector3(102, 2, 0) + second * outward},
        {{0, 0, 0}, {1, 1, 1}}};
    return translating(points, -outward);
  };
  for (const auto& [first, second] : {std::pair(0.18, 0.01), std::pair(0.01, 0.18)}) {
    const ToiResult within = time_of_impact(a, before(first, second), {0, 1}, options);
    EXPECT_EQ(within.status, ToiStatus::InitiallyWithinTarget);
    EXPECT_NEAR(within.contact->upper, 0.01, 1e-9);
  }
  for (const auto& [first, second] : {std::pair(0.18, 0.19), std::pair(0.18, 0.4)}) {
    const ToiResult impact = time_of_impact(a, before(first, second), {0, 1}, options);
    EXPECT_EQ(impact.status, ToiStatus::Impact);
    EXPECT_EQ(impact.t_safe, 0);
    EXPECT_GE(impact.contact->lower, 0.17);
  }
}

TEST(DeformingTimeOfImpact, RefusesAMeshThatWasMovedFrom) {
  DeformingMesh from = translating(plate_at(1), Vector3::UnitZ());
  const DeformingMesh to = std::move(from);
  const std::string refusal = " was moved from and holds no triangles";
  EXPECT_EQ(testing::message_of([&] {
              time_of_impact(from, to, {0, 1});
            }),
            "time_of_impact: the deforming mesh A" + refusal);
  EXPECT_EQ(testing::message_of([&] {
              time_of_impact(to, from, {0, 1});
            }),
            "time_of_impact: the deforming mesh B" + refusal);
  const TriangleMesh rigid = plate_at(0).mesh();
  const RestMotion at_rest{RigidPose()};
  EXPECT_EQ(testing::message_of([&] {
              time_of_impact(from, rigid, at_rest, {0, 1});
            }),
            "time_of_impact: the deforming mesh A" + refusal);
  from = to;
  EXPECT_EQ(time_of_impact(from, rigid, at_rest, {0, 1}).status, ToiStatus::Separated);
}

}  // namespace
}  // namespace dyop
