// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/dynamics/arkode_integrator.h"

#include <arkode/arkode_erkstep.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "dynamics/integrators/sundials_support.h"

namespace dyop {
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

}  // namespace dyop
