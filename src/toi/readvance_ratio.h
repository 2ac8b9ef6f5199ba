// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace dyop::toi_internal {

/// A pair of boxes whose gap exceeds this fraction of its size is examined again, at its new time,
/// before it is split; without this the number of pairs of distant trees explodes. Speed only. Also
/// included by the kernels for each instruction set, so this file must contain nothing else.
inline constexpr double kReadvanceRatio = 0.3;

}  // namespace dyop::toi_internal
