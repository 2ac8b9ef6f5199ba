// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/paper/distance_algorithm.h"

#include <ccd/ccd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "core/tolerance.h"
#include "distance/gjk/triangle_core.h"
#include "dyop/core/error.h"
#include "dyop/distance/gjk.h"
#include "dyop/distance/triangle_distance.h"
#include "dyop/paper/lin_canny.h"
#include "dyop/paper/planar_distance.h"
#include "dyop/paper/published_dyop.h"

namespace dyop {

std::optional<DistanceBounds> DistanceAlgorithm::distance(const ConvexHull&, const ConvexHull&,
                                                          const RigidPose&) const {
  return std::nullopt;
}

namespace {

class CertifiedDyop final : public DistanceAlgorithm {
 public:
  using DistanceAlgorithm::distance;
  std::string_view name() const override { return "certified DyOP"; }
  bool is_certified() const override { return true; }
  DistanceBounds distance(const PlanarTriangle& a, const PlanarTriangle& b) const override {
    const PlanarDistance d = planar_triangle_distance(a, b);
    return {d.lower, d.upper};
  }
  DistanceBounds distance(const Triangle& a, const Triangle& b) const override {
    const TriangleDistance d = triangle_distance(a, b);
    return {d.lower, d.upper};
  }
};

class PublishedDyopAlgorithm final : public DistanceAlgorithm {
 public:
  using DistanceAlgorithm::distance;
  std::string_view name() const override { return "published DyOP"; }
  bool is_certified() const override { return false; }
  DistanceBounds distance(const PlanarTriangle& a, const PlanarTriangle& b) const override {
    return {0, published_dyop(a, b).distance};
  }
  DistanceBounds distance(const Triangle& a, const Triangle& b) const override {
    return {0, published_dyop(a, b).distance};
  }
};

class TextbookGjk final : public DistanceAlgorithm {
 public:
  using DistanceAlgorithm::distance;
  std::string_view name() const override { return "GJK"; }
  bool is_certified() const override { return false; }
  DistanceBounds distance(const PlanarTriangle& a, const PlanarTriangle& b) const override {
    return {0, textbook_gjk(a, b).distance};
  }
  DistanceBounds distance(const Triangle& a, const Triangle& b) const override {
    return {0, textbook_gjk(a, b).distance};
  }
};

class LinCanny final : public DistanceAlgorithm {
 public:
  std::string_view name() const override { return "Lin-Canny"; }
  bool is_certified() const override { return true; }
  DistanceBounds distance(const PlanarTriangle& a, const PlanarTriangle& b) const override {
    const PlanarDistance d = lin_canny_distance(a, b);
    return {d.lower, d.upper};
  }
  DistanceBounds distance(const Triangle& a, const Triangle& b) const override {
    const TriangleDistance d = lin_canny_distance(a, b);
    return {d.lower, d.upper};
  }
  std::optional<DistanceBounds> distance(const ConvexHull& a, const ConvexHull& b,
                                         const RigidPose& X_AB) const override {
    const GjkResult d = lin_canny_distance(HullFeatures(a), HullFeatures(b), X_AB);
    return DistanceBounds{d.lower, d.upper};
  }
};

class LibccdGjk final : public DistanceAlgorithm {
 public:
  using DistanceAlgorithm::distance;
  std::string_view name() const override { return "libccd GJK"; }
  bool is_certified() const override { return false; }
  DistanceBounds distance(const PlanarTriangle& a, const PlanarTriangle& b) const override {
    return {0, libccd_distance(a, b)};
  }
  DistanceBounds distance(const Triangle& a, const Triangle& b) const override {
    return {0, libccd_distance(a, b)};
  }
};

class CertifiedGjk final : public DistanceAlgorithm {
 public:
  std::string_view name() const override { return "certified GJK"; }
  bool is_certified() const override { return true; }
  DistanceBounds distance(const PlanarTriangle& a, const PlanarTriangle& b) const override {
    return distance(in_space(a), in_space(b));
  }
  DistanceBounds distance(const Triangle& a, const Triangle& b) const override {
    const GjkResult d = gjk_distance(distance_internal::TriangleCore(a),
                                     distance_internal::TriangleCore(b), RigidPose());
    return {d.lower, d.upper};
  }
  std::optional<DistanceBounds> distance(const ConvexHull& a, const ConvexHull& b,
                                         const RigidPose& X_AB) const override {
    const GjkResult d = gjk_distance(a, b, X_AB);
    return DistanceBounds{d.lower, d.upper};
  }

