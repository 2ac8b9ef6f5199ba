// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <vector>

#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/sampled_motion.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/deforming_time_of_impact.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/oracles/fast_distance_oracle.h"
#include "support/oracles/toi_promises.h"

namespace dyop {
namespace {

using testing::MeshArrays;

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
  return {testing::icosphere(1), testing::plate_grid(1.6, 1.6, 3, 3),
          testing::random_soup(20, 0.5, 3), testing::needle(2, 3), testing::point_cloud(12, 8)};
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
  const MeshArrays sphere = testing::icosphere(1);
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

}  // namespace
}  // namespace dyop
