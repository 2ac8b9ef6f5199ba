// SPDX-License-Identifier: BSD-3-Clause
#include <filesystem>
#include <memory>

#include "dyop/io/query_record.h"
#include "python/bindings.h"
#include "python/query/query_options.h"

namespace dyop::python {
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

}  // namespace dyop::python
