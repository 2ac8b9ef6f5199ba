// SPDX-License-Identifier: BSD-3-Clause
#include "check/enclosure.h"

#include <array>
#include <map>

namespace dyop_check {
namespace {

constexpr double kInside = 0.5;  // turns; a closed surface has whole ones

// Of a mesh, mostly: a hull of three points is within nothing either.
bool is_triangle(const Piece& piece) {
  return piece.kind == Piece::Kind::Points && piece.points.size() == 3 && piece.radius == 0;
}

// Sets of numbers that are joined one by one.
class Joined {
 public:
  std::size_t add() {
    parents_.push_back(parents_.size());
    return parents_.back();
  }
  std::size_t root(std::size_t k) {
    while (parents_[k] != k) k = parents_[k] = parents_[parents_[k]];
    return k;
  }
  void join(std::size_t a, std::size_t b) { parents_[root(a)] = root(b); }

 private:
  std::vector<std::size_t> parents_;
};

// One point of each connected part of a body; triangles hang together at the same corners. A
// half-space is inside of nothing.
std::vector<Vec> points_of(const Body& body) {
  std::vector<Vec> points;
  if (body.half_space()) return points;
  std::map<std::array<double, 3>, std::size_t> numbers;
  Joined corners;
  const auto number_of = [&](const Vec& p) {
    const auto [found, is_new] = numbers.try_emplace({p.x, p.y, p.z}, 0);
    if (is_new) found->second = corners.add();
    return found->second;
  };
  for (const Piece& piece : body.pieces) {
    if (!is_triangle(piece)) {
      points.push_back(piece.core_support({1, 0, 0}));
      continue;
    }
    for (const Vec& corner : piece.points)
      corners.join(number_of(corner), number_of(piece.points[0]));
  }
  for (const auto& [p, number] : numbers) {
    if (corners.root(number) == number) points.push_back({p[0], p[1], p[2]});
  }
  return points;
}

// The part of all directions from the origin in which a triangle is, by the formula of van Oosterom
// and Strackee.
double turn_of(const Vec& a, const Vec& b, const Vec& c) {
  const double la = norm(a);
  const double lb = norm(b);
  const double lc = norm(c);
  const double angle = 2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc +
                                                               dot(b, c) * la + dot(c, a) * lb);
  return angle / (4 * kPi);
}

// How often the triangles of a body's meshes go around a point.
double turns_around(const Body& body, const Vec& p) {
  double turns = 0;
  for (const Piece& piece : body.pieces) {
    if (!is_triangle(piece)) continue;
    turns += turn_of(piece.points[0] - p, piece.points[1] - p, piece.points[2] - p);
  }
  return turns;
}

double turns_around(const Obstacle& obstacle, const Vec& p_W) {
  if (!obstacle.deforms)
    return turns_around(*obstacle.shape, transposed(obstacle.X_WO.R, p_W - obstacle.X_WO.p));
  double turns = 0;
  for (std::size_t k = 0; k < obstacle.corners.size(); k += 3) {
    const auto corner = [&](std::size_t i) {
      return obstacle.vertices[std::size_t(obstacle.corners[k + i])] - p_W;
    };
    turns += turn_of(corner(0), corner(1), corner(2));
  }
  return turns;
}

bool is_in_box(const Node& box, const Vec& p) {
  const Vec d = p - box.center;
  return std::abs(d.x) <= box.half.x && std::abs(d.y) <= box.half.y && std::abs(d.z) <= box.half.z;
}

bool encloses(const RecordedBody& outer, const RecordedBody& inner,
              const std::vector<Vec>& points_of_inner, double t) {
  const Segment* of_outer = outer.segment(t);
  const Segment* of_inner = inner.segment(t);
  if (of_outer == nullptr || of_inner == nullptr) return false;
  const Pose X = of_outer->pose(t);
  const Pose Y = of_inner->pose(t);
  for (const Vec& point : points_of_inner) {
    const Vec p = transposed(X.R, Y * point - X.p);
    if (is_in_box(outer.shape->nodes[0], p) && std::abs(turns_around(*outer.shape, p)) > kInside)
      return true;
  }
  return false;
}

// When a body appears or is put elsewhere.
std::set<double> beginnings(const RecordedBody& body, double begin) {
  std::set<double> times = body.placed;
  times.insert(std::max(begin, body.from));
  return times;
}

}  // namespace

std::vector<Enclosure> find_enclosures(const Recording& recording) {
  std::vector<Enclosure> found;
  const auto count = std::uint32_t(recording.bodies.size());
  std::map<const Body*, std::vector<Vec>> points;
  const auto points_once = [&](const Body& body) -> const std::vector<Vec>& {
    const auto [at, is_new] = points.try_emplace(&body);
    if (is_new) at->second = points_of(body);
    return at->second;
  };
  for (std::uint32_t outer = 0; outer < count; ++outer) {
    const RecordedBody& mesh = recording.bodies[outer];
    const auto& pieces = mesh.shape->pieces;
    if (std::none_of(pieces.begin(), pieces.end(), is_triangle)) continue;
    for (std::uint32_t inner = 0; inner < count; ++inner) {
      std::set<double> times = beginnings(recording.bodies[inner], recording.begin);
      times.merge(beginnings(mesh, recording.begin));
      for (const double t : times) {
        if (!recording.is_tested(outer, inner, at_time(recording.rules, t)) ||
            !encloses(mesh, recording.bodies[inner], points_once(*recording.bodies[inner].shape),
                      t))
          continue;
        found.push_back({inner, outer, t});
        break;
      }
    }
  }
  return found;
}

std::vector<std::pair<std::string, std::string>> find_enclosures(const HapticRecording& recording) {
  std::vector<std::pair<std::string, std::string>> found;
  const Waypoint start = recording.waypoint(0);
  for (const ToolPart& part : recording.parts) {
    const Waypoint::Tool& tool = start.tools[part.tool];
    Pose X = tool.X_WT;
    if (part.hinge) X = X * part.X_TJ * Pose{rotation({0, 0, tool.angles[*part.hinge]}), {}};
    const std::vector<Vec> points = points_of(*part.shape);
    for (const Obstacle& obstacle : recording.obstacles) {
      const bool is_inside = std::any_of(points.begin(), points.end(), [&](const Vec& point) {
        return std::abs(turns_around(obstacle, X * point)) > kInside;
      });
      if (obstacle.is_hard && is_inside) found.emplace_back(part.name, obstacle.name);
    }
  }
  return found;
}

}  // namespace dyop_check