 private:
  static Triangle in_space(const PlanarTriangle& t) {
    return {Vector3(t[0].x(), t[0].y(), 0), Vector3(t[1].x(), t[1].y(), 0),
            Vector3(t[2].x(), t[2].y(), 0)};
  }
};

}  // namespace

std::span<const DistanceAlgorithm* const> distance_algorithms() {
  static const CertifiedDyop certified_dyop;
  static const PublishedDyopAlgorithm published_dyop_algorithm;
  static const TextbookGjk gjk;
  static const LinCanny lin_canny;
  static const LibccdGjk libccd;
  static const CertifiedGjk certified_gjk;
  // To add an algorithm: its name goes here.
  static constexpr std::array<const DistanceAlgorithm*, 6> kAll{
      &certified_dyop, &published_dyop_algorithm, &gjk, &lin_canny, &libccd, &certified_gjk};
  return kAll;
}

const DistanceAlgorithm& distance_algorithm(std::string_view name) {
  std::string names;
  for (const DistanceAlgorithm* algorithm : distance_algorithms()) {
    if (algorithm->name() == name) return *algorithm;
    names += (names.empty() ? "" : ", ") + std::string(algorithm->name());
  }
  throw InvalidArgument("no distance algorithm named '" + std::string(name) +
                        "'; the names are: " + names);
}

namespace {

static_assert(sizeof(ccd_real_t) == sizeof(Scalar), "libccd must be built with double precision");

using CcdTriangle = std::array<ccd_vec3_t, 3>;

void support_of_triangle(const void* triangle, const ccd_vec3_t* direction, ccd_vec3_t* point) {
  const auto& vertices = *static_cast<const CcdTriangle*>(triangle);
  const ccd_vec3_t* best = &vertices[0];
  for (const ccd_vec3_t& vertex : vertices) {
    if (ccdVec3Dot(&vertex, direction) > ccdVec3Dot(best, direction)) best = &vertex;
  }
  *point = *best;
}

// Up to four points of the Minkowski difference A - B, whose nearest point libccd finds.
class CcdSimplex {
 public:
  bool contains(const ccd_vec3_t& point) const {
    return std::any_of(points_.begin(), points_.begin() + count_,
                       [&](const ccd_vec3_t& p) { return ccdVec3Eq(&p, &point) != 0; });
  }

  void add(const ccd_vec3_t& point) { points_[static_cast<std::size_t>(count_++)] = point; }

  // Squared distance of the origin to the nearest point. Of four points, keeps the triangle that
  // has it; a tetrahedron around the origin has no such triangle at distance zero, so the loop ends
  // for lack of progress.
  Scalar reduce(ccd_vec3_t* nearest) {
    const auto& p = points_;
    switch (count_) {
      case 1:
        *nearest = p[0];
        return ccdVec3Len2(&p[0]);
      case 2:
        return ccdVec3PointSegmentDist2(ccd_vec3_origin, &p[0], &p[1], nearest);
      case 3:
        return ccdVec3PointTriDist2(ccd_vec3_origin, &p[0], &p[1], &p[2], nearest);
      default:
        return keep_nearest_triangle(nearest);
    }
  }

  // Whether the four points enclose the origin, which is then on the inner side of every face.
  bool holds_origin(const ccd_vec3_t& added) const {
    if (count_ < 3) return false;
    const std::array<ccd_vec3_t, 4> p{points_[0], points_[1], points_[2], added};
    constexpr int kFaces[4][4] = {{0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}};
    for (const auto& face : kFaces) {
      const auto& corner = p[static_cast<std::size_t>(face[0])];
      ccd_vec3_t u, v, n, inner;
      ccdVec3Sub2(&u, &p[static_cast<std::size_t>(face[1])], &corner);
      ccdVec3Sub2(&v, &p[static_cast<std::size_t>(face[2])], &corner);
      ccdVec3Sub2(&inner, &p[static_cast<std::size_t>(face[3])], &corner);
      ccdVec3Cross(&n, &u, &v);
      if (!(-ccdVec3Dot(&n, &corner) * ccdVec3Dot(&n, &inner) > 0)) return false;
    }
    return true;
  }

