// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/chain/kinematic_chain.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "dyop/core/error.h"
#include "support/inputs/arms.h"
#include "support/message_of.h"
#include "support/oracles/chain_oracle.h"

namespace dyop::testing {
namespace {

const std::shared_ptr<const Shape> kBall = std::make_shared<Sphere>(0.1);

Joint revolute(const char* name, const char* parent, const char* child) {
  return {name, JointType::Revolute, parent, child, RigidPose(Vector3(1, 0, 0))};
}

TEST(KinematicChain, PosesOfAPlanarArmAreTheClosedForm) {
  const KinematicChain chain({{"a", kBall}, {"b", kBall}, {"c", kBall}},
                             {revolute("j1", "a", "b"), revolute("j2", "b", "c")});
  JointVector q(2);
  q << 0.3, -1.1;
  const std::vector<RigidPose> poses = chain.link_poses(q);
  EXPECT_LT((poses[1].translation() - Vector3(1, 0, 0)).norm(), 1e-15);
  EXPECT_LT((poses[2].translation() - Vector3(1 + std::cos(0.3), std::sin(0.3), 0)).norm(), 1e-15);
  EXPECT_LT(
      (poses[2].rotation() * Vector3::UnitX() - Vector3(std::cos(-0.8), std::sin(-0.8), 0)).norm(),
      1e-15);
}

TEST(KinematicChain, PosesAreTheProductsOfHomogeneousMatrices) {
  std::mt19937_64 random(1);
  for (int round = 0; round < 200; ++round) {
    const Scalar size = random_magnitude(-4, 4, random);
    const KinematicChain chain = random_tree(size, random);
    JointVector q(chain.coordinate_count());
    for (Eigen::Index i = 0; i < q.size(); ++i) q[i] = random_number(-4, 4, random);
    const std::vector<RigidPose> poses = chain.link_poses(q);
    const std::vector<Eigen::Matrix4d> expected = oracle_link_poses(chain, q);
    for (std::size_t link = 0; link < poses.size(); ++link) {
      const Scalar reach = 10 * (size + 4) * Scalar(poses.size());
      EXPECT_LT((poses[link].rotation() - expected[link].topLeftCorner<3, 3>()).norm(), 1e-13);
      EXPECT_LT((poses[link].translation() - expected[link].topRightCorner<3, 1>()).norm(),
                1e-14 * reach);
    }
  }
}

// Against central differences of the oracle's poses.
TEST(KinematicChain, JacobiansAreTheRatesOfThePoses) {
  std::mt19937_64 random(4);
  for (int round = 0; round < 40; ++round) {
    const KinematicChain chain = random_tree(1, random);
    JointVector q(chain.coordinate_count());
    for (Eigen::Index i = 0; i < q.size(); ++i) q[i] = random_number(-2, 2, random);
    constexpr Scalar kStep = 1e-5;
    for (std::size_t link = 0; link < chain.links().size(); ++link) {
      const std::vector<Twist> twists = chain.link_jacobian(link, q);
      ASSERT_EQ(twists.size(), chain.coordinate_count());
      for (std::size_t k = 0; k < twists.size(); ++k) {
        JointVector plus = q;
        JointVector minus = q;
        plus[Eigen::Index(k)] += kStep;
        minus[Eigen::Index(k)] -= kStep;
        const Eigen::Matrix4d rate =
            (oracle_link_poses(chain, plus)[link] - oracle_link_poses(chain, minus)[link]) /
            (2 * kStep);
        const Matrix3 R = oracle_link_poses(chain, q)[link].topLeftCorner<3, 3>();
        const Matrix3 turning = rate.topLeftCorner<3, 3>() * R.transpose();
        const Vector3 w(turning(2, 1), turning(0, 2), turning(1, 0));
        EXPECT_LT((twists[k].v_WB - rate.topRightCorner<3, 1>()).norm(), 1e-7);
        EXPECT_LT((twists[k].w_WB - w).norm(), 1e-7);
      }
    }
    EXPECT_THROW(chain.link_jacobian(chain.links().size(), q), InvalidArgument);
  }
}

// A fixed link is where it is at all coordinates, any other one is not.
TEST(KinematicChain, FixedLinksAreThoseThatNoCoordinateMoves) {
  std::mt19937_64 random(5);
  int fixed = 0, moving = 0;
  for (int round = 0; round < 200; ++round) {
    const KinematicChain chain = random_tree(1, random);
    JointVector q(chain.coordinate_count());
    for (Eigen::Index i = 0; i < q.size(); ++i) q[i] = random_number(0.1, 2, random);
    const auto at_zero = oracle_link_poses(chain, JointVector::Zero(q.size()));
    const auto at_q = oracle_link_poses(chain, q);
    for (std::size_t link = 1; link < chain.links().size(); ++link) {
      EXPECT_EQ(chain.is_fixed(link), (at_q[link] - at_zero[link]).norm() < 1e-12);
      ++(chain.is_fixed(link) ? fixed : moving);
    }
    EXPECT_TRUE(chain.is_fixed(0));
    EXPECT_THROW(chain.is_fixed(chain.links().size()), InvalidArgument);
  }
  EXPECT_GT(fixed, 50);
  EXPECT_GT(moving, 200);
}

TEST(KinematicChain, NamesWhatIsWrong) {
  const auto message = [](std::vector<Link> links, std::vector<Joint> joints) {
    return message_of<InvalidArgument>(
        [&] { KinematicChain(std::move(links), std::move(joints)); });
  };
  const auto contains = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  contains(message({}, {}), "needs a link");
  contains(message({{"a", kBall}, {"a", kBall}}, {}), "two links have the name 'a'");
  contains(message({{"a", kBall}, {"b", kBall}}, {}), "one link without a joint above, not 2");
  contains(message({{"a", kBall}, {"b", kBall}}, {revolute("j", "a", "x")}), "child 'x'");
  contains(
      message({{"a", kBall}, {"b", kBall}}, {revolute("j", "a", "b"), revolute("j", "a", "b")}),
      "two joints have the name 'j'");
  contains(
      message({{"a", kBall}, {"b", kBall}}, {revolute("j", "a", "b"), revolute("k", "a", "b")}),
      "'b' is already the child");
  contains(message({{"a", kBall}, {"b", kBall}, {"c", kBall}},
                   {revolute("j", "b", "c"), revolute("k", "c", "b")}),
           "form a loop");
  Joint zero = revolute("j", "a", "b");
  zero.axis_J.setZero();
  contains(message({{"a", kBall}, {"b", kBall}}, {zero}), "axis of joint 'j'");
  Joint reversed = revolute("j", "a", "b");
  reversed.lower = 2;
  reversed.upper = 1;
  contains(message({{"a", kBall}, {"b", kBall}}, {reversed}), "2 > 1");
  KinematicChain::Options options;
  options.ignored_pairs = {{"a", "z"}};
  contains(message_of<InvalidArgument>([&] {
             KinematicChain({{"a", kBall}}, {}, options);
           }),
           "ignored pair: 'z'");
}

TEST(KinematicChain, SelfPairsLeaveOutNeighboursAndIgnoredPairs) {
  // a - b - (no shape) - c - d, and e on b.
  const std::vector<Link> links{{"a", kBall}, {"b", kBall}, {"empty", nullptr},
                                {"c", kBall}, {"d", kBall}, {"e", kBall}};
  const std::vector<Joint> joints{revolute("1", "a", "b"), revolute("2", "b", "empty"),
                                  revolute("3", "empty", "c"), revolute("4", "c", "d"),
                                  revolute("5", "b", "e")};
  KinematicChain::Options options;
  options.ignored_pairs = {{"d", "a"}};
  const KinematicChain chain(links, joints, options);
  std::vector<std::string> pairs;
  for (const KinematicChain::LinkPair& pair : chain.self_pairs()) {
    pairs.push_back(links[pair.first].name + links[pair.second].name);
  }
  EXPECT_EQ(pairs, (std::vector<std::string>{"ac", "ae", "bd", "ce", "de"}));
  EXPECT_EQ(chain.common_ancestor(4, 5), 1u);
  EXPECT_EQ(chain.depth(4), 4u);
}

TEST(KinematicChain, KnowsItsLimits) {
  const KinematicChain arm = six_axis_arm();
  EXPECT_EQ(arm.coordinate_count(), 6u);
  EXPECT_TRUE(arm.is_within_limits(JointVector::Zero(6)));
  JointVector q = JointVector::Zero(6);
  q[2] = 2.7;
  EXPECT_FALSE(arm.is_within_limits(q));
  EXPECT_THROW(arm.is_within_limits(JointVector::Zero(5)), InvalidArgument);
  EXPECT_THROW(arm.link_poses(JointVector::Zero(7)), InvalidArgument);
  EXPECT_EQ(arm.find_link("tool"), 7u);
  EXPECT_FALSE(arm.find_link("hammer"));
}

}  // namespace
}  // namespace dyop::testing
