// SPDX-License-Identifier: BSD-3-Clause

// What joints measure, drive, resist, couple and bear, against closed forms, at two steps.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "dyop/geometry/primitives.h"
#include "support/inputs/world_scenes.h"
#include "support/message_of.h"
#include "support/run_world.h"

namespace dyop {
namespace {

using namespace testing;
using testing::message_of;

constexpr Scalar kPi = std::numbers::pi;
const std::vector<Scalar> kSteps{0.01, 0.0025};

BodyId add_ground(World& world) {
  BodyDefinition body;
  body.name = "ground";
  body.kind = BodyKind::Static;
  body.shape = std::make_shared<Sphere>(0.05);
  return world.add_body(body);
}

// A plank on a hinge about an axis through its middle, or off it by `arm` along its x.
struct Plank {
  explicit Plank(JointDefinition joint = {}, Scalar arm = 0, const WorldOptions& options = {},
                 const Vector3& axis = {1, -2, 0.5})
      : world(options), R(rotation_between(Vector3::UnitZ(), axis).toRotationMatrix()) {
    ground = add_ground(world);
    BodyDefinition body = dynamic_body("plank", std::make_shared<Box>(Vector3(0.3, 0.2, 0.1)),
                                       R * Vector3(arm, 0, 0));
    body.initial.X_WB = RigidPose(R, R * Vector3(arm, 0, 0));
    mass = body.mass_properties.mass;
    inertia = body.mass_properties.I_BBcm(2, 2) + mass * arm * arm;
    id = world.add_body(body);
    joint.name = "axle";
    joint.kind = JointKind::Hinge;
    joint.a = ground;
    joint.b = id;
    joint.X_AJ = RigidPose(R, Vector3::Zero());
    joint.X_BJ = RigidPose(Vector3(-arm, 0, 0));
    hinge = world.add_joint(joint);
  }
  void set_torque(Scalar torque) {
    const Vector3 torque_W = torque * R.col(2);
    world.set_wrench(id, [torque_W](Scalar, const MotionState&) {
      return Wrench{Vector3::Zero(), torque_W};
    });
  }
  void set_rate(Scalar rate) {
    MotionState state = world.state(id);
    state.twist.w_WB = rate * R.col(2);
    state.twist.v_WB = state.twist.w_WB.cross(state.X_WB.translation());
    world.set_state(id, state);
  }
  JointValues values() const { return world.joint_values(hinge); }
  World world;
  Matrix3 R;
  BodyId ground, id;
  JointId hinge;
  Scalar mass = 0;
  Scalar inertia = 0;  // about the axle
};

TEST(JointLaws, AHingeCountsTheTurnsThatATorqueDrives) {
  for (const Scalar h : kSteps) {
    Plank plank;
    const Scalar torque = 20 * plank.inertia;
    plank.set_torque(torque);
    run_solved(plank.world, 2, h);
    EXPECT_NEAR(plank.values().angle, 20 * 2 * 2 / 2.0, 1e-3);  // more than six turns
    EXPECT_NEAR(plank.values().angle_rate, 20 * 2, 1e-3);
    plank.set_torque(-3 * torque);
    run_solved(plank.world, 2, h);
    EXPECT_NEAR(plank.values().angle, 40 + 40 * 2 - 60 * 2 * 2 / 2.0, 2e-3);
    EXPECT_LT(plank.values().separation, 1e-6);
  }
}

TEST(JointLaws, AHingeBearsTheWeightAndTheCentripetalForce) {
  constexpr Scalar kRate = 3;
  constexpr Scalar kArm = 0.7;
  for (const Scalar h : kSteps) {
    Plank plank({}, kArm, earth_options(), Vector3::UnitZ());
    plank.set_rate(kRate);
    run_solved(plank.world, 1, h);
    // The mean over the step is that of its middle, to second order.
    const Scalar angle = plank.values().angle - kRate * h / 2;
    const Scalar pull = plank.mass * kRate * kRate * kArm;
    const Scalar weight = plank.mass * kGravity;
    const Vector3 expected(-pull * std::cos(angle), -pull * std::sin(angle), weight);
    EXPECT_LT((plank.values().force_W - expected).norm(), 2e-3 * weight) << h;
    // About the axle: the weight's moment, and nothing along it.
    const Vector3 moment = weight * kArm * Vector3(-std::sin(angle), std::cos(angle), 0);
    EXPECT_LT((plank.values().torque_W + moment).norm(), 2e-3 * weight) << h;
    EXPECT_NEAR(plank.values().angle, kRate, 1e-3);
  }
}

// I q'' + C q' + K (q - q0) = 0.
Scalar oscillator(Scalar t, Scalar start, Scalar frequency, Scalar decay) {
  if (decay < frequency) {
    const Scalar w = std::sqrt(frequency * frequency - decay * decay);
    return start * std::exp(-decay * t) * (std::cos(w * t) + decay / w * std::sin(w * t));
  }
  const Scalar w = std::sqrt(decay * decay - frequency * frequency);
  return start * std::exp(-decay * t) * (std::cosh(w * t) + decay / w * std::sinh(w * t));
}

JointMotor servo(Scalar position, Scalar stiffness, Scalar damping, Scalar strength = kInfinity) {
  JointMotor motor;
  motor.position = position;
  motor.stiffness = stiffness;
  motor.damping = damping;
  motor.strength = strength;
  return motor;
}

TEST(JointLaws, AServoSwingsAndDecaysAsItsGainsSay) {
  constexpr Scalar kFrequency = 1.5;
  for (const Scalar decay : {0.0, 0.3, 3.0}) {
    for (const auto& [h, arm] : {std::pair(0.01, 0.0), {0.0025, 0.0}, {0.01, 0.4}, {0.0025, 0.4}}) {
      const Scalar goal = arm > 0 ? 1 : 7;  // or beyond a turn
      Plank plank({}, arm);
      plank.world.set_motor(plank.hinge, servo(goal, plank.inertia * kFrequency * kFrequency,
                                               2 * decay * plank.inertia));
      Scalar largest = 0;
      for (int k = 1; k <= 8; ++k) {
        run_solved(plank.world, 1, h);
        const Scalar expected = goal + oscillator(k, -goal, kFrequency, decay);
        largest = std::max(largest, std::abs(plank.values().angle - expected));
      }
      // The phase lags by (w h)^2 / 12 of w t.
      EXPECT_LT(largest, goal * 12 * std::pow(kFrequency * h, 2) / 10 + 1e-4)
          << "decay " << decay << ", h " << h << ", arm " << arm;
    }
  }
}

TEST(JointLaws, NoGainBlowsUp) {
  for (const Scalar h : kSteps) {
    for (const Scalar stiffness : {1e6, 1e12}) {
      for (const Scalar damping : {0.0, 1e4, 1e12}) {
        Plank plank({}, 0.4, earth_options());
        plank.world.set_motor(plank.hinge, servo(1, stiffness, damping));
        for (int k = 0; k < 200; ++k) {
          plank.world.advance(h);
          ASSERT_LT(std::abs(plank.values().angle), 2.5) << stiffness << ' ' << damping;
          ASSERT_LT(std::abs(plank.values().angle_rate), 2.5 / h) << stiffness << ' ' << damping;
        }
        if (damping == 1e4 || (damping == 0 && stiffness == 1e12)) {
          EXPECT_NEAR(plank.values().angle, 1, 2e-3) << stiffness << ' ' << damping;
        }
      }
    }
  }
}

TEST(JointLaws, AServoGivesNoMoreThanItsStrength) {
  for (const Scalar h : kSteps) {
    Plank plank;
    const Scalar strength = 2 * plank.inertia;
    plank.world.set_motor(plank.hinge, servo(100, 1e3, 1, strength));
    run_solved(plank.world, 1, h);
    EXPECT_NEAR(plank.values().angle_rate, 2, 1e-4);
    EXPECT_NEAR(plank.values().angle, 1, 1e-4);
    EXPECT_NEAR(plank.values().drive, strength, 1e-4 * strength);
  }
}

// What it bears at rest it measures, and it falls asleep; a new goal wakes it.
TEST(JointLaws, AServoHoldsAnArmAgainstItsWeightAndSleeps) {
  for (const Scalar h : kSteps) {
    Plank plank({}, 0.4, earth_options(), Vector3::UnitY());
    const Scalar stiffness = 400 * plank.inertia;
    plank.world.set_motor(plank.hinge, servo(0.5, stiffness, 40 * plank.inertia));
    for (int k = 0; k < int(6 / h) && !plank.world.is_asleep(plank.id); ++k) plank.world.advance(h);
    EXPECT_TRUE(plank.world.is_asleep(plank.id));
    const Scalar lag = 0.5 - plank.values().angle;
    // x of the plank has turned down: the weight's moment about y.
    const Vector3 x_W = plank.world.state(plank.id).X_WB.rotation().col(0);
    const Vector3 moment = (0.4 * x_W).cross(plank.mass * Vector3(0, 0, -kGravity));
    EXPECT_NEAR(stiffness * lag, -moment.dot(plank.R.col(2)), 1e-3 * stiffness);
    EXPECT_NEAR(plank.values().drive, stiffness * lag, 1e-3 * stiffness);
    EXPECT_NEAR(plank.values().force_W.z(), plank.mass * kGravity, 1e-3 * plank.mass * kGravity);
    plank.world.set_motor(plank.hinge, servo(-0.5, stiffness, 40 * plank.inertia));
    EXPECT_FALSE(plank.world.is_asleep(plank.id));
    run_solved(plank.world, 1, h);
    EXPECT_LT(plank.values().angle, -0.2);
  }
}

TEST(JointLaws, FrictionHoldsBrakesAndStops) {
  for (const Scalar h : kSteps) {
    JointDefinition joint;
    joint.friction = 3;
    Plank plank(joint);
    plank.set_torque(2.9);
    run_solved(plank.world, 1, h);
    EXPECT_NEAR(plank.values().angle, 0, 1e-6);
    EXPECT_NEAR(plank.values().drive, plank.world.is_asleep(plank.id) ? -2.9 : -2.9, 1e-3);
    plank.set_torque(4);
    run_solved(plank.world, 1, h);
    EXPECT_NEAR(plank.values().angle_rate, 1 / plank.inertia, 1e-3 / plank.inertia);
    plank.set_torque(0);
    const Scalar before = plank.values().angle;
    const Scalar rate = plank.values().angle_rate;
    run_solved(plank.world, plank.inertia * rate / 3 + 1, h);
    EXPECT_NEAR(plank.values().angle - before, plank.inertia * rate * rate / 6, 0.01);
    EXPECT_NEAR(plank.values().angle_rate, 0, 1e-5);
    EXPECT_TRUE(plank.world.is_asleep(plank.id));
  }
}

// A motor that works against friction turns with what is left of it.
TEST(JointLaws, FrictionTakesItsPartOfAMotor) {
  for (const Scalar h : kSteps) {
    JointDefinition joint;
    joint.friction = 2;
    joint.motor = JointMotor{1.5, 5};
    Plank plank(joint);
    run_solved(plank.world, 0.1, h);
    EXPECT_NEAR(plank.values().angle_rate, 0.3 / plank.inertia, 1e-3);
    run_solved(plank.world, plank.inertia, h);
    EXPECT_NEAR(plank.values().angle_rate, 1.5, 1e-4);
  }
}

TEST(JointLaws, DampingSlowsDownExponentially) {
  for (const Scalar h : kSteps) {
    for (const Scalar rate : {0.5, 3.0, 1e9}) {
      Plank plank;
      JointDefinition joint = plank.world.joint(plank.hinge);
      plank.world.remove_joint(plank.hinge);
      joint.damping = rate * plank.inertia;
      plank.hinge = plank.world.add_joint(joint);
      plank.set_rate(5);
      for (int k = 0; k < 4; ++k) {
        run_solved(plank.world, 0.25, h);
        const Scalar expected = 5 * std::exp(-rate * 0.25 * (k + 1));
        EXPECT_NEAR(plank.values().angle_rate, expected, 2e-3) << rate;
      }
    }
  }
}

// A rod that hangs from a ball joint at its end, axis z of both frames up the rod.
struct Rod {
  explicit Rod(const JointDefinition& definition, const Vector3& gravity_W) {
    WorldOptions options;
    options.gravity_W = gravity_W;
    world = World(options);
    const BodyId ground = add_ground(world);
    BodyDefinition body =
        dynamic_body("rod", std::make_shared<Box>(Vector3(0.05, 0.08, 0.5)), {0, 0, 0.5});
    id = world.add_body(body);
    JointDefinition joint = definition;
    joint.a = ground;
    joint.b = id;
    joint.X_BJ = RigidPose(Vector3(0, 0, -0.5));
    ball = world.add_joint(joint);
  }
  World world;
  BodyId id;
  JointId ball;
};

TEST(JointLaws, ABallStopsAtItsCone) {
  for (const Scalar h : kSteps) {
    JointDefinition joint;
    joint.swing_twist = SwingTwistLimits{0.6, -kPi, kPi};
    joint.damping = 20;
    Rod rod(joint, {3, -2, -kGravity});  // it falls over to where that points
    run_solved(rod.world, 3, h);
    const Vector3 z = rod.world.state(rod.id).X_WB.rotation().col(2);
    EXPECT_NEAR(std::acos(z.z()), 0.6, 1e-4) << h;
    EXPECT_NEAR(rod.world.joint_values(rod.ball).swing, 0.6, 1e-4);
    EXPECT_NEAR(z.y() / z.x(), -2.0 / 3, 1e-3);
    run_solved(rod.world, 3, h);
    EXPECT_TRUE(rod.world.is_asleep(rod.id));
    // Pushed back it leaves the limit.
    rod.world.set_gravity({0, 0, kGravity});
    run_solved(rod.world, 1, h);
    EXPECT_LT(rod.world.joint_values(rod.ball).swing, 0.4);
  }
}

TEST(JointLaws, ABallTwistsAsFarAsItMay) {
  for (const Scalar h : kSteps) {
    for (const Scalar torque : {5.0, -5.0}) {
      JointDefinition joint;
      joint.swing_twist = SwingTwistLimits{1, -0.4, 0.9};
      joint.damping = 2;
      Rod rod(joint, {0, 0, 0});
      // Held at a swing by a torque across, and turned about its own axis.
      rod.world.set_wrench(rod.id, [torque](Scalar, const MotionState& state) {
        return Wrench{Vector3::Zero(), torque * state.X_WB.rotation().col(2) + Vector3(40, 20, 0)};
      });
      run_solved(rod.world, 10, h);
      const JointValues values = rod.world.joint_values(rod.ball);
      EXPECT_NEAR(values.angle, torque > 0 ? 0.9 : -0.4, 2e-4);
      EXPECT_NEAR(values.swing, 1, 2e-4);
      EXPECT_LT(values.separation, 1e-5);
    }
  }
}

// Two shafts at an angle b, joined by a cross: tan(driven) = tan(driving) cos b if the driving
// fork starts across the plane of the shafts.
TEST(JointLaws, AUniversalJointTurnsAShaftUnevenly) {
  constexpr Scalar kBend = 0.6;
  for (const Scalar h : kSteps) {
    World world;
    const BodyId ground = add_ground(world);
    const Matrix3 bent = rotation_from_vector(Vector3(kBend, 0, 0));
    const auto shaft = std::make_shared<Box>(Vector3(0.05, 0.05, 0.3));
    const BodyId in = world.add_body(dynamic_body("in", shaft, {0, 0, -0.4}));
    BodyDefinition out_body = dynamic_body("out", shaft, {0, 0, 0});
    out_body.initial.X_WB = RigidPose(bent, bent * Vector3(0, 0, 0.4));
    const BodyId out = world.add_body(out_body);
    const auto hinge = [&](BodyId body, const RigidPose& X_WJ, Scalar speed) {
      JointDefinition joint;
      joint.kind = JointKind::Hinge;
      joint.a = ground;
      joint.b = body;
      joint.X_AJ = X_WJ;
      joint.X_BJ = world.state(body).X_WB.inverse() * X_WJ;
      if (speed > 0) joint.motor = JointMotor{speed, 1e4};
      return world.add_joint(joint);
    };
    const JointId driving = hinge(in, RigidPose(Vector3(0, 0, -0.4)), 2);
    const JointId driven = hinge(out, RigidPose(bent, bent * Vector3(0, 0, 0.4)), 0);
    JointDefinition cross;
    cross.kind = JointKind::Universal;
    cross.a = in;
    cross.b = out;
    cross.X_AJ = RigidPose(Vector3(0, 0, 0.4));
    cross.X_BJ = RigidPose(Vector3(0, 0, -0.4));
    const JointId universal = world.add_joint(cross);
    EXPECT_NEAR(world.joint_values(universal).angle, kBend, 1e-9);
    Scalar worst = 0;
    for (int k = 0; k < int(4 / h); ++k) {
      run_solved(world, h, h);
      const Scalar angle = world.joint_values(driving).angle;
      // x of the driving fork stays at right angles to y of the driven one.
      const Scalar expected = std::atan2(std::sin(angle) * std::cos(kBend), std::cos(angle));
      const Scalar error = world.joint_values(driven).angle - expected;
      worst = std::max(worst, std::abs(std::remainder(error, 2 * kPi)));
    }
    EXPECT_LT(worst, 1e-4) << h;
    EXPECT_GT(world.joint_values(driven).angle, 7);  // it keeps up: more than a turn
    EXPECT_LT(world.joint_values(universal).separation, 1e-5);
  }
}

TEST(JointLaws, ACylindricalJointTurnsAndSlidesEachOnItsOwn) {
  for (const Scalar h : kSteps) {
    World world(earth_options());
    const BodyId ground = add_ground(world);
    const BodyId body = world.add_body(
        dynamic_body("sleeve", std::make_shared<Box>(Vector3(0.2, 0.3, 0.1)), {0, 0, 0}));
    JointDefinition joint;
    joint.kind = JointKind::Cylindrical;
    joint.a = ground;
    joint.b = body;
    joint.limits = JointLimits{-1, 1};
    joint.damping = 2;
    const JointId id = world.add_joint(joint);
    const Scalar inertia = world.body(body).mass_properties.I_BBcm(2, 2);
    world.set_wrench(body, [](Scalar, const MotionState&) {
      return Wrench{Vector3::Zero(), Vector3(0.4, 0.2, 3)};
    });
    run_solved(world, 0.4, h);
    EXPECT_NEAR(world.joint_values(id).position, -kGravity * 0.08, 1e-3);
    EXPECT_NEAR(world.joint_values(id).position_rate, -kGravity * 0.4, 1e-3);
    EXPECT_NEAR(world.joint_values(id).angle_rate, 1.5 * (1 - std::exp(-2 * 0.4 / inertia)), 1e-3);
    run_solved(world, 2, h);
    EXPECT_NEAR(world.joint_values(id).position, -1, 1e-4);
    EXPECT_NEAR(world.joint_values(id).angle_rate, 1.5 * (1 - std::exp(-2 * 2.4 / inertia)), 2e-3);
    EXPECT_LT(world.joint_values(id).separation, 1e-5);
  }
}

// It falls freely until the rope is taut, then swings on as what is left of its velocity allows.
TEST(JointLaws, ARopeIsSlackThenHolds) {
  for (const Scalar h : kSteps) {
    World world(earth_options());
    const BodyId ground = add_ground(world);
    const BodyId body = world.add_body(
        dynamic_body("crate", std::make_shared<Box>(Vector3(0.1, 0.2, 0.15)), {0.6, 0, 0}));
    JointDefinition rope;
    rope.kind = JointKind::Distance;
    rope.a = ground;
    rope.b = body;
    rope.limits = JointLimits{0, 1};
    const JointId id = world.add_joint(rope);
    const Scalar taut = std::sqrt(2 * 0.8 / kGravity);  // 0.8 down it is 1 away
    run_solved(world, 0.9 * taut, h);
    const Scalar t = world.time();
    EXPECT_NEAR(world.joint_values(id).position, std::hypot(0.6, kGravity * t * t / 2), 1e-3);
    EXPECT_NEAR(world.joint_values(id).force_W.norm(), 0, 1e-9);
    // Its speed across the rope is left: 0.6 of it, and then it swings through below.
    const Scalar speed = 0.6 * kGravity * taut;
    Scalar fastest = 0;
    Scalar longest = 0;
    for (int k = 0; k < int(1 / h); ++k) {
      run_solved(world, h, h);
      if (world.time() > taut + 0.05) {
        fastest = std::max(fastest, world.state(body).twist.v_WB.norm());
      }
      longest = std::max(longest, world.joint_values(id).position);
    }
    EXPECT_LT(longest, 1 + 1e-4) << h;
    EXPECT_NEAR(fastest, std::sqrt(speed * speed + 2 * kGravity * 0.2), 4 * h) << h;
  }
}

// Two wheels on hinges, coupled: q1 + ratio q2 stays.
struct Gears {
  explicit Gears(Scalar ratio) {
    const BodyId ground = add_ground(world);
    const auto wheel = [&](const Vector3& half, const Vector3& place, const Vector3& axis) {
      const Matrix3 R = rotation_between(Vector3::UnitZ(), axis).toRotationMatrix();
      BodyDefinition body = dynamic_body("wheel", std::make_shared<Box>(half), place);
      body.initial.X_WB = RigidPose(R, place);
      const BodyId id = world.add_body(body);
      JointDefinition joint;
      joint.kind = JointKind::Hinge;
      joint.a = ground;
      joint.b = id;
      joint.X_AJ = RigidPose(R, place);
      hinges.push_back(world.add_joint(joint));
      inertias.push_back(body.mass_properties.I_BBcm(2, 2));
      wheels.push_back(id);
      return R;
    };
    const Matrix3 R = wheel({0.3, 0.2, 0.1}, {0, 0, 0}, {0, 1, 1});
    wheel({0.5, 0.4, 0.1}, {2, 0, 0}, {1, 0, -2});
    JointDefinition gear;
    gear.name = "gear";
    gear.kind = JointKind::Coupling;
    gear.first = hinges[0];
    gear.second = hinges[1];
    gear.ratio = ratio;
    coupling = world.add_joint(gear);
    axis_W = R.col(2);
  }
  World world;
  std::vector<JointId> hinges;
  std::vector<BodyId> wheels;
  std::vector<Scalar> inertias;
  JointId coupling;
  Vector3 axis_W;
};

TEST(JointLaws, GearsTurnAtTheirRatioAndDoNotSlip) {
  for (const Scalar h : kSteps) {
    for (const Scalar ratio : {2.5, -0.4}) {
      Gears gears(ratio);
      const Scalar carried = gears.inertias[0] + gears.inertias[1] / (ratio * ratio);
      const Vector3 torque_W = 10 * carried * gears.axis_W;
      gears.world.set_wrench(gears.wheels[0], [torque_W](Scalar, const MotionState&) {
        return Wrench{Vector3::Zero(), torque_W};
      });
      run_solved(gears.world, 2, h);
      const JointValues first = gears.world.joint_values(gears.hinges[0]);
      const JointValues second = gears.world.joint_values(gears.hinges[1]);
      EXPECT_NEAR(first.angle, 20, 1e-3);
      EXPECT_NEAR(first.angle_rate, 20, 1e-3);
      EXPECT_NEAR(second.angle, -20 / ratio, 1e-3);
      EXPECT_NEAR(gears.world.joint_values(gears.coupling).position, 0, 1e-5);
      // The second wheel is turned by the coupling alone: I2 a2.
      const Scalar turned = gears.world.joint_values(gears.coupling).torque_W.norm();
      EXPECT_NEAR(turned, gears.inertias[1] * 10 / std::abs(ratio), 1e-3 * turned);
    }
  }
}

TEST(JointLaws, ARackFallsAsFastAsItsWheelLetsIt) {
  constexpr Scalar kPitch = 0.25;
  for (const Scalar h : kSteps) {
    World world(earth_options());
    const BodyId ground = add_ground(world);
    const BodyId rack = world.add_body(
        dynamic_body("rack", std::make_shared<Box>(Vector3(0.05, 0.1, 0.4)), {0.5, 0, 0}));
    const BodyId wheel =
        world.add_body(dynamic_body("wheel", std::make_shared<Cylinder>(0.25, 0.1), {0, 0, 0}));
    JointDefinition slider;
    slider.kind = JointKind::Slider;
    slider.a = ground;
    slider.b = rack;
    slider.X_AJ = RigidPose(Vector3(0.5, 0, 0));
    JointDefinition hinge;
    hinge.kind = JointKind::Hinge;
    hinge.a = ground;
    hinge.b = wheel;
    JointDefinition mesh;
    mesh.kind = JointKind::Coupling;
    mesh.first = world.add_joint(slider);
    mesh.second = world.add_joint(hinge);
    mesh.ratio = kPitch;
    world.add_joint(mesh);
    const Scalar m = world.body(rack).mass_properties.mass;
    const Scalar I = world.body(wheel).mass_properties.I_BBcm(2, 2);
    const Scalar a = kGravity * m / (m + I / (kPitch * kPitch));
    run_solved(world, 1, h);
    EXPECT_NEAR(world.joint_values(mesh.first).position, -a / 2, 1e-4 * a);
    EXPECT_NEAR(world.joint_values(mesh.second).angle, a / 2 / kPitch, 1e-3 * a);
  }
}

// A nut on a screw of some lead: it turns as it falls.
TEST(JointLaws, ANutTurnsAsItRunsDownAScrew) {
  constexpr Scalar kLead = 0.05;  // length per radian
  for (const Scalar h : kSteps) {
    World world(earth_options());
    const BodyId ground = add_ground(world);
    const BodyId nut = world.add_body(
        dynamic_body("nut", std::make_shared<Box>(Vector3(0.2, 0.3, 0.1)), {0, 0, 0}));
    JointDefinition joint;
    joint.kind = JointKind::Cylindrical;
    joint.a = ground;
    joint.b = nut;
    JointDefinition thread;
    thread.kind = JointKind::Coupling;
    thread.first = thread.second = world.add_joint(joint);
    thread.ratio = 1 / kLead;
    world.add_joint(thread);
    const Scalar m = world.body(nut).mass_properties.mass;
    const Scalar I = world.body(nut).mass_properties.I_BBcm(2, 2);
    const Scalar a = kGravity / (1 + I / (m * kLead * kLead));
    run_solved(world, 3, h);
    const JointValues values = world.joint_values(thread.first);
    EXPECT_NEAR(values.position, -a * 9 / 2, 1e-3 * a);
    EXPECT_NEAR(values.angle, a * 9 / 2 / kLead, 1e-3 * a / kLead);
  }
}

// Atwood's machine: two crates on a rope over two rolls; the rope may also go slack.
TEST(JointLaws, APulleyLetsTheHeavierCrateDown) {
  for (const Scalar h : kSteps) {
    for (const bool is_rope : {false, true}) {
      World world(earth_options());
      const BodyId ground = add_ground(world);
      const auto hang = [&](Scalar x, Scalar size) {
        const BodyId body = world.add_body(
            dynamic_body("crate", std::make_shared<Box>(Vector3(0.2, 0.1, size)), {x, 0, -3}));
        JointDefinition line;
        line.kind = JointKind::Distance;
        line.a = ground;
        line.b = body;
        line.X_AJ = RigidPose(Vector3(x, 0, 0));
        line.limits = JointLimits{0, 100};
        return std::pair(world.add_joint(line), world.body(body).mass_properties.mass);
      };
      const auto [light, m1] = hang(0, 0.1);
      const auto [heavy, m2] = hang(2, 0.15);
      JointDefinition pulley;
      pulley.kind = JointKind::Coupling;
      pulley.first = light;
      pulley.second = heavy;
      if (is_rope) pulley.limits = JointLimits{0, 6};
      world.add_joint(pulley);
      const Scalar a = kGravity * (m2 - m1) / (m2 + m1);
      run_solved(world, 1, h);
      EXPECT_NEAR(world.joint_values(heavy).position, 3 + a / 2, 1e-4);
      EXPECT_NEAR(world.joint_values(light).position, 3 - a / 2, 1e-4);
      EXPECT_NEAR(world.joint_values(heavy).position_rate, a, 1e-3);
    }
  }
}

// A pendulum let go from level pulls with 3 m g cos(angle) at an angle from straight below (a thin
// arm: 1 + 2 m L^2 / I instead of 3).
TEST(JointLaws, AJointBreaksAtItsLoad) {
  for (const Scalar h : kSteps) {
    constexpr Scalar kArm = 0.8;
    Plank probe({}, kArm, earth_options(), Vector3::UnitY());
    const Scalar factor = 1 + 2 * probe.mass * kArm * kArm / probe.inertia;
    const Scalar weight = probe.mass * kGravity;
    // Most at the bottom: factor times the weight.
    JointDefinition strong;
    strong.break_force = 1.002 * factor * weight;
    Plank holds(strong, kArm, earth_options(), Vector3::UnitY());
    for (int k = 0; k < int(2 / h); ++k) {
      EXPECT_TRUE(holds.world.advance(h).broken_joints.empty());
    }
    JointDefinition weak;
    weak.break_force = 0.998 * factor * weight;
    Plank breaks(weak, kArm, earth_options(), Vector3::UnitY());
    std::vector<BrokenJoint> broken;
    for (int k = 0; k < int(2 / h) && broken.empty(); ++k) {
      broken = breaks.world.advance(h).broken_joints;
    }
    ASSERT_EQ(broken.size(), 1U) << h;
    EXPECT_EQ(broken[0].joint, breaks.hinge);
    EXPECT_EQ(broken[0].name, "axle");
    EXPECT_EQ(broken[0].b, breaks.id);
    EXPECT_NEAR(broken[0].force, factor * weight, 4e-3 * factor * weight);
    // Near the bottom.
    const Vector3 x_W = breaks.world.state(breaks.id).X_WB.rotation().col(0);
    EXPECT_LT(x_W.z(), -0.99);
    EXPECT_NE(message_of([&] { breaks.world.joint(breaks.hinge); }).find("no joint"),
              std::string::npos);
    // It flies on along a parabola.
    const MotionState before = breaks.world.state(breaks.id);
    run_solved(breaks.world, 0.2, h);
    const MotionState after = breaks.world.state(breaks.id);
    EXPECT_NEAR(after.X_WB.translation().z(),
                before.X_WB.translation().z() + 0.2 * before.twist.v_WB.z() - kGravity * 0.02,
                1e-6);
  }
}

// A board clamped at its end breaks where its own weight bends it.
TEST(JointLaws, AClampBreaksAtItsTorque) {
  for (const Scalar h : kSteps) {
    for (const Scalar part : {0.99, 1.01}) {
      World world(earth_options());
      const BodyId ground = add_ground(world);
      const BodyId board = world.add_body(
          dynamic_body("board", std::make_shared<Box>(Vector3(0.5, 0.1, 0.05)), {0.6, 0, 0}));
      JointDefinition clamp;
      clamp.kind = JointKind::Fixed;
      clamp.a = ground;
      clamp.b = board;
      clamp.X_BJ = RigidPose(Vector3(-0.6, 0, 0));
      clamp.break_torque = part * world.body(board).mass_properties.mass * kGravity * 0.6;
      world.add_joint(clamp);
      std::size_t broken = 0;
      for (int k = 0; k < 50; ++k) broken += world.advance(h).broken_joints.size();
      EXPECT_EQ(broken, part < 1 ? 1U : 0U) << part;
      EXPECT_EQ(world.joints().size(), part < 1 ? 0U : 1U);
    }
  }
}

TEST(JointLaws, ACouplingGoesWithItsJoints) {
  Gears gears(2);
  EXPECT_EQ(gears.world.joints().size(), 3U);
  gears.world.remove_joint(gears.hinges[1]);
  EXPECT_EQ(gears.world.joints(), (std::vector<JointId>{gears.hinges[0]}));
  run_solved(gears.world, 0.1, 0.01);
}

TEST(JointLaws, ASnapshotKeepsTurnsAndCouplings) {
  Gears gears(3);
  const Vector3 torque_W = 20 * gears.inertias[0] * gears.axis_W;
  gears.world.set_wrench(gears.wheels[0], [torque_W](Scalar, const MotionState&) {
    return Wrench{Vector3::Zero(), torque_W};
  });
  run_solved(gears.world, 2, 0.01);
  const WorldSnapshot snapshot = gears.world.snapshot();
  run_solved(gears.world, 1, 0.01);
  const JointValues values = gears.world.joint_values(gears.hinges[1]);
  gears.world.restore(snapshot);
  run_solved(gears.world, 1, 0.01);
  EXPECT_EQ(gears.world.joint_values(gears.hinges[1]).angle, values.angle);
  EXPECT_LT(values.angle, -2 * kPi);
}

TEST(JointLaws, RefusesWhatCannotBe) {
  World world;
  const BodyId ground = add_ground(world);
  const auto box = std::make_shared<Box>(Vector3(0.1, 0.1, 0.1));
  std::vector<BodyId> bodies;
  std::vector<JointId> balls;
  std::vector<JointId> hinges;
  for (int k = 0; k < 3; ++k) {
    bodies.push_back(world.add_body(dynamic_body("box", box, {Scalar(k), 0, 0})));
    JointDefinition joint;
    joint.kind = JointKind::Hinge;
    joint.a = k == 0 ? ground : bodies[std::size_t(k) - 1];
    joint.b = bodies.back();
    hinges.push_back(world.add_joint(joint));
    joint.kind = JointKind::Ball;
    balls.push_back(world.add_joint(joint));
  }
  JointDefinition joint;
  joint.name = "knee";
  joint.a = bodies[0];
  joint.b = bodies[1];
  const auto refuses = [&](const char* what) {
    const std::string message = message_of([&] { world.add_joint(joint); });
    EXPECT_NE(message.find(what), std::string::npos) << message << " for " << what;
  };
  joint.swing_twist = SwingTwistLimits{0, -1, 1};
  refuses("joint 'knee': the limit of a swing must be in (0, pi), not 0");
  joint.swing_twist = SwingTwistLimits{1, 1, -1};
  refuses("limits of a twist must be in order");
  joint.kind = JointKind::Hinge;
  refuses("only a ball can have limits of swing and twist");
  joint.swing_twist.reset();
  joint.motor = JointMotor{1, kInfinity};
  refuses("finite without gains");
  joint.motor = servo(1, -1, 0, 5);
  refuses("gains must be finite and >= 0, not -1");
  joint.motor = servo(1, 0, 1, 5);
  refuses("a motor has a position with a stiffness > 0");
  joint.motor.reset();
  joint.friction = -1;
  refuses("friction must be finite and >= 0, not -1");
  joint.friction = 1;
  joint.kind = JointKind::Fixed;
  refuses("only a joint that turns or slides can have friction");
  joint.friction = 0;
  joint.break_force = 0;
  refuses("at which it breaks must be > 0, not 0");
  joint.break_force = kInfinity;
  joint.kind = JointKind::Distance;
  joint.limits = JointLimits{0, 0};
  refuses("a distance must be > 0");
  joint.limits.reset();
  joint.kind = JointKind::Coupling;
  joint.first = balls[0];
  joint.second = hinges[0];
  refuses("couples a joint that has no coordinate");
  joint.first = hinges[0];
  joint.second = hinges[2];
  refuses("couples joints of 3 bodies that are not static");
  joint.second = hinges[0];
  joint.ratio = 0;
  refuses("the ratio must be finite and not 0");
  EXPECT_EQ(world.joints().size(), 6U);
}

}  // namespace
}  // namespace dyop
