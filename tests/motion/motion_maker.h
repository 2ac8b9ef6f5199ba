// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "motion/random_values.h"

namespace dyop::testing {

/// Where and how large a random motion is.
struct Scales {
  Scalar length = 1;    ///< of displacements during the span
  Scalar distance = 1;  ///< from the world's origin
  Scalar turn = 1;      ///< about the radians turned during the span
  TimeInterval span{0, 1};

  Scalar time() const { return span.length(); }
};

using MotionPointer = std::shared_ptr<const Motion>;

struct MotionMaker {
  const char* name;
  MotionPointer (*make)(Random&, const Scales&);
};

}  // namespace dyop::testing
