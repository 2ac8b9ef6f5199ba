// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <memory>

#include "dyop/core/error.h"
#include "dyop/io/motion_file.h"
#include "dyop/motion/bezier_motion.h"
#include "dyop/motion/bspline_motion.h"
#include "dyop/motion/hermite_motion.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/sampled_motion.h"
#include "dyop/motion/smooth_sampled_motion.h"
#include "python/bindings.h"
#include "python/glue/record.h"

namespace dyop::python {
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
          "list[RigidPose]: at the times")
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
