// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/contact_features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/tolerance.h"

namespace dyop {
namespace {

struct EdgeShape {
  EdgeKind kind = EdgeKind::NonManifold;
  bool is_contact = true;
  bool is_doubtful = true;
};

// Classifies the edges and vertices of one mesh.
class FeatureFinder {
 public:
  FeatureFinder(std::span<const Vector3> vertices, std::span<const TriangleIndices> triangles,
                const MeshTopology& topology)
      : vertices_(vertices), triangles_(triangles), topology_(topology) {
    find_normals();
  }

  EdgeShape edge_shape(std::int32_t edge) const;

  // Whether some n has n . t <= 0 for all edges t at the vertex: the normal cone, or a superset.
  bool has_normal_cone(std::int32_t vertex);

 private:
  void find_normals();
  bool runs_up(std::int32_t side) const;
  const Vector3& corner_across(std::int32_t side) const;
  EdgeShape shape_of_two(std::int32_t side_a, std::int32_t side_b) const;
  bool opens_beyond_half(std::span<const std::int32_t> sides) const;
  bool is_normal(const Vector3& n) const;
  std::optional<std::int32_t> edge_owned_by(std::int32_t side) const;
  void gather_rays(std::int32_t vertex);

  std::span<const Vector3> vertices_;
  std::span<const TriangleIndices> triangles_;
  const MeshTopology& topology_;
  std::vector<Vector3> normals_;  // unit by winding; zero for a triangle without area
  std::vector<Vector3> rays_;     // unit, along the edges at a vertex
};

void FeatureFinder::find_normals() {
  // A triangle thinner than this, relative to its length, has no normal beyond rounding.
  constexpr Scalar kThinnest = kFlatEdgeSine * kFlatEdgeSine;
  normals_.assign(triangles_.size(), Vector3::Zero());
  for (std::size_t k = 0; k < triangles_.size(); ++k) {
    const TriangleIndices& t = triangles_[k];
    const Vector3 e = vertices_[std::size_t(t[1])] - vertices_[std::size_t(t[0])];
    const Vector3 f = vertices_[std::size_t(t[2])] - vertices_[std::size_t(t[0])];
    const Vector3 n = e.cross(f);
    const Scalar length = n.norm();
    if (length > kThinnest * std::max(e.squaredNorm(), f.squaredNorm())) normals_[k] = n / length;
  }
}

// Whether a side runs from the smaller vertex of its edge to the larger one.
bool FeatureFinder::runs_up(std::int32_t side) const {
  const TriangleIndices& t = triangles_[std::size_t(side / 3)];
  return t[std::size_t(side % 3)] == topology_.edge(*topology_.edge_of_side(side))[0];
}

const Vector3& FeatureFinder::corner_across(std::int32_t side) const {
  const TriangleIndices& t = triangles_[std::size_t(side / 3)];
  return vertices_[std::size_t(t[std::size_t((side % 3 + 2) % 3)])];
}

EdgeShape FeatureFinder::shape_of_two(std::int32_t side_a, std::int32_t side_b) const {
  const Vector3& n_a = normals_[std::size_t(side_a / 3)];
  const Vector3& n_b = normals_[std::size_t(side_b / 3)];
  if (n_a.isZero(0) || n_b.isZero(0)) return {};
  constexpr Scalar kFlatSquare = kFlatEdgeSine * kFlatEdgeSine;
  const bool is_consistent = runs_up(side_a) != runs_up(side_b);
  const Scalar parted_sq = (n_a - n_b).squaredNorm();
  const Scalar opposed_sq = (n_a + n_b).squaredNorm();
  const bool is_flat = (is_consistent ? parted_sq : opposed_sq) <= kFlatSquare;
  // A duplicate triangle hides what it is joined to.
  const bool is_folded = (is_consistent ? opposed_sq : parted_sq) <= kFlatSquare;
  if (!is_consistent) return {EdgeKind::NonManifold, !is_flat, is_folded};
  if (is_flat) return {EdgeKind::Flat, false, false};
  const Vector3& from = vertices_[std::size_t(topology_.edge(*topology_.edge_of_side(side_a))[0])];
  const bool is_concave = n_a.dot(corner_across(side_b) - from) > 0;
  return {is_concave ? EdgeKind::Concave : EdgeKind::Convex, true, is_folded};
}

// Whether the triangles at an edge leave more than half a turn free on one side.
bool FeatureFinder::opens_beyond_half(std::span<const std::int32_t> sides) const {
  const auto& ends = topology_.edge(*topology_.edge_of_side(sides[0]));
  const Vector3& from = vertices_[std::size_t(ends[0])];
  const Vector3 along = (vertices_[std::size_t(ends[1])] - from).normalized();
  const Vector3 zero = along.cross(along.cross(corner_across(sides[0]) - from)).normalized();
  const Vector3 quarter = along.cross(zero);
  std::vector<Scalar> turns;
  for (const std::int32_t side : sides) {
    const Vector3 up = corner_across(side) - from;
    turns.push_back(std::atan2(quarter.dot(up), zero.dot(up)));
  }
  std::sort(turns.begin(), turns.end());
  constexpr Scalar kHalf = std::numbers::pi;
  Scalar widest = turns.front() + 2 * kHalf - turns.back();
  for (std::size_t k = 1; k < turns.size(); ++k) widest = std::max(widest, turns[k] - turns[k - 1]);
  return widest > kHalf + kFlatEdgeSine;
}

EdgeShape FeatureFinder::edge_shape(std::int32_t edge) const {
  const std::span<const std::int32_t> sides = topology_.sides_of_edge(edge);
  if (sides.size() == 2) return shape_of_two(sides[0], sides[1]);
  for (const std::int32_t side : sides) {
    if (normals_[std::size_t(side / 3)].isZero(0)) return {};
  }
  if (sides.size() == 1) return {EdgeKind::Border, true, true};
  return {EdgeKind::NonManifold, opens_beyond_half(sides), true};
}

bool FeatureFinder::is_normal(const Vector3& n) const {
  return std::all_of(rays_.begin(), rays_.end(),
                     [&](const Vector3& ray) { return n.dot(ray) <= kFlatEdgeSine; });
}

// The edge of a side, if this side owns it.
std::optional<std::int32_t> FeatureFinder::edge_owned_by(std::int32_t side) const {
  const auto edge = topology_.edge_of_side(side);
  return edge && topology_.sides_of_edge(*edge)[0] == side ? edge : std::nullopt;
}

void FeatureFinder::gather_rays(std::int32_t vertex) {
  rays_.clear();
  const Vector3& p = vertices_[std::size_t(vertex)];
  for (const std::int32_t corner : topology_.corners_of_vertex(vertex)) {
    const std::int32_t side_before = corner % 3 == 0 ? corner + 2 : corner - 1;
    for (const std::int32_t side : {corner, side_before}) {
      const std::optional<std::int32_t> edge = edge_owned_by(side);
      if (!edge) continue;
      const auto& ends = topology_.edge(*edge);
      const Vector3 ray = vertices_[std::size_t(ends[ends[0] == vertex])] - p;
      const Scalar length = ray.norm();
      if (length > 0) rays_.push_back(ray / length);
    }
  }
}

// If there is a cone, it has a normal along the mean of the rays or perpendicular to two of them.
bool FeatureFinder::has_normal_cone(std::int32_t vertex) {
  constexpr std::size_t kMostRays = 24;  // the work grows with the cube; with more rays: a cone
  gather_rays(vertex);
  Vector3 mean = Vector3::Zero();
  for (const Vector3& ray : rays_) mean += ray;
  const Scalar length = mean.norm();
  if (rays_.size() > kMostRays || (length > 0 && is_normal(-mean / length))) return true;
  bool is_line = true;
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Vector3 n = rays_[i].cross(rays_[j]);
      if (n.squaredNorm() <= kFlatEdgeSine * kFlatEdgeSine) continue;
      is_line = false;
      // Not divided by its length: at worst that keeps a vertex too many.
      bool is_above = false;
      bool is_below = false;
      for (std::size_t k = 0; k < rays_.size() && !(is_above && is_below); ++k) {
        const Scalar rise = n.dot(rays_[k]);
        is_above = is_above || rise > kFlatEdgeSine;
        is_below = is_below || rise < -kFlatEdgeSine;
      }
      if (!(is_above && is_below)) return true;
    }
  }
  return is_line;
}

}  // namespace

