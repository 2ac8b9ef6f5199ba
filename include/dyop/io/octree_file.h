// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "dyop/geometry/occupancy.h"

namespace DYOP_EXPORT dyop {

/// How OctoMap has written the nodes of an octree, as a file's header or a message of octomap_msgs
/// tells.
struct OctreeFormat {
  std::string id;         ///< OcTree or ColorOcTree
  bool is_binary = true;  ///< two bits a child, else a value a node
  Scalar resolution = 0;  ///< size of the smallest leaves, > 0
};

/// The occupied leaves of an octree, for occupancy(), from its nodes: the data of a message. Where
/// nodes have values, leaves are occupied from log-odds 0 on, a probability of one half.
/// @throws InvalidArgument if they are truncated or not understood, or there is no occupied leaf or
///         more than 2^24.
std::vector<OccupiedCube> read_octree(const OctreeFormat& format, std::string_view nodes);

/// The occupied leaves of an OctoMap file (`.bt`, or `.ot` of an OcTree or ColorOcTree), in the
/// frame of the map. Free and unknown space is left out. Needs no library of OctoMap.
/// @throws FileError if the file is missing, or as read_octree().
std::vector<OccupiedCube> load_octree(const std::filesystem::path& file);

}  // namespace dyop
