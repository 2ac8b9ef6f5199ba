// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "dyop/dynamics/world.h"
#include "dyop/scene_io/scene_file.h"

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
  /// What World::advance() threw, if that ended the run; `status` is then that of the advance
  /// before.
  std::optional<std::string> error;

  void add(const AdvanceReport& report);

  /// How the run ended in one word: the name of the status, or "Error".
  std::string_view end() const;
};

/// Writes a run as JSON lines: docs/recording-format.md. The bytes depend on the scene and the
/// reports only: no clock, no host, no number of threads.
class RunRecorder {
 public:
  /// Writes the header. The stream must outlive the recorder.
  RunRecorder(std::ostream& out, const Scene& scene);

  /// Writes the committed steps and impacts of one advance, in the order of time.
  void write(const AdvanceReport& report);

  /// Writes the last line.
  void finish();

  /// Writes the last line of a run that an exception with this message ended.
  void fail(const std::string& error);

  const RunTotals& totals() const { return totals_; }

 private:
  std::ostream& out_;
  RunTotals totals_;
};

/// One committed step of all bodies: exact states of the committed motion at its begin, its end
/// and some times between.
struct RecordedStep {
  std::vector<Scalar> times;                     ///< increasing, at least two
  std::vector<std::vector<MotionState>> states;  ///< per time, per body
};

/// What a recording holds.
struct RunRecording {
  struct Body {
    std::string name;
    BodyKind kind = BodyKind::Dynamic;
  };
  std::string scene;  ///< JSON of the scene file, on one line
  std::vector<Body> bodies;
  std::vector<RecordedStep> steps;
  std::vector<ImpactEvent> impacts;
  bool is_complete = false;  ///< the last line is there: the run was not killed
  RunTotals totals;          ///< if complete
};

/// @throws FileError with the line.
RunRecording read_recording(const std::filesystem::path& file);

/// The pose of a body at a time within a step. At a recorded time it is the recorded pose, which is
/// the committed one up to rounding; between two of them it is the cubic through their states (see
/// HermiteMotion), whose error is of fourth order in their distance.
/// @throws InvalidArgument if the step does not hold the time or the body.
RigidPose recorded_pose(const RecordedStep& step, BodyId body, Scalar t);

}  // namespace dyop
