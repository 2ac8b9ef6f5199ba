// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/distance/gjk.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "core/tolerance.h"
#include "distance/core_distance.h"
#include "distance/gjk/warm_gjk.h"
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

// GJK on the Minkowski difference B - A of the cores, in frame A. A point of the difference is
// w = p_ACb - p_ACa; the point v nearest to the origin is the shortest vector from A to B.
namespace dyop {
namespace {

using distance_internal::GjkGoal;
using distance_internal::GjkSeed;
using distance_internal::RealVector3;
using distance_internal::SimplexCombination;
using distance_internal::SimplexPoints;
using distance_internal::SimplexSolver;

// Whether a squared norm neither overflowed nor underflowed.
template <typename Real>
bool is_safe_square(Real norm_sq) {
  // literal: properties of the number format; the squares of the components are normal numbers.
  return norm_sq > static_cast<Real>(1e-200) && norm_sq < static_cast<Real>(1e200);
}

// One support query: a point of each core, each in the frame of its own shape, so exact.
struct CorePair {
  SupportPoint a;
  SupportPoint b;

  bool is_smooth() const { return !a.vertex || !b.vertex; }
};

bool is_same_point(const SupportPoint& p, const SupportPoint& q) {
  return p.vertex ? p.vertex == q.vertex : p.point == q.point;
}

template <typename Real>
RealVector3<Real> transform(const RigidPose& X_AB, const Vector3& p_B) {
  return X_AB.rotation().cast<Real>() * p_B.cast<Real>() + X_AB.translation().cast<Real>();
}

// Norm and direction without overflow or underflow. The size is a sum because a sum keeps NaN,
// which a maximum may lose.
template <typename Real>
Real scaled_norm(const RealVector3<Real>& v) {
  const Real norm_sq = v.squaredNorm();
  if (is_safe_square(norm_sq)) return std::sqrt(norm_sq);
  const Real size = v.cwiseAbs().sum();
  return size > 0 ? size * (v / size).norm() : size;
}

template <typename Real>
Vector3 unit_vector(const RealVector3<Real>& v, const Vector3& fallback) {
  const Real norm_sq = v.squaredNorm();
  if (is_safe_square(norm_sq)) {
    return (v / std::sqrt(norm_sq)).template cast<Scalar>();
  }
  const Real size = v.cwiseAbs().sum();
  if (!(size > 0)) return fallback;
  return (v / size).normalized().template cast<Scalar>();
}

enum class Progress { None, Tie, Nearer };

// A convex combination of points of B - A. The first `count` support points are in use.
template <typename Real>
struct Simplex {
  std::array<CorePair, 4> pairs;
  SimplexPoints<Real> points;
  std::size_t count = 0;
  SimplexCombination<Real> nearest;

  bool contains(const CorePair& pair) const {
    for (std::size_t i = 0; i < count; ++i) {
      if (is_same_point(pairs[i].a, pair.a) && is_same_point(pairs[i].b, pair.b)) return true;
    }
    return false;
  }

  void drop_unused() {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (!(nearest.weights[i] > 0)) continue;
      pairs[kept] = pairs[i];
      points[kept] = points[i];
      nearest.weights[kept] = nearest.weights[i];
      ++kept;
    }
    std::fill(nearest.weights.begin() + static_cast<std::ptrdiff_t>(kept), nearest.weights.end(),
              Real(0));
    count = kept;
  }

