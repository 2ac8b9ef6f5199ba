// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

namespace dyop::cli {

/// Throws FileError unless the name ends in .svg, .png or .html, and this program can write that.
/// To be asked before the work of a query is done.
void require_picture(const std::filesystem::path& file);

/// Writes a picture (an SVG file's text) to a file of such a name: as it is, as PNG with twice its
/// pixels, or in an HTML page.
/// @throws FileError
void write_picture(const std::filesystem::path& file, const std::string& svg);

/// The picture as a PNG file.
/// @throws FileError if this program was built without librsvg.
std::string png_of(const std::filesystem::path& file, const std::string& svg);

}  // namespace dyop::cli
