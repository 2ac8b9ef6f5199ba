// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/height_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/distance/ray_cast.h"
#include "dyop/geometry/primitives.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/time_of_impact.h"
#include "support/inputs/random_inputs.h"
#include "support/message_of.h"

namespace dyop {
namespace {

HeightGrid random_grid(std::mt19937_64& random, Scalar size, Scalar offset) {
  HeightGrid grid;
  grid.rows = std::size_t(2 + testing::random_index(12, random));
  grid.columns = std::size_t(2 + testing::random_index(12, random));
  grid.x = offset * testing::random_number(-1, 1, random);
  grid.y = offset * testing::random_number(-1, 1, random);
  grid.spacing_x = size * testing::random_number(0.2, 2, random);
  grid.spacing_y = size * testing::random_number(0.2, 2, random);
  const Scalar floor = offset * testing::random_number(-1, 1, random);
  const bool is_flat = testing::random_index(4, random) == 0;
  for (std::size_t k = 0; k < grid.rows * grid.columns; ++k) {
    grid.heights.push_back(floor + (is_flat ? 0 : size * testing::random_number(-1, 1, random)));
  }
  return grid;
}

// The surface between the heights of a cell, by the weights of each triangle's corners.
Scalar height_at(const HeightGrid& grid, std::size_t row, std::size_t column, Scalar u, Scalar v) {
  const auto z = [&](std::size_t dr, std::size_t dc) {
    return grid.heights[(row + dr) * grid.columns + column + dc];
  };
  if (u >= v) return (1 - u) * z(0, 0) + (u - v) * z(0, 1) + v * z(1, 1);
  return (1 - v) * z(0, 0) + (v - u) * z(1, 0) + u * z(1, 1);
}

template <typename Check>
void for_random_grids(const Check& check) {
  std::mt19937_64 random(20);
  for (const Scalar size : {1e-4, 1e-2, 1.0, 1e4}) {
    for (const Scalar offset : {0.0, 1e3}) {
      for (int k = 0; k < 20; ++k) {
        check(random_grid(random, size, offset * size), size, random);
      }
    }
  }
}

TEST(HeightField, IsClosedAndHoldsTheVolumeUnderTheHeights) {
  for_random_grids([](HeightGrid grid, Scalar size, std::mt19937_64& random) {
    const Scalar lowest = *std::min_element(grid.heights.begin(), grid.heights.end());
    const Scalar base = lowest - size * testing::random_number(0.1, 5, random);
    grid.base = base;
    const TriangleMesh mesh = height_field(grid);
    EXPECT_TRUE(mesh.is_closed());
    EXPECT_EQ(mesh.part_vertices().size(), 1u);
    // Prisms: area times the mean height of the corners.
    Scalar volume = 0;
    for (std::size_t r = 0; r + 1 < grid.rows; ++r) {
      for (std::size_t c = 0; c + 1 < grid.columns; ++c) {
        const Scalar mean =
            (2 * grid.heights[r * grid.columns + c] + grid.heights[r * grid.columns + c + 1] +
             2 * grid.heights[(r + 1) * grid.columns + c + 1] +
             grid.heights[(r + 1) * grid.columns + c]) /
            6;
        volume += grid.spacing_x * grid.spacing_y * (mean - base);
      }
    }
    EXPECT_NEAR(mesh.compute_mass_properties(1).mass, volume, 1e-8 * volume);
  });
}

TEST(HeightField, RaysFromAboveMeetTheHeightBetweenThePoints) {
  for_random_grids([](const HeightGrid& grid, Scalar size, std::mt19937_64& random) {
    const TriangleMesh mesh = height_field(grid);
    // Of coordinates, on slopes of up to ten.
    const Scalar noise = 1e-12 * mesh.bounding_radius();
    const Scalar top = mesh.bounding_box().max().z() + size;
    for (int k = 0; k < 5; ++k) {
      const auto row = std::size_t(testing::random_index(int(grid.rows) - 1, random));
      const auto column = std::size_t(testing::random_index(int(grid.columns) - 1, random));
      const Scalar u = testing::random_number(0, 1, random);
      const Scalar v = testing::random_number(0, 1, random);
      const Vector3 from(grid.x + (Scalar(column) + u) * grid.spacing_x,
                         grid.y + (Scalar(row) + v) * grid.spacing_y, top);
      const Scalar expected = height_at(grid, row, column, u, v);
      const RayHit hit =
          ray_cast(mesh, RigidPose(), {.p_W = from, .direction_W = -Vector3::UnitZ()});
      ASSERT_EQ(hit.status, RayStatus::Hit);
      EXPECT_NEAR(hit.p_WC.z(), expected, noise);
      const std::size_t cell = row * (grid.columns - 1) + column;
      EXPECT_EQ(std::size_t(*hit.triangle) / 2, cell);
      const Scalar gap = 1e-6 * size + noise;
      EXPECT_FALSE(contains(mesh, Vector3(from.x(), from.y(), expected + gap)));
      EXPECT_TRUE(contains(mesh, Vector3(from.x(), from.y(), expected - gap)));
    }
  });
}

TEST(HeightField, ASteadyGroundStopsABallWhereItsPlaneDoes) {
  // z = 0.3 x - 0.2 y: a ball of radius r falling from z touches it at height r / cos of the slope.
  HeightGrid grid;
  grid.rows = 6;
  grid.columns = 9;
  for (std::size_t k = 0; k < 54; ++k) {
    grid.heights.push_back(0.3 * Scalar(k % 9) - 0.2 * Scalar(k / 9));
  }
  const Sphere ball(0.4);
  const ConstantTwistMotion falling(RigidPose(Vector3(3.7, 2.2, 9)), {{0, 0, -1}, {1, 2, 3}});
  const ToiResult result =
      time_of_impact(height_field(grid), RestMotion(RigidPose()), ball, falling, {0, 20});
  ASSERT_EQ(result.status, ToiStatus::Impact);
  const Scalar touching = 0.3 * 3.7 - 0.2 * 2.2 + 0.4 * std::sqrt(1 + 0.09 + 0.04);
  EXPECT_LE(result.t_safe, 9 - touching);
  EXPECT_NEAR(result.t_safe, 9 - touching, 1e-5);
}

TEST(HeightField, ChoosesABaseBelowTheLowestHeight) {
  HeightGrid grid;
  grid.rows = grid.columns = 2;
  grid.heights = {1, 4, 2, 3};
  EXPECT_EQ(height_field(grid).bounding_box().min().z(), -2);
  grid.spacing_y = 10;
  EXPECT_EQ(height_field(grid).bounding_box().min().z(), -9);
  grid.base = 0.5;
  EXPECT_EQ(height_field(grid).bounding_box().min().z(), 0.5);
}

TEST(HeightField, NamesWhatIsWrong) {
  HeightGrid grid;
  grid.rows = grid.columns = 2;
  grid.heights = {1, 4, 2, 3};
  const auto refusal = [&grid](const auto& change) {
    HeightGrid changed = grid;
    change(changed);
    return testing::message_of([&] { height_field(changed); });
  };
  const auto expect = [](const std::string& message, const std::string& part) {
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  expect(refusal([](HeightGrid& g) { g.rows = 1; }), "two rows and two columns, not 1 and 2");
  expect(refusal([](HeightGrid& g) { g.rows = std::size_t(-1); }), "has more than 134217728");
  expect(refusal([](HeightGrid& g) { g.heights.pop_back(); }), "4 heights, not 3");
  expect(refusal([](HeightGrid& g) { g.heights[3] = std::nan(""); }), "row 1, column 1");
  expect(refusal([](HeightGrid& g) { g.spacing_x = 0; }), "must be > 0, not 0");
  expect(refusal([](HeightGrid& g) { g.spacing_y = std::nan(""); }), "must be > 0, not nan");
  expect(refusal([](HeightGrid& g) { g.base = 1; }), "below its lowest height, 1, not 1");
  expect(refusal([](HeightGrid& g) { g.base = std::nan(""); }), "not nan");
  expect(refusal([](HeightGrid& g) { g.x = std::nan(""); }), "vertex 0");
  expect(refusal([](HeightGrid& g) { g.heights[0] = 1e200; }), "1e+200");
}

}  // namespace
}  // namespace dyop
