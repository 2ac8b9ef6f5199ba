// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/tolerance.h"
#include "dyop/distance/triangle_distance.h"
#include "support/oracles/triangle_oracle.h"

/// Checks every promise of triangle_distance() on one answer, for unit tests and the soak.
namespace dyop::testing {

inline long double wide(Scalar x) {
  return static_cast<long double>(x);
}

/// Slab gap of the triangles along the direction, which need not be exactly unit; in extended
/// precision and relative to a vertex of a.
inline long double slab_gap(const Triangle& a, const Triangle& b, const Vector3& normal) {
  using Wide = Eigen::Matrix<long double, 3, 1>;
  const Wide n = normal.cast<long double>();
  const Wide origin = a[0].cast<long double>();
  long double low_b = HUGE_VALL;
  long double high_a = -HUGE_VALL;
  for (std::size_t k = 0; k < 3; ++k) {
    low_b = std::min(low_b, n.dot(b[k].cast<long double>() - origin));
    high_a = std::max(high_a, n.dot(a[k].cast<long double>() - origin));
  }
  return (low_b - high_a) / n.norm();
}

/// The part of the triangle that a feature of triangle_distance() names; empty vertices if none.
inline Triangle feature_part(const Triangle& triangle, const Feature& feature) {
  const auto vertex = [&](std::size_t k) {
    const std::int32_t number = feature.vertices[k];
    const bool is_valid = number >= 0 && number < 3;
    return is_valid ? triangle[static_cast<std::size_t>(number)]
                    : Vector3(Vector3::Constant(std::nan("")));
  };
  switch (feature.kind) {
    case FeatureKind::Vertex:
      return {vertex(0), vertex(0), vertex(0)};
    case FeatureKind::Edge:
      return {vertex(0), vertex(1), vertex(1)};
    default:
      return {vertex(0), vertex(1), vertex(2)};
  }
}

/// Room for the rounding of a computed point: of the pair, and of the coordinates themselves.
inline Scalar point_noise(const Triangle& a, const Triangle& b) {
  Scalar largest = 0;
  for (const Triangle* triangle : {&a, &b}) {
    for (const Vector3& p : *triangle) largest = std::max(largest, p.cwiseAbs().maxCoeff());
  }
  return triangle_noise(a, b) + 8 * kUnitRoundoff * largest;
}

/// Returns which promise on bounds, status and normal the answer breaks, or nullptr.
inline const char* broken_bound(const Triangle& a, const Triangle& b, const TriangleDistance& d,
                                const OracleDistance& truth) {
  const Scalar noise = triangle_noise(a, b);
  if (!(d.lower >= 0)) return "lower is negative or NaN";
  if (!(static_cast<long double>(d.lower) <= truth.upper())) return "lower is above the distance";
  if (!(static_cast<long double>(d.upper) >= truth.lower())) return "upper is below the distance";
  if (d.is_overlapping && d.lower > 0) return "crossing, but proven apart";
  if (d.is_overlapping && !(d.upper <= noise)) return "crossing, but upper is more than noise";
  if (!(std::abs(d.nhat_AB.norm() - 1) <= 8 * kUnitRoundoff)) return "normal is not unit";
  if (d.lower > 0 && !(slab_gap(a, b, d.nhat_AB) >= wide(d.lower - noise / 16))) {
    return "normal does not prove lower";
  }
  return nullptr;
}

/// Returns which promise on witness points and features the answer breaks, or nullptr.
inline const char* broken_witness(const Triangle& a, const Triangle& b, const TriangleDistance& d) {
  const Scalar noise = point_noise(a, b);
  if (!d.p_a.allFinite() || !d.p_b.allFinite()) return "a witness point is not finite";
  if (!(std::abs((d.p_b - d.p_a).norm() - d.upper) <= 2 * noise)) {
    return "the witness points are not upper apart";
  }
  const Triangle part_a = feature_part(a, d.feature_a);
  const Triangle part_b = feature_part(b, d.feature_b);
  for (const Triangle* part : {&part_a, &part_b}) {
    for (const Vector3& p : *part) {
      if (!p.allFinite()) return "a feature names no vertices";
    }
  }
  if (!(oracle_triangle_distance({d.p_a, d.p_a, d.p_a}, part_a).lower() <= wide(noise))) {
    return "p_a is not on its feature";
  }
  if (!(oracle_triangle_distance({d.p_b, d.p_b, d.p_b}, part_b).lower() <= wide(noise))) {
    return "p_b is not on its feature";
  }
  return nullptr;
}

}  // namespace dyop::testing
