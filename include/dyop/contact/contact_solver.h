// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string_view>

#include "dyop/contact/contact_problem.h"

namespace DYOP_EXPORT dyop {

namespace internal {
class ContactSystem;
}

enum class ContactStatus {
  NotRun,
  Converged,     ///< residual <= tolerance
  NotConverged,  ///< a budget ran out first; impulses and velocities are the best found
};

/// Budgets limit counts; zero skips the solver in a cascade.
struct ContactSolverOptions {
  /// Largest residual that counts as solved, length per time, > 0. Below some 1e-13 times the
  /// largest speed rounding may keep solvers from reaching it.
  Scalar tolerance = 1e-9;    // literal: a default for speeds of about one
  int sweep_limit = 30;       ///< of Gauss-Seidel, each forward and back
  int few_contacts = 4;       ///< with at most this many contacts and rows,
  int few_sweep_limit = 200;  ///< this is the limit of sweeps
  int newton_limit = 100;     ///< of factorisations
  int admm_limit = 200;       ///< of iterations
  int cascade_rounds = 2;     ///< times that ContactCascade goes through its solvers
};

/// What a solver achieved. The residual is a velocity, length per time: the largest over all
/// contacts and rows of |w J - P(w J - u~)|, where J is the impulse, w the trace of that contact's
/// own mobility matrix (velocity per impulse), P the nearest point of the set of admissible
/// impulses (friction cone, bounds), u the relative velocity minus its target, and u~ = u +
/// friction |u_t| n
/// ([DeSaxce1998]). It is zero exactly where all laws of PointContact and JointRow hold; it covers
/// penetration velocity, complementarity, the cone and the direction of friction. Always computed
/// from the impulses and velocities that are returned.
struct ContactReport {
  ContactStatus status = ContactStatus::NotRun;
  Scalar residual = 0;
  std::string_view solver;    ///< name of the solver whose answer this is
  int sweeps = 0;             ///< of Gauss-Seidel, forward and back
  int newton_iterations = 0;  ///< factorisations
  int admm_iterations = 0;
  /// Contacts and rows between bodies without mobility along them that are violated by more than
  /// the tolerance. No impulse can help; the residual leaves them out.
  int immovable_violations = 0;
};

/// Solves contact problems at velocity level. An object owns its working memory: reuse it, and
/// nothing is allocated once it has seen the largest problem. Use one per thread. Earlier problems
/// change no bit of an answer.
///
/// To add a contact solver:
///   1. `include/dyop/contact/<name>_solver.h` and `src/contact/<name>_solver.cpp`, deriving from
///      ContactSolver: name() and improve(); list both in `src/contact/CMakeLists.txt`;
///   2. one word in `tests/contact/all_contact_solvers.h`: the contract tests check laws, closed
///      forms and bits of its answers;
///   3. if it should be part of the default: its budget in ContactSolverOptions, its place in
///      ContactCascade.
class ContactSolver {
 public:
  ContactSolver();
  virtual ~ContactSolver();
  ContactSolver(const ContactSolver&) = delete;
  ContactSolver& operator=(const ContactSolver&) = delete;

  virtual std::string_view name() const = 0;

  /// Finds impulses and velocities that obey all laws; writes them into `problem`. Impulses
  /// already in it are the warm start: they affect speed, and the answer where it is not unique.
  ///
  /// @throws InvalidArgument for a value that is not finite, an index out of range, a body touching
  /// itself, a normal that is not a unit vector, negative coefficients or crossed bounds.
  ContactReport solve(ContactProblem& problem, const ContactSolverOptions& options = {});

 protected:
  friend class ContactCascade;

  /// Improves the impulses of the system until its residual is at most the tolerance or the budget
  /// ends; counts in `report`. Must leave impulses within their sets.
  virtual void improve(internal::ContactSystem& system, const ContactSolverOptions& options,
                       ContactReport& report) = 0;

 private:
  std::unique_ptr<internal::ContactSystem> system_;
};

}  // namespace dyop
