// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <stop_token>

#include "dyop/core/error.h"
#include "python/bindings.h"
#include "python/glue/calls.h"
#include "python/glue/record.h"

namespace dyop::python {
namespace {

RigidPose pose_from_parts(const py::object& quaternion, const py::object& position,
                          const py::object& rotation) {
  DYOP_REQUIRE(quaternion.is_none() || rotation.is_none(),
               "a pose has a quaternion or a rotation, not both");
  if (!rotation.is_none()) return pose_of(py::make_tuple(rotation, position));
  if (quaternion.is_none()) return RigidPose(vector_of(position, "position"));
  return pose_of(py::make_tuple(quaternion, position));
}

// As scipy, ROS and many others order a quaternion.
RigidPose pose_from_xyzw(const py::object& quaternion, const Vector3& position) {
  const auto rows = rows_of(py::make_tuple(quaternion), 4, "quaternion", CopyRule::IfNeeded);
  DYOP_REQUIRE(rows.shape(0) == 1, "quaternion must be four numbers (x, y, z, w)");
  const double* q = rows.data();
  return {Quaternion(q[3], q[0], q[1], q[2]), position};
}

py::array_t<double> quaternion_of(const RigidPose& X) {
  const Quaternion q = X.quaternion();
  const double numbers[] = {q.w(), q.x(), q.y(), q.z()};
  return py::array_t<double>(4, numbers);
}

// p_BP of one point (3,), or of many (N, 3).
py::array transform(const RigidPose& X, py::handle points) {
  const auto dimensions = py::module_::import("numpy").attr("ndim")(points).cast<int>();
  if (dimensions == 1) return array_of(Vector3(X * vector_of(points, "point")));
  const auto rows = rows_of(points, 3, "points", CopyRule::IfNeeded);
  py::array_t<double> result({rows.shape(0), py::ssize_t{3}});
  double* out = result.mutable_data();
  for (const Vector3& p : points_in(rows)) {
    out = std::copy_n(Vector3(X * p).data(), 3, out);
  }
  return result;
}

void bind_pose(py::module_& m) {
  py::class_<RigidPose>(m, "RigidPose",
                        "The pose X_AB of a frame B in a frame A: p_AP = X_AB * p_BP. Immutable.")
      .def(py::init<>(), "Identity.")
      .def(py::init([](const PoseArgument& matrix) { return matrix.X; }), py::arg("matrix"),
           "From a (4, 4) array, a pair (quaternion (w, x, y, z), position), a (3, 3) array, a "
           "scipy\n"
           "Rotation, or a RigidPose; the rotation must be orthonormal.")
      .def(py::init(&pose_from_parts), py::kw_only(), py::arg("quaternion") = py::none(),
           py::arg("position") = py::make_tuple(0.0, 0.0, 0.0), py::arg("rotation") = py::none(),
           "From a unit quaternion (w, x, y, z), or a rotation: (3, 3) or a scipy Rotation; none "
           "for\n"
           "no turn; and a position (3,), length.")
      .def_static("from_xyzw", &pose_from_xyzw, py::arg("quaternion"),
                  py::arg("position") = py::make_tuple(0.0, 0.0, 0.0),
                  "From a unit quaternion (x, y, z, w), as scipy and ROS have it, and a position.")
      .def_property_readonly(
          "rotation", [](const RigidPose& X) { return array_of(X.rotation()); },
          "numpy.ndarray: (3, 3) rotation matrix R_AB")
      .def_property_readonly(
          "translation", [](const RigidPose& X) { return array_of(X.translation()); },
          "numpy.ndarray: (3,) p_AB, length")
      .def_property_readonly("quaternion", &quaternion_of,
                             "numpy.ndarray: (4,) unit quaternion (w, x, y, z)")
      .def_property_readonly(
          "matrix", [](const RigidPose& X) { return array_of(X); },
          "numpy.ndarray: (4, 4) homogeneous matrix")
      .def("inverse", &RigidPose::inverse, "X_BA.")
      .def(
          "__mul__", [](const RigidPose& X, const RigidPose& Y) { return X * Y; },
          "X_AB * X_BC = X_AC.")
      .def("__mul__", &transform, py::arg("points"), "X_AB * p_BP = p_AP, as transform().")
      .def("transform", &transform, py::arg("points"), "Points (3,) or (N, 3) of B in A.")
      .def("__array__", [](const RigidPose& X, const py::args&) { return array_of(X); })
      .def(
          "__eq__",
          [](const RigidPose& X, const RigidPose& Y) {
            return X.rotation() == Y.rotation() && X.translation() == Y.translation();
          },
          py::is_operator())
      .def("__repr__",
           [](const RigidPose& X) {
             return "RigidPose(quaternion=" +
                    std::string(py::str(quaternion_of(X).attr("tolist")())) + ", position=" +
                    std::string(py::str(array_of(X.translation()).attr("tolist")())) + ")";
           })
      .def(py::pickle(
          [](const RigidPose& X) {
            return py::make_tuple(array_of(X.rotation()), array_of(X.translation()));
          },
          [](const py::tuple& state) {  // the same bits, not rounded again
            return RigidPose::from_trusted(matrix_of(state[0], "rotation"),
                                           vector_of(state[1], "translation"));
          }))
      .attr("__hash__") = py::none();
}

void bind_rotations(py::module_& m) {
  m.def(
      "rotation_from_vector", [](const Vector3& w) { return rotation_from_vector(w); },
      py::arg("w"), "The rotation (3, 3) by |w| radians about w (3,), right-handed.");
  m.def(
      "rotation_vector", [](const Matrix3& R) { return Vector3(rotation_vector(R)); }, py::arg("R"),
      "The rotation vector (3,) of R (3, 3), of length 0 to pi.");
}

void bind_interval(py::module_& m) {
  py::class_<TimeInterval>(m, "TimeInterval",
                           "A span of time [begin, end], in any unit that velocities use too.")
      .def(py::init([](Scalar begin, Scalar end) {
             DYOP_REQUIRE(!std::isnan(begin) && !std::isnan(end), "an interval [", begin, ", ", end,
                          "] needs two times");
             return TimeInterval{begin, end};
           }),
           py::arg("begin") = 0.0, py::arg("end") = 1.0,
           "Times; their order is not checked before they are used.")
      .def_readonly("begin", &TimeInterval::begin, "float: time")
      .def_readonly("end", &TimeInterval::end, "float: time")
      .def("length", &TimeInterval::length, "end - begin.")
      .def("contains", &TimeInterval::contains, py::arg("t"), "begin <= t <= end.")
      .def("__iter__",
           [](const TimeInterval& i) { return py::iter(py::make_tuple(i.begin, i.end)); })
      .def(
          "__eq__", [](const TimeInterval& a, const TimeInterval& b) { return a == b; },
          py::is_operator())
      .def("__hash__",
           [](const TimeInterval& i) { return py::hash(py::make_tuple(i.begin, i.end)); })
      .def("__repr__",
           [](const TimeInterval& i) {
             return "TimeInterval" + std::string(py::repr(py::make_tuple(i.begin, i.end)));
           })
      .def(py::pickle([](const TimeInterval& i) { return py::make_tuple(i.begin, i.end); },
                      [](const py::tuple& state) {
                        return TimeInterval{state[0].cast<Scalar>(), state[1].cast<Scalar>()};
                      }));
}

}  // namespace

void bind_core(py::module_& m) {
  bind_errors(m);
  bind_pose(m);
  bind_rotations(m);
  bind_interval(m);
  py::class_<std::stop_source>(m, "StopSource",
                               "Asks queries that were given it to stop, from any thread.")
      .def(py::init<>())
      .def("request_stop", &std::stop_source::request_stop, "True if it was the first request.")
      .def("stop_requested", &std::stop_source::stop_requested, "Whether a stop was requested.");
  m.def(
      "as_rows",
      [](py::handle array, py::ssize_t width, const py::object& copy) {
        return rows_of(array, width, "array", copy_rule_of(copy));
      },
      py::arg("array"), py::arg("width") = 3, py::arg("copy") = py::none(),
      "The (N, width) float64 array in C order that a call given this one reads: in the same\n"
      "memory, unless it must be copied. copy=False: InvalidArgument in that case.");
}

}  // namespace dyop::python
