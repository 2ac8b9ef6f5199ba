// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/adapters/moveit_collision_env.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <set>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "adapters/pose_at.h"
#include "dyop/adapters/host_geometry.h"
#include "dyop/adapters/moveit_chain.h"
#include "dyop/adapters/moveit_shapes.h"
#include "dyop/distance/distance.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using adapters::MoveitChain;
using adapters::MoveitCollisionDetectorAllocator;
using adapters::MoveitCollisionEnv;
using adapters::MoveitPath;
using collision_detection::AllowedCollisionMatrix;
using collision_detection::BodyType;
using collision_detection::CollisionRequest;
using collision_detection::CollisionResult;
using collision_detection::DistanceRequest;
using moveit::core::LinkModel;
using moveit::core::RobotModel;
using moveit::core::RobotState;
using testing::at;
using testing::kNaN;
using testing::message_of;

std::shared_ptr<shapes::Box> box(double x, double y, double z) {
  return std::make_shared<shapes::Box>(x, y, z);
}

template <typename Model>
std::unique_ptr<Model> joint(const std::string& name, const Vector3& axis = Vector3::UnitZ()) {
  auto model = std::make_unique<Model>(name);
  if constexpr (requires { model->setAxis(axis); }) model->setAxis(axis);
  return model;
}

/// A post at the origin, an arm that turns about it, and a hand that turns at the arm's end. The
/// arm reaches from x = 0.2 to x = 1, the hand from there to x = 1.5.
struct Arm {
  std::shared_ptr<RobotModel> model = std::make_shared<RobotModel>();
  const LinkModel* post =
      model->stub_add("post", nullptr, joint<moveit::core::FixedJointModel>("ground"), at(0, 0, 0),
                      {std::make_shared<shapes::Cylinder>(0.1, 1)}, {at(0, 0, 0)});
  const LinkModel* arm =
      model->stub_add("arm", post, joint<moveit::core::RevoluteJointModel>("shoulder"), at(0, 0, 0),
                      {box(0.8, 0.1, 0.1)}, {at(0.6, 0, 0)});
  const LinkModel* hand =
      model->stub_add("hand", arm, joint<moveit::core::RevoluteJointModel>("elbow"), at(1, 0, 0),
                      {box(0.5, 0.1, 0.1)}, {at(0.25, 0, 0)});

  Arm() {
    neighbours.setEntry("post", "arm", true);
    neighbours.setEntry("arm", "hand", true);
  }

  RobotState state(double shoulder, double elbow = 0) const {
    RobotState result(model);
    result.setVariablePosition(0, shoulder);
    result.setVariablePosition(1, elbow);
    result.update();
    return result;
  }

  AllowedCollisionMatrix neighbours;
};

CollisionResult check(const MoveitCollisionEnv& env, const RobotState& state,
                      const AllowedCollisionMatrix& acm, const CollisionRequest& request = {}) {
  CollisionResult result;
  env.checkRobotCollision(request, result, state, acm);
  return result;
}
CollisionResult check(const MoveitCollisionEnv& env, const RobotState& from, const RobotState& to,
                      const AllowedCollisionMatrix& acm, const CollisionRequest& request = {}) {
  CollisionResult result;
  env.checkRobotCollision(request, result, from, to, acm);
  return result;
}

CollisionRequest with_contacts(std::size_t count = 1, std::size_t per_pair = 1) {
  CollisionRequest request;
  request.contacts = true;
  request.max_contacts = count;
  request.max_contacts_per_pair = per_pair;
  return request;
}

bool has_error(const std::string& text) {
  for (const std::string& error : rclcpp::stub::errors()) {
    if (error.find(text) != std::string::npos) return true;
  }
  return false;
}

