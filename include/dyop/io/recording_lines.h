// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <iosfwd>

#include "dyop/io/recording.h"
#include "dyop/io/scene_file.h"

namespace DYOP_EXPORT dyop {

/// Writes a recorded run as text, one JSON object a line, in order of time: for scripts and for
/// comparing runs. The lines depend only on what was recorded. docs/formats.md lists them.
void write_json_lines(std::ostream& out, const RecordingReader& reader);

/// What a recording of this scene's run is headed with.
RunHeader run_header(const Scene& scene);

}  // namespace dyop
