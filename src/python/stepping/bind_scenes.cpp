// SPDX-License-Identifier: BSD-3-Clause
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>

#include "dyop/io/file_error.h"
#include "dyop/io/query_record.h"
#include "dyop/io/recording.h"
#include "dyop/io/recording_lines.h"
#include "dyop/io/run_summary.h"
#include "dyop/io/scene_file.h"
#include "python/bindings.h"
#include "python/glue/record.h"
#include "python/query/queries.h"
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
          "tuple[str, ...]: where meshes were looked for besides")
      .def_property_readonly(
          "options", [](const PythonScene& s) { return s.scene.options; },
          "WorldOptions: make_world() takes a changed copy.copy() of it")
      .def_property_readonly(
          "bodies", [](const PythonScene& s) { return s.scene.bodies; },
          "tuple[BodyDefinition, ...]: BodyId.slot is the place in this list")
      .def_property_readonly(
          "shape_names", [](const PythonScene& s) { return s.scene.shape_names; },
          "tuple[str, ...]: per body, for people")
      .def_property_readonly(
          "target_distances", [](const PythonScene& s) { return s.scene.target_distances; },
          "tuple[SceneTarget, ...]: of single pairs")
      .def_property_readonly(
          "disabled_pairs", [](const PythonScene& s) { return s.scene.disabled_pairs; },
          "tuple[Tuple[BodyId, BodyId], ...]: that are not examined")
      .def_property_readonly(
          "joints", [](const PythonScene& s) { return s.scene.joints; },
          "tuple[JointDefinition, ...]: all")
      .def_property_readonly(
          "springs", [](const PythonScene& s) { return s.scene.springs; },
          "tuple[SpringDefinition, ...]: all")
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
      .field<&GeneratedScene::meshes>("meshes", "tuple[Tuple[str, str], ...]: file name, OBJ text")
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
      .field<&Totals::too_near>("too_near", "tuple[Tuple[BodyId, BodyId], ...]: as AdvanceReport")
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

namespace {

using SharedRecord = std::shared_ptr<QueryRecord>;

// What a record owns, which it keeps alive.
template <typename T>
std::shared_ptr<T> owned(const SharedRecord& record, const T* part) {
  return {record, const_cast<T*>(part)};
}

ToiQuery query_of(const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
                  const IntervalArgument& interval, const PythonToiOptions* options) {
  return {&a, &X_WA, &b, &X_WB, interval.interval, options_or_default(options)};
}

void bind_writers(py::module_& m) {
  m.def(
      "write_query_record",
      [](const py::object& file, const Shape& a, const Motion& X_WA, const Shape& b,
         const Motion& X_WB, const IntervalArgument& interval, const PythonToiOptions* options,
         const ToiResult& result) {
        write_query_record(path_of(file), query_of(a, X_WA, b, X_WB, interval, options), result);
      },
      py::arg("file"), py::arg("a"), py::arg("X_WA"), py::arg("b"), py::arg("X_WB"),
      py::arg("interval"), py::arg("options"), py::arg("result"),
      "Writes a query and its answer, for a comparison bit by bit later (docs/formats.md).");
  m.def(
      "write_failure_record",
      [](const py::object& file, const Shape& a, const Motion& X_WA, const Shape& b,
         const Motion& X_WB, const IntervalArgument& interval, const PythonToiOptions* options,
         const std::string& failure) {
        write_failure_record(path_of(file), query_of(a, X_WA, b, X_WB, interval, options), failure);
      },
      py::arg("file"), py::arg("a"), py::arg("X_WA"), py::arg("b"), py::arg("X_WB"),
      py::arg("interval"), py::arg("options"), py::arg("failure"),
      "The same for a query that ended in an exception with this message.");
}

void bind_query_record(py::module_& m) {
  Record<FieldDifference>(m, "FieldDifference", "One field in which two answers differ.")
      .field<&FieldDifference::field>("field", "str: its name")
      .field<&FieldDifference::recorded>("recorded", "str: JSON; empty if absent")
      .field<&FieldDifference::now>("now", "str: JSON; empty if absent")
      .finish();
  py::class_<QueryRecord, SharedRecord>(m, "QueryRecord", "A query read from a record.")
      .def(py::init(
               [](const py::object& file) { return std::make_shared<QueryRecord>(path_of(file)); }),
           py::arg("file"), "A file of write_query_record() or of `dyop toi --record`.")
      .def_property_readonly(
          "version", [](const QueryRecord& r) { return r.version(); }, "str: of dyop that wrote it")
      .def_property_readonly(
          "failure", [](const QueryRecord& r) { return r.failure(); },
          "str: the error the query ended in; empty if it was answered")
      .def(
          "query",
          [](const SharedRecord& record) {
            const ToiQuery query = record->query();
            py::dict arguments;
            arguments["a"] = owned(record, query.a);
            arguments["X_WA"] = owned(record, query.X_WA);
            arguments["b"] = owned(record, query.b);
            arguments["X_WB"] = owned(record, query.X_WB);
            arguments["interval"] = query.interval;
            arguments["options"] = PythonToiOptions{query.options, std::nullopt};
            return arguments;
          },
          "The arguments of time_of_impact(), by name.")
      .def("differences", &QueryRecord::differences, py::arg("now"),
           "All fields of an answer that differ in any bit from the recorded ones.");
}

}  // namespace