TEST(MoveitCollisionEnv, FindsAThinWallBetweenTwoFreeStates) {
  const Arm robot;
  MoveitCollisionEnv env(robot.model);
  env.getWorld()->addToObject("wall", box(0.1, 1e-4, 1), at(1.2, 0, 0));
  const RobotState from = robot.state(-0.7);
  const RobotState to = robot.state(0.6);
  EXPECT_FALSE(check(env, from, robot.neighbours).collision);
  EXPECT_FALSE(check(env, to, robot.neighbours).collision);
  const CollisionResult found = check(env, from, to, robot.neighbours, with_contacts());
  ASSERT_TRUE(found.collision);
  ASSERT_EQ(found.contact_count, 1U);
  const auto& contact = found.contacts.at({"hand", "wall"}).front();
  EXPECT_EQ(contact.body_type_1, BodyType::ROBOT_LINK);
  EXPECT_EQ(contact.body_type_2, BodyType::WORLD_OBJECT);
  // The hand's side meets the inner edge of the wall at (1.15, 0): asin(0.05 / 1.15) before y = 0.
  const double expected = (0.7 - std::asin((0.05 + 5e-5) / 1.15)) / 1.3;
  EXPECT_NEAR(contact.percent_interpolation, expected, 1e-3);
  EXPECT_NEAR(contact.normal.norm(), 1, 1e-12);
  EXPECT_GT(contact.normal.y(), 0.9);
  EXPECT_NEAR(contact.depth, 0, 1e-5);
  EXPECT_NEAR(contact.pos.y(), 0, 1e-3);
  env.getWorld()->removeObject("wall");
  EXPECT_FALSE(check(env, from, to, robot.neighbours).collision);
}

TEST(MoveitCollisionEnv, IsFreeUpToTheFirstContactAsSingleStatesAre) {
  const Arm robot;
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> number(-1, 1);
  int hits = 0;
  for (int run = 0; run < 60; ++run) {
    SCOPED_TRACE(run);
    MoveitCollisionEnv env(robot.model, 0.02);
    env.getWorld()->addToObject("ball", std::make_shared<shapes::Sphere>(0.1),
                                at(number(random) + 0.8, number(random), 0.1 * number(random)));
    const RobotState from = robot.state(number(random), number(random));
    const RobotState to = robot.state(2 * number(random), 2 * number(random));
    const CollisionResult found = check(env, from, to, robot.neighbours, with_contacts());
    double first = 1;
    if (found.collision) {
      first = found.contacts.begin()->second.front().percent_interpolation;
      ++hits;
    }
    RobotState between(from);
    for (int k = 0; k <= 200; ++k) {
      const double t = first * k / 200 - 1e-6;
      if (t < 0) continue;
      from.interpolate(to, t, between);
      between.update();
      EXPECT_FALSE(check(env, between, robot.neighbours).collision) << t;
    }
  }
  EXPECT_GT(hits, 10);
  EXPECT_LT(hits, 50);
}

TEST(MoveitCollisionEnv, LeavesOutWhatTheMatrixAllows) {
  const Arm robot;
  MoveitCollisionEnv env(robot.model);
  env.getWorld()->addToObject("wall", box(0.1, 0.01, 1), at(1.2, 0, 0));
  AllowedCollisionMatrix acm = robot.neighbours;
  acm.setEntry("hand", "wall", true);
  EXPECT_FALSE(check(env, robot.state(0), acm).collision);
  EXPECT_FALSE(check(env, robot.state(-0.6), robot.state(0.6), acm).collision);
  int asked = 0;
  bool answer = true;
  collision_detection::DecideContactFn decide = [&](collision_detection::Contact& contact) {
    EXPECT_EQ(contact.body_name_2, "wall");
    ++asked;
    return answer;
  };
  acm.setEntry("hand", "wall", decide);
  EXPECT_FALSE(check(env, robot.state(0), acm).collision);
  EXPECT_GT(asked, 0);
  answer = false;
  EXPECT_TRUE(check(env, robot.state(0), acm).collision);
  answer = true;  // the rest of the way would stay undecided
  EXPECT_TRUE(check(env, robot.state(-0.6), robot.state(0.6), acm).collision);
}

