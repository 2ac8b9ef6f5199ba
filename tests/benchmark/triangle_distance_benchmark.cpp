// SPDX-License-Identifier: BSD-3-Clause

// Distance of two triangles: triangle_distance() and triangle_distances() on every instruction set
// that the processor has, against FCL's triangle routine (the method of PQP), libccd's GJK as FCL
// calls it, CGAL's squared distance (its kernel of inexact constructions) and Bullet's GJK (single
// precision, as Debian builds it). Each iteration passes over 1e5 distinct pairs of one family, so
// that branch predictors cannot learn them; `pair` is the time of one, `wrong` the share of pairs
// whose result is off by more than kWrong of the pair's size.
//
// Then nearest_triangle() for blocks of eight triangles; `pair` is the time of one of the eight.

#include <BulletCollision/CollisionShapes/btTriangleShape.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>
#include <BulletCollision/NarrowPhaseCollision/btPointCollector.h>
#include <BulletCollision/NarrowPhaseCollision/btVoronoiSimplexSolver.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/squared_distance_3.h>
#include <benchmark/benchmark.h>
#include <fcl/narrowphase/detail/convexity_based_algorithm/gjk_libccd.h>
#include <fcl/narrowphase/detail/primitive_shape_algorithm/triangle_distance.h>

#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/tolerance.h"
#include "distance/triangle_wide/triangle_batch.h"
#include "dyop/distance/triangle_distance.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/runnable_sets.h"

