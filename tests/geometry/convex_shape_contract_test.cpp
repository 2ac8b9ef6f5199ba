// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/geometry/convex_shape.h"
#include "geometry/all_shapes.h"

namespace dyop {
namespace {

using testing::all_shapes;
using testing::icosphere;
using testing::ShapeMaker;

class ConvexShapeContract : public ::testing::TestWithParam<std::tuple<ShapeMaker, Scalar>> {
 protected:
  std::unique_ptr<ConvexShape> shape_ = std::get<0>(GetParam()).make(std::get<1>(GetParam()));
  Scalar noise_ = 8 * kUnitRoundoff * shape_->bounding_radius();
  std::mt19937_64 random_{20260101};

  bool has_volume() const { return std::get<0>(GetParam()).has_volume; }

  Vector3 random_unit() {
    std::normal_distribution<Scalar> coordinate;
    const Scalar x = coordinate(random_);
    const Scalar y = coordinate(random_);
    return Vector3(x, y, coordinate(random_)).normalized();
  }

  // Random, and the axes, along which there are ties.
  std::vector<Vector3> directions() {
    std::vector<Vector3> result;
    for (int k = 0; k < 3; ++k) {
      result.push_back(Vector3::Unit(k));
      result.push_back(-Vector3::Unit(k));
    }
    for (int k = 0; k < 100; ++k) result.push_back(random_unit());
    return result;
  }
};

TEST_P(ConvexShapeContract, SupportIsNotBeatenByAnyPointOfTheCore) {
  const TriangleMesh* surface = shape_->core_surface();
  std::uniform_real_distribution<Scalar> weight(0, 1);
  for (const Vector3& n : directions()) {
    const Scalar best = n.dot(shape_->core_support(n).point);
    EXPECT_LE(n.dot(shape_->core_center()), best + noise_);
    if (surface == nullptr) continue;
    for (std::size_t k = 0; k < surface->triangles().size(); ++k) {
      const Triangle t = surface->triangle(std::int32_t(k));
      const Scalar w0 = weight(random_);
      const Scalar w1 = weight(random_) * (1 - w0);
      for (const Vector3& p : t) EXPECT_LE(n.dot(p), best + noise_);
      EXPECT_LE(n.dot(w0 * t[0] + w1 * t[1] + (1 - w0 - w1) * t[2]), best + 2 * noise_);
    }
  }
}

TEST_P(ConvexShapeContract, SupportDoesNotDependOnTheLengthOfTheDirection) {
  for (const Vector3& n : directions()) {
    const SupportPoint expected = shape_->core_support(n);
    for (const Scalar factor : {0x1p-40, 0x1p40}) {
      const SupportPoint support = shape_->core_support(factor * n);
      EXPECT_EQ(support.vertex, expected.vertex);
      EXPECT_EQ(support.point, expected.point);
    }
  }
}

// Where closed forms are taken, the numbers describe what the support function does.
TEST_P(ConvexShapeContract, SimpleCoreIsTheCore) {
  const SimpleCore& core = shape_->simple_core();
  if (core.kind == CoreKind::General) return;
  EXPECT_EQ(core.rounding_radius, shape_->rounding_radius());
  EXPECT_EQ(core.bounding_radius, shape_->bounding_radius());
  EXPECT_EQ(core.is_centred, core.center == Vector3::Zero());
  for (const Vector3& n : directions()) {
    const Scalar half = core.kind == CoreKind::Box ? n.cwiseAbs().dot(core.half_extents)
                                                   : std::abs(n.dot(core.half_extents));
    EXPECT_NEAR(shape_->core_reach(n), n.dot(core.center) + half, noise_);
  }
}

TEST_P(ConvexShapeContract, ReachIsTheHeightOfTheSupportPoint) {
  for (const Vector3& n : directions()) {
    for (const Scalar length : {0.0, 1.0, 0x1p-40, 0x1p40}) {
      const Scalar height = length * n.dot(shape_->core_support(n).point);
      EXPECT_NEAR(shape_->core_reach(length * n), height, length * noise_);
    }
  }
  EXPECT_TRUE(std::isnan(shape_->core_reach(Vector3(1, std::nan(""), 1))));
}

TEST_P(ConvexShapeContract, ZeroAndHugeAndTinyDirectionsGiveAPointOfTheCore) {
  for (const Scalar length : {0.0, 0x1p-1000, 0x1p200}) {
    const SupportPoint support = shape_->core_support(length * Vector3(1, 2, 3));
    EXPECT_LE(support.point.norm(), shape_->bounding_radius());
  }
}

TEST_P(ConvexShapeContract, VertexNumbersAreThoseOfTheCoreSurface) {
  const TriangleMesh* surface = shape_->core_surface();
  for (const Vector3& n : directions()) {
    const SupportPoint support = shape_->core_support(n);
    if (surface == nullptr) {
      EXPECT_FALSE(support.vertex);
      continue;
    }
    ASSERT_TRUE(support.vertex);
    ASSERT_GE(*support.vertex, 0);
    ASSERT_LT(std::size_t(*support.vertex), surface->vertices().size());
    EXPECT_EQ(surface->vertices()[std::size_t(*support.vertex)], support.point);
  }
}

TEST_P(ConvexShapeContract, BoundsContainTheShape) {
  const AlignedBox box = shape_->bounding_box();
  const Scalar radius = shape_->bounding_radius();
  for (const Vector3& n : directions()) {
    const Vector3 p = shape_->support(n);
    EXPECT_LE(p.norm(), radius + noise_);
    for (int k = 0; k < 3; ++k) {
      EXPECT_GE(p[k], box.min()[k] - noise_);
      EXPECT_LE(p[k], box.max()[k] + noise_);
    }
  }
  // Along an axis, without any tolerance: the ball's addition rounds to nearest, the bound up.
  for (int k = 0; k < 3; ++k) {
    EXPECT_LE(shape_->support(Vector3::Unit(k))[k], box.max()[k]);
    EXPECT_GE(shape_->support(-Vector3::Unit(k))[k], box.min()[k]);
  }
}

TEST_P(ConvexShapeContract, BoundsAreTight) {
  const AlignedBox box = shape_->bounding_box();
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(shape_->support(Vector3::Unit(k))[k], box.max()[k], 2 * noise_);
    EXPECT_NEAR(shape_->support(-Vector3::Unit(k))[k], box.min()[k], 2 * noise_);
  }
  EXPECT_LE(shape_->bounding_radius(),
            box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).norm() * (1 + 32 * kUnitRoundoff));
}

