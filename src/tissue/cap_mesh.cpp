// SPDX-License-Identifier: BSD-3-Clause
#include "tissue/cap_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

namespace dyop::tissue_internal {
namespace {

using Eigen::Vector2d;
using Ring = std::vector<std::int32_t>;

// Relative to the square of the coordinates.
constexpr Scalar kAreaNoise = 1e-14;       // literal: some roundings of twice a triangle's area
constexpr Scalar kAreaError = 1e-9;        // literal: far above the sum of all triangles' roundings
constexpr std::size_t kMostInside = 4000;  // points: the time grows with their square
constexpr std::size_t kMostOverlapping = 1000;  // points: the time grows with their cube
constexpr Scalar kShort = 1e-6;                 // of a chord's squared length, against area
constexpr Scalar kFlat = 1e-3;     // what a flat triangle costs, which shares its chord with others
constexpr Scalar kFromLoop = 0.5;  // spacings between an added point and the loops

Scalar cross(const Vector2d& a, const Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

// Twice the area of the triangle, positive if it turns left.
Scalar turn(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return cross(b - a, c - a);
}

Scalar distance_to_segment(const Vector2d& p, const Vector2d& a, const Vector2d& b) {
  const Vector2d way = b - a;
  const Scalar length_sq = way.squaredNorm();
  const Scalar t = length_sq > 0 ? std::clamp((p - a).dot(way) / length_sq, 0.0, 1.0) : 0;
  return (p - a - t * way).norm();
}

// Loops made one: every hole is joined to the ring around it by a pair of edges, there and back.
class Bridges {
 public:
  Bridges(const PlaneRegion& region, Scalar noise) : region_(region), noise_(noise) {
    for (const Ring& loop : region.loops) {
      (area(loop) > 0 ? rings_ : holes_).push_back(loop);
    }
    std::sort(holes_.begin(), holes_.end(),
              [&](const Ring& a, const Ring& b) { return rightmost(a) > rightmost(b); });
  }

  // Nothing if a hole lies in no ring.
  std::optional<std::vector<Ring>> join() {
    std::vector<Ring> turned_over;
    for (std::size_t k = 0; k < holes_.size(); ++k) {
      Ring* around = ring_around(holes_[k]);
      if (around != nullptr && join(k, *around)) continue;
      if (!region_.is_crumpled) return std::nullopt;
      if (around == nullptr) turned_over.push_back(holes_[k]);
    }
    rings_.insert(rings_.end(), turned_over.begin(), turned_over.end());
    return rings_;
  }

  Scalar area() const {
    Scalar sum = 0;
    for (const Ring& loop : region_.loops) sum += area(loop);
    return sum;
  }

 private:
  const Vector2d& at(std::int32_t point) const { return region_.points[std::size_t(point)]; }

  Scalar area(const Ring& ring) const {
    Scalar twice = 0;
    const Vector2d& base = at(ring[0]);
    for (std::size_t k = 1; k + 1 < ring.size(); ++k) {
      twice += turn(base, at(ring[k]), at(ring[k + 1]));
    }
    return twice / 2;
  }

  Scalar rightmost(const Ring& ring) const {
    Scalar x = -kInfinity;
    for (const std::int32_t point : ring) x = std::max(x, at(point).x());
    return x;
  }

  bool contains(const Ring& ring, const Vector2d& p) const {
    bool is_inside = false;
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const Vector2d& a = at(ring[k]);
      const Vector2d& b = at(ring[(k + 1) % ring.size()]);
      if ((a.y() > p.y()) == (b.y() > p.y())) continue;
      is_inside ^= (turn(a, b, p) > 0) == (b.y() > a.y());
    }
    return is_inside;
  }

  // The smallest one.
  Ring* ring_around(const Ring& hole) {
    Ring* smallest = nullptr;
    for (Ring& ring : rings_) {
      if (!contains(ring, at(hole[0]))) continue;
      if (smallest == nullptr || area(ring) < area(*smallest)) smallest = &ring;
    }
    return smallest;
  }

  bool crosses(const Ring& ring, std::int32_t from, std::int32_t to) const {
    const Vector2d &a = at(from), &b = at(to);
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const std::int32_t u = ring[k], v = ring[(k + 1) % ring.size()];
      const bool has_end = u == from || u == to || v == from || v == to;
      if (has_end) continue;
      const Scalar of_u = turn(a, b, at(u)), of_v = turn(a, b, at(v));
      const Scalar of_a = turn(at(u), at(v), a), of_b = turn(at(u), at(v), b);
      const bool is_apart = (of_u > noise_ && of_v > noise_) || (of_u < -noise_ && of_v < -noise_);
      const bool is_beside = (of_a > noise_ && of_b > noise_) || (of_a < -noise_ && of_b < -noise_);
      if (!is_apart && !is_beside) return true;
    }
    return false;
  }

