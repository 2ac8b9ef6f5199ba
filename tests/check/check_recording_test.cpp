// SPDX-License-Identifier: BSD-3-Clause

// Verdicts of dyop-check on recorded runs: of Worlds, which are right, and of motions that are
// made up, which are wrong by as much as the test says.

#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <sstream>

#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/half_space.h"
#include "dyop/geometry/primitives.h"
#include "dyop/io/recording.h"
#include "dyop/io/recording_lines.h"
#include "dyop/io/scene_file.h"
#include "dyop/motion/bezier_motion.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/sampled_motion.h"
#include "dyop/motion/steady_motions.h"
#include "support/check_answer.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/world_scenes.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

using testing::Answer;
using testing::check;
using testing::kProven;
using testing::kRefuted;
using testing::kUnusable;

WorldOptions recorded_options() {
  WorldOptions options = testing::earth_options();
  options.records_impulses = true;
  return options;
}

class CheckRecording : public ::testing::Test {
 protected:
  std::filesystem::path file() const { return directory_.path() / "run.h5"; }

  void expect_lawful() const {
    const Answer answer = check(file());
    EXPECT_EQ(answer.code, kProven) << answer.text << answer.error;
    EXPECT_NE(answer.text.find("contact    holds"), std::string::npos) << answer.text;
  }

  // A mover above a body at rest at the origin, target 0.01.
  void record(std::shared_ptr<const Shape> mover, std::shared_ptr<const Shape> rester,
              const std::vector<CommittedStep>& steps, const std::string& scene = "",
              Scalar target_distance = 0.01) const {
    std::vector<BodyDefinition> bodies(2);
    bodies[0].name = mover_name_;
    bodies[0].shape = std::move(mover);
    bodies[1].name = "rester";
    bodies[1].kind = BodyKind::Static;
    bodies[1].shape = std::move(rester);
    RunHeader header;
    header.scene = scene;
    header.target_distance = target_distance;
    RecordingWriter writer(file(), header);
    AdvanceReport report;
    report.status = AdvanceStatus::Completed;
    report.t = steps.back().interval.end;
    report.steps = steps;
    writer.write(report, bodies);
    writer.finish();
  }

  // Down to `lowest` at half time, along a parabola, while it turns about z by an angle.
  static CommittedStep swing(Scalar lowest, Scalar turn, Scalar begin = 0) {
    const auto node = [&](Scalar sign) {
      HermiteNode result;
      result.p_WB = Vector3(0, 0, lowest + 1);
      result.v_WB = Vector3(0, 0, 4 * sign);
      result.theta = Vector3(0, 0, sign > 0 ? turn : 0);
      result.theta_rate = Vector3(0, 0, turn);
      return result;
    };
    const TimeInterval interval{begin, begin + 1};
    CommittedStep step;
    step.interval = interval;
    step.motions = {std::make_shared<HermiteMotion>(HermiteMotion::from_chart(
                        interval, Matrix3::Identity(), node(-1), node(1))),
                    std::make_shared<RestMotion>(RigidPose())};
    return step;
  }

  testing::TemporaryDirectory directory_;
  std::string mover_name_ = "mover";
};

TEST_F(CheckRecording, ProvesRunsOfWorlds) {
  for (const auto& [kind, n] : std::vector<std::pair<const char*, int>>{
           {"arch", 5}, {"cards", 1}, {"pile", 4}, {"cradle", 3}, {"gears", 2}, {"domino", 3}}) {
    const std::filesystem::path scene_file = directory_.path() / "scene.json";
    write_generated_scene(generate_scene(kind, n), scene_file);
    Scene scene = load_scene(scene_file);
    scene.options.records_impulses = true;
    World world = make_world(scene);
    {
      RecordingWriter writer(file(), run_header(scene));
      for (int k = 0; k < 60; ++k) writer.write(world.advance(scene.step), world);
      writer.finish();
    }
    const Answer answer = check(file());
    EXPECT_EQ(answer.code, kProven) << kind << '\n' << answer.text << answer.error;
    EXPECT_NE(answer.text.find("geometry   proven"), std::string::npos) << answer.text;
    EXPECT_NE(answer.text.find("flight     holds"), std::string::npos) << kind << answer.text;
    EXPECT_NE(answer.text.find("contact    holds"), std::string::npos) << kind << answer.text;
  }
}

