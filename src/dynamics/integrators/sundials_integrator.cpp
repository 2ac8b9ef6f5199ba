// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/dynamics/sundials_integrator.h"

#include <arkode/arkode_erkstep.h>
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sundials/sundials_nvector.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>
#include <sunnonlinsol/sunnonlinsol_newton.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "core/tolerance.h"
#include "dyop/dynamics/integrator.h"

namespace dyop::dynamics_internal {

/// Owns a SUNDIALS object; Free takes the handle.
template <typename Handle, auto Free>
struct SundialsDeleter {
  void operator()(Handle handle) const { Free(handle); }
};
using VectorPointer = std::unique_ptr<_generic_N_Vector, SundialsDeleter<N_Vector, N_VDestroy>>;

/// @throws InvalidArgument if f is empty or an option is out of range, naming the value.
void require_valid(const OdeFunction& f, const IntegratorOptions& options);

/// Wraps the user's right-hand side for SUNDIALS' C interface, which no exception may cross.
class GuardedFunction {
 public:
  GuardedFunction(OdeFunction f, std::size_t size);

  /// @throws IntegrationError if a derivative is not finite; passes on what f throws.
  void evaluate(Scalar t, std::span<const Scalar> y, std::span<Scalar> dydt);

  /// The callback for SUNDIALS; `self` is a GuardedFunction. Stores what is thrown and returns an
  /// unrecoverable error.
  static int call(sunrealtype t, N_Vector y, N_Vector dydt, void* self) noexcept;

  /// Throws the stored exception, once.
  void rethrow_kept();

  std::int64_t evaluations() const { return evaluations_; }

 private:
  OdeFunction f_;
  std::size_t size_;
  std::int64_t evaluations_ = 0;
  std::exception_ptr kept_;
};

/// One SUNDIALS solver for a system of size > 0. A call that fails throws what the user's function
/// threw, or else IntegrationError.
class SundialsSolver {
 public:
  SundialsSolver(const char* name, OdeFunction f, std::size_t size);
  virtual ~SundialsSolver();
  SundialsSolver(const SundialsSolver&) = delete;
  SundialsSolver& operator=(const SundialsSolver&) = delete;

  /// Discards all history.
  virtual void restart(Scalar t, std::span<const Scalar> y) = 0;
  /// Takes one step, not beyond t_end; returns the time reached.
  virtual Scalar step(Scalar t_end, std::span<Scalar> y) = 0;
  /// Dense output within the last step.
  virtual void evaluate(Scalar t, std::span<Scalar> y) = 0;
  /// Rejected attempts since the last restart.
  virtual std::int64_t rejected_steps() const = 0;

  const char* name() const { return name_; }
  GuardedFunction& function() { return function_; }

 protected:
  SUNContext context() const { return context_.get(); }
  N_Vector vector() const { return vector_.get(); }
  void load(std::span<const Scalar> y);
  void store(std::span<Scalar> y) const;

  /// Throws if `code`, returned by `call` at time t, is an error.
  void check(int code, const char* call, Scalar t);
  /// Throws if a SUNDIALS constructor returned null.
  void check_made(const void* object, const char* call) const;

  /// Error handler for SUNDIALS: stores the text instead of printing it; `self` is a
  /// SundialsSolver.
  static void keep_message(int code, const char* module, const char* function, char* message,
                           void* self) noexcept;

  /// Name of a return code, to be released with free().
  virtual char* code_name(int code) const = 0;

 private:
  static void free_context(SUNContext context) { SUNContext_Free(&context); }

  const char* name_;
  GuardedFunction function_;
  std::unique_ptr<_SUNContext, SundialsDeleter<SUNContext, free_context>> context_;
  VectorPointer vector_;
  std::string message_;
};

}  // namespace dyop::dynamics_internal

