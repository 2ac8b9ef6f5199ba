// SPDX-License-Identifier: BSD-3-Clause
#include "io/result_json.h"

#include <cmath>

namespace dyop::io_internal {
namespace {

template <typename Value>
Json optional(const std::optional<Value>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json impact_contact_json(const ImpactContact& contact) {
  Json json = to_json(static_cast<const Contact&>(contact));
  json["closing_speed"] = number_json(contact.closing_speed);
  json["pivot_W"] = to_json(contact.pivot_W());
  return json;
}

Json distance_statistics_json(const DistanceStatistics& statistics) {
  Json json;
  json["box_tests"] = statistics.box_tests;
  json["leaf_tests"] = statistics.leaf_tests;
  json["gjk_iterations"] = statistics.gjk_iterations;
  return json;
}

}  // namespace

Json number_json(Scalar value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json to_json(const Vector3& v) {
  return Json::array({number_json(v.x()), number_json(v.y()), number_json(v.z())});
}

Json to_json(const RigidPose& X) {
  const Quaternion q = X.quaternion();
  Json json;
  json["position"] = to_json(X.translation());
  json["quaternion"] = Json::array({q.w(), q.x(), q.y(), q.z()});
  return json;
}

Json to_json(const Feature& feature) {
  Json json;
  json["kind"] = name_of(feature.kind);
  json["vertices"] = Json::array();
  for (std::size_t k = 0; k < feature.vertex_count(); ++k) {
    json["vertices"].push_back(feature.vertices[k]);
  }
  return json;
}

Json to_json(const DistanceResult& result) {
  Json json;
  json["status"] = name_of(result.status);
  json.update(to_json(static_cast<const Contact&>(result)));
  json["pivot_W"] = to_json(result.pivot_W());
  json["penetration"] = nullptr;
  if (result.penetration) {
    json["penetration"] = {{"depth", number_json(result.penetration->depth)},
                           {"nhat_AB_W", to_json(result.penetration->nhat_AB_W)},
                           {"p_W", to_json(result.penetration->p_W)}};
  }
  json["statistics"] = distance_statistics_json(result.statistics);
  return json;
}

Json to_json(const RayHit& hit) {
  const bool is_miss = hit.status == RayStatus::Miss;
  Json json;
  json["status"] = name_of(hit.status);
  json["distance"] = number_json(hit.distance);
  json["gap"] = number_json(hit.gap);
  json["p_WC"] = is_miss ? Json(nullptr) : to_json(hit.p_WC);
  json["nhat_W"] = is_miss ? Json(nullptr) : to_json(hit.nhat_W);
  json["feature"] = is_miss ? Json(nullptr) : to_json(hit.feature);
  json["triangle"] = optional(hit.triangle);
  json["child"] = optional(hit.child);
  return json;
}

Json to_json(const ToiStatistics& statistics) {
  Json json;
  json["box_tests"] = statistics.box_tests;
  json["leaf_tests"] = statistics.leaf_tests;
  json["node_pairs"] = statistics.node_pairs;
  json["peak_queue"] = statistics.peak_queue;
  return json;
}

Json to_json(const ToiResult& result) {
  Json json;
  json["status"] = name_of(result.status);
  json["t_safe"] = number_json(result.t_safe);
  json["t_hit"] = optional(result.t_hit);
  json["contact"] = result.contact ? impact_contact_json(*result.contact) : Json(nullptr);
  json["X_WA"] = to_json(result.X_WA);
  json["X_WB"] = to_json(result.X_WB);
  json["rounding_allowance"] = number_json(result.rounding_allowance);
  json["statistics"] = to_json(result.statistics);
  return json;
}

Json to_json(const Contact& contact) {
  Json json;
  json["lower"] = number_json(contact.lower);
  json["upper"] = number_json(contact.upper);
  json["p_WCa"] = to_json(contact.p_WCa);
  json["p_WCb"] = to_json(contact.p_WCb);
  json["nhat_AB_W"] = to_json(contact.nhat_AB_W);
  json["feature_a"] = to_json(contact.feature_a);
  json["feature_b"] = to_json(contact.feature_b);
  json["triangle_a"] = optional(contact.triangle_a);
  json["triangle_b"] = optional(contact.triangle_b);
  return json;
}

Json to_json(const std::vector<Contact>& contacts) {
  Json json = Json::array();
  for (const Contact& contact : contacts) json.push_back(to_json(contact));
  return json;
}

}  // namespace dyop::io_internal