// A ball that swings down to a half-space, as the mover or as the rester.
// Default distances go by the size of a shape, not by how far it is from its frame's origin.
TEST_F(CheckRecording, ProvesRunsOfShapesFarFromTheirOrigins) {
  const auto box = std::make_shared<Box>(Vector3(0.2, 0.15, 0.1));
  const Vector3 p(3, 4, 0);
  World world(recorded_options());
  world.add_body(testing::floor_body(0.5));
  BodyDefinition body;
  body.shape = std::make_shared<CompoundShape>(std::vector<CompoundChild>{{box, RigidPose(p)}});
  body.mass_properties = box->compute_mass_properties(1000);
  body.mass_properties.p_BoBcm = p;
  body.initial.X_WB = RigidPose(Vector3(0, 0, 0.12) - p);
  world.add_body(body);
  {
    RecordingWriter writer(file(), RunHeader{});
    for (int k = 0; k < 30; ++k) writer.write(world.advance(0.01), world);
    writer.finish();
  }
  expect_lawful();
}

TEST_F(CheckRecording, KnowsHalfSpaces) {
  const auto ball = std::make_shared<Sphere>(1);
  const auto floor = std::make_shared<HalfSpace>(Vector3(0, 0, 2), 3);
  record(ball, floor, {swing(4.011, 1)});
  EXPECT_EQ(check(file()).code, kProven) << check(file()).text << check(file()).error;
  record(ball, floor, {swing(4.009, 1)});
  EXPECT_EQ(check(file()).code, kRefuted);
  record(ball, floor, {swing(-40, 1)});
  EXPECT_EQ(check(file()).code, kRefuted);
  const auto ceiling = std::make_shared<HalfSpace>(Vector3(0, 0, -1), 0);  // z >= 0, in its frame
  record(ceiling, ball, {swing(1.011, 0)});
  EXPECT_EQ(check(file()).code, kProven) << check(file()).text << check(file()).error;
  record(ceiling, ball, {swing(1.009, 0)});
  EXPECT_EQ(check(file()).code, kRefuted);
  record(ceiling, ball, {swing(1.011, 2)});  // it turns in its own plane
  EXPECT_EQ(check(file()).code, kProven) << check(file()).text << check(file()).error;
  // A plane that leans: it is nearest when lowest, at 0.8 of its height above the ball.
  const auto leaning = std::make_shared<HalfSpace>(Vector3(0.6, 0, -0.8), 0);
  record(leaning, ball, {swing(1.264, 1)});
  EXPECT_EQ(check(file()).code, kProven) << check(file()).text << check(file()).error;
  record(leaning, ball, {swing(1.261, 1)});
  EXPECT_EQ(check(file()).code, kRefuted);
}

// Whose lowest points are one below their origins.
TEST_F(CheckRecording, KnowsRoundedAndTaperedShapes) {
  const auto floor = std::make_shared<HalfSpace>();
  const std::vector<Vector3> points{Vector3(1, 0, -0.5), Vector3(-1, 0, -0.5), Vector3(0, 1, -0.5)};
  const std::vector<std::shared_ptr<const Shape>> movers{
      std::make_shared<ConvexHull>(points, 0.5), std::make_shared<RoundedCylinder>(1, 0.8, 0.2),
      std::make_shared<TaperedCapsule>(0.6, 0.3, 0.4)};
  for (const auto& mover : movers) {
    record(mover, floor, {swing(1.011, 1)});
    EXPECT_EQ(check(file()).code, kProven) << check(file()).text << check(file()).error;
    record(mover, floor, {swing(1.009, 1)});
    EXPECT_EQ(check(file()).code, kRefuted);
  }
}

// A box that slides, a ball that bounces and a spinning rod that falls beside them.
World sliding_world(WorldOptions options = testing::earth_options()) {
  options.records_impulses = true;
  World world(options);
  world.add_body(testing::floor_body(0.5, 0.3));
  const auto box = std::make_shared<Box>(Vector3(0.5, 0.5, 0.5));
  world.add_body(testing::dynamic_body("box", box, {0, 0, 0.5005}, {1, 0.3, 0}, {0, 0, 0}));
  const auto ball = std::make_shared<Sphere>(0.3);
  BodyDefinition bouncing = testing::dynamic_body("ball", ball, {3, 0, 0.4}, {0, 0, -2}, {0, 3, 0});
  bouncing.restitution = 0.6;
  world.add_body(bouncing);
  const auto rod = std::make_shared<Capsule>(0.1, 0.5);
  world.add_body(testing::dynamic_body("rod", rod, {0, 4, 3}, {0, 0, 1}, {4, 1, 2}));
  return world;
}

// Changes what is recorded of the run above; null: nothing.
using Forgery = std::function<void(AdvanceReport&)>;

