// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/recorded_run.h"

namespace dyop {

std::string_view name_of(BodyKind kind) {
  switch (kind) {
    case BodyKind::Dynamic:
      return "dynamic";
    case BodyKind::Kinematic:
      return "kinematic";
    case BodyKind::Static:
      return "static";
  }
  return "dynamic";
}

std::string_view name_of(SegmentKind kind) {
  switch (kind) {
    case SegmentKind::Absent:
      return "absent";
    case SegmentKind::Rest:
      return "rest";
    case SegmentKind::Twist:
      return "twist";
    case SegmentKind::Hermite:
      return "hermite";
    case SegmentKind::Given:
      return "given";
    case SegmentKind::Approximate:
      return "approximate";
  }
  return "absent";
}

std::string_view name_of(RunEventKind kind) {
  switch (kind) {
    case RunEventKind::FellAsleep:
      return "fell_asleep";
    case RunEventKind::Woke:
      return "woke";
    case RunEventKind::TooNear:
      return "too_near";
    case RunEventKind::Crossed:
      return "crossed";
    case RunEventKind::SensorBegins:
      return "sensor_begins";
    case RunEventKind::SensorEnds:
      return "sensor_ends";
    case RunEventKind::Stalled:
      return "stalled";
    case RunEventKind::Undecided:
      return "undecided";
    case RunEventKind::Parted:
      return "parted";
    case RunEventKind::Placed:
      return "placed";
  }
  return "undecided";
}

}  // namespace dyop
