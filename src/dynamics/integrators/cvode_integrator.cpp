// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/dynamics/cvode_integrator.h"

#include <cvode/cvode.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>
#include <sunnonlinsol/sunnonlinsol_newton.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "dynamics/integrators/sundials_support.h"

namespace dyop {
namespace {

using dynamics_internal::GuardedFunction;
using dynamics_internal::SundialsDeleter;
using dynamics_internal::SundialsSolver;

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

}  // namespace dyop
