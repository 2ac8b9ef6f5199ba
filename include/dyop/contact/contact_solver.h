// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <memory>
#include <string_view>
#include <vector>

#include "dyop/contact/contact_problem.h"
#include "dyop/core/batch_options.h"

namespace DYOP_EXPORT dyop {

namespace contact_internal {
class ContactSystem;
}
namespace core_internal {
class Team;
}

enum class ContactStatus {
  NotRun,
  Converged,     ///< residual <= tolerance
  NotConverged,  ///< out of budget; impulses and velocities are the best found
};

/// Budgets are counts; zero leaves the solver out of a cascade.
struct ContactSolverOptions {
  /// Largest residual that counts as solved, length per time, > 0. Below about 1e-13 times the
  /// largest speed, rounding may keep solvers from reaching it.
  Scalar tolerance = 1e-9;    // literal: a default for speeds of about one
  int sweep_limit = 30;       ///< of Gauss-Seidel, each forward and back
  int few_contacts = 4;       ///< with at most this many contacts and rows ...
  int few_sweep_limit = 200;  ///< ... this is the limit on sweeps
  int newton_limit = 100;     ///< of factorisations
  int admm_limit = 200;       ///< of iterations
  /// Newton and ADMM give up when so many factorisations, or twice as many iterations, have not
  /// halved their residual.
  int patience = 100;
  int cascade_rounds = 2;  ///< passes of ContactCascade over its solvers
  /// If the rounds of ContactCascade do not solve a problem of at most this many contacts and rows,
  /// it raises friction in steps from zero to its value, then tries random starts, each with its
  /// own round.
  int restart_contacts = 32;
  int friction_steps = 10;
  int scattered_starts = 20;
  /// Threads that solve one problem of many contacts together; 0: all. Never changes the answer.
  int thread_count = 1;
  /// Ends a solve between sweeps, factorisations or iterations; the best answer is returned. Not
  /// owned; null: never.
  Interrupt* interrupt = nullptr;
};

/// @throws InvalidArgument naming the option that is out of its range.
void require_valid(const ContactSolverOptions& options);

/// What a solver achieved. The residual is a velocity, length per time: the largest value over all
/// contacts and rows of |w J - P(w J - u~)|. Here J is the impulse, w the trace of the contact's
/// own mobility matrix (velocity per impulse), P the projection onto the set of admissible impulses
/// (friction cone, bounds), u the relative velocity minus its target, and u~ = u + friction |u_t| n
/// ([DeSaxce1998]). It is zero exactly where all laws of PointContact and JointRow hold; it covers
/// penetration velocity, complementarity, the cone and the direction of friction. It is always
/// computed from the impulses and velocities that are returned.
struct ContactReport {
  ContactStatus status = ContactStatus::NotRun;
  Scalar residual = 0;
  std::string_view solver;    ///< the solver that gave this answer
  int sweeps = 0;             ///< of Gauss-Seidel, forward and back
  int newton_iterations = 0;  ///< factorisations
  int admm_iterations = 0;
  /// Contacts and rows that are violated by more than the tolerance between bodies with no mobility
  /// along them. No impulse can help; the residual leaves them out.
  int immovable_violations = 0;
};

/// Solves contact problems at velocity level. An object owns its working memory: reuse it, and
/// nothing is allocated once it has seen the largest problem. Use one per thread. Answers do not
/// depend on earlier problems, to the bit.
///
/// To add a contact solver:
///   1. a class in this file that derives from ContactSolver: name() and improve(); its code in
///      `src/contact/solver/<name>_solver.cpp`, listed in `src/contact/CMakeLists.txt`;
///   2. one word in `tests/contact/all_contact_solvers.h`: the contract tests check the laws,
///      closed forms and determinism;
///   3. if it should be part of the default: its budget in ContactSolverOptions, its place in
///      ContactCascade.
class ContactSolver {
 public:
  ContactSolver();
  virtual ~ContactSolver();
  ContactSolver(const ContactSolver&) = delete;
  ContactSolver& operator=(const ContactSolver&) = delete;

  virtual std::string_view name() const = 0;

  /// Finds impulses and velocities that obey all laws and writes them into `problem`. Impulses
  /// already in it are the warm start: they affect the speed, and the answer where it is not
  /// unique.
  ///
  /// @throws InvalidArgument for a value that is not finite, an index out of range, a body touching
  /// itself, a normal that is not a unit vector, a negative coefficient or crossed bounds.
  ContactReport solve(ContactProblem& problem, const ContactSolverOptions& options = {});

