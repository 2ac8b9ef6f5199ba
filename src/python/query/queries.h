// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include "dyop/chain/robot.h"
#include "dyop/core/error.h"
#include "dyop/distance/distance_result.h"
#include "dyop/toi/least_distance.h"
#include "dyop/toi/obstacle_set.h"
#include "dyop/toi/time_of_impact.h"
#include "dyop/toi/toi_result.h"
#include "python/glue/arguments.h"
#include "python/glue/calls.h"
#include "python/glue/record.h"

namespace dyop::python {

/// Options with the source of their stop token, which Python sees as `stop`.
template <typename Options>
struct Stoppable : Options {
  std::optional<std::stop_source> stop_source;
};
using PythonToiOptions = Stoppable<ToiOptions>;
using PythonLeastDistanceOptions = Stoppable<LeastDistanceOptions>;

/// The options, or the defaults for null.
template <typename Options>
Options options_or_default(const Stoppable<Options>* options) {
  return options != nullptr ? static_cast<const Options&>(*options) : Options();
}

/// A point in time of Python's time.monotonic(), in seconds.
std::chrono::steady_clock::time_point deadline_of(py::handle seconds);
py::object seconds_of(const std::optional<std::chrono::steady_clock::time_point>& deadline);

/// Adds the fields `deadline` and `stop`.
template <typename SomeRecord, typename Options>
void add_limits(SomeRecord& record, const Stoppable<Options>*) {
  using T = Stoppable<Options>;
  record.custom(
      {"deadline",
       [](const void* o, py::handle) { return seconds_of(static_cast<const T*>(o)->deadline); },
       [](void* o, py::handle value) {
         auto& deadline = static_cast<T*>(o)->deadline;
         if (value.is_none()) {
           deadline.reset();
         } else {
           deadline = deadline_of(value);
         }
       }},
      "Optional[float]: when to stop, in seconds of time.monotonic()");
  record.custom(
      {"stop",
       [](const void* o, py::handle) { return py::cast(static_cast<const T*>(o)->stop_source); },
       [](void* o, py::handle value) {
         auto* options = static_cast<T*>(o);
         options->stop_source = value.cast<std::optional<std::stop_source>>();
         options->stop =
             options->stop_source ? options->stop_source->get_token() : std::stop_token();
       }},
      "Optional[StopSource]: cancels the query");
}

/// A workspace that keeps alive what its last query was about, for resuming it.
struct PythonWorkspace {
  ToiWorkspace workspace;
  std::vector<std::shared_ptr<const void>> held;
};

inline constexpr std::int64_t kSlice = 50'000;  // node pairs: some ten milliseconds

/// Adds the work of a further slice of a query.
inline void add_work(ToiStatistics& sum, const ToiStatistics& slice) {
  sum.box_tests += slice.box_tests;
  sum.leaf_tests += slice.leaf_tests;
  sum.node_pairs += slice.node_pairs;
  sum.peak_queue = std::max(sum.peak_queue, slice.peak_queue);
}

/// Answers a query in slices of its budget and serves Ctrl-C between them. The result is the one of
/// the whole budget at once; what is interrupted can be resumed.
/// @param first  Starts the query under other options; `resume` goes on with it.
template <typename First, typename Resume>
ToiResult answer_in_slices(const ToiOptions& options, const First& first, const Resume& resume) {
  const py::gil_scoped_release unlocked;
  ToiOptions slice = options;
  slice.max_node_pairs = std::min(options.max_node_pairs, kSlice);
  ToiResult result = first(slice);
  ToiStatistics work = result.statistics;
  const auto is_over = [&] {
    return result.status != ToiStatus::BudgetExhausted ||
           work.node_pairs >= options.max_node_pairs ||
           (options.deadline && std::chrono::steady_clock::now() >= *options.deadline);
  };
  while (!is_over()) {
    {
      const py::gil_scoped_acquire lock;
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    }
    slice.max_node_pairs = std::min(options.max_node_pairs - work.node_pairs, kSlice);
    result = resume(slice);
    add_work(work, result.statistics);
  }
  result.statistics = work;
  return result;
}

/// Answers a query that cannot be resumed: within a slice of its budget in the calling thread, and
/// if that is not enough once more with all of it, while Ctrl-C is served. The result is the one of
/// the whole budget at once.
/// @param toi_of The ToiResult within a result.
template <typename Ask, typename ToiOf>
auto answer_or_start_over(ToiOptions options, const Ask& ask, const ToiOf& toi_of) {
  const std::int64_t budget = options.max_node_pairs;
  options.max_node_pairs = std::min(budget, kSlice);
  auto result = [&] {
    const py::gil_scoped_release unlocked;
    return ask(options);
  }();
  const bool is_late = options.deadline && std::chrono::steady_clock::now() >= *options.deadline;
  const bool is_undecided = toi_of(result).status == ToiStatus::BudgetExhausted;
  if (budget <= kSlice || is_late || !is_undecided) return result;
  options.max_node_pairs = budget;
  run_interruptible(options.stop, [&](const std::stop_token& stop) {
    options.stop = stop;
    result = ask(options);
  });
  return result;
}

/// A KinematicChain or a Robot, whose paths are those of its free coordinates.
struct ChainArgument {
  std::shared_ptr<const KinematicChain> chain;
  std::shared_ptr<const Robot> robot;  ///< none for a chain

