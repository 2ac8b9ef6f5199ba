// SPDX-License-Identifier: BSD-3-Clause
#include "tissue/kerf_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "dyop/geometry/triangle_mesh.h"
#include "tissue/cap_mesh.h"

namespace dyop::tissue_internal {
namespace {

// Relative to the largest coordinate: what is nearer to a plane lies in it, and how much larger the
// kerf is made then, each time.
constexpr Scalar kInPlane = 1e-11;  // literal: some 1e5 roundings
constexpr Scalar kGrowth = 1e-9;    // literal: far above that, far below what a blade can do
constexpr int kMostGrowths = 20;
constexpr int kMostCrossings = 3;  // tries with a wall that does not close; a growth may help
constexpr std::size_t kMostPieces = 1000;  // of a kerf's edge
constexpr Scalar kPerSpacing = 0.005;      // of a stretch's length, against cubes that it misses

// Planes are numbered 2 axis + (1 for the upper one).
constexpr int kPlanes = 6;
constexpr int axis_of(int plane) {
  return plane / 2;
}
constexpr Scalar sign_of(int plane) {
  return plane % 2 == 1 ? 1 : -1;
}

std::uint64_t key(std::int32_t a, std::int32_t b) {
  if (a > b) std::swap(a, b);
  return (std::uint64_t(std::uint32_t(a)) << 32) | std::uint32_t(b);
}

// A piece of a triangle. planes[k] is that of the edge from corner k to the next; -1: none.
struct Piece {
  std::vector<std::int32_t> corners;
  std::vector<int> planes;
  std::int32_t triangle = 0;

  std::size_t next(std::size_t k) const { return (k + 1) % corners.size(); }
  void add(std::int32_t corner, int plane) {
    corners.push_back(corner);
    planes.push_back(plane);
  }
};

// Points in the kerf's frame, and where they come from.
struct Points {
  std::vector<Vector3> p_K;
  std::vector<unsigned> planes;  // a bit for each one that the point lies in by construction
  std::vector<std::int32_t> parts, sources;

  const Vector3& operator[](std::int32_t point) const { return p_K[std::size_t(point)]; }
  bool is_in(std::int32_t point, int plane) const {
    return (planes[std::size_t(point)] >> plane & 1U) != 0;
  }
  std::int32_t add(const Vector3& p, unsigned of_planes, std::int32_t part, std::int32_t source) {
    p_K.push_back(p);
    planes.push_back(of_planes);
    parts.push_back(part);
    sources.push_back(source);
    return std::int32_t(p_K.size()) - 1;
  }
};

using Extents = std::array<Scalar, kPlanes>;

// Divides triangles into what the box contains and pieces outside.
class Divider {
 public:
  Divider(Points& points, const Extents& extents, Scalar noise)
      : points_(points), extents_(extents), noise_(noise) {}

  // Something lies in a plane to rounding.
  bool is_degenerate() const { return is_degenerate_; }
  const std::vector<Piece>& kept() const { return kept_; }
  const std::vector<Piece>& gone() const { return gone_; }

  void divide(Piece piece) {
    for (int plane = 0; plane < kPlanes; ++plane) {
      if (is_beyond_one(piece)) {
        kept_.push_back(std::move(piece));
        return;
      }
      split(piece, plane);
    }
    gone_.push_back(std::move(piece));
  }

  // The corners of a piece with all points that its neighbours have on its edges.
  std::vector<std::int32_t> outline(const Piece& piece) const {
    std::vector<std::int32_t> all;
    for (std::size_t k = 0; k < piece.corners.size(); ++k) {
      all.push_back(piece.corners[k]);
      add_between(piece.corners[k], piece.corners[piece.next(k)], all);
    }
    return all;
  }

 private:
  Scalar height(std::int32_t point, int plane) const {
    return sign_of(plane) * points_[point][axis_of(plane)] - extents_[std::size_t(plane)];
  }

