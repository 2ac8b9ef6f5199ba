#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "dyop/io/file_error.h"
#include "io/mesh_check.h"
#include "io/text_scanner.h"

namespace dyop::internal {
namespace {

enum class PlyEncoding { Ascii, LittleEndian, BigEndian };

struct PlyType {
  std::size_t bytes = 0;
  bool is_real = false;
  bool is_signed = false;
};

struct PlyProperty {
  std::string name;
  PlyType type;                       // of the values
  std::optional<PlyType> count_type;  // of the count in front, if the property is a list
};

struct PlyElement {
  std::string name;
  std::int64_t count = 0;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::Ascii;
  std::vector<PlyElement> elements;

  std::int64_t vertex_count() const {
    for (const PlyElement& element : elements) {
      if (element.name == "vertex") return element.count;
    }
    return 0;
  }
};

PlyType parse_type(const TextScanner& scanner, std::string_view word) {
  if (word == "char" || word == "int8") return {1, false, true};
  if (word == "uchar" || word == "uint8") return {1, false, false};
  if (word == "short" || word == "int16") return {2, false, true};
  if (word == "ushort" || word == "uint16") return {2, false, false};
  if (word == "int" || word == "int32") return {4, false, true};
  if (word == "uint" || word == "uint32") return {4, false, false};
  if (word == "float" || word == "float32") return {4, true, true};
  if (word == "double" || word == "float64") return {8, true, true};
  scanner.fail("expected a type of property, found " + quote(word));
}

PlyProperty parse_property(const TextScanner& scanner) {
  const auto& words = scanner.words();
  if (words.size() == 5 && words[1] == "list") {
    return {std::string(words[4]), parse_type(scanner, words[3]), parse_type(scanner, words[2])};
  }
  if (words.size() != 3) scanner.fail("expected 'property <type> <name>'");
  return {std::string(words[2]), parse_type(scanner, words[1]), std::nullopt};
}

PlyEncoding parse_encoding(const TextScanner& scanner) {
  const auto& words = scanner.words();
  if (words.size() > 1 && words[1] == "ascii") return PlyEncoding::Ascii;
  if (words.size() > 1 && words[1] == "binary_little_endian") return PlyEncoding::LittleEndian;
  if (words.size() > 1 && words[1] == "binary_big_endian") return PlyEncoding::BigEndian;
  scanner.fail("expected 'format ascii', 'binary_little_endian' or 'binary_big_endian'");
}

PlyHeader parse_header(TextScanner& scanner) {
  PlyHeader header;
  if (!scanner.next_line() || scanner.words().empty() || scanner.words().front() != "ply") {
    scanner.fail("expected the word ply");
  }
  while (scanner.next_line()) {
    const auto& words = scanner.words();
    if (words.empty()) continue;
    if (words[0] == "end_header") break;
    if (words[0] == "format") header.encoding = parse_encoding(scanner);
    if (words[0] == "element") {
      if (words.size() != 3) scanner.fail("expected 'element <name> <count>'");
      const std::int64_t count = scanner.integer(words[2], "count of elements");
      if (count < 0) scanner.fail("count of elements must not be negative");
      header.elements.push_back({std::string(words[1]), count, {}});
    }
    if (words[0] == "property") {
      if (header.elements.empty()) scanner.fail("property without an element");
      header.elements.back().properties.push_back(parse_property(scanner));
    }
  }
  if (scanner.words().empty()) scanner.fail("truncated: expected end_header");
  for (const PlyElement& element : header.elements) {
    if (!element.properties.empty() || element.count == 0) continue;
    scanner.fail("element " + quote(element.name) + " has no property");
  }
  return header;
}

// Reads the values behind the header one after the other; each fail() says where.
class AsciiValues {
 public:
  explicit AsciiValues(TextScanner& scanner) : scanner_(scanner) {}

  void begin_element(const PlyElement& element, std::int64_t row) {
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

  void begin_element(const PlyElement& element, std::int64_t row) {
    element_ = &element;
    row_ = row;
  }
  Scalar read(const PlyType& type) {
    if (bytes_.size() < type.bytes) fail("truncated: the file ends here");
    std::array<char, 8> raw{};
    std::copy_n(bytes_.begin(), type.bytes, raw.begin());
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

  std::filesystem::path file_;
  std::string_view bytes_;
  bool swaps_;
  const PlyElement* element_ = nullptr;
  std::int64_t row_ = 0;
};

template <typename Values>
void check_list(Values& values, const PlyProperty& property, std::int64_t vertex_count) {
  const Scalar count = values.read(*property.count_type);
  constexpr Scalar kLongestList = 1e9;
  if (!(count >= 0 && count <= kLongestList)) {
    values.fail(compose_message("expected the length of a list, found ", count));
  }
  const bool holds_indices = property.name == "vertex_indices" || property.name == "vertex_index";
  for (std::int64_t k = 0; k < std::int64_t(count); ++k) {
    const Scalar value = values.read(property.type);
    if (!holds_indices || (value >= 0 && value < Scalar(vertex_count))) continue;
    values.fail(compose_message("vertex index ", value, " is out of range: the file has ",
                                vertex_count, " vertices, counted from 0"));
  }
}

template <typename Values>
void check_values(Values values, const PlyHeader& header) {
  const std::int64_t vertex_count = header.vertex_count();
  for (const PlyElement& element : header.elements) {
    for (std::int64_t row = 0; row < element.count; ++row) {
      values.begin_element(element, row);
      for (const PlyProperty& property : element.properties) {
        if (property.count_type) {
          check_list(values, property, vertex_count);
          continue;
        }
        const bool is_coordinate =
            property.name == "x" || property.name == "y" || property.name == "z";
        const Scalar value = values.read(property.type);
        if (is_coordinate && !std::isfinite(value)) {
          values.fail(property.name + ": expected a finite number, found " + std::to_string(value));
        }
      }
    }
  }
}

}  // namespace

void check_ply(const std::filesystem::path& file, std::string_view bytes) {
  TextScanner scanner(file, bytes);
  const PlyHeader header = parse_header(scanner);
  if (header.encoding == PlyEncoding::Ascii) return check_values(AsciiValues(scanner), header);
  check_values(BinaryValues(file, scanner.rest(), header.encoding == PlyEncoding::BigEndian),
               header);
}

}  // namespace dyop::internal
