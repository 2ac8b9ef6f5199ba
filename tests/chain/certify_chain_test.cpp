// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/chain/certify_chain.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "dyop/core/error.h"
#include "support/inputs/arms.h"
#include "support/message_of.h"
#include "support/oracles/chain_oracle.h"

namespace dyop::testing {
namespace {

JointVector vector_of(std::initializer_list<Scalar> values) {
  JointVector q(Eigen::Index(values.size()));
  std::copy(values.begin(), values.end(), q.begin());
  return q;
}

JointPath line(const JointVector& from, const JointVector& to) {
  return JointPath::linear(std::vector<Scalar>{0, 1}, std::vector{from, to});
}

// A bar of half length 1 that turns about its end, in the xy-plane.
KinematicChain bar() {
  const auto rod = std::make_shared<CompoundShape>(std::vector<CompoundChild>{
      {std::make_shared<Box>(Vector3(0.5, 0.01, 0.01)), RigidPose(Vector3(0.5, 0, 0))}});
  return KinematicChain({{"root"}, {"bar", rod}}, {{"j", JointType::Revolute, "root", "bar"}});
}

TEST(CertifyChain, FindsWhenABarMeetsABall) {
  // The bar's side y = 0.01 in its own frame meets a ball of radius r at (0, 0.8) when the distance
  // of the center from the bar's middle plane, 0.8 cos q, is r + 0.01.
  ObstacleSet obstacles;
  obstacles.add(std::make_shared<Sphere>(0.1), RigidPose(Vector3(0, 0.8, 0)));
  const ChainResult result = certify(bar(), line(vector_of({0}), vector_of({3})), obstacles);
  EXPECT_EQ(result.toi.status, ToiStatus::Impact);
  EXPECT_NEAR(3 * result.toi.t_safe, std::acos(0.11 / 0.8), 1e-5);
  EXPECT_EQ(result.link_a, 1u);
  EXPECT_TRUE(result.obstacle);
  EXPECT_FALSE(result.link_b);
  EXPECT_EQ(result.free_fraction, result.toi.t_safe);
}

TEST(CertifyChain, ProvesAFreePath) {
  ObstacleSet obstacles;
  obstacles.add(std::make_shared<Sphere>(0.1), RigidPose(Vector3(0, 1.2, 0)));
  const ChainResult result = certify(bar(), line(vector_of({0}), vector_of({3})), obstacles);
  EXPECT_EQ(result.toi.status, ToiStatus::Separated);
  EXPECT_EQ(result.free_fraction, 1);
  EXPECT_FALSE(result.link_a);
  EXPECT_FALSE(result.obstacle);
}

TEST(CertifyChain, FindsSelfCollisionInTheWorldFrame) {
  // Three bars of length 1, the last of which folds back on the first.
  const auto rod = std::make_shared<CompoundShape>(std::vector<CompoundChild>{
      {std::make_shared<Capsule>(0.05, 0.4),
       RigidPose(rotation_from_vector(Vector3(0, 1.5707963267948966, 0)), Vector3(0.5, 0, 0))}});
  KinematicChain::Options options;
  options.X_WR = RigidPose(Vector3(5, 6, 7));
  const std::vector<Link> links{{"root"}, {"a", rod}, {"b", rod}, {"c", rod}};
  const std::vector<Joint> joints{
      {"1", JointType::Revolute, "root", "a"},
      {"2", JointType::Revolute, "a", "b", RigidPose(Vector3(1, 0, 0))},
      {"3", JointType::Revolute, "b", "c", RigidPose(Vector3(1, 0, 0))}};
  const KinematicChain chain(links, joints, options);
  const JointPath path = line(vector_of({1, 0, 0}), vector_of({1, 2.2, 2.2}));
  const ChainResult result = certify(chain, path, ObstacleSet());
  ASSERT_EQ(result.toi.status, ToiStatus::Impact);
  EXPECT_EQ(result.link_a, 1u);
  EXPECT_EQ(result.link_b, 3u);
  EXPECT_FALSE(result.obstacle);
  ASSERT_TRUE(result.toi.contact);
  const std::vector<Eigen::Matrix4d> poses =
      oracle_link_poses(chain, path.position(result.toi.t_safe));
  EXPECT_LT((homogeneous(result.toi.X_WA) - poses[1]).norm(), 1e-13);
  EXPECT_LT((homogeneous(result.toi.X_WB) - poses[3]).norm(), 1e-13);
  // The witness point on the first bar is on its surface, 0.05 from its axis.
  const Vector3 p_A = result.toi.X_WA.inverse() * result.toi.contact->p_WCa;
  const Vector3 on_axis(std::clamp(p_A.x(), 0.1, 0.9), 0, 0);
  EXPECT_NEAR((p_A - on_axis).norm(), 0.05, 1e-6);
  EXPECT_NEAR(result.toi.contact->nhat_AB_W.norm(), 1, 1e-12);

  ChainOptions unchecked;
  unchecked.with_self_collision = false;
  EXPECT_EQ(certify(chain, path, ObstacleSet(), unchecked).toi.status, ToiStatus::Separated);
}

TEST(CertifyChain, ObeysGroupsAndFilters) {
  ObstacleSet obstacles;
  const ObstacleId ball =
      obstacles.add(std::make_shared<Sphere>(0.1), RigidPose(Vector3(0, 0.8, 0)), /*groups=*/4);
  const JointPath path = line(vector_of({0}), vector_of({3}));
  ChainOptions options;
  EXPECT_EQ(certify(bar(), path, obstacles, options).obstacle, ball);
  options.obstacles.groups = 3;
  EXPECT_EQ(certify(bar(), path, obstacles, options).toi.status, ToiStatus::Separated);
  options.obstacles.groups = ~0u;
  options.obstacles.accepts = [](ObstacleId) { return false; };
  EXPECT_EQ(certify(bar(), path, obstacles, options).toi.status, ToiStatus::Separated);
  const KinematicChain seeing = bar();
  std::vector<Link> links(seeing.links().begin(), seeing.links().end());
  links[1].groups = 3;
  const KinematicChain blind(links, {seeing.joints().begin(), seeing.joints().end()});
  EXPECT_EQ(certify(blind, path, obstacles).toi.status, ToiStatus::Separated);
}

TEST(CertifyChain, ASpentBudgetIsNotAMiss) {
  std::mt19937_64 random(3);
  const KinematicChain arm = six_axis_arm();
  const ObstacleSet obstacles = arm_surroundings(100, random);
  ChainOptions few;
  few.toi.max_node_pairs = 1;
  int spent = 0;
  for (int k = 0; k < 20; ++k) {
    const JointPath path = line(JointVector::Zero(6), random_coordinates(arm, random));
    const ChainResult result = certify(arm, path, obstacles, few);
    if (result.toi.status == ToiStatus::Separated) {
      EXPECT_EQ(certify(arm, path, obstacles).toi.status, ToiStatus::Separated);
    }
    if (result.toi.status != ToiStatus::BudgetExhausted) continue;
    ++spent;
    EXPECT_LT(result.free_fraction, 1);
    EXPECT_TRUE(result.link_a);
  }
  EXPECT_GE(spent, 5);
}

// The last link is examined first, and comes within the tolerance at the start, closing.
TEST(CertifyChain, AnImpactAtTheStartDoesNotHideAnOverlap) {
  const auto ball = std::make_shared<Sphere>(0.5);
  const KinematicChain two(
      {{"root"}, {"inner", ball}, {"outer", ball}},
      {{"slide", JointType::Prismatic, "root", "inner", RigidPose(), Vector3::UnitX()},
       {"hold", JointType::Fixed, "inner", "outer", RigidPose(Vector3(0, 5, 0))}});
  ObstacleSet obstacles;
  obstacles.add(ball, RigidPose(Vector3(0.9, 0, 0)));       // overlaps the inner ball
  obstacles.add(ball, RigidPose(Vector3(1 + 5e-5, 5, 0)));  // literal: half of the tolerance
  ChainOptions options;
  options.toi.distance_tolerance = 1e-4;  // literal: twice the gap
  const ChainResult result =
      certify(two, line(JointVector::Zero(1), JointVector::Ones(1)), obstacles, options);
  EXPECT_EQ(result.toi.status, ToiStatus::InitiallyWithinTarget);
  EXPECT_EQ(result.link_a, std::size_t{1});
  EXPECT_EQ(result.free_fraction, 0);
}

TEST(CertifyChain, ABatchGivesTheBitsOfSingleCalls) {
  ObstacleSet obstacles;
  obstacles.add(std::make_shared<Sphere>(0.1), RigidPose(Vector3(0, 0.8, 0)));
  std::vector<JointPath> paths;
  for (int k = 0; k < 30; ++k) {
    paths.push_back(line(vector_of({0.1 * k}), vector_of({0.1 * k + 0.4})));
  }
  std::vector<ChainResult> results(paths.size());
  int hits = 0;
  for (const int threads : {1, 3}) {
    BatchOptions batch;
    batch.thread_count = threads;
    certify_batch(bar(), paths, obstacles, results, {}, batch);
    for (std::size_t k = 0; k < paths.size(); ++k) {
      const ChainResult single = certify(bar(), paths[k], obstacles);
      EXPECT_EQ(results[k].toi.status, single.toi.status);
      EXPECT_EQ(results[k].toi.t_safe, single.toi.t_safe);
      EXPECT_EQ(results[k].link_a, single.link_a);
      EXPECT_EQ(results[k].obstacle, single.obstacle);
      hits += single.toi.status == ToiStatus::Separated ? 0 : 1;
    }
  }
  EXPECT_GT(hits, 0);
  EXPECT_LT(hits, 60);
  paths.push_back(line(vector_of({0, 0}), vector_of({1, 1})));
  EXPECT_NE(message_of([&] { certify_batch(bar(), paths, obstacles, results); }).find("results"),
            std::string::npos);
  results.resize(paths.size());
  EXPECT_NE(message_of([&] { certify_batch(bar(), paths, obstacles, results); }).find("path 30"),
            std::string::npos);
}

TEST(CertifyChain, AStoppedBatchTellsWhatItDidNotExamine) {
  const std::vector<JointPath> paths(4, line(vector_of({0}), vector_of({3})));
  std::vector<ChainResult> results(paths.size());
  for (const bool by_batch : {true, false}) {
    std::stop_source stop;
    stop.request_stop();
    BatchOptions batch;
    ChainOptions options;
    (by_batch ? batch.stop : options.toi.stop) = stop.get_token();
    ObstacleSet obstacles;
    obstacles.add(std::make_shared<Sphere>(0.1), RigidPose(Vector3(0, 0.8, 0)));
    certify_batch(bar(), paths, obstacles, results, options, batch);
    for (const ChainResult& result : results) {
      EXPECT_EQ(result.toi.status, by_batch ? ToiStatus::NotRun : ToiStatus::Cancelled);
      EXPECT_LT(result.toi.t_safe, by_batch ? 1e-300 : 0.5);  // literal: not begun
    }
  }
}

TEST(CertifyChain, RefusesBadInput) {
  const ObstacleSet none;
  EXPECT_THROW(certify(bar(), line(JointVector::Zero(2), JointVector::Ones(2)), none),
               InvalidArgument);
  ChainOptions options;
  options.toi.solid_a = true;
  EXPECT_THROW(certify(bar(), line(vector_of({0}), vector_of({1})), none, options),
               InvalidArgument);
  EXPECT_THROW(
      certify(KinematicChain(
                  {{"sheet", std::make_shared<TriangleMesh>(testing::plate_grid(1, 1, 2, 2).mesh()),
                    true}},
                  {}),
              line(JointVector(), JointVector()), none),
      InvalidArgument);
}

enum class PathKind { Linear, Cubic, Spline };

JointPath random_path(PathKind kind, const KinematicChain& arm, std::mt19937_64& random) {
  const auto q = [&] { return random_coordinates(arm, random); };
  switch (kind) {
    case PathKind::Linear:
      return JointPath::linear(std::vector<Scalar>{1, 3}, std::vector{q(), q()});
    case PathKind::Cubic:
      return JointPath::cubic(std::vector<Scalar>{-1, 0, 2}, std::vector{q(), q(), q()});
    case PathKind::Spline:
      break;
  }
  return JointPath::bspline(3, std::vector<Scalar>{0, 0, 0, 0, 1, 2, 2, 2, 2},
                            std::vector{q(), q(), q(), q(), q()});
}

// Random paths, half of which begin free. `path_count` is raised by hand for a soak run.
class ArmPaths : public ::testing::TestWithParam<PathKind> {
 protected:
  ObstacleSet obstacles_;
};

TEST_P(ArmPaths, AreNeverPenetratingAndNeverStoppedEarly) {
  const char* const soak = std::getenv("DYOP_SOAK_PATHS");
  const int path_count = soak ? std::atoi(soak) : 60;
  std::mt19937_64 random(20261122 + std::uint64_t(GetParam()));
  const KinematicChain arm = six_axis_arm();
  ChainWorkspace workspace;
  std::array<int, 3> counts{};  // separated, impact, already within
  for (int i = 0; i < path_count; ++i) {
    SCOPED_TRACE(i);
    if (i % 20 == 0) obstacles_ = arm_surroundings(100, random);
    const JointPath path = random_path(GetParam(), arm, random);
    ChainOptions options;
    options.toi.target_distance = i % 3 == 0 ? 0.01 : 0;
    options.toi.distance_tolerance = 1e-4;
    const ChainResult result = certify(arm, path, obstacles_, options, workspace);
    const Scalar target = options.toi.target_distance;
    const Scalar epsilon = *options.toi.distance_tolerance;
    const Scalar noise = result.toi.rounding_allowance;
    ASSERT_LT(noise, 1e-9);
    const auto gap_at = [&](Scalar t) { return oracle_gap(arm, path, obstacles_, t, 0.5); };
    const TimeInterval whole = path.domain();
    if (result.toi.status == ToiStatus::InitiallyWithinTarget) {
      ++counts[2];
      ASSERT_LE(gap_at(whole.begin), target + epsilon + noise);
      continue;
    }
    const bool is_impact = result.toi.status == ToiStatus::Impact;
    ASSERT_TRUE(is_impact || result.toi.status == ToiStatus::Separated);
    ++counts[is_impact];
    // As far as it is proven free, steps of what the gap allows at the largest speed, but no
    // shorter than a tenth of the tolerance: nothing deeper than that escapes.
    const Scalar speed = oracle_speed(arm, path);
    for (Scalar t = whole.begin; t < result.toi.t_safe;) {
      const Scalar gap = gap_at(t);
      ASSERT_GE(gap, target + epsilon / 4 - noise - 1e-12) << "at " << t;
      t += std::max({(gap - target) / speed, epsilon / 10 / speed, whole.length() / 2000});
    }
    ASSERT_GE(gap_at(result.toi.t_safe), target + epsilon / 4 - noise - 1e-12);
    if (is_impact) {
      ASSERT_LE(gap_at(result.toi.t_safe), target + epsilon + noise + 1e-12);
    }
  }
  if (!soak) {
    EXPECT_GE(counts[0], 2);
    EXPECT_GE(counts[1], 20);
    EXPECT_GE(counts[2], 2);
  }
  std::printf("separated %d, impact %d, initially within %d\n", counts[0], counts[1], counts[2]);
}

INSTANTIATE_TEST_SUITE_P(Kinds, ArmPaths,
                         ::testing::Values(PathKind::Linear, PathKind::Cubic, PathKind::Spline));

}  // namespace
}  // namespace dyop::testing