TEST(MoveitCollisionEnv, PadsExactlyAndScales) {
  const Arm robot;
  MoveitCollisionEnv env(robot.model);
  env.getWorld()->addToObject("wall", box(1, 0.1, 1), at(1, 0.3, 0));  // from y = 0.25
  const RobotState state = robot.state(0);
  EXPECT_NEAR(env.distanceRobot(state), 0.2, 1e-12);
  env.setLinkPadding("hand", 0.05);
  EXPECT_NEAR(env.distanceRobot(state), 0.15, 1e-12);
  env.setLinkPadding("hand", 0.199);
  EXPECT_FALSE(check(env, state, robot.neighbours).collision);
  EXPECT_FALSE(check(env, state, state, robot.neighbours).collision);
  env.setLinkPadding("hand", 0.201);
  const CollisionResult found = check(env, state, robot.neighbours, with_contacts());
  ASSERT_TRUE(found.collision);
  EXPECT_NEAR(found.contacts.at({"hand", "wall"}).front().depth, 0.001, 1e-9);
  EXPECT_TRUE(check(env, state, state, robot.neighbours).collision);
  env.setLinkPadding("hand", 0);
  env.setLinkScale("hand", 2);  // from y = -0.1 to 0.1
  EXPECT_NEAR(env.distanceRobot(state), 0.15, 1e-12);
}

TEST(MoveitCollisionEnv, DistancesAreThoseOfDyop) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> number(-1, 1);
  const auto pose = [&] {
    Eigen::Isometry3d X = at(2 * number(random), 2 * number(random), 2 * number(random));
    X.linear() = Eigen::Quaterniond(number(random), number(random), number(random), 0.3)
                     .normalized()
                     .toRotationMatrix();
    return X;
  };
  const std::vector<shapes::ShapeConstPtr> kinds{
      box(0.4, 0.6, 1), std::make_shared<shapes::Sphere>(0.4),
      std::make_shared<shapes::Cylinder>(0.3, 0.9), std::make_shared<shapes::Cone>(0.4, 0.8),
      std::make_shared<shapes::Plane>(1, 2, 2, 12)};
  for (const shapes::ShapeConstPtr& a : kinds) {
    if (a->type == shapes::PLANE) continue;
    for (const shapes::ShapeConstPtr& b : kinds) {
      auto model = std::make_shared<RobotModel>();
      const Eigen::Isometry3d X_WA = pose();
      const Eigen::Isometry3d X_WB = pose();
      model->stub_add("link", nullptr, joint<moveit::core::FixedJointModel>("ground"), X_WA, {a},
                      {at(0, 0, 0)});
      MoveitCollisionEnv env(model);
      env.getWorld()->addToObject("object", b, X_WB);
      RobotState state(model);
      state.update();
      const DistanceResult expected = distance(*adapters::moveit_shape(*a), adapters::pose_of(X_WA),
                                               *adapters::moveit_shape(*b), adapters::pose_of(X_WB),
                                               {.with_penetration = true});
      DistanceRequest request;
      request.enable_signed_distance = true;
      collision_detection::DistanceResult found;
      env.distanceRobot(request, found, state);
      const double depth = expected.penetration ? expected.penetration->depth : 0;
      EXPECT_NEAR(found.minimum_distance.distance, expected.lower - depth, 1e-9);
      EXPECT_EQ(found.collision, expected.lower == 0);
      EXPECT_EQ(check(env, state, {}).collision, expected.lower == 0);
      const double length =
          (found.minimum_distance.nearest_points[1] - found.minimum_distance.nearest_points[0])
              .norm();
      if (!found.collision) {
        EXPECT_NEAR(length, expected.lower, 1e-9);
      }
    }
  }
}

TEST(MoveitCollisionEnv, AnswersEveryTypeOfDistanceRequest) {
  using namespace collision_detection::DistanceRequestTypes;
  const Arm robot;
  MoveitCollisionEnv env(robot.model);
  env.getWorld()->addToObject("near", std::make_shared<shapes::Sphere>(0.1), at(1.3, 0.4, 0));
  env.getWorld()->addToObject("far", std::make_shared<shapes::Sphere>(0.1), at(0.5, -2, 0));
  const RobotState state = robot.state(0);
  for (const auto type : {GLOBAL, SINGLE, LIMITED, ALL}) {
    DistanceRequest request;
    request.type = type;
    request.distance_threshold = 0.7;
    collision_detection::DistanceResult found;
    env.distanceRobot(request, found, state);
    EXPECT_NEAR(found.minimum_distance.distance, 0.25, 1e-12);
    EXPECT_EQ(found.minimum_distance.link_names[0], "hand");
    EXPECT_EQ(found.minimum_distance.link_names[1], "near");
    EXPECT_FALSE(found.collision);
    EXPECT_EQ(found.distances.size(), type == GLOBAL ? 0U : 2U);  // also the arm and "near"
  }
  CollisionRequest request;
  request.distance = true;
  request.detailed_distance = true;
  const CollisionResult found = check(env, state, robot.neighbours, request);
  EXPECT_NEAR(found.distance, 0.25, 1e-12);
  EXPECT_EQ(found.distance_result.minimum_distance.link_names[1], "near");
  // On the way the hand only moves away from the ball at (1.3, 0.4).
  const double least = check(env, state, robot.state(-0.5), robot.neighbours, request).distance;
  EXPECT_LE(least, 0.25);
  EXPECT_NEAR(least, 0.25, 0.01);
}

