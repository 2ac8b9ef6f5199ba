// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/io/recorded_run.h"
#include "dyop/io/scene_file.h"

namespace DYOP_EXPORT dyop {

/// What a recording of this scene's run is headed with.
RunHeader run_header(const Scene& scene);

}  // namespace dyop
