// SPDX-License-Identifier: BSD-3-Clause
#include <filesystem>
#include <memory>

#include "dyop/io/query_record.h"
#include "dyop/io/run_recording.h"
#include "python/bindings.h"
#include "python/query/query_options.h"

namespace dyop::python {
namespace {

// States of a step as an array: (times, bodies, 13) numbers: quaternion w x y z, position, v, w.
py::array_t<double> state_rows(const RecordedStep& step) {
  const std::size_t bodies = step.states.empty() ? 0 : step.states.front().size();
  py::array_t<double> rows({py::ssize_t(step.states.size()), py::ssize_t(bodies), py::ssize_t{13}});
  double* out = rows.mutable_data();
  for (const auto& states : step.states) {
    for (const MotionState& state : states) {
      const Quaternion q = state.X_WB.quaternion();
      for (const double number : {q.w(), q.x(), q.y(), q.z()}) *out++ = number;
      out = std::copy_n(state.X_WB.translation().data(), 3, out);
      out = std::copy_n(state.twist.v_WB.data(), 3, out);
      out = std::copy_n(state.twist.w_WB.data(), 3, out);
    }
  }
  return rows;
}

void bind_recording(py::module_& m) {
  using Body = RunRecording::Body;
  Record<Body>(m, "RunRecordingBody", "A body of a text recording.")
      .field<&Body::name>("name", "str: as in the scene")
      .field<&Body::kind>("kind", "BodyKind: what moved it")
      .finish();
  Record<RecordedStep> step(m, "RecordedStep", "One committed step of all bodies.");
  step.field<&RecordedStep::times>("times", "list[float]: increasing, at least two")
      .field<&RecordedStep::states>("states", "list[list[MotionState]]: per time, per body")
      .finish();
  step.type.def("array", &state_rows,
                "(times, bodies, 13) float64: quaternion (w, x, y, z), position, v, w.");
  Record<RunRecording>(m, "RunRecording", "What a recording holds.")
      .field<&RunRecording::scene>("scene", "str: JSON of the scene file, on one line")
      .field<&RunRecording::bodies>("bodies", "list[RunRecordingBody]: by slot")
      .field<&RunRecording::steps>("steps", "list[RecordedStep]: in order of time")
      .field<&RunRecording::impacts>("impacts", "list[ImpactEvent]: in order of time")
      .field<&RunRecording::is_complete>("is_complete", "bool: the run was not killed")
      .field<&RunRecording::totals>("totals", "RunTotals: if complete")
      .finish();
  m.def(
      "read_recording",
      [](const py::object& file) {
        const auto path = path_of(file);
        const py::gil_scoped_release unlocked;
        return read_recording(path);
      },
      py::arg("file"), "What a recording holds.");
  m.def("recorded_pose", &recorded_pose, py::arg("step"), py::arg("body"), py::arg("t"),
        "The pose of a body at a time within a recorded step.");
}

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
      "Writes a query and its answer, for a comparison bit by bit later (docs/replay-format.md).");
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
  bind_recording(m);
  bind_writers(m);
  bind_query_record(m);
}

}  // namespace dyop::python
