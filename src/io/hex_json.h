// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/rigid_pose.h"
#include "io/json_reader.h"

/// Numbers as strings in hexadecimal floating point, "0x1.8p+1": every bit is kept and visible.
namespace dyop::io_internal {

Json hex_json(Scalar value);
Json hex_json(const Vector3& v);
/// The rotation as nine numbers, row by row: a quaternion would lose bits.
Json hex_json(const RigidPose& X);

/// The same value with every floating-point number in it as a string.
Json with_hex_numbers(const Json& json);

/// The value as a number: such a string, or a plain number. Throws FileError, also if not finite.
Scalar hex_number(const JsonNode& node);
Vector3 hex_vector(const JsonNode& node);
/// Uses the rotation unchanged, if it is one.
RigidPose hex_pose(const JsonNode& node);

}  // namespace dyop::io_internal
