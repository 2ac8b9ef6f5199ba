// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of Tesseract 0.33 with just what the adapter and its tests use.
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

namespace tesseract_common {
template <typename T>
using AlignedVector = std::vector<T, Eigen::aligned_allocator<T>>;
template <typename Key, typename Value>
using AlignedMap =
    std::map<Key, Value, std::less<Key>, Eigen::aligned_allocator<std::pair<const Key, Value>>>;
template <typename Key, typename Value>
using AlignedUnorderedMap =
    std::unordered_map<Key, Value, std::hash<Key>, std::equal_to<Key>,
                       Eigen::aligned_allocator<std::pair<const Key, Value>>>;
using VectorIsometry3d = AlignedVector<Eigen::Isometry3d>;
using VectorVector3d = std::vector<Eigen::Vector3d>;
using TransformMap = AlignedUnorderedMap<std::string, Eigen::Isometry3d>;
}  // namespace tesseract_common