  bool is_beyond_one(const Piece& piece) const {
    for (int plane = 0; plane < kPlanes; ++plane) {
      const auto is_beyond = [&](std::int32_t point) {
        return !points_.is_in(point, plane) && height(point, plane) > noise_;
      };
      if (std::all_of(piece.corners.begin(), piece.corners.end(), is_beyond)) return true;
    }
    return false;
  }

  // Keeps what is beyond the plane; the rest remains.
  void split(Piece& piece, int plane) {
    std::vector<bool> is_beyond;
    for (const std::int32_t point : piece.corners) {
      const Scalar h = height(point, plane);
      is_degenerate_ |= std::abs(h) <= noise_;
      is_beyond.push_back(h > 0);
    }
    const auto count = std::count(is_beyond.begin(), is_beyond.end(), true);
    if (count == 0) return;
    Piece inside{{}, {}, piece.triangle}, outside = inside;
    for (std::size_t k = 0; k < piece.corners.size(); ++k) {
      const std::size_t next = piece.next(k);
      const std::int32_t from = piece.corners[k];
      Piece& own = is_beyond[k] ? outside : inside;
      own.add(from, piece.planes[k]);
      if (is_beyond[k] == is_beyond[next]) continue;
      const std::int32_t point = crossing(from, piece.corners[next], plane, piece.triangle);
      Piece& other = is_beyond[k] ? inside : outside;
      own.add(point, plane);
      other.add(point, piece.planes[k]);
    }
    kept_.push_back(std::move(outside));
    piece = std::move(inside);
  }

  // Of an edge and a plane: the same point for both of the edge's sides.
  std::int32_t crossing(std::int32_t a, std::int32_t b, int plane, std::int32_t triangle) {
    if (a > b) std::swap(a, b);
    const auto [found, is_new] = split_.try_emplace(key(a, b), 0);
    if (!is_new) return found->second;
    const Vector3 from = points_[a], to = points_[b];
    const Scalar of_a = height(a, plane), of_b = height(b, plane);
    Vector3 p = from + of_a / (of_a - of_b) * (to - from);
    const unsigned common = points_.planes[std::size_t(a)] & points_.planes[std::size_t(b)];
    for (int k = 0; k < kPlanes; ++k) {
      const bool is_in = k == plane || (common >> k & 1U) != 0;
      if (is_in) p[axis_of(k)] = sign_of(k) * extents_[std::size_t(k)];
    }
    const std::int32_t part = points_.parts[std::size_t(a)];
    found->second = points_.add(p, common | 1U << plane, part, triangle);
    return found->second;
  }

  void add_between(std::int32_t a, std::int32_t b, std::vector<std::int32_t>& all) const {
    const auto found = split_.find(key(a, b));
    if (found == split_.end()) return;
    add_between(a, found->second, all);
    all.push_back(found->second);
    add_between(found->second, b, all);
  }

  Points& points_;
  const Extents& extents_;
  Scalar noise_;
  bool is_degenerate_ = false;
  std::vector<Piece> kept_, gone_;
  std::unordered_map<std::uint64_t, std::int32_t> split_;
};

// An end of a stretch of a kerf's edge inside the body.
struct RimEnd {
  std::int32_t point = 0;
  bool is_end = false;  // the body ends there
  std::optional<Host> host;
};

// Pairs stretches' starts with their ends where the body lies over itself.
class RimPairs {
 public:
  RimPairs(const Points& points, const RigidPose& X_WK, const BodySheets& sheets, Scalar spacing)
      : points_(points), X_WK_(X_WK), sheets_(sheets), spacing_(spacing) {}

