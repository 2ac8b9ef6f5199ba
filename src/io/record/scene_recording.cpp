// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/scene_recording.h"

namespace dyop {

RunHeader run_header(const Scene& scene) {
  RunHeader header;
  header.title = scene.title;
  header.scene = scene.source;
  header.target_distance = scene.options.target_distance;
  header.rest_offset = scene.options.rest_offset;
  header.end_time = scene.end_time;
  header.step = scene.step;
  return header;
}

}  // namespace dyop