namespace dyop {
namespace dynamics_internal {

void require_valid(const OdeFunction& f, const IntegratorOptions& options) {
  DYOP_REQUIRE(f != nullptr, "integrator: the right-hand side is empty");
  DYOP_REQUIRE(options.relative_tolerance >= 0 && options.relative_tolerance < kInfinity,
               "integrator: relative_tolerance must be finite and >= 0, not ",
               options.relative_tolerance);
  DYOP_REQUIRE(options.absolute_tolerance > 0 && options.absolute_tolerance < kInfinity,
               "integrator: absolute_tolerance must be finite and > 0, not ",
               options.absolute_tolerance);
  DYOP_REQUIRE(options.max_step > 0, "integrator: max_step must be > 0, not ", options.max_step);
  DYOP_REQUIRE(options.max_internal_steps > 0, "integrator: max_internal_steps must be > 0, not ",
               options.max_internal_steps);
}

GuardedFunction::GuardedFunction(OdeFunction f, std::size_t size) : f_(std::move(f)), size_(size) {}

void GuardedFunction::evaluate(Scalar t, std::span<const Scalar> y, std::span<Scalar> dydt) {
  ++evaluations_;
  f_(t, y, dydt);
  for (std::size_t i = 0; i < dydt.size(); ++i) {
    if (!std::isfinite(dydt[i])) {
      throw IntegrationError(
          compose_message("derivative ", i, " is ", dydt[i], " at t = ", t, ", not finite"));
    }
  }
}

int GuardedFunction::call(sunrealtype t, N_Vector y, N_Vector dydt, void* self) noexcept {
  auto& guarded = *static_cast<GuardedFunction*>(self);
  try {
    guarded.evaluate(t, {N_VGetArrayPointer(y), guarded.size_},
                     {N_VGetArrayPointer(dydt), guarded.size_});
    return 0;
  } catch (...) {
    guarded.kept_ = std::current_exception();
    return -1;
  }
}

void GuardedFunction::rethrow_kept() {
  if (kept_) std::rethrow_exception(std::exchange(kept_, nullptr));
}

SundialsSolver::SundialsSolver(const char* name, OdeFunction f, std::size_t size)
    : name_(name), function_(std::move(f), size) {
  SUNContext context = nullptr;
  SUNContext_Create(nullptr, &context);
  context_.reset(context);
  check_made(context, "SUNContext_Create");
  vector_.reset(N_VNew_Serial(static_cast<sunindextype>(size), context));
  check_made(vector_.get(), "N_VNew_Serial");
  N_VConst(0, vector());
}

SundialsSolver::~SundialsSolver() = default;

void SundialsSolver::load(std::span<const Scalar> y) {
  std::copy(y.begin(), y.end(), N_VGetArrayPointer(vector()));
}

void SundialsSolver::store(std::span<Scalar> y) const {
  std::copy_n(N_VGetArrayPointer(vector()), y.size(), y.begin());
}

void SundialsSolver::check(int code, const char* call, Scalar t) {
  function_.rethrow_kept();
  if (code >= 0) return;  // positive codes are notices, such as reaching the stop time
  const std::unique_ptr<char, SundialsDeleter<void*, std::free>> code_text(code_name(code));
  throw IntegrationError(compose_message(name_, ": ", call, " failed at t = ", t, " with ",
                                         code_text ? code_text.get() : "an unnamed code", " (",
                                         code, "): ", std::exchange(message_, {})));
}

void SundialsSolver::check_made(const void* object, const char* call) const {
  if (object == nullptr) throw IntegrationError(compose_message(name_, ": ", call, " failed"));
}

void SundialsSolver::keep_message(int, const char*, const char*, char* message,
                                  void* self) noexcept {
  try {
    static_cast<SundialsSolver*>(self)->message_ = message;
  } catch (...) {
    // No memory left for an explanation; the code itself is still reported.
  }
}

}  // namespace dynamics_internal

using core_internal::compose_message;

namespace {

// If t_end cuts a step to less than this fraction of the longest one, its history is discarded: a
// multistep method of order q that grows back from it multiplies rounding noise by the growth to
// the power q. Adams was seen to jump by 1e4 tolerances. Larger: more restarts; smaller: more
// noise.
constexpr Scalar kCutStepFraction = 0.1;

}  // namespace

struct SundialsIntegrator::Impl {
  // How the state is known between begin and time.
  enum class Dense { Solver, Linear };

  void midpoint_step(Scalar t_end);
  void solver_step(Scalar t_end);
  void accept(Scalar t);

