// SPDX-License-Identifier: BSD-3-Clause
#include "distance/triangle/triangle_facets.h"

#include <cstddef>

namespace dyop::distance_internal {
namespace {

struct VertexOrder {
  int lowest;
  int highest;
};

/// Numbers of the smallest and the largest of three values, by a table and without branches.
VertexOrder order_of(Scalar x0, Scalar x1, Scalar x2) {
  static constexpr VertexOrder kOrders[8] = {{2, 0}, {2, 1}, {1, 0}, {0, 0},
                                             {2, 0}, {0, 1}, {1, 2}, {0, 2}};
  return kOrders[static_cast<int>(x0 < x1) + 2 * static_cast<int>(x1 < x2) +
                 4 * static_cast<int>(x0 < x2)];
}

}  // namespace

Witness face_witness(const TrianglePair& pair, const Facets& facets, bool of_a) {
  const Vector3 n = of_a ? facets.n.low() : facets.n.high();
  const auto height = [&](int k) {
    return of_a ? facets.height[k].low() : facets.height[k].high();
  };
  const bool is_above = smaller(smaller(height(0), height(1)), height(2)) > 0;
  const Scalar sign = is_above ? 1 : -1;
  const VertexOrder order = order_of(sign * height(0), sign * height(1), sign * height(2));
  const int nearest = order.lowest;
  const Triangle& face = of_a ? pair.A : pair.B;
  const auto at = [](int k) { return static_cast<std::size_t>(k); };
  const Vector3& vertex = of_a ? pair.B[at(nearest)] : pair.A[at(nearest)];
  const Vector3* edge = of_a ? pair.a : pair.b;
  const Vector3 x = vertex - face[0];
  const Scalar inverse = 1 / dot(n, n);
  const Scalar v = -(dot(x.cross(edge[2]), n) * inverse);
  const Scalar w = dot(edge[0].cross(x), n) * inverse;
  const Scalar rest = (1 - v) - w;
  if (!(v >= 0 && w >= 0 && rest >= 0)) {
    int beyond = v < rest ? 2 : 1;  // the edge opposite to vertex k is k + 1
    if (w < smaller(v, rest)) beyond = 0;
    return of_a ? edge_witness(pair, beyond, kNext[order.highest])
                : edge_witness(pair, kNext[order.highest], beyond);
  }
  Witness result;
  const Vector3 ve = v * edge[0];
  const Vector3 we = w * edge[2];
  const Vector3 D = (x - ve) + we;
  const Vector3 foot = (face[0] + ve) - we;
  result.m = is_above == of_a ? n : Vector3(-n);
  result.D = of_a ? D : Vector3(-D);
  result.p_a = of_a ? foot : vertex;
  result.p_b = of_a ? vertex : foot;
  result.place_a = of_a ? kFaceCode : nearest;
  result.place_b = of_a ? nearest : kFaceCode;
  return result;
}

Vector3 facet_normal(const TrianglePair& pair, const Facets& facets) {
  Vector3 normal;
  if (facets.code >= 9) {
    const bool of_a = facets.code == 9;
    normal = of_a ? facets.n.low() : facets.n.high();
    // The side with the smaller depth.
    Scalar sum = 0, most = 0;
    for (const LanePair& height : facets.height) {
      const Scalar value = of_a ? height.low() : -height.high();
      sum = std::abs(value) > std::abs(most) ? value : sum;
      most = sum;
    }
    if (most < 0) normal = -normal;
  } else {
    const int i = facets.code / 3;
    const int j = facets.code % 3;
    normal = pair.a[i].cross(pair.b[j]);
    if (dot(pair.a[i], facets.n.high()) + dot(pair.b[j], facets.n.low()) < 0) normal = -normal;
  }
  const Scalar squared = dot(normal, normal);
  if (!(squared >= kSmallestSquaredDirection)) return Vector3::UnitX();
  return normal * (1 / std::sqrt(squared));
}

Witness directed_witness(const TrianglePair& pair, const Vector3& c) {
  // The edge opposite to a vertex has the number of the next one.
  const int i = kNext[order_of(0, dot(c, pair.a[0]), -dot(c, pair.a[2])).lowest];
  const int j = kNext[order_of(0, dot(c, pair.b[0]), -dot(c, pair.b[2])).highest];
  return edge_witness(pair, i, j);
}

}  // namespace dyop::distance_internal
