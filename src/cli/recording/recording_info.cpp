// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string_view>

#include "cli/recording/recording_tools.h"
#include "cli/tool/tool_output.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/io/haptic_recording_reader.h"
#include "dyop/io/recording_lines.h"
#include "dyop/io/recording_reader.h"

namespace dyop::cli {
namespace {

constexpr std::size_t kSegmentKinds = 6;
constexpr std::size_t kEventKinds = 8;

struct RecordingSummary {
  std::array<std::size_t, kSegmentKinds> segments{};  // by kind
  std::array<std::size_t, kEventKinds> events{};
  std::size_t segment_count = 0;
  std::size_t triangles = 0;
  std::uintmax_t bytes = 0;
  Scalar residual = 0;
  std::int64_t stalls = 0;
};

std::size_t triangles_of(const Shape& shape) {
  const auto* mesh = dynamic_cast<const TriangleMesh*>(&shape);
  return mesh == nullptr ? 0 : mesh->triangles().size();
}

RecordingSummary summarize(const RecordingReader& reader, const std::filesystem::path& file) {
  RecordingSummary summary;
  for (std::size_t body = 0; body < reader.bodies().size(); ++body) {
    const std::size_t count = reader.segment_count(BodyId(body));
    summary.segment_count += count;
    for (std::size_t k = 0; k < count; ++k) {
      ++summary.segments[std::size_t(reader.segment(BodyId(body), k).kind)];
    }
  }
  for (const RunEvent& event : reader.events()) ++summary.events[std::size_t(event.kind)];
  for (const RecordedShape& shape : reader.shapes())
    summary.triangles += triangles_of(*shape.shape);
  for (const RecordedFrame& frame : reader.frames()) {
    summary.residual = std::max(summary.residual, frame.work.residual);
    summary.stalls += frame.work.stalls;
  }
  summary.bytes = std::filesystem::file_size(file);
  return summary;
}

std::string end_words(const RecordingReader& reader) {
  if (!reader.end()) return "not ended: still running, or killed";
  if (!reader.end()->error.empty()) return "Error: " + reader.end()->error;
  return std::string(name_of(reader.end()->status));
}

template <typename Kind, std::size_t Count>
nlohmann::ordered_json counts_json(const std::array<std::size_t, Count>& counts) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (std::size_t k = 0; k < Count; ++k) json[std::string(name_of(Kind(k)))] = counts[k];
  return json;
}

void print_json(const RecordingReader& reader, const RecordingSummary& summary) {
  nlohmann::ordered_json json;
  json["title"] = reader.header().title;
  json["end"] = end_words(reader);
  json["is_complete"] = reader.end().has_value();
  json["interval"] = {reader.interval().begin, reader.interval().end};
  json["planned_end"] = reader.header().end_time;
  json["bodies"] = reader.bodies().size();
  json["shapes"] = reader.shapes().size();
  json["triangles"] = summary.triangles;
  json["frames"] = reader.frames().size();
  json["steps"] = reader.steps().size();
  json["segments"] = counts_json<SegmentKind>(summary.segments);
  json["impacts"] = reader.impacts().size();
  json["events"] = counts_json<RunEventKind>(summary.events);
  json["stalls"] = summary.stalls;
  json["residual"] = summary.residual;
  json["bytes"] = summary.bytes;
  std::cout << json.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace) << '\n';
}

template <typename Kind, std::size_t Count>
std::string count_words(const std::array<std::size_t, Count>& counts) {
  std::string words;
  for (std::size_t k = 0; k < Count; ++k) {
    if (counts[k] == 0) continue;
    words += (words.empty() ? "" : ", ") + std::to_string(counts[k]) + ' ' +
             std::string(name_of(Kind(k)));
  }
  return words.empty() ? "none" : words;
}

void print_words(const RecordingReader& reader, const RecordingSummary& summary) {
  std::cout.precision(9);
  std::cout << "run               " << reader.header().title << '\n'
            << "ended             " << end_words(reader) << '\n'
            << "time              " << reader.interval().begin << " to " << reader.interval().end
            << ", planned to " << reader.header().end_time << '\n'
            << "bodies            " << reader.bodies().size() << ", " << reader.shapes().size()
            << " shapes, " << summary.triangles << " triangles\n"
            << "steps             " << reader.steps().size() << " in " << reader.frames().size()
            << " advances\n"
            << "segments          " << summary.segment_count << ": "
            << count_words<SegmentKind>(summary.segments) << '\n'
            << "impacts           " << reader.impacts().size() << '\n'
            << "events            " << count_words<RunEventKind>(summary.events) << '\n'
            << "solver            largest residual " << summary.residual << ", " << summary.stalls
            << " stalls\n"
            << "size              " << Scalar(summary.bytes) / (1 << 20) << " MiB\n";
}

}  // namespace

ExitCode print_recording(const std::filesystem::path& file, RecordingForm form) {
  const bool is_json = form == RecordingForm::Json;
  if (is_haptic_recording(file)) {
    DYOP_REQUIRE(form != RecordingForm::JsonLines, file.string(),
                 ": --json-lines is for recordings of dyop simulate");
    return print_haptic_recording(file, is_json);
  }
  const RecordingReader reader(file);
  if (form == RecordingForm::JsonLines) {
    write_json_lines(std::cout, reader);
    return ExitCode::Answered;
  }
  const RecordingSummary summary = summarize(reader, file);
  is_json ? print_json(reader, summary) : print_words(reader, summary);
  return ExitCode::Answered;
}

}  // namespace dyop::cli
