// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "dyop/chain/kinematic_chain.h"

namespace DYOP_EXPORT dyop {

/// Returns the chain of a JSON file, as described in docs/algorithms/chain.md, "Files". Mesh files
/// are looked for beside it.
/// @throws FileError naming the file and the key.
KinematicChain load_chain(const std::filesystem::path& file);

}  // namespace dyop