TEST_F(CheckRecording, FindsForgedImpulsesAndVelocities) {
  using Kind = VelocityChangeKind;
  const auto first = [](AdvanceReport& report, Kind kind, auto change_it) {
    for (VelocityChange& change : report.velocity_changes) {
      if (change.kind == kind && !change.contacts.empty()) return change_it(change);
    }
  };
  const std::vector<std::pair<const char*, Forgery>> forgeries{
      {"impulse",
       [&](AdvanceReport& report) {
         first(report, Kind::Move, [](auto& c) { c.contacts[0].impulse_W.z() *= 1 + 1e-6; });
       }},
      {"place",
       [&](AdvanceReport& report) {
         first(report, Kind::End, [](auto& c) { c.contacts[0].p_W.x() += 1e-6; });
       }},
      {"missing",
       [&](AdvanceReport& report) {
         first(report, Kind::End, [](auto& c) { c.contacts.pop_back(); });
       }},
      {"velocity",
       [&](AdvanceReport& report) {
         first(report, Kind::End, [](auto& c) { c.bodies[0].v_W.y() += 1e-6; });
       }},
      {"turn",
       [&](AdvanceReport& report) {
         first(report, Kind::Move, [](auto& c) { c.bodies[0].L_W.z() += 1e-6; });
       }},
      {"friction",
       [&](AdvanceReport& report) {
         first(report, Kind::Move, [](auto& c) { c.contacts[0].friction *= 1.01; });
       }},
      {"cone",
       [&](AdvanceReport& report) {
         // Both bodies agree, and momentum balances: only Coulomb's law is broken.
         first(report, Kind::End, [](VelocityChange& c) {
           const Scalar more = c.contacts[0].impulse_W.norm();
           c.contacts[0].impulse_W.x() += more;
           for (MomentumChange& body : c.bodies) {
             if (body.body == c.contacts[0].b) body.v_W.x() += more;
             if (body.body == c.contacts[0].a) body.v_W.x() -= more;
           }
         });
       }},
      {"restitution", [&](AdvanceReport& report) {
         first(report, Kind::Impact, [](auto& c) { c.contacts[0].target *= 1.5; });
       }}};
  const auto run = [&](const Forgery& forgery) {
    World world = sliding_world();
    RecordingWriter writer(file(), {});
    for (int k = 0; k < 60; ++k) {
      AdvanceReport report = world.advance(1.0 / 64);
      if (forgery && k >= 3) forgery(report);
      writer.write(report, world);
    }
    writer.finish();
    return check(file());
  };
  const Answer honest = run(nullptr);
  EXPECT_EQ(honest.code, kProven) << honest.text << honest.error;
  for (const auto& [name, forgery] : forgeries) {
    const Answer forged = run(forgery);
    EXPECT_EQ(forged.code, kRefuted) << name << '\n' << forged.text << forged.error;
    EXPECT_NE(forged.text.find("contact    FAILS"), std::string::npos) << name << forged.text;
    EXPECT_NE(forged.text.find("geometry   proven"), std::string::npos) << name << forged.text;
  }
}

// A body that is moved beside its velocity by more than gaps could need, while impulses explain all
// velocities: a joint's, at the start of a substep and back at its end.
TEST_F(CheckRecording, RefutesRecoveryThatNothingNeeds) {
  for (const Scalar speed : {0.1, 5.0}) {
    World world = sliding_world();
    const BodyId floor = world.bodies()[0];
    const BodyId box = world.bodies()[1];
    const Vector3 kick = speed * world.body(box).mass_properties.mass * Vector3::UnitX();
    RecordingWriter writer(file(), {});
    for (int k = 0; k < 10; ++k) {
      AdvanceReport report = world.advance(1.0 / 64);
      for (VelocityChange& change : report.velocity_changes) {
        if (k != 5 || change.kind == VelocityChangeKind::Impact) continue;
        const bool is_move = change.kind == VelocityChangeKind::Move;
        for (MomentumChange& body : change.bodies) {
          if (body.body != box) continue;
          (is_move ? body.v_W : body.v_before_W).x() += speed;
          change.links.push_back({LinkImpulse::Kind::Joint, floor, box, (is_move ? 1 : -1) * kick});
        }
      }
      writer.write(report, world);
    }
    writer.finish();
    const Answer answer = check(file());
    EXPECT_EQ(answer.code, speed > 1 ? kRefuted : kProven) << answer.text << answer.error;
    EXPECT_EQ(
        answer.text.find("FAULT: box at t = 0.078125: its way in a substep differs by 0.078") !=
            std::string::npos,
        speed > 1)
        << answer.text;
  }
}

