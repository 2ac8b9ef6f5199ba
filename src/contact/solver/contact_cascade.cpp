// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "contact/solver/contact_law.h"
#include "contact/solver/contact_system.h"
#include "contact/solver/interior_point_solver.h"
#include "core/tolerance.h"
#include "dyop/contact/contact_solver.h"
#include "dyop/core/error.h"

namespace dyop::contact_internal {

// Other starting points for a problem that the solvers did not solve from the one they were given.
// With friction there may be several solutions, and iterations that circle between two wrong
// states.
class ContactRestart {
 public:
  // Keeps the problem's coefficients of friction.
  void begin(const ContactSystem& system);

  // Continuation in the friction: coefficients times `fraction`, impulses as they are. At zero,
  // where the problem is convex, also the impulses begin at zero.
  void set_friction(ContactSystem& system, Scalar fraction) const;

  // Random impulses, about as large as the velocities ask for, the same in every run. With full
  // friction.
  void scatter(ContactSystem& system);

 private:
  std::vector<Scalar> friction_;
  std::minstd_rand random_;
  std::size_t starts_ = 0;
};

namespace {

// Sizes of the starts one after the other; with one size alone fewer problems are solved.
constexpr std::array<Scalar, 3> kSizes{1, 0.2, 5};

// In [-1, 1], by the same arithmetic with every standard library.
Scalar signed_fraction(std::minstd_rand& random) {
  return 2 * Scalar(random()) / Scalar(std::minstd_rand::max()) - 1;
}

}  // namespace

void ContactRestart::begin(const ContactSystem& system) {
  friction_.clear();
  for (const Block& block : system.blocks()) friction_.push_back(block.friction);
  random_.seed();
  starts_ = 0;
}

void ContactRestart::set_friction(ContactSystem& system, Scalar fraction) const {
  for (std::size_t i = 0; i < friction_.size(); ++i) {
    Block& block = system.blocks()[i];
    block.friction = fraction * friction_[i];
    if (fraction == 0) block.lambda.setZero();
  }
  system.update_velocities();
}

void ContactRestart::scatter(ContactSystem& system) {
  set_friction(system, 1);
  const Scalar speed = kSizes[starts_++ % kSizes.size()] * system.residual_without_impulses();
  for (Block& block : system.blocks()) {
    const Scalar size = speed / block.weight;
    Vector3 impulse;
    for (Scalar& component : impulse) component = size * signed_fraction(random_);
    const bool is_turning = block.kind == BlockKind::Rolling || block.kind == BlockKind::Torsion;
    const Scalar bound =
        is_turning ? system.blocks()[std::size_t(block.owner)].lambda[0] : Scalar{0};
    block.lambda = project(block, impulse, bound);
  }
  system.update_velocities();
}

}  // namespace dyop::contact_internal

