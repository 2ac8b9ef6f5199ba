// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sundials/sundials_context.h>
#include <sundials/sundials_nvector.h>

#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <span>
#include <string>

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
