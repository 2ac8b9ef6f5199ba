// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "dyop/distance/distance.h"
#include "dyop/toi/time_of_impact.h"

namespace dyop::cli {

/// A time-of-impact query and its answer as an SVG file: both shapes at t_safe with their paths,
/// witness points, normal and pivot; the same from near; and the gap over time with the proven
/// lower bound.
std::string toi_picture(const ToiQuery& query, const ToiResult& result);

/// A distance query and its answer: the shapes, witness points, normal and pivot.
std::string distance_picture(const Shape& a, const RigidPose& X_WA, const Shape& b,
                             const RigidPose& X_WB, const DistanceResult& result);

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
