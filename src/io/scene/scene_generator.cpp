// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/scene_generator.h"

#include <algorithm>

#include "dyop/core/error.h"
#include "dyop/io/file_error.h"
#include "io/output_file.h"
#include "io/scene/scene_builder.h"

namespace dyop {
namespace {

struct KindRow {
  SceneKind kind;
  GeneratedScene (*make)(int n);
};

const std::vector<KindRow>& kind_rows() {
  static const std::vector<KindRow> rows{
      {{"stack", "cubes", 1, 1000}, io_internal::make_stack},
      {{"pyramid", "courses", 1, 100}, io_internal::make_pyramid},
      {{"wall", "courses of 2 N bricks", 1, 50}, io_internal::make_wall},
      {{"pile", "cubes", 1, 20000}, io_internal::make_pile},
      {{"arch", "stones", 3, 1001}, io_internal::make_arch},
      {{"cards", "levels", 1, 30}, io_internal::make_cards},
      {{"domino", "dominoes", 1, 1000}, io_internal::make_domino},
      {{"chain-net", "rings per side, not counting links", 2, 30}, io_internal::make_chain_net},
      {{"gears", "gears", 1, 100}, io_internal::make_gears},
      {{"cradle", "balls", 2, 100}, io_internal::make_cradle},
      {{"bolt", "turns of the nut", 1, 100}, io_internal::make_bolt}};
  return rows;
}

}  // namespace

const std::vector<SceneKind>& scene_kinds() {
  static const std::vector<SceneKind> kinds = [] {
    std::vector<SceneKind> list;
    for (const KindRow& row : kind_rows()) list.push_back(row.kind);
    return list;
  }();
  return kinds;
}

GeneratedScene generate_scene(const std::string& kind, int n) {
  std::string names;
  for (const KindRow& row : kind_rows()) {
    if (row.kind.name == kind) {
      DYOP_REQUIRE(n >= row.kind.least && n <= row.kind.most, "scene ", kind, ": N (",
                   row.kind.count, ") must be ", row.kind.least, " to ", row.kind.most, ", not ",
                   n);
      return row.make(n);
    }
    names += (names.empty() ? "" : ", ") + row.kind.name;
  }
  DYOP_REQUIRE(false, "no kind of scene named '", kind, "'; the kinds are ", names);
  return {};
}

void write_generated_scene(const GeneratedScene& scene, const std::filesystem::path& file) {
  for (const auto& [name, text] : scene.meshes)
    io_internal::write_whole_file(file.parent_path() / name, text);
  io_internal::write_whole_file(file, scene.text);
}

}  // namespace dyop
