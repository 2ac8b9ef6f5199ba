// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/types.h"

namespace dyop::testing {

/// Distance of two triangles, zero if they intersect: the least of the distances of all vertices
/// from the other triangle and of all pairs of edges. Plain double precision, nothing of the
/// library is used; right to about 1e-14 times the coordinates.
Scalar plain_distance(const Triangle& a, const Triangle& b);

}  // namespace dyop::testing
