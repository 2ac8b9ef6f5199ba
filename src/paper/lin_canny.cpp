// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/paper/lin_canny.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "paper/planar_core.h"

// The walk of lin_canny_distance() in space, for any two bodies with these members:
//   vertex(number)               a Vector3 in the frame of the walk
//   ends(edge), faces(edge)      two numbers each; -1 for no face
//   corners(face), sides(face)   three vertex and three edge numbers; side k starts at corner k
//   edges_at(vertex)             a range of edge numbers
//   face_count()
//   is_flat                      flat bodies have faces with two outer sides
namespace dyop::paper_internal {

using Place = LinCannyCache::Place;

inline Place vertex_place(std::int32_t number) {
  return {FeatureKind::Vertex, number};
}
inline Place edge_place(std::int32_t number) {
  return {FeatureKind::Edge, number};
}
inline Place face_place(std::int32_t number) {
  return {FeatureKind::Face, number};
}

// The nearest points of two closed features, on the smallest features that contain them.
struct FeaturePair {
  Place a;
  Place b;
  Vector3 p_a = Vector3::Zero();
  Vector3 w = Vector3::Zero();  // from p_a to the point on b
  Scalar length_sq = kInfinity;

  FeaturePair swapped() const { return {b, a, p_a + w, -w, length_sq}; }
  void keep_nearer(const FeaturePair& other) {
    if (other.length_sq < length_sq) *this = other;
  }
};

inline Scalar unit_clamped(Scalar x) {
  return x > 0 ? std::min(x, Scalar{1}) : 0;  // NaN gives 0
}

// An edge with its vertex numbers and coordinates.
template <typename Body>
struct EdgeLine {
  std::int32_t number;
  std::array<std::int32_t, 2> ends;
  Vector3 start;
  Vector3 along;

  EdgeLine(const Body& body, std::int32_t edge)
      : number(edge),
        ends(body.ends(edge)),
        start(body.vertex(ends[0])),
        along(body.vertex(ends[1]) - start) {}

  Place place(Scalar t) const {
    if (!(t > 0)) return vertex_place(ends[0]);
    return t < 1 ? edge_place(number) : vertex_place(ends[1]);
  }
};

template <typename Body>
FeaturePair edge_to_point(const EdgeLine<Body>& edge, const Vector3& p, Place place) {
  const Vector3 r = p - edge.start;
  const Scalar t = unit_clamped(r.dot(edge.along) / edge.along.squaredNorm());
  const Vector3 w = r - t * edge.along;
  return {edge.place(t), place, edge.start + t * edge.along, w, w.squaredNorm()};
}

// [Ericson2005] 5.1.9, with cross products in place of the Gram determinant, which loses half of
// the digits for nearly parallel edges.
template <typename BodyA, typename BodyB>
FeaturePair edge_to_edge(const EdgeLine<BodyA>& a, const EdgeLine<BodyB>& b) {
  const Vector3 r = b.start - a.start;
  const Vector3 n = a.along.cross(b.along);
  const Scalar ab = a.along.dot(b.along);
  Scalar s = unit_clamped(r.cross(b.along).dot(n) / n.squaredNorm());
  const Scalar t = unit_clamped((s * ab - r.dot(b.along)) / b.along.squaredNorm());
  s = unit_clamped((t * ab + r.dot(a.along)) / a.along.squaredNorm());
  const Vector3 w = (r + t * b.along) - s * a.along;
  return {a.place(s), b.place(t), a.start + s * a.along, w, w.squaredNorm()};
}

template <typename Body>
Vector3 face_normal(const Body& body, std::int32_t face) {
  const auto corners = body.corners(face);
  const Vector3 origin = body.vertex(corners[0]);
  return (body.vertex(corners[1]) - origin).cross(body.vertex(corners[2]) - origin);
}

// The plane of a face, and its sides, which a point may be beyond.
template <typename Body>
struct FacePlane {
  std::array<Vector3, 3> corners;
  Vector3 normal;
  Scalar normal_sq;

