// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>

#include "dyop/paper/planar_distance.h"

namespace dyop::paper_internal {

// A common point of two convex polygons and the features that share it; nothing if they are apart,
// or if coordinates differ so much in size that the exact predicates fail (2^200).
struct PlanarCrossing {
  Vector2 point;  // within rounding, unless the edges are parallel up to rounding
  Feature feature_a;
  Feature feature_b;
};

// Decided in exact arithmetic. Cost: all pairs of edges.
std::optional<PlanarCrossing> find_crossing(std::span<const Vector2> a, std::span<const Vector2> b);

}  // namespace dyop::paper_internal