ContactFeatures::ContactFeatures(std::span<const Vector3> vertices,
                                 std::span<const TriangleIndices> triangles,
                                 const MeshTopology& topology, const MeshHierarchy& hierarchy)
    : kinds_(std::size_t(topology.edge_count())),
      edge_bits_(kinds_.size()),
      vertex_bits_(vertices.size()),
      owned_(triangles.size()) {
  FeatureFinder finder(vertices, triangles, topology);
  for (std::int32_t e = 0; e < topology.edge_count(); ++e) {
    const EdgeShape shape = finder.edge_shape(e);
    kinds_[std::size_t(e)] = shape.kind;
    const auto bits =
        std::uint8_t((shape.is_contact ? kContact : 0) | (shape.is_doubtful ? kDoubtful : 0));
    edge_bits_[std::size_t(e)] = bits;
    const auto bends = std::uint8_t((shape.kind != EdgeKind::Convex ? kNotConvex : 0) |
                                    (shape.kind != EdgeKind::Concave ? kNotConcave : 0));
    for (const std::int32_t v : topology.edge(e)) {
      std::uint8_t& vertex_bits = vertex_bits_[std::size_t(v)];
      vertex_bits |= bits;
      if (shape.kind != EdgeKind::Flat) vertex_bits |= bends;
    }
    const std::int32_t owner = topology.sides_of_edge(e)[0];
    if (shape.is_contact) owned_[std::size_t(owner / 3)] |= std::uint8_t(8 << owner % 3);
  }
  for (std::int32_t v = 0; v < topology.vertex_count(); ++v) {
    std::uint8_t& bits = vertex_bits_[std::size_t(v)];
    const std::span<const std::int32_t> corners = topology.corners_of_vertex(v);
    if (corners.empty()) continue;
    const bool has_edge = std::any_of(corners.begin(), corners.end(), [&](std::int32_t corner) {
      return topology.edge_of_side(corner).has_value();
    });
    if (!has_edge) bits = kContact | kDoubtful;
    // A fan that bends one way only has a cone.
    const bool is_mixed = (bits & kNotConvex) != 0 && (bits & kNotConcave) != 0;
    bits &= kContact | kDoubtful;
    if (bits == kContact && is_mixed && !finder.has_normal_cone(v)) bits = 0;
    if ((bits & kContact) == 0) continue;
    owned_[std::size_t(corners[0] / 3)] |= std::uint8_t(1 << corners[0] % 3);
  }
  mark_nodes(hierarchy);
}

// Parts come after their node, so going backwards completes every node before its parent.
void ContactFeatures::mark_nodes(const MeshHierarchy& hierarchy) {
  const std::vector<MeshHierarchy::Node>& nodes = hierarchy.nodes();
  node_bits_.resize(nodes.size());
  for (std::size_t node = nodes.size(); node-- > 0;) {
    NodeBits& bits = node_bits_[node];
    for (int column = 0; column < nodes[node].count(); ++column) {
      const std::int32_t child = nodes[node].child[column];
      bool has_vertices;
      bool has_edges;
      if (child < 0) {
        has_vertices = (owned_by(-1 - child) & kCorners) != 0;
        has_edges = (owned_by(-1 - child) & kSides) != 0;
      } else {
        has_vertices = node_bits_[std::size_t(child)].vertices != 0;
        has_edges = node_bits_[std::size_t(child)].edges != 0;
      }
      bits.vertices |= std::uint8_t(has_vertices << column);
      bits.edges |= std::uint8_t(has_edges << column);
    }
  }
}

}  // namespace dyop
