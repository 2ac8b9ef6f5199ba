// SPDX-License-Identifier: BSD-3-Clause
#include "motion/motion_contract.h"

#include "motion/all_motions.h"

namespace dyop::testing {
namespace {

INSTANTIATE_TEST_SUITE_P(All, MotionContract, all_of(kAllMotions), test_name);

}  // namespace
}  // namespace dyop::testing
