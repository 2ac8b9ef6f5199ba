// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <vector>

#include "contact/solver/body_matrix.h"
#include "contact/solver/contact_law.h"
#include "contact/solver/contact_system.h"
#include "core/tolerance.h"
#include "dyop/contact/contact_solver.h"

namespace dyop::contact_internal {

// Where more contacts carry a body than are needed, and what they ask of it differs by a little,
// some must let go. Multipliers then drift: every outer iteration shifts the same small amount of
// impulse from one contact to another, with hardly any effect on velocities, until one is at its
// bound; the smaller the contradiction, the more iterations that takes. This finds such a drift
// and goes to its end at once.
class ImpulseDrift {
 public:
  // Forgets earlier iterations.
  void clear();

  // Call after each outer iteration with its penalty and the impulses from before it. If they go on
  // changing like the last time, moves the system's impulses along that change until the first of
  // them that was inside its bounds reaches them. Returns whether it did.
  bool follow(ContactSystem& system, const std::vector<Vector3>& before, Scalar penalty);

 private:
  bool is_steady(const std::vector<Block>& blocks, Scalar growth) const;

  std::vector<Vector3> previous_, change_;
  Scalar previous_penalty_ = 0;  // 0: there is no previous change
};

namespace {

// Changes whose angle has at least this cosine are parallel. Found by measurement.
constexpr Scalar kParallel = 0.99;
// A change of at least this part of the last one, for the same penalty, does not converge.
constexpr Scalar kSteady = 0.9;
// Impulses at the edge of a cone turn by at most about this angle, radians.
constexpr Scalar kMostTurn = 0.3;
// Impulses nearer to their bound than this part of it are at it.
constexpr Scalar kAtBound = 1e-9;  // literal: relative; rounding of a projection is far smaller

// Smallest s > 0 at which |x + s dx| = r + s dr, for |x| < r; infinite if there is none. Of an x at
// the bound: at which the bound vanishes or x has turned too far to be followed.
Scalar way_to_disc(const Vector2& x, const Vector2& dx, Scalar r, Scalar dr) {
  if (!(x.norm() < (1 - kAtBound) * r)) {
    const Scalar turn = std::abs(x[0] * dx[1] - x[1] * dx[0]);
    const Scalar to_end = dr < 0 ? -r / dr : kInfinity;
    return turn > 0 ? std::min(to_end, kMostTurn * x.squaredNorm() / turn) : to_end;
  }
  const Scalar a = dx.squaredNorm() - dr * dr;
  const Scalar b = x.dot(dx) - r * dr;
  const Scalar c = x.squaredNorm() - r * r;  // < 0
  const Scalar discriminant = b * b - a * c;
  if (!(discriminant >= 0)) return kInfinity;
  // The root of the sign that avoids cancellation; a <= 0 may have none ahead.
  const Scalar root = std::sqrt(discriminant);
  const Scalar s = b > 0 ? -c / (b + root) : (root - b) / a;
  return s > 0 ? s : kInfinity;
}

Scalar way_to_interval(Scalar x, Scalar dx, Scalar lower, Scalar upper) {
  if (x <= lower || x >= upper || dx == 0) return kInfinity;
  return (dx > 0 ? upper - x : lower - x) / dx;
}

// How often the change can be repeated before the block's impulse is at its bounds; infinite if it
// is there already and does not become free.
Scalar way(const std::vector<Block>& blocks, const std::vector<Vector3>& change, std::size_t i) {
  const Block& block = blocks[i];
  const Vector3& x = block.lambda;
  const Vector3& dx = change[i];
  const std::size_t owner = block.owner < 0 ? i : std::size_t(block.owner);
  const Scalar normal = blocks[owner].lambda[0];
  switch (block.kind) {
    case BlockKind::Contact: {
      const Scalar mu = block.friction;
      const Scalar to_cone =
          mu > 0 ? way_to_disc(x.tail<2>(), dx.tail<2>(), mu * x[0], mu * dx[0]) : kInfinity;
      return dx[0] < 0 ? std::min(to_cone, -x[0] / dx[0]) : to_cone;
    }
    case BlockKind::Row:
      return way_to_interval(x[0], dx[0], block.lower, block.upper);
    case BlockKind::Rolling:
    case BlockKind::Torsion:
      return way_to_disc(x.head<2>(), dx.head<2>(), normal, change[owner][0]);
  }
  return kInfinity;  // not reached
}

}  // namespace

void ImpulseDrift::clear() {
  previous_.clear();
  previous_penalty_ = 0;
}

// Whether the change goes on like the last one. What converges changes less each time; a drift
// does not, and is proportional to the penalty.
bool ImpulseDrift::is_steady(const std::vector<Block>& blocks, Scalar growth) const {
  Scalar product = 0;
  Scalar change_sq = 0;
  Scalar previous_sq = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    product += blocks[i].weight * change_[i].dot(previous_[i]);
    change_sq += blocks[i].weight * change_[i].squaredNorm();
    previous_sq += blocks[i].weight * previous_[i].squaredNorm();
  }
  return change_sq > 0 && product >= kParallel * std::sqrt(change_sq * previous_sq) &&
         std::sqrt(change_sq) >= kSteady * growth * std::sqrt(previous_sq);
}

