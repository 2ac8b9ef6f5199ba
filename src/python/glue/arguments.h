// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <filesystem>
#include <span>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/core/time_interval.h"
#include "dyop/core/types.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/motion.h"
#include "python/glue/derived.h"

namespace dyop::python {

namespace py = pybind11;

/// Reads a value from what Python offers for it. All throw InvalidArgument that names `what`.
Vector3 vector_of(py::handle source, const char* what);
Matrix3 matrix_of(py::handle source, const char* what);
/// A RigidPose, a (4, 4) array, a rotation, or a pair (rotation, position). A rotation is a
/// quaternion w x y z (in a pair only), a (3, 3) array or an object with `as_matrix`.
RigidPose pose_of(py::handle source);
/// A str or os.PathLike.
std::filesystem::path path_of(py::handle file);
/// A TimeInterval or a pair (begin, end).
TimeInterval interval_of(py::handle source);
/// A Twist or a pair (v, w).
Twist twist_of(py::handle source);
/// A MotionState or a pair (pose, twist).
MotionState state_of(py::handle source);

py::array_t<double> array_of(const Vector3& v);
py::array_t<double> array_of(const Matrix3& m);
/// (4, 4) homogeneous matrix.
py::array_t<double> array_of(const RigidPose& X);

/// A read-only (N, 3) array over memory of `owner`, which it keeps alive.
template <typename Number>
py::array view_of(const Number* data, std::size_t count, py::handle owner) {
  const py::ssize_t width = sizeof(Number);
  py::array view(py::dtype::of<Number>(), {py::ssize_t(count), py::ssize_t{3}}, {3 * width, width},
                 data, owner);
  view.attr("flags").attr("writeable") = false;
  return view;
}

/// Whether numbers may be copied into another layout or type: what `copy=` says in Python.
enum class CopyRule { IfNeeded, Never };
CopyRule copy_rule_of(const py::object& copy);

/// Numbers side by side, where a pointer may read them.
using Doubles =
    py::array_t<double, int(py::array::c_style) | int(py::detail::npy_api::NPY_ARRAY_ALIGNED_)>;

/// The array itself if it is C-contiguous (N, width) float64, else a copy that is.
/// @throws InvalidArgument for another shape or numbers that float64 cannot hold, or under
///         CopyRule::Never for a copy; names `what`.
Doubles rows_of(py::handle source, py::ssize_t width, const char* what, CopyRule rule);
/// Points of such an array, in its memory.
std::span<const Vector3> points_in(const Doubles& rows);
/// The same into a vector of its own.
std::vector<Vector3> points_of(py::handle source, const char* what, CopyRule rule);
/// (N, 3) integers.
std::vector<TriangleIndices> triangles_of(py::handle source, CopyRule rule);

/// Rows of a caller's array that a mesh can read where they are: float64 or float32, int32 or
/// uint32, rows at any forward stride. Null data: they must be copied first.
template <typename Number>
StridedRows<Number> rows_in_place(const py::array& array) {
  const bool fits = array.ndim() == 2 && array.shape(1) == 3 &&
                    py::isinstance<py::array_t<Number>>(array) &&
                    array.strides(1) == py::ssize_t(sizeof(Number)) &&
                    array.strides(0) >= py::ssize_t(3 * sizeof(Number));
  if (!fits) return {};
  return {static_cast<const Number*>(array.data()), std::size_t(array.shape(0)),
          std::size_t(array.strides(0))};
}

/// Poses of a batch: one for all, or one per query.
struct PoseList {
  std::vector<RigidPose> poses;
  bool is_single = false;
  const RigidPose& at(std::size_t i) const { return poses[is_single ? 0 : i]; }
};
/// A pose as in pose_of(), a list of them, (N, 4, 4) or a pair ((N, 4), (N, 3)).
PoseList poses_of(py::handle source, const char* what);

/// What Python offers for a pose, interval, twist or state, as an argument of a bound function.
struct PoseArgument {
  RigidPose X;
};
struct IntervalArgument {
  TimeInterval interval;
};
struct TwistArgument {
  Twist twist;
};
struct StateArgument {
  MotionState state;
};

}  // namespace dyop::python

namespace pybind11::detail {

template <>
struct type_caster<dyop::Vector3> {
  PYBIND11_TYPE_CASTER(dyop::Vector3, const_name("numpy.ndarray[(3,), float64]"));
  bool load(handle source, bool convert) {
    if (!convert) return false;
    value = dyop::python::vector_of(source, "vector");
    return true;
  }
  static handle cast(const dyop::Vector3& v, return_value_policy, handle) {
    return dyop::python::array_of(v).release();
  }
};

template <>
struct type_caster<dyop::Matrix3> {
  PYBIND11_TYPE_CASTER(dyop::Matrix3, const_name("numpy.ndarray[(3, 3), float64]"));
  bool load(handle source, bool convert) {
    if (!convert) return false;
    value = dyop::python::matrix_of(source, "matrix");
    return true;
  }
  static handle cast(const dyop::Matrix3& m, return_value_policy, handle) {
    return dyop::python::array_of(m).release();
  }
};

// Only read, in the pass in which conversions are allowed.
#define DYOP_PYTHON_ARGUMENT(Type, member, read, name)          \
  template <>                                                   \
  struct type_caster<dyop::python::Type> {                      \
    PYBIND11_TYPE_CASTER(dyop::python::Type, const_name(name)); \
    bool load(handle source, bool) {                            \
      value.member = dyop::python::read(source);                \
      return true;                                              \
    }                                                           \
  }
DYOP_PYTHON_ARGUMENT(PoseArgument, X, pose_of, "PoseLike");
DYOP_PYTHON_ARGUMENT(IntervalArgument, interval, interval_of, "IntervalLike");
DYOP_PYTHON_ARGUMENT(TwistArgument, twist, twist_of, "TwistLike");
DYOP_PYTHON_ARGUMENT(StateArgument, state, state_of, "StateLike");
#undef DYOP_PYTHON_ARGUMENT

}  // namespace pybind11::detail
