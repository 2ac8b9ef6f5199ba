#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "dyop/io/file_error.h"
#include "io/mesh_check.h"
#include "io/text_scanner.h"

namespace dyop::internal {
namespace {

constexpr std::size_t kHeaderBytes = 84;  // 80 of text, 4 of the number of facets
constexpr std::size_t kFacetBytes = 50;   // 12 floats, 2 bytes of attributes
static_assert(std::endian::native == std::endian::little,
              "binary STL is read as it lies in memory");

std::uint32_t facet_count(std::string_view bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + 80, sizeof(count));
  return count;
}

void check_facets(const std::filesystem::path& file, std::string_view bytes) {
  for (std::size_t facet = 0; facet < facet_count(bytes); ++facet) {
    std::array<float, 9> corners;  // behind the normal, which is not used
    std::memcpy(corners.data(), bytes.data() + kHeaderBytes + facet * kFacetBytes + 12,
                sizeof(corners));
    for (std::size_t k = 0; k < corners.size(); ++k) {
      if (std::isfinite(corners[k])) continue;
      throw FileError(file, "facet " + std::to_string(facet) + ", vertex " + std::to_string(k / 3) +
                                ": expected finite numbers, found " + std::to_string(corners[k]));
    }
  }
}

void check_ascii(const std::filesystem::path& file, std::string_view bytes) {
  TextScanner scanner(file, bytes);
  bool is_open = false;
  std::int64_t corners = 0;
  while (scanner.next_line()) {
    if (scanner.words().empty()) continue;
    const std::string_view keyword = scanner.words().front();
    if (keyword == "solid") is_open = true;
    if (keyword == "endsolid") is_open = false;
    if (keyword == "facet") corners = 0;
    if (keyword == "endfacet" && corners != 3) {
      scanner.fail("facet: expected 3 vertices, found " + std::to_string(corners));
    }
    if (keyword != "vertex") continue;
    ++corners;
    if (scanner.words().size() < 4) scanner.fail("vertex: expected three coordinates");
    for (std::size_t axis = 1; axis <= 3; ++axis) {
      scanner.finite_number(scanner.words()[axis], "vertex coordinate");
    }
  }
  if (is_open) scanner.fail("truncated: expected 'endsolid' before the end of the file");
}

}  // namespace

void check_stl(const std::filesystem::path& file, std::string_view bytes) {
  const std::size_t expected =
      bytes.size() < kHeaderBytes ? kHeaderBytes : kHeaderBytes + kFacetBytes * facet_count(bytes);
  if (bytes.size() == expected) return check_facets(file, bytes);
  // Binary files may begin with "solid" as well, so the word alone decides nothing.
  const bool is_ascii = bytes.substr(0, bytes.find_first_of(" \t\r\n")) == "solid" &&
                        (bytes.find("facet") != std::string_view::npos ||
                         bytes.find("endsolid") != std::string_view::npos);
  if (is_ascii) return check_ascii(file, bytes);
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

}  // namespace dyop::internal
