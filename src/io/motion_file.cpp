// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/motion_file.h"

#include "io/file_bytes.h"
#include "io/scene/motion_reader.h"

namespace dyop {

std::shared_ptr<const Motion> load_motion(const std::filesystem::path& file) {
  const io_internal::Json json = io_internal::parse_json(file, io_internal::read_bytes(file));
  return io_internal::read_motion(io_internal::JsonNode(file, json));
}

}  // namespace dyop
