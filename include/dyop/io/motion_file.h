// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>

#include "dyop/motion/motion.h"

namespace DYOP_EXPORT dyop {

/// Returns the motion of a JSON file: one object as described in docs/formats.md, "Motions".
/// @throws FileError naming the file and the key.
std::shared_ptr<const Motion> load_motion(const std::filesystem::path& file);

}  // namespace dyop