TEST(MoveitCollisionEnv, FindsALinkAgainstItselfOnTheWay) {
  const Arm robot;
  const MoveitCollisionEnv env(robot.model);
  const double kPi = std::numbers::pi;
  // The hand turns all the way round the elbow; near pi it lies on the arm. Only the post is far.
  auto model = std::make_shared<RobotModel>();
  const LinkModel* post =
      model->stub_add("post", nullptr, joint<moveit::core::FixedJointModel>("ground"), at(3, 0, 0),
                      {box(0.2, 0.2, 1)}, {at(0, 0, 0)});
  const LinkModel* arm =
      model->stub_add("arm", post, joint<moveit::core::RevoluteJointModel>("shoulder"), at(0, 0, 0),
                      {box(0.8, 0.1, 0.1)}, {at(0.6, 0, 0.2)});
  model->stub_add("hand", arm, joint<moveit::core::RevoluteJointModel>("elbow"), at(1, 0, 0),
                  {box(1.2, 0.1, 0.1)}, {at(0.6, 0, 0)});
  const MoveitCollisionEnv long_hand(model);
  AllowedCollisionMatrix acm = robot.neighbours;
  const auto state = [&](double elbow) {
    RobotState result(model);
    result.setVariablePosition(1, elbow);
    result.update();
    return result;
  };
  CollisionResult begin;
  CollisionResult end;
  long_hand.checkSelfCollision({}, begin, state(kPi - 0.7), acm);
  long_hand.checkSelfCollision({}, end, state(kPi + 0.7), acm);
  EXPECT_FALSE(begin.collision);
  EXPECT_FALSE(end.collision);
  const CollisionResult found =
      check(long_hand, state(kPi - 0.7), state(kPi + 0.7), acm, with_contacts());
  ASSERT_TRUE(found.collision);
  const auto& contact = found.contacts.at({"hand", "post"}).front();
  EXPECT_GT(contact.percent_interpolation, 0.3);
  EXPECT_LT(contact.percent_interpolation, 0.5);
  EXPECT_NEAR(contact.pos.x(), 3, 0.15);  // in the world, not in the frame of the query
  // Without a matrix neighbours would always touch: the robot itself is left out.
  CollisionResult world_only;
  long_hand.checkRobotCollision({}, world_only, state(kPi - 0.7), state(kPi + 0.7));
  EXPECT_FALSE(world_only.collision);
  CollisionResult touching;
  env.checkSelfCollision({}, touching, robot.state(0));
  EXPECT_TRUE(touching.collision);
  EXPECT_NEAR(env.distanceSelf(robot.state(0)), 0, 1e-12);
}

