// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "dyop/tissue/soft_tissue.h"
#include "tissue/tissue_lattice.h"

namespace dyop::tissue_internal {

/// A point that a cut adds to the surface.
struct NewPoint {
  Vector3 p_W = Vector3::Zero();
  Vector3 away_W = Vector3::Zero();  ///< unit vector from the kerf
  std::int32_t part = 0;             ///< of the lattice, to which it belongs
  std::optional<Vector3> rest;       ///< about where it is at rest, if that is known
  /// Those that hold the corners of its triangle, if it is on one.
  std::vector<std::int32_t> cubes_beside;
};

/// What a cut leaves of a lattice.
struct LatticePieces {
  struct Cube {
    std::int32_t old = 0;
    Corners nodes{};
    Samples material, light;
    bool is_changed = false;  ///< it has other samples than the old one
  };
  std::vector<Cube> cubes;
  std::vector<std::int32_t> old_nodes;  ///< of each node
  std::vector<Host> hosts;              ///< of the vertices, in the new cubes
  std::vector<bool> keeps_triangle;     ///< false: of a crumb, which the blade takes along
  /// Vertices of triangles that join parts of the lattice that are apart: those in the smaller one.
  std::vector<std::int32_t> torn;
};

/// A cube as it is now, in the kerf's frame.
struct CubeShape {
  std::array<Vector3, 8> corners;
  std::array<Vector3, kSamples> samples;
  Samples left;  ///< those of the body that the kerf has not taken
};

/// Divides the lattice where a kerf goes through its cubes in their present shape: virtual nodes
/// [Molino2004]. Samples of the material are joined to their neighbours unless the kerf has taken
/// one of them or lies between them, and points of the surface to the samples that they see. Each
/// connected part of a cube becomes a cube of its own; cubes share the nodes between them if their
/// material is joined across.
class LatticeCut {
 public:
  /// @param x Present places of the nodes.
  LatticeCut(const TissueLattice& lattice, const NodeVectors& x, const TissueKerf& kerf);

  /// The cube that holds a new point of the surface, and where in it.
  /// @return Nothing if there is no such cube.
  std::optional<Host> host_of(const NewPoint& point) const;

  /// Where a point is that is reached from another one straight through the body: along nodes that
  /// cubes share, so that it stays on its side where the body lies over itself.
  /// @param way Out: all cubes on it are added, the first one too.
  /// @return Nothing if the way leads out of the body's cubes.
  std::optional<Host> follow(const Host& from, const Vector3& from_W, const Vector3& to_W,
                             std::vector<std::int32_t>& way) const;

  /// All places of a part of the lattice that are at a point of the kerf, those in its material
  /// first.
  std::vector<Host> places_at(const Vector3& p_W, std::int32_t part) const;

  /// Between two places at rest, in cubes; a cut between them counts as some more.
  Scalar distance(const Host& a, const Host& b) const;
  Vector3 rest_place(const Host& host) const { return lattice_.rest_place(host); }

  /// Where a point is in that one of some cubes which it is least outside of.
  /// @return Nothing if it is half a cube outside of all.
  std::optional<Host> host_among(std::span<const std::int32_t> cubes, const Vector3& p_W) const;

  /// @param vertices_W, hosts Of all vertices; hosts in the old cubes.
  LatticePieces divide(std::span<const Vector3> vertices_W, const std::vector<Host>& hosts,
                       std::span<const TriangleIndices> triangles) const;

 private:
  friend class LatticeDivision;

  const CubeShape& shape(std::int32_t cube) const;
  const Samples& domain(std::int32_t cube) const;
  bool takes(const Vector3& p_K) const;
  bool may_hold(std::int32_t cube, const Vector3& p_K, std::int32_t part) const;
  std::set<std::int32_t> cubes_around(std::int32_t cube) const;
  bool are_apart(std::int32_t a, std::int32_t b) const;
  bool lies_between(const Vector3& a_K, const Vector3& b_K) const;
  std::optional<Vector3> place_in(std::int32_t cube, const Vector3& p_K) const;
  std::optional<Host> next_place(const Host& from, const Vector3& p_K,
                                 std::span<const std::int32_t> way) const;
  Scalar distance_to_material(std::int32_t cube, const Vector3& place) const;
  Scalar distance_to_seen(std::int32_t cube, const Vector3& place, const Vector3& p_K) const;

  const TissueLattice& lattice_;
  const NodeVectors& x_;
  RigidPose X_KW_;
  Vector3 half_extents_;
  std::vector<std::vector<std::int32_t>> cubes_at_;  // around each node
  std::vector<AlignedBox> boxes_;     // of all cubes, somewhat larger, in the kerf's frame
  std::vector<std::int32_t> near_;    // cubes that the kerf may touch
  std::vector<std::int32_t> number_;  // of each cube among these; -1
  mutable std::vector<std::unique_ptr<CubeShape>> shapes_;
};

}  // namespace dyop::tissue_internal