 private:
  Scalar keep_nearest_triangle(ccd_vec3_t* nearest) {
    constexpr int kFaces[4][3] = {{0, 1, 3}, {1, 2, 3}, {2, 0, 3}, {0, 1, 2}};
    const std::array<ccd_vec3_t, 4> p = points_;
    Scalar best = kInfinity;
    for (const auto& [i, j, k] : kFaces) {
      const std::array<ccd_vec3_t, 3> face{p[static_cast<std::size_t>(i)],
                                           p[static_cast<std::size_t>(j)],
                                           p[static_cast<std::size_t>(k)]};
      ccd_vec3_t point;
      const Scalar squared =
          ccdVec3PointTriDist2(ccd_vec3_origin, &face[0], &face[1], &face[2], &point);
      if (!(squared < best)) continue;
      best = squared;
      *nearest = point;
      std::copy(face.begin(), face.end(), points_.begin());
    }
    count_ = 3;
    return best;
  }

  std::array<ccd_vec3_t, 4> points_;
  int count_ = 0;
};

Scalar run_loop(const CcdTriangle& a, const CcdTriangle& b) {
  ccd_t ccd;
  CCD_INIT(&ccd);
  ccd.support1 = support_of_triangle;
  ccd.support2 = support_of_triangle;
  CcdSimplex simplex;
  ccd_vec3_t nearest;
  ccdVec3Sub2(&nearest, &a[0], &b[0]);
  simplex.add(nearest);
  Scalar distance_sq = ccdVec3Len2(&nearest);
  for (int k = 0; k < kTextbookGjkLimit && distance_sq > 0; ++k) {
    ccd_vec3_t backwards = nearest;
    ccdVec3Scale(&backwards, -1);
    ccd_vec3_t on_a, on_b, added;
    ccd.support1(&a, &backwards, &on_a);
    ccd.support2(&b, &nearest, &on_b);
    ccdVec3Sub2(&added, &on_a, &on_b);
    const Scalar reach = ccdVec3Dot(&nearest, &added);  // positive only if they are apart
    const bool has_converged = distance_sq - reach <= kTextbookGjkConvergence * distance_sq;
    if (has_converged || simplex.contains(added)) break;
    if (!(reach > 0) && simplex.holds_origin(added)) return 0;
    simplex.add(added);
    const Scalar nearer_sq = simplex.reduce(&nearest);
    if (!(nearer_sq < distance_sq)) break;
    distance_sq = nearer_sq;
  }
  return std::sqrt(distance_sq);
}

// libccd's tolerances are absolute and meant for coordinates of about one.
template <typename AnyTriangle>
Scalar scaled_distance(const AnyTriangle& a, const AnyTriangle& b) {
  const auto origin = a[0];
  Scalar size = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    size = std::max(
        {size, (a[k] - origin).cwiseAbs().maxCoeff(), (b[k] - origin).cwiseAbs().maxCoeff()});
  }
  if (!(size > 0)) return 0;
  const Scalar inverse = 1 / size;
  CcdTriangle ccd_a{};
  CcdTriangle ccd_b{};
  for (std::size_t k = 0; k < 3; ++k) {
    for (Eigen::Index axis = 0; axis < origin.size(); ++axis) {
      ccd_a[k].v[axis] = (a[k][axis] - origin[axis]) * inverse;
      ccd_b[k].v[axis] = (b[k][axis] - origin[axis]) * inverse;
    }
  }
  return size * run_loop(ccd_a, ccd_b);
}

}  // namespace

Scalar libccd_distance(const Triangle& a, const Triangle& b) {
  return scaled_distance(a, b);
}

Scalar libccd_distance(const PlanarTriangle& a, const PlanarTriangle& b) {
  return scaled_distance(a, b);
}

