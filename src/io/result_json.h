#pragma once

#include "dyop/distance/distance.h"
#include "dyop/dynamics/world.h"
#include "dyop/toi/toi_result.h"
#include "io/json_reader.h"

namespace dyop::internal {

/// Results as JSON values and back, field by field under the same names. Numbers are exact. An
/// infinite number is null.
Json to_json(const Vector3& v);
Json to_json(const RigidPose& X);
Json to_json(const Feature& feature);
Json to_json(const DistanceResult& result);
Json to_json(const BodyId& id);
Json to_json(const ToiStatistics& statistics);
Json to_json(const IntegratorStatistics& statistics);
Json to_json(const StepStatistics& statistics);
/// Without its contacts: an impact event lists those of all pairs.
Json to_json(const ToiResult& result);
Json to_json(const std::vector<Contact>& contacts);
Json to_json(const ImpactEvent& event);

/// Throw nlohmann exceptions for values of the wrong form.
BodyId body_id_from(const Json& json);
Vector3 vector3_from(const Json& json);
RigidPose pose_from(const Json& json);
ToiStatistics toi_statistics_from(const Json& json);
IntegratorStatistics integrator_statistics_from(const Json& json);
StepStatistics step_statistics_from(const Json& json);
ImpactEvent impact_event_from(const Json& json);

}  // namespace dyop::internal
