// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "dyop/dynamics/world.h"
#include "dyop/io/scene_file.h"

namespace DYOP_EXPORT dyop {

/// The enumerator's name, as in the header.
std::string_view name_of(AdvanceStatus status);

/// Sums over the advances of a run, and how it ended.
struct RunTotals {
  AdvanceStatus status = AdvanceStatus::NotRun;
  Scalar t = 0;  ///< where the run ended
  std::int64_t advances = 0;
  std::int64_t steps = 0;  ///< committed steps
  std::int64_t impacts = 0;
  std::vector<std::pair<BodyId, BodyId>> too_near;
  std::pair<BodyId, BodyId> offending_pair;  ///< as AdvanceReport
  IntegratorStatistics integrator;
  ToiStatistics toi;  ///< peak_queue is the largest
  StepStatistics work;
  StepTimes times;  ///< not recorded: a recording knows no clock
  /// What World::advance() threw, if that ended the run; `status` is then that of the previous
  /// advance.
  std::optional<std::string> error;

  void add(const AdvanceReport& report);

  /// How the run ended in one word: the name of the status, or "Error".
  std::string_view end() const;
};

/// Writes a run as JSON lines: docs/recording-format.md. The bytes depend only on the scene and the
/// reports, not on the clock, the host or the number of threads.
class RunRecorder {
 public:
  /// Writes the header. The stream must outlive the recorder.
  RunRecorder(std::ostream& out, const Scene& scene);

  /// Writes the committed steps and impacts of one advance, in order of time.
  void write(const AdvanceReport& report);

  /// Writes the last line.
  void finish();

  /// Writes the last line of a run that was ended by an exception with this message.
  void fail(const std::string& error);

  const RunTotals& totals() const { return totals_; }

 private:
  std::ostream& out_;
  RunTotals totals_;
};

/// One committed step of all bodies: exact states of the committed motion at its start, at its end
/// and at some times in between.
struct RecordedStep {
  std::vector<Scalar> times;                     ///< increasing, at least two
  std::vector<std::vector<MotionState>> states;  ///< per time, per body
};

/// The contents of a recording.
struct RunRecording {
  struct Body {
    std::string name;
    BodyKind kind = BodyKind::Dynamic;
  };
  std::string scene;  ///< JSON of the scene file, on one line
  std::vector<Body> bodies;
  std::vector<RecordedStep> steps;
  std::vector<ImpactEvent> impacts;
  bool is_complete = false;  ///< the last line exists: the run was not killed
  RunTotals totals;          ///< if complete
};

/// @throws FileError with the line.
RunRecording read_recording(const std::filesystem::path& file);

/// The pose of a body at a time within a step. At a recorded time it is the recorded pose, which is
/// the committed one up to rounding; in between it is the cubic through the neighbouring states
/// (see HermiteMotion), whose error is of fourth order in their distance in time.
/// @throws InvalidArgument if the step does not contain the time or the body.
RigidPose recorded_pose(const RecordedStep& step, BodyId body, Scalar t);

}  // namespace dyop
