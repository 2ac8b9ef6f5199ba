// SPDX-License-Identifier: BSD-3-Clause

// Boxes on top of each other: stack, pyramid, wall, pile.
#include <cmath>

#include "io/scene/scene_builder.h"

namespace dyop::io_internal {
namespace {

constexpr Scalar kCubeHalf = 0.5;

std::string numbered(const std::string& word, int number) {
  return word + " " + std::to_string(number);
}

// The height of the centre of a body of half height `half` in the given course, counted from 0.
Scalar course_height(int course, Scalar half, Scalar gap = kGeneratedGap) {
  return half + gap + course * (2 * half + gap);
}

// A number in [0, 1) that looks random, the same on all machines.
Scalar scattered(int k) {
  // literal: the golden ratio spreads its multiples evenly
  const Scalar value = k * 0.6180339887498949;
  return value - std::floor(value);
}

}  // namespace

GeneratedScene make_stack(int n) {
  SceneBuilder builder("A stack of cubes", 5);
  builder.add_floor(Vector3::Zero(), 2, 2);
  for (int k = 0; k < n; ++k) {
    builder.add_body(numbered("cube", k), box_shape(Vector3::Constant(kCubeHalf)),
                     {0, 0, course_height(k, kCubeHalf)});
  }
  return builder.finish();
}

GeneratedScene make_pyramid(int n) {
  constexpr Scalar kPitch = 1.1;  // of the cubes in a course
  SceneBuilder builder("A pyramid of cubes", 5);
  builder.add_floor(Vector3::Zero(), 2 + kPitch * n / 2, 2);
  for (int course = 0, number = 0; course < n; ++course) {
    for (int k = 0; k < n - course; ++k, ++number) {
      builder.add_body(
          numbered("cube", number), box_shape(Vector3::Constant(kCubeHalf)),
          {kPitch * (k - Scalar(n - course - 1) / 2), 0, course_height(course, kCubeHalf)});
    }
  }
  return builder.finish();
}

GeneratedScene make_wall(int n) {
  // Larger than usual: a strike is solved to parts of the rest offset.
  constexpr Scalar kTarget = 10 * kGeneratedTarget;
  constexpr Scalar kGap = 10 * kGeneratedGap;
  const Vector3 half(0.5, 0.25, 0.25);
  const Scalar pitch = 2 * half.x() + kGap;
  const Scalar half_brick = (half.x() - kGap / 2) / 2;
  const Scalar end = n * pitch;  // of the wall, from its middle
  SceneBuilder builder("A ball strikes a wall of bricks", 3);
  builder.set_lengths(kTarget, kGap - kTarget);
  builder.add_floor(Vector3::Zero(), end + 5, 15);
  for (int course = 0, number = 0; course < n; ++course) {
    const Scalar z = course_height(course, half.z(), kGap);
    const bool is_offset = course % 2 == 1;
    for (int k = 0; k < 2 * n - int(is_offset); ++k, ++number) {
      builder.add_body(numbered("brick", number), box_shape(half),
                       {(k + (is_offset ? 1 : 0.5)) * pitch - end, 0, z});
    }
    if (!is_offset) continue;
    const Scalar x = end - kGap / 2 - half_brick;
    for (const Scalar side : {-x, x}) {
      builder.add_body(numbered("half brick", number++),
                       box_shape({half_brick, half.y(), half.z()}), {side, 0, z});
    }
  }
  const Scalar radius = 0.25 + 0.05 * n;
  Json& ball = builder.add_body("ball", sphere_shape(radius),
                                {0, -3 - radius, std::max(0.5 * half.z() * n, radius + 0.25)});
  ball["density"] = 5000;
  ball["velocity"] = {{"linear", {0, 12, 0}}};
  return builder.finish();
}

GeneratedScene make_pile(int n) {
  constexpr Scalar kPitch = 2;  // more than the diagonal of a cube
  const int side = std::max(1, int(std::ceil(std::cbrt(Scalar(n)))));
  const Scalar half = kPitch * side / 2;
  SceneBuilder builder("Cubes fall into a pit", 5);
  builder.add_floor(Vector3::Zero(), half + 1, half + 1);
  const Scalar height = half + 1;
  for (const Scalar sign : {-1.0, 1.0}) {
    const std::string which = sign < 0 ? " 0" : " 1";
    builder.add_static_body("wall x" + which, box_shape({0.5, half + 1, height}),
                            {sign * (half + 0.5), 0, height});
    builder.add_static_body("wall y" + which, box_shape({half + 1, 0.5, height}),
                            {0, sign * (half + 0.5), height});
  }
  for (int k = 0; k < n; ++k) {
    const Vector3 place(k % side, k / side % side, k / (side * side));
    const Vector3 p = kPitch * (place + Vector3::Constant(0.5)) - Vector3(half, half, 0);
    Json& cube = builder.add_body(numbered("cube", k), box_shape(Vector3::Constant(kCubeHalf)), p);
    const Vector3 axis(scattered(3 * k + 1) - 0.5, scattered(3 * k + 2) - 0.5, 1);
    cube["pose"]["axis_angle"] = turn_json(axis, 360 * scattered(7 * k + 3));
  }
  return builder.finish();
}

}  // namespace dyop::io_internal