  std::unique_ptr<dynamics_internal::SundialsSolver> solver;
  IntegratorOptions options;
  Scalar begin = 0;
  Scalar time = 0;
  Scalar longest_step = 0;  // since the solver's last restart
  std::vector<Scalar> begin_state;
  std::vector<Scalar> state;
  std::vector<Scalar> next;  // the state proposed by the step in progress
  Dense dense = Dense::Linear;
  bool is_started = false;
  bool must_restart_solver = true;
  std::int64_t steps = 0;
  std::int64_t rejected_before = 0;  // before the solver's last restart
};

SundialsIntegrator::SundialsIntegrator(std::unique_ptr<dynamics_internal::SundialsSolver> solver,
                                       std::size_t size, const IntegratorOptions& options)
    : impl_(std::make_unique<Impl>()) {
  impl_->solver = std::move(solver);
  impl_->options = options;
  impl_->begin_state.resize(size);
  impl_->state.resize(size);
  impl_->next.resize(size);
}

SundialsIntegrator::~SundialsIntegrator() = default;

void SundialsIntegrator::restart(Scalar t, std::span<const Scalar> y) {
  DYOP_REQUIRE(std::isfinite(t), "integrator: t must be finite, not ", t);
  DYOP_REQUIRE(y.size() == impl_->state.size(), "integrator: y must have size ",
               impl_->state.size(), ", not ", y.size());
  for (std::size_t i = 0; i < y.size(); ++i) {
    DYOP_REQUIRE(std::isfinite(y[i]), "integrator: y[", i, "] must be finite, not ", y[i]);
  }
  // y may be our own state().
  std::copy(y.begin(), y.end(), impl_->next.begin());
  impl_->state = impl_->next;
  impl_->begin_state = impl_->next;
  impl_->begin = t;
  impl_->time = t;
  impl_->dense = Impl::Dense::Linear;
  impl_->is_started = true;
  impl_->must_restart_solver = true;
}

void SundialsIntegrator::step(Scalar t_end) {
  DYOP_REQUIRE(impl_->is_started, "integrator: restart() must come before the first step()");
  const Scalar t = impl_->time;
  DYOP_REQUIRE(t_end > t && t_end < kInfinity, "integrator: t_end must be finite and > ", t,
               ", not ", t_end);
  const Scalar target = std::min(t_end, t + impl_->options.max_step);
  if (!(target > t)) {
    throw IntegrationError(compose_message("integrator: max_step ", impl_->options.max_step,
                                           " is below the resolution of time at t = ", t));
  }
  if (!impl_->solver) {
    impl_->accept(target);
    return;
  }
  const Scalar longest = impl_->must_restart_solver ? 0 : impl_->longest_step;
  const Scalar shortest =
      std::max(kShortestSolverStep * std::max({std::abs(t), std::abs(target), longest}),
               kShortestSolverTime);
  if (target - t <= shortest) {
    impl_->midpoint_step(target);
  } else {
    impl_->solver_step(t_end);
  }
}

void SundialsIntegrator::Impl::midpoint_step(Scalar t_end) {
  const Scalar h = t_end - time;
  std::vector<Scalar> rate(state.size());
  solver->function().evaluate(time, state, rate);
  for (std::size_t i = 0; i < state.size(); ++i) next[i] = state[i] + h / 2 * rate[i];
  solver->function().evaluate(time + h / 2, next, rate);
  for (std::size_t i = 0; i < state.size(); ++i) next[i] = state[i] + h * rate[i];
  accept(t_end);
  dense = Dense::Linear;
  must_restart_solver = true;
}

void SundialsIntegrator::Impl::solver_step(Scalar t_end) {
  if (must_restart_solver) {
    rejected_before += solver->rejected_steps();
    solver->restart(time, state);
    longest_step = 0;
  }
  must_restart_solver = true;  // unless this step succeeds
  const std::int64_t rejected = solver->rejected_steps();
  // A step may be too short to advance time; the solver then makes the next one longer.
  for (std::int64_t i = 1;; ++i) {
    const Scalar reached = solver->step(t_end, next);
    if (reached > time) {
      const Scalar length = reached - time;
      accept(reached);
      dense = Dense::Solver;
      longest_step = std::max(longest_step, length);
      must_restart_solver = reached == t_end && length < kCutStepFraction * longest_step;
      return;
    }
    if (i + solver->rejected_steps() - rejected >= options.max_internal_steps) {
      throw IntegrationError(
          compose_message(solver->name(), ": no progress at t = ", time,
                          " after max_internal_steps = ", options.max_internal_steps, " attempts"));
    }
  }
}

void SundialsIntegrator::Impl::accept(Scalar t) {
  for (std::size_t i = 0; i < next.size(); ++i) {
    if (!std::isfinite(next[i])) {
      throw IntegrationError(compose_message(solver->name(), ": y[", i, "] is ", next[i],
                                             " at t = ", t, ", not finite"));
    }
  }
  begin_state.swap(state);
  state.swap(next);
  begin = time;
  time = t;
  ++steps;
}

Scalar SundialsIntegrator::begin() const {
  return impl_->begin;
}

Scalar SundialsIntegrator::time() const {
  return impl_->time;
}

std::span<const Scalar> SundialsIntegrator::state() const {
  return impl_->state;
}

void SundialsIntegrator::evaluate(Scalar t, std::span<Scalar> y) const {
  const Impl& impl = *impl_;
  DYOP_REQUIRE(impl.is_started, "integrator: restart() must come before evaluate()");
  DYOP_REQUIRE(t >= impl.begin && t <= impl.time, "integrator: t must be in [", impl.begin, ", ",
               impl.time, "], not ", t);
  DYOP_REQUIRE(y.size() == impl.state.size(), "integrator: y must have size ", impl.state.size(),
               ", not ", y.size());
  if (t == impl.time) {
    std::copy(impl.state.begin(), impl.state.end(), y.begin());
  } else if (t == impl.begin) {
    std::copy(impl.begin_state.begin(), impl.begin_state.end(), y.begin());
  } else if (impl.dense == Impl::Dense::Solver) {
    impl.solver->evaluate(t, y);
  } else {
    const Scalar s = (t - impl.begin) / (impl.time - impl.begin);
    for (std::size_t i = 0; i < y.size(); ++i) {
      y[i] = impl.begin_state[i] + s * (impl.state[i] - impl.begin_state[i]);
    }
  }
}

IntegratorStatistics SundialsIntegrator::statistics() const {
  if (!impl_->solver) return {impl_->steps, 0, 0};
  return {impl_->steps, impl_->rejected_before + impl_->solver->rejected_steps(),
          impl_->solver->function().evaluations()};
}

namespace {

using dynamics_internal::GuardedFunction;
using dynamics_internal::SundialsDeleter;
using dynamics_internal::SundialsSolver;

void free_arkode(void* memory) {
  ERKStepFree(&memory);
}

class ArkodeSolver final : public SundialsSolver {
 public:
  ArkodeSolver(OdeFunction f, std::size_t size, const IntegratorOptions& options)
      : SundialsSolver("ARKODE", std::move(f), size) {
    memory_.reset(ERKStepCreate(GuardedFunction::call, 0, vector(), context()));
    check_made(memory_.get(), "ERKStepCreate");
    void* const memory = memory_.get();
    const auto set = [this](int code, const char* call) { check(code, call, 0); };
    set(ERKStepSetErrHandlerFn(memory, keep_message, this), "ERKStepSetErrHandlerFn");
    set(ERKStepSetUserData(memory, &function()), "ERKStepSetUserData");
    set(ERKStepSetOrder(memory, 4), "ERKStepSetOrder");
    set(ERKStepSetInterpolantType(memory, ARK_INTERP_HERMITE), "ERKStepSetInterpolantType");
    set(ERKStepSetInterpolantDegree(memory, 3), "ERKStepSetInterpolantDegree");
    set(ERKStepSStolerances(memory, options.relative_tolerance, options.absolute_tolerance),
        "ERKStepSStolerances");
    set(ERKStepSetMaxStep(memory, options.max_step), "ERKStepSetMaxStep");
    // An explicit step is rejected only for its error, so this limits the attempts.
    const auto attempts =
        std::min<std::int64_t>(options.max_internal_steps, std::numeric_limits<int>::max());
    set(ERKStepSetMaxErrTestFails(memory, static_cast<int>(attempts)), "ERKStepSetMaxErrTestFails");
  }

