// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/vertex_time_of_impact.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <type_traits>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "toi/impact_band.h"
#include "toi/nearest_difference.h"
#include "toi/toi_check.h"
#include "toi/vertex/exact_contact.h"

namespace dyop::toi_internal {

template <int N>
using Values = std::array<Scalar, static_cast<std::size_t>(N)>;

// A fixed direction n and what it proves: the slab gap min_k n.D_k(s) is a minimum of linear
// functions, given by its values at both ends.
template <int N>
struct PathSlab {
  Vector3 nhat = Vector3::UnitX();
  Values<N> at_begin{};
  Values<N> at_end{};

  Scalar value(std::size_t k, Scalar s) const { return (1 - s) * at_begin[k] + s * at_end[k]; }
  Scalar gap(Scalar s) const {
    Scalar least = value(0, s);
    for (std::size_t k = 1; k < at_begin.size(); ++k) least = std::min(least, value(k, s));
    return least;
  }
};

// The pair at one instant s in [0, 1].
template <int N>
struct Instant {
  Scalar s = 0;
  Differences<N> corners;
  NearestDifference<N> nearest;
  PathSlab<N> slab;
  Scalar lower = 0;
  Scalar upper = 0;
};

// What a search found, in the parameter s.
template <int N>
struct Finding {
  ToiStatus status = ToiStatus::Separated;
  Instant<N> instant;
};

// Conservative advancement of one pair, given by the differences of its points at both ends of the
// interval: s runs from 0 to 1. `paths` are the same points, for the exact decision.
template <int N>
class PathSearch {
 public:
  using Paths = std::conditional_t<N == 3, VertexFacePaths, EdgeEdgePaths>;

  PathSearch(const Differences<N>& begin, const Differences<N>& end, const Paths& paths,
             const VertexToiOptions& options);

  // Whether one of the axes separates the pair at all times.
  bool is_apart_along_an_axis() const;
  Finding<N> run();

  Scalar noise() const { return noise_; }
  std::int64_t steps() const { return steps_; }

 private:
  PathSlab<N> make_slab(const Vector3& nhat) const;
  Instant<N> make_instant(Scalar s);
  void use_normal(const Vector3& normal, Instant<N>& instant) const;
  bool is_apart_between(const Instant<N>& first, const Instant<N>& last, Scalar floor) const;
  Scalar slab_end(const Instant<N>& here, Scalar floor) const;
  Scalar closing_speed(const Instant<N>& here) const;
  Instant<N> advance(const Instant<N>& here, Scalar safe_until, Scalar floor);
  bool may_touch();
  Finding<N> found(ToiStatus status, const Instant<N>& instant);

  const Differences<N> begin_;
  const Differences<N> end_;
  const Paths& paths_;
  const VertexToiOptions& options_;
  const bool is_exact_;
  Scalar noise_ = 0;
  const ImpactBand band_;
  Scalar reach_ = 1;  // the reach of the next turning direction
  std::optional<bool> has_contact_;
  std::int64_t steps_ = 0;
};

}  // namespace dyop::toi_internal

