// SPDX-License-Identifier: BSD-3-Clause

// Time of impact of two small shapes on any motions with any options: the promises of ToiResult,
// against the distance by an oracle that shares no code with the library, at sampled times.

#include <algorithm>
#include <array>
#include <cmath>

#include "core/tolerance.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/toi/time_of_impact.h"
#include "fuzz/fuzz_motion.h"
#include "support/oracles/toi_promises.h"
#include "support/same_bits.h"

namespace dyop::fuzz {
namespace {

struct Query {
  std::shared_ptr<const Shape> a;
  std::shared_ptr<const Motion> X_WA;
  std::shared_ptr<const Shape> b;
  std::shared_ptr<const Motion> X_WB;
  TimeInterval interval;
  ToiOptions options;

  ToiQuery view() const { return {a.get(), X_WA.get(), b.get(), X_WB.get(), interval, options}; }
};

std::vector<Vector3> read_points(Input& in, Scalar limit) {
  std::vector<Vector3> points(std::size_t(1 + in.index(8)));
  for (Vector3& p : points) p = in.vector_within(limit);
  return points;
}

std::shared_ptr<const Shape> read_shape(Input& in, Scalar limit) {
  switch (in.index(7)) {
    case 0:
      return std::make_shared<Sphere>(std::abs(in.number_within(limit)));
    case 1:
      return std::make_shared<Box>(Vector3(in.vector_within(limit).cwiseAbs()));
    case 2: {
      const Scalar radius = std::abs(in.number_within(limit));
      return std::make_shared<Capsule>(radius, std::abs(in.number_within(limit)));
    }
    case 3:
      return std::make_shared<ConvexHull>(read_points(in, limit));
    default: {
      std::vector<Vector3> points = read_points(in, limit);
      std::vector<TriangleIndices> triangles(std::size_t(1 + in.index(10)));
      for (TriangleIndices& triangle : triangles) {
        for (std::int32_t& vertex : triangle) vertex = in.index(int(points.size()));
      }
      return std::make_shared<TriangleMesh>(std::move(points), std::move(triangles));
    }
  }
}

Query read_query(Input& in) {
  constexpr std::array<Scalar, 3> kLengths{16, 1, 1e6};
  constexpr std::array<Scalar, 3> kTurns{8, 1, 300};
  const MotionLimits limits{kLengths[std::size_t(in.index(3))], kTurns[std::size_t(in.index(3))]};
  Query query;
  query.options.distance_tolerance = limits.length * std::ldexp(1.0, -4 - in.index(40));
  query.options.target_distance = in.flag() ? std::abs(in.number_within(limits.length)) : 0;
  query.options.max_node_pairs = 1 + in.index(16);
  query.options.max_node_pairs += 4 * in.index(256);
  const int flags = in.byte();
  query.options.with_contacts = (flags & 1) != 0;
  query.options.solid_a = (flags & 2) != 0;
  query.options.solid_b = (flags & 4) != 0;
  query.interval = in.flag() ? TimeInterval{0, 1} : read_interval(in, 16);
  query.a = read_shape(in, limits.length);
  query.b = read_shape(in, limits.length);
  query.X_WA = read_motion(in, query.interval, limits);
  query.X_WB = read_motion(in, query.interval, limits);
  return query;
}

void require_same(const ToiResult& x, const ToiResult& y, const std::string& how) {
  require(testing::has_same_bits(x, y), how);
}

void require_kept(const char* broken) {
  require(broken == nullptr, broken == nullptr ? "" : broken);
}

// Under the same budget: in a workspace, and interrupted halfway and resumed.
void check_other_ways(const Query& query, const ToiResult& result) {
  ToiWorkspace workspace;
  ToiOptions half = query.options;
  half.max_node_pairs = std::max<std::int64_t>(1, query.options.max_node_pairs / 2);
  ToiResult other =
      time_of_impact(*query.a, *query.X_WA, *query.b, *query.X_WB, query.interval, half, workspace);
  const std::int64_t rest = query.options.max_node_pairs - other.statistics.node_pairs;
  if (workspace.can_resume() && rest > 0) {
    half.max_node_pairs = rest;
    other = resume_time_of_impact(*query.a, *query.X_WA, *query.b, *query.X_WB, query.interval,
                                  half, workspace);
  }
  require_same(result, other, "a resumed query ends with the same bits");
  const ToiResult again = time_of_impact(*query.a, *query.X_WA, *query.b, *query.X_WB,
                                         query.interval, query.options, workspace);
  require_same(result, again, "a workspace changes no bit");
}

}  // namespace
}  // namespace dyop::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace dyop;
  fuzz::Input in(data, size);
  try {
    const fuzz::Query query = fuzz::read_query(in);
    const ToiResult result =
        time_of_impact(*query.a, *query.X_WA, *query.b, *query.X_WB, query.interval, query.options);
    fuzz::require_kept(testing::broken_form(query.view(), result));
    fuzz::check_other_ways(query, result);
    fuzz::require_kept(testing::ToiJudge(query.view()).broken_distance(result, 12));
  } catch (const InvalidArgument& error) {
    fuzz::require_readable(error.what());
  }
  return 0;
}
