// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/recording_lines.h"

#include <algorithm>
#include <ostream>

#include "dyop/dynamics/world.h"
#include "io/json_reader.h"
#include "io/result_json.h"

namespace dyop::io_internal {

/// Reports of a World as JSON values.
Json to_json(const BodyId& id);
Json to_json(const IntegratorStatistics& statistics);
Json to_json(const StepStatistics& statistics);
/// Without the contacts of the time of impact: the event lists those of all pairs.
Json to_json(const ImpactEvent& event);

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

namespace dyop {
namespace {

using io_internal::Json;
using io_internal::number_json;
using io_internal::to_json;

constexpr int kPartsOfStep = 4;

Json optional_json(const std::optional<Scalar>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json header_json(const RecordingReader& reader) {
  const RunHeader& header = reader.header();
  Json json;
  json["record"] = "header";
  json["title"] = header.title;
  json["target_distance"] = optional_json(header.target_distance);
  json["rest_offset"] = optional_json(header.rest_offset);
  json["begin_time"] = header.begin_time;
  json["end_time"] = header.end_time;
  json["step"] = header.step;
  json["bodies"] = Json::array();
  for (const RecordedBody& body : reader.bodies()) {
    json["bodies"].push_back({{"name", body.name},
                              {"kind", name_of(body.kind)},
                              {"is_sensor", body.is_sensor},
                              {"mass", body.mass}});
  }
  return json;
}

// Position, quaternion w x y z, velocity, angular velocity: one flat list keeps the lines short.
Json state_json(const MotionState& state) {
  const Quaternion q = state.X_WB.quaternion();
  const Vector3& p = state.X_WB.translation();
  const auto& [v, w] = state.twist;
  return Json::array(
      {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z(), v.x(), v.y(), v.z(), w.x(), w.y(), w.z()});
}

// Whether a body was there, or said to be absent, by a time: others are added later.
bool is_known_at(const RecordingReader& reader, BodyId body, Scalar t) {
  return reader.segment_count(body) > 0 && reader.segment(body, 0).interval.begin <= t;
}

// The times within a step at which a body's segment ends: velocities may jump there.
std::vector<Scalar> breaks_of(const RecordingReader& reader, const TimeInterval& step) {
  std::vector<Scalar> breaks{step.begin, step.end};
  for (std::size_t slot = 0; slot < reader.bodies().size(); ++slot) {
    const BodyId body(slot);
    if (!is_known_at(reader, body, step.end)) continue;
    const std::size_t last = reader.segment_at(body, step.end);
    const bool is_known = is_known_at(reader, body, step.begin);
    for (std::size_t k = is_known ? reader.segment_at(body, step.begin) + 1 : 0; k <= last; ++k) {
      const Scalar begin = reader.segment(body, k).interval.begin;
      if (step.contains(begin)) breaks.push_back(begin);
    }
  }
  std::sort(breaks.begin(), breaks.end());
  breaks.erase(std::unique(breaks.begin(), breaks.end()), breaks.end());
  return breaks;
}

// The times are equally spaced; the last is the end exactly.
std::vector<Scalar> times_in(const TimeInterval& part) {
  std::vector<Scalar> times;
  for (int k = 0; k < kPartsOfStep; ++k) {
    times.push_back(part.begin + part.length() * k / kPartsOfStep);
  }
  times.push_back(part.end);
  return times;
}

Json part_json(const RecordingReader& reader, const TimeInterval& part) {
  const std::vector<Scalar> times = times_in(part);
  std::vector<Json> states(times.size(), Json::array());
  for (std::size_t slot = 0; slot < reader.bodies().size(); ++slot) {
    const BodyId body(slot);
    const Scalar middle = part.begin + part.length() / 2;
    MotionSegment segment;
    if (is_known_at(reader, body, middle))
      segment = reader.segment(body, reader.segment_at(body, middle));
    for (std::size_t k = 0; k < times.size(); ++k) {
      const bool is_there = segment.motion != nullptr;
      states[k].push_back(is_there ? state_json(segment.motion->state(times[k])) : Json(nullptr));
    }
  }
  return {{"record", "step"}, {"t", times}, {"states", std::move(states)}};
}

Json event_json(const RunEvent& event) {
  return {{"record", name_of(event.kind)},
          {"t", event.t},
          {"a", to_json(event.a)},
          {"b", to_json(event.b)}};
}

Json end_json(const RecordingReader& reader) {
  const RunEnd& end = *reader.end();
  Json json{{"record", "end"}, {"status", name_of(end.status)}};
  if (!end.error.empty()) json["error"] = end.error;
  json["t"] = number_json(reader.interval().end);
  json["advances"] = reader.frames().size();
  json["steps"] = reader.steps().size();
  json["impacts"] = reader.impacts().size();
  return json;
}

class LineWriter {
 public:
  LineWriter(std::ostream& out, const RecordingReader& reader) : out_(out), reader_(reader) {}

  void write() {
    line(header_json(reader_));
    for (const TimeInterval& step : reader_.steps()) {
      const std::vector<Scalar> breaks = breaks_of(reader_, step);
      for (std::size_t k = 1; k < breaks.size(); ++k) {
        write_events_until(breaks[k - 1]);
        line(part_json(reader_, {breaks[k - 1], breaks[k]}));
      }
    }
    write_events_until(kInfinity);
    if (reader_.end()) line(end_json(reader_));
  }

 private:
  // Names of bodies need not be valid UTF-8.
  void line(const Json& json) {
    out_ << json.dump(-1, ' ', false, Json::error_handler_t::replace) << '\n';
  }

  void write_events_until(Scalar t) {
    for (; impact_ < reader_.impacts().size() && reader_.impacts()[impact_].t <= t; ++impact_) {
      Json json{{"record", "impact"}, {"number", impact_ + 1}};
      json.update(to_json(reader_.impacts()[impact_]));
      line(json);
    }
    for (; event_ < reader_.events().size() && reader_.events()[event_].t <= t; ++event_) {
      line(event_json(reader_.events()[event_]));
    }
  }

  std::ostream& out_;
  const RecordingReader& reader_;
  std::size_t impact_ = 0;  // the first that is not written
  std::size_t event_ = 0;
};

}  // namespace

void write_json_lines(std::ostream& out, const RecordingReader& reader) {
  LineWriter(out, reader).write();
}

RunHeader run_header(const Scene& scene) {
  RunHeader header;
  header.title = scene.title;
  header.scene = scene.source;
  header.target_distance = scene.options.target_distance;
  header.rest_offset = scene.options.rest_offset;
  header.end_time = scene.end_time;
  header.step = scene.step;
  return header;
}

}  // namespace dyop
