// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/core/rigid_pose.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "support/message_of.h"

namespace dyop {
namespace {

using testing::message_of;

TEST(RigidPose, ComposesAndInverts) {
  const RigidPose X_AB(Quaternion(Eigen::AngleAxisd(0.7, Vector3(1, 2, 3).normalized())),
                       Vector3(4, -5, 6));
  const RigidPose X_BC(Quaternion(Eigen::AngleAxisd(-1.3, Vector3::UnitY())), Vector3(0.1, 0, 2));
  const Vector3 p_C(3, 1, -2);
  EXPECT_LT(((X_AB * X_BC) * p_C - X_AB * (X_BC * p_C)).norm(), 1e-14);
  EXPECT_LT((X_AB.inverse() * (X_AB * p_C) - p_C).norm(), 1e-14);
}

TEST(RigidPose, RefusesNonUnitQuaternionNamingItsNorm) {
  const std::string message =
      message_of([] { RigidPose(Quaternion(1, 0.1, 0, 0), Vector3::Zero()); });
  EXPECT_NE(message.find("1.004987"), std::string::npos) << message;
}

TEST(RigidPose, RefusesNonFiniteNumbers) {
  EXPECT_NE(message_of([] { RigidPose(Vector3(0, std::nan(""), 0)); }).find("nan"),
            std::string::npos);
  EXPECT_NE(message_of([] { RigidPose(Quaternion(std::nan(""), 0, 0, 0), Vector3::Zero()); }),
            "no error");
}

TEST(RigidPose, RefusesMirrorsAndShears) {
  const Matrix3 mirror = Vector3(1, 1, -1).asDiagonal();
  EXPECT_NE(message_of([&] { RigidPose(mirror, Vector3::Zero()); }).find("mirror"),
            std::string::npos);
  Matrix3 shear = Matrix3::Identity();
  shear(0, 1) = 0.01;
  EXPECT_NE(message_of([&] { RigidPose(shear, Vector3::Zero()); }).find("orthonormal"),
            std::string::npos);
}

TEST(RotationVector, RoundTripsFromTinyToPi) {
  std::mt19937_64 random(1);
  std::normal_distribution<Scalar> normal;
  for (int i = 0; i < 20000; ++i) {
    const Vector3 axis = Vector3(normal(random), normal(random), normal(random)).normalized();
    const Scalar angle = std::numbers::pi * std::pow(10.0, -8.0 * (i % 100) / 100.0) * 0.999;
    const Vector3 w = axis * angle;
    EXPECT_LT((rotation_vector(rotation_from_vector(w)) - w).norm(), 4e-15 + 1e-15 * angle)
        << "angle " << angle;
  }
}

TEST(RotationVector, MatchesAngleAxisAndStaysOrthonormal) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<Scalar> uniform(-10, 10);
  for (int i = 0; i < 20000; ++i) {
    const Vector3 w(uniform(random), uniform(random), uniform(random));
    const Matrix3 R = rotation_from_vector(w);
    const Matrix3 expected = Eigen::AngleAxisd(w.norm(), w.normalized()).toRotationMatrix();
    EXPECT_LT((R - expected).cwiseAbs().maxCoeff(), 1e-14);
    EXPECT_LT((R.transpose() * R - Matrix3::Identity()).cwiseAbs().maxCoeff(), 24 * kUnitRoundoff);
  }
}

}  // namespace
}  // namespace dyop
