// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/contact/contact_solver.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

#include "contact/solver/contact_system.h"
#include "core/team.h"
#include "core/tolerance.h"
#include "dyop/core/error.h"

namespace dyop::contact_internal {
namespace {

void check_body(const ContactBody& body, std::size_t i) {
  DYOP_REQUIRE(body.inverse_mass_W.allFinite() && body.inverse_inertia_W.allFinite(), "body ", i,
               ": mobilities must be finite, not ", body.inverse_mass_W, " and ",
               body.inverse_inertia_W);
  DYOP_REQUIRE((body.inverse_mass_W.diagonal().array() >= 0).all() &&
                   (body.inverse_inertia_W.diagonal().array() >= 0).all(),
               "body ", i, ": mobilities must be positive semidefinite, not ", body.inverse_mass_W,
               " and ", body.inverse_inertia_W);
  DYOP_REQUIRE(body.free_v_W.allFinite() && body.free_w_W.allFinite(), "body ", i,
               ": free velocities must be finite, not ", body.free_v_W, " and ", body.free_w_W);
}

void check_bodies(const char* what, std::size_t i, std::size_t a, std::size_t b,
                  std::size_t count) {
  DYOP_REQUIRE(a < count && b < count && a != b, what, " ", i, ": needs two different bodies of ",
               count, ", not ", a, " and ", b);
}

void check_contact(const PointContact& contact, std::size_t i) {
  DYOP_REQUIRE(contact.r_a_W.allFinite() && contact.r_b_W.allFinite(), "contact ", i,
               ": lever arms must be finite, not ", contact.r_a_W, " and ", contact.r_b_W);
  DYOP_REQUIRE(std::abs(contact.nhat_AB_W.squaredNorm() - 1) <= 2 * kRotationTolerance, "contact ",
               i, ": normal must be a unit vector, not ", contact.nhat_AB_W);
  DYOP_REQUIRE(std::isfinite(contact.target), "contact ", i, ": target must be finite, not ",
               contact.target);
  DYOP_REQUIRE(contact.sticking_velocity_W.allFinite(), "contact ", i,
               ": sticking velocity must be finite, not ", contact.sticking_velocity_W);
  check_friction(contact.friction, i);
  if (contact.ellipse) {
    check_friction(contact.ellipse->across, i);
    DYOP_REQUIRE(contact.ellipse->axis_W.allFinite(), "contact ", i,
                 ": axis of friction must be finite, not ", contact.ellipse->axis_W);
  }
  DYOP_REQUIRE(contact.rolling_friction >= 0 && std::isfinite(contact.rolling_friction) &&
                   contact.torsional_friction >= 0 && std::isfinite(contact.torsional_friction),
               "contact ", i, ": rolling and torsional friction must be finite and >= 0, not ",
               contact.rolling_friction, " and ", contact.torsional_friction);
  DYOP_REQUIRE(contact.impulse_W.allFinite() && contact.angular_impulse_W.allFinite(), "contact ",
               i, ": initial impulses must be finite, not ", contact.impulse_W, " and ",
               contact.angular_impulse_W);
}

void check_row(const JointRow& row, std::size_t i) {
  DYOP_REQUIRE(row.j_av_W.allFinite() && row.j_aw_W.allFinite() && row.j_bv_W.allFinite() &&
                   row.j_bw_W.allFinite(),
               "row ", i, ": coefficients must be finite, not ", row.j_av_W, ", ", row.j_aw_W, ", ",
               row.j_bv_W, " and ", row.j_bw_W);
  DYOP_REQUIRE(std::isfinite(row.target), "row ", i, ": target must be finite, not ", row.target);
  DYOP_REQUIRE(row.lower <= row.upper && row.lower < kInfinity && row.upper > -kInfinity, "row ", i,
               ": bounds must be in order, not ", row.lower, " and ", row.upper);
  DYOP_REQUIRE(row.compliance >= 0 && std::isfinite(row.compliance), "row ", i,
               ": compliance must be finite and >= 0, not ", row.compliance);
  DYOP_REQUIRE(std::isfinite(row.impulse), "row ", i, ": initial impulse must be finite, not ",
               row.impulse);
}

// Turning would need their rates, and a law of friction their velocities.
void check_carriers(const ContactProblem& problem) {
  DYOP_REQUIRE(problem.carriers.empty() || !problem.friction_law,
               "a problem with carriers cannot have a friction law");
  for (std::size_t i = 0; i < problem.carriers.size(); ++i) {
    const ContactCarrier& carrier = problem.carriers[i];
    DYOP_REQUIRE(carrier.contact < problem.contacts.size() && carrier.body < problem.bodies.size(),
                 "carrier ", i, ": there is no contact ", carrier.contact, " or body ",
                 carrier.body);
    const PointContact& contact = problem.contacts[carrier.contact];
    DYOP_REQUIRE(carrier.body != contact.body_a && carrier.body != contact.body_b, "carrier ", i,
                 ": body ", carrier.body, " is one of contact ", carrier.contact, "'s own");
    DYOP_REQUIRE(carrier.r_W.allFinite(), "carrier ", i, ": the lever arm must be finite, not ",
                 carrier.r_W);
    DYOP_REQUIRE(contact.rolling_friction == 0 && contact.torsional_friction == 0, "carrier ", i,
                 ": contact ", carrier.contact, " has rolling or torsional friction");
    for (std::size_t k = i; k-- > 0 && problem.carriers[k].contact >= carrier.contact;) {
      DYOP_REQUIRE(problem.carriers[k].contact == carrier.contact, "carrier ", i,
                   ": carriers must ascend by contact, not ", problem.carriers[k].contact, ", ",
                   carrier.contact);
      DYOP_REQUIRE(problem.carriers[k].body != carrier.body, "carrier ", i, ": body ", carrier.body,
                   " carries contact ", carrier.contact, " twice");
    }
  }
}

// check(i) for every i, of which the first that fails throws.
template <typename Check>
void check_all(const SharedLoops& loops, std::size_t count, const Check& check) {
  std::atomic<bool> has_failed = false;
  if (loops.has_team()) {
    loops.each(count, [&](std::size_t i) {
      try {
        check(i);
      } catch (...) {
        has_failed = true;
      }
    });
    if (!has_failed) return;
  }
  for (std::size_t i = 0; i < count; ++i) check(i);
}

}  // namespace

void check_friction(Scalar friction, std::size_t contact) {
  DYOP_REQUIRE(friction >= 0 && std::isfinite(friction), "contact ", contact,
               ": friction must be finite and >= 0, not ", friction);
}

void check_problem(const ContactProblem& problem, const SharedLoops& loops) {
  const std::size_t count = problem.bodies.size();
  const auto check_one = [&](std::size_t i) {
    const PointContact& contact = problem.contacts[i];
    check_bodies("contact", i, contact.body_a, contact.body_b, count);
    check_contact(contact, i);
  };
  for (std::size_t i = 0; i < count; ++i) check_body(problem.bodies[i], i);
  check_all(loops, problem.contacts.size(), check_one);
  check_carriers(problem);
  for (std::size_t i = 0; i < problem.rows.size(); ++i) {
    check_bodies("row", i, problem.rows[i].body_a, problem.rows[i].body_b, count);
    check_row(problem.rows[i], i);
  }
}

}  // namespace dyop::contact_internal

