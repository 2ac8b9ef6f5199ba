// SPDX-License-Identifier: BSD-3-Clause

// Structures held by friction and shape: arch, card house, dominoes.
#include <cmath>
#include <numbers>

#include "io/scene/scene_builder.h"

namespace dyop::io_internal {
namespace {

// The stone of an arch between two joints at these angles from the x axis; half a gap is left on
// either side, a whole one at a foot.
struct ArchStone {
  Scalar begin = 0, end = 0;
  Scalar begin_gap = 0, end_gap = 0;
};

// Corners in the plane x, z: those of the first joint, then those of the second.
std::array<Vector3, 4> corners(const ArchStone& stone, Scalar inner, Scalar outer) {
  const auto corner = [](Scalar angle, Scalar radius, Scalar offset) {
    const Vector3 along(std::cos(angle), 0, std::sin(angle));
    const Vector3 across(-std::sin(angle), 0, std::cos(angle));
    return Vector3(radius * along + offset * across);
  };
  return {corner(stone.begin, inner, stone.begin_gap), corner(stone.begin, outer, stone.begin_gap),
          corner(stone.end, inner, -stone.end_gap), corner(stone.end, outer, -stone.end_gap)};
}

void add_stone(SceneBuilder& builder, const std::string& name,
               const std::array<Vector3, 4>& corners_W) {
  constexpr Scalar kHalfWidth = 0.25;
  Vector3 middle = Vector3::Zero();
  for (const Vector3& corner : corners_W) middle += corner / 4;
  std::vector<Vector3> points;
  for (const Vector3& corner : corners_W) {
    for (const Scalar y : {-kHalfWidth, kHalfWidth}) {
      points.push_back(corner - middle + Vector3(0, y, 0));
    }
  }
  builder.add_body(name, hull_shape(points), middle);
}

}  // namespace

GeneratedScene make_arch(int n) {
  constexpr Scalar kInner = 2, kOuter = 2.6;
  SceneBuilder builder("An arch of stones", 5);
  builder.add_floor(Vector3::Zero(), kOuter + 1, 1);
  const Scalar turn = std::numbers::pi_v<Scalar> / n;
  for (int k = 0; k < n; ++k) {
    ArchStone stone{k * turn, (k + 1) * turn, kGeneratedGap / 2, kGeneratedGap / 2};
    if (k == 0) stone.begin_gap = kGeneratedGap;
    if (k == n - 1) stone.end_gap = kGeneratedGap;
    add_stone(builder, "stone " + std::to_string(k), corners(stone, kInner, kOuter));
  }
  builder.set_friction(0.7);
  return builder.finish();
}

GeneratedScene make_cards(int n) {
  constexpr Scalar kHalfLength = 0.5, kHalfWidth = 0.35, kHalfThickness = 0.01;
  constexpr Scalar kDegrees = 70;  // from the floor
  constexpr Scalar kBetweenFeet = 0.02;
  const Scalar angle = kDegrees * std::numbers::pi_v<Scalar> / 180;
  const Scalar cosine = std::cos(angle), sine = std::sin(angle);
  // Half the extent of a leaning card, along and up.
  const Scalar reach = kHalfLength * cosine + kHalfThickness * sine;
  const Scalar rise = kHalfLength * sine + kHalfThickness * cosine;
  const Scalar pitch = 4 * reach + kGeneratedGap + kBetweenFeet;  // of the pairs in a level
  const Vector3 card(kHalfLength, kHalfWidth, kHalfThickness);
  const Vector3 flat((pitch - kGeneratedGap) / 2, kHalfWidth, kHalfThickness);
  SceneBuilder builder("A house of cards", 5);
  builder.add_floor(Vector3::Zero(), 1 + pitch * n / 2, 2);
  Scalar base = 0;  // height of the base of the level
  int number = 0;
  for (int level = 0; level < n; ++level) {
    const int pairs = n - level;
    for (int k = 0; k < pairs; ++k) {
      const Scalar middle = pitch * (k - Scalar(pairs - 1) / 2);
      for (const Scalar side : {-1.0, 1.0}) {
        Json& body = builder.add_body(
            "card " + std::to_string(number++), box_shape(card),
            {middle + side * (reach + kGeneratedGap / 2), 0, base + kGeneratedGap + rise});
        body["pose"]["axis_angle"] = turn_json({0, 1, 0}, side * kDegrees);
      }
    }
    base += 2 * (kGeneratedGap + rise);
    for (int k = 0; k < pairs - 1; ++k) {
      builder.add_body("card " + std::to_string(number++), box_shape(flat),
                       {pitch * (k - Scalar(pairs - 2) / 2), 0, base + kHalfThickness});
    }
    base += 2 * kHalfThickness;
  }
  builder.set_friction(0.6);
  return builder.finish();
}

GeneratedScene make_domino(int n) {
  const Vector3 half(0.05, 0.25, 0.5);
  constexpr Scalar kPitch = 0.5;
  constexpr Scalar kRadius = 0.15;
  SceneBuilder builder("A ball tips a row of dominoes", 2 + 0.2 * n);
  builder.add_floor({kPitch * n / 2, 0, 0}, 3 + kPitch * n / 2, 1);
  for (int k = 0; k < n; ++k) {
    builder.add_body("domino " + std::to_string(k), box_shape(half),
                     {kPitch * k, 0, half.z() + kGeneratedGap});
  }
  Json& ball = builder.add_body("ball", sphere_shape(kRadius), {-0.5, 0, 0.85});
  ball["velocity"] = {{"linear", {3, 0, 0}}};
  builder.set_friction(0.4);
  return builder.finish();
}

}  // namespace dyop::io_internal
