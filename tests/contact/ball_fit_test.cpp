// SPDX-License-Identifier: BSD-3-Clause

// Contacts on fine facets against those on the smooth surface that their vertices lie on.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "contact/generation/contact_fit.h"
#include "dyop/contact/contact_generator.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "support/inputs/curved_meshes.h"

namespace dyop {
namespace {

using namespace testing;

constexpr Scalar kRadius = 0.25;
constexpr Scalar kGap = 1e-3;

// The contact that is nearest, of all within reach.
const ContactPoint& nearest_of(const std::vector<ContactPoint>& contacts) {
  return *std::min_element(contacts.begin(), contacts.end(),
                           [](const auto& x, const auto& y) { return x.gap < y.gap; });
}

struct BallInBowl {
  TriangleMesh mesh = bowl(1, 0.5, 60).mesh();
  Sphere ball{kRadius};
  RigidPose X_WM{rotation_from_vector(Vector3(0.2, -0.3, 0.4)), Vector3(1, 2, 3)};

  // Towards a place of the bowl.
  static Vector3 downwards(Scalar x, Scalar y) {
    return Vector3(x, y, -std::sqrt(1 - x * x - y * y));
  }
  RigidPose ball_pose(const Vector3& down_M) const {
    return {Matrix3::Identity(), X_WM * Vector3((1 - kRadius - kGap) * down_M)};
  }
};

// With facets of 0.0083 the normal is off by up to half of that over the bowl's radius, and by four
// thirds of it for the ball's centre; the gap by the sagitta. Fitted, both err at the next order.
TEST(BallFit, ABallFeelsTheSphereThroughTheVertices) {
  const BallInBowl scene;
  Scalar worst_unfitted = 0;
  for (const Scalar x : {0.003, 0.0511, 0.12, 0.2134}) {
    for (const Scalar y : {0.001, 0.0437, -0.1103}) {
      const Vector3 down = BallInBowl::downwards(x, y);
      const RigidPose X_WB = scene.ball_pose(down);
      const Vector3 expected = scene.X_WM.rotation() * down;
      for (const bool mesh_is_a : {false, true}) {
        const Shape& a = mesh_is_a ? static_cast<const Shape&>(scene.mesh) : scene.ball;
        const Shape& b = mesh_is_a ? static_cast<const Shape&>(scene.ball) : scene.mesh;
        const RigidPose& X_WA = mesh_is_a ? scene.X_WM : X_WB;
        const RigidPose& X_WO = mesh_is_a ? X_WB : scene.X_WM;
        const Scalar sign = mesh_is_a ? -1 : 1;
        auto contacts = generate_contacts(a, X_WA, b, X_WO, 2 * kGap);
        ASSERT_FALSE(contacts.empty());
        worst_unfitted =
            std::max(worst_unfitted, (sign * nearest_of(contacts).nhat_AB_W - expected).norm());
        EXPECT_TRUE(contact_internal::fit_ball_contacts(a, X_WA, b, X_WO, 1, contacts));
        const ContactPoint& contact = nearest_of(contacts);
        EXPECT_LT((sign * contact.nhat_AB_W - expected).norm(), 5e-5) << x << ' ' << y;
        EXPECT_NEAR(contact.gap, kGap, 2e-7) << x << ' ' << y;
        EXPECT_LT((X_WA * contact.p_ACa - contact.p_WCa).norm(), 1e-14);
        EXPECT_LT((X_WO * contact.p_BCb - contact.p_WCb).norm(), 1e-14);
        const RigidPose& X_WS = contact.normal_is_of_b ? X_WO : X_WA;
        EXPECT_LT((X_WS.rotation() * contact.nhat_AB_S - contact.nhat_AB_W).norm(), 1e-14);
      }
    }
  }
  EXPECT_GT(worst_unfitted, 2e-3);
}

// Coarser than asked for, flat, or at a border: as found.
TEST(BallFit, OtherContactsOfABallAreLeftAlone) {
  const BallInBowl scene;
  const RigidPose X_WB = scene.ball_pose(BallInBowl::downwards(0.12, 0.0437));
  auto contacts = generate_contacts(scene.ball, X_WB, scene.mesh, scene.X_WM, 2 * kGap);
  EXPECT_FALSE(contact_internal::fit_ball_contacts(scene.ball, X_WB, scene.mesh, scene.X_WM, 1e-6,
                                                   contacts));
  EXPECT_FALSE(
      contact_internal::fit_ball_contacts(scene.ball, X_WB, scene.mesh, scene.X_WM, 0, contacts));
  const RigidPose at_border = scene.ball_pose(BallInBowl::downwards(std::sin(0.498), 0));
  contacts = generate_contacts(scene.ball, at_border, scene.mesh, scene.X_WM, 2 * kGap);
  ASSERT_FALSE(contacts.empty());
  EXPECT_FALSE(contact_internal::fit_ball_contacts(scene.ball, at_border, scene.mesh, scene.X_WM, 1,
                                                   contacts));
  const TriangleMesh prism = disc(1, 0.5, 16).mesh();
  const RigidPose on_top(Matrix3::Identity(), Vector3(0.1, 0.5 + kRadius + kGap, 0.2));
  contacts = generate_contacts(scene.ball, on_top, prism, {}, 2 * kGap);
  ASSERT_FALSE(contacts.empty());
  EXPECT_FALSE(contact_internal::fit_ball_contacts(scene.ball, on_top, prism, {}, 1, contacts));
}

}  // namespace
}  // namespace dyop
