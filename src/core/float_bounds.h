// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <limits>

#include "dyop/core/types.h"

namespace dyop::core_internal {

// Numbers in single precision on a chosen side of one in double precision; NaN stays NaN.
//
// GCC 12's SLP vectorizer can drop a conversion to float when several stand side by side, as in
// `return {float(x), float(y), float(z)}`, and go on with the doubles. The comparison below keeps
// the conversion alive; tests/core/float_bounds_test.cpp watches that it stays so.

/// The smallest float that is not below x.
inline float float_above(Scalar x) {
  const auto near = static_cast<float>(x);
  return Scalar(near) < x ? std::nextafter(near, std::numeric_limits<float>::infinity()) : near;
}

/// The largest float that is not above x.
inline float float_below(Scalar x) {
  return -float_above(-x);
}

}  // namespace dyop::core_internal
