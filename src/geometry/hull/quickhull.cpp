// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/hull/quickhull.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "exact/orientation.h"

namespace dyop::geometry_internal {
namespace {

// Scaled by a power of two to size one, with vanishing coordinates set to zero, as the exact
// predicates require.
std::vector<Vector3> scaled_for_predicates(std::span<const Vector3> points) {
  Scalar largest = 0;
  for (const Vector3& p : points) largest = std::max(largest, p.cwiseAbs().maxCoeff());
  int exponent = 0;
  std::frexp(largest, &exponent);
  std::vector<Vector3> scaled(points.begin(), points.end());
  for (Vector3& p : scaled) {
    for (Scalar& x : p) {
      x = std::ldexp(x, -exponent);
      if (std::abs(x) < kSmallestHullCoordinate) x = 0;
    }
  }
  return scaled;
}

struct Facet {
  TriangleIndices vertices{};               // counterclockwise seen from outside
  std::array<std::int32_t, 3> neighbors{};  // across the edge from vertex k to the next one
  std::vector<std::int32_t> outside;        // unused points strictly beyond this facet
  std::int32_t farthest = -1;               // of those
  Scalar farthest_height = 0;
  std::int32_t visit = -1;  // the last apex this facet was tested from
  bool is_visible = false;  // from that apex
};

// An edge between a visible facet and one that is not, in the direction of the visible one.
struct HorizonEdge {
  std::int32_t from, to;
  std::int32_t beyond;  // the facet that is not visible
};

// Quickhull in space [Barber1996]. A facet is visible from a point only if the point is strictly
// beyond its plane, decided exactly: so coplanar facets are all visible or none, the horizon is one
// simple cycle, and new facets are never degenerate. A point beyond a removed facet and outside the
// new hull is beyond a new facet, so only those need testing.
class Quickhull {
 public:
  Quickhull(std::span<const Vector3> points, const std::array<std::int32_t, 4>& simplex)
      : points_(points), facet_from_(points.size(), -1) {
    auto [a, b, c, d] = simplex;
    if (orientation(point(a), point(b), point(c), point(d)) > 0) std::swap(b, c);
    // d is now below a, b, c; each facet omits one corner.
    facets_.resize(4);
    facets_[0].vertices = {a, b, c};
    facets_[1].vertices = {b, a, d};
    facets_[2].vertices = {c, b, d};
    facets_[3].vertices = {a, c, d};
    facets_[0].neighbors = {1, 2, 3};
    facets_[1].neighbors = {0, 3, 2};
    facets_[2].neighbors = {0, 1, 3};
    facets_[3].neighbors = {0, 2, 1};
    const std::array<std::int32_t, 4> all{0, 1, 2, 3};
    for (std::int32_t k = 0; k < std::int32_t(points.size()); ++k) assign(k, all);
    pending_.assign(all.begin(), all.end());
  }

  std::vector<TriangleIndices> run() {
    // Each round with a point outside makes it a vertex and removes it from the lists for good.
    while (!pending_.empty()) {
      const std::int32_t facet = pending_.back();
      pending_.pop_back();
      if (!at(facet).outside.empty()) add_apex(facet);
    }
    std::vector<bool> is_free(facets_.size(), false);
    for (const std::int32_t facet : free_) is_free[std::size_t(facet)] = true;
    std::vector<TriangleIndices> triangles;
    for (std::size_t k = 0; k < facets_.size(); ++k) {
      if (!is_free[k]) triangles.push_back(facets_[k].vertices);
    }
    return triangles;
  }

 private:
  const Vector3& point(std::int32_t k) const { return points_[std::size_t(k)]; }
  Facet& at(std::int32_t k) { return facets_[std::size_t(k)]; }

  bool is_beyond(const Facet& facet, std::int32_t p) const {
    const auto [a, b, c] = facet.vertices;
    return orientation(point(a), point(b), point(c), point(p)) > 0;
  }

