// SPDX-License-Identifier: BSD-3-Clause

// Links dyop::dynamics and dyop::io: a ball dropped on a box.
#include <dyop/dynamics/world.h>
#include <dyop/geometry/primitives.h>
#include <dyop/io/mesh_file.h>

#include <iostream>
#include <memory>

int main() {
  dyop::WorldOptions options;
  options.gravity_W = dyop::Vector3(0, 0, -9.81);
  options.max_step = 0.01;
  dyop::World world(options);
  dyop::BodyDefinition floor;
  floor.name = "floor";
  floor.kind = dyop::BodyKind::Static;
  floor.shape = std::make_shared<dyop::Box>(dyop::Vector3(5, 5, 0.5));
  world.add_body(floor);
  dyop::BodyDefinition ball;
  ball.name = "ball";
  ball.shape = std::make_shared<dyop::Sphere>(0.5);
  ball.mass_properties = ball.shape->compute_mass_properties(1000);
  ball.initial.X_WB = dyop::RigidPose(dyop::Vector3(0, 0, 3));
  world.add_body(ball);
  const dyop::AdvanceReport report = world.advance(1);
  std::cout << report.impacts.size() << " impacts\n";
  try {
    dyop::load_mesh("missing.obj");
  } catch (const dyop::Error& error) {
    return report.impacts.empty() ? 1 : 0;
  }
  return 1;
}
