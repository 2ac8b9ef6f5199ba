// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "toi/deforming/pair_front.h"

// The members of PairFront that are templates.
namespace dyop::toi_internal {

template <typename IsOver, typename Visit>
bool PairFront::refine(const StandingPair& sides, Scalar reach, const IsOver& is_over,
                       const Visit& visit) {
  Pass<IsOver, Visit> pass{sides, reach, nullptr, is_over, visit};
  return descend(pass, 0);
}

template <typename IsOver, typename Visit>
bool PairFront::refine(const StandingPair& sides, const ExpectedApproach& approach,
                       const IsOver& is_over, const Visit& visit) {
  const auto visit_all = [&](const PieceDistance& piece, std::int32_t a, std::int32_t b) {
    visit(piece, a, b);
    return approach.reach;
  };
  Pass<IsOver, decltype(visit_all)> pass{sides, approach.reach, &approach, is_over, visit_all};
  return descend(pass, 0);
}

template <typename IsOver, typename Visit>
bool PairFront::descend(Pass<IsOver, Visit>& pass, std::int32_t number) {
  const Node& node = at(number);
  if (node.key > pass.reach + moved_) return true;
  if (++visited_ % kVisitsAsked == 0 && pass.is_over()) return false;
  if (node.count > 0 && node.try_after > moved_) return descend_to_parts(pass, number);
  const Question question{pass.sides, pass.reach, pass.approach};
  const Measured* near = measured(number);
  if (!near && is_still_apart(question, number)) return true;
  if (pass.is_over()) return false;
  if (!near) {
    const Finding finding = examine(question, number);
    if (finding == Finding::Apart) return true;
    if (finding == Finding::Opened) return descend_to_parts(pass, number);
    near = &measured_.back();
  }
  pass.reach = pass.visit(near->piece, at(number).a, at(number).b);
  return true;
}

template <typename IsOver, typename Visit>
bool PairFront::descend_between(Scalar near_key, Scalar far_key, const IsOver& is_over,
                                const Visit& visit, std::int32_t number) const {
  const Node& node = at(number);
  if (node.key > far_key) return true;
  if (node.count == 0) {
    if (!(node.key > near_key)) return true;
    if (is_over()) return false;
    visit(node.a, node.b, node.n_W);
    return true;
  }
  for (std::int32_t part = node.parts; part < node.parts + node.count; ++part) {
    if (!descend_between(near_key, far_key, is_over, visit, part)) return false;
  }
  return true;
}

// What the parts up to this key are made of comes into the cache meanwhile, all at once: after a
// snapshot was refitted nothing of it is there.
inline void PairFront::fetch_parts(std::int32_t first, std::int32_t end, Scalar key) const {
  for (std::int32_t part = first; part < end; ++part) {
    const Node& node = at(part);
    if (node.count > 0 && !(node.key > key)) __builtin_prefetch(&at(node.parts));
  }
}

// Opening a part may move all nodes.
template <typename IsOver, typename Visit>
bool PairFront::descend_to_parts(Pass<IsOver, Visit>& pass, std::int32_t number) {
  const std::int32_t first = at(number).parts, end = first + at(number).count;
  bool is_through = true;
  Scalar least = kInfinity;
  fetch_parts(first, end, pass.reach + moved_);
  for (std::int32_t part = first; part < end; ++part) {
    if (is_through) is_through = descend(pass, part);
    least = std::min(least, at(part).key);
  }
  at(number).key = least;
  // Of parts that are all apart, the least bound tells enough.
  if (is_through && least > pass.reach + moved_ && is_crowded()) close(number);
  return is_through;
}

template <typename IsOver>
bool PairFront::find_nearest(const StandingPair& sides, const NearestGoal& goal,
                             const IsOver& is_over, BoxPairStack& stack, PieceDistance& best) {
  best = first_nearest(sides, std::cref(is_over), stack);
  if (best.lower > 0) nearest_n_W_ = best.nhat_AB;
  const auto is_reached = [&] {
    return lower() >= std::min(best.upper, goal.farthest) - goal.allowed;
  };
  if (is_reached()) {
    last_search_ = 0;
    return true;
  }
  // An older search may end with less than is wanted now.
  return search(sides, goal, is_over, best) && (is_reached() || search(sides, goal, is_over, best));
}

template <typename IsOver>
bool PairFront::search(const StandingPair& sides, const NearestGoal& goal, const IsOver& is_over,
                       PieceDistance& best) {
  const auto reach = [&] {
    return std::min(std::min(best.upper, goal.farthest) - goal.tight, sought_ - moved_);
  };
  // A distance that is a little too large has all pairs examined that the true one leaves out.
  const bool was_long = last_search_ > kLongSearch;
  if (was_long && lower() < reach() && !is_over()) try_promising(sides, best);
  const std::size_t before = examined_;
  sought_ = reach() + moved_;
  const bool is_through = refine(sides, reach(), is_over,
                                 [&](const PieceDistance& piece, std::int32_t a, std::int32_t b) {
                                   if (piece.upper < best.upper) {
                                     best = piece;
                                     nearest_ = {0, a, b};
                                   }
                                   return reach();
                                 });
  last_search_ = examined_ - before;
  if (is_through) sought_ = kInfinity;
  return is_through;
}

}  // namespace dyop::toi_internal
