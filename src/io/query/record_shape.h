// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "dyop/geometry/shape.h"
#include "io/json_reader.h"

namespace dyop::io_internal {

/// The object "shape" of docs/formats.md.
/// @throws InvalidArgument for a shape that is not one of dyop's.
Json record_shape(const Shape& shape);

/// Throws FileError.
std::shared_ptr<const Shape> recorded_shape(const JsonNode& node);

}  // namespace dyop::io_internal
