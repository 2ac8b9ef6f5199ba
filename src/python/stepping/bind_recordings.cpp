// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/recording_reader.h"
#include "dyop/io/recording_writer.h"
#include "dyop/io/scene_recording.h"
#include "python/bindings.h"
#include "python/glue/record.h"
#include "python/stepping/python_scene.h"
#include "python/stepping/python_world.h"

namespace dyop::python {
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
      .field<&MotionSegment::numbers>("numbers", "list[float]: see docs/formats.md")
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
      .value("Undecided", RunEventKind::Undecided);
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
          "list[Shape]: with the same numbers as in the run")
      .def_property_readonly(
          "bodies", [](const RecordingReader& r) { return listed(r.bodies()); },
          "list[RecordedBody]: by slot")
      .def("interval", &RecordingReader::interval, "From the start to the last committed time.")
      .def(
          "end", [](const RecordingReader& r) { return r.end(); }, "How the run ended, if it has.")
      .def_property_readonly(
          "steps", [](const RecordingReader& r) { return listed(r.steps()); },
          "list[TimeInterval]: committed, in order")
      .def_property_readonly(
          "frames", [](const RecordingReader& r) { return listed(r.frames()); },
          "list[RecordedFrame]: one per advance")
      .def_property_readonly(
          "impacts", [](const RecordingReader& r) { return listed(r.impacts()); },
          "list[ImpactEvent]: in order of time")
      .def_property_readonly(
          "events", [](const RecordingReader& r) { return listed(r.events()); },
          "list[RunEvent]: in order of time")
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

}  // namespace dyop::python
