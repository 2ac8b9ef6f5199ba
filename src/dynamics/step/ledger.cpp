// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/ledger.h"

#include <algorithm>

#include "dyop/core/error.h"

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

}  // namespace dyop::dynamics_internal
