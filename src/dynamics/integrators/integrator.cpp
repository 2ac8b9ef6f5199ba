// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/dynamics/integrator.h"

#include <utility>

#include "dyop/dynamics/arkode_integrator.h"
#include "dyop/dynamics/cvode_integrator.h"

namespace dyop {

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
