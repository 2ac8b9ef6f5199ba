// SPDX-License-Identifier: BSD-3-Clause
#include "io/yaml_reader.h"

#include <charconv>
#include <set>
#include <string_view>

#include "io/text_scanner.h"

namespace dyop::io_internal {
namespace {

// As deep as JSON is read (JsonNode::at).
constexpr int kDeepest = 64;

// A line with content. What a sequence's dash precedes is taken for a line of its own, indented by
// as much as it is.
struct Line {
  std::size_t begin = 0;  // of the line in the text
  std::size_t at = 0;     // of the content
  std::size_t end = 0;    // after its last character
  std::size_t indent() const { return at - begin; }
};

bool is_space(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

class YamlReader {
 public:
  YamlReader(const std::filesystem::path& file, const std::string& text)
      : file_(file), text_(text) {}

  Json read();

 private:
  void split_lines();
  bool is_over() const { return line_ == lines_.size(); }
  const Line& line() const { return lines_[line_]; }
  std::string_view content() const {
    return std::string_view(text_).substr(line().at, line().end - line().at);
  }
  bool is_item() const;
  std::optional<std::size_t> colon() const;

  Json read_block(int depth);
  Json read_sequence(int depth);
  Json read_mapping(int depth);
  Json read_value(std::size_t at, std::size_t indent, bool is_of_mapping, int depth);
  Json read_inline(std::size_t at, int depth);

  Json read_flow(std::size_t& at, int depth);
  Json read_flow_sequence(std::size_t& at, int depth);
  Json read_flow_mapping(std::size_t& at, int depth);
  std::string read_key_of_flow(std::size_t& at);
  bool end_of_entry(std::size_t& at, char closing);
  void skip_space(std::size_t& at) const;
  std::string read_quoted(std::size_t& at);
  void append_escape(std::size_t& at, std::string& result);
  std::string_view plain_until_comment(std::size_t at) const;
  Json scalar(std::string_view word) const;
  void refuse_unread(std::size_t at) const;

  void insert(Json& object, std::set<std::string>& keys, const std::string& key, std::size_t at,
              Json value) const;
  void require_depth(int depth, std::size_t at) const;
  [[noreturn]] void fail(std::size_t at, const std::string& problem) const;

  const std::filesystem::path& file_;
  const std::string& text_;
  std::vector<Line> lines_;
  std::size_t line_ = 0;
};

void YamlReader::fail(std::size_t at, const std::string& problem) const {
  std::size_t number = 1;
  std::size_t begin = 0;
  for (std::size_t k = 0; k < std::min(at, text_.size()); ++k) {
    if (text_[k] != '\n') continue;
    ++number;
    begin = k + 1;
  }
  throw FileError(file_, FilePosition{number, at - begin + 1}, problem);
}

void YamlReader::require_depth(int depth, std::size_t at) const {
  if (depth > kDeepest) fail(at, "nested too deeply");
}

// Lines without content, directives and the marks of the document are left out.
void YamlReader::split_lines() {
  bool has_begun = false;
  bool has_ended = false;
  for (std::size_t begin = 0; begin < text_.size();) {
    std::size_t end = text_.find('\n', begin);
    if (end == std::string::npos) end = text_.size();
    Line line{begin, begin, end};
    while (line.at < end && text_[line.at] == ' ') ++line.at;
    while (line.end > line.at && is_space(text_[line.end - 1])) --line.end;
    const std::string_view content = std::string_view(text_).substr(line.at, line.end - line.at);
    begin = end + 1;
    if (content.empty() || content[0] == '#') continue;
    const bool is_at_margin = line.indent() == 0;
    if (is_at_margin && (content == "---" || content == "...")) {
      has_ended = has_ended || content == "..." || has_begun || !lines_.empty();
      has_begun = true;
      continue;
    }
    if (is_at_margin && content[0] == '%' && lines_.empty()) continue;
    if (has_ended) fail(line.at, "expected one document, found a second one");
    if (content[0] == '\t') fail(line.at, "expected spaces before the content, found a tab");
    lines_.push_back(line);
  }
}

bool YamlReader::is_item() const {
  return content() == "-" || content().starts_with("- ");
}

// Where the key of the line ends, in the text.
std::optional<std::size_t> YamlReader::colon() const {
  std::size_t at = line().at;
  if (text_[at] == '"' || text_[at] == '\'') {
    const char quote = text_[at];
    for (++at; at < line().end; ++at) {
      if (quote == '"' && text_[at] == '\\') {
        ++at;
      } else if (text_[at] == quote) {
        const bool is_doubled = quote == '\'' && at + 1 < line().end && text_[at + 1] == quote;
        if (!is_doubled) break;
        ++at;
      }
    }
    ++at;
    while (at < line().end && is_space(text_[at])) ++at;
    if (at < line().end && text_[at] == ':') return at;
    return std::nullopt;
  }
  if (text_[at] == '[' || text_[at] == '{') return std::nullopt;
  for (; at < line().end; ++at) {
    if (text_[at] == '#' && is_space(text_[at - 1])) return std::nullopt;
    if (text_[at] == ':' && (at + 1 == line().end || is_space(text_[at + 1]))) return at;
  }
  return std::nullopt;
}

Json YamlReader::read_block(int depth) {
  require_depth(depth, line().at);
  if (is_item()) return read_sequence(depth);
  if (colon()) return read_mapping(depth);
  return read_inline(line().at, depth);
}

Json YamlReader::read_sequence(int depth) {
  const std::size_t indent = line().indent();
  Json result = Json::array();
  while (!is_over() && line().indent() == indent && is_item()) {
    std::size_t at = line().at + 1;
    while (at < line().end && is_space(text_[at])) ++at;
    const bool is_empty = at == line().end || text_[at] == '#';
    if (is_empty) {
      result.push_back(read_value(at, indent, false, depth + 1));
      continue;
    }
    lines_[line_].at = at;
    result.push_back(read_block(depth + 1));
  }
  if (!is_over() && line().indent() > indent) fail(line().at, "unexpected indentation");
  return result;
}

Json YamlReader::read_mapping(int depth) {
  const std::size_t indent = line().indent();
  Json result = Json::object();
  std::set<std::string> keys;
  while (!is_over() && line().indent() == indent && !is_item()) {
    const std::size_t key_at = line().at;
    const std::optional<std::size_t> found = colon();
    if (!found) fail(key_at, "expected a key and a colon, found " + quote(content()));
    std::size_t at = key_at;
    std::string key;
    if (text_[at] == '"' || text_[at] == '\'') {
      key = read_quoted(at);
    } else {
      refuse_unread(at);
      key = text_.substr(at, *found - at);
      while (!key.empty() && is_space(key.back())) key.pop_back();
    }
    insert(result, keys, key, key_at, read_value(*found + 1, indent, true, depth + 1));
  }
  if (!is_over() && line().indent() > indent) fail(line().at, "unexpected indentation");
  return result;
}

void YamlReader::insert(Json& object, std::set<std::string>& keys, const std::string& key,
                        std::size_t at, Json value) const {
  if (!keys.insert(key).second) fail(at, "the key " + quote(key) + " occurs twice in one mapping");
  // No search for the key: there is none.
  object.get_ref<Json::object_t&>().push_back({key, std::move(value)});
}

// What follows a key or a dash: on its line, or in the lines below.
Json YamlReader::read_value(std::size_t at, std::size_t indent, bool is_of_mapping, int depth) {
  while (at < line().end && is_space(text_[at])) ++at;
  if (at < line().end && text_[at] != '#') return read_inline(at, depth);
  ++line_;
  if (is_over()) return {};
  // The items of a sequence may stand below their key without indentation.
  const bool is_flush = is_of_mapping && line().indent() == indent && is_item();
  return line().indent() > indent || is_flush ? read_block(depth) : Json();
}

// A value that begins on this line; goes to the line after it.
Json YamlReader::read_inline(std::size_t at, int depth) {
  const char first = text_[at];
  Json result;
  if (first == '[' || first == '{') {
    result = read_flow(at, depth);
  } else if (first == '"' || first == '\'') {
    result = read_quoted(at);
  } else {
    refuse_unread(at);
    const std::string_view word = plain_until_comment(at);
    at += word.size();
    result = scalar(word);
  }
  while (line_ + 1 < lines_.size() && lines_[line_ + 1].begin < at) ++line_;
  while (at < line().end && is_space(text_[at])) ++at;
  if (at < line().end && text_[at] != '#') fail(at, "unexpected text after a value");
  ++line_;
  return result;
}

// To the end of the line, or to a comment.
std::string_view YamlReader::plain_until_comment(std::size_t at) const {
  std::size_t end = at;
  while (end < line().end && !(text_[end] == '#' && end > at && is_space(text_[end - 1]))) {
    if (text_[end] == ':' && end + 1 < line().end && text_[end + 1] == ' ') {
      fail(end, "unexpected colon in a value");
    }
    ++end;
  }
  while (end > at && is_space(text_[end - 1])) --end;
  return std::string_view(text_).substr(at, end - at);
}

void YamlReader::refuse_unread(std::size_t at) const {
  switch (text_[at]) {
    case '&':
    case '*':
      fail(at, "anchors and aliases are not read");
    case '!':
      fail(at, "tags are not read");
    case '|':
    case '>':
      fail(at, "text in several lines is not read");
    case '?':
      if (at + 1 == text_.size() || is_space(text_[at + 1])) fail(at, "long keys are not read");
      break;
    case '@':
    case '`':
    case ']':
    case '}':
    case ',':
      fail(at, std::string("unexpected '") + text_[at] + "'");
    default:
      break;
  }
}

Json YamlReader::scalar(std::string_view word) const {
  if (word.empty() || word == "~" || word == "null" || word == "Null" || word == "NULL") return {};
  if (word == "true" || word == "True" || word == "TRUE") return true;
  if (word == "false" || word == "False" || word == "FALSE") return false;
  const std::string_view digits = word.starts_with('+') ? word.substr(1) : word;
  const char* const end = digits.data() + digits.size();
  // Neither "infinity" nor "nan" is a number of YAML.
  const bool may_be_number = !digits.empty() && (std::string_view("0123456789.-").find(digits[0]) !=
                                                 std::string_view::npos);
  const bool has_letter = digits.find_first_of("iInN") != std::string_view::npos;
  if (may_be_number && !has_letter) {
    std::int64_t integer = 0;
    if (const auto read = std::from_chars(digits.data(), end, integer);
        read.ec == std::errc() && read.ptr == end) {
      return integer;
    }
    Scalar number = 0;
    if (const auto read = std::from_chars(digits.data(), end, number);
        read.ec == std::errc() && read.ptr == end) {
      return number;
    }
  }
  return std::string(word);
}

void YamlReader::append_escape(std::size_t& at, std::string& result) {
  constexpr std::string_view kNames = "ntr0\"\\/";
  constexpr std::string_view kValues{"\n\t\r\0\"\\/", 7};
  const std::size_t which = at < text_.size() ? kNames.find(text_[at]) : std::string_view::npos;
  if (which == std::string_view::npos) fail(at, "unknown escape");
  result += kValues[which];
  ++at;
}

std::string YamlReader::read_quoted(std::size_t& at) {
  const std::size_t begin = at;
  const char quote = text_[at++];
  std::string result;
  while (at < text_.size() && text_[at] != '\n') {
    const char c = text_[at++];
    if (c == quote && quote == '\'' && at < text_.size() && text_[at] == '\'') {
      result += text_[at++];
    } else if (c == quote) {
      return result;
    } else if (c == '\\' && quote == '"') {
      append_escape(at, result);
    } else {
      result += c;
    }
  }
  fail(begin, "expected the closing quotation mark on the same line");
}

// Over blanks, ends of lines and comments.
void YamlReader::skip_space(std::size_t& at) const {
  while (at < text_.size()) {
    if (text_[at] == '#' && (is_space(text_[at - 1]) || text_[at - 1] == '\n')) {
      while (at < text_.size() && text_[at] != '\n') ++at;
    } else if (is_space(text_[at]) || text_[at] == '\n') {
      ++at;
    } else {
      return;
    }
  }
}

Json YamlReader::read_flow(std::size_t& at, int depth) {
  require_depth(depth, at);
  if (at == text_.size()) fail(at, "expected a value, found the end of the file");
  if (text_[at] == '[') return read_flow_sequence(at, depth);
  if (text_[at] == '{') return read_flow_mapping(at, depth);
  if (text_[at] == '"' || text_[at] == '\'') return read_quoted(at);
  refuse_unread(at);
  std::size_t end = at;
  while (end < text_.size() && std::string_view(",[]{}\n").find(text_[end]) == std::string::npos &&
         !(text_[end] == '#' && is_space(text_[end - 1]))) {
    ++end;
  }
  std::string_view word = std::string_view(text_).substr(at, end - at);
  at = end;
  while (!word.empty() && is_space(word.back())) word.remove_suffix(1);
  return scalar(word);
}

// After an entry: true at the closing bracket, which it passes; otherwise a comma must follow.
bool YamlReader::end_of_entry(std::size_t& at, char closing) {
  skip_space(at);
  if (at < text_.size() && text_[at] == ',') {
    ++at;
    skip_space(at);
    if (at == text_.size() || text_[at] != closing) return false;
  }
  if (at < text_.size() && text_[at] == closing) {
    ++at;
    return true;
  }
  fail(at, std::string("expected ',' or '") + closing + "'");
}

Json YamlReader::read_flow_sequence(std::size_t& at, int depth) {
  Json result = Json::array();
  skip_space(++at);
  if (at < text_.size() && text_[at] == ']') {
    ++at;
    return result;
  }
  do {
    result.push_back(read_flow(at, depth + 1));
  } while (!end_of_entry(at, ']'));
  return result;
}

std::string YamlReader::read_key_of_flow(std::size_t& at) {
  if (at < text_.size() && (text_[at] == '"' || text_[at] == '\'')) return read_quoted(at);
  const std::size_t begin = at;
  while (at < text_.size() && std::string_view(":,[]{}\n").find(text_[at]) == std::string::npos) {
    ++at;
  }
  std::string key = text_.substr(begin, at - begin);
  while (!key.empty() && is_space(key.back())) key.pop_back();
  return key;
}

Json YamlReader::read_flow_mapping(std::size_t& at, int depth) {
  Json result = Json::object();
  std::set<std::string> keys;
  skip_space(++at);
  if (at < text_.size() && text_[at] == '}') {
    ++at;
    return result;
  }
  do {
    const std::size_t key_at = at;
    const std::string key = read_key_of_flow(at);
    skip_space(at);
    if (at == text_.size() || text_[at] != ':') fail(at, "expected a colon after a key");
    skip_space(++at);
    insert(result, keys, key, key_at, read_flow(at, depth + 1));
  } while (!end_of_entry(at, '}'));
  return result;
}

Json YamlReader::read() {
  split_lines();
  if (lines_.empty()) return {};
  Json result = read_block(0);
  if (!is_over()) fail(line().at, "unexpected text: " + quote(content()));
  return result;
}

}  // namespace

Json parse_yaml(const std::filesystem::path& file, const std::string& text) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) return parse_yaml(file, text.substr(3));
  return YamlReader(file, text).read();
}

bool has_yaml_name(const std::filesystem::path& file) {
  return file.extension() == ".yaml" || file.extension() == ".yml";
}

Json parse_structured(const std::filesystem::path& file, const std::string& text) {
  return has_yaml_name(file) ? parse_yaml(file, text) : parse_json(file, text);
}

}  // namespace dyop::io_internal