  FacePlane(const Body& body, std::int32_t face)
      : corners{body.vertex(body.corners(face)[0]), body.vertex(body.corners(face)[1]),
                body.vertex(body.corners(face)[2])},
        normal((corners[1] - corners[0]).cross(corners[2] - corners[0])),
        normal_sq(normal.squaredNorm()) {}

  // From the foot of the perpendicular from p to p, if the foot is inside. Nothing for a face
  // without area. u and v are coordinates along the sides at corner 0, times normal_sq. Whatever
  // rounding does to them, they give a point of the face; a foot along the normal of a thin face
  // need not be one.
  std::optional<Vector3> height(const Vector3& p) const {
    const Vector3 along = corners[1] - corners[0];
    const Vector3 across = corners[2] - corners[0];
    const Vector3 r = p - corners[0];
    const Scalar u = r.cross(across).dot(normal);
    const Scalar v = along.cross(r).dot(normal);
    if (!(u > 0 && v > 0 && u + v < normal_sq)) return std::nullopt;
    return Vector3((r - (u / normal_sq) * along) - (v / normal_sq) * across);
  }
};

// A pair that stays empty unless the foot of p is inside the face.
template <typename Body>
FeaturePair inner_face_to_point(const FacePlane<Body>& plane, std::int32_t face, const Vector3& p,
                                Place place) {
  const std::optional<Vector3> w = plane.height(p);
  if (!w) return {};
  return {face_place(face), place, p - *w, *w, w->squaredNorm()};
}

template <typename Body>
FeaturePair face_to_point(const Body& body, std::int32_t face, const Vector3& p, Place place) {
  FeaturePair best = inner_face_to_point(FacePlane<Body>(body, face), face, p, place);
  if (best.a.number >= 0) return best;
  for (const std::int32_t side : body.sides(face)) {
    best.keep_nearer(edge_to_point(EdgeLine<Body>(body, side), p, place));
  }
  return best;
}

// A face and an edge that does not pierce it: an end above the face, or a side and the edge. (If
// the edge does pierce it, the bodies intersect; then the walk proves nothing.) The side already
// known to be farther, if any, is skipped.
template <typename BodyA, typename BodyB>
FeaturePair face_to_edge(const BodyA& a, std::int32_t face, const BodyB& b, std::int32_t edge,
                         std::int32_t known_side) {
  const FacePlane<BodyA> plane(a, face);
  const EdgeLine<BodyB> line(b, edge);
  FeaturePair best = inner_face_to_point(plane, face, line.start, vertex_place(line.ends[0]));
  best.keep_nearer(inner_face_to_point(plane, face, Vector3(line.start + line.along),
                                       vertex_place(line.ends[1])));
  for (const std::int32_t side : a.sides(face)) {
    if (side != known_side) best.keep_nearer(edge_to_edge(EdgeLine<BodyA>(a, side), line));
  }
  return best;
}

// Nearest points of any two features except two faces, which never meet in a walk. `known_edge` is
// an edge of the body that owns the face, see face_to_edge().
template <typename BodyA, typename BodyB>
FeaturePair nearest_points(const BodyA& a, Place place_a, const BodyB& b, Place place_b,
                           std::int32_t known_edge = -1) {
  if (place_b.kind == FeatureKind::Face ||
      (place_b.kind == FeatureKind::Edge && place_a.kind == FeatureKind::Vertex)) {
    return nearest_points(b, place_b, a, place_a, known_edge).swapped();
  }
  if (place_a.kind == FeatureKind::Vertex) {
    const Vector3 p = a.vertex(place_a.number);
    const Vector3 w = b.vertex(place_b.number) - p;
    return {place_a, place_b, p, w, w.squaredNorm()};
  }
  const bool is_face = place_a.kind == FeatureKind::Face;
  if (place_b.kind == FeatureKind::Vertex) {
    const Vector3 p = b.vertex(place_b.number);
    if (is_face) return face_to_point(a, place_a.number, p, place_b);
    return edge_to_point(EdgeLine<BodyA>(a, place_a.number), p, place_b);
  }
  if (is_face) return face_to_edge(a, place_a.number, b, place_b.number, known_edge);
  return edge_to_edge(EdgeLine<BodyA>(a, place_a.number), EdgeLine<BodyB>(b, place_b.number));
}

// The three functions below return the neighbour of the feature, one dimension up, towards which a
// step along w goes the most: the Voronoi plane that the other point is farthest beyond. Smooth if
// it is beyond none.
template <typename Body>
Place steepest_edge(const Body& body, std::int32_t vertex, const Vector3& w) {
  Place best;
  // The slope is along / |e|; compared without dividing.
  Scalar best_square = 0;
  Scalar best_length_sq = 1;
  const Vector3 p = body.vertex(vertex);
  for (const std::int32_t edge : body.edges_at(vertex)) {
    const auto ends = body.ends(edge);
    const Vector3 e = body.vertex(ends[0] == vertex ? ends[1] : ends[0]) - p;
    const Scalar along = e.dot(w);
    const Scalar length_sq = e.squaredNorm();
    if (!(along > 0 && along * along * best_length_sq > best_square * length_sq)) continue;
    best_square = along * along;
    best_length_sq = length_sq;
    best = edge_place(edge);
  }
  return best;
}

// Because w is perpendicular to the edge, the third corner of a face tells whether the face is
// nearer.
template <typename Body>
Place steepest_face(const Body& body, std::int32_t edge, const Vector3& w) {
  Place best;
  Scalar farthest = 0;
  const auto ends = body.ends(edge);
  const Vector3 start = body.vertex(ends[0]);
  for (const std::int32_t face : body.faces(edge)) {
    if (face < 0) continue;
    const auto corners = body.corners(face);
    std::size_t k = 0;
    while (k < 2 && (corners[k] == ends[0] || corners[k] == ends[1])) ++k;
    const Scalar along = (body.vertex(corners[k]) - start).dot(w);
    if (!(along > farthest)) continue;
    farthest = along;
    best = face_place(face);
  }
  return best;
}

template <typename Body>
Place steepest_neighbour(const Body& body, Place place, const Vector3& w) {
  switch (place.kind) {
    case FeatureKind::Vertex:
      return steepest_edge(body, place.number, w);
    case FeatureKind::Edge:
      return steepest_face(body, place.number, w);
    case FeatureKind::Face:
    case FeatureKind::Smooth:
      return {};
  }
  return {};  // not reached
}

// Whether the other point is behind the face, where the nearest point of the face is not a nearest
// point of the body (a local minimum in [Mirtich1998]).
template <typename Body>
bool is_behind(const Body& body, Place place, const Vector3& w) {
  return !body.is_flat && place.kind == FeatureKind::Face &&
         face_normal(body, place.number).dot(w) < 0;
}

// The face that p is farthest in front of; Smooth if p is behind all.
template <typename Body>
Place face_in_front(const Body& body, const Vector3& p) {
  Place best;
  Scalar farthest = 0;
  for (std::int32_t face = 0; face < body.face_count(); ++face) {
    const Vector3 n = face_normal(body, face);
    const Scalar height = n.dot(p - body.vertex(body.corners(face)[0])) / n.norm();
    if (!(height > farthest)) continue;
    farthest = height;
    best = face_place(face);
  }
  return best;
}

// One walk. Every step except a jump brings the points strictly nearer, so no pair occurs twice.
template <typename BodyA, typename BodyB>
class FeatureWalk {
 public:
  FeatureWalk(const BodyA& a, const BodyB& b, Place place_a, Place place_b)
      : a_(a), b_(b), pair_(nearest_points(a, place_a, b, place_b)) {}

