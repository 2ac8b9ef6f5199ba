// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of MoveIt 2.12 with just what the adapter and its tests use.
#pragma once

#include <Eigen/Geometry>
#include <vector>

namespace EigenSTL {
using vector_Isometry3d =
    std::vector<Eigen::Isometry3d, Eigen::aligned_allocator<Eigen::Isometry3d>>;
}