// The origin against the Minkowski difference B - A: v is its nearest point so far.
namespace {

template <int dimension>
using GjkPoint = typename GjkEstimate<dimension>::Point;

template <int dimension>
using GjkTriangle = std::array<GjkPoint<dimension>, 3>;

// Number of the vertex farthest along the direction, found without a branch.
template <int dimension>
int support(const GjkTriangle<dimension>& triangle, const GjkPoint<dimension>& direction) {
  const Scalar h0 = triangle[0].dot(direction);
  const Scalar h1 = triangle[1].dot(direction);
  const Scalar h2 = triangle[2].dot(direction);
  const Scalar highest = h1 > h0 ? h1 : h0;
  const int of_two = static_cast<int>(h1 > h0);
  return h2 > highest ? 2 : of_two;
}

// A point of the difference and the vertices it comes from.
template <int dimension>
struct GjkVertex {
  GjkPoint<dimension> w;
  int a = 0;
  int b = 0;
};

template <int dimension>
struct GjkSimplex {
  std::array<GjkVertex<dimension>, 4> vertices;
  std::array<Scalar, 4> weights{1, 0, 0, 0};
  int count = 0;

  const GjkPoint<dimension>& w(int k) const { return vertices[static_cast<std::size_t>(k)].w; }

  bool contains(int a, int b) const {
    for (int k = 0; k < count; ++k) {
      const auto& vertex = vertices[static_cast<std::size_t>(k)];
      if (vertex.a == a && vertex.b == b) return true;
    }
    return false;
  }

  GjkPoint<dimension> nearest() const {
    GjkPoint<dimension> v = GjkPoint<dimension>::Zero();
    for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
      v += weights[k] * vertices[k].w;
    }
    return v;
  }

  GjkSimplex with(std::initializer_list<std::pair<int, Scalar>> kept) const {
    GjkSimplex result;
    for (const auto& [k, weight] : kept) {
      const auto at = static_cast<std::size_t>(result.count++);
      result.vertices[at] = vertices[static_cast<std::size_t>(k)];
      result.weights[at] = weight;
    }
    return result;
  }
};

// The part of the segment i, j that contains its point nearest to the origin.
template <int dimension>
GjkSimplex<dimension> nearest_on_segment(const GjkSimplex<dimension>& s, int i, int j) {
  const GjkPoint<dimension> edge = s.w(j) - s.w(i);
  const Scalar along = -edge.dot(s.w(i));
  const Scalar length_sq = edge.squaredNorm();
  if (!(along > 0)) return s.with({{i, 1}});
  if (along >= length_sq) return s.with({{j, 1}});
  const Scalar t = along / length_sq;
  return s.with({{i, 1 - t}, {j, t}});
}

// [Ericson2005] 5.1.5: the regions of a triangle's vertices, edges and face, by six scalar
// products; first those at k, the newest vertex.
template <int dimension>
GjkSimplex<dimension> nearest_on_triangle(const GjkSimplex<dimension>& s, int i, int j, int k) {
  const GjkPoint<dimension> ki = s.w(i) - s.w(k);
  const GjkPoint<dimension> kj = s.w(j) - s.w(k);
  const Scalar d1 = -ki.dot(s.w(k));
  const Scalar d2 = -kj.dot(s.w(k));
  if (d1 <= 0 && d2 <= 0) return s.with({{k, 1}});
  const Scalar d3 = -ki.dot(s.w(i));
  const Scalar d4 = -kj.dot(s.w(i));
  if (d3 >= 0 && d4 <= d3) return s.with({{i, 1}});
  const Scalar of_j = d1 * d4 - d3 * d2;
  if (of_j <= 0 && d1 >= 0 && d3 <= 0) return nearest_on_segment(s, k, i);
  const Scalar d5 = -ki.dot(s.w(j));
  const Scalar d6 = -kj.dot(s.w(j));
  if (d6 >= 0 && d5 <= d6) return s.with({{j, 1}});
  const Scalar of_i = d5 * d2 - d1 * d6;
  if (of_i <= 0 && d2 >= 0 && d6 <= 0) return nearest_on_segment(s, k, j);
  const Scalar of_k = d3 * d6 - d5 * d4;
  const Scalar sum = of_i + of_j + of_k;
  if (of_k <= 0 || !(sum > 0)) return nearest_on_segment(s, i, j);
  return s.with({{i, of_i / sum}, {j, of_j / sum}, {k, of_k / sum}});
}

