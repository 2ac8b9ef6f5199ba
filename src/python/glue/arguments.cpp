// SPDX-License-Identifier: BSD-3-Clause
#include "python/glue/arguments.h"

#include <limits>
#include <optional>
#include <string>

#include "dyop/core/error.h"

namespace dyop::python {
namespace {

// "an array of float64 and shape (3, 4)", or the type's name.
std::string describe_source(py::handle source) {
  if (!py::isinstance<py::array>(source)) {
    return "a value of type " + std::string(py::str(py::type::handle_of(source).attr("__name__")));
  }
  return "an array of " + std::string(py::str(source.attr("dtype"))) + " and shape " +
         std::string(py::str(source.attr("shape")));
}

[[noreturn]] void refuse(const std::string& what, const std::string& wanted, py::handle found) {
  throw InvalidArgument(what + " must be " + wanted + ", not " + describe_source(found));
}

// The array of numbers that the source can be made into without loss; null if it is none. Other
// errors, such as Ctrl-C, are not swallowed.
template <typename Array>
Array converted(py::handle source) {
  try {
    return Array(py::reinterpret_borrow<py::object>(source));
  } catch (const py::error_already_set& error) {
    if (!error.matches(PyExc_TypeError) && !error.matches(PyExc_ValueError) &&
        !error.matches(PyExc_OverflowError)) {
      throw;
    }
    return py::reinterpret_steal<Array>(py::handle());
  }
}

// As numpy reads numbers, but for text, of which it would read the digits.
Doubles doubles_of(py::handle source) {
  if (!py::isinstance<py::array>(source)) {
    const auto own = converted<py::array>(source);
    const char kind = own ? own.dtype().kind() : '?';
    if (kind == 'U' || kind == 'S') return py::reinterpret_steal<Doubles>(py::handle());
    if (own && py::isinstance<Doubles>(own)) return own;
  }
  return converted<Doubles>(source);
}

bool has_shape(const py::array& array, std::initializer_list<py::ssize_t> shape) {
  return array &&
         std::equal(shape.begin(), shape.end(), array.shape(), array.shape() + array.ndim());
}

bool is_pair(py::handle source) {
  return (PyTuple_Check(source.ptr()) || PyList_Check(source.ptr())) && py::len(source) == 2;
}

// Three floats of a tuple or list without an array in between; false if it is none.
bool read_sequence(py::handle source, Vector3& v) {
  if (!PyTuple_CheckExact(source.ptr()) && !PyList_CheckExact(source.ptr())) return false;
  const auto items = py::reinterpret_borrow<py::sequence>(source);
  if (items.size() != 3) return false;
  for (std::size_t k = 0; k < 3; ++k) {
    const py::object item = items[k];
    if (!PyFloat_CheckExact(item.ptr()) && !PyLong_CheckExact(item.ptr())) return false;
    v[Eigen::Index(k)] = PyFloat_AsDouble(item.ptr());
    if (PyErr_Occurred() != nullptr) throw py::error_already_set();
  }
  return true;
}

Matrix3 rotation_block(const double* row_major) {
  Matrix3 R;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) R(i, j) = row_major[4 * i + j];
  }
  return R;
}

RigidPose pose_of_matrix(const double* m) {
  DYOP_REQUIRE(m[12] == 0 && m[13] == 0 && m[14] == 0 && m[15] == 1,
               "the last row of a (4, 4) pose must be 0 0 0 1, not ", m[12], " ", m[13], " ", m[14],
               " ", m[15]);
  return {rotation_block(m), Vector3(m[3], m[7], m[11])};
}

RigidPose pose_of_parts(const double* q, const double* p) {
  return {Quaternion(q[0], q[1], q[2], q[3]), Vector3(p[0], p[1], p[2])};
}

constexpr const char* kPose =
    "a RigidPose, a (4, 4) array, a rotation, or a pair (rotation, position), where a rotation is "
    "a "
    "quaternion (w, x, y, z), a (3, 3) array or a scipy Rotation";

// The matrix of an object that has `as_matrix`, such as a scipy Rotation, or the source itself.
Doubles numbers_of(py::handle source) {
  if (!py::isinstance<py::array>(source) && py::hasattr(source, "as_matrix")) {
    return doubles_of(source.attr("as_matrix")());
  }
  return doubles_of(source);
}

