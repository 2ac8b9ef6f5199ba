// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include "core/tolerance.h"
#include "dyop/paper/lin_canny.h"

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
