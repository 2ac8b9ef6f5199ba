// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace dyop::internal {

/// A pair of boxes whose gap exceeds this part of its size is examined again, at its new time,
/// before it is split; pairs of trees far apart explode without it. Speed only. Also included by
/// the kernels for each instruction set, so nothing else may stand here.
inline constexpr double kReadvanceRatio = 0.3;

}  // namespace dyop::internal
