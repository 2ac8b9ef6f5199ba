// SPDX-License-Identifier: BSD-3-Clause
#include <cerrno>
#include <exception>
#include <string>

#include "dyop/core/error.h"
#include "dyop/dynamics/integrator.h"
#include "dyop/io/file_error.h"
#include "python/glue/calls.h"

namespace dyop::python {
namespace {

namespace py = pybind11;

// Never freed: translators take no data and may run until the interpreter ends.
struct ErrorTypes {
  py::handle error;
  py::handle invalid_argument;
  py::handle internal;
  py::handle integration;
  py::handle file;
  py::handle missing_file;
};
ErrorTypes error_types;

void set_error(py::handle type, const std::exception& error) {
  PyErr_SetObject(type.ptr(), readable(error.what()).ptr());
}

void set_file_error(py::handle type, const FileError& error) {
  const py::object value = type(readable(error.what()));
  value.attr("file") = py::module_::import("os").attr("fsdecode")(py::bytes(error.file().string()));
  value.attr("line") = py::none();
  value.attr("column") = py::none();
  if (error.position()) {
    value.attr("line") = error.position()->line;
    const auto& column = error.position()->column;
    if (column) value.attr("column") = *column;
  }
  if (type.is(error_types.missing_file)) value.attr("errno") = ENOENT;
  PyErr_SetObject(type.ptr(), value.ptr());
}

// pybind11's messages name the type between quotes: "... of type <class 'str'> to C++ ...".
void set_cast_error(const std::string& message) {
  const std::size_t begin = message.find("<class '");
  const std::size_t end = message.find("'>", begin);
  const std::string type = end == std::string::npos
                               ? "unknown type"
                               : "type " + message.substr(begin + 8, end - begin - 8);
  PyErr_SetString(PyExc_TypeError, ("a value of " + type + " does not fit here").c_str());
}

void translate(std::exception_ptr thrown) {
  try {
    if (thrown) std::rethrow_exception(thrown);
  } catch (const MissingFile& error) {
    set_file_error(error_types.missing_file, error);
  } catch (const FileError& error) {
    set_file_error(error_types.file, error);
  } catch (const InvalidArgument& error) {
    set_error(error_types.invalid_argument, error);
  } catch (const InternalError& error) {
    set_error(error_types.internal, error);
  } catch (const IntegrationError& error) {
    set_error(error_types.integration, error);
  } catch (const Error& error) {
    set_error(error_types.error, error);
  } catch (const py::cast_error& error) {
    set_cast_error(error.what());
  }
}

py::handle add_error(py::module_& m, const char* name, const char* doc, const py::object& bases) {
  const std::string full_name = "dyop._dyop." + std::string(name);
  PyObject* type = PyErr_NewExceptionWithDoc(full_name.c_str(), doc, bases.ptr(), nullptr);
  if (type == nullptr) throw py::error_already_set();
  m.attr(name) = py::handle(type);
  return type;
}

constexpr int kCallFlags = METH_VARARGS | METH_KEYWORDS;
PyCFunctionWithKeywords refusing_call = nullptr;  // pybind11's

// Puts the explanation in place of the TypeError that is set, if pybind11 set it.
void explain(PyObject* args, PyObject* kwargs) {
  PyObject *type = nullptr, *value = nullptr, *trace = nullptr;
  PyErr_Fetch(&type, &value, &trace);
  const auto message =
      py::reinterpret_steal<py::object>(value == nullptr ? nullptr : PyObject_Str(value));
  PyErr_Clear();
  PyErr_Restore(type, value, trace);
  if (!message || std::string(py::str(message)).find(": incompatible ") == std::string::npos)
    return;
  PyErr_Clear();
  try {
    const py::object given =
        kwargs == nullptr ? py::object(py::dict()) : py::reinterpret_borrow<py::object>(kwargs);
    const py::object text =
        py::module_::import("dyop._errors").attr("explain")(message, py::handle(args), given);
    PyErr_SetObject(PyExc_TypeError, text.ptr());
  } catch (py::error_already_set& error) {
    error.restore();
  }
}

// The signatures of a bound function, one for each overload: "(t: float) -> float".
py::list signatures_of(PyObject* function) {
  const char* name = PyCapsule_GetName(function);
  const auto* record =
      static_cast<const py::detail::function_record*>(PyCapsule_GetPointer(function, name));
  py::list signatures;
  for (; record != nullptr; record = record->next) signatures.append(record->signature);
  return signatures;
}

// Names the argument in the InvalidArgument that is set, if a converter of its value threw that.
void name_argument(PyObject* function, PyObject* args, PyObject* kwargs) {
  py::error_already_set thrown;
  try {
    const py::object given =
        kwargs == nullptr ? py::object(py::dict()) : py::reinterpret_borrow<py::object>(kwargs);
    const py::str message(thrown.value());
    const py::object named =
        py::module_::import("dyop._errors")
            .attr("name_argument")(message, signatures_of(function), py::handle(args), given);
    if (named.equal(message)) {
      thrown.restore();
    } else {
      PyErr_SetObject(error_types.invalid_argument.ptr(), named.ptr());
    }
  } catch (py::error_already_set& error) {
    error.restore();
  }
}

// The call as pybind11 makes it. What it throws before it looks at the arguments, for a constructor
// of one class called on an object of another, would end the process.
PyObject* contained_call(PyObject* self, PyObject* args, PyObject* kwargs) {
  try {
    return refusing_call(self, args, kwargs);
  } catch (const std::exception&) {
    PyErr_SetString(PyExc_TypeError, "a constructor of another class cannot make this object");
    return nullptr;
  }
}

PyObject* explained_call(PyObject* self, PyObject* args, PyObject* kwargs) {
  PyObject* result = contained_call(self, args, kwargs);
  if (result != nullptr) return result;
  if (PyErr_ExceptionMatches(error_types.invalid_argument.ptr()) != 0) {
    name_argument(self, args, kwargs);
  } else if (PyErr_ExceptionMatches(PyExc_TypeError) != 0) {
    explain(args, kwargs);
  }
  return result;
}

// What pybind11 made of a C++ function, within what it is wrapped in; null for anything else.
PyCFunctionObject* function_in(py::handle object) {
  if (!object) return nullptr;
  PyObject* pointer = object.ptr();
  if (PyInstanceMethod_Check(pointer)) pointer = PyInstanceMethod_GET_FUNCTION(pointer);
  if (!PyCFunction_CheckExact(pointer)) return nullptr;
  auto* function = reinterpret_cast<PyCFunctionObject*>(pointer);
  return function->m_ml->ml_flags == kCallFlags ? function : nullptr;
}

void explain_calls_of(py::handle object) {
  PyCFunctionObject* function = function_in(object);
  if (function == nullptr) return;
  auto* call = reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)()>(&explained_call));
  auto* theirs = reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)()>(refusing_call));
  if (function->m_ml->ml_meth == theirs) function->m_ml->ml_meth = call;
}

