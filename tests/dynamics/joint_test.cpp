// SPDX-License-Identifier: BSD-3-Clause

// Joints against closed forms, at steps of 0.01.
#include "dyop/dynamics/joint.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "dyop/geometry/primitives.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/world_scenes.h"
#include "support/message_of.h"
#include "support/run_world.h"

namespace dyop {
namespace {

using namespace testing;
using testing::message_of;

constexpr Scalar kJointStep = 0.01;

BodyDefinition anchor_body() {
  BodyDefinition body;
  body.name = "anchor";
  body.kind = BodyKind::Static;
  body.shape = std::make_shared<Sphere>(0.05);
  return body;
}

// A ball that hangs one below the origin, deflected by an angle.
struct Pendulum {
  explicit Pendulum(Scalar angle, JointKind kind = JointKind::Ball) : world(earth_options()) {
    const BodyId anchor = world.add_body(anchor_body());
    const Matrix3 R = rotation_from_vector(Vector3(0, -angle, 0));
    BodyDefinition body = dynamic_body("bob", std::make_shared<Sphere>(0.2), {0, 0, 0});
    body.initial.X_WB = RigidPose(R, R * Vector3(0, 0, -1));
    mass_properties = body.mass_properties;
    bob = world.add_body(body);
    JointDefinition definition;
    definition.name = "pivot";
    definition.kind = kind;
    definition.a = anchor;
    definition.b = bob;
    const Matrix3 z_to_y = rotation_from_vector(Vector3(-std::numbers::pi / 2, 0, 0));
    definition.X_AJ = RigidPose(z_to_y, Vector3::Zero());  // turns about y
    definition.X_BJ = RigidPose(z_to_y, Vector3(0, 0, 1));
    joint = world.add_joint(definition);
  }
  Scalar energy() const {
    return world.kinetic_energy() +
           mass_properties.mass * kGravity * world.state(bob).X_WB.translation().z();
  }
  Scalar period() const {
    const Scalar inertia = mass_properties.I_BBcm(0, 0) + mass_properties.mass;
    return 2 * std::numbers::pi * std::sqrt(inertia / (mass_properties.mass * kGravity));
  }
  World world;
  MassProperties mass_properties;
  BodyId bob;
  JointId joint;
};

TEST(Joint, SwingsAPendulumWithItsPeriodAndEnergy) {
  for (const JointKind kind : {JointKind::Ball, JointKind::Hinge}) {
    Pendulum pendulum(0.05, kind);
    const Scalar energy = pendulum.energy();
    const Scalar swing = pendulum.mass_properties.mass * kGravity * (1 - std::cos(0.05));
    Scalar last = pendulum.world.state(pendulum.bob).X_WB.translation().x();
    std::vector<Scalar> crossings;
    for (int k = 0; k < 500; ++k) {
      run_for(pendulum.world, kJointStep);
      const Scalar x = pendulum.world.state(pendulum.bob).X_WB.translation().x();
      if (last * x < 0) crossings.push_back(pendulum.world.time() - kJointStep * x / (x - last));
      last = x;
      EXPECT_NEAR(pendulum.world.state(pendulum.bob).X_WB.translation().norm(), 1, 1e-4);
    }
    ASSERT_GE(crossings.size(), 4U);
    const Scalar half = (crossings.back() - crossings.front()) / Scalar(crossings.size() - 1);
    EXPECT_NEAR(2 * half, pendulum.period(), 2e-3 * pendulum.period());
    EXPECT_NEAR(pendulum.energy() - energy, 0, 0.02 * swing);
  }
}

TEST(Joint, LosesEnergyAtSecondOrderOnly) {
  const auto drift = [](Scalar h) {
    Pendulum pendulum(1.5);
    const Scalar before = pendulum.energy();
    for (int k = 0; k < int(2 / h); ++k) pendulum.world.advance(h);
    return std::abs(pendulum.energy() - before);
  };
  EXPECT_LT(drift(0.005), 0.5 * drift(0.01) + 1e-6 * 33 * kGravity);
}

TEST(Joint, TurnsAHingeAtTheSpeedOfItsMotor) {
  World world;
  const BodyId anchor = world.add_body(anchor_body());
  const BodyId wheel = world.add_body(
      dynamic_body("wheel", std::make_shared<Box>(Vector3(0.3, 0.3, 0.1)), {0, 0, 0}));
  JointDefinition definition;
  definition.kind = JointKind::Hinge;
  definition.a = anchor;
  definition.b = wheel;
  definition.motor = JointMotor{2, 50};
  const JointId joint = world.add_joint(definition);
  constexpr Scalar kSolved = 2e-5;  // literal: the tolerance of the solver in this world
  // Until it has its speed the torque is the motor's strength.
  const Scalar inertia = world.body(wheel).mass_properties.I_BBcm(2, 2);
  run_for(world, 0.05);
  EXPECT_NEAR(world.state(wheel).twist.w_WB.z(), 0.05 * 50 / inertia, 0.02 * 0.05 * 50 / inertia);
  run_for(world, 1);
  EXPECT_NEAR(world.state(wheel).twist.w_WB.z(), 2, kSolved);
  world.set_motor(joint, JointMotor{-1, 50});
  run_for(world, 1);
  EXPECT_NEAR(world.state(wheel).twist.w_WB.z(), -1, kSolved);
}

TEST(Joint, StopsASliderAtItsLimit) {
  World world(earth_options());
  const BodyId anchor = world.add_body(anchor_body());
  const BodyId block = world.add_body(
      dynamic_body("block", std::make_shared<Box>(Vector3(0.1, 0.2, 0.3)), {0, 0, 0}));
  JointDefinition definition;
  definition.kind = JointKind::Slider;
  definition.a = anchor;
  definition.b = block;
  definition.limits = JointLimits{-0.5, 0.5};
  world.add_joint(definition);
  run_for(world, 1);
  const MotionState state = world.state(block);
  EXPECT_NEAR(state.X_WB.translation().z(), -0.5, 1e-4);
  EXPECT_LT(state.X_WB.translation().head<2>().norm(), 1e-6);
  EXPECT_NEAR(state.X_WB.rotation().trace(), 3, 1e-9);
  EXPECT_NEAR(state.twist.v_WB.z(), 0, 1e-4);
}

TEST(Joint, HoldsFixedBodiesTogetherAndLetsThemGo) {
  World world(earth_options());
  const BodyId anchor = world.add_body(anchor_body());
  const BodyId arm = world.add_body(
      dynamic_body("arm", std::make_shared<Box>(Vector3(0.5, 0.1, 0.1)), {0.6, 0, 0}));
  JointDefinition definition;
  definition.kind = JointKind::Fixed;
  definition.a = anchor;
  definition.b = arm;
  definition.X_BJ = RigidPose(Vector3(-0.6, 0, 0));
  const JointId joint = world.add_joint(definition);
  run_for(world, 1);
  EXPECT_LT((world.state(arm).X_WB.translation() - Vector3(0.6, 0, 0)).norm(), 1e-4);
  world.remove_joint(joint);
  run_for(world, 0.5);
  EXPECT_NEAR(world.state(arm).twist.v_WB.z(), -kGravity * 0.5, 1e-2);
  EXPECT_NE(message_of([&] { world.joint(joint); }).find("no joint"), std::string::npos);
}

TEST(Joint, KeepsADistance) {
  World world;
  const BodyId a =
      world.add_body(dynamic_body("a", std::make_shared<Sphere>(0.1), {0, 0, 0}, {0, 1, 0}));
  const BodyId b =
      world.add_body(dynamic_body("b", std::make_shared<Sphere>(0.1), {1, 0, 0}, {0, -1, 0}));
  JointDefinition definition;
  definition.kind = JointKind::Distance;
  definition.a = a;
  definition.b = b;
  world.add_joint(definition);
  const Vector3 spin = world.angular_momentum();
  const Scalar energy = world.kinetic_energy();
  run_for(world, 3);
  const Vector3 between = world.state(b).X_WB.translation() - world.state(a).X_WB.translation();
  EXPECT_NEAR(between.norm(), 1, 1e-5);
  EXPECT_LT(world.momentum().norm(), 1e-9);
  EXPECT_NEAR((world.angular_momentum() - spin).norm(), 0, 1e-3 * spin.norm());
  EXPECT_NEAR(world.kinetic_energy(), energy, 1e-3 * energy);
}

// However far it goes in a step: a bound on the speed with which errors of position are closed must
// not bound what the turn needs, or the joint tears open, and a spring in parallel gains energy.
TEST(Joint, KeepsADistanceToABodyThatCirclesFast) {
  for (const Scalar way : {0.05, 0.25, 0.8, 3.0}) {  // in a step; the distance is 1
    World world;
    const BodyId anchor = world.add_body(anchor_body());
    const BodyId ball = world.add_body(
        dynamic_body("ball", std::make_shared<Sphere>(0.1), {1, 0, 0}, {0, way / kJointStep, 0}));
    JointDefinition definition;
    definition.kind = JointKind::Distance;
    definition.a = anchor;
    definition.b = ball;
    world.add_joint(definition);
    const Scalar energy = world.kinetic_energy();
    for (int k = 0; k < 100; ++k) {
      run_for(world, kJointStep);
      EXPECT_NEAR(world.state(ball).X_WB.translation().norm(), 1, 3e-4) << "way " << way;
      EXPECT_NEAR(world.kinetic_energy(), energy, 1e-4 * energy) << "way " << way;
    }
  }
}

// Rods in a plane, one at the end of the other, by Lagrange's equations in their angles q from the
// horizontal, M(q) q'' = -A sin(q_i - q_j) q'^2 - g b cos q, and a Runge-Kutta method.
struct PlanarChain {
  void add(Scalar length, Scalar center, Scalar mass, Scalar inertia) {
    const Eigen::Index n = lengths.size();
    for (Eigen::VectorXd* values : {&lengths, &q, &rate, &b}) values->conservativeResize(n + 1);
    lengths[n] = center;  // as far as the last rod's mass
    q[n] = rate[n] = b[n] = 0;
    A.conservativeResizeLike(Eigen::MatrixXd::Zero(n + 1, n + 1));
    A += mass * lengths * lengths.transpose();
    b += mass * lengths;
    A(n, n) += inertia;
    lengths[n] = length;
  }
  Eigen::VectorXd acceleration(const Eigen::VectorXd& at, const Eigen::VectorXd& w) const {
    Eigen::MatrixXd M = A;
    Eigen::VectorXd f = -kGravity * b.cwiseProduct(Eigen::VectorXd(at.array().cos()));
    for (Eigen::Index i = 0; i < A.rows(); ++i) {
      for (Eigen::Index j = 0; j < A.cols(); ++j) {
        M(i, j) *= std::cos(at[i] - at[j]);
        f[i] -= A(i, j) * std::sin(at[i] - at[j]) * w[j] * w[j];
      }
    }
    return M.ldlt().solve(f);
  }
  void step(Scalar h) {
    const Eigen::VectorXd w1 = rate;
    const Eigen::VectorXd a1 = acceleration(q, w1);
    const Eigen::VectorXd w2 = rate + h / 2 * a1;
    const Eigen::VectorXd a2 = acceleration(q + h / 2 * w1, w2);
    const Eigen::VectorXd w3 = rate + h / 2 * a2;
    const Eigen::VectorXd a3 = acceleration(q + h / 2 * w2, w3);
    const Eigen::VectorXd w4 = rate + h * a3;
    const Eigen::VectorXd a4 = acceleration(q + h * w3, w4);
    q += h / 6 * (w1 + 2 * w2 + 2 * w3 + w4);
    rate += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
  Vector3 end() const {
    return {lengths.dot(Eigen::VectorXd(q.array().cos())), 0,
            lengths.dot(Eigen::VectorXd(q.array().sin()))};
  }
  Eigen::VectorXd lengths, q, rate, b;
  Eigen::MatrixXd A;
};

// A rope of `count` capsules of length `pitch`, level at first, from p_W along x; at its end a ball
// of `load` times the mass of one of them.
struct LoadedRope {
  LoadedRope(int count, Scalar pitch, Scalar load, const Vector3& p_W)
      : start_W(p_W), world(earth_options()) {
    BodyDefinition anchor = anchor_body();
    anchor.initial.X_WB = RigidPose(Vector3(p_W + Vector3(-pitch, 0, 0)));
    anchor.shape = std::make_shared<Sphere>(pitch / 4);
    last = world.add_body(anchor);
    const Scalar radius = pitch / 5;
    const auto link = std::make_shared<Capsule>(radius, pitch / 2 - radius);
    for (int i = 0; i < count; ++i) add(link, pitch / 2, pitch);
    const Scalar mass = world.body(last).mass_properties.mass;
    const Scalar size = std::cbrt(load * mass / (1000 * 4 * std::numbers::pi / 3));
    add(std::make_shared<Sphere>(size), size + radius, size + radius);
  }
  void add(const std::shared_ptr<const Shape>& shape, Scalar center, Scalar length) {
    const RigidPose X_along(rotation_between(Vector3::UnitZ(), Vector3::UnitX()), Vector3::Zero());
    BodyDefinition body = dynamic_body("link", shape, Vector3::Zero());
    body.mass_properties = shape->compute_mass_properties(1000);
    const Vector3 joint_W = start_W + Vector3(chain.lengths.sum(), 0, 0);
    body.initial.X_WB = RigidPose(Vector3(joint_W + Vector3(center, 0, 0))) * X_along;
    JointDefinition joint;
    joint.a = last;
    joint.X_AJ = RigidPose(world.state(last).X_WB.inverse() * joint_W);
    last = world.add_body(body);
    joint.b = last;
    joint.X_BJ = RigidPose(Vector3(0, 0, -center));
    joints.push_back(world.add_joint(joint));
    chain.add(length, center, body.mass_properties.mass, body.mass_properties.I_BBcm(0, 0));
    weight += kGravity * body.mass_properties.mass;
    potential.push_back({last, kGravity * body.mass_properties.mass});
  }
  Scalar energy() const {
    Scalar sum = world.kinetic_energy();
    for (const auto& [id, force] : potential) {
      sum += force * (world.state(id).X_WB.translation().z() - start_W.z());
    }
    return sum;
  }
  Scalar widest_gap() const {
    Scalar widest = 0;
    for (const JointId id : joints) {
      const JointDefinition& joint = world.joint(id);
      const Vector3 p_a = world.state(joint.a).X_WB * joint.X_AJ.translation();
      const Vector3 p_b = world.state(joint.b).X_WB * joint.X_BJ.translation();
      widest = std::max(widest, (p_a - p_b).norm());
    }
    return widest;
  }
  Vector3 start_W;
  World world;
  PlanarChain chain;
  BodyId last;
  std::vector<JointId> joints;
  std::vector<std::pair<BodyId, Scalar>> potential;
  Scalar weight = 0;
};

// Its links turn at hundreds of radians per second about where the load pulls them: steps of 0.01
// do not resolve that, and neither shorten for it nor gain energy by it.
TEST(Joint, SwingsAHeavyLoadOnARopeAsLagrangeSays) {
  for (const Scalar scale : {0.01, 1.0, 100.0}) {
    for (const Scalar load : {1.0, 1000.0}) {
      const Vector3 start(load == 1 ? 0 : 1000 * scale, 0, 0);
      LoadedRope rope(10, 0.2 * scale, load, start);
      const Scalar length = rope.chain.lengths.sum();
      const Scalar h = 0.01 * std::sqrt(scale);
      std::int64_t substeps = 0;
      for (int k = 0; k < 80; ++k) {
        const AdvanceReport report = rope.world.advance(h);
        ASSERT_EQ(report.status, AdvanceStatus::Completed);
        substeps += report.work.substeps;
        for (int i = 0; i < 20; ++i) rope.chain.step(h / 20);
        EXPECT_LT(rope.widest_gap(), 1e-4 * scale);
      }
      const RigidPose X_WB = rope.world.state(rope.last).X_WB;
      const Vector3 center = rope.chain.end() + start;
      EXPECT_LT((X_WB.translation() - center).norm(), 2e-3 * length) << scale << ' ' << load;
      EXPECT_NEAR(rope.energy() / (rope.weight * length), 0, 1e-3) << scale << ' ' << load;
      EXPECT_EQ(substeps, 80) << scale << ' ' << load;
    }
  }
}

// Balls of mass 1 in a row, each held at its distance from the one before, the first from a post; the
// last has `load` times that mass.
struct BallsOnRods {
  BallsOnRods(int count, Scalar load, const Vector3& along_W, bool are_ropes)
      : world(earth_options()) {
    BodyDefinition post = anchor_body();
    post.shape = std::make_shared<Sphere>(0.01);
    BodyId last = world.add_body(post);
    const auto ball = std::make_shared<Sphere>(0.02);
    for (int i = 1; i <= count; ++i) {
      BodyDefinition body = dynamic_body("ball", ball, kPitch * i * along_W);
      masses.push_back(i == count ? load : 1);
      const Scalar inertia = masses.back() * 0.4 * 0.02 * 0.02;
      body.mass_properties = {masses.back(), Vector3::Zero(), inertia * Matrix3::Identity()};
      JointDefinition joint;
      joint.kind = JointKind::Distance;
      joint.a = last;
      joint.b = last = world.add_body(body);
      joint.limits = JointLimits{are_ropes ? 0 : kPitch, kPitch};
      joints.push_back(world.add_joint(joint));
      balls.push_back(last);
    }
  }
  Scalar energy() const {
    Scalar sum = world.kinetic_energy();
    for (std::size_t i = 0; i < balls.size(); ++i) {
      sum += masses[i] * kGravity * world.state(balls[i]).X_WB.translation().z();
    }
    return sum;
  }
  static constexpr Scalar kPitch = 0.1;
  World world;
  std::vector<Scalar> masses;
  std::vector<BodyId> balls;
  std::vector<JointId> joints;
};

TEST(Joint, SwingsBallsOnRodsAtSecondOrder) {
  const Scalar duration = 0.4;
  const auto error = [&](int count, Scalar h) {
    BallsOnRods row(count, 1, Vector3::UnitX(), false);
    PlanarChain chain;
    for (int i = 0; i < count; ++i) chain.add(row.kPitch, row.kPitch, 1, 0);
    for (int k = 0; k < int(std::lround(duration / h)); ++k) row.world.advance(h);
    for (int i = 0; i < 4000; ++i) chain.step(duration / 4000);
    return (row.world.state(row.balls.back()).X_WB.translation() - chain.end()).norm();
  };
  for (const int count : {1, 2, 8}) {
    const Scalar coarse = error(count, 0.005);
    EXPECT_LT(coarse, 2e-3) << count;
    EXPECT_LT(error(count, 0.0025), 0.3 * coarse) << count;
  }
}

// The load pulls the light balls to and fro across the row many times a step.
TEST(Joint, HoldsAHeavyLoadOnRodsAndRopes) {
  for (const bool are_ropes : {false, true}) {
    for (const Scalar load : {100., 1000., 10000.}) {
      BallsOnRods row(20, load, -Vector3::UnitZ(), are_ropes);
      row.world.apply_impulse(row.balls[10], Vector3(0.05, 0, 0));
      const Scalar before = row.energy();
      for (int k = 0; k < 100; ++k) {
        const AdvanceReport report = row.world.advance(0.01);
        ASSERT_EQ(report.status, AdvanceStatus::Completed);
        ASSERT_EQ(report.work.substeps, 1);
      }
      // What rounding lets the load move counts more than the push.
      EXPECT_NEAR(row.energy(), before, 2e-3 + 1e-7 * load * kGravity * row.kPitch) << load;
      for (const BodyId ball : row.balls) {
        EXPECT_LT(row.world.state(ball).X_WB.translation().head<2>().norm(), 0.01) << load;
      }
      for (const JointId joint : row.joints) {
        EXPECT_LT(row.world.joint_values(joint).separation, 1e-7) << load;
      }
    }
  }
}

// Two rods in a straight line between two posts, held by three joints: rounding alone lets such a
// truss sag, and a sag of it carries the weight. It once burst.
TEST(Joint, HoldsAStraightTrussStill) {
  for (const Matrix3& R_J :
       {Matrix3(Matrix3::Identity()), rotation_from_vector(Vector3(-std::numbers::pi / 2, 0, 0))}) {
    for (const Scalar h : {0.02, 0.01, 0.005, 0.002}) {
      World world(earth_options());
      std::vector<BodyId> row;
      for (const Scalar x : {0.0, 0.5, 1.5, 2.0}) {
        BodyDefinition body =
            dynamic_body("rod", std::make_shared<Capsule>(0.01, 0.488), {x, 0, 0});
        body.initial.X_WB =
            RigidPose(rotation_from_vector(Vector3(0, std::numbers::pi / 2, 0)), Vector3(x, 0, 0));
        if (row.empty() || x == 2) body.kind = BodyKind::Static;
        body.filter.mask = 0;
        row.push_back(world.add_body(body));
      }
      std::vector<JointId> joints;
      for (std::size_t k = 0; k < 3; ++k) {
        const RigidPose X_WJ(R_J, Vector3(Scalar(k), 0, 0));
        JointDefinition joint;
        joint.a = row[k];
        joint.b = row[k + 1];
        joint.X_AJ = world.state(row[k]).X_WB.inverse() * X_WJ;
        joint.X_BJ = world.state(row[k + 1]).X_WB.inverse() * X_WJ;
        joints.push_back(world.add_joint(joint));
      }
      const Scalar weight = world.body(row[1]).mass_properties.mass * kGravity;
      for (int k = 0; k < std::lround(1 / h); ++k) {
        ASSERT_EQ(world.advance(h).status, AdvanceStatus::Completed);
        EXPECT_LT(world.kinetic_energy(), 0.02 * weight) << h;
      }
      for (const JointId joint : joints) EXPECT_LT(world.joint_values(joint).separation, 1e-6) << h;
      EXPECT_NEAR(world.state(row[1]).X_WB.translation().z(), 0, 1e-3) << h;
    }
  }
}

// A trunk, a head, two arms and two legs of capsules; returns its mass.
Scalar add_ragdoll(World& world, const RigidPose& X_WR) {
  const Quaternion across = rotation_between(Vector3::UnitZ(), Vector3::UnitX());
  const Quaternion upright = Quaternion::Identity();
  Scalar mass = 0;
  const auto add = [&](Scalar radius, Scalar half_length, const RigidPose& X_RB) {
    BodyDefinition body =
        dynamic_body("limb", std::make_shared<Capsule>(radius, half_length), Vector3::Zero());
    body.initial.X_WB = X_WR * X_RB;
    body.restitution = 0;
    mass += body.mass_properties.mass;
    return world.add_body(body);
  };
  const BodyId trunk = add(0.15, 0.25, RigidPose());
  const auto add_limb = [&](Scalar radius, Scalar half_length, const RigidPose& X_RB,
                            const Vector3& p_R) {
    JointDefinition joint;
    joint.a = trunk;
    joint.b = add(radius, half_length, X_RB);
    joint.X_AJ = RigidPose(p_R);
    joint.X_BJ = X_RB.inverse() * RigidPose(p_R);
    world.add_joint(joint);
  };
  add_limb(0.12, 0.05, RigidPose(upright, {0, 0, 0.62}), {0, 0, 0.42});
  for (const Scalar side : {-1.0, 1.0}) {
    add_limb(0.07, 0.25, RigidPose(across, {side * 0.56, 0, 0.25}), {side * 0.2, 0, 0.25});
    add_limb(0.09, 0.35, RigidPose(upright, {side * 0.12, 0, -0.9}), {side * 0.12, 0, -0.42});
  }
  return mass;
}

// Ragdolls that begin inside each other have no way apart that their joints allow: pushing them
// apart gives no energy, and no step tries for long.
TEST(Joint, EndsTheStepAndGainsNoEnergyWhereHeldBodiesBeginInsideEachOther) {
  World world(earth_options());
  world.add_body(floor_body(0.5));
  Scalar mass = 0;
  const Matrix3 lying = rotation_from_vector(Vector3(std::numbers::pi / 2, 0, 0));
  for (int i = 0; i < 9; ++i) {
    const Vector3 p(0, 1.2 * (i % 3), 0.35 + i / 3);
    mass += add_ragdoll(world, RigidPose(lying, p));
  }
  std::size_t too_near = 0;
  for (int k = 1; k <= 3; ++k) {
    const AdvanceReport report = world.advance(kJointStep);
    ASSERT_EQ(report.status, AdvanceStatus::Completed);
    EXPECT_LT(report.work.unconverged, 100);
    const Scalar speed = kGravity * k * kJointStep;
    EXPECT_LT(world.kinetic_energy(), 2 * mass * speed * speed);
    too_near += report.too_near.size();
  }
  EXPECT_GT(too_near, 0U);
}

// Eighteen ragdolls dropped on each other in two layers: a crowd with joints.
struct RagdollHeap {
  explicit RagdollHeap(int threads) : world(options_of(threads)) {
    world.add_body(floor_body(0.5));
    const Matrix3 lying = rotation_from_vector(Vector3(std::numbers::pi / 2, 0, 0));
    for (int i = 0; i < 18; ++i) {
      const int layer = i / 9;
      const Matrix3 R = rotation_from_vector(Vector3(0, 0, 0.4 * layer)) * lying;
      const Vector3 p(1.3 * (i % 3), 2.2 * (i / 3 % 3), 0.35 + 0.8 * layer);
      mass += add_ragdoll(world, RigidPose(R, p));
    }
  }
  static WorldOptions options_of(int threads) {
    WorldOptions options = earth_options();
    options.thread_count = threads;
    return options;
  }

