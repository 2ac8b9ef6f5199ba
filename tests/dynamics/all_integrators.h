// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <ostream>

#include "dyop/dynamics/integrator.h"

/// One word an integrator; the contract test runs over kAllIntegrators.
namespace dyop::testing {

struct NamedIntegrator {
  const char* name;
  IntegratorKind kind;

  std::unique_ptr<Integrator> make(OdeFunction f, std::size_t size,
                                   const IntegratorOptions& options = {}) const {
    return make_integrator(kind, std::move(f), size, options);
  }
};

inline void PrintTo(const NamedIntegrator& integrator, std::ostream* out) {
  *out << integrator.name;
}

inline constexpr NamedIntegrator kAllIntegrators[] = {
    {"Arkode", IntegratorKind::Arkode},
    {"CvodeAdams", IntegratorKind::CvodeAdams},
    {"CvodeBdf", IntegratorKind::CvodeBdf},
};

}  // namespace dyop::testing
