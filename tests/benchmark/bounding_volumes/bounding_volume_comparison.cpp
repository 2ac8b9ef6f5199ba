// SPDX-License-Identifier: BSD-3-Clause

// Distance and impact of meshes by trees of different bounding volumes: same queries, same split,
// same search, one triangle a leaf, so that only the volumes differ. docs/algorithms/distance.md
// has the result.
//   bounding_volume_comparison [MODEL...]
// Each model is put against itself; without one, those of kModels. Prints a table of mean values a
// query, times being processor time. Every answer is checked against dyop's own; exits with 1 if
// one is wrong.

#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "benchmark/bounding_volumes/bounding_volume_queries.h"
#include "benchmark/bounding_volumes/bounding_volumes.h"
#include "benchmark/bounding_volumes/k_dop.h"
#include "benchmark/mesh_pair.h"
#include "dyop/distance/distance.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/models.h"
#include "support/inputs/random_inputs.h"

namespace dyop::testing {
namespace {

const std::vector<std::string> kModels{"bunny.obj", "horse.3ds"};
constexpr int kQueries = 200;
constexpr Scalar kRates[] = {0, 1, 6};
constexpr Scalar kGaps[] = {0.001, 0.05, 1};
constexpr TimeInterval kInterval{0, 2};
constexpr Scalar kTolerance = 1e-6;           // literal: of the radius of the models, which is one
constexpr Scalar kDistanceDifference = 1e-9;  // literal: far above rounding
// The reference stops this near to contact: at most kTimeDifference before it, unless bodies close
// at less than a thousandth of a radius a unit of time.
constexpr Scalar kReferenceTolerance = 1e-9;  // literal: far below kTolerance
constexpr Scalar kTimeDifference = 1e-6;      // literal: see above

struct Totals {
  Scalar volume_tests = 0;
  Scalar leaf_tests = 0;
  Scalar time = 0;
};

// The queries of one bounding volume.
struct Contender {
  const char* name;
  std::size_t bytes;
  std::function<TreeAnswer(const RigidPose& X_AB)> distance;
  std::function<TreeAnswer(const ImpactQuery&)> impact;
  std::vector<Totals> totals;  // by kind of query
};

template <typename Volume>
Contender make_contender(const TreeShape& shape, PairQueue& queue) {
  const auto tree = std::make_shared<VolumeTree<Volume>>(shape);
  return {
      Volume::kName,
      sizeof(Volume),
      [tree, &queue](const RigidPose& X_AB) { return tree_distance(*tree, *tree, X_AB, queue); },
      [tree, &queue](const ImpactQuery& query) {
        return ImpactSearch(*tree, *tree, query, queue).run();
      },
      {}};
}

// Asks all contenders in turn, each time beginning with another, and calls `check` on each answer.
template <typename Ask, typename Check>
void run_query(std::vector<Contender>& contenders, int number, const Ask& ask, const Check& check) {
  for (std::size_t k = 0; k < contenders.size(); ++k) {
    Contender& contender = contenders[(k + std::size_t(number)) % contenders.size()];
    TreeAnswer answer;
    Totals& totals = contender.totals.back();
    totals.time += microseconds([&] { answer = ask(contender); }) / kQueries;
    totals.volume_tests += Scalar(answer.volume_tests) / kQueries;
    totals.leaf_tests += Scalar(answer.leaf_tests) / kQueries;
    check(contender, answer.value);
  }
}

// Queries of one mesh against itself.
class Comparison {
 public:
  explicit Comparison(const TriangleMesh& mesh) : mesh_(mesh), shape_(mesh) {
    contenders_.push_back(make_contender<Sphere>(shape_, queue_));
    contenders_.push_back(make_contender<AxisAlignedBox>(shape_, queue_));
    contenders_.push_back(make_contender<PrincipalBox>(shape_, queue_));
    contenders_.push_back(make_contender<SmallerBox>(shape_, queue_));
    contenders_.push_back(make_contender<RectangleSweptSphere>(shape_, queue_));
    contenders_.push_back(make_contender<Dop<18>>(shape_, queue_));
    contenders_.push_back(make_contender<Dop<26>>(shape_, queue_));
  }

  Comparison(const Comparison&) = delete;
  Comparison& operator=(const Comparison&) = delete;

