// SPDX-License-Identifier: BSD-3-Clause
#include <chrono>
#include <memory>

#include "dyop/core/error.h"
#include "dyop/io/query_record.h"
#include "dyop/io/result_text.h"
#include "dyop/toi/impact_derivatives.h"
#include "dyop/toi/least_distance.h"
#include "dyop/toi/separating_translation.h"
#include "dyop/toi/time_of_impact.h"
#include "python/bindings.h"
#include "python/glue/calls.h"
#include "python/query/queries.h"

namespace dyop::python {

std::chrono::steady_clock::time_point deadline_of(py::handle seconds) {
  using Clock = std::chrono::steady_clock;
  const auto value = read_as<double>(seconds, "deadline must be a time of time.monotonic()");
  // literal: beyond it the clock's count ends
  constexpr double kLongest = 1e9;
  DYOP_REQUIRE(value >= 0 && value <= kLongest, "deadline must be a time of time.monotonic(), not ",
               value);
  return Clock::time_point(
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(value)));
}

py::object seconds_of(const std::optional<std::chrono::steady_clock::time_point>& deadline) {
  if (!deadline) return py::none();
  return py::float_(std::chrono::duration<double>(deadline->time_since_epoch()).count());
}

namespace {

using ShapePointer = std::shared_ptr<const Shape>;
using MotionPointer = std::shared_ptr<const Motion>;

void bind_toi_results(py::module_& m) {
  py::enum_<ToiStatus>(m, "ToiStatus", "How a time-of-impact query ended; docs/concepts.md.")
      .value("NotRun", ToiStatus::NotRun)
      .value("Separated", ToiStatus::Separated, "No impact in the whole interval: proven.")
      .value("Impact", ToiStatus::Impact, "In contact at t_safe, and closing.")
      .value("InitiallyWithinTarget", ToiStatus::InitiallyWithinTarget, "Near at the start.")
      .value("BudgetExhausted", ToiStatus::BudgetExhausted, "Undecided after t_safe: not a miss.")
      .value("Cancelled", ToiStatus::Cancelled, "Undecided after t_safe: not a miss.")
      .value("NumericalLimit", ToiStatus::NumericalLimit, "Undecided after t_safe: not a miss.");
  Record<ToiStatistics>(m, "ToiStatistics", "Work of a time-of-impact query.")
      .field<&ToiStatistics::box_tests>("box_tests", "int: pairs of bounding boxes examined")
      .field<&ToiStatistics::leaf_tests>("leaf_tests", "int: pairs of triangles or convex pieces")
      .field<&ToiStatistics::node_pairs>("node_pairs", "int: what the budget counts")
      .field<&ToiStatistics::peak_queue>("peak_queue", "int: largest length of the queue")
      .finish();
  Record<ImpactContact, WitnessPair> contact(m, "ImpactContact",
                                             "The pair of pieces that ended a search.");
  add_witness_fields(contact);
  contact
      .field<&ImpactContact::closing_speed>("closing_speed",
                                            "float: -d/dt of the gap along the normal")
      .finish();
  Record<ToiResult> result(m, "ToiResult", "Result of time_of_impact(); see ToiStatus.");
  result.field<&ToiResult::status>("status", "ToiStatus: what is promised")
      .field<&ToiResult::t_safe>("t_safe", "float: proven apart until then")
      .field<&ToiResult::t_hit>("t_hit", "Optional[float]: a later time of being within target")
      .field<&ToiResult::contact>("contact", "Optional[ImpactContact]: that ended the search")
      .field<&ToiResult::contacts>("contacts",
                                   "tuple[WitnessPair, ...]: under with_contacts, at t_safe")
      .field<&ToiResult::X_WA>("X_WA", "RigidPose: at t_safe")
      .field<&ToiResult::X_WB>("X_WB", "RigidPose: at t_safe")
      .field<&ToiResult::rounding_allowance>("rounding_allowance", "float: length")
      .field<&ToiResult::statistics>("statistics", "ToiStatistics: work")
      .finish();
  result.type.def("__str__", [](const ToiResult& r) { return describe(r); });
}

void bind_toi_options(py::module_& m) {
  using Options = PythonToiOptions;
  Record<Options> options(m, "ToiOptions", "Options of time_of_impact().");
  options
      .option<&ToiOptions::target_distance>("target_distance",
                                            "float: gap that counts as touching; length, >= 0")
      .option<&ToiOptions::distance_tolerance>(
          "distance_tolerance",
          "Optional[float]: how much above the target an impact may be; default a millionth of the "
          "smaller bounding radius")
      .option<&ToiOptions::max_node_pairs>("max_node_pairs", "int: budget of work");
  add_limits(options, static_cast<const Options*>(nullptr));
  options
      .option<&ToiOptions::with_contacts>("with_contacts", "bool: gather all contacts of an impact")
      .option<&ToiOptions::solid_a>("solid_a", "bool: A is a solid, not a surface")
      .option<&ToiOptions::solid_b>("solid_b", "bool: B is a solid, not a surface")
      .finish();
  py::class_<PythonWorkspace>(m, "ToiWorkspace",
                              "Memory kept between queries; holds a query that can be resumed.")
      .def(py::init<>())
      .def(
          "can_resume", [](const PythonWorkspace& w) { return w.workspace.can_resume(); },
          "Whether the last query ended undecided and can be resumed.");
  m.def("default_distance_tolerance", &default_distance_tolerance, py::arg("a"), py::arg("b"),
        "The tolerance of a query of these shapes that names none, length.");
}

// Pointers are within optionals because pybind11 takes None for a pointer in a second attempt only.
ToiResult ask_toi(const ShapePointer& a, const MotionPointer& X_WA, const ShapePointer& b,
                  const MotionPointer& X_WB, const IntervalArgument& interval,
                  std::optional<PythonToiOptions*> options, std::optional<PythonWorkspace*> given) {
  std::optional<PythonWorkspace> own;
  PythonWorkspace& kept = given ? **given : own.emplace();
  if (given) kept.held = {a, X_WA, b, X_WB};
  const auto resume = [&](const ToiOptions& slice) {
    return resume_time_of_impact(*a, *X_WA, *b, *X_WB, interval.interval, slice, kept.workspace);
  };
  const auto start = [&](const ToiOptions& slice) {
    return time_of_impact(*a, *X_WA, *b, *X_WB, interval.interval, slice, kept.workspace);
  };
  return answer_in_slices(options_or_default(options.value_or(nullptr)), start, resume);
}

void bind_toi_query(py::module_& m) {
  m.def("time_of_impact", &ask_toi, py::arg("a").none(false), py::arg("X_WA").none(false),
        py::arg("b").none(false), py::arg("X_WB").none(false), py::arg("interval"),
        py::arg("options") = py::none(), py::arg("workspace") = py::none(),
        "When two moving shapes first come within target_distance, or a proof that they do not.\n"
        "Motions must be defined on interval, (begin, end).");
  m.def(
      "resume_time_of_impact",
      [](const ShapePointer& a, const MotionPointer& X_WA, const ShapePointer& b,
         const MotionPointer& X_WB, const IntervalArgument& interval,
         const PythonToiOptions* options, PythonWorkspace& kept) {
        const auto resume = [&](const ToiOptions& slice) {
          return resume_time_of_impact(*a, *X_WA, *b, *X_WB, interval.interval, slice,
                                       kept.workspace);
        };
        return answer_in_slices(options_or_default(options), resume, resume);
      },
      py::arg("a").none(false), py::arg("X_WA").none(false), py::arg("b").none(false),
      py::arg("X_WB").none(false), py::arg("interval"), py::arg("options"),
      py::arg("workspace").none(false),
      "Goes on with the last query of workspace, which ended in BudgetExhausted or Cancelled.");
}

void bind_least_distance(py::module_& m) {
  py::enum_<LeastDistanceStatus>(m, "LeastDistanceStatus", "How a least-distance query ended.")
      .value("NotRun", LeastDistanceStatus::NotRun)
      .value("Bounded", LeastDistanceStatus::Bounded)
      .value("FartherThanMaxDistance", LeastDistanceStatus::FartherThanMaxDistance)
      .value("BudgetExhausted", LeastDistanceStatus::BudgetExhausted)
      .value("Cancelled", LeastDistanceStatus::Cancelled)
      .value("NumericalLimit", LeastDistanceStatus::NumericalLimit);
  using Options = PythonLeastDistanceOptions;
  Record<Options> options(m, "LeastDistanceOptions", "Options of least_distance().");
  options
      .option<&LeastDistanceOptions::absolute_tolerance>("absolute_tolerance",
                                                         "float: length, >= 0")
      .option<&LeastDistanceOptions::relative_tolerance>("relative_tolerance",
                                                         "float: times upper, in [0, 1)")
      .option<&LeastDistanceOptions::max_distance>("max_distance", "float: length, >= 0")
      .option<&LeastDistanceOptions::solid_a>("solid_a", "bool: A is a solid")
      .option<&LeastDistanceOptions::solid_b>("solid_b", "bool: B is a solid")
      .option<&LeastDistanceOptions::max_node_pairs>("max_node_pairs", "int: budget of work");
  add_limits(options, static_cast<const Options*>(nullptr));
  options.finish();
  Record<LeastDistanceResult>(m, "LeastDistanceResult", "Result of least_distance().")
      .field<&LeastDistanceResult::status>("status", "LeastDistanceStatus: how it ended")
      .field<&LeastDistanceResult::lower>("lower", "float: never above the least distance")
      .field<&LeastDistanceResult::upper>("upper", "float: never below it")
      .field<&LeastDistanceResult::t_upper>("t_upper", "float: time of the nearest approach")
      .field<&LeastDistanceResult::nearest>("nearest", "DistanceResult: at t_upper")
      .field<&LeastDistanceResult::X_WA>("X_WA", "RigidPose: at t_upper")
      .field<&LeastDistanceResult::X_WB>("X_WB", "RigidPose: at t_upper")
      .field<&LeastDistanceResult::rounding_allowance>("rounding_allowance", "float: length")
      .field<&LeastDistanceResult::distance_queries>("distance_queries", "int: at single times")
      .field<&LeastDistanceResult::statistics>("statistics", "ToiStatistics: of the proof")
      .finish();
  m.def(
      "least_distance",
      [](const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
         const IntervalArgument& interval, const Options* given) {
        LeastDistanceOptions used = options_or_default(given);
        LeastDistanceResult result;
        run_interruptible(used.stop, [&](const std::stop_token& stop) {
          used.stop = stop;
          result = least_distance(a, X_WA, b, X_WB, interval.interval, used);
        });
        return result;
      },
      py::arg("a"), py::arg("X_WA"), py::arg("b"), py::arg("X_WB"), py::arg("interval"),
      py::arg("options") = py::none(),
      "The least distance of two moving shapes over an interval (begin, end), with proven bounds\n"
      "and the time of nearest approach.");
}

void bind_impact_derivatives(py::module_& m) {
  Record<ImpactDerivatives>(m, "ImpactDerivatives", "Result of impact_derivatives().")
      .field<&ImpactDerivatives::status>("status", "DerivativeStatus: whether to use them")
      .field<&ImpactDerivatives::by_a>("by_a", "PoseGradient: of the time, by A's pose then")
      .field<&ImpactDerivatives::by_b>("by_b", "PoseGradient: of the time, by B's pose then")
      .field<&ImpactDerivatives::closing_speed>("closing_speed", "float: length per time")
      .field<&ImpactDerivatives::error>("error", "float: of the gradients, relative, proven")
      .field<&ImpactDerivatives::distance>("distance", "DistanceDerivatives: at the impact")
      .finish();
  m.def(
      "impact_derivatives",
      [](const Shape& a, const Motion& X_WA, const Shape& b, const Motion& X_WB,
         const ToiResult& impact, Scalar tolerance, Scalar grazing_fraction) {
        return impact_derivatives(a, X_WA, b, X_WB, impact, {tolerance, grazing_fraction});
      },
      py::arg("a"), py::arg("X_WA"), py::arg("b"), py::arg("X_WB"), py::arg("impact"),
      py::arg("tolerance") = ImpactDerivativeOptions().tolerance,
      py::arg("grazing_fraction") = ImpactDerivativeOptions().grazing_fraction,
      "The derivatives of the time of an impact that time_of_impact() found, by both poses at "
      "that\n"
      "time; flagged where features tie or the bodies graze each other.");
}

void bind_separation(py::module_& m) {
  Record<SeparationOptions>(m, "SeparationOptions", "Options of separating_translation().")
      .option<&SeparationOptions::directions>("directions", "int: tried first, in [1, 10000]")
      .option<&SeparationOptions::tolerance>("tolerance",
                                             "Optional[float]: of the depth, length > 0")
      .finish();
  m.def(
      "separating_translation",
      [](const Shape& a, const PoseArgument& X_WA, const Shape& b, const PoseArgument& X_WB,
         const SeparationOptions* options) {
        const SeparationOptions used = options != nullptr ? *options : SeparationOptions();
        const py::gil_scoped_release unlocked;
        return separating_translation(a, X_WA.X, b, X_WB.X, used);
      },
      py::arg("a"), py::arg("X_WA"), py::arg("b"), py::arg("X_WB"), py::arg("options") = py::none(),
      "How far and along which direction B can be moved so that two overlapping shapes of any "
      "kind\n"
      "come apart, proven; None if they do not overlap. Closed meshes are solids.");
}

}  // namespace

void bind_toi(py::module_& m) {
  bind_toi_results(m);
  bind_toi_options(m);
  bind_toi_query(m);
  bind_least_distance(m);
  bind_impact_derivatives(m);
  bind_separation(m);
}

}  // namespace dyop::python
