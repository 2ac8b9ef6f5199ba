// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <stdexcept>

#include "dynamics/all_integrators.h"
#include "dynamics/ode_problems.h"
#include "support/message_of.h"

namespace dyop::testing {
namespace {

constexpr Scalar kNaN = std::numeric_limits<Scalar>::quiet_NaN();

class IntegratorContract : public ::testing::TestWithParam<NamedIntegrator> {};

const Oscillator kOscillators[] = {
    {1, 1, 0},           // unit
    {1e-4, 1e4, 0},      // small and fast
    {1e4, 1e-4, -7e4},   // large and slow
    {1, 2 * M_PI, 1e6},  // far from the origin of time
};

TEST_P(IntegratorContract, DecaysExponentiallyWithinTheTolerance) {
  // y' = -k y: y = y0 exp(-k (t - t0)).
  for (const auto& [y0, k, t0] : kOscillators) {
    IntegratorOptions options;
    options.absolute_tolerance = 1e-8 * y0;
    const auto integrator = GetParam().make(
        [k = k](Scalar, std::span<const Scalar> y, std::span<Scalar> dydt) { dydt[0] = -k * y[0]; },
        1, options);
    integrator->restart(t0, std::vector<Scalar>{y0});
    const Scalar t_end = t0 + 3 / k;
    run_to(*integrator, t_end);
    EXPECT_EQ(integrator->time(), t_end);
    EXPECT_NEAR(integrator->state()[0] / y0, std::exp(-k * (t_end - t0)), 1e-6);
  }
}

TEST_P(IntegratorContract, OscillatesWithinTheTolerance) {
  for (const Oscillator& oscillator : kOscillators) {
    const auto integrator = GetParam().make(oscillator.function(), 2, oscillator.options(1e-8));
    integrator->restart(oscillator.t0, oscillator.solution(oscillator.t0));
    run_to(*integrator, oscillator.t0 + 20 / oscillator.rate);
    // Twenty radians are some hundred steps, each of which may err by the tolerance and more.
    EXPECT_LT(oscillator.error(integrator->time(), integrator->state()), 2e-5)
        << oscillator.amplitude;
  }
}

TEST_P(IntegratorContract, ErrorShrinksWithTheTolerance) {
  // The error per step is held at the tolerance, so that a hundredth of it costs at least a factor
  // of ten in the error over a fixed time.
  const Oscillator oscillator;
  Scalar previous = kInfinity;
  for (const Scalar tolerance : {1e-4, 1e-6, 1e-8, 1e-10}) {
    const auto integrator =
        GetParam().make(oscillator.function(), 2, oscillator.options(tolerance));
    integrator->restart(0, oscillator.solution(0));
    run_to(*integrator, 10);
    const Scalar error = oscillator.error(10, integrator->state());
    EXPECT_LT(error, previous / 10) << "tolerance " << tolerance;
    EXPECT_LT(error, 1e3 * tolerance);
    previous = error;
  }
}

TEST_P(IntegratorContract, DenseOutputIsAsGoodAsTheSteps) {
  std::mt19937_64 random(20240611);
  for (const Oscillator& oscillator : kOscillators) {
    const auto integrator = GetParam().make(oscillator.function(), 2, oscillator.options(1e-8));
    integrator->restart(oscillator.t0, oscillator.solution(oscillator.t0));
    const Scalar t_end = oscillator.t0 + 10 / oscillator.rate;
    while (integrator->time() < t_end) {
      integrator->step(t_end);
      std::uniform_real_distribution<Scalar> inside(integrator->begin(), integrator->time());
      for (int i = 0; i < 10; ++i) {
        const Scalar t = inside(random);
        ASSERT_LT(oscillator.error(t, evaluated(*integrator, t)), 2e-5);
      }
    }
  }
}

TEST_P(IntegratorContract, DenseOutputIsExactAtBothEnds) {
  const Oscillator oscillator;
  const auto integrator = GetParam().make(oscillator.function(), 2);
  integrator->restart(0, oscillator.solution(0));
  EXPECT_EQ(evaluated(*integrator, 0), oscillator.solution(0));
  for (int i = 0; i < 50; ++i) {
    const std::vector<Scalar> before = copy(integrator->state());
    integrator->step(1000);
    ASSERT_EQ(evaluated(*integrator, integrator->begin()), before);
    ASSERT_EQ(evaluated(*integrator, integrator->time()), copy(integrator->state()));
  }
}

TEST_P(IntegratorContract, StepsJoinAndNeverPassTheEnd) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<Scalar> exponent(-17, 1);
  for (const Scalar t0 : {0.0, 1.0, -3.0, 1e4}) {
    const Oscillator oscillator{1, 1, t0};
    const auto integrator = GetParam().make(oscillator.function(), 2);
    integrator->restart(t0, oscillator.solution(t0));
    EXPECT_EQ(integrator->begin(), t0);
    EXPECT_EQ(integrator->time(), t0);
    for (int i = 0; i < 200; ++i) {
      const Scalar t_end = integrator->time() + std::pow(10, exponent(random));
      while (integrator->time() < t_end) {
        const Scalar before = integrator->time();
        integrator->step(t_end);
        ASSERT_EQ(integrator->begin(), before);
        ASSERT_GT(integrator->time(), before);
        ASSERT_LE(integrator->time(), t_end);
        const Scalar middle = before + (integrator->time() - before) / 2;
        ASSERT_LT(oscillator.error(middle, evaluated(*integrator, middle)), 1e-5);
      }
    }
  }
}

TEST_P(IntegratorContract, TakesStepsOfOneUlp) {
  for (const Scalar t0 : {0.0, 1e-300, 1.0, -1.0, 1e-4, 1e4, -1e6}) {
    const auto integrator = GetParam().make(
        [](Scalar, std::span<const Scalar> y, std::span<Scalar> dydt) { dydt[0] = -y[0]; }, 1);
    integrator->restart(t0, std::vector<Scalar>{1});
    for (int ulps = 1; ulps < 3000; ulps = ulps * 3 / 2 + 1) {
      Scalar t_end = integrator->time();
      for (int i = 0; i < ulps; ++i) t_end = std::nextafter(t_end, kInfinity);
      const Scalar before = integrator->time();
      integrator->step(t_end);
      ASSERT_GT(integrator->time(), before);
      ASSERT_LE(integrator->time(), t_end);
      run_to(*integrator, t_end);
      // The solver rounds the ends of its steps, so each may be off by the resolution of time.
      ASSERT_NEAR(integrator->state()[0], std::exp(t0 - integrator->time()),
                  1e-12 + 4e-16 * std::abs(t0));
    }
    run_to(*integrator, t0 + 1);
    EXPECT_NEAR(integrator->state()[0], std::exp(-1.0), 1e-6);
  }
}

TEST_P(IntegratorContract, RestartForgetsHistory) {
  const Oscillator oscillator;
  const std::vector<Scalar> y{0.3, -0.7};
  const auto used = GetParam().make(oscillator.function(), 2);
  used->restart(0, oscillator.solution(0));
  run_to(*used, 5);
  const auto fresh = GetParam().make(oscillator.function(), 2);
  used->restart(2, y);
  fresh->restart(2, y);
  EXPECT_EQ(used->begin(), 2);
  EXPECT_EQ(used->time(), 2);
  for (int i = 0; i < 100; ++i) {
    used->step(50);
    fresh->step(50);
    ASSERT_EQ(used->time(), fresh->time()) << "step " << i;
    ASSERT_EQ(copy(used->state()), copy(fresh->state())) << "step " << i;
  }
}

TEST_P(IntegratorContract, GoesOnFromATruncatedStep) {
  // What the World does at an impact, but with nothing changed there.
  const Oscillator oscillator;
  const auto integrator = GetParam().make(oscillator.function(), 2);
  integrator->restart(0, oscillator.solution(0));
  for (int i = 0; i < 20; ++i) {
    for (int j = 0; j < 5; ++j) integrator->step(100);
    const Scalar t = integrator->begin() + (integrator->time() - integrator->begin()) / 3;
    integrator->restart(t, evaluated(*integrator, t));
  }
  EXPECT_LT(oscillator.error(integrator->time(), integrator->state()), 1e-5);
}

TEST_P(IntegratorContract, RestartsAtItsOwnState) {
  const Oscillator oscillator;
  const auto integrator = GetParam().make(oscillator.function(), 2);
  integrator->restart(0, oscillator.solution(0));
  integrator->step(1);
  const std::vector<Scalar> y = copy(integrator->state());
  integrator->restart(integrator->time(), integrator->state());
  EXPECT_EQ(copy(integrator->state()), y);
}

TEST_P(IntegratorContract, GivesTheSameBitsTwice) {
  std::vector<std::vector<Scalar>> runs[2];
  for (auto& run : runs) {
    const Oscillator oscillator{1, 3, 0.1};
    const auto integrator = GetParam().make(oscillator.function(), 2);
    integrator->restart(0.1, oscillator.solution(0.1));
    while (integrator->time() < 10) {
      integrator->step(10);
      run.push_back(copy(integrator->state()));
      run.push_back(evaluated(
          *integrator, integrator->begin() + 0.3 * (integrator->time() - integrator->begin())));
      run.push_back({integrator->time()});
    }
  }
  EXPECT_EQ(runs[0], runs[1]);
}

TEST_P(IntegratorContract, RespectsMaxStep) {
  IntegratorOptions options;
  options.max_step = 0.015625;  // a power of two: t_end is a multiple
  const auto integrator = GetParam().make(
      [](Scalar, std::span<const Scalar>, std::span<Scalar> dydt) { dydt[0] = 1; }, 1, options);
  integrator->restart(0, std::vector<Scalar>{0});
  while (integrator->time() < 1) {
    integrator->step(1);
    ASSERT_LE(integrator->time() - integrator->begin(), options.max_step * (1 + 1e-12));
  }
  EXPECT_NEAR(integrator->state()[0], 1, 1e-12);
}

TEST_P(IntegratorContract, ReportsAMaxStepBelowTheResolutionOfTime) {
  IntegratorOptions options;
  options.max_step = 1e-20;
  const auto integrator = GetParam().make(Oscillator{}.function(), 2, options);
  integrator->restart(1, std::vector<Scalar>{1, 0});
  const std::string message = message_of<IntegrationError>([&] { integrator->step(2); });
  EXPECT_NE(message.find("max_step"), std::string::npos) << message;
}

TEST_P(IntegratorContract, PassesOnExceptionsOfTheFunction) {
  struct Stop {
    int value;
  };
  bool is_armed = false;
  const Oscillator oscillator;
  const auto integrator = GetParam().make(
      [&](Scalar t, std::span<const Scalar> y, std::span<Scalar> dydt) {
        if (is_armed) throw Stop{42};
        oscillator.function()(t, y, dydt);
      },
      2);
  integrator->restart(0, oscillator.solution(0));
  for (int i = 0; i < 10; ++i) integrator->step(10);
  const Scalar t = integrator->time();
  const std::vector<Scalar> y = copy(integrator->state());
  is_armed = true;
  for (const Scalar t_end : {10.0, std::nextafter(t, kInfinity)}) {
    try {
      integrator->step(t_end);
      ADD_FAILURE() << "nothing was thrown";
    } catch (const Stop& stop) {
      EXPECT_EQ(stop.value, 42);
    }
    EXPECT_EQ(integrator->time(), t);
    EXPECT_EQ(copy(integrator->state()), y);
  }
  is_armed = false;
  run_to(*integrator, 10);
  EXPECT_LT(oscillator.error(10, integrator->state()), 1e-5);
}

TEST_P(IntegratorContract, NamesTimeAndIndexOfANonFiniteDerivative) {
  for (const Scalar bad : {kNaN, kInfinity, -kInfinity}) {
    const auto integrator = GetParam().make(
        [bad](Scalar t, std::span<const Scalar>, std::span<Scalar> dydt) {
          dydt[0] = 1;
          dydt[1] = t < 0.5 ? 1 : bad;
        },
        2);
    integrator->restart(0, std::vector<Scalar>{0, 0});
    ::testing::internal::CaptureStderr();
    const std::string message = message_of<IntegrationError>([&] { run_to(*integrator, 1); });
    EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
    EXPECT_NE(message.find("derivative 1 is "), std::string::npos) << message;
    EXPECT_NE(message.find("at t = "), std::string::npos) << message;
    EXPECT_LE(integrator->time(), 0.5);
  }
}

TEST_P(IntegratorContract, GivesUpAtTheStepLimitAndSaysWhere) {
  // A velocity that jumps at t = 1: the step across it is rejected until it is short enough.
  const OdeFunction jump = [](Scalar t, std::span<const Scalar>, std::span<Scalar> dydt) {
    dydt[0] = t < 1 ? 0 : 1e6;
  };
  IntegratorOptions options;
  options.max_internal_steps = 1;
  const auto limited = GetParam().make(jump, 1, options);
  limited->restart(0.5, std::vector<Scalar>{0});
  ::testing::internal::CaptureStderr();
  const std::string message = message_of<IntegrationError>([&] { run_to(*limited, 2); });
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  for (const char* part : {"failed at t = ", "ERR_FAILURE"}) {
    EXPECT_NE(message.find(part), std::string::npos) << message;
  }
  EXPECT_LT(limited->time(), 1);
  EXPECT_EQ(limited->statistics().rejected_steps, 1);

  const auto unlimited = GetParam().make(jump, 1);
  unlimited->restart(0.5, std::vector<Scalar>{0});
  run_to(*unlimited, 2);
  EXPECT_NEAR(unlimited->state()[0], 1e6, 1);
  EXPECT_GT(unlimited->statistics().rejected_steps, 1);
}

TEST_P(IntegratorContract, ReportsToleranceBelowRounding) {
  IntegratorOptions options;
  options.relative_tolerance = 0;
  options.absolute_tolerance = 1e-30;
  const Oscillator oscillator;
  const auto integrator = GetParam().make(oscillator.function(), 2, options);
  integrator->restart(0, oscillator.solution(0));
  EXPECT_NE(message_of<IntegrationError>([&] { run_to(*integrator, 1); }), "no error");
}

TEST_P(IntegratorContract, StepsASystemOfSizeZero) {
  const auto integrator = GetParam().make(
      [](Scalar, std::span<const Scalar>, std::span<Scalar>) { FAIL() << "nothing to evaluate"; },
      0);
  integrator->restart(1, {});
  integrator->step(3);
  EXPECT_EQ(integrator->begin(), 1);
  EXPECT_EQ(integrator->time(), 3);
  EXPECT_EQ(integrator->state().size(), 0u);
  integrator->evaluate(2, {});
  EXPECT_EQ(integrator->statistics().steps, 1);
}

TEST_P(IntegratorContract, AddsStatisticsOverRestarts) {
  std::int64_t calls = 0;
  const Oscillator oscillator;
  const auto integrator = GetParam().make(
      [&](Scalar t, std::span<const Scalar> y, std::span<Scalar> dydt) {
        ++calls;
        oscillator.function()(t, y, dydt);
      },
      2);
  IntegratorStatistics last;
  std::int64_t steps = 0;
  for (int i = 0; i < 5; ++i) {
    integrator->restart(0, oscillator.solution(0));
    for (int j = 0; j < 7; ++j, ++steps) integrator->step(10);
    const IntegratorStatistics now = integrator->statistics();
    EXPECT_EQ(now.steps, steps);
    EXPECT_EQ(now.function_evaluations, calls);
    EXPECT_GE(now.rejected_steps, last.rejected_steps);
    last = now;
  }
}

TEST_P(IntegratorContract, RefusesInvalidInput) {
  const OdeFunction f = Oscillator{}.function();
  const auto refuses = [&](auto change) {
    IntegratorOptions options;
    change(options);
    return message_of([&] { GetParam().make(f, 2, options); }) != "no error";
  };
  EXPECT_TRUE(refuses([](auto& options) { options.relative_tolerance = -1; }));
  EXPECT_TRUE(refuses([](auto& options) { options.relative_tolerance = kNaN; }));
  EXPECT_TRUE(refuses([](auto& options) { options.absolute_tolerance = 0; }));
  EXPECT_TRUE(refuses([](auto& options) { options.absolute_tolerance = kNaN; }));
  EXPECT_TRUE(refuses([](auto& options) { options.max_step = 0; }));
  EXPECT_TRUE(refuses([](auto& options) { options.max_step = kNaN; }));
  EXPECT_TRUE(refuses([](auto& options) { options.max_internal_steps = 0; }));
  EXPECT_THROW(GetParam().make(nullptr, 2), InvalidArgument);
  EXPECT_THROW(GetParam().make(nullptr, 0), InvalidArgument);

  const auto integrator = GetParam().make(f, 2);
  std::vector<Scalar> y(2);
  EXPECT_THROW(integrator->step(1), InvalidArgument);
  EXPECT_THROW(integrator->evaluate(0, y), InvalidArgument);
  EXPECT_THROW(integrator->restart(kNaN, y), InvalidArgument);
  EXPECT_THROW(integrator->restart(0, std::vector<Scalar>{1}), InvalidArgument);
  EXPECT_THROW(integrator->restart(0, std::vector<Scalar>{1, kNaN}), InvalidArgument);
  integrator->restart(0, std::vector<Scalar>{1, 0});
  for (const Scalar t_end : {-1.0, 0.0, kNaN, kInfinity}) {
    EXPECT_THROW(integrator->step(t_end), InvalidArgument) << t_end;
  }
  integrator->step(1);
  const Scalar t = integrator->time();
  for (const Scalar outside : {std::nextafter(0.0, -1.0), std::nextafter(t, 2.0), kNaN}) {
    EXPECT_THROW(integrator->evaluate(outside, y), InvalidArgument) << outside;
  }
  std::vector<Scalar> too_long(3);
  EXPECT_THROW(integrator->evaluate(t, too_long), InvalidArgument);
}

INSTANTIATE_TEST_SUITE_P(All, IntegratorContract, ::testing::ValuesIn(kAllIntegrators),
                         [](const auto& parameter) { return std::string(parameter.param.name); });

}  // namespace
}  // namespace dyop::testing
