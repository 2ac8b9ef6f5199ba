// SPDX-License-Identifier: BSD-3-Clause

// A tool near an organ, as at the 1 kHz of a haptic device: a torus of 800 triangles moves on a
// curve along a lumpy sphere of 5,120, turning, at a gap of about a hundredth of the organ's
// radius. Every step of a millisecond is a cubic in position and rotation vector, asked for its
// impact in the memory of the steps before, and for the distance at its start from the pieces that
// were nearest at the last one:
//   tool_steps_benchmark [STEPS]
// Prints the processor time of single calls in microseconds.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "dyop/distance/distance.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "mesh_pair.h"
#include "support/inputs/mesh_generators.h"

namespace dyop::testing {
namespace {

TriangleMesh lumpy_sphere() {
  auto arrays = testing::icosphere(4);
  for (Vector3& p : arrays.vertices) {
    p *= 1 + 0.005 * std::sin(7 * p.x()) * std::sin(6 * p.y()) * std::sin(5 * p.z());
  }
  return arrays.mesh();
}

// Once around the organ in six units of time, up and down beside its equator, turning at 6 radians
// a unit of time. The tool's axis of symmetry stays about tangential.
MotionState state_at(Scalar t) {
  const Scalar step = 1e-4;  // literal: of differences in a smooth path
  const auto place = [](Scalar s) {
    const Scalar height = 0.3 * std::sin(1.7 * s);
    const Vector3 direction = Vector3(std::cos(s), std::sin(s), height).normalized();
    return Vector3((1.15 + 0.008 * std::sin(5 * s)) * direction);
  };
  const Vector3 w(0, 6, 1);
  return {RigidPose(rotation_from_vector(w * t), place(t)),
          {(place(t + step) - place(t - step)) / (2 * step), w}};
}

void print_row(const char* name, const std::vector<Scalar>& times) {
  std::printf("%-28s", name);
  for (const Scalar part : {0.5, 0.99, 0.999, 1.0}) std::printf(" %8.2f", quantile(times, part));
  std::printf(" %8.2f\n", mean(times));
}

int run(int steps) {
  const TriangleMesh organ = lumpy_sphere();
  const TriangleMesh tool = testing::torus(0.1, 0.035, 20, 20).mesh();
  const RestMotion rest;
  ToiOptions options;
  options.distance_tolerance = 1e-6;  // literal: of the organ's radius, which is one
  ToiWorkspace workspace;
  DistanceCache cache;
  std::vector<Scalar> impact_times, distance_times;
  int hits = 0, undecided = 0;
  Scalar least_gap = kInfinity, largest_gap = 0;
  for (int k = 0; k < steps; ++k) {
    const TimeInterval interval{k * 1e-3, (k + 1) * 1e-3};  // literal: a millisecond
    const HermiteMotion path(interval, state_at(interval.begin), state_at(interval.end));
    ToiResult result;
    impact_times.push_back(microseconds(
        [&] { result = time_of_impact(organ, rest, tool, path, interval, options, workspace); }));
    hits += result.status == ToiStatus::Impact;
    undecided += result.status != ToiStatus::Impact && result.status != ToiStatus::Separated &&
                 result.status != ToiStatus::InitiallyWithinTarget;
    DistanceResult gap;
    distance_times.push_back(microseconds([&] {
      gap = distance(organ, RigidPose(), tool, path.pose(interval.begin), DistanceOptions{}, cache);
    }));
    least_gap = std::min(least_gap, gap.lower);
    largest_gap = std::max(largest_gap, gap.upper);
  }
  std::printf("%d steps, %d with an impact, %d undecided, gaps %.4f to %.4f\n", steps, hits,
              undecided, least_gap, largest_gap);
  std::printf("%-28s %8s %8s %8s %8s %8s\n", "us", "median", "99 %", "99.9 %", "worst", "mean");
  print_row("time of impact of a step", impact_times);
  print_row("distance, from the last", distance_times);
  return 0;
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  const int steps = argc > 1 ? std::atoi(argv[1]) : 6000;
  if (steps > 0) return dyop::testing::run(steps);
  std::fprintf(stderr, "usage: tool_steps_benchmark [STEPS]\n");
  return 2;
}