  // Adds a point. Changes nothing unless the nearest point comes closer, or stays as near up to
  // rounding: a tie may still improve the normal.
  Progress add(const CorePair& pair, const RealVector3<Real>& point) {
    if (count == 4) return Progress::None;
    pairs[count] = pair;
    points[count] = point;
    SimplexCombination<Real> next = SimplexSolver<Real>(points, count + 1).solve_with_newest();
    if (!(next.norm_sq < nearest.norm_sq)) {
      next = SimplexSolver<Real>(points, count + 1).solve_exhaustively();
    }
    if (!std::isfinite(next.norm_sq)) return Progress::None;
    const bool is_tie = !(next.norm_sq < nearest.norm_sq);
    if (is_tie && !(next.norm_sq <= nearest.norm_sq * SimplexSolver<Real>::kTie)) {
      return Progress::None;
    }
    nearest = next;
    ++count;
    drop_unused();
    return is_tie ? Progress::Tie : Progress::Nearer;
  }
};

// The normal of a triangle simplex, pointing away from the origin; zero if v itself is more
// accurate.
template <typename Real>
RealVector3<Real> plane_direction(const Simplex<Real>& simplex) {
  const auto& w = simplex.points;
  const std::array<RealVector3<Real>, 3> edges{w[2] - w[1], w[0] - w[2], w[1] - w[0]};
  const std::array<Real, 3> lengths_sq{edges[0].squaredNorm(), edges[1].squaredNorm(),
                                       edges[2].squaredNorm()};
  const auto longest = std::max_element(lengths_sq.begin(), lengths_sq.end());
  const auto i = static_cast<std::size_t>(longest - lengths_sq.begin());
  // The two shorter edges give the normal of a sliver with the least rounding.
  const RealVector3<Real> n = edges[(i + 1) % 3].cross(edges[(i + 2) % 3]);
  const Real height_sq = n.squaredNorm() / *longest;
  if (!(height_sq > simplex.nearest.norm_sq)) return RealVector3<Real>::Zero();
  return n.dot(simplex.nearest.point) >= 0 ? n : RealVector3<Real>(-n);
}

// The direction of v, or a more accurate one from the features: rounding turns v by about noise /
// |v|, the normal of a triangle by noise / height and an edge by noise / length. Near contact v
// alone would end the iteration far from full accuracy.
template <typename Real>
Vector3 search_direction(const Simplex<Real>& simplex, const Vector3& previous) {
  RealVector3<Real> d = simplex.nearest.point;
  if (simplex.count == 3) {
    const RealVector3<Real> n = plane_direction(simplex);
    if (n.cwiseAbs().maxCoeff() > 0) d = n;
  } else if (simplex.count == 2) {
    const RealVector3<Real> e = simplex.points[1] - simplex.points[0];
    const Real length_sq = e.squaredNorm();
    if (length_sq > simplex.nearest.norm_sq) d -= e * (e.dot(d) / length_sq);
  }
  return unit_vector(d, previous);
}

// The state of one query: the bounds on the distance of the cores, and what bounds rounding.
class GjkQuery {
 public:
  GjkQuery(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB, const GjkGoal& goal)
      : a_(a),
        b_(b),
        X_AB_(X_AB),
        goal_(goal),
        radius_a_(a.rounding_radius()),
        radius_b_(b.rounding_radius()),
        scale_(distance_internal::length_for_noise(X_AB.translation()) + a.bounding_radius() +
               b.bounding_radius()) {}

  GjkResult run(GjkSeed& seed) {
    Simplex<Scalar> simplex;
    if (!start_from(seed, simplex) && !start(simplex)) {
      return {};  // NaN from a support function: nothing is known
    }
    const bool is_done = iterate(simplex);
    keep(simplex, seed);
    return is_done ? result(simplex) : run_in_wide_arithmetic(simplex);
  }

 private:
  bool start(Simplex<Scalar>& simplex) {
    simplex.count = 0;
    simplex.nearest = {};
    best_normal_ =
        unit_vector<Scalar>(X_AB_ * b_.core_center() - a_.core_center(), Vector3::UnitX());
    const CorePair first = find_support(best_normal_);
    const Vector3 w = difference<Scalar>(first);
    best_gap_ = best_normal_.dot(w);
    return simplex.add(first, w) != Progress::None;
  }

  // Do not seed from coincident points: they define no direction.
  bool start_from(const GjkSeed& seed, Simplex<Scalar>& simplex) {
    if (seed.count == 0) return false;
    for (std::size_t i = 0; i < seed.count; ++i) {
      simplex.pairs[i] = {seed.a[i], seed.b[i]};
      simplex.points[i] = difference<Scalar>(simplex.pairs[i]);
    }
    simplex.count = seed.count;
    simplex.nearest = SimplexSolver<Scalar>(simplex.points, seed.count).solve_from_largest();
    if (!std::isfinite(simplex.nearest.norm_sq)) return false;
    if (touches(scaled_norm(simplex.nearest.point))) return false;
    simplex.drop_unused();
    return true;
  }

