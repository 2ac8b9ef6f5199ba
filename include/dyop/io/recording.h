// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dyop/core/time_interval.h"
#include "dyop/dynamics/advance_report.h"
#include "dyop/dynamics/rigid_body.h"
#include "dyop/dynamics/world.h"

namespace DYOP_EXPORT dyop {

/// The name of a body's kind in scene files.
std::string_view name_of(BodyKind kind);

/// Data of a run, besides its bodies.
struct RunHeader {
  std::string title;
  std::string scene;  ///< the scene file's JSON on one line; empty if the run has none
  /// Of all pairs; none: the World's default.
  std::optional<Scalar> target_distance;
  std::optional<Scalar> rest_offset;
  Scalar begin_time = 0;
  Scalar end_time = 0;  ///< planned; 0: unknown
  Scalar step = 0;      ///< of one World::advance(); 0: unknown
};

/// A shape in a recording; bodies with equal shapes share it.
struct RecordedShape {
  std::uint64_t hash = 0;              ///< of its contents; see docs/formats.md
  std::shared_ptr<const Shape> shape;  ///< the same numbers as in the run
};

struct RecordedBody {
  std::string name;
  BodyKind kind = BodyKind::Dynamic;
  std::size_t shape = 0;  ///< index into the list of shapes
  bool is_sensor = false;
  Scalar mass = 0;                    ///< Dynamic
  Vector3 p_BoBcm = Vector3::Zero();  ///< Dynamic: centre of mass; otherwise zero
};

/// The kind of a segment of a body's path. M is the frame at the body's centre of mass with the
/// axes of B: X_WB(t) = X_WM(t) * translation(-p_BoBcm).
enum class SegmentKind : std::uint32_t {
  Absent = 0,   ///< the body was removed or disabled
  Rest = 1,     ///< at rest or asleep
  Twist = 2,    ///< M has a constant twist
  Hermite = 3,  ///< M follows cubics of position and rotation vector: HermiteMotion
  Given = 4,    ///< the motion of a kinematic body, as given
  /// A motion of the user's own functions, which no file can store: cubics through its states at
  /// the ends of the segment. The only kind that is not exact.
  Approximate = 5,
};

std::string_view name_of(SegmentKind kind);

/// A segment of one body's path: from `interval.begin` on the body follows `motion`, until its next
/// segment starts, or up to the last committed time.
struct MotionSegment {
  SegmentKind kind = SegmentKind::Absent;
  TimeInterval interval;
  /// The parameters, as docs/formats.md lists them for each kind (rotations row by row):
  /// Rest: R_WB 9, p_WB 3. Twist: R_WM 9, p_WM 3, v_WM 3, w_WM 3, t0, all at t0.
  /// Hermite and Approximate: R_WC 9, then for both ends t, p_WM 3, v_WM 3, theta 3, theta_rate 3,
  /// where R_WM(t) = R_WC exp(theta(t)). Absent and Given: none.
  std::vector<Scalar> numbers;
  std::string given;                     ///< Given: JSON of the motion, as docs/formats.md
  std::shared_ptr<const Motion> motion;  ///< of B, the same bits as in the run; null if Absent
};

/// One World::advance(), with the World's data at its end. A recording is complete up to the end of
/// its last frame.
struct RecordedFrame {
  TimeInterval interval;  ///< the end is the committed time
  AdvanceStatus status = AdvanceStatus::NotRun;
  std::pair<BodyId, BodyId> offending_pair;  ///< as AdvanceReport
  Scalar kinetic_energy = 0;
  Vector3 momentum = Vector3::Zero();
  Vector3 angular_momentum = Vector3::Zero();  ///< about the world origin
  StepStatistics work;                         ///< `residual` is that of the contact solver
  IntegratorStatistics integrator;
  ToiStatistics toi;
};

enum class RunEventKind : std::uint32_t {
  FellAsleep = 0,    ///< a
  Woke = 1,          ///< a
  TooNear = 2,       ///< a and b started a step nearer than their target
  Crossed = 3,       ///< a and b, which no force can move apart
  SensorBegins = 4,  ///< a is the sensor, b the body
  SensorEnds = 5,
  Stalled = 6,    ///< an island found no motion and stood still; no bodies are named
  Undecided = 7,  ///< the frame did not reach its end: see its status; a and b if known
  Parted = 8,     ///< a and b, once too near, are far enough apart from here on
  Placed = 9,     ///< the caller put a elsewhere
};

std::string_view name_of(RunEventKind kind);

/// Something that happened, besides impacts.
struct RunEvent {
  RunEventKind kind = RunEventKind::FellAsleep;
  Scalar t = 0;
  BodyId a;
  BodyId b;
};

/// How a run ended.
struct RunEnd {
  AdvanceStatus status = AdvanceStatus::NotRun;  ///< of the last advance
  std::string error;  ///< message of the error that ended it; empty: none
};

/// What to record about pairs of bodies after every advance.
enum class PairDetail {
  None,      ///< nothing
  Gaps,      ///< proof, bounds of the gap, normal, pivot
  Contacts,  ///< and the contacts with their impulses
};

struct RecordingOptions {
  PairDetail pairs = PairDetail::Contacts;
  /// Seconds after which a frame is in the file, where readers see it and a kill cannot take it, at
  /// the latest when the next one is written; >= 0. Sooner if that costs at most a twentieth of the
  /// run's time; 0: always at once.
  Scalar longest_delay = 0.5;
};

/// Writes a run to a file as described in docs/formats.md: the committed motions of each body,
/// exactly and each once, and separately the events. RecordingReader can read the file at any time:
/// while it is being written, and after the process was killed, it contains whole frames, all but
/// those of RecordingOptions::longest_delay.
///
/// The contents depend only on the calls: the clock decides when they are written, not what. Not
/// for concurrent use.
class RecordingWriter {
 public:
  /// Replaces the file. The World is used only in write(); its bodies may change between calls.
  /// @throws FileError if the file cannot be created, and from every member if it cannot be
  /// written; InvalidArgument if an option is out of its range.
  RecordingWriter(const std::filesystem::path& file, const RunHeader& header,
                  const RecordingOptions& options = {});
  /// Without finish(): as if the process were killed now, but nothing written is lost.
  ~RecordingWriter();
  RecordingWriter(RecordingWriter&&) noexcept;
  RecordingWriter& operator=(RecordingWriter&&) noexcept;

