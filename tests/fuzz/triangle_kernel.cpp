// SPDX-License-Identifier: BSD-3-Clause

// Distance of two triangles with any finite coordinates up to kLargestCoordinate: bounds against
// the exact oracle and against sampled points, and the same from either side.

#include <algorithm>

#include "core/tolerance.h"
#include "dyop/distance/triangle_distance.h"
#include "dyop/paper/lin_canny.h"
#include "fuzz/fuzz_input.h"
#include "support/oracles/triangle_distance_check.h"

namespace dyop::fuzz {
namespace {

using Wide = Eigen::Matrix<long double, 3, 1>;

Triangle read_triangle(Input& in, Scalar limit) {
  return {in.vector_within(limit), in.vector_within(limit), in.vector_within(limit)};
}

// The point with barycentric coordinates i, j, 8 - i - j eighths.
Wide grid_point(const Triangle& t, int i, int j) {
  return (t[0].cast<long double>() * (8 - i - j) + t[1].cast<long double>() * i +
          t[2].cast<long double>() * j) /
         8;
}

// No two points of the triangles are nearer than `lower`, up to the rounding of this sampling.
void require_below_samples(const Triangle& a, const Triangle& b, Scalar lower) {
  long double nearest = HUGE_VALL;
  long double size = 0;
  for (int i = 0; i <= 8; i += 2) {
    for (int j = 0; j <= 8 - i; j += 2) {
      const Wide p = grid_point(a, i, j);
      for (int k = 0; k <= 8; k += 2) {
        for (int l = 0; l <= 8 - k; l += 2) {
          const Wide q = grid_point(b, k, l);
          nearest = std::min(nearest, (p - q).norm());
          size = std::max({size, p.norm(), q.norm()});
        }
      }
    }
  }
  require(testing::wide(lower) <= nearest + 0x1p-60L * size, "lower is below sampled distances");
}

void check_answer(const Triangle& a, const Triangle& b, const TriangleDistance& d,
                  const testing::OracleDistance& truth) {
  require(d.lower <= d.upper, "lower <= upper, and neither is NaN");
  const char* const broken = testing::broken_bound(a, b, d, truth);
  require(broken == nullptr, broken == nullptr ? "" : broken);
  require_below_samples(a, b, d.lower);
}

void check(const Triangle& a, const Triangle& b) {
  const testing::OracleDistance truth = testing::oracle_triangle_distance(a, b);
  const TriangleDistance d = triangle_distance(a, b);
  check_answer(a, b, d, truth);
  const TriangleDistance swapped = triangle_distance(b, a);
  check_answer(b, a, swapped, truth);
  require(swapped.lower <= d.upper && d.lower <= swapped.upper, "both orders bracket one distance");
  check_answer(a, b, warm_triangle_distance(a, b, d.feature_a, d.feature_b), truth);
  check_answer(a, b, warm_triangle_distance(a, b, d.feature_b, d.feature_a), truth);
  const TriangleDistance walked = lin_canny_distance(a, b);
  require(walked.lower <= walked.upper && testing::wide(walked.lower) <= truth.upper() &&
              testing::wide(walked.upper) >= truth.lower(),
          "the walk's bounds bracket the distance");
}

}  // namespace
}  // namespace dyop::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dyop;
  fuzz::Input in(data, size);
  const Scalar limit = in.flag() ? kLargestCoordinate : 1024;
  const Triangle a = fuzz::read_triangle(in, limit);
  const Triangle b = fuzz::read_triangle(in, limit);
  fuzz::check(a, b);
  return 0;
}
