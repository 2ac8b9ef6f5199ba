// SPDX-License-Identifier: BSD-3-Clause
#include "check/trusted/json.h"

#include <cmath>
#include <cstdlib>

namespace dyop_check {
namespace {

constexpr int kDeepest = 200;

class Parser {
 public:
  explicit Parser(std::string_view text) : text_(text) {}

  Json whole() {
    Json value = parse(0);
    skip_space();
    if (at_ != text_.size()) fail();
    return value;
  }

 private:
  [[noreturn]] void fail() const {
    throw BadFile("ill-formed JSON at byte " + std::to_string(at_));
  }
  void skip_space() {
    while (at_ < text_.size() && std::string_view(" \t\r\n").find(text_[at_]) != text_.npos) ++at_;
  }
  char peek() {
    skip_space();
    if (at_ == text_.size()) fail();
    return text_[at_];
  }
  bool take(char c) {
    if (peek() != c) return false;
    ++at_;
    return true;
  }
  void expect(char c) {
    if (!take(c)) fail();
  }

  Json parse(int depth) {
    if (depth > kDeepest) fail();
    switch (peek()) {
      case '{':
        return object(depth);
      case '[':
        return list(depth);
      case '"':
        return text();
      default:
        return word();
    }
  }

  Json object(int depth) {
    Json value;
    value.kind = Json::Kind::Object;
    expect('{');
    if (take('}')) return value;
    do {
      if (peek() != '"') fail();
      const std::string key = text().text;
      expect(':');
      value.object[key] = parse(depth + 1);
    } while (take(','));
    expect('}');
    return value;
  }

  Json list(int depth) {
    Json value;
    value.kind = Json::Kind::List;
    expect('[');
    if (take(']')) return value;
    do {
      value.list.push_back(parse(depth + 1));
    } while (take(','));
    expect(']');
    return value;
  }

  // Escapes are kept as they are: names are compared and printed, nothing else.
  Json text() {
    Json value;
    value.kind = Json::Kind::Text;
    expect('"');
    while (at_ < text_.size() && text_[at_] != '"') {
      if (text_[at_] == '\\') value.text += text_[at_++];
      if (at_ == text_.size()) fail();
      value.text += text_[at_++];
    }
    if (at_ == text_.size()) fail();
    ++at_;
    return value;
  }

  Json word() {
    std::size_t end = at_;
    while (end < text_.size() && std::string_view(",]} \t\r\n").find(text_[end]) == text_.npos)
      ++end;
    const std::string token(text_.substr(at_, end - at_));
    Json value;
    if (token == "null") {
    } else if (token == "true" || token == "false") {
      value.kind = Json::Kind::Boolean;
      value.boolean = token == "true";
    } else {
      char* rest = nullptr;
      value.kind = Json::Kind::Number;
      value.number = std::strtod(token.c_str(), &rest);
      if (token.empty() || *rest != '\0') fail();
    }
    at_ = end;
    return value;
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

}  // namespace

const Json* Json::find(const std::string& key) const {
  const auto member = object.find(key);
  return member == object.end() ? nullptr : &member->second;
}

const Json& Json::at(const std::string& key) const {
  const Json* member = find(key);
  if (member == nullptr) throw BadFile("the key '" + key + "' is missing");
  return *member;
}

double Json::to_number() const {
  double value = number;
  if (kind == Kind::Text) {
    char* rest = nullptr;
    value = std::strtod(text.c_str(), &rest);
    if (text.empty() || *rest != '\0') throw BadFile("expected a number, found '" + text + "'");
  } else if (kind != Kind::Number) {
    throw BadFile("expected a number");
  }
  if (!std::isfinite(value)) throw BadFile("expected a finite number");
  return value;
}

std::vector<double> Json::to_numbers(std::size_t count) const {
  if (kind != Kind::List || list.size() != count) {
    throw BadFile("expected " + std::to_string(count) + " numbers");
  }
  std::vector<double> numbers;
  for (const Json& entry : list) numbers.push_back(entry.to_number());
  return numbers;
}

bool Json::to_boolean() const {
  if (kind != Kind::Boolean) throw BadFile("expected true or false");
  return boolean;
}

std::size_t index_of(const Json& json, std::size_t limit) {
  const double value = json.to_number();
  if (!(value >= 0 && value < double(limit) && value == std::floor(value)))
    throw BadFile("an index is out of range");
  return std::size_t(value);
}

Json parse_json(std::string_view text) {
  return Parser(text).whole();
}

}  // namespace dyop_check
