// SPDX-License-Identifier: BSD-3-Clause
#include "toi/best_first_search.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "core/assert.h"
#include "toi/deforming/deforming_pair.h"
#include "toi/rigid/rigid_pair.h"

namespace dyop::toi_internal {

// --- the loop -----------------------------------------------------------------------------------

template <typename Pair>
ToiResult BestFirstSearch<Pair>::run() {
  memory_.queue.clear();
  memory_.seed = std::exchange(memory_.start, {});
  memory_.is_unfinished = false;
  memory_.has_resting_pair = false;
  memory_.is_seeking_nearer = false;
  if (const auto p_W = pair_.enclosed_point(options_)) return finish_enclosed(*p_W);
  const Scalar time = pair_.first_time();
  for (const BoxPair& first : pair_.first_pairs()) push(time, first.a, first.b);
  return search();
}

template <typename Pair>
ToiResult BestFirstSearch<Pair>::resume() {
  // Where the sides were, so that the search continues with the same bits.
  pair_.set_time(memory_.standing_time);
  memory_.is_unfinished = false;
  return search();
}

template <typename Pair>
ToiResult BestFirstSearch<Pair>::search() {
  RadixQueue& queue = memory_.queue;
  ToiStatistics& work = result_.statistics;
  while (!queue.is_empty()) {
    work.peak_queue = std::max(work.peak_queue, queue.size());
    QueuedPair pair = queue.pop();
    DYOP_ASSERT(pair.time >= pair_.time(), pair.time, ' ', pair_.time());
    // A pair whose search for a nearer one continues was counted before.
    if (!memory_.is_seeking_nearer) {
      if (const auto status = interruption_.after(work.node_pairs)) {
        return finish_undecided(*status, pair);
      }
      ++work.node_pairs;
    }
    const bool is_far = (pair.b & kFarFlag) != 0;
    pair.b &= ~kFarFlag;
    if (is_far || !pair_.is_leaf_pair(pair)) {
      examine_boxes(pair, is_far);
      continue;
    }
    if (pair.time != pair_.time()) pair_.set_time(pair.time);
    switch (examine_leaves(pair)) {
      case Verdict::GoOn:
        break;
      case Verdict::TooCloseAtBegin:
        return finish(ToiStatus::InitiallyWithinTarget, pair.time);
      case Verdict::Stuck:
        return finish(ToiStatus::NumericalLimit, pair.time);
      case Verdict::Interrupted:
        return finish_undecided(interruption_.status().value(), pair);
      case Verdict::Impact:
        return finish_impact(pair);
    }
  }
  return finish(ToiStatus::Separated, interval_.end);
}

// Advances a pair of boxes in time, or replaces it by the pairs of the larger box's parts with the
// other box.
template <typename Pair>
void BestFirstSearch<Pair>::examine_boxes(const QueuedPair& pair, bool is_far) {
  if (!is_far) pair_.fetch_parts(pair);  // while set_time() runs
  // What is proven from an earlier time on holds too, and keys never fall below the pair's own.
  if (pair.time != pair_.time() && !pair_.may_stand_still(pair)) pair_.set_time(pair.time);
  const auto step_to = [&](Scalar step) { return std::max(pair.time, pair_.time() + step); };
  if (is_far) {
    ++result_.statistics.box_tests;
    pair_.advance(pair, [&](Scalar step, bool is_still_far) {
      const Scalar time = step_to(step);
      // A step too short for its time must not come back as a far pair.
      const bool is_flagged = is_still_far && time > pair.time;
      push(time, pair.a, is_flagged ? pair.b | kFarFlag : pair.b);
    });
    return;
  }
  result_.statistics.box_tests +=
      pair_.open(pair, [&](std::int32_t a, std::int32_t b, Scalar step, bool is_part_far) {
        push(step_to(step), a, is_part_far ? b | kFarFlag : b);
      });
}

// --- leaves -------------------------------------------------------------------------------------

template <typename Pair>
typename BestFirstSearch<Pair>::Verdict BestFirstSearch<Pair>::examine_leaves(
    const QueuedPair& pair) {
  ++result_.statistics.leaf_tests;
  const Scalar noise = pair_.noise();
  // Far away a rough distance is enough for a step.
  const PieceDistance piece =
      measure(pair, {.apart = band_.largest_impact + 4 * noise, .share = kRoughShare});
  DYOP_ASSERT(piece.lower <= piece.upper, piece.lower, ' ', piece.upper);
  // A pair this close at the start was never proven apart. Later it can be this close only by
  // rounding, and its time was proven safe.
  if (pair_.time() == interval_.begin && !(piece.lower > band_.guaranteed)) {
    return examine_start(pair, piece);
  }
  const bool is_near = piece.upper <= band_.largest_impact + noise;
  const bool is_in_contact = piece.upper <= band_.contact + noise;
  const bool is_approaching = is_near && pair_.is_closing(piece, pair);
  if (is_approaching && is_in_contact) {
    const std::optional<bool> is_impact = is_nearest(piece);
    if (!is_impact) return Verdict::Interrupted;
    if (*is_impact) {
      result_.contact = make_contact(piece, pair);
      return Verdict::Impact;
    }
  }
  const bool is_resting = is_near && (is_in_contact || !is_approaching);
  memory_.has_resting_pair |= is_resting;
  const Scalar least = is_resting ? band_.resting_target(piece.lower, noise) : band_.leaf_target;
  const Scalar next = pair_.time() + pair_.leaf_step(piece, pair, least);
  if (!(next > pair_.time())) {
    result_.contact = make_contact(piece, pair);
    return is_near ? Verdict::Impact : Verdict::Stuck;
  }
  push(next, pair.a, pair.b);
  return Verdict::GoOn;
}

// Two leaves too close at the start, or not known to be apart there. The rounding allowance of the
// query grows with speeds; that of the poses at the start does not.
template <typename Pair>
typename BestFirstSearch<Pair>::Verdict BestFirstSearch<Pair>::examine_start(
    const QueuedPair& pair, const PieceDistance& piece) {
  PieceDistance at_start = piece;
  if (!(piece.upper <= band_.largest_impact)) {
    const GjkGoal exact{.apart = kInfinity};
    at_start = pair_.measure(pair, pair_.start_noise(), exact, memory_.seed);
  }
  result_.contact = make_contact(at_start, pair);
  // Bounds wider than the tolerance cannot tell near from far; nor can NaN.
  const bool is_within =
      at_start.upper <= band_.largest_impact && !(at_start.lower > band_.guaranteed);
  return is_within ? Verdict::TooCloseAtBegin : Verdict::Stuck;
}

// Bodies that slide along each other keep the distance they have where they touch. The neighbouring
// faces and edges come nearer until they take over: they do not collide. And at the start nothing
// is proven about pairs not yet measured: a nearer one may be too close. Nothing if the search must
// end before that is known.
template <typename Pair>
std::optional<bool> BestFirstSearch<Pair>::is_nearest(const PieceDistance& piece) {
  // No pair was in contact before, or could have been.
  if (!memory_.has_resting_pair && pair_.time() > interval_.begin) return true;
  if (pair_.is_single_leaf_pair()) return true;
  auto nearer = pair_.nearer_search(piece.upper, memory_.box_pairs);
  // Most of the rounding comes from the poses, which all pairs of pieces share.
  nearer.sought_middle = piece.middle();
  if (memory_.is_seeking_nearer) {
    nearer.best = memory_.nearer;
  } else {
    nearer.start();
  }
  ToiStatistics& work = result_.statistics;
  const std::int64_t before = work.node_pairs;
  bool is_through = false;
  do {
    is_through = nearer.run_portion(interruption_.portion(work.node_pairs));
    work.node_pairs = before + nearer.box_pairs;
  } while (!is_through && !interruption_.after(work.node_pairs));
  work.box_tests += nearer.statistics.box_tests;
  work.leaf_tests += nearer.statistics.leaf_tests;
  memory_.is_seeking_nearer = !is_through;
  memory_.nearer = nearer.best;
  if (!is_through) return std::nullopt;
  // After the start, only rounding can make pieces overlap.
  if (nearer.best.is_overlapping) return pair_.time() > interval_.begin;
  return !(nearer.best.middle() < piece.middle());
}

// --- results ------------------------------------------------------------------------------------

// Probes along the motion in doubling steps until the pair in contact is proven nearer than its
// steps aim at.
template <typename Pair>
std::optional<Scalar> BestFirstSearch<Pair>::probe_hit(const QueuedPair& pair,
                                                       const ToiResult& impact) {
  constexpr int kProbes = 12;
  const ImpactContact& contact = *impact.contact;
  if (!(contact.closing_speed > 0)) return std::nullopt;
  const Scalar below = band_.leaf_target;
  // Either above it or below it.
  const GjkGoal goal{.apart = below, .share = kInfinity, .hit = below - 2 * pair_.noise()};
  const Scalar begin = pair_.time();
  // At the start the gap may already be below it.
  const Scalar distance = std::max(contact.upper - below, band_.tolerance / 8);
  // literal: a little longer than to the target, so that the first probe is usually below it.
  Scalar step = 1.25 * distance / contact.closing_speed;
  for (int probe = 0; probe < kProbes && begin + step <= interval_.end; ++probe, step *= 2) {
    if (!(begin + step > begin)) continue;
    pair_.set_time(begin + step);
    if (pair_.witness_distance(impact) < below) return pair_.time();
    const PieceDistance piece = measure(pair, goal);
    if (piece.upper < below || piece.is_overlapping) return pair_.time();
  }
  return std::nullopt;
}

template <typename Pair>
ToiResult BestFirstSearch<Pair>::finish(ToiStatus status, Scalar t_safe) {
  DYOP_ASSERT(t_safe >= interval_.begin && t_safe <= interval_.end, t_safe);
  result_.status = status;
  result_.t_safe = t_safe;
  result_.rounding_allowance = pair_.noise();
  std::tie(result_.X_WA, result_.X_WB) = pair_.poses(t_safe);
  if (status == ToiStatus::Impact && options_.with_contacts) {
    // Never empty: it contains the contact that ended the search.
    const Scalar reach = result_.contact->upper + band_.tolerance + pair_.noise();
    result_.contacts = pair_.contacts_within(reach);
  }
  return std::move(result_);
}

template <typename Pair>
ToiResult BestFirstSearch<Pair>::finish_impact(const QueuedPair& pair) {
  ToiResult result = finish(ToiStatus::Impact, pair.time);
  result.t_hit = probe_hit(pair, result);
  return result;
}

// Puts the pair back, so that the search can be resumed with it.
template <typename Pair>
ToiResult BestFirstSearch<Pair>::finish_undecided(ToiStatus status, const QueuedPair& pair) {
  memory_.queue.push(pair);
  memory_.is_unfinished = true;
  memory_.standing_time = pair_.time();
  return finish(status, pair.time);
}

// A solid contains a part of the other shape at the start, whatever the distance of the surfaces.
template <typename Pair>
ToiResult BestFirstSearch<Pair>::finish_enclosed(const Vector3& p_W) {
  result_.contact.emplace();
  result_.contact->p_WCa = result_.contact->p_WCb = p_W;
  return finish(ToiStatus::InitiallyWithinTarget, interval_.begin);
}

template class BestFirstSearch<RigidPair>;
template class BestFirstSearch<DeformingPair<DeformingSide>>;
template class BestFirstSearch<DeformingPair<RigidSide>>;

}  // namespace dyop::toi_internal
