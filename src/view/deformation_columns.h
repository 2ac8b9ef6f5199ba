// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>

#include "dyop/core/triangle.h"
#include "dyop/view/page_encoder.h"
#include "view/column_block.h"

namespace dyop::view_internal {

/// Adds columns <name>.t, <name>.weights and <name>.mode0 ... to a block and returns what the page
/// needs to decode them. Modes are rounded as the vertices of a surface, and in its order.
nlohmann::json add_deformation(ColumnBlock& block, const std::string& name,
                               const PageDeformation& deformation,
                               std::span<const TriangleIndices> triangles);

}  // namespace dyop::view_internal
