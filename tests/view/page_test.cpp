// SPDX-License-Identifier: BSD-3-Clause
// The page in a real browser: check_page.mjs compares it with the World's own motions.
#include <gtest/gtest.h>

#include "dyop/io/scene_generator.h"
#include "dyop/view/page_file.h"
#include "dyop/view/run_follower.h"
#include "support/temporary_directory.h"
#include "view/browser_check.h"
#include "view/page_case.h"

namespace dyop {
namespace {

using testing::PageCase;

void expect_scene_shown(const std::string& kind, int n, Scalar end_time) {
  if (const std::string why = testing::reason_to_skip_browser(); !why.empty()) GTEST_SKIP() << why;
  const testing::TemporaryDirectory directory;
  const auto file = directory.path() / "scene.json";
  write_generated_scene(generate_scene(kind, n), file);
  const PageCase run = testing::run_page_case(load_scene(file), end_time);
  ASSERT_FALSE(run.impacts.empty());
  testing::expect_page_shows(kind, page_html(run.scene.title, run.blocks), run.facts(10000));
}

TEST(Page, ShowsACradleAsItRan) {
  expect_scene_shown("cradle", 5, 3);
}

TEST(Page, ShowsFallingBoxesInAPit) {
  expect_scene_shown("pile", 12, 1.5);
}

}  // namespace
}  // namespace dyop
