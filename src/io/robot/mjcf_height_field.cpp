// SPDX-License-Identifier: BSD-3-Clause
#include "io/robot/mjcf_height_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include "dyop/geometry/height_field.h"
#include "io/file_bytes.h"

namespace dyop::io_internal {
namespace {

using core_internal::compose_message;

// Row 0 is the one with the least y.
struct Elevations {
  std::size_t rows = 2;
  std::size_t columns = 2;
  std::vector<Scalar> values = std::vector<Scalar>(4, 0);
};

// Two counts of 32 bits, then single precision, row by row, all little-endian.
Elevations read_binary(const XmlNode& node, const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file);
  std::array<std::int32_t, 2> counts{};
  if (bytes.size() >= sizeof(counts)) std::memcpy(counts.data(), bytes.data(), sizeof(counts));
  const auto [rows, columns] = counts;
  const std::size_t held = (bytes.size() - std::min(bytes.size(), sizeof(counts))) / sizeof(float);
  const bool is_sound =
      rows > 0 && columns > 0 && std::size_t(rows) <= held &&
      std::size_t(columns) == held / std::size_t(rows) &&
      bytes.size() == sizeof(counts) + std::size_t(rows) * std::size_t(columns) * sizeof(float);
  if (!is_sound) {
    node.fail(compose_message("file: expected a binary height field, found ", bytes.size(),
                              " bytes with the counts ", rows, " and ", columns, " in '",
                              file.string(), "'"));
  }
  std::vector<float> values(std::size_t(rows) * std::size_t(columns));
  std::memcpy(values.data(), bytes.data() + sizeof(counts), values.size() * sizeof(float));
  return {std::size_t(rows), std::size_t(columns), {values.begin(), values.end()}};
}

std::size_t read_count(const XmlNode& node, const char* attribute) {
  const Scalar count = node.number(attribute);
  if (!(count >= 2 && count == std::floor(count))) {
    node.fail_expected(attribute, "a whole number >= 2");
  }
  return static_cast<std::size_t>(std::min(count, 0x1p53));  // literal: whole numbers end there
}

// A text goes from the top down, so its first row has the largest y. Without heights the ground is
// flat, however many there would be.
Elevations read_text(const MjcfElement& element) {
  const std::size_t rows = read_count(element.at("nrow"), "nrow");
  const std::size_t columns = read_count(element.at("ncol"), "ncol");
  if (!element.has("elevation")) return {};
  const XmlNode node = element.at("elevation");
  const std::vector<Scalar> numbers = node.numbers("elevation");
  if (numbers.size() % rows != 0 || numbers.size() / rows != columns) {
    node.fail(compose_message("elevation: expected ", rows, " x ", columns, " numbers, found ",
                              numbers.size()));
  }
  Elevations elevations{rows, columns, {}};
  for (std::size_t row = rows; row-- > 0;) {
    const auto first = numbers.begin() + std::ptrdiff_t(row * columns);
    elevations.values.insert(elevations.values.end(), first, first + std::ptrdiff_t(columns));
  }
  return elevations;
}

}  // namespace

std::shared_ptr<const TriangleMesh> read_height_field(const MjcfElement& element,
                                                      const std::filesystem::path& file) {
  const XmlNode node = element.at("size");
  const std::vector<Scalar> size = node.numbers("size");
  const bool is_sized = size.size() == 4 && std::all_of(size.begin(), size.end(),
                                                        [](Scalar length) { return length > 0; });
  if (!is_sized) node.fail_expected("size", "four numbers > 0");
  Elevations elevations = file.empty() ? read_text(element) : read_binary(element.at("file"), file);
  HeightGrid grid;
  grid.rows = elevations.rows;
  grid.columns = elevations.columns;
  grid.heights = std::move(elevations.values);
  const auto [lowest, highest] = std::minmax_element(grid.heights.begin(), grid.heights.end());
  const Scalar low = *lowest;
  const Scalar scale = *highest > low ? size[2] / (*highest - low) : 0;
  for (Scalar& height : grid.heights) height = (height - low) * scale;
  grid.x = -size[0];
  grid.y = -size[1];
  grid.spacing_x = 2 * size[0] / Scalar(grid.columns - 1);
  grid.spacing_y = 2 * size[1] / Scalar(grid.rows - 1);
  grid.base = -size[3];
  return std::make_shared<TriangleMesh>(height_field(grid));
}

}  // namespace dyop::io_internal
