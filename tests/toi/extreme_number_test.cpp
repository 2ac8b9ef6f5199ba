// SPDX-License-Identifier: BSD-3-Clause

// Extreme numbers: distances and times whose squares or roundings matter. Every query ends within
// its budget, with a status that is true.

#include <gtest/gtest.h>

#include "dyop/geometry/primitives.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/bodies.h"
#include "support/inputs/mesh_generators.h"

namespace dyop {
namespace {

using testing::at;
using testing::box_mesh;
using testing::moving;

// The square of the distance overflows; still the bodies collide halfway.
TEST(ExtremeInput, OfDistancesWhoseSquaresOverflowIsNoMiss) {
  for (const Scalar distance : {1e150, 1e153, 1e155, 1e200}) {
    for (const Scalar rate : {0.0, 1e-54, 1e-50}) {
      const ConstantTwistMotion X_WB =
          moving(at(distance, 0, 0), Vector3(-distance / 1e55, 0, 0), Vector3(0, 0, rate));
      const TimeInterval interval{0, 2e55};
      const ToiOptions options{.distance_tolerance = 1e-6};
      EXPECT_EQ(time_of_impact(Sphere(1), RestMotion(), Sphere(1), X_WB, interval, options).status,
                ToiStatus::NumericalLimit)
          << distance << ' ' << rate;
      const TriangleMesh cube = box_mesh(Vector3(1, 1, 1)).mesh();
      EXPECT_EQ(time_of_impact(cube, RestMotion(), cube, X_WB, interval, options).status,
                ToiStatus::NumericalLimit)
          << distance << ' ' << rate;
    }
  }
}

// Poses are computed from the time since t0: what is lost there is part of the allowance, and the
// status tells when that exceeds the tolerance.
TEST(ExtremeInput, OfMotionsSinceLongAgoCountsTheirRounding) {
  const Sphere a(1), b(1);
  const TimeInterval interval{0, 1};
  for (const Scalar t0 : {0.0, -1e6, -1e15}) {
    // In contact at time 0.5, up to the rounding of -t0.
    const ConstantTwistMotion X_WB(at(3 + 2 * t0, 0, 0), Twist{Vector3(-2, 0, 0), Vector3::Zero()},
                                   -t0);
    const ToiOptions options{.distance_tolerance = 1e-6};
    const ToiResult result = time_of_impact(a, RestMotion(), b, X_WB, interval, options);
    EXPECT_GE(result.rounding_allowance, 1e-16 * 2 * -t0);
    if (t0 > -1e9) {
      EXPECT_EQ(result.status, ToiStatus::Impact);
      EXPECT_NEAR(result.t_safe, 0.5, 1e-6 + 2 * result.rounding_allowance);
    } else {
      EXPECT_NE(result.status, ToiStatus::Impact);
      EXPECT_NE(result.status, ToiStatus::Separated);
    }
  }
}

}  // namespace
}  // namespace dyop
