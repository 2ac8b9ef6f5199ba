// SPDX-License-Identifier: BSD-3-Clause

// Random worlds: never nearer than the target distance, by dense samples of the committed motions
// with distance(), which the stepper takes no part in.
#include <gtest/gtest.h>

#include <random>

#include "dyop/distance/distance.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/steady_motions.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/world_scenes.h"

namespace dyop {
namespace {

using namespace testing;

class RandomWorld {
 public:
  RandomWorld(unsigned seed, Scalar scale, bool is_stirred) : random_(seed), scale_(scale) {
    WorldOptions options;
    options.gravity_W = Vector3(0, 0, -10 * scale);
    world_ = std::make_unique<World>(options);
    BodyDefinition floor = floor_body(0.5, 0.3);
    floor.shape = std::make_shared<Box>(Vector3(6, 6, 1) * scale);
    floor.initial.X_WB = RigidPose(Vector3(0, 0, -scale));
    world_->add_body(floor);
    if (is_stirred) add_stirrer();
    const int count = 3 + int(seed % 8);
    for (int i = 0; i < count; ++i) add_body(i);
  }

  World& world() { return *world_; }

  // Kinetic and potential.
  Scalar energy() const {
    Scalar sum = world_->kinetic_energy();
    for (const BodyId id : world_->bodies()) {
      const BodyDefinition& body = world_->body(id);
      if (body.kind != BodyKind::Dynamic) continue;
      const Vector3 p_WBcm = world_->state(id).X_WB * body.mass_properties.p_BoBcm;
      sum += body.mass_properties.mass * 10 * scale_ * p_WBcm.z();
    }
    return sum;
  }

  // The least excess of a distance over its target in the samples of a step.
  Scalar least_excess(const CommittedStep& step,
                      const std::vector<std::pair<BodyId, BodyId>>& but) {
    Scalar least = kInfinity;
    const std::vector<BodyId> ids = world_->bodies();
    for (std::size_t i = 0; i < ids.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        const BodyDefinition& a = world_->body(ids[i]);
        const BodyDefinition& b = world_->body(ids[k]);
        if (a.kind != BodyKind::Dynamic && b.kind != BodyKind::Dynamic) continue;
        if (std::find(but.begin(), but.end(), std::pair(ids[k], ids[i])) != but.end()) continue;
        const Scalar target =
            1e-4 * std::min(a.shape->bounding_radius(), b.shape->bounding_radius());
        constexpr int kSamples = 6;
        for (int s = 0; s <= kSamples; ++s) {
          const Scalar t = step.interval.begin + step.interval.length() * s / kSamples;
          DistanceOptions options;
          options.max_distance = 10 * target;
          const DistanceResult result = distance(
              *a.shape, step.motions[ids[i].slot]->pose(std::min(t, step.interval.end)), *b.shape,
              step.motions[ids[k].slot]->pose(std::min(t, step.interval.end)), options);
          least = std::min(least, (result.upper - target) / target);
        }
      }
    }
    return least;
  }

  // The widest gap across which an impact acts, as a multiple of the pair's target distance. Bodies
  // come to rest at five of it.
  Scalar widest_push(const ImpactEvent& event) const {
    Scalar widest = 0;
    for (const WorldContact& contact : event.contacts) {
      if (contact.impulse_W.isZero(0)) continue;
      const Scalar target = 1e-4 * std::min(world_->body(contact.a).shape->bounding_radius(),
                                            world_->body(contact.b).shape->bounding_radius());
      widest = std::max(widest, contact.contact.lower / target);
    }
    return widest;
  }

 private:
  Scalar number(Scalar low, Scalar high) {
    return std::uniform_real_distribution<Scalar>(low, high)(random_);
  }
  Vector3 vector(Scalar size) {
    return {number(-size, size), number(-size, size), number(-size, size)};
  }

  std::shared_ptr<const Shape> shape(int kind) {
    const Scalar r = scale_ * number(0.2, 0.5);
    switch (kind % 5) {
      case 0:
        return std::make_shared<Box>(Vector3(r, r * number(0.3, 1), r * number(0.3, 1)));
      case 1:
        return std::make_shared<Sphere>(r);
      case 2:
        return std::make_shared<Capsule>(r / 2, r);
      case 3:
        return std::make_shared<TriangleMesh>(testing::box_mesh(Vector3(r, r / 2, r / 3)).mesh());
      default:
        return std::make_shared<TriangleMesh>(testing::torus(r, r / 3, 12, 8).mesh());
    }
  }

  void add_stirrer() {
    BodyDefinition stirrer;
    stirrer.name = "stirrer";
    stirrer.kind = BodyKind::Kinematic;
    stirrer.shape = std::make_shared<Box>(Vector3(2, 0.1, 0.3) * scale_);
    stirrer.motion = std::make_shared<ConstantTwistMotion>(
        RigidPose(Vector3(0, 0, 0.5 * scale_)), Twist{Vector3::Zero(), Vector3(0, 0, 2)});
    stirrer.friction = 0.4;
    world_->add_body(stirrer);
  }

  void add_body(int i) {
    BodyDefinition body = dynamic_body(
        "body", shape(int(random_() % 5)),
        scale_ * Vector3(1.3 * (i % 3) - 1.3, 1.3 * (i / 3 % 3) - 1.3, 2 + 1.3 * (i / 9)),
        vector(scale_), vector(3));
    body.friction = number(0, 1);
    body.restitution = number(0, 1);
    world_->add_body(body);
  }

  std::mt19937_64 random_;
  Scalar scale_;
  std::unique_ptr<World> world_;
};

class WorldSafety : public ::testing::TestWithParam<unsigned> {};

TEST_P(WorldSafety, KeepsEveryTargetDistance) {
  const unsigned seed = GetParam();
  constexpr Scalar kScales[] = {1, 0.01, 100};  // literal: sizes of the scene
  RandomWorld random(seed, kScales[seed % 3], true);
  std::int64_t stalls = 0;
  for (int k = 0; k < 120; ++k) {
    const AdvanceReport report = random.world().advance(0.01);
    // A body may get jammed by the stirrer, which cannot yield: what was committed is safe.
    const bool is_infeasible = report.status == AdvanceStatus::Blocked;
    if (!is_infeasible) {
      ASSERT_EQ(report.status, AdvanceStatus::Completed) << "seed " << seed << " step " << k;
    }
    ASSERT_TRUE(report.too_near.empty()) << "seed " << seed << " step " << k;
    stalls += report.work.stalls;
    for (const ImpactEvent& event : report.impacts) {
      ASSERT_LE(random.widest_push(event), 10) << "seed " << seed << " t " << event.t;
    }
    for (const CommittedStep& step : report.steps) {
      ASSERT_GE(random.least_excess(step, {}), 0) << "seed " << seed << " step " << k;
    }
    if (is_infeasible) return;
  }
  EXPECT_EQ(stalls, 0) << "seed " << seed;
}

TEST_P(WorldSafety, GainsNoEnergy) {
  const unsigned seed = GetParam();
  RandomWorld random(seed, 1, false);
  const Scalar before = random.energy();
  for (int k = 0; k < 120; ++k) {
    ASSERT_EQ(random.world().advance(0.01).status, AdvanceStatus::Completed);
    ASSERT_LT(random.energy(), before * (1 + 1e-3)) << "seed " << seed << " step " << k;
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, WorldSafety, ::testing::Range(0U, 24U));

}  // namespace
}  // namespace dyop
