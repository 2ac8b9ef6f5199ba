// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <random>

#include "dyop/toi/vertex_time_of_impact.h"

namespace dyop::testing {

using FourPaths = std::array<VertexPath, 4>;

/// Kinds of four moving points. The integer kinds touch exactly in many cases.
enum class PathKind {
  General,      ///< coordinates and displacements even in [-1, 1]
  Slow,         ///< displacements a hundredth of the size
  SmallWhole,   ///< integer coordinates from -2 to 2
  Coplanar,     ///< integers, all in the plane x = y at all times
  Collinear,    ///< integers, all on one line at all times
  Resting,      ///< integers, nothing moves
  Duplicate,    ///< integers, two points equal at the start and sometimes at the end
  Parallel,     ///< integers, the second pair of points is the first one, translated
  NearlyWhole,  ///< SmallWhole with one coordinate moved by 2^-40 to 2^-20
};
inline constexpr std::array kAllPathKinds{
    PathKind::General,   PathKind::Slow,      PathKind::SmallWhole,
    PathKind::Coplanar,  PathKind::Collinear, PathKind::Resting,
    PathKind::Duplicate, PathKind::Parallel,  PathKind::NearlyWhole};

FourPaths make_paths(PathKind kind, std::mt19937_64& random);

/// All coordinates times `scale`, then plus `offset`.
FourPaths placed(const FourPaths& paths, double scale, const Vector3& offset);

inline VertexFacePaths vertex_face(const FourPaths& p) {
  return {p[0], {p[1], p[2], p[3]}};
}
inline EdgeEdgePaths edge_edge(const FourPaths& p) {
  return {{p[0], p[1]}, {p[2], p[3]}};
}

}  // namespace dyop::testing
