// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>

#include "dyop/dynamics/integrator.h"

namespace DYOP_EXPORT dyop {

namespace dynamics_internal {
class SundialsSolver;
}

/// What the SUNDIALS integrators share: the bookkeeping of steps, and the cases that SUNDIALS
/// itself rejects. A step too short for SUNDIALS (kShortestSolverStep) is one explicit midpoint
/// step with linear dense output; a system of size zero steps to t_end at once.
///
/// Same inputs, same bits. After an exception time() and state() are unchanged, and the next step
/// restarts from there. Exceptions of the right-hand side are passed on unchanged. Not for
/// concurrent use, not even evaluate().
class SundialsIntegrator : public Integrator {
 public:
  ~SundialsIntegrator() override;

  /// @throws InvalidArgument if t or y is not finite, or y has the wrong size.
  void restart(Scalar t, std::span<const Scalar> y) override;

  /// @throws InvalidArgument if t_end is not finite and > time(), or before the first restart();
  /// IntegrationError if the solver fails, a derivative is not finite, or the step takes more than
  /// max_internal_steps attempts.
  void step(Scalar t_end) override;

  Scalar begin() const override;
  Scalar time() const override;
  std::span<const Scalar> state() const override;

  /// Exact (to the bit) at begin() and time().
  /// @throws InvalidArgument if t is outside [begin(), time()], or y has the wrong size.
  void evaluate(Scalar t, std::span<Scalar> y) const override;

  /// Sums since construction; restart() does not reset them.
  IntegratorStatistics statistics() const override;

 protected:
  /// The solver is null if and only if size is zero.
  SundialsIntegrator(std::unique_ptr<dynamics_internal::SundialsSolver> solver, std::size_t size,
                     const IntegratorOptions& options);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Explicit Runge-Kutta steps of order 4 with adaptive size: ERKStep of ARKODE ([Reynolds2023]).
/// For smooth, non-stiff equations; restarts are cheap. Dense output is the cubic Hermite
/// polynomial through both ends of the step, of the same local order as the error estimate.
class ArkodeIntegrator final : public SundialsIntegrator {
 public:
  /// @throws InvalidArgument if f is empty or an option is out of range.
  ArkodeIntegrator(OdeFunction f, std::size_t size, const IntegratorOptions& options);
};

enum class CvodeMethod {
  Adams,  ///< orders 1 to 12, fixed-point iteration: smooth equations, expensive right-hand sides
  Bdf,    ///< orders 1 to 5, Newton iteration with a dense Jacobian by differences: stiff equations
};

/// Linear multistep methods of variable order and step size: CVODE ([Hindmarsh2005]). Each restart
/// begins with order 1 and small steps. Dense output is the method's own polynomial.
class CvodeIntegrator final : public SundialsIntegrator {
 public:
  /// @throws InvalidArgument if f is empty or an option is out of range.
  CvodeIntegrator(CvodeMethod method, OdeFunction f, std::size_t size,
                  const IntegratorOptions& options);
};

}  // namespace dyop