// Every kind of joint, a little open and turned, closes by more than gaps would need.
TEST_F(CheckRecording, AllowsJointsToClose) {
  using enum JointKind;
  for (const JointKind kind : {Ball, Hinge, Slider, Fixed, Distance, Universal, Cylindrical}) {
    WorldOptions options;
    options.records_impulses = true;
    World world(options);
    const auto box = std::make_shared<Box>(Vector3(0.5, 0.4, 0.3));
    JointDefinition joint;
    joint.kind = kind;
    joint.a = world.add_body(testing::dynamic_body("a", box, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}));
    joint.b = world.add_body(testing::dynamic_body("b", box, {2, 0, 0}, {0, 0, 0}, {0, 0, 0}));
    joint.X_AJ = RigidPose(Quaternion(Eigen::AngleAxisd(0.03, Vector3(1, 2, 2) / 3)), {1, 0, 0});
    joint.X_BJ = RigidPose(Vector3(-0.99, 0.02, 0));
    if (kind == Distance) joint.limits = JointLimits{0.05, 0.05};
    if (kind == Universal) joint.X_BJ = RigidPose(joint.X_BJ.translation());
    world.add_joint(joint);
    RecordingWriter writer(file(), {});
    for (int k = 0; k < 5; ++k) writer.write(world.advance(0.01), world);
    writer.finish();
    const Answer answer = check(file());
    EXPECT_EQ(answer.code, kProven) << int(kind) << answer.text << answer.error;
    const std::size_t at = answer.text.find("recovery of gaps and joints");
    ASSERT_NE(at, std::string::npos) << answer.text << answer.error;
    EXPECT_GT(std::stod(answer.text.substr(at + 27)), 1e-3) << int(kind);
  }
}

// Two links straight between two posts, whose joints are in a singular position.
TEST_F(CheckRecording, ProvesATrussThatStands) {
  World world(recorded_options());
  const auto add = [&](const char* name, std::shared_ptr<const Shape> shape, Scalar x) {
    BodyDefinition body =
        testing::dynamic_body(name, std::move(shape), {x, 0, 0}, {0, 0, 0}, {0, 0, 0});
    body.filter.mask = 0;
    body.initial.X_WB = RigidPose(Quaternion(std::sqrt(0.5), 0, std::sqrt(0.5), 0), {x, 0, 0});
    if (x == 0 || x == 2) body.kind = BodyKind::Static;
    return world.add_body(body);
  };
  const auto post = std::make_shared<Sphere>(0.01);
  const auto link = std::make_shared<Capsule>(0.01, 0.488);
  const std::vector<BodyId> bodies{add("left", post, 0), add("link 0", link, 0.5),
                                   add("link 1", link, 1.5), add("right", post, 2)};
  for (std::size_t k = 0; k < 3; ++k) {
    JointDefinition joint;
    joint.a = bodies[k];
    joint.b = bodies[k + 1];
    joint.X_AJ = RigidPose(Vector3(0, 0, k == 0 ? 0 : 0.5));
    joint.X_BJ = RigidPose(Vector3(0, 0, k == 2 ? 0 : -0.5));
    world.add_joint(joint);
  }
  RecordingWriter writer(file(), {});
  for (int k = 0; k < 10; ++k) writer.write(world.advance(0.02), world);
  writer.finish();
  const Answer answer = check(file());
  EXPECT_EQ(answer.code, kProven) << answer.text << answer.error;
  EXPECT_NE(answer.text.find("contact    holds"), std::string::npos) << answer.text;
}

// A rope over a pulley pulls both its bodies up.
TEST_F(CheckRecording, KnowsWhatCouplingsDo) {
  World world(recorded_options());
  const auto ball = std::make_shared<Sphere>(0.1);
  BodyDefinition roller = testing::dynamic_body("roller", ball, {0, 0, 2}, {0, 0, 0}, {0, 0, 0});
  roller.kind = BodyKind::Static;
  const BodyId post = world.add_body(roller);
  JointDefinition pulley;
  pulley.kind = JointKind::Coupling;
  for (const Scalar x : {-0.5, 0.5}) {
    BodyDefinition bob = testing::dynamic_body("bob", ball, {x, 0, 0}, {0, 0, 0}, {0, 0, 0});
    bob.mass_properties = ball->compute_mass_properties(x < 0 ? 1 : 2);
    JointDefinition rope;
    rope.kind = JointKind::Distance;
    rope.a = post;
    rope.b = world.add_body(bob);
    rope.X_AJ = RigidPose(Vector3(x, 0, 0));
    rope.limits = JointLimits{0, 10};
    (x < 0 ? pulley.first : pulley.second) = world.add_joint(rope);
  }
  world.add_joint(pulley);
  RecordingWriter writer(file(), {});
  for (int k = 0; k < 20; ++k) writer.write(world.advance(0.01), world);
  writer.finish();
  expect_lawful();
}

