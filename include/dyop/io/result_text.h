// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "dyop/distance/distance_result.h"
#include "dyop/distance/ray_cast.h"
#include "dyop/toi/toi_result.h"

namespace DYOP_EXPORT dyop {

/// A result as one JSON object without line breaks, every field under its own name; numbers read
/// back exactly, infinite ones are null. Format: docs/formats.md.
std::string to_json_text(const DistanceResult& result);
std::string to_json_text(const ToiResult& result);
std::string to_json_text(const RayHit& hit);

/// The names of two bodies, for texts.
struct PairNames {
  std::string a = "A";
  std::string b = "B";
};

/// A result in words, on several lines.
std::string describe(const DistanceResult& result, const PairNames& names = {});
std::string describe(const ToiResult& result, const PairNames& names = {});
std::string describe(const RayHit& hit);

}  // namespace dyop
