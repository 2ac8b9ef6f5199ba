// SPDX-License-Identifier: BSD-3-Clause

// Time of contact generation. Run: contact_generation_benchmark
// The bunny needs a model file, see tests/support/models.h; without it these rows are left out.
#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "dyop/contact/contact_generator.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/primitives.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/models.h"
#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

using testing::random_number;

// A pair of shapes and poses of the second one, the first at rest.
struct Scene {
  std::shared_ptr<const Shape> a;
  std::shared_ptr<const Shape> b;
  std::vector<RigidPose> poses;
  Scalar reach;
};

constexpr int kPoses = 256;

Scene cube_on_triangles() {
  Scene scene{std::make_shared<TriangleMesh>(testing::plate_grid(8, 8, 64, 64).mesh()),
              std::make_shared<Box>(Vector3(0.5, 0.5, 0.5)),
              {},
              0.01};
  std::mt19937_64 random(1);
  for (int k = 0; k < kPoses; ++k) {
    scene.poses.emplace_back(
        Quaternion(Eigen::AngleAxisd(random_number(0, 6, random), Vector3::UnitZ())),
        Vector3(random_number(-3, 3, random), random_number(-3, 3, random), 0.502));
  }
  return scene;
}

Scene box_on_box() {
  const auto box = std::make_shared<Box>(Vector3(0.5, 0.5, 0.5));
  Scene scene{box, box, {}, 0.01};
  std::mt19937_64 random(2);
  for (int k = 0; k < kPoses; ++k) {
    scene.poses.emplace_back(
        Quaternion(Eigen::AngleAxisd(random_number(0, 6, random), Vector3::UnitZ())),
        Vector3(random_number(-0.3, 0.3, random), random_number(-0.3, 0.3, random), 1.002));
  }
  return scene;
}

// B comes down from a random side until it is `gap` away.
void add_near_poses(Scene& scene, Scalar gap, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  while (scene.poses.size() < kPoses) {
    const Quaternion q = testing::random_rotation(random);
    const Vector3 from = testing::random_direction(random);
    Scalar far = 4;
    for (int k = 0; k < 60; ++k) {
      const DistanceResult d = distance(*scene.a, RigidPose(), *scene.b, RigidPose(q, far * from));
      if (d.lower <= gap * 1.01) break;
      far -= (d.lower - gap) * 0.99;
    }
    scene.poses.emplace_back(q, far * from);
  }
}

Scene bunny_on_bunny() {
  const auto file = testing::find_model("bunny.obj");
  if (!file) return {};
  const auto bunny = std::make_shared<TriangleMesh>(testing::load_unit_model(*file));
  Scene scene{bunny, bunny, {}, 2e-3};
  add_near_poses(scene, 1e-3, 3);
  return scene;
}

Scene tool_on_bunny() {
  const auto file = testing::find_model("bunny.obj");
  if (!file) return {};
  Scene scene{std::make_shared<TriangleMesh>(testing::load_unit_model(*file)),
              std::make_shared<Capsule>(0.02, 0.2),
              {},
              2e-3};
  add_near_poses(scene, 1e-3, 4);
  return scene;
}

void generate(benchmark::State& state, const Scene& scene) {
  ContactWorkspace workspace;
  std::vector<ContactPoint> contacts;
  std::size_t next = 0;
  std::size_t found = 0;
  std::size_t calls = 0;
  for (auto _ : state) {
    generate_contacts(*scene.a, RigidPose(), *scene.b, scene.poses[next], scene.reach, {},
                      workspace, contacts);
    next = (next + 1) % scene.poses.size();
    found += contacts.size();
    ++calls;
  }
  state.counters["contacts"] = double(found) / double(calls);
}

// The same pose over and over: what a pair at rest costs.
void carry(benchmark::State& state, const Scene& scene) {
  ContactWorkspace workspace;
  ContactCache cache;
  ContactCacheOptions options;
  options.max_drift = scene.reach / 10;
  for (auto _ : state) {
    cache.refresh(*scene.a, RigidPose(), *scene.b, scene.poses[0], scene.reach, options, workspace);
    benchmark::DoNotOptimize(cache.contacts().data());
  }
}

// The features of a new mesh, and its hierarchy beside them.
void build(benchmark::State& state, bool features) {
  const auto file = testing::find_model("bunny.obj");
  if (!file) return state.SkipWithError("no bunny.obj");
  const TriangleMesh bunny = testing::load_unit_model(*file);
  for (auto _ : state) {
    if (features) {
      const MeshTopology topology(bunny.vertices().size(), bunny.triangles());
      const ContactFeatures found(bunny.vertices(), bunny.triangles(), topology, bunny.hierarchy());
      benchmark::DoNotOptimize(found.owned_by(0));
    } else {
      const MeshHierarchy hierarchy(bunny.vertices(), bunny.triangles());
      benchmark::DoNotOptimize(hierarchy.nodes().data());
    }
  }
}

const bool kIsRegistered = [] {
  const auto add = [](const std::string& name, const Scene& scene) {
    if (!scene.a) return;
    benchmark::RegisterBenchmark((name + "/generate").c_str(), [scene](benchmark::State& state) {
      generate(state, scene);
    })->Unit(benchmark::kMicrosecond);
    benchmark::RegisterBenchmark((name + "/carry").c_str(), [scene](benchmark::State& state) {
      carry(state, scene);
    })->Unit(benchmark::kMicrosecond);
  };
  add("cube_on_8192_triangles", cube_on_triangles());
  add("box_on_box", box_on_box());
  add("tool_on_bunny", tool_on_bunny());
  add("bunny_on_bunny", bunny_on_bunny());
  benchmark::RegisterBenchmark("bunny/hierarchy", [](benchmark::State& state) {
    build(state, false);
  })->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark("bunny/topology_and_features", [](benchmark::State& state) {
    build(state, true);
  })->Unit(benchmark::kMillisecond);
  return true;
}();

}  // namespace
}  // namespace dyop
