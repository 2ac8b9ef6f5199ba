// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/scene_recording.h"

#include <utility>

#include "dyop/io/file_error.h"
#include "dyop/io/run_recording.h"
#include "dyop/motion/hermite_motion.h"
#include "dyop/motion/rest_motion.h"
#include "dyop/motion/sequence_motion.h"

namespace dyop {
namespace {

bool is_same_state(const MotionState& x, const MotionState& y) {
  return x.X_WB.rotation() == y.X_WB.rotation() && x.X_WB.translation() == y.X_WB.translation() &&
         x.twist.v_WB == y.twist.v_WB && x.twist.w_WB == y.twist.w_WB;
}

bool rests(const RecordedStep& step, std::size_t body) {
  const MotionState& first = step.states.front()[body];
  if (!first.twist.v_WB.isZero(0) || !first.twist.w_WB.isZero(0)) return false;
  for (const std::vector<MotionState>& states : step.states) {
    if (!is_same_state(states[body], first)) return false;
  }
  return true;
}

// The cubics between the recorded states: see recorded_pose().
std::shared_ptr<const Motion> motion_of(const RecordedStep& step, std::size_t body) {
  if (rests(step, body)) return std::make_shared<RestMotion>(step.states.front()[body].X_WB);
  std::vector<SequenceMotion::Part> parts;
  for (std::size_t k = 1; k < step.times.size(); ++k) {
    const TimeInterval interval{step.times[k - 1], step.times[k]};
    if (!(interval.length() > 0)) continue;
    parts.push_back({interval, std::make_shared<HermiteMotion>(interval, step.states[k - 1][body],
                                                               step.states[k][body])});
  }
  return std::make_shared<SequenceMotion>(std::move(parts));
}

AdvanceReport report_of(const RecordedStep& step) {
  AdvanceReport report;
  report.status = AdvanceStatus::Completed;
  report.t = step.times.back();
  report.work.steps = 1;
  CommittedStep& committed = report.steps.emplace_back();
  committed.interval = {step.times.front(), step.times.back()};
  for (std::size_t body = 0; body < step.states.front().size(); ++body) {
    committed.motions.push_back(motion_of(step, body));
  }
  return report;
}

}  // namespace

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

void convert_recording(const std::filesystem::path& text, const Scene& scene,
                       const std::filesystem::path& out) {
  const RunRecording recording = read_recording(text);
  if (recording.bodies.size() != scene.bodies.size()) {
    throw FileError(text,
                    core_internal::compose_message("records ", recording.bodies.size(),
                                                   " bodies, the scene has ", scene.bodies.size()));
  }
  RecordingOptions options;
  options.is_sampled = true;
  RecordingWriter writer(out, run_header(scene), options);
  std::size_t next_impact = 0;
  for (std::size_t k = 0; k < recording.steps.size(); ++k) {
    AdvanceReport report = report_of(recording.steps[k]);
    const bool is_last = k + 1 == recording.steps.size();
    while (next_impact < recording.impacts.size() &&
           (is_last || recording.impacts[next_impact].t <= report.t)) {
      report.impacts.push_back(recording.impacts[next_impact++]);
    }
    if (is_last && recording.is_complete) {
      report.status = recording.totals.status;
      report.offending_pair = recording.totals.offending_pair;
    }
    writer.write(report, scene.bodies);
  }
  if (!recording.is_complete) return;  // of a run that was killed: so is what this makes of it
  if (recording.totals.error) {
    writer.fail(*recording.totals.error);
  } else {
    writer.finish();
  }
}

}  // namespace dyop
