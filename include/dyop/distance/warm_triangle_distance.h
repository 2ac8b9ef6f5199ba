#pragma once

#include "dyop/distance/triangle_distance.h"

namespace DYOP_EXPORT dyop {

/// Returns triangle_distance(a, b), looking first at the features that were nearest at a nearby
/// pose. Promises as there; the features affect speed only, and which of two equally near pairs is
/// named.
///
/// @param last_a, last_b Features of the last answer for this pair, any if there is none.
/// Cost: one clamped closest-point problem and its proof, if that holds; else triangle_distance()
/// more.
TriangleDistance warm_triangle_distance(const Triangle& a, const Triangle& b, const Feature& last_a,
                                        const Feature& last_b);

}  // namespace dyop