  JointPath expand(const JointPath& path) const { return robot ? robot->expand(path) : path; }
};

/// Coordinates (K,); throws InvalidArgument.
JointVector coordinates_of(py::handle source);

}  // namespace dyop::python

namespace pybind11::detail {

template <>
struct type_caster<dyop::JointVector> {
  PYBIND11_TYPE_CASTER(dyop::JointVector, const_name("numpy.ndarray[(K,), float64]"));
  bool load(handle source, bool convert) {
    if (!convert) return false;
    value = dyop::python::coordinates_of(source);
    return true;
  }
  static handle cast(const dyop::JointVector& q, return_value_policy, handle) {
    return array_t<double>(q.size(), q.data()).release();
  }
};

template <>
struct type_caster<dyop::python::ChainArgument> {
  PYBIND11_TYPE_CASTER(dyop::python::ChainArgument, const_name("Union[KinematicChain, Robot]"));
  bool load(handle source, bool) {
    if (isinstance<dyop::Robot>(source)) {
      value.robot = source.cast<std::shared_ptr<dyop::Robot>>();
      value.chain = value.robot->chain;
      return true;
    }
    if (!isinstance<dyop::KinematicChain>(source)) return false;
    value.chain = source.cast<std::shared_ptr<dyop::KinematicChain>>();
    return true;
  }
};

}  // namespace pybind11::detail

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
            const auto number = value.cast<std::optional<std::uint64_t>>();
            id = number ? std::optional(ObstacleId(*number)) : std::nullopt;
          }};
}

/// The fields that a record has because it is a WitnessPair.
template <typename SomeRecord>
void add_witness_fields(SomeRecord& record) {
  record.template field<&WitnessPair::lower>("lower", "float: never above the distance")
      .template field<&WitnessPair::upper>("upper", "float: never below the distance")
      .template field<&WitnessPair::p_WCa>("p_WCa", "numpy.ndarray: (3,) witness point on A")
      .template field<&WitnessPair::p_WCb>("p_WCb", "numpy.ndarray: (3,) witness point on B")
      .template field<&WitnessPair::nhat_AB_W>("nhat_AB_W",
                                               "numpy.ndarray: (3,) unit normal from A to B")
      .template field<&WitnessPair::feature_a>("feature_a", "Feature: of A")
      .template field<&WitnessPair::feature_b>("feature_b", "Feature: of B")
      .template field<&WitnessPair::triangle_a>("triangle_a",
                                                "Optional[int]: if A, or its child, is a mesh")
      .template field<&WitnessPair::triangle_b>("triangle_b",
                                                "Optional[int]: if B, or its child, is a mesh")
      .template field<&WitnessPair::child_a>("child_a", "Optional[int]: if A is a compound")
      .template field<&WitnessPair::child_b>("child_b", "Optional[int]: if B is a compound");
  record.type.def(
      "pivot_W",
      [](py::handle self) {
        const py::object sum = self.attr("p_WCa").attr("__add__")(self.attr("p_WCb"));
        return sum.attr("__truediv__")(2.0);
      },
      "Dynamic pivot point (3,): the midpoint of the witness segment.");
}

}  // namespace dyop::python
