// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "dynamics/ode_problems.h"
#include "dyop/dynamics/sundials_integrator.h"
#include "support/message_of.h"

namespace dyop::testing {
namespace {

// Prothero and Robinson's problem: y' = -k (y - cos t) - sin t has the solution cos t for every k,
// and neighbours fall onto it with the rate k ([ProtheroRobinson1974]).
OdeFunction stiff(Scalar k) {
  return [k](Scalar t, std::span<const Scalar> y, std::span<Scalar> dydt) {
    dydt[0] = -k * (y[0] - std::cos(t)) - std::sin(t);
  };
}

std::int64_t steps_of(CvodeMethod method, Scalar k) {
  IntegratorOptions options;
  options.relative_tolerance = 1e-6;
  options.absolute_tolerance = 1e-8;
  CvodeIntegrator integrator(method, stiff(k), 1, options);
  integrator.restart(0, std::vector<Scalar>{2});
  run_to(integrator, 10);
  EXPECT_NEAR(integrator.state()[0], std::cos(10.0), 1e-4);
  return integrator.statistics().steps;
}

TEST(CvodeIntegrator, BdfNeedsFewStepsHoweverStiff) {
  for (const Scalar k : {1e2, 1e4, 1e6}) EXPECT_LT(steps_of(CvodeMethod::Bdf, k), 500) << k;
}

TEST(CvodeIntegrator, AdamsNeedsStepsInProportionToStiffness) {
  // The fixed-point iteration converges only for h k < 1.
  EXPECT_GT(steps_of(CvodeMethod::Adams, 1e4), 20 * steps_of(CvodeMethod::Bdf, 1e4));
}

TEST(CvodeIntegrator, AdamsNeedsFewerStepsThanBdfWhereSmooth) {
  const Oscillator oscillator;
  std::int64_t steps[2];
  for (const CvodeMethod method : {CvodeMethod::Adams, CvodeMethod::Bdf}) {
    CvodeIntegrator integrator(method, oscillator.function(), 2, oscillator.options(1e-9));
    integrator.restart(0, oscillator.solution(0));
    run_to(integrator, 50);
    steps[static_cast<int>(method)] = integrator.statistics().steps;
  }
  EXPECT_LT(steps[0], steps[1]);
}

TEST(CvodeIntegrator, DoesNotJumpAfterAStepThatWasCutShort) {
  // Left to itself CVODE grows the step back tenfold at a time at full order, and the rounding
  // noise of the history with it; the state then jumped by 1e-4 within a microsecond.
  const Oscillator oscillator;
  for (const CvodeMethod method : {CvodeMethod::Adams, CvodeMethod::Bdf}) {
    for (const Scalar cut : {1e-13, 1e-11, 1e-9, 1e-7, 1e-5, 1e-3}) {
      CvodeIntegrator integrator(method, oscillator.function(), 2, {});
      integrator.restart(0, oscillator.solution(0));
      for (int i = 1; i <= 10; ++i) {
        run_to(integrator, 5 * i);
        run_to(integrator, 5 * i + cut);
      }
      EXPECT_LT(oscillator.error(integrator.time(), integrator.state()), 1e-5) << cut;
    }
  }
}

TEST(CvodeIntegrator, NamesItsMethodInErrors) {
  for (const auto& [method, name] :
       {std::pair(CvodeMethod::Adams, "CVODE Adams"), std::pair(CvodeMethod::Bdf, "CVODE BDF")}) {
    IntegratorOptions options;
    options.relative_tolerance = 0;
    options.absolute_tolerance = 1e-30;
    CvodeIntegrator integrator(method, stiff(1), 1, options);
    integrator.restart(0, std::vector<Scalar>{2});
    const std::string message =
        testing::message_of<IntegrationError>([&] { run_to(integrator, 1); });
    EXPECT_NE(message.find(name), std::string::npos) << message;
  }
}

}  // namespace
}  // namespace dyop::testing
