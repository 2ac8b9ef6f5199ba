// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/chain/link_pairs.h"

#include <gtest/gtest.h>

#include <numbers>

#include "dyop/chain/robot.h"
#include "dyop/geometry/primitives.h"
#include "support/inputs/arms.h"
#include "support/inputs/curved_meshes.h"
#include "support/message_of.h"
#include "support/oracles/chain_oracle.h"
#include "support/oracles/mesh_intersection_oracle.h"

namespace dyop::testing {
namespace {

constexpr Scalar kPi = std::numbers::pi;

// A point drawn evenly from the limits of the free coordinates; a turn where there are none.
JointVector random_free(const Robot& robot, std::mt19937_64& random) {
  JointVector free(Eigen::Index(robot.free_count()));
  for (std::size_t k = 0; k < robot.free_count(); ++k) {
    const Joint& joint = robot.chain->joints()[robot.free_joints[k]];
    const bool has_limits = std::isfinite(joint.upper - joint.lower);
    free[Eigen::Index(k)] = has_limits ? random_number(joint.lower, joint.upper, random)
                                       : random_number(-kPi, kPi, random);
  }
  return free;
}

const TriangleMesh& mesh_of(const Link& link) {
  return dynamic_cast<const TriangleMesh&>(*link.shape);
}

bool is_within_limits(const Robot& robot, const JointVector& free) {
  for (std::size_t k = 0; k < robot.free_count(); ++k) {
    const Joint& joint = robot.chain->joints()[robot.free_joints[k]];
    const Scalar q = free[Eigen::Index(k)];
    const Scalar noise = 1e-12;
    if (!(joint.lower - noise <= q && q <= joint.upper + noise)) return false;
  }
  return true;
}

// By homogeneous matrices and CGAL.
bool oracle_touches(const Robot& robot, const LinkPairReport& pair, const JointVector& free) {
  const std::vector<Eigen::Matrix4d> poses = oracle_link_poses(*robot.chain, robot.expand(free));
  const Link& a = robot.chain->links()[pair.first];
  const Link& b = robot.chain->links()[pair.second];
  const RigidPose X_WA = oracle_pose(poses[pair.first]);
  const RigidPose X_WB = oracle_pose(poses[pair.second]);
  if (oracle_meshes_intersect(mesh_of(a), X_WA, mesh_of(b), X_WB)) return true;
  DistanceOptions options;
  options.solid_a = a.is_solid;
  options.solid_b = b.is_solid;
  return distance(*a.shape, X_WA, *b.shape, X_WB, options).lower == 0;
}

// A tree of up to seven links with meshes, with limits, some joints coupled to others.
Robot random_robot(std::mt19937_64& random) {
  const int count = 2 + random_index(6, random);
  std::vector<Link> links;
  std::vector<Joint> joints;
  for (int i = 0; i < count; ++i) {
    const Scalar size = random_number(0.05, 0.3, random);
    const MeshArrays arrays = random_index(2, random) == 0
                                  ? box_mesh(Vector3(size, 0.3 * size, 0.5 * size))
                                  : torus(size, 0.3 * size, 9, 6);
    links.push_back({std::to_string(i), std::make_shared<TriangleMesh>(arrays.mesh()),
                     random_index(2, random) == 0});
    if (i == 0) continue;
    Joint joint;
    joint.name = std::to_string(i);
    joint.type = JointType(random_index(3, random));
    joint.parent = std::to_string(random_index(i, random));
    joint.child = std::to_string(i);
    joint.X_PJ = random_pose(0.5, random);
    joint.axis_J = random_direction(random);
    const bool is_continuous = joint.type == JointType::Revolute && random_index(3, random) == 0;
    if (joint.type != JointType::Fixed && !is_continuous) {
      joint.lower = random_number(-1, 0.5, random);
      joint.upper = joint.lower + random_number(0, 1.5, random);
    }
    joints.push_back(joint);
  }
  Robot robot = make_robot("random", KinematicChain(std::move(links), std::move(joints)));
  const std::size_t last = robot.free_count();
  if (last >= 2 && random_index(2, random) == 0) {
    robot.couplings[last - 1] = {0, random_number(-2, 2, random), random_number(-1, 1, random)};
    robot.free_joints.pop_back();
  }
  return robot;
}

TEST(LinkPairs, AgreeWithRandomSamples) {
  std::mt19937_64 random(11);
  int never = 0;
  int can = 0;
  int undecided = 0;
  for (int round = 0; round < 40; ++round) {
    const Robot robot = random_robot(random);
    LinkPairOptions options;
    options.max_boxes = 3000;
    options.samples = 300;
    for (const LinkPairReport& pair : decide_link_pairs(robot, options)) {
      never += pair.verdict == PairVerdict::Never;
      can += pair.verdict == PairVerdict::Can;
      undecided += pair.verdict == PairVerdict::Undecided;
      EXPECT_EQ(pair.verdict == PairVerdict::Undecided, pair.undecided_share > 0);
      EXPECT_LE(pair.undecided_share, 1.001);
      if (pair.witness) {
        EXPECT_TRUE(oracle_touches(robot, pair, *pair.witness));
        EXPECT_TRUE(is_within_limits(robot, *pair.witness));
      }
      if (pair.verdict == PairVerdict::Can || pair.verdict == PairVerdict::Undecided) continue;
      for (int k = 0; k < 60; ++k) {
        EXPECT_EQ(oracle_touches(robot, pair, random_free(robot, random)),
                  pair.verdict == PairVerdict::Always)
            << round << ": " << pair.first << ' ' << pair.second;
      }
    }
  }
  EXPECT_GT(never, 100);
  EXPECT_GT(can, 50);
  EXPECT_LT(undecided, 30);
}

// Cylinders between the prisms inside and around them, by CGAL. All are of one size, so that none is
// inside another.
TEST(LinkPairs, OfCylindersAgreeWithPrisms) {
  constexpr Scalar kRadius = 0.1;
  constexpr Scalar kHalfLength = 0.25;
  constexpr int kSides = 64;
  const TriangleMesh inside = disc(kRadius, kHalfLength, kSides).mesh();
  const TriangleMesh around = disc(kRadius / std::cos(kPi / kSides), kHalfLength, kSides).mesh();
  // The axis of a disc is y.
  const RigidPose X_CD(Matrix3(Eigen::AngleAxisd(kPi / 2, Vector3::UnitX())), Vector3::Zero());
  std::mt19937_64 random(12);
  int never = 0;
  int touching = 0;
  for (int round = 0; round < 25; ++round) {
    Robot robot = random_robot(random);
    std::vector<Link> links(robot.chain->links().begin(), robot.chain->links().end());
    for (Link& link : links) {
      link.shape = std::make_shared<Cylinder>(kRadius, kHalfLength);
      link.is_solid = false;
    }
    const std::vector<Joint> joints(robot.chain->joints().begin(), robot.chain->joints().end());
    robot.chain = std::make_shared<const KinematicChain>(links, joints);
    const auto prisms_meet = [&](const LinkPairReport& pair, const TriangleMesh& mesh,
                                 const JointVector& free) {
      const auto poses = oracle_link_poses(*robot.chain, robot.expand(free));
      return oracle_meshes_intersect(mesh, oracle_pose(poses[pair.first]) * X_CD, mesh,
                                     oracle_pose(poses[pair.second]) * X_CD);
    };
    LinkPairOptions options;
    options.max_boxes = 3000;
    options.samples = 300;
    for (const LinkPairReport& pair : decide_link_pairs(robot, options)) {
      if (pair.witness) {
        ++touching;
        EXPECT_TRUE(prisms_meet(pair, around, *pair.witness)) << round;
      }
      if (pair.verdict != PairVerdict::Never) continue;
      ++never;
      for (int k = 0; k < 30; ++k) {
        EXPECT_FALSE(prisms_meet(pair, inside, random_free(robot, random))) << round;
      }
    }
  }
  EXPECT_GT(never, 50);
  EXPECT_GT(touching, 30);
}

TEST(LinkPairs, AreTheSameEveryTime) {
  const Robot robot = make_robot("arm", six_axis_arm());
  LinkPairOptions options;
  options.max_boxes = 500;
  const std::vector<LinkPairReport> first = decide_link_pairs(robot, options);
  const std::vector<LinkPairReport> second = decide_link_pairs(robot, options);
  ASSERT_EQ(first.size(), 28u);
  ASSERT_EQ(second.size(), first.size());
  for (std::size_t k = 0; k < first.size(); ++k) {
    EXPECT_EQ(first[k].verdict, second[k].verdict);
    EXPECT_EQ(first[k].boxes, second[k].boxes);
    EXPECT_EQ(first[k].undecided_share, second[k].undecided_share);
    EXPECT_EQ(first[k].witness, second[k].witness);
  }
}

// Two rods of length 1 on parallel axes: apart for good unless a limit lets them meet.
Robot two_rods(Scalar limit) {
  const auto rod = std::make_shared<Box>(Vector3(0.5, 0.02, 0.02));
  const auto turn = [&](const char* name, const Vector3& place) {
    return Joint{
        name, JointType::Revolute, "root", name, RigidPose(place), Vector3::UnitZ(), -limit, limit};
  };
  std::vector<Link> links{{"root"}, {"left", rod}, {"right", rod}};
  std::vector<Joint> joints{turn("left", Vector3(0, 0.6, 0)), turn("right", Vector3(0, -0.6, 0))};
  return make_robot("rods", KinematicChain(links, joints));
}

TEST(LinkPairs, DependOnTheLimits) {
  // Both rods reach 0.5 sin(q) + 0.02 cos(q) to the side, and meet where that exceeds 0.6 together.
  const auto narrow = decide_link_pairs(two_rods(0.5));
  ASSERT_EQ(narrow.size(), 1u);
  EXPECT_EQ(narrow[0].verdict, PairVerdict::Never);
  EXPECT_TRUE(narrow[0].is_adjacent);  // joined through a link without a shape
  EXPECT_EQ(narrow[0].joints, 2u);
  // They reach 1.2 only with both at more than a right angle's worth: never with half length 0.5.
  EXPECT_EQ(decide_link_pairs(two_rods(3))[0].verdict, PairVerdict::Never);
}

TEST(LinkPairs, CoupledJointsMoveTogether) {
  // Two jaws on one coordinate: the right one mirrors the left, so they close on each other.
  const auto jaw = std::make_shared<Box>(Vector3(0.01, 0.01, 0.05));
  const auto slide = [&](const char* name, Scalar x) {
    return Joint{
        name, JointType::Prismatic, "palm", name, RigidPose(Vector3(x, 0, 0)), Vector3::UnitX(), 0,
        0.1};
  };
  const auto robot_of = [&](Scalar multiplier) {
    Robot robot = make_robot("jaws", KinematicChain({{"palm"}, {"left", jaw}, {"right", jaw}},
                                                    {slide("left", -0.05), slide("right", 0.05)}));
    robot.couplings[1] = {0, multiplier, 0};
    robot.free_joints.pop_back();
    return robot;
  };
  EXPECT_EQ(decide_link_pairs(robot_of(1))[0].verdict, PairVerdict::Never);
  const auto closing = decide_link_pairs(robot_of(-1));
  EXPECT_EQ(closing[0].verdict, PairVerdict::Can);
  EXPECT_GE((*closing[0].witness)[0], 0.04);
}

TEST(LinkPairs, ALinkInsideAnotherAlwaysTouches) {
  const auto shell = std::make_shared<TriangleMesh>(box_mesh(Vector3(1, 1, 1)).mesh());
  const auto core = std::make_shared<TriangleMesh>(box_mesh(Vector3(0.2, 0.1, 0.1)).mesh());
  Joint turn{"turn", JointType::Revolute, "shell", "core"};
  const auto verdict = [&](bool is_solid) {
    const KinematicChain chain({{"shell", shell, is_solid}, {"core", core}}, {turn});
    return decide_link_pairs(make_robot("nested", chain))[0].verdict;
  };
  EXPECT_EQ(verdict(false), PairVerdict::Never);
  EXPECT_EQ(verdict(true), PairVerdict::Always);
}

TEST(LinkPairs, ASlideWithoutLimitsIsUndecided) {
  const auto ball = std::make_shared<Sphere>(0.1);
  Joint slide{"slide", JointType::Prismatic, "a", "b", RigidPose(Vector3(1, 0, 0))};
  const auto pairs =
      decide_link_pairs(make_robot("slide", KinematicChain({{"a", ball}, {"b", ball}}, {slide})));
  EXPECT_EQ(pairs[0].verdict, PairVerdict::Undecided);
  EXPECT_EQ(pairs[0].undecided_share, 1);
}

TEST(LinkPairs, NameWhatIsWrong) {
  const Robot robot = two_rods(1);
  EXPECT_NE(message_of([&] {
              decide_link_pairs(robot, {.only = {{"left", "middle"}}});
            }).find("'middle'"),
            std::string::npos);
  EXPECT_NE(message_of([&] { decide_link_pairs(robot, {.max_boxes = 0}); }).find("max_boxes"),
            std::string::npos);
  EXPECT_EQ(decide_link_pairs(robot, {.only = {{"right", "left"}}}).size(), 1u);
}

TEST(Robot, ExpandsCoupledCoordinates) {
  Robot robot = two_rods(1);
  robot.couplings[1] = {0, -2, 0.5};
  robot.free_joints.pop_back();
  const JointVector free = JointVector::Constant(1, 0.25);
  EXPECT_EQ(robot.expand(free)[0], 0.25);
  EXPECT_EQ(robot.expand(free)[1], 0);
  EXPECT_EQ(robot.expand_rates(free)[1], -0.5);
  EXPECT_NE(message_of([&] { robot.expand(JointVector(2)); }).find("1 free"), std::string::npos);
}

TEST(Robot, HoldsAnObject) {
  const KinematicChain arm = six_axis_arm();
  Link object;
  object.name = "part";
  object.shape = std::make_shared<Sphere>(0.02);
  const KinematicChain held =
      attach(arm, object, "tool", RigidPose(Vector3(0, 0, 0.1)), {"flange"});
  EXPECT_EQ(held.links().size(), arm.links().size() + 1);
  // Checked against all links but the tool and the flange; other pairs stay as they were.
  EXPECT_EQ(held.self_pairs().size(), arm.self_pairs().size() + arm.links().size() - 2);
  EXPECT_NE(message_of([&] { attach(arm, object, "hand", RigidPose()); }).find("'hand'"),
            std::string::npos);
}

}  // namespace
}  // namespace dyop::testing