// The pose of a rotation and a position; nothing if the first is no rotation.
std::optional<RigidPose> pose_of_rotation(py::handle rotation, const Vector3& p) {
  const Doubles numbers = numbers_of(rotation);
  if (has_shape(numbers, {4})) return pose_of_parts(numbers.data(), p.data());
  if (!has_shape(numbers, {3, 3})) return std::nullopt;
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(numbers.data());
  return RigidPose(Matrix3(R), p);
}

}  // namespace

Vector3 vector_of(py::handle source, const char* what) {
  Vector3 v;
  if (read_sequence(source, v)) return v;
  const auto array = doubles_of(source);
  if (!has_shape(array, {3})) refuse(what, "three numbers", source);
  return Eigen::Map<const Vector3>(array.data());
}

Matrix3 matrix_of(py::handle source, const char* what) {
  const auto array = doubles_of(source);
  if (!has_shape(array, {3, 3})) refuse(what, "a (3, 3) array", source);
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(array.data());
}

RigidPose pose_of(py::handle source) {
  if (py::isinstance<RigidPose>(source)) return source.cast<const RigidPose&>();
  if (is_pair(source)) {
    const Vector3 p = vector_of(source[py::int_(1)], "position of a pose");
    const auto pose = pose_of_rotation(source[py::int_(0)], p);
    if (!pose) refuse("pose", kPose, source);
    return *pose;
  }
  const auto array = numbers_of(source);
  if (has_shape(array, {3, 3})) return *pose_of_rotation(array, Vector3::Zero());
  if (!has_shape(array, {4, 4})) refuse("pose", kPose, source);
  return pose_of_matrix(array.data());
}

std::filesystem::path path_of(py::handle file) {
  if (!PyUnicode_Check(file.ptr()) && !PyBytes_Check(file.ptr()) &&
      !py::hasattr(file, "__fspath__")) {
    throw py::type_error("file must be a str or os.PathLike, not " + describe_source(file));
  }
  // As the system sees it, whatever bytes it holds.
  const auto name = py::module_::import("os").attr("fsencode")(file).cast<std::string>();
  DYOP_REQUIRE(name.find('\0') == std::string::npos, "a file's name holds no zero byte");
  return name;
}

TimeInterval interval_of(py::handle source) {
  if (py::isinstance<TimeInterval>(source)) return source.cast<const TimeInterval&>();
  const auto array = doubles_of(source);
  if (!has_shape(array, {2})) refuse("interval", "a TimeInterval or a pair (begin, end)", source);
  return {array.at(0), array.at(1)};
}

Twist twist_of(py::handle source) {
  if (py::isinstance<Twist>(source)) return source.cast<const Twist&>();
  if (is_pair(source)) {
    return {vector_of(source[py::int_(0)], "v"), vector_of(source[py::int_(1)], "w")};
  }
  const auto array = doubles_of(source);
  if (!has_shape(array, {2, 3})) refuse("twist", "a Twist or a pair (v, w)", source);
  return {Vector3(array.data()), Vector3(array.data() + 3)};
}

MotionState state_of(py::handle source) {
  if (py::isinstance<MotionState>(source)) return source.cast<const MotionState&>();
  if (!is_pair(source)) refuse("state", "a MotionState or a pair (pose, twist)", source);
  return {pose_of(source[py::int_(0)]), twist_of(source[py::int_(1)])};
}

py::array_t<double> array_of(const Vector3& v) {
  return py::array_t<double>(3, v.data());
}

py::array_t<double> array_of(const Matrix3& m) {
  py::array_t<double> array({3, 3});
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(array.mutable_data()) = m;
  return array;
}

py::array_t<double> array_of(const RigidPose& X) {
  Eigen::Matrix<double, 4, 4, Eigen::RowMajor> m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = X.rotation();
  m.topRightCorner<3, 1>() = X.translation();
  return py::array_t<double>({4, 4}, m.data());
}

CopyRule copy_rule_of(const py::object& copy) {
  if (copy.is_none() || (py::isinstance<py::bool_>(copy) && copy.cast<bool>())) {
    return CopyRule::IfNeeded;
  }
  if (!py::isinstance<py::bool_>(copy)) refuse("copy", "None, True or False", copy);
  return CopyRule::Never;
}

