// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/distance/distance.h"
#include "dyop/distance/ray_cast.h"
#include "dyop/toi/toi_result.h"
#include "io/json_reader.h"

namespace dyop::io_internal {

/// Results as JSON values, every field under its own name. Numbers are exact. An infinite
/// number is null.
DYOP_EXPORT Json number_json(Scalar value);
DYOP_EXPORT Json to_json(const Vector3& v);
Json to_json(const RigidPose& X);
Json to_json(const Feature& feature);
Json to_json(const DistanceResult& result);
Json to_json(const RayHit& hit);
DYOP_EXPORT Json to_json(const ToiStatistics& statistics);
/// Without its contacts.
DYOP_EXPORT Json to_json(const ToiResult& result);
DYOP_EXPORT Json to_json(const Contact& contact);
Json to_json(const std::vector<Contact>& contacts);

}  // namespace dyop::io_internal
