#include "dyop/distance/triangle_distance.h"

#include "distance/triangle_facets.h"

namespace dyop {
namespace internal {
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

/// triangle_distance() for sizes whose powers leave the range of double: scaled by a power of two,
/// which is exact, or smaller by far than the slack.
TriangleDistance extreme_triangle_distance(const Triangle& a, const Triangle& b) {
  TriangleDistance result;
  result.upper = kInfinity;
  result.p_a = a[0];
  result.p_b = b[0];
  const Scalar largest = largest_difference(a, b);
  if (!std::isfinite(largest)) return result;  // proves nothing
  if (largest == 0) {
    result.upper = 0;
    result.feature_a = result.feature_b = feature_of_place(0);
    result.is_crossing = true;
    return result;
  }
  const int exponent = std::ilogb(largest);
  result = triangle_distance(scaled(a, -exponent), scaled(b, -exponent));
  // Back in the smallest numbers a result may be rounded: outward.
  constexpr Scalar kStep = std::numeric_limits<Scalar>::denorm_min();
  result.lower = std::max(Scalar{0}, std::ldexp(result.lower, exponent) - kStep);
  if (result.upper > 0) result.upper = std::ldexp(result.upper, exponent) + kStep;
  for (Vector3* p : {&result.p_a, &result.p_b}) {
    for (Scalar& x : *p) x = std::ldexp(x, exponent);
  }
  return result;
}

}  // namespace

}  // namespace internal

TriangleDistance triangle_distance(const Triangle& a, const Triangle& b) {
  using namespace internal;
  const TrianglePair pair(a, b);
  if (!(pair.size >= kSmallestTriangleSize && pair.size <= kLargestTriangleSize)) {
    return extreme_triangle_distance(a, b);
  }
  TriangleDistance result;
  Vector3 direction =
      pair.r + ((pair.b[0] - pair.b[2]) - (pair.a[0] - pair.a[2])) * (Scalar{1} / 3);
  const Scalar edges =
      (pair.aa[0] + pair.aa[1] + pair.aa[2]) + (pair.bb[0] + pair.bb[1] + pair.bb[2]);
  if (direction.dot(direction) > kTriangleFarRatio * edges) {
    if (certify(pair, directed_witness(pair, direction), result)) return result;
  }
  const Facets facets(pair);
  const Scalar contact = kTriangleContactGap * pair.size;
  if (facets.best > contact * contact) {
    const Witness w = facets.code < 9 ? edge_witness(pair, facets.code / 3, facets.code % 3)
                                      : face_witness(pair, facets, facets.code == 9);
    if (certify(pair, w, result)) return result;
    direction = w.D;
  } else {
    result = TriangleDistance{};
    result.upper = kInfinity;
  }
  return resolve_triangle_pair(pair, facets, direction, result);
}

Scalar triangle_noise(const Triangle& a, const Triangle& b) {
  return kTriangleNoise * internal::TrianglePair(a, b).size;
}

}  // namespace dyop
