// SPDX-License-Identifier: BSD-3-Clause
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <charconv>
#include <set>
#include <sstream>
#include <string_view>
#include <vector>

#include "io/json_reader.h"
#include "io/text_scanner.h"

namespace dyop::io_internal {
namespace {

// As deep as JSON is read (JsonNode::at).
constexpr std::size_t kDeepest = 64;

// A plain scalar: null, a truth value, a number or text. Neither "infinity" nor "nan" is a number
// of YAML.
Json plain_scalar(std::string_view word) {
  if (word == "true" || word == "True" || word == "TRUE") return true;
  if (word == "false" || word == "False" || word == "FALSE") return false;
  const std::string_view digits = word.starts_with('+') ? word.substr(1) : word;
  const char* const end = digits.data() + digits.size();
  const bool may_be_number =
      !digits.empty() && std::string_view("0123456789.-").find(digits[0]) != std::string_view::npos;
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

// Builds the tree of one document from what the parser meets, and refuses what JSON has not.
class TreeBuilder final : public YAML::EventHandler {
 public:
  explicit TreeBuilder(const std::filesystem::path& file) : file_(file) {}

  Json take() { return std::move(root_); }
  const YAML::Mark& start() const { return start_; }
  [[noreturn]] void fail(const YAML::Mark& mark, const std::string& problem) const {
    // Nowhere at all is the end of an empty file.
    const std::size_t line = std::size_t(std::max(mark.line, 0)) + 1;
    throw FileError(file_, FilePosition{line, std::size_t(std::max(mark.column, 0)) + 1}, problem);
  }

  void OnDocumentStart(const YAML::Mark& mark) override { start_ = mark; }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    refuse(mark, anchor, "");
    if (is_key()) fail(mark, "expected text as a key, found nothing");
    add(mark, {}, "");
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override { refuse(mark, 1, ""); }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    refuse(mark, anchor, tag);
    add(mark, tag == "?" ? plain_scalar(value) : Json(value), value);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    open(mark, tag, anchor, Json::array());
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    open(mark, tag, anchor, Json::object());
  }
  void OnMapEnd() override { close(); }

 private:
  // A list or an object that is being read.
  struct Open {
    Json value;
    YAML::Mark mark;
    std::set<std::string> keys;  // of an object
    bool has_key = false;        // whose value comes next
  };

  // The tags that the parser gives where the file has none.
  void refuse(const YAML::Mark& mark, YAML::anchor_t anchor, const std::string& tag) const {
    if (anchor != YAML::NullAnchor) fail(mark, "anchors and aliases are not read");
    if (!tag.empty() && tag != "?" && tag != "!") fail(mark, "tags are not read");
  }

  void open(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor, Json value) {
    refuse(mark, anchor, tag);
    if (open_.size() >= kDeepest) fail(mark, "nested too deeply");
    if (is_key()) {
      fail(mark, "expected text as a key, found a list or a mapping, or one without its end");
    }
    open_.push_back({std::move(value), mark, {}, false});
  }

  void close() {
    Open done = std::move(open_.back());
    open_.pop_back();
    add(done.mark, std::move(done.value), "");
  }

  bool is_key() const {
    return !open_.empty() && open_.back().value.is_object() && !open_.back().has_key;
  }

  // `word`: the value as it is written, which it is as a key.
  void add(const YAML::Mark& mark, Json value, const std::string& word) {
    if (open_.empty()) {
      root_ = std::move(value);
    } else if (open_.back().value.is_array()) {
      open_.back().value.push_back(std::move(value));
    } else if (is_key()) {
      if (!open_.back().keys.insert(word).second) {
        fail(mark, "the key " + quote(word) + " occurs twice in one mapping");
      }
      // No search for the key: there is none.
      open_.back().value.get_ref<Json::object_t&>().push_back({word, Json()});
      open_.back().has_key = true;
    } else {
      open_.back().value.get_ref<Json::object_t&>().back().second = std::move(value);
      open_.back().has_key = false;
    }
  }

  const std::filesystem::path& file_;
  YAML::Mark start_ = YAML::Mark::null_mark();
  Json root_;
  std::vector<Open> open_;
};

// The parser takes a byte 4 for the end of the text, and zeros for another encoding.
void require_text(const std::filesystem::path& file, const std::string& text) {
  std::size_t line = 1;
  std::size_t begin = 0;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const auto byte = static_cast<unsigned char>(text[at]);
    if (byte == '\n') {
      ++line;
      begin = at + 1;
    } else if (byte < ' ' && byte != '\t' && byte != '\r') {
      throw FileError(file, FilePosition{line, at - begin + 1},
                      "expected text, found a byte " + std::to_string(byte));
    }
  }
}

// The one document of the text. Some texts are documents without end to the parser, which stays
// where it is: it is asked for one document more, which must be empty and further on.
Json read_document(const std::filesystem::path& file, const std::string& text) {
  // A mark of the end: the parser takes the end of the file for a closing quotation mark.
  std::istringstream stream(text + (text.ends_with('\n') ? "...\n" : "\n...\n"));
  YAML::Parser parser(stream);
  TreeBuilder first(file);
  if (!parser.HandleNextDocument(first)) return {};
  TreeBuilder second(file);
  if (parser.HandleNextDocument(second)) {
    const YAML::Mark& at = second.start();
    if (at.pos <= first.start().pos) {
      const std::size_t place = std::min(std::size_t(std::max(at.pos, 0)), text.size());
      second.fail(at, "unexpected " + quote(text.substr(place, 1)) + " outside of any value");
    }
    TreeBuilder third(file);
    if (!second.take().is_null() || parser.HandleNextDocument(third)) {
      second.fail(at, "expected one document, found a second one");
    }
  }
  return first.take();
}

// What the parser says of an error, or what is more likely the cause.
std::string explain(const YAML::Exception& error, const std::string& text) {
  if (error.msg.find("anchor is not defined") != std::string::npos) {
    return "anchors and aliases are not read";
  }
  if (std::size_t(std::max(error.mark.pos, 0)) >= text.size() &&
      error.msg.find("document indicator in scalar") != std::string::npos) {
    return "expected the closing quotation mark, found the end of the file";
  }
  std::istringstream lines(text);
  std::string line;
  for (int k = 0; k <= error.mark.line; ++k) std::getline(lines, line);
  const std::string margin = line.substr(0, line.find_first_not_of(" \t"));
  if (margin.find('\t') == std::string::npos) return error.msg;
  return error.msg + "; expected spaces before the content, found a tab";
}

}  // namespace

Json parse_yaml(const std::filesystem::path& file, const std::string& text) {
  require_text(file, text);
  try {
    return read_document(file, text);
  } catch (const YAML::Exception& error) {
    TreeBuilder(file).fail(error.mark, explain(error, text));
  }
}

bool has_yaml_name(const std::filesystem::path& file) {
  return file.extension() == ".yaml" || file.extension() == ".yml";
}

Json parse_structured(const std::filesystem::path& file, const std::string& text) {
  return has_yaml_name(file) ? parse_yaml(file, text) : parse_json(file, text);
}

}  // namespace dyop::io_internal
