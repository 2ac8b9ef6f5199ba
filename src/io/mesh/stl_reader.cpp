// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "dyop/io/file_error.h"
#include "io/mesh/mesh_reader.h"
#include "io/text_scanner.h"

namespace dyop::io_internal {
namespace {

constexpr std::size_t kHeaderBytes = 84;  // 80 of text, 4 of the number of facets
constexpr std::size_t kFacetBytes = 50;   // 12 floats, 2 bytes of attributes
static_assert(std::endian::native == std::endian::little,
              "binary STL is copied without conversion");

std::uint32_t facet_count(std::string_view bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + 80, sizeof(count));
  return count;
}

// A facet is the polygon of the last three vertices.
void add_facet(PolygonMesh& mesh) {
  mesh.begin_polygon();
  for (std::size_t back = 3; back > 0; --back) {
    mesh.add_corner(std::int64_t(mesh.vertices.size() - back));
  }
}

PolygonMesh read_binary(const std::filesystem::path& file, std::string_view bytes) {
  PolygonMesh mesh;
  mesh.vertices.reserve(3 * std::size_t(facet_count(bytes)));
  for (std::size_t facet = 0; facet < facet_count(bytes); ++facet) {
    std::array<float, 9> corners;  // after the normal, which is not used
    std::memcpy(corners.data(), bytes.data() + kHeaderBytes + facet * kFacetBytes + 12,
                sizeof(corners));
    for (std::size_t k = 0; k < corners.size(); ++k) {
      if (std::isfinite(corners[k])) continue;
      throw FileError(file, "facet " + std::to_string(facet) + ", vertex " + std::to_string(k / 3) +
                                ": expected finite numbers, found " + std::to_string(corners[k]));
    }
    for (std::size_t k = 0; k < corners.size(); k += 3) {
      mesh.vertices.emplace_back(corners[k], corners[k + 1], corners[k + 2]);
    }
    add_facet(mesh);
  }
  return mesh;
}

std::string lower_case(std::string_view word) {
  std::string lower(word);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  return lower;
}

// Reads the statements of the text; those for normals and loops are skipped. Some programs write
// the keywords in capitals.
class AsciiStlReader {
 public:
  AsciiStlReader(const std::filesystem::path& file, std::string_view bytes)
      : scanner_(file, bytes) {}

  PolygonMesh read() {
    while (scanner_.next_line()) {
      if (!scanner_.words().empty()) read_statement(lower_case(scanner_.words().front()));
    }
    if (is_open_) scanner_.fail("truncated: expected 'endsolid' before the end of the file");
    return std::move(mesh_);
  }

 private:
  void read_statement(std::string_view keyword) {
    if (keyword == "solid") is_open_ = true;
    if (keyword == "facet") begin_facet();
    if (keyword == "vertex") read_vertex();
    if (keyword == "endfacet") end_facet();
    if (keyword == "endsolid") {
      if (is_in_facet_) scanner_.fail("expected 'endfacet', found 'endsolid'");
      is_open_ = false;
    }
  }

  void begin_facet() {
    if (is_in_facet_) scanner_.fail("expected 'endfacet', found 'facet'");
    is_in_facet_ = true;
    corners_ = 0;
  }

  void read_vertex() {
    if (!is_in_facet_) scanner_.fail("vertex outside a facet");
    const auto& words = scanner_.words();
    if (words.size() < 4) scanner_.fail("vertex: expected three coordinates");
    mesh_.vertices.emplace_back(scanner_.finite_number(words[1], "vertex coordinate"),
                                scanner_.finite_number(words[2], "vertex coordinate"),
                                scanner_.finite_number(words[3], "vertex coordinate"));
    ++corners_;
  }

  void end_facet() {
    if (!is_in_facet_) scanner_.fail("expected 'facet', found 'endfacet'");
    if (corners_ != 3) {
      scanner_.fail("facet: expected 3 vertices, found " + std::to_string(corners_));
    }
    add_facet(mesh_);
    is_in_facet_ = false;
  }

  TextScanner scanner_;
  PolygonMesh mesh_;
  bool is_open_ = false;
  bool is_in_facet_ = false;
  std::int64_t corners_ = 0;
};

}  // namespace

PolygonMesh read_stl(const std::filesystem::path& file, std::string_view bytes) {
  const std::size_t expected =
      bytes.size() < kHeaderBytes ? kHeaderBytes : kHeaderBytes + kFacetBytes * facet_count(bytes);
  if (bytes.size() == expected) return read_binary(file, bytes);
  // Binary files may start with "solid" too, so the word alone decides nothing.
  const std::string_view text = without_byte_order_mark(bytes);
  const auto holds = [&](const char* word, const char* in_capitals) {
    return text.find(word) != std::string_view::npos ||
           text.find(in_capitals) != std::string_view::npos;
  };
  const bool is_ascii = lower_case(text.substr(0, text.find_first_of(" \t\r\n"))) == "solid" &&
                        (holds("facet", "FACET") || holds("endsolid", "ENDSOLID"));
  if (is_ascii) return AsciiStlReader(file, bytes).read();
  if (bytes.size() < kHeaderBytes) {
    throw FileError(file, "truncated: expected at least " + std::to_string(kHeaderBytes) +
                              " bytes of a binary STL header or 'solid', found " +
                              std::to_string(bytes.size()) + " bytes");
  }
  throw FileError(file, "truncated or damaged: the header announces " +
                            std::to_string(facet_count(bytes)) + " facets, expected " +
                            std::to_string(expected) + " bytes, found " +
                            std::to_string(bytes.size()));
}

}  // namespace dyop::io_internal
