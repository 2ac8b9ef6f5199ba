// SPDX-License-Identifier: BSD-3-Clause

// ESRI ASCII grids: a header of keys and values, then heights from north to south.

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <string>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/io/file_error.h"
#include "geometry/height_field.h"
#include "io/mesh/mesh_reader.h"
#include "io/text_scanner.h"

namespace dyop::io_internal {
namespace {

using Header = std::map<std::string, Scalar>;

constexpr std::array<std::string_view, 10> kKeys{
    "ncols",     "nrows", "xllcorner", "yllcorner",    "xllcenter",
    "yllcenter", "dx",    "dy",        "nodata_value", "cellsize"};

bool is_key(std::string_view word) {
  return std::isalpha(static_cast<unsigned char>(word.front())) != 0;
}

// Reads lines of a key and a value, and stops at the first line of heights.
Header read_header(TextScanner& scanner) {
  Header header;
  while (scanner.next_line_with_words()) {
    const auto& words = scanner.words();
    if (!is_key(words[0])) return header;
    std::string key(words[0]);
    std::transform(key.begin(), key.end(), key.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    if (std::find(kKeys.begin(), kKeys.end(), key) == kKeys.end()) {
      scanner.fail("unknown key " + quote(words[0]));
    }
    if (words.size() != 2) scanner.fail(key + ": expected one value");
    if (!header.emplace(key, scanner.finite_number(words[1], key)).second) {
      scanner.fail("a second " + key);
    }
  }
  scanner.fail("expected heights after the header");
}

Scalar number(const TextScanner& scanner, const Header& header, const std::string& key) {
  const auto found = header.find(key);
  if (found == header.end()) scanner.fail("the header has no " + key);
  return found->second;
}

std::size_t count(const TextScanner& scanner, const Header& header, const std::string& key) {
  const Scalar value = number(scanner, header, key);
  const bool is_count =
      value >= 2 && value <= Scalar(kLargestTriangleCount) && value == Scalar(std::size_t(value));
  if (!is_count) {
    scanner.fail(core_internal::compose_message(key, " must be an integer from 2 to ",
                                                kLargestTriangleCount, ", not ", value));
  }
  return std::size_t(value);
}

// The place of the first cell's middle along one axis.
Scalar first_middle(const Header& header, const std::string& axis, Scalar spacing) {
  const auto center = header.find(axis + "llcenter");
  if (center != header.end()) return center->second;
  const auto corner = header.find(axis + "llcorner");
  return (corner == header.end() ? 0 : corner->second) + spacing / 2;
}

HeightGrid grid_of(const TextScanner& scanner, const Header& header) {
  HeightGrid grid;
  grid.columns = count(scanner, header, "ncols");
  grid.rows = count(scanner, header, "nrows");
  const bool is_square = header.find("cellsize") != header.end();
  grid.spacing_x = number(scanner, header, is_square ? "cellsize" : "dx");
  grid.spacing_y = number(scanner, header, is_square ? "cellsize" : "dy");
  grid.x = first_middle(header, "x", grid.spacing_x);
  grid.y = first_middle(header, "y", grid.spacing_y);
  return grid;
}

// All heights in the order of the file; lines may break anywhere.
std::vector<Scalar> read_heights(TextScanner& scanner, const Header& header, std::size_t wanted) {
  const auto missing = header.find("nodata_value");
  std::vector<Scalar> heights;
  do {
    for (const std::string_view word : scanner.words()) {
      heights.push_back(scanner.finite_number(word, "height"));
      if (missing != header.end() && heights.back() == missing->second) {
        scanner.fail("a cell without data, " + quote(word) + ": fill holes first");
      }
    }
    if (heights.size() > wanted) break;
  } while (scanner.next_line_with_words());
  if (heights.size() != wanted) {
    scanner.fail("expected " + std::to_string(wanted) + " heights, found " +
                 (heights.size() > wanted ? "more" : std::to_string(heights.size())));
  }
  return heights;
}

PolygonMesh polygons_of(geometry_internal::HeightFieldArrays arrays) {
  PolygonMesh mesh;
  mesh.vertices = std::move(arrays.vertices);
  for (const TriangleIndices& triangle : arrays.triangles) {
    mesh.begin_polygon();
    for (const std::int32_t corner : triangle) mesh.add_corner(corner);
  }
  return mesh;
}

}  // namespace

PolygonMesh read_asc(const std::filesystem::path& file, std::string_view bytes) {
  TextScanner scanner(file, bytes);
  const Header header = read_header(scanner);
  HeightGrid grid = grid_of(scanner, header);
  const std::vector<Scalar> heights = read_heights(scanner, header, grid.rows * grid.columns);
  for (std::size_t row = grid.rows; row-- > 0;) {
    const auto begin = heights.begin() + std::ptrdiff_t(row * grid.columns);
    grid.heights.insert(grid.heights.end(), begin, begin + std::ptrdiff_t(grid.columns));
  }
  try {
    return polygons_of(geometry_internal::height_field_arrays(grid));
  } catch (const InvalidArgument& error) {
    throw FileError(file, error.what());
  }
}

}  // namespace dyop::io_internal