// The hull of 10242 support points lies inside the shape and misses at most its curved parts by the
// square of the spacing: (0.02)^2, a few thousandths of the volume and the moments.
TEST_P(ConvexShapeContract, MassIsThatOfTheHullOfSupportPointsOrRefusedWithoutVolume) {
  if (!has_volume()) {
    EXPECT_THROW(shape_->compute_mass_properties(1), InvalidArgument);
    return;
  }
  std::vector<Vector3> points;
  for (const Vector3& n : icosphere(5).vertices) points.push_back(shape_->support(n));
  const MassProperties expected = ConvexHull(points).compute_mass_properties(2.5);
  const MassProperties found = shape_->compute_mass_properties(2.5);
  const Scalar radius = shape_->bounding_radius();
  EXPECT_NEAR(found.mass / expected.mass, 1, 0.005);
  EXPECT_GE(found.mass, expected.mass * (1 - 1024 * kUnitRoundoff));
  EXPECT_LE((found.p_BoBcm - expected.p_BoBcm).norm(), 0.005 * radius);
  EXPECT_LE((found.I_BBcm - expected.I_BBcm).norm(), 0.01 * expected.I_BBcm.norm());
}

TEST_P(ConvexShapeContract, RefusesBadDensity) {
  for (const Scalar density : {0.0, -1.0, kInfinity, std::nan("")}) {
    EXPECT_THROW(shape_->compute_mass_properties(density), InvalidArgument);
  }
}

INSTANTIATE_TEST_SUITE_P(
    AllShapes, ConvexShapeContract,
    ::testing::Combine(::testing::ValuesIn(all_shapes()), ::testing::Values(1e-4, 1.0, 1e4)),
    [](const auto& param) {
      const Scalar size = std::get<1>(param.param);
      return std::get<0>(param.param).name + (size < 1 ? "_small" : size > 1 ? "_large" : "_unit");
    });

}  // namespace
}  // namespace dyop
