// SPDX-License-Identifier: BSD-3-Clause
#include "check/direction.h"

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

}  // namespace

bool Simplex::holds_origin() const {
  if (count < 4) return false;
  const auto& [a, b, c, d] = points;
  const double abc = dot(cross(a, b), c);
  const double acd = dot(cross(a, c), d);
  const double adb = dot(cross(a, d), b);
  const double bdc = dot(cross(b, d), c);
  return (abc > 0 && acd > 0 && adb > 0 && bdc > 0) || (abc < 0 && acd < 0 && adb < 0 && bdc < 0);
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

}  // namespace dyop_check
