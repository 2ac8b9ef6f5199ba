// SPDX-License-Identifier: BSD-3-Clause
#include "io/result_json.h"

#include <cmath>

#include "dyop/io/result_text.h"

namespace dyop::io_internal {
namespace {

template <typename Value>
Json optional(const std::optional<Value>& value) {
  return value ? Json(*value) : Json(nullptr);
}

template <typename Value>
std::optional<Value> optional_from(const Json& json) {
  if (json.is_null()) return std::nullopt;
  return json.get<Value>();
}

// The value of an enumeration by its name.
template <typename Enum>
Enum enum_from(const Json& json, std::initializer_list<Enum> values) {
  const std::string& name = json.get_ref<const std::string&>();
  for (const Enum value : values) {
    if (name_of(value) == name) return value;
  }
  throw InvalidArgument("unknown name " + name);
}

Feature feature_from(const Json& json) {
  Feature feature;
  feature.kind = enum_from(json.at("kind"), {FeatureKind::Vertex, FeatureKind::Edge,
                                             FeatureKind::Face, FeatureKind::Smooth});
  const Json& vertices = json.at("vertices");
  for (std::size_t k = 0; k < vertices.size() && k < feature.vertices.size(); ++k) {
    feature.vertices[k] = vertices[k].get<std::int32_t>();
  }
  return feature;
}

Json impact_contact_json(const ImpactContact& contact) {
  Json json = to_json(static_cast<const Contact&>(contact));
  json["closing_speed"] = number_json(contact.closing_speed);
  json["pivot_W"] = to_json(contact.pivot_W());
  return json;
}

ImpactContact impact_contact_from(const Json& json) {
  return {contact_from(json), number_from(json.at("closing_speed"))};
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

Scalar number_from(const Json& json) {
  return json.is_null() ? kInfinity : json.get<Scalar>();
}

Json to_json(const Vector3& v) {
  return Json::array({number_json(v.x()), number_json(v.y()), number_json(v.z())});
}

Vector3 vector3_from(const Json& json) {
  return Vector3(number_from(json.at(0)), number_from(json.at(1)), number_from(json.at(2)));
}

Json to_json(const RigidPose& X) {
  const Quaternion q = X.quaternion();
  Json json;
  json["position"] = to_json(X.translation());
  json["quaternion"] = Json::array({q.w(), q.x(), q.y(), q.z()});
  return json;
}

RigidPose pose_from(const Json& json) {
  const Json& q = json.at("quaternion");
  return RigidPose(Quaternion(q.at(0).get<Scalar>(), q.at(1).get<Scalar>(), q.at(2).get<Scalar>(),
                              q.at(3).get<Scalar>()),
                   vector3_from(json.at("position")));
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

Json to_json(const ToiStatistics& statistics) {
  Json json;
  json["box_tests"] = statistics.box_tests;
  json["leaf_tests"] = statistics.leaf_tests;
  json["node_pairs"] = statistics.node_pairs;
  json["peak_queue"] = statistics.peak_queue;
  return json;
}

ToiStatistics toi_statistics_from(const Json& json) {
  ToiStatistics statistics;
  statistics.box_tests = json.at("box_tests").get<std::int64_t>();
  statistics.leaf_tests = json.at("leaf_tests").get<std::int64_t>();
  statistics.node_pairs = json.at("node_pairs").get<std::int64_t>();
  statistics.peak_queue = json.at("peak_queue").get<std::int64_t>();
  return statistics;
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

ToiResult toi_result_from(const Json& json) {
  ToiResult result;
  result.status =
      enum_from(json.at("status"), {ToiStatus::NotRun, ToiStatus::Separated, ToiStatus::Impact,
                                    ToiStatus::InitiallyWithinTarget, ToiStatus::BudgetExhausted,
                                    ToiStatus::Cancelled, ToiStatus::NumericalLimit});
  result.t_safe = number_from(json.at("t_safe"));
  result.t_hit = optional_from<Scalar>(json.at("t_hit"));
  if (!json.at("contact").is_null()) result.contact = impact_contact_from(json.at("contact"));
  result.X_WA = pose_from(json.at("X_WA"));
  result.X_WB = pose_from(json.at("X_WB"));
  result.rounding_allowance = number_from(json.at("rounding_allowance"));
  result.statistics = toi_statistics_from(json.at("statistics"));
  return result;
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

Contact contact_from(const Json& json) {
  Contact contact;
  contact.lower = number_from(json.at("lower"));
  contact.upper = number_from(json.at("upper"));
  contact.p_WCa = vector3_from(json.at("p_WCa"));
  contact.p_WCb = vector3_from(json.at("p_WCb"));
  contact.nhat_AB_W = vector3_from(json.at("nhat_AB_W"));
  contact.feature_a = feature_from(json.at("feature_a"));
  contact.feature_b = feature_from(json.at("feature_b"));
  contact.triangle_a = optional_from<std::int32_t>(json.at("triangle_a"));
  contact.triangle_b = optional_from<std::int32_t>(json.at("triangle_b"));
  return contact;
}

Json to_json(const std::vector<Contact>& contacts) {
  Json json = Json::array();
  for (const Contact& contact : contacts) json.push_back(to_json(contact));
  return json;
}

}  // namespace dyop::io_internal