  // In place: an end to each start, so that one comes to it when going from the start, or back. The
  // nearest one of several.
  void sort(int axis, const std::vector<RimEnd>& starts, std::vector<RimEnd>& ends) const {
    struct Way {
      Scalar miss;
      std::size_t start, end;
    };
    std::vector<Way> ways;
    for (std::size_t i = 0; i < starts.size(); ++i) {
      for (std::size_t k = 0; k < ends.size(); ++k) {
        const Scalar length = points_[ends[k].point][axis] - points_[starts[i].point][axis];
        const Scalar cost = length < 0 ? kInfinity : miss(starts[i], ends[k]);
        ways.push_back({cost + kPerSpacing * length / spacing_, i, k});
      }
    }
    std::stable_sort(ways.begin(), ways.end(),
                     [](const Way& a, const Way& b) { return a.miss < b.miss; });
    std::vector<std::optional<RimEnd>> end_of(starts.size());
    std::vector<bool> is_taken(ends.size());
    for (const Way& way : ways) {
      if (end_of[way.start] || is_taken[way.end]) continue;
      end_of[way.start] = ends[way.end];
      is_taken[way.end] = true;
    }
    for (std::size_t i = 0; i < starts.size(); ++i) ends[i] = *end_of[i];
  }

 private:
  Scalar miss(const RimEnd& start, const RimEnd& end) const {
    if (!start.host || !end.host) return kInfinity;
    const Vector3 a_W = X_WK_ * points_[start.point], b_W = X_WK_ * points_[end.point];
    return std::min(sheets_.miss(*start.host, a_W, *end.host, b_W),
                    sheets_.miss(*end.host, b_W, *start.host, a_W));
  }

  const Points& points_;
  const RigidPose& X_WK_;
  const BodySheets& sheets_;
  const Scalar spacing_;
};

// The six walls of a kerf inside one part of the body.
class Caps {
 public:
  Caps(Points& points, const Extents& extents, std::int32_t part, Scalar spacing,
       const RigidPose& X_WK, const BodySheets* sheets)
      : points_(points),
        extents_(extents),
        part_(part),
        spacing_(spacing),
        X_WK_(X_WK),
        sheets_(sheets) {}

  // The walls' edges on the surface, and where the surface crosses edges of the kerf.
  void add(const Piece& gone) {
    for (std::size_t k = 0; k < gone.corners.size(); ++k) {
      const std::size_t next = gone.next(k);
      const int in = gone.planes[k], out = gone.planes[next];
      if (in >= 0) lead(in, gone.corners[k], gone.corners[next]);
      if (in >= 0 && out >= 0 && in != out) add_crossing(in, out, gone.corners[next]);
    }
  }

  // @param covers How often this part of the body covers a corner of the kerf; asked if the
  // crossings do not tell.
  // @return False if a wall cannot be closed.
  template <typename Covers>
  bool close(const Covers& covers, std::vector<TriangleIndices>& triangles) {
    if (!find_corners(covers)) return false;
    for (Edge& edge : edges_) add_rim(edge);
    if (!is_clear_) return false;
    for (int plane = 0; plane < kPlanes; ++plane) {
      if (!add_wall(plane, triangles)) return false;
    }
    return true;
  }

 private:
  // Along an axis, between the planes first and second of the two other ones.
  struct Edge {
    int axis = 0, first = 0, second = 0;
    std::array<std::size_t, 2> corners{};                  // lower and upper
    std::vector<std::pair<std::int32_t, bool>> crossings;  // and whether the body ends there
  };
  using Next = std::map<std::int32_t, std::int32_t>;

  static std::array<Edge, 12> all_edges() {
    std::array<Edge, 12> edges;
    std::size_t number = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      for (int k = 0; k < 4; ++k) {
        const std::size_t low = std::size_t(k % 2) << u | std::size_t(k / 2) << v;
        edges[number++] = {
            axis, 2 * u + k % 2, 2 * v + k / 2, {low, low | std::size_t{1} << axis}, {}};
      }
    }
    return edges;
  }

  void lead(int plane, std::int32_t from, std::int32_t to) {
    is_clear_ &= next_[std::size_t(plane)].emplace(from, to).second;
  }

  // The triangle's outline turns from one plane into the other, which tells its normal's sign.
  void add_crossing(int in, int out, std::int32_t point) {
    for (Edge& edge : edges_) {
      const bool is_forward = in == edge.first && out == edge.second;
      const bool is_backward = in == edge.second && out == edge.first;
      if (!is_forward && !is_backward) continue;
      const bool is_alike = sign_of(in) == sign_of(out);
      edge.crossings.emplace_back(point, is_forward == is_alike);
    }
  }

