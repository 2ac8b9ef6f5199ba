// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/toi/vertex_time_of_impact.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "toi/toi_check.h"
#include "toi/vertex/path_search.h"

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
    in_full.distance_tolerance = default_distance_tolerance(size_of(a), size_of(b));
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
