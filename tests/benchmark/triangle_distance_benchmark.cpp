// Distance of two triangles: triangle_distance() against FCL's triangle routine (the method of PQP)
// and libccd's GJK as FCL calls it. Each iteration passes over 1e5 distinct pairs of one family, so
// that branch predictors cannot learn them; `pair` is the time of one, `wrong` the share of pairs
// whose result is off by more than kWrong of the pair's size.

#include <benchmark/benchmark.h>
#include <fcl/narrowphase/detail/convexity_based_algorithm/gjk_libccd.h>
#include <fcl/narrowphase/detail/primitive_shape_algorithm/triangle_distance.h>

#include <random>
#include <vector>

#include "dyop/core/tolerance.h"
#include "dyop/distance/triangle_distance.h"
#include "support/random_inputs.h"

namespace dyop::testing {
namespace {

constexpr int kPairCount = 100000;
constexpr Scalar kWrong = 1e-9;         // literal: far above every kernel's rounding, far below use
constexpr int kGjkIterations = 1000;    // FCL's own default
constexpr Scalar kGjkTolerance = 1e-6;  // literal: FCL's own default

struct Case {
  const char* name;
  TriangleFamily family;
  Scalar scale;
};

constexpr Scalar kTiny = 1e-4;  // literal: the size at which FCL is known to fail
constexpr Scalar kHuge = 1e4;

constexpr Case kCases[] = {{"far", TriangleFamily::Far, 1},
                           {"near", TriangleFamily::Near, 1},
                           {"crossing", TriangleFamily::Crossing, 1},
                           {"degenerate", TriangleFamily::DegenerateMix, 1},
                           {"shared vertex", TriangleFamily::SharedVertex, 1},
                           {"shared edge", TriangleFamily::SharedEdge, 1},
                           {"near, tiny", TriangleFamily::Near, kTiny},
                           {"near, huge", TriangleFamily::Near, kHuge},
                           {"CAD ties", TriangleFamily::CadTies, 1}};

std::vector<TrianglePair> pairs_of(const Case& c) {
  std::mt19937_64 random(42);
  std::vector<TrianglePair> pairs(kPairCount);
  for (TrianglePair& pair : pairs) {
    pair = random_triangle_pair(c.family, random);
    for (Triangle* triangle : {&pair.a, &pair.b}) {
      for (Vector3& p : *triangle) p *= c.scale;
    }
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

template <typename Distance>
void run(benchmark::State& state, const Case& c, Distance distance) {
  const std::vector<TrianglePair> pairs = pairs_of(c);
  int wrong = 0;
  for (const TrianglePair& pair : pairs) {
    const TriangleDistance truth = triangle_distance(pair.a, pair.b);
    const Scalar allowance = kWrong * triangle_noise(pair.a, pair.b) / kTriangleNoise;
    const Scalar value = distance(pair);
    if (!(value >= truth.lower - allowance && value <= truth.upper + allowance)) ++wrong;
  }
  for (auto _ : state) {
    Scalar sum = 0;
    for (const TrianglePair& pair : pairs) sum += distance(pair);
    benchmark::DoNotOptimize(sum);
  }
  using benchmark::Counter;
  state.counters["pair"] =
      Counter(kPairCount, Counter::kIsIterationInvariantRate | Counter::kInvert);
  state.counters["wrong"] = Scalar{1} * wrong / kPairCount;
}

bool register_all() {
  for (const Case& c : kCases) {
    const auto add = [&c](const char* who, auto distance) {
      const std::string name = std::string(c.name) + "/" + who;
      benchmark::RegisterBenchmark(name.c_str(), [&c, distance](benchmark::State& state) {
        run(state, c, distance);
      })->Unit(benchmark::kMillisecond);
    };
    add("dyop", dyop_distance);
    add("FCL triangle", fcl_distance);
    add("libccd GJK", libccd_distance);
  }
  return true;
}

const bool is_registered = register_all();

}  // namespace
}  // namespace dyop::testing
