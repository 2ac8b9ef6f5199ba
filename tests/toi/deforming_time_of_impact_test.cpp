// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/deforming_time_of_impact.h"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <random>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "dyop/core/error.h"
#include "dyop/motion/constant_twist_motion.h"
#include "dyop/motion/hermite_motion.h"
#include "dyop/motion/rest_motion.h"
#include "dyop/motion/sampled_motion.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/message_of.h"
#include "support/oracles/fast_distance_oracle.h"
#include "support/oracles/toi_promises.h"

namespace dyop {
namespace {

using test_support::MeshArrays;

DeformingMesh translating(const MeshArrays& arrays, const Vector3& by) {
  std::vector<Vector3> end = arrays.vertices;
  for (Vector3& p : end) p += by;
  return DeformingMesh(arrays.vertices, end, arrays.triangles);
}

MeshArrays plate_at(Scalar height) {
  return test_support::plate_grid(2, 2, 4, 4).moved(Matrix3::Identity(), {0, 0, height});
}

TEST(DeformingTimeOfImpact, FindsTheTimeOneVertexReachesASheet) {
  // All vertices of A rest at the height 1 but one, which falls with the height 1 - 2 s in its
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
            (Feature{FeatureKind::Vertex, {static_cast<std::int32_t>(middle), -1, -1}}));
  EXPECT_NEAR(result.contact->closing_speed, 0.5, 1e-9);
  EXPECT_NEAR((result.contact->nhat_AB_W - Vector3(0, 0, -1)).norm(), 0, 1e-9);

