// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "dyop/geometry/primitives.h"
#include "dyop/io/haptic_recording.h"
#include "support/inputs/haptic_scenes.h"

/// Runs of haptic sessions, recorded.
namespace dyop::testing {

/// A ball with a jaw over a sheet that heaves, beside a forbidden box.
inline HapticScene heaving_scene() {
  HapticScene scene = ball_tool(2, {0.3, 0.2, 4});
  scene.hinges.push_back({RigidPose(Vector3(0, 0, -1)), 0.2, 50});
  scene.tool.push_back({std::make_shared<Capsule>(0.3, 1.5),
                        RigidPose(rotation_from_vector({0, 1.5, 0}), Vector3(2, 0, 0)), 0});
  scene.obstacles.push_back(deforming_tissue(sheet(30, 8), 0.2));
  ToolObstacle region =
      rigid_tissue(std::make_shared<Box>(Vector3(1, 1, 1)),
                   RigidPose(rotation_from_vector({0.1, 0.7, 0.2}), Vector3(9, 0, 3)));
  region.role = ObstacleRole::HardRegion;
  region.margin = 0.5;
  scene.obstacles.push_back(region);
  return scene;
}

inline DevicePose heaving_device(int tick) {
  DevicePose device(RigidPose(rotation_from_vector({0.002 * tick, 0, 0.001 * tick}),
                              Vector3(0.02 * tick, 0.2, 4 - 0.03 * std::min(tick, 150))));
  device.angles[0] = 0.2 * std::cos(0.05 * tick);
  if (tick == 77) device.p_WD.y() = std::nan("");
  return device;
}

/// The sheet without its first triangles.
inline std::vector<TriangleIndices> cut_triangles(const HapticScene& scene) {
  const std::vector<TriangleIndices>& whole = scene.obstacles[0].triangles;
  return {whole.begin() + 20, whole.end()};
}

/// Ends some ticks by itself.
inline constexpr std::int64_t kHeavingWork = 400;

/// Runs the scene, every seventh tick cut off, with snapshots at irregular ticks; one of them is
/// another mesh.
inline std::vector<HapticTick> record_heaving_run(const std::filesystem::path& file, int count) {
  const HapticScene scene = heaving_scene();
  HapticOptions options = haptic_options();
  options.max_work = kHeavingWork;
  HapticSession session(scene, options);
  HapticRecordingWriter writer(file, {"heaving", "", 1e-3, ""}, session);
  std::vector<HapticTick> run;
  for (int k = 0; k < count; ++k) {
    if (k % 13 == 5) {
      std::vector<Vector3> vertices = scene.obstacles[0].vertices;
      for (Vector3& p : vertices) p.z() += std::sin(0.02 * k + 0.1 * p.x());
      if (k == 122) {
        vertices = session.tissue_vertices(0);
        // More vertices than before, which nothing uses.
        vertices.push_back(Vector3::Zero());
        session.give_mesh(0, vertices, cut_triangles(scene));
      } else {
        vertices.resize(session.tissue_vertices(0).size(), Vector3(1, 2, 3));
        session.give_snapshot(0, vertices, 0.01);
      }
    }
    TickRecord record{k, heaving_device(k), k % 50 == 20 ? 2e-3 : 1e-3, {}};
    std::optional<TickCutoff> cutoff;
    if (k % 7 == 3) cutoff = TickCutoff{1 + k % 11, 0};
    record.tick = session.replay(record.device, record.dt, cutoff);
    run.push_back(record.tick);
    writer.add(record);
  }
  writer.finish({});
  return run;
}

/// Two tools push each other, one through a trocar, the other with a jaw.
inline HapticScene scene_of_two() {
  HapticScene scene = heaving_scene();
  HapticTool other;
  other.parts = scene.tool;
  other.hinges = scene.hinges;
  other.X_WT = RigidPose(Vector3(-6, 0.2, 4));
  other.coupling = haptic_options().coupling;
  other.coupling->stiffness.setConstant(2);
  scene.more_tools.push_back(other);
  scene.trocar = ToolTrocar{Vector3(0.3, 0.2, 20), Vector3::Zero(), Vector3::UnitZ()};
  scene.tool_margin = 0.1;
  scene.tool_friction = 0.2;
  return scene;
}

inline std::vector<std::vector<HapticTick>> record_two(const std::filesystem::path& file,
                                                       int count) {
  const HapticScene scene = scene_of_two();
  const HapticOptions options = haptic_options();
  HapticSession session(scene, options);
  HapticRecordingWriter writer(file, {"two", "", 1e-3, ""}, session);
  std::vector<std::vector<HapticTick>> run;
  for (int k = 0; k < count; ++k) {
    std::array<DevicePose, 2> devices{heaving_device(k), heaving_device(k)};
    devices[1].p_WD = Vector3(-6 + 0.03 * k, 0.2, 4);
    const auto ticks = session.update(devices, 1e-3);
    run.emplace_back(ticks.begin(), ticks.end());
    writer.add({k, devices[0], 1e-3, ticks[0], {{devices[1], ticks[1]}}});
  }
  writer.finish({});
  return run;
}

}  // namespace dyop::testing