// The faces at vertex 3, the newest: the opposite one cannot be nearer than before. All four
// vertices if the origin is on the inner side of each face; if the triangles are known to be apart
// that is rounding, and the nearest face is taken.
GjkSimplex<3> nearest_on_tetrahedron(const GjkSimplex<3>& s, bool is_apart) {
  constexpr int kFaces[3][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}};
  GjkSimplex<3> best = s;
  best.weights = {0.25, 0.25, 0.25, 0.25};
  Scalar best_sq = kInfinity;
  const auto test_faces = [&](bool tests_inner) {
    for (const auto& [i, j, opposite] : kFaces) {
      const Vector3 n = (s.w(i) - s.w(3)).cross(s.w(j) - s.w(3));
      const bool is_inner = n.dot(s.w(opposite) - s.w(3)) * -n.dot(s.w(3)) > 0;
      if (is_inner && !tests_inner) continue;
      const GjkSimplex<3> part = nearest_on_triangle(s, i, j, 3);
      const Scalar squared = part.nearest().squaredNorm();
      if (!(squared < best_sq)) continue;
      best = part;
      best_sq = squared;
    }
  };
  test_faces(false);
  if (best.count == 4 && is_apart) test_faces(true);
  return best;
}

template <int dimension>
GjkSimplex<dimension> nearest_part(const GjkSimplex<dimension>& s, [[maybe_unused]] bool is_apart) {
  switch (s.count) {
    case 1:
      return s.with({{0, 1}});
    case 2:
      return nearest_on_segment(s, 1, 0);
    case 3:
      return nearest_on_triangle(s, 0, 1, 2);
    default:
      if constexpr (dimension == 3) return nearest_on_tetrahedron(s, is_apart);
      return s;
  }
}

template <int dimension>
GjkEstimate<dimension> run_gjk(const GjkTriangle<dimension>& a, const GjkTriangle<dimension>& b) {
  using Point = GjkPoint<dimension>;
  const auto vertex_of = [&](int i, int j) {
    return GjkVertex<dimension>{b[static_cast<std::size_t>(j)] - a[static_cast<std::size_t>(i)], i,
                                j};
  };
  GjkSimplex<dimension> simplex;
  simplex.vertices[0] = vertex_of(0, 0);
  simplex.count = 1;
  Point v = simplex.w(0);
  Scalar norm_sq = v.squaredNorm();
  GjkEstimate<dimension> result;
  while (result.iterations < kTextbookGjkLimit && norm_sq > 0) {
    ++result.iterations;
    const int i = support<dimension>(a, v);
    const int j = support<dimension>(b, -v);
    const GjkVertex<dimension> added = vertex_of(i, j);
    const Scalar reach = v.dot(added.w);  // positive only if they are apart
    if (norm_sq - reach <= kTextbookGjkConvergence * norm_sq) break;
    if (simplex.contains(i, j)) break;
    GjkSimplex<dimension> next = simplex;
    next.vertices[static_cast<std::size_t>(next.count++)] = added;
    next = nearest_part(next, reach > 0);
    if (next.count == dimension + 1) {
      simplex = next;
      result.is_overlapping = true;
      break;
    }
    const Point nearer = next.nearest();
    const Scalar nearer_sq = nearer.squaredNorm();
    if (!(nearer_sq < norm_sq)) break;  // rounding: no progress
    simplex = next;
    v = nearer;
    norm_sq = nearer_sq;
  }
  result.is_overlapping = result.is_overlapping || norm_sq == 0;
  result.distance = result.is_overlapping ? 0 : std::sqrt(norm_sq);
  for (std::size_t k = 0; k < static_cast<std::size_t>(simplex.count); ++k) {
    const auto& vertex = simplex.vertices[k];
    result.p_a += simplex.weights[k] * a[static_cast<std::size_t>(vertex.a)];
    result.p_b += simplex.weights[k] * b[static_cast<std::size_t>(vertex.b)];
  }
  return result;
}

}  // namespace

GjkEstimate<2> textbook_gjk(const PlanarTriangle& a, const PlanarTriangle& b) {
  return run_gjk<2>(a, b);
}

GjkEstimate<3> textbook_gjk(const Triangle& a, const Triangle& b) {
  return run_gjk<3>(a, b);
}

}  // namespace dyop
