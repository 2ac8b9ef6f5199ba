// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "dyop/motion/sampled_motion.h"
#include "dyop/motion/sequence_motion.h"

namespace DYOP_EXPORT dyop {

/// A log of poses at uneven time stamps, through which the body moves with a continuous twist:
/// cubics in position and rotation vector between stamps (HermiteMotion). The twist at a stamp is
/// that of the parabola through it and its two neighbours; the first and last stamp use the
/// parabola of the stamp next to them. With two samples it is constant.
///
/// A turn by pi or more between two stamps looks like the shorter one: sample faster.
/// @throws InvalidArgument as SampledMotion.
SequenceMotion smooth_sampled_motion(const std::vector<SampledMotion::Sample>& samples);

}  // namespace dyop
