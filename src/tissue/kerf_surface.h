// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "dyop/tissue/soft_tissue.h"
#include "tissue/tissue_lattice.h"

namespace dyop::tissue_internal {

/// A closed surface and the parts that its vertices belong to: parts may overlap each other.
struct SurfaceParts {
  std::span<const Vector3> vertices_W;
  std::span<const TriangleIndices> triangles;
  std::span<const std::int32_t> part_of_vertex;
};

/// Tells places of a body apart that lie over each other.
class BodySheets {
 public:
  virtual ~BodySheets() = default;
  /// Where a point of a triangle is in the body.
  virtual std::optional<Host> on_surface(std::int32_t triangle, const Vector3& p_W) const = 0;
  /// All places of a part at a point, those that are surely inside first.
  virtual std::vector<Host> inside(std::int32_t part, const Vector3& p_W) const = 0;
  /// How far from `to` one comes when going straight from `from`, through the body; infinite: one
  /// does not arrive.
  virtual Scalar miss(const Host& from, const Vector3& from_W, const Host& to,
                      const Vector3& to_W) const = 0;
};

/// A surface out of which a kerf was taken.
struct KerfSurface {
  CutStatus status = CutStatus::NotRun;
  /// Vertices keep their numbers; the added ones follow. Some may be used by no triangle.
  std::vector<TriangleIndices> triangles;
  std::vector<Vector3> added_W;
  std::vector<std::int32_t> parts;    ///< of the added vertices
  std::vector<std::int32_t> sources;  ///< the old triangle on which it lies; -1: inside
  std::vector<Vector3> away_W;        ///< from the kerf, a unit vector: the body is there
};

/// Returns the surface of the body less the kerf, with the kerf's walls inside the body as caps. By
/// construction it is closed if the old one was: neighbours share the vertex of an edge and a plane
/// of the kerf, and the vertex of a triangle and an edge of the kerf.
///
/// What lies in a plane of the kerf to rounding is decided by a kerf that is larger by some 1e-9.
/// @param spacing Largest distance of the caps' points, > 0.
/// @param sheets  Asked where the body lies over itself; none: what begins first ends first.
KerfSurface take_kerf(const SurfaceParts& surface, const TissueKerf& kerf, Scalar spacing,
                      const BodySheets* sheets = nullptr);

}  // namespace dyop::tissue_internal