namespace dyop {
namespace {

// Bodies seem to rest if the tolerance is at most this part of the residual without impulses:
// contact_tolerance() asks for so little only where nothing moves by much more than a rest offset
// per step. Found by measurement.
constexpr Scalar kRestingPart = 3e-5;  // literal: a ratio of residuals

// Largest number of movable bodies for which Newton is faster than Gauss-Seidel from any start. Found
// by measurement.
constexpr std::size_t kNewtonBodies = 300;

// Factorisations of Newton's before interior points are tried: from a good start it needs no more.
// With joints, where of several answers Newton's is the one that shares loads evenly, it has more.
constexpr int kFirstNewton = 6;
constexpr int kFirstNewtonOfJoints = 12;

void keep(const contact_internal::ContactSystem& system, std::vector<Vector3>& lambda) {
  lambda.clear();
  for (const contact_internal::Block& block : system.blocks()) lambda.push_back(block.lambda);
}

void restore(contact_internal::ContactSystem& system, const std::vector<Vector3>& lambda) {
  for (std::size_t i = 0; i < lambda.size(); ++i) system.blocks()[i].lambda = lambda[i];
  system.update_velocities();
}

}  // namespace

ContactCascade::ContactCascade()
    : interior_(std::make_unique<contact_internal::InteriorPointSolver>()),
      restart_(std::make_unique<contact_internal::ContactRestart>()) {}
ContactCascade::~ContactCascade() = default;

// Solvers one after the other, each from the best answer so far, which is left in the system.
// `best` is the residual before.
Scalar ContactCascade::run_round(contact_internal::ContactSystem& system, Scalar best,
                                 const ContactSolverOptions& options, ContactReport& report) {
  for (ContactSolver* solver : order_) {
    if (best <= options.tolerance || is_over(options.interrupt)) break;
    keep(system, best_lambda_);
    solver->improve(system, options, report);
    system.update_velocities();
    const Scalar residual = system.residual();
    if (residual < best) {
      best = residual;
      report.solver = solver->name();
    } else {
      restore(system, best_lambda_);
    }
  }
  return best;
}

void ContactCascade::improve(contact_internal::ContactSystem& system,
                             const ContactSolverOptions& options, ContactReport& report) {
  using contact_internal::InteriorPointSolver;
  order_ = {&gauss_seidel_, &newton_, &admm_};
  Scalar best = system.residual();
  if (best <= options.tolerance) return;  // at rest, the warm start already solves it
  const Scalar without_impulses = system.residual_without_impulses();
  const bool is_small = system.velocities().size() <= kContactFewBodies;
  if (!is_small && options.tolerance <= kRestingPart * without_impulses) {
    interior_->improve(system, options, report);
    best = system.residual();
    if (best <= options.tolerance) {
      report.solver = "interior points";
      return;
    }
  }
  const bool is_medium = system.velocities().size() <= kNewtonBodies;
  if (is_medium && system.has_contacts() && options.newton_limit > 0) {
    ContactSolverOptions first = options;
    const bool has_joints = system.blocks().front().kind == contact_internal::BlockKind::Row;
    first.newton_limit =
        std::min(options.newton_limit, has_joints ? kFirstNewtonOfJoints : kFirstNewton);
    ContactSolver& newton = newton_;
    newton.improve(system, first, report);
    report.solver = newton.name();
    if (system.residual() > options.tolerance && !system.has_turning()) {
      interior_->improve(system, options, report, InteriorPointSolver::Sliding::Any);
      report.solver = "interior points";
    }
    best = system.residual();
    if (best <= options.tolerance || is_over(options.interrupt)) return;
  }
  // Joints alone are solved at once by Gauss-Seidel, and with large ratios of masses slowly by
  // Newton. Large problems cost Newton more than linearly.
  const bool starts_well = best <= kContactGoodStart * without_impulses;
  if ((starts_well || is_medium) && system.has_contacts()) std::swap(order_[0], order_[1]);
  for (int round = 0; round < options.cascade_rounds; ++round) {
    const Scalar before = std::exchange(best, run_round(system, best, options, report));
    if (best <= options.tolerance || is_over(options.interrupt)) return;
    if (!(best < before)) break;  // the next round would change nothing
  }
  restart(system, best, options, report);
}

// The best answer yet is in the system, with this residual.
void ContactCascade::restart(contact_internal::ContactSystem& system, Scalar best,
                             const ContactSolverOptions& options, ContactReport& report) {
  if (system.blocks().size() > std::size_t(options.restart_contacts)) return;
  const std::string_view solver = report.solver;
  keep(system, first_lambda_);
  restart_->begin(system);
  for (int k = 0; options.friction_steps > 0 && k <= options.friction_steps; ++k) {
    restart_->set_friction(system, Scalar(k) / options.friction_steps);
    run_round(system, system.residual(), options, report);
  }
  for (int k = 0; k < options.scattered_starts; ++k) {
    if (system.residual() <= options.tolerance || is_over(options.interrupt)) break;
    restart_->scatter(system);
    run_round(system, system.residual(), options, report);
  }
  restart_->set_friction(system, 1);
  if (system.residual() < best) return;
  restore(system, first_lambda_);
  report.solver = solver;
}

Scalar contact_tolerance(Scalar largest_speed, Scalar rest_offset, Scalar h) {
  DYOP_REQUIRE(largest_speed >= 0, "speed must be >= 0, not ", largest_speed);
  DYOP_REQUIRE(rest_offset > 0 && h > 0, "rest_offset and step must be > 0, not ", rest_offset,
               " and ", h);
  const Scalar way = largest_speed * h / rest_offset;  // in a step, in rest offsets
  return std::clamp(kContactSpeedTolerance * way * std::max(way, Scalar{1}), kContactRestTolerance,
                    kContactLooseTolerance) *
         rest_offset / h;
}

}  // namespace dyop