  void restart(Scalar t, std::span<const Scalar> y) override {
    load(y);
    check(ERKStepReInit(memory_.get(), GuardedFunction::call, t, vector()), "ERKStepReInit", t);
    t_ = t;
  }

  Scalar step(Scalar t_end, std::span<Scalar> y) override {
    check(ERKStepSetStopTime(memory_.get(), t_end), "ERKStepSetStopTime", t_);
    Scalar reached = t_;
    check(ERKStepEvolve(memory_.get(), t_end, vector(), &reached, ARK_ONE_STEP), "ERKStepEvolve",
          t_);
    store(y);
    t_ = reached;
    return reached;
  }

  void evaluate(Scalar t, std::span<Scalar> y) override {
    check(ERKStepGetDky(memory_.get(), t, 0, vector()), "ERKStepGetDky", t);
    store(y);
  }

  std::int64_t rejected_steps() const override {
    long int failures = 0;
    ERKStepGetNumErrTestFails(memory_.get(), &failures);
    return failures;
  }

 protected:
  char* code_name(int code) const override { return ERKStepGetReturnFlagName(code); }

 private:
  std::unique_ptr<void, SundialsDeleter<void*, free_arkode>> memory_;
  Scalar t_ = 0;  // the solver's time, for messages
};

std::unique_ptr<SundialsSolver> make_solver(OdeFunction f, std::size_t size,
                                            const IntegratorOptions& options) {
  dynamics_internal::require_valid(f, options);
  if (size == 0) return nullptr;
  return std::make_unique<ArkodeSolver>(std::move(f), size, options);
}

}  // namespace

ArkodeIntegrator::ArkodeIntegrator(OdeFunction f, std::size_t size,
                                   const IntegratorOptions& options)
    : SundialsIntegrator(make_solver(std::move(f), size, options), size, options) {}

namespace {

// CVODE's default limit on failures to solve the implicit equations within one step.
constexpr std::int64_t kConvergenceFailures = 10;

void free_cvode(void* memory) {
  CVodeFree(&memory);
}

class CvodeSolver final : public SundialsSolver {
 public:
  CvodeSolver(CvodeMethod method, OdeFunction f, std::size_t size, const IntegratorOptions& options)
      : SundialsSolver(method == CvodeMethod::Adams ? "CVODE Adams" : "CVODE BDF", std::move(f),
                       size) {
    memory_.reset(CVodeCreate(method == CvodeMethod::Adams ? CV_ADAMS : CV_BDF, context()));
    check_made(memory_.get(), "CVodeCreate");
    void* const memory = memory_.get();
    set(CVodeSetErrHandlerFn(memory, keep_message, this), "CVodeSetErrHandlerFn");
    set(CVodeSetUserData(memory, &function()), "CVodeSetUserData");
    set(CVodeInit(memory, GuardedFunction::call, 0, vector()), "CVodeInit");
    set(CVodeSStolerances(memory, options.relative_tolerance, options.absolute_tolerance),
        "CVodeSStolerances");
    set(CVodeSetMaxStep(memory, options.max_step), "CVodeSetMaxStep");
    limit_attempts(options.max_internal_steps);
    if (method == CvodeMethod::Adams) {
      use_fixed_point();
    } else {
      use_newton(size);
    }
  }

