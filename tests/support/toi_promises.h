#pragma once

#include <algorithm>
#include <cmath>

#include "core/tolerance.h"
#include "dyop/toi/toi_batch.h"
#include "support/toi_oracle.h"

/// Checks every promise of ToiResult on one answer, for fuzzing and recorded queries.
namespace dyop::testing {

/// Returns which promise is broken by the fields alone, or nullptr.
inline const char* broken_form(const ToiQuery& query, const ToiResult& result) {
  const bool has_contact =
      result.status == ToiStatus::Impact || result.status == ToiStatus::InitiallyWithinTarget;
  const bool lists_contacts = result.status == ToiStatus::Impact && query.options.with_contacts;
  if (!query.interval.contains(result.t_safe)) return "t_safe is not in the interval";
  if (result.statistics.node_pairs > query.options.max_node_pairs) return "the budget is exceeded";
  if (!(result.rounding_allowance >= 0)) return "the rounding allowance is negative or NaN";
  if (result.status == ToiStatus::NotRun || result.status == ToiStatus::Cancelled) {
    return "the status is one that cannot occur";
  }
  if (result.status == ToiStatus::Separated && result.t_safe != query.interval.end) {
    return "Separated, but not up to the end";
  }
  if (result.status == ToiStatus::InitiallyWithinTarget && result.t_safe != query.interval.begin) {
    return "InitiallyWithinTarget, but not at the begin";
  }
  if (has_contact && !result.contact) return "an impact without a contact";
  if (result.contacts.empty() == lists_contacts) return "contacts do not come with the impact";
  if (result.t_hit && !(*result.t_hit > result.t_safe && *result.t_hit <= query.interval.end)) {
    return "t_hit is not after t_safe, or after the end";
  }
  if (!result.contact) return nullptr;
  const ImpactContact& contact = *result.contact;
  if (!(contact.lower <= contact.upper)) return "the contact's bounds cross";
  if (!contact.p_WCa.allFinite() || !contact.p_WCb.allFinite()) return "a witness is not finite";
  if (!(std::abs(contact.nhat_AB_W.norm() - 1) <= 64 * kUnitRoundoff)) return "normal is not unit";
  return nullptr;
}

/// Compares an answer with the oracle's distances at sampled times.
class ToiJudge {
 public:
  explicit ToiJudge(const ToiQuery& query)
      : query_(query), a_(*query.a), b_(*query.b), oracle_(a_, *query.X_WA, b_, *query.X_WB) {}

  /// Returns which promise on distances is broken, or nullptr.
  const char* broken_distance(const ToiResult& result, int samples) {
    const Scalar begin = query_.interval.begin;
    const Scalar target = query_.options.target_distance;
    const Scalar epsilon = query_.options.distance_tolerance;
    const Scalar lost = target + kLostFraction * epsilon;
    const Scalar allowance = result.rounding_allowance;
    if (result.status == ToiStatus::InitiallyWithinTarget) {
      // The oracle knows no solid meshes.
      if (query_.options.solid_a || query_.options.solid_b) return nullptr;
      const bool is_within = distance_at(begin).lower <= lost + allowance + noise(begin);
      return is_within ? nullptr : "InitiallyWithinTarget, but begins apart";
    }
    const bool is_proven =
        result.status == ToiStatus::Separated || result.status == ToiStatus::Impact;
    // Where an undecided query ends at the begin, nothing is known.
    if (!is_proven && result.t_safe == begin) return nullptr;
    for (int k = 0; k <= samples; ++k) {
      const Scalar t = k == samples
                           ? result.t_safe
                           : std::min(begin + (result.t_safe - begin) * k / samples, result.t_safe);
      if (distance_at(t).upper + noise(t) < lost - allowance) return "an impact was missed";
    }
    if (result.status != ToiStatus::Impact) return nullptr;
    const Scalar nearest = distance_at(result.t_safe).lower;
    const bool is_near = nearest <= target + epsilon + allowance + noise(result.t_safe);
    return is_near ? nullptr : "an impact that is none";
  }

 private:
  DistanceBracket distance_at(Scalar t) {
    return oracle_.distance_at(t, query_.options.distance_tolerance / 16);
  }

  // Rounding of the oracle, as stated at fast_oracle_distance().
  Scalar noise(Scalar t) const {
    const Vector3 p_AB_W = query_.X_WB->pose(t).translation() - query_.X_WA->pose(t).translation();
    const Scalar size = a_.radius() + b_.radius();
    return 0x1p-38 * size + 1024 * kUnitRoundoff * (size + p_AB_W.norm());
  }

  const ToiQuery query_;
  const OracleBody a_;
  const OracleBody b_;
  ToiOracle oracle_;
};

}  // namespace dyop::testing