TEST(MoveitCollisionEnv, TakesAttachedBodiesAlong) {
  const Arm robot;
  MoveitCollisionEnv env(robot.model);
  env.getWorld()->addToObject("wall", box(0.1, 1e-3, 1), at(1.8, 0, 0));
  EXPECT_FALSE(check(env, robot.state(-0.5), robot.state(0.5), robot.neighbours).collision);
  const auto attach = [&](std::set<std::string> touch_links) {
    RobotState state = robot.state(-0.5);
    state.attachBody(std::make_unique<moveit::core::AttachedBody>(
        robot.hand, "cup", at(0.5, 0, 0),
        std::vector<shapes::ShapeConstPtr>{std::make_shared<shapes::Cylinder>(0.05, 0.6)},
        EigenSTL::vector_Isometry3d{at(0.2, 0, 0) *
                                    Eigen::AngleAxisd(std::numbers::pi / 2, Vector3::UnitY())},
        std::move(touch_links)));
    state.update();
    return state;
  };
  const CollisionResult found =
      check(env, attach({"hand"}), robot.state(0.5), robot.neighbours, with_contacts());
  ASSERT_TRUE(found.collision);
  const auto& contact = found.contacts.at({"cup", "wall"}).front();
  EXPECT_EQ(contact.body_type_1, BodyType::ROBOT_ATTACHED);
  EXPECT_GT(contact.percent_interpolation, 0.3);
  CollisionResult self;
  env.checkSelfCollision(with_contacts(), self, attach({}), robot.neighbours);
  EXPECT_TRUE(self.contacts.contains({"cup", "hand"}));
  CollisionResult touching;
  env.checkSelfCollision(with_contacts(), touching, attach({"hand"}), robot.neighbours);
  EXPECT_FALSE(touching.collision);
}

TEST(MoveitCollisionEnv, KeepsTheLimitsOfTheRequest) {
  const Arm robot;
  MoveitCollisionEnv env(robot.model, 0.02);  // boxes are within the padding
  for (int k = 0; k < 4; ++k)
    env.getWorld()->addToObject("box" + std::to_string(k), box(0.05, 0.05, 0.05),
                                at(0.4 + 0.3 * k, 0.085, 0));
  const RobotState state = robot.state(0);
  EXPECT_EQ(check(env, state, robot.neighbours).contact_count, 0U);
  EXPECT_EQ(check(env, state, robot.neighbours, with_contacts(3)).contact_count, 3U);
  EXPECT_EQ(check(env, state, robot.neighbours, with_contacts(100)).contact_count, 5U);
  EXPECT_GT(check(env, state, robot.neighbours, with_contacts(100, 3)).contact_count, 5U);
  for (const auto& [pair, contacts] :
       check(env, state, robot.neighbours, with_contacts(100, 3)).contacts)
    EXPECT_LE(contacts.size(), 3U);
  CollisionRequest cost;
  cost.cost = true;
  cost.max_cost_sources = 2;
  const CollisionResult costly = check(env, state, robot.neighbours, cost);
  EXPECT_EQ(costly.cost_sources.size(), 2U);
  EXPECT_LE(costly.cost_sources.begin()->aabb_max[0] - costly.cost_sources.begin()->aabb_min[0],
            0.05 + 1e-12);
  CollisionRequest patient = with_contacts(100);
  patient.is_done = [](const CollisionResult& result) { return result.contact_count >= 2; };
  EXPECT_EQ(check(env, state, robot.neighbours, patient).contact_count, 2U);
  // Only the hand is in the group: it touches the last two boxes.
  robot.model->stub_group("tool").stub_add(robot.hand);
  CollisionRequest group = with_contacts(100);
  group.group_name = "tool";
  EXPECT_EQ(check(env, state, robot.neighbours, group).contact_count, 2U);
  // On a way the earliest comes first.
  const CollisionResult sweep =
      check(env, robot.state(-0.5), robot.state(0.5), robot.neighbours, with_contacts(100));
  EXPECT_GE(sweep.contact_count, 4U);
  const CollisionResult first =
      check(env, robot.state(-0.5), robot.state(0.5), robot.neighbours, with_contacts(1));
  ASSERT_EQ(first.contact_count, 1U);
  double least = 1;
  for (const auto& [pair, contacts] : sweep.contacts)
    least = std::min(least, contacts.front().percent_interpolation);
  EXPECT_EQ(first.contacts.begin()->second.front().percent_interpolation, least);
}

