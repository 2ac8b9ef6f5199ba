// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/distance/triangle_distance.h"

#include <bit>

#include "distance/triangle/triangle_facets.h"
#include "distance/triangle/triangle_shared.h"

namespace dyop {
namespace distance_internal {
namespace {

/// Largest absolute difference of coordinates of the two triangles; NaN or infinite if one is.
Scalar largest_difference(const Triangle& a, const Triangle& b) {
  Scalar largest = 0;
  Scalar sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    for (const Vector3& x : {Vector3(a[k] - a[0]), Vector3(b[k] - a[0])}) {
      largest = std::max(largest, x.cwiseAbs().maxCoeff());
      sum += x.sum();
    }
  }
  return std::isfinite(sum) ? largest : sum;
}

Triangle scaled(const Triangle& triangle, int exponent) {
  Triangle result = triangle;
  for (Vector3& vertex : result) {
    for (Scalar& x : vertex) x = std::ldexp(x, exponent);
  }
  return result;
}

/// What scaling by a power of two may lose, in the scale of the result: coordinates scaled into the
/// smallest numbers are off by half of the least one, and so is a result scaled back into them.
Scalar scaling_loss(int exponent) {
  constexpr Scalar kStep = std::numeric_limits<Scalar>::denorm_min();
  return 4 * (kStep + std::ldexp(kStep, exponent));
}

/// How to scale a pair by 2^-exponent so that its largest difference is in [1, 2).
struct Scaling {
  Scalar largest;  ///< NaN or infinite if a coordinate is, or if differences overflow
  int exponent;

  Scaling(const Triangle& a, const Triangle& b)
      : largest(largest_difference(a, b)),
        exponent(std::isfinite(largest) && largest > 0 ? std::ilogb(largest) : 0) {}
};

/// triangle_distance() for sizes whose powers leave the range of double.
TriangleDistance extreme_triangle_distance(const Triangle& a, const Triangle& b) {
  TriangleDistance result;
  result.upper = kInfinity;
  result.feature_a = result.feature_b = feature_of_place(kFaceCode);
  result.p_a = a[0];
  result.p_b = b[0];
  const Scaling scaling(a, b);
  if (!std::isfinite(scaling.largest)) return result;  // proves nothing
  // Before scaling, which may merge vertices.
  if (const unsigned equal = equal_vertices(a, b); equal != 0) {
    const auto i = static_cast<std::size_t>(std::countr_zero(equal));
    result.upper = 0;
    result.p_a = result.p_b = a[i / 3];
    result.feature_a = feature_of_place(static_cast<int>(i / 3));
    result.feature_b = feature_of_place(static_cast<int>(i % 3));
    result.is_overlapping = true;
    return result;
  }
  const int exponent = scaling.exponent;
  result = triangle_distance(scaled(a, -exponent), scaled(b, -exponent));
  const Scalar loss = scaling_loss(exponent);
  result.lower = std::max(Scalar{0}, std::ldexp(result.lower, exponent) - loss);
  result.upper = std::ldexp(result.upper, exponent) + loss;
  for (Vector3* p : {&result.p_a, &result.p_b}) {
    for (Scalar& x : *p) x = std::ldexp(x, exponent);
  }
  return result;
}

/// Whether both triangles are segments or points up to rounding.
bool are_segments(const TrianglePair& pair, const VectorPair& n) {
  const LanePair squares = LanePair(pair.aa[0], pair.bb[0]) * LanePair(pair.aa[2], pair.bb[2]);
  return bits(above(n.dot(n), LanePair(kTriangleFlatSquare) * squares)) == 0;
}

int longest_of(const Scalar* squares) {
  const int longer = squares[1] > squares[0] ? 1 : 0;
  return squares[2] > squares[longer] ? 2 : longer;
}

}  // namespace

}  // namespace distance_internal

TriangleDistance triangle_distance(const Triangle& a, const Triangle& b) {
  using namespace distance_internal;
  if (may_share_vertex(a, b)) {
    if (const unsigned equal = equal_vertices(a, b); equal != 0) {
      const Vector3 normal = touching_normal(a, b, equal);
      const int first = std::countr_zero(equal);
      const Vector3& p = a[static_cast<std::size_t>(first / 3)];
      if (normal != Vector3::Zero()) {
        return {0, 0, p, p, normal, feature_of_place(first / 3), feature_of_place(first % 3), true};
      }
    }
  }
  const TrianglePair pair(a, b);
  if (!(pair.size >= kSmallestTriangleSize && pair.size <= kLargestTriangleSize)) {
    return extreme_triangle_distance(a, b);
  }
  // From centroid to centroid.
  const VectorPair spread = pair.b02 - pair.a02;
  const Vector3 direction = pair.r + (spread.low() - spread.high()) * (Scalar{1} / 3);
  if (dot(direction, direction) > kTriangleFarRatio * pair.edges) {
    const Witness w = directed_witness(pair, direction);
    const Bounds bounds = prove(pair, w.m, w.D);
    if (is_certified(pair, bounds.lower, bounds.upper)) return result_of(w, bounds);
  }
  const VectorPair n = face_normals(pair);
  if (are_segments(pair, n)) {
    const Witness w = edge_witness(pair, longest_of(pair.aa), longest_of(pair.bb));
    const Bounds bounds = prove(pair, w.m, w.D);
    if (is_certified(pair, bounds.lower, bounds.upper)) return result_of(w, bounds);
    return resolve_triangle_pair(pair, Facets(pair, n), w.D, result_of(w, bounds));
  }
  const Facets facets(pair, n);
  const Scalar contact = kTriangleContactGap * pair.size;
  if (facets.best > contact * contact) {
    const Witness w = facets.code < 9 ? edge_witness(pair, facets.code / 3, facets.code % 3)
                                      : face_witness(pair, facets, facets.code == 9);
    const Bounds bounds = prove(pair, w.m, w.D);
    if (is_certified(pair, bounds.lower, bounds.upper)) return result_of(w, bounds);
    return resolve_triangle_pair(pair, facets, w.D, result_of(w, bounds));
  }
  TriangleDistance found;
  found.upper = kInfinity;
  return resolve_triangle_pair(pair, facets, direction, found);
}

Scalar triangle_noise(const Triangle& a, const Triangle& b) {
  using namespace distance_internal;
  const Scalar size = TrianglePair(a, b).size;
  if (size >= kSmallestTriangleSize && size <= kLargestTriangleSize) return kTriangleNoise * size;
  const Scaling scaling(a, b);
  if (!(scaling.largest > 0)) return scaling.largest;
  const int exponent = scaling.exponent;
  const Triangle small_a = scaled(a, -exponent);
  const Triangle small_b = scaled(b, -exponent);
  const Scalar scaled_size = TrianglePair(small_a, small_b).size;
  return std::ldexp(kTriangleNoise * scaled_size, exponent) + 2 * scaling_loss(exponent);
}

}  // namespace dyop
