// SPDX-License-Identifier: BSD-3-Clause

// Building and refitting the hierarchy of a mesh, and what it takes in memory. `cpu` is the time of
// all threads together. Models are read where support/models.h finds them and left out otherwise.

#include <benchmark/benchmark.h>

#include <cmath>
#include <functional>
#include <string>

#include "dyop/io/mesh_file.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/models.h"

namespace dyop::testing {
namespace {

using testing::MeshArrays;

// Bends the mesh, as a soft body does: neighbours stay neighbours.
std::vector<Vector3> bent(const MeshArrays& mesh) {
  std::vector<Vector3> vertices = mesh.vertices;
  for (Vector3& p : vertices) p.z() += 0.2 * std::sin(3 * p.x());
  return vertices;
}

void add(const std::string& name, const MeshArrays& mesh) {
  const auto build = [mesh](benchmark::State& state) {
    std::size_t nodes = 0;
    for ([[maybe_unused]] auto _ : state) {
      nodes = MeshHierarchy(mesh.vertices, mesh.triangles).nodes().size();
    }
    const auto triangles = Scalar(mesh.triangles.size());
    state.counters["triangles"] = triangles;
    state.counters["bytes/triangle"] = Scalar(nodes * sizeof(MeshHierarchy::Node)) / triangles;
  };
  const auto refit = [mesh](benchmark::State& state) {
    const MeshHierarchy tree(mesh.vertices, mesh.triangles);
    const std::vector<Vector3> vertices = bent(mesh);
    for ([[maybe_unused]] auto _ : state) {
      benchmark::DoNotOptimize(tree.refitted(vertices, mesh.triangles));
    }
  };
  for (const auto& [what, run] :
       {std::pair<const char*, std::function<void(benchmark::State&)>>{"build", build},
        {"refit", refit}}) {
    benchmark::RegisterBenchmark((what + (" " + name)).c_str(), run)
        ->Unit(benchmark::kMillisecond)
        ->MeasureProcessCPUTime()
        ->UseRealTime();
  }
}

void add_all() {
  // 20 * 4^k triangles: 80 to 1,310,720.
  for (int k = 1; k <= 8; ++k) {
    const MeshArrays sphere = testing::icosphere(k);
    add("sphere " + std::to_string(sphere.triangles.size()), sphere);
  }
  for (const char* model : {"bunny.obj", "dragon_vrip_res4.ply.gz", "dragon_vrip_res3.ply.gz",
                            "dragon_vrip_res2.ply.gz", "dragon_vrip.ply.gz"}) {
    const auto file = find_model(model);
    if (!file) continue;
    const TriangleMesh mesh = load_unit_model(*file);
    add(model, {{mesh.vertices().begin(), mesh.vertices().end()},
                {mesh.triangles().begin(), mesh.triangles().end()}});
  }
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  dyop::testing::add_all();
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
