// SPDX-License-Identifier: BSD-3-Clause
#include "io/robot/xml_reader.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>

#include "io/file_bytes.h"

namespace dyop::io_internal {
namespace {

using core_internal::compose_message;

// Longer values of attributes are cut in messages.
constexpr std::size_t kLongestQuote = 60;

std::string quoted(std::string value) {
  if (value.size() > kLongestQuote) value = value.substr(0, kLongestQuote) + "...";
  return "'" + value + "'";
}

// Whether the text is UTF-8: no overlong form, no surrogate, nothing beyond U+10FFFF.
bool is_utf8(std::string_view text) {
  constexpr std::uint32_t kLeast[] = {0, 0x80, 0x800, 0x10000};
  std::uint32_t code = 0;
  std::size_t length = 0;  // bytes after the first one
  std::size_t rest = 0;
  for (const char c : text) {
    const std::uint32_t byte = static_cast<unsigned char>(c);
    if (rest > 0) {
      if ((byte & 0xc0) != 0x80) return false;
      code = code << 6 | (byte & 0x3f);
      if (--rest > 0) continue;
      const bool is_surrogate = 0xd800 <= code && code < 0xe000;
      if (code < kLeast[length] || code > 0x10ffff || is_surrogate) return false;
    } else if (byte >= 0x80) {
      if (byte < 0xc0 || byte >= 0xf8) return false;
      length = rest = byte < 0xe0 ? 1 : byte < 0xf0 ? 2 : 3;
      code = byte & (0x3f >> length);
    }
  }
  return rest == 0;
}

// Numbers between blanks; nothing if a word is not a finite number.
std::optional<std::vector<Scalar>> parse_numbers(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  std::vector<Scalar> numbers;
  while (true) {
    const std::size_t begin = text.find_first_not_of(kBlanks);
    if (begin == std::string_view::npos) return numbers;
    text.remove_prefix(begin);
    const std::string_view word = text.substr(0, text.find_first_of(kBlanks));
    const std::size_t sign = word.size() > 1 && word.front() == '+' && word[1] != '-' ? 1 : 0;
    Scalar value = 0;
    const auto [end, error] = std::from_chars(word.data() + sign, word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
    if (!std::isfinite(value)) return std::nullopt;
    numbers.push_back(value);
    text.remove_prefix(word.size());
  }
}

}  // namespace

std::optional<XmlNode> XmlNode::find(const char* child) const {
  const tinyxml2::XMLElement* found = element_->FirstChildElement(child);
  if (found == nullptr) return std::nullopt;
  return XmlNode(*file_, *found);
}

XmlNode XmlNode::at(const char* child) const {
  const std::optional<XmlNode> found = find(child);
  if (!found) fail(compose_message("expected an element <", child, ">"));
  return *found;
}

std::vector<XmlNode> XmlNode::all(const char* child) const {
  std::vector<XmlNode> nodes;
  for (const auto* next = element_->FirstChildElement(child); next != nullptr;
       next = next->NextSiblingElement(child)) {
    nodes.emplace_back(*file_, *next);
  }
  return nodes;
}

std::vector<XmlNode> XmlNode::children() const {
  return all(nullptr);
}

std::vector<std::pair<std::string, std::string>> XmlNode::attributes() const {
  std::vector<std::pair<std::string, std::string>> result;
  for (const auto* next = element_->FirstAttribute(); next != nullptr; next = next->Next()) {
    result.emplace_back(next->Name(), next->Value());
  }
  return result;
}

std::string XmlNode::text(const char* attribute) const {
  const char* value = element_->Attribute(attribute);
  if (value == nullptr || *value == '\0') {
    fail(compose_message("expected the attribute '", attribute, "'"));
  }
  if (!is_utf8(value)) fail_expected(attribute, "UTF-8");
  return value;
}

Scalar XmlNode::number(const char* attribute) const {
  const auto numbers = parse_numbers(text(attribute));
  if (!numbers || numbers->size() != 1) fail_expected(attribute, "a finite number");
  return (*numbers)[0];
}

Scalar XmlNode::number_or(const char* attribute, Scalar otherwise) const {
  return has(attribute) ? number(attribute) : otherwise;
}

Scalar XmlNode::positive(const char* attribute) const {
  const Scalar value = number(attribute);
  if (!(value > 0)) fail_expected(attribute, "a number > 0");
  return value;
}

std::vector<Scalar> XmlNode::numbers(const char* attribute) const {
  const auto numbers = parse_numbers(text(attribute));
  if (!numbers) fail_expected(attribute, "finite numbers");
  return *numbers;
}

Vector3 XmlNode::vector3(const char* attribute) const {
  const auto numbers = parse_numbers(text(attribute));
  if (!numbers || numbers->size() != 3) fail_expected(attribute, "three finite numbers");
  return {(*numbers)[0], (*numbers)[1], (*numbers)[2]};
}

Vector3 XmlNode::vector3_or(const char* attribute, const Vector3& otherwise) const {
  return has(attribute) ? vector3(attribute) : otherwise;
}

namespace {

// Of an <origin>: roll, pitch and yaw, or the quaternion of URDF 1.2.
Matrix3 rotation_of(const XmlNode& node) {
  if (!node.has("quat_xyzw")) {
    const Vector3 rpy = node.vector3_or("rpy", Vector3::Zero());
    return (Eigen::AngleAxisd(rpy.z(), Vector3::UnitZ()) *
            Eigen::AngleAxisd(rpy.y(), Vector3::UnitY()) *
            Eigen::AngleAxisd(rpy.x(), Vector3::UnitX()))
        .toRotationMatrix();
  }
  if (node.has("rpy")) node.fail("expected one of the attributes 'rpy' and 'quat_xyzw'");
  const std::vector<Scalar> q = node.numbers("quat_xyzw");
  // literal: files round quaternions; farther from a unit one is a mistake
  constexpr Scalar kLargestStray = 1e-3;
  const bool is_unit =
      q.size() == 4 && std::abs(Quaternion(q[3], q[0], q[1], q[2]).norm() - 1) < kLargestStray;
  if (!is_unit) node.fail_expected("quat_xyzw", "a unit quaternion x y z w");
  return Quaternion(q[3], q[0], q[1], q[2]).normalized().toRotationMatrix();
}

}  // namespace

RigidPose XmlNode::origin() const {
  const std::optional<XmlNode> node = find("origin");
  if (!node) return RigidPose();
  return RigidPose(rotation_of(*node), node->vector3_or("xyz", Vector3::Zero()));
}

void XmlNode::fail(const std::string& problem) const {
  const char* name_of_element = element_->Attribute("name");
  const std::string which = name_of_element == nullptr ? "" : " " + quoted(name_of_element);
  throw FileError(*file_, FilePosition{std::size_t(std::max(element_->GetLineNum(), 1)), {}},
                  compose_message("<", element_->Name(), ">", which, ": ", problem));
}

void XmlNode::fail_expected(const char* attribute, const std::string& what) const {
  const char* value = element_->Attribute(attribute);
  fail(compose_message(attribute, ": expected ", what, ", found ",
                       quoted(value == nullptr ? "" : value)));
}

XmlFile::XmlFile(const std::filesystem::path& file, std::initializer_list<const char*> roots)
    : file_(file) {
  const std::string bytes = read_bytes(file);
  const tinyxml2::XMLError error = document_.Parse(bytes.data(), bytes.size());
  if (error != tinyxml2::XML_SUCCESS) {
    const auto line = std::size_t(std::max(document_.ErrorLineNum(), 1));
    throw FileError(
        file_, FilePosition{line, {}},
        compose_message("not well-formed XML: ", tinyxml2::XMLDocument::ErrorIDToName(error)));
  }
  if (document_.RootElement() == nullptr) throw FileError(file_, "the file has no element");
  const std::string_view name = document_.RootElement()->Name();
  if (roots.size() == 0 || std::find(roots.begin(), roots.end(), name) != roots.end()) return;
  std::string names;
  for (const char* root : roots) names += compose_message(names.empty() ? "<" : " or <", root, ">");
  root().fail(compose_message("expected the root element ", names));
}

}  // namespace dyop::io_internal
