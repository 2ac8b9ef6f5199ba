// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/height_field.h"

#include <algorithm>
#include <cmath>

#include "core/tolerance.h"
#include "dyop/core/error.h"

namespace dyop {
namespace {

void require_valid(const HeightGrid& grid) {
  DYOP_REQUIRE(grid.rows >= 2 && grid.columns >= 2,
               "a height field needs at least two rows and two columns, not ", grid.rows, " and ",
               grid.columns);
  // Two triangles a cell.
  DYOP_REQUIRE(grid.rows <= kLargestTriangleCount / 2 / grid.columns, "a height field of ",
               grid.rows, " rows and ", grid.columns, " columns has more than ",
               kLargestTriangleCount, " triangles");
  DYOP_REQUIRE(grid.heights.size() == grid.rows * grid.columns, "a height field of ", grid.rows,
               " rows and ", grid.columns, " columns has ", grid.rows * grid.columns,
               " heights, not ", grid.heights.size());
  for (std::size_t k = 0; k < grid.heights.size(); ++k) {
    DYOP_REQUIRE(std::isfinite(grid.heights[k]), "the height in row ", k / grid.columns,
                 ", column ", k % grid.columns, " must be finite, not ", grid.heights[k]);
  }
  for (const Scalar spacing : {grid.spacing_x, grid.spacing_y}) {
    DYOP_REQUIRE(spacing > 0 && std::isfinite(spacing),
                 "the spacing of a height field must be > 0, not ", spacing);
  }
}

Scalar base_of(const HeightGrid& grid) {
  const auto [low, high] = std::minmax_element(grid.heights.begin(), grid.heights.end());
  const Scalar depth = std::max({*high - *low, grid.spacing_x, grid.spacing_y});
  const Scalar base = grid.base.value_or(*low - depth);
  DYOP_REQUIRE(base < *low, "the base of a height field must be below its lowest height, ", *low,
               ", not ", base);
  return base;
}

/// The numbers of the grid's points, and those on its border, counterclockwise seen from above.
class GridNumbers {
 public:
  explicit GridNumbers(const HeightGrid& grid)
      : rows_(std::int32_t(grid.rows)), columns_(std::int32_t(grid.columns)) {}

  std::int32_t rows() const { return rows_; }
  std::int32_t columns() const { return columns_; }
  std::int32_t at(std::int32_t row, std::int32_t column) const { return row * columns_ + column; }

  std::vector<std::int32_t> border() const {
    std::vector<std::int32_t> numbers;
    for (std::int32_t c = 0; c + 1 < columns_; ++c) numbers.push_back(at(0, c));
    for (std::int32_t r = 0; r + 1 < rows_; ++r) numbers.push_back(at(r, columns_ - 1));
    for (std::int32_t c = columns_ - 1; c > 0; --c) numbers.push_back(at(rows_ - 1, c));
    for (std::int32_t r = rows_ - 1; r > 0; --r) numbers.push_back(at(r, 0));
    return numbers;
  }

 private:
  std::int32_t rows_;
  std::int32_t columns_;
};

void append_top(const GridNumbers& numbers, std::vector<TriangleIndices>& triangles) {
  for (std::int32_t r = 0; r + 1 < numbers.rows(); ++r) {
    for (std::int32_t c = 0; c + 1 < numbers.columns(); ++c) {
      const std::int32_t from = numbers.at(r, c);
      const std::int32_t to = numbers.at(r + 1, c + 1);
      triangles.push_back({from, numbers.at(r, c + 1), to});
      triangles.push_back({from, to, numbers.at(r + 1, c)});
    }
  }
}

// A wall down from the border, and a bottom whose triangles meet in its middle.
void append_sides(const std::vector<std::int32_t>& border, geometry_internal::HeightFieldArrays& to,
                  const Vector3& middle) {
  const auto foot = std::int32_t(to.vertices.size());
  const auto count = std::int32_t(border.size());
  const std::int32_t center = foot + count;
  for (const std::int32_t top : border) {
    const Vector3& p = to.vertices[std::size_t(top)];
    to.vertices.emplace_back(Vector3(p.x(), p.y(), middle.z()));
  }
  to.vertices.push_back(middle);
  for (std::int32_t k = 0; k < count; ++k) {
    const std::int32_t next = (k + 1) % count;
    const std::int32_t top = border[std::size_t(k)];
    const std::int32_t next_top = border[std::size_t(next)];
    to.triangles.push_back({next_top, top, foot + k});
    to.triangles.push_back({next_top, foot + k, foot + next});
    to.triangles.push_back({foot + next, foot + k, center});
  }
}

}  // namespace

geometry_internal::HeightFieldArrays geometry_internal::height_field_arrays(
    const HeightGrid& grid) {
  require_valid(grid);
  const Scalar base = base_of(grid);
  const GridNumbers numbers(grid);
  HeightFieldArrays arrays;
  for (std::size_t k = 0; k < grid.heights.size(); ++k) {
    arrays.vertices.emplace_back(grid.x + Scalar(k % grid.columns) * grid.spacing_x,
                                 grid.y + Scalar(k / grid.columns) * grid.spacing_y,
                                 grid.heights[k]);
  }
  append_top(numbers, arrays.triangles);
  const Vector3 middle = (arrays.vertices.front() + arrays.vertices.back()) / 2;
  append_sides(numbers.border(), arrays, Vector3(middle.x(), middle.y(), base));
  return arrays;
}

TriangleMesh height_field(const HeightGrid& grid) {
  geometry_internal::HeightFieldArrays arrays = geometry_internal::height_field_arrays(grid);
  return TriangleMesh(std::move(arrays.vertices), std::move(arrays.triangles));
}

}  // namespace dyop
