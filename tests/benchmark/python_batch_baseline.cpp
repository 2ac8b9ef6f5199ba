// SPDX-License-Identifier: BSD-3-Clause

// The C++ side of python_batch.py. With arguments DIRECTORY THREADS: answers the batch in the files
// there and prints hits, the sum of the bits of t_safe, wall and processor seconds. Without:
// microseconds of one distance() and one time_of_impact() of two spheres.

#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include "dyop/distance/distance.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"

namespace {

using namespace dyop;
using Clock = std::chrono::steady_clock;

double wall_seconds() {
  return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

double cpu_seconds() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

template <typename Row>
std::vector<Row> read_rows(const std::string& file) {
  std::ifstream in(file, std::ios::binary | std::ios::ate);
  std::vector<Row> rows(std::size_t(in.tellg()) / sizeof(Row));
  in.seekg(0);
  in.read(reinterpret_cast<char*>(rows.data()), std::streamsize(rows.size() * sizeof(Row)));
  return rows;
}

void answer_batch(const std::string& directory, int threads) {
  const TriangleMesh mesh(read_rows<Vector3>(directory + "/vertices"),
                          read_rows<TriangleIndices>(directory + "/triangles"));
  const auto numbers = read_rows<std::array<double, 13>>(directory + "/numbers");
  const RestMotion rest;
  const double wall = wall_seconds();
  const double cpu = cpu_seconds();
  std::vector<ConstantTwistMotion> motions;
  for (const auto& n : numbers) {
    motions.emplace_back(RigidPose(Quaternion(n[0], n[1], n[2], n[3]), Vector3(n[4], n[5], n[6])),
                         Twist{{n[7], n[8], n[9]}, {n[10], n[11], n[12]}});
  }
  std::vector<ToiQuery> queries;
  for (const auto& motion : motions) queries.push_back({&mesh, &rest, &mesh, &motion, {0, 3}, {}});
  std::vector<ToiResult> results(queries.size());
  BatchOptions options;
  options.thread_count = threads;
  time_of_impact_batch(queries, results, options);
  const double wall_spent = wall_seconds() - wall;
  const double cpu_spent = cpu_seconds() - cpu;
  int hits = 0;
  std::uint64_t bits = 0;  // of all t_safe, in any order
  for (const ToiResult& result : results) {
    hits += result.status == ToiStatus::Impact;
    bits += std::bit_cast<std::uint64_t>(result.t_safe);
  }
  std::printf("%d %llu %.6f %.6f\n", hits, static_cast<unsigned long long>(bits), wall_spent,
              cpu_spent);
}

template <typename Ask>
double microseconds_of(const Ask& ask) {
  constexpr int kCount = 20'000;
  double best = 1e9;
  for (int round = 0; round < 7; ++round) {
    const double begin = wall_seconds();
    for (int i = 0; i < kCount; ++i) ask();
    best = std::min(best, (wall_seconds() - begin) / kCount * 1e6);
  }
  return best;
}

void answer_singles() {
  const Sphere a(1);
  const Sphere b(0.5);
  const RigidPose here;
  const RigidPose there(Vector3(3, 0, 0));
  const RestMotion rest;
  const ConstantTwistMotion flight(there, {{-1, 0, 0}, {0, 0, 0}});
  volatile double sink = 0;
  std::printf("%.3f %.3f\n",
              microseconds_of([&] { sink = sink + distance(a, here, b, there).upper; }),
              microseconds_of([&] {
                sink = sink + time_of_impact(a, rest, b, flight, {0, 1}).t_safe;
              }));
}

}  // namespace

int main(int argc, char** argv) {
  argc > 2 ? answer_batch(argv[1], std::stoi(argv[2])) : answer_singles();
}
