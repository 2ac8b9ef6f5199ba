#include <array>
#include <cstdint>

#include "dyop/io/file_error.h"
#include "io/mesh_check.h"
#include "io/text_scanner.h"

namespace dyop::internal {
namespace {

// An index beyond the vertices seen so far: legal if the vertex comes later.
struct ForwardReference {
  std::int64_t index = 0;
  std::size_t line = 0;
};

void check_vertex(const TextScanner& scanner) {
  const auto& words = scanner.words();
  if (words.size() < 4) {
    scanner.fail("vertex: expected three coordinates, found " + std::to_string(words.size() - 1));
  }
  constexpr std::array kNames{"vertex x", "vertex y", "vertex z"};
  for (std::size_t k = 0; k < 3; ++k) scanner.finite_number(words[k + 1], kNames[k]);
}

std::string out_of_range(std::int64_t index, std::int64_t vertex_count) {
  return "vertex index " + std::to_string(index) + " is out of range: the file has " +
         std::to_string(vertex_count) + " vertices, counted from 1";
}

// Checks the corners of a face, line or point; remembers the largest forward reference.
void check_corners(const TextScanner& scanner, std::int64_t vertices_so_far,
                   ForwardReference& largest) {
  for (std::size_t k = 1; k < scanner.words().size(); ++k) {
    const std::string_view word = scanner.words()[k];
    const std::int64_t index = scanner.integer(word.substr(0, word.find('/')), "vertex index");
    if (index == 0 || index < -vertices_so_far) scanner.fail(out_of_range(index, vertices_so_far));
    if (index > largest.index) largest = {index, scanner.line()};
  }
}

}  // namespace

void check_obj(const std::filesystem::path& file, std::string_view bytes) {
  TextScanner scanner(file, bytes);
  std::int64_t vertex_count = 0;
  ForwardReference largest;
  while (scanner.next_line(/*joins_lines=*/true)) {
    scanner.drop_comment();
    if (scanner.words().empty()) continue;
    const std::string_view keyword = scanner.words().front();
    if (keyword == "v") {
      check_vertex(scanner);
      ++vertex_count;
    } else if (keyword == "f" || keyword == "l" || keyword == "p") {
      if (keyword == "f" && scanner.words().size() < 2) scanner.fail("face without vertices");
      check_corners(scanner, vertex_count, largest);
    }
  }
  if (largest.index > vertex_count) {
    throw FileError(file, FilePosition{largest.line, std::nullopt},
                    out_of_range(largest.index, vertex_count));
  }
}

}  // namespace dyop::internal