void explain_calls_within(py::handle type) {
  const py::dict members = py::dict(type.attr("__dict__"));
  for (const auto& [name, member] : members) {
    if (py::isinstance<py::staticmethod>(member)) {
      explain_calls_of(member.attr("__func__"));
    } else if (PyObject_TypeCheck(member.ptr(), &PyProperty_Type) != 0) {
      explain_calls_of(member.attr("fset"));
    } else {
      explain_calls_of(member);
    }
  }
}

// In place of the memory that pybind11 would make up for an object without a C++ part, which then
// would be read as if it held one.
void* refuse_unmade(std::size_t /*size*/) {
  throw py::type_error("an object cannot be used whose __init__() was never called");
}

// copyreg makes an object of the base class for older protocols, where pybind11 ends the process.
py::object reduce_by_newer_protocols(const py::object& self, int protocol) {
  if (protocol < 2) throw py::type_error("pickle needs protocol 2 or later for this object");
  return py::module_::import("builtins").attr("object").attr("__reduce_ex__")(self, protocol);
}

// As protocol 2 does it; object.__reduce__() would follow protocol 0, and end the process likewise.
py::object reduce_by_state(const py::object& self) {
  const py::type type = py::type::of(self);
  const py::object object = py::module_::import("builtins").attr("object");
  const py::object get_state = py::getattr(type, "__getstate__", py::none());
  if (get_state.is(py::getattr(object, "__getstate__", py::none()))) {
    const std::string name = py::str(type.attr("__name__"));
    throw py::type_error("cannot pickle '" + name + "' object");
  }
  return py::make_tuple(py::module_::import("copyreg").attr("__newobj__"), py::make_tuple(type),
                        get_state(self));
}

