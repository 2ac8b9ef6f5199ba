// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/run_recording.h"

#include <algorithm>
#include <array>
#include <ostream>

#include "dyop/io/file_error.h"
#include "dyop/motion/hermite_motion.h"
#include "dyop/motion/sequence_motion.h"
#include "io/file_bytes.h"
#include "io/record/event_json.h"
#include "io/result_json.h"

namespace dyop {
namespace {

using io_internal::Json;
using io_internal::to_json;

constexpr int kVersion = 2;
constexpr std::size_t kStateNumbers = 13;
constexpr int kPartsOfStep = 4;
constexpr std::string_view kError = "Error";  // the status of a run ended by an exception

constexpr std::array<std::pair<BodyKind, std::string_view>, 3> kKinds{{
    {BodyKind::Dynamic, "dynamic"},
    {BodyKind::Kinematic, "kinematic"},
    {BodyKind::Static, "static"},
}};

std::string_view name_of_kind(BodyKind kind) {
  for (const auto& [value, name] : kKinds) {
    if (value == kind) return name;
  }
  return "dynamic";
}

Json header_of(const Scene& scene) {
  Json json;
  json["record"] = "header";
  json["format"] = "dyop recording";
  json["version"] = kVersion;
  json["bodies"] = Json::array();
  for (const BodyDefinition& body : scene.bodies) {
    json["bodies"].push_back({{"name", body.name},
                              {"kind", name_of_kind(body.kind)},
                              {"bounding_radius", body.shape->bounding_radius()}});
  }
  json["options"] = {{"target_distance", nullptr},
                     {"rest_offset", nullptr},
                     {"max_node_pairs", scene.options.max_node_pairs},
                     {"end_time", scene.end_time},
                     {"step", scene.step}};
  if (const auto& value = scene.options.target_distance) {
    json["options"]["target_distance"] = *value;
  }
  if (const auto& value = scene.options.rest_offset) json["options"]["rest_offset"] = *value;
  json["scene"] = Json::parse(scene.source);
  return json;
}

// Position, quaternion w x y z, velocity, angular velocity: one flat list keeps the lines short.
Json state_json(const RigidPose& X_WB, const Twist& twist) {
  const Quaternion q = X_WB.quaternion();
  const Vector3& p = X_WB.translation();
  return Json::array({p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z(), twist.v_WB.x(),
                      twist.v_WB.y(), twist.v_WB.z(), twist.w_WB.x(), twist.w_WB.y(),
                      twist.w_WB.z()});
}

// The motion that a body follows throughout a part of a step: where two parts of a sequence meet,
// the velocity before the meeting.
const Motion& motion_within(const Motion& motion, const TimeInterval& part) {
  const auto* sequence = dynamic_cast<const SequenceMotion*>(&motion);
  if (sequence == nullptr) return motion;
  for (const SequenceMotion::Part& entry : sequence->parts()) {
    if (entry.interval.begin <= part.begin && part.end <= entry.interval.end) return *entry.motion;
  }
  return motion;
}

// The times are equally spaced; the last is the end exactly.
Json step_json(const CommittedStep& step, const TimeInterval& part) {
  Json json;
  json["record"] = "step";
  Json times = Json::array();
  Json states = Json::array();
  for (int k = 0; k <= kPartsOfStep; ++k) {
    const Scalar t = k == kPartsOfStep ? part.end : part.begin + part.length() * k / kPartsOfStep;
    times.push_back(t);
    Json bodies = Json::array();
    for (const auto& motion : step.motions) {
      const MotionState state = motion_within(*motion, part).state(t);
      bodies.push_back(state_json(state.X_WB, state.twist));
    }
    states.push_back(std::move(bodies));
  }
  json["t"] = std::move(times);
  json["states"] = std::move(states);
  return json;
}

// Splits a step where the velocity of one of its bodies jumps.
std::vector<TimeInterval> smooth_parts(const CommittedStep& step) {
  std::vector<TimeInterval> parts;
  for (Scalar t = step.interval.begin; t < step.interval.end;) {
    Scalar next = step.interval.end;
    for (const auto& motion : step.motions) {
      if (dynamic_cast<const SequenceMotion*>(motion.get()) == nullptr) continue;
      next = std::min(next, motion->smooth_until(t));
    }
    parts.push_back({t, next});
    t = next;
  }
  return parts;
}

Json impact_json(const ImpactEvent& event, std::int64_t number) {
  Json json;
  json["record"] = "impact";
  json["number"] = number;
  json.update(to_json(event));
  return json;
}

Json totals_json(const RunTotals& totals) {
  Json json;
  json["record"] = "end";
  json["status"] = totals.end();
  if (totals.error) json["error"] = *totals.error;
  json["t"] = totals.t;
  json["advances"] = totals.advances;
  json["steps"] = totals.steps;
  json["impacts"] = totals.impacts;
  json["offending_pair"] =
      Json::array({to_json(totals.offending_pair.first), to_json(totals.offending_pair.second)});
  json["too_near"] = Json::array();
  for (const auto& [a, b] : totals.too_near) {
    json["too_near"].push_back(Json::array({to_json(a), to_json(b)}));
  }
  json["integrator"] = to_json(totals.integrator);
  json["toi"] = to_json(totals.toi);
  json["work"] = to_json(totals.work);
  return json;
}

std::vector<MotionState> states_from(const Json& json, std::size_t count) {
  if (json.size() != count) throw InvalidArgument("expected one state per body");
  std::vector<MotionState> states;
  for (const Json& entry : json) {
    const auto x = entry.get<std::vector<Scalar>>();
    if (x.size() != kStateNumbers) throw InvalidArgument("expected 13 numbers per body");
    states.push_back({RigidPose(Quaternion(x[3], x[4], x[5], x[6]), Vector3(x[0], x[1], x[2])),
                      Twist{Vector3(x[7], x[8], x[9]), Vector3(x[10], x[11], x[12])}});
  }
  return states;
}

RecordedStep step_from(const Json& json, std::size_t body_count) {
  RecordedStep step;
  step.times = json.at("t").get<std::vector<Scalar>>();
  if (step.times.size() < 2 || !std::is_sorted(step.times.begin(), step.times.end())) {
    throw InvalidArgument("expected increasing times");
  }
  for (const Json& states : json.at("states"))
    step.states.push_back(states_from(states, body_count));
  if (step.states.size() != step.times.size()) throw InvalidArgument("expected states per time");
  return step;
}

void read_header(const Json& json, RunRecording& recording) {
  if (json.at("version") != kVersion) throw InvalidArgument("unknown format version");
  recording.scene = json.at("scene").dump();
  for (const Json& body : json.at("bodies")) {
    const auto kind = std::find_if(kKinds.begin(), kKinds.end(), [&](const auto& entry) {
      return body.at("kind") == entry.second;
    });
    if (kind == kKinds.end()) throw InvalidArgument("unknown kind of body");
    recording.bodies.push_back({body.at("name").get<std::string>(), kind->first});
  }
}

std::pair<BodyId, BodyId> pair_from(const Json& json) {
  return {io_internal::body_id_from(json.at(0)), io_internal::body_id_from(json.at(1))};
}

RunTotals totals_from(const Json& json) {
  RunTotals totals;
  for (const AdvanceStatus status :
       {AdvanceStatus::Completed, AdvanceStatus::StoppedAtImpact, AdvanceStatus::BudgetExhausted,
        AdvanceStatus::Blocked, AdvanceStatus::Cancelled, AdvanceStatus::NumericalLimit}) {
    if (json.at("status") == name_of(status)) totals.status = status;
  }
  if (json.contains("error")) totals.error = json.at("error").get<std::string>();
  totals.t = json.at("t").get<Scalar>();
  totals.advances = json.at("advances").get<std::int64_t>();
  totals.steps = json.at("steps").get<std::int64_t>();
  totals.impacts = json.at("impacts").get<std::int64_t>();
  totals.offending_pair = pair_from(json.at("offending_pair"));
  for (const Json& pair : json.at("too_near")) totals.too_near.push_back(pair_from(pair));
  totals.integrator = io_internal::integrator_statistics_from(json.at("integrator"));
  totals.toi = io_internal::toi_statistics_from(json.at("toi"));
  totals.work = io_internal::step_statistics_from(json.at("work"));
  return totals;
}

void read_line(const Json& json, RunRecording& recording) {
  const std::string record = json.at("record").get<std::string>();
  if (record == "header") {
    read_header(json, recording);
  } else if (record == "step") {
    recording.steps.push_back(step_from(json, recording.bodies.size()));
  } else if (record == "impact") {
    recording.impacts.push_back(io_internal::impact_event_from(json));
  } else if (record == "end") {
    recording.totals = totals_from(json);
    recording.is_complete = true;
  } else if (record != "asleep" && record != "woke") {
    throw InvalidArgument("unknown record " + record);
  }
}

}  // namespace

std::string_view name_of(AdvanceStatus status) {
  switch (status) {
    case AdvanceStatus::NotRun:
      return "NotRun";
    case AdvanceStatus::Completed:
      return "Completed";
    case AdvanceStatus::StoppedAtImpact:
      return "StoppedAtImpact";
    case AdvanceStatus::BudgetExhausted:
      return "BudgetExhausted";
    case AdvanceStatus::Blocked:
      return "Blocked";
    case AdvanceStatus::Cancelled:
      return "Cancelled";
    case AdvanceStatus::NumericalLimit:
      return "NumericalLimit";
  }
  return "NotRun";
}

namespace {

void add_work(StepStatistics& sum, const StepStatistics& part) {
  sum.steps += part.steps;
  sum.substeps += part.substeps;
  sum.islands += part.islands;
  sum.rounds += part.rounds;
  sum.stalls += part.stalls;
  sum.contacts = std::max(sum.contacts, part.contacts);
  sum.unconverged += part.unconverged;
  sum.residual = std::max(sum.residual, part.residual);
  sum.shortest_gap = std::min(sum.shortest_gap, part.shortest_gap);
  sum.pairs_by_bound += part.pairs_by_bound;
  sum.pairs_by_query += part.pairs_by_query;
  sum.pairs_at_rest += part.pairs_at_rest;
  sum.pairs_excused += part.pairs_excused;
}

void add_times(StepTimes& sum, const StepTimes& part) {
  sum.broad_phase += part.broad_phase;
  sum.flight += part.flight;
  sum.contacts += part.contacts;
  sum.solve += part.solve;
  sum.ends += part.ends;
  sum.proofs += part.proofs;
  sum.total += part.total;
}

}  // namespace

void RunTotals::add(const AdvanceReport& report) {
  status = report.status;
  t = report.t;
  ++advances;
  steps += std::int64_t(report.steps.size());
  impacts += std::int64_t(report.impacts.size());
  too_near.insert(too_near.end(), report.too_near.begin(), report.too_near.end());
  offending_pair = report.offending_pair;
  integrator.steps += report.integrator.steps;
  integrator.rejected_steps += report.integrator.rejected_steps;
  integrator.function_evaluations += report.integrator.function_evaluations;
  toi.box_tests += report.toi.box_tests;
  toi.leaf_tests += report.toi.leaf_tests;
  toi.node_pairs += report.toi.node_pairs;
  toi.peak_queue = std::max(toi.peak_queue, report.toi.peak_queue);
  add_work(work, report.work);
  add_times(times, report.times);
}

std::string_view RunTotals::end() const {
  return error ? kError : name_of(status);
}

RunRecorder::RunRecorder(std::ostream& out, const Scene& scene) : out_(out) {
  out_ << header_of(scene).dump() << '\n';
}

void RunRecorder::write(const AdvanceReport& report) {
  std::size_t next_impact = 0;
  const auto write_impacts_until = [&](Scalar t) {
    while (next_impact < report.impacts.size() && report.impacts[next_impact].t <= t) {
      const std::int64_t number = totals_.impacts + std::int64_t(next_impact) + 1;
      out_ << impact_json(report.impacts[next_impact++], number).dump() << '\n';
    }
  };
  for (const CommittedStep& step : report.steps) {
    for (const TimeInterval& part : smooth_parts(step)) {
      write_impacts_until(part.begin);
      out_ << step_json(step, part).dump() << '\n';
    }
  }
  write_impacts_until(kInfinity);
  const auto write_bodies = [&](const char* record, const std::vector<BodyId>& bodies) {
    if (bodies.empty()) return;
    Json ids = Json::array();
    for (const BodyId& id : bodies) ids.push_back(to_json(id));
    const Json json{{"record", record}, {"t", report.t}, {"bodies", ids}};
    out_ << json.dump() << '\n';
  };
  write_bodies("woke", report.woke);
  write_bodies("asleep", report.fell_asleep);
  totals_.add(report);
}

void RunRecorder::finish() {
  out_ << totals_json(totals_).dump() << '\n';
}

void RunRecorder::fail(const std::string& error) {
  totals_.error = error;
  finish();
}

RunRecording read_recording(const std::filesystem::path& file) {
  RunRecording recording;
  const std::string text = io_internal::read_bytes(file);
  std::size_t line = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    ++line;
    try {
      const Json json =
          Json::parse(text.begin() + std::ptrdiff_t(begin), text.begin() + std::ptrdiff_t(end));
      if (line == 1 && json.at("record") != "header") throw InvalidArgument("expected the header");
      read_line(json, recording);
    } catch (const Json::exception& error) {
      throw FileError(file, FilePosition{line, std::nullopt}, error.what());
    } catch (const InvalidArgument& error) {
      throw FileError(file, FilePosition{line, std::nullopt}, error.what());
    }
    begin = end + 1;
  }
  if (line == 0) throw FileError(file, "the file is empty");
  return recording;
}

RigidPose recorded_pose(const RecordedStep& step, BodyId body, Scalar t) {
  DYOP_REQUIRE(step.times.front() <= t && t <= step.times.back(), "the recorded step [",
               step.times.front(), ", ", step.times.back(), "] does not contain the time ", t);
  DYOP_REQUIRE(body.slot < step.states.front().size(), "the recording has no body ", body);
  const auto next = std::lower_bound(step.times.begin(), step.times.end(), t);
  const auto k = std::size_t(next - step.times.begin());
  const MotionState& end = step.states[k][body.slot];
  if (*next == t) return end.X_WB;
  const MotionState& begin = step.states[k - 1][body.slot];
  return HermiteMotion({step.times[k - 1], step.times[k]}, {begin.X_WB, begin.twist},
                       {end.X_WB, end.twist})
      .pose(t);
}

}  // namespace dyop
