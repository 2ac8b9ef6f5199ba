// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/toi/vertex_time_of_impact.h"
#include "support/inputs/quad.h"

namespace dyop::testing {

/// Distance of the two elements at the fraction s of their interval, in 113 bits.
Quad path_distance(const VertexFacePaths& paths, Quad s);
Quad path_distance(const EdgeEdgePaths& paths, Quad s);

/// The least distance over [0, 1], slow and independent of the library: samples in double, golden
/// section in 113 bits about every smallest sample.
///
/// Resolution: the distance found is at most about 1e-28 of the size above a least distance of
/// zero, so contact and a gap of one rounding of double are distinguished. A minimum narrower than
/// 1 / samples next to a lower one may be missed.
Quad least_path_distance(const VertexFacePaths& paths, int samples = 400);
Quad least_path_distance(const EdgeEdgePaths& paths, int samples = 400);

}  // namespace dyop::testing