TEST(MoveitCollisionEnv, CallsNothingFreeThatItCannotDecide) {
  const Arm robot;
  const RobotState from = robot.state(-0.3);
  const RobotState to = robot.state(0.3);
  struct Unknown : shapes::Shape {};
  const std::vector<std::pair<shapes::ShapeConstPtr, Eigen::Isometry3d>> rubbish{
      {std::make_shared<Unknown>(), at(9, 9, 9)},
      {std::make_shared<shapes::Sphere>(kNaN), at(9, 9, 9)},
      {std::make_shared<shapes::Mesh>(1, 0), at(9, 9, 9)},
      {nullptr, at(9, 9, 9)},
      {std::make_shared<shapes::Plane>(0, 0, 0, 1), at(9, 9, 9)},
      {box(1, 1, 1), at(kNaN, 9, 9)}};
  for (const auto& [shape, pose] : rubbish) {
    rclcpp::stub::errors().clear();
    MoveitCollisionEnv env(robot.model);
    env.getWorld()->addToObject("thing", shape, pose);
    EXPECT_TRUE(check(env, from, robot.neighbours).collision);
    EXPECT_TRUE(has_error("\"thing\""));
    rclcpp::stub::errors().clear();
    const CollisionResult found = check(env, from, to, robot.neighbours, with_contacts());
    EXPECT_TRUE(found.collision);
    EXPECT_EQ(found.contact_count, 1U);
    EXPECT_TRUE(has_error("\"thing\""));
    EXPECT_LE(env.distanceRobot(from), 0);
    CollisionResult self;
    env.checkSelfCollision({}, self, from, robot.neighbours);
    EXPECT_FALSE(self.collision);
  }
  rclcpp::stub::errors().clear();
  const MoveitCollisionEnv env(robot.model);
  RobotState stale(robot.model);
  EXPECT_TRUE(check(env, stale, robot.neighbours).collision);
  EXPECT_TRUE(has_error("update()"));
  rclcpp::stub::errors().clear();
  EXPECT_TRUE(check(env, from, stale, robot.neighbours).collision);
  EXPECT_TRUE(has_error("update()"));
  EXPECT_LE(env.distanceRobot(stale), 0);
  EXPECT_TRUE(check(env, from, robot.state(kNaN), robot.neighbours).collision);
  EXPECT_TRUE(has_error("\"shoulder\""));
  RobotState warped = robot.state(0.3);
  warped.updateStateWithLinkAt(robot.hand, at(5, 5, 5));
  EXPECT_TRUE(check(env, from, warped, robot.neighbours).collision);
  EXPECT_TRUE(has_error("link \"hand\""));
}

// So far from the origin numbers are too coarse for the tolerance.
TEST(MoveitCollisionEnv, CallsNothingFreeThatRoundingHides) {
  const double far = 1e10;
  auto model = std::make_shared<RobotModel>();
  const LinkModel* rail = model->stub_add(
      "rail", nullptr, joint<moveit::core::FixedJointModel>("ground"), at(far, 0, 0), {}, {});
  model->stub_add("cart", rail, joint<moveit::core::PrismaticJointModel>("drive", Vector3::UnitX()),
                  at(0, 0, 0), {std::make_shared<shapes::Sphere>(0.1)}, {at(0, 0, 0)});
  MoveitCollisionEnv env(model);
  env.getWorld()->addToObject("wall", box(1e-4, 1, 1), at(far, 0, 0));
  RobotState from(model);
  from.setVariablePosition(0, -1);
  from.update();
  RobotState to(model);
  to.setVariablePosition(0, 1);
  to.update();
  rclcpp::stub::errors().clear();
  EXPECT_TRUE(check(env, from, to, {}, with_contacts()).collision);
  EXPECT_TRUE(has_error("could not decide whether \"cart\" and \"wall\" collide"));
}

/// Every kind of joint that a chain can have, one that mimics and one that turns without end, on a
/// base of the kind given.
template <typename Base>
std::shared_ptr<RobotModel> tree(std::mt19937_64& random) {
  std::uniform_real_distribution<double> number(-1, 1);
  const auto vector = [&] { return Vector3(number(random), number(random), number(random)); };
  const auto pose = [&] {
    Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
    X.translation() = vector();
    X.linear() = rotation_from_vector(vector());
    return X;
  };
  auto model = std::make_shared<RobotModel>();
  const auto add = [&](const std::string& name, const LinkModel* parent, auto made) {
    return model->stub_add(name, parent, std::move(made), pose(), {box(0.1, 0.1, 0.1)}, {pose()});
  };
  const LinkModel* root = add("root", nullptr, joint<Base>("base"));
  auto endless = joint<moveit::core::RevoluteJointModel>("endless", vector());
  endless->setContinuous(true);
  const LinkModel* a = add("a", root, std::move(endless));
  const LinkModel* b = add("b", a, joint<moveit::core::PrismaticJointModel>("slide", vector()));
  const LinkModel* c = add("c", b, joint<moveit::core::FixedJointModel>("weld"));
  auto leader = joint<moveit::core::RevoluteJointModel>("leader", vector());
  auto follower = joint<moveit::core::RevoluteJointModel>("follower", vector());
  follower->setMimic(leader.get(), -1.5, 0.25);
  add("d", c, std::move(leader));
  add("e", root, std::move(follower));
  return model;
}