  // Returns false if it ended at the limit or inside a body.
  bool run(int limit) {
    while (steps_ < limit) {
      ++steps_;
      if (is_behind(a_, pair_.a, pair_.w) || is_behind(b_, pair_.b, -pair_.w)) {
        if (!jump()) return false;
      } else if (!step()) {
        return true;
      }
    }
    return false;
  }

  const FeaturePair& pair() const { return pair_; }
  int steps() const { return steps_; }

  // The direction that should prove the pair nearest: from the features themselves, which rounding
  // turns less than a short w.
  Vector3 proof_direction() const {
    const Vector3& w = pair_.w;
    if (pair_.a.kind == FeatureKind::Face) return facing(face_normal(a_, pair_.a.number));
    if (pair_.b.kind == FeatureKind::Face) return facing(face_normal(b_, pair_.b.number));
    const bool is_edge_a = pair_.a.kind == FeatureKind::Edge;
    const bool is_edge_b = pair_.b.kind == FeatureKind::Edge;
    if (!is_edge_a && !is_edge_b) return w;
    const Vector3 e = is_edge_a ? along_a() : along_b();
    if (is_edge_a && is_edge_b) {
      const Vector3 n = e.cross(along_b());
      if (n.dot(w) != 0) return facing(n);
    }
    return w - e * (e.dot(w) / e.squaredNorm());
  }

