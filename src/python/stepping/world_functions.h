// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <any>

#include "dyop/dynamics/world_options.h"
#include "python/glue/callback.h"
#include "python/glue/record.h"

namespace dyop::python {

/// A Wrench or a pair (force, torque).
inline Wrench read_wrench(const py::object& value) {
  if (py::isinstance<Wrench>(value)) return value.cast<Wrench>();
  const Twist pair = twist_of(value);  // two vectors as well
  return {pair.v_WB, pair.w_WB};
}
using WrenchFunction = PythonFunction<&read_wrench>;

/// Calls function(event, states) and takes over what it wrote into states.
struct ImpactFunction {
  SharedObject function;

  void operator()(const ImpactEvent& event, ImpactStates& states) const {
    const py::gil_scoped_acquire lock;
    const py::object shown = py::cast(states, py::return_value_policy::copy);
    function.get()(event, shown);
    states = shown.cast<ImpactStates&>();
  }
};

/// The Python function within a std::function, None if it is empty. One that was made by C++ cannot
/// be called from Python: an Ellipsis stands for it.
template <typename Function, typename StdFunction>
py::object python_function(const StdFunction& function) {
  if (!function) return py::none();
  const auto* own = function.template target<Function>();
  return own != nullptr ? own->function.get() : py::object(py::ellipsis());
}

/// The other direction. An Ellipsis leaves the function as it is.
template <typename Function, typename StdFunction>
void set_function(StdFunction& function, py::handle value) {
  if (value.is(py::ellipsis())) return;
  function = nullptr;
  if (value.is_none()) return;
  if (PyCallable_Check(value.ptr()) == 0) throw py::type_error("a function is wanted");
  function = Function{SharedObject(py::reinterpret_borrow<py::object>(value))};
}

/// A field of a record T that holds a function.
template <typename T, auto kMember, typename Function>
Field function_field(const char* name) {
  return {name,
          [](const void* r, py::handle) {
            return python_function<Function>(static_cast<const T*>(r)->*kMember);
          },
          [](void* r, py::handle value) {
            set_function<Function>(static_cast<T*>(r)->*kMember, value);
          }};
}

inline py::object object_in(const std::any& data) {
  const auto* held = std::any_cast<SharedObject>(&data);
  return held != nullptr ? held->get() : py::object(py::none());
}

}  // namespace dyop::python
