// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>

#include "dyop/core/types.h"

// The subproblem of GJK: the point of a simplex nearest to the origin.
namespace dyop::distance_internal {

template <typename Real>
using RealVector3 = Eigen::Matrix<Real, 3, 1>;

template <typename Real>
using SimplexPoints = std::array<RealVector3<Real>, 4>;

// A convex combination of the points of a simplex: weights >= 0 that sum to one up to rounding.
template <typename Real>
struct SimplexCombination {
  std::array<Real, 4> weights{0, 0, 0, 0};
  RealVector3<Real> point = RealVector3<Real>::Zero();
  Real norm_sq = std::numeric_limits<Real>::infinity();
};

// Tries sub-simplices one after another and keeps the combination with the smallest norm.
//
// The nearest point lies in the relative interior of exactly one sub-simplex, where it is the
// projection of the origin onto that sub-simplex's affine hull. The projections are computed in
// floating point, but every candidate is compared by the norm of the actual combination: a
// misjudged sign can lose accuracy, never validity. Region tests ([Ericson2005]) and Johnson's
// recursion ([GilbertJohnsonKeerthi1988]) do not have this property on slivers; compare
// [MontanariPetrinicBarbieri2017].
template <typename Real>
class SimplexSolver {
 public:
  using Vector = RealVector3<Real>;

  SimplexSolver(const SimplexPoints<Real>& points, std::size_t count) : w_(points), count_(count) {}

  // All sub-simplices, at most 15.
  SimplexCombination<Real> solve_exhaustively() {
    for (std::size_t i = 0; i < count_; ++i) try_vertex(i);
    for (std::size_t i = 1; i < count_; ++i) try_edges(i);
    for (std::size_t i = 2; i < count_; ++i) try_triangles(i);
    if (count_ == 4) try_tetrahedron();
    return best_;
  }

  // Only sub-simplices that contain the newest point, which has the largest index, and only the
  // simplex itself if the origin projects into it. Gives the same point as above if the newest
  // point made progress and no sign was misjudged; the caller compares norms to find out.
  SimplexCombination<Real> solve_with_newest() {
    const std::size_t newest = count_ - 1;
    if (count_ == 3) try_triangle(2, 1, 0);
    if (count_ == 4) try_tetrahedron();
    if (best_.norm_sq < std::numeric_limits<Real>::infinity()) return best_;
    try_vertex(newest);
    try_edges(newest);
    if (count_ == 4) try_triangles(newest);
    return best_;
  }

  // All sub-simplices of at most three points, but only the largest if the origin projects into it.
  SimplexCombination<Real> solve_from_largest() {
    if (count_ == 2) try_edge(1, 0);
    if (count_ == 3) try_triangle(2, 1, 0);
    if (best_.norm_sq < std::numeric_limits<Real>::infinity()) return best_;
    return solve_exhaustively();
  }

  // Two squared norms that differ by less than this factor are indistinguishable.
  static constexpr Real kTie = 1 + 16 * std::numeric_limits<Real>::epsilon();

 private:
  // Edges and triangles that join `last` to points before it.
  void try_edges(std::size_t last) {
    for (std::size_t i = 0; i < last; ++i) try_edge(last, i);
  }
  void try_triangles(std::size_t last) {
    for (std::size_t i = 1; i < last; ++i) {
      for (std::size_t j = 0; j < i; ++j) try_triangle(last, i, j);
    }
  }

  void try_vertex(std::size_t i) {
    if (!keep_if_nearer(w_[i])) return;
    best_.weights[i] = 1;
  }

  void try_edge(std::size_t i, std::size_t j) {
    const Vector e = w_[j] - w_[i];
    const Real s = -w_[i].dot(e);
    const Real length_sq = e.squaredNorm();
    if (!(s > 0 && s < length_sq)) return;  // a vertex is nearer, or the edge is a point
    const Real weight_j = s / length_sq;
    if (!keep_if_nearer(w_[i] + weight_j * e)) return;
    best_.weights[i] = 1 - weight_j;
    best_.weights[j] = weight_j;
  }

  void try_triangle(std::size_t i, std::size_t j, std::size_t k) {
    // -w_i = weight_j e + weight_k f in the plane, by Cramer's rule along the plane's normal.
    const Vector e = w_[j] - w_[i];
    const Vector f = w_[k] - w_[i];
    const Vector n = e.cross(f);
    const Real area_sq = n.squaredNorm();
    const Real part_j = f.cross(w_[i]).dot(n);
    const Real part_k = w_[i].cross(e).dot(n);
    if (!(part_j > 0 && part_k > 0 && part_j + part_k < area_sq)) return;
    const Real weight_j = part_j / area_sq;
    const Real weight_k = part_k / area_sq;
    if (!keep_if_nearer(w_[i] + weight_j * e + weight_k * f)) return;
    best_.weights[i] = std::max<Real>(0, 1 - weight_j - weight_k);
    best_.weights[j] = weight_j;
    best_.weights[k] = weight_k;
  }

  void try_tetrahedron() {
    const Vector e = w_[0] - w_[3];
    const Vector f = w_[1] - w_[3];
    const Vector g = w_[2] - w_[3];
    const Vector f_cross_g = f.cross(g);
    const Real volume = e.dot(f_cross_g);
    const Vector w_cross_e = w_[3].cross(e);
    const Real weight_0 = -w_[3].dot(f_cross_g) / volume;
    const Real weight_1 = w_cross_e.dot(g) / volume;
    const Real weight_2 = -w_cross_e.dot(f) / volume;
    const Real weight_3 = 1 - weight_0 - weight_1 - weight_2;
    // False for the NaN of a flat tetrahedron; then a face is as near.
    if (!(weight_0 > 0 && weight_1 > 0 && weight_2 > 0 && weight_3 > 0)) return;
    if (!keep_if_nearer(w_[3] + weight_0 * e + weight_1 * f + weight_2 * g)) return;
    best_.weights = {weight_0, weight_1, weight_2, weight_3};
  }

  // Returns true if the point was kept, with all weights zero: the caller must set them.
  bool keep_if_nearer(const Vector& point) {
    // Called in order of dimension. On a tie the larger sub-simplex wins: its point is the same up
    // to rounding, but its normal is right even where v's direction is lost in rounding.
    const Real norm_sq = point.squaredNorm();
    if (!(norm_sq <= best_.norm_sq * kTie)) return false;
    best_.weights = {0, 0, 0, 0};
    best_.point = point;
    best_.norm_sq = norm_sq;
    return true;
  }

  const SimplexPoints<Real>& w_;
  std::size_t count_;
  SimplexCombination<Real> best_;
};

}  // namespace dyop::distance_internal
