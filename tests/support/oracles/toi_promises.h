// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "core/tolerance.h"
#include "dyop/toi/time_of_impact.h"
#include "dyop/toi/vertex_time_of_impact.h"
#include "support/oracles/toi_oracle.h"

/// The checker of the table at ToiStatus, cell by cell, for every kind of query.
namespace dyop::testing {

/// The options of a query with its tolerance in place of the default.
inline ToiOptions in_full(const ToiQuery& query) {
  ToiOptions options = query.options;
  if (!options.distance_tolerance) {
    options.distance_tolerance = default_distance_tolerance(*query.a, *query.b);
  }
  return options;
}

/// What the table is about, of one query.
struct PromiseTerms {
  TimeInterval interval;
  Scalar target_distance = 0;
  Scalar distance_tolerance = 0;
  bool with_contacts = false;
  bool has_solids = false;
  bool is_exact = false;  ///< ContactRule::Exact

  PromiseTerms(const TimeInterval& the_interval, const ToiOptions& options)
      : interval(the_interval),
        target_distance(options.target_distance),
        distance_tolerance(options.distance_tolerance.value()),
        with_contacts(options.with_contacts),
        has_solids(options.solid_a || options.solid_b) {}
  PromiseTerms(const TimeInterval& the_interval, const VertexToiOptions& options)
      : interval(the_interval),
        target_distance(options.target_distance),
        distance_tolerance(options.distance_tolerance.value()),
        is_exact(options.contact_rule == ContactRule::Exact) {}

