// SPDX-License-Identifier: BSD-3-Clause

// Distance of points from a mesh of 81,920 triangles: near the surface and anywhere around it,
// against CGAL's AABB tree in plain doubles (no bounds), which has the nearest point only.
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>
#include <benchmark/benchmark.h>

#include <vector>

#include "dyop/distance/point_distance.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

// A ball with dents, so that no point is equally near to everything.
const TriangleMesh& mesh() {
  static const TriangleMesh dented = [] {
    testing::MeshArrays ball = testing::icosphere(6);
    for (Vector3& v : ball.vertices) v *= 1 + 0.1 * std::sin(7 * v.x()) * std::sin(9 * v.y());
    return ball.mesh();
  }();
  return dented;
}

// Within 1 % of the surface, or in a box of twice the size.
std::vector<Vector3> points(bool is_near) {
  std::mt19937_64 random(1);
  std::vector<Vector3> result;
  for (int k = 0; k < 1000; ++k) {
    const Vector3 p = testing::random_vector(2, random);
    const std::int32_t count = static_cast<std::int32_t>(mesh().vertices().size());
    const Vector3& v =
        mesh().vertices()[static_cast<std::size_t>(testing::random_index(count, random))];
    result.push_back(is_near ? Vector3(v + 0.005 * p) : p);
  }
  return result;
}

void dyop_points(benchmark::State& state) {
  const std::vector<Vector3> all = points(state.range(0) != 0);
  const PointDistanceOptions options{.is_signed = state.range(1) != 0};
  std::size_t k = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(point_distance(mesh(), RigidPose(), all[k], options));
    k = (k + 1) % all.size();
  }
}

void cgal_points(benchmark::State& state) {
  const std::vector<Vector3> all = points(state.range(0) != 0);
  Triangles triangles;
  const auto point = [](const Vector3& p) { return Kernel::Point_3(p.x(), p.y(), p.z()); };
  for (std::size_t k = 0; k < mesh().triangles().size(); ++k) {
    const Triangle t = mesh().triangle(static_cast<std::int32_t>(k));
    triangles.emplace_back(point(t[0]), point(t[1]), point(t[2]));
  }
  Tree tree(triangles.begin(), triangles.end());
  tree.build();
  tree.accelerate_distance_queries();
  std::size_t k = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(tree.closest_point_and_primitive(point(all[k])));
    k = (k + 1) % all.size();
  }
}

BENCHMARK(dyop_points)->ArgNames({"near", "signed"})->Args({1, 0})->Args({0, 0})->Args({1, 1});
BENCHMARK(cgal_points)->ArgNames({"near"})->Arg(1)->Arg(0);

}  // namespace
}  // namespace dyop
