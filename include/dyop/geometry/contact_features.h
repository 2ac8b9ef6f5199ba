// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dyop/core/types.h"
#include "dyop/geometry/mesh_topology.h"
#include "dyop/hierarchy/mesh_hierarchy.h"

namespace DYOP_EXPORT dyop {

/// The shape of a mesh at an edge. Convex or concave follows from the winding of its triangles: at
/// a convex edge each triangle lies on the inner side of the other.
enum class EdgeKind : std::uint8_t {
  Flat,  ///< two triangles in one plane, to kFlatEdgeSine
  Convex,
  Concave,
  Border,       ///< one triangle
  NonManifold,  ///< no triangle with area, more than two, or two wound oppositely
};

/// Which edges and vertices of a mesh another body can touch: those where the surface's normal cone
/// (the directions n with n . t <= 0 for every direction t along the surface) is more than the
/// normals of a flat area. See docs/algorithms/contact_generation.md.
///
/// Both sides of the surface count, so a concave edge can be touched from the inside. Doubtful
/// features are kept: edges and vertices of triangles without area, and borders.
class ContactFeatures {
 public:
  ContactFeatures(std::span<const Vector3> vertices, std::span<const TriangleIndices> triangles,
                  const MeshTopology& topology, const MeshHierarchy& hierarchy);

  EdgeKind edge_kind(std::int32_t edge) const { return kinds_[static_cast<std::size_t>(edge)]; }
  bool is_contact_edge(std::int32_t edge) const { return (edge_bits(edge) & kContact) != 0; }
  bool is_contact_vertex(std::int32_t vertex) const {
    return (vertex_bits(vertex) & kContact) != 0;
  }

  /// Whether vertex numbers may not tell everything that meets here: borders, more than two
  /// triangles at an edge, triangles without area.
  bool is_doubtful_edge(std::int32_t edge) const { return (edge_bits(edge) & kDoubtful) != 0; }
  bool is_doubtful_vertex(std::int32_t vertex) const {
    return (vertex_bits(vertex) & kDoubtful) != 0;
  }

  /// Each contact edge and vertex is owned by one triangle: bit k stands for its corner k, bit 3 +
  /// k for its side k.
  std::uint8_t owned_by(std::int32_t triangle) const {
    return owned_[static_cast<std::size_t>(triangle)];
  }
  static constexpr std::uint8_t kCorners = 7;
  static constexpr std::uint8_t kSides = 56;

  /// Bit k: below column k of a node of the hierarchy a triangle owns a contact vertex (edge).
  std::uint8_t columns_with_vertices(std::int32_t node) const {
    return node_bits_[static_cast<std::size_t>(node)].vertices;
  }
  std::uint8_t columns_with_edges(std::int32_t node) const {
    return node_bits_[static_cast<std::size_t>(node)].edges;
  }

 private:
  static constexpr std::uint8_t kContact = 1;
  static constexpr std::uint8_t kDoubtful = 2;
  static constexpr std::uint8_t kNotConvex = 4;  // of an edge at a vertex, during construction
  static constexpr std::uint8_t kNotConcave = 8;
  struct NodeBits {
    std::uint8_t vertices = 0;
    std::uint8_t edges = 0;
  };
  std::uint8_t edge_bits(std::int32_t edge) const {
    return edge_bits_[static_cast<std::size_t>(edge)];
  }
  std::uint8_t vertex_bits(std::int32_t vertex) const {
    return vertex_bits_[static_cast<std::size_t>(vertex)];
  }
  void mark_nodes(const MeshHierarchy& hierarchy);

  std::vector<EdgeKind> kinds_;
  std::vector<std::uint8_t> edge_bits_;
  std::vector<std::uint8_t> vertex_bits_;
  std::vector<std::uint8_t> owned_;
  std::vector<NodeBits> node_bits_;
};

}  // namespace dyop
