// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "dyop/geometry/occupancy.h"

namespace DYOP_EXPORT dyop {

/// The occupied leaves of an OctoMap file (`.bt`, or `.ot` of an OcTree or ColorOcTree), in the
/// frame of the map; leaves of a `.ot` file are occupied from log-odds 0 on, a probability of one
/// half. Free and unknown space is left out.
///
/// For occupancy(). Needs no library of OctoMap.
/// @throws FileError if the file is missing, truncated or not understood, or has no occupied leaf
///         or more than 2^24.
std::vector<OccupiedCube> load_octree(const std::filesystem::path& file);

}  // namespace dyop
