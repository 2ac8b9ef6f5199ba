// SPDX-License-Identifier: BSD-3-Clause
#include "view/column_block.h"

#include <zlib.h>

#include <bit>

#include "dyop/core/error.h"
#include "view/shape_surface.h"

namespace dyop::view_internal {
namespace {

static_assert(std::endian::native == std::endian::little, "the page reads little-endian numbers");

constexpr int kTightLevel = 6;
constexpr int kQuickLevel = 1;

std::string compressed(const std::string& bytes, int level) {
  uLongf size = compressBound(uLong(bytes.size()));
  std::string result(size, '\0');
  const int status =
      compress2(reinterpret_cast<Bytef*>(result.data()), &size,
                reinterpret_cast<const Bytef*>(bytes.data()), uLong(bytes.size()), level);
  if (status != Z_OK) throw InternalError("zlib refused to compress a block of a page");
  result.resize(size);
  return result;
}

}  // namespace

template <typename Number>
void ColumnBlock::add_planes(std::string_view name, const char* type,
                             std::span<const Number> values) {
  columns_[std::string(name)] = {{"type", type}, {"at", data_.size()}, {"count", values.size()}};
  const std::size_t begin = data_.size();
  data_.resize(begin + sizeof(Number) * values.size());
  const auto* bytes = reinterpret_cast<const char*>(values.data());
  for (std::size_t plane = 0; plane < sizeof(Number); ++plane) {
    char* out = data_.data() + begin + plane * values.size();
    for (std::size_t k = 0; k < values.size(); ++k) out[k] = bytes[k * sizeof(Number) + plane];
  }
}

void ColumnBlock::add(std::string_view name, std::span<const double> values) {
  add_planes(name, "f64", values);
}

void ColumnBlock::add(std::string_view name, std::span<const float> values) {
  add_planes(name, "f32", values);
}

void ColumnBlock::add(std::string_view name, std::span<const std::uint32_t> values) {
  add_planes(name, "u32", values);
}

void ColumnBlock::add(std::string_view name, std::span<const std::uint16_t> values) {
  add_planes(name, "u16", values);
}

void ColumnBlock::add(std::string_view name, std::span<const std::uint8_t> values) {
  add_planes(name, "u8", values);
}

void ColumnBlock::add(std::string_view name, std::span<const Vector3> values) {
  std::vector<double> numbers(3 * values.size());
  for (std::size_t k = 0; k < values.size(); ++k) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      numbers[axis * values.size() + k] = values[k][Eigen::Index(axis)];
    }
  }
  add(name, std::span<const double>(numbers));
}

std::string ColumnBlock::bytes(nlohmann::json header, Packing packing) const {
  header["columns"] = columns_;
  const std::string text = header.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  const auto length = std::uint32_t(text.size());
  std::string all(reinterpret_cast<const char*>(&length), sizeof(length));
  all += text;
  all += data_;
  return compressed(all, packing == Packing::Quick ? kQuickLevel : kTightLevel);
}

nlohmann::json add_deformation(ColumnBlock& block, const std::string& name,
                               const PageDeformation& deformation,
                               std::span<const TriangleIndices> triangles) {
  nlohmann::json json{{"body", deformation.body.slot}, {"modes", nlohmann::json::array()}};
  block.add(name + ".t", std::span<const double>(deformation.times));
  block.add(name + ".weights", std::span<const double>(deformation.weights));
  for (std::size_t k = 0; k < deformation.modes.size(); ++k) {
    std::vector<Vector3> moved;
    for (const std::int32_t vertex : vertices_in_order(triangles, deformation.modes[k].size())) {
      moved.push_back(deformation.modes[k][std::size_t(vertex)]);
    }
    const AlignedBox box = add_rounded(block, name + ".mode" + std::to_string(k), moved);
    json["modes"].push_back({{"low", {box.min().x(), box.min().y(), box.min().z()}},
                             {"high", {box.max().x(), box.max().y(), box.max().z()}}});
  }
  return json;
}

}  // namespace dyop::view_internal
