// SPDX-License-Identifier: BSD-3-Clause
#include "io/record/recording_input.h"

#include <algorithm>

#include "dyop/io/file_error.h"

namespace dyop::io_internal {
namespace {

std::optional<Scalar> optional_number(const Json& json) {
  if (json.is_null()) return std::nullopt;
  return json.get<Scalar>();
}

}  // namespace

Hdf5File open_recording(const std::filesystem::path& path) {
  Hdf5File file = Hdf5File::open(path);
  const std::string format = file.text_attribute("format");
  if (format != kRecordingFormat) {
    throw FileError(path, "is no recording of dyop's World: its format is '" + format + "'");
  }
  const std::int64_t version = file.integer_attribute("version");
  if (version < 1 || version > kRecordingVersion) {
    throw FileError(path,
                    compose_message("is a recording of version ", version,
                                    ", this program reads versions 1 to ", kRecordingVersion));
  }
  return file;
}

std::string text_of(const std::vector<char>& bytes) {
  return {bytes.begin(), bytes.end()};
}

std::vector<Json> json_lines(const std::string& text) {
  std::vector<Json> lines;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    lines.push_back(Json::parse(text.substr(begin, end - begin)));
    begin = end + 1;
  }
  return lines;
}

RunHeader header_from(const Json& json) {
  RunHeader header;
  header.title = json.at("title").get<std::string>();
  if (!json.at("scene").is_null()) header.scene = json.at("scene").dump();
  header.target_distance = optional_number(json.at("target_distance"));
  header.rest_offset = optional_number(json.at("rest_offset"));
  header.begin_time = json.at("begin_time").get<Scalar>();
  header.end_time = json.at("end_time").get<Scalar>();
  header.step = json.at("step").get<Scalar>();
  return header;
}

}  // namespace dyop::io_internal
