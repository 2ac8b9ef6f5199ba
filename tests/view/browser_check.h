// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace dyop::testing {

/// Why pages cannot be checked here; empty if they can.
std::string reason_to_skip_browser();

/// Runs a script of tests/view with node; its output is kept as page_test/NAME.log.
void expect_script_passes(const std::string& name, const std::string& script,
                          const std::vector<std::string>& arguments);

/// Opens a page in Firefox on a virtual screen and plays it (open_firefox.mjs). Skips the test
/// where Firefox is missing, does not start or has no WebGL 2.
void expect_plays_in_firefox(const std::string& name, const std::string& html);

/// Runs check_page.mjs on a page and the facts of its run. Page and screenshots stay in the build
/// folder, page_test/.
void expect_page_shows(const std::string& name, const std::string& html,
                       const nlohmann::json& facts);

}  // namespace dyop::testing
