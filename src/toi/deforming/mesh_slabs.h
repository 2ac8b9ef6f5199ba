// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <vector>

#include "dyop/core/export.h"
#include "dyop/toi/deforming_mesh.h"

namespace dyop::toi_internal {

/// For every node of a deforming mesh a slab across the mean normal of its triangles, besides its
/// axis-aligned box. A piece of surface of size l and radius of curvature r is as thick as l if it
/// is inclined to the axes, but only l^2 / (8 r) across its normal.
class DYOP_EXPORT MeshSlabs {
 public:
  MeshSlabs() = default;
  explicit MeshSlabs(const DeformingMesh& mesh) { fit(mesh); }

  /// To be called after every change of the mesh. Linear in its size; allocates only for another
  /// number of nodes.
  void fit(const DeformingMesh& mesh);

  /// Across the slab, unit besides rounding.
  const Vector3& normal(std::int32_t node) const {
    return slabs_[static_cast<std::size_t>(node)].normal;
  }
  /// Upper bound of n.x over the vertices of a node at the fraction s of the mesh's interval,
  /// besides rounding of the few operations here.
  /// @param center, half_extents Of its box then.
  Scalar support(std::int32_t node, Scalar s, const Vector3& n_W, const Vector3& center,
                 const Vector3& half_extents) const {
    const Slab& slab = slabs_[static_cast<std::size_t>(node)];
    const Scalar along = n_W.dot(slab.normal);
    const Scalar begin = along * (along > 0 ? slab.at_begin.highest : slab.at_begin.lowest);
    const Scalar end = along * (along > 0 ? slab.at_end.highest : slab.at_end.lowest);
    const Vector3 across = n_W - along * slab.normal;
    return begin + s * (end - begin) + across.dot(center) + across.cwiseAbs().dot(half_extents);
  }

 private:
  struct Range {
    Scalar lowest = kInfinity;
    Scalar highest = -kInfinity;

    void add(Scalar low, Scalar high) {
      lowest = std::min(lowest, low);
      highest = std::max(highest, high);
    }
  };
  struct Slab {
    Vector3 normal = Vector3::UnitX();
    Range at_begin;
    Range at_end;
  };

  void fit_leaf(const DeformingMesh& mesh, std::size_t node);
  void add_part(const DeformingMesh& mesh, std::size_t part, Slab& slab) const;

  std::vector<Slab> slabs_;
  std::vector<Vector3> areas_;  // of the nodes: twice the sum of their triangles' area vectors
};

}  // namespace dyop::toi_internal
