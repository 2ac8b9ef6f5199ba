// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/paper/lin_canny.h"

#include "paper/feature_walk.h"

namespace dyop {
namespace {

using paper_internal::FeaturePair;
using paper_internal::FeatureWalk;
using paper_internal::Place;

// A triangle as a flat body: edge k from vertex k, one face.
struct TriangleBody {
  static constexpr bool is_flat = true;
  const Triangle& triangle;

  const Vector3& vertex(std::int32_t k) const { return triangle[static_cast<std::size_t>(k)]; }
  static std::array<std::int32_t, 2> ends(std::int32_t edge) { return {edge, (edge + 1) % 3}; }
  static std::array<std::int32_t, 1> faces(std::int32_t) { return {0}; }
  static std::array<std::int32_t, 3> corners(std::int32_t) { return {0, 1, 2}; }
  static std::array<std::int32_t, 3> sides(std::int32_t) { return {0, 1, 2}; }
  static std::array<std::int32_t, 2> edges_at(std::int32_t vertex) {
    return {vertex, (vertex + 2) % 3};
  }
  static std::int32_t face_count() { return 1; }
};

// The vertex farthest along the direction.
template <typename Points, typename Vector>
std::int32_t farthest_along(const Points& points, const Vector& direction) {
  std::size_t best = 0;
  Scalar highest = points[0].dot(direction);
  for (std::size_t k = 1; k < points.size(); ++k) {
    const Scalar height = points[k].dot(direction);
    best = height > highest ? k : best;
    highest = height > highest ? height : highest;
  }
  return static_cast<std::int32_t>(best);
}

bool is_valid(const Place& place, std::int32_t vertices, std::int32_t edges, std::int32_t faces) {
  const std::int32_t count = place.kind == FeatureKind::Vertex ? vertices
                             : place.kind == FeatureKind::Edge ? edges
                             : place.kind == FeatureKind::Face ? faces
                                                               : 0;
  return place.number >= 0 && place.number < count;
}

// From the last query, or from the vertices facing the other's centroid. Never two faces.
std::pair<Place, Place> start_of(const Triangle& a, const Triangle& b, const LinCannyCache* cache) {
  if (cache != nullptr && is_valid(cache->a, 3, 3, 1) && is_valid(cache->b, 3, 3, 1) &&
      (cache->a.kind != FeatureKind::Face || cache->b.kind != FeatureKind::Face)) {
    return {cache->a, cache->b};
  }
  const Vector3 direction = (b[0] + b[1] + b[2]) - (a[0] + a[1] + a[2]);
  return {paper_internal::vertex_place(farthest_along(a, direction)),
          paper_internal::vertex_place(farthest_along(b, Vector3(-direction)))};
}

void remember(LinCannyCache* cache, const FeaturePair& pair, int steps, bool is_certified) {
  if (cache == nullptr) return;
  *cache = {pair.a, pair.b, steps, is_certified};
}

template <typename Body>
Feature feature_of(const Body& body, const Place& place) {
  Feature feature{place.kind, {place.number}};
  if (place.kind == FeatureKind::Edge) {
    const auto ends = body.ends(place.number);
    feature.vertices = {std::min(ends[0], ends[1]), std::max(ends[0], ends[1])};
  } else if (place.kind == FeatureKind::Face) {
    feature.vertices = body.corners(place.number);
    std::sort(feature.vertices.begin(), feature.vertices.end());
  }
  return feature;
}

// Extent of the box around both: no two points are farther apart. The sum keeps NaN.
Scalar extent(const Triangle& a, const Triangle& b) {
  AlignedBox box(a[0]);
  Scalar sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    box.extend(a[k]);
    box.extend(b[k]);
    sum += a[k].sum() + b[k].sum();
  }
  return box.sizes().sum() + 0 * sum;
}

// The bounds proven by the end of the walk; see kFeatureSlack for the rounding.
TriangleDistance proven(const Triangle& a, const Triangle& b, const FeaturePair& pair,
                        const Vector3& m, Scalar size) {
  TriangleDistance result;
  Scalar high_a = -kInfinity;
  Scalar low_b = kInfinity;
  for (std::size_t k = 0; k < 3; ++k) {
    high_a = std::max(high_a, m.dot(a[k] - pair.p_a));
    low_b = std::min(low_b, m.dot(b[k] - pair.p_a));
  }
  const Scalar norm = m.norm();
  const Scalar gap = (low_b - high_a) / norm;
  result.lower = std::max(Scalar{0}, gap - kFeatureSlack * size);
  result.upper = std::sqrt(pair.length_sq) + kFeatureSlack * size;
  result.p_a = pair.p_a;
  result.p_b = pair.p_a + pair.w;
  result.nhat_AB = m / norm;
  return result;
}

// A hull as a body, with its vertices transformed by the pose: the identity for the first one.
class HullBody {
 public:
  explicit HullBody(const HullFeatures& features, const RigidPose* X_AB = nullptr)
      : is_flat(features.hull().dimension() < 3),
        features_(features),
        X_AB_(X_AB),
        triangles_(features.hull().core_surface()->triangles()) {}

  const bool is_flat;

