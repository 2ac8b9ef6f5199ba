// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/ompl/ompl_motion_validator.h"

#include <gtest/gtest.h>
#include <ompl/base/DiscreteMotionValidator.h>
#include <ompl/base/ScopedState.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/base/spaces/SE3StateSpace.h>

#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>
#include <thread>

#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/primitives.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/arms.h"
#include "support/inputs/random_inputs.h"
#include "support/inputs/thin_wall.h"
#include "support/message_of.h"
#include "support/oracles/chain_oracle.h"

namespace dyop::testing {
namespace {

namespace ob = ompl::base;
using Se3 = ob::SE3StateSpace;

// A space of poses with x, y and z within `half`.
ob::SpaceInformationPtr pose_space(Scalar half = 1) {
  const auto space = std::make_shared<Se3>();
  ob::RealVectorBounds bounds(3);
  bounds.setLow(-half);
  bounds.setHigh(half);
  space->setBounds(bounds);
  const auto si = std::make_shared<ob::SpaceInformation>(space);
  si->setStateValidityChecker([](const ob::State*) { return true; });
  si->setup();
  return si;
}

ob::ScopedState<Se3> state_of(const ob::SpaceInformationPtr& si, const RigidPose& X) {
  ob::ScopedState<Se3> state(si);
  const Vector3& p = X.translation();
  state->setXYZ(p.x(), p.y(), p.z());
  const Quaternion q = X.quaternion().normalized();
  state->rotation().x = q.x();
  state->rotation().y = q.y();
  state->rotation().z = q.z();
  state->rotation().w = q.w();
  return state;
}

RigidPose pose_of(const ob::State* state) {
  const auto& pose = *state->as<Se3::StateType>();
  const auto& q = pose.rotation();
  return RigidPose(Quaternion(q.w, q.x, q.y, q.z).normalized(),
                   Vector3(pose.getX(), pose.getY(), pose.getZ()));
}

// Any shape against all obstacles at one pose, one by one.
Scalar gap_at(const Shape& body, const RigidPose& X_WB, const ObstacleSet& obstacles) {
  Scalar least = kInfinity;
  for (const ObstacleId id : obstacles.ids()) {
    const Obstacle& other = obstacles.obstacle(id);
    least = std::min(least, distance(body, X_WB, *other.shape, other.X_WO->pose(0)).lower);
  }
  return least;
}

// The least gap on the way between two states as OMPL interpolates, at steps of what the gap allows
// at the largest speed of any point, but of a two-thousandth at least.
Scalar least_gap(const ob::SpaceInformationPtr& si, const Shape& body, const ObstacleSet& obstacles,
                 const ob::State* from, const ob::State* to) {
  const RigidPose X0 = pose_of(from);
  const RigidPose X1 = pose_of(to);
  const Scalar turn = rotation_vector(X0.rotation().transpose() * X1.rotation()).norm();
  const Scalar speed = (X1.translation() - X0.translation()).norm() + turn * body.bounding_radius();
  ob::ScopedState<Se3> state(si);
  Scalar least = kInfinity;
  for (Scalar t = 0; t <= 1;) {
    si->getStateSpace()->interpolate(from, to, t, state.get());
    const Scalar gap = gap_at(body, pose_of(state.get()), obstacles);
    least = std::min(least, gap);
    if (gap == 0) return 0;
    t += std::max(gap / speed, 1 / 2000.0);
  }
  return least;
}

TEST(OmplMotionValidator, GivesTheTimeUpToWhichAFallIsFree) {
  const auto si = pose_space(10);
  auto obstacles = std::make_shared<ObstacleSet>();
  obstacles->add(std::make_shared<Sphere>(1), RigidPose());
  const OmplMotionValidator validator(si, std::make_shared<Sphere>(0.5), obstacles);
  const auto high = state_of(si, RigidPose(Vector3(0, 0, 4)));
  const auto low = state_of(si, RigidPose(Vector3(0, 0, -4)));
  EXPECT_FALSE(validator.checkMotion(high.get(), low.get()));
  ob::ScopedState<Se3> last(si);
  std::pair<ob::State*, double> valid(last.get(), -1);
  EXPECT_FALSE(validator.checkMotion(high.get(), low.get(), valid));
  EXPECT_NEAR(valid.second, 2.5 / 8, 1e-6);
  EXPECT_DOUBLE_EQ(last->getZ(), 4 - 8 * valid.second);
  // The time is that of the query, exactly, and a null state is not written to.
  const InterpolatedMotion fall({0, 1}, RigidPose(Vector3(0, 0, 4)), RigidPose(Vector3(0, 0, -4)));
  const ObstacleImpact impact = obstacles->first_impact(Sphere(0.5), fall, {0, 1});
  EXPECT_EQ(valid.second, impact.toi.t_safe);
  valid.first = nullptr;
  EXPECT_FALSE(validator.checkMotion(high.get(), low.get(), valid));
  // A valid motion leaves it alone.
  const auto side = state_of(si, RigidPose(Vector3(9, 0, 4)));
  valid.second = -1;
  EXPECT_TRUE(validator.checkMotion(high.get(), side.get(), valid));
  EXPECT_EQ(valid.second, -1);
  EXPECT_EQ(validator.getValidMotionCount(), 1u);
  EXPECT_EQ(validator.getInvalidMotionCount(), 3u);
}

TEST(OmplMotionValidator, KeepsTheClearanceInStatesAndMotions) {
  const auto si = pose_space(10);
  auto obstacles = std::make_shared<ObstacleSet>();
  obstacles->add(std::make_shared<Sphere>(1), RigidPose());
  OmplOptions options;
  options.clearance = 0.25;
  const OmplMotionValidator validator(si, std::make_shared<Sphere>(0.5), obstacles, options);
  const auto at = [&](Scalar x, Scalar y) { return state_of(si, RigidPose(Vector3(x, y, 0))); };
  EXPECT_TRUE(validator.is_valid(at(1.751, 0).get()));
  EXPECT_FALSE(validator.is_valid(at(1.749, 0).get()));
  EXPECT_TRUE(validator.checkMotion(at(1.751, -5).get(), at(1.751, 5).get()));
  EXPECT_FALSE(validator.checkMotion(at(1.749, -5).get(), at(1.749, 5).get()));
}

// The motion that is proven is the one that OMPL interpolates, half turns included.
TEST(OmplMotionValidator, ProvesTheArcThatOmplTakes) {
  std::mt19937_64 random(1);
  const auto si = pose_space(4);
  const auto ball = std::make_shared<Sphere>(0.1);
  // A ball far from the body's origin: where it goes depends on the arc.
  const auto body = std::make_shared<CompoundShape>(
      std::vector<CompoundChild>{{ball, RigidPose(Vector3(1, 0, 0))}});
  int blocked = 0;
  for (int i = 0; i < 300; ++i) {
    const RigidPose from = random_pose(1, random);
    const Scalar angle = i % 3 == 0 ? std::numbers::pi : random_number(0, std::numbers::pi, random);
    const RigidPose to(
        Matrix3(from.rotation() * rotation_from_vector(angle * random_direction(random))),
        random_vector(1, random));
    auto a = state_of(si, from), b = state_of(si, to);
    if (i % 2 == 0) {  // the same rotation
      auto& q = b->rotation();
      q.x = -q.x, q.y = -q.y, q.z = -q.z, q.w = -q.w;
    }
    const Scalar t = random_number(0.1, 0.9, random);
    ob::ScopedState<Se3> middle(si);
    si->getStateSpace()->interpolate(a.get(), b.get(), t, middle.get());
    auto obstacles = std::make_shared<ObstacleSet>();
    obstacles->add(ball, RigidPose(pose_of(middle.get()) * Vector3(1, 0, 0)));
    const OmplMotionValidator validator(si, body, obstacles);
    std::pair<ob::State*, double> last(nullptr, -1);
    ASSERT_FALSE(validator.checkMotion(a.get(), b.get(), last)) << i;
    ASSERT_LT(last.second, t);
    blocked += last.second > 0;
  }
  EXPECT_GT(blocked, 200);
}

// OMPL looks every 3.4 cm, a hundredth of the space's diagonal: before the wall, and behind it.
TEST(OmplMotionValidator, SeesTheWallThatTheDiscreteValidatorJumpsOver) {
  const auto si = pose_space();
  const auto obstacles = std::make_shared<ObstacleSet>(thin_wall());
  const OmplMotionValidator validator(si, piano(), obstacles);
  si->setStateValidityChecker([&](const ob::State* s) { return validator.is_valid(s); });
  si->setup();
  const Matrix3 across = rotation_from_vector(Vector3(0, 0, std::numbers::pi / 2));
  const auto a = state_of(si, RigidPose(across, Vector3(-0.5, 0.3, 0.3)));
  const auto b = state_of(si, RigidPose(across, Vector3(0.5, 0.3, 0.3)));
  EXPECT_TRUE(ob::DiscreteMotionValidator(si).checkMotion(a.get(), b.get()));
  std::pair<ob::State*, double> last(nullptr, 0);
  EXPECT_FALSE(validator.checkMotion(a.get(), b.get(), last));
  EXPECT_NEAR(last.second, 0.495, 1e-6);  // the wall's side less half the piano's depth
}

TEST(OmplMotionValidator, AcceptsNoMotionThroughAThinWall) {
  const auto si = pose_space();
  const auto obstacles = std::make_shared<ObstacleSet>(thin_wall());
  const auto body = piano();
  const OmplMotionValidator validator(si, body, obstacles);
  si->setStateValidityChecker([&](const ob::State* s) { return validator.is_valid(s); });
  si->setup();
  const ob::DiscreteMotionValidator discrete(si);
  std::mt19937_64 random(2);
  const char* const soak = std::getenv("DYOP_SOAK_EDGES");
  const int edge_count = soak ? std::atoi(soak) : 400;
  int accepted = 0, refused_although_free = 0, jumped = 0;
  for (int i = 0; i < edge_count; ++i) {
    const RigidPose from = random_pose(1, random);
    const Scalar turn = i % 2 == 0 ? 0.1 : 3;  // OMPL's steps are longest for those that turn least
    const Matrix3 R = from.rotation() * rotation_from_vector(random_vector(turn / 2, random));
    const auto a = state_of(si, from);
    const auto b = state_of(si, RigidPose(R, random_vector(1, random)));
    if (!validator.is_valid(a.get()) || !validator.is_valid(b.get())) continue;
    const bool is_valid = validator.checkMotion(a.get(), b.get());
    const Scalar least = least_gap(si, *body, *obstacles, a.get(), b.get());
    ASSERT_TRUE(!is_valid || least > 0) << i;
    accepted += is_valid;
    // The default tolerance is a millionth of the radius.
    refused_although_free += !is_valid && least > 1e-3;
    jumped += discrete.checkMotion(a.get(), b.get()) && least == 0;
  }
  EXPECT_GT(accepted, 20);
  EXPECT_EQ(refused_although_free, 0);
  EXPECT_GT(jumped, 0);
  std::printf("accepted %d; the discrete validator accepts %d that collide\n", accepted, jumped);
}

TEST(OmplMotionValidator, ValidatesAChain) {
  std::mt19937_64 random(3);
  const auto arm = std::make_shared<KinematicChain>(six_axis_arm());
  const auto obstacles = std::make_shared<ObstacleSet>(arm_surroundings(60, random));
  const auto space = std::make_shared<ob::RealVectorStateSpace>(6);
  space->setBounds(-3.2, 3.2);
  const auto si = std::make_shared<ob::SpaceInformation>(space);
  const OmplMotionValidator validator(si, arm, obstacles);
  ob::ScopedState<ob::RealVectorStateSpace> a(si), b(si), last(si);
  int free = 0, blocked = 0;
  for (int i = 0; i < 60; ++i) {
    const JointVector from = random_coordinates(*arm, random);
    const JointVector to = from + 0.2 * (random_coordinates(*arm, random) - from);
    std::copy(from.begin(), from.end(), a->values);
    std::copy(to.begin(), to.end(), b->values);
    const JointPath path = JointPath::linear(std::vector<Scalar>{0, 1}, std::vector{from, to});
    const auto gap = [&](Scalar t) { return oracle_gap(*arm, path, *obstacles, t, 1); };
    ASSERT_EQ(validator.is_valid(a.get()), gap(0) > 1e-5) << i;
    std::pair<ob::State*, double> valid(last.get(), 2);
    if (validator.checkMotion(a.get(), b.get(), valid)) {
      ++free;
      for (int k = 0; k <= 50; ++k) ASSERT_GT(gap(k / 50.0), 0);
      continue;
    }
    ++blocked;
    ASSERT_LE(gap(valid.second), 1e-5);
    const Eigen::Map<const JointVector> reached(last->values, 6);
    ASSERT_LT((reached - path.position(valid.second)).norm(), 1e-14);
  }
  EXPECT_GE(free, 10);
  EXPECT_GE(blocked, 10);
}

TEST(OmplMotionValidator, TakesMotionsOfTheCaller) {
  // Two balls that a line of one coordinate drives apart.
  const auto space = std::make_shared<ob::RealVectorStateSpace>(1);
  space->setBounds(-5, 5);
  const auto si = std::make_shared<ob::SpaceInformation>(space);
  const auto ball = std::make_shared<Sphere>(0.5);
  const auto bodies = [&](const ob::State* from, const ob::State* to) {
    const Scalar x0 = from->as<ob::RealVectorStateSpace::StateType>()->values[0];
    const Scalar x1 = to->as<ob::RealVectorStateSpace::StateType>()->values[0];
    std::vector<OmplMotionValidator::Body> result;
    for (const Scalar sign : {1.0, -2.0}) {
      result.push_back({ball, std::make_shared<ConstantTwistMotion>(
                                  RigidPose(Vector3(sign * x0, 0, 0)),
                                  Twist{{sign * (x1 - x0), 0, 0}, {0, 0, 0}})});
    }
    return result;
  };
  auto obstacles = std::make_shared<ObstacleSet>();
  obstacles->add(ball, RigidPose(Vector3(4, 0, 0)));
  obstacles->add(ball, RigidPose(Vector3(-4, 0, 0)));
  const OmplMotionValidator validator(si, bodies, obstacles);
  ob::ScopedState<ob::RealVectorStateSpace> a(si), b(si);
  a->values[0] = 0;
  b->values[0] = 3;
  std::pair<ob::State*, double> last(nullptr, 0);
  EXPECT_FALSE(validator.checkMotion(a.get(), b.get(), last));
  EXPECT_NEAR(last.second, 0.5, 1e-6);  // the second ball has gone 3
  b->values[0] = 1.4;
  EXPECT_TRUE(validator.checkMotion(a.get(), b.get()));
}

TEST(OmplMotionValidator, AnswersAlikeInManyThreads) {
  const auto si = pose_space();
  const auto obstacles = std::make_shared<ObstacleSet>(thin_wall());
  const OmplMotionValidator validator(si, piano(), obstacles);
  std::mt19937_64 random(4);
  std::vector<ob::ScopedState<Se3>> states;
  for (int i = 0; i < 200; ++i) states.push_back(state_of(si, random_pose(1, random)));
  const auto times = [&] {
    std::vector<double> result;
    for (std::size_t i = 0; i + 1 < states.size(); ++i) {
      std::pair<ob::State*, double> last(nullptr, 1);
      validator.checkMotion(states[i].get(), states[i + 1].get(), last);
      result.push_back(last.second);
    }
    return result;
  };
  const std::vector<double> alone = times();
  std::vector<std::vector<double>> found(4);
  {
    std::vector<std::jthread> threads;
    for (auto& each : found) threads.emplace_back([&each, &times] { each = times(); });
  }
  for (const auto& each : found) EXPECT_EQ(each, alone);
  EXPECT_EQ(validator.getCheckedMotionCount(), 5 * (states.size() - 1));
}

TEST(OmplMotionValidator, NamesWhatIsWrong) {
  const auto si = pose_space();
  const auto obstacles = std::make_shared<ObstacleSet>();
  const auto ball = std::make_shared<Sphere>(1);
  const auto contains = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  contains(message_of([&] { OmplMotionValidator(si, std::shared_ptr<const Shape>(), obstacles); }),
           "null");
  contains(message_of([&] { OmplMotionValidator(si, ball, obstacles, {.clearance = -1}); }),
           "clearance must be finite and >= 0, not -1");
  contains(message_of([&] { OmplMotionValidator(si, ball, obstacles, {.max_node_pairs = 0}); }),
           "not 0");
  const auto arm = std::make_shared<KinematicChain>(six_axis_arm());
  contains(message_of([&] { OmplMotionValidator(si, arm, obstacles); }), "RealVectorStateSpace");
  const auto line =
      std::make_shared<ob::SpaceInformation>(std::make_shared<ob::RealVectorStateSpace>(5));
  contains(message_of([&] { OmplMotionValidator(line, arm, obstacles); }), "of 5");
  contains(message_of([&] { OmplMotionValidator(line, ball, obstacles); }), "SE3StateSpace");
}

}  // namespace
}  // namespace dyop::testing
