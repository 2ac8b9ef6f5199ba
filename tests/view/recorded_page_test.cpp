// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/view/recorded_page.h"

#include <gtest/gtest.h>

#include "dyop/core/error.h"
#include "dyop/io/file_error.h"
#include "dyop/io/recording_reader.h"
#include "dyop/view/page_file.h"
#include "io/record/recorded_world.h"
#include "support/temporary_directory.h"
#include "view/browser_check.h"
#include "view/page_case.h"

namespace dyop {
namespace {

using testing::PageCase;

// What a run's own motions say; bodies of a user's functions are not recorded exactly.
PageCase case_of(const std::vector<AdvanceReport>& reports) {
  PageCase run;
  const World world = testing::busy_world();
  for (const BodyId id : world.bodies()) {
    const BodyDefinition& body = world.body(id);
    run.scene.bodies.push_back({body.name, body.kind, body.shape, "", {}});
  }
  for (const AdvanceReport& report : reports) {
    run.steps.insert(run.steps.end(), report.steps.begin(), report.steps.end());
    run.impacts.insert(run.impacts.end(), report.impacts.begin(), report.impacts.end());
  }
  return run;
}

TEST(RecordedPage, ShowsTheRecordedRunInABrowser) {
  if (const std::string why = testing::reason_to_skip_browser(); !why.empty()) GTEST_SKIP() << why;
  const testing::TemporaryDirectory directory;
  const auto file = directory.path() / "run.h5";
  const PageCase run = case_of(testing::record_busy_run(file));
  ASSERT_FALSE(run.impacts.empty());
  testing::expect_page_shows("recorded", recorded_page_html(file), run.facts(10000));
}

TEST(RecordedPage, NamesTheFileThatIsNoRecording) {
  if (!has_page()) GTEST_SKIP() << "runs where the page is built: bash .ci/install.sh page";
  const testing::TemporaryDirectory directory;
  const auto file = directory.write("run.h5", "not HDF5");
  try {
    recorded_page_html(file);
    ADD_FAILURE() << "a page was made of nothing";
  } catch (const FileError& error) {
    EXPECT_NE(std::string(error.what()).find("run.h5"), std::string::npos);
  }
}

}  // namespace
}  // namespace dyop
