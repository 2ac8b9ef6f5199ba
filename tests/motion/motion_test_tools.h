// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/motion/motion.h"
#include "motion/motion_differences.h"
#include "motion/random_values.h"
#include "support/message_of.h"

namespace dyop::testing {

using motion_internal::differentiate;
using motion_internal::twist_by_differences;

}  // namespace dyop::testing
