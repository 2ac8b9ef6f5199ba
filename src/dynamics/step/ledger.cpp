// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/ledger.h"

#include <algorithm>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "toi/rigid/rigid_pair.h"
#include "toi/toi_memory.h"

namespace dyop::dynamics_internal {
namespace {

// Ranks proofs from strong to weak; several proofs of a pair are reported as the weakest.
int weakness(ProofKind kind) {
  switch (kind) {
    case ProofKind::AtRest:
      return 0;
    case ProofKind::ByBound:
      return 1;
    case ProofKind::ByQuery:
      return 2;
    case ProofKind::Excused:
      return 3;
  }
  return 3;
}

}  // namespace

std::optional<PairProof> PairProof::by_bound(const PairState& pair, const TimeInterval& interval,
                                             Scalar gap_lower, Scalar closing, Scalar kept) {
  // Also false for NaN.
  if (!(gap_lower - closing > kept)) return std::nullopt;
  return PairProof(pair.key, interval, ProofKind::ByBound);
}

std::optional<PairProof> PairProof::by_query(const PairState& pair, const TimeInterval& interval,
                                             const ToiResult& result) {
  const bool holds = result.status == ToiStatus::Separated ||
                     (result.status == ToiStatus::Impact && result.t_safe >= interval.end);
  if (!holds) return std::nullopt;
  return PairProof(pair.key, interval,
                   pair.uncertified_gap ? ProofKind::Excused : ProofKind::ByQuery);
}

PairProof PairProof::at_rest(PairKey key, const TimeInterval& interval) {
  return PairProof(key, interval, ProofKind::AtRest);
}

PairProof PairProof::excused(PairKey key, const TimeInterval& interval) {
  return PairProof(key, interval, ProofKind::Excused);
}

Ledger::Ledger(const TimeInterval& interval, std::span<const PairKey> candidates,
               std::vector<PairProof> proofs)
    : interval_(interval) {
  const auto is_before = [](const PairProof& x, const PairProof& y) {
    if (x.key() != y.key()) return x.key() < y.key();
    return x.interval().begin < y.interval().begin;
  };
  // Where nothing moves they come in order.
  if (!std::is_sorted(proofs.begin(), proofs.end(), is_before)) {
    std::stable_sort(proofs.begin(), proofs.end(), is_before);
  }
  entries_.reserve(candidates.size());
  std::size_t next = 0;
  for (const PairKey& key : candidates) {
    while (next < proofs.size() && proofs[next].key() < key) ++next;
    Scalar proven = interval.begin;
    ProofKind kind = ProofKind::AtRest;
    for (; next < proofs.size() && proofs[next].key() == key; ++next) {
      if (proofs[next].interval().begin > proven) break;
      proven = std::max(proven, proofs[next].interval().end);
      if (weakness(proofs[next].kind()) > weakness(kind)) kind = proofs[next].kind();
    }
    if (!(proven >= interval.end)) {
      throw InternalError(compose_message("World: the pair ", key.a, ", ", key.b,
                                          " is not proven from t = ", proven, " to ",
                                          interval.end));
    }
    entries_.push_back({key, kind});
  }
}

namespace {

// How far apart the bounds of a gap may stay that only serves as a proof, relative to it. Where
// surfaces run beside each other, as those of two links do, the exact distance costs several times
// as much.
constexpr Scalar kRoughGap = 0.2;

// Nothing is left that could meet.
ToiResult apart(const BodyMove& a, const BodyMove& b, const TimeInterval& interval) {
  ToiResult result;
  result.status = ToiStatus::Separated;
  result.t_safe = interval.end;
  result.X_WA = a.motion->pose(interval.end);
  result.X_WB = b.motion->pose(interval.end);
  result.rounding_allowance = pair_noise(a, b);
  return result;
}

// Begins where the pair's last query of distance or impact ended, and is followed by the next.
ToiResult query(PairState& pair, const BodyMove& a, const BodyMove& b, const TimeInterval& interval,
                Scalar target, Scalar tolerance, const QueryLimits& limits,
                ToiWorkspace& workspace) {
  const Shape& shape_a = *a.body->definition.shape;
  const Shape& shape_b = *b.body->definition.shape;
  const RigidPose X_WA = a.motion->pose(interval.begin);
  const RigidPose X_WB = b.motion->pose(interval.begin);
  const bool moves_a = pair.neighbours.moves_a();
  NearBound near = approach_bound(moves_a ? b : a, moves_a ? a : b, interval,
                                  (moves_a ? X_WB : X_WA) * pair.neighbours.pivot_F());
  const Scalar least = target + tolerance + pair_noise(a, b);
  near.reach += least;
  const bool is_listed = pair.list_near(shape_a, X_WA, shape_b, X_WB, near);
  const auto chords = is_listed ? chord_motion(a, b, interval) : std::nullopt;
  if (chords) {
    const Scalar noise = pose_noise(shape_a, X_WA, shape_b, X_WB);
    pair.directions.keep_unproven(shape_a, shape_b, *chords, least, noise, pair.first_pairs);
    if (pair.first_pairs.empty()) return apart(a, b, interval);
  }
  const std::span<const BoxPair> first_pairs =
      is_listed ? std::span<const BoxPair>(pair.first_pairs) : std::span(&kRootPair, 1);
  ToiOptions options;
  options.target_distance = target;
  options.distance_tolerance = tolerance;
  options.max_node_pairs = limits.max_node_pairs;
  options.stop = limits.stop;
  options.deadline = limits.deadline;
  ToiMemory& memory = workspace.memory();
  memory.start = pair.seed.supports;
  ToiResult result = time_of_listed_impact(shape_a, *a.motion, shape_b, *b.motion, interval,
                                           options, workspace, first_pairs);
  if (memory.seed.count > 0) pair.seed.supports = memory.seed;
  return result;
}

// A pair that began too near becomes an ordinary one again once it is far enough apart.
void release(PairState& pair, const BodyMove& a, const RigidPose& X_WA, const BodyMove& b,
             const RigidPose& X_WB) {
  if (!pair.uncertified_gap && !pair.overlaps) return;
  const Scalar enough = pair.lengths.target + pair.lengths.tolerance() / 2;
  measure_gap(pair, *a.body, X_WA, *b.body, X_WB, enough);
  if (pair.gap_lower > enough) {
    pair.uncertified_gap.reset();
    pair.overlaps = false;
  } else if (pair.overlaps && pair.gap_lower > 0) {
    pair.overlaps = false;
    pair.uncertified_gap = pair.gap_lower / 2;
  }
}

}  // namespace

std::optional<AdvanceStatus> QueryLimits::exceeded() const {
  if (stop.stop_requested()) return AdvanceStatus::Cancelled;
  if (is_late()) return AdvanceStatus::BudgetExhausted;
  return std::nullopt;
}

Scalar pair_noise(const BodyMove& a, const BodyMove& b) {
  // Of a half-space what matters is where the other body is. Points are given from the origin of
  // the body's frame.
  const auto radius = [](const BodyMove& move) {
    const BodyDefinition& body = move.body->definition;
    const HalfSpace* half_space = as_half_space(*body.shape);
    if (half_space) return std::abs(half_space->offset());
    return move.body->radius + body.mass_properties.p_BoBcm.norm();
  };
  return kStepNoise * (a.center.norm() + b.center.norm() + radius(a) + radius(b));
}

std::optional<AdvanceStatus> failure_of(ToiStatus status) {
  switch (status) {
    case ToiStatus::Impact:
      return std::nullopt;
    case ToiStatus::Separated:
    case ToiStatus::InitiallyWithinTarget:
    case ToiStatus::NumericalLimit:
      return AdvanceStatus::NumericalLimit;
    case ToiStatus::BudgetExhausted:
      return AdvanceStatus::BudgetExhausted;
    case ToiStatus::NotRun:
    case ToiStatus::Cancelled:
      break;
  }
  return AdvanceStatus::Cancelled;
}

void add(ToiStatistics& sum, const ToiStatistics& part) {
  sum.box_tests += part.box_tests;
  sum.leaf_tests += part.leaf_tests;
  sum.node_pairs += part.node_pairs;
  sum.peak_queue = std::max(sum.peak_queue, part.peak_queue);
}

namespace {

// With enough to spare that a query can start where the bound ends.
Scalar floor_of(const PairState& pair, const BodyMove& a, const BodyMove& b, Scalar kept) {
  return std::max(kept, pair.kept_distance()) + pair.lengths.tolerance() / 2 + pair_noise(a, b);
}

std::optional<PairProof> proof_by_bound(const PairState& pair, const BodyMove& a, const BodyMove& b,
                                        const TimeInterval& interval, Scalar kept, Scalar closing) {
  return PairProof::by_bound(pair, interval, pair.gap_lower, closing, floor_of(pair, a, b, kept));
}

}  // namespace

Certificate certify(PairState& pair, const BodyMove& a, const BodyMove& b,
                    const TimeInterval& interval, Scalar kept, const QueryLimits& limits,
                    ToiWorkspace& workspace) {
  Certificate certificate;
  if (a.is_rest && b.is_rest) {
    certificate.proof = PairProof::at_rest(pair.key, interval);
    return certificate;
  }
  certificate.closing = closing_bound(a, b, interval);
  // Most pairs need no pose.
  if (!pair.uncertified_gap && !pair.overlaps) {
    certificate.proof = proof_by_bound(pair, a, b, interval, kept, certificate.closing);
    if (certificate.proof) return certificate;
  }
  const RigidPose X_WA = a.motion->pose(interval.begin);
  const RigidPose X_WB = b.motion->pose(interval.begin);
  const Scalar tolerance = pair.lengths.tolerance();
  release(pair, a, X_WA, b, X_WB);
  if (pair.overlaps) {
    certificate.proof = PairProof::excused(pair.key, interval);
    return certificate;
  }
  const auto by_bound = [&] {
    return proof_by_bound(pair, a, b, interval, kept, certificate.closing);
  };
  certificate.proof = by_bound();
  if (certificate.proof) return certificate;
  // It may just have become an ordinary pair; hold it to the ordinary distance.
  kept = std::max(kept, pair.kept_distance());
  const Scalar floor = floor_of(pair, a, b, kept);
  // Skip measuring when a known contact already rules out a proof by bound.
  const bool is_near = pair.gap_lower >= 0 && pair.shortest_gap() - certificate.closing <= floor;
  if (!is_near) {
    // A gap that would suffice as proof, with something left over for the next steps.
    measure_gap(pair, *a.body, X_WA, *b.body, X_WB, floor + 4 * certificate.closing, kRoughGap);
    certificate.proof = by_bound();
    if (certificate.proof) return certificate;
  }

  ToiResult result = query(
      pair, a, b, interval, pair.uncertified_gap ? std::min(kept, *pair.uncertified_gap) : kept,
      pair.uncertified_gap ? std::min(tolerance, *pair.uncertified_gap / 4) : tolerance, limits,
      workspace);
  if (result.status == ToiStatus::InitiallyWithinTarget && kept <= pair.lengths.target) {
    if (pair.gap_lower > 0) {
      pair.uncertified_gap = pair.gap_lower / 2;
      result = query(pair, a, b, interval, *pair.uncertified_gap, *pair.uncertified_gap / 4, limits,
                     workspace);
    } else {
      pair.overlaps = true;
      certificate.proof = PairProof::excused(pair.key, interval);
      return certificate;
    }
  }
  certificate.proof = PairProof::by_query(pair, interval, result);
  certificate.result = std::make_unique<const ToiResult>(std::move(result));
  return certificate;
}

}  // namespace dyop::dynamics_internal