  // Puts a point on the list of the first of these facets that it is beyond; otherwise it is
  // inside.
  void assign(std::int32_t p, std::span<const std::int32_t> candidates) {
    for (const std::int32_t k : candidates) {
      Facet& facet = at(k);
      if (!is_beyond(facet, p)) continue;
      const auto [a, b, c] = facet.vertices;
      // Not exact: it only decides the order in which points are added.
      const Scalar height =
          (point(b) - point(a)).cross(point(c) - point(a)).dot(point(p) - point(a));
      if (facet.farthest < 0 || height > facet.farthest_height) {
        facet.farthest = p;
        facet.farthest_height = height;
      }
      facet.outside.push_back(p);
      return;
    }
  }

  void add_apex(std::int32_t start) {
    const std::int32_t apex = at(start).farthest;
    find_visible(start, apex);
    std::vector<std::int32_t> orphans;
    for (const std::int32_t k : visible_) {
      orphans.insert(orphans.end(), at(k).outside.begin(), at(k).outside.end());
      at(k).outside.clear();
      at(k).farthest = -1;
    }
    free_.insert(free_.end(), visible_.begin(), visible_.end());
    make_cone(apex);
    for (const std::int32_t p : orphans) {
      if (p != apex) assign(p, cone_);
    }
    for (const std::int32_t k : cone_) {
      if (!at(k).outside.empty()) pending_.push_back(k);
    }
  }

  // Fills visible_ and horizon_ by a search over neighbors; each facet is tested once.
  void find_visible(std::int32_t start, std::int32_t apex) {
    visible_.assign(1, start);
    horizon_.clear();
    at(start).visit = apex;
    at(start).is_visible = true;
    for (std::size_t next = 0; next < visible_.size(); ++next) {
      const std::int32_t current = visible_[next];
      for (std::size_t edge = 0; edge < 3; ++edge) {
        const std::int32_t across = at(current).neighbors[edge];
        Facet& neighbor = at(across);
        if (neighbor.visit != apex) {
          neighbor.visit = apex;
          neighbor.is_visible = is_beyond(neighbor, apex);
          if (neighbor.is_visible) visible_.push_back(across);
        }
        if (!neighbor.is_visible) {
          const TriangleIndices& v = at(current).vertices;
          horizon_.push_back({v[edge], v[(edge + 1) % 3], across});
        }
      }
    }
  }

  std::int32_t new_facet() {
    if (free_.empty()) {
      facets_.emplace_back();
      return std::int32_t(facets_.size() - 1);
    }
    const std::int32_t k = free_.back();
    free_.pop_back();
    return k;
  }

  // Fills cone_ with the facets from the horizon to the apex.
  void make_cone(std::int32_t apex) {
    cone_.clear();
    for (const HorizonEdge& edge : horizon_) {
      const std::int32_t k = new_facet();
      cone_.push_back(k);
      at(k).vertices = {edge.from, edge.to, apex};
      at(k).visit = -1;
      facet_from_[std::size_t(edge.from)] = k;
    }
    for (std::size_t n = 0; n < cone_.size(); ++n) {
      const HorizonEdge& edge = horizon_[n];
      const std::int32_t k = cone_[n];
      const std::int32_t next = facet_from_[std::size_t(edge.to)];
      at(k).neighbors[0] = edge.beyond;
      at(k).neighbors[1] = next;
      at(next).neighbors[2] = k;
      Facet& beyond = at(edge.beyond);
      for (std::size_t e = 0; e < 3; ++e) {
        if (beyond.vertices[e] == edge.to && beyond.vertices[(e + 1) % 3] == edge.from) {
          beyond.neighbors[e] = k;
        }
      }
    }
  }