  World world;
  Scalar mass = 0;
};

TEST(Joint, HeapOfRagdollsGainsNoEnergyOnAnyNumberOfThreads) {
  RagdollHeap one(1);
  RagdollHeap three(3);
  const auto energy = [](const World& world) {
    Scalar sum = world.kinetic_energy();
    for (const BodyId id : world.bodies()) {
      const Scalar mass = world.body(id).mass_properties.mass;
      if (world.body(id).kind == BodyKind::Dynamic) {
        sum += mass * kGravity * world.state(id).X_WB.translation().z();
      }
    }
    return sum;
  };
  Scalar last = energy(one.world);
  std::int64_t unconverged = 0;
  for (int k = 0; k < 100; ++k) {
    const AdvanceReport report = one.world.advance(kJointStep);
    ASSERT_EQ(report.status, AdvanceStatus::Completed);
    ASSERT_EQ(three.world.advance(kJointStep).status, AdvanceStatus::Completed);
    unconverged += report.work.unconverged;
    const Scalar now = energy(one.world);
    ASSERT_LT(now, last + 1e-4 * one.mass * kGravity) << "step " << k;
    last = now;
  }
  EXPECT_LE(unconverged, 5);
  for (const BodyId id : one.world.bodies()) {
    const RigidPose X_WB = one.world.state(id).X_WB;
    EXPECT_EQ(X_WB.translation(), three.world.state(id).X_WB.translation());
    EXPECT_EQ(X_WB.rotation(), three.world.state(id).X_WB.rotation());
  }
  for (const JointId id : one.world.joints()) {
    EXPECT_LT(one.world.joint_values(id).separation, 1e-3);
  }
}

TEST(Joint, RefusesWhatCannotBe) {
  World world;
  const BodyId a = world.add_body(anchor_body());
  const BodyId b = world.add_body(anchor_body());
  JointDefinition definition;
  definition.name = "knee";
  definition.a = a;
  definition.b = a;
  const auto message = [&] { return message_of([&] { world.add_joint(definition); }); };
  EXPECT_NE(message().find("joint 'knee': needs two different bodies"), std::string::npos);
  definition.b = b;
  EXPECT_NE(message().find("one of its bodies must be dynamic"), std::string::npos);
  definition.motor = JointMotor{1, 1};
  EXPECT_NE(message().find("can have a motor"), std::string::npos);
  definition.kind = JointKind::Hinge;
  definition.limits = JointLimits{1, -1};
  EXPECT_NE(message().find("in order"), std::string::npos);
}

TEST(Joint, WhatHangsOnACrawlingBodyStaysAwake) {
  for (const bool crawls : {false, true}) {
    World world(earth_options());
    BodyDefinition anchor = anchor_body();
    anchor.kind = BodyKind::Kinematic;
    const Vector3 v_W(crawls ? 1e-6 : 0.0, 0, 0);  // literal: far below the speed of sleep
    anchor.motion = std::make_shared<ConstantTwistMotion>(RigidPose(), Twist{v_W, Vector3::Zero()});
    const auto cube = std::make_shared<Box>(Vector3(0.1, 0.1, 0.1));
    JointDefinition joint;
    joint.kind = JointKind::Fixed;
    joint.a = world.add_body(anchor);
    joint.b = world.add_body(dynamic_body("load", cube, {0, 0, 0}));
    world.add_joint(joint);
    run_for(world, 2);
    EXPECT_EQ(world.is_asleep(joint.b), !crawls);
  }
}

}  // namespace
}  // namespace dyop
