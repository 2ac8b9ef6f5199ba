// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/pybind11.h>

#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <utility>

#include "dyop/core/batch_options.h"
#include "python/glue/arguments.h"

namespace dyop::python {

/// Adds the exceptions to the module, and how C++ ones become them. Text that is not UTF-8, such as
/// bytes of a file that a message quotes, is shown escaped.
void bind_errors(pybind11::module_& m);

/// To be called when everything is bound: makes a call whose arguments do not fit say in one line
/// which one, and what it must be (dyop/_errors.py). Calls that succeed cost nothing more.
void explain_refused_calls(pybind11::module_& m);
/// Likewise: an object that `__new__` made and no `__init__`, and pickling with protocols 0 and 1,
/// are refused with a TypeError, where pybind11 would crash.
void refuse_unmade_objects(pybind11::module_& m);

/// Text in which bytes that are not UTF-8 are shown escaped.
pybind11::str readable(const std::string& text);

/// Reads a value of Python; `what` names it where it is of another type.
/// @throws TypeError
template <typename T>
T read_as(pybind11::handle value, const char* what) {
  try {
    return value.cast<T>();
  } catch (const pybind11::cast_error&) {
    throw pybind11::type_error(
        std::string(what) + ", not a value of type " +
        std::string(pybind11::str(pybind11::type::handle_of(value).attr("__name__"))));
  }
}

/// A Python object that C++ may copy and drop in any thread, with or without the interpreter's
/// lock.
class SharedObject {
 public:
  SharedObject() = default;
  explicit SharedObject(py::object object)
      : object_(object.release().ptr(), [](PyObject* pointer) {
          if (Py_IsInitialized() == 0) return;  // the interpreter has freed everything
          const py::gil_scoped_acquire lock;
          Py_DECREF(pointer);
        }) {}

  /// With the lock only; None if empty.
  py::object get() const {
    return object_ ? py::reinterpret_borrow<py::object>(object_.get()) : py::object(py::none());
  }

 private:
  std::shared_ptr<PyObject> object_;
};

/// A Python function as a C++ one: takes the lock, calls, and reads the answer.
template <auto kRead>
struct PythonFunction {
  SharedObject function;

  template <typename... Arguments>
  auto operator()(const Arguments&... arguments) const {
    const py::gil_scoped_acquire lock;
    return kRead(function.get()(arguments...));
  }
};

inline void read_nothing(const py::object&) {}
inline Scalar read_scalar(const py::object& value) {
  return read_as<Scalar>(value, "a function must return a number");
}
inline bool read_bool(const py::object& value) {
  return read_as<bool>(value, "a function must return a bool");
}
inline RigidPose read_pose(const py::object& value) {
  return pose_of(value);
}
inline Twist read_twist(const py::object& value) {
  return twist_of(value);
}

using StepFunction = PythonFunction<&read_nothing>;
using ScalarFunction = PythonFunction<&read_scalar>;
using BoolFunction = PythonFunction<&read_bool>;
using PoseFunction = PythonFunction<&read_pose>;
using TwistFunction = PythonFunction<&read_twist>;

/// Runs work(token) without the interpreter's lock while Ctrl-C and other signals of Python are
/// served: an exception of a handler requests a stop, and is thrown when the work has ended. The
/// work may also be stopped by `stop`.
void run_interruptible(const std::stop_token& stop,
                       const std::function<void(std::stop_token)>& work);

/// A callback for BatchOptions: calls progress(done, total) at most ten times a second, and at the
/// end. True draws a bar on a terminal or in a notebook. Empty for None.
std::function<void(std::size_t, std::size_t)> make_progress(const py::object& progress);

}  // namespace dyop::python