  // B sinks out of reach by the same amount: no impact.
  const DeformingMesh sinking = translating(plate_at(0), {0, 0, -2});
  EXPECT_EQ(time_of_impact(a, sinking, {10, 14}).status, ToiStatus::Separated);
}

TEST(DeformingTimeOfImpact, AgreesWithTheRigidQueryForTranslations) {
  std::mt19937_64 random(1);
  const MeshArrays sphere = test_support::icosphere(2);
  const MeshArrays gear = test_support::gear(7, 0.8, 1.0, 0.3);
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

// As TimeOfImpact.HitsAfterTheBeginWhateverTheGapThere.
TEST(DeformingTimeOfImpact, HitsAfterTheBeginWhateverTheGapThere) {
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
  const MeshArrays sphere = test_support::icosphere(3);
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

// The distance of two meshes at the fraction s, by the oracle, which takes plain triangles.
class MeshPairOracle {
 public:
  MeshPairOracle(const DeformingMesh& a, const DeformingMesh& b) : a_(a), deforming_b_(&b) {}
  MeshPairOracle(const DeformingMesh& a, const TriangleMesh& b, const Motion& X_WB)
      : a_(a), rigid_b_(&b), X_WB_(&X_WB) {}

  testing::DistanceBracket distance_at(Scalar s) const {
    const TriangleMesh a = place(a_, s);
    testing::PairSeed seed;
    const testing::SearchGap gap{1e-12, 0, 0};
    const testing::OracleBody body_a(a);
    if (rigid_b_ != nullptr) {
      const testing::OracleBody body_b(*rigid_b_);
      return widened(
          testing::fast_oracle_distance(body_a, RigidPose(), body_b, X_WB_->pose(s), gap, seed));
    }
    const TriangleMesh b = place(*deforming_b_, s);
    const testing::OracleBody body_b(b);
    return widened(
        testing::fast_oracle_distance(body_a, RigidPose(), body_b, RigidPose(), gap, seed));
  }

 private:
  // By the oracle's own rounding.
  static testing::DistanceBracket widened(testing::DistanceBracket bracket) {
    bracket.lower -= 2e-12;  // literal: of sizes of a few
    bracket.upper += 2e-12;  // literal: likewise
    return bracket;
  }

  static TriangleMesh place(const DeformingMesh& mesh, Scalar s) {
    std::vector<Vector3> places(mesh.begin().begin(), mesh.begin().end());
    for (std::size_t i = 0; i < places.size(); ++i) {
      places[i] = (1 - s) * places[i] + s * mesh.end()[i];
    }
    return TriangleMesh(places, {mesh.triangles().begin(), mesh.triangles().end()});
  }

  const DeformingMesh& a_;
  const DeformingMesh* deforming_b_ = nullptr;
  const TriangleMesh* rigid_b_ = nullptr;
  const Motion* X_WB_ = nullptr;
};

struct Tally {
  int separated = 0;
  int impacts = 0;
};

// Steps through time by what the oracle's distance and the largest speed allow, at least a
// thousandth.
void check_promises(const ToiResult& result, const MeshPairOracle& oracle, Scalar speed,
                    const ToiOptions& options, Tally& tally) {
  const testing::PromiseTerms terms({0, 1}, options);
  const auto distance_at = [&](Scalar s) { return oracle.distance_at(s); };
  EXPECT_STREQ(testing::broken_form(terms, result), nullptr);
  EXPECT_STREQ(testing::broken_distance(terms, result, 8, distance_at), nullptr);
  if (result.status == ToiStatus::InitiallyWithinTarget) return;
  const Scalar floor =
      options.target_distance + options.distance_tolerance.value() / 4 - result.rounding_allowance;
  ASSERT_TRUE(result.status == ToiStatus::Impact || result.status == ToiStatus::Separated)
      << static_cast<int>(result.status);
  for (Scalar s = 0; s < result.t_safe;) {
    const Scalar distance = oracle.distance_at(s).upper;
    ASSERT_GE(distance, floor) << "at " << s << " before " << result.t_safe;
    s += std::max((distance - floor) / speed, 1e-3);  // literal: step of the oracle
  }
  if (result.status == ToiStatus::Separated) {
    ++tally.separated;
    return;
  }
  ++tally.impacts;
  EXPECT_NEAR((result.contact->p_WCb - result.contact->p_WCa).norm(), result.contact->upper, 1e-9);
}

DeformingMesh random_deforming(const MeshArrays& arrays, const Vector3& from, const Vector3& way,
                               std::mt19937_64& random) {
  const MeshArrays begin = arrays.moved(testing::random_rotation(random).toRotationMatrix(), from);
  // Sheared at random, and shaken.
  Matrix3 shear = Matrix3::Identity();
  for (int row = 0; row < 3; ++row) shear.row(row) += testing::random_vector(0.4, random);
  std::vector<Vector3> end = begin.vertices;
  for (Vector3& p : end) {
    p = from + way + shear * (p - from) + testing::random_vector(0.05, random);
  }
  return DeformingMesh(begin.vertices, end, begin.triangles);
}

std::vector<MeshArrays> small_meshes() {
  return {test_support::icosphere(1), test_support::plate_grid(1.6, 1.6, 3, 3),
          test_support::random_soup(20, 0.5, 3), test_support::needle(2, 3),
          test_support::point_cloud(12, 8)};
}

TEST(DeformingTimeOfImpact, KeepsItsPromisesBetweenRandomDeformingMeshes) {
  std::mt19937_64 random(3);
  const std::vector<MeshArrays> meshes = small_meshes();
  Tally tally;
  for (int i = 0; i < 60; ++i) {
    const auto pick = [&](int n) { return meshes[static_cast<std::size_t>(n) % meshes.size()]; };
    const Vector3 from = 3 * testing::random_direction(random);
    const DeformingMesh a = random_deforming(pick(i), Vector3::Zero(), Vector3::Zero(), random);
    const DeformingMesh b = random_deforming(
        pick(i / 5), from, 1.3 * (testing::random_vector(1, random) - from), random);
    ToiOptions options{.distance_tolerance = 1e-6};
    options.target_distance = i % 3 == 0 ? 0.1 : 0;
    SCOPED_TRACE(i);
    check_promises(time_of_impact(a, b, {0, 1}, options), MeshPairOracle(a, b),
                   a.largest_displacement() + b.largest_displacement(), options, tally);
  }
  EXPECT_GT(tally.impacts, 12);
  EXPECT_GT(tally.separated, 8);
}

TEST(DeformingTimeOfImpact, KeepsItsPromisesAgainstTurningRigidMeshes) {
  std::mt19937_64 random(4);
  const std::vector<MeshArrays> meshes = small_meshes();
  Tally tally;
  for (int i = 0; i < 60; ++i) {
    const auto pick = [&](int n) { return meshes[static_cast<std::size_t>(n) % meshes.size()]; };
    const Vector3 from = 3 * testing::random_direction(random);
    const Vector3 way = 1.3 * (testing::random_vector(1, random) - from);
    const DeformingMesh a = random_deforming(pick(i), Vector3::Zero(), Vector3::Zero(), random);
    const TriangleMesh b = pick(i / 5).mesh();
    const RigidPose begin(testing::random_rotation(random), from);
    const Twist twist{way, testing::random_vector(5, random)};
    const RigidPose end(testing::random_rotation(random), from + way);
    std::unique_ptr<Motion> X_WB = std::make_unique<ConstantTwistMotion>(begin, twist);
    if (i % 3 == 1) {
      X_WB = std::make_unique<HermiteMotion>(TimeInterval{0, 1}, MotionState{begin, twist},
                                             MotionState{end, twist});
    } else if (i % 3 == 2) {
      const RigidPose middle(testing::random_rotation(random), from + 0.4 * way);
      X_WB = std::make_unique<SampledMotion>(
          std::vector<SampledMotion::Sample>{{0, begin}, {0.5, middle}, {1, end}});
    }
    const TwistBound bound = X_WB->twist_bound({0, 1});
    const Scalar speed =
        a.largest_displacement() + bound.linear_speed + bound.angular_speed * b.bounding_radius();
    ToiOptions options{.distance_tolerance = 1e-6};
    options.target_distance = i % 4 == 0 ? 0.1 : 0;
    SCOPED_TRACE(i);
    const ToiResult result = time_of_impact(a, b, *X_WB, {0, 1}, options);
    check_promises(result, MeshPairOracle(a, b, *X_WB), speed, options, tally);
    EXPECT_EQ(result.X_WB.translation(), X_WB->pose(result.t_safe).translation());
  }
  EXPECT_GT(tally.impacts, 12);
  EXPECT_GT(tally.separated, 8);
}

TEST(DeformingTimeOfImpact, ScalesWithLengthAndHoldsFarFromTheOrigin) {
  std::mt19937_64 random(5);
  const MeshArrays sphere = test_support::icosphere(1);
  const Vector3 from(3, 0.3, 0.2);
  const DeformingMesh a = random_deforming(sphere, Vector3::Zero(), Vector3::Zero(), random);
  const DeformingMesh b = random_deforming(sphere, from, {-3, 0, 0}, random);
  const ToiResult unit = time_of_impact(a, b, {0, 1});
  ASSERT_EQ(unit.status, ToiStatus::Impact);
  for (const Scalar scale : {1e-4, 1.0, 1e4}) {
    for (const Vector3& offset : {Vector3(0, 0, 0), Vector3(1e3, 2e3, -1e3)}) {
      const auto placed = [&](const DeformingMesh& mesh) {
        std::vector<Vector3> begin(mesh.begin().begin(), mesh.begin().end());
        std::vector<Vector3> end(mesh.end().begin(), mesh.end().end());
        for (Vector3& p : begin) p = scale * (p + offset);
        for (Vector3& p : end) p = scale * (p + offset);
        return DeformingMesh(begin, end, {mesh.triangles().begin(), mesh.triangles().end()});
      };
      ToiOptions options{.distance_tolerance = 1e-6};
      options.distance_tolerance = 1e-6 * scale;  // literal: a tolerance, in the scale
      const ToiResult result = time_of_impact(placed(a), placed(b), {0, 1}, options);
      ASSERT_EQ(result.status, ToiStatus::Impact);
      EXPECT_NEAR(result.t_safe, unit.t_safe, 1e-6);
    }
  }
}

// Points before the long sides of two triangles, within their boxes: gaps 0.18 and 0.01 or 0.19 at
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
