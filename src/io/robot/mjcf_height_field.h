// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>

#include "dyop/geometry/triangle_mesh.h"
#include "io/robot/mjcf_document.h"

namespace dyop::io_internal {

/// The ground of an element <hfield>, in the frame of its geom. As in MuJoCo its heights are scaled
/// to lie between zero and the third size; the fourth is the depth of what is below.
/// @param file In MuJoCo's binary form; empty: the element has the numbers.
/// @throws FileError that names the element or the file.
std::shared_ptr<const TriangleMesh> read_height_field(const MjcfElement& element,
                                                      const std::filesystem::path& file);

}  // namespace dyop::io_internal
