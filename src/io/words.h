// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "dyop/geometry/shape.h"

namespace dyop::io_internal {

/// A number with nine significant digits, for display.
DYOP_EXPORT std::string show(Scalar value);
/// "(x, y, z)" with six significant digits.
DYOP_EXPORT std::string show(const Vector3& v);

/// Describes where a witness point lies: coordinates, feature, triangle.
DYOP_EXPORT std::string place_words(const Vector3& p_WC, const Feature& feature,
                                    const std::optional<std::int32_t>& triangle);

}  // namespace dyop::io_internal
