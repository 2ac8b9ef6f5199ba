// SPDX-License-Identifier: BSD-3-Clause
#include "python/glue/record.h"

#include <algorithm>

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
  if (!py::isinstance<py::list>(value)) return cut(py::repr(value), kShownLetters);
  const py::list items = value;
  std::string text = "[";
  for (std::size_t i = 0; i < std::min(items.size(), kShownItems); ++i) {
    text += (i > 0 ? ", " : "") + short_repr(items[i]);
  }
  if (items.size() > kShownItems) text += ", ... of " + std::to_string(items.size());
  return text + ']';
}

std::string names_of(const FieldList& fields) {
  std::string names;
  for (const Field& field : fields) names += (names.empty() ? "" : ", ") + field.name;
  return names;
}

}  // namespace

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
    std::string text = py::str(py::type::handle_of(self).attr("__name__"));
    text += '(';
    for (const Field& field : fields) {
      if (&field != fields.data()) text += ", ";
      text += field.name + '=' + short_repr(field.get(pointer_of(self), {}));
    }
    return cut(text + ')', kShownRecord);
  });
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
    return get(pointer_of(self), is_writable ? self : py::handle());
  });
  py::object set = py::none();
  if (is_writable) {
    set = py::cpp_function(
        [set = field.set, pointer_of, name = field.name](py::handle self, py::handle value) {
          try {
            set(pointer_of(self), value);
          } catch (const py::cast_error&) {
            throw py::type_error(name + " cannot be " + std::string(py::repr(value)));
          }
        });
  }
  const auto property = py::module_::import("builtins").attr("property");
  type.attr(field.name.c_str()) = property(get, set, py::none(), doc);
}

void set_fields(void* record, const FieldList& fields, const py::kwargs& values) {
  for (const auto& [key, value] : values) {
    const std::string name = py::str(key);
    const auto field =
        std::find_if(fields.begin(), fields.end(), [&](const Field& f) { return f.name == name; });
    if (field == fields.end()) {
      throw py::type_error("there is no field '" + name + "'; there are " + names_of(fields));
    }
    try {
      field->set(record, value);
    } catch (const py::cast_error&) {
      throw py::type_error(name + " cannot be " + std::string(py::repr(value)));
    }
  }
}

}  // namespace dyop::python
