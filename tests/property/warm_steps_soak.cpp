// SPDX-License-Identifier: BSD-3-Clause

// Queries that begin where the last one of the same pair ended, against the same queries begun
// afresh, along walks of two bodies in steps of very different length:
//   warm_steps_soak STEPS [SEED]
// Distances with a DistanceCache must have the bounds of those without up to rounding; the time of
// impact of each step in a kept ToiWorkspace must have the same bits as in a new one. Prints what
// was met, and exits with 1 on any difference.

#include <array>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <random>
#include <vector>

#include "core/tolerance.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"
#include "support/same_bits.h"

namespace dyop::testing {
namespace {

constexpr int kStepsAWalk = 200;
constexpr Scalar kTolerance = 1e-6;  // literal: of the size of the shapes, which is about one
constexpr TimeInterval kStep{0, 1e-3};
// Lengths and angles of steps: a robot at rest, one at work, and bodies that jump.
constexpr std::array<Scalar, 4> kStepSizes{1e-7, 1e-3, 0.03, 1};

std::vector<std::unique_ptr<const Shape>> make_shapes() {
  using namespace testing;
  std::vector<std::unique_ptr<const Shape>> shapes;
  for (const MeshArrays& mesh : {icosphere(4), torus(0.8, 0.25, 40, 16), gear(12, 0.7, 1, 0.2),
                                 plate_grid(1.8, 0.8, 8, 5), box_mesh(Vector3(1, 0.1, 0.1)),
                                 needle(1.5, 5), point_cloud(30, 4), random_soup(200, 0.2, 5)}) {
    shapes.push_back(std::make_unique<TriangleMesh>(mesh.mesh()));
  }
  shapes.push_back(std::make_unique<Box>(Vector3(0.9, 0.3, 0.1)));
  shapes.push_back(std::make_unique<Capsule>(0.1, 0.8));
  shapes.push_back(std::make_unique<Sphere>(0.5));
  std::mt19937_64 random(6);
  std::vector<Vector3> points(24);
  for (Vector3& p : points) p = random_vector(0.7, random);
  shapes.push_back(std::make_unique<ConvexHull>(points));
  return shapes;
}

struct Tally {
  int steps = 0;
  int near = 0;  // distances below a hundredth
  int overlapping = 0;
  int impacts = 0;
  int other_status = 0;
  int apart = 0;       // distances whose bounds exclude each other
  int loose = 0;       // warm bounds farther apart than those without and rounding
  int other_bits = 0;  // times of impact
};

// One pair of bodies on a walk; what the queries of one step leave is there for the next.
class Walk {
 public:
  Walk(const Shape& a, const Shape& b, std::mt19937_64& random)
      : a_(a),
        b_(b),
        random_(random),
        X_WA_(random_rotation(random), Vector3::Zero()),
        X_WB_(random_rotation(random), random_number(0.5, 2, random) * random_direction(random)),
        size_(kStepSizes[std::size_t(random_index(3, random))]) {}

  void step(Tally& tally) {
    compare_distances(tally);
    const bool is_jump = random_index(50, random_) == 0;
    const Scalar size = is_jump ? kStepSizes.back() : size_;
    const Scalar h = kStep.length();
    // On the whole towards A, so that there is something to meet, and out of it again.
    const Scalar drift = is_overlapping_ ? -1 : 0.3;
    const Vector3 travel =
        size * (random_vector(1, random_) - drift * X_WB_.translation().normalized());
    const ConstantTwistMotion motion(X_WB_, {travel / h, size / h * random_vector(1, random_)},
                                     kStep.begin);
    compare_impacts(motion, tally);
    X_WB_ = motion.pose(kStep.end);
    ++tally.steps;
  }

 private:
  void compare_distances(Tally& tally) {
    const DistanceResult cold = distance(a_, X_WA_, b_, X_WB_);
    const DistanceResult warm = distance(a_, X_WA_, b_, X_WB_, {}, cache_);
    tally.near += cold.upper < 0.01;
    is_overlapping_ = cold.status == DistanceStatus::Overlapping;
    tally.overlapping += is_overlapping_;
    if (cold.status != warm.status) ++tally.other_status;
    if (!(warm.lower <= cold.upper && cold.lower <= warm.upper)) ++tally.apart;
    const Scalar noise =
        kPoseNoise * (X_WB_.translation().norm() + a_.bounding_radius() + b_.bounding_radius());
    if (!(warm.upper - warm.lower <= cold.upper - cold.lower + 2 * noise)) ++tally.loose;
  }

  void compare_impacts(const Motion& motion, Tally& tally) {
    ToiOptions options{.distance_tolerance = 1e-6};
    options.distance_tolerance = kTolerance;
    const RestMotion rest(X_WA_);
    const ToiResult cold = time_of_impact(a_, rest, b_, motion, kStep, options);
    const ToiResult warm = time_of_impact(a_, rest, b_, motion, kStep, options, workspace_);
    tally.impacts += cold.status == ToiStatus::Impact;
    if (!has_same_bits(cold, warm)) ++tally.other_bits;
  }

  const Shape& a_;
  const Shape& b_;
  std::mt19937_64& random_;
  RigidPose X_WA_;
  RigidPose X_WB_;
  Scalar size_;
  bool is_overlapping_ = false;
  DistanceCache cache_;
  ToiWorkspace workspace_;
};

int run(int steps, std::uint64_t seed) {
  const auto shapes = make_shapes();
  std::mt19937_64 random(seed);
  Tally tally;
  while (tally.steps < steps) {
    const auto pick = [&]() -> const Shape& {
      return *shapes[std::size_t(random_index(int(shapes.size()), random))];
    };
    const Shape& a = pick();
    Walk walk(a, pick(), random);
    for (int k = 0; k < kStepsAWalk; ++k) walk.step(tally);
  }
  std::printf("%d steps: %d near, %d overlapping, %d impacts\n", tally.steps, tally.near,
              tally.overlapping, tally.impacts);
  std::printf("warm distances with another status %d, outside the cold bounds %d, looser %d\n",
              tally.other_status, tally.apart, tally.loose);
  std::printf("times of impact with other bits %d\n", tally.other_bits);
  // Some of everything, or nothing was compared.
  const bool is_mixed = tally.near > tally.steps / 50 && tally.overlapping > tally.steps / 50 &&
                        tally.impacts > tally.steps / 100;
  return is_mixed && tally.other_status + tally.apart + tally.loose + tally.other_bits == 0 ? 0 : 1;
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  const int steps = argc > 1 ? std::atoi(argv[1]) : 2000;
  const long seed = argc > 2 ? std::atol(argv[2]) : 1;
  if (steps <= 0 || seed < 0) {
    std::fprintf(stderr, "usage: warm_steps_soak STEPS [SEED]\n");
    return 2;
  }
  return dyop::testing::run(steps, static_cast<std::uint64_t>(seed));
}
