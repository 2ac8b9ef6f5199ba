// SPDX-License-Identifier: BSD-3-Clause
#include "check/direction.h"

#include <array>
#include <optional>

namespace dyop_check {
namespace {

struct Candidate {
  Vec point;
  bool is_inside = true;
};

Candidate nearest_on_edge(const Vec& a, const Vec& b) {
  const Vec e = b - a;
  const double k = dot(e, e) > 0 ? -dot(a, e) / dot(e, e) : -1;
  return {a + k * e, k >= 0 && k <= 1};
}

Candidate nearest_on_face(const Vec& a, const Vec& b, const Vec& c) {
  const Vec e = b - a;
  const Vec f = c - a;
  const Vec n = cross(e, f);
  const double area = dot(n, n);
  if (!(area > 0)) return {a, false};
  const double v = dot(cross(f, a), n) / area;
  const double w = dot(cross(a, e), n) / area;
  return {a + v * e + w * f, v >= 0 && w >= 0 && v + w <= 1};
}

// Up to four points of the set of differences of two convex sets.
struct Simplex {
  std::array<Vec, 4> points;
  std::size_t count = 0;

  // The point of the hull that is nearest to the origin; keeps the points that span it. False if
  // none was found, or the origin may be inside.
  bool reduce(Vec& nearest);
  // If four points hold the origin, so that the sets have a point in common: the combination of them
  // that should be the origin, as near as rounding lets it come.
  std::optional<Vec> origin() const;
};

std::optional<Vec> Simplex::origin() const {
  constexpr double kNear = 1e-9;  // literal: relative; flat ones may seem to hold anything
  if (count < 4) return std::nullopt;
  const auto& [a, b, c, d] = points;
  const double abc = dot(cross(a, b), c);
  const double acd = dot(cross(a, c), d);
  const double adb = dot(cross(a, d), b);
  const double bdc = dot(cross(b, d), c);
  const bool is_inside =
      (abc > 0 && acd > 0 && adb > 0 && bdc > 0) || (abc < 0 && acd < 0 && adb < 0 && bdc < 0);
  const double sum = abc + acd + adb + bdc;
  if (!is_inside || !std::isfinite(sum)) return std::nullopt;
  const Vec p = (1 / sum) * (bdc * a + acd * b + adb * c + abc * d);
  if (!(norm(p) <= kNear * (norm(a) + norm(b) + norm(c) + norm(d)))) return std::nullopt;
  return p;
}

// Tries all subsets of up to three points: the best in which the weights are >= 0.
bool Simplex::reduce(Vec& nearest) {
  double best = -1;
  std::array<std::size_t, 3> kept{};
  std::size_t kept_count = 0;
  const auto offer = [&](const Candidate& candidate, std::initializer_list<std::size_t> subset) {
    const double squared = dot(candidate.point, candidate.point);
    if (!candidate.is_inside || (best >= 0 && squared >= best)) return;
    best = squared;
    nearest = candidate.point;
    kept_count = 0;
    for (const std::size_t k : subset) kept[kept_count++] = k;
  };
  for (std::size_t i = 0; i < count; ++i) {
    offer({points[i]}, {i});
    for (std::size_t j = i + 1; j < count; ++j) {
      offer(nearest_on_edge(points[i], points[j]), {i, j});
      for (std::size_t k = j + 1; k < count; ++k)
        offer(nearest_on_face(points[i], points[j], points[k]), {i, j, k});
    }
  }
  std::array<Vec, 4> spanning;
  for (std::size_t k = 0; k < kept_count; ++k) spanning[k] = points[kept[k]];
  points = spanning;
  count = kept_count;
  return best >= 0 && count < 4;
}

// The point of a node that is farthest along d.
Vec support_point(const PosedNode& at, const Vec& d) {
  const Node& node = *at.node;
  const Vec in = transposed(at.X->R, d);
  if (node.is_leaf()) {
    const double radius = at.body->pieces[std::size_t(node.piece)].radius;
    return *at.X * (at.body->core_support(node, in, at.part) +
                    (radius / std::max(norm(in), std::numeric_limits<double>::min())) * in);
  }
  const auto [center, half] = at.body->box(node, at.part);
  return *at.X * (center + Vec{std::copysign(half.x, in.x), std::copysign(half.y, in.y),
                               std::copysign(half.z, in.z)});
}

Nearest gjk(const PosedNode& a, const PosedNode& b, const Vec& guess) {
  constexpr int kMostIterations = 60;
  constexpr double kClose = 1e-13;  // literal: relative, of the squared distance
  const auto difference = [&](const Vec& d) {
    return support_point(b, d) - support_point(a, -1.0 * d);
  };
  Vec v = difference(-1.0 * guess);
  Simplex simplex;
  simplex.points[simplex.count++] = v;
  for (int k = 0; k < kMostIterations; ++k) {
    const double squared = dot(v, v);
    if (!(squared > 0)) return {v, 0, true};
    const Vec w = difference(-1.0 * v);
    if (squared - dot(v, w) <= kClose * squared) break;
    simplex.points[simplex.count++] = w;
    if (const auto origin = simplex.origin()) return {v, norm(*origin), true};
    Vec next;
    if (!simplex.reduce(next) || !(dot(next, next) < squared)) break;
    v = next;
  }
  return {v, norm(v)};
}

}  // namespace

Nearest nearest_direction(const PosedNode& a, const PosedNode& b, const Vec& guess) {
  // Of a half-space and a convex piece the gap along the normal is their distance.
  const auto along = [&](const Vec& n) {
    const double height = gap(a, b, n);
    return Nearest{n, std::max(0.0, height), !(height > 0)};
  };
  if (const Piece* plane = a.body->half_space()) return along(a.X->R * plane->normal);
  if (const Piece* plane = b.body->half_space()) return along(-1.0 * (b.X->R * plane->normal));
  return gjk(a, b, guess);
}

}  // namespace dyop_check
