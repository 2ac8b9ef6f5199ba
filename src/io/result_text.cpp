// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/result_text.h"

#include <sstream>

#include "io/json_reader.h"
#include "io/result_json.h"

namespace dyop {
namespace {

using io_internal::place_words;
using io_internal::show;

Scalar bracket_of(const ToiResult& result) {
  return result.t_hit.value_or(kInfinity) - result.t_safe;
}

std::string status_words(const ToiResult& result, const PairNames& names) {
  const std::string pair = names.a + " and " + names.b;
  const std::string t = show(result.t_safe, bracket_of(result));
  // If the query stopped at its start, nothing is known about that time.
  const std::string proven = " are proven apart only before t = " + t + ".";
  switch (result.status) {
    case ToiStatus::NotRun:
      return "The query has not run.";
    case ToiStatus::Separated:
      return "No impact: " + pair + " are proven apart up to t = " + t + ", the end.";
    case ToiStatus::Impact:
      return "Impact at t = " + t + ": " + pair + " are proven apart until then.";
    case ToiStatus::InitiallyWithinTarget:
      return "Within the target from the start: " + pair + " are too close at t = " + t +
             " for anything to be proven.";
    case ToiStatus::BudgetExhausted:
      return "Undecided: the budget ran out; " + pair + proven;
    case ToiStatus::Cancelled:
      return "Undecided: stopped; " + pair + proven;
    case ToiStatus::NumericalLimit:
      return "Undecided: rounding prevents the requested tolerance; " + pair + proven;
  }
  return "";
}

std::string status_words(DistanceStatus status, const PairNames& names) {
  const std::string pair = names.a + " and " + names.b;
  switch (status) {
    case DistanceStatus::NotRun:
      return "The query has not run.";
    case DistanceStatus::Separated:
      return pair + " are proven apart.";
    case DistanceStatus::Overlapping:
      return pair + " touch or intersect.";
    case DistanceStatus::FartherThanMaxDistance:
      return pair + " are proven farther apart than the maximum.";
    case DistanceStatus::Inconclusive:
      return "Undecided: neither separation nor overlap of " + pair + " was proven.";
  }
  return "";
}

std::string status_words(RayStatus status) {
  switch (status) {
    case RayStatus::NotRun:
      return "The ray was not cast.";
    case RayStatus::Miss:
      return "Miss: proven to touch nothing.";
    case RayStatus::Hit:
      return "Hit: proven free until there.";
    case RayStatus::InitiallyTouching:
      return "Not proven apart at the start.";
    case RayStatus::NumericalLimit:
      return "Undecided: proven free only until there.";
  }
  return "";
}

std::string contact_words(const std::vector<Contact>& contacts, const PairNames& names) {
  std::ostringstream out;
  out << "  contacts     " << contacts.size() << ", from the nearest\n";
  for (const Contact& contact : contacts) {
    out << "    gap at least " << show(contact.lower) << ", at most " << show(contact.upper)
        << ", normal " << show(contact.nhat_AB_W) << '\n';
    out << "      on " << names.a << ": "
        << place_words(contact.p_WCa, contact.feature_a, contact.triangle_a, contact.upper) << '\n';
    out << "      on " << names.b << ": "
        << place_words(contact.p_WCb, contact.feature_b, contact.triangle_b, contact.upper) << '\n';
  }
  return out.str();
}

}  // namespace

std::string to_json_text(const DistanceResult& result) {
  return io_internal::to_json(result).dump();
}

std::string to_json_text(const ToiResult& result) {
  io_internal::Json json = io_internal::to_json(result);
  json["contacts"] = io_internal::to_json(result.contacts);
  return json.dump();
}

std::string to_json_text(const RayHit& hit) {
  return io_internal::to_json(hit).dump();
}

std::string describe(const RayHit& hit) {
  std::ostringstream out;
  out << status_words(hit.status) << '\n';
  out << "  distance     " << show(hit.distance) << '\n';
  if (hit.status == RayStatus::Miss) return out.str();
  out << "  gap          at most " << show(hit.gap) << '\n';
  out << "  at           " << place_words(hit.p_WC, hit.feature, hit.triangle, hit.gap) << '\n';
  out << "  normal       " << show(hit.nhat_W) << '\n';
  return out.str();
}

std::string describe(const DistanceResult& result, const PairNames& names) {
  std::ostringstream out;
  out << status_words(result.status, names) << '\n';
  out << "  distance     at least " << show(result.lower) << ", at most " << show(result.upper)
      << '\n';
  // Shapes that overlap have no nearest points and no normal between them.
  if (result.status == DistanceStatus::Overlapping) {
    out << "  meet near    " << show(result.pivot_W()) << '\n';
  } else {
    out << "  on " << names.a << ": "
        << place_words(result.p_WCa, result.feature_a, result.triangle_a, result.upper) << '\n';
    out << "  on " << names.b << ": "
        << place_words(result.p_WCb, result.feature_b, result.triangle_b, result.upper) << '\n';
    out << "  normal       " << show(result.nhat_AB_W) << " from " << names.a << " to " << names.b
        << '\n';
    out << "  pivot        " << show(result.pivot_W()) << '\n';
  }
  if (result.penetration) {
    out << "  penetration  depth " << show(result.penetration->depth) << " along "
        << show(result.penetration->nhat_AB_W) << " (estimate)\n";
  }
  out << "  work         " << result.statistics.box_tests << " box tests, "
      << result.statistics.leaf_tests << " leaf tests, " << result.statistics.gjk_iterations
      << " GJK iterations\n";
  return out.str();
}

std::string describe(const ToiResult& result, const PairNames& names) {
  std::ostringstream out;
  out << status_words(result, names) << '\n';
  if (result.t_hit) {
    out << "  bracket      [" << show(result.t_safe, bracket_of(result)) << ", "
        << show(*result.t_hit, bracket_of(result))
        << "]: apart until its start, in contact by its end\n";
  }
  if (result.contact) {
    const ImpactContact& contact = *result.contact;
    out << "  gap          at least " << show(contact.lower) << ", at most " << show(contact.upper)
        << '\n';
    out << "  on " << names.a << ": "
        << place_words(contact.p_WCa, contact.feature_a, contact.triangle_a, contact.upper) << '\n';
    out << "  on " << names.b << ": "
        << place_words(contact.p_WCb, contact.feature_b, contact.triangle_b, contact.upper) << '\n';
    out << "  normal       " << show(contact.nhat_AB_W) << " from " << names.a << " to " << names.b
        << '\n';
    out << "  pivot        " << show(contact.pivot_W()) << '\n';
    out << "  closing      at speed " << show(contact.closing_speed) << '\n';
  }
  if (!result.contacts.empty()) out << contact_words(result.contacts, names);
  out << "  work         " << result.statistics.node_pairs << " node pairs, "
      << result.statistics.box_tests << " box tests, " << result.statistics.leaf_tests
      << " leaf tests\n";
  return out.str();
}

}  // namespace dyop
