#include <iostream>
#include <sstream>

#include "cli/commands.h"
#include "dyop/scene_io/scene_generator.h"

namespace dyop::cli {
namespace {

struct SceneArguments {
  std::string kind;
  int n = 0;
  std::string out;
};

std::string scene_footer() {
  std::ostringstream text;
  text << "Kinds, and what N counts:\n";
  for (const SceneKind& kind : scene_kinds()) {
    text << "  " << kind.name << std::string(11 - kind.name.size(), ' ') << kind.count << " ("
         << kind.least << " to " << kind.most << ")\n";
  }
  text << "Mesh files that a scene names are written beside it.\n\nExample:\n"
          "  dyop scene arch 25 --out arch.json && dyop simulate arch.json --out run\n";
  return text.str();
}

}  // namespace

void add_scene_command(CLI::App& app, ExitCode& exit_code) {
  auto arguments = std::make_shared<SceneArguments>();
  CLI::App* command = app.add_subcommand("scene", "Make a scene file of a known kind");
  command->footer(scene_footer());
  command->add_option("KIND", arguments->kind, "What it shows, see below")->required();
  command->add_option("N", arguments->n, "How many")->required();
  command->add_option("--out", arguments->out, "Scene file to write")->required();
  command->callback([arguments, &exit_code] {
    write_generated_scene(generate_scene(arguments->kind, arguments->n), arguments->out);
    exit_code = ExitCode::Answered;
  });
}

}  // namespace dyop::cli