bool ImpulseDrift::follow(ContactSystem& system, const std::vector<Vector3>& before,
                          Scalar penalty) {
  std::vector<Block>& blocks = system.blocks();
  std::swap(previous_, change_);
  change_.resize(blocks.size());
  for (std::size_t i = 0; i < blocks.size(); ++i) change_[i] = blocks[i].lambda - before[i];
  const Scalar growth = previous_penalty_ > 0 ? penalty / previous_penalty_ : kInfinity;
  previous_penalty_ = penalty;
  if (growth == kInfinity || !is_steady(blocks, growth)) return false;
  Scalar times = kInfinity;
  for (std::size_t i = 0; i < blocks.size(); ++i) times = std::min(times, way(blocks, change_, i));
  if (!(times > 0 && times < kInfinity)) return false;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    Block& block = blocks[i];
    block.lambda += times * change_[i];
    const Scalar normal = block.owner >= 0 ? blocks[std::size_t(block.owner)].lambda[0] : 0;
    block.lambda = project(block, block.lambda, normal);
  }
  system.update_velocities();
  clear();
  return true;
}

}  // namespace dyop::contact_internal

namespace dyop {
namespace contact_internal {
namespace {

// Starting impulses whose residual is so small a part of that without impulses have nearly all
// contacts in the right state: then a large penalty diverges no more, and stands for fewer
// iterations. Found by measurement.
constexpr Scalar kNearStart = 1e-4;  // literal: a ratio of residuals
constexpr Scalar kNearPenalty = 3e5;
// Multipliers that drift are followed from this residual on, a part of that without impulses:
// farther away, contacts still change state, and what looks like a drift ends by itself. Found by
// measurement.
constexpr Scalar kDriftResidual = 1e-3;

}  // namespace

// For multipliers lambda_k and De Saxce's shifts of an outer iteration, finds the y that minimises
//   1/2 |y|^2 + sum over blocks of max over lambda in C of
//       -lambda . u~ - |lambda - lambda_k|^2 / (2 rho) - compliance |lambda|^2 / 2,
// with u~ = free + G y + shift n: convex, once differentiable, Hessian I + sum of G^T rho P' G.
class NewtonRun {
 public:
  // Starts at the system's impulses.
  void begin(ContactSystem& system, const ContactSolverOptions& options);

  // Sets multipliers and shifts from the present y, and the penalty rho = factor / W_nn.
  void begin_outer(Scalar factor);

  enum class End { Converged, Minimised, Failed };
  // One outer iteration of at most `limit` factorisations, which it counts.
  End minimise(int limit, int& factorisations);

  // Newton steps on the whole law, shifts included, with new multipliers at each step, for as long
  // as every step halves the residual.
  End polish(Scalar factor, int limit, int& factorisations);

  // Near the solution, follows a drift of the multipliers over the last two outer iterations to its
  // end. Returns whether there was one.
  bool end_drift();

  // Puts the impulses with the smallest residual into the system.
  void restore_best() { restore(best_lambda_, best_residual_); }
  // Penalty to begin with, times a contact's mobility.
  Scalar first_penalty() const {
    const bool is_near = best_residual_ <= kNearStart * system_->residual_without_impulses();
    return is_near ? kNearPenalty : kContactPenalty;
  }
  Scalar best_residual() const { return best_residual_; }
  bool is_lost() const { return !std::isfinite(residual_); }

