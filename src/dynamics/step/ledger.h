// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "dynamics/pair_state.h"
#include "dyop/core/time_interval.h"
#include "dyop/toi/toi_result.h"

namespace dyop::dynamics_internal {

/// Evidence that a pair kept its distance over an interval. Only the functions below create one.
class PairProof {
 public:
  PairKey key() const { return key_; }
  const TimeInterval& interval() const { return interval_; }
  ProofKind kind() const { return kind_; }

  /// The gap at the start, minus all that can be closed, exceeds the distance to keep.
  static std::optional<PairProof> by_bound(const PairState& pair, const TimeInterval& interval,
                                           Scalar gap_lower, Scalar closing, Scalar kept);
  /// The query found no impact in an interval that contains this one.
  static std::optional<PairProof> by_query(const PairState& pair, const TimeInterval& interval,
                                           const ToiResult& result);
  /// Neither body moved, and their poses were proven before.
  static PairProof at_rest(PairKey key, const TimeInterval& interval);
  /// For a pair that began too near, which is reported.
  static PairProof excused(PairKey key, const TimeInterval& interval);

 private:
  PairProof(PairKey key, const TimeInterval& interval, ProofKind kind)
      : key_(key), interval_(interval), kind_(kind) {}
  PairKey key_;
  TimeInterval interval_;
  ProofKind kind_;
};

/// The complete proofs of a step: for every candidate pair they cover the whole interval without a
/// gap. The only way to commit a step is with a Ledger.
class Ledger {
 public:
  struct Entry {
    PairKey key;
    ProofKind kind = ProofKind::AtRest;  // the weakest of the pair's proofs
  };

  /// @param candidates Sorted.
  /// @throws InternalError naming the pair and the time from which on nothing is proven.
  Ledger(const TimeInterval& interval, std::span<const PairKey> candidates,
         std::vector<PairProof> proofs);

  const TimeInterval& interval() const { return interval_; }
  std::span<const Entry> entries() const { return entries_; }

 private:
  TimeInterval interval_;
  std::vector<Entry> entries_;
};

}  // namespace dyop::dynamics_internal
