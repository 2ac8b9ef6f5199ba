// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/simd.h"
#include "hierarchy/box_gaps.h"

// Finds a direction along which two boxes are far apart, for several boxes at once.
//
// separating_direction() (split_tree.h) finds one for a single pair, and shares no code with
// this: here boxes are columns of a node in single precision, a nearly optimal direction is good
// enough, and a branch stalls all lanes.
namespace dyop::hierarchy_internal {

inline namespace DYOP_LANES {

/// Boxes of a group from column `first` on, one per lane.
template <typename L>
struct BoxLanes {
  L center[3];
  L axes[3][3];
  L half_extents[3];

  DYOP_INLINE BoxLanes(const GroupRows& group, int first) {
    const auto& rows = group.rows;
    const L scale(group.scale);
    for (int i = 0; i < 3; ++i) {
      center[i] = L(group.origin[i]) + scale * L::load(rows[i] + first);
      for (int k = 0; k < 3; ++k) axes[k][i] = L::load(rows[kGroupAxes + 3 * k + i] + first);
      half_extents[i] = scale * L::load(rows[kGroupHalfExtents + i] + first);
    }
  }
};

template <typename L>
struct Broadcast3 {
  L v[3];
  DYOP_INLINE explicit Broadcast3(const double* x) : v{L(x[0]), L(x[1]), L(x[2])} {}
};

/// The axis with the largest normalised gap so far: gap^2 / length_sq, axis not of unit length.
template <typename L>
struct BestAxis {
  L gap_sq;
  L length_sq;
  L axis[3];

  template <typename Mask>
  DYOP_INLINE void take(Mask is_better, L new_gap_sq, L new_length_sq, L x, L y, L z) {
    gap_sq = select(is_better, new_gap_sq, gap_sq);
    length_sq = select(is_better, new_length_sq, length_sq);
    axis[0] = select(is_better, x, axis[0]);
    axis[1] = select(is_better, y, axis[1]);
    axis[2] = select(is_better, z, axis[2]);
  }
};

/// The nine axes across an edge of either box. r, abs_r, t, h, g as in find_axis().
template <typename L>
DYOP_INLINE void take_edges(const L (*r)[3], const L (*abs_r)[3], const L* t, const L* h,
                            const L* g, BestAxis<L>& best) {
  const L zero(0);
  // literal: squared sine below which edges are parallel and add nothing to the faces.
  const L smallest_sine_sq(1e-6f);
  for (int i = 0; i < 3; ++i) {
    const int i1 = (i + 1) % 3;
    const int i2 = (i + 2) % 3;
    for (int j = 0; j < 3; ++j) {
      const int j1 = (j + 1) % 3;
      const int j2 = (j + 2) % 3;
      const L length_sq = r[i1][j] * r[i1][j] + r[i2][j] * r[i2][j];
      const L along = t[i2] * r[i1][j] - t[i1] * r[i2][j];
      const L gap = ((magnitude(along) - h[i1] * abs_r[i2][j]) - h[i2] * abs_r[i1][j]) -
                    (g[j1] * abs_r[i][j2] + g[j2] * abs_r[i][j1]);
      const L gap_sq = gap * gap;
      const auto is_better = (gap > zero) & (length_sq > smallest_sine_sq) &
                             (gap_sq * best.length_sq > best.gap_sq * length_sq);
      const L x = flip_sign(zero - r[i2][j], along);
      const L y = flip_sign(r[i1][j], along);
      best.take(is_better, gap_sq, length_sq, i == 0 ? zero : (i1 == 0 ? x : y),
                i == 1 ? zero : (i1 == 1 ? x : y), i == 2 ? zero : (i1 == 2 ? x : y));
    }
  }
}

/// How far a coordinate lies beyond [-half, half].
template <typename L>
DYOP_INLINE L beyond(L x, L half) {
  return flip_sign(larger(magnitude(x) - half, L(0)), x);
}

/// An axis n in the box's frame. r, t, h, g as in find_axis().
template <typename L>
DYOP_INLINE void take_axis(const L* n, const L (*r)[3], const L* t, const L* h, const L* g,
                           BestAxis<L>& best) {
  L gap = dot(t, n);
  for (int j = 0; j < 3; ++j) {
    const L along = (r[0][j] * n[0] + r[1][j] * n[1]) + r[2][j] * n[2];
    gap = gap - (h[j] * magnitude(n[j]) + g[j] * magnitude(along));
  }
  const L length_sq = dot(n, n);
  const L gap_sq = gap * gap;
  // literal: squares above it have full precision.
  const auto is_better = (gap > L(0)) & (length_sq > L(0x1p-100f)) &
                         (gap_sq * best.length_sq > best.gap_sq * length_sq);
  best.take(is_better, gap_sq, length_sq, n[0], n[1], n[2]);
}

/// The directions from the middle of either box to the nearest point of the other, which are exact
/// for a point, and nearly so for a segment and a small box. t_other as in find_axis().
template <typename L>
DYOP_INLINE void take_nearest(const L (*r)[3], const L* t, const L* t_other, const L* h, const L* g,
                              BestAxis<L>& best) {
  L n[3];
  for (int i = 0; i < 3; ++i) n[i] = beyond(t[i], h[i]);
  take_axis(n, r, t, h, g, best);
  for (int i = 0; i < 3; ++i) {
    n[i] = (r[i][0] * beyond(t_other[0], g[0]) + r[i][1] * beyond(t_other[1], g[1])) +
           r[i][2] * beyond(t_other[2], g[2]);
  }
  take_axis(n, r, t, h, g, best);
}

/// What find_axes() needs to know about the other box, in single precision and in a unit close to
/// the largest length involved, so that products of four lengths do not overflow, nor matter where
/// they underflow.
struct RankingBox {
  float center[3];  ///< from the group's origin
  float axes[3][3];
  float half_extents[3];
  float scale;  ///< unit of the group's rows
  bool is_of_cores;

  DYOP_INLINE RankingBox(const FacingBox& other, const GroupRows& group)
      : is_of_cores(other.is_of_cores) {
    double unit = group.scale;
    double from_origin[3];
    for (int i = 0; i < 3; ++i) {
      from_origin[i] = other.center[i] - group.origin[i];
      const double reach = __builtin_fabs(from_origin[i]) + 2 * other.half_extents[i];
      unit = reach > unit ? reach : unit;
    }
    for (int i = 0; i < 3; ++i) {
      center[i] = static_cast<float>(from_origin[i] / unit);
      half_extents[i] = static_cast<float>(other.half_extents[i] / unit);
      for (int k = 0; k < 3; ++k) axes[k][i] = static_cast<float>(other.axes[k][i]);
    }
    scale = static_cast<float>(group.scale / unit);
  }
};

/// Finds the axis, from the group's box to `other`, along which their slabs are farthest apart,
/// among the fifteen axes of the separating axis test [Gottschalk1996] and the line of centers;
/// optionally without the nine from pairs of edges. Not of unit length; some axis if none separates
/// the boxes. Only ranks: a caller must evaluate the gap along the axis itself. F holds single
/// precision.
template <bool kWithEdges, typename F>
DYOP_INLINE void find_axis(const GroupRows& group, int first, const RankingBox& other,
                           float (*axis)[kGroupWidth]) {
  const F zero(0);
  const F one(1);
  const F scale(other.scale);
  const auto& rows = group.rows;
  // Everything in the box's own frame: r[i][j] = axis i of the box . axis j of the other.
  F u[3][3];
  F h[3];
  F g[3];
  F r[3][3];
  F abs_r[3][3];
  F t[3];
  F t_other[3];
  F d[3];
  for (int i = 0; i < 3; ++i) {
    d[i] = F(other.center[i]) - scale * F::load(rows[i] + first);
    for (int k = 0; k < 3; ++k) u[k][i] = F::load(rows[kGroupAxes + 3 * k + i] + first);
    h[i] = scale * F::load(rows[kGroupHalfExtents + i] + first);
    g[i] = F(other.half_extents[i]);
  }
  for (int j = 0; j < 3; ++j) {
    const F other_axis[3] = {F(other.axes[j][0]), F(other.axes[j][1]), F(other.axes[j][2])};
    t_other[j] = dot(other_axis, d);
    for (int i = 0; i < 3; ++i) {
      r[i][j] = dot(u[i], other_axis);
      abs_r[i][j] = magnitude(r[i][j]);
    }
  }
  for (int i = 0; i < 3; ++i) t[i] = dot(u[i], d);

  // Faces first, comparing gaps directly.
  F best_gap = magnitude(t[0]) - h[0] - dot(abs_r[0], g);
  BestAxis<F> best{zero, one, {flip_sign(one, t[0]), zero, zero}};
  for (int i = 1; i < 3; ++i) {
    const F gap = magnitude(t[i]) - h[i] - dot(abs_r[i], g);
    const auto is_better = gap > best_gap;
    best_gap = select(is_better, gap, best_gap);
    const F sign = flip_sign(one, t[i]);
    best.take(is_better, zero, one, zero, i == 1 ? sign : zero, i == 2 ? sign : zero);
  }
  for (int j = 0; j < 3; ++j) {
    const F gap = magnitude(t_other[j]) - g[j] -
                  ((abs_r[0][j] * h[0] + abs_r[1][j] * h[1]) + abs_r[2][j] * h[2]);
    const auto is_better = gap > best_gap;
    best_gap = select(is_better, gap, best_gap);
    best.take(is_better, zero, one, flip_sign(r[0][j], t_other[j]), flip_sign(r[1][j], t_other[j]),
              flip_sign(r[2][j], t_other[j]));
  }
  const F positive = larger(best_gap, zero);
  best.gap_sq = positive * positive;

  // From here on squares of positive gaps are compared.
  F size = zero;
  for (int i = 0; i < 3; ++i) {
    size = size + (h[i] * magnitude(t[i]) + g[i] * magnitude(t_other[i]));
  }
  const F length_sq = dot(t, t);
  const F gap = length_sq - size;
  const F gap_sq = gap * gap;
  // literal: squares above it have full precision.
  const auto is_better = (gap > zero) & (length_sq > F(0x1p-100f)) &
                         (gap_sq * best.length_sq > best.gap_sq * length_sq);
  best.take(is_better, gap_sq, length_sq, t[0], t[1], t[2]);
  if (other.is_of_cores) take_nearest(r, t, t_other, h, g, best);
  if constexpr (kWithEdges) take_edges(r, abs_r, t, h, g, best);
  for (int i = 0; i < 3; ++i) {
    ((u[0][i] * best.axis[0] + u[1][i] * best.axis[1]) + u[2][i] * best.axis[2])
        .store(axis[i] + first);
  }
}

/// The axes for `count` boxes of a group.
DYOP_INLINE void find_axes(const GroupRows& group, int count, const RankingBox& other,
                           float (*axes)[kGroupWidth]) {
  for (int first = 0; first < count; first += FloatLanes::kCount) {
    find_axis<true, FloatLanes>(group, first, other, axes);
  }
}

/// The unit vector along an axis, up to 8u.
template <typename L>
DYOP_INLINE void unit_axis(const float (*axes)[kGroupWidth], int first, L* n) {
  for (int i = 0; i < 3; ++i) n[i] = L::load(axes[i] + first);
  const L scale = L(1) / sqrt(dot(n, n));
  for (int i = 0; i < 3; ++i) n[i] = n[i] * scale;
}

}  // namespace DYOP_LANES
}  // namespace dyop::hierarchy_internal