 private:
  Vector3 raw_impulse(std::size_t i, const Vector3& u) const;  // before its projection onto C
  void compute_u(const std::vector<Vector6>& y, std::vector<Vector3>& u) const;
  void restore(const std::vector<Vector3>& lambda, Scalar residual);
  void compute_shifts();
  Scalar take_impulses();
  Scalar compute_gradient();
  bool compute_step(bool with_shifts);
  bool step_on_whole_law();
  End minimise_whole_law(int limit, int& factorisations);
  Scalar slope_at_start() const;
  Scalar slope(Scalar t) const;
  bool search_line();

  ContactSystem* system_ = nullptr;
  Scalar tolerance_ = 0;
  Interrupt* interrupt_ = nullptr;
  Scalar residual_ = kInfinity;  // of the impulses that are in the system
  Scalar outer_residual_ = kInfinity;
  Scalar best_residual_ = kInfinity;
  BodyMatrix matrix_;
  ImpulseDrift drift_;
  std::vector<Vector3> lambda_, best_lambda_;
  std::vector<Scalar> rho_, shift_, radius_;
  std::vector<Scalar> penalty_;         // d lambda / d u, without P'
  std::vector<Vector3> lambda_by_rho_;  // lambda_ / rho_
  std::vector<Vector3> raw_;            // raw impulses at y_, of take_impulses()
  std::vector<Vector3> u_, du_;         // without compliance and shift
  std::vector<Vector6> y_, step_;
};

void NewtonRun::begin(ContactSystem& system, const ContactSolverOptions& options) {
  system_ = &system;
  tolerance_ = options.tolerance;
  interrupt_ = options.interrupt;
  const std::size_t count = system.blocks().size();
  for (auto* array : {&lambda_, &best_lambda_, &lambda_by_rho_, &raw_, &u_, &du_}) {
    array->resize(count);
  }
  for (auto* array : {&rho_, &penalty_, &shift_, &radius_}) array->resize(count);
  system.update_velocities();
  y_ = system.velocities();
  step_.resize(y_.size());
  for (std::size_t i = 0; i < count; ++i) best_lambda_[i] = system.blocks()[i].lambda;
  residual_ = system.residual();
  best_residual_ = residual_;
  outer_residual_ = residual_;
  matrix_.analyse(system);
  drift_.clear();
  compute_u(y_, u_);
}

void NewtonRun::begin_outer(Scalar factor) {
  const std::vector<Block>& blocks = system_->blocks();
  outer_residual_ = residual_;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    lambda_[i] = blocks[i].lambda;
    rho_[i] = factor / blocks[i].weight;
    penalty_[i] = rho_[i] / (1 + rho_[i] * blocks[i].compliance);
    lambda_by_rho_[i] = lambda_[i] / rho_[i];
  }
  compute_shifts();
}

void NewtonRun::compute_shifts() {
  const std::vector<Block>& blocks = system_->blocks();
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const Block& block = blocks[i];
    const bool is_contact = block.kind == BlockKind::Contact;
    shift_[i] = is_contact ? block.friction * tangent_length(u_[i]) : 0;
    radius_[i] = block.owner >= 0 ? blocks[std::size_t(block.owner)].lambda[0] : 0;
  }
}

Vector3 NewtonRun::raw_impulse(std::size_t i, const Vector3& u) const {
  const Vector3& start = lambda_by_rho_[i];
  const Scalar factor = penalty_[i];
  return {factor * (start[0] - u[0] - shift_[i]), factor * (start[1] - u[1]),
          factor * (start[2] - u[2])};
}

void NewtonRun::compute_u(const std::vector<Vector6>& y, std::vector<Vector3>& u) const {
  const std::vector<Block>& blocks = system_->blocks();
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const Block& block = blocks[i];
    u[i].setZero();
    if (block.slot_a >= 0) u[i] += block.G_a * y[std::size_t(block.slot_a)];
    if (block.slot_b >= 0) u[i] += block.G_b * y[std::size_t(block.slot_b)];
    if (&u == &u_) u[i] += block.free;
  }
}

