// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>

#include "io/mesh/mesh_reader.h"
#include "io/text_scanner.h"

namespace dyop::io_internal {
namespace {

struct OffCounts {
  std::int64_t vertices = 0;
  std::int64_t faces = 0;
};

// The first word is OFF, preceded by letters for what else each vertex line contains.
void check_keyword(const TextScanner& scanner) {
  const std::string_view keyword = scanner.words().front();
  if (!keyword.ends_with("OFF")) scanner.fail("expected the word OFF");
  if (keyword.find_first_of("4n") != std::string_view::npos) {
    scanner.fail("only three coordinates per vertex are supported, not " + quote(keyword));
  }
  if (scanner.words().size() > 1 && scanner.words()[1] == "BINARY") {
    scanner.fail("binary OFF is not supported");
  }
}

// Words of the line from `first` on: vertices, faces and (ignored) edges.
OffCounts read_counts(const TextScanner& scanner, std::size_t first) {
  const auto& words = scanner.words();
  if (words.size() < first + 2) scanner.fail("expected the numbers of vertices, faces and edges");
  const OffCounts counts{scanner.integer(words[first], "number of vertices"),
                         scanner.integer(words[first + 1], "number of faces")};
  if (counts.vertices < 0 || counts.faces < 0) scanner.fail("counts must not be negative");
  return counts;
}

void read_vertices(TextScanner& scanner, std::int64_t count, PolygonMesh& mesh) {
  for (std::int64_t k = 0; k < count; ++k) {
    if (!scanner.next_line_with_words()) {
      scanner.fail("expected " + std::to_string(count) + " vertices, found " + std::to_string(k));
    }
    const auto& words = scanner.words();
    if (words.size() < 3) scanner.fail("vertex: expected three coordinates");
    mesh.vertices.emplace_back(scanner.finite_number(words[0], "vertex coordinate"),
                               scanner.finite_number(words[1], "vertex coordinate"),
                               scanner.finite_number(words[2], "vertex coordinate"));
  }
}

void read_face(const TextScanner& scanner, PolygonMesh& mesh) {
  const auto& words = scanner.words();
  const auto vertex_count = std::int64_t(mesh.vertices.size());
  const std::int64_t corners = scanner.integer(words[0], "number of corners");
  if (corners < 1 || std::uint64_t(corners) >= words.size()) {
    scanner.fail("face: expected " + std::to_string(corners) + " vertex indices, found " +
                 std::to_string(words.size() - 1));
  }
  mesh.begin_polygon();
  for (std::size_t k = 1; k <= std::size_t(corners); ++k) {
    const std::int64_t index = scanner.integer(words[k], "vertex index");
    if (index < 0 || index >= vertex_count) {
      scanner.fail("vertex index " + std::to_string(index) + " is out of range: the file has " +
                   std::to_string(vertex_count) + " vertices, counted from 0");
    }
    mesh.add_corner(index);
  }
}

}  // namespace

PolygonMesh read_off(const std::filesystem::path& file, std::string_view bytes) {
  TextScanner scanner(file, bytes);
  if (!scanner.next_line_with_words()) scanner.fail("expected the word OFF");
  check_keyword(scanner);
  // The counts may follow the keyword on its own line.
  const bool counts_follow = scanner.words().size() > 1;
  if (!counts_follow && !scanner.next_line_with_words()) scanner.fail("the file ends too early");
  const OffCounts counts = read_counts(scanner, counts_follow ? 1 : 0);
  PolygonMesh mesh;
  read_vertices(scanner, counts.vertices, mesh);
  for (std::int64_t k = 0; k < counts.faces; ++k) {
    if (!scanner.next_line_with_words()) {
      scanner.fail("expected " + std::to_string(counts.faces) + " faces, found " +
                   std::to_string(k));
    }
    read_face(scanner, mesh);
  }
  return mesh;
}

}  // namespace dyop::io_internal