// A joint that breaks while its bodies overlap: until then the pair does not count.
TEST_F(CheckRecording, KnowsWhenAJointBreaks) {
  World world(recorded_options());
  const auto ball = std::make_shared<Sphere>(0.5);
  BodyDefinition post = testing::dynamic_body("post", ball, {0, 0, 0}, {0, 0, 0}, {0, 0, 0});
  post.kind = BodyKind::Static;
  JointDefinition joint;
  joint.kind = JointKind::Fixed;
  joint.a = world.add_body(post);
  joint.b = world.add_body(testing::dynamic_body("bob", ball, {0, 0, -0.9}, {0, 0, 0}, {0, 0, 0}));
  joint.X_AJ = RigidPose(Vector3(0, 0, -0.9));
  joint.break_force = 2 * 9.81 * world.body(joint.b).mass_properties.mass;
  world.add_joint(joint);
  RecordingWriter writer(file(), {});
  std::size_t broken = 0;
  for (int k = 0; k < 20; ++k) {
    if (k == 10) world.set_gravity(3 * world.gravity());
    const AdvanceReport report = world.advance(0.01);
    broken += report.broken_joints.size();
    writer.write(report, world);
  }
  writer.finish();
  EXPECT_EQ(broken, 1U);
  expect_lawful();
}

// Rules between bodies, a teleport, another material, a body in the slot of one that was removed:
// all of a World that no scene file describes.
TEST_F(CheckRecording, KnowsTheRulesOfAWorld) {
  World world = sliding_world();
  const auto ball = std::make_shared<Sphere>(0.3);
  const BodyId ghost =
      world.add_body(testing::dynamic_body("ghost", ball, {0, 0, 0.5}, {0, 0, 0}, {0, 0, 1}));
  const std::vector<BodyId> ids = world.bodies();
  for (const BodyId id : ids) {
    if (id != ghost) world.set_pair_enabled(ghost, id, false);
  }
  world.set_target_distance(ids[0], ids[2], 1e-3);
  RecordingWriter writer(file(), {});
  const auto step = [&](int count) {
    for (int k = 0; k < count; ++k) writer.write(world.advance(1.0 / 64), world);
  };
  step(10);
  MotionState state = world.state(ids[3]);
  state.X_WB = RigidPose(Vector3(-3, 4, 2));
  world.set_state(ids[3], state);
  world.set_material(ids[1], {0.2, 0.1, 0, 0});
  step(10);
  world.remove_body(ids[2]);
  world.add_body(testing::dynamic_body("new", ball, {6, 0, 1}, {0, 0, 0}, {0, 0, 1}));
  world.set_gravity({0, 0, -5});
  step(30);
  writer.finish();
  const Answer answer = check(file());
  EXPECT_EQ(answer.code, kProven) << answer.text << answer.error;
  EXPECT_EQ(answer.text.find("no rules"), std::string::npos) << answer.text;
}

// Coefficients that follow other rules, or are given for a pair.
TEST_F(CheckRecording, KnowsHowMaterialsCombine) {
  for (const CombineRule rule : {CombineRule::Mean, CombineRule::Product, CombineRule::Minimum,
                                 CombineRule::Maximum, CombineRule::GeometricMean}) {
    for (const bool is_forged : {false, true}) {
      WorldOptions options = testing::earth_options();
      options.combine_friction = rule;
      options.combine_restitution = rule;
      World world = sliding_world(options);
      const std::vector<BodyId> ids = world.bodies();
      RecordingWriter writer(file(), {});
      for (int k = 0; k < 40; ++k) {
        if (k == 20) world.set_pair_material(ids[1], ids[0], Material{0.9, 0.05, 0, 0});
        AdvanceReport report = world.advance(1.0 / 64);
        for (VelocityChange& change : report.velocity_changes) {
          for (auto& contact : change.contacts) contact.friction *= is_forged ? 1 + 1e-6 : 1;
        }
        writer.write(report, world);
      }
      writer.finish();
      const Answer answer = check(file());
      EXPECT_EQ(answer.code, is_forged ? kRefuted : kProven) << answer.text << answer.error;
    }
  }
}