 private:
  Vector3 facing(const Vector3& n) const { return n.dot(pair_.w) < 0 ? Vector3(-n) : n; }
  Vector3 along_a() const { return EdgeLine<BodyA>(a_, pair_.a.number).along; }
  Vector3 along_b() const { return EdgeLine<BodyB>(b_, pair_.b.number).along; }

  static std::int32_t edge_number(const Place& place) {
    return place.kind == FeatureKind::Edge ? place.number : -1;
  }

  bool keep_if_nearer(const FeaturePair& next) {
    if (!(next.length_sq < pair_.length_sq)) return false;
    pair_ = next;
    return true;
  }

  bool step() {
    const Place next_a = steepest_neighbour(a_, pair_.a, pair_.w);
    if (next_a.number >= 0 &&
        keep_if_nearer(nearest_points(a_, next_a, b_, pair_.b, edge_number(pair_.a)))) {
      return true;
    }
    const Place next_b = steepest_neighbour(b_, pair_.b, -pair_.w);
    return next_b.number >= 0 &&
           keep_if_nearer(nearest_points(a_, pair_.a, b_, next_b, edge_number(pair_.b)));
  }

  // Moves away from behind a face. May lengthen w, so the number of jumps is limited.
  bool jump() {
    if (++jumps_ > kFeatureJumpLimit) return false;
    const bool is_of_a = is_behind(a_, pair_.a, pair_.w);
    const Place next =
        is_of_a ? face_in_front(a_, Vector3(pair_.p_a + pair_.w)) : face_in_front(b_, pair_.p_a);
    if (next.number < 0) return false;
    pair_ = is_of_a ? nearest_points(a_, next, b_, pair_.b) : nearest_points(a_, pair_.a, b_, next);
    return true;
  }

  const BodyA& a_;
  const BodyB& b_;
  FeaturePair pair_;
  int steps_ = 0;
  int jumps_ = 0;
};

}  // namespace dyop::paper_internal

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

namespace {

// One side of a face: its ends in increasing order, and where it was found.
struct Side {
  std::array<std::int32_t, 2> ends;
  std::int32_t face;
  std::size_t corner;
};

// The sides of faces with area; a segment, which is a triangle with a repeated vertex, has one
// side.
std::vector<Side> collect_sides(const ConvexHull& hull) {
  std::vector<Side> sides;
  const auto triangles = hull.core_surface()->triangles();
  for (std::size_t face = 0; face < triangles.size(); ++face) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t from = triangles[face][k];
      const std::int32_t to = triangles[face][(k + 1) % 3];
      if (from == to) continue;
      sides.push_back(
          {{std::min(from, to), std::max(from, to)}, static_cast<std::int32_t>(face), k});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) {
    return std::pair(x.ends, x.face) < std::pair(y.ends, y.face);
  });
  return sides;
}

}  // namespace

