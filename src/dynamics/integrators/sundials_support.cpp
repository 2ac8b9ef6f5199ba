// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/integrators/sundials_support.h"

#include <nvector/nvector_serial.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace dyop::dynamics_internal {

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

}  // namespace dyop::dynamics_internal
