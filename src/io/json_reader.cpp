// SPDX-License-Identifier: BSD-3-Clause
#include "io/json_reader.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <set>
#include <sstream>

#include "io/text_scanner.h"

namespace dyop::io_internal {
namespace {

FilePosition position_of(const std::string& text, std::size_t byte_count) {
  // The parser counts the bytes it has read; the last one is the offending one.
  const std::size_t at = std::min(byte_count > 0 ? byte_count - 1 : 0, text.size());
  const std::size_t line_begin = at == 0 ? 0 : text.rfind('\n', at - 1) + 1;
  const auto line = 1 + std::count(text.begin(), text.begin() + std::ptrdiff_t(line_begin), '\n');
  return {std::size_t(line), at - line_begin + 1};
}

// The parser's message without its prefix and position.
std::string syntax_problem(const std::string& what) {
  constexpr std::string_view kMark = "column ";
  const std::size_t mark = what.find(kMark);
  if (mark != std::string::npos) {
    const std::size_t colon = what.find(": ", mark);
    if (colon != std::string::npos) return what.substr(colon + 2);
  }
  const std::size_t bracket = what.find("] ");
  return bracket == std::string::npos ? what : what.substr(bracket + 2);
}

// Follows the parser's events to find keys that occur twice in one object.
class DuplicateKeyFinder {
 public:
  bool operator()(int /*depth*/, Json::parse_event_t event, const Json& parsed) {
    if (event == Json::parse_event_t::object_start) keys_.emplace_back();
    if (event == Json::parse_event_t::object_end) keys_.pop_back();
    if (event == Json::parse_event_t::key) {
      const std::string key = parsed.get<std::string>();
      const bool is_new = keys_.back().insert(key).second;
      if (!is_new && !duplicate_) duplicate_ = key;
    }
    return true;
  }
  const std::optional<std::string>& duplicate() const { return duplicate_; }

