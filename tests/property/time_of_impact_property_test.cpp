// Time of impact against an oracle that samples densely with a Lipschitz bound and shares no code
// with the engine: no penetration before t_safe, no missed impact, no loose impact.

#include <gtest/gtest.h>

#include <memory>
#include <random>

#include "dyop/geometry/box.h"
#include "dyop/geometry/capsule.h"
#include "dyop/geometry/sphere.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/constant_twist_motion.h"
#include "dyop/motion/hermite_motion.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/toi/time_of_impact.h"
#include "support/fast_distance_oracle.h"
#include "support/mesh_generators.h"
#include "support/random_inputs.h"
#include "support/toi_oracle.h"

namespace dyop {
namespace {

using Shapes = std::vector<std::shared_ptr<const Shape>>;

Shapes make_shapes() {
  return {std::make_shared<TriangleMesh>(test_support::icosphere(2).mesh()),
          std::make_shared<TriangleMesh>(
              TriangleMesh({{-1, 0, 0}, {1, 0, 0}, {0, 0.3, 0}}, {{0, 1, 1}, {0, 1, 2}})),
          std::make_shared<Box>(Vector3(0.9, 0.3, 0.05)), std::make_shared<Capsule>(0.1, 0.8),
          std::make_shared<Sphere>(0.5)};
}

// A motion over [0, 1] that starts at X and moves by about `travel`, turning by up to `rate`.
std::unique_ptr<Motion> random_motion(int kind, const RigidPose& X, const Vector3& travel,
                                      Scalar rate, std::mt19937_64& random) {
  const Twist twist{travel, rate * testing::random_vector(1, random)};
  if (kind == 0) return std::make_unique<ConstantTwistMotion>(X, twist);
  const RigidPose end(rotation_from_vector(testing::random_vector(1, random)) * X.rotation(),
                      X.translation() + travel);
  if (kind == 1) return std::make_unique<InterpolatedMotion>(TimeInterval{0, 1}, X, end);
  return std::make_unique<HermiteMotion>(TimeInterval{0, 1}, HermiteMotion::State{X, twist},
                                         HermiteMotion::State{end, twist});
}

TEST(TimeOfImpactProperty, IsSafeTightAndCompleteAsTheOracleSays) {
  const Shapes shapes = make_shapes();
  std::vector<testing::OracleBody> bodies;
  for (const auto& shape : shapes) bodies.emplace_back(*shape);
  std::mt19937_64 random(20);
  int impacts = 0;
  int total = 0;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    for (std::size_t j = 0; j < shapes.size(); ++j) {
      for (int trial = 0; trial < 24; ++trial) {
        SCOPED_TRACE(::testing::Message() << "shapes " << i << " " << j << " trial " << trial);
        const Vector3 from = 4 * testing::random_direction(random);
        const Vector3 aim = testing::random_vector(1.2, random);
        const auto X_WA =
            random_motion(trial % 3, RigidPose(testing::random_rotation(random), Vector3::Zero()),
                          Vector3::Zero(), 6, random);
        const auto X_WB =
            random_motion((trial / 3) % 3, RigidPose(testing::random_rotation(random), from),
                          1.5 * (aim - from), 6, random);
        ToiOptions options;
        options.target_distance = trial % 4 == 3 ? 0.1 : 0;
        const ToiResult result =
            time_of_impact(*shapes[i], *X_WA, *shapes[j], *X_WB, {0, 1}, options);
        ++total;
        const Scalar delta = options.target_distance;
        const Scalar epsilon = options.distance_tolerance;
        testing::ToiOracle oracle(bodies[i], *X_WA, bodies[j], *X_WB);
        ASSERT_TRUE(result.status == ToiStatus::Impact || result.status == ToiStatus::Separated);
        // Safe: nowhere below the floor; the resolution is what the oracle leaves open.
        const Scalar floor = delta + epsilon / 4 - result.rounding_allowance;
        const Scalar resolution = epsilon / 8;
        const auto broken =
            oracle.first_time_within(floor - resolution, {0, result.t_safe}, resolution);
        EXPECT_FALSE(broken.t && broken.at_t.upper < floor) << *broken.t;
        if (result.status == ToiStatus::Separated) {
          EXPECT_EQ(result.t_safe, 1);
          continue;
        }
        ++impacts;
        EXPECT_LE(oracle.distance_at(result.t_safe, resolution).lower,
                  delta + epsilon + result.rounding_allowance);
        EXPECT_NEAR((result.contact->p_WCb - result.contact->p_WCa).norm(),
                    result.contact->distance_upper, 1e-9);
      }
    }
  }
  EXPECT_GT(impacts, total * 3 / 10);
  EXPECT_LT(impacts, total * 8 / 10);
}

}  // namespace
}  // namespace dyop