void bind_records(py::module_& m) {
  bind_writers(m);
  bind_query_record(m);
}

#ifdef DYOP_HAS_RECORDING

namespace {

template <typename T>
std::vector<T> listed(std::span<const T> items) {
  return {items.begin(), items.end()};
}

void bind_recorded_parts(py::module_& m) {
  Record<RunHeader>(m, "RunHeader", "What a run is, besides its bodies.")
      .option<&RunHeader::title>("title", "str: for people")
      .option<&RunHeader::scene>("scene", "str: JSON of the scene file; empty if there is none")
      .option<&RunHeader::target_distance>("target_distance", "Optional[float]: of the pairs")
      .option<&RunHeader::rest_offset>("rest_offset", "Optional[float]: of the pairs")
      .option<&RunHeader::begin_time>("begin_time", "float: of the run")
      .option<&RunHeader::end_time>("end_time", "float: planned; 0: not known")
      .option<&RunHeader::step>("step", "float: of one advance; 0: not known")
      .finish();
  Record<RecordedBody>(m, "RecordedBody", "A body of a recording.")
      .field<&RecordedBody::name>("name", "str: as in the World")
      .field<&RecordedBody::kind>("kind", "BodyKind: what moved it")
      .field<&RecordedBody::shape>("shape", "int: place in the list of shapes")
      .field<&RecordedBody::is_sensor>("is_sensor", "bool: gives no force")
      .field<&RecordedBody::mass>("mass", "float: dynamic")
      .field<&RecordedBody::p_BoBcm>("p_BoBcm", "numpy.ndarray: (3,) centre of mass")
      .finish();
  py::enum_<SegmentKind>(m, "SegmentKind", "What a stretch of a body's path is.")
      .value("Absent", SegmentKind::Absent)
      .value("Rest", SegmentKind::Rest)
      .value("Twist", SegmentKind::Twist)
      .value("Hermite", SegmentKind::Hermite)
      .value("Given", SegmentKind::Given)
      .value("Approximate", SegmentKind::Approximate, "The only kind that is not exact.");
  Record<MotionSegment>(m, "MotionSegment", "A stretch of one body's path.")
      .field<&MotionSegment::kind>("kind", "SegmentKind: what it is")
      .field<&MotionSegment::interval>("interval", "TimeInterval: where it holds")
      .field<&MotionSegment::numbers>("numbers", "tuple[float, ...]: see docs/formats.md")
      .field<&MotionSegment::given>("given", "str: JSON of a given motion")
      .field<&MotionSegment::motion>("motion", "Optional[Motion]: the same bits as in the run")
      .finish();
  Record<RecordedFrame>(m, "RecordedFrame", "One advance, with what the World knew at its end.")
      .field<&RecordedFrame::interval>("interval", "TimeInterval: of the advance")
      .field<&RecordedFrame::status>("status", "AdvanceStatus: how it ended")
      .field<&RecordedFrame::offending_pair>("offending_pair", "Tuple[BodyId, BodyId]: if any")
      .field<&RecordedFrame::kinetic_energy>("kinetic_energy", "float: of all dynamic bodies")
      .field<&RecordedFrame::momentum>("momentum", "numpy.ndarray: (3,)")
      .field<&RecordedFrame::angular_momentum>("angular_momentum", "numpy.ndarray: (3,)")
      .field<&RecordedFrame::work>("work", "StepStatistics: sums")
      .field<&RecordedFrame::integrator>("integrator", "IntegratorStatistics: sums")
      .field<&RecordedFrame::toi>("toi", "ToiStatistics: sums")
      .finish();
}

void bind_recorded_events(py::module_& m) {
  py::enum_<RunEventKind>(m, "RunEventKind", "What happened in a run, besides impacts.")
      .value("FellAsleep", RunEventKind::FellAsleep)
      .value("Woke", RunEventKind::Woke)
      .value("TooNear", RunEventKind::TooNear)
      .value("Crossed", RunEventKind::Crossed)
      .value("SensorBegins", RunEventKind::SensorBegins)
      .value("SensorEnds", RunEventKind::SensorEnds)
      .value("Stalled", RunEventKind::Stalled)
      .value("Undecided", RunEventKind::Undecided)
      .value("Parted", RunEventKind::Parted)
      .value("Placed", RunEventKind::Placed);
  Record<RunEvent>(m, "RunEvent", "Something that happened, besides impacts.")
      .field<&RunEvent::kind>("kind", "RunEventKind: what")
      .field<&RunEvent::t>("t", "float: when")
      .field<&RunEvent::a>("a", "BodyId: the body, or the sensor")
      .field<&RunEvent::b>("b", "BodyId: the other one, if there is one")
      .finish();
  Record<RunEnd>(m, "RunEnd", "How a run ended.")
      .field<&RunEnd::status>("status", "AdvanceStatus: of the last advance")
      .field<&RunEnd::error>("error", "str: the message that ended it, if one did")
      .finish();
}

void bind_reader(py::module_& m) {
  py::class_<RecordingReader>(m, "RecordingReader",
                              "A recorded run (docs/formats.md), also while it is written.")
      .def(py::init([](const py::object& file) {
             return std::make_unique<RecordingReader>(path_of(file));
           }),
           py::arg("file"), "Opens the file.")
      .def_property_readonly(
          "file", [](const RecordingReader& r) { return readable(r.file().string()); },
          "str: as it was given")
      .def("__repr__",
           [](const RecordingReader& r) {
             return "RecordingReader(" + std::string(py::repr(readable(r.file().string()))) + ", " +
                    std::to_string(r.bodies().size()) +
                    " bodies, t=" + std::string(py::repr(py::cast(r.interval().begin))) + " to " +
                    std::string(py::repr(py::cast(r.interval().end))) + ")";
           })
      .def("refresh", &RecordingReader::refresh, "Reads what was written since; True if anything.")
      .def_property_readonly(
          "header", [](const RecordingReader& r) { return r.header(); }, "RunHeader: of the run")
      .def_property_readonly(
          "shapes",
          [](const RecordingReader& r) {
            std::vector<std::shared_ptr<const Shape>> shapes;
            for (const RecordedShape& shape : r.shapes()) shapes.push_back(shape.shape);
            return shapes;
          },
          "tuple[Shape, ...]: with the same numbers as in the run")
      .def_property_readonly(
          "bodies", [](const RecordingReader& r) { return listed(r.bodies()); },
          "tuple[RecordedBody, ...]: by slot")
      .def("gravity", &RecordingReader::gravity,
           "numpy.ndarray: of the World at the start; zero if the recording does not say.")
      .def("interval", &RecordingReader::interval, "From the start to the last committed time.")
      .def(
          "end", [](const RecordingReader& r) { return r.end(); }, "How the run ended, if it has.")
      .def_property_readonly(
          "steps", [](const RecordingReader& r) { return listed(r.steps()); },
          "tuple[TimeInterval, ...]: committed, in order")
      .def_property_readonly(
          "frames", [](const RecordingReader& r) { return listed(r.frames()); },
          "tuple[RecordedFrame, ...]: one per advance")
      .def_property_readonly(
          "impacts", [](const RecordingReader& r) { return listed(r.impacts()); },
          "tuple[ImpactEvent, ...]: in order of time")
      .def_property_readonly(
          "events", [](const RecordingReader& r) { return listed(r.events()); },
          "tuple[RunEvent, ...]: in order of time")
      .def("pairs", &RecordingReader::pairs, py::arg("frame"),
           "Pair records at the end of a frame.")
      .def("segment_count", &RecordingReader::segment_count, py::arg("body"), "Of one body.")
      .def("segment", &RecordingReader::segment, py::arg("body"), py::arg("index"),
           "A stretch of a body's path.")
      .def("segment_at", &RecordingReader::segment_at, py::arg("body"), py::arg("t"),
           "The index of the segment that holds t.")
      .def("pose", &RecordingReader::pose, py::arg("body"), py::arg("t"),
           "X_WB on the committed motion: the bits that the run's own motion gives.")
      .def("state", &RecordingReader::state, py::arg("body"), py::arg("t"), "Pose and twist.");
}

void bind_writer(py::module_& m) {
  py::enum_<PairDetail>(m, "PairDetail", "What of the pairs of bodies is recorded.")
      .value("None_", PairDetail::None)
      .value("Gaps", PairDetail::Gaps, "Proof, bounds of the gap, normal, pivot.")
      .value("Contacts", PairDetail::Contacts, "And the contacts with their impulses.");
  py::class_<RecordingWriter>(m, "RecordingWriter", "Writes a run as docs/formats.md describes.")
      .def(py::init([](const py::object& file, const RunHeader* header, PairDetail pairs) {
             return std::make_unique<RecordingWriter>(
                 path_of(file), header != nullptr ? *header : RunHeader(), RecordingOptions{pairs});
           }),
           py::arg("file"), py::arg("header") = py::none(), py::arg("pairs") = PairDetail::Contacts,
           "Replaces the file.")
      .def(
          "write",
          [](RecordingWriter& writer, const AdvanceReport& report, PythonWorld& world) {
            writer.write(report, world.read());
          },
          py::arg("report"), py::arg("world"), "What one advance of the world reported.")
      .def("finish", &RecordingWriter::finish, "Writes how the run ended, and closes the file.")
      .def("fail", &RecordingWriter::fail, py::arg("error"), "The same after an exception.");
}

}  // namespace

void bind_recordings(py::module_& m) {
  bind_recorded_parts(m);
  bind_recorded_events(m);
  bind_reader(m);
  bind_writer(m);
  m.def(
      "run_header", [](const PythonScene& scene) { return run_header(scene.scene); },
      py::arg("scene"), "What a recording of this scene's run is headed with.");
}

#endif  // DYOP_HAS_RECORDING

}  // namespace dyop::python
