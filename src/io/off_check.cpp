#include <cstdint>

#include "io/mesh_check.h"
#include "io/text_scanner.h"

namespace dyop::internal {
namespace {

struct OffCounts {
  std::int64_t vertices = 0;
  std::int64_t faces = 0;
};

// Words of the line from `first` on: vertices, faces and (ignored) edges.
OffCounts read_counts(const TextScanner& scanner, std::size_t first) {
  const auto& words = scanner.words();
  if (words.size() < first + 2) scanner.fail("expected the numbers of vertices, faces and edges");
  const OffCounts counts{scanner.integer(words[first], "number of vertices"),
                         scanner.integer(words[first + 1], "number of faces")};
  if (counts.vertices < 0 || counts.faces < 0) scanner.fail("counts must not be negative");
  return counts;
}

void check_vertices(TextScanner& scanner, std::int64_t count) {
  for (std::int64_t k = 0; k < count; ++k) {
    if (!scanner.next_line_with_words()) {
      scanner.fail("expected " + std::to_string(count) + " vertices, found " + std::to_string(k));
    }
    if (scanner.words().size() < 3) scanner.fail("vertex: expected three coordinates");
    for (std::size_t axis = 0; axis < 3; ++axis) {
      scanner.finite_number(scanner.words()[axis], "vertex coordinate");
    }
  }
}

void check_face(const TextScanner& scanner, std::int64_t vertex_count) {
  const auto& words = scanner.words();
  const std::int64_t corners = scanner.integer(words[0], "number of corners");
  if (corners < 1 || std::uint64_t(corners) >= words.size()) {
    scanner.fail("face: expected " + std::to_string(corners) + " vertex indices, found " +
                 std::to_string(words.size() - 1));
  }
  for (std::size_t k = 1; k <= std::size_t(corners); ++k) {
    const std::int64_t index = scanner.integer(words[k], "vertex index");
    if (index < 0 || index >= vertex_count) {
      scanner.fail("vertex index " + std::to_string(index) + " is out of range: the file has " +
                   std::to_string(vertex_count) + " vertices, counted from 0");
    }
  }
}

}  // namespace

void check_off(const std::filesystem::path& file, std::string_view bytes) {
  TextScanner scanner(file, bytes);
  if (!scanner.next_line_with_words() || !scanner.words().front().ends_with("OFF")) {
    scanner.fail("expected the word OFF");
  }
  if (scanner.words().size() > 1 && scanner.words()[1] == "BINARY") {
    scanner.fail("binary OFF is not supported");
  }
  // The counts may follow the keyword on its own line.
  const bool counts_follow = scanner.words().size() > 1;
  if (!counts_follow && !scanner.next_line_with_words()) scanner.fail("the file ends too early");
  const OffCounts counts = read_counts(scanner, counts_follow ? 1 : 0);
  check_vertices(scanner, counts.vertices);
  for (std::int64_t k = 0; k < counts.faces; ++k) {
    if (!scanner.next_line_with_words()) {
      scanner.fail("expected " + std::to_string(counts.faces) + " faces, found " +
                   std::to_string(k));
    }
    check_face(scanner, counts.vertices);
  }
}

}  // namespace dyop::internal
