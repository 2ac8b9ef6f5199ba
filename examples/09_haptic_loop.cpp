// SPDX-License-Identifier: BSD-3-Clause

// 9. A haptic loop: a tool driven by a device, tissue that breathes, a vessel to be kept away from.
#include <dyop/geometry/triangle_mesh.h>
#include <dyop/haptics/haptic_session.h>
#include <dyop/io/haptic_scene_file.h>

#include <cmath>
#include <cstdio>

int main() {
  // Millimetres, newtons, seconds. The tool is a rod; its origin is at its tip.
  const dyop::AnatomyMesh rod = dyop::make_shaft(1000, 2.5, 100);
  dyop::HapticScene scene;
  scene.tool.push_back({std::make_shared<dyop::TriangleMesh>(rod.vertices, rod.triangles), {}});
  scene.X_WT = dyop::RigidPose(dyop::Vector3(0, 0, 60));

  const dyop::AnatomyMesh liver = dyop::make_liver(5000);
  dyop::ToolObstacle tissue;
  tissue.name = "liver";
  tissue.vertices = liver.vertices;
  tissue.triangles = liver.triangles;
  tissue.friction = 0.2;
  const dyop::AnatomyMesh tube = dyop::make_vessel(2000);
  dyop::ToolObstacle vessel;
  vessel.role = dyop::ObstacleRole::HardRegion;
  vessel.margin = 2;
  vessel.shape = std::make_shared<dyop::TriangleMesh>(tube.vertices, tube.triangles);
  vessel.X_WO = dyop::RigidPose(dyop::Vector3(0, 30, 50));
  scene.obstacles = {tissue, vessel};

  dyop::HapticOptions options;
  options.coupling.stiffness.setConstant(1);  // 1 N/mm
  options.coupling.rotational_stiffness.setConstant(2000);
  options.rest_offset = 0.05;
  options.recovery_speed = 50;
  dyop::HapticSession session(scene, options);

  for (int tick = 0; tick <= 600; ++tick) {
    if (tick % 20 == 0) {  // 50 snapshots a second; usually from a thread of the simulation
      std::vector<dyop::Vector3> shape = liver.vertices;
      for (dyop::Vector3& p : shape) p.z() += 3 * std::sin(1.57 * (tick + 20) / 1000);
      session.give_snapshot(0, shape, 0.02);
    }
    // What the device reports; here it goes down to 10 mm below the surface, then to the vessel.
    const double down = std::min(1.0, tick / 300.0), aside = std::max(0.0, tick / 300.0 - 1);
    const dyop::DevicePose device(dyop::RigidPose(dyop::Vector3(0, 30 * aside, 60 - 35 * down)));
    const dyop::HapticTick& result = session.update(device, 0.001);
    if (tick % 150 != 0) continue;
    const bool is_held = result.status == dyop::HapticStatus::Held;
    std::printf("%.2f s: %s, force %4.1f N up, %4.1f mm to the vessel\n", session.time(),
                is_held ? "held" : "free", result.wrench.force_W.z(), result.clearances[1].lower);
  }
}
// Prints:
// 0.00 s: free, force  0.0 N up, 24.9 mm to the vessel
// 0.15 s: free, force  0.0 N up, 21.1 mm to the vessel
// 0.30 s: held, force 12.1 N up, 21.1 mm to the vessel
// 0.45 s: held, force 12.1 N up,  8.0 mm to the vessel
// 0.60 s: held, force 10.2 N up,  2.0 mm to the vessel
