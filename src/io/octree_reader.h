// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "dyop/geometry/occupancy.h"

namespace dyop::io_internal {

/// How the nodes of an octree of OctoMap are written.
struct OctreeFormat {
  std::string id;         ///< OcTree or ColorOcTree
  bool is_binary = true;  ///< two bits a child, else a value a node
  Scalar resolution = 0;  ///< size of the smallest leaves
};

/// The occupied leaves of the nodes in `bytes`.
/// @throws InvalidArgument if they are not understood, as load_octree().
std::vector<OccupiedCube> read_octree_nodes(const OctreeFormat& format, std::string_view bytes);

}  // namespace dyop::io_internal
