// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/tolerance.h"
#include "distance/distance_traversal.h"
#include "distance/point_search.h"
#include "dyop/core/error.h"
#include "dyop/toi/obstacle_set.h"
#include "toi/obstacles/obstacle_data.h"
#include "toi/obstacles/swept_boxes.h"
#include "toi/toi_check.h"

namespace dyop {
namespace {

using toi_internal::box_gap;

// Bodies are boxed over each of this many equal parts of the interval.
constexpr int kClearanceParts = 16;

// Rejects times at which an obstacle of the set has no place.
void require_placeable(const toi_internal::ObstacleSetData& data, Scalar t, const char* query,
                       const char* motion) {
  DYOP_REQUIRE(std::isfinite(t), query, ": t must be finite, not ", t);
  for (const std::uint32_t slot : data.moving) {
    require_defined(*data.slots[slot].obstacle->X_WO, {t, t}, motion);
  }
}

// How far a ray goes at least before its ball can meet a box; infinite if it never does.
class RayEntry {
 public:
  explicit RayEntry(const Ray& ray)
      : ray_(ray), direction_(ray.direction_W.stableNormalized()), size_(ray.p_W.norm()) {}

  Scalar operator()(const AlignedBox& box) const {
    Scalar entry = 0;
    Scalar exit = ray_.length;
    for (int k = 0; k < 3; ++k) {
      // Rounding of the slabs and, over the way to the box, of the direction.
      const Scalar reach =
          ray_.radius +
          kPoseNoise * (size_ + ray_.radius + std::abs(box.min()[k]) + std::abs(box.max()[k]));
      const Scalar inverse = 1 / direction_[k];
      const Scalar t0 = (box.min()[k] - reach - ray_.p_W[k]) * inverse;
      const Scalar t1 = (box.max()[k] + reach - ray_.p_W[k]) * inverse;
      // NaN, for a ray along a face, changes nothing.
      const Scalar nearer = t0 < t1 ? t0 : t1;
      const Scalar farther = t0 < t1 ? t1 : t0;
      if (nearer > entry) entry = nearer;
      if (farther < exit) exit = farther;
    }
    return entry > exit * (1 + 8 * kUnitRoundoff) ? kInfinity : entry * (1 - 8 * kUnitRoundoff);
  }

 private:
  const Ray& ray_;
  const Vector3 direction_;
  const Scalar size_;
};

void add_work(const DistanceStatistics& work, DistanceStatistics& sum) {
  sum.box_tests += work.box_tests;
  sum.leaf_tests += work.leaf_tests;
  sum.gjk_iterations += work.gjk_iterations;
}

// Gathers what least_distance() finds of one obstacle after another.
class LeastOfAll {
 public:
  explicit LeastOfAll(const LeastDistanceOptions& options) : options_(options) {
    sum_.status = LeastDistanceStatus::FartherThanMaxDistance;
  }

  // Obstacles farther away need no search; none does after a query that could not decide.
  Scalar limit() const { return stopped_ ? -1 : std::min(sum_.upper, options_.max_distance); }

  LeastDistanceOptions remaining(bool is_solid) const {
    LeastDistanceOptions own = options_;
    own.max_distance = std::min(sum_.upper, options_.max_distance);
    own.solid_b = is_solid;
    own.max_node_pairs = std::max<std::int64_t>(1, options_.max_node_pairs - work_.node_pairs);
    return own;
  }

  // The bodies' swept boxes are `gap` apart.
  void add(const LeastDistanceResult& found, Scalar gap, ObstacleId id) {
    work_.box_tests += found.statistics.box_tests;
    work_.leaf_tests += found.statistics.leaf_tests;
    work_.node_pairs += found.statistics.node_pairs;
    work_.peak_queue = std::max(work_.peak_queue, found.statistics.peak_queue);
    queries_ += found.distance_queries;
    allowance_ = std::max(allowance_, found.rounding_allowance);
    lower_ = std::min(lower_, std::max(gap, found.lower));
    const bool is_undecided = found.status == LeastDistanceStatus::BudgetExhausted ||
                              found.status == LeastDistanceStatus::Cancelled;
    if (is_undecided) stopped_ = found.status;
    if (found.upper < sum_.upper) {
      sum_ = found;
      nearest_ = id;
    }
  }

  // All obstacles that were left out are at least `left` away.
  ObstacleClearance clearance(Scalar left) const {
    ObstacleClearance best{sum_, nearest_};
    LeastDistanceResult& sum = best.distance;
    sum.lower = std::min({lower_, left, sum.upper});
    sum.statistics = work_;
    sum.distance_queries = queries_;
    sum.rounding_allowance = allowance_;
    if (stopped_) {
      sum.status = *stopped_;
    } else if (sum.lower > options_.max_distance || !best.obstacle) {
      sum.status = LeastDistanceStatus::FartherThanMaxDistance;
    } else {
      const bool is_tight = sum.upper - sum.lower <= toi_internal::tolerance_of(options_, sum);
      sum.status = is_tight ? LeastDistanceStatus::Bounded : LeastDistanceStatus::NumericalLimit;
    }
    return best;
  }