  bool is_free(std::int32_t from, std::int32_t to, const Ring& ring, std::size_t hole) const {
    if (crosses(ring, from, to)) return false;
    return std::none_of(holes_.begin() + std::ptrdiff_t(hole), holes_.end(),
                        [&](const Ring& other) { return crosses(other, from, to); });
  }

  // From the hole's rightmost point to the nearest one of the ring that it sees; where it sees none
  // and the region is crumpled, to the nearest one.
  bool join(std::size_t hole, Ring& ring) {
    Ring inner = holes_[hole];
    std::rotate(inner.begin(),
                std::max_element(inner.begin(), inner.end(),
                                 [&](auto a, auto b) { return at(a).x() < at(b).x(); }),
                inner.end());
    std::vector<std::pair<Scalar, std::size_t>> places;
    for (std::size_t k = 0; k < ring.size(); ++k) {
      places.emplace_back((at(ring[k]) - at(inner[0])).squaredNorm(), k);
    }
    std::sort(places.begin(), places.end());
    auto best = std::find_if(places.begin(), places.end(), [&](const auto& place) {
      return is_free(inner[0], ring[place.second], ring, hole);
    });
    if (best == places.end() && region_.is_crumpled) best = places.begin();
    if (best == places.end()) return false;
    inner.push_back(inner[0]);
    inner.push_back(ring[best->second]);
    ring.insert(ring.begin() + std::ptrdiff_t(best->second) + 1, inner.begin(), inner.end());
    return true;
  }

  const PlaneRegion& region_;
  Scalar noise_;
  std::vector<Ring> rings_, holes_;
};

// Cuts ears off a ring until nothing is left.
class Ears {
 public:
  Ears(const std::vector<Vector2d>& points, Ring ring, Scalar noise)
      : points_(points), ring_(std::move(ring)), noise_(noise) {}

  bool cut(std::vector<TriangleIndices>& triangles) {
    std::size_t start = 0;
    while (ring_.size() > 3) {
      const std::optional<std::size_t> ear = find(start);
      if (!ear) return false;
      triangles.push_back(corners(*ear));
      ring_.erase(ring_.begin() + std::ptrdiff_t(*ear));
      start = *ear;  // so that not all ears share a point
    }
    triangles.push_back({ring_[0], ring_[1], ring_[2]});
    return turn_of(triangles.back()) >= -noise_;
  }

 private:
  const Vector2d& at(std::int32_t point) const { return points_[std::size_t(point)]; }
  Scalar turn_of(const TriangleIndices& t) const { return turn(at(t[0]), at(t[1]), at(t[2])); }

  TriangleIndices corners(std::size_t k) const {
    const std::size_t size = ring_.size();
    return {ring_[(k + size - 1) % size], ring_[k], ring_[(k + 1) % size]};
  }

  // Otherwise a flat one.
  std::optional<std::size_t> find(std::size_t start) const {
    std::optional<std::size_t> flat;
    for (std::size_t i = 0; i < ring_.size(); ++i) {
      const std::size_t k = (start + i) % ring_.size();
      const TriangleIndices ear = corners(k);
      const Scalar area = turn_of(ear);
      if (area > noise_ && is_empty(ear)) return k;
      if (!flat && std::abs(area) <= noise_) flat = k;
    }
    return flat;
  }

  bool is_empty(const TriangleIndices& ear) const {
    return std::none_of(ring_.begin(), ring_.end(), [&](std::int32_t point) {
      if (point == ear[0] || point == ear[1] || point == ear[2]) return false;
      for (std::size_t k = 0; k < 3; ++k) {
        if (turn(at(ear[k]), at(ear[(k + 1) % 3]), at(point)) < -noise_) return false;
      }
      return true;
    });
  }

  const std::vector<Vector2d>& points_;
  Ring ring_;
  Scalar noise_;
};

// Triangulates a ring that crosses itself, where what it bounds lies over itself: by dynamic
// programming [Klincsek1980] so that what turns right has the least area, and chords are short. Only
// where no disk can be laid over itself with this outline does anything turn right.
class Overlap {
 public:
  Overlap(const std::vector<Vector2d>& points, const Ring& ring, Scalar noise)
      : points_(points), ring_(ring), noise_(noise), flat_(kFlat / kAreaNoise * noise) {}