// Puts the impulses that belong to y into the system; returns their residual.
Scalar NewtonRun::take_impulses() {
  std::vector<Block>& blocks = system_->blocks();
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    raw_[i] = raw_impulse(i, u_[i]);
    blocks[i].lambda = project(blocks[i], raw_[i], radius_[i]);
  }
  system_->update_velocities();
  residual_ = system_->residual();
  if (residual_ < best_residual_) {
    best_residual_ = residual_;
    for (std::size_t i = 0; i < blocks.size(); ++i) best_lambda_[i] = blocks[i].lambda;
  }
  return residual_;
}

// Stores the negative gradient in step_. Returns its largest effect on a relative velocity.
Scalar NewtonRun::compute_gradient() {
  for (std::size_t i = 0; i < y_.size(); ++i) step_[i] = system_->velocities()[i] - y_[i];
  compute_u(step_, du_);
  Scalar largest_sq = 0;
  for (const Vector3& du : du_) largest_sq = std::max(largest_sq, du.squaredNorm());
  return std::sqrt(largest_sq);
}

// The impulses at y_ have been taken.
bool NewtonRun::compute_step(bool with_shifts) {
  matrix_.reset(!with_shifts);
  const std::vector<Block>& blocks = system_->blocks();
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    Matrix3 D = project_derivative(blocks[i], raw_[i], radius_[i]);
    if (D.isZero(0)) continue;
    D *= penalty_[i];
    if (with_shifts && shift_[i] > 0) {  // d shift / d u_t = friction u_t / |u_t|
      const Vector2 along = u_[i].tail<2>().normalized();
      D.rightCols<2>() += blocks[i].friction * D.col(0) * along.transpose();
    }
    matrix_.add(*system_, i, D);
  }
  if (!matrix_.factorise()) return false;
  matrix_.solve(step_);
  compute_u(step_, du_);
  return true;
}

// slope(0): the impulses at y_ are in the system.
Scalar NewtonRun::slope_at_start() const {
  const std::vector<Block>& blocks = system_->blocks();
  Scalar sum = 0;
  for (std::size_t i = 0; i < y_.size(); ++i) sum += step_[i].dot(y_[i]);
  for (std::size_t i = 0; i < blocks.size(); ++i) sum -= du_[i].dot(blocks[i].lambda);
  return sum;
}

// Derivative of the objective along the step.
Scalar NewtonRun::slope(Scalar t) const {
  const std::vector<Block>& blocks = system_->blocks();
  Scalar sum = 0;
  for (std::size_t i = 0; i < y_.size(); ++i) sum += step_[i].dot(y_[i] + t * step_[i]);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const Vector3 u = u_[i] + t * du_[i];
    sum -= du_[i].dot(project(blocks[i], raw_impulse(i, u), radius_[i]));
  }
  return sum;
}

// Moves along the step to a point where the slope is at most half as steep. The slope grows with t.
bool NewtonRun::search_line() {
  const Scalar at_zero = slope_at_start();
  if (!(at_zero < 0 && at_zero > -kInfinity)) return false;
  Scalar low = 0;
  Scalar high = 1;
  Scalar slope_low = at_zero;
  Scalar slope_high = slope(1);
  Scalar t = 1;
  for (int i = 0; i < kContactLineLimit && slope_high > -at_zero / 2; ++i) {
    // False position, kept away from the ends.
    const Scalar part = slope_low / (slope_low - slope_high);
    t = low + (high - low) * std::clamp(part, Scalar{0.1}, Scalar{0.9});
    const Scalar here = slope(t);
    if (std::abs(here) <= -at_zero / 2) break;
    (here < 0 ? low : high) = t;
    (here < 0 ? slope_low : slope_high) = here;
  }
  for (std::size_t i = 0; i < y_.size(); ++i) y_[i] += t * step_[i];
  compute_u(y_, u_);
  return true;
}

NewtonRun::End NewtonRun::minimise(int limit, int& factorisations) {
  const Scalar goal = std::max(outer_residual_, tolerance_) * 0.1;
  for (int i = 0;; ++i) {
    if (take_impulses() <= tolerance_) return End::Converged;
    if (compute_gradient() <= goal) return End::Minimised;
    if (i == limit || is_over(interrupt_)) return End::Failed;
    ++factorisations;
    if (!compute_step(false) || !search_line()) return End::Failed;
  }
}

