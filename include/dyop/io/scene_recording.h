// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "dyop/io/recording_writer.h"
#include "dyop/io/scene_file.h"

namespace DYOP_EXPORT dyop {

/// What a recording of this scene's run is headed with.
RunHeader run_header(const Scene& scene);

/// Writes a run that is recorded as text (docs/recording-format.md) as a file of docs/recording.md.
/// The text holds samples of the motions, so all its segments are SegmentKind::Approximate, with
/// the poses that recorded_pose() gives, and it knows no pairs and no energy.
/// @param scene The scene that was run: its shapes are not in the text.
/// @throws FileError if a file cannot be read or written, or the number of bodies differs.
void convert_recording(const std::filesystem::path& text, const Scene& scene,
                       const std::filesystem::path& out);

}  // namespace dyop
