// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "check/trusted/haptic_recording.h"
#include "check/trusted/recording.h"

/// What begins inside a closed mesh: told only, a verdict does not depend on it.
namespace dyop_check {

/// A body of which a part is inside a closed mesh.
struct Enclosure {
  std::uint32_t inner = 0;
  std::uint32_t outer = 0;
  double t = 0;
};

/// Meshes are surfaces, so a body may keep its distance from a mesh and be inside it. That can only
/// begin where one of them appears or is put elsewhere: surfaces that stay apart do not pass. Tells
/// the pairs that count.
std::vector<Enclosure> find_enclosures(const Recording& recording);

/// Parts of tools of which a point begins within the surface of an obstacle, and that obstacle.
std::vector<std::pair<std::string, std::string>> find_enclosures(const HapticRecording& recording);

}  // namespace dyop_check