  // Keeps at most three points: one of an overlap's tetrahedron is left out.
  static void keep(const Simplex<Scalar>& simplex, GjkSeed& seed) {
    seed.count = std::min(simplex.count, seed.a.size());
    for (std::size_t i = 0; i < seed.count; ++i) {
      seed.a[i] = simplex.pairs[i].a;
      seed.b[i] = simplex.pairs[i].b;
    }
  }

  // Rounding stopped the iteration early: continues with the same simplex in long double.
  GjkResult run_in_wide_arithmetic(const Simplex<Scalar>& start) {
    Simplex<long double> simplex;
    simplex.pairs = start.pairs;
    simplex.count = start.count;
    for (std::size_t i = 0; i < start.count; ++i) {
      simplex.points[i] = difference<long double>(start.pairs[i]);
    }
    simplex.nearest =
        SimplexSolver<long double>(simplex.points, simplex.count).solve_exhaustively();
    simplex.drop_unused();
    iterate(simplex);
    return result(simplex);
  }

  CorePair find_support(const Vector3& nhat_A) const {
    return {a_.core_support(nhat_A), b_.core_support(-(X_AB_.rotation().transpose() * nhat_A))};
  }

  template <typename Real>
  RealVector3<Real> difference(const CorePair& pair) const {
    return transform<Real>(X_AB_, pair.b.point) - pair.a.point.cast<Real>();
  }

  // Errors of the two bounds in multiples of u S, S the scale, first order ([Higham2002], chapters 2
  // and 3):                                                                     lower  upper
  //   transforming a point of B by the pose (gamma_4 per coordinate, below 8u in norm)  8   8
  //   R_AB orthonormal only to rounding (the exact pose has the nearest rotation)       8   8
  //   direction transformed to B with error below 6u: another point is chosen, at most
  //       2 R_b times that lower                                                       12
  //   support functions exact to 8u |n| R each (promise in convex_shape.h)              8
  //   p_ACb - p_ACa, the scalar product, unit length of n to 5u                         9
  //   weights and the two combinations                                                      8
  //   difference, norm                                                                      4
  //   subtracting r and noise                                                           3   3
  //   sum                                                                              48  31
  // 64 leaves slack for the square root and the sums in S.
  // literal: more than all underflow, for shapes as small as the smallest numbers.
  Scalar noise() const { return kPoseNoise * scale_ + 0x1p-1064; }

  // Within half of what result() calls touching, so that its own rounding cannot contradict this.
  bool touches(Scalar norm) const { return norm <= noise() / 2; }

  // Whether the bounds that result() would give suffice, if v has this length.
  bool is_enough(Scalar norm) {
    const Scalar radii = radius_a_ + radius_b_;
    const Scalar lower = best_gap_ - radii - noise();
    const Scalar upper = norm - radii + noise();
    is_goal_met_ = (lower > goal_.apart && upper - lower <= goal_.share * (lower - goal_.apart)) ||
                   upper < goal_.hit || upper - lower <= goal_.slack;
    return is_goal_met_;
  }

  // Narrows the bounds; returns true once they meet or the cores are found to touch.
  template <typename Real>
  bool iterate(Simplex<Real>& simplex) {
    int ties = 0;
    for (int i = 0; i < kGjkIterationLimit; ++i) {
      const auto norm = static_cast<Scalar>(scaled_norm(simplex.nearest.point));
      if (touches(norm)) return true;
      const Vector3 nhat_A = search_direction(simplex, best_normal_);
      const CorePair pair = find_support(nhat_A);
      const RealVector3<Real> w = difference<Real>(pair);
      ++iterations_;
      const auto gap = static_cast<Scalar>(nhat_A.template cast<Real>().dot(w));
      if (gap > best_gap_) {
        best_gap_ = gap;
        best_normal_ = nhat_A;
      }
      const Scalar target =
          kGjkStopNoise * scale_ + (pair.is_smooth() ? kGjkSmoothConvergence * norm : 0);
      if (norm - best_gap_ <= target || is_enough(norm)) return true;
      if (simplex.contains(pair)) return false;
      const Progress progress = simplex.add(pair, w);
      if (progress == Progress::Tie) ++ties;
      if (progress == Progress::None || ties > kGjkTieLimit) return false;
    }
    return false;
  }

  template <typename Real>
  GjkResult result(const Simplex<Real>& simplex) const;

