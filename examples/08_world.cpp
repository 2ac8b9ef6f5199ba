// SPDX-License-Identifier: BSD-3-Clause

// 8. Stepping a scene: a ball falls on a floor and bounces. Nothing ever passes through anything.
#include <dyop/dynamics/world.h>
#include <dyop/dyop.h>

#include <cstdio>
#include <memory>

int main() {
  dyop::WorldOptions options;
  options.gravity_W = {0, 0, -10};
  options.max_step = 0.01;  // contact is solved once per step
  dyop::World world(options);

  dyop::BodyDefinition floor;
  floor.name = "floor";
  floor.kind = dyop::BodyKind::Static;
  floor.shape = std::make_shared<dyop::Box>(dyop::Vector3(5, 5, 0.5));
  floor.initial.X_WB = dyop::RigidPose({0, 0, -0.5});
  world.add_body(floor);

  dyop::BodyDefinition ball;
  ball.name = "ball";
  ball.shape = std::make_shared<dyop::Sphere>(0.5);
  ball.mass_properties = ball.shape->compute_mass_properties(1);
  ball.initial.X_WB = dyop::RigidPose({0, 0, 2});  // the lowest point is at 1.5
  ball.restitution = 0.5;
  floor.restitution = 0.5;
  const dyop::BodyId id = world.add_body(ball);

  // The trajectory is proven: the bodies always stay apart by at least their target distance.
  for (int step = 0; step < 5; ++step) {
    const dyop::AdvanceReport report = world.advance(0.25);
    for (const dyop::ImpactEvent& impact : report.impacts) {
      std::printf("  impact at t = %.4f, closing at %.3f\n", impact.t,
                  impact.toi.contact->closing_speed);
    }
    const dyop::MotionState& state = world.state(id);
    std::printf("t = %.2f: height %.3f, speed %+.3f\n", world.time(), state.X_WB.translation().z(),
                state.twist.v_WB.z());
  }
}
// Prints:
// t = 0.25: height 1.688, speed -2.500
// t = 0.50: height 0.750, speed -5.000
//   impact at t = 0.5477, closing at 5.477
// t = 0.75: height 0.850, speed +0.715
// t = 1.00: height 0.716, speed -1.785
//   impact at t = 1.0954, closing at 2.738
// t = 1.25: height 0.592, speed -0.177
