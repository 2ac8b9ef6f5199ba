// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/dynamics/rigid_body.h"
#include "io/json_reader.h"
#include "io/scene/shape_reader.h"

namespace dyop::io_internal {

struct NamedBody {
  BodyDefinition definition;
  std::string shape_name;  ///< for display
};

/// Reads one element of "bodies" of docs/formats.md. A kinematic body's motion must cover
/// `span`.
NamedBody read_body(const JsonNode& node, const TimeInterval& span, ShapeReader& shapes);

}  // namespace dyop::io_internal
