// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <iomanip>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string_view>

#include "check/check.h"
#include "cli/body_arguments.h"
#include "cli/commands.h"
#include "cli/page/page_output.h"
#include "cli/recording/recording_tools.h"
#include "cli/tool/tool_summary.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/io/haptic_recording.h"
#include "dyop/io/recording.h"
#include "dyop/io/recording_lines.h"
#include "dyop/view/run_files.h"
#include "io/file_bytes.h"

namespace dyop::cli {
namespace {

constexpr const char* kCheckExamples =
    R"(Reads nothing but the file, and shares no code with what computed the run (docs/check.md). The
program dyop-check does the same without the rest of dyop.

Examples:
    dyop simulate examples/scenes/arch.json -o run.h5
    dyop check run.h5
  Of a haptic tool: that no motion of any tick broke a margin:
    dyop tool examples/surgery/two-hands.json -o run.h5
    dyop check run.h5
)";

}  // namespace

PageVerdict verdict_on(const std::filesystem::path& file) {
  std::ostringstream words;
  const int code = dyop_check::check_file(file.string(), 1, words, words);
  return {code == 0, file.filename().string() + ": " + words.str()};
}

void add_check_command(CLI::App& app, ExitCode& exit_code) {
  struct Arguments {
    std::string file;
    bool touching = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("check", "Prove from a recording that bodies or tools kept apart");
  command->footer(kCheckExamples);
  command->add_option("RECORDING", arguments->file, "Recording of dyop simulate or dyop tool")
      ->required();
  command->add_flag("--touching", arguments->touching, "Ask only that nothing touched");
  command->callback([arguments, &exit_code] {
    const double scale = arguments->touching ? 0 : 1;
    exit_code = static_cast<ExitCode>(
        dyop_check::check_file(arguments->file, scale, std::cout, std::cerr, "dyop"));
  });
}

namespace {

constexpr const char* kExportExamples =
    R"(-o FILE.glb writes binary glTF, which Blender and every other viewer plays; -o FILE.mp4 a film;
--frames DIR pictures at equal steps of time. Pictures are drawn by Chromium without a window; a film
needs ffmpeg as well. `dyop info --json-lines` writes a recording as text.

Examples:
  For Blender:
    dyop export run.h5 -o run.glb
  A film at a tenth of the speed, and ten pictures for a paper:
    dyop export run.h5 -o run.mp4 --speed 0.1
    dyop export run.h5 --frames pictures --fps 10 --from 0.3 --to 1.2 --width 1920 --height 1080
)";

}  // namespace

void add_export_command(CLI::App& app, ExitCode& exit_code) {
  auto arguments = std::make_shared<ExportArguments>();
  CLI::App* command = app.add_subcommand("export", "A recorded run in another form");
  command->footer(kExportExamples);
  command->add_option("RECORDING", arguments->recording, "Recording (docs/formats.md)")->required();
  command->add_option("-o,--out", arguments->out, "File to write; its ending says what");
  command->add_option("--frames", arguments->frames, "Directory of pictures frame-00000.png, ...");
  add_frame_options(*command, arguments->frame_options);
  command
      ->add_option(
          "--tolerance", arguments->tolerance,
          "Of glTF: how far poses may be off, as a part of the smallest moving body's radius")
      ->check(require_positive)
      ->capture_default_str();
  command->add_option("--up", arguments->up, "Of glTF: the run's upward axis")
      ->check(CLI::IsMember({"z", "y"}))
      ->capture_default_str();
  command->callback([arguments, &exit_code] { exit_code = export_recording(*arguments); });
}

namespace {

void export_frames(const ExportArguments& arguments, const std::string& out) {
  const std::string page = recorded_page_html(arguments.recording);
  const std::int64_t count = write_page_frames(page, out, arguments.frame_options);
  std::cout << "frames: " << count << '\n';
}

}  // namespace

ExitCode export_recording(const ExportArguments& arguments) {
  const std::filesystem::path out = arguments.out;
  for (const std::string& file : {arguments.out, arguments.frames})
    io_internal::require_other_than(file, {arguments.recording});
  DYOP_REQUIRE(!arguments.out.empty() || !arguments.frames.empty(),
               "export needs -o FILE or --frames DIR");
  if (!arguments.frames.empty()) export_frames(arguments, arguments.frames);
  if (arguments.out.empty()) return ExitCode::Answered;
  if (out.extension() == ".mp4") {
    export_frames(arguments, arguments.out);
    return ExitCode::Answered;
  }
  if (out.extension() == ".glb") {
    GltfOptions options;
    options.tolerance = arguments.tolerance;
    options.z_is_up = arguments.up == "z";
    write_gltf(arguments.recording, out, options);
    return ExitCode::Answered;
  }
  throw InvalidArgument("-o " + arguments.out + ": expected a file .glb or .mp4");
}

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
  const std::string& title = reader.header().title;
  std::cout << "run               " << (title.empty() ? "without a title" : title) << '\n'
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
            << std::setprecision(3) << "size              " << Scalar(summary.bytes) / (1 << 20)
            << " MiB\n";
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

namespace {

class Hdf5Output final : public RunOutput {
 public:
  Hdf5Output(const std::filesystem::path& file, const Scene& scene, const RecordingOptions& options)
      : writer_(file, run_header(scene), options) {}

  void write(const AdvanceReport& report, const World& world) override {
    writer_.write(report, world);
  }
  void finish() override { writer_.finish(); }
  void fail(const std::string& error) override { writer_.fail(error); }

 private:
  RecordingWriter writer_;
};

PairDetail detail_of(const std::string& word) {
  if (word == "none") return PairDetail::None;
  if (word == "gaps") return PairDetail::Gaps;
  DYOP_REQUIRE(word == "contacts", "pairs must be none, gaps or contacts, not ", word);
  return PairDetail::Contacts;
}

}  // namespace

std::unique_ptr<RunOutput> make_hdf5_output(const std::filesystem::path& file, const Scene& scene,
                                            const std::string& pairs) {
  RecordingOptions options;
  options.pairs = detail_of(pairs);
  return std::make_unique<Hdf5Output>(file, scene, options);
}

}  // namespace dyop::cli
