// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace dyop::view_internal {

/// A page of the recorded run of a tool.
struct ToolPage {
  std::string title;
  std::vector<std::string> blocks;
};
ToolPage make_tool_page(const std::filesystem::path& recording);

}  // namespace dyop::view_internal
