// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/core/types.h"
#include "dyop/geometry/shape.h"
#include "dyop/io/file_error.h"

namespace dyop::io_internal {

/// Keeps the keys in the order of the file.
using Json = nlohmann::ordered_json;

/// Parses a JSON text. Throws FileError with line and column for a syntax error, and with the key
/// if one occurs twice in the same object.
DYOP_EXPORT Json parse_json(const std::filesystem::path& file, const std::string& text);

/// A value of a JSON file together with the path of keys that leads to it. Every reading function
/// checks type and range, and throws a FileError `<file>: <path>: expected ..., found ...`.
class DYOP_EXPORT JsonNode {
 public:
  /// The root of a file; `root` must outlive the node.
  JsonNode(const std::filesystem::path& file, const Json& root) : file_(&file), value_(&root) {}

  const std::string& path() const { return path_; }
  const std::filesystem::path& file() const { return *file_; }
  const Json& value() const { return *value_; }

  /// Requires an object with no other keys.
  void require_object(std::span<const std::string_view> keys) const;
  void require_object(std::initializer_list<std::string_view> keys) const {
    require_object(std::span(keys.begin(), keys.size()));
  }
  bool has(std::string_view key) const;
  JsonNode at(std::string_view key) const;
  std::optional<JsonNode> find(std::string_view key) const;

  /// Requires an array with at least this many elements.
  std::vector<JsonNode> items(std::size_t at_least = 0) const;

  bool is_string() const { return value_->is_string(); }
  Scalar number() const;
  Scalar positive_number() const;
  Scalar non_negative_number() const;
  std::int64_t positive_integer() const;
  bool boolean() const;
  std::string text() const;
  Vector3 vector3() const;
  /// One of the words of a table {word, value}.
  template <typename Value>
  Value choice(std::initializer_list<std::pair<std::string_view, Value>> table) const;

  /// Runs f; an InvalidArgument from it becomes a FileError for this value.
  template <typename Function>
  auto guard(Function f) const;

  [[noreturn]] void fail_expected(const std::string& expected) const;
  [[noreturn]] void fail(const std::string& problem) const;

 private:
  JsonNode(const JsonNode& parent, const Json& value, std::string path)
      : file_(parent.file_), value_(&value), path_(std::move(path)), depth_(parent.depth_ + 1) {}

  const std::filesystem::path* file_;
  const Json* value_;
  std::string path_;
  int depth_ = 0;
};

template <typename Value>
Value JsonNode::choice(std::initializer_list<std::pair<std::string_view, Value>> table) const {
  std::string words;
  for (const auto& [word, value] : table) {
    if (is_string() && value_->get_ref<const std::string&>() == word) return value;
    words.append(words.empty() ? "one of " : ", ").append(word);
  }
  fail_expected(words);
}

template <typename Function>
auto JsonNode::guard(Function f) const {
  try {
    return f();
  } catch (const InvalidArgument& error) {
    fail(error.what());
  }
}

// Numbers as strings in hexadecimal floating point, "0x1.8p+1": every bit is kept and visible.

Json hex_json(Scalar value);
Json hex_json(const Vector3& v);
/// The rotation as nine numbers, row by row: a quaternion would lose bits.
Json hex_json(const RigidPose& X);

/// The same value with every floating-point number in it as a string.
Json with_hex_numbers(const Json& json);

/// The value as a number: such a string, or a plain number. Throws FileError, also if not finite.
Scalar hex_number(const JsonNode& node);
Vector3 hex_vector(const JsonNode& node);
/// Uses the rotation unchanged, if it is one.
RigidPose hex_pose(const JsonNode& node);

/// A number for display, with nine significant digits, or with more (up to all 17) where numbers
/// that are `apart` from each other would look alike otherwise.
DYOP_EXPORT std::string show(Scalar value, Scalar apart = kInfinity);
/// "(x, y, z)", likewise.
DYOP_EXPORT std::string show(const Vector3& v, Scalar apart = kInfinity);

/// Describes where a witness point lies: coordinates, feature, triangle.
/// @param gap The distance of the point on the other shape, which the coordinates tell apart.
DYOP_EXPORT std::string place_words(const Vector3& p_WC, const Feature& feature,
                                    const std::optional<std::int32_t>& triangle,
                                    Scalar gap = kInfinity);

/// Parses one document of YAML by yaml-cpp, as the same tree of values as JSON. Anchors, aliases,
/// tags, keys that are no text, further documents and nesting deeper than JSON is read are refused.
/// @throws FileError with line and column; for a key that occurs twice, too.
DYOP_EXPORT Json parse_yaml(const std::filesystem::path& file, const std::string& text);

/// parse_yaml() of a file whose name ends in .yaml or .yml, parse_json() of others.
Json parse_structured(const std::filesystem::path& file, const std::string& text);

/// Whether the name ends in .yaml or .yml.
bool has_yaml_name(const std::filesystem::path& file);

}  // namespace dyop::io_internal