Doubles rows_of(py::handle source, py::ssize_t width, const char* what, CopyRule rule) {
  const std::string wanted = "an (N, " + std::to_string(width) + ") array of float64";
  const auto array = doubles_of(source);
  if (!array || array.ndim() != 2 || array.shape(1) != width) {
    refuse(what, wanted, source);
  }
  const bool is_copy = !py::isinstance<py::array>(source) ||
                       array.data() != py::reinterpret_borrow<py::array>(source).data();
  if (rule == CopyRule::Never && is_copy) {
    refuse(what, wanted + " in C order under copy=False", source);
  }
  return array;
}

std::span<const Vector3> points_in(const Doubles& rows) {
  static_assert(sizeof(Vector3) == 3 * sizeof(double) && alignof(Vector3) == alignof(double));
  return {reinterpret_cast<const Vector3*>(rows.data()), std::size_t(rows.shape(0))};
}

std::vector<Vector3> points_of(py::handle source, const char* what, CopyRule rule) {
  const auto rows = rows_of(source, 3, what, rule);
  const auto points = points_in(rows);
  return {points.begin(), points.end()};
}

std::vector<TriangleIndices> triangles_of(py::handle source, CopyRule rule) {
  constexpr const char* kWanted = "an (N, 3) array of int32";
  if (rule == CopyRule::Never && !py::isinstance<py::array_t<std::int32_t>>(source)) {
    refuse("triangles", std::string(kWanted) + " under copy=False", source);
  }
  // Safe casting: integers only, and none that int64 cannot hold. Lists become arrays of their own
  // type first: numpy would cut off the fractions in them.
  const auto own = converted<py::array>(source);
  if (!own) refuse("triangles", kWanted, source);
  const auto array = converted<py::array_t<std::int64_t, py::array::c_style>>(own);
  if (!array || array.ndim() != 2 || array.shape(1) != 3) {
    refuse("triangles", kWanted, source);
  }
  std::vector<TriangleIndices> triangles(std::size_t(array.shape(0)));
  const std::int64_t* number = array.data();
  for (std::size_t row = 0; row < triangles.size(); ++row) {
    for (std::int32_t& index : triangles[row]) {
      DYOP_REQUIRE(*number >= 0 && *number <= std::numeric_limits<std::int32_t>::max(),
                   "triangles[", row, "] holds ", *number, ", which is no vertex number");
      index = std::int32_t(*number++);
    }
  }
  return triangles;
}

PoseList poses_of(py::handle source, const char* what) {
  PoseList list;
  if (py::isinstance<RigidPose>(source)) return {{pose_of(source)}, true};
  if (is_pair(source) && !py::isinstance<RigidPose>(source[py::int_(0)])) {
    const auto q = numbers_of(source[py::int_(0)]);
    const auto p = doubles_of(source[py::int_(1)]);
    if ((has_shape(q, {4}) || has_shape(q, {3, 3})) && has_shape(p, {3})) {
      return {{pose_of(source)}, true};
    }
    if (q && p && q.ndim() == 2 && p.ndim() == 2 && q.shape(1) == 4 && p.shape(1) == 3) {
      DYOP_REQUIRE(q.shape(0) == p.shape(0), what, ": ", q.shape(0), " quaternions but ",
                   p.shape(0), " positions");
      for (py::ssize_t i = 0; i < q.shape(0); ++i) {
        list.poses.push_back(pose_of_parts(q.data() + 4 * i, p.data() + 3 * i));
      }
      return list;
    }
  }
  if (py::isinstance<py::sequence>(source) && !py::isinstance<py::array>(source)) {
    for (const py::handle item : source) list.poses.push_back(pose_of(item));
    return list;
  }
  const auto array = numbers_of(source);
  if (has_shape(array, {4, 4}) || has_shape(array, {3, 3})) return {{pose_of(array)}, true};
  if (!array || array.ndim() != 3 || array.shape(1) != 4 || array.shape(2) != 4) {
    refuse(what, std::string(kPose) + ", a list of these, (N, 4, 4), or ((N, 4), (N, 3))", source);
  }
  for (py::ssize_t i = 0; i < array.shape(0); ++i) {
    list.poses.push_back(pose_of_matrix(array.data() + 16 * i));
  }
  return list;
}

}  // namespace dyop::python