// A body that becomes heavier, off centre and larger while it slides, and one that is tumbling.
TEST_F(CheckRecording, FollowsBodiesWhoseMassAndShapeChange) {
  World world = sliding_world();
  const std::vector<BodyId> ids = world.bodies();
  std::vector<RigidPose> poses;
  const auto step = [&](RecordingWriter& writer, int count) {
    for (int k = 0; k < count; ++k) {
      writer.write(world.advance(1.0 / 64), world);
      poses.push_back(world.state(ids[3]).X_WB);
    }
  };
  {
    RecordingWriter writer(file(), {});
    step(writer, 10);
    const auto larger = std::make_shared<Box>(Vector3(0.6, 0.6, 0.5));
    world.set_shape(ids[1], larger);
    world.set_mass_properties(ids[1], with_mass(larger->compute_mass_properties(1), 7));
    MassProperties heavy = world.body(ids[3]).mass_properties;
    heavy.p_BoBcm = Vector3(0, 0.02, 0.2);
    heavy.mass *= 3;
    world.set_mass_properties(ids[3], heavy);
    step(writer, 30);
    writer.finish();
  }
  const Answer answer = check(file());
  EXPECT_EQ(answer.code, kProven) << answer.text << answer.error;
  EXPECT_NE(answer.text.find("contact    holds"), std::string::npos) << answer.text;
  const RecordingReader reader(file());
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const RigidPose read = reader.pose(ids[3], reader.frames()[k].interval.end);
    EXPECT_LT((read.translation() - poses[k].translation()).norm(), 1e-12) << k;
  }
}

// Two boxes that begin too near are told, and again when they are far enough apart: from then on
// they must keep their distance.
TEST_F(CheckRecording, HoldsPairsToTheirDistanceOnceTheyHaveParted) {
  WorldOptions options;
  options.records_impulses = true;
  World world(options);
  const auto box = std::make_shared<Box>(Vector3(0.5, 0.5, 0.5));
  world.add_body(testing::dynamic_body("left", box, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}));
  world.add_body(testing::dynamic_body("right", box, {1.00001, 0, 0}, {0, 0, 0}, {0, 0, 0}));
  RecordingWriter writer(file(), {});
  std::size_t near = 0;
  std::size_t parted = 0;
  for (int k = 0; k < 40; ++k) {
    const AdvanceReport report = world.advance(0.01);
    near += report.too_near.size();
    parted += report.parted.size();
    writer.write(report, world);
  }
  writer.finish();
  EXPECT_EQ(near, 1U);
  EXPECT_EQ(parted, 1U);
  const Answer answer = check(file());
  EXPECT_EQ(answer.code, kProven) << answer.text << answer.error;
}

// Of two that overlap and are slowly pushed out, none is told to have parted while it is free, but
// nearer than its distance.
TEST_F(CheckRecording, SlowPartingEndsAtTheTargetDistance) {
  WorldOptions options;
  options.separation_speed = 1e-3;
  World world(options);
  const auto box = std::make_shared<Box>(Vector3(0.5, 0.5, 0.5));
  world.add_body(testing::dynamic_body("left", box, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}));
  world.add_body(testing::dynamic_body("right", box, {0.99998, 0, 0}, {0, 0, 0}, {0, 0, 0}));
  RecordingWriter writer(file(), {});
  std::size_t parted = 0;
  for (int k = 0; k < 60; ++k) {
    const AdvanceReport report = world.advance(0.01);
    parted += report.parted.size();
    writer.write(report, world);
  }
  writer.finish();
  EXPECT_EQ(parted, 1U);
  const Answer answer = check(file());
  EXPECT_EQ(answer.code, kProven) << answer.text << answer.error;
}

// A body that is added beside one that collides with nothing, and one in a slot that was empty when
// the recording began.
TEST_F(CheckRecording, KnowsFiltersOfBodiesThatComeLater) {
  World world;
  const auto ball = std::make_shared<Sphere>(0.5);
  const auto add = [&](Scalar x) {
    return world.add_body(testing::dynamic_body("ball", ball, {x, 0, 0}, {0, 0, 0}, {0, 0, 0}));
  };
  add(0);
  const BodyId gone = add(5);
  add(10);
  world.set_filter(world.bodies().front(), CollisionFilter{1, 0, 0});
  world.remove_body(gone);
  RecordingWriter writer(file(), {});
  writer.write(world.advance(0.01), world);
  add(0.2);
  writer.write(world.advance(0.01), world);
  add(10.3);
  const AdvanceReport report = world.advance(0.01);
  EXPECT_EQ(report.too_near.size(), 1U);
  writer.write(report, world);
  writer.finish();
  const Answer answer = check(file());
  EXPECT_EQ(answer.code, kProven) << answer.text << answer.error;
  EXPECT_NE(answer.text.find("not proven for 1 pairs"), std::string::npos) << answer.text;
}

