// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>

#include "io/mesh/mesh_reader.h"
#include "io/text_scanner.h"

namespace dyop::io_internal {
namespace {

// An index beyond the vertices seen so far: legal if the vertex comes later.
struct ForwardReference {
  std::int64_t index = 0;
  std::size_t line = 0;
};

// Further numbers on the line, weights or colours, are ignored.
Vector3 read_vertex(const TextScanner& scanner) {
  const auto& words = scanner.words();
  if (words.size() < 4) {
    scanner.fail("vertex: expected three coordinates, found " + std::to_string(words.size() - 1));
  }
  return Vector3(scanner.finite_number(words[1], "vertex x"),
                 scanner.finite_number(words[2], "vertex y"),
                 scanner.finite_number(words[3], "vertex z"));
}

std::string out_of_range(std::int64_t index, std::int64_t vertex_count) {
  return "vertex index " + std::to_string(index) + " is out of range: the file has " +
         std::to_string(vertex_count) + " vertices, counted from 1";
}

class ObjReader {
 public:
  ObjReader(const std::filesystem::path& file, std::string_view bytes) : scanner_(file, bytes) {}

  PolygonMesh read() {
    while (scanner_.next_line(/*joins_lines=*/true)) {
      scanner_.drop_comment();
      if (!scanner_.words().empty()) read_statement(scanner_.words().front());
    }
    if (largest_.index > vertex_count()) {
      scanner_.fail_at(largest_.line, out_of_range(largest_.index, vertex_count()));
    }
    return std::move(mesh_);
  }

 private:
  std::int64_t vertex_count() const { return std::int64_t(mesh_.vertices.size()); }

  void read_statement(std::string_view keyword) {
    if (keyword == "v") mesh_.vertices.push_back(read_vertex(scanner_));
    if (keyword == "f") read_face();
    if (keyword == "l") read_line();
    if (keyword == "p") read_points();
  }

  // The vertex of a corner `vertex[/texture[/normal]]`, counted from 0.
  std::int64_t vertex_of(std::string_view word) {
    const std::int64_t index = scanner_.integer(word.substr(0, word.find('/')), "vertex index");
    if (index == 0 || index < -vertex_count()) scanner_.fail(out_of_range(index, vertex_count()));
    if (index < 0) return vertex_count() + index;
    if (index > largest_.index) largest_ = {index, scanner_.line()};
    return index - 1;
  }

  void read_face() {
    if (scanner_.words().size() < 2) scanner_.fail("face without vertices");
    mesh_.begin_polygon();
    for (std::size_t k = 1; k < scanner_.words().size(); ++k) {
      mesh_.add_corner(vertex_of(scanner_.words()[k]));
    }
  }

  void read_line() {
    if (scanner_.words().size() < 3) scanner_.fail("line: expected at least two vertices");
    for (std::size_t k = 2; k < scanner_.words().size(); ++k) {
      mesh_.begin_polygon();
      mesh_.add_corner(vertex_of(scanner_.words()[k - 1]));
      mesh_.add_corner(vertex_of(scanner_.words()[k]));
    }
  }

  void read_points() {
    for (std::size_t k = 1; k < scanner_.words().size(); ++k) {
      mesh_.begin_polygon();
      mesh_.add_corner(vertex_of(scanner_.words()[k]));
    }
  }

  TextScanner scanner_;
  PolygonMesh mesh_;
  ForwardReference largest_;
};

}  // namespace

PolygonMesh read_obj(const std::filesystem::path& file, std::string_view bytes) {
  return ObjReader(file, bytes).read();
}

}  // namespace dyop::io_internal