HullFeatures::HullFeatures(ConvexHull hull) : hull_(std::move(hull)) {
  DYOP_REQUIRE(hull_.rounding_radius() == 0, "HullFeatures: the hull must not be rounded");
  edges_of_face_.assign(hull_.core_surface()->triangles().size(), {-1, -1, -1});
  const bool has_faces = hull_.dimension() >= 2;
  for (const Side& side : collect_sides(hull_)) {
    const bool is_new = edges_.empty() || edges_.back().vertices != side.ends;
    if (is_new) edges_.push_back({side.ends, {-1, -1}});
    if (!has_faces) continue;
    edges_.back().faces[is_new ? 0 : 1] = side.face;
    edges_of_face_[static_cast<std::size_t>(side.face)][side.corner] =
        static_cast<std::int32_t>(edges_.size()) - 1;
  }
  first_edge_.assign(hull_.vertices().size() + 1, 0);
  for (const Edge& edge : edges_) {
    for (const std::int32_t v : edge.vertices) ++first_edge_[static_cast<std::size_t>(v) + 1];
  }
  for (std::size_t v = 1; v < first_edge_.size(); ++v) first_edge_[v] += first_edge_[v - 1];
  edges_of_vertices_.resize(2 * edges_.size());
  std::vector<std::int32_t> next(first_edge_.begin(), first_edge_.end() - 1);
  for (std::size_t k = 0; k < edges_.size(); ++k) {
    for (const std::int32_t v : edges_[k].vertices) {
      const std::int32_t at = next[static_cast<std::size_t>(v)]++;
      edges_of_vertices_[static_cast<std::size_t>(at)] = static_cast<std::int32_t>(k);
    }
  }
}

std::span<const std::int32_t> HullFeatures::edges_of_vertex(std::int32_t vertex) const {
  const auto v = static_cast<std::size_t>(vertex);
  const auto first = static_cast<std::size_t>(first_edge_[v]);
  const auto end = static_cast<std::size_t>(first_edge_[v + 1]);
  return std::span(edges_of_vertices_).subspan(first, end - first);
}

}  // namespace dyop

// The walk in the plane. Edge k of a polygon goes from vertex k to the next one.
namespace dyop {
namespace {

using namespace paper_internal;
using Place = LinCannyCache::Place;

std::size_t number_of(const Feature& feature) {
  return static_cast<std::size_t>(feature.vertices[0]);
}

template <typename Polygon>
std::size_t before(const Polygon& polygon, std::size_t k) {
  return (k == 0 ? polygon.size() : k) - 1;
}

template <typename PolygonA, typename PolygonB>
PlanarWitness vertex_witness(const PolygonA& a, std::size_t i, const PolygonB& b, std::size_t j) {
  const Vector2 w = b[j] - a[i];
  return {w, w, w.squaredNorm(), a[i], b[j], planar_vertex(i), planar_vertex(j), w, w};
}

// Edges that do not cross are nearest at an end of one. (For edges that cross nothing is proven.)
template <typename PolygonA, typename PolygonB>
PlanarWitness edge_witness(const PolygonA& a, std::size_t i, const PolygonB& b, std::size_t j) {
  PlanarWitness best = edge_vertex_witness(a, i, b, j);
  for (const PlanarWitness& other :
       {edge_vertex_witness(a, i, b, after(b, j)), swapped(edge_vertex_witness(b, j, a, i)),
        swapped(edge_vertex_witness(b, j, a, after(a, i)))}) {
    if (other.length_sq < best.length_sq) best = other;
  }
  return best;
}

template <typename PolygonA, typename PolygonB>
PlanarWitness nearest(const PolygonA& a, FeatureKind kind_a, std::size_t i, const PolygonB& b,
                      FeatureKind kind_b, std::size_t j) {
  const bool is_edge_a = kind_a == FeatureKind::Edge;
  const bool is_edge_b = kind_b == FeatureKind::Edge;
  if (is_edge_a && is_edge_b) return edge_witness(a, i, b, j);
  if (is_edge_a) return edge_vertex_witness(a, i, b, j);
  if (is_edge_b) return swapped(edge_vertex_witness(b, j, a, i));
  return vertex_witness(a, i, b, j);
}

// Sign of the enclosed area: 1 for counterclockwise, 0 for none.
template <typename Polygon>
Scalar sense_of(const Polygon& polygon) {
  Scalar area = 0;
  for (std::size_t k = 2; k < polygon.size(); ++k) {
    area += cross(polygon[k - 1] - polygon[0], polygon[k] - polygon[0]);
  }
  return static_cast<Scalar>((area > 0) - (area < 0));
}

template <typename PolygonA, typename PolygonB>
class PlanarWalk {
 public:
  PlanarWalk(const PolygonA& a, const PolygonB& b, const PlanarWitness& start)
      : a_(a), b_(b), sense_a_(sense_of(a)), sense_b_(sense_of(b)), pair_(start) {}

