#include "scene_io/event_json.h"

#include "io/result_json.h"

namespace dyop::internal {
namespace {

Json world_contact_json(const WorldContact& world_contact) {
  Json json;
  json["a"] = world_contact.a;
  json["b"] = world_contact.b;
  json.update(to_json(world_contact.contact));
  json["normal_velocity"] = number_json(world_contact.normal_velocity);
  json["impulse_W"] = to_json(world_contact.impulse_W);
  return json;
}

WorldContact world_contact_from(const Json& json) {
  WorldContact world_contact;
  world_contact.a = json.at("a").get<BodyId>();
  world_contact.b = json.at("b").get<BodyId>();
  world_contact.contact = contact_from(json);
  world_contact.normal_velocity = number_from(json.at("normal_velocity"));
  world_contact.impulse_W = vector3_from(json.at("impulse_W"));
  return world_contact;
}

}  // namespace

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

Json to_json(const ImpactEvent& event) {
  Json json;
  json["t"] = number_json(event.t);
  json["a"] = event.a;
  json["b"] = event.b;
  json["settled"] = event.settled;
  json["toi"] = to_json(event.toi);
  json["contacts"] = Json::array();
  for (const WorldContact& contact : event.contacts)
    json["contacts"].push_back(world_contact_json(contact));
  return json;
}

ImpactEvent impact_event_from(const Json& json) {
  ImpactEvent event;
  event.t = number_from(json.at("t"));
  event.a = json.at("a").get<BodyId>();
  event.b = json.at("b").get<BodyId>();
  event.settled = json.at("settled").get<bool>();
  event.toi = toi_result_from(json.at("toi"));
  for (const Json& contact : json.at("contacts")) {
    event.contacts.push_back(world_contact_from(contact));
  }
  return event;
}

}  // namespace dyop::internal
