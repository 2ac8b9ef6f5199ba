// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "dyop/core/export.h"

namespace DYOP_EXPORT dyop {

/// Whether this dyop was built with its page (it needs npm packages, see docs/player.md).
bool has_page();

/// A self-contained HTML page that plays a run: PageEncoder's blocks within the page's own code.
/// Opens from a file; needs no network.
/// @throws InvalidArgument unless has_page().
std::string page_html(std::string_view title, std::span<const std::string> blocks);

/// The same page without a run: it fetches its blocks from the server that it comes from, and
/// controls the run there (LiveServer).
/// @throws InvalidArgument unless has_page().
std::string live_page_html(std::string_view title);

}  // namespace dyop
