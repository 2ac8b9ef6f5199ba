// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/run_summary.h"

#include <ostream>

#include "io/json_reader.h"

namespace dyop {
namespace {

using io_internal::place_words;
using io_internal::show;

const std::string& name_of_body(const Scene& scene, BodyId id) {
  static const std::string kNobody = "(no body)";
  return id.slot < scene.bodies.size() ? scene.bodies[id.slot].name : kNobody;
}

std::string_view kind_words(BodyKind kind) {
  switch (kind) {
    case BodyKind::Dynamic:
      return "dynamic";
    case BodyKind::Kinematic:
      return "kinematic";
    case BodyKind::Static:
      return "static";
  }
  return "";
}

std::string pair_words(const Scene& scene, std::pair<BodyId, BodyId> pair) {
  return name_of_body(scene, pair.first) + " and " + name_of_body(scene, pair.second);
}

void write_bodies(std::ostream& out, const Scene& scene) {
  out << "Bodies\n";
  for (std::size_t k = 0; k < scene.bodies.size(); ++k) {
    out << "  " << scene.bodies[k].name << ": " << scene.shape_names[k] << ", "
        << kind_words(scene.bodies[k].kind) << '\n';
  }
}

void write_world_contact(std::ostream& out, const Scene& scene, const WorldContact& contact) {
  const std::string& a = name_of_body(scene, contact.a);
  const std::string& b = name_of_body(scene, contact.b);
  const Contact& c = contact.contact;
  out << "    " << a << " at " << place_words(c.p_WCa, c.feature_a, c.triangle_a, c.upper) << '\n'
      << "    " << b << " at " << place_words(c.p_WCb, c.feature_b, c.triangle_b, c.upper) << '\n'
      << "      normal from " << a << " to " << b << " " << show(c.nhat_AB_W) << ", gap "
      << show(c.lower) << " to " << show(c.upper) << ",\n      gap changed at "
      << show(contact.normal_velocity) << ", impulse on " << b << " " << show(contact.impulse_W)
      << '\n';
}

void write_impact(std::ostream& out, const Scene& scene, const ImpactEvent& event,
                  std::size_t number) {
  const std::string& a = name_of_body(scene, event.a);
  const std::string& b = name_of_body(scene, event.b);
  out << "\nImpact " << number << " at t = " << show(event.t) << ": " << a << " meets " << b
      << '\n';
  const Scalar apart = event.toi.t_hit.value_or(kInfinity) - event.toi.t_safe;
  out << "  proven apart until t = " << show(event.toi.t_safe, apart);
  if (event.toi.t_hit) out << ", in contact by t = " << show(*event.toi.t_hit, apart);
  out << '\n';
  if (event.toi.contact) {
    const ImpactContact& c = *event.toi.contact;
    out << "  gap at that time: at least " << show(c.lower) << ", at most " << show(c.upper)
        << "; closing at " << show(c.closing_speed) << '\n';
    out << "  on " << a << ": " << place_words(c.p_WCa, c.feature_a, c.triangle_a, c.upper) << '\n';
    out << "  on " << b << ": " << place_words(c.p_WCb, c.feature_b, c.triangle_b, c.upper) << '\n';
    out << "  normal from " << a << " to " << b << ": " << show(c.nhat_AB_W) << "; pivot "
        << show(c.pivot_W()) << '\n';
  }
  out << "  found with " << event.toi.statistics.node_pairs << " node pairs, "
      << event.toi.statistics.leaf_tests << " leaf tests\n";
  if (event.contacts.size() == 1) out << "  1 place in contact:\n";
  if (event.contacts.size() > 1) out << "  " << event.contacts.size() << " places in contact:\n";
  for (const WorldContact& contact : event.contacts) write_world_contact(out, scene, contact);
}

void write_counters(std::ostream& out, const RunTotals& totals) {
  out << "\nWork\n"
      << "  " << totals.steps << " proven steps, " << totals.work.substeps
      << " of islands; contact: " << totals.work.rounds << " rounds of hits, "
      << totals.work.unconverged << " solves not converged,\n    largest residual "
      << show(totals.work.residual) << ", " << totals.work.stalls << " stalls, at most "
      << totals.work.contacts << " contacts";
  if (totals.work.shortest_gap < kInfinity) {
    out << ", the nearest " << show(totals.work.shortest_gap) << " apart";
  }
  out << "\n  pairs proven: " << totals.work.pairs_by_bound << " by bound, "
      << totals.work.pairs_by_query << " by query, " << totals.work.pairs_at_rest << " at rest, "
      << totals.work.pairs_excused << " not proven (started too near)\n"
      << "  integrator: " << totals.integrator.steps << " steps, "
      << totals.integrator.rejected_steps << " rejected, " << totals.integrator.function_evaluations
      << " force evaluations\n"
      << "  impact engine: " << totals.toi.node_pairs << " node pairs, " << totals.toi.box_tests
      << " box tests, " << totals.toi.leaf_tests << " leaf tests, longest queue "
      << totals.toi.peak_queue << '\n';
}

// Milliseconds per step of each part, if it was measured.
void write_times(std::ostream& out, const RunTotals& totals) {
  const StepTimes& times = totals.times;
  if (!(times.total > 0) || totals.steps == 0) return;
  const auto per_step = [&](Scalar seconds) { return show(1000 * seconds / Scalar(totals.steps)); };
  out << "  ms per step: " << per_step(times.total) << "; over all threads: broad phase "
      << per_step(times.broad_phase) << ", free flight " << per_step(times.flight)
      << ", contact generation " << per_step(times.contacts) << ",\n    contact solve "
      << per_step(times.solve) << ", ends of contacts " << per_step(times.ends) << ", proofs "
      << per_step(times.proofs) << '\n';
}

}  // namespace

std::string describe_end(const Scene& scene, const RunTotals& totals) {
  const std::string t = show(totals.t);
  if (totals.error) return "Ended by an error, safe until then: " + *totals.error;
  const std::string pair = pair_words(scene, totals.offending_pair);
  switch (totals.status) {
    case AdvanceStatus::NotRun:
      return "The run did not start.";
    case AdvanceStatus::Completed:
      return "Completed at t = " + t + ".";
    case AdvanceStatus::StoppedAtImpact:
      return "Stopped at the impact at t = " + t + ", as the scene requires.";
    case AdvanceStatus::BudgetExhausted:
      return "Undecided after t = " + t + ": the budget ran out for " + pair + ". Safe until then.";
    case AdvanceStatus::Blocked:
      return "Blocked at t = " + t + ": kinematic bodies leave no space for " + pair +
             ". Safe until then.";
    case AdvanceStatus::NumericalLimit:
      return "Undecided after t = " + t + ": rounding rules out the tolerance for " + pair +
             ". Safe until then.";
    case AdvanceStatus::Cancelled:
      return "Cancelled at t = " + t + ". Safe until then.";
  }
  return "";
}

void write_summary(std::ostream& out, const Scene& scene, const std::vector<ImpactEvent>& impacts,
                   const RunTotals& totals, double wall_seconds) {
  if (!scene.title.empty()) out << scene.title << "\n\n";
  write_bodies(out, scene);
  out << "\nFrom t = 0 to t = " << show(totals.t) << " of " << show(scene.end_time) << ": "
      << impacts.size() << (impacts.size() == 1 ? " impact. " : " impacts. ")
      << describe_end(scene, totals) << '\n';
  for (const auto& pair : totals.too_near) {
    out << "Started too near and were pushed apart: " << pair_words(scene, pair) << '\n';
  }
  constexpr std::size_t kMostTold = 20;
  for (std::size_t k = 0; k < impacts.size() && k < kMostTold; ++k) {
    write_impact(out, scene, impacts[k], k + 1);
  }
  if (impacts.size() > kMostTold) {
    out << "\n... and " << impacts.size() - kMostTold << " more, in the recording.\n";
  }
  write_counters(out, totals);
  write_times(out, totals);
  out << "  time spent: " << show(wall_seconds) << " s\n";
}

namespace {

void add_work(StepStatistics& sum, const StepStatistics& part) {
  sum.steps += part.steps;
  sum.substeps += part.substeps;
  sum.islands += part.islands;
  sum.rounds += part.rounds;
  sum.stalls += part.stalls;
  sum.contacts = std::max(sum.contacts, part.contacts);
  sum.unconverged += part.unconverged;
  sum.residual = std::max(sum.residual, part.residual);
  sum.shortest_gap = std::min(sum.shortest_gap, part.shortest_gap);
  sum.pairs_by_bound += part.pairs_by_bound;
  sum.pairs_by_query += part.pairs_by_query;
  sum.pairs_at_rest += part.pairs_at_rest;
  sum.pairs_excused += part.pairs_excused;
  sum.discarded_runs += part.discarded_runs;
}

void add_times(StepTimes& sum, const StepTimes& part) {
  sum.broad_phase += part.broad_phase;
  sum.flight += part.flight;
  sum.contacts += part.contacts;
  sum.solve += part.solve;
  sum.ends += part.ends;
  sum.proofs += part.proofs;
  sum.total += part.total;
}

}  // namespace

void RunTotals::add(const AdvanceReport& report) {
  status = report.status;
  t = report.t;
  ++advances;
  steps += report.work.steps;  // `report.steps` is empty where no motions are recorded
  impacts += std::int64_t(report.impacts.size());
  too_near.insert(too_near.end(), report.too_near.begin(), report.too_near.end());
  offending_pair = report.offending_pair;
  integrator.steps += report.integrator.steps;
  integrator.rejected_steps += report.integrator.rejected_steps;
  integrator.function_evaluations += report.integrator.function_evaluations;
  toi.box_tests += report.toi.box_tests;
  toi.leaf_tests += report.toi.leaf_tests;
  toi.node_pairs += report.toi.node_pairs;
  toi.peak_queue = std::max(toi.peak_queue, report.toi.peak_queue);
  add_work(work, report.work);
  add_times(times, report.times);
}

std::string_view RunTotals::end() const {
  return error ? "Error" : name_of(status);
}

}  // namespace dyop
