// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "dyop/core/error.h"
#include "dyop/core/types.h"

namespace DYOP_EXPORT dyop {

/// The solver failed; the message names the solver, the failed call and the reason.
class IntegrationError : public Error {
 public:
  using Error::Error;
};

/// Right-hand side y' = f(t, y). Sizes of y and dydt are equal and constant.
using OdeFunction =
    std::function<void(Scalar t, std::span<const Scalar> y, std::span<Scalar> dydt)>;

struct IntegratorOptions {
  Scalar relative_tolerance = 1e-8;           // literal: a default the user sees, per step
  Scalar absolute_tolerance = 1e-10;          // literal: in the units of the state
  Scalar max_step = kInfinity;                ///< time
  std::int64_t max_internal_steps = 100'000;  ///< attempts per call of step()
};

/// What an integrator did. In a World, pieces of free flight without a wrench also count as steps,
/// without evaluations.
struct IntegratorStatistics {
  std::int64_t steps = 0;
  std::int64_t rejected_steps = 0;
  std::int64_t function_evaluations = 0;
};

/// A one-step-at-a-time solver of an ordinary differential equation, with dense output over the
/// last step. It only proposes states: the World decides what is committed, and restarts the solver
/// wherever it cuts a step short.
///
/// To add an integrator:
///   1. `include/dyop/dynamics/<name>_integrator.h` and
///      `src/dynamics/integrators/<name>_integrator.cpp`; list both in
///      `src/dynamics/CMakeLists.txt`;
///   2. one word in `tests/dynamics/all_integrators.h`: the contract test checks order, dense
///      output, restart and errors;
///   3. its name in `make_integrator()`.
class Integrator {
 public:
  virtual ~Integrator() = default;

  /// Starts, or starts again, at (t, y); discards the history.
  virtual void restart(Scalar t, std::span<const Scalar> y) = 0;

  /// One internal step, not beyond t_end > time(). Afterwards begin() < time() <= t_end.
  /// @throws IntegrationError if the solver fails.
  virtual void step(Scalar t_end) = 0;

  virtual Scalar begin() const = 0;  ///< start of the last step
  virtual Scalar time() const = 0;   ///< end of the last step
  /// At time(); valid until the next step() or restart().
  virtual std::span<const Scalar> state() const = 0;

  /// Dense output of y at t in [begin(), time()].
  virtual void evaluate(Scalar t, std::span<Scalar> y) const = 0;

  virtual IntegratorStatistics statistics() const = 0;
};

enum class IntegratorKind { Arkode, CvodeAdams, CvodeBdf };

std::unique_ptr<Integrator> make_integrator(IntegratorKind kind, OdeFunction f, std::size_t size,
                                            const IntegratorOptions& options);

}  // namespace dyop
