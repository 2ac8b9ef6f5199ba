// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/motion_file.h"

#include "io/file_bytes.h"
#include "io/scene/motion_reader.h"

namespace dyop {

std::shared_ptr<const Motion> load_motion(const std::filesystem::path& file) {
  const internal::Json json = internal::parse_json(file, internal::read_bytes(file));
  return internal::read_motion(internal::JsonNode(file, json));
}

}  // namespace dyop
