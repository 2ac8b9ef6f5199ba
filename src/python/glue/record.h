// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/stl.h>

#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "python/glue/arguments.h"
#include "python/glue/calls.h"

namespace dyop::python {

/// A named member of a struct, reached through a pointer to the struct.
struct Field {
  std::string name;
  /// With an owner, a record within the record is that one itself, so that its fields can be set;
  /// without, a copy.
  py::object (*get)(const void* record, py::handle owner);
  void (*set)(void* record, py::handle value);
};
using FieldList = std::vector<Field>;

/// Adds what all records have beside their fields: `_fields`, `asdict()`, repr and pickling.
/// @param pointer_of The struct within an instance.
void finish_record(const py::object& type, const FieldList& fields,
                   void* (*pointer_of)(py::handle));
/// Adds a field as a property; `doc` begins with its type, "float: ...".
void add_property(const py::object& type, const Field& field, const char* doc, bool is_writable,
                  void* (*pointer_of)(py::handle));
/// Sets the fields that keyword arguments name.
/// @throws TypeError naming a keyword that is none.
void set_fields(void* record, const FieldList& fields, const py::kwargs& values);

template <typename Member>
struct MemberTraits;
template <typename Class, typename Value>
struct MemberTraits<Value Class::*> {
  using ValueType = Value;
};

/// Whether Python holds a value of this type as an object of its own, not converted.
template <typename Value>
inline constexpr bool kIsRecord =
    std::is_base_of_v<py::detail::type_caster_base<Value>, py::detail::make_caster<Value>>;

/// What is read from Python for a member of this type.
template <typename Value>
Value value_of(py::handle source) {
  if constexpr (std::is_same_v<Value, RigidPose>) {
    return pose_of(source);
  } else if constexpr (std::is_same_v<Value, TimeInterval>) {
    return interval_of(source);
  } else if constexpr (std::is_same_v<Value, Twist>) {
    return twist_of(source);
  } else if constexpr (std::is_same_v<Value, MotionState>) {
    return state_of(source);
  } else {
    return source.cast<Value>();
  }
}

/// Binds a plain struct whose members have the same names in Python. Every record pickles, and can
/// be made empty or from keyword arguments.
template <typename T, typename... Bases>
class Record {
 public:
  Record(py::handle scope, const char* name, const char* doc) : type(scope, name, doc) {}

  /// A result: read only.
  template <auto kMember>
  Record& field(const char* name, const char* doc) {
    return add<kMember>(name, doc, false);
  }
  /// An option: can be set.
  template <auto kMember>
  Record& option(const char* name, const char* doc) {
    return add<kMember>(name, doc, true);
  }
  /// A member whose Python type is another one.
  Record& custom(const Field& field, const char* doc, bool is_writable = true) {
    fields.push_back(field);
    add_property(type, field, doc, is_writable, &pointer_of);
    return *this;
  }
  void finish() {
    type.def(py::init([list = fields](const py::kwargs& values) {
      T record{};
      set_fields(&record, list, values);
      return record;
    }));
    finish_record(type, fields, &pointer_of);
  }

  py::class_<T, Bases...> type;
  FieldList fields;

 private:
  static void* pointer_of(py::handle instance) { return instance.cast<T*>(); }

  template <auto kMember>
  Record& add(const char* name, const char* doc, bool is_writable) {
    using Value = typename MemberTraits<decltype(kMember)>::ValueType;
    return custom({name,
                   [](const void* record, [[maybe_unused]] py::handle owner) {
                     const Value& value = static_cast<const T*>(record)->*kMember;
                     if constexpr (kIsRecord<Value>) {
                       if (owner) {
                         return py::cast(&value, py::return_value_policy::reference_internal,
                                         owner);
                       }
                     }
                     if constexpr (std::is_same_v<Value, std::string>) {
                       return py::object(readable(value));
                     } else {
                       return py::cast(value, py::return_value_policy::copy);
                     }
                   },
                   [](void* record, py::handle value) {
                     static_cast<T*>(record)->*kMember = value_of<Value>(value);
                   }},
                  doc, is_writable);
  }
};

}  // namespace dyop::python
