// SPDX-License-Identifier: BSD-3-Clause

// 6. Many queries at once, on all cores. Results have the same bits for any number of threads.
#include <dyop/dyop.h>

#include <cmath>
#include <cstdio>
#include <vector>

int main() {
  // A ball is shot at a turning box in 1000 directions. Shapes and motions are shared, not copied.
  const dyop::Box box({1, 0.5, 0.25});
  const dyop::Sphere ball(0.1);
  const dyop::ConstantTwistMotion turning(dyop::RigidPose(), {{0, 0, 0}, {0, 0, 3}});
  std::vector<dyop::ConstantTwistMotion> shots;
  for (int i = 0; i < 1000; ++i) {
    const dyop::RigidPose start({-4, 0.002 * i - 1, 0});
    shots.emplace_back(start, dyop::Twist{{2, 0, 0}, {0, 0, 0}});
  }
  std::vector<dyop::ToiQuery> queries;
  for (const dyop::ConstantTwistMotion& shot : shots) {
    queries.push_back({&box, &turning, &ball, &shot, {0, 4}, {}});
  }
  std::vector<dyop::ToiResult> results(queries.size());
  dyop::BatchOptions options;
  options.thread_count = 0;  // all cores; a stop token and a progress callback are also possible
  dyop::time_of_impact_batch(queries, results, options);
  int hits = 0;
  double first = 4;
  for (const dyop::ToiResult& result : results) {
    if (result.status != dyop::ToiStatus::Impact) continue;
    ++hits;
    first = std::fmin(first, result.t_safe);
  }
  std::printf("%d of %zu shots hit, the first at t = %.4f\n", hits, results.size(), first);

  // Points against one shape: a slice of its signed distance, in steps of 0.5 along x.
  std::vector<dyop::Vector3> points;
  for (int i = 0; i < 5; ++i) points.push_back({0.5 * i, 0, 0});
  std::vector<dyop::PointDistance> distances(points.size());
  dyop::PointDistanceOptions is_signed;
  is_signed.is_signed = true;
  dyop::point_distance_batch(box, dyop::RigidPose(), points, distances, is_signed);
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::printf("x = %.1f: %+.4f\n", points[i].x(), distances[i].upper);
  }
}
// Prints:
// 812 of 1000 shots hit, the first at t = 1.6239
// x = 0.0: -0.2500
// x = 0.5: -0.2500
// x = 1.0: +0.0000
// x = 1.5: +0.5000
// x = 2.0: +1.0000
