// SPDX-License-Identifier: BSD-3-Clause
#include "distance/triangle/triangle_shared.h"

#include <bit>
#include <cstddef>

#include "distance/triangle/triangle_facets.h"

namespace dyop::distance_internal {
namespace {

constexpr int kRowOf[9] = {0, 0, 0, 1, 1, 1, 2, 2, 2};
constexpr int kColumnOf[9] = {0, 1, 2, 0, 1, 2, 0, 1, 2};
/// Pairs of vertices that contain neither vertex of the given pair.
constexpr unsigned kOthers[9] = {0b110110000, 0b101101000, 0b011011000, 0b110000110, 0b101000101,
                                 0b011000011, 0b000110110, 0b000101101, 0b000011011};

/// Unit normal from a to b for triangles with a common edge. Either face's normal separates them,
/// and that of the larger face is more accurate. Zero if both faces are too thin, or not in range.
Vector3 hinge_normal(const Triangle& a, const Triangle& b, int first, int second) {
  const auto at = [](int k) { return static_cast<std::size_t>(k); };
  const VectorPair edge02[2] = {VectorPair(a[1], b[1]) - VectorPair(a[0], b[0]),
                                VectorPair(a[0], b[0]) - VectorPair(a[2], b[2])};
  const VectorPair n = edge02[1].cross(edge02[0]);
  const LanePair squares = n.dot(n);
  const LanePair lengths = edge02[0].dot(edge02[0]) + edge02[1].dot(edge02[1]);
  const bool of_a = squares.low() >= squares.high();
  const Scalar squared = of_a ? squares.low() : squares.high();
  const Scalar length = of_a ? lengths.low() : lengths.high();
  constexpr Scalar kFourth = kLargestTriangleSize * kLargestTriangleSize;
  // A sum, so that NaN in either triangle is rejected.
  const bool is_in_range = lengths.low() + lengths.high() <= kFourth && length * kFourth >= 1;
  if (!is_in_range || !(squared >= kTriangleParallelSquare * (length * length))) {
    return Vector3::Zero();
  }
  // From the common edge to the other triangle's own vertex.
  const int i = 3 - kRowOf[first] - kRowOf[second];
  const int j = 3 - kColumnOf[first] - kColumnOf[second];
  const Vector3& common = a[at(kRowOf[first])];
  const Vector3 out = of_a ? Vector3(b[at(j)] - common) : Vector3(common - a[at(i)]);
  const Vector3 normal = of_a ? n.low() : n.high();
  const Scalar inverse = 1 / std::sqrt(squared);
  return normal * (dot(normal, out) < 0 ? -inverse : inverse);
}

}  // namespace

Vector3 touching_normal(const Triangle& a, const Triangle& b, unsigned equal_mask) {
  const int first = std::countr_zero(equal_mask);
  if (const unsigned others = equal_mask & kOthers[first]; others != 0) {
    const Vector3 normal = hinge_normal(a, b, first, std::countr_zero(others));
    if (normal != Vector3::Zero()) return normal;
  }
  const TrianglePair pair(a, b);
  if (!(pair.size >= kSmallestTriangleSize && pair.size <= kLargestTriangleSize)) {
    return Vector3::Zero();
  }
  return facet_normal(pair, Facets(pair, face_normals(pair)));
}

}  // namespace dyop::distance_internal
