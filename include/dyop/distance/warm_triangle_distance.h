// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/distance/triangle_distance.h"

namespace DYOP_EXPORT dyop {

/// Returns triangle_distance(a, b), trying first the features that were nearest at a nearby pose.
/// Same guarantees; the features affect only speed, and which of two equally near pairs is named.
///
/// @param last_a, last_b Features of the last result for this pair; arbitrary if there is none.
/// Cost: one clamped closest-point problem and its proof; if the proof fails, triangle_distance()
/// on top.
TriangleDistance warm_triangle_distance(const Triangle& a, const Triangle& b, const Feature& last_a,
                                        const Feature& last_b);

}  // namespace dyop
