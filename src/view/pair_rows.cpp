// SPDX-License-Identifier: BSD-3-Clause
#include "view/pair_rows.h"

#include <algorithm>

namespace dyop::view_internal {

void add_pair(const PairRecord& pair, const TimeInterval& frame, PageSpan& span) {
  const bool is_resting = pair.proof == ProofKind::AtRest;
  PageGap gap;
  gap.t = frame.end;
  gap.a = pair.a;
  gap.b = pair.b;
  gap.lower = pair.gap_lower;
  // A pair without contacts may not have been measured.
  if (pair.gap_upper >= pair.gap_lower) gap.upper = pair.gap_upper;
  gap.is_resting = is_resting;
  gap.proof = pair.proof;
  gap.pivot_W = pair.pivot_W;
  const auto nearest = std::ranges::min_element(
      pair.contacts, {}, [](const PairContact& contact) { return contact.point.gap; });
  if (nearest != pair.contacts.end()) {
    gap.witness_W = {nearest->point.p_WCa, nearest->point.p_WCb};
  }
  span.gaps.push_back(gap);
  for (const PairContact& contact : pair.contacts) {
    const ContactPoint& point = contact.point;
    span.contacts.push_back({frame, pair.a, pair.b, is_resting, (point.p_WCa + point.p_WCb) / 2,
                             point.nhat_AB_W, contact.impulse_W, point.gap});
  }
}

void add_witness(PageGap& gap, const Shape& a, const RigidPose& X_WA, const Shape& b,
                 const RigidPose& X_WB, DistanceCache& cache) {
  const DistanceResult result = distance(a, X_WA, b, X_WB, {}, cache);
  gap.lower = std::max(gap.lower, result.lower);
  gap.upper = result.upper;
  gap.witness_W = {result.p_WCa, result.p_WCb};
}

void place_impact(ImpactEvent& event, const Shape& a, const RigidPose& X_WA, const Shape& b,
                  const RigidPose& X_WB) {
  if (!event.toi.contact) return;
  const DistanceResult result = distance(a, X_WA, b, X_WB);
  if (result.status != DistanceStatus::Separated) return;
  static_cast<WitnessPair&>(*event.toi.contact) = result;
  event.toi.X_WA = X_WA;
  event.toi.X_WB = X_WB;
}

const char* undecided_words(AdvanceStatus status) {
  switch (status) {
    case AdvanceStatus::BudgetExhausted:
      return "budget exhausted";
    case AdvanceStatus::NumericalLimit:
      return "numerical limit";
    case AdvanceStatus::Blocked:
      return "blocked by bodies on given motions";
    case AdvanceStatus::Cancelled:
      return "cancelled";
    case AdvanceStatus::NotRun:
    case AdvanceStatus::Completed:
    case AdvanceStatus::StoppedAtImpact:
      return nullptr;
  }
  return nullptr;
}

const char* ending_words(AdvanceStatus status, Scalar t, Scalar planned_end) {
  switch (status) {
    case AdvanceStatus::NotRun:
      return "nothing was run";
    case AdvanceStatus::Completed:
      return t >= planned_end ? "it reached its planned end"
                              : "it was ended before its planned end, with everything proven";
    case AdvanceStatus::StoppedAtImpact:
      return "it stops at impacts, as asked";
    case AdvanceStatus::BudgetExhausted:
      return "its budget or deadline was used up";
    case AdvanceStatus::NumericalLimit:
      return "rounding forbids the distances asked for";
    case AdvanceStatus::Blocked:
      return "bodies or friction left no way to go on";
    case AdvanceStatus::Cancelled:
      return "it was stopped by its user";
  }
  return "not known";
}

}  // namespace dyop::view_internal
