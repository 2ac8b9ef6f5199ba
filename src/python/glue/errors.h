// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/pybind11.h>

#include <string>

namespace dyop::python {

/// Adds the exceptions to the module, and how C++ ones become them. Text that is not UTF-8, such as
/// bytes of a file that a message quotes, is shown escaped.
void bind_errors(pybind11::module_& m);

/// To be called when everything is bound: makes a call whose arguments do not fit say in one line
/// which one, and what it must be (dyop/_errors.py). Calls that succeed cost nothing more.
void explain_refused_calls(pybind11::module_& m);

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

}  // namespace dyop::python
