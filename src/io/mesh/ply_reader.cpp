// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "dyop/io/file_error.h"
#include "io/mesh/mesh_reader.h"
#include "io/text_scanner.h"

namespace dyop::io_internal {

/// The header of a PLY file: which elements follow, and the properties of each.
enum class PlyEncoding { Ascii, LittleEndian, BigEndian };

struct PlyType {
  std::size_t bytes = 0;
  bool is_real = false;
  bool is_signed = false;
};

struct PlyProperty {
  std::string name;
  PlyType type;                       // type of the values
  std::optional<PlyType> count_type;  // type of the leading count, if the property is a list
};

struct PlyElement {
  std::string name;
  std::int64_t count = 0;
  std::vector<PlyProperty> properties;

  /// Index of the property; nothing if there is none of this name and kind.
  std::optional<std::size_t> find(std::string_view property, bool is_list) const;
  /// The list of vertices, for which two names are in use.
  std::optional<std::size_t> find_vertex_list() const;
};

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::Ascii;
  std::vector<PlyElement> elements;

  std::int64_t vertex_count() const;
};

/// Reads up to the line after `end_header`. Every element has properties; at most one is named
/// "vertex", with x, y and z; "face" and "tristrips" have a list of vertices.
/// @throws FileError with the line.
PlyHeader read_ply_header(TextScanner& scanner);

namespace {

// Reads the values after the header one by one; fail() adds the position.
class AsciiValues {
 public:
  explicit AsciiValues(TextScanner& scanner) : scanner_(scanner) {}

  void begin_row(const PlyElement& element, std::int64_t row) {
    next_ = 0;
    if (!scanner_.next_line_with_words()) {
      scanner_.fail("truncated: expected " + std::to_string(element.count) + " of element " +
                    quote(element.name) + ", found " + std::to_string(row));
    }
  }
  Scalar read(const PlyType& /*type*/) {
    if (next_ >= scanner_.words().size()) scanner_.fail("expected more numbers on this line");
    return scanner_.finite_number(scanner_.words()[next_++], "value");
  }
  [[noreturn]] void fail(const std::string& problem) const { scanner_.fail(problem); }

 private:
  TextScanner& scanner_;
  std::size_t next_ = 0;
};

class BinaryValues {
 public:
  BinaryValues(const std::filesystem::path& file, std::string_view bytes, bool is_big_endian)
      : file_(file),
        bytes_(bytes),
        swaps_((std::endian::native == std::endian::big) != is_big_endian) {}

  void begin_row(const PlyElement& element, std::int64_t row) {
    element_ = &element;
    row_ = row;
  }
  Scalar read(const PlyType& type) {
    if (bytes_.size() < type.bytes) fail("truncated: the file ends here");
    std::array<char, 8> raw{};
    std::memcpy(raw.data(), bytes_.data(), type.bytes);
    bytes_.remove_prefix(type.bytes);
    if (swaps_) std::reverse(raw.begin(), raw.begin() + std::ptrdiff_t(type.bytes));
    return decode(type, raw);
  }
  [[noreturn]] void fail(const std::string& problem) const {
    throw FileError(file_, element_->name + " " + std::to_string(row_) + " of " +
                               std::to_string(element_->count) + ": " + problem);
  }

 private:
  template <typename Number>
  static Scalar decode_as(const std::array<char, 8>& raw) {
    Number number;
    std::memcpy(&number, raw.data(), sizeof(number));
    return Scalar(number);
  }
  static Scalar decode(const PlyType& type, const std::array<char, 8>& raw) {
    if (type.is_real) return type.bytes == 4 ? decode_as<float>(raw) : decode_as<double>(raw);
    if (type.bytes == 1)
      return type.is_signed ? decode_as<std::int8_t>(raw) : decode_as<std::uint8_t>(raw);
    if (type.bytes == 2)
      return type.is_signed ? decode_as<std::int16_t>(raw) : decode_as<std::uint16_t>(raw);
    return type.is_signed ? decode_as<std::int32_t>(raw) : decode_as<std::uint32_t>(raw);
  }

  const std::filesystem::path& file_;
  std::string_view bytes_;
  bool swaps_;
  const PlyElement* element_ = nullptr;
  std::int64_t row_ = 0;
};

template <typename Values>
class PlyReader {
 public:
  PlyReader(Values values, const PlyHeader& header) : values_(values), header_(header) {}

