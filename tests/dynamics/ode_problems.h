// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "dyop/dynamics/integrator.h"

/// Equations with known solutions for the tests of integrators.
namespace dyop::testing {

/// x'' = -w^2 x as (x, v): x = a cos(w (t - t0)), v = -a w sin(w (t - t0)).
struct Oscillator {
  Scalar amplitude = 1;
  Scalar rate = 1;  ///< w, radians per unit time
  Scalar t0 = 0;

  OdeFunction function() const {
    return [w = rate](Scalar, std::span<const Scalar> y, std::span<Scalar> dydt) {
      dydt[0] = y[1];
      dydt[1] = -w * w * y[0];
    };
  }

  std::vector<Scalar> solution(Scalar t) const {
    const Scalar phase = rate * (t - t0);
    return {amplitude * std::cos(phase), -amplitude * rate * std::sin(phase)};
  }

  /// Largest error of y at t in units of the amplitudes of x and v.
  Scalar error(Scalar t, std::span<const Scalar> y) const {
    const std::vector<Scalar> exact = solution(t);
    return std::max(std::abs(y[0] - exact[0]) / amplitude,
                    std::abs(y[1] - exact[1]) / (amplitude * rate));
  }

  /// A relative tolerance, and the absolute one for x and v alike that goes with it.
  IntegratorOptions options(Scalar relative_tolerance) const {
    IntegratorOptions options;
    options.relative_tolerance = relative_tolerance;
    options.absolute_tolerance = relative_tolerance * amplitude * std::min(rate, 1.0);
    return options;
  }
};

/// Steps until t_end.
inline void run_to(Integrator& integrator, Scalar t_end) {
  while (integrator.time() < t_end) integrator.step(t_end);
}

inline std::vector<Scalar> copy(std::span<const Scalar> y) {
  return {y.begin(), y.end()};
}

inline std::vector<Scalar> evaluated(const Integrator& integrator, Scalar t) {
  std::vector<Scalar> y(integrator.state().size());
  integrator.evaluate(t, y);
  return y;
}

}  // namespace dyop::testing