template <typename Base>
class MoveitChainOn : public ::testing::Test {};
using Bases = ::testing::Types<moveit::core::FixedJointModel, moveit::core::FloatingJointModel,
                               moveit::core::PlanarJointModel>;
TYPED_TEST_SUITE(MoveitChainOn, Bases);

TYPED_TEST(MoveitChainOn, MovesAsMoveitInterpolates) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> number(-1, 1);
  for (int run = 0; run < 20; ++run) {
    const std::shared_ptr<RobotModel> model = tree<TypeParam>(random);
    const MoveitChain chain(*model);
    const auto random_state = [&] {
      RobotState state(model);
      for (int k = 0; k < int(model->getVariableCount()); ++k)
        state.setVariablePosition(k, std::numbers::pi * number(random));
      if (std::is_same_v<TypeParam, moveit::core::FloatingJointModel>) {
        const Quaternion q(rotation_from_vector(
            Vector3(2 * number(random), 2 * number(random), 2 * number(random))));
        for (int k = 0; k < 4; ++k) state.setVariablePosition(3 + k, q.coeffs()[k]);
      }
      state.update();
      return state;
    };
    const RobotState from = random_state();
    const RobotState to = random_state();
    const MoveitPath path = chain.path(from, to);
    RobotState between(from);
    for (int k = 0; k <= 16; ++k) {
      const double t = k / 16.0;
      from.interpolate(to, t, between);
      between.update();
      for (std::size_t link = 0; link < chain.chain().links().size(); ++link) {
        const Eigen::Isometry3d& expected =
            between.getGlobalLinkTransform(chain.chain().links()[link].name);
        const RigidPose X = path.link_motion(link)->pose(t);
        EXPECT_LE((X.translation() - expected.translation()).norm(), 1e-11);
        EXPECT_LE((X.rotation() - expected.linear()).norm(), 1e-11);
      }
    }
  }
}

TEST(MoveitChain, RefusesJointsThatItCannotFollow) {
  auto model = std::make_shared<RobotModel>();
  const LinkModel* root =
      model->stub_add("root", nullptr, joint<moveit::core::FixedJointModel>("ground"), at(0, 0, 0),
                      {box(1, 1, 1)}, {at(0, 0, 0)});
  model->stub_add("loose", root, joint<moveit::core::FloatingJointModel>("air"), at(3, 0, 0),
                  {box(1, 1, 1)}, {at(0, 0, 0)});
  RobotState state(model);
  state.update();
  EXPECT_NE(message_of([&] { MoveitChain(*model).path(state, state); }).find("\"air\""),
            std::string::npos);
  // Single states do not need a chain.
  const MoveitCollisionEnv env(model);
  EXPECT_FALSE(check(env, state, {}).collision);
  EXPECT_TRUE(check(env, state, state, {}).collision);

  auto car = std::make_shared<RobotModel>();
  auto wheels = joint<moveit::core::PlanarJointModel>("wheels");
  wheels->setMotionModel(moveit::core::PlanarJointModel::DIFF_DRIVE);
  car->stub_add("car", nullptr, std::move(wheels), at(0, 0, 0), {box(1, 1, 1)}, {at(0, 0, 0)});
  RobotState from(car);
  from.update();
  RobotState to(car);
  to.setVariablePosition(0, 1);
  to.update();
  EXPECT_NO_THROW(MoveitChain(*car).path(from, from));
  EXPECT_NE(message_of([&] { MoveitChain(*car).path(from, to); }).find("\"wheels\""),
            std::string::npos);
}