  // From the first one along the edges. Where parts of the body that were pressed together overlap,
  // they cover a place more than once.
  template <typename Covers>
  bool find_corners(const Covers& covers) {
    for (Edge& edge : edges_) {
      std::sort(edge.crossings.begin(), edge.crossings.end(), [&](const auto& a, const auto& b) {
        return points_[a.first][edge.axis] < points_[b.first][edge.axis];
      });
    }
    covered_[0] = 0;
    if (!spread_corners()) return false;
    const auto [least, most] = range_of_covers();
    const int first = most == least + 1 ? -least : covers(corner(0));
    for (std::optional<int>& times : covered_) *times += first;
    return least + first >= 0;
  }

  // Three edges are the longest way.
  bool spread_corners() {
    for (int pass = 0; pass < 3; ++pass) {
      for (const Edge& edge : edges_) {
        int change = 0;
        for (const auto& [point, is_end] : edge.crossings) change += is_end ? -1 : 1;
        std::optional<int>&lower = covered_[edge.corners[0]], &upper = covered_[edge.corners[1]];
        if (!lower && upper) lower = *upper - change;
        if (!upper && lower) upper = *lower + change;
        if (lower && *upper != *lower + change) return false;
      }
    }
    return true;
  }

  // The least and the largest number of times that a place on an edge is covered.
  std::pair<int, int> range_of_covers() const {
    std::pair<int, int> range{*covered_[0], *covered_[0]};
    for (const Edge& edge : edges_) {
      int times = *covered_[edge.corners[0]];
      range = {std::min(range.first, times), std::max(range.second, times)};
      for (const auto& [point, is_end] : edge.crossings) {
        times += is_end ? -1 : 1;
        range = {std::min(range.first, times), std::max(range.second, times)};
      }
    }
    return range;
  }

  Vector3 corner(std::size_t number) const {
    Vector3 p;
    for (int axis = 0; axis < 3; ++axis) {
      const int plane = 2 * axis + int(number >> axis & 1);
      p[axis] = sign_of(plane) * extents_[std::size_t(plane)];
    }
    return p;
  }

  // One for each time that the corner is covered: the three edges share them.
  const std::vector<RimEnd>& corner_points(std::size_t number) {
    std::vector<RimEnd>& points = corner_points_[number];
    const auto times = std::size_t(std::max(0, *covered_[number]));
    if (points.size() == times) return points;
    unsigned planes = 0;
    for (int axis = 0; axis < 3; ++axis) planes |= 1U << (2 * axis + int(number >> axis & 1));
    std::vector<Host> hosts;
    if (sheets_ != nullptr && times > 1) hosts = sheets_->inside(part_, X_WK_ * corner(number));
    for (std::size_t k = 0; k < times; ++k) {
      points.push_back({points_.add(corner(number), planes, part_, -1), false, {}});
      if (k < hosts.size()) points.back().host = hosts[k];
    }
    return points;
  }

  // The parts of an edge inside the body bound both of its walls, in opposite directions.
  void add_rim(Edge& edge) {
    std::vector<RimEnd> ends = corner_points(edge.corners[0]);
    for (const auto& [point, is_end] : edge.crossings) ends.push_back({point, is_end, {}});
    for (RimEnd end : corner_points(edge.corners[1])) {
      end.is_end = true;
      ends.push_back(end);
    }
    // From one place outside the body to the next.
    std::size_t first = 0;
    int times = 0;
    for (std::size_t k = 0; k < ends.size(); ++k) {
      times += ends[k].is_end ? -1 : 1;
      if (times > 0) continue;
      add_stretches(edge, std::span(ends).subspan(first, k + 1 - first));
      first = k + 1;
    }
  }

