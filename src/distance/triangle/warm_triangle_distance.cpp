// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/distance/warm_triangle_distance.h"

#include <optional>

#include "distance/triangle/triangle_pair.h"

namespace dyop {
namespace {

using namespace distance_internal;

bool is_corner(std::int32_t number) {
  return number >= 0 && number < 3;
}

// Number of an edge that contains the feature; nothing for other features. Edge k runs from vertex
// k to vertex k + 1, and the feature may list them in either order.
std::optional<int> edge_with(const Feature& feature) {
  const auto [first, second, unused] = feature.vertices;
  if (!is_corner(first)) return std::nullopt;
  if (feature.kind == FeatureKind::Vertex) return first;
  if (feature.kind != FeatureKind::Edge || !is_corner(second)) return std::nullopt;
  return kNext[first] == second ? first : second;
}

// Witness of a vertex above the interior of the other triangle's face; nothing if it is beyond it.
std::optional<Witness> vertex_above_face(const TrianglePair& pair, bool is_face_of_a, int vertex) {
  const Triangle& face = is_face_of_a ? pair.A : pair.B;
  const Vector3& p = (is_face_of_a ? pair.B : pair.A)[static_cast<std::size_t>(vertex)];
  const Vector3* edge = is_face_of_a ? pair.a : pair.b;
  const Vector3 n = edge[2].cross(edge[0]);
  const Vector3 x = p - face[0];
  const Scalar inverse = 1 / dot(n, n);
  // Coordinates of the foot along the edges at vertex 0. False for NaN, of a face without area.
  const Scalar v = -(dot(x.cross(edge[2]), n) * inverse);
  const Scalar w = dot(edge[0].cross(x), n) * inverse;
  if (!(v >= 0 && w >= 0 && v + w <= 1)) return std::nullopt;
  const Vector3 ve = v * edge[0];
  const Vector3 we = w * edge[2];
  const Vector3 D = (x - ve) + we;
  const Vector3 foot = (face[0] + ve) - we;
  Witness result;
  result.D = is_face_of_a ? D : Vector3(-D);
  result.m = dot(n, result.D) < 0 ? Vector3(-n) : n;
  result.p_a = is_face_of_a ? foot : p;
  result.p_b = is_face_of_a ? p : foot;
  result.place_a = is_face_of_a ? kFaceCode : vertex;
  result.place_b = is_face_of_a ? vertex : kFaceCode;
  return result;
}

std::optional<Witness> witness_of(const TrianglePair& pair, const Feature& a, const Feature& b) {
  const bool is_face_of_a = a.kind == FeatureKind::Face;
  if (is_face_of_a || b.kind == FeatureKind::Face) {
    const Feature& other = is_face_of_a ? b : a;
    if (other.kind != FeatureKind::Vertex || !is_corner(other.vertices[0])) return std::nullopt;
    return vertex_above_face(pair, is_face_of_a, other.vertices[0]);
  }
  const std::optional<int> edge_a = edge_with(a);
  const std::optional<int> edge_b = edge_with(b);
  if (!edge_a || !edge_b) return std::nullopt;
  return edge_witness(pair, *edge_a, *edge_b);
}

}  // namespace

TriangleDistance warm_triangle_distance(const Triangle& a, const Triangle& b, const Feature& last_a,
                                        const Feature& last_b) {
  const TrianglePair pair(a, b);
  if (pair.size >= kSmallestTriangleSize && pair.size <= kLargestTriangleSize) {
    if (const std::optional<Witness> witness = witness_of(pair, last_a, last_b)) {
      const Bounds bounds = prove(pair, witness->m, witness->D);
      if (is_certified(pair, bounds.lower, bounds.upper)) return result_of(*witness, bounds);
    }
  }
  return triangle_distance(a, b);
}

}  // namespace dyop
