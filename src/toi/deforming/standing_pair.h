// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <functional>
#include <optional>
#include <vector>

#include "dyop/core/export.h"
#include "dyop/core/types.h"
#include "dyop/motion/motion.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/deforming_mesh.h"
#include "toi/deforming/deforming_sides.h"
#include "toi/deforming/deforming_traversal.h"

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

/// A deforming mesh A at a fraction of its interval and a rigid mesh B, where they stand.
struct DYOP_EXPORT StandingPair {
  /// @param slabs_of_a Null: bounds are from boxes alone.
  StandingPair(const DeformingMesh& mesh_a, Scalar s, const TriangleMesh& mesh_b,
               const RigidPose& X_WB, const MeshSlabs* slabs_of_a = nullptr);
  StandingPair(const StandingPair&) = delete;
  StandingPair& operator=(const StandingPair&) = delete;

  /// Lower bounds of the distance of two boxes, or of two leaves' triangles: their gap along n,
  /// unit, from A to B.
  Scalar box_gap(std::int32_t box_a, std::int32_t box_b, const Vector3& n_W) const {
    return -b.box_reach(box_b, -n_W) - reach_of_a(box_a, n_W) - noise;
  }
  Scalar triangle_gap(std::int32_t leaf_a, std::int32_t leaf_b, const Vector3& n_W) const {
    return -b.triangle_reach(leaf_b, -n_W) - largest_along(a.triangle_W(leaf_a), n_W) - noise;
  }

  /// Whether all triangles are farther apart than this; nothing if is_over(), which is asked before
  /// every pair of boxes, says so first.
  std::optional<bool> is_apart_by(Scalar least, const std::function<bool()>& is_over,
                                  BoxPairStack& stack) const;

  /// Across the slab of a node of A, to the side of a box of B. Only with slabs.
  Vector3 slab_direction(std::int32_t box_a, std::int32_t box_b) const {
    const Vector3& n_W = slabs->normal(box_a);
    const bool is_towards_b = n_W.dot(b.box_W(box_b).center - a.box_W(box_a).center) >= 0;
    return is_towards_b ? n_W : Vector3(-n_W);
  }
  /// Upper bound of n.x over a node of A.
  Scalar reach_of_a(std::int32_t node, const Vector3& n_W) const {
    const OrientedBox box_W = a.box_W(node);
    const Scalar of_box = n_W.dot(box_W.center) + n_W.cwiseAbs().dot(box_W.half_extents);
    if (!slabs) return of_box;
    return std::min(of_box, slabs->support(node, fraction, n_W, box_W.center, box_W.half_extents));
  }

  RestMotion X_WB_motion;
  DeformingSide a;
  RigidSide b;
  Scalar fraction;  ///< of A's interval
  const MeshSlabs* slabs;
  Scalar noise;  ///< rounding allowance of a gap
};

/// Proves that triangles of a deforming mesh A and a moving rigid mesh B stay apart along one fixed
/// direction, over a whole short interval [0, T], from their places at its two ends.
///
/// Points of A move on straight lines; a point of B at the distance r from its origin leaves its
/// chord by at most T^2 / 8 (sup |dv/dt| + r sup |dw/dt| + r sup |w|^2). So the gap along n of two
/// triangles is, at every time, at least the smaller one of its values at the ends, minus that.
class DYOP_EXPORT ChordGap {
 public:
  /// @param span The part of A's interval during [0, duration].
  ChordGap(const DeformingMesh& a, const DeformingSpan& span, const TriangleMesh& b,
           const Motion& X_WB, Scalar duration);

  /// Lower bound of the gap of two triangles along n, unit, from A to B; rounding included.
  Scalar least(std::int32_t triangle_a, std::int32_t triangle_b, const Vector3& n_W) const;
  /// The same for two boxes, from where they stand at the two ends.
  Scalar least_of_boxes(const StandingPair& begin, const StandingPair& end, std::int32_t box_a,
                        std::int32_t box_b, const Vector3& n_W) const;

 private:
  // How far a point at this distance from the origin leaves its chord.
  Scalar bend(Scalar radius) const;

  const DeformingMesh& a_;
  const DeformingSpan span_;
  const TriangleMesh& b_;
  RigidPose X_WB_begin_;
  RigidPose X_WB_end_;
  // How far a point leaves its chord: a constant plus a multiple of its distance from the origin.
  Scalar bend_;
  Scalar bend_per_length_;
  Scalar noise_;
};

}  // namespace dyop::toi_internal