namespace dyop {
namespace {

using toi_internal::Differences;
using toi_internal::Finding;
using toi_internal::Instant;

// Side A has N / 2 points for two edges, else one: difference k is b[k % kPointsB] - a[k /
// kPointsB].
template <int N>
constexpr int kPointsB = N == 4 ? 2 : 3;

void require_coordinates(std::initializer_list<const VertexPath*> paths) {
  for (const VertexPath* path : paths) {
    for (const Vector3* point : {&path->begin, &path->end}) {
      const bool is_valid = (point->array().abs() <= kLargestCoordinate).all();
      DYOP_REQUIRE(is_valid, "time_of_impact: a vertex must have finite coordinates of at most ",
                   kLargestCoordinate, ", not (", point->x(), ", ", point->y(), ", ", point->z(),
                   ")");
    }
  }
}

void require_valid(const VertexToiOptions& options) {
  toi_internal::require_valid_distances(options.target_distance, options.distance_tolerance);
  DYOP_REQUIRE(options.max_steps >= 1, "time_of_impact: max_steps must be >= 1, not ",
               options.max_steps);
  DYOP_REQUIRE(options.contact_rule != ContactRule::Exact || options.target_distance == 0,
               "time_of_impact: ContactRule::Exact needs a target_distance of 0, not ",
               options.target_distance);
}

Vector3 position(const VertexPath& path, Scalar s) {
  return path.begin + s * (path.end - path.begin);
}

// The contact at an instant; `a` and `b` are the points of both sides.
template <int N, typename PointsA, typename PointsB>
ImpactContact make_contact(const Instant<N>& here, const PointsA& a, const PointsB& b,
                           const TimeInterval& interval) {
  ImpactContact contact;
  contact.lower = std::max(here.lower, 0.0);
  contact.upper = here.upper;
  Scalar speed = 0;
  for (std::size_t k = 0; k < here.corners.size(); ++k) {
    const Scalar weight = here.nearest.weights[k];
    contact.p_WCa += weight * position(a[k / kPointsB<N>], here.s);
    contact.p_WCb += weight * position(b[k % kPointsB<N>], here.s);
    speed += weight * (here.slab.at_begin[k] - here.slab.at_end[k]);
  }
  contact.nhat_AB_W = here.slab.nhat;
  contact.closing_speed = interval.length() > 0 ? speed / interval.length() : 0;
  contact.feature_a = here.nearest.feature_a;
  contact.feature_b = here.nearest.feature_b;
  return contact;
}

// How far the points of a pair may be from where they were proven, because a time is rounded.
template <int N>
Scalar time_noise(const Differences<N>& begin, const Differences<N>& end,
                  const TimeInterval& interval) {
  if (!(interval.length() > 0)) return 0;
  Scalar largest = 0;
  for (std::size_t k = 0; k < begin.size(); ++k) {
    largest = std::max(largest, (end[k] - begin[k]).norm());
  }
  const Scalar time = std::max(std::abs(interval.begin), std::abs(interval.end));
  // literal: begin + s * length errs by 2u of its size, and the length by u of itself.
  return 4 * kUnitRoundoff * largest * (time / interval.length() + 1);
}

// Largest distance between two vertices of an element, at the start or the end.
template <typename Points>
Scalar size_of(const Points& points) {
  Scalar largest_sq = 0;
  for (const VertexPath& p : points) {
    for (const VertexPath& q : points) {
      largest_sq =
          std::max({largest_sq, (p.begin - q.begin).squaredNorm(), (p.end - q.end).squaredNorm()});
    }
  }
  return std::sqrt(largest_sq);
}

template <int N, typename Paths, typename PointsA, typename PointsB>
VertexToiResult search(const Paths& paths, const PointsA& a, const PointsB& b,
                       const TimeInterval& interval, const VertexToiOptions& options) {
  require_valid(interval, "time_of_impact: interval");
  require_valid(options);
  Differences<N> begin;
  Differences<N> end;
  for (std::size_t k = 0; k < begin.size(); ++k) {
    begin[k] = b[k % kPointsB<N>].begin - a[k / kPointsB<N>].begin;
    end[k] = b[k % kPointsB<N>].end - a[k / kPointsB<N>].end;
  }
  VertexToiResult result;
  VertexToiOptions in_full = options;
  if (!options.distance_tolerance) {
    in_full.distance_tolerance = toi_internal::tolerance_for_sizes(size_of(a), size_of(b));
  }
  toi_internal::PathSearch<N> path_search(begin, end, paths, in_full);
  result.rounding_allowance = path_search.noise() + time_noise<N>(begin, end, interval);
  result.status = ToiStatus::Separated;
  result.t_safe = interval.end;
  if (path_search.is_apart_along_an_axis()) return result;
  const Finding<N> finding = path_search.run();
  result.steps = path_search.steps();
  result.status = finding.status;
  if (finding.status == ToiStatus::Separated) return result;
  result.t_safe = std::min(interval.begin + finding.instant.s * interval.length(), interval.end);
  if (finding.status != ToiStatus::BudgetExhausted) {
    result.contact = make_contact<N>(finding.instant, a, b, interval);
  }
  return result;
}

// Over an interval of length zero nothing moves.
VertexPath at_rest(const VertexPath& path) {
  return {path.begin, path.begin};
}

}  // namespace

VertexToiResult time_of_impact(const VertexFacePaths& paths, const TimeInterval& interval,
                               const VertexToiOptions& options) {
  require_coordinates({&paths.vertex, &paths.face[0], &paths.face[1], &paths.face[2]});
  if (interval.length() <= 0) {
    const VertexFacePaths resting{
        at_rest(paths.vertex),
        {at_rest(paths.face[0]), at_rest(paths.face[1]), at_rest(paths.face[2])}};
    return search<3>(resting, std::array{resting.vertex}, resting.face, interval, options);
  }
  return search<3>(paths, std::array{paths.vertex}, paths.face, interval, options);
}

VertexToiResult time_of_impact(const EdgeEdgePaths& paths, const TimeInterval& interval,
                               const VertexToiOptions& options) {
  require_coordinates({&paths.edge_a[0], &paths.edge_a[1], &paths.edge_b[0], &paths.edge_b[1]});
  if (interval.length() <= 0) {
    const EdgeEdgePaths resting{{at_rest(paths.edge_a[0]), at_rest(paths.edge_a[1])},
                                {at_rest(paths.edge_b[0]), at_rest(paths.edge_b[1])}};
    return search<4>(resting, resting.edge_a, resting.edge_b, interval, options);
  }
  return search<4>(paths, paths.edge_a, paths.edge_b, interval, options);
}

}  // namespace dyop

