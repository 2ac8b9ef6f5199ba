// SPDX-License-Identifier: BSD-3-Clause

// The 20 lines of a project that embeds dyop: when does a falling, turning box touch a sphere?
#include <dyop/geometry/primitives.h>
#include <dyop/motion/steady_motions.h>
#include <dyop/toi/time_of_impact.h>

#include <iostream>

int main() {
  const dyop::Sphere sphere(1);
  const dyop::Box box({0.5, 0.5, 0.5});
  const dyop::RestMotion at_rest{dyop::RigidPose()};
  const dyop::ConstantTwistMotion falling(dyop::RigidPose({0.3, 0, 5}), {{0, 0, -2}, {0, 3, 1}});
  const dyop::ToiResult result = dyop::time_of_impact(sphere, at_rest, box, falling, {0, 4});
  std::cout << "touching at t = " << result.t_safe << '\n';
  return result.status == dyop::ToiStatus::Impact ? 0 : 1;
}
