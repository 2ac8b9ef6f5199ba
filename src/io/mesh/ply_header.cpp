// SPDX-License-Identifier: BSD-3-Clause
#include "io/mesh/ply_header.h"

#include <algorithm>

namespace dyop::io_internal {
namespace {

PlyType parse_type(const TextScanner& scanner, std::string_view word) {
  if (word == "char" || word == "int8") return {1, false, true};
  if (word == "uchar" || word == "uint8") return {1, false, false};
  if (word == "short" || word == "int16") return {2, false, true};
  if (word == "ushort" || word == "uint16") return {2, false, false};
  if (word == "int" || word == "int32") return {4, false, true};
  if (word == "uint" || word == "uint32") return {4, false, false};
  if (word == "float" || word == "float32") return {4, true, true};
  if (word == "double" || word == "float64") return {8, true, true};
  scanner.fail("expected a property type, found " + quote(word));
}

PlyProperty parse_property(const TextScanner& scanner) {
  const auto& words = scanner.words();
  if (words.size() == 5 && words[1] == "list") {
    return {std::string(words[4]), parse_type(scanner, words[3]), parse_type(scanner, words[2])};
  }
  if (words.size() != 3) scanner.fail("expected 'property <type> <name>'");
  return {std::string(words[2]), parse_type(scanner, words[1]), std::nullopt};
}

PlyElement parse_element(const TextScanner& scanner) {
  const auto& words = scanner.words();
  if (words.size() != 3) scanner.fail("expected 'element <name> <count>'");
  const std::int64_t count = scanner.integer(words[2], "number of elements");
  if (count < 0) scanner.fail("number of elements must not be negative");
  return {std::string(words[1]), count, {}};
}

PlyEncoding parse_encoding(const TextScanner& scanner) {
  const auto& words = scanner.words();
  if (words.size() > 1 && words[1] == "ascii") return PlyEncoding::Ascii;
  if (words.size() > 1 && words[1] == "binary_little_endian") return PlyEncoding::LittleEndian;
  if (words.size() > 1 && words[1] == "binary_big_endian") return PlyEncoding::BigEndian;
  scanner.fail("expected 'format ascii', 'binary_little_endian' or 'binary_big_endian'");
}

void check_elements(const TextScanner& scanner, const PlyHeader& header) {
  int vertex_elements = 0;
  for (const PlyElement& element : header.elements) {
    if (element.name == "vertex" && ++vertex_elements > 1) {
      scanner.fail("element 'vertex' occurs twice in the header");
    }
    if (element.count == 0) continue;
    if (element.properties.empty()) {
      scanner.fail("element " + quote(element.name) + " has no property");
    }
    for (const char* axis : {"x", "y", "z"}) {
      if (element.name == "vertex" && !element.find(axis, /*is_list=*/false)) {
        scanner.fail("element 'vertex' has no number " + quote(axis));
      }
    }
    if ((element.name == "face" || element.name == "tristrips") && !element.find_vertex_list()) {
      scanner.fail("element " + quote(element.name) + " has no list 'vertex_indices'");
    }
  }
}

}  // namespace

std::optional<std::size_t> PlyElement::find(std::string_view property, bool is_list) const {
  const auto found =
      std::find_if(properties.begin(), properties.end(), [&](const PlyProperty& candidate) {
        return candidate.name == property && candidate.count_type.has_value() == is_list;
      });
  if (found == properties.end()) return std::nullopt;
  return std::size_t(found - properties.begin());
}

std::optional<std::size_t> PlyElement::find_vertex_list() const {
  const auto plural = find("vertex_indices", /*is_list=*/true);
  return plural ? plural : find("vertex_index", /*is_list=*/true);
}

std::int64_t PlyHeader::vertex_count() const {
  for (const PlyElement& element : elements) {
    if (element.name == "vertex") return element.count;
  }
  return 0;
}

PlyHeader read_ply_header(TextScanner& scanner) {
  PlyHeader header;
  if (!scanner.next_line() || scanner.words().empty() || scanner.words().front() != "ply") {
    scanner.fail("expected the word ply");
  }
  bool is_complete = false;
  while (!is_complete && scanner.next_line()) {
    const auto& words = scanner.words();
    if (words.empty()) continue;
    is_complete = words[0] == "end_header";
    if (words[0] == "format") header.encoding = parse_encoding(scanner);
    if (words[0] == "element") header.elements.push_back(parse_element(scanner));
    if (words[0] == "property") {
      if (header.elements.empty()) scanner.fail("property without an element");
      header.elements.back().properties.push_back(parse_property(scanner));
    }
  }
  if (!is_complete) scanner.fail("truncated: expected end_header");
  check_elements(scanner, header);
  return header;
}

}  // namespace dyop::io_internal
