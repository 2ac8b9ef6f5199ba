// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <string>

#include "dyop/view/run_files.h"

/// What `view` and `export` both write of a run: its page, and pictures of that page.
namespace dyop::cli {

/// The options of frames, but the one that says where they go.
void add_frame_options(CLI::App& command, FrameOptions& options);

/// How `view` and `tool` serve a live page.
struct LivePage {
  int port = 0;
  bool ends_with_run = false;
};

/// --port and --end-with-run.
void add_live_options(CLI::App& command, LivePage& page);

void write_page(const std::filesystem::path& file, const std::string& html);

/// write_frames() of a page that need not be kept.
std::int64_t write_page_frames(const std::string& html, const std::filesystem::path& out,
                               const FrameOptions& options);

}  // namespace dyop::cli