  const ConvexShape& a_;
  const ConvexShape& b_;
  const RigidPose& X_AB_;
  const GjkGoal& goal_;
  Scalar radius_a_;
  Scalar radius_b_;
  Scalar scale_;  // size of all numbers in the query, length
  Vector3 best_normal_ = Vector3::UnitX();
  Scalar best_gap_ = -kInfinity;  // slab gap of the cores along best_normal_, not yet rounded down
  int iterations_ = 0;
  bool is_goal_met_ = false;
};

// The feature of one core spanned by the given support points; of four vertices, which occur only
// in the tetrahedron of an overlap, the first three.
Feature spanned_feature(const std::array<CorePair, 4>& pairs, std::size_t count,
                        SupportPoint CorePair::*side) {
  Feature feature;
  std::size_t distinct = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (!(pairs[i].*side).vertex) return {};
    const std::int32_t vertex = *(pairs[i].*side).vertex;
    auto& vertices = feature.vertices;
    bool is_known = distinct == 3;
    for (std::size_t k = 0; k < distinct; ++k) is_known |= vertices[k] == vertex;
    if (is_known) continue;
    std::size_t at = distinct++;
    for (; at > 0 && vertices[at - 1] > vertex; --at) vertices[at] = vertices[at - 1];
    vertices[at] = vertex;
  }
  constexpr std::array kKinds{FeatureKind::Smooth, FeatureKind::Vertex, FeatureKind::Edge,
                              FeatureKind::Face};
  feature.kind = kKinds[distinct];
  return feature;
}

template <typename Real>
GjkResult GjkQuery::result(const Simplex<Real>& simplex) const {
  GjkResult result;
  result.iterations = iterations_;
  result.nhat_AB = best_normal_;
  if (!is_goal_met_) {
    result.feature_a = spanned_feature(simplex.pairs, simplex.count, &CorePair::a);
    result.feature_b = spanned_feature(simplex.pairs, simplex.count, &CorePair::b);
  }

  RealVector3<Real> core_a = RealVector3<Real>::Zero();
  RealVector3<Real> core_b = RealVector3<Real>::Zero();
  for (std::size_t i = 0; i < simplex.count; ++i) {
    const Real weight = simplex.nearest.weights[i];
    core_a += weight * simplex.pairs[i].a.point.template cast<Real>();
    core_b += weight * transform<Real>(X_AB_, simplex.pairs[i].b.point);
  }
  const Scalar radii = radius_a_ + radius_b_;
  const RealVector3<Real> v = core_b - core_a;
  const auto core_upper = static_cast<Scalar>(scaled_norm(v));
  if (!std::isfinite(core_upper)) return result;  // nothing is known: lower 0, upper infinite

  // Every comparison below is false for NaN, which leaves lower at 0 and is_overlapping false.
  const Scalar lower = best_gap_ - radii - noise();
  if (lower > 0) result.lower = lower;
  result.upper = std::max(Scalar(0), core_upper - radii + noise());
  result.is_overlapping = !(lower > 0) && core_upper - radii <= noise();

  // Along v, not best_normal_, so that the points are no farther apart than `upper`. For
  // overlapping rounded shapes, a point in both.
  Vector3 offset_a = Vector3::Zero();
  Vector3 offset_b = Vector3::Zero();
  if (core_upper > radii) {
    const Vector3 vhat = unit_vector(v, best_normal_);
    offset_a = radius_a_ * vhat;
    offset_b = -radius_b_ * vhat;
  } else if (radii > 0) {
    offset_a = v.template cast<Scalar>() * (radius_a_ / radii);
    offset_b = -v.template cast<Scalar>() * (radius_b_ / radii);
  }
  result.p_a = core_a.template cast<Scalar>() + offset_a;
  result.p_b = core_b.template cast<Scalar>() + offset_b;
  return result;
}

}  // namespace

GjkResult gjk_distance(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB) {
  GjkSeed seed;
  return distance_internal::gjk_distance(a, b, X_AB, GjkGoal{}, seed);
}

namespace distance_internal {

GjkResult gjk_distance(const ConvexShape& a, const ConvexShape& b, const RigidPose& X_AB,
                       const GjkGoal& goal, GjkSeed& seed) {
  if (const auto gap = half_space_gap(a, b, X_AB)) return {gap->nearest(), 0};
  return GjkQuery(a, b, X_AB, goal).run(seed);
}

}  // namespace distance_internal

}  // namespace dyop
