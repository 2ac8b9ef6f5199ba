// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "dynamics/pair_state.h"
#include "dynamics/step/track.h"
#include "dyop/core/batch_options.h"
#include "dyop/core/time_interval.h"
#include "dyop/dynamics/advance_report.h"
#include "dyop/toi/time_of_impact.h"
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

/// Limits on the queries of a step.
struct QueryLimits {
  std::int64_t max_node_pairs = 0;
  std::stop_token stop;
  std::optional<std::chrono::steady_clock::time_point> deadline;

  bool is_late() const { return deadline && std::chrono::steady_clock::now() >= *deadline; }
  /// As what a step ends that the caller wants to end now.
  std::optional<AdvanceStatus> exceeded() const;
};

/// Ends the parts of a step that take long when the caller wants that.
class LimitInterrupt final : public Interrupt {
 public:
  explicit LimitInterrupt(const QueryLimits& limits) : limits_(limits) {}
  bool is_over() override { return limits_.exceeded().has_value(); }

 private:
  const QueryLimits& limits_;
};

/// Either a proof over the whole interval, or the query's result instead.
struct Certificate {
  std::optional<PairProof> proof;
  std::unique_ptr<const ToiResult> result;  // of the query, if one was made: few pairs need one
  Scalar closing = 0;                       // bound on how much the gap shrinks over the interval
};

/// Proves that a pair stays farther apart than `kept`, trying the cheapest proof first: it is at
/// rest; its known gap exceeds what can be closed; its gap measured anew does; no impact is found.
/// A pair that began too near keeps part of its gap, see PairState::uncertified_gap.
Certificate certify(PairState& pair, const BodyMove& a, const BodyMove& b,
                    const TimeInterval& interval, Scalar kept, const QueryLimits& limits,
                    ToiWorkspace& workspace);

/// Allowance for rounding at the scale of a pair.
Scalar pair_noise(const BodyMove& a, const BodyMove& b);

/// What the end of a query without a proof means for a step; none for an impact, which is answered.
std::optional<AdvanceStatus> failure_of(ToiStatus status);

void add(ToiStatistics& sum, const ToiStatistics& part);

}  // namespace dyop::dynamics_internal
