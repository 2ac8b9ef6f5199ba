// SPDX-License-Identifier: BSD-3-Clause

// Verdicts of dyop-check on recorded runs: of Worlds, which are right, and of motions that are
// made up, which are wrong by as much as the test says.

#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <sstream>

#include "check/check.h"
#include "dyop/geometry/box.h"
#include "dyop/geometry/capsule.h"
#include "dyop/geometry/cylinder.h"
#include "dyop/geometry/sphere.h"
#include "dyop/io/recording_lines.h"
#include "dyop/io/recording_writer.h"
#include "dyop/io/scene_file.h"
#include "dyop/motion/hermite_motion.h"
#include "dyop/motion/rest_motion.h"
#include "support/inputs/world_scenes.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

constexpr int kProven = 0;
constexpr int kRefuted = 1;
constexpr int kUnusable = 2;

struct Answer {
  int code = 0;
  std::string text;
  std::string error;
};

Answer check(const std::filesystem::path& file, double scale = 1) {
  std::ostringstream out;
  std::ostringstream errors;
  const int code = dyop_check::check_file(file.string(), scale, out, errors);
  return {code, out.str(), errors.str()};
}

class CheckRecording : public ::testing::Test {
 protected:
  std::filesystem::path file() const { return directory_.path() / "run.h5"; }

  // A mover above a body at rest at the origin, target 0.01.
  void record(std::shared_ptr<const Shape> mover, std::shared_ptr<const Shape> rester,
              const std::vector<CommittedStep>& steps, const std::string& scene = "") const {
    std::vector<BodyDefinition> bodies(2);
    bodies[0].name = "mover";
    bodies[0].shape = std::move(mover);
    bodies[1].name = "rester";
    bodies[1].kind = BodyKind::Static;
    bodies[1].shape = std::move(rester);
    RunHeader header;
    header.scene = scene;
    header.target_distance = 0.01;
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

// A box that slides, a ball that bounces and a spinning rod that falls beside them.
World sliding_world() {
  WorldOptions options = testing::earth_options();
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

TEST_F(CheckRecording, RefutesAJumpBetweenSteps) {
  const auto ball = std::make_shared<Sphere>(0.5);
  record(ball, ball, {swing(2, 0), swing(2.001, 0, 1)});
  const Answer answer = check(file());
  EXPECT_EQ(answer.code, kRefuted) << answer.text;
  EXPECT_NE(answer.text.find("jump: mover by 0.001"), std::string::npos) << answer.text;
  record(ball, ball, {swing(2, 0), swing(2, 0, 1)});
  EXPECT_EQ(check(file()).code, kProven);
}

TEST_F(CheckRecording, LeavesOutWhatTheSceneDoesNotTest) {
  const auto ball = std::make_shared<Sphere>(0.5);
  record(ball, ball, {swing(0.5, 0)});
  EXPECT_EQ(check(file()).code, kRefuted);
  record(ball, ball, {swing(0.5, 0)}, R"({"filters":[["mover","rester"]]})");
  EXPECT_EQ(check(file()).code, kProven);
  record(ball, ball, {swing(1.005, 0)},
         R"({"target_distances":[{"a":"rester","b":"mover","distance":0.001}]})");
  EXPECT_EQ(check(file()).code, kProven);
}

TEST_F(CheckRecording, RefusesWhatItCannotRead) {
  EXPECT_EQ(check(directory_.path() / "none.h5").code, kUnusable);
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
