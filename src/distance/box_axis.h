#pragma once

#include "core/lanes.h"
#include "distance/facing_box.h"

// A direction along which two boxes are far apart, for several boxes at once.
namespace dyop::internal {

inline namespace DYOP_LANES {

/// Boxes of a group from column `first` on, one a lane.
template <typename L>
struct BoxLanes {
  L center[3];
  L axes[3][3];
  L half_extents[3];

  DYOP_INLINE BoxLanes(const GroupRows& group, int first) {
    const auto& rows = group.rows;
    const L scale(group.scale);
    for (int i = 0; i < 3; ++i) {
      center[i] = scale * L::load(rows[i] + first);
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

/// The axis of the largest normalised gap so far: gap^2 / length_sq, axis not of unit length.
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
  const L zero(0.0);
  // literal: squared sine below which edges are parallel and say nothing the faces do not.
  const L smallest_sine_sq(1e-6);
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
      const L x = turned(zero - r[i2][j], along);
      const L y = turned(r[i1][j], along);
      best.take(is_better, gap_sq, length_sq, i == 0 ? zero : (i1 == 0 ? x : y),
                i == 1 ? zero : (i1 == 1 ? x : y), i == 2 ? zero : (i1 == 2 ? x : y));
    }
  }
}

/// Finds the direction n, from the group's box to `other`, along which their slabs are farthest
/// apart, among the fifteen axes of the separating axis test [Gottschalk1996] and the line of
/// centers; without the nine of pairs of edges on request. If the boxes are not apart along any, n
/// is some unit vector. Only ranks: a caller must evaluate the gap along n itself, so nothing here
/// needs to be rigorous but |n| = 1 up to 32u.
template <bool kWithEdges, typename L>
DYOP_INLINE void find_axis(const BoxLanes<L>& box, const FacingBox& other, L* n) {
  const L zero(0.0);
  const L one(1.0);
  // Everything in the box's own frame: r[i][j] = axis i of the box . axis j of the other.
  L r[3][3];
  L abs_r[3][3];
  L t[3];
  L t_other[3];
  L d[3];
  for (int i = 0; i < 3; ++i) d[i] = L(other.center[i]) - box.center[i];
  for (int j = 0; j < 3; ++j) {
    const Broadcast3<L> axis(other.axes[j]);
    t_other[j] = dot(axis.v, d);
    for (int i = 0; i < 3; ++i) {
      r[i][j] = dot(box.axes[i], axis.v);
      abs_r[i][j] = magnitude(r[i][j]);
    }
  }
  for (int i = 0; i < 3; ++i) t[i] = dot(box.axes[i], d);
  const L* h = box.half_extents;
  const Broadcast3<L> other_h(other.half_extents);
  const L* g = other_h.v;

  // Faces first; the largest gap of them by plain comparison.
  L best_gap = magnitude(t[0]) - h[0] - dot(abs_r[0], g);
  BestAxis<L> best{zero, one, {turned(one, t[0]), zero, zero}};
  for (int i = 1; i < 3; ++i) {
    const L gap = magnitude(t[i]) - h[i] - dot(abs_r[i], g);
    const auto is_better = gap > best_gap;
    best_gap = select(is_better, gap, best_gap);
    const L sign = turned(one, t[i]);
    best.take(is_better, zero, one, zero, i == 1 ? sign : zero, i == 2 ? sign : zero);
  }
  for (int j = 0; j < 3; ++j) {
    const L gap = magnitude(t_other[j]) - g[j] -
                  ((abs_r[0][j] * h[0] + abs_r[1][j] * h[1]) + abs_r[2][j] * h[2]);
    const auto is_better = gap > best_gap;
    best_gap = select(is_better, gap, best_gap);
    best.take(is_better, zero, one, turned(r[0][j], t_other[j]), turned(r[1][j], t_other[j]),
              turned(r[2][j], t_other[j]));
  }
  const L positive = larger(best_gap, zero);
  best.gap_sq = positive * positive;

  // From here on squares are compared, of positive gaps only.
  {
    L size = zero;
    for (int i = 0; i < 3; ++i)
      size = size + (h[i] * magnitude(t[i]) + g[i] * magnitude(t_other[i]));
    const L length_sq = dot(t, t);
    const L gap = length_sq - size;
    const L gap_sq = gap * gap;
    // literal: squares above it have all their digits.
    const auto is_better = (gap > zero) & (length_sq > L(0x1p-960)) &
                           (gap_sq * best.length_sq > best.gap_sq * length_sq);
    best.take(is_better, gap_sq, length_sq, t[0], t[1], t[2]);
  }
  if constexpr (kWithEdges) take_edges(r, abs_r, t, h, g, best);
  for (int i = 0; i < 3; ++i) {
    n[i] = (box.axes[0][i] * best.axis[0] + box.axes[1][i] * best.axis[1]) +
           box.axes[2][i] * best.axis[2];
  }
  // Axes have unit length in single precision only.
  const L scale = one / root(dot(n, n));
  for (int i = 0; i < 3; ++i) n[i] = n[i] * scale;
}

}  // namespace DYOP_LANES
}  // namespace dyop::internal
