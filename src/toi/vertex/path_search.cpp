// SPDX-License-Identifier: BSD-3-Clause
#include "toi/vertex/path_search.h"

#include <algorithm>

#include "core/tolerance.h"
#include "toi/vertex/exact_contact.h"

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
