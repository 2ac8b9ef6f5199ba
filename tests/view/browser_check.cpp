// SPDX-License-Identifier: BSD-3-Clause
#include "view/browser_check.h"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "dyop/view/run_files.h"

namespace dyop::testing {
namespace {

namespace fs = std::filesystem;

std::string read_text(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

}  // namespace

std::string reason_to_skip_browser() {
  if (!has_page()) return "runs where the page is built: bash .ci/install.sh page";
  const std::string modules = DYOP_PAGE_MODULES;
  if (!fs::exists(modules + "/puppeteer-core"))
    return "runs with the npm package puppeteer-core: bash .ci/install.sh page";
  if (!fs::exists(DYOP_CHROMIUM)) return "runs with chromium: bash .ci/install.sh page";
  return "";
}

void expect_script_passes(const std::string& name, const std::string& script,
                          const std::vector<std::string>& arguments) {
  const fs::path folder = DYOP_PAGE_OUTPUT;
  fs::create_directories(folder);
  const std::string log = (folder / (name + ".log")).string();
  std::string command = "DYOP_PAGE_MODULES='" DYOP_PAGE_MODULES "' '" DYOP_NODE
                        "' '" DYOP_PAGE_CHECKS "/" +
                        script + "' '" DYOP_CHROMIUM "'";
  for (const std::string& argument : arguments) command += " '" + argument + "'";
  command += " > '" + log + "' 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0) << read_text(log);
}

void expect_plays_in_firefox(const std::string& name, const std::string& html) {
  if (!fs::exists(DYOP_FIREFOX) || !fs::exists(DYOP_XVFB))
    GTEST_SKIP() << "runs with firefox-esr and xvfb: bash .ci/install.sh firefox";
  const fs::path folder = DYOP_PAGE_OUTPUT;
  fs::create_directories(folder);
  const std::string page = (folder / (name + ".html")).string();
  const std::string log = (folder / (name + ".log")).string();
  std::ofstream(page, std::ios::binary) << html;
  const std::string command = "DYOP_PAGE_MODULES='" DYOP_PAGE_MODULES "' '" DYOP_XVFB
                              "' -a -s '-screen 0 1280x800x24' '" DYOP_NODE "' '" DYOP_PAGE_CHECKS
                              "/open_firefox.mjs' '" DYOP_FIREFOX "' '" +
                              page + "' > '" + log + "' 2>&1";
  constexpr int kSkipped = 77;
  const int code = WEXITSTATUS(std::system(command.c_str()));
  if (code == kSkipped) GTEST_SKIP() << read_text(log);
  EXPECT_EQ(code, 0) << read_text(log);
}

void expect_page_shows(const std::string& name, const std::string& html,
                       const nlohmann::json& facts) {
  const fs::path folder = DYOP_PAGE_OUTPUT;
  fs::create_directories(folder);
  const std::string page = (folder / (name + ".html")).string();
  const std::string facts_file = (folder / (name + ".json")).string();
  std::ofstream(page, std::ios::binary) << html;
  std::ofstream(facts_file) << facts.dump();
  expect_script_passes(name, "check_page.mjs", {page, facts_file});
}

}  // namespace dyop::testing