  Scalar guaranteed() const { return target_distance + kGuaranteedFraction * distance_tolerance; }
  Scalar leaf_target() const { return target_distance + kLeafTargetFraction * distance_tolerance; }
  Scalar largest_impact() const { return target_distance + distance_tolerance; }
};

/// Returns what is wrong with a contact by itself, or nullptr.
inline const char* broken_contact(const WitnessPair& contact) {
  if (!(contact.lower <= contact.upper)) return "the contact's bounds cross";
  if (!contact.p_WCa.allFinite() || !contact.p_WCb.allFinite()) return "a witness is not finite";
  if (!(std::abs(contact.nhat_AB_W.norm() - 1) <= 64 * kUnitRoundoff)) return "normal is not unit";
  return nullptr;
}

/// Column t_safe.
inline const char* broken_end(const PromiseTerms& terms, ToiStatus status, Scalar t_safe) {
  if (!terms.interval.contains(t_safe)) return "t_safe is not in the interval";
  switch (status) {
    case ToiStatus::Separated:
      return t_safe == terms.interval.end ? nullptr : "Separated, but not up to the end";
    case ToiStatus::NotRun:
    case ToiStatus::InitiallyWithinTarget:
      return t_safe == terms.interval.begin ? nullptr : "t_safe is not the start of the interval";
    case ToiStatus::Impact:
    case ToiStatus::BudgetExhausted:
    case ToiStatus::Cancelled:
    case ToiStatus::NumericalLimit:
      return nullptr;
  }
  return "the status is none";
}

/// Column contact.
inline bool has_contact(ToiStatus status) {
  switch (status) {
    case ToiStatus::Impact:
    case ToiStatus::InitiallyWithinTarget:
    case ToiStatus::NumericalLimit:
      return true;
    case ToiStatus::NotRun:
    case ToiStatus::Separated:
    case ToiStatus::BudgetExhausted:
    case ToiStatus::Cancelled:
      return false;
  }
  return false;
}

/// Which cell is broken by what `result` says by itself, or nullptr.
template <typename Result>
const char* broken_form(const PromiseTerms& terms, const Result& result) {
  const bool is_impact = result.status == ToiStatus::Impact;
  if (const char* const broken = broken_end(terms, result.status, result.t_safe)) return broken;
  if (!(result.rounding_allowance >= 0)) return "the rounding allowance is negative or NaN";
  if (result.contact.has_value() != has_contact(result.status)) {
    return "a contact that does not go with the status";
  }
  if constexpr (std::is_same_v<Result, ToiResult>) {
    if (result.contacts.empty() == (is_impact && terms.with_contacts)) {
      return "contacts that do not go with the status and the options";
    }
    for (const Contact& contact : result.contacts) {
      if (const char* const broken = broken_contact(contact)) return broken;
      const Scalar limit =
          result.contact->upper + terms.distance_tolerance + 2 * result.rounding_allowance;
      if (!(contact.lower <= limit)) return "a contact out of reach";
    }
    if (result.t_hit && !is_impact) return "t_hit without an impact";
    if (result.t_hit && !(*result.t_hit > result.t_safe && *result.t_hit <= terms.interval.end)) {
      return "t_hit is not after t_safe, or after the end";
    }
  }
  if (!result.contact) return nullptr;
  if (result.status == ToiStatus::InitiallyWithinTarget && !terms.is_exact &&
      !(result.contact->lower <= terms.guaranteed())) {
    return "InitiallyWithinTarget, but proven apart";
  }
  return broken_contact(*result.contact);
}

/// Which cell is broken by the distance, or nullptr. `distance_at(t)` must return a DistanceBracket
/// that holds whatever its own rounding.
template <typename Result, typename DistanceAt>
const char* broken_distance(const PromiseTerms& terms, const Result& result, int samples,
                            const DistanceAt& distance_at) {
  const Scalar begin = terms.interval.begin;
  const Scalar allowance = result.rounding_allowance;
  const ToiStatus status = result.status;
  if (status == ToiStatus::NotRun) return nullptr;
  if (status == ToiStatus::InitiallyWithinTarget) {
    // Distances are those of surfaces.
    if (terms.has_solids) return nullptr;
    const bool is_within = distance_at(begin).lower <= terms.largest_impact() + allowance;
    return is_within ? nullptr : "InitiallyWithinTarget, but begins apart";
  }
  const bool is_proven = status == ToiStatus::Separated || status == ToiStatus::Impact;
  if (!is_proven && result.t_safe == begin) return nullptr;
  const bool is_only_apart = terms.is_exact && status == ToiStatus::Separated;
  const Scalar least = is_only_apart ? 0 : terms.guaranteed() - allowance;
  for (int k = 0; k <= samples; ++k) {
    const Scalar t = k == samples
                         ? result.t_safe
                         : std::min(begin + (result.t_safe - begin) * k / samples, result.t_safe);
    if (!(distance_at(t).upper >= least)) return "nearer than promised before t_safe";
  }
  if (status != ToiStatus::Impact) return nullptr;
  const Scalar nearest = distance_at(result.t_safe).lower;
  if (!(nearest <= terms.largest_impact() + allowance)) return "an impact that is none";
  if (!(nearest <= result.contact->upper)) return "farther than the contact's upper bound";
  if constexpr (std::is_same_v<Result, ToiResult>) {
    if (result.t_hit && !(distance_at(*result.t_hit).lower <= terms.leaf_target() + allowance)) {
      return "t_hit, but not near enough then";
    }
  }
  return nullptr;
}

/// The same for a rigid query that nothing can have cancelled; also the poses and the budget.
inline const char* broken_form(const ToiQuery& query, const ToiResult& result) {
  if (result.statistics.node_pairs > query.options.max_node_pairs) return "the budget is exceeded";
  if (result.status == ToiStatus::NotRun || result.status == ToiStatus::Cancelled) {
    return "the status is one that cannot occur";
  }
  const auto is_pose = [](const RigidPose& X, const RigidPose& Y) {
    return X.translation() == Y.translation() && X.rotation() == Y.rotation();
  };
  if (!is_pose(result.X_WA, query.X_WA->pose(result.t_safe)) ||
      !is_pose(result.X_WB, query.X_WB->pose(result.t_safe))) {
    return "a pose is not that at t_safe";
  }
  return broken_form(PromiseTerms(query.interval, in_full(query)), result);
}

/// Compares an answer of a rigid query with the oracle's distances at sampled times.
class ToiJudge {
 public:
  explicit ToiJudge(const ToiQuery& query)
      : query_(query), a_(*query.a), b_(*query.b), oracle_(a_, *query.X_WA, b_, *query.X_WB) {}

  /// Returns which cell is broken, or nullptr.
  const char* broken_distance(const ToiResult& result, int samples) {
    return testing::broken_distance(PromiseTerms(query_.interval, in_full(query_)), result, samples,
                                    [&](Scalar t) { return distance_at(t); });
  }

 private:
  DistanceBracket distance_at(Scalar t) {
    DistanceBracket bracket =
        oracle_.distance_at(t, in_full(query_).distance_tolerance.value() / 16);
    bracket.lower -= noise(t);
    bracket.upper += noise(t);
    return bracket;
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
