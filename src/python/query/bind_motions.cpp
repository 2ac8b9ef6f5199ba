// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <memory>

#include "dyop/core/error.h"
#include "dyop/io/motion_file.h"
#include "dyop/motion/bezier_motion.h"
#include "dyop/motion/check_motion.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/motion.h"
#include "dyop/motion/sampled_motion.h"
#include "dyop/motion/steady_motions.h"
#include "python/bindings.h"
#include "python/glue/calls.h"
#include "python/glue/record.h"

namespace dyop::python {

namespace {

// A TwistBound or four numbers.
TwistBound bound_of(const py::object& value) {
  if (py::isinstance<TwistBound>(value)) return value.cast<TwistBound>();
  const auto numbers =
      read_as<std::array<Scalar, 4>>(value, "twist_bound must return a TwistBound or four numbers");
  return {numbers[0], numbers[1], numbers[2], numbers[3]};
}

}  // namespace

/// A UserMotion that knows its Python functions, so that it can be pickled.
class PythonMotion final : public Motion {
 public:
  /// pose, twist, twist_bound, smooth_until (or None).
  using Functions = std::array<SharedObject, 4>;

  PythonMotion(const Functions& functions, const TimeInterval& domain)
      : functions_(functions), motion_(make(functions), domain) {}

  RigidPose pose(Scalar t) const override { return motion_.pose(t); }
  Twist twist(Scalar t) const override { return motion_.twist(t); }
  TwistBound twist_bound(const TimeInterval& interval) const override {
    return motion_.twist_bound(interval);
  }
  TimeInterval domain() const override { return motion_.domain(); }
  Scalar smooth_until(Scalar t) const override { return motion_.smooth_until(t); }

  const Functions& functions() const { return functions_; }

 private:
  static UserMotion::Functions make(const Functions& functions) {
    UserMotion::Functions made;
    made.pose = PoseFunction{functions[0]};
    made.twist = TwistFunction{functions[1]};
    made.twist_bound = PythonFunction<&bound_of>{functions[2]};
    if (!functions[3].get().is_none()) made.smooth_until = ScalarFunction{functions[3]};
    return made;
  }

