// SPDX-License-Identifier: BSD-3-Clause

// Compounds in time_of_impact(), against their children one by one, on all motions.

#include <gtest/gtest.h>

#include "core/tolerance.h"
#include "dyop/distance/distance.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/toi/time_of_impact.h"
#include "geometry/all_compounds.h"
#include "motion/all_motions.h"
#include "support/inputs/bodies.h"

namespace dyop {
namespace {

using namespace testing;  // NOLINT: makers
using testing::kAllMotions;
using testing::MotionPointer;
using testing::Scales;

TEST(CompoundTimeOfImpact, IsTheFirstOfTheChildren) {
  testing::Random random(11);
  int impacts = 0;
  int separated = 0;
  for (std::size_t k = 0; k < 3 * kAllMotions.size(); ++k) {
    const testing::MotionMaker& maker = kAllMotions[k % kAllMotions.size()];
    for (const CompoundMaker& shape : all_compounds()) {
      const auto a = shape.make(0.7);
      const auto b = all_compounds()[2].make(0.7);
      const Scales scales{6, 4, 3, {0, 1}};
      const MotionPointer X_WA = maker.make(random, scales);
      const MotionPointer X_WB = testing::slerp(random, scales);
      ToiOptions options;
      options.distance_tolerance = 1e-4;
      const ToiResult whole = time_of_impact(*a, *X_WA, *b, *X_WB, {0, 1}, options);
      Scalar first = kInfinity;
      bool is_within = false;
      for (const CompoundChild& child_a : a->children()) {
        for (const CompoundChild& child_b : b->children()) {
          const ComposedMotion motion_a(X_WA, std::make_shared<RestMotion>(child_a.X_CS));
          const ComposedMotion motion_b(X_WB, std::make_shared<RestMotion>(child_b.X_CS));
          const ToiResult single =
              time_of_impact(*child_a.shape, motion_a, *child_b.shape, motion_b, {0, 1}, options);
          is_within |= single.status == ToiStatus::InitiallyWithinTarget;
          if (single.status == ToiStatus::Impact) first = std::min(first, single.t_safe);
        }
      }
      SCOPED_TRACE(std::string(maker.name) + " " + shape.name);
      if (is_within) {
        EXPECT_EQ(whole.status, ToiStatus::InitiallyWithinTarget);
        continue;
      }
      EXPECT_EQ(whole.status == ToiStatus::Impact, first < kInfinity);
      if (whole.status != ToiStatus::Impact) {
        ++separated;
        continue;
      }
      ++impacts;
      // Both lie in the band of the tolerance, which bodies cross at some speed.
      EXPECT_NEAR(whole.t_safe, first, 0.02);
      ASSERT_TRUE(whole.contact && whole.contact->child_a && whole.contact->child_b);
      const CompoundChild& child_a = a->children()[std::size_t(*whole.contact->child_a)];
      const CompoundChild& child_b = b->children()[std::size_t(*whole.contact->child_b)];
      const DistanceResult d = distance(*child_a.shape, whole.X_WA * child_a.X_CS, *child_b.shape,
                                        whole.X_WB * child_b.X_CS);
      EXPECT_LE(d.lower, options.distance_tolerance.value() * 1.001);
      EXPECT_GE(d.upper, options.distance_tolerance.value() * 0.249);
      EXPECT_EQ(whole.contact->triangle_a.has_value(),
                child_a.shape->kind() == ShapeKind::TriangleMesh);
    }
  }
  EXPECT_GT(impacts, 10);
  EXPECT_GT(separated, 30);
}

TEST(CompoundTimeOfImpact, ResumesAndBatchesWithTheSameBits) {
  const auto a = all_compounds()[3].make(1);
  const auto b = all_compounds()[4].make(1);
  const ConstantTwistMotion X_WA = testing::moving(testing::at(-4, 0.1, 0), {5, 0, 0}, {1, 2, 3});
  const RestMotion X_WB;
  ToiQuery query{a.get(), &X_WA, b.get(), &X_WB, {0, 1}, {}};
  const ToiResult whole = time_of_impact(*a, X_WA, *b, X_WB, {0, 1});
  ASSERT_EQ(whole.status, ToiStatus::Impact);
  std::vector<ToiResult> results(1);
  time_of_impact_batch(std::span(&query, 1), results);
  EXPECT_EQ(results[0].t_safe, whole.t_safe);
  ToiWorkspace workspace;
  query.options.max_node_pairs = 20;
  ToiResult part = time_of_impact(*a, X_WA, *b, X_WB, {0, 1}, query.options, workspace);
  int portions = 1;
  while (part.status == ToiStatus::BudgetExhausted) {
    part = resume_time_of_impact(*a, X_WA, *b, X_WB, {0, 1}, query.options, workspace);
    ++portions;
  }
  EXPECT_GT(portions, 1);
  EXPECT_EQ(part.t_safe, whole.t_safe);
  EXPECT_EQ(part.contact->child_a, whole.contact->child_a);
}

TEST(CompoundTimeOfImpact, BeginsInsideASolidChild) {
  const auto shell = std::make_shared<TriangleMesh>(icosphere(2).mesh());
  const CompoundShape solid({{shell, testing::at(5, 0, 0)}, {shell, testing::at(0, 0, 0)}});
  const Sphere ball(0.1);
  const RestMotion resting;
  ToiOptions options;
  EXPECT_EQ(time_of_impact(solid, resting, ball, resting, {0, 1}, options).status,
            ToiStatus::Separated);
  options.solid_a = true;
  EXPECT_EQ(time_of_impact(solid, resting, ball, resting, {0, 1}, options).status,
            ToiStatus::InitiallyWithinTarget);
}

}  // namespace
}  // namespace dyop
