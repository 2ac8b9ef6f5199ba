// SPDX-License-Identifier: BSD-3-Clause
#include <memory>

#include "dyop/motion/check_motion.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/motion/constant_twist_motion.h"
#include "dyop/motion/rest_motion.h"
#include "dyop/motion/screw_motion.h"
#include "dyop/motion/sequence_motion.h"
#include "python/bindings.h"
#include "python/glue/record.h"
#include "python/query/python_motion.h"

namespace dyop::python {
namespace {

using SharedMotion = std::shared_ptr<Motion>;

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
}

void bind_motion_base(py::module_& m) {
  py::class_<Motion, SharedMotion>(m, "Motion",
                                   "A pose as a function of time, with bounds on how its twist "
                                   "changes. Immutable and shared.")
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
           "A time after t until which the twist does not jump.");
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
      .def(py::init<ConstMotion, ConstMotion>(), py::arg("X_WM"), py::arg("X_MB"),
           "The frame's motion in world, and the body's in the frame.")
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
          "list[tuple[TimeInterval, Motion]]: in order of time")
      .def("__reduce__", [](const py::object& self) {
        return py::make_tuple(py::type::of(self), py::make_tuple(self.attr("parts")));
      });
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
      .value("AccelerationAboveBound", MotionFault::AccelerationAboveBound);
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

}  // namespace dyop::python