namespace dyop {

void require_valid(const ContactSolverOptions& options) {
  DYOP_REQUIRE(options.tolerance > 0 && std::isfinite(options.tolerance),
               "tolerance must be finite and > 0, not ", options.tolerance);
  const std::pair<const char*, int> limits[] = {
      {"sweep_limit", options.sweep_limit},         {"few_contacts", options.few_contacts},
      {"few_sweep_limit", options.few_sweep_limit}, {"newton_limit", options.newton_limit},
      {"admm_limit", options.admm_limit},           {"patience", options.patience},
      {"cascade_rounds", options.cascade_rounds},   {"restart_contacts", options.restart_contacts},
      {"friction_steps", options.friction_steps},   {"scattered_starts", options.scattered_starts},
      {"thread_count", options.thread_count}};
  for (const auto& [name, limit] : limits) {
    DYOP_REQUIRE(limit >= 0, name, " must be >= 0, not ", limit);
  }
}

ContactSolver::ContactSolver() : system_(std::make_unique<contact_internal::ContactSystem>()) {}
ContactSolver::~ContactSolver() = default;

ContactReport ContactSolver::solve(ContactProblem& problem, const ContactSolverOptions& options) {
  require_valid(options);
  const bool is_shared = options.thread_count != 1 && problem.carriers.empty() &&
                         problem.contacts.size() + problem.rows.size() >= kContactTeamBlocks;
  if (!is_shared) return solve_in_team(problem, options, nullptr);
  ContactReport report;
  core_internal::with_team(options.thread_count, [&](core_internal::Team& team) {
    report = solve_in_team(problem, options, team.has_helpers() ? &team : nullptr);
  });
  return report;
}

ContactReport ContactSolver::solve_in_team(ContactProblem& problem,
                                           const ContactSolverOptions& options,
                                           core_internal::Team* team) {
  contact_internal::ContactSystem& system = *system_;
  system.set_team(team);
  system.build(problem);
  ContactReport report;
  report.solver = name();
  system.update_friction(problem);
  // A friction law is solved as a sequence of problems with constant coefficients.
  for (int round = 0; round < kContactFrictionRounds; ++round) {
    improve(system, options, report);
    system.update_velocities();
    system.update_friction(problem);
    report.residual = system.residual();
    if (!problem.friction_law || report.residual <= options.tolerance) break;
  }
  report.status =
      report.residual <= options.tolerance ? ContactStatus::Converged : ContactStatus::NotConverged;
  report.immovable_violations = system.immovable_violations(options.tolerance);
  system.write(problem);
  return report;
}

}  // namespace dyop