  void restart(Scalar t, std::span<const Scalar> y) override {
    load(y);
    check(CVodeReInit(memory_.get(), t, vector()), "CVodeReInit", t);
    t_ = t;
  }

  Scalar step(Scalar t_end, std::span<Scalar> y) override {
    check(CVodeSetStopTime(memory_.get(), t_end), "CVodeSetStopTime", t_);
    Scalar reached = t_;
    check(CVode(memory_.get(), t_end, vector(), &reached, CV_ONE_STEP), "CVode", t_);
    store(y);
    t_ = reached;
    return reached;
  }

  void evaluate(Scalar t, std::span<Scalar> y) override {
    check(CVodeGetDky(memory_.get(), t, 0, vector()), "CVodeGetDky", t);
    store(y);
  }

  std::int64_t rejected_steps() const override {
    long int error_failures = 0;
    long int solve_failures = 0;
    CVodeGetNumErrTestFails(memory_.get(), &error_failures);
    CVodeGetNumStepSolveFails(memory_.get(), &solve_failures);
    return std::int64_t{error_failures} + solve_failures;
  }

 protected:
  char* code_name(int code) const override { return CVodeGetReturnFlagName(code); }

 private:
  void set(int code, const char* call) { check(code, call, 0); }

  // CVODE gives up at the a-th failure of the error test or the b-th of the implicit solve, so
  // after at most a + b - 1 attempts.
  void limit_attempts(std::int64_t attempts) {
    const std::int64_t b = std::min(kConvergenceFailures, (attempts - 1) / 2 + 1);
    const std::int64_t a =
        std::min<std::int64_t>(attempts - b, std::numeric_limits<int>::max() - 1) + 1;
    set(CVodeSetMaxConvFails(memory_.get(), static_cast<int>(b)), "CVodeSetMaxConvFails");
    set(CVodeSetMaxErrTestFails(memory_.get(), static_cast<int>(a)), "CVodeSetMaxErrTestFails");
  }