 protected:
  friend class ContactCascade;

  /// Improves the impulses of the system until its residual is at most the tolerance or the budget
  /// runs out; adds its counts to `report`. Must leave the impulses admissible.
  virtual void improve(contact_internal::ContactSystem& system, const ContactSolverOptions& options,
                       ContactReport& report) = 0;

 private:
  ContactReport solve_in_team(ContactProblem& problem, const ContactSolverOptions& options,
                              core_internal::Team* team);

  std::unique_ptr<contact_internal::ContactSystem> system_;
};

/// Projected block Gauss-Seidel: solves one contact after another exactly, forward and back
/// ([Jean1999]), with conjugate steps between the sweeps (NNCG, [Silcowitz2010]). Fast for few
/// contacts, and for a rough answer with many; slow to converge in tall stacks and arches.
class GaussSeidelSolver final : public ContactSolver {
 public:
  GaussSeidelSolver();
  ~GaussSeidelSolver() override;
  std::string_view name() const override { return "gauss_seidel"; }

 protected:
  void improve(contact_internal::ContactSystem& system, const ContactSolverOptions& options,
               ContactReport& report) override;

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

namespace contact_internal {
class NewtonRun;
}

/// Newton's method on the laws themselves ([AlartCurnier1991]); what that does not solve, by an
/// augmented Lagrangian of the velocities, with De Saxce's shift for Coulomb's law in an outer
/// loop. The matrices are factorised in blocks over the bodies
/// (docs/algorithms/contact_solvers.md). From a good start a few factorisations do; for stacks,
/// arches and everything stiff.
class NewtonSolver final : public ContactSolver {
 public:
  NewtonSolver();
  ~NewtonSolver() override;
  std::string_view name() const override { return "newton"; }

 protected:
  void improve(contact_internal::ContactSystem& system, const ContactSolverOptions& options,
               ContactReport& report) override;

 private:
  std::unique_ptr<contact_internal::NewtonRun> run_;
};

namespace contact_internal {
class AdmmRun;
}

/// Alternating direction method of multipliers: one factorisation over the bodies, then cheap
/// iterations, each a linear solve and a projection onto every cone ([Boyd2011]). Slow but robust:
/// for problems on which Newton cycles.
class AdmmSolver final : public ContactSolver {
 public:
  AdmmSolver();
  ~AdmmSolver() override;
  std::string_view name() const override { return "admm"; }

 protected:
  void improve(contact_internal::ContactSystem& system, const ContactSolverOptions& options,
               ContactReport& report) override;

 private:
  std::unique_ptr<contact_internal::AdmmRun> run_;
};

namespace contact_internal {
class ContactRestart;
class InteriorPointSolver;
}  // namespace contact_internal

/// The default solver: a few steps of Newton, interior points, then Newton, Gauss-Seidel and ADMM,
/// each from the best answer so far and within its own budget, until one converges; if none does, a
/// second round of these three. Gauss-Seidel comes first for joints alone, and for many bodies
/// without a good start; interior points where bodies seem to rest. Their factorisations count as
/// Newton's. What no round solves, and has few contacts, is begun again: by continuation from the
/// problem without friction, then from random impulses, the same in every run. Returns the answer
/// with the smallest residual.
class ContactCascade final : public ContactSolver {
 public:
  ContactCascade();
  ~ContactCascade() override;
  std::string_view name() const override { return "cascade"; }

 protected:
  void improve(contact_internal::ContactSystem& system, const ContactSolverOptions& options,
               ContactReport& report) override;

 private:
  Scalar run_round(contact_internal::ContactSystem& system, Scalar best,
                   const ContactSolverOptions& options, ContactReport& report);
  void restart(contact_internal::ContactSystem& system, Scalar best,
               const ContactSolverOptions& options, ContactReport& report);

  std::unique_ptr<contact_internal::InteriorPointSolver> interior_;
  GaussSeidelSolver gauss_seidel_;
  NewtonSolver newton_;
  AdmmSolver admm_;
  std::array<ContactSolver*, 3> order_{};
  std::unique_ptr<contact_internal::ContactRestart> restart_;
  std::vector<Vector3> first_lambda_, best_lambda_;
};

/// The tolerance for a step of length h that keeps a rest offset s (a length), by the way
/// x = speed h / s of the fastest body: 1e-6 max(x, x^2) s / h, but at least 1e-7 s / h, for bodies
/// at rest, and at most 0.1 s / h.
Scalar contact_tolerance(Scalar largest_speed, Scalar rest_offset, Scalar h);

}  // namespace dyop
