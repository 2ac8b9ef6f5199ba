// SPDX-License-Identifier: BSD-3-Clause
#include <fstream>
#include <iostream>
#include <map>

#include "cli/body_arguments.h"
#include "cli/commands.h"
#include "cli/console.h"
#include "cli/scene_run.h"
#include "cli/study/study_file.h"
#include "dyop/dynamics/integrator.h"
#include "dyop/io/file_error.h"
#include "dyop/io/query_record.h"
#include "dyop/io/run_summary.h"
#include "io/file_bytes.h"

namespace dyop::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kStudyExamples =
    R"(STUDY names a scene and the values in it that change (docs/formats.md). A shard holds its
results in DIR; started again, it goes on where it ended. Shards need not know of each other.

Examples:
  One of 64 jobs, the fourth; then all results in one file:
    dyop study study.json --shard 4/64 --out results
    dyop study study.json --merge --out results
  On all cores of one machine, with GNU parallel:
    parallel dyop study study.json --shard {}/64 --out results ::: $(seq 64)
  As an array job of Slurm:
    sbatch --array=1-64 --wrap 'dyop study study.json --shard $SLURM_ARRAY_TASK_ID/64 --out results'
)";

struct StudyArguments {
  std::string study;
  std::string out;
  std::string shard = "1/1";
  std::vector<std::string> mesh_path;
  int threads = 1;
  bool is_merge = false;
  bool no_progress = false;
  bool is_json = false;
};

std::string check_shard(const std::string& text) {
  const auto slash = text.find('/');
  const auto is_number = [](const std::string& digits) {
    return !digits.empty() && digits.size() < 10 &&
           digits.find_first_not_of("0123456789") == std::string::npos;
  };
  const bool is_fraction = slash != std::string::npos && is_number(text.substr(0, slash)) &&
                           is_number(text.substr(slash + 1));
  if (is_fraction) {
    const long number = std::stol(text);
    if (1 <= number && number <= std::stol(text.substr(slash + 1))) return {};
  }
  return "must be K/N with 1 <= K <= N, not " + text;
}

Shard read_shard(const std::string& text) {
  return {std::stol(text), std::stol(text.substr(text.find('/') + 1))};
}

// The scene of one case, in a file of its own that lives as long as this.
class CaseScene {
 public:
  CaseScene(const Study& study, const StudyArguments& arguments)
      : study_(study),
        file_(fs::path(arguments.out) / (".case-" + read_shard_name(arguments) + ".json")),
        directories_(mesh_directories(arguments.mesh_path)) {
    directories_.insert(directories_.begin(), study.scene_file().parent_path().empty()
                                                  ? fs::path(".")
                                                  : study.scene_file().parent_path());
  }
  ~CaseScene() {
    std::error_code ignored;
    fs::remove(file_, ignored);
  }
  CaseScene(const CaseScene&) = delete;
  CaseScene& operator=(const CaseScene&) = delete;

  Scene load(std::int64_t number) const {
    std::ofstream out(file_, std::ios::binary);
    out << study_.scene_text(number);
    out.close();
    if (!out) throw FileError(file_, "could not be written");
    return load_scene(file_, directories_);
  }
  // An error's message, the same for every shard.
  std::string message_of(const Error& error) const {
    std::string message = error.what();
    const std::string name = file_.string();
    if (message.starts_with(name)) message.replace(0, name.size(), study_.scene_file().string());
    return message;
  }

 private:
  static std::string read_shard_name(const StudyArguments& arguments) {
    const Shard shard = read_shard(arguments.shard);
    return std::to_string(shard.number) + "-of-" + std::to_string(shard.count);
  }
  const Study& study_;
  fs::path file_;
  std::vector<fs::path> directories_;
};

// One line; empty if the case was stopped.
std::string run_case(const Study& study, const CaseScene& files, std::int64_t number, int threads,
                     const std::stop_token& stop) {
  nlohmann::ordered_json line{{"case", number}, {"values", study.values(number)}};
  RunTotals totals;
  nlohmann::ordered_json first_impact;
  try {
    Scene scene = files.load(number);
    scene.options.thread_count = threads;
    scene.options.records_motions = false;
    World world = make_world(scene);
    step_through(scene, stop, world, [&](const AdvanceReport& report) {
      totals.add(report);
      if (first_impact.is_null() && !report.impacts.empty()) first_impact = report.impacts[0].t;
    });
    if (totals.status == AdvanceStatus::Cancelled) return {};
    line["status"] = totals.end();
    line["t"] = totals.t;
    line["steps"] = totals.steps;
    line["impacts"] = totals.impacts;
    line["first_impact"] = first_impact;
    line["too_near"] = totals.too_near.size();
    line["bodies"] = bodies_json(world);
  } catch (const InternalError&) {
    throw;
  } catch (const Error& error) {  // an answer, too: this case cannot be run
    line["status"] = "Error";
    line["error"] = files.message_of(error);
  }
  return line.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace);
}

