#pragma once

#include "dyop/distance/distance.h"
#include "dyop/toi/toi_result.h"
#include "io/json_reader.h"

namespace dyop::internal {

/// Results as JSON values and back, field by field under the same names. Numbers are exact. An
/// infinite number is null.
Json number_json(Scalar value);
Json to_json(const Vector3& v);
Json to_json(const RigidPose& X);
Json to_json(const Feature& feature);
Json to_json(const DistanceResult& result);
Json to_json(const ToiStatistics& statistics);
/// Without its contacts.
Json to_json(const ToiResult& result);
Json to_json(const Contact& contact);
Json to_json(const std::vector<Contact>& contacts);

/// Throw nlohmann exceptions for values of the wrong form.
Scalar number_from(const Json& json);
Vector3 vector3_from(const Json& json);
RigidPose pose_from(const Json& json);
ToiStatistics toi_statistics_from(const Json& json);
ToiResult toi_result_from(const Json& json);
Contact contact_from(const Json& json);

}  // namespace dyop::internal