namespace dyop::testing {
namespace {

constexpr int kPairCount = 100000;
constexpr Scalar kWrong = 1e-9;         // literal: far above every kernel's rounding, far below use
constexpr int kGjkIterations = 1000;    // FCL's own default
constexpr Scalar kGjkTolerance = 1e-6;  // literal: FCL's own default

constexpr Scalar kTiny = 1e-4;  // literal: the size at which FCL is known to fail
constexpr Scalar kHuge = 1e4;

using Pairs = std::vector<TrianglePair>;

Pairs pairs_of(TriangleFamily family, Scalar scale) {
  std::mt19937_64 random(42);
  Pairs pairs(kPairCount);
  for (TrianglePair& pair : pairs) {
    pair = random_triangle_pair(family, random);
    for (Triangle* triangle : {&pair.a, &pair.b}) {
      for (Vector3& p : *triangle) p *= scale;
    }
  }
  return pairs;
}

// Triangles of a bent sheet that share a vertex or an edge, at random.
Pairs mesh_neighbours() {
  constexpr int kCells = 64;
  std::mt19937_64 random(42);
  const testing::MeshArrays sheet = testing::plate_grid(2, 2, kCells, kCells);
  std::vector<Vector3> vertices = sheet.vertices;
  for (Vector3& p : vertices) {
    p += Vector3(0, 0, std::sin(3 * p.x()) * std::cos(2 * p.y())) + random_vector(0.005, random);
  }
  std::vector<std::vector<std::size_t>> at_vertex(vertices.size());
  for (std::size_t t = 0; t < sheet.triangles.size(); ++t) {
    for (const std::int32_t v : sheet.triangles[t]) at_vertex[std::size_t(v)].push_back(t);
  }
  const auto corners = [&](std::size_t t) {
    const TriangleIndices& v = sheet.triangles[t];
    return Triangle{vertices[std::size_t(v[0])], vertices[std::size_t(v[1])],
                    vertices[std::size_t(v[2])]};
  };
  Pairs pairs;
  while (pairs.size() < kPairCount) {
    const auto t = std::size_t(random_index(int(sheet.triangles.size()), random));
    const auto v = std::size_t(sheet.triangles[t][std::size_t(random_index(3, random))]);
    const std::size_t other =
        at_vertex[v][std::size_t(random_index(int(at_vertex[v].size()), random))];
    if (other != t) pairs.push_back({corners(t), corners(other)});
  }
  return pairs;
}

Scalar dyop_distance(const TrianglePair& pair) {
  return triangle_distance(pair.a, pair.b).upper;
}

Scalar fcl_distance(const TrianglePair& pair) {
  Vector3 p, q;
  return fcl::detail::TriangleDistance<Scalar>::triDistance(pair.a.data(), pair.b.data(), p, q);
}

// Objects are created and freed as FCL does for every triangle pair.
Scalar libccd_distance(const TrianglePair& pair) {
  namespace gjk = fcl::detail;
  void* a = gjk::triCreateGJKObject(pair.a[0], pair.a[1], pair.a[2]);
  void* b = gjk::triCreateGJKObject(pair.b[0], pair.b[1], pair.b[2]);
  Scalar distance = 0;
  Vector3 p, q;
  const bool is_apart =
      gjk::GJKDistance<Scalar>(a, gjk::triGetSupportFunction(), b, gjk::triGetSupportFunction(),
                               kGjkIterations, kGjkTolerance, &distance, &p, &q);
  gjk::triDeleteGJKObject(a);
  gjk::triDeleteGJKObject(b);
  return is_apart ? distance : 0;
}

Scalar cgal_distance(const TrianglePair& pair) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  const auto point = [](const Vector3& p) { return Kernel::Point_3(p.x(), p.y(), p.z()); };
  const auto triangle = [&](const Triangle& t) {
    return Kernel::Triangle_3(point(t[0]), point(t[1]), point(t[2]));
  };
  return std::sqrt(CGAL::squared_distance(triangle(pair.a), triangle(pair.b)));
}

// Zero where it finds no distance: it is given no solver for penetrations.
Scalar bullet_distance(const TrianglePair& pair) {
  const auto point = [](const Vector3& p) {
    return btVector3(btScalar(p.x()), btScalar(p.y()), btScalar(p.z()));
  };
  btTriangleShape a(point(pair.a[0]), point(pair.a[1]), point(pair.a[2]));
  btTriangleShape b(point(pair.b[0]), point(pair.b[1]), point(pair.b[2]));
  a.setMargin(0);
  b.setMargin(0);
  btVoronoiSimplexSolver simplex;
  btGjkPairDetector detector(&a, &b, &simplex, nullptr);
  btGjkPairDetector::ClosestPointInput input;
  input.m_transformA.setIdentity();
  input.m_transformB.setIdentity();
  btPointCollector result;
  detector.getClosestPoints(input, result, nullptr);
  return result.m_hasResult ? Scalar(result.m_distance) : 0;
}

using benchmark::Counter;

void report(benchmark::State& state, int wrong) {
  state.counters["pair"] =
      Counter(kPairCount, Counter::kIsIterationInvariantRate | Counter::kInvert);
  state.counters["wrong"] = Scalar{1} * wrong / kPairCount;
}

bool is_wrong(const TrianglePair& pair, Scalar value) {
  const TriangleDistance truth = triangle_distance(pair.a, pair.b);
  const Scalar allowance = kWrong * triangle_noise(pair.a, pair.b) / kTriangleNoise;
  return !(value >= truth.lower - allowance && value <= truth.upper + allowance);
}

template <typename Distance>
void run(benchmark::State& state, const Pairs& pairs, Distance distance) {
  int wrong = 0;
  for (const TrianglePair& pair : pairs) wrong += is_wrong(pair, distance(pair)) ? 1 : 0;
  for (auto _ : state) {
    Scalar sum = 0;
    for (const TrianglePair& pair : pairs) sum += distance(pair);
    benchmark::DoNotOptimize(sum);
  }
  report(state, wrong);
}

void run_wide(benchmark::State& state, const Pairs& pairs, core_internal::InstructionSet set) {
  TriangleBlocks a(pairs.size());
  TriangleBlocks b(pairs.size());
  for (std::size_t n = 0; n < pairs.size(); ++n) {
    a.set(n, pairs[n].a);
    b.set(n, pairs[n].b);
  }
  TriangleDistanceBlocks answers;
  for (auto _ : state) {
    distance_internal::triangle_distances(a, b, set, answers);
    benchmark::ClobberMemory();
  }
  int wrong = 0;
  for (std::size_t n = 0; n < pairs.size(); ++n) {
    wrong += is_wrong(pairs[n], answers[n].upper) ? 1 : 0;
  }
  report(state, wrong);
}

// A triangle, eight others in a block, the direction to the nearest and its distance.
struct Leaf {
  Triangle a;
  TriangleBlock block;
  Vector3 direction;
  Scalar distance = kInfinity;
};

std::vector<Leaf> random_leaves() {
  std::mt19937_64 random(42);
  std::vector<Leaf> leaves(kPairCount / kTriangleBlockWidth);
  for (Leaf& leaf : leaves) {
    for (Vector3& p : leaf.a) p = random_vector(1, random);
    const Vector3 center = random_direction(random) * random_number(2, 4, random);
    for (std::size_t n = 0; n < kTriangleBlockWidth; ++n) {
      Triangle triangle;
      const Vector3 middle = center + random_vector(1, random);
      for (Vector3& p : triangle) p = middle + random_vector(0.5, random);
      for (std::size_t k = 0; k < 9; ++k) {
        leaf.block.at[k][n] = triangle[k / 3][static_cast<Eigen::Index>(k % 3)];
      }
      const TriangleDistance d = triangle_distance(leaf.a, triangle);
      if (!(d.upper < leaf.distance)) continue;
      leaf.distance = d.upper;
      leaf.direction = d.nhat_AB;
    }
  }
  return leaves;
}

// With a cutoff at a multiple of the leaf's distance.
void run_leaves(benchmark::State& state, Scalar multiple, core_internal::InstructionSet set) {
  const std::vector<Leaf> leaves = random_leaves();
  for (auto _ : state) {
    int found = 0;
    for (const Leaf& leaf : leaves) {
      found += distance_internal::nearest_triangle(leaf.a, leaf.block, kTriangleBlockWidth,
                                                   leaf.direction, multiple * leaf.distance, set)
                   ? 1
                   : 0;
    }
    benchmark::DoNotOptimize(found);
  }
  report(state, 0);
}

const char* name_of(core_internal::InstructionSet set) {
  switch (set) {
    case core_internal::InstructionSet::Avx512:
      return "AVX-512";
    case core_internal::InstructionSet::Avx2:
      return "AVX2";
    default:
      return "SSE2";
  }
}

template <typename Run>
void add(const std::string& name, Run run) {
  benchmark::RegisterBenchmark(name.c_str(), run)->Unit(benchmark::kMillisecond);
}

// All rivals on one family. The pairs are made when they are first needed, and kept.
void add_family(const std::string& name, std::function<Pairs()> make) {
  const auto pairs = [make = std::move(make), kept = std::make_shared<Pairs>()]() -> const Pairs& {
    if (kept->empty()) *kept = make();
    return *kept;
  };
  const auto add_one = [&](const char* who, auto distance) {
    add(name + "/" + who,
        [pairs, distance](benchmark::State& state) { run(state, pairs(), distance); });
  };
  add_one("dyop", dyop_distance);
  for (const core_internal::InstructionSet set : runnable_sets()) {
    add(name + "/dyop wide " + name_of(set),
        [pairs, set](benchmark::State& state) { run_wide(state, pairs(), set); });
  }
  add_one("FCL triangle", fcl_distance);
  add_one("libccd GJK", libccd_distance);
  add_one("CGAL", cgal_distance);
  add_one("Bullet GJK", bullet_distance);
}

bool register_all() {
  const auto add_random = [](const char* name, TriangleFamily family, Scalar scale = 1) {
    add_family(name, [family, scale] { return pairs_of(family, scale); });
  };
  add_random("far", TriangleFamily::Far);
  add_random("near", TriangleFamily::Near);
  add_random("crossing", TriangleFamily::Crossing);
  add_random("degenerate", TriangleFamily::DegenerateMix);
  add_random("shared vertex", TriangleFamily::SharedVertex);
  add_random("shared edge", TriangleFamily::SharedEdge);
  add_family("mesh neighbours", mesh_neighbours);
  add_random("near, tiny", TriangleFamily::Near, kTiny);
  add_random("near, huge", TriangleFamily::Near, kHuge);
  add_random("CAD ties", TriangleFamily::CadTies);
  for (const core_internal::InstructionSet set : runnable_sets()) {
    for (const auto& [what, multiple] :
         {std::pair("left out", 0.2), std::pair("cutoff near", 1.01), std::pair("all", 100.0)}) {
      add(std::string("leaf, ") + what + "/dyop wide " + name_of(set),
          [set, multiple = multiple](benchmark::State& state) {
            run_leaves(state, multiple, set);
          });
    }
  }
  return true;
}

const bool is_registered = register_all();

}  // namespace
}  // namespace dyop::testing