  Functions functions_;
  UserMotion motion_;
};

namespace {

using SharedMotion = std::shared_ptr<Motion>;

// Of what a class of Python answers, only what proofs may rest on goes on; NaN does not.

MotionStretch checked(const MotionStretch& stretch, Scalar after) {
  DYOP_REQUIRE(stretch.end > after, "a stretch of a motion must end after ", after, ", not at ",
               stretch.end);
  DYOP_REQUIRE(stretch.twist.v_WB.allFinite() && stretch.twist.w_WB.allFinite(),
               "the twist of a stretch must be finite: v_WB ", stretch.twist.v_WB.transpose(),
               ", w_WB ", stretch.twist.w_WB.transpose());
  DYOP_REQUIRE(stretch.linear_acceleration >= 0 && stretch.angular_acceleration >= 0 &&
                   stretch.linear_deviation >= 0 && stretch.angular_deviation >= 0,
               "bounds of a stretch must not be negative or NaN: linear acceleration ",
               stretch.linear_acceleration, ", angular acceleration ", stretch.angular_acceleration,
               ", linear deviation ", stretch.linear_deviation, ", angular deviation ",
               stretch.angular_deviation);
  return stretch;
}

PoseScale scale_of(const py::object& value) {
  const auto scale = read_as<PoseScale>(value, "pose_scale must return a PoseScale");
  DYOP_REQUIRE(scale.length >= 0 && scale.angle >= 0,
               "pose_scale of a motion must not be negative or NaN: length ", scale.length,
               ", angle ", scale.angle);
  return scale;
}

/// The C++ part of an object whose class derives from Motion in Python.
class DerivedMotion final : public Motion, public DerivedInPython {
 public:
  RigidPose pose(Scalar t) const override {
    const py::gil_scoped_acquire lock;
    return pose_of(required_method<Motion>(this, "pose")(t));
  }
  Twist twist(Scalar t) const override {
    const py::gil_scoped_acquire lock;
    return twist_of(required_method<Motion>(this, "twist")(t));
  }
  TwistBound twist_bound(const TimeInterval& interval) const override {
    const py::gil_scoped_acquire lock;
    const TwistBound bound = bound_of(required_method<Motion>(this, "twist_bound")(interval));
    require_valid(bound, interval, "twist_bound of a motion");
    return bound;
  }
  MotionState state(Scalar t) const override {
    const py::gil_scoped_acquire lock;
    const py::function method = method_of<Motion>(this, "state");
    return method ? state_of(method(t)) : Motion::state(t);
  }
  PoseScale pose_scale(const TimeInterval& interval) const override {
    const py::gil_scoped_acquire lock;
    const py::function method = method_of<Motion>(this, "pose_scale");
    return method ? scale_of(method(interval)) : Motion::pose_scale(interval);
  }
  TimeInterval domain() const override {
    const py::gil_scoped_acquire lock;
    const py::function method = method_of<Motion>(this, "domain");
    return method ? interval_of(method()) : Motion::domain();
  }
  Scalar smooth_until(Scalar t) const override {
    const py::gil_scoped_acquire lock;
    const py::function method = method_of<Motion>(this, "smooth_until");
    if (!method) return Motion::smooth_until(t);
    const Scalar until = read_scalar(method(t));
    DYOP_REQUIRE(until > t, "smooth_until of a motion must be after ", t, ", not ", until);
    return until;
  }
  std::optional<MotionStretch> stretch(Scalar t, Scalar after) const override {
    const py::gil_scoped_acquire lock;
    const py::function method = method_of<Motion>(this, "stretch");
    if (!method) return Motion::stretch(t, after);
    const py::object answer = method(t, after);
    if (answer.is_none()) return std::nullopt;
    return checked(read_as<MotionStretch>(answer, "stretch must return a MotionStretch or None"),
                   after);
  }
};

void bind_motion_records(py::module_& m) {
  Record<Twist>(m, "Twist", "Velocity of a body B in world W.")
      .option<&Twist::v_WB>("v_WB", "numpy.ndarray: (3,) of the body's origin, length per time")
      .option<&Twist::w_WB>("w_WB", "numpy.ndarray: (3,) angular, radians per time")
      .finish();
  Record<TwistBound>(m, "TwistBound", "Upper bounds that hold at every time of an interval.")
      .option<&TwistBound::linear_speed>("linear_speed", "float: length per time")
      .option<&TwistBound::angular_speed>("angular_speed", "float: radians per time")
      .option<&TwistBound::linear_acceleration>("linear_acceleration",
                                                "float: length per time squared")
      .option<&TwistBound::angular_acceleration>("angular_acceleration",
                                                 "float: radians per time squared")
      .finish();
  Record<MotionState>(m, "MotionState", "Pose and velocity of a body at one time.")
      .option<&MotionState::X_WB>("X_WB", "RigidPose: of the body")
      .option<&MotionState::twist>("twist", "Twist: of the body")
      .finish();
  Record<PoseScale>(m, "PoseScale", "How large the numbers are that poses are computed from.")
      .option<&PoseScale::length>("length", "float: the largest length")
      .option<&PoseScale::angle>("angle", "float: 1 plus the angles, radians")
      .finish();
  using Stretch = MotionStretch;
  Record<Stretch>(
      m, "MotionStretch",
      "From a time t on, the motion stays near one whose twist does not jump and whose\n"
      "pose at t is the same: how far at most.")
      .option<&Stretch::end>("end", "float: time until which this holds")
      .option<&Stretch::twist>("twist", "Twist: of the motion nearby, at t")
      .option<&Stretch::linear_acceleration>("linear_acceleration",
                                             "float: bounds how its twist changes")
      .option<&Stretch::angular_acceleration>("angular_acceleration", "float: the same")
      .option<&Stretch::linear_deviation>("linear_deviation", "float: between origins, length")
      .option<&Stretch::angular_deviation>("angular_deviation", "float: per length, at most 2")
      .finish();
}

void bind_motion_base(py::module_& m) {
  py::class_<Motion, DerivedMotion, SharedMotion>(
      m, "Motion",
      "A pose as a function of time, with bounds on how its twist changes. Immutable and shared.\n"
      "A class of yours may derive from it: pose(t), twist(t) and twist_bound(interval), as for a\n"
      "UserMotion, and where they differ domain(), smooth_until(t), state(t), "
      "pose_scale(interval)\n"
      "and stretch(t, after). Slow likewise.")
      .def(py::init_alias<>(), "For classes that derive from it.")
      .def(py::pickle(
          [](const py::object& self) {
            return py::make_tuple(py::getattr(self, "__dict__", py::dict()));
          },
          [](const py::tuple& state) {
            return std::make_pair(static_cast<Motion*>(new DerivedMotion()),
                                  state[0].cast<py::dict>());
          }))
      .def("pose", &Motion::pose, py::arg("t"), "X_WB at time t.")
      .def("twist", &Motion::twist, py::arg("t"), "Twist at time t.")
      .def("state", &Motion::state, py::arg("t"), "Pose and twist at time t.")
      .def(
          "twist_bound",
          [](const Motion& motion, const IntervalArgument& interval) {
            return motion.twist_bound(interval.interval);
          },
          py::arg("interval"), "Bounds over (begin, end).")
      .def("domain", &Motion::domain, "Where the motion is defined.")
      .def("__repr__",
           [](const py::object& self) {
             return std::string(py::str(py::type::of(self).attr("__name__"))) +
                    "(domain=" + std::string(py::repr(self.attr("domain")())) + ")";
           })
      .def("smooth_until", &Motion::smooth_until, py::arg("t"),
           "A time after t until which the twist does not jump.")
      .def(
          "pose_scale",
          [](const Motion& motion, const IntervalArgument& interval) {
            return motion.pose_scale(interval.interval);
          },
          py::arg("interval"), "The PoseScale over (begin, end): for the rounding of poses.")
      .def(
          "stretch", &Motion::stretch, py::arg("t"), py::arg("after"),
          "A MotionStretch from t until later than `after`, a time not before smooth_until(t), by\n"
          "which queries pass many jumps at once; None if none is known.");
  py::class_<RestMotion, Motion, std::shared_ptr<RestMotion>>(m, "RestMotion",
                                                              "A body that does not move.")
      .def(py::init([](const PoseArgument& X_WB) { return std::make_shared<RestMotion>(X_WB.X); }),
           py::arg("X_WB") = RigidPose(), "Its pose.")
      .def("__repr__",
           [](const RestMotion& motion) {
             return "RestMotion(" + std::string(py::repr(py::cast(motion.pose(0)))) + ")";
           })
      .def("__reduce__", [](const py::object& self) {
        return py::make_tuple(py::type::of(self), py::make_tuple(self.attr("pose")(0.0)));
      });
}

void bind_steady_motions(py::module_& m) {
  using Screw = ScrewMotion::Screw;
  py::class_<ConstantTwistMotion, Motion, std::shared_ptr<ConstantTwistMotion>>(
      m, "ConstantTwistMotion",
      "The origin moves on a straight line while the body turns about it, both at constant rates.")
      .def(py::init([](const PoseArgument& X, const TwistArgument& twist, Scalar t0) {
             return std::make_shared<ConstantTwistMotion>(X.X, twist.twist, t0);
           }),
           py::arg("X_WB0"), py::arg("twist_WB"), py::arg("t0") = 0.0,
           "Pose at time t0, and twist: a Twist or a pair (v, w) of (3,), length and radians per\n"
           "time, in world.")
      .def_property_readonly("X_WB0", &ConstantTwistMotion::X_WB0, "RigidPose: at time t0")
      .def_property_readonly("t0", &ConstantTwistMotion::t0, "float: time")
      .def(
          "pose_change",
          [](const ConstantTwistMotion& self, Scalar t, const TwistArgument& initial,
             const TwistArgument& rate) { return self.pose_change(t, initial.twist, rate.twist); },
          py::arg("t"), py::arg("initial"), py::arg("rate"),
          "How the pose at time t changes, as a twist (v, w), if X_WB0 changes by `initial` and "
          "the\n"
          "twist of the motion by `rate`.")
      .def("__reduce__", [](const py::object& self) {
        return py::make_tuple(
            py::type::of(self),
            py::make_tuple(self.attr("X_WB0"), self.attr("twist")(0.0), self.attr("t0")));
      });
  py::class_<ScrewMotion, Motion, std::shared_ptr<ScrewMotion>>(
      m, "ScrewMotion", "The body turns about a fixed line of the world and slides along it.")
      .def(py::init([](const PoseArgument& X, const Vector3& point, const Vector3& axis,
                       Scalar turn_rate, Scalar slide_rate, Scalar t0) {
             return std::make_shared<ScrewMotion>(X.X, Screw{point, axis, turn_rate, slide_rate},
                                                  t0);
           }),
           py::arg("X_WB0"), py::arg("p_WA") = Vector3(Vector3::Zero()),
           py::arg("axis_W") = Vector3(Vector3::UnitZ()), py::arg("turn_rate") = 0.0,
           py::arg("slide_rate") = 0.0, py::arg("t0") = 0.0,
           "Pose at time t0; a point (3,) and the direction (3,) of the axis; radians and length\n"
           "per time.")
      .def_property_readonly("X_WB0", &ScrewMotion::X_WB0, "RigidPose: at time t0")
      .def_property_readonly(
          "p_WA", [](const ScrewMotion& s) { return s.screw().p_WA; },
          "numpy.ndarray: (3,) a point of the axis")
      .def_property_readonly(
          "axis_W", [](const ScrewMotion& s) { return s.screw().axis_W; },
          "numpy.ndarray: (3,) direction of the axis")
      .def_property_readonly(
          "turn_rate", [](const ScrewMotion& s) { return s.screw().turn_rate; },
          "float: radians per time")
      .def_property_readonly(
          "slide_rate", [](const ScrewMotion& s) { return s.screw().slide_rate; },
          "float: length per time")
      .def_property_readonly("t0", &ScrewMotion::t0, "float: time")
      .def("__reduce__", [](const py::object& self) {
        const ScrewMotion& s = self.cast<const ScrewMotion&>();
        return py::make_tuple(py::type::of(self),
                              py::make_tuple(s.X_WB0(), s.screw().p_WA, s.screw().axis_W,
                                             s.screw().turn_rate, s.screw().slide_rate, s.t0()));
      });
}

// A motion within another one, which it keeps alive.
SharedMotion part_of(const std::shared_ptr<ComposedMotion>& whole, const Motion& part) {
  return {whole, const_cast<Motion*>(&part)};
}

void bind_compositions(py::module_& m) {
  using ConstMotion = std::shared_ptr<const Motion>;
  py::class_<ComposedMotion, Motion, std::shared_ptr<ComposedMotion>>(
      m, "ComposedMotion", "A body that moves relative to a moving frame: X_WB = X_WM X_MB.")
      .def(py::init<ConstMotion, ConstMotion>(), py::arg("X_WM").none(false),
           py::arg("X_MB").none(false), "The frame's motion in world, and the body's in the frame.")
      .def(
          "outer", [](const std::shared_ptr<ComposedMotion>& c) { return part_of(c, c->outer()); },
          "X_WM.")
      .def(
          "inner", [](const std::shared_ptr<ComposedMotion>& c) { return part_of(c, c->inner()); },
          "X_MB.")
      .def("__reduce__", [](const py::object& self) {
        return py::make_tuple(py::type::of(self),
                              py::make_tuple(self.attr("outer")(), self.attr("inner")()));
      });
  using Part = std::pair<IntervalArgument, ConstMotion>;
  py::class_<SequenceMotion, Motion, std::shared_ptr<SequenceMotion>>(m, "SequenceMotion",
                                                                      "Motions one after another.")
      .def(py::init([](const std::vector<Part>& parts) {
             std::vector<SequenceMotion::Part> list;
             for (const auto& [interval, motion] : parts) {
               list.push_back({interval.interval, motion});
             }
             return std::make_shared<SequenceMotion>(std::move(list));
           }),
           py::arg("parts"), "Pairs (interval, motion); each starts where the one before it ends.")
      .def_property_readonly(
          "parts",
          [](const SequenceMotion& sequence) {
            py::list list;
            for (const SequenceMotion::Part& part : sequence.parts()) {
              list.append(
                  py::make_tuple(part.interval, std::const_pointer_cast<Motion>(part.motion)));
            }
            return list;
          },
          "tuple[tuple[TimeInterval, Motion], ...]: in order of time")
      .def("__reduce__", [](const py::object& self) {
        return py::make_tuple(py::type::of(self), py::make_tuple(self.attr("parts")));
      });
}

void require_function(const py::object& value, const char* name) {
  if (PyCallable_Check(value.ptr()) != 0) return;
  throw py::type_error("UserMotion: " + std::string(name) +
                       " must be a function, not a value of type " +
                       std::string(py::str(py::type::of(value).attr("__name__"))));
}

void bind_user_motion(py::module_& m) {
  py::class_<PythonMotion, Motion, std::shared_ptr<PythonMotion>>(
      m, "UserMotion",
      "A motion made of Python functions. Slow: each call takes the interpreter's lock. Proofs "
      "are\n"
      "only as good as twist_bound; check_motion() looks for mistakes.")
      .def(py::init([](const py::object& pose, const py::object& twist,
                       const py::object& twist_bound, const py::object& smooth_until,
                       const IntervalArgument& domain) {
             require_function(pose, "pose");
             require_function(twist, "twist");
             require_function(twist_bound, "twist_bound");
             if (!smooth_until.is_none()) require_function(smooth_until, "smooth_until");
             const PythonMotion::Functions functions{SharedObject(pose), SharedObject(twist),
                                                     SharedObject(twist_bound),
                                                     SharedObject(smooth_until)};
             return std::make_shared<PythonMotion>(functions, domain.interval);
           }),
           py::arg("pose"), py::arg("twist"), py::arg("twist_bound"),
           py::arg("smooth_until") = py::none(),
           py::arg("domain") = py::make_tuple(-kInfinity, kInfinity),
           "pose(t) gives a pose, twist(t) a Twist or (v, w), twist_bound(interval) a TwistBound "
           "or\n"
           "four numbers, smooth_until(t) a time after t. Called from several threads.")
      .def("__reduce__", [](const py::object& self) {
        const auto& motion = self.cast<const PythonMotion&>();
        const auto& f = motion.functions();
        return py::make_tuple(py::type::of(self), py::make_tuple(f[0].get(), f[1].get(), f[2].get(),
                                                                 f[3].get(), motion.domain()));
      });
}

void bind_check(py::module_& m) {
  py::enum_<MotionFault>(m, "MotionFault", "The promise of Motion that a motion breaks.")
      .value("Domain", MotionFault::Domain)
      .value("Refused", MotionFault::Refused)
      .value("PoseNotFinite", MotionFault::PoseNotFinite)
      .value("PoseNotRotation", MotionFault::PoseNotRotation)
      .value("TwistNotFinite", MotionFault::TwistNotFinite)
      .value("StateDiffers", MotionFault::StateDiffers)
      .value("BoundNotValid", MotionFault::BoundNotValid)
      .value("SmoothUntil", MotionFault::SmoothUntil)
      .value("Jump", MotionFault::Jump)
      .value("TwistNotDerivative", MotionFault::TwistNotDerivative)
      .value("SpeedAboveBound", MotionFault::SpeedAboveBound)
      .value("AccelerationAboveBound", MotionFault::AccelerationAboveBound)
      .value("StretchExceeded", MotionFault::StretchExceeded);
  Record<MotionCheck>(m, "MotionCheck", "Result of check_motion().")
      .field<&MotionCheck::fault>("fault", "Optional[MotionFault]: None: nothing wrong was found")
      .field<&MotionCheck::t>("t", "float: when")
      .field<&MotionCheck::found>("found", "float: the wrong value, in the unit of the promise")
      .field<&MotionCheck::allowed>("allowed", "float: the largest value allowed")
      .field<&MotionCheck::message>("message", "str: in words; empty if there is no fault")
      .finish();
  m.def(
      "check_motion",
      [](const Motion& motion, const IntervalArgument& interval, int sample_count,
         std::uint64_t seed) {
        const py::gil_scoped_release unlocked;
        return check_motion(motion, interval.interval, {sample_count, seed});
      },
      py::arg("motion"), py::arg("interval"), py::kw_only(), py::arg("sample_count") = 1000,
      py::arg("seed") = 1,
      "Samples a motion over (begin, end) and names the first promise of Motion that it breaks.");
}

}  // namespace

void bind_motions(py::module_& m) {
  bind_motion_records(m);
  bind_motion_base(m);
  bind_steady_motions(m);
  bind_compositions(m);
  bind_user_motion(m);
  bind_check(m);
}

namespace {

using Node = InterpolatedMotion::Node;

// Columns of an (N, 6) array: positions and rotation vectors.
std::vector<ControlPoint> control_points_of(py::handle source) {
  const auto rows = rows_of(source, 6, "control_points", CopyRule::IfNeeded);
  std::vector<ControlPoint> points;
  for (py::ssize_t i = 0; i < rows.shape(0); ++i) {
    const double* row = rows.data() + 6 * i;
    points.push_back({Vector3(row), Vector3(row + 3)});
  }
  return points;
}

py::array_t<double> control_rows(std::span<const ControlPoint> points) {
  py::array_t<double> rows({py::ssize_t(points.size()), py::ssize_t{6}});
  double* row = rows.mutable_data();
  for (const ControlPoint& point : points) {
    row = std::copy_n(point.p_WB.data(), 3, row);
    row = std::copy_n(point.theta.data(), 3, row);
  }
  return rows;
}

void bind_interpolated(py::module_& m) {
  py::enum_<RotationPath>(m, "RotationPath", "How a body turns between two orientations.")
      .value("Slerp", RotationPath::Slerp, "Constant angular velocity along the shortest arc.")
      .value("RotationVector", RotationPath::RotationVector, "Linear rotation vector.");
  Record<Node>(m, "InterpolationNode", "An end of a path of rotation vectors relative to C.")
      .option<&Node::p_WB>("p_WB", "numpy.ndarray: (3,) position, length")
      .option<&Node::theta>("theta", "numpy.ndarray: (3,) R_WB = R_WC exp(theta), radians")
      .finish();
  py::class_<InterpolatedMotion, Motion, std::shared_ptr<InterpolatedMotion>>(
      m, "InterpolatedMotion", "Between two poses: the origin moves linearly.")
      .def(py::init([](const IntervalArgument& interval, const PoseArgument& begin,
                       const PoseArgument& end, RotationPath path) {
             return std::make_shared<InterpolatedMotion>(interval.interval, begin.X, end.X, path);
           }),
           py::arg("interval"), py::arg("X_WB0"), py::arg("X_WB1"),
           py::arg("path") = RotationPath::Slerp,
           "Poses at both ends of the interval (begin, end).")
      .def_static(
          "from_chart",
          [](const IntervalArgument& interval, const PoseArgument& X_WC, const Node& begin,
             const Node& end) {
            return std::make_shared<InterpolatedMotion>(
                InterpolatedMotion::from_chart(interval.interval, X_WC.X, begin, end));
          },
          py::arg("interval"), py::arg("X_WC"), py::arg("begin"), py::arg("end"),
          "Linear in the rotation vector relative to the rotation of X_WC.")
      .def("X_WC", &InterpolatedMotion::X_WC, "Frame of the rotation vectors.")
      .def("begin", &InterpolatedMotion::begin, "Start of the path.")
      .def("end", &InterpolatedMotion::end, "End of the path.")
      .def(py::pickle(
          [](const InterpolatedMotion& motion) {
            return py::make_tuple(motion.domain(), motion.X_WC(), motion.begin(), motion.end());
          },
          [](const py::tuple& state) {
            return std::make_shared<InterpolatedMotion>(
                InterpolatedMotion::from_chart(interval_of(state[0]), pose_of(state[1]),
                                               state[2].cast<Node>(), state[3].cast<Node>()));
          }));
}

void bind_hermite(py::module_& m) {
  Record<HermiteNode>(m, "HermiteNode", "One end of a cubic in the chart R_WC exp(theta).")
      .option<&HermiteNode::p_WB>("p_WB", "numpy.ndarray: (3,) position, length")
      .option<&HermiteNode::v_WB>("v_WB", "numpy.ndarray: (3,) its velocity")
      .option<&HermiteNode::theta>("theta", "numpy.ndarray: (3,) rotation vector, radians")
      .option<&HermiteNode::theta_rate>("theta_rate", "numpy.ndarray: (3,) d theta / dt")
      .finish();
  py::class_<HermiteMotion, Motion, std::shared_ptr<HermiteMotion>>(
      m, "HermiteMotion", "Cubics in position and rotation vector.")
      .def(py::init([](const IntervalArgument& interval, const StateArgument& begin,
                       const StateArgument& end) {
             return std::make_shared<HermiteMotion>(interval.interval, begin.state, end.state);
           }),
           py::arg("interval"), py::arg("begin"), py::arg("end"),
           "Through two states: a MotionState or a pair (pose, twist).")
      .def_static(
          "from_chart",
          [](const IntervalArgument& interval, const PoseArgument& X_WC, const HermiteNode& begin,
             const HermiteNode& end) {
            return std::make_shared<HermiteMotion>(
                HermiteMotion::from_chart(interval.interval, X_WC.X, begin, end));
          },
          py::arg("interval"), py::arg("X_WC"), py::arg("begin"), py::arg("end"),
          "From data in a chart.")
      .def("X_WC", &HermiteMotion::X_WC, "Frame of the rotation vectors.")
      .def("begin", &HermiteMotion::begin, "Start of the cubics.")
      .def("end", &HermiteMotion::end, "End of the cubics.")
      .def(py::pickle(
          [](const HermiteMotion& motion) {
            return py::make_tuple(motion.domain(), motion.X_WC(), motion.begin(), motion.end());
          },
          [](const py::tuple& state) {
            return std::make_shared<HermiteMotion>(HermiteMotion::from_chart(
                interval_of(state[0]), pose_of(state[1]), state[2].cast<HermiteNode>(),
                state[3].cast<HermiteNode>()));
          }));
}

void bind_bezier(py::module_& m) {
  py::class_<BezierMotion, Motion, std::shared_ptr<BezierMotion>>(
      m, "BezierMotion", "Bezier curves in position and rotation vector.")
      .def(py::init([](const IntervalArgument& interval, const PoseArgument& X_WC,
                       const py::object& control_points) {
             return std::make_shared<BezierMotion>(interval.interval, X_WC.X,
                                                   control_points_of(control_points));
           }),
           py::arg("interval"), py::arg("X_WC"), py::arg("control_points"),
           "control_points (N, 6), N from 2 to 10: positions, length, and rotation vectors "
           "relative\n"
           "to the rotation of X_WC, radians.")
      .def("X_WC", &BezierMotion::X_WC, "Frame of the rotation vectors.")
      .def_property_readonly(
          "control_points", [](const BezierMotion& b) { return control_rows(b.control_points()); },
          "numpy.ndarray: (N, 6)")
      .def("__reduce__", [](const py::object& self) {
        return py::make_tuple(py::type::of(self),
                              py::make_tuple(self.attr("domain")(), self.attr("X_WC")(),
                                             self.attr("control_points")));
      });
  m.def(
      "bspline_motion",
      [](std::size_t degree, const std::vector<Scalar>& knots, const PoseArgument& X_WC,
         const py::object& control_points) {
        return std::make_shared<SequenceMotion>(
            bspline_motion(degree, knots, X_WC.X.rotation(), control_points_of(control_points)));
      },
      py::arg("degree"), py::arg("knots"), py::arg("X_WC"), py::arg("control_points"),
      "A B-spline as the Bezier curves of its knot spans: N + degree + 1 knots (times), and\n"
      "control_points (N, 6) as for BezierMotion.");
}

std::vector<SampledMotion::Sample> samples_of(const std::vector<Scalar>& times,
                                              const py::object& poses) {
  const PoseList list = poses_of(poses, "poses");
  DYOP_REQUIRE(!list.is_single && list.poses.size() == times.size(), "there are ", times.size(),
               " times but ", list.poses.size(), " poses");
  std::vector<SampledMotion::Sample> samples;
  for (std::size_t i = 0; i < times.size(); ++i) samples.push_back({times[i], list.poses[i]});
  return samples;
}

void bind_sampled(py::module_& m) {
  py::class_<SampledMotion, Motion, std::shared_ptr<SampledMotion>>(
      m, "SampledMotion", "A log of poses: linear and at constant turning rate between stamps.")
      .def(py::init([](const std::vector<Scalar>& times, const py::object& poses) {
             return std::make_shared<SampledMotion>(samples_of(times, poses));
           }),
           py::arg("times"), py::arg("poses"),
           "Increasing times (N,), and N poses: (N, 4, 4), ((N, 4), (N, 3)) or a list.")
      .def_property_readonly(
          "times",
          [](const SampledMotion& motion) {
            py::array_t<double> times(py::ssize_t(motion.samples().size()));
            double* out = times.mutable_data();
            for (const auto& sample : motion.samples()) *out++ = sample.t;
            return times;
          },
          "numpy.ndarray: (N,)")
      .def_property_readonly(
          "poses",
          [](const SampledMotion& motion) {
            py::list poses;
            for (const auto& sample : motion.samples()) poses.append(sample.X_WB);
            return poses;
          },
          "tuple[RigidPose, ...]: at the times")
      .def("__reduce__", [](const py::object& self) {
        return py::make_tuple(py::type::of(self),
                              py::make_tuple(self.attr("times"), self.attr("poses")));
      });
  m.def(
      "smooth_sampled_motion",
      [](const std::vector<Scalar>& times, const py::object& poses) {
        return std::make_shared<SequenceMotion>(smooth_sampled_motion(samples_of(times, poses)));
      },
      py::arg("times"), py::arg("poses"),
      "A log of poses through which the body moves with a continuous twist; as SampledMotion.");
}

}  // namespace

void bind_curves(py::module_& m) {
  bind_interpolated(m);
  bind_hermite(m);
  bind_bezier(m);
  bind_sampled(m);
  m.def(
      "load_motion",
      [](const py::object& file) {
        const auto path = path_of(file);
        return std::const_pointer_cast<Motion>(load_motion(path));
      },
      py::arg("file"), "The motion of a JSON file (docs/formats.md, \"Motions\").");
}

}  // namespace dyop::python
