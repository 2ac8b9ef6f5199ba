// SPDX-License-Identifier: BSD-3-Clause
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>

#include "dyop/io/file_error.h"
#include "dyop/io/run_summary.h"
#include "dyop/io/scene_file.h"
#include "dyop/io/scene_generator.h"
#include "python/bindings.h"
#include "python/glue/record.h"
#include "python/stepping/python_scene.h"
#include "python/stepping/python_world.h"

namespace dyop::python {
namespace {

namespace fs = std::filesystem;

void bind_scene(py::module_& m) {
  Record<SceneTarget>(m, "SceneTarget", "A target distance of one pair.")
      .field<&SceneTarget::a>("a", "BodyId: A")
      .field<&SceneTarget::b>("b", "BodyId: B")
      .field<&SceneTarget::distance>("distance", "float: length")
      .finish();
  py::class_<PythonScene, std::shared_ptr<PythonScene>>(m, "Scene", py::dynamic_attr(),
                                                        "A scene file, read and checked.")
      .def_property_readonly(
          "title", [](const PythonScene& s) { return s.scene.title; }, "str: of the file")
      .def_property_readonly(
          "source", [](const PythonScene& s) { return s.scene.source; },
          "str: the file's JSON on one line")
      .def_property_readonly(
          "file", [](const PythonScene& s) { return s.file.string(); }, "str: where it was read")
      .def_property_readonly(
          "mesh_directories",
          [](const PythonScene& s) {
            std::vector<std::string> names;
            for (const fs::path& directory : s.mesh_directories)
              names.push_back(directory.string());
            return names;
          },
          "list[str]: where meshes were looked for besides")
      .def_property_readonly(
          "options", [](const PythonScene& s) { return s.scene.options; },
          "WorldOptions: a copy, to change and hand to make_world()")
      .def_property_readonly(
          "bodies", [](const PythonScene& s) { return s.scene.bodies; },
          "list[BodyDefinition]: BodyId.slot is the place in this list")
      .def_property_readonly(
          "shape_names", [](const PythonScene& s) { return s.scene.shape_names; },
          "list[str]: per body, for people")
      .def_property_readonly(
          "target_distances", [](const PythonScene& s) { return s.scene.target_distances; },
          "list[SceneTarget]: of single pairs")
      .def_property_readonly(
          "disabled_pairs", [](const PythonScene& s) { return s.scene.disabled_pairs; },
          "list[Tuple[BodyId, BodyId]]: that are not examined")
      .def_property_readonly(
          "joints", [](const PythonScene& s) { return s.scene.joints; },
          "list[JointDefinition]: all")
      .def_property_readonly(
          "springs", [](const PythonScene& s) { return s.scene.springs; },
          "list[SpringDefinition]: all")
      .def_property_readonly(
          "end_time", [](const PythonScene& s) { return s.scene.end_time; }, "float: > 0")
      .def_property_readonly(
          "step", [](const PythonScene& s) { return s.scene.step; }, "float: of an advance, > 0")
      .def("__repr__",
           [](const PythonScene& s) {
             return "Scene(" + std::string(py::repr(py::cast(s.scene.title))) + ", " +
                    std::to_string(s.scene.bodies.size()) + " bodies)";
           })
      .def("__reduce__", [](const py::object& self) {
        return py::module_::import("dyop._scenes").attr("reduce_scene")(self);
      });
}

void bind_scene_functions(py::module_& m) {
  m.def(
      "load_scene",
      [](const py::object& file, const py::iterable& mesh_directories) {
        auto scene = std::make_shared<PythonScene>();
        scene->file = path_of(file);
        for (const py::handle item : mesh_directories) {
          scene->mesh_directories.push_back(path_of(item));
        }
        const py::gil_scoped_release unlocked;
        scene->scene = load_scene(scene->file, scene->mesh_directories);
        return scene;
      },
      py::arg("file"), py::arg("mesh_directories") = py::tuple(),
      "The scene of a file (docs/formats.md). Meshes are looked for beside it, then in\n"
      "mesh_directories.");
  m.def(
      "make_world",
      [](const PythonScene& scene, const WorldOptions* options) {
        const auto build = [&](const WorldOptions& used) {
          Scene changed = scene.scene;
          changed.options = used;
          return make_world(changed);
        };
        return PythonWorld::make_with(options != nullptr ? *options : scene.scene.options, build);
      },
      py::arg("scene"), py::arg("options") = py::none(),
      "The World of a scene at time 0, under other options if they are given.");
  m.def(
      "describe_run",
      [](const PythonScene& scene, const std::vector<ImpactEvent>& impacts, const RunTotals& totals,
         double wall_seconds) {
        std::ostringstream text;
        write_summary(text, scene.scene, impacts, totals, wall_seconds);
        return text.str();
      },
      py::arg("scene"), py::arg("impacts"), py::arg("totals"), py::arg("wall_seconds") = 0.0,
      "What happened in a run, for a person to read.");
}

void bind_generator(py::module_& m) {
  Record<SceneKind>(m, "SceneKind", "One kind of scene that generate_scene() makes.")
      .field<&SceneKind::name>("name", "str: for generate_scene()")
      .field<&SceneKind::count>("count", "str: what n counts")
      .field<&SceneKind::least>("least", "int: smallest n")
      .field<&SceneKind::most>("most", "int: largest n")
      .finish();
  Record<GeneratedScene>(m, "GeneratedScene", "The text of a scene file and of its meshes.")
      .field<&GeneratedScene::text>("text", "str: of the scene file")
      .field<&GeneratedScene::meshes>("meshes", "list[Tuple[str, str]]: file name, OBJ text")
      .finish();
  m.def("scene_kinds", &scene_kinds, "All kinds that generate_scene() makes.");
  m.def("generate_scene", &generate_scene, py::arg("kind"), py::arg("n"),
        "Makes a scene of a known kind; the same arguments give the same text.");
  m.def(
      "write_generated_scene",
      [](const GeneratedScene& scene, const py::object& file) {
        write_generated_scene(scene, path_of(file));
      },
      py::arg("scene"), py::arg("file"), "Writes the scene to file and its meshes beside it.");
}

void bind_totals(py::module_& m) {
  using Totals = RunTotals;
  Record<Totals> totals(m, "RunTotals", "Sums over the advances of a run, and how it ended.");
  totals.field<&Totals::status>("status", "AdvanceStatus: of the last advance")
      .field<&Totals::t>("t", "float: where the run ended")
      .field<&Totals::advances>("advances", "int: calls of World.advance()")
      .field<&Totals::steps>("steps", "int: committed")
      .field<&Totals::impacts>("impacts", "int: number of them")
      .field<&Totals::too_near>("too_near", "list[Tuple[BodyId, BodyId]]: as AdvanceReport")
      .field<&Totals::offending_pair>("offending_pair", "Tuple[BodyId, BodyId]: as AdvanceReport")
      .field<&Totals::integrator>("integrator", "IntegratorStatistics: sums")
      .field<&Totals::toi>("toi", "ToiStatistics: sums")
      .field<&Totals::work>("work", "StepStatistics: sums")
      .field<&Totals::error>("error", "Optional[str]: what ended the run, if an exception did")
      .finish();
  totals.type.def("add", &Totals::add, py::arg("report"), "One more advance.")
      .def("end", &Totals::end, "How the run ended, in one word.");
}

}  // namespace

void bind_scenes(py::module_& m) {
  bind_scene(m);
  bind_totals(m);
  bind_scene_functions(m);
  bind_generator(m);
}

}  // namespace dyop::python
