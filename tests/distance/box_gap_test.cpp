#include "distance/box_gap.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "dyop/core/tolerance.h"
#include "support/random_inputs.h"
#include "support/triangle_oracle.h"

namespace dyop::internal {
namespace {

using WideVector = Eigen::Matrix<long double, 3, 1>;
using Corners = std::array<Vector3, 8>;

OrientedBox random_box(Scalar size, std::mt19937_64& random) {
  OrientedBox box;
  box.center = testing::random_vector(size, random);
  box.axes = testing::random_rotation(random).toRotationMatrix();
  for (Scalar& h : box.half_extents) h = size * testing::random_number(0, 1, random);
  if (testing::random_index(4, random) == 0) box.half_extents[testing::random_index(3, random)] = 0;
  return box;
}

// The corners in A's frame, where they are exact inputs to the oracle; they err by a few roundings.
Corners corners_of(const OrientedBox& box, const RigidPose& X) {
  Corners corners;
  for (std::size_t k = 0; k < 8; ++k) {
    const Vector3 x((k & 1) != 0 ? 1 : -1, (k & 2) != 0 ? 1 : -1, (k & 4) != 0 ? 1 : -1);
    corners[k] = X * Vector3(box.center + box.axes * box.half_extents.cwiseProduct(x));
  }
  return corners;
}

std::vector<Triangle> faces_of(const Corners& c) {
  std::vector<Triangle> faces;
  for (const auto& [i, j, k, l] : {std::array<std::size_t, 4>{0, 1, 2, 3},
                                   {4, 5, 6, 7},
                                   {0, 1, 4, 5},
                                   {2, 3, 6, 7},
                                   {0, 2, 4, 6},
                                   {1, 3, 5, 7}}) {
    faces.push_back({c[i], c[j], c[k]});
    faces.push_back({c[j], c[k], c[l]});
  }
  return faces;
}

/// Exact distance of the surfaces; not below that of the boxes.
Scalar surface_distance(const Corners& a, const Corners& b) {
  long double least = HUGE_VALL;
  for (const Triangle& face_a : faces_of(a)) {
    for (const Triangle& face_b : faces_of(b)) {
      least = std::min(least, testing::oracle_triangle_distance(face_a, face_b).upper());
    }
  }
  return static_cast<Scalar>(least);
}

long double slab_gap(const Corners& a, const Corners& b, const Vector3& nhat) {
  const WideVector n = nhat.cast<long double>().normalized();
  long double low_b = HUGE_VALL;
  long double high_a = -HUGE_VALL;
  for (std::size_t k = 0; k < 8; ++k) {
    low_b = std::min(low_b, n.dot(b[k].cast<long double>()));
    high_a = std::max(high_a, n.dot(a[k].cast<long double>()));
  }
  return low_b - high_a;
}

/// Rounding allowance for a pair of boxes, as a traversal hands it over.
Scalar noise_of(const OrientedBox& a, const OrientedBox& b, const RigidPose& X_AB) {
  return kPoseNoise * (X_AB.translation().norm() + a.center.norm() + a.half_extents.norm() +
                       b.center.norm() + b.half_extents.norm());
}

// Cubes of half width 1 with centres 5 apart along x: the faces are 3 apart.
TEST(BoxGap, MeasuresFacingCubes) {
  OrientedBox cube;
  cube.half_extents = Vector3(1, 1, 1);
  const BoxGap result = box_gap(cube, cube, RigidPose(Matrix3::Identity(), Vector3(5, 0.5, 0)), 0);
  EXPECT_DOUBLE_EQ(result.gap, 3);
  EXPECT_EQ(result.nhat_AB_A, Vector3::UnitX());
}

// B turned by 45 degrees about z shows an edge at 5 - sqrt(2); so does A's face at 1.
TEST(BoxGap, MeasuresAnEdgeBeforeAFace) {
  OrientedBox cube;
  cube.half_extents = Vector3(1, 1, 1);
  const Matrix3 R = Eigen::AngleAxisd(std::acos(-1) / 4, Vector3::UnitZ()).toRotationMatrix();
  const BoxGap result = box_gap(cube, cube, RigidPose(R, Vector3(5, 0, 0)), 0);
  EXPECT_NEAR(result.gap, 4 - std::sqrt(2), 1e-14);
}

TEST(BoxGap, IsNotPositiveForBoxesThatOverlap) {
  std::mt19937_64 random(3);
  for (int k = 0; k < 2000; ++k) {
    const OrientedBox a = random_box(1, random);
    OrientedBox b = random_box(1, random);
    // A point of A, in a corner of B.
    const Vector3 x = testing::random_vector(1, random);
    const Vector3 p = a.center + a.axes * a.half_extents.cwiseProduct(x);
    b.center = p - b.axes * b.half_extents;
    ASSERT_LE(box_gap(a, b, RigidPose(), noise_of(a, b, RigidPose())).gap, 0) << k;
  }
}

TEST(BoxGap, IsNeverAboveTheDistanceOfTheBoxes) {
  std::mt19937_64 random(4);
  int separated = 0;
  for (int k = 0; k < 300; ++k) {
    const Scalar size = testing::random_magnitude(-4, 4, random);
    const OrientedBox a = random_box(size, random);
    const OrientedBox b = random_box(size, random);
    const RigidPose X_AB = testing::random_pose(4 * size, random);
    const Scalar noise = noise_of(a, b, X_AB);
    const BoxGap result = box_gap(a, b, X_AB, noise);
    if (result.gap <= 0) continue;
    ++separated;
    const Scalar distance = surface_distance(corners_of(a, RigidPose()), corners_of(b, X_AB));
    ASSERT_LE(result.gap, distance + noise) << k;
  }
  EXPECT_GT(separated, 100);
}

TEST(BoxGap, IsTheSlabGapAlongItsNormal) {
  std::mt19937_64 random(5);
  for (int k = 0; k < 20000; ++k) {
    const Scalar size = testing::random_magnitude(-4, 4, random);
    const OrientedBox a = random_box(size, random);
    const OrientedBox b = random_box(size, random);
    const RigidPose X_AB = testing::random_pose(4 * size, random);
    const Scalar noise = noise_of(a, b, X_AB);
    const BoxGap result = box_gap(a, b, X_AB, noise);
    if (!(result.gap > 0)) continue;
    ASSERT_NEAR(result.nhat_AB_A.norm(), 1, 1e-14);
    ASSERT_LE(result.gap,
              slab_gap(corners_of(a, RigidPose()), corners_of(b, X_AB), result.nhat_AB_A))
        << k;
  }
}

// Edges turned by about 1.1e-3 against each other, seen crosswise: the length of their cross
// product must not lose digits.
TEST(BoxGap, IsNotAboveTheSlabGapOfNearlyParallelEdges) {
  std::mt19937_64 random(6);
  for (int k = 0; k < 20000; ++k) {
    OrientedBox a;
    OrientedBox b;
    a.half_extents = b.half_extents = Vector3(0, 0, 1);
    const Scalar angle = testing::random_number(1e-3, 3e-3, random);
    const Matrix3 R = (Eigen::AngleAxisd(testing::random_number(0, 6, random), Vector3::UnitZ()) *
                       Eigen::AngleAxisd(angle, Vector3::UnitX()))
                          .toRotationMatrix();
    // The axis z x (R z) and a distance of about one along it.
    const Vector3 axis = Vector3::UnitZ().cross(R.col(2)).normalized();
    const Vector3 aside = testing::random_vector(0.5, random);
    const RigidPose X_AB(R, axis + aside.z() * Vector3::UnitZ());
    const BoxGap result = box_gap(a, b, X_AB, noise_of(a, b, X_AB));
    ASSERT_LE(result.gap,
              slab_gap(corners_of(a, RigidPose()), corners_of(b, X_AB), result.nhat_AB_A))
        << k;
  }
}

}  // namespace
}  // namespace dyop::internal