  PolygonMesh read() {
    for (const PlyElement& element : header_.elements) {
      for (std::int64_t row = 0; row < element.count; ++row) {
        values_.begin_row(element, row);
        if (element.name == "vertex") {
          read_vertex(element);
        } else if (element.name == "face") {
          read_row(element);
          add_face(row);
        } else if (element.name == "tristrips") {
          read_row(element);
          add_strip();
        } else {
          read_row(element);
        }
      }
    }
    return std::move(mesh_);
  }

 private:
  void read_vertex(const PlyElement& element) {
    Vector3 p = Vector3::Zero();
    for (const PlyProperty& property : element.properties) {
      if (property.count_type) {
        read_list(property, other_list_);
        continue;
      }
      const Scalar value = values_.read(property.type);
      const bool is_coordinate =
          property.name == "x" || property.name == "y" || property.name == "z";
      if (!is_coordinate) continue;
      if (!std::isfinite(value)) {
        values_.fail(compose_message(property.name, ": expected a finite number, found ", value));
      }
      p[property.name[0] - 'x'] = value;
    }
    mesh_.vertices.push_back(p);
  }

  // Reads all properties of a row, but keeps only the list of vertices.
  void read_row(const PlyElement& element) {
    const std::optional<std::size_t> vertex_list = element.find_vertex_list();
    for (std::size_t k = 0; k < element.properties.size(); ++k) {
      if (element.properties[k].count_type) {
        read_list(element.properties[k], k == vertex_list ? list_ : other_list_);
      } else {
        values_.read(element.properties[k].type);
      }
    }
  }

  void read_list(const PlyProperty& property, std::vector<Scalar>& list) {
    const Scalar count = values_.read(*property.count_type);
    constexpr Scalar kLongestList = 1e9;
    if (!(count >= 0 && count <= kLongestList && count == std::floor(count))) {
      values_.fail(compose_message("expected the length of a list, found ", count));
    }
    list.clear();
    for (Scalar k = 0; k < count; ++k) list.push_back(values_.read(property.type));
  }

  std::int64_t vertex_of(Scalar value) const {
    if (!(value >= 0 && value < Scalar(header_.vertex_count()))) {
      values_.fail(compose_message("vertex index ", value, " is out of range: the file has ",
                                   header_.vertex_count(), " vertices, counted from 0"));
    }
    if (value != std::floor(value)) {
      values_.fail(compose_message("vertex index: expected an integer, found ", value));
    }
    return std::int64_t(value);
  }

  void add_face(std::int64_t row) {
    if (list_.empty()) values_.fail("face " + std::to_string(row) + " has no vertices");
    mesh_.begin_polygon();
    for (const Scalar value : list_) mesh_.add_corner(vertex_of(value));
  }

  // Every vertex except the first two ends a triangle, of alternating orientation; -1 starts a new
  // strip.
  void add_strip() {
    std::size_t begin = 0;
    for (std::size_t k = 0; k < list_.size(); ++k) {
      if (list_[k] == -1) {
        begin = k + 1;
      } else if (k >= begin + 2) {
        const bool is_turned = (k - begin) % 2 == 1;
        mesh_.begin_polygon();
        mesh_.add_corner(vertex_of(list_[k - (is_turned ? 1 : 2)]));
        mesh_.add_corner(vertex_of(list_[k - (is_turned ? 2 : 1)]));
        mesh_.add_corner(vertex_of(list_[k]));
      }
    }
  }

  Values values_;
  const PlyHeader& header_;
  PolygonMesh mesh_;
  std::vector<Scalar> list_;        // vertex numbers of a row
  std::vector<Scalar> other_list_;  // for lists that are not kept
};

}  // namespace

PolygonMesh read_ply(const std::filesystem::path& file, std::string_view bytes) {
  TextScanner scanner(file, bytes);
  const PlyHeader header = read_ply_header(scanner);
  if (header.encoding == PlyEncoding::Ascii) return PlyReader(AsciiValues(scanner), header).read();
  const bool is_big_endian = header.encoding == PlyEncoding::BigEndian;
  return PlyReader(BinaryValues(file, scanner.rest(), is_big_endian), header).read();
}

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
