// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

#include "dyop/core/types.h"
#include "dyop/hierarchy/mesh_hierarchy.h"

namespace dyop::toi_internal {

/// Which pairs of two surfaces A and B matter if B is about to move as expected: every point p of B
/// by v + w x (p - origin), give or take the slack, in which the motion of A is included. A body
/// that slides along a surface so leaves out nearly all that it only passes.
struct ExpectedApproach {
  Scalar least = 0;  ///< a pair matters if it comes as near as this ...
  Scalar reach = 0;  ///< ... and is at most so far apart now; >= least
  Scalar slack = 0;
  Vector3 v_W = Vector3::Zero();
  Vector3 w_W = Vector3::Zero();
  Vector3 origin_W = Vector3::Zero();
  Scalar radius = kInfinity;  ///< no point of B is farther from the origin

  /// A gap along n, unit, from A to B, between anything of A and what is in a box of B: if it is
  /// larger than this, it is more than `least` until the end of the expected motion, or more than
  /// `reach` now.
  ///
  /// The largest of -n.(v + w x r) over the box is at its corners: with m = n x w, which gives
  /// n.(w x r) = m.r, it is -n.v - m.(c - origin) + sum of h_i |m.e_i|.
  Scalar needed_gap(const Vector3& n_W, const OrientedBox& box_W) const {
    const Vector3 m_W = n_W.cross(w_W);
    return needed_gap(-n_W.dot(v_W) - m_W.dot(box_W.center - origin_W) +
                      (box_W.axes.transpose() * m_W).cwiseAbs().dot(box_W.half_extents));
  }
  /// The same for all of B: at least as large, and found sooner. NaN without a radius.
  Scalar needed_gap(const Vector3& n_W) const {
    return needed_gap(-n_W.dot(v_W) + n_W.cross(w_W).norm() * radius);
  }
  /// The same in all directions.
  Scalar largest_needed_gap() const { return needed_gap(v_W.norm() + w_W.norm() * radius); }

 private:
  Scalar needed_gap(Scalar closing) const {
    return std::min(reach, least + slack + std::max(Scalar{0}, closing));
  }
};

}  // namespace dyop::toi_internal