 private:
  std::vector<std::set<std::string>> keys_;
  std::optional<std::string> duplicate_;
};

std::string shown(const Json& value) {
  if (value.is_object()) return "an object";
  // Nested values are not printed: the printer is recursive, and the file decides the depth.
  const bool is_nested =
      value.is_array() && std::any_of(value.begin(), value.end(),
                                      [](const Json& entry) { return entry.is_structured(); });
  if (is_nested) return "an array of arrays or objects";
  constexpr std::size_t kLongest = 60;
  const std::string text =
      value.dump(-1, ' ', /*ensure_ascii=*/true, Json::error_handler_t::replace);
  if (text.size() <= kLongest) return text;
  return text.substr(0, kLongest) + "...";
}

}  // namespace

Json parse_json(const std::filesystem::path& file, const std::string& text) {
  DuplicateKeyFinder finder;
  try {
    Json json = Json::parse(text, std::ref(finder));
    if (finder.duplicate()) {
      throw FileError(file,
                      "the key " + quote(*finder.duplicate()) + " occurs twice in one object");
    }
    return json;
  } catch (const Json::parse_error& error) {
    throw FileError(file, position_of(text, error.byte), syntax_problem(error.what()));
  } catch (const Json::exception& error) {
    throw FileError(file, syntax_problem(error.what()));
  }
}

void JsonNode::require_object(std::span<const std::string_view> keys) const {
  if (!value_->is_object()) fail_expected("an object");
  for (const auto& [key, value] : value_->items()) {
    if (std::find(keys.begin(), keys.end(), key) != keys.end()) continue;
    std::string known;
    for (const std::string_view word : keys) known.append(known.empty() ? "" : ", ").append(word);
    fail("unknown key " + quote(key) + "; known keys are " + known);
  }
}

bool JsonNode::has(std::string_view key) const {
  return value_->is_object() && value_->contains(key);
}

JsonNode JsonNode::at(std::string_view key) const {
  if (!value_->is_object()) fail_expected("an object");
  const auto found = value_->find(key);
  if (found == value_->end()) fail("the key " + quote(key) + " is missing");
  constexpr int kDeepest = 64;
  if (depth_ >= kDeepest) fail("nested too deeply");
  return JsonNode(*this, *found, path_.empty() ? std::string(key) : path_ + "." + std::string(key));
}

std::optional<JsonNode> JsonNode::find(std::string_view key) const {
  if (!has(key)) return std::nullopt;
  return at(key);
}

std::vector<JsonNode> JsonNode::items(std::size_t at_least) const {
  if (!value_->is_array()) fail_expected("an array");
  if (value_->size() < at_least) {
    fail("expected at least " + std::to_string(at_least) + " elements, found " +
         std::to_string(value_->size()));
  }
  std::vector<JsonNode> nodes;
  nodes.reserve(value_->size());
  for (std::size_t k = 0; k < value_->size(); ++k) {
    nodes.push_back(JsonNode(*this, (*value_)[k], path_ + "[" + std::to_string(k) + "]"));
  }
  return nodes;
}

Scalar JsonNode::number() const {
  if (!value_->is_number()) fail_expected("a number");
  return value_->get<Scalar>();
}

Scalar JsonNode::positive_number() const {
  if (!value_->is_number() || !(value_->get<Scalar>() > 0)) fail_expected("a number > 0");
  return value_->get<Scalar>();
}

Scalar JsonNode::non_negative_number() const {
  if (!value_->is_number() || !(value_->get<Scalar>() >= 0)) fail_expected("a number >= 0");
  return value_->get<Scalar>();
}

std::int64_t JsonNode::positive_integer() const {
  const bool fits = value_->is_number_integer() && value_->get<Scalar>() >= 1 &&
                    value_->get<Scalar>() < Scalar(std::numeric_limits<std::int64_t>::max());
  if (!fits) fail_expected("an integer > 0");
  return value_->get<std::int64_t>();
}

bool JsonNode::boolean() const {
  if (!value_->is_boolean()) fail_expected("true or false");
  return value_->get<bool>();
}

std::string JsonNode::text() const {
  if (!value_->is_string()) fail_expected("a string");
  return value_->get<std::string>();
}

Vector3 JsonNode::vector3() const {
  const bool is_vector = value_->is_array() && value_->size() == 3 &&
                         std::all_of(value_->begin(), value_->end(),
                                     [](const Json& entry) { return entry.is_number(); });
  if (!is_vector) fail_expected("three numbers [x, y, z]");
  return Vector3((*value_)[0].get<Scalar>(), (*value_)[1].get<Scalar>(),
                 (*value_)[2].get<Scalar>());
}

void JsonNode::fail_expected(const std::string& expected) const {
  fail("expected " + expected + ", found " + shown(*value_));
}

void JsonNode::fail(const std::string& problem) const {
  throw FileError(*file_, path_.empty() ? problem : path_ + ": " + problem);
}

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

namespace {

std::string feature_words(const Feature& feature) {
  std::ostringstream out;
  switch (feature.kind) {
    case FeatureKind::Vertex:
      out << "vertex";
      break;
    case FeatureKind::Edge:
      out << "edge";
      break;
    case FeatureKind::Face:
      out << "face";
      break;
    case FeatureKind::Smooth:
      return "smooth surface";
  }
  for (std::size_t k = 0; k < feature.vertex_count(); ++k) out << ' ' << feature.vertices[k];
  return out.str();
}

}  // namespace

std::string show(Scalar value, Scalar apart) {
  // One digit more than the difference needs, so that the difference can be read off.
  const bool is_told_apart = std::isfinite(value) && apart > 0;
  const Scalar wanted = is_told_apart ? std::log10(std::abs(value) / apart) + 2 : 0;
  std::ostringstream out;
  out.precision(int(std::clamp(std::ceil(wanted), Scalar(9), Scalar(17))));
  out << value;
  return out.str();
}

std::string show(const Vector3& v, Scalar apart) {
  const Vector3 shown = v + Vector3::Zero();  // -0 becomes 0
  return '(' + show(shown.x(), apart) + ", " + show(shown.y(), apart) + ", " +
         show(shown.z(), apart) + ')';
}

std::string place_words(const Vector3& p_WC, const Feature& feature,
                        const std::optional<std::int32_t>& triangle, Scalar gap) {
  std::string words = show(p_WC, gap) + ", " + feature_words(feature);
  if (triangle) words += ", triangle " + std::to_string(*triangle);
  return words;
}

}  // namespace dyop::io_internal
