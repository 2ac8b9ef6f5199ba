// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "dynamics/ode_problems.h"
#include "dyop/dynamics/sundials_integrator.h"

namespace dyop::testing {
namespace {

// Options under which every step has the length h (after the first few, which grow towards it).
IntegratorOptions fixed_step(Scalar h) {
  IntegratorOptions options;
  options.relative_tolerance = 1;
  options.absolute_tolerance = 1;
  options.max_step = h;
  return options;
}

TEST(ArkodeIntegrator, ConvergesWithOrderFour) {
  const Oscillator oscillator;
  Scalar previous = 0;
  for (const Scalar h : {0.2, 0.1, 0.05, 0.025}) {
    ArkodeIntegrator integrator(oscillator.function(), 2, fixed_step(h));
    integrator.restart(0, oscillator.solution(0));
    run_to(integrator, 10);
    const Scalar error = oscillator.error(10, integrator.state());
    // Half the step, a sixteenth of the error.
    if (previous > 0) {
      EXPECT_NEAR(std::log2(previous / error), 4, 0.4) << h;
    }
    previous = error;
  }
}

TEST(ArkodeIntegrator, DenseOutputConvergesWithOrderFour) {
  // Cubic Hermite interpolation errs by h^4 |y''''| / 384 in the middle.
  const Oscillator oscillator;
  Scalar previous = 0;
  for (const Scalar h : {0.2, 0.1, 0.05, 0.025}) {
    ArkodeIntegrator integrator(oscillator.function(), 2, fixed_step(h));
    integrator.restart(0, oscillator.solution(0));
    Scalar worst = 0;
    while (integrator.time() < 5) {
      integrator.step(5);
      const Scalar middle = integrator.begin() + (integrator.time() - integrator.begin()) / 2;
      worst = std::max(worst, oscillator.error(middle, evaluated(integrator, middle)));
    }
    if (previous > 0) {
      EXPECT_NEAR(std::log2(previous / worst), 4, 0.4) << h;
    }
    previous = worst;
  }
}

TEST(ArkodeIntegrator, IsExactForPolynomialsUpToDegreeFour) {
  // y' = p'(t) is quadrature; order 4 integrates cubics exactly.
  ArkodeIntegrator integrator(
      [](Scalar t, std::span<const Scalar>, std::span<Scalar> dydt) { dydt[0] = 4 * t * t * t; }, 1,
      fixed_step(0.5));
  integrator.restart(0, std::vector<Scalar>{0});
  run_to(integrator, 2);
  EXPECT_NEAR(integrator.state()[0], 16, 1e-13);
}

TEST(ArkodeIntegrator, DenseOutputCallsNoFunction) {
  const Oscillator oscillator;
  ArkodeIntegrator integrator(oscillator.function(), 2, {});
  integrator.restart(0, oscillator.solution(0));
  integrator.step(1);
  const std::int64_t before = integrator.statistics().function_evaluations;
  evaluated(integrator, integrator.begin() + (integrator.time() - integrator.begin()) / 2);
  EXPECT_EQ(integrator.statistics().function_evaluations, before);
}

}  // namespace
}  // namespace dyop::testing
