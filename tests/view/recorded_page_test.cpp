// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "dyop/core/error.h"
#include "dyop/io/file_error.h"
#include "dyop/io/recording.h"
#include "dyop/view/run_files.h"
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
  nlohmann::json facts = run.facts(10000);
  facts["checksAccess"] = true;
  testing::expect_page_shows("recorded", recorded_page_html(file), facts);
}

// Writes a page and returns its place for check_views.mjs.
std::string write_page(const std::string& name, const std::string& html) {
  const auto folder = std::filesystem::path(DYOP_PAGE_OUTPUT);
  std::filesystem::create_directories(folder);
  const auto file = folder / name;
  std::ofstream(file, std::ios::binary) << html;
  return file.string();
}

TEST(RecordedPage, InChunksShowsTheSameAsWhole) {
  if (const std::string why = testing::reason_to_skip_browser(); !why.empty()) GTEST_SKIP() << why;
  const testing::TemporaryDirectory directory;
  const auto file = directory.path() / "run.h5";
  const PageCase run = case_of(testing::record_busy_run(file));
  RecordedPageOptions options;
  options.most_rows = 0;
  options.rows_of_chunk = 100;
  testing::expect_script_passes("large", "check_views.mjs",
                                {"large", write_page("large.json", run.facts(100).dump()),
                                 write_page("whole.html", recorded_page_html(file)),
                                 write_page("large.html", recorded_page_html(file, options))});
}

// Records the busy world in steps of this length until time 1, and returns what was committed.
PageCase record_in_steps(const std::filesystem::path& file, int steps) {
  World world = testing::busy_world();
  RunHeader header = testing::busy_header();
  header.end_time = 1;
  header.step = 1.0 / steps;
  RecordingWriter writer(file, header, {});
  std::vector<AdvanceReport> reports;
  for (int k = 0; k < steps; ++k) {
    reports.push_back(world.advance(header.step));
    writer.write(reports.back(), world);
  }
  writer.finish();
  return case_of(reports);
}

TEST(RecordedPage, TwoRunsAreSideBySide) {
  if (const std::string why = testing::reason_to_skip_browser(); !why.empty()) GTEST_SKIP() << why;
  const testing::TemporaryDirectory directory;
  const auto fine = directory.path() / "fine.h5";
  const auto coarse = directory.path() / "coarse.h5";
  const PageCase a = record_in_steps(fine, 64);
  const PageCase b = record_in_steps(coarse, 16);
  const World world = testing::busy_world();
  nlohmann::json facts;
  for (int k = 0; k <= 20; ++k) {
    const Scalar t = k == 20 ? 1 : 0.049 * k;
    Scalar most = 0;
    for (const BodyId id : world.bodies()) {
      const BodyDefinition& body = world.body(id);
      const Vector3 center =
          body.kind == BodyKind::Dynamic ? body.mass_properties.p_BoBcm : Vector3(Vector3::Zero());
      const Vector3 off = a.pose(id.slot, t) * center - b.pose(id.slot, t) * center;
      most = std::max(most, off.norm());
    }
    facts["differences"].push_back({{"t", t}, {"distance", most}});
  }
  testing::expect_script_passes("compare", "check_views.mjs",
                                {"compare", write_page("compare.json", facts.dump()),
                                 write_page("compare.html", compared_page_html(fine, coarse)),
                                 write_page("compare-same.html", compared_page_html(fine, fine))});
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
