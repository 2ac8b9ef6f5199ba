// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "dyop/contact/contact_generator.h"
#include "dyop/core/error.h"
#include "dyop/geometry/primitives.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

const Box kFloor(Vector3(5, 5, 1));
const Box kCube(Vector3(0.5, 0.5, 0.5));
constexpr Scalar kReach = 0.01;

RigidPose above(Scalar gap, Scalar x = 0) {
  return RigidPose(Vector3(x, 0.1, 1.5 + gap));
}

ContactCacheOptions with_drift(Scalar max_drift) {
  ContactCacheOptions options;
  options.max_drift = max_drift;
  return options;
}

class CacheOfACube : public ::testing::Test {
 protected:
  bool refresh(const RigidPose& X_WB, Scalar reach = kReach) {
    return cache_.refresh(kFloor, RigidPose(), kCube, X_WB, reach, options_, workspace_);
  }
  ContactCacheOptions options_ = with_drift(1e-3);
  ContactWorkspace workspace_;
  ContactCache cache_;
};

TEST_F(CacheOfACube, CarriesWhileItHardlyMoves) {
  EXPECT_TRUE(refresh(above(2e-3)));
  ASSERT_EQ(cache_.contacts().size(), 4u);
  EXPECT_FALSE(refresh(above(1.5e-3, 5e-4)));
  EXPECT_NEAR(cache_.drift(), std::hypot(5e-4, 5e-4), 1e-12);
  for (const ContactPoint& contact : cache_.contacts()) {
    EXPECT_NEAR(contact.gap, 1.5e-3, 1e-12);
    EXPECT_NEAR(contact.p_WCb.z(), 1 + 1.5e-3, 1e-12);
  }
  EXPECT_TRUE(refresh(above(1.5e-3, 2e-3)));
  EXPECT_EQ(cache_.drift(), 0);
  EXPECT_FALSE(refresh(above(1.5e-3, 2e-3)));
}

TEST_F(CacheOfACube, BothShapesMayMoveTogether) {
  refresh(above(2e-3));
  const RigidPose X_WF(Quaternion(Eigen::AngleAxisd(1.2, Vector3(1, 2, 3).normalized())),
                       Vector3(4, 5, 6));
  EXPECT_FALSE(
      cache_.refresh(kFloor, X_WF, kCube, X_WF * above(2e-3), kReach, options_, workspace_));
  for (const ContactPoint& contact : cache_.contacts()) {
    EXPECT_NEAR(contact.gap, 2e-3, 1e-12);
    EXPECT_NEAR((contact.nhat_AB_W - X_WF.rotation().col(2)).norm(), 0, 1e-12);
  }
}

TEST_F(CacheOfACube, GeneratesAnewForMoreReachOrOtherOptions) {
  refresh(above(2e-3));
  EXPECT_FALSE(refresh(above(2e-3), kReach));
  EXPECT_TRUE(refresh(above(2e-3), 2 * kReach));
  EXPECT_TRUE(refresh(above(2e-3), kReach / 10));
  options_.generator.cone_tolerance = 0.1;
  EXPECT_TRUE(refresh(above(2e-3), kReach / 10));
  cache_.clear();
  EXPECT_TRUE(cache_.contacts().empty());
  EXPECT_TRUE(refresh(above(2e-3)));
}

// The drift bounds how far any point of the smaller shape moved, and the gaps err at second order.
TEST(ContactCache, CarriedGapsAreRightToFirstOrder) {
  std::mt19937_64 random(11);
  ContactWorkspace workspace;
  const TriangleMesh body = testing::gear(5, 0.3, 0.5, 0.2).mesh();
  const TriangleMesh sheet = testing::torus(1.5, 0.6, 16, 9).mesh();
  int carried = 0;
  for (int k = 0; k < 300; ++k) {
    const Quaternion q = testing::random_rotation(random);
    const Vector3 p(1.5, 0, testing::random_number(0.7, 1.1, random));
    for (const Scalar step : {1e-3, 1e-5}) {
      ContactCache cache;
      cache.refresh(sheet, RigidPose(), body, RigidPose(q, p), 0.1, with_drift(0.01), workspace);
      const Vector3 turn = step * testing::random_direction(random);
      const RigidPose X_WB(Matrix3(rotation_from_vector(turn) * q.toRotationMatrix()),
                           Vector3(p + step * testing::random_direction(random)));
      const auto before =
          std::vector<ContactPoint>(cache.contacts().begin(), cache.contacts().end());
      ASSERT_FALSE(
          cache.refresh(sheet, RigidPose(), body, X_WB, 0.05, with_drift(0.05), workspace));
      for (const Vector3& vertex : body.vertices()) {
        EXPECT_LE((X_WB * vertex - RigidPose(q, p) * vertex).norm(), cache.drift() * (1 + 1e-9));
      }
      std::vector<ContactPoint> fresh;
      generate_contacts(sheet, RigidPose(), body, X_WB, 0.2, {}, workspace, fresh);
      for (const ContactPoint& contact : cache.contacts()) {
        for (const ContactPoint& truth : fresh) {
          if (truth.key != contact.key || truth.gap < 0.01) continue;
          EXPECT_NEAR(contact.gap, truth.gap, 300 * step * step);
          ++carried;
        }
      }
    }
  }
  EXPECT_GT(carried, 200);
}

TEST_F(CacheOfACube, HandsImpulsesOnByKeyAndByPlace) {
  refresh(above(2e-3));
  for (ContactPoint& contact : cache_.contacts()) {
    contact.impulse_W = Vector3(0.1, 0, 1) * (1 + contact.key.b.number);
  }
  // Far enough that another triangle of the floor lies below some corners.
  EXPECT_TRUE(refresh(RigidPose(Vector3(5e-3, 0.1, 1.502))));
  for (const ContactPoint& contact : cache_.contacts()) {
    EXPECT_TRUE(contact.previous.has_value());
    EXPECT_NEAR(contact.impulse_W.z(), 1 + contact.key.b.number, 1e-12);
  }
  // The cube tips: the impulse keeps its part along the normal.
  EXPECT_TRUE(cache_.refresh(
      kFloor, RigidPose(Quaternion(Eigen::AngleAxisd(0.5, Vector3::UnitX())), Vector3::Zero()),
      kCube,
      RigidPose(Quaternion(Eigen::AngleAxisd(0.5, Vector3::UnitX())), Vector3::Zero()) *
          RigidPose(Vector3(0.2, 0.1, 1.502)),
      kReach, options_, workspace_));
  for (const ContactPoint& contact : cache_.contacts()) {
    EXPECT_NEAR(contact.impulse_W.dot(contact.nhat_AB_W), 1 + contact.key.b.number, 1e-12);
  }
}

TEST_F(CacheOfACube, RefusesADriftThatIsNoLength) {
  options_.max_drift = -1;
  EXPECT_THROW(refresh(above(2e-3)), InvalidArgument);
  options_.max_drift = std::nan("");
  EXPECT_THROW(refresh(above(2e-3)), InvalidArgument);
}

}  // namespace
}  // namespace dyop