namespace dyop::toi_internal {
namespace {

template <int N>
Differences<N> interpolate(const Differences<N>& begin, const Differences<N>& end, Scalar s) {
  Differences<N> corners;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    corners[k] = begin[k] + s * (end[k] - begin[k]);
  }
  return corners;
}

}  // namespace

// Rounding, in u M, u = 2^-53 and M the sum over the axes of the largest coordinate of the D_k at
// both ends, so |D_k| <= M. One slab gap:
//     D_k is a rounded difference, relative error u a coordinate                   1
//     n.D_k: three products, two sums [Higham2002]                                 3
//     interpolation (1-s) g(0) + s g(1): one difference, two products, one sum     3
//     n has unit length only to 4u: division by its length                         4
//     comparison with δ + ε/2 + noise: the sum is rounded                          1
//     end of a step: the quotient and its product with 1 - s are good to 5u,
//         their sum with s to u, and g falls by at most 2 M                        12
//     sum                                                                          24
// Turning directions use interpolated corners (1 + 2 + 2 + 1 = 6), a product (3), a mean (1) and a
// length (4): 14 in place of the first four lines. A witness errs by at most 36.
template <int N>
PathSearch<N>::PathSearch(const Differences<N>& begin, const Differences<N>& end,
                          const Paths& paths, const VertexToiOptions& options)
    : begin_(begin),
      end_(end),
      paths_(paths),
      options_(options),
      is_exact_(options.contact_rule == ContactRule::Exact),
      band_(options.target_distance, options.distance_tolerance.value()) {
  Vector3 largest = Vector3::Zero();
  for (std::size_t k = 0; k < begin.size(); ++k) {
    largest = largest.cwiseMax(begin[k].cwiseAbs()).cwiseMax(end[k].cwiseAbs());
  }
  noise_ = kPathNoise * largest.sum();
}

template <int N>
bool PathSearch<N>::is_apart_along_an_axis() const {
  // The sign of a rounded difference is exact.
  const Scalar least = is_exact_ ? 0 : band_.leaf_target + noise_;
  Vector3 lowest = begin_[0].cwiseMin(end_[0]);
  Vector3 highest = begin_[0].cwiseMax(end_[0]);
  for (std::size_t k = 1; k < begin_.size(); ++k) {
    lowest = lowest.cwiseMin(begin_[k]).cwiseMin(end_[k]);
    highest = highest.cwiseMax(begin_[k]).cwiseMax(end_[k]);
  }
  return lowest.maxCoeff() > least || highest.minCoeff() < -least;
}

template <int N>
PathSlab<N> PathSearch<N>::make_slab(const Vector3& nhat) const {
  PathSlab<N> slab;
  slab.nhat = nhat;
  for (std::size_t k = 0; k < begin_.size(); ++k) {
    slab.at_begin[k] = nhat.dot(begin_[k]);
    slab.at_end[k] = nhat.dot(end_[k]);
  }
  return slab;
}

// Keeps the direction if it proves more than the previous one.
template <int N>
void PathSearch<N>::use_normal(const Vector3& normal, Instant<N>& instant) const {
  const Scalar length = normal.norm();
  if (!(length > 0)) return;
  const PathSlab<N> slab = make_slab(normal / length);
  const Scalar lower = slab.gap(instant.s) - noise_;
  if (!(lower > instant.lower)) return;
  instant.slab = slab;
  instant.lower = lower;
}

template <int N>
Instant<N> PathSearch<N>::make_instant(Scalar s) {
  ++steps_;
  Instant<N> instant;
  instant.s = s;
  instant.corners = s <= 0 ? begin_ : s >= 1 ? end_ : interpolate<N>(begin_, end_, s);
  instant.nearest = find_nearest(instant.corners);
  const Scalar length = instant.nearest.point.norm();
  instant.upper = length + noise_;
  instant.lower = -kInfinity;
  use_normal(instant.nearest.normal, instant);
  // The feature's normal is better near contact, but inaccurate for thin triangles and nearly
  // parallel edges.
  if (!(instant.lower > length / 2)) use_normal(instant.nearest.point, instant);
  return instant;
}