// Far at both ends of the step; nearer than the target in between by a millionth.
TEST_F(CheckRecording, RefutesADipWithinAStep) {
  const auto ball = std::make_shared<Sphere>(0.5);
  const auto plate = std::make_shared<Box>(Vector3(2, 2, 0.1));
  const auto cube = std::make_shared<Box>(Vector3(0.5, 0.4, 0.3));
  const auto can = std::make_shared<Cylinder>(0.4, 0.3);
  const std::vector<std::tuple<std::shared_ptr<const Shape>, Scalar, Scalar>> movers{
      {ball, 0.5, 3}, {cube, 0.3, 2}, {can, 0.3, 1}};
  for (const auto& [mover, height, turn] : movers) {
    const Scalar touching = 0.1 + height;
    record(mover, plate, {swing(touching + 0.01 + 1e-6, turn)});
    const Answer kept = check(file());
    EXPECT_EQ(kept.code, kProven) << kept.text << kept.error;
    record(mover, plate, {swing(touching + 0.01 - 1e-6, turn)});
    const Answer dipped = check(file());
    EXPECT_EQ(dipped.code, kRefuted) << dipped.text << dipped.error;
    EXPECT_NE(dipped.text.find("refuted: mover and rester are at most 0.00999"), std::string::npos)
        << dipped.text;
    EXPECT_EQ(check(file(), 0).code, kProven);  // but nothing touched
    record(mover, plate, {swing(touching - 1e-6, turn)});
    EXPECT_EQ(check(file(), 0).code, kRefuted);
  }
}

// Controls of a terminal, in ASCII (which recordings hold as JSON's escapes) and in UTF-8, and what
// turns the order of text around.
TEST_F(CheckRecording, NamesCannotSteerTheTerminal) {
  mover_name_ =
      "a\x1b[31m b\xc2\x9b"
      "c\xe2\x80\xae"
      "d\xe2\x81\xa6"
      "e\xc3\xa9";
  const auto ball = std::make_shared<Sphere>(0.5);
  record(ball, std::make_shared<Box>(Vector3(2, 2, 0.1)), {swing(0.6 + 0.01 - 1e-6, 3)});
  const Answer dipped = check(file());
  EXPECT_EQ(dipped.code, kRefuted) << dipped.text << dipped.error;
  EXPECT_NE(dipped.text.find("refuted: a\\u001b[31m b?c?d?e\xc3\xa9 and rester"), std::string::npos)
      << dipped.text;
}

// A ball beside a rod that follows each kind of prescribed motion, far from the origin too, and
// that would touch it otherwise.
TEST_F(CheckRecording, KnowsPrescribedMotions) {
  const RigidPose X(rotation_from_vector(Vector3(0.3, -0.2, 0.9)), Vector3(5, 0.1, 0.2));
  const RigidPose Y(rotation_from_vector(Vector3(1.2, 0.4, 0.5)), Vector3(5.2, 0.4, 0.1));
  const TimeInterval second{0, 1};
  const auto screw =
      std::make_shared<ScrewMotion>(X, ScrewMotion::Screw{{5, 0, -1}, {0.1, 0, 1}, 2, 0.1});
  const auto straight = std::make_shared<InterpolatedMotion>(second, X, Y);
  const auto twist = std::make_shared<ConstantTwistMotion>(X, Twist{{0.1, 0, 0}, {0, 2, 0.3}}, 0);
  const auto curve = std::make_shared<BezierMotion>(
      second, X.rotation(),
      std::vector<ControlPoint>{
          {X.translation(), {}}, {{5, 0.3, 0}, {1, 0, 0}}, {{5.1, 0, 0}, {}}});
  const auto log = std::make_shared<SampledMotion>(
      std::vector<SampledMotion::Sample>{{-1, X}, {0.3, Y}, {0.6, X}, {2, Y}});
  const auto parts = std::make_shared<SequenceMotion>(std::vector<SequenceMotion::Part>{
      {{0, 0.5}, std::make_shared<InterpolatedMotion>(TimeInterval{0, 0.5}, X, Y)},
      {{0.5, 1}, std::make_shared<RestMotion>(Y)}});
  const auto offset = std::make_shared<RestMotion>(
      RigidPose(rotation_from_vector(Vector3(0, 1, 0.5)), Vector3(0.1, 0, 0.2)));
  std::vector<std::shared_ptr<const Motion>> motions{screw, straight, twist, curve, log, parts};
  std::vector<ControlPoint> points;
  for (int k = 0; k < 10; ++k) points.push_back({{5, 0.1 * (k % 4), 0}, {0.3 * (k % 3), 0, 0.2}});
  motions.push_back(std::make_shared<BezierMotion>(second, X.rotation(), points));
  for (std::size_t k = 0; k < 7; ++k) {
    motions.push_back(
        std::make_shared<ComposedMotion>(k % 2 ? motions[k] : offset, k % 2 ? offset : motions[k]));
    motions.push_back(std::make_shared<ComposedMotion>(twist, motions[k]));
  }
  const auto rod = std::make_shared<Capsule>(0.1, 0.4);
  for (const auto& motion : motions) {
    // The ball's middle is 0.7 from a point of the rod's axis, all along; or 0.45 in one place.
    for (const bool is_near : {false, true}) {
      CommittedStep step;
      step.interval = second;
      step.motions = {motion, std::make_shared<RestMotion>(RigidPose(Vector3(100, 0, 0)))};
      if (is_near) {
        const RigidPose at = motion->pose(0.7);
        step.motions[1] =
            std::make_shared<RestMotion>(RigidPose(Vector3(at * Vector3(0.25, 0, 0.4))));
      }
      record(rod, std::make_shared<Sphere>(0.15 - (is_near ? 0.001 : 0)), {step});
      const Answer answer = check(file());
      EXPECT_EQ(answer.code, is_near ? kRefuted : kProven) << answer.text << answer.error;
    }
  }
}

