// SPDX-License-Identifier: BSD-3-Clause
// The page in a real browser: check_page.mjs compares it with the World's own motions.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "dyop/scene_io/scene_generator.h"
#include "dyop/view/page_file.h"
#include "view/page_case.h"

namespace dyop {
namespace {

namespace fs = std::filesystem;
using testing::PageCase;
using testing::run_page_case;

std::string read_text(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

// Why pages cannot be checked here; empty if they can.
std::string reason_to_skip() {
  if (!has_page()) return "this build has no page: bash .ci/install.sh page";
  const std::string modules = DYOP_PAGE_MODULES;
  if (!fs::exists(modules + "/puppeteer-core")) return "npm package puppeteer-core is missing";
  if (!fs::exists(DYOP_CHROMIUM)) return "chromium is missing: apt-get install chromium";
  return "";
}

fs::path write_page(const std::string& name, const PageCase& run, int poses) {
  const fs::path folder = DYOP_PAGE_OUTPUT;
  fs::create_directories(folder);
  const fs::path file = folder / (name + ".html");
  std::ofstream(file, std::ios::binary) << page_html(run.scene.title, run.blocks);
  std::ofstream(folder / (name + ".json")) << run.facts(poses).dump();
  return file;
}

// Screenshots stay beside the page in the build folder.
void expect_page_shows(const std::string& name, const PageCase& run, int poses) {
  const fs::path file = write_page(name, run, poses);
  const fs::path folder = file.parent_path();
  const fs::path log = folder / (name + ".log");
  const std::string command = std::string("DYOP_PAGE_MODULES='" DYOP_PAGE_MODULES "' '" DYOP_NODE
                                          "' '" DYOP_CHECK_PAGE "' '" DYOP_CHROMIUM "' '") +
                              file.string() + "' '" + (folder / (name + ".json")).string() +
                              "' > '" + log.string() + "' 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0) << read_text(log);
}

Scene generated(const std::string& kind, int n, const std::string& name) {
  const fs::path file = fs::path(DYOP_PAGE_OUTPUT) / (name + "-scene.json");
  fs::create_directories(file.parent_path());
  write_generated_scene(generate_scene(kind, n), file);
  return load_scene(file);
}

#define DYOP_SKIP_WITHOUT_BROWSER() \
  if (const std::string why = reason_to_skip(); !why.empty()) GTEST_SKIP() << why

TEST(Page, ShowsACradleAsItRan) {
  DYOP_SKIP_WITHOUT_BROWSER();
  const PageCase run = run_page_case(generated("cradle", 5, "cradle"));
  ASSERT_FALSE(run.impacts.empty());
  expect_page_shows("cradle", run, 10000);
}

TEST(Page, ShowsFallingBoxesAndGivenMotions) {
  DYOP_SKIP_WITHOUT_BROWSER();
  const PageCase run = run_page_case(generated("pile", 12, "pile"), 1.5);
  ASSERT_FALSE(run.impacts.empty());
  expect_page_shows("pile", run, 10000);
}

}  // namespace
}  // namespace dyop