// Proves a gap above the floor at all times between two instants: along the last direction, or
// along one that turns from the first to the last. The latter is m(x) = (1 - x) n0 + x n1, of
// length at most one; m.D_k is a quadratic, bounded below by its least Bernstein coefficient.
template <int N>
bool PathSearch<N>::is_apart_between(const Instant<N>& first, const Instant<N>& last,
                                     Scalar floor) const {
  const Scalar least = floor + noise_;
  if (last.slab.gap(first.s) > least && last.slab.gap(last.s) > least) return true;
  for (std::size_t k = 0; k < begin_.size(); ++k) {
    const Scalar c0 = first.slab.nhat.dot(first.corners[k]);
    const Scalar c2 = last.slab.nhat.dot(last.corners[k]);
    const Scalar c1 =
        (first.slab.nhat.dot(last.corners[k]) + last.slab.nhat.dot(first.corners[k])) / 2;
    if (!(c0 > least && c1 > least && c2 > least)) return false;
  }
  return true;
}

// The time until which the slab of the instant stays above the floor; 1 or more if to the end.
template <int N>
Scalar PathSearch<N>::slab_end(const Instant<N>& here, Scalar floor) const {
  const Scalar least = floor + noise_;
  Scalar end = 2;
  for (std::size_t k = 0; k < begin_.size(); ++k) {
    const Scalar now = here.slab.value(k, here.s);
    if (!(now > least)) return here.s;
    const Scalar last = here.slab.at_end[k];
    if (last > least) continue;
    end = std::min(end, here.s + (1 - here.s) * ((now - least) / (now - last)));
  }
  return end;
}

template <int N>
Scalar PathSearch<N>::closing_speed(const Instant<N>& here) const {
  Scalar speed = 0;
  for (std::size_t k = 0; k < begin_.size(); ++k) {
    speed += here.nearest.weights[k] * (here.slab.at_begin[k] - here.slab.at_end[k]);
  }
  return speed;
}

// Advances by the slab's step, or farther with a turning direction if that step is short for the
// speed: for faces and edges that turn while they stay near.
template <int N>
Instant<N> PathSearch<N>::advance(const Instant<N>& here, Scalar safe_until, Scalar floor) {
  constexpr int kTrials = 3;
  const Scalar rest = 1 - here.s;
  const Scalar speed = closing_speed(here);
  const Scalar slack = here.lower - floor;
  const Scalar until_contact = speed * rest > slack ? slack / speed : rest;
  const Scalar step = safe_until - here.s;
  Scalar trial = std::min(until_contact < rest ? 0.9 * until_contact : rest, reach_);
  for (int i = 0; i < kTrials && trial > 2 * step; ++i, trial /= 4) {
    const Instant<N> there = make_instant(trial < rest ? here.s + trial : 1);
    if (is_apart_between(here, there, floor)) {
      reach_ = 4 * trial;
      return there;
    }
    reach_ = trial / 2;
  }
  return make_instant(safe_until);
}

template <int N>
bool PathSearch<N>::may_touch() {
  if (!is_exact_) return true;
  if (!has_contact_) has_contact_ = has_contact(paths_);
  return *has_contact_;
}

template <int N>
Finding<N> PathSearch<N>::found(ToiStatus status, const Instant<N>& instant) {
  if (!may_touch()) return {};
  return {status, instant};
}

template <int N>
Finding<N> PathSearch<N>::run() {
  Instant<N> here = make_instant(0);
  if (!(here.lower > band_.guaranteed)) {
    const bool is_within = !(here.upper > band_.largest_impact + 2 * noise_);
    return found(is_within ? ToiStatus::InitiallyWithinTarget : ToiStatus::NumericalLimit, here);
  }
  while (here.s < 1) {
    const bool is_near = !(here.upper > band_.largest_impact + noise_);
    if (is_near && !may_touch()) return {};
    if (is_near && closing_speed(here) > noise_) return found(ToiStatus::Impact, here);
    const Scalar least = is_near ? band_.resting_target(here.lower, noise_) : band_.leaf_target;
    const Scalar safe_until = slab_end(here, least);
    if (safe_until >= 1) return {};
    if (steps_ >= options_.max_steps) return found(ToiStatus::BudgetExhausted, here);
    const Instant<N> next = advance(here, safe_until, least);
    if (!(next.s > here.s)) {
      return found(is_near ? ToiStatus::Impact : ToiStatus::NumericalLimit, here);
    }
    here = next;
  }
  return {};
}

template class PathSearch<3>;
template class PathSearch<4>;

}  // namespace dyop::toi_internal
