// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/distance/distance_derivatives.h"

#include <gtest/gtest.h>

#include <limits>
#include <sstream>

#include "dyop/core/error.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/primitives.h"
#include "support/inputs/mesh_generators.h"
#include "support/inputs/random_inputs.h"

// Random queries against central differences: tests/property/derivatives_soak.cpp.
namespace dyop::testing {
namespace {

RigidPose at(Scalar x, Scalar y, Scalar z) {
  return RigidPose(Vector3(x, y, z));
}

// A vertex of a tilted box over the top of another: the gap is the height of the vertex.
TEST(DistanceDerivatives, OfAVertexOverAFaceAreThoseOfItsHeight) {
  const Box box({1, 1, 1});
  const Matrix3 turn = rotation_from_vector(Vector3(0.5, 0.4, 0.1));
  const RigidPose X_WB(turn, Vector3(0.1, 0.2, 3));
  const DistanceDerivatives found = distance_derivatives(box, RigidPose(), box, X_WB);
  ASSERT_EQ(found.status, DerivativeStatus::Proven);
  EXPECT_LE(found.error, 1e-5);
  EXPECT_TRUE(found.by_b.translation.isApprox(Vector3::UnitZ(), 1e-12));
  const Vector3 r = found.distance.p_WCb - X_WB.translation();
  EXPECT_TRUE(found.by_b.rotation.isApprox(r.cross(Vector3::UnitZ()), 1e-12));
  EXPECT_TRUE(found.by_a.translation.isApprox(-Vector3::UnitZ(), 1e-12));
  // Moving both alike changes nothing.
  const Twist both{{0.3, 0.4, 0.5}, {0, 0, 0}};
  EXPECT_NEAR(found.by_a.along(both) + found.by_b.along(both), 0, 1e-12);
  // The normal is that of the face: it turns with A and not with B. The witness on B is its vertex.
  ASSERT_TRUE(found.witness);
  EXPECT_LE(found.witness->nhat_by_b.rotation.norm(), 1e-12);
  const Vector3 w(0.2, 0.3, 0.4);
  EXPECT_TRUE((found.witness->nhat_by_a.rotation * w).isApprox(w.cross(Vector3::UnitZ()), 1e-9));
  EXPECT_TRUE((found.witness->p_WCb_by_b.rotation * w).isApprox(w.cross(r), 1e-9));
  EXPECT_TRUE(found.witness->p_WCb_by_b.translation.isApprox(Matrix3::Identity(), 1e-9));
}

TEST(DistanceDerivatives, OfBallsTurnTheNormal) {
  const Sphere a(1);
  const Sphere b(0.5);
  const DistanceDerivatives found = distance_derivatives(a, at(0, 0, 0), b, at(4, 0, 0));
  ASSERT_EQ(found.status, DerivativeStatus::Proven);
  EXPECT_TRUE(found.by_b.translation.isApprox(Vector3::UnitX(), 1e-14));
  EXPECT_LE(found.by_b.rotation.norm(), 1e-14);
  ASSERT_TRUE(found.witness);
  // The centres are 4 apart: moving B by y turns the normal by y / 4.
  EXPECT_TRUE(found.witness->nhat_by_b.translation.col(1).isApprox(Vector3(0, 0.25, 0), 1e-12));
  EXPECT_TRUE(found.witness->p_WCa_by_b.translation.col(1).isApprox(Vector3(0, 0.25, 0), 1e-12));
  EXPECT_TRUE(found.witness->p_WCb_by_b.translation.col(1).isApprox(Vector3(0, 0.875, 0), 1e-12));
}

TEST(DistanceDerivatives, FlagFacesThatAreParallel) {
  const Box box({1, 1, 1});
  const DistanceDerivatives found = distance_derivatives(box, at(0, 0, 0), box, at(0.3, 0.2, 3));
  EXPECT_EQ(found.status, DerivativeStatus::Tie);
  EXPECT_GT(found.error, 0.1);
  EXPECT_FALSE(found.witness);
}

// Balls have no corners, however near they are: what inflates a core bends nothing.
TEST(DistanceDerivatives, OfRoundShapesAreProvenAtSmallGaps) {
  const Sphere ball(1);
  const Capsule capsule(0.5, 1);
  for (const Scalar gap : {1e-2, 1e-4, 1e-6, 1e-8}) {
    const DistanceDerivatives found =
        distance_derivatives(ball, at(0, 0, 0), capsule, at(1.5 + gap, 0, 0));
    EXPECT_EQ(found.status, DerivativeStatus::Proven) << gap;
    EXPECT_LT(found.error, 1e-3) << gap;
  }
}

// A corner so near to a face that nothing can be proven about it has no tie either.
TEST(DistanceDerivatives, AreUnprovenWhereNothingIsLeftOfTheGap) {
  const Box box({1, 1, 1});
  const RigidPose X_WB(rotation_from_vector(Vector3(0.5, 0.6, 0)), Vector3(0, 0, 4));
  const Scalar down = distance(box, at(0, 0, 0), box, X_WB).lower;
  for (const Scalar gap : {1e-2, 1e-10}) {
    const RigidPose X_near(X_WB.rotation(), Vector3(0, 0, 4 - down + gap));
    const DistanceDerivatives found = distance_derivatives(box, at(0, 0, 0), box, X_near);
    EXPECT_EQ(found.status, gap > 1e-4 ? DerivativeStatus::Proven : DerivativeStatus::Unproven)
        << gap << " " << found.error;
  }
}

TEST(DistanceDerivatives, FlagTwoPlacesThatAreAsNear) {
  const auto ball = std::make_shared<Sphere>(1);
  const CompoundShape pair({{ball, at(0, 3, 0)}, {ball, at(0, -3, 0)}});
  const Sphere probe(0.5);
  EXPECT_EQ(distance_derivatives(pair, RigidPose(), probe, at(4, 0, 0)).status,
            DerivativeStatus::Tie);
  const DistanceDerivatives aside = distance_derivatives(pair, RigidPose(), probe, at(4, 0.1, 0));
  EXPECT_EQ(aside.status, DerivativeStatus::Proven);
  EXPECT_TRUE(aside.witness);
  EXPECT_EQ(aside.distance.child_a, 0);
}

TEST(DistanceDerivatives, FlagWhatTouches) {
  const Sphere ball(1);
  EXPECT_EQ(distance_derivatives(ball, at(0, 0, 0), ball, at(2, 0, 0)).status,
            DerivativeStatus::Touching);
  EXPECT_EQ(distance_derivatives(ball, at(0, 0, 0), ball, at(1, 0, 0)).status,
            DerivativeStatus::Touching);
}

TEST(DistanceDerivatives, OfSmoothCoresHaveNoWitnessJacobians) {
  const Cylinder cylinder(0.5, 1);
  const DistanceDerivatives found = distance_derivatives(
      cylinder, RigidPose(rotation_from_vector(Vector3(0.3, 0.2, 0.1)), Vector3::Zero()),
      Sphere(0.5), at(2, 0.3, 0.2));
  EXPECT_EQ(found.status, DerivativeStatus::Proven);
  EXPECT_FALSE(found.witness);
}

TEST(DistanceDerivatives, FlagWitnessesAtTheBorderOfAFeature) {
  // Straight over an edge of the face: the point nearest to the ball slides on one side only.
  const Box box({1, 1, 1});
  const DistanceDerivatives found =
      distance_derivatives(box, RigidPose(), Sphere(0.25), at(1, 0.3, 2));
  EXPECT_EQ(found.status, DerivativeStatus::Proven);
  EXPECT_FALSE(found.witness);
  EXPECT_TRUE(
      distance_derivatives(box, RigidPose(), Sphere(0.25), at(0.9, 0.3, 2)).witness.has_value());
  EXPECT_TRUE(
      distance_derivatives(box, RigidPose(), Sphere(0.25), at(1.1, 0.3, 2)).witness.has_value());
}

TEST(DistanceDerivatives, RefuseATolerance) {
  const Sphere ball(1);
  EXPECT_THROW(distance_derivatives(ball, RigidPose(), ball, at(3, 0, 0), {.tolerance = 0}),
               InvalidArgument);
  EXPECT_THROW(distance_derivatives(ball, RigidPose(), ball, at(3, 0, 0),
                                    {.tolerance = std::numeric_limits<Scalar>::quiet_NaN()}),
               InvalidArgument);
}

TEST(DistanceDerivatives, StatusesHaveNames) {
  std::ostringstream out;
  out << DerivativeStatus::Tie << ' ' << DerivativeStatus::Grazing;
  EXPECT_EQ(out.str(), "Tie Grazing");
}

}  // namespace
}  // namespace dyop::testing
