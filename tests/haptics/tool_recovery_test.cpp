// SPDX-License-Identifier: BSD-3-Clause

// What starts nearer than its target comes no nearer, however long a hand pulls.

#include <gtest/gtest.h>

#include <cmath>

#include "dyop/geometry/primitives.h"
#include "dyop/haptics/haptic_session.h"
#include "support/inputs/haptic_scenes.h"

namespace dyop {
namespace {

using testing::device_at;
using testing::haptic_options;
using testing::kMillisecond;

constexpr Scalar kRestOffset = 0.05;
constexpr Scalar kTolerance = 0.3 * kRestOffset;

struct Start {
  Scalar gap;
  Scalar recovery_speed;
  bool deforms;
  bool is_faceted;
};

class ToolRecovery : public ::testing::TestWithParam<Start> {
 protected:
  static constexpr Scalar kRadius = 2;

  static HapticScene scene() {
    HapticScene scene;
    std::shared_ptr<const Shape> ball = std::make_shared<Sphere>(kRadius);
    if (GetParam().is_faceted) ball = testing::shared_mesh(testing::icosphere(0, kRadius));
    scene.tool.push_back({ball, RigidPose()});
    scene.X_WT = RigidPose(Vector3(0.31, 0.17, height() + GetParam().gap));
    const testing::MeshArrays plate = testing::sheet(40, 8);
    scene.obstacles.push_back(GetParam().deforms
                                  ? testing::deforming_tissue(plate)
                                  : testing::rigid_tissue(testing::shared_mesh(plate)));
    return scene;
  }
  // Where it touches, not turned.
  static Scalar height() {
    if (!GetParam().is_faceted) return kRadius;
    Scalar lowest = 0;
    for (const Vector3& p : testing::icosphere(0, kRadius).vertices) {
      lowest = std::min(lowest, p.z());
    }
    return -lowest;
  }
  // A plane: the lowest point counts.
  static Scalar gap_at(const ToolPose& pose) {
    if (!GetParam().is_faceted) return pose.X_WT.translation().z() - kRadius;
    Scalar lowest = kInfinity;
    for (const Vector3& p : testing::icosphere(0, kRadius).vertices) {
      lowest = std::min(lowest, (pose.X_WT * p).z());
    }
    return lowest;
  }
};

TEST_P(ToolRecovery, NeverComesNearerThanPromised) {
  HapticOptions options = haptic_options();
  options.rest_offset = kRestOffset;
  options.recovery_speed = GetParam().recovery_speed;
  HapticSession session(scene(), options);
  const Scalar start = GetParam().gap;
  const Scalar promised =
      start < kTolerance / 4 ? start - 0.75 * std::min(kTolerance, start / 4) : kTolerance / 4;
  for (int k = 0; k < 6000; ++k) {
    const Scalar t = k * kMillisecond;
    // Dragged aside and down at 0.5 mm/s, with a tremor.
    const HapticTick& tick = session.update(
        device_at({0.31 + 0.5 * t, 0.17, height() + start - 0.5 * t + 0.002 * std::sin(60 * t)}),
        kMillisecond);
    ASSERT_NE(tick.status, HapticStatus::Overlapping) << k;
    for (const ToolWaypoint& waypoint : tick.path) {
      ASSERT_GT(gap_at(waypoint.tool), promised * (1 - 1e-6)) << k;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Starts, ToolRecovery,
    ::testing::Values(Start{0.003, 1e-3, false, false}, Start{0.003, 1e-3, true, false},
                      Start{0.003, 1e-3, false, true}, Start{0.003, 1e-3, true, true},
                      Start{0.003, 1e-5, false, false}, Start{0.003, 1e-5, true, true},
                      Start{kTolerance / 4, 1e-3, true, true}, Start{0.0005, 1e-4, true, true},
                      Start{kTolerance / 4 * (1 + 1e-9), 1e-3, false, false},
                      Start{0.0005, 50, true, false}));

}  // namespace
}  // namespace dyop