  Vector3 vertex(std::int32_t k) const {
    const Vector3& p = features_.hull().vertices()[static_cast<std::size_t>(k)];
    return X_AB_ ? Vector3(*X_AB_ * p) : p;
  }
  const std::array<std::int32_t, 2>& ends(std::int32_t edge) const { return at(edge).vertices; }
  const std::array<std::int32_t, 2>& faces(std::int32_t edge) const { return at(edge).faces; }
  const TriangleIndices& corners(std::int32_t face) const {
    return triangles_[static_cast<std::size_t>(face)];
  }
  const std::array<std::int32_t, 3>& sides(std::int32_t face) const {
    return features_.edges_of_face(face);
  }
  std::span<const std::int32_t> edges_at(std::int32_t vertex) const {
    return features_.edges_of_vertex(vertex);
  }
  std::int32_t face_count() const {
    return features_.hull().dimension() < 2 ? 0 : static_cast<std::int32_t>(triangles_.size());
  }
  bool has(const Place& place) const {
    return is_valid(place, vertex_count(), static_cast<std::int32_t>(features_.edges().size()),
                    face_count());
  }
  std::int32_t vertex_count() const {
    return static_cast<std::int32_t>(features_.hull().vertices().size());
  }

 private:
  const HullFeatures::Edge& at(std::int32_t edge) const {
    return features_.edges()[static_cast<std::size_t>(edge)];
  }

  const HullFeatures& features_;
  const RigidPose* X_AB_;
  std::span<const TriangleIndices> triangles_;
};

std::pair<Place, Place> start_of(const HullBody& body_a, const HullBody& body_b,
                                 const ConvexHull& a, const ConvexHull& b, const RigidPose& X_AB,
                                 const LinCannyCache* cache) {
  if (cache != nullptr && body_a.has(cache->a) && body_b.has(cache->b) &&
      (cache->a.kind != FeatureKind::Face || cache->b.kind != FeatureKind::Face)) {
    return {cache->a, cache->b};
  }
  const Vector3 direction = X_AB * b.core_center() - a.core_center();
  return {paper_internal::vertex_place(a.core_support(direction).vertex.value()),
          paper_internal::vertex_place(
              b.core_support(-(X_AB.rotation().transpose() * direction)).vertex.value())};
}

// The bounds proven by the end of the walk, rounded as docs/algorithms/gjk.md derives.
GjkResult proven(const ConvexHull& a, const ConvexHull& b, const RigidPose& X_AB,
                 const FeaturePair& pair, const Vector3& m, Scalar noise) {
  GjkResult result;
  const Vector3 nhat_A = m.normalized();
  const Vector3 low_b = X_AB * b.core_support(-(X_AB.rotation().transpose() * nhat_A)).point;
  const Scalar gap = nhat_A.dot(low_b - a.core_support(nhat_A).point);
  result.lower = std::max(Scalar{0}, gap - noise);
  result.upper = std::sqrt(pair.length_sq) + noise;
  result.p_a = pair.p_a;
  result.p_b = pair.p_a + pair.w;
  result.nhat_AB = nhat_A;
  return result;
}

}  // namespace

TriangleDistance lin_canny_distance(const Triangle& a, const Triangle& b, LinCannyCache* cache) {
  const TriangleBody body_a{a};
  const TriangleBody body_b{b};
  const auto [place_a, place_b] = start_of(a, b, cache);
  FeatureWalk<TriangleBody, TriangleBody> walk(body_a, body_b, place_a, place_b);
  walk.run(kTriangleFeatureLimit);
  const FeaturePair& pair = walk.pair();
  const Scalar size = extent(a, b);
  const bool is_in_range = size >= kSmallestTriangleSize && size <= kLargestTriangleSize;
  if (is_in_range) {
    TriangleDistance result = proven(a, b, pair, walk.proof_direction(), size);
    if (result.lower > 0 && result.upper - result.lower <= kTriangleNoise * size) {
      remember(cache, pair, walk.steps(), true);
      result.feature_a = feature_of(body_a, pair.a);
      result.feature_b = feature_of(body_b, pair.b);
      return result;
    }
  }
  remember(cache, pair, walk.steps(), false);
  return triangle_distance(a, b);
}

GjkResult lin_canny_distance(const HullFeatures& a, const HullFeatures& b, const RigidPose& X_AB,
                             LinCannyCache* cache) {
  const HullBody body_a(a);
  const HullBody body_b(b, &X_AB);
  const auto [place_a, place_b] = start_of(body_a, body_b, a.hull(), b.hull(), X_AB, cache);
  FeatureWalk<HullBody, HullBody> walk(body_a, body_b, place_a, place_b);
  walk.run(kFeatureLimit * (body_a.vertex_count() + body_b.vertex_count()));
  const FeaturePair& pair = walk.pair();
  const Scalar noise = kPoseNoise * (X_AB.translation().norm() + a.hull().bounding_radius() +
                                     b.hull().bounding_radius());
  GjkResult result = proven(a.hull(), b.hull(), X_AB, pair, walk.proof_direction(), noise);
  // Both bounds have moved outwards by the noise; any remainder was left open by the walk.
  const bool is_certified = result.lower > 0 && result.upper - result.lower <= 3 * noise;
  remember(cache, pair, walk.steps(), is_certified);
  if (is_certified) {
    result.feature_a = feature_of(body_a, pair.a);
    result.feature_b = feature_of(body_b, pair.b);
  } else {
    result = gjk_distance(a.hull(), b.hull(), X_AB);
  }
  result.iterations += walk.steps();
  return result;
}

}  // namespace dyop
