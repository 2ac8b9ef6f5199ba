// SPDX-License-Identifier: BSD-3-Clause

// Damaged scene files: an Error or a scene, never a crash or a hang.

#include <gtest/gtest.h>

#include "dyop/io/scene_file.h"
#include "support/damaged_files.h"
#include "support/temporary_directory.h"

namespace dyop {
namespace {

TEST(DamagedScene, IsRefusedOrMakesAWorld) {
  const testing::TemporaryDirectory directory;
  const std::filesystem::path file = directory.path() / "scene.json";
  for (const auto& [kind, n] : {std::pair("cradle", 2), std::pair("cards", 1)}) {
    write_generated_scene(generate_scene(kind, n), file);
    const testing::DamageReport report = testing::read_damaged(
        testing::TemporaryDirectory::read(file), [&](const std::string& bytes) {
          make_world(load_scene(directory.write("scene.json", bytes)));
        });
    EXPECT_EQ(report.disaster, "") << kind;
    EXPECT_GT(report.refused, 0) << kind;
    EXPECT_GT(report.read, 0) << kind;
  }
}

}  // namespace
}  // namespace dyop
