// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/dynamics/sundials_integrator.h"

namespace DYOP_EXPORT dyop {

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
