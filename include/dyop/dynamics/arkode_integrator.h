// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/dynamics/sundials_integrator.h"

namespace DYOP_EXPORT dyop {

/// Explicit Runge-Kutta steps of order 4 with adaptive size: ERKStep of ARKODE ([Reynolds2023]).
/// For smooth, non-stiff equations; restarts are cheap. Dense output is the cubic Hermite
/// polynomial through both ends of the step, of the same local order as the error estimate.
class ArkodeIntegrator final : public SundialsIntegrator {
 public:
  /// @throws InvalidArgument if f is empty or an option is out of range.
  ArkodeIntegrator(OdeFunction f, std::size_t size, const IntegratorOptions& options);
};

}  // namespace dyop