  void add_stretches(const Edge& edge, std::span<const RimEnd> all) {
    std::vector<RimEnd> starts, ends;
    for (const RimEnd& one : all) (one.is_end ? ends : starts).push_back(one);
    if (starts.size() != ends.size()) return;  // the surface will not be closed
    if (starts.size() > 1 && sheets_ != nullptr) {
      for (RimEnd& start : starts) find_host(start);
      for (RimEnd& end : ends) find_host(end);
      RimPairs(points_, X_WK_, *sheets_, spacing_).sort(edge.axis, starts, ends);
    }
    for (std::size_t k = 0; k < starts.size(); ++k) {
      add_stretch(edge, starts[k].point, ends[k].point);
    }
  }

  void find_host(RimEnd& end) const {
    const std::int32_t source = points_.sources[std::size_t(end.point)];
    if (source >= 0) end.host = sheets_->on_surface(source, X_WK_ * points_[end.point]);
    if (source >= 0 || end.host) return;
    const std::vector<Host> hosts = sheets_->inside(part_, X_WK_ * points_[end.point]);
    if (!hosts.empty()) end.host = hosts[0];
  }

  void add_stretch(const Edge& edge, std::int32_t from, std::int32_t to) {
    const bool is_alike = sign_of(edge.first) == sign_of(edge.second);
    const std::vector<std::int32_t> points =
        divided(from, to, 1U << edge.first | 1U << edge.second);
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
      lead(is_alike ? edge.second : edge.first, points[i], points[i + 1]);
      lead(is_alike ? edge.first : edge.second, points[i + 1], points[i]);
    }
  }

  std::vector<std::int32_t> divided(std::int32_t from, std::int32_t to, unsigned planes) {
    const Vector3 a = points_[from], b = points_[to];
    const Scalar wanted = std::ceil((b - a).norm() / spacing_);
    const auto pieces = std::size_t(std::clamp(wanted, Scalar{1}, Scalar(kMostPieces)));
    std::vector<std::int32_t> points{from};
    for (std::size_t k = 1; k < pieces; ++k) {
      points.push_back(points_.add(a + Scalar(k) / Scalar(pieces) * (b - a), planes, part_, -1));
    }
    points.push_back(to);
    return points;
  }

  // Nothing if the chains do not close.
  std::optional<std::vector<std::vector<std::int32_t>>> loops_of(int plane) {
    Next rest = next_[std::size_t(plane)];
    std::vector<std::vector<std::int32_t>> loops;
    while (!rest.empty()) {
      std::vector<std::int32_t>& loop = loops.emplace_back();
      const std::int32_t start = rest.begin()->first;
      for (std::int32_t point = start; loop.empty() || point != start;) {
        const auto found = rest.find(point);
        if (found == rest.end()) return std::nullopt;
        loop.push_back(point);
        point = found->second;
        rest.erase(found);
      }
      if (loop.size() < 3) return std::nullopt;
    }
    return loops;
  }

  // Seen from inside the kerf, where the body's outside is.
  bool add_wall(int plane, std::vector<TriangleIndices>& triangles) {
    auto loops = loops_of(plane);
    if (!loops) return false;
    if (loops->empty()) return true;
    int u = (axis_of(plane) + 1) % 3, v = (axis_of(plane) + 2) % 3;
    if (sign_of(plane) > 0) std::swap(u, v);
    PlaneRegion region;
    region.is_crumpled = sheets_ != nullptr;
    std::vector<std::int32_t> points;
    for (std::vector<std::int32_t>& loop : *loops) {
      for (std::int32_t& point : loop) {
        region.points.emplace_back(points_[point][u], points_[point][v]);
        points.push_back(std::exchange(point, std::int32_t(points.size())));
      }
    }
    region.loops = std::move(*loops);
    const auto wall = triangulate(region, spacing_);
    if (!wall) return false;
    for (std::size_t k = points.size(); k < region.points.size(); ++k) {
      Vector3 p;
      p[axis_of(plane)] = sign_of(plane) * extents_[std::size_t(plane)];
      p[u] = region.points[k].x();
      p[v] = region.points[k].y();
      points.push_back(points_.add(p, 1U << plane, part_, -1));
    }
    for (const TriangleIndices& t : *wall) {
      triangles.push_back(
          {points[std::size_t(t[0])], points[std::size_t(t[1])], points[std::size_t(t[2])]});
    }
    return true;
  }

