// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <iomanip>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/body_arguments.h"
#include "cli/commands.h"
#include "cli/recording/recording_tools.h"
#include "dyop/geometry/triangle_mesh.h"

namespace dyop::cli {
namespace {

constexpr const char* kInfoExamples = R"(Examples:
  Size of a mesh, and whether it is closed:
    dyop info bunny.obj
  Mass properties at unit density about the centre of mass, scaled by ten, as JSON:
    dyop info bunny.obj --scale 10 --center mass --json
  What happened in a run; and all of it as text, one JSON object a line:
    dyop info run.h5
    dyop info run.h5 --json-lines > run.jsonl
)";

struct InfoArguments {
  std::string mesh;
  PlacementArguments placement;
  bool is_json = false;
  bool is_json_lines = false;
};

struct MeshReport {
  std::size_t vertices = 0;
  std::size_t triangles = 0;
  std::size_t degenerate = 0;
  std::size_t duplicate = 0;
  std::size_t nodes = 0;
  std::size_t bytes = 0;
  bool is_closed = false;
  AlignedBox bounds;
  Scalar bounding_radius = 0;
  Scalar area = 0;
  std::optional<MassProperties> solid;  ///< of unit density, if the mesh encloses a volume
};

std::size_t count_duplicates(const TriangleMesh& mesh) {
  std::vector<TriangleIndices> sorted(mesh.triangles().begin(), mesh.triangles().end());
  for (TriangleIndices& triangle : sorted) std::sort(triangle.begin(), triangle.end());
  std::sort(sorted.begin(), sorted.end());
  return std::size_t(sorted.end() - std::unique(sorted.begin(), sorted.end()));
}

bool has_no_area(const Triangle& triangle) {
  return (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).isZero(0);
}

// A mesh may have no area or volume; that is not an error here.
Scalar area_or_zero(const TriangleMesh& mesh) {
  try {
    return mesh.compute_shell_mass_properties(1).mass;
  } catch (const InvalidArgument&) {
    return 0;
  }
}

std::optional<MassProperties> solid_or_nothing(const TriangleMesh& mesh) {
  try {
    return mesh.compute_mass_properties(1);
  } catch (const InvalidArgument&) {
    return std::nullopt;
  }
}

MeshReport inspect(const TriangleMesh& mesh) {
  MeshReport report;
  report.vertices = mesh.vertices().size();
  report.triangles = mesh.triangles().size();
  for (std::size_t k = 0; k < report.triangles; ++k) {
    report.degenerate += has_no_area(mesh.triangle(std::int32_t(k)));
  }
  report.duplicate = count_duplicates(mesh);
  report.nodes = mesh.hierarchy().nodes().size();
  report.bytes = report.vertices * sizeof(Vector3) + report.triangles * sizeof(TriangleIndices) +
                 report.nodes * sizeof(MeshHierarchy::Node);
  report.is_closed = mesh.is_closed();
  report.bounds = mesh.bounding_box();
  report.bounding_radius = mesh.bounding_radius();
  report.area = area_or_zero(mesh);
  report.solid = solid_or_nothing(mesh);
  return report;
}

nlohmann::ordered_json to_json(const Vector3& v) {
  return nlohmann::ordered_json::array({v.x(), v.y(), v.z()});
}

void print_json(const MeshReport& report) {
  nlohmann::ordered_json json;
  json["vertices"] = report.vertices;
  json["triangles"] = report.triangles;
  json["is_closed"] = report.is_closed;
  json["degenerate_triangles"] = report.degenerate;
  json["duplicate_triangles"] = report.duplicate;
  json["bounds"] = {{"min", to_json(report.bounds.min())}, {"max", to_json(report.bounds.max())}};
  json["bounding_radius"] = report.bounding_radius;
  json["area"] = report.area;
  json["solid"] = nullptr;
  if (report.solid) {
    const Matrix3& I = report.solid->I_BBcm;
    json["solid"] = {{"volume", report.solid->mass},
                     {"p_BoBcm", to_json(report.solid->p_BoBcm)},
                     {"I_BBcm", {to_json(I.row(0)), to_json(I.row(1)), to_json(I.row(2))}}};
  }
  json["hierarchy_nodes"] = report.nodes;
  json["bytes"] = report.bytes;
  std::cout << json.dump() << '\n';
}

void print_words(const MeshReport& report) {
  const Eigen::IOFormat row(9, Eigen::DontAlignCols, ", ", ", ", "", "", "(", ")");
  std::cout.precision(9);
  std::cout << "triangles         " << report.triangles << ", " << report.degenerate
            << " without area, " << report.duplicate << " duplicate\n"
            << "vertices          " << report.vertices << '\n'
            << "closed            " << (report.is_closed ? "yes" : "no") << '\n'
            << "bounds            " << report.bounds.min().transpose().format(row) << " to "
            << report.bounds.max().transpose().format(row) << '\n'
            << "bounding radius   " << report.bounding_radius << '\n'
            << "area              " << report.area << '\n';
  if (report.solid) {
    const Matrix3& I = report.solid->I_BBcm;
    std::cout << "volume            " << report.solid->mass << '\n'
              << "centre of mass    " << report.solid->p_BoBcm.transpose().format(row) << '\n'
              << "inertia           " << I.row(0).format(row) << '\n'
              << "  (density 1)     " << I.row(1).format(row) << '\n'
              << "                  " << I.row(2).format(row) << '\n';
  } else {
    std::cout << "volume            none: the mesh is open or inside out\n";
  }
  std::cout << "hierarchy         " << report.nodes << " nodes\n"
            << std::setprecision(3) << "memory            " << Scalar(report.bytes) / (1 << 20)
            << " MiB\n";
}

RecordingForm form_of(const InfoArguments& arguments) {
  if (arguments.is_json_lines) return RecordingForm::JsonLines;
  return arguments.is_json ? RecordingForm::Json : RecordingForm::Words;
}

ExitCode run_info(const InfoArguments& arguments) {
  if (is_recording(arguments.mesh)) return print_recording(arguments.mesh, form_of(arguments));
  DYOP_REQUIRE(!arguments.is_json_lines, "--json-lines needs a recording, not ", arguments.mesh);
  const auto shape = make_shape(arguments.mesh, arguments.placement);
  const auto* mesh = dynamic_cast<const TriangleMesh*>(shape.get());
  DYOP_REQUIRE(mesh != nullptr, arguments.mesh, ": expected a mesh file");
  const MeshReport report = inspect(*mesh);
  arguments.is_json ? print_json(report) : print_words(report);
  return ExitCode::Answered;
}

}  // namespace

void add_info_command(CLI::App& app, ExitCode& exit_code) {
  auto arguments = std::make_shared<InfoArguments>();
  CLI::App* command = app.add_subcommand("info", "What a mesh file or a recording holds");
  command->footer(kInfoExamples);
  command->add_option("FILE", arguments->mesh, "Mesh file, or recording in HDF5")->required();
  add_placement_options(*command, arguments->placement);
  command->add_flag("--json", arguments->is_json, "Print one JSON object to stdout");
  command
      ->add_flag("--json-lines", arguments->is_json_lines,
                 "Print a whole recording, one JSON object a line (docs/formats.md)")
      ->excludes("--json");
  command->callback([arguments, &exit_code] { exit_code = run_info(*arguments); });
}

}  // namespace dyop::cli