  bool cut(std::vector<TriangleIndices>& triangles) {
    const std::size_t size = ring_.size();
    if (size > kMostOverlapping) return false;
    chords_.resize(size * size);
    for (std::size_t length = 2; length < size; ++length) {
      for (std::size_t i = 0; i + length < size; ++i) find(i, i + length);
    }
    std::vector<std::array<std::size_t, 2>> rest{{0, size - 1}};
    while (!rest.empty()) {
      const auto [i, j] = rest.back();
      rest.pop_back();
      if (j == i + 1) continue;
      const std::size_t k = chord(i, j).middle;
      triangles.push_back({ring_[i], ring_[k], ring_[j]});
      rest.push_back({i, k});
      rest.push_back({k, j});
    }
    return true;
  }

 private:
  // From point i of the ring to point j: the best triangle at it, and the cost of what lies between.
  struct Chord {
    Scalar cost = 0;
    std::size_t middle = 0;
  };

  Chord& chord(std::size_t i, std::size_t j) { return chords_[i * ring_.size() + j]; }
  const Vector2d& at(std::size_t k) const { return points_[std::size_t(ring_[k])]; }

  void find(std::size_t i, std::size_t j) {
    Chord best{kInfinity, i + 1};
    for (std::size_t k = i + 1; k < j; ++k) {
      const Scalar left = turn(at(i), at(k), at(j));
      const Scalar cost = chord(i, k).cost + chord(k, j).cost + std::max(0.0, -left) +
                          (std::abs(left) <= noise_ ? flat_ : 0);
      if (cost < best.cost) best = {cost, k};
    }
    best.cost += kShort * (at(j) - at(i)).squaredNorm();
    chord(i, j) = best;
  }

  const std::vector<Vector2d>& points_;
  const Ring& ring_;
  Scalar noise_, flat_;
  std::vector<Chord> chords_;
};

// Triangles that know their neighbours, each under its three directed edges.
class Flips {
 public:
  Flips(std::vector<Vector2d>& points, std::vector<TriangleIndices> triangles, Scalar noise)
      : points_(points), triangles_(std::move(triangles)), noise_(noise) {
    for (std::size_t t = 0; t < triangles_.size(); ++t) enter(std::int32_t(t));
  }

  bool is_manifold() const { return owner_.size() == 3 * triangles_.size(); }
  const std::vector<TriangleIndices>& triangles() const { return triangles_; }

  void improve() {
    std::vector<Edge> edges;
    for (const TriangleIndices& t : triangles_) {
      for (std::size_t k = 0; k < 3; ++k) edges.push_back({t[k], t[(k + 1) % 3]});
    }
    improve(std::move(edges));
  }

  void insert(const Vector2d& p) {
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      const TriangleIndices old = triangles_[t];
      if (!is_inside(old, p)) continue;
      const auto point = std::int32_t(points_.size());
      points_.push_back(p);
      triangles_[t] = {old[0], old[1], point};
      triangles_.push_back({old[1], old[2], point});
      triangles_.push_back({old[2], old[0], point});
      enter(std::int32_t(t));
      enter(std::int32_t(triangles_.size()) - 2);
      enter(std::int32_t(triangles_.size()) - 1);
      improve({{old[0], old[1]}, {old[1], old[2]}, {old[2], old[0]}});
      return;
    }
  }

 private:
  using Edge = std::array<std::int32_t, 2>;

  static std::uint64_t key(std::int32_t a, std::int32_t b) {
    return (std::uint64_t(std::uint32_t(a)) << 32) | std::uint32_t(b);
  }
  const Vector2d& at(std::int32_t point) const { return points_[std::size_t(point)]; }

  void enter(std::int32_t t) {
    const TriangleIndices& corners = triangles_[std::size_t(t)];
    for (std::size_t k = 0; k < 3; ++k) owner_[key(corners[k], corners[(k + 1) % 3])] = t;
  }

  bool is_inside(const TriangleIndices& t, const Vector2d& p) const {
    return turn(at(t[0]), at(t[1]), p) > noise_ && turn(at(t[1]), at(t[2]), p) > noise_ &&
           turn(at(t[2]), at(t[0]), p) > noise_;
  }

  static std::int32_t opposite(const TriangleIndices& t, std::int32_t a, std::int32_t b) {
    for (const std::int32_t corner : t) {
      if (corner != a && corner != b) return corner;
    }
    return t[0];
  }

  // Whether d lies inside the circle through a, b, c.
  bool is_in_circle(std::int32_t a, std::int32_t b, std::int32_t c, std::int32_t d) const {
    const Vector2d u = at(a) - at(d), v = at(b) - at(d), w = at(c) - at(d);
    const Scalar uu = u.squaredNorm(), vv = v.squaredNorm(), ww = w.squaredNorm();
    const Scalar inside = uu * cross(v, w) - vv * cross(u, w) + ww * cross(u, v);
    const Scalar size = uu + vv + ww;
    return inside > kAreaError * size * size;
  }