  Points& points_;
  const Extents& extents_;
  const std::int32_t part_;
  const Scalar spacing_;
  const RigidPose& X_WK_;
  const BodySheets* const sheets_;
  bool is_clear_ = true;
  std::array<Edge, 12> edges_ = all_edges();
  std::array<Next, kPlanes> next_;             // of each wall's outline
  std::array<std::optional<int>, 8> covered_;  // times, of each corner
  std::array<std::vector<RimEnd>, 8> corner_points_;
};

// One try with a kerf of a certain size.
class KerfRun {
 public:
  KerfRun(const SurfaceParts& surface, const TissueKerf& kerf, Scalar spacing,
          const BodySheets* sheets, int growths)
      : surface_(surface), kerf_(kerf), spacing_(spacing), sheets_(sheets) {
    const RigidPose X_KW = kerf.X_WK.inverse();
    Scalar size = kerf.half_extents.maxCoeff();
    for (std::size_t k = 0; k < surface.vertices_W.size(); ++k) {
      const Vector3& p_W = surface.vertices_W[k];
      points_.add(X_KW * p_W, 0, surface.part_of_vertex[k], -1);
      size = std::max({size, p_W.cwiseAbs().maxCoeff(), points_.p_K.back().cwiseAbs().maxCoeff()});
    }
    noise_ = kInPlane * size;
    for (int plane = 0; plane < kPlanes; ++plane) {
      // Every plane by another length, so that none meets the same place twice.
      const Scalar growth = kGrowth * size * growths * (1 + Scalar(plane) / (2 * kPlanes));
      extents_[std::size_t(plane)] = kerf.half_extents[axis_of(plane)] + growth;
    }
  }

  bool is_degenerate() const { return is_degenerate_; }

  // Nothing if another size should be tried: something lies in a plane, or a wall cannot be closed.
  std::optional<KerfSurface> run() {
    Divider divider(points_, extents_, noise_);
    for (std::size_t t = 0; t < surface_.triangles.size(); ++t) {
      const TriangleIndices& corners = surface_.triangles[t];
      divider.divide({{corners[0], corners[1], corners[2]}, {-1, -1, -1}, std::int32_t(t)});
    }
    is_degenerate_ = divider.is_degenerate();
    if (is_degenerate_) return std::nullopt;
    for (const Piece& piece : divider.kept()) {
      if (!add_kept(divider.outline(piece), piece.triangle)) return std::nullopt;
    }
    const std::size_t kept = result_.triangles.size();
    if (!add_caps(divider.gone()) || !is_closed()) return std::nullopt;
    const bool is_missed = divider.gone().empty() && result_.triangles.size() == kept;
    result_.status = is_missed                   ? CutStatus::Missed
                     : result_.triangles.empty() ? CutStatus::NothingLeft
                                                 : CutStatus::Cut;
    tell_points();
    return std::move(result_);
  }

 private:
  // In the plane of its triangle, seen along the axis that is nearest to its normal.
  bool add_kept(const std::vector<std::int32_t>& outline, std::int32_t triangle) {
    if (outline.size() == 3) {
      result_.triangles.push_back({outline[0], outline[1], outline[2]});
      return true;
    }
    const TriangleIndices& t = surface_.triangles[std::size_t(triangle)];
    const Vector3 base = points_[t[0]];
    const Vector3 normal = (points_[t[1]] - base).cross(points_[t[2]] - base);
    int axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    int u = (axis + 1) % 3, v = (axis + 2) % 3;
    if (normal[axis] < 0) std::swap(u, v);
    PlaneRegion region;
    region.loops.emplace_back();
    for (std::size_t k = 0; k < outline.size(); ++k) {
      const Vector3 p = points_[outline[k]] - base;
      region.points.emplace_back(p[u], p[v]);
      region.loops[0].push_back(std::int32_t(k));
    }
    const auto pieces = triangulate(region, 0);
    if (!pieces) return false;
    for (const TriangleIndices& piece : *pieces) {
      result_.triangles.push_back({outline[std::size_t(piece[0])], outline[std::size_t(piece[1])],
                                   outline[std::size_t(piece[2])]});
    }
    return true;
  }

