// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/occupancy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/distance/point_distance.h"
#include "dyop/geometry/primitives.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/random_inputs.h"
#include "support/message_of.h"

namespace dyop {
namespace {

// Cells of a grid, some of them twice as large, touching each other.
std::vector<OccupiedCube> random_cubes(std::mt19937_64& random, Scalar size, const Vector3& place) {
  std::vector<OccupiedCube> cubes;
  const int count = 1 + testing::random_index(60, random);
  for (int k = 0; k < count; ++k) {
    const auto cell = [&] { return Scalar(testing::random_index(8, random)); };
    const Scalar edge = testing::random_index(5, random) == 0 ? 2 : 1;
    cubes.push_back({place + size * (Vector3(cell(), cell(), cell()) + Vector3::Constant(edge / 2)),
                     size * edge});
  }
  return cubes;
}

Scalar distance_of(const OccupiedCube& cube, const Vector3& p) {
  return ((p - cube.center).cwiseAbs().array() - cube.size / 2).cwiseMax(0).matrix().norm();
}

template <typename Check>
void for_random_cubes(const Check& check) {
  std::mt19937_64 random(9);
  for (const Scalar size : {1e-4, 1e-2, 1.0, 1e4}) {
    for (const Scalar offset : {0.0, 1e3}) {
      for (int k = 0; k < 12; ++k) {
        const Vector3 place = offset * size * testing::random_direction(random);
        check(random_cubes(random, size, place), size, place, random);
      }
    }
  }
}

TEST(Occupancy, DistancesAreThoseOfTheNearestCube) {
  for_random_cubes([](const std::vector<OccupiedCube>& cubes, Scalar size, const Vector3& place,
                      std::mt19937_64& random) {
    const CompoundShape shape = occupancy(cubes);
    const Scalar noise = 1e-12 * (place.norm() + 20 * size);
    for (int k = 0; k < 10; ++k) {
      const auto coordinate = [&] { return size * testing::random_number(-6, 15, random); };
      const Vector3 p = place + Vector3(coordinate(), coordinate(), coordinate());
      Scalar nearest = kInfinity;
      for (const OccupiedCube& cube : cubes) nearest = std::min(nearest, distance_of(cube, p));
      const PointDistance found = point_distance(shape, RigidPose(), p);
      EXPECT_LE(found.lower, nearest + noise);
      EXPECT_GE(found.upper, nearest - noise);
      EXPECT_LE(found.upper - found.lower, noise);
      const Scalar radius = 0.3 * size;
      const DistanceResult ball = distance(shape, RigidPose(), Sphere(radius), RigidPose(p));
      EXPECT_LE(ball.lower, std::max(Scalar(0), nearest - radius) + noise);
      EXPECT_GE(ball.upper, nearest - radius - noise);
    }
  });
}

TEST(Occupancy, BallsStopAtTheFirstCube) {
  for_random_cubes([](const std::vector<OccupiedCube>& cubes, Scalar size, const Vector3& place,
                      std::mt19937_64& random) {
    const auto coordinate = [&] { return size * testing::random_number(0, 9, random); };
    const Vector3 from = place + Vector3(coordinate(), coordinate(), 15 * size);
    const Scalar radius = 0.3 * size;
    const ConstantTwistMotion falling(RigidPose(from), {{0, 0, -size}, {1, 2, 3}});
    const ToiResult result =
        time_of_impact(occupancy(cubes), RestMotion(RigidPose()), Sphere(radius), falling, {0, 20});
    // The path in small steps, each proven by the closed form: no step may go through.
    const auto gap = [&](Scalar t) {
      Scalar nearest = kInfinity;
      const Vector3 p = from - Vector3(0, 0, t * size);
      for (const OccupiedCube& cube : cubes) nearest = std::min(nearest, distance_of(cube, p));
      return nearest - radius;
    };
    Scalar t = 0;
    while (t < 20 && gap(t) > 1e-9 * size) t += gap(t) / size;
    const Scalar noise = 1e-3 + 1e-9 * place.norm() / size;
    if (t < 20) {
      ASSERT_EQ(result.status, ToiStatus::Impact);
      EXPECT_LE(gap(result.t_safe), noise * size);
      EXPECT_GE(gap(result.t_safe), -1e-12 * (place.norm() + 20 * size));
    }
    EXPECT_LE(result.t_safe, t + noise);
  });
}

TEST(PointCloud, DistancesAreThoseOfTheNearestPoint) {
  std::mt19937_64 random(10);
  for (const Scalar size : {1e-4, 1.0, 1e4}) {
    for (const int count : {1, 2, 40, 1000}) {
      std::vector<Vector3> points;
      for (int k = 0; k < count; ++k) {
        points.push_back(size * testing::random_number(0, 1, random) *
                         testing::random_direction(random));
      }
      points.push_back(points.front());  // twice
      const Scalar radius = 0.02 * size;
      const CompoundShape cloud = point_cloud(points, radius);
      for (int k = 0; k < 50; ++k) {
        const Vector3 p =
            2 * size * testing::random_number(0, 1, random) * testing::random_direction(random);
        Scalar nearest = kInfinity;
        for (const Vector3& point : points) nearest = std::min(nearest, (p - point).norm());
        nearest = std::max(Scalar(0), nearest - radius);
        const PointDistance found = point_distance(cloud, RigidPose(), p);
        EXPECT_NEAR(found.lower, nearest, 1e-12 * size);
        EXPECT_NEAR(found.upper, nearest, 1e-12 * size);
      }
    }
  }
}

TEST(Occupancy, SharesOneBoxForAllCubesOfASize) {
  const std::vector<OccupiedCube> cubes{{Vector3(0, 0, 0), 1}, {Vector3(1, 0, 0), 1}};
  const CompoundShape shape = occupancy(cubes);
  EXPECT_EQ(shape.children()[0].shape, shape.children()[1].shape);
  EXPECT_DOUBLE_EQ(shape.compute_mass_properties(1).mass, 2);
}

TEST(Occupancy, NamesWhatIsWrong) {
  const auto refuse = [](const std::vector<OccupiedCube>& cubes, const std::string& part) {
    const std::string message = testing::message_of([&] { occupancy(cubes); });
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  refuse({}, "at least one cube");
  refuse({{Vector3::Zero(), 1}, {Vector3::Zero(), 0}}, "cube 1 must be > 0, not 0");
  refuse({{Vector3::Zero(), std::nan("")}}, "not nan");
  refuse({{Vector3(0, std::nan(""), 0), 1}}, "the center of cube 0 must be finite");
  const std::vector<Vector3> points{Vector3(0, 0, kInfinity)};
  EXPECT_NE(testing::message_of([&] { point_cloud(points, 1); }).find("point 0 must be finite"),
            std::string::npos);
  EXPECT_NE(testing::message_of([&] { point_cloud({}, 1); }).find("at least one point"),
            std::string::npos);
  EXPECT_NE(testing::message_of([&] { point_cloud(points, -1); }).find("not -1"),
            std::string::npos);
}

}  // namespace
}  // namespace dyop
