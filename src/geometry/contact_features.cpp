#include "dyop/geometry/contact_features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "dyop/core/tolerance.h"

namespace dyop {
namespace {

// A triangle beside an edge, as seen from it.
struct Wing {
  Vector3 leaving = Vector3::Zero();  // unit, in the triangle, square to the edge
  bool has_area = false;
  bool runs_up = false;  // from the smaller vertex to the larger one
};

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
      : vertices_(vertices), triangles_(triangles), topology_(topology) {}

  EdgeShape edge_shape(std::int32_t edge) const;

  // Whether some n has n . t <= 0 for all edges t at the vertex: the normal cone, or more.
  bool has_normal_cone(std::int32_t vertex);

 private:
  Wing wing(std::int32_t side) const;
  EdgeShape shape_of_two(const Wing& a, const Wing& b) const;
  bool opens_beyond_half(std::span<const std::int32_t> sides) const;
  bool is_normal(const Vector3& n) const;
  std::int32_t edge_owned_by(std::int32_t side) const;
  void gather_rays(std::int32_t vertex);

  std::span<const Vector3> vertices_;
  std::span<const TriangleIndices> triangles_;
  const MeshTopology& topology_;
  std::vector<Vector3> rays_;  // unit, along the edges at a vertex
};

// A triangle flatter than this across its side has no direction across it that rounding leaves.
constexpr Scalar kThinnestWing = kFlatEdgeSine * kFlatEdgeSine;

Wing FeatureFinder::wing(std::int32_t side) const {
  const TriangleIndices& t = triangles_[std::size_t(side / 3)];
  const auto k = std::size_t(side % 3);
  const Vector3& from = vertices_[std::size_t(t[k])];
  const Vector3 along = vertices_[std::size_t(t[(k + 1) % 3])] - from;
  const Vector3 up = vertices_[std::size_t(t[(k + 2) % 3])] - from;
  const Scalar along_sq = along.squaredNorm();
  Wing wing;
  wing.runs_up = t[k] < t[(k + 1) % 3];
  if (!(along_sq > 0)) return wing;
  wing.leaving = up - along * (along.dot(up) / along_sq);
  const Scalar height = wing.leaving.norm();
  wing.has_area = height > kThinnestWing * std::max(std::sqrt(along_sq), up.norm());
  if (wing.has_area) wing.leaving /= height;
  return wing;
}

EdgeShape FeatureFinder::shape_of_two(const Wing& a, const Wing& b) const {
  const Vector3 bend = a.leaving + b.leaving;
  const bool is_flat = bend.norm() <= kFlatEdgeSine;
  if (a.runs_up == b.runs_up) return {EdgeKind::NonManifold, !is_flat, false};
  if (is_flat) return {EdgeKind::Flat, false, false};
  return {EdgeKind::Convex, true, false};
}

// Whether the triangles at an edge leave more than a half turn free on one side.
bool FeatureFinder::opens_beyond_half(std::span<const std::int32_t> sides) const {
  const Wing first = wing(sides[0]);
  const auto& ends = topology_.edge(topology_.edge_of_side(sides[0]));
  const Vector3 along =
      (vertices_[std::size_t(ends[1])] - vertices_[std::size_t(ends[0])]).normalized();
  const Vector3 across = along.cross(first.leaving);
  std::vector<Scalar> turns;
  for (const std::int32_t side : sides) {
    const Vector3 leaving = wing(side).leaving;
    turns.push_back(std::atan2(across.dot(leaving), first.leaving.dot(leaving)));
  }
  std::sort(turns.begin(), turns.end());
  constexpr Scalar kHalf = std::numbers::pi;
  Scalar widest = turns.front() + 2 * kHalf - turns.back();
  for (std::size_t k = 1; k < turns.size(); ++k) widest = std::max(widest, turns[k] - turns[k - 1]);
  return widest > kHalf + kFlatEdgeSine;
}

EdgeShape FeatureFinder::edge_shape(std::int32_t edge) const {
  const std::span<const std::int32_t> sides = topology_.sides_of_edge(edge);
  if (sides.size() == 1) {
    return {wing(sides[0]).has_area ? EdgeKind::Border : EdgeKind::NonManifold, true, true};
  }
  if (sides.size() == 2) {
    const Wing a = wing(sides[0]);
    const Wing b = wing(sides[1]);
    if (!a.has_area || !b.has_area) return {};
    EdgeShape shape = shape_of_two(a, b);
    if (shape.kind != EdgeKind::Convex) return shape;
    const auto& ends = topology_.edge(edge);
    const Vector3 along = vertices_[std::size_t(ends[1])] - vertices_[std::size_t(ends[0])];
    const Vector3 outer = a.runs_up ? along.cross(a.leaving) : a.leaving.cross(along);
    if (outer.dot(b.leaving) > 0) shape.kind = EdgeKind::Concave;
    return shape;
  }
  for (const std::int32_t side : sides) {
    if (!wing(side).has_area) return {};
  }
  return {EdgeKind::NonManifold, opens_beyond_half(sides), true};
}

bool FeatureFinder::is_normal(const Vector3& n) const {
  return std::all_of(rays_.begin(), rays_.end(),
                     [&](const Vector3& ray) { return n.dot(ray) <= kFlatEdgeSine; });
}

// The edge of a side, if this side owns it; -1 if not.
std::int32_t FeatureFinder::edge_owned_by(std::int32_t side) const {
  const std::int32_t edge = topology_.edge_of_side(side);
  return edge >= 0 && topology_.sides_of_edge(edge)[0] == side ? edge : -1;
}

void FeatureFinder::gather_rays(std::int32_t vertex) {
  rays_.clear();
  const Vector3& p = vertices_[std::size_t(vertex)];
  for (const std::int32_t corner : topology_.corners_of_vertex(vertex)) {
    const std::int32_t side_before = corner % 3 == 0 ? corner + 2 : corner - 1;
    for (const std::int32_t side : {corner, side_before}) {
      const std::int32_t edge = edge_owned_by(side);
      if (edge < 0) continue;
      const auto& ends = topology_.edge(edge);
      const Vector3 ray = vertices_[std::size_t(ends[ends[0] == vertex])] - p;
      const Scalar length = ray.norm();
      if (length > 0) rays_.push_back(ray / length);
    }
  }
}

// The cone, if there is one, has a normal along the rays' mean or one square to two of them.
bool FeatureFinder::has_normal_cone(std::int32_t vertex) {
  constexpr std::size_t kMostRays = 24;  // the work grows with the cube: more count as a cone
  gather_rays(vertex);
  Vector3 mean = Vector3::Zero();
  for (const Vector3& ray : rays_) mean += ray;
  const Scalar length = mean.norm();
  if (rays_.size() > kMostRays || (length > 0 && is_normal(-mean / length))) return true;
  bool is_line = true;
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Vector3 n = rays_[i].cross(rays_[j]);
      const Scalar sine = n.norm();
      if (sine <= kFlatEdgeSine) continue;
      is_line = false;
      if (is_normal(n / sine) || is_normal(-n / sine)) return true;
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
    const auto bits = std::uint8_t((shape.is_contact ? kContact : 0) |
                                   (shape.is_doubtful ? kDoubtful : 0));
    edge_bits_[std::size_t(e)] = bits;
    for (const std::int32_t v : topology.edge(e)) vertex_bits_[std::size_t(v)] |= bits;
    const std::int32_t owner = topology.sides_of_edge(e)[0];
    if (shape.is_contact) owned_[std::size_t(owner / 3)] |= std::uint8_t(8 << owner % 3);
  }
  for (std::int32_t v = 0; v < topology.vertex_count(); ++v) {
    std::uint8_t& bits = vertex_bits_[std::size_t(v)];
    const std::span<const std::int32_t> corners = topology.corners_of_vertex(v);
    if (corners.empty()) continue;
    const bool has_edge = std::any_of(corners.begin(), corners.end(), [&](std::int32_t corner) {
      return topology.edge_of_side(corner) >= 0;
    });
    if (!has_edge) bits = kContact | kDoubtful;
    if (bits == kContact && !finder.has_normal_cone(v)) bits = 0;
    if ((bits & kContact) == 0) continue;
    owned_[std::size_t(corners[0] / 3)] |= std::uint8_t(1 << corners[0] % 3);
  }
  mark_nodes(hierarchy);
}

// Parts come after their node, so that the last node is the first that is complete.
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
