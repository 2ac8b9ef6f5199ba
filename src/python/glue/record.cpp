// SPDX-License-Identifier: BSD-3-Clause
#include "python/glue/record.h"

#include <algorithm>

#include "dyop/core/error.h"

namespace dyop::python {

namespace {

// Longer lists, texts and records are cut, so that a repr fills one screen at most.
constexpr std::size_t kShownItems = 3;
constexpr std::size_t kShownLetters = 250;  // of a field or an item
constexpr std::size_t kShownRecord = 1800;

// Cuts UTF-8 between two letters.
std::string cut(std::string text, std::size_t most) {
  if (text.size() <= most) return text;
  while (most > 0 && (static_cast<unsigned char>(text[most]) & 0xc0) == 0x80) --most;
  return text.substr(0, most) + "...";
}

std::string short_repr(const py::object& value) {
  if (!py::isinstance<py::tuple>(value)) return cut(py::repr(value), kShownLetters);
  const py::tuple items = value;
  std::string text = "(";
  for (std::size_t i = 0; i < std::min(items.size(), kShownItems); ++i) {
    text += (i > 0 ? ", " : "") + short_repr(items[i]);
  }
  if (items.size() > kShownItems) text += ", ... of " + std::to_string(items.size());
  return text + (items.size() == 1 ? ",)" : ")");
}

// "Name(a=1, b=2)" of values that are looked up by name.
template <typename Names, typename Lookup>
std::string repr_of_parts(py::handle self, const Names& names, const Lookup& look_up) {
  std::string text = py::str(py::type::handle_of(self).attr("__name__"));
  std::string between = "(";
  for (const auto& name : names) {
    text += between + look_up(name);
    between = ", ";
  }
  return cut(text + ')', kShownRecord);
}

// Whether two values of a field are equal: arrays as a whole, tuples by their items.
bool are_equal(const py::object& a, const py::object& b) {
  if (py::isinstance<py::array>(a) && py::isinstance<py::array>(b)) {
    return py::module_::import("numpy").attr("array_equal")(a, b).cast<bool>();
  }
  if (!py::isinstance<py::tuple>(a) || !py::isinstance<py::tuple>(b)) return a.equal(b);
  const py::tuple first = a;
  const py::tuple second = b;
  return first.size() == second.size() &&
         std::equal(first.begin(), first.end(), second.begin(), [](py::handle x, py::handle y) {
           return are_equal(py::reinterpret_borrow<py::object>(x),
                            py::reinterpret_borrow<py::object>(y));
         });
}

std::string names_of(const FieldList& fields) {
  std::string names;
  for (const Field& field : fields) names += (names.empty() ? "" : ", ") + field.name;
  return names;
}

// The holder of a record that Python owns; null for what is part of another one, or no record.
FreezableHolder* holder_of(py::handle object) {
  auto* base = reinterpret_cast<PyTypeObject*>(py::detail::get_internals().instance_base);
  if (PyObject_TypeCheck(object.ptr(), base) == 0) return nullptr;
  const auto& types = py::detail::all_type_info(Py_TYPE(object.ptr()));
  // The class that C++ made: one of Python may have what it likes.
  if (types.size() != 1) return nullptr;
  if (PyDict_GetItemString(types[0]->type->tp_dict, "_fields") == nullptr) return nullptr;
  const auto holder = reinterpret_cast<py::detail::instance*>(object.ptr())->get_value_and_holder();
  return holder.holder_constructed() ? &holder.holder<FreezableHolder>() : nullptr;
}

// Errors name the field.
void set_field(const Field& field, void* record, py::handle value) {
  try {
    field.set(record, value);
  } catch (const py::cast_error&) {
    throw py::type_error(field.name + " must be " + field.type + ", not " +
                         cut(py::repr(value), kShownLetters));
  } catch (const py::type_error& error) {
    const std::string message = error.what();
    if (message.starts_with(field.name)) throw;
    throw py::type_error(field.name + ": " + message);
  } catch (const InvalidArgument& error) {
    const std::string message = error.what();
    if (message.starts_with(field.name)) throw;
    throw InvalidArgument(field.name + ": " + message);
  }
}

void require_unfrozen(py::handle record, const std::string& field) {
  if (!is_frozen(record)) return;
  throw py::attribute_error(
      "cannot set " + field + ": this " +
      std::string(py::str(py::type::handle_of(record).attr("__name__"))) +
      " is a copy of a part of another object; change copy.copy() of it, and assign that");
}

// Not a view of what another kind of object holds.
bool owns_memory(py::object array) {
  while (array && py::isinstance<py::array>(array)) {
    array = py::reinterpret_borrow<py::object>(py::detail::array_proxy(array.ptr())->base);
  }
  return !array;
}

template <typename Sequence>
py::tuple sealed_items(const Sequence& items) {
  py::tuple sealed_ones(items.size());
  for (std::size_t i = 0; i < items.size(); ++i) sealed_ones[i] = sealed(items[i]);
  return sealed_ones;
}

void seal_properties_of(const py::object& type) {
  const py::object property = py::module_::import("builtins").attr("property");
  const py::object fields = py::getattr(type, "_fields", py::tuple());
  const py::dict members = py::dict(type.attr("__dict__"));
  for (const auto& [name, member] : members) {
    // Those of records are sealed where that is called for.
    if (!py::type::handle_of(member).is(property) || fields.contains(name)) continue;
    const py::cpp_function get([get = py::object(member.attr("fget"))](const py::object& self) {
      return sealed(get(self));
    });
    type.attr(name) = property(get, member.attr("fset"), py::none(), member.attr("__doc__"));
  }
}

}  // namespace

bool is_frozen(py::handle record) {
  const FreezableHolder* holder = holder_of(record);
  return holder != nullptr && holder->is_frozen;
}

py::object sealed(py::object value) {
  if (PyList_CheckExact(value.ptr())) return sealed_items(py::list(value));
  if (PyTuple_CheckExact(value.ptr())) return sealed_items(py::tuple(value));
  if (py::isinstance<py::array>(value)) {
    if (owns_memory(value)) {
      py::detail::array_proxy(value.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
    }
  } else if (FreezableHolder* holder = holder_of(value)) {
    holder->is_frozen = true;
  }
  return value;
}

void seal_properties(py::module_& m) {
  const py::dict members = m.attr("__dict__");
  for (const auto& [name, member] : members) {
    if (PyType_Check(member.ptr()) && !py::hasattr(member, "__members__")) {
      seal_properties_of(py::reinterpret_borrow<py::object>(member));
    }
  }
}

void finish_record(const py::object& type, const FieldList& fields,
                   void* (*pointer_of)(py::handle)) {
  py::list names;
  for (const Field& field : fields) names.append(field.name);
  type.attr("_fields") = py::tuple(names);
  const auto method = [&](const char* name, const char* doc, auto function) {
    // Without the name: pybind11 takes one called __setstate__ for a constructor.
    type.attr(name) = py::cpp_function(function, py::is_method(type), py::scope(type), doc);
  };
  method("asdict", "The fields by name.", [fields, pointer_of](py::handle self) {
    py::dict values;
    for (const Field& field : fields) values[field.name.c_str()] = field.get(pointer_of(self), {});
    return values;
  });
  method("__repr__", "", [fields, pointer_of](py::handle self) {
    return repr_of_parts(self, fields, [&](const Field& field) {
      return field.name + '=' + short_repr(field.get(pointer_of(self), {}));
    });
  });
  method("__eq__", "Whether all fields are equal.",
         [fields, pointer_of](py::handle self, py::handle other) -> py::object {
           if (!py::type::handle_of(other).is(py::type::handle_of(self))) {
             return py::reinterpret_borrow<py::object>(Py_NotImplemented);
           }
           void* const a = pointer_of(self);
           void* const b = pointer_of(other);
           return py::bool_(std::all_of(fields.begin(), fields.end(), [&](const Field& field) {
             return are_equal(field.get(a, {}), field.get(b, {}));
           }));
         });
  type.attr("__hash__") = py::none();  // what can change cannot be a key
  method("__reduce__", "", [fields, pointer_of](py::handle self) {
    py::tuple values(fields.size());
    for (std::size_t i = 0; i < fields.size(); ++i) values[i] = fields[i].get(pointer_of(self), {});
    return py::make_tuple(py::type::of(self), py::tuple(), values);
  });
  method("__setstate__", "", [fields, pointer_of](py::handle self, const py::tuple& values) {
    if (values.size() != fields.size()) throw py::value_error("pickled by another version of dyop");
    for (std::size_t i = 0; i < fields.size(); ++i) fields[i].set(pointer_of(self), values[i]);
  });
}

void add_property(const py::object& type, const Field& field, const char* doc, bool is_writable,
                  void* (*pointer_of)(py::handle)) {
  const py::cpp_function get([get = field.get, pointer_of, is_writable](py::handle self) {
    return get(pointer_of(self), is_writable && !is_frozen(self) ? self : py::handle());
  });
  py::object set = py::none();
  if (is_writable) {
    set = py::cpp_function([field, pointer_of](py::handle self, py::handle value) {
      require_unfrozen(self, field.name);
      set_field(field, pointer_of(self), value);
    });
  }
  const auto property = py::module_::import("builtins").attr("property");
  type.attr(field.name.c_str()) = property(get, set, py::none(), doc);
}

void show_properties(const py::object& type, const std::vector<std::string>& names) {
  type.attr("__repr__") = py::cpp_function(
      [names](py::handle self) {
        return repr_of_parts(self, names, [&](const std::string& name) {
          return name + '=' + short_repr(self.attr(name.c_str()));
        });
      },
      py::is_method(type), py::name("__repr__"));
}

void set_fields(void* record, const FieldList& fields, const py::kwargs& values) {
  for (const auto& [key, value] : values) {
    const std::string name = py::str(key);
    const auto field =
        std::find_if(fields.begin(), fields.end(), [&](const Field& f) { return f.name == name; });
    if (field == fields.end()) {
      throw py::type_error("there is no field '" + name + "'; there are " + names_of(fields));
    }
    set_field(*field, record, value);
  }
}

}  // namespace dyop::python
