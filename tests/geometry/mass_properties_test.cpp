// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "dyop/core/error.h"
#include "dyop/geometry/shape.h"

namespace dyop {
namespace {

TEST(MassProperties, WithMassScalesTheInertiaAndKeepsTheCenter) {
  const MassProperties body{2, Vector3(1, 2, 3), 4 * Matrix3::Identity()};
  const MassProperties heavy = with_mass(body, 6);
  EXPECT_EQ(heavy.mass, 6);
  EXPECT_EQ(heavy.p_BoBcm, body.p_BoBcm);
  EXPECT_EQ(heavy.I_BBcm, 12 * Matrix3::Identity());
}

TEST(MassProperties, WithMassRefusesBadMass) {
  const MassProperties body{2, Vector3::Zero(), Matrix3::Identity()};
  for (const Scalar mass : {0.0, -1.0, kInfinity, std::nan("")}) {
    EXPECT_THROW(with_mass(body, mass), InvalidArgument) << mass;
  }
  EXPECT_THROW(with_mass(MassProperties{}, 1), InvalidArgument);
}

}  // namespace
}  // namespace dyop
