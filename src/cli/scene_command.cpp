// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/commands.h"
#include "dyop/core/error.h"
#include "dyop/io/scene_file.h"

namespace dyop::cli {
namespace {

struct SceneArguments {
  std::string kind;
  int n = 0;
  std::string out;
  bool is_json = false;
};

std::string scene_footer() {
  std::ostringstream text;
  text << "Kinds, and what N counts:\n";
  for (const SceneKind& kind : scene_kinds()) {
    text << "  " << kind.name << std::string(11 - kind.name.size(), ' ') << kind.count << " ("
         << kind.least << " to " << kind.most << ")\n";
  }
  text << "Without --out a scene that needs no mesh files goes to stdout; mesh files are written "
          "beside\n"
          "the scene file.\n\nExamples:\n"
          "  Generate and step an arch of 25 stones:\n"
          "    dyop scene arch 25 --out arch.json && dyop simulate arch.json\n"
          "  A net of rings; ring.obj is written beside net.json:\n"
          "    dyop scene chain-net 8 --out net.json --json\n";
  return text.str();
}

ExitCode run_scene(const SceneArguments& arguments) {
  const GeneratedScene scene = generate_scene(arguments.kind, arguments.n);
  if (arguments.out.empty()) {
    DYOP_REQUIRE(scene.meshes.empty() && !arguments.is_json, "--out is required",
                 arguments.is_json ? " with --json" : ": mesh files are written beside the scene");
    std::cout << scene.text;
    return ExitCode::Answered;
  }
  write_generated_scene(scene, arguments.out);
  if (arguments.is_json) {
    nlohmann::ordered_json json;
    json["scene"] = arguments.out;
    json["meshes"] = nlohmann::ordered_json::array();
    for (const auto& [name, text] : scene.meshes) json["meshes"].push_back(name);
    std::cout << json.dump() << '\n';
  }
  return ExitCode::Answered;
}

}  // namespace

void add_scene_command(CLI::App& app, ExitCode& exit_code) {
  auto arguments = std::make_shared<SceneArguments>();
  CLI::App* command = app.add_subcommand("scene", "Generate a scene file");
  command->footer(scene_footer());
  command->add_option("KIND", arguments->kind, "Kind of scene, see below")->required();
  command->add_option("N", arguments->n, "Size of the scene, see below")->required();
  command->add_option("-o,--out", arguments->out, "Scene file to write");
  command->add_flag("--json", arguments->is_json,
                    "Print one JSON object to stdout: the files written");
  command->callback([arguments, &exit_code] { exit_code = run_scene(*arguments); });
}

}  // namespace dyop::cli
