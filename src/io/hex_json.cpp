// SPDX-License-Identifier: BSD-3-Clause
#include "io/hex_json.h"

#include <array>
#include <charconv>
#include <cmath>

namespace dyop::io_internal {
namespace {

std::string hex_text(Scalar value) {
  std::string text(std::signbit(value) ? "-" : "");
  if (!std::isfinite(value)) return text.append(std::isnan(value) ? "nan" : "inf");
  std::array<char, 32> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), std::abs(value),
                                 std::chars_format::hex);
  return text.append("0x").append(digits.data(), end.ptr);
}

// A finite number, or nothing.
std::optional<Scalar> parsed(const Json& json) {
  if (json.is_number()) return json.get<Scalar>();
  if (!json.is_string()) return std::nullopt;
  std::string_view text = json.get_ref<const std::string&>();
  const bool is_negative = text.starts_with('-');
  if (is_negative) text.remove_prefix(1);
  if (!text.starts_with("0x") || text.starts_with("0x-")) return std::nullopt;
  text.remove_prefix(2);
  Scalar value = 0;
  const auto [stop, error] =
      std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::hex);
  const bool is_number = error == std::errc() && stop == text.data() + text.size();
  if (!is_number || !std::isfinite(value)) return std::nullopt;
  return is_negative ? -value : value;
}

constexpr const char* kNumber = "a finite number, in hexadecimal as \"0x1.8p+1\"";

// An array of exactly this many numbers.
template <int kCount>
Eigen::Matrix<Scalar, kCount, 1> hex_numbers(const JsonNode& node) {
  Eigen::Matrix<Scalar, kCount, 1> numbers;
  const Json& json = node.value();
  bool is_right = json.is_array() && json.size() == kCount;
  for (int k = 0; is_right && k < kCount; ++k) {
    const std::optional<Scalar> number = parsed(json[std::size_t(k)]);
    is_right = number.has_value();
    if (is_right) numbers[k] = *number;
  }
  if (!is_right) node.fail_expected(std::to_string(kCount) + " times " + kNumber);
  return numbers;
}

}  // namespace

Json hex_json(Scalar value) {
  return hex_text(value);
}

Json hex_json(const Vector3& v) {
  return Json::array({hex_text(v.x()), hex_text(v.y()), hex_text(v.z())});
}

Json hex_json(const RigidPose& X) {
  Json json;
  json["position"] = hex_json(X.translation());
  json["rotation"] = Json::array();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      json["rotation"].push_back(hex_text(X.rotation()(row, column)));
    }
  }
  return json;
}

Json with_hex_numbers(const Json& json) {
  if (json.is_number_float()) return hex_text(json.get<Scalar>());
  if (!json.is_structured()) return json;
  Json result = json;
  for (Json& value : result) value = with_hex_numbers(value);
  return result;
}

Scalar hex_number(const JsonNode& node) {
  const std::optional<Scalar> number = parsed(node.value());
  if (!number || !std::isfinite(*number)) node.fail_expected(kNumber);
  return *number;
}

Vector3 hex_vector(const JsonNode& node) {
  return hex_numbers<3>(node);
}

RigidPose hex_pose(const JsonNode& node) {
  node.require_object({"position", "rotation"});
  const Vector3 p = hex_vector(node.at("position"));
  const Eigen::Matrix<Scalar, 9, 1> rows = hex_numbers<9>(node.at("rotation"));
  Matrix3 R;
  R << rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6], rows[7], rows[8];
  node.guard([&] { return RigidPose(R, p); });  // refuses what is no rotation
  return RigidPose::from_trusted(R, p);
}

}  // namespace dyop::io_internal