bool inherits_reduction(py::handle type) {
  const py::object own = type.attr("__reduce__");
  return own.is(py::module_::import("builtins").attr("object").attr("__reduce__"));
}

}  // namespace

py::str readable(const std::string& text) {
  PyObject* decoded =
      PyUnicode_DecodeUTF8(text.data(), py::ssize_t(text.size()), "backslashreplace");
  if (decoded == nullptr) throw py::error_already_set();
  return py::reinterpret_steal<py::str>(decoded);
}

void bind_errors(py::module_& m) {
  ErrorTypes& types = error_types;
  types.error = add_error(m, "Error", "Root of every exception that dyop throws.",
                          py::reinterpret_borrow<py::object>(PyExc_RuntimeError));
  const auto with = [&](py::handle base) { return py::make_tuple(types.error, base); };
  const auto only = py::reinterpret_borrow<py::object>(types.error);
  types.invalid_argument = add_error(
      m, "InvalidArgument", "A documented condition is broken; the message names the value.",
      with(PyExc_ValueError));
  types.internal =
      add_error(m, "InternalError",
                "An error in dyop itself; the message holds what is needed to reproduce it.", only);
  types.integration =
      add_error(m, "IntegrationError",
                "A solver could not go on; the message has its name and the reason.", only);
  types.file =
      add_error(m, "FileError",
                "A file cannot be read, written or understood; attributes file, line, column.",
                with(PyExc_OSError));
  types.missing_file = add_error(m, "MissingFile", "The file is not there.",
                                 py::make_tuple(types.file, py::handle(PyExc_FileNotFoundError)));
  py::register_exception_translator(&translate);
}

void explain_refused_calls(py::module_& m) {
  // Any function of the module shows what pybind11 calls.
  const PyCFunctionObject* sample = function_in(m.attr("distance"));
  if (sample == nullptr) return;
  refusing_call = reinterpret_cast<PyCFunctionWithKeywords>(
      reinterpret_cast<void (*)()>(sample->m_ml->ml_meth));
  const py::dict members = m.attr("__dict__");
  for (const auto& [name, member] : members) {
    if (PyType_Check(member.ptr())) {
      explain_calls_within(member);
    } else {
      explain_calls_of(member);
    }
  }
}

void refuse_unmade_objects(py::module_& m) {
  const py::dict members = m.attr("__dict__");
  for (const auto& [name, member] : members) {
    if (!PyType_Check(member.ptr())) continue;
    auto* type = reinterpret_cast<PyTypeObject*>(member.ptr());
    auto* info = py::detail::get_type_info(type);
    if (info == nullptr) continue;
    info->operator_new = &refuse_unmade;
    member.attr("__reduce_ex__") =
        py::cpp_function(&reduce_by_newer_protocols, py::is_method(member));
    if (inherits_reduction(member)) {
      member.attr("__reduce__") = py::cpp_function(&reduce_by_state, py::is_method(member));
    }
  }
}

}  // namespace dyop::python