  // As in time_of_impact_benchmark.cpp: B flies at A, aimed so that about two thirds hit.
  void run_impacts(Scalar rate) {
    begin_kind("impact, turning rate ", rate);
    std::mt19937_64 random(7);
    for (int k = 0; k < kQueries; ++k) {
      const Vector3 from = random_number(2.2, 3.2, random) * random_direction(random);
      const Vector3 aim = random_number(0, 2.6, random) * random_direction(random);
      const ConstantTwistMotion motion_a(RigidPose(random_rotation(random), Vector3::Zero()),
                                         {Vector3::Zero(), rate * random_direction(random)});
      const ConstantTwistMotion motion_b(
          RigidPose(random_rotation(random), from),
          {1.5 * (aim - from).normalized(), rate * random_direction(random)});
      const ImpactQuery query{&motion_a, &motion_b, kInterval, kTolerance};
      ToiOptions options;
      options.distance_tolerance = kReferenceTolerance;
      const ToiResult reference =
          time_of_impact(mesh_, motion_a, mesh_, motion_b, kInterval, options);
      run_query(
          contenders_, k, [&](const Contender& c) { return c.impact(query); },
          [&](const Contender& c, Scalar t) {
            check(is_impact_right(query, reference, t), c, t, reference.t_safe);
          });
    }
  }

  void run_distances(Scalar gap) {
    begin_kind("distance, gap ", gap);
    std::mt19937_64 random(7);
    for (int k = 0; k < kQueries; ++k) {
      const RigidPose X_WA(random_rotation(random), Vector3::Zero());
      const auto X_WB = pose_at_gap(mesh_, X_WA, gap, random);
      if (!X_WB) continue;
      const RigidPose X_AB = X_WA.inverse() * *X_WB;
      const Scalar reference = distance(mesh_, X_WA, mesh_, *X_WB).upper;
      run_query(
          contenders_, k, [&](const Contender& c) { return c.distance(X_AB); },
          [&](const Contender& c, Scalar d) {
            check(std::abs(d - reference) <= kDistanceDifference, c, d, reference);
          });
    }
  }

  void print() const {
    std::printf("| volume | bytes |");
    for (const std::string& kind : kinds_) std::printf(" %s |", kind.c_str());
    std::printf("\n|---|---|");
    for (std::size_t k = 0; k < kinds_.size(); ++k) std::printf("---|");
    for (const Contender& contender : contenders_) {
      std::printf("\n| %s | %zu |", contender.name, contender.bytes);
      for (const Totals& totals : contender.totals) {
        std::printf(" %.0f / %.0f / %.0f |", totals.volume_tests, totals.leaf_tests, totals.time);
      }
    }
    std::printf("\n\n");
  }

  int wrong() const { return wrong_; }

 private:
  void begin_kind(const char* name, Scalar parameter) {
    std::ostringstream kind;
    kind << name << parameter;
    kinds_.push_back(kind.str());
    for (Contender& contender : contenders_) contender.totals.emplace_back();
  }

  // An impact is within the tolerance and not after contact, which is just after the reference's
  // t_safe if that is an impact; then there must be one.
  bool is_impact_right(const ImpactQuery& query, const ToiResult& reference, Scalar t) const {
    if (t == kInfinity) return reference.status == ToiStatus::Separated;
    const Scalar d = distance(mesh_, query.motion_a->pose(t), mesh_, query.motion_b->pose(t)).lower;
    return t <= reference.t_safe + kTimeDifference && d <= kTolerance + kReferenceTolerance;
  }

  void check(bool is_right, const Contender& contender, Scalar value, Scalar reference) {
    if (is_right) return;
    ++wrong_;
    std::fprintf(stderr, "%s, %s: %.17g, dyop: %.17g\n", kinds_.back().c_str(), contender.name,
                 value, reference);
  }

  const TriangleMesh& mesh_;
  TreeShape shape_;
  PairQueue queue_;
  std::vector<Contender> contenders_;
  std::vector<std::string> kinds_;
  int wrong_ = 0;
};

int run(const std::vector<std::string>& models) {
  int wrong = 0;
  for (const std::string& model : models) {
    const auto file = find_model(model);
    if (!file) {
      std::fprintf(stderr, "%s not found: set DYOP_MESH_PATH\n", model.c_str());
      return 1;
    }
    const TriangleMesh mesh = load_unit_model(*file);
    Comparison comparison(mesh);
    for (const Scalar rate : kRates) comparison.run_impacts(rate);
    for (const Scalar gap : kGaps) comparison.run_distances(gap);
    std::printf(
        "%s, %zu triangles, %d queries a column; volume tests / leaf tests / microseconds\n",
        model.c_str(), mesh.triangles().size(), kQueries);
    comparison.print();
    wrong += comparison.wrong();
  }
  std::printf("%d wrong answers\n", wrong);
  return wrong == 0 ? 0 : 1;
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  const std::vector<std::string> models(argv + 1, argv + argc);
  return dyop::testing::run(models.empty() ? dyop::testing::kModels : models);
}
