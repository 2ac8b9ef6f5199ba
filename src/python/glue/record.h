// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/stl.h>

#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "python/glue/arguments.h"
#include "python/glue/calls.h"

namespace dyop::python {

// No write from Python is lost silently. What a property gives is a part of its owner, so that
// writing changes the owner; or it cannot be written: a tuple, a read-only array, or a frozen
// record, whose fields refuse to be set.

/// The part of a record's holder that does not depend on its type.
struct FreezableHolder {
  bool is_frozen = false;
};

/// What owns a record that Python made or was given a copy of.
template <typename T>
class RecordHolder : public FreezableHolder {
 public:
  RecordHolder() = default;
  explicit RecordHolder(T* record) : record_(record) {}
  T* get() const { return record_.get(); }

 private:
  std::unique_ptr<T> record_;
};

/// Whether a record refuses writes. False for any other object.
bool is_frozen(py::handle record);
/// A value that no other object has, made such that writing into it is refused: lists as tuples,
/// arrays read-only, records frozen, and what is in them. Other objects as they are.
py::object sealed(py::object value);
/// To be called when everything is bound: properties that no Record has made give sealed values.
void seal_properties(py::module_& m);
/// Returned by a method that looks something up: a sealed record.
template <typename T>
struct LookedUp {
  T record;
};

}  // namespace dyop::python

namespace pybind11::detail {

template <typename T>
struct is_holder_type<T, dyop::python::RecordHolder<T>> : std::true_type {};

template <typename T>
struct type_caster<dyop::python::LookedUp<T>> {
  PYBIND11_TYPE_CASTER(dyop::python::LookedUp<T>, make_caster<T>::name);
  static handle cast(const dyop::python::LookedUp<T>& found, return_value_policy, handle) {
    return dyop::python::sealed(pybind11::cast(found.record)).release();
  }
};

}  // namespace pybind11::detail

namespace dyop::python {

/// A named member of a struct, reached through a pointer to the struct.
struct Field {
  std::string name;
  /// With an owner, an array or record within the record is that one itself, so that it can be
  /// changed; without, a sealed copy.
  py::object (*get)(const void* record, py::handle owner);
  void (*set)(void* record, py::handle value);
  std::string type = {};  // as the property's text begins
};
using FieldList = std::vector<Field>;

/// Adds what all records have beside their fields: `_fields`, `asdict()`, repr, comparison by value
/// and pickling.
/// @param pointer_of The struct within an instance.
void finish_record(const py::object& type, const FieldList& fields,
                   void* (*pointer_of)(py::handle));
/// Adds a field as a property; `doc` begins with its type, "float: ...".
void add_property(const py::object& type, const Field& field, const char* doc, bool is_writable,
                  void* (*pointer_of)(py::handle));
/// A repr of these properties for a class that is no record: "Name(a=1, b=2)".
void show_properties(const py::object& type, const std::vector<std::string>& names);
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

/// An array over a vector or matrix of `owner`, which it keeps alive.
template <typename Value>
py::array part_of_owner(const Value& value, py::handle owner) {
  constexpr py::ssize_t kRows = Value::RowsAtCompileTime;
  constexpr py::ssize_t kColumns = Value::ColsAtCompileTime;
  constexpr py::ssize_t kWidth = sizeof(double);
  static_assert(!Value::IsRowMajor);
  std::vector<py::ssize_t> shape{kRows};
  std::vector<py::ssize_t> strides{kWidth};
  if constexpr (kColumns > 1) {
    shape.push_back(kColumns);
    strides.push_back(kRows * kWidth);
  }
  return {py::dtype::of<double>(), shape, strides, value.data(), owner};
}

/// A member as a property gives it: see Field::get.
template <typename Value>
py::object member_of(const Value& value, py::handle owner) {
  if constexpr (kIsRecord<Value>) {
    if (owner) {
      return py::cast(&value, py::return_value_policy::reference_internal, owner);
    }
  }
  if constexpr (std::is_same_v<Value, Vector3> || std::is_same_v<Value, Matrix3>) {
    if (owner) return part_of_owner(value, owner);
  }
  if constexpr (std::is_same_v<Value, std::string>) {
    return readable(value);
  } else {
    return sealed(py::cast(value, py::return_value_policy::copy));
  }
}

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
    const std::string text = doc;
    fields.push_back({field.name, field.get, field.set, text.substr(0, text.find(':'))});
    add_property(type, fields.back(), doc, is_writable, &pointer_of);
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

  py::class_<T, RecordHolder<T>, Bases...> type;
  FieldList fields;

 private:
  static void* pointer_of(py::handle instance) { return instance.cast<T*>(); }

  template <auto kMember>
  Record& add(const char* name, const char* doc, bool is_writable) {
    using Value = typename MemberTraits<decltype(kMember)>::ValueType;
    return custom({name,
                   [](const void* record, py::handle owner) {
                     return member_of<Value>(static_cast<const T*>(record)->*kMember, owner);
                   },
                   [](void* record, py::handle value) {
                     static_cast<T*>(record)->*kMember = value_of<Value>(value);
                   }},
                  doc, is_writable);
  }
};

}  // namespace dyop::python
