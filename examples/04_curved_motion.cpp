// SPDX-License-Identifier: BSD-3-Clause

// 4. Motions: through recorded poses, and from your own functions.
#include <dyop/dyop.h>

#include <cmath>
#include <cstdio>
#include <string>

int main() {
  // A tool's tip was recorded at uneven times. In between it moves on a smooth curve.
  const auto turned = [](double angle, const dyop::Vector3& p) {
    return dyop::RigidPose(dyop::rotation_from_vector({0, 0, angle}), p);
  };
  const dyop::SequenceMotion tool = dyop::smooth_sampled_motion({{0.0, turned(0, {4, -2, 0})},
                                                                 {0.5, turned(0.5, {3, 0, 0})},
                                                                 {1.1, turned(1.2, {1.5, 1, 0})},
                                                                 {2.0, turned(2.0, {0, 1, 0})}});
  const dyop::Capsule needle(0.05, 1);
  const dyop::Sphere organ(1);
  const dyop::RestMotion at_rest{dyop::RigidPose()};
  dyop::ToiOptions options;
  options.target_distance = 0.25;  // keep this far away
  const dyop::ToiResult near = dyop::time_of_impact(organ, at_rest, needle, tool, {0, 2}, options);
  std::printf("the needle is proven 0.25 away until t = %.4f\n", near.t_safe);

  // Your own functions need bounds on speed and acceleration: the proof relies on them.
  dyop::UserMotion::Functions swing;
  swing.pose = [](double t) { return dyop::RigidPose({2 + std::cos(3 * t), 0, 0}); };
  swing.twist = [](double t) { return dyop::Twist{{-3 * std::sin(3 * t), 0, 0}, {0, 0, 0}}; };
  swing.twist_bound = [](const dyop::TimeInterval&) { return dyop::TwistBound{3, 0, 9, 0}; };
  const auto check = [&] {
    const dyop::MotionCheck found = dyop::check_motion(dyop::UserMotion(swing), {0, 2});
    const std::string& words = found.message;  // long: all the numbers, then a guess
    if (found.is_sound()) std::printf("sound\n");
    if (!found.is_sound()) std::printf("unsound%s\n", words.substr(words.rfind(';')).c_str());
  };
  check();

  // check_motion() samples a motion and names the first promise that it breaks: here, a wrong sign.
  swing.twist = [](double t) { return dyop::Twist{{+3 * std::sin(3 * t), 0, 0}, {0, 0, 0}}; };
  check();

  // Every query refuses poses that are not poses at all.
  swing.pose = [](double t) { return dyop::RigidPose({t < 1 ? 2 + t : std::nan(""), 0, 0}); };
  try {
    dyop::time_of_impact(organ, at_rest, organ, dyop::UserMotion(swing), {1, 2});
  } catch (const dyop::InvalidArgument& error) {
    std::printf("%s\n", error.what());
  }
}
// Prints:
// the needle is proven 0.25 away until t = 1.6552
// sound
// unsound; its sign is reversed
// time_of_impact: the motion of B at t = 1: pose translation must be finite, not (nan 0 0)
