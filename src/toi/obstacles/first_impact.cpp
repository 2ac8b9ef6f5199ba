// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/toi/obstacle_set.h"
#include "toi/best_first_search.h"
#include "toi/obstacles/obstacle_data.h"
#include "toi/obstacles/swept_boxes.h"
#include "toi/toi_check.h"

namespace dyop {
namespace {

using toi_internal::ObstacleEvent;
using toi_internal::ObstaclePair;
using toi_internal::ObstacleTree;
using toi_internal::SweptBoxes;
using toi_internal::TimeParts;

// Node pairs of the first portion of a pair, and the growth of later ones. Most pairs need one.
constexpr std::int64_t kFirstPortion = 512;
constexpr std::int64_t kPortionGrowth = 4;

// Order at equal times: first everything that may still turn out earlier, then the worst news.
enum Rank : int { kNode, kPair, kWithinTarget, kUndecided, kImpact };

Rank rank_of(ToiStatus status) {
  switch (status) {
    case ToiStatus::InitiallyWithinTarget:
      return kWithinTarget;
    case ToiStatus::Impact:
      return kImpact;
    case ToiStatus::NotRun:
    case ToiStatus::Separated:
    case ToiStatus::BudgetExhausted:
    case ToiStatus::Cancelled:
    case ToiStatus::NumericalLimit:
      break;
  }
  return kUndecided;
}

// At least the default tolerance of the body with any obstacle.
Scalar largest_default_tolerance(const toi_internal::ObstacleSetData& data, const Shape& body) {
  if (!as_half_space(body) && toi_internal::size_of(body) > 0) {
    return kDefaultRelativeTolerance * toi_internal::size_of(body);
  }
  Scalar largest = 0;
  for (const auto& slot : data.slots) {
    if (!slot.obstacle || as_half_space(*slot.obstacle->shape)) continue;
    largest = std::max(largest, toi_internal::size_of(*slot.obstacle->shape));
  }
  return kDefaultRelativeTolerance * largest;
}

// Best-first over obstacles: pursues whichever may be hit first, a portion at a time.
class ImpactSearch {
 public:
  ImpactSearch(const toi_internal::ObstacleSetData& data, const Shape& body, const Motion& X_WB,
               const TimeInterval& interval, const ToiOptions& options,
               const ObstacleFilter& filter, toi_internal::ObstacleMemory& memory)
      : data_(data),
        body_(body),
        X_WB_(X_WB),
        interval_(interval),
        options_(options),
        filter_(filter),
        memory_(memory),
        parts_{interval, interval.length() > 0 ? memory.time_parts : 1},
        swept_(body, X_WB, parts_),
        // Boxes farther apart than this contain shapes that are too, rounding included. The default
        // tolerance depends on the smaller shape, so that of the body or of a larger shape is never
        // exceeded.
        reach_(options.target_distance +
               options.distance_tolerance.value_or(largest_default_tolerance(data, body))) {}

  ObstacleImpact run();

 private:
  void push_node(std::int32_t number, int first);
  void push_obstacle(std::uint32_t slot, const AlignedBox& box, int first);
  void push_moving(std::uint32_t slot);
  void add_pair(std::uint32_t slot, int first, int last);
  // Returns true if the whole call must end.
  bool pursue(std::size_t index);
  ToiResult run_portion(ObstaclePair& pair);
  const Obstacle& obstacle(const ObstaclePair& pair) const {
    return *data_.slots[pair.slot].obstacle;
  }
  ObstacleImpact finish(const ObstaclePair& pair, ToiStatus status, Scalar t_safe);
  ObstacleImpact finish_separated();

