// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

/// JSON, as far as recordings need it. TRUSTED.
namespace dyop_check {

/// What a file may contain and still be unusable.
class BadFile : public std::exception {
 public:
  explicit BadFile(std::string what) : what_(std::move(what)) {}
  const char* what() const noexcept override { return what_.c_str(); }

 private:
  std::string what_;
};

struct Json {
  enum class Kind { Null, Boolean, Number, Text, List, Object };
  Kind kind = Kind::Null;
  bool boolean = false;
  double number = 0;
  std::string text;
  std::vector<Json> list;
  std::map<std::string, Json> object;

  /// Null if there is no such member.
  const Json* find(const std::string& key) const;
  /// @throws BadFile if there is no such member.
  const Json& at(const std::string& key) const;
  /// A number, or a string that is one in hexadecimal.
  /// @throws BadFile unless it is finite.
  double to_number() const;
  /// @throws BadFile unless there are `count` numbers.
  std::vector<double> to_numbers(std::size_t count) const;
  /// @throws BadFile unless it is true or false.
  bool to_boolean() const;

  bool operator==(const Json&) const = default;
};

/// A whole number below a limit.
/// @throws BadFile
std::size_t index_of(const Json& json, std::size_t limit);

/// @throws BadFile
Json parse_json(std::string_view text);

}  // namespace dyop_check