 private:
  const LeastDistanceOptions& options_;
  LeastDistanceResult sum_;
  std::optional<ObstacleId> nearest_;
  Scalar lower_ = kInfinity;
  ToiStatistics work_;
  std::int64_t queries_ = 0;
  Scalar allowance_ = 0;
  std::optional<LeastDistanceStatus> stopped_;
};

}  // namespace

NearestObstacle ObstacleSet::nearest(const Shape& body, const RigidPose& X_WB, Scalar t,
                                     const DistanceOptions& options,
                                     const ObstacleFilter& filter) const {
  toi_internal::require_no_solid_b("nearest", options.solid_b);
  distance_internal::require_valid_options(options, "nearest");
  distance_internal::require_closed("nearest", body, body, {options.solid_a, false});
  require_placeable(*data_, t, "nearest", "nearest: the motion of an obstacle");
  NearestObstacle best;
  best.distance.status = DistanceStatus::FartherThanMaxDistance;
  Scalar lower = kInfinity;
  DistanceStatistics work;
  const AlignedBox box = toi_internal::placed_box(body, X_WB);
  const auto place = [&](std::uint32_t slot) { return data_->slots[slot].obstacle->X_WO->pose(t); };
  const auto limit = [&] { return std::min(best.distance.upper, options.max_distance); };
  const Scalar left = toi_internal::visit_by_gap(
      *data_, filter, [&](const AlignedBox& other) { return box_gap(box, other); },
      [&](std::uint32_t slot) {
        return box_gap(box,
                       toi_internal::placed_box(*data_->slots[slot].obstacle->shape, place(slot)));
      },
      // An overlapping obstacle is as near as possible.
      [&] { return best.distance.status == DistanceStatus::Overlapping ? -1 : limit(); },
      [&](std::uint32_t slot, Scalar) {
        const Obstacle& other = *data_->slots[slot].obstacle;
        DistanceOptions own = options;
        own.max_distance = limit();
        own.solid_b = other.is_solid;
        const DistanceResult found = dyop::distance(body, X_WB, *other.shape, place(slot), own);
        add_work(found.statistics, work);
        lower = std::min(lower, found.lower);
        const bool is_overlap = found.status == DistanceStatus::Overlapping;
        if (is_overlap || found.upper < best.distance.upper) {
          best.distance = found;
          best.obstacle = data_->id_of(slot);
        }
      });
  const bool is_overlap = best.distance.status == DistanceStatus::Overlapping;
  best.distance.lower = is_overlap ? 0 : std::min({lower, left, best.distance.upper});
  best.distance.statistics = work;
  if (is_overlap) return best;
  if (best.distance.lower > options.max_distance || !best.obstacle) {
    best.distance.status = DistanceStatus::FartherThanMaxDistance;
  } else {
    best.distance.status =
        best.distance.lower > 0 ? DistanceStatus::Separated : DistanceStatus::Inconclusive;
  }
  return best;
}

ObstacleHit ObstacleSet::ray_cast(const Ray& ray, Scalar t, const ObstacleFilter& filter) const {
  distance_internal::require_valid_ray(ray, "ray_cast");
  require_placeable(*data_, t, "ray_cast", "ray_cast: the motion of an obstacle");
  ObstacleHit first;
  first.hit.status = RayStatus::Miss;
  first.hit.distance = ray.length;
  const RayEntry entry(ray);
  const auto place = [&](std::uint32_t slot) { return data_->slots[slot].obstacle->X_WO->pose(t); };
  toi_internal::visit_by_gap(
      *data_, filter, entry,
      [&](std::uint32_t slot) {
        return entry(toi_internal::placed_box(*data_->slots[slot].obstacle->shape, place(slot)));
      },
      // Finite, so that boxes which the ray misses are beyond it.
      [&] { return std::min(first.hit.distance, std::numeric_limits<Scalar>::max()); },
      [&](std::uint32_t slot, Scalar) {
        Ray rest = ray;
        rest.length = first.hit.distance;
        const RayHit found = dyop::ray_cast(*data_->slots[slot].obstacle->shape, place(slot), rest);
        if (found.status == RayStatus::Miss) return;
        const ObstacleId id = data_->id_of(slot);
        if (first.obstacle && !(found.distance < first.hit.distance) && *first.obstacle < id)
          return;
        first = {found, id};
      });
  return first;
}

ObstacleClearance ObstacleSet::least_distance(const Shape& body, const Motion& X_WB,
                                              const TimeInterval& interval,
                                              const LeastDistanceOptions& options,
                                              const ObstacleFilter& filter) const {
  toi_internal::require_no_solid_b("least_distance", options.solid_b);
  require_valid(interval, "least_distance: interval");
  require_defined(X_WB, interval, "least_distance: the motion of the body");
  toi_internal::require_valid_options(options);
  distance_internal::require_closed("least_distance", body, body, {options.solid_a, false});
  for (const std::uint32_t slot : data_->moving) {
    require_defined(*data_->slots[slot].obstacle->X_WO, interval,
                    "least_distance: the motion of an obstacle");
  }
  LeastOfAll least(options);
  const toi_internal::TimeParts parts{interval, interval.length() > 0 ? kClearanceParts : 1};
  const toi_internal::SweptBoxes swept(body, X_WB, parts);
  const Scalar left = toi_internal::visit_by_gap(
      *data_, filter, [&](const AlignedBox& box) { return swept.least_gap(box); },
      [&](std::uint32_t slot) {
        const Obstacle& other = *data_->slots[slot].obstacle;
        const toi_internal::SweptBoxes boxes(*other.shape, *other.X_WO, parts);
        Scalar gap = kInfinity;
        for (int i = 0; i < parts.count; ++i) {
          gap = std::min(gap, box_gap(swept.part(i), boxes.part(i)));
        }
        return gap;
      },
      [&] { return least.limit(); },
      [&](std::uint32_t slot, Scalar gap) {
        const Obstacle& other = *data_->slots[slot].obstacle;
        const LeastDistanceOptions own = least.remaining(other.is_solid);
        least.add(dyop::least_distance(body, X_WB, *other.shape, *other.X_WO, interval, own), gap,
                  data_->id_of(slot));
      });
  return least.clearance(left);
}

}  // namespace dyop
