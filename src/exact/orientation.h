// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/types.h"

namespace dyop::exact_internal {

// Coordinates for the exact predicates must be zero, or of size 2^-200 to 1. Then no product of
// three differences, nor its rounding error, leaves the range of double, and signs are exact.

// Sign (-1, 0, 1) of (b - a) x (c - a) . (d - a): 1 if d lies on the side of the plane from which
// a, b, c appear counterclockwise. Exact [Shewchuk1997].
int orientation(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d);

// Sign of component `axis` of (b - a) x (c - a): 1 if a, b, c turn left seen from the tip of the
// axis. Exact.
DYOP_EXPORT int orientation_along(int axis, const Vector3& a, const Vector3& b, const Vector3& c);

}  // namespace dyop::exact_internal