std::shared_ptr<shapes::Mesh> cube_mesh(double half, const Vector3& center) {
  auto mesh = std::make_shared<shapes::Mesh>(8, 12);
  for (unsigned k = 0; k < 8; ++k) {
    for (unsigned axis = 0; axis < 3; ++axis)
      mesh->vertices[3 * k + axis] = center[int(axis)] + ((k >> axis & 1U) != 0 ? half : -half);
  }
  const std::array<unsigned, 36> corners{0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                         2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  std::copy(corners.begin(), corners.end(), mesh->triangles);
  return mesh;
}

TEST(MoveitShapes, ConvertsMeshesPlanesAndOctrees) {
  const std::shared_ptr<const Shape> mesh =
      adapters::moveit_shape(*cube_mesh(0.5, Vector3(1, 2, 3)), 2);
  EXPECT_TRUE(adapters::is_closed_mesh(*mesh));
  EXPECT_TRUE(mesh->bounding_box().min().isApprox(Vector3(0, 1, 2), 1e-12));
  EXPECT_TRUE(mesh->bounding_box().max().isApprox(Vector3(2, 3, 4), 1e-12));
  const Sphere probe(0.5);
  // 2 z = 6, solid below.
  const std::shared_ptr<const Shape> plane = adapters::moveit_shape(shapes::Plane(0, 0, 2, -6));
  EXPECT_NEAR(distance(probe, RigidPose(Vector3(0, 0, 5)), *plane, RigidPose()).lower, 1.5, 1e-12);
  EXPECT_EQ(distance(probe, RigidPose(Vector3(0, 0, 1)), *plane, RigidPose()).lower, 0);
  auto tree = std::make_shared<octomap::OcTree>(0.5);
  EXPECT_EQ(adapters::moveit_shape(shapes::OcTree(tree)), nullptr);
  tree->updateNode(octomap::point3d(0.25F, 0.25F, 0.25F), true);
  tree->updateNode(octomap::point3d(2.25F, 0.25F, 0.25F), false);
  const std::shared_ptr<const Shape> leaves = adapters::moveit_shape(shapes::OcTree(tree));
  EXPECT_NEAR(distance(probe, RigidPose(Vector3(3, 0.25, 0.25)), *leaves, RigidPose()).lower, 2,
              1e-9);
}

TEST(MoveitCollisionEnv, TakesWhatIsInsideAClosedMeshForACollision) {
  const Arm robot;
  MoveitCollisionEnv env(robot.model);
  env.getWorld()->addToObject("room", cube_mesh(5, Vector3(0, 0, 0)), at(0, 0, 0));
  EXPECT_TRUE(check(env, robot.state(0), robot.neighbours).collision);
  EXPECT_TRUE(check(env, robot.state(0), robot.state(1), robot.neighbours).collision);
  env.getWorld()->removeObject("room");
  env.getWorld()->addToObject(
      "nothing", std::make_shared<shapes::OcTree>(std::make_shared<const octomap::OcTree>(0.1)),
      at(0, 0, 0));
  EXPECT_FALSE(check(env, robot.state(0), robot.state(1), robot.neighbours).collision);
}

TEST(MoveitCollisionDetectorAllocator, MakesEnvironments) {
  const Arm robot;
  const auto allocator = MoveitCollisionDetectorAllocator::create();
  EXPECT_EQ(allocator->getName(), "dyop");
  auto world = std::make_shared<collision_detection::World>();
  world->addToObject("wall", box(0.1, 0.01, 1), at(1.2, 0, 0));
  const auto env = allocator->allocateEnv(world, robot.model);
  env->setLinkPadding("hand", 0.01);
  CollisionResult found;
  env->checkRobotCollision({}, found, robot.state(-0.6), robot.state(0.6));
  EXPECT_TRUE(found.collision);
  const auto copy = allocator->allocateEnv(collision_detection::CollisionEnvConstPtr(env),
                                           std::make_shared<collision_detection::World>());
  EXPECT_EQ(copy->getLinkPadding("hand"), 0.01);
  CollisionResult free;
  copy->checkRobotCollision({}, free, robot.state(-0.6), robot.state(0.6));
  EXPECT_FALSE(free.collision);
}

}  // namespace
}  // namespace dyop