  /// Writes what one advance of `world` reported.
  /// @throws InvalidArgument if a shape is not one of dyop's own.
  void write(const AdvanceReport& report, const World& world);
  /// For a run without its World: pairs are not recorded, energy and momenta are NaN.
  /// @param bodies By slot; the same in every call.
  void write(const AdvanceReport& report, std::span<const BodyDefinition> bodies);

  /// Writes how the run ended, and closes the file.
  void finish();
  /// The same for a run that was ended by an exception with this message.
  void fail(const std::string& error);

 private:
  struct Output;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A pair of RecordingReader::pairs() in short.
struct NearPair {
  BodyId a;
  BodyId b;
  Scalar gap_lower = 0;  ///< proven
  std::int64_t contacts = 0;
};

/// A recorded run, read from a file of docs/formats.md, even while another process writes it or
/// after that process was killed. Bodies, steps, frames and events are read when the file is
/// opened; segments and pairs on demand, a block at a time.
///
/// A body's id is its slot, the index into bodies(). Not for concurrent use.
class RecordingReader {
 public:
  /// @throws FileError if the file is missing, not a recording, of another version, or damaged.
  explicit RecordingReader(const std::filesystem::path& file);
  /// The path that was given.
  const std::filesystem::path& file() const;
  ~RecordingReader();
  RecordingReader(RecordingReader&&) noexcept;
  RecordingReader& operator=(RecordingReader&&) noexcept;

  /// Reads what was written since; returns true if there is anything new. Invalidates spans. Opens
  /// the file again: data written by another process is not seen while another reader of this
  /// process has the same file open.
  /// @throws FileError as the constructor.
  bool refresh();

  const RunHeader& header() const;
  /// Of the World, at the start; zero if the recording does not say.
  Vector3 gravity() const;
  std::span<const RecordedShape> shapes() const;
  std::span<const RecordedBody> bodies() const;

  /// The time from the start to the last commit; of length zero if nothing was committed yet.
  TimeInterval interval() const;
  /// How the run ended; none if it is still running or was killed.
  const std::optional<RunEnd>& end() const;

  /// The committed steps, in order, each starting where the previous one ended.
  std::span<const TimeInterval> steps() const;
  std::span<const RecordedFrame> frames() const;
  /// All impacts in order of time; X_WA and X_WB of `toi` are the poses at t_safe.
  std::span<const ImpactEvent> impacts() const;
  std::span<const RunEvent> events() const;
  /// Pairs at the end of a frame, as World::pairs(), without those whose bodies both rested in the
  /// previous frame too. Only the contact fields listed in docs/formats.md are set: points in
  /// single precision relative to the pivot.
  /// @throws InvalidArgument if there is no such frame.
  std::vector<PairRecord> pairs(std::size_t frame) const;
  /// The same pairs without the rest; faster.
  /// @throws InvalidArgument if there is no such frame.
  std::vector<NearPair> near_pairs(std::size_t frame) const;

  /// All impulses of the run, as AdvanceReport::velocity_changes; none if they were not recorded.
  /// The impulse of forces is stored only for bodies with a wrench of their own; for the others it
  /// is gravity times half of the interval, and zero here.
  std::vector<VelocityChange> velocity_changes() const;

  /// @throws InvalidArgument if there is no such body.
  std::size_t segment_count(BodyId body) const;
  /// @throws InvalidArgument if there is no such body or segment.
  MotionSegment segment(BodyId body, std::size_t index) const;
  /// The index of the segment that contains t; where two meet, the later one.
  /// @throws InvalidArgument if t is outside interval() or there is no such body.
  std::size_t segment_at(BodyId body, Scalar t) const;

  /// Pose X_WB on the committed motion, with the same bits as the run's own motion.
  /// @throws InvalidArgument as segment_at(), and if the body is absent at t.
  RigidPose pose(BodyId body, Scalar t) const;
  /// Pose and twist; where two segments meet, those of the later one.
  MotionState state(BodyId body, Scalar t) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dyop