  void run(int limit) {
    while (steps_ < limit) {
      ++steps_;
      if (is_behind(a_, sense_a_, pair_.feature_a, pair_.w) ||
          is_behind(b_, sense_b_, pair_.feature_b, -pair_.w)) {
        if (!jump()) return;
      } else if (!step()) {
        return;
      }
    }
  }

  const PlanarWitness& pair() const { return pair_; }
  int steps() const { return steps_; }

 private:
  // The edge at the vertex along which a step along w goes the most; nothing for an edge.
  template <typename Polygon>
  static bool has_steeper_edge(const Polygon& polygon, const Feature& feature, const Vector2& w,
                               std::size_t& edge) {
    if (feature.kind != FeatureKind::Vertex) return false;
    const std::size_t k = number_of(feature);
    const Vector2 forth = polygon[after(polygon, k)] - polygon[k];
    const Vector2 back = polygon[before(polygon, k)] - polygon[k];
    const Scalar along_forth = std::max(forth.dot(w), Scalar{0});
    const Scalar along_back = std::max(back.dot(w), Scalar{0});
    const bool is_forth = along_forth * along_forth * back.squaredNorm() >
                          along_back * along_back * forth.squaredNorm();
    edge = is_forth ? k : before(polygon, k);
    return along_forth > 0 || along_back > 0;
  }

  template <typename Polygon>
  static Vector2 outward(const Polygon& polygon, Scalar sense, std::size_t edge) {
    return sense * rotated_clockwise(polygon[after(polygon, edge)] - polygon[edge]);
  }

  template <typename Polygon>
  static bool is_behind(const Polygon& polygon, Scalar sense, const Feature& feature,
                        const Vector2& w) {
    return feature.kind == FeatureKind::Edge &&
           outward(polygon, sense, number_of(feature)).dot(w) < 0;
  }

  // The edge that p is farthest in front of; false if p is behind all edges.
  template <typename Polygon>
  static bool has_edge_in_front(const Polygon& polygon, Scalar sense, const Vector2& p,
                                std::size_t& edge) {
    Scalar farthest = 0;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const Vector2 n = outward(polygon, sense, k);
      const Scalar height = n.dot(p - polygon[k]) / n.norm();
      if (!(height > farthest)) continue;
      farthest = height;
      edge = k;
    }
    return farthest > 0;
  }

  bool keep_if_nearer(const PlanarWitness& next) {
    if (!(next.length_sq < pair_.length_sq)) return false;
    pair_ = next;
    return true;
  }

  bool step() {
    std::size_t edge = 0;
    if (has_steeper_edge(a_, pair_.feature_a, pair_.w, edge) &&
        keep_if_nearer(nearest(a_, FeatureKind::Edge, edge, b_, pair_.feature_b.kind,
                               number_of(pair_.feature_b)))) {
      return true;
    }
    return has_steeper_edge(b_, pair_.feature_b, -pair_.w, edge) &&
           keep_if_nearer(nearest(a_, pair_.feature_a.kind, number_of(pair_.feature_a), b_,
                                  FeatureKind::Edge, edge));
  }

