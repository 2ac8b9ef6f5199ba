// SPDX-License-Identifier: BSD-3-Clause
#include "view/page_block.h"

#include <zlib.h>

#include <array>
#include <cstring>
#include <stdexcept>

namespace dyop::testing {
namespace {

std::string inflated(const std::string& bytes) {
  std::string result(1 << 20, '\0');
  for (;;) {
    uLongf size = uLong(result.size());
    const int status =
        uncompress(reinterpret_cast<Bytef*>(result.data()), &size,
                   reinterpret_cast<const Bytef*>(bytes.data()), uLong(bytes.size()));
    if (status == Z_OK) {
      result.resize(size);
      return result;
    }
    if (status != Z_BUF_ERROR) throw std::runtime_error("not a zlib stream");
    result.resize(2 * result.size());
  }
}

template <typename Number>
std::vector<double> from_planes(const char* data, std::size_t count) {
  std::vector<double> numbers;
  for (std::size_t k = 0; k < count; ++k) {
    std::array<char, sizeof(Number)> bytes{};
    for (std::size_t plane = 0; plane < sizeof(Number); ++plane) {
      bytes[plane] = data[plane * count + k];
    }
    Number number{};
    std::memcpy(&number, bytes.data(), sizeof(Number));
    numbers.push_back(double(number));
  }
  return numbers;
}

}  // namespace

PageBlock::PageBlock(const std::string& bytes) {
  const std::string all = inflated(bytes);
  std::uint32_t length = 0;
  std::memcpy(&length, all.data(), sizeof(length));
  header_ = nlohmann::json::parse(all.substr(sizeof(length), length));
  data_ = all.substr(sizeof(length) + length);
}

std::vector<double> PageBlock::numbers(const std::string& column) const {
  const nlohmann::json& place = header_.at("columns").at(column);
  const char* data = data_.data() + place.at("at").get<std::size_t>();
  const auto count = place.at("count").get<std::size_t>();
  const auto type = place.at("type").get<std::string>();
  if (type == "f64") return from_planes<double>(data, count);
  if (type == "f32") return from_planes<float>(data, count);
  if (type == "u32") return from_planes<std::uint32_t>(data, count);
  if (type == "u16") return from_planes<std::uint16_t>(data, count);
  if (type == "u8") return from_planes<std::uint8_t>(data, count);
  throw std::runtime_error("unknown type " + type);
}

Vector3 PageBlock::vector(const std::string& column, std::size_t k) const {
  const std::vector<double> all = numbers(column);
  const std::size_t count = all.size() / 3;
  return {all.at(k), all.at(count + k), all.at(2 * count + k)};
}

}  // namespace dyop::testing
