#include "io/result_json.h"

#include <cmath>

#include "dyop/io/result_text.h"

namespace dyop::internal {
namespace {

Json number(Scalar value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Scalar number_from(const Json& json) {
  return json.is_null() ? kInfinity : json.get<Scalar>();
}

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
  throw InvalidArgument("unknown word " + name);
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
  Json json;
  json["distance_lower"] = number(contact.distance_lower);
  json["distance_upper"] = number(contact.distance_upper);
  json["p_WCa"] = to_json(contact.p_WCa);
  json["p_WCb"] = to_json(contact.p_WCb);
  json["nhat_AB_W"] = to_json(contact.nhat_AB_W);
  json["closing_speed"] = number(contact.closing_speed);
  json["feature_a"] = to_json(contact.feature_a);
  json["feature_b"] = to_json(contact.feature_b);
  json["triangle_a"] = optional(contact.triangle_a);
  json["triangle_b"] = optional(contact.triangle_b);
  json["pivot_W"] = to_json(contact.pivot_W);
  return json;
}

ImpactContact impact_contact_from(const Json& json) {
  ImpactContact contact;
  contact.distance_lower = number_from(json.at("distance_lower"));
  contact.distance_upper = number_from(json.at("distance_upper"));
  contact.p_WCa = vector3_from(json.at("p_WCa"));
  contact.p_WCb = vector3_from(json.at("p_WCb"));
  contact.nhat_AB_W = vector3_from(json.at("nhat_AB_W"));
  contact.closing_speed = number_from(json.at("closing_speed"));
  contact.feature_a = feature_from(json.at("feature_a"));
  contact.feature_b = feature_from(json.at("feature_b"));
  contact.triangle_a = optional_from<std::int32_t>(json.at("triangle_a"));
  contact.triangle_b = optional_from<std::int32_t>(json.at("triangle_b"));
  contact.pivot_W = vector3_from(json.at("pivot_W"));
  return contact;
}

void add_contact(const Contact& contact, Json& json) {
  json["lower"] = number(contact.lower);
  json["upper"] = number(contact.upper);
  json["p_WCa"] = to_json(contact.p_WCa);
  json["p_WCb"] = to_json(contact.p_WCb);
  json["nhat_AB_W"] = to_json(contact.nhat_AB_W);
  json["feature_a"] = to_json(contact.feature_a);
  json["feature_b"] = to_json(contact.feature_b);
  json["triangle_a"] = optional(contact.triangle_a);
  json["triangle_b"] = optional(contact.triangle_b);
}

Json world_contact_json(const WorldContact& world_contact) {
  Json json;
  json["a"] = to_json(world_contact.a);
  json["b"] = to_json(world_contact.b);
  add_contact(world_contact.contact, json);
  json["normal_velocity"] = number(world_contact.normal_velocity);
  json["impulse_W"] = to_json(world_contact.impulse_W);
  return json;
}

WorldContact world_contact_from(const Json& json) {
  WorldContact world_contact;
  Contact& contact = world_contact.contact;
  world_contact.a = body_id_from(json.at("a"));
  world_contact.b = body_id_from(json.at("b"));
  contact.lower = number_from(json.at("lower"));
  contact.upper = number_from(json.at("upper"));
  contact.p_WCa = vector3_from(json.at("p_WCa"));
  contact.p_WCb = vector3_from(json.at("p_WCb"));
  contact.nhat_AB_W = vector3_from(json.at("nhat_AB_W"));
  contact.feature_a = feature_from(json.at("feature_a"));
  contact.feature_b = feature_from(json.at("feature_b"));
  contact.triangle_a = optional_from<std::int32_t>(json.at("triangle_a"));
  contact.triangle_b = optional_from<std::int32_t>(json.at("triangle_b"));
  world_contact.normal_velocity = number_from(json.at("normal_velocity"));
  world_contact.impulse_W = vector3_from(json.at("impulse_W"));
  return world_contact;
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

Json distance_statistics_json(const DistanceStatistics& statistics) {
  Json json;
  json["box_tests"] = statistics.box_tests;
  json["leaf_tests"] = statistics.leaf_tests;
  json["gjk_iterations"] = statistics.gjk_iterations;
  return json;
}

}  // namespace

Json to_json(const Vector3& v) {
  return Json::array({number(v.x()), number(v.y()), number(v.z())});
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
  for (const std::int32_t vertex : feature.vertices) {
    if (vertex >= 0) json["vertices"].push_back(vertex);
  }
  return json;
}

Json to_json(const DistanceResult& result) {
  Json json;
  json["status"] = name_of(result.status);
  json["lower"] = number(result.lower);
  json["upper"] = number(result.upper);
  json["p_WCa"] = to_json(result.p_WCa);
  json["p_WCb"] = to_json(result.p_WCb);
  json["nhat_AB_W"] = to_json(result.nhat_AB_W);
  json["feature_a"] = to_json(result.feature_a);
  json["feature_b"] = to_json(result.feature_b);
  json["triangle_a"] = optional(result.triangle_a);
  json["triangle_b"] = optional(result.triangle_b);
  json["pivot_W"] = to_json(result.pivot_W);
  json["penetration"] = nullptr;
  if (result.penetration) {
    json["penetration"] = {{"depth", number(result.penetration->depth)},
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

// Ids of a recording are places in its list of bodies.
Json to_json(const BodyId& id) {
  return id == BodyId() ? Json(nullptr) : Json(id.slot);
}

BodyId body_id_from(const Json& json) {
  return json.is_null() ? BodyId() : BodyId(json.get<std::uint32_t>());
}

Json to_json(const StepStatistics& statistics) {
  Json json;
  json["steps"] = statistics.steps;
  json["legs"] = statistics.legs;
  json["islands"] = statistics.islands;
  json["rounds"] = statistics.rounds;
  json["stalls"] = statistics.stalls;
  json["contacts"] = statistics.contacts;
  json["unconverged"] = statistics.unconverged;
  json["residual"] = number(statistics.residual);
  json["pairs_by_bound"] = statistics.pairs_by_bound;
  json["pairs_by_query"] = statistics.pairs_by_query;
  json["pairs_at_rest"] = statistics.pairs_at_rest;
  json["pairs_excused"] = statistics.pairs_excused;
  return json;
}

StepStatistics step_statistics_from(const Json& json) {
  StepStatistics statistics;
  statistics.steps = json.at("steps").get<std::int64_t>();
  statistics.legs = json.at("legs").get<std::int64_t>();
  statistics.islands = json.at("islands").get<std::int64_t>();
  statistics.rounds = json.at("rounds").get<std::int64_t>();
  statistics.stalls = json.at("stalls").get<std::int64_t>();
  statistics.contacts = json.at("contacts").get<std::int64_t>();
  statistics.unconverged = json.at("unconverged").get<std::int64_t>();
  statistics.residual = number_from(json.at("residual"));
  statistics.pairs_by_bound = json.at("pairs_by_bound").get<std::int64_t>();
  statistics.pairs_by_query = json.at("pairs_by_query").get<std::int64_t>();
  statistics.pairs_at_rest = json.at("pairs_at_rest").get<std::int64_t>();
  statistics.pairs_excused = json.at("pairs_excused").get<std::int64_t>();
  return statistics;
}

Json to_json(const IntegratorStatistics& statistics) {
  Json json;
  json["steps"] = statistics.steps;
  json["rejected_steps"] = statistics.rejected_steps;
  json["function_evaluations"] = statistics.function_evaluations;
  return json;
}

IntegratorStatistics integrator_statistics_from(const Json& json) {
  IntegratorStatistics statistics;
  statistics.steps = json.at("steps").get<std::int64_t>();
  statistics.rejected_steps = json.at("rejected_steps").get<std::int64_t>();
  statistics.function_evaluations = json.at("function_evaluations").get<std::int64_t>();
  return statistics;
}

Json to_json(const ToiResult& result) {
  Json json;
  json["status"] = name_of(result.status);
  json["t_safe"] = number(result.t_safe);
  json["t_hit"] = optional(result.t_hit);
  json["contact"] = result.contact ? impact_contact_json(*result.contact) : Json(nullptr);
  json["X_WA"] = to_json(result.X_WA);
  json["X_WB"] = to_json(result.X_WB);
  json["rounding_allowance"] = number(result.rounding_allowance);
  json["statistics"] = to_json(result.statistics);
  return json;
}

Json to_json(const std::vector<Contact>& contacts) {
  Json json = Json::array();
  for (const Contact& contact : contacts) add_contact(contact, json.emplace_back());
  return json;
}

Json to_json(const ImpactEvent& event) {
  Json json;
  json["t"] = number(event.t);
  json["a"] = to_json(event.a);
  json["b"] = to_json(event.b);
  json["toi"] = to_json(event.toi);
  json["contacts"] = Json::array();
  for (const WorldContact& contact : event.contacts)
    json["contacts"].push_back(world_contact_json(contact));
  return json;
}

ImpactEvent impact_event_from(const Json& json) {
  ImpactEvent event;
  event.t = number_from(json.at("t"));
  event.a = body_id_from(json.at("a"));
  event.b = body_id_from(json.at("b"));
  event.toi = toi_result_from(json.at("toi"));
  for (const Json& contact : json.at("contacts")) {
    event.contacts.push_back(world_contact_from(contact));
  }
  return event;
}

}  // namespace dyop::internal