  // Walls that lie over each other may have a chord in common.
  bool is_closed() const {
    std::unordered_set<std::uint64_t> edges;
    const auto directed = [](std::int32_t a, std::int32_t b) {
      return (std::uint64_t(std::uint32_t(a)) << 32) | std::uint32_t(b);
    };
    for (const TriangleIndices& t : result_.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        if (!edges.insert(directed(t[k], t[(k + 1) % 3])).second) return false;
      }
    }
    return std::ranges::all_of(result_.triangles, [&](const TriangleIndices& t) {
      return edges.contains(directed(t[1], t[0])) && edges.contains(directed(t[2], t[1])) &&
             edges.contains(directed(t[0], t[2]));
    });
  }

  bool add_caps(const std::vector<Piece>& gone) {
    std::map<std::int32_t, Caps> caps;
    for (const std::int32_t part : surface_.part_of_vertex) {
      if (caps.contains(part)) continue;
      caps.try_emplace(part, points_, extents_, part, spacing_, kerf_.X_WK, sheets_);
    }
    for (const Piece& piece : gone) {
      caps.at(points_.parts[std::size_t(piece.corners[0])]).add(piece);
    }
    return std::all_of(caps.begin(), caps.end(), [&](auto& entry) {
      const std::int32_t part = entry.first;
      return entry.second.close([&](const Vector3& p_K) { return times_covered(part, p_K); },
                                result_.triangles);
    });
  }

  int times_covered(std::int32_t part, const Vector3& p_K) const {
    std::vector<TriangleIndices> triangles;
    AlignedBox box;
    for (const TriangleIndices& t : surface_.triangles) {
      if (surface_.part_of_vertex[std::size_t(t[0])] != part) continue;
      triangles.push_back(t);
      for (const std::int32_t corner : t) box.extend(points_[corner]);
    }
    if (triangles.empty() || !box.contains(p_K)) return 0;
    const std::vector<Vector3> vertices(
        points_.p_K.begin(), points_.p_K.begin() + std::ptrdiff_t(surface_.vertices_W.size()));
    return winding_number(TriangleMesh(vertices, std::move(triangles)), p_K);
  }

  void tell_points() {
    for (std::size_t k = surface_.vertices_W.size(); k < points_.p_K.size(); ++k) {
      result_.added_W.push_back(kerf_.X_WK * points_.p_K[k]);
      result_.parts.push_back(points_.parts[k]);
      result_.sources.push_back(points_.sources[k]);
      Vector3 away = Vector3::Zero();
      for (int plane = 0; plane < kPlanes; ++plane) {
        if (points_.is_in(std::int32_t(k), plane)) away[axis_of(plane)] = sign_of(plane);
      }
      result_.away_W.push_back(kerf_.X_WK.rotation() * away.normalized());
    }
  }

  const SurfaceParts& surface_;
  const TissueKerf& kerf_;
  const Scalar spacing_;
  const BodySheets* const sheets_;
  Points points_;
  Extents extents_{};
  Scalar noise_ = 0;
  bool is_degenerate_ = false;
  KerfSurface result_;
};

}  // namespace

KerfSurface take_kerf(const SurfaceParts& surface, const TissueKerf& kerf, Scalar spacing,
                      const BodySheets* sheets) {
  int crossings = 0;
  for (int growths = 0; growths <= kMostGrowths && crossings < kMostCrossings; ++growths) {
    KerfRun run(surface, kerf, spacing, sheets, growths);
    auto result = run.run();
    if (result) return std::move(*result);
    crossings += run.is_degenerate() ? 0 : 1;
  }
  return {CutStatus::Unclear, {}, {}, {}, {}, {}};
}

}  // namespace dyop::tissue_internal
