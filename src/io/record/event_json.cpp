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

}  // namespace

// Ids in a recording are indices into its list of bodies.
Json to_json(const BodyId& id) {
  return id == BodyId() ? Json(nullptr) : Json(id.slot);
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
  json["discarded_runs"] = statistics.discarded_runs;
  return json;
}

Json to_json(const IntegratorStatistics& statistics) {
  Json json;
  json["steps"] = statistics.steps;
  json["rejected_steps"] = statistics.rejected_steps;
  json["function_evaluations"] = statistics.function_evaluations;
  return json;
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

}  // namespace dyop::io_internal
