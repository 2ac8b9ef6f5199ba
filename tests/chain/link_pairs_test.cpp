// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/chain/link_pairs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>

#include "dyop/chain/robot.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "support/inputs/arms.h"
#include "support/inputs/curved_meshes.h"
#include "support/message_of.h"
#include "support/oracles/chain_oracle.h"
#include "support/oracles/mesh_intersection_oracle.h"

namespace dyop::testing {
namespace {

constexpr Scalar kPi = std::numbers::pi;

// A point drawn evenly from the limits of the free coordinates; ten turns where there are none.
JointVector random_free(const Robot& robot, std::mt19937_64& random) {
  JointVector free = robot.lower();
  const JointVector upper = robot.upper();
  for (Eigen::Index k = 0; k < free.size(); ++k) {
    const bool has_limits = std::isfinite(upper[k] - free[k]);
    free[k] = has_limits ? random_number(free[k], upper[k], random)
                         : random_number(-10 * kPi, 10 * kPi, random);
  }
  return free;
}

const TriangleMesh& mesh_of(const Link& link) {
  return dynamic_cast<const TriangleMesh&>(*link.shape);
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
    robot.free_joints.pop_back();
    do {
      const bool is_fraction = random_index(2, random) == 0;
      const Scalar multiplier =
          is_fraction ? Scalar(1 + random_index(4, random)) / Scalar(-1 - random_index(5, random))
                      : random_number(-2, 2, random);
      robot.couplings[last - 1] = {0, multiplier, random_number(-1, 1, random)};
    } while (robot.lower()[0] > robot.upper()[0]);
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
        EXPECT_TRUE(robot.is_within_limits(*pair.witness));
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
  const auto slide = [&](const char* name, Scalar x, Scalar lower) {
    return Joint{name,
                 JointType::Prismatic,
                 "palm",
                 name,
                 RigidPose(Vector3(x, 0, 0)),
                 Vector3::UnitX(),
                 lower,
                 0.1};
  };
  const auto robot_of = [&](Scalar multiplier) {
    Robot robot =
        make_robot("jaws", KinematicChain({{"palm"}, {"left", jaw}, {"right", jaw}},
                                          {slide("left", -0.05, 0), slide("right", 0.05, -0.1)}));
    robot.couplings[1] = {0, multiplier, 0};
    robot.free_joints.pop_back();
    return robot;
  };
  EXPECT_EQ(decide_link_pairs(robot_of(1))[0].verdict, PairVerdict::Never);
  const auto closing = decide_link_pairs(robot_of(-1));
  EXPECT_EQ(closing[0].verdict, PairVerdict::Can);
  EXPECT_GE((*closing[0].witness)[0], 0.04);
}

// Two hands of length 1 that turn without limits about parallel axes, the right one by
// multiplier f + offset. Where f = 0 the left one points to the right axis, the right one away.
Robot two_hands(Scalar distance, Scalar multiplier, Scalar offset) {
  std::vector<Vector3> corners = box_mesh(Vector3(0.5, 0.05, 0.05)).vertices;
  for (Vector3& corner : corners) corner.x() += 0.5;
  const auto hand = std::make_shared<ConvexHull>(corners);
  const auto turn = [](const char* name, Scalar x) {
    return Joint{name, JointType::Revolute, "root", name, RigidPose(Vector3(x, 0, 0))};
  };
  Robot robot = make_robot("clock", KinematicChain({{"root"}, {"left", hand}, {"right", hand}},
                                                   {turn("left", 0), turn("right", distance)}));
  robot.couplings[1] = {0, multiplier, offset};
  robot.free_joints.pop_back();
  return robot;
}

TEST(LinkPairs, TurnsWithoutLimitsFollowOneAnother) {
  for (const Scalar multiplier : {1.0, -1.0, 2.0, 0.5, 1.0 / 3, 0.3, std::sqrt(0.5)}) {
    const LinkPairReport apart = decide_link_pairs(two_hands(2.2, multiplier, 0))[0];
    EXPECT_EQ(apart.verdict, PairVerdict::Never) << multiplier;
    EXPECT_EQ(apart.joints, 1u);
  }
  // The hands meet where both point at each other: f = 2 pi k and multiplier f + offset = pi.
  EXPECT_EQ(decide_link_pairs(two_hands(1.8, 1, 0))[0].verdict, PairVerdict::Never);
  EXPECT_EQ(decide_link_pairs(two_hands(1.8, 1, kPi))[0].verdict, PairVerdict::Can);
  const LinkPairReport later = decide_link_pairs(two_hands(1.8, 0.5, 0))[0];
  ASSERT_EQ(later.verdict, PairVerdict::Can);  // in the second turn
  EXPECT_NEAR(std::abs((*later.witness)[0]), 2 * kPi, 0.5);
  EXPECT_EQ(decide_link_pairs(two_hands(1.8, 0.5, kPi / 2))[0].verdict, PairVerdict::Never);
  EXPECT_EQ(decide_link_pairs(two_hands(1.8, 1.0 / 3, 0))[0].verdict, PairVerdict::Never);
  EXPECT_EQ(decide_link_pairs(two_hands(1.8, 0.3, 0))[0].verdict, PairVerdict::Can);  // 10 turns
  // Never back: they come as near to every pair of angles as wanted, so that no proof is true.
  const Robot dense = two_hands(1.5, std::sqrt(0.5), 0);
  const LinkPairReport found = decide_link_pairs(dense)[0];
  ASSERT_EQ(found.verdict, PairVerdict::Can);
  const std::vector<RigidPose> X_WL = dense.chain->link_poses(dense.expand(*found.witness));
  const std::span<const Link> links = dense.chain->links();
  EXPECT_EQ(distance(*links[1].shape, X_WL[1], *links[2].shape, X_WL[2]).lower, 0);
  const LinkPairReport unseen =
      decide_link_pairs(two_hands(1.8, std::sqrt(0.5), 0), {.samples = 0})[0];
  EXPECT_NE(unseen.verdict, PairVerdict::Never);
  EXPECT_EQ(unseen.undecided_share, unseen.verdict == PairVerdict::Undecided ? 1 : 0);
}

// What a mimicking joint moves changes nothing for the links that it does not move.
TEST(LinkPairs, OfAMimickedJointAreAsWithoutTheMimic) {
  const auto wheel = std::make_shared<Cylinder>(0.1, 0.02);
  const auto robot_of = [&](std::optional<Scalar> multiplier) {
    const auto axle = [](const char* name, Scalar y) {
      return Joint{name, JointType::Revolute, "base", name,
                   RigidPose(Quaternion(std::sqrt(0.5), -std::sqrt(0.5), 0, 0), Vector3(0, y, 0))};
    };
    const auto body = std::make_shared<Box>(Vector3(0.2, 0.15, 0.05));
    Robot robot = make_robot("cart", KinematicChain({{"base", body}, {"l", wheel}, {"r", wheel}},
                                                    {axle("l", 0.2), axle("r", -0.2)}));
    if (!multiplier) return robot;
    robot.couplings[1] = {0, *multiplier, 0};
    robot.free_joints.pop_back();
    return robot;
  };
  const auto free = decide_link_pairs(robot_of({}));
  for (const Scalar multiplier : {1.0, -1.0, 2.0, 0.5, 0.123}) {
    const auto pairs = decide_link_pairs(robot_of(multiplier));
    ASSERT_EQ(pairs.size(), 3u);
    for (const LinkPairReport& pair : pairs) EXPECT_EQ(pair.verdict, PairVerdict::Never);
    EXPECT_EQ(pairs[0].boxes, free[0].boxes);
    EXPECT_EQ(pairs[1].boxes, free[1].boxes);
  }
}

TEST(LinkPairs, KeepToTheLimitsOfMimickingJoints) {
  const auto cube = std::make_shared<Box>(Vector3(0.1, 0.1, 0.1));
  const auto robot_of = [&](Scalar upper) {
    const Joint aside{"j", JointType::Prismatic, "a", "m", {}, Vector3::UnitY(), 0, 1};
    const Joint nearer{
        "k",  JointType::Prismatic, "a", "b", RigidPose(Vector3(1, 0, 0)), -Vector3::UnitX(), 0,
        upper};
    Robot robot =
        make_robot("r", KinematicChain({{"a", cube}, {"m"}, {"b", cube}}, {aside, nearer}));
    robot.couplings[1] = {0, 2, 0.1};
    robot.free_joints.pop_back();
    return robot;
  };
  const Robot near = robot_of(0.79);  // b comes up to 0.01 near
  EXPECT_EQ(near.lower()[0], 0);
  EXPECT_NEAR(near.upper()[0], 0.345, 1e-15);
  EXPECT_TRUE(near.is_within_limits(near.upper()));
  EXPECT_FALSE(near.is_within_limits(JointVector(near.upper().array() + 1e-12)));
  EXPECT_EQ(decide_link_pairs(near)[0].verdict, PairVerdict::Never);
  const Robot touching = robot_of(0.81);
  const LinkPairReport pair = decide_link_pairs(touching)[0];
  ASSERT_EQ(pair.verdict, PairVerdict::Can);
  EXPECT_TRUE(touching.is_within_limits(*pair.witness));
  const std::string message = message_of([&] { decide_link_pairs(robot_of(0.05)); });
  EXPECT_NE(message.find("'j'"), std::string::npos) << message;
}

TEST(Robot, LimitsOfWhatMimicsHoldWhatItMimics) {
  std::mt19937_64 random(5);
  for (int round = 0; round < 20'000; ++round) {
    const CoordinateCoupling coupling{
        0, random_number(-3, 3, random) * std::pow(10, random_index(9, random) - 4),
        random_number(-1, 1, random) * std::pow(10, random_index(9, random) - 4)};
    const Scalar lower = random_number(-2, 2, random);
    const Scalar upper = lower + random_number(0.1, 2, random);
    const auto [low, high] = coupling.free_limits(lower, upper);
    const auto is_within = [&](Scalar free) {
      const Scalar q = coupling.multiplier * free + coupling.offset;
      return lower <= q && q <= upper;
    };
    EXPECT_TRUE(is_within(low) && is_within(high)) << low << ' ' << high;
    const Scalar noise = 1e-12 * (high - low) + 1e-14 * (std::abs(low) + std::abs(high));
    EXPECT_FALSE(is_within(low - noise) || is_within(high + noise)) << low << ' ' << high;
  }
  const auto [low, high] = CoordinateCoupling{0, 0, 3}.free_limits(1, 2);
  EXPECT_GT(low, high);
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