  void use_fixed_point() {
    nonlinear_solver_.reset(SUNNonlinSol_FixedPoint(vector(), 0, context()));
    check_made(nonlinear_solver_.get(), "SUNNonlinSol_FixedPoint");
    set(CVodeSetNonlinearSolver(memory_.get(), nonlinear_solver_.get()), "CVodeSetNonlinearSolver");
  }

  void use_newton(std::size_t size) {
    const auto n = static_cast<sunindextype>(size);
    nonlinear_solver_.reset(SUNNonlinSol_Newton(vector(), context()));
    check_made(nonlinear_solver_.get(), "SUNNonlinSol_Newton");
    set(CVodeSetNonlinearSolver(memory_.get(), nonlinear_solver_.get()), "CVodeSetNonlinearSolver");
    matrix_.reset(SUNDenseMatrix(n, n, context()));
    check_made(matrix_.get(), "SUNDenseMatrix");
    linear_solver_.reset(SUNLinSol_Dense(vector(), matrix_.get(), context()));
    check_made(linear_solver_.get(), "SUNLinSol_Dense");
    set(CVodeSetLinearSolver(memory_.get(), linear_solver_.get(), matrix_.get()),
        "CVodeSetLinearSolver");
  }

  // CVODE uses the solvers, so it must be destroyed first: it is the last member.
  std::unique_ptr<_generic_SUNMatrix, SundialsDeleter<SUNMatrix, SUNMatDestroy>> matrix_;
  std::unique_ptr<_generic_SUNLinearSolver, SundialsDeleter<SUNLinearSolver, SUNLinSolFree>>
      linear_solver_;
  std::unique_ptr<_generic_SUNNonlinearSolver,
                  SundialsDeleter<SUNNonlinearSolver, SUNNonlinSolFree>>
      nonlinear_solver_;
  std::unique_ptr<void, SundialsDeleter<void*, free_cvode>> memory_;
  Scalar t_ = 0;  // the solver's time, for messages
};

std::unique_ptr<SundialsSolver> make_solver(CvodeMethod method, OdeFunction f, std::size_t size,
                                            const IntegratorOptions& options) {
  dynamics_internal::require_valid(f, options);
  if (size == 0) return nullptr;
  return std::make_unique<CvodeSolver>(method, std::move(f), size, options);
}

}  // namespace

CvodeIntegrator::CvodeIntegrator(CvodeMethod method, OdeFunction f, std::size_t size,
                                 const IntegratorOptions& options)
    : SundialsIntegrator(make_solver(method, std::move(f), size, options), size, options) {}

std::unique_ptr<Integrator> make_integrator(IntegratorKind kind, OdeFunction f, std::size_t size,
                                            const IntegratorOptions& options) {
  switch (kind) {
    case IntegratorKind::Arkode:
      return std::make_unique<ArkodeIntegrator>(std::move(f), size, options);
    case IntegratorKind::CvodeAdams:
      return std::make_unique<CvodeIntegrator>(CvodeMethod::Adams, std::move(f), size, options);
    case IntegratorKind::CvodeBdf:
      return std::make_unique<CvodeIntegrator>(CvodeMethod::Bdf, std::move(f), size, options);
  }
  throw InvalidArgument(
      core_internal::compose_message("unknown integrator kind ", static_cast<int>(kind)));
}

}  // namespace dyop