bool NewtonRun::step_on_whole_law() {
  if (!compute_step(true)) return false;
  for (std::size_t k = 0; k < y_.size(); ++k) y_[k] += step_[k];
  compute_u(y_, u_);
  compute_shifts();
  return true;
}

NewtonRun::End NewtonRun::minimise_whole_law(int limit, int& factorisations) {
  if (take_impulses() <= tolerance_) return End::Converged;
  Scalar gradient = compute_gradient();
  for (int i = 0; i < limit && !is_over(interrupt_); ++i) {
    ++factorisations;
    if (!step_on_whole_law()) return End::Failed;
    const Scalar residual = take_impulses();
    if (residual <= tolerance_) return End::Converged;
    const Scalar before = gradient;
    gradient = compute_gradient();
    if (gradient <= 0.1 * residual) {
      return residual <= outer_residual_ / 2 ? End::Minimised : End::Failed;
    }
    // The first step may increase the gradient, when a contact changes state.
    if (i > 0 && !(gradient <= before / 2)) return End::Failed;
  }
  return End::Failed;
}

NewtonRun::End NewtonRun::polish(Scalar factor, int limit, int& factorisations) {
  while (factorisations < limit) {
    y_ = system_->velocities();
    compute_u(y_, u_);
    begin_outer(factor);
    const int left = std::min(limit - factorisations, kContactPolishLimit);
    const End end = minimise_whole_law(left, factorisations);
    if (end == End::Converged) return end;
    if (end == End::Failed) {
      restore(lambda_, outer_residual_);
      return end;
    }
    factor = std::min(factor * 10, kContactPolishPenalty);
  }
  return End::Minimised;
}

bool NewtonRun::end_drift() {
  const bool is_near = residual_ < kDriftResidual * system_->residual_without_impulses();
  if (!is_near || !drift_.follow(*system_, lambda_, rho_[0])) return false;
  residual_ = system_->residual();
  y_ = system_->velocities();
  compute_u(y_, u_);
  return true;
}

void NewtonRun::restore(const std::vector<Vector3>& lambda, Scalar residual) {
  std::vector<Block>& blocks = system_->blocks();
  for (std::size_t i = 0; i < blocks.size(); ++i) blocks[i].lambda = lambda[i];
  residual_ = residual;
  system_->update_velocities();
  y_ = system_->velocities();
  compute_u(y_, u_);
}

}  // namespace contact_internal

NewtonSolver::NewtonSolver() : run_(std::make_unique<contact_internal::NewtonRun>()) {}
NewtonSolver::~NewtonSolver() = default;

void NewtonSolver::improve(contact_internal::ContactSystem& system,
                           const ContactSolverOptions& options, ContactReport& report) {
  using End = contact_internal::NewtonRun::End;
  if (options.newton_limit == 0 || is_over(options.interrupt)) return;
  run_->begin(system, options);
  Scalar factor = run_->first_penalty();
  int left = options.newton_limit;
  int wait = 0;       // outer iterations until the next polish
  int next_wait = 1;  // after a failed polish
  contact_internal::Progress progress(run_->best_residual(), options.patience);
  while (left > 0 && !is_over(options.interrupt)) {
    const int done = options.newton_limit - left;
    if (progress.has_stalled(done, run_->best_residual())) break;
    int used = 0;
    if (wait-- <= 0) {
      const End end = run_->polish(factor, left, used);
      report.newton_iterations += used;
      left -= used;
      if (end == End::Converged || left <= 0) break;
      wait = next_wait;
      next_wait *= 2;
      used = 0;
    }
    run_->begin_outer(factor);
    const End end = run_->minimise(std::min(left, kContactInnerLimit), used);
    report.newton_iterations += used;
    left -= std::max(used, 1);
    if (end == End::Converged) break;
    if (end == End::Failed) {
      if (run_->is_lost()) run_->restore_best();
      factor = std::max(factor / 10, Scalar{1});
    } else if (used <= kContactInnerFew) {
      factor = std::max(factor, std::min(factor * 4, kContactLargestPenalty));
    }
    if (options.follows_drift && end == End::Minimised && run_->end_drift()) {
      factor = std::min(factor * 10, kContactPolishPenalty);
    }
  }
  run_->restore_best();
}

}  // namespace dyop
