// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "dyop/core/error.h"
#include "dyop/toi/obstacle_set.h"
#include "python/glue/callback.h"
#include "python/glue/record.h"

namespace dyop::python {

/// Queries run without the interpreter's lock: the set must not change meanwhile.
struct SharedObstacleSet {
  ObstacleSet set;
  int readers = 0;  // under the lock

  ObstacleSet& change() {
    DYOP_REQUIRE(readers == 0, "the obstacle set is being read by ", readers, " queries");
    return set;
  }
  template <typename Query>
  auto read(const Query& query) {
    struct Guard {
      int& readers;
      explicit Guard(int& count) : readers(count) { ++readers; }
      ~Guard() { --readers; }
    };
    const Guard guard(readers);
    return query(static_cast<const ObstacleSet&>(set));
  }
};

inline ObstacleFilter make_filter(std::uint32_t groups, const py::object& accepts) {
  ObstacleFilter filter;
  filter.groups = groups;
  if (!accepts.is_none()) {
    filter.accepts = [call = BoolFunction{SharedObject(accepts)}](ObstacleId id) {
      return call(std::uint64_t(id));
    };
  }
  return filter;
}

/// The id of an obstacle as a field of a record: a plain integer in Python.
template <typename T>
Field id_field() {
  return {"obstacle",
          [](const void* r, py::handle) {
            const auto& id = static_cast<const T*>(r)->obstacle;
            return id ? py::object(py::int_(std::uint64_t(*id))) : py::object(py::none());
          },
          [](void* r, py::handle value) {
            auto& id = static_cast<T*>(r)->obstacle;
            id.reset();
            if (!value.is_none()) id = ObstacleId(value.cast<std::uint64_t>());
          }};
}

}  // namespace dyop::python
