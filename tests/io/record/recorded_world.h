// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "dyop/dynamics/world.h"
#include "dyop/geometry/primitives.h"
#include "dyop/io/recording.h"
#include "dyop/motion/motion.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/world_scenes.h"

namespace dyop::testing {

/// A little of everything: impacts, spinning flight off centre, forces, stacks that fall asleep, a
/// body on a given motion, a sensor, and a motion of the user's functions.
inline World busy_world() {
  using namespace testing;
  World world(earth_options());
  world.add_body(floor_body(0.5, 0.3));
  world.add_body(resting_cube(0, 0, 0));
  world.add_body(resting_cube(0, 0, 1 + rest_gap(0.8)));
  const auto ball = std::make_shared<Sphere>(0.3);
  BodyDefinition thrown = dynamic_body("thrown", ball, {-4, 0.1, 2}, {6, 0, 1}, {1, 2, 3});
  thrown.restitution = 0.6;
  world.add_body(thrown);
  const auto rod = std::make_shared<Capsule>(0.1, 0.5);
  BodyDefinition spinning = dynamic_body("spinning", rod, {3, 3, 3}, {0, 0, 2}, {4, 1, 2});
  spinning.mass_properties.p_BoBcm = Vector3(0, 0.02, 0.2);
  world.add_body(spinning);
  BodyDefinition drawn = dynamic_body("drawn", ball, {6, 6, 4}, {1, 0, 0}, {0, 1, 0});
  drawn.wrench = [](Scalar t, const MotionState& state) {
    return Wrench{-40 * state.X_WB.translation(), Vector3(std::sin(7 * t), 0, 1)};
  };
  world.add_body(drawn);
  BodyDefinition drill;
  drill.name = "drill";
  drill.kind = BodyKind::Kinematic;
  drill.shape = rod;
  drill.motion = std::make_shared<ScrewMotion>(RigidPose(Vector3(-8, 0, 3)),
                                               ScrewMotion::Screw{{-8, 0, 3}, {0, 0, 1}, 3, 0.1});
  world.add_body(drill);
  BodyDefinition sensor;
  sensor.name = "sensor";
  sensor.kind = BodyKind::Static;
  sensor.shape = std::make_shared<Box>(Vector3(1, 1, 1));
  sensor.is_sensor = true;
  sensor.initial.X_WB = RigidPose(Vector3(-2, 0, 2));
  world.add_body(sensor);
  return world;
}

inline RunHeader busy_header() {
  RunHeader header;
  header.title = "A little of everything";
  header.scene = R"({"title":"A little of everything"})";
  header.rest_offset = 0.25;
  header.end_time = 2;
  header.step = 1.0 / 64;
  return header;
}

inline constexpr int kBusyFrames = 128;

/// Runs it, records it, and returns what was recorded.
inline std::vector<AdvanceReport> record_busy_run(const std::filesystem::path& file,
                                                  const RecordingOptions& options = {}) {
  World world = busy_world();
  RecordingWriter writer(file, busy_header(), options);
  std::vector<AdvanceReport> reports;
  for (int k = 0; k < kBusyFrames; ++k) {
    reports.push_back(world.advance(busy_header().step));
    writer.write(reports.back(), world);
  }
  writer.finish();
  return reports;
}

}  // namespace dyop::testing
