// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <stop_token>

#include "dynamics/step/ledger.h"
#include "dynamics/step/track.h"
#include "dyop/dynamics/advance_report.h"
#include "dyop/toi/time_of_impact.h"

namespace dyop::internal {

/// Limits of the queries of a step.
struct QueryLimits {
  std::int64_t max_node_pairs = 0;
  std::stop_token stop;
};

/// Either a proof over the whole interval, or what the query says instead.
struct Certificate {
  std::optional<PairProof> proof;
  std::optional<ToiResult> result;  // of the query, if there was one
  Scalar closing = 0;               // what the gap may have lost over the interval
};

/// Proves that a pair stays farther apart than `kept`, the cheapest proof first: it rests; its
/// known gap exceeds what can be closed; its gap measured anew does; no impact is found. A pair
/// that begins too near is granted part of its gap, see PairState::granted.
Certificate certify(PairState& pair, const BodyMove& a, const BodyMove& b,
                    const TimeInterval& interval, Scalar kept, const QueryLimits& limits,
                    ToiWorkspace& workspace);

/// Allowance for rounding at the size of a pair.
Scalar pair_noise(const BodyMove& a, const BodyMove& b);

/// What the end of a query without a proof means for a step; none for an impact, which is answered.
std::optional<AdvanceStatus> failure_of(ToiStatus status);

void add(ToiStatistics& sum, const ToiStatistics& part);

}  // namespace dyop::internal