// A ball within a hollow box of triangles keeps its distance; that it is inside is told.
TEST_F(CheckRecording, TellsWhatBeginsInsideAMesh) {
  const auto shell = std::make_shared<TriangleMesh>(testing::box_mesh(Vector3(2, 2, 4)).mesh());
  for (const Scalar height : {0.0, 10.0}) {
    record(std::make_shared<Sphere>(0.5), shell, {swing(height, 1)});
    const Answer answer = check(file());
    EXPECT_EQ(answer.code, kProven) << answer.text << answer.error;
    const bool is_told =
        answer.text.find("mover begins within the surface of rester") != std::string::npos;
    EXPECT_EQ(is_told, height == 0) << answer.text;
  }
}

TEST_F(CheckRecording, RefutesAJumpBetweenSteps) {
  const auto ball = std::make_shared<Sphere>(0.5);
  record(ball, ball, {swing(2, 0), swing(2.001, 0, 1)});
  const Answer answer = check(file());
  EXPECT_EQ(answer.code, kRefuted) << answer.text;
  EXPECT_NE(answer.text.find("jump: mover by 0.001"), std::string::npos) << answer.text;
  record(ball, ball, {swing(2, 0), swing(2, 0, 1)});
  EXPECT_EQ(check(file()).code, kProven);
}

// A file without rules excuses no pair, whatever its scene says.
TEST_F(CheckRecording, WithoutRulesAllPairsCount) {
  const auto ball = std::make_shared<Sphere>(0.5);
  record(ball, ball, {swing(0.5, 0)}, R"({"filters":[["mover","rester"]]})");
  const Answer answer = check(file());
  EXPECT_EQ(answer.code, kRefuted);
  EXPECT_NE(answer.text.find("no rules"), std::string::npos) << answer.text;
}

// The distance that is proven is said, and none below zero is.
TEST_F(CheckRecording, SaysWhichDistancesWereAskedFor) {
  const auto ball = std::make_shared<Sphere>(0.5);
  record(ball, ball, {swing(1.02, 0)});
  EXPECT_NE(check(file()).text.find("near pairs: 0.01 to 0.01"), std::string::npos)
      << check(file()).text;
  record(ball, ball, {swing(0.5, 0)}, "", -1);
  EXPECT_EQ(check(file()).code, kUnusable) << check(file()).text;
  EXPECT_NE(check(file()).error.find("negative"), std::string::npos) << check(file()).error;
}

TEST_F(CheckRecording, RefusesWhatItCannotRead) {
  const auto missing = check(directory_.path() / "none.h5");
  EXPECT_EQ(missing.code, kUnusable);
  EXPECT_NE(missing.error.find("none.h5: no such file"), std::string::npos) << missing.error;
  const std::filesystem::path text = directory_.write("text.h5", "not HDF5");
  EXPECT_EQ(check(text).code, kUnusable);
  EXPECT_NE(check(text).error.find("no readable HDF5 file"), std::string::npos);
  record(std::make_shared<Sphere>(0.5), std::make_shared<Sphere>(0.5), {swing(2, 0)});
  const std::string whole = testing::TemporaryDirectory::read(file());
  for (const std::size_t length : {whole.size() / 4, whole.size() / 2}) {
    EXPECT_EQ(check(directory_.write("part.h5", whole.substr(0, length))).code, kUnusable);
  }
}

}  // namespace
}  // namespace dyop
