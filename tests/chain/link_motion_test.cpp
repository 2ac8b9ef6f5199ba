// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/chain/link_motion.h"

#include <gtest/gtest.h>

#include <numbers>

#include "dyop/core/error.h"
#include "motion/motion_contract.h"
#include "motion/stretch_check.h"
#include "support/inputs/arms.h"
#include "support/message_of.h"
#include "support/oracles/chain_oracle.h"

namespace dyop::testing {
namespace {

// A chain of up to four moving joints and some fixed ones, of all kinds. Joints turn by about
// scales.turn in all, and links are a few times shorter than scales.length.
std::shared_ptr<const KinematicChain> random_arm(Random& random, const Scales& scales) {
  const Scalar size = scales.length / 8;
  const int count = 1 + int(random.uniform(0, 4.999));
  std::vector<Link> links{{"0", nullptr}};
  std::vector<Joint> joints;
  for (int i = 1; i <= count; ++i) {
    links.push_back({std::to_string(i), nullptr});
    const auto type = i == 1 ? JointType::Revolute : JointType(int(random.uniform(0, 2.999)));
    joints.push_back({"j" + std::to_string(i), type, std::to_string(i - 1), std::to_string(i),
                      random.pose(size), random.direction()});
  }
  KinematicChain::Options options;
  options.X_WR = random.pose(scales.distance);
  return std::make_shared<KinematicChain>(links, joints, options);
}

std::vector<JointVector> random_waypoints(Random& random, const KinematicChain& chain,
                                          const Scales& scales, int count) {
  std::vector<JointVector> points;
  for (int i = 0; i < count; ++i) {
    points.emplace_back(chain.coordinate_count());
    for (std::size_t j = 0; j < chain.coordinate_count(); ++j) {
      const bool is_turn = chain.joints()[chain.joint_of(j)].type == JointType::Revolute;
      points.back()[Eigen::Index(j)] =
          random.uniform(-1, 1) * (is_turn ? scales.turn / 4 : scales.length / 8);
    }
  }
  return points;
}

MotionPointer tip(const std::shared_ptr<const KinematicChain>& chain, const JointPath& path) {
  return std::make_shared<LinkMotion>(chain, std::make_shared<JointPath>(path),
                                      chain->links().size() - 1);
}

MotionPointer linear(Random& random, const Scales& scales) {
  const auto chain = random_arm(random, scales);
  const std::vector<Scalar> times{scales.span.begin, scales.span.begin + 0.3 * scales.time(),
                                  scales.span.end};
  return tip(chain, JointPath::linear(times, random_waypoints(random, *chain, scales, 3)));
}

MotionPointer cubic(Random& random, const Scales& scales) {
  const auto chain = random_arm(random, scales);
  const std::vector<Scalar> times{scales.span.begin, scales.span.begin + 0.6 * scales.time(),
                                  scales.span.end};
  return tip(chain, JointPath::cubic(times, random_waypoints(random, *chain, scales, 3)));
}

MotionPointer spline(Random& random, const Scales& scales) {
  const auto chain = random_arm(random, scales);
  std::vector<Scalar> knots;
  for (const Scalar fraction : {0.0, 0.0, 0.0, 0.0, 0.3, 0.55, 1.0, 1.0, 1.0, 1.0}) {
    knots.push_back(fraction == 1 ? scales.span.end : scales.span.begin + fraction * scales.time());
  }
  return tip(chain, JointPath::bspline(3, knots, random_waypoints(random, *chain, scales, 6)));
}

MotionPointer seen_from_a_link(Random& random, const Scales& scales) {
  const auto chain = random_arm(random, scales);
  const std::vector<Scalar> times{scales.span.begin, scales.span.end};
  std::vector<JointVector> velocities = random_waypoints(random, *chain, scales, 2);
  for (JointVector& velocity : velocities) velocity /= scales.time();
  const auto path = std::make_shared<JointPath>(
      JointPath::cubic(times, random_waypoints(random, *chain, scales, 2), velocities));
  return std::make_shared<LinkMotion>(chain, path, chain->links().size() - 1,
                                      chain->links().size() / 2);
}

const std::vector<MotionMaker> kLinkMotions{{"linear", linear},
                                            {"cubic", cubic},
                                            {"spline", spline},
                                            {"seen_from_a_link", seen_from_a_link}};

INSTANTIATE_TEST_SUITE_P(Links, MotionContract, all_of(kLinkMotions), test_name);

TEST(LinkMotion, FollowsTheProductOfHomogeneousMatrices) {
  std::mt19937_64 random(5);
  for (int round = 0; round < 300; ++round) {
    const auto chain = std::make_shared<KinematicChain>(random_tree(1, random));
    if (chain->coordinate_count() == 0) continue;
    std::vector<JointVector> points(2, JointVector(chain->coordinate_count()));
    for (JointVector& q : points) {
      for (Eigen::Index i = 0; i < q.size(); ++i) q[i] = random_number(-3, 3, random);
    }
    const auto path =
        std::make_shared<JointPath>(JointPath::linear(std::vector<Scalar>{2, 5}, points));
    const Scalar t = random_number(2, 5, random);
    const std::vector<Eigen::Matrix4d> expected = oracle_link_poses(*chain, path->position(t));
    for (std::size_t link = 0; link < chain->links().size(); ++link) {
      const Eigen::Matrix4d pose = homogeneous(LinkMotion(chain, path, link).pose(t));
      ASSERT_LT((pose - expected[link]).norm(), 1e-12);
      const std::size_t base = chain->common_ancestor(link, 0);
      const Eigen::Matrix4d seen = homogeneous(LinkMotion(chain, path, link, base).pose(t));
      ASSERT_LT((expected[base] * seen - expected[link]).norm(), 1e-12);
    }
  }
}

// About one axis the bounds are the speed and the centripetal acceleration.
TEST(LinkMotion, BoundsAreEqualitiesForOneJoint) {
  const auto chain = std::make_shared<KinematicChain>(
      std::vector<Link>{{"root"}, {"arm"}, {"tip"}},
      std::vector<Joint>{{"j", JointType::Revolute, "root", "arm"},
                         {"f", JointType::Fixed, "arm", "tip", RigidPose(Vector3(3, 0, 7))}});
  const auto path = std::make_shared<JointPath>(JointPath::linear(
      std::vector<Scalar>{0, 2},
      std::vector{JointVector(JointVector::Zero(1)), JointVector(JointVector::Constant(1, 4))}));
  const TwistBound bound = LinkMotion(chain, path, 2).twist_bound({0.5, 0.75});
  EXPECT_NEAR(bound.linear_speed, 6, 1e-11);
  EXPECT_NEAR(bound.angular_speed, 2, 1e-11);
  EXPECT_NEAR(bound.linear_acceleration, 12, 1e-11);
  EXPECT_EQ(bound.angular_acceleration, 0);
}

TEST(LinkMotion, ParallelAxesDoNotTurnOneAnother) {
  const auto chain = std::make_shared<KinematicChain>(
      std::vector<Link>{{"root"}, {"a"}, {"b"}},
      std::vector<Joint>{{"1", JointType::Revolute, "root", "a", RigidPose(Vector3(1, 2, 3))},
                         {"2", JointType::Revolute, "a", "b", RigidPose(Vector3(1, 0, 0))}});
  const auto path = std::make_shared<JointPath>(JointPath::linear(
      std::vector<Scalar>{0, 1},
      std::vector{JointVector(JointVector::Zero(2)), JointVector(JointVector::Ones(2))}));
  EXPECT_LT(LinkMotion(chain, path, 2).twist_bound({0, 1}).angular_acceleration, 1e-12);
}

TEST(LinkMotion, OfALongChainIsStillARotation) {
  std::vector<Link> links{{"0"}};
  std::vector<Joint> joints;
  for (int i = 1; i <= 200; ++i) {
    links.push_back({std::to_string(i)});
    joints.push_back({std::to_string(i), JointType::Revolute, std::to_string(i - 1),
                      std::to_string(i), RigidPose(Vector3(0.1, 0, 0)), Vector3(i % 3, 1, i % 2)});
  }
  const auto chain = std::make_shared<KinematicChain>(links, joints);
  const auto path = std::make_shared<JointPath>(JointPath::linear(
      std::vector<Scalar>{0, 1},
      std::vector{JointVector(JointVector::Zero(200)), JointVector(JointVector::Ones(200))}));
  const LinkMotion motion(chain, path, 200);
  const Matrix3 R = motion.pose(0.7).rotation();
  EXPECT_LT((R.transpose() * R - Matrix3::Identity()).norm(), 1e-15);
  const MotionCheck check = check_motion(motion, {0, 1}, {.sample_count = 50});
  EXPECT_TRUE(check.is_sound()) << check.message;
}

TEST(LinkMotion, NamesWhatIsWrong) {
  const auto chain = std::make_shared<KinematicChain>(six_axis_arm());
  const std::vector<JointVector> six(2, JointVector::Zero(6)), five(2, JointVector::Zero(5));
  const std::vector<Scalar> times{0, 1};
  const auto path = std::make_shared<JointPath>(JointPath::linear(times, six));
  const auto other = std::make_shared<JointPath>(JointPath::linear(times, five));
  const auto contains = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  using Wrong = InvalidArgument;
  contains(message_of<Wrong>([&] { LinkMotion(nullptr, path, 0); }), "null");
  contains(message_of<Wrong>([&] { LinkMotion(chain, path, 8); }), "8 links, not link 8");
  contains(message_of<Wrong>([&] { LinkMotion(chain, other, 1); }), "5 coordinates, the chain 6");
  contains(message_of<Wrong>([&] { LinkMotion(chain, path, 2, 4); }),
           "'wrist_1' is not on the path");
}

// Paths of many waypoints that are smooth, jump or repeat themselves; links in the world and as seen
// from another.
TEST(LinkMotionStretch, HoldsAcrossManyWaypoints) {
  Random random(28);
  std::mt19937_64 engine(28);
  for (int i = 0; i < 40; ++i) {
    SCOPED_TRACE(::testing::Message() << "path " << i);
    const Scales scales{i % 2 == 0 ? 1 : 1e-4, i % 3 == 0 ? 1e4 : 1, i % 4 == 0 ? 0.01 : 1,
                        i % 5 == 0 ? TimeInterval{300, 301} : TimeInterval{0, 1e-3}};
    const auto chain = random_arm(random, scales);
    const int count = i % 2 == 0 ? 10 : 130;
    std::vector<JointVector> points = random_waypoints(random, *chain, scales, count);
    std::vector<Scalar> times;
    for (int k = 0; k < count; ++k) {
      const std::size_t n = std::size_t(k);
      const Scalar share = Scalar(k) / (count - 1);
      if (i % 3 != 0 && k > 0) points[n] = points[n - 1] + points[n] / count;
      if (k % 7 == 3) points[n] = points[n - 1];
      // literal: two waypoints almost at once.
      times.push_back(scales.span.begin +
                      scales.time() * (k % 11 == 5 ? share - 0.99 / count : share));
    }
    const std::size_t last = chain->links().size() - 1;
    for (const JointPath& given :
         {JointPath::linear(times, points), JointPath::cubic(times, points)}) {
      const auto path = std::make_shared<JointPath>(given);
      expect_stretches(LinkMotion(chain, path, last), times, engine);
      if (last > 1) expect_stretches(LinkMotion(chain, path, last, 1), times, engine);
      if (HasFailure()) return;
    }
  }
}

}  // namespace
}  // namespace dyop::testing
