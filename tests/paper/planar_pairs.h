// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <random>

#include "support/inputs/random_inputs.h"
#include "support/oracles/triangle_oracle.h"

/// Triangle pairs in the plane for tests, and the truth about them from the oracle for space.
namespace dyop::testing {

struct PlanarPair {
  PlanarTriangle a;
  PlanarTriangle b;
};

inline Triangle in_space(const PlanarTriangle& t) {
  return {Vector3(t[0].x(), t[0].y(), 0), Vector3(t[1].x(), t[1].y(), 0),
          Vector3(t[2].x(), t[2].y(), 0)};
}

inline OracleDistance oracle_distance(const PlanarPair& pair) {
  return oracle_triangle_distance(in_space(pair.a), in_space(pair.b));
}

inline bool oracle_intersect(const PlanarPair& pair) {
  return oracle_triangles_intersect(in_space(pair.a), in_space(pair.b));
}

inline Vector2 random_planar_vector(Scalar half_width, std::mt19937_64& random) {
  const Scalar x = random_number(-half_width, half_width, random);
  return {x, random_number(-half_width, half_width, random)};
}

enum class PlanarFamily {
  Apart,         ///< random, B moved away by up to 1
  Mixed,         ///< random, half of them crossing
  SharedCorner,  ///< one vertex in common
  SharedEdge,    ///< two
  Grid,          ///< small integers: parallel, collinear, touching
  Degenerate,    ///< points, segments and slivers
};

inline constexpr std::array kAllPlanarFamilies{
    PlanarFamily::Apart,      PlanarFamily::Mixed, PlanarFamily::SharedCorner,
    PlanarFamily::SharedEdge, PlanarFamily::Grid,  PlanarFamily::Degenerate};

/// Coordinates of about one, times `scale`, plus an offset.
inline PlanarPair random_planar_pair(PlanarFamily family, Scalar scale, const Vector2& offset,
                                     std::mt19937_64& random) {
  PlanarPair pair;
  for (PlanarTriangle* t : {&pair.a, &pair.b}) {
    for (Vector2& p : *t) {
      p = random_planar_vector(1, random);
      if (family == PlanarFamily::Grid) p = Vector2((3 * p).array().round());
    }
  }
  if (family == PlanarFamily::Apart) {
    for (Vector2& p : pair.b) p.x() += random_number(1, 3, random);
  }
  if (family == PlanarFamily::SharedCorner) pair.b[1] = pair.a[2];
  if (family == PlanarFamily::SharedEdge) {
    pair.b[0] = pair.a[1];
    pair.b[2] = pair.a[0];
  }
  if (family == PlanarFamily::Degenerate) {
    const Scalar width = random_index(2, random) == 0 ? 0 : random_magnitude(-12, -3, random);
    const Vector2 side = width * random_planar_vector(1, random);
    pair.a[2] = pair.a[0] + random_number(0, 1, random) * (pair.a[1] - pair.a[0]) + side;
    if (random_index(2, random) == 0) pair.b[1] = pair.b[0];
    if (random_index(3, random) == 0) pair.b[2] = pair.b[1] + side;
  }
  for (PlanarTriangle* t : {&pair.a, &pair.b}) {
    for (Vector2& p : *t) p = scale * p + offset;
  }
  return pair;
}

}  // namespace dyop::testing