  std::span<const Vector3> points_;
  std::vector<Facet> facets_;
  std::vector<std::int32_t> free_;
  std::vector<std::int32_t> pending_;
  std::vector<std::int32_t> visible_;
  std::vector<HorizonEdge> horizon_;
  std::vector<std::int32_t> cone_;
  std::vector<std::int32_t>
      facet_from_;  // by vertex: the new facet whose horizon edge starts there
};

// The point with the largest value of `measure`, or, where rounding makes none positive, any point
// for which `is_proper` holds exactly.
template <typename Measure, typename IsProper>
std::optional<std::int32_t> find_best(std::span<const Vector3> points, const Measure& measure,
                                      const IsProper& is_proper) {
  std::size_t best = 0;
  for (std::size_t k = 1; k < points.size(); ++k) {
    if (measure(points[k]) > measure(points[best])) best = k;
  }
  if (is_proper(points[best])) return std::int32_t(best);
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (is_proper(points[k])) return std::int32_t(k);
  }
  return std::nullopt;
}

// The first axis in which the line or plane of the points does not vanish; zero otherwise.
int axis_of_turn(const Vector3& a, const Vector3& b, const Vector3& c) {
  Vector3 normal = (b - a).cross(c - a).cwiseAbs();
  for (int trial = 0; trial < 3; ++trial) {
    int axis = 0;
    normal.maxCoeff(&axis);
    if (orientation_along(axis, a, b, c) != 0) return axis;
    normal[axis] = -1;
  }
  return -1;
}

// Hull of coplanar points: of their projection along an axis (monotone chain [Andrew1979]).
std::vector<TriangleIndices> hull_of_flat(std::span<const Vector3> points, int axis) {
  const int x = (axis + 1) % 3;
  const int y = (axis + 2) % 3;
  std::vector<std::int32_t> order(points.size());
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = std::int32_t(k);
  const auto point = [&](std::int32_t k) -> const Vector3& { return points[std::size_t(k)]; };
  std::sort(order.begin(), order.end(), [&](std::int32_t p, std::int32_t q) {
    return std::tuple(point(p)[x], point(p)[y], p) < std::tuple(point(q)[x], point(q)[y], q);
  });
  // Lower chain forwards, then upper chain backwards; both keep left turns only.
  std::vector<std::int32_t> polygon;
  for (int chain = 0; chain < 2; ++chain) {
    const std::size_t start = polygon.size();
    for (const std::int32_t k : order) {
      while (polygon.size() >= start + 2 &&
             orientation_along(axis, point(polygon[polygon.size() - 2]), point(polygon.back()),
                               point(k)) <= 0) {
        polygon.pop_back();
      }
      polygon.push_back(k);
    }
    // The last point starts the other chain.
    polygon.pop_back();
    std::reverse(order.begin(), order.end());
  }
  std::vector<TriangleIndices> fan;
  for (std::size_t k = 1; k + 1 < polygon.size(); ++k) {
    fan.push_back({polygon[0], polygon[k], polygon[k + 1]});
  }
  return fan;
}

// The two ends of collinear points.
TriangleIndices hull_of_segment(std::span<const Vector3> points, const Vector3& direction) {
  int axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  const auto [low, high] =
      std::minmax_element(points.begin(), points.end(),
                          [&](const Vector3& p, const Vector3& q) { return p[axis] < q[axis]; });
  const auto a = std::int32_t(low - points.begin());
  const auto b = std::int32_t(high - points.begin());
  return {a, b, b};
}

}  // namespace

HullSurface quickhull(std::span<const Vector3> input) {
  const std::vector<Vector3> points = scaled_for_predicates(input);
  const auto found = [&](const std::optional<std::int32_t>& k) -> const Vector3& {
    return points[std::size_t(*k)];
  };
  const Vector3& a = points.front();
  const auto b = find_best(
      points, [&](const Vector3& p) { return (p - a).squaredNorm(); },
      [&](const Vector3& p) { return p != a; });
  if (!b) return {0, {{0, 0, 0}}};
  const Vector3 ab = found(b) - a;
  const auto c = find_best(
      points, [&](const Vector3& p) { return ab.cross(p - a).squaredNorm(); },
      [&](const Vector3& p) { return axis_of_turn(a, found(b), p) >= 0; });
  if (!c) return {1, {hull_of_segment(points, ab)}};
  const Vector3 normal = ab.cross(found(c) - a);
  const auto d = find_best(
      points, [&](const Vector3& p) { return std::abs(normal.dot(p - a)); },
      [&](const Vector3& p) { return orientation(a, found(b), found(c), p) != 0; });
  if (!d) return {2, hull_of_flat(points, axis_of_turn(a, found(b), found(c)))};
  return {3, Quickhull(points, {0, *b, *c, *d}).run()};
}

}  // namespace dyop::geometry_internal
