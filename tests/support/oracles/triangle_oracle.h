// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

#include "dyop/core/types.h"
#include "support/nearest_points.h"

namespace dyop::testing {

/// A distance and how wrong it may be: |distance - truth| <= error, proven.
struct OracleDistance {
  long double distance = 0;
  long double error = 0;

  long double lower() const { return std::max(0.0L, distance - error); }
  long double upper() const { return distance + error; }
};

/// The vertices in another field of numbers, without rounding.
template <typename Number>
PointTriangle<Number> to_points(const Triangle& triangle) {
  PointTriangle<Number> result;
  for (std::size_t k = 0; k < 3; ++k) {
    result[k] = {Number(triangle[k].x()), Number(triangle[k].y()), Number(triangle[k].z())};
  }
  return result;
}

/// Distance of two triangles (segments and points included) by exhaustion over the definition:
/// see nearest_points(). First in quad precision, where the slab between the triangles
/// must prove the answer; pairs too ill-conditioned for that go to exact rational arithmetic.
///
/// error <= 1e-28 of the pair's size plus 1e-18 of the distance. Zero is met up to error only;
/// oracle_triangles_intersect() decides it. Any finite coordinates up to 1e300, any order.
/// Cost: about 0.05 ms, or 1 ms for the ill-conditioned.
OracleDistance oracle_triangle_distance(const Triangle& a, const Triangle& b);

/// The same for vertices that carry more digits than a double, such as posed ones. There is no
/// rational arithmetic behind it: the error grows where quad precision does not suffice.
OracleDistance oracle_triangle_distance(const PointTriangle<Quad>& a, const PointTriangle<Quad>& b);

/// Whether two triangles have a point in common: exact, for any finite coordinates.
bool oracle_triangles_intersect(const Triangle& a, const Triangle& b);

}  // namespace dyop::testing
