// SPDX-License-Identifier: BSD-3-Clause
#include "io/record/event_json.h"

#include "io/result_json.h"

namespace dyop::io_internal {
namespace {

Json world_contact_json(const WorldContact& world_contact) {
  Json json;
  json["a"] = to_json(world_contact.a);
  json["b"] = to_json(world_contact.b);
  json.update(to_json(world_contact.contact));
  json["normal_velocity"] = number_json(world_contact.normal_velocity);
  json["impulse_W"] = to_json(world_contact.impulse_W);
  return json;
}

WorldContact world_contact_from(const Json& json) {
  WorldContact world_contact;
  world_contact.a = body_id_from(json.at("a"));
  world_contact.b = body_id_from(json.at("b"));
  world_contact.contact = contact_from(json);
  world_contact.normal_velocity = number_from(json.at("normal_velocity"));
  world_contact.impulse_W = vector3_from(json.at("impulse_W"));
  return world_contact;
}

}  // namespace

// Ids in a recording are indices into its list of bodies.
Json to_json(const BodyId& id) {
  return id == BodyId() ? Json(nullptr) : Json(id.slot);
}

BodyId body_id_from(const Json& json) {
  return json.is_null() ? BodyId() : BodyId(json.get<std::uint32_t>());
}

Json to_json(const StepStatistics& statistics) {
  Json json;
  json["steps"] = statistics.steps;
  json["substeps"] = statistics.substeps;
  json["islands"] = statistics.islands;
  json["rounds"] = statistics.rounds;
  json["stalls"] = statistics.stalls;
  json["contacts"] = statistics.contacts;
  json["unconverged"] = statistics.unconverged;
  json["residual"] = number_json(statistics.residual);
  json["shortest_gap"] = number_json(statistics.shortest_gap);
  json["pairs_by_bound"] = statistics.pairs_by_bound;
  json["pairs_by_query"] = statistics.pairs_by_query;
  json["pairs_at_rest"] = statistics.pairs_at_rest;
  json["pairs_excused"] = statistics.pairs_excused;
  return json;
}

StepStatistics step_statistics_from(const Json& json) {
  StepStatistics statistics;
  statistics.steps = json.at("steps").get<std::int64_t>();
  statistics.substeps = json.at("substeps").get<std::int64_t>();
  statistics.islands = json.at("islands").get<std::int64_t>();
  statistics.rounds = json.at("rounds").get<std::int64_t>();
  statistics.stalls = json.at("stalls").get<std::int64_t>();
  statistics.contacts = json.at("contacts").get<std::int64_t>();
  statistics.unconverged = json.at("unconverged").get<std::int64_t>();
  statistics.residual = number_from(json.at("residual"));
  // Recordings of version 0.2 do not have it.
  if (json.contains("shortest_gap")) {
    statistics.shortest_gap = number_from(json.at("shortest_gap"));
  }
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

Json to_json(const ImpactEvent& event) {
  Json json;
  json["t"] = number_json(event.t);
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

}  // namespace dyop::io_internal