  // Each flip lowers the triangulation in a finite order, but for rounding.
  void improve(std::vector<Edge> edges) {
    std::size_t flips = 0;
    const std::size_t most = 100 + triangles_.size() * triangles_.size();
    while (!edges.empty() && flips < most) {
      const auto [a, b] = edges.back();
      edges.pop_back();
      const auto here = owner_.find(key(a, b)), there = owner_.find(key(b, a));
      if (here == owner_.end() || there == owner_.end()) continue;
      const std::int32_t t = here->second, s = there->second;
      const std::int32_t c = opposite(triangles_[std::size_t(t)], a, b);
      const std::int32_t d = opposite(triangles_[std::size_t(s)], a, b);
      if (!is_in_circle(a, b, c, d)) continue;
      const bool is_convex =
          turn(at(c), at(a), at(d)) > noise_ && turn(at(d), at(b), at(c)) > noise_;
      if (!is_convex || owner_.contains(key(c, d)) || owner_.contains(key(d, c))) continue;
      owner_.erase(here);
      owner_.erase(key(b, a));
      triangles_[std::size_t(t)] = {c, a, d};
      triangles_[std::size_t(s)] = {d, b, c};
      enter(t);
      enter(s);
      ++flips;
      for (const Edge& edge : {Edge{c, a}, Edge{a, d}, Edge{d, b}, Edge{b, c}}) {
        edges.push_back(edge);
      }
    }
  }

  std::vector<Vector2d>& points_;
  std::vector<TriangleIndices> triangles_;
  std::unordered_map<std::uint64_t, std::int32_t> owner_;
  Scalar noise_;
};

Eigen::AlignedBox2d box_of(const std::vector<Vector2d>& points) {
  Eigen::AlignedBox2d box;
  for (const Vector2d& p : points) box.extend(p);
  return box;
}

bool is_far_from_loops(const PlaneRegion& region, const Vector2d& p, Scalar distance) {
  for (const Ring& loop : region.loops) {
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const Vector2d& a = region.points[std::size_t(loop[k])];
      const Vector2d& b = region.points[std::size_t(loop[(k + 1) % loop.size()])];
      if (distance_to_segment(p, a, b) < distance) return false;
    }
  }
  return true;
}

// Rows of points, every other one moved by half a spacing.
std::vector<Vector2d> points_inside(const PlaneRegion& region, Scalar spacing) {
  const Eigen::AlignedBox2d box = box_of(region.points);
  spacing = std::max(spacing, std::sqrt(box.volume() / Scalar(kMostInside)));
  std::vector<Vector2d> inside;
  const auto rows = int(box.sizes().y() / spacing), columns = int(box.sizes().x() / spacing);
  for (int row = 1; row <= rows; ++row) {
    for (int column = 1; column <= columns; ++column) {
      const Vector2d steps(column - 0.5 * (row % 2), row);
      const Vector2d p = box.min() + spacing * steps;
      if (is_far_from_loops(region, p, kFromLoop * spacing)) inside.push_back(p);
    }
  }
  return inside;
}

}  // namespace

std::optional<std::vector<TriangleIndices>> triangulate(PlaneRegion& region, Scalar spacing) {
  const Scalar size = box_of(region.points).sizes().maxCoeff();
  const Scalar noise = kAreaNoise * size * size;
  Bridges bridges(region, noise);
  const std::optional<std::vector<Ring>> rings = bridges.join();
  if (!rings) return std::nullopt;
  std::vector<TriangleIndices> triangles;
  for (const Ring& ring : *rings) {
    const std::size_t before = triangles.size();
    if (Ears(region.points, ring, noise).cut(triangles)) continue;
    triangles.resize(before);
    if (!Overlap(region.points, ring, noise).cut(triangles)) return std::nullopt;
  }
  Scalar area = 0;
  for (const TriangleIndices& t : triangles) {
    area += turn(region.points[std::size_t(t[0])], region.points[std::size_t(t[1])],
                 region.points[std::size_t(t[2])]) /
            2;
  }
  if (!(std::abs(area - bridges.area()) <= kAreaError * size * size)) return std::nullopt;
  const std::vector<Vector2d> inside =
      spacing > 0 ? points_inside(region, spacing) : std::vector<Vector2d>{};
  Flips flips(region.points, std::move(triangles), noise);
  if (!flips.is_manifold()) return std::nullopt;
  flips.improve();
  for (const Vector2d& p : inside) flips.insert(p);
  return flips.triangles();
}

}  // namespace dyop::tissue_internal