  const toi_internal::ObstacleSetData& data_;
  const Shape& body_;
  const Motion& X_WB_;
  const TimeInterval interval_;
  const ToiOptions& options_;
  const ObstacleFilter& filter_;
  toi_internal::ObstacleMemory& memory_;
  const TimeParts parts_;
  const SweptBoxes swept_;
  const Scalar reach_;
  ToiStatistics statistics_;
  Scalar rounding_allowance_ = 0;
};

void ImpactSearch::push_node(std::int32_t number, int first) {
  const ObstacleTree::Node& node = data_.tree.node(number);
  if (node.is_leaf()) {
    push_obstacle(node.number, node.box, first);
    return;
  }
  ++statistics_.box_tests;
  const std::optional<int> near = swept_.first_near(node.box, reach_, first);
  if (near) {
    memory_.queue.push(
        {parts_.time(*near), kNode, std::uint64_t(*near), static_cast<std::size_t>(number)});
  }
}

void ImpactSearch::push_obstacle(std::uint32_t slot, const AlignedBox& box, int first) {
  ++statistics_.box_tests;
  const std::optional<int> near = swept_.first_near(box, reach_, first);
  if (near) add_pair(slot, *near, swept_.last_near(box, reach_, *near));
}

// Both shapes are boxed over each part of the interval.
void ImpactSearch::push_moving(std::uint32_t slot) {
  ++statistics_.box_tests;
  const Obstacle& other = *data_.slots[slot].obstacle;
  if (toi_internal::box_gap(
          swept_.whole(), toi_internal::swept_box(*other.shape, *other.X_WO, interval_)) > reach_) {
    return;
  }
  const SweptBoxes boxes(*other.shape, *other.X_WO, parts_);
  int first = parts_.count;
  int last = 0;
  for (int i = 0; i < parts_.count; ++i) {
    if (toi_internal::box_gap(swept_.part(i), boxes.part(i)) > reach_) continue;
    first = std::min(first, i);
    last = i;
  }
  if (first < parts_.count) add_pair(slot, first, last);
}

void ImpactSearch::add_pair(std::uint32_t slot, int first, int last) {
  if (!toi_internal::passes(data_, slot, filter_)) return;
  if (memory_.used == memory_.pairs.size()) {
    memory_.pairs.push_back(std::make_unique<ObstaclePair>());
  }
  const std::size_t index = memory_.used++;
  ObstaclePair& pair = *memory_.pairs[index];
  pair.slot = slot;
  pair.interval = {parts_.time(first), parts_.time(last + 1)};
  pair.portion = kFirstPortion;
  pair.is_begun = false;
  pair.result = ToiResult();
  memory_.queue.push(
      {pair.interval.begin, kPair, static_cast<std::uint64_t>(data_.id_of(slot)), index});
}

// Runs a further portion of a pair's search.
ToiResult ImpactSearch::run_portion(ObstaclePair& pair) {
  const Obstacle& other = obstacle(pair);
  ToiOptions options = options_;
  options.max_node_pairs = std::min(pair.portion, options_.max_node_pairs - statistics_.node_pairs);
  options.solid_b = other.is_solid;
  if (pair.is_begun) {
    return resume_time_of_impact(body_, X_WB_, *other.shape, *other.X_WO, pair.interval, options,
                                 pair.workspace);
  }
  pair.is_begun = true;
  return time_of_impact(body_, X_WB_, *other.shape, *other.X_WO, pair.interval, options,
                        pair.workspace);
}

bool ImpactSearch::pursue(std::size_t index) {
  ObstaclePair& pair = *memory_.pairs[index];
  pair.result = run_portion(pair);
  const ToiResult& found = pair.result;
  statistics_.box_tests += found.statistics.box_tests;
  statistics_.leaf_tests += found.statistics.leaf_tests;
  statistics_.node_pairs += found.statistics.node_pairs;
  statistics_.peak_queue = std::max(statistics_.peak_queue, found.statistics.peak_queue);
  rounding_allowance_ = std::max(rounding_allowance_, found.rounding_allowance);
  const auto id = static_cast<std::uint64_t>(data_.id_of(pair.slot));
  switch (found.status) {
    case ToiStatus::Separated:
      return false;
    case ToiStatus::Impact:
    case ToiStatus::InitiallyWithinTarget:
    case ToiStatus::NumericalLimit:
      memory_.queue.push({found.t_safe, rank_of(found.status), id, index});
      return false;
    case ToiStatus::BudgetExhausted:
    case ToiStatus::Cancelled:
    case ToiStatus::NotRun:
      break;
  }
  memory_.queue.push({found.t_safe, kPair, id, index});
  // The portion was used up, not the budget, the time or the caller's patience.
  const bool is_portion = found.status == ToiStatus::BudgetExhausted &&
                          found.statistics.node_pairs >= pair.portion &&
                          statistics_.node_pairs < options_.max_node_pairs;
  pair.portion *= kPortionGrowth;
  return !is_portion;
}

ObstacleImpact ImpactSearch::finish(const ObstaclePair& pair, ToiStatus status, Scalar t_safe) {
  ObstacleImpact impact;
  impact.toi = pair.result;
  impact.toi.status = status;
  impact.toi.t_safe = t_safe;
  impact.obstacle = data_.id_of(pair.slot);
  impact.toi.statistics = statistics_;
  impact.toi.rounding_allowance = rounding_allowance_;
  if (!pair.is_begun || pair.result.t_safe != t_safe) {
    impact.toi.X_WA = X_WB_.pose(t_safe);
    impact.toi.X_WB = obstacle(pair).X_WO->pose(t_safe);
  }
  const Scalar share = (t_safe - interval_.begin) / interval_.length();
  impact.free_fraction = interval_.length() > 0 ? std::clamp(share, 0.0, 1.0) : 0;
  return impact;
}

ObstacleImpact ImpactSearch::finish_separated() {
  ObstacleImpact impact;
  impact.toi.status = ToiStatus::Separated;
  impact.toi.t_safe = interval_.end;
  impact.toi.X_WA = X_WB_.pose(interval_.end);
  impact.toi.statistics = statistics_;
  impact.toi.rounding_allowance = rounding_allowance_;
  impact.free_fraction = 1;
  return impact;
}

ObstacleImpact ImpactSearch::run() {
  memory_.queue.clear();
  memory_.used = 0;
  for (const std::uint32_t slot : data_.moving) push_moving(slot);
  if (data_.tree.root() != ObstacleTree::kNone) push_node(data_.tree.root(), 0);
  ToiStatus undecided = ToiStatus::NotRun;
  while (!memory_.queue.is_empty()) {
    const ObstacleEvent event = memory_.queue.pop();
    if (event.rank == kNode) {
      for (const std::int32_t child : data_.tree.node(std::int32_t(event.index)).children) {
        push_node(child, int(event.id));
      }
      continue;
    }
    const ObstaclePair& pair = *memory_.pairs[event.index];
    if (statistics_.node_pairs >= options_.max_node_pairs) undecided = ToiStatus::BudgetExhausted;
    if (event.rank != kPair || undecided != ToiStatus::NotRun) {
      const bool is_decided = event.rank != kPair;
      return finish(pair, is_decided ? pair.result.status : undecided, event.key);
    }
    if (pursue(event.index)) undecided = pair.result.status;
  }
  return finish_separated();
}

}  // namespace

ObstacleImpact ObstacleSet::first_impact(const Shape& body, const Motion& X_WB,
                                         const TimeInterval& interval, const ToiOptions& options,
                                         const ObstacleFilter& filter) const {
  ObstacleWorkspace workspace;
  return first_impact(body, X_WB, interval, options, filter, workspace);
}

ObstacleImpact ObstacleSet::first_impact(const Shape& body, const Motion& X_WB,
                                         const TimeInterval& interval, const ToiOptions& options,
                                         const ObstacleFilter& filter,
                                         ObstacleWorkspace& workspace) const {
  toi_internal::require_no_solid_b("first_impact", options.solid_b);
  toi_internal::require_valid_query(body, X_WB, body, X_WB, interval, options);
  for (const std::uint32_t slot : data_->moving) {
    require_defined(*data_->slots[slot].obstacle->X_WO, interval,
                    "first_impact: the motion of an obstacle");
  }
  return ImpactSearch(*data_, body, X_WB, interval, options, filter, workspace.memory()).run();
}

}  // namespace dyop