  // As in space: moves away from behind an edge, a limited number of times.
  bool jump() {
    if (++jumps_ > kFeatureJumpLimit) return false;
    std::size_t edge = 0;
    if (is_behind(a_, sense_a_, pair_.feature_a, pair_.w)) {
      if (!has_edge_in_front(a_, sense_a_, pair_.p_b, edge)) return false;
      pair_ = edge_vertex_witness(a_, edge, b_, number_of(pair_.feature_b));
    } else {
      if (!has_edge_in_front(b_, sense_b_, pair_.p_a, edge)) return false;
      pair_ = swapped(edge_vertex_witness(b_, edge, a_, number_of(pair_.feature_a)));
    }
    return true;
  }

  const PolygonA& a_;
  const PolygonB& b_;
  Scalar sense_a_;
  Scalar sense_b_;
  PlanarWitness pair_;
  int steps_ = 0;
  int jumps_ = 0;
};

template <typename Polygon>
Vector2 middle(const Polygon& polygon) {
  Vector2 sum = Vector2::Zero();
  for (std::size_t k = 0; k < polygon.size(); ++k) sum += polygon[k];
  return sum / static_cast<Scalar>(polygon.size());
}

template <typename Polygon>
std::size_t farthest_along(const Polygon& polygon, const Vector2& direction) {
  std::size_t best = 0;
  for (std::size_t k = 1; k < polygon.size(); ++k) {
    if (polygon[k].dot(direction) > polygon[best].dot(direction)) best = k;
  }
  return best;
}

template <typename Polygon>
bool has(const Polygon& polygon, const Place& place) {
  const bool is_feature = place.kind == FeatureKind::Vertex || place.kind == FeatureKind::Edge;
  return is_feature && place.number >= 0 && static_cast<std::size_t>(place.number) < polygon.size();
}

// From the last query, or from the vertices facing the other's middle.
template <typename PolygonA, typename PolygonB>
PlanarWitness start_of(const PolygonA& a, const PolygonB& b, const LinCannyCache* cache) {
  if (cache != nullptr && has(a, cache->a) && has(b, cache->b)) {
    return nearest(a, cache->a.kind, static_cast<std::size_t>(cache->a.number), b, cache->b.kind,
                   static_cast<std::size_t>(cache->b.number));
  }
  const Vector2 direction = middle(b) - middle(a);
  return vertex_witness(a, static_cast<std::size_t>(farthest_along(a, direction)), b,
                        static_cast<std::size_t>(farthest_along(b, -direction)));
}

template <typename PolygonA, typename PolygonB>
PlanarDistance walk_and_prove(const PolygonA& a, const PolygonB& b, int limit,
                              LinCannyCache* cache) {
  PlanarWalk<PolygonA, PolygonB> walk(a, b, start_of(a, b, cache));
  walk.run(limit);
  const PlanarWitness& pair = walk.pair();
  const Scalar size = planar_size(a, b);
  const PlanarDistance result = proven_distance(a, b, size, pair);
  const bool is_proven = is_certified(result, size);
  if (cache != nullptr) {
    *cache = {{pair.feature_a.kind, pair.feature_a.vertices[0]},
              {pair.feature_b.kind, pair.feature_b.vertices[0]},
              walk.steps(),
              is_proven};
  }
  return is_proven ? result : resolve_polygons(a, b);
}

}  // namespace

PlanarDistance lin_canny_distance(const PlanarTriangle& a, const PlanarTriangle& b,
                                  LinCannyCache* cache) {
  return walk_and_prove(a, b, kTriangleFeatureLimit, cache);
}

PlanarDistance lin_canny_distance(std::span<const Vector2> a, std::span<const Vector2> b,
                                  LinCannyCache* cache) {
  DYOP_REQUIRE(!a.empty() && !b.empty(), "a polygon needs a vertex; these have ", a.size(), " and ",
               b.size());
  constexpr std::size_t kMost = kLargestTriangleCount;
  DYOP_REQUIRE(a.size() + b.size() <= kMost / kFeatureLimit, "at most ", kMost / kFeatureLimit,
               " vertices, not ", a.size() + b.size());
  return walk_and_prove(a, b, kFeatureLimit * static_cast<int>(a.size() + b.size()), cache);
}

}  // namespace dyop
