// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "dyop/paper/distance_algorithm.h"
#include "planar_pairs.h"

namespace dyop::testing {
namespace {

TEST(LibccdDistance, VertexAboveAFaceAtAnyScale) {
  for (const Scalar scale : {1e-6, 1.0, 1e6}) {  // literal: sizes under test
    const Triangle a{scale * Vector3(-1, -1, 0), scale * Vector3(1, -1, 0),
                     scale * Vector3(0, 2, 0)};
    const Triangle b{scale * Vector3(0, 0, 0.5), scale * Vector3(1, 0, 4),
                     scale * Vector3(-1, 0, 4)};
    EXPECT_NEAR(libccd_distance(a, b), scale / 2, 1e-12 * scale);  // literal: rounding
  }
}

TEST(LibccdDistance, InThePlaneItIsTheSameWithoutHeight) {
  std::mt19937_64 random(41);
  for (int k = 0; k < 1000; ++k) {
    const PlanarPair pair = random_planar_pair(PlanarFamily::Apart, 1, Vector2::Zero(), random);
    EXPECT_EQ(libccd_distance(pair.a, pair.b), libccd_distance(in_space(pair.a), in_space(pair.b)));
  }
}

TEST(LibccdDistance, APointMeetsItself) {
  const Triangle point{Vector3(1, 2, 3), Vector3(1, 2, 3), Vector3(1, 2, 3)};
  EXPECT_EQ(libccd_distance(point, point), 0);
}

}  // namespace
}  // namespace dyop::testing
