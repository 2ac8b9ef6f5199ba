// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/pybind11.h>

#include <memory>
#include <string>
#include <utility>

#include "dyop/geometry/shape.h"
#include "dyop/motion/motion.h"

// Classes of Python that derive from Motion or ConvexShape. Their objects are Python's; a
// shared_ptr that C++ keeps must keep the Python object, which has the functions, and not just the
// C++ part of it.

namespace dyop::python {

/// Base of the C++ parts of such objects.
class DerivedInPython {
 public:
  virtual ~DerivedInPython() = default;

 protected:
  /// The method of this name that the class defines; empty if it defines none. Lock held.
  template <typename Base>
  static pybind11::function method_of(const Base* self, const char* name) {
    return pybind11::get_override(self, name);
  }
  /// The same. @throws TypeError if there is none.
  template <typename Base>
  static pybind11::function required_method(const Base* self, const char* name) {
    pybind11::function method = method_of(self, name);
    if (method) return method;
    const pybind11::object object = pybind11::cast(self, pybind11::return_value_policy::reference);
    throw pybind11::type_error(
        std::string(pybind11::str(pybind11::type::of(object).attr("__name__"))) +
        " must define the method " + name);
  }
};

/// A pointer to `part` that keeps `object`, of which it is the C++ part.
template <typename T>
std::shared_ptr<T> kept_by(pybind11::handle object, T* part) {
  object.inc_ref();
  const std::shared_ptr<PyObject> keeper(object.ptr(), [](PyObject* pointer) {
    if (Py_IsInitialized() == 0) return;  // the interpreter has freed everything
    const pybind11::gil_scoped_acquire lock;
    Py_DECREF(pointer);
  });
  return std::shared_ptr<T>(keeper, part);
}

}  // namespace dyop::python

namespace pybind11::detail {

/// A shared_ptr read from Python.
template <typename T>
struct KeepingCaster : copyable_holder_caster<T, std::shared_ptr<T>> {
  using Caster = copyable_holder_caster<T, std::shared_ptr<T>>;
  bool load(handle source, bool convert) {
    if (!Caster::load(source, convert)) return false;
    T* const part = this->holder.get();
    if (dynamic_cast<const dyop::python::DerivedInPython*>(part) != nullptr) {
      this->holder = dyop::python::kept_by(source, part);
    }
    return true;
  }
};

template <>
struct type_caster<std::shared_ptr<dyop::Motion>> : KeepingCaster<dyop::Motion> {};
template <>
struct type_caster<std::shared_ptr<const dyop::Motion>> : KeepingCaster<const dyop::Motion> {};
template <>
struct type_caster<std::shared_ptr<dyop::Shape>> : KeepingCaster<dyop::Shape> {};
template <>
struct type_caster<std::shared_ptr<const dyop::Shape>> : KeepingCaster<const dyop::Shape> {};

}  // namespace pybind11::detail
