// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "dyop/core/types.h"

namespace DYOP_EXPORT dyop {

/// A point that moves on a straight line at constant speed over an interval of time: from `begin`
/// at its start to `end` at its end, world frame. The path is the exact line through the two given
/// points, unaffected by rounding.
struct VertexPath {
  Vector3 begin = Vector3::Zero();
  Vector3 end = Vector3::Zero();
};

/// A moving vertex (side A) and a moving triangle (side B). The triangle may degenerate to a
/// segment or a point, always or at some times.
struct VertexFacePaths {
  VertexPath vertex;
  std::array<VertexPath, 3> face;
};

/// Two moving edges, sides A and B. An edge may degenerate to a point, always or at some times.
struct EdgeEdgePaths {
  std::array<VertexPath, 2> edge_a;
  std::array<VertexPath, 2> edge_b;
};

}  // namespace dyop
