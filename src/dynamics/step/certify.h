// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <optional>
#include <stop_token>

#include "dynamics/step/ledger.h"
#include "dynamics/step/track.h"
#include "dyop/core/interrupt.h"
#include "dyop/dynamics/advance_report.h"
#include "dyop/toi/time_of_impact.h"

namespace dyop::dynamics_internal {

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
  std::optional<ToiResult> result;  // of the query, if one was made
  Scalar closing = 0;               // bound on how much the gap shrinks over the interval
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
