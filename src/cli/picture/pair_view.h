// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "cli/picture/shaded_image.h"
#include "dyop/distance/distance_result.h"
#include "paper/experiment/svg_canvas.h"

namespace dyop::cli {

inline constexpr Rgb kColourA{66, 126, 196};
inline constexpr Rgb kColourB{226, 138, 60};
inline constexpr std::string_view kInkA = "#1d4f91";
inline constexpr std::string_view kInkB = "#a65310";
inline constexpr std::string_view kInkPivot = "#b00060";

/// Two bodies as they are drawn.
struct PairScene {
  view_internal::ShapeSurface a;
  view_internal::ShapeSurface b;
  Scalar radius_a = 0;
  Scalar radius_b = 0;
  RigidPose X_WA;
  RigidPose X_WB;
  std::optional<std::pair<RigidPose, RigidPose>> start;  ///< poses that are drawn faintly
  std::vector<Vector3> path_a;                           ///< of the origins, up to the poses
  std::vector<Vector3> path_b;
  std::optional<WitnessPair> witness;
  std::optional<Vector3> meeting_W = {};  ///< of shapes that overlap: where they do
};

/// A rectangle of the picture, pixels.
struct Panel {
  Vector2 corner;
  Vector2 size;
};

/// Draws the whole pair, seen across the normal.
void draw_pair(SvgCanvas& canvas, const Panel& panel, const PairScene& scene);

/// Whether the gap is small enough, beside what draw_pair() shows on `whole`, for a view from
/// nearer.
bool has_close_up(const Panel& whole, const Panel& near, const PairScene& scene);

/// The same from near: around the pivot, as wide as a part of the smaller body or a few gaps.
void draw_close_up(SvgCanvas& canvas, const Panel& panel, const PairScene& scene);

}  // namespace dyop::cli