// How many of the cases cannot be run, and why the first one cannot.
class CaseErrors {
 public:
  void add(const nlohmann::json& line) {
    if (line.at("status") == "Error" && count_++ == 0) first_ = line.at("error");
  }
  void report_in(nlohmann::ordered_json& report) const {
    if (count_ == 0) return;
    report["errors"] = count_;
    report["first_error"] = first_;
  }

 private:
  std::int64_t count_ = 0;
  std::string first_;
};

void print_report(const StudyArguments& arguments, const nlohmann::ordered_json& report) {
  if (arguments.is_json) {
    std::cout << report.dump() << '\n';
    return;
  }
  for (const auto& [key, value] : report.items()) {
    std::cout << key << ": " << (value.is_string() ? value.get<std::string>() : value.dump())
              << '\n';
  }
}

ExitCode run_shard(const Study& study, const StudyArguments& arguments) {
  const InterruptGuard interrupt;
  const Shard shard = read_shard(arguments.shard);
  ShardFile file(arguments.out, study, shard);
  const CaseScene files(study, arguments);
  const std::int64_t last = study.case_count() - shard.number;
  const std::int64_t count = last < 0 ? 0 : last / shard.count + 1;
  const std::int64_t found = file.done();
  CaseErrors errors;
  ProgressBar progress(!arguments.no_progress);
  while (file.done() < count && !interrupt.token().stop_requested()) {
    const std::int64_t number = shard.number - 1 + file.done() * shard.count;
    const std::string line = run_case(study, files, number, arguments.threads, interrupt.token());
    if (line.empty()) break;
    file.append(line);
    errors.add(nlohmann::json::parse(line));
    progress.update(double(file.done()) / double(count), 0);
  }
  const bool is_complete = file.done() == count;
  nlohmann::ordered_json report{{"shard", arguments.shard},
                                {"cases", count},
                                {"found", found},
                                {"run", file.done() - found},
                                {"complete", is_complete}};
  errors.report_in(report);
  print_report(arguments, report);
  return is_complete ? ExitCode::Answered : ExitCode::Undecided;
}

void write_results(const fs::path& file, const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) {
    if (!line.empty()) text += line + '\n';
  }
  io_internal::write_whole_file(file, text);
}

ExitCode run_merge(const Study& study, const StudyArguments& arguments) {
  const MergedShards merged = merge_shards(arguments.out, study);
  std::map<std::string, std::int64_t> ends;
  CaseErrors errors;
  for (const std::string& line : merged.lines) {
    if (line.empty()) continue;
    const nlohmann::json result = nlohmann::json::parse(line);
    ++ends[result.at("status").get<std::string>()];
    errors.add(result);
  }
  const fs::path file = fs::path(arguments.out) / "results.jsonl";
  nlohmann::ordered_json report{
      {"cases", study.case_count()}, {"missing", merged.missing.size()}, {"ends", ends}};
  errors.report_in(report);
  if (!merged.missing.empty()) {
    report["first_missing"] = merged.missing.front();
    print_report(arguments, report);
    return ExitCode::Undecided;
  }
  write_results(file, merged.lines);
  report["results"] = file.string();
  print_report(arguments, report);
  return ExitCode::Answered;
}

ExitCode run_study(const StudyArguments& arguments) {
  const Study study(arguments.study);
  std::error_code error;
  fs::create_directories(arguments.out, error);
  if (error) throw FileError(arguments.out, "could not be created: " + error.message());
  return arguments.is_merge ? run_merge(study, arguments) : run_shard(study, arguments);
}

}  // namespace

void add_study_command(CLI::App& app, ExitCode& exit_code) {
  auto arguments = std::make_shared<StudyArguments>();
  CLI::App* command = app.add_subcommand("study", "Run many variants of a scene, in shards");
  command->footer(kStudyExamples);
  command->add_option("STUDY", arguments->study, "Study file (docs/formats.md)")->required();
  command->add_option("-o,--out", arguments->out, "Directory for the results; created if missing")
      ->required();
  CLI::Option* shard =
      command->add_option("--shard", arguments->shard, "K/N: the K-th of N parts, 1 <= K <= N")
          ->check(check_shard)
          ->capture_default_str();
  command->add_flag("--merge", arguments->is_merge, "Collect the shards' results in results.jsonl")
      ->excludes(shard);
  command->add_option("--mesh-path", arguments->mesh_path, "More directories to search for meshes");
  command->add_option("--threads", arguments->threads, "Per scene; 0: one per core")
      ->check(CLI::Range(0, 4096))
      ->capture_default_str();
  command->add_flag("--no-progress", arguments->no_progress, "No progress bar on a terminal");
  command->add_flag("--json", arguments->is_json, "One JSON object on stdout");
  command->callback([arguments, &exit_code] { exit_code = run_study(*arguments); });
}

}  // namespace dyop::cli
