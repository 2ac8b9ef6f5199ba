// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "dyop/core/time_interval.h"
#include "dyop/dynamics/advance_report.h"
#include "dyop/dynamics/rigid_body.h"

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

}  // namespace dyop
