// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <memory>
#include <optional>

#include "dyop/chain/link_motion.h"
#include "dyop/core/error.h"
#include "dyop/io/chain_file.h"
#include "python/bindings.h"
#include "python/glue/record.h"
#include "python/query/chain_arguments.h"

namespace dyop::python {
namespace {

using NamePairs = std::vector<std::pair<std::string, std::string>>;

// (N, K): a row per waypoint.
std::vector<JointVector> rows_of_coordinates(const py::object& source, const char* what) {
  const auto numbers = Doubles::ensure(source);
  if (!numbers) PyErr_Clear();
  DYOP_REQUIRE(numbers && numbers.ndim() == 2, what, " must be an array (N, K)");
  std::vector<JointVector> rows;
  for (py::ssize_t i = 0; i < numbers.shape(0); ++i) {
    rows.push_back(
        Eigen::Map<const JointVector>(numbers.data() + i * numbers.shape(1), numbers.shape(1)));
  }
  return rows;
}

// (P, K, D + 1): control points of each piece.
std::vector<Eigen::MatrixXd> pieces_of(const py::object& source) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const auto numbers = Doubles::ensure(source);
  if (!numbers) PyErr_Clear();
  DYOP_REQUIRE(numbers && numbers.ndim() == 3, "controls must be an array (P, K, D + 1)");
  std::vector<Eigen::MatrixXd> pieces;
  for (py::ssize_t i = 0; i < numbers.shape(0); ++i) {
    pieces.push_back(
        Eigen::Map<const RowMajor>(numbers.data() + i * numbers.shape(1) * numbers.shape(2),
                                   numbers.shape(1), numbers.shape(2)));
  }
  return pieces;
}

py::array controls_of(const JointPath& path) {
  const std::size_t pieces = path.times().size() - 1;
  py::array_t<double> all({pieces, path.coordinate_count(), path.degree() + 1});
  double* out = all.mutable_data();
  for (std::size_t k = 0; k < pieces; ++k) {
    const Eigen::MatrixXd controls = path.controls(k);
    for (Eigen::Index i = 0; i < controls.rows(); ++i) {
      for (Eigen::Index j = 0; j < controls.cols(); ++j) *out++ = controls(i, j);
    }
  }
  return all;
}

std::pair<Scalar, Scalar> bound_of(const JointPath& path, std::size_t coordinate,
                                   const py::object& part) {
  if (coordinate >= path.coordinate_count()) throw py::index_error();
  const TimeInterval interval = part.is_none() ? path.domain() : interval_of(part);
  const TimeInterval domain = path.domain();
  DYOP_REQUIRE(domain.begin <= interval.begin && interval.begin <= interval.end &&
                   interval.end <= domain.end,
               "part [", interval.begin, ", ", interval.end, "] is not within the domain [",
               domain.begin, ", ", domain.end, "]");
  const JointPath::Bound bound = path.bound(coordinate, interval);
  return {bound.speed, bound.acceleration};
}

void bind_chain_parts(py::module_& m) {
  Record<Link>(m, "Link", "A rigid part of a KinematicChain.")
      .option<&Link::name>("name", "str: as joints name it")
      .option<&Link::shape>("shape", "Optional[Shape]: in the link's frame; None hits nothing")
      .option<&Link::is_solid>("is_solid", "bool: a closed mesh is a solid")
      .option<&Link::groups>("groups", "int: bit set; of the obstacles it can hit")
      .finish();
  py::enum_<JointType>(m, "JointType", "How a child link moves in its parent's frame.")
      .value("Fixed", JointType::Fixed, "Not at all.")
      .value("Revolute", JointType::Revolute, "Turns about the axis.")
      .value("Prismatic", JointType::Prismatic, "Slides along the axis.");
  Record<Joint>(m, "Joint", "Holds a child link to its parent; of a KinematicChain.")
      .option<&Joint::name>("name", "str: for messages")
      .option<&Joint::type>("type", "JointType: how it moves")
      .option<&Joint::parent>("parent", "str: name of a link")
      .option<&Joint::child>("child", "str: name of a link")
      .option<&Joint::X_PJ>("X_PJ", "RigidPose: of the joint in the parent's frame")
      .option<&Joint::axis_J>("axis_J", "numpy.ndarray: (3,) of any length but zero")
      .option<&Joint::lower>("lower", "float: smallest coordinate, radians or length")
      .option<&Joint::upper>("upper", "float: largest coordinate")
      .finish();
}

void bind_chain_type(py::module_& m) {
  using Chain = KinematicChain;
  py::class_<Chain, std::shared_ptr<Chain>>(m, "KinematicChain",
                                            "Links in a tree of joints, such as a robot's arm.")
      .def(py::init([](std::vector<Link> links, std::vector<Joint> joints, const PoseArgument& X_WR,
                       NamePairs ignored_pairs) {
             return std::make_shared<Chain>(std::move(links), std::move(joints),
                                            Chain::Options{X_WR.X, std::move(ignored_pairs)});
           }),
           py::arg("links"), py::arg("joints"), py::arg("X_WR") = RigidPose(),
           py::arg("ignored_pairs") = NamePairs(),
           "X_WR: pose of the root link; ignored_pairs: names of links never checked against each\n"
           "other.")
      .def_property_readonly(
          "links",
          [](const Chain& c) { return std::vector<Link>(c.links().begin(), c.links().end()); },
          "list[Link]: in the order given")
      .def_property_readonly(
          "joints",
          [](const Chain& c) { return std::vector<Joint>(c.joints().begin(), c.joints().end()); },
          "list[Joint]: in the order given")
      .def_property_readonly("X_WR", &Chain::X_WR, "RigidPose: of the root link")
      .def_property_readonly(
          "self_pairs",
          [](const Chain& c) {
            std::vector<std::pair<std::size_t, std::size_t>> pairs;
            for (const Chain::LinkPair& pair : c.self_pairs()) {
              pairs.emplace_back(pair.first, pair.second);
            }
            return pairs;
          },
          "list[Tuple[int, int]]: links that self-collision checks")
      .def("coordinate_count", &Chain::coordinate_count, "Number of joints that are not fixed.")
      .def(
          "joint_of",
          [](const Chain& c, std::size_t coordinate) {
            if (coordinate >= c.coordinate_count()) throw py::index_error();
            return c.joint_of(coordinate);
          },
          py::arg("coordinate"), "Number of the joint of a coordinate.")
      .def(
          "find_link", [](const Chain& c, const std::string& name) { return c.find_link(name); },
          py::arg("name"), "Number of the link of this name, or None.")
      .def(
          "is_within_limits",
          [](const Chain& c, const JointVector& q) { return c.is_within_limits(q); }, py::arg("q"),
          "Whether coordinates (K,) lie within their joints' limits.")
      .def(
          "link_poses", [](const Chain& c, const JointVector& q) { return c.link_poses(q); },
          py::arg("q"), "Poses X_WL of all links at coordinates (K,).")
      .def(
          "are_neighbours",
          [](const Chain& c, std::size_t first, std::size_t second) {
            const std::size_t last = std::max(first, second);
            if (last >= c.links().size()) throw py::index_error();
            return c.are_neighbours(first, second);
          },
          py::arg("first"), py::arg("second"),
          "Whether two links are joined directly, or only through links without shapes.")
      .def_property_readonly(
          "ignored_pairs",
          [](const Chain& c) {
            return NamePairs(c.ignored_pairs().begin(), c.ignored_pairs().end());
          },
          "list[Tuple[str, str]]: names of links never checked against each other")
      .def("__repr__",
           [](const Chain& c) {
             return "KinematicChain(" + std::to_string(c.links().size()) + " links, " +
                    std::to_string(c.coordinate_count()) + " coordinates)";
           })
      .def("__reduce__", [](const py::object& self) {
        return py::make_tuple(py::type::of(self),
                              py::make_tuple(self.attr("links"), self.attr("joints"),
                                             self.attr("X_WR"), self.attr("ignored_pairs")));
      });
  m.def(
      "load_chain",
      [](const py::object& file) { return std::make_shared<Chain>(load_chain(path_of(file))); },
      py::arg("file"), "The chain of a JSON file (docs/algorithms/chain.md).");
}

void bind_joint_path(py::module_& m) {
  using Path = JointPath;
  using Times = std::vector<Scalar>;
  py::class_<Path, std::shared_ptr<Path>>(
      m, "JointPath", "Coordinates of a chain as piecewise polynomials of time.")
      .def_static(
          "linear",
          [](const Times& times, const py::object& waypoints) {
            return Path::linear(times, rows_of_coordinates(waypoints, "waypoints"));
          },
          py::arg("times"), py::arg("waypoints"), "Straight lines between waypoints (N, K).")
      .def_static(
          "cubic",
          [](const Times& times, const py::object& waypoints, const py::object& velocities) {
            const auto rows = rows_of_coordinates(waypoints, "waypoints");
            if (velocities.is_none()) return Path::cubic(times, rows);
            return Path::cubic(times, rows, rows_of_coordinates(velocities, "velocities"));
          },
          py::arg("times"), py::arg("waypoints"), py::arg("velocities") = py::none(),
          "Cubics through waypoints (N, K) with velocities (N, K); without them the spline that\n"
          "starts and ends at rest.")
      .def_static(
          "bspline",
          [](std::size_t degree, const Times& knots, const py::object& control_points) {
            return Path::bspline(degree, knots,
                                 rows_of_coordinates(control_points, "control_points"));
          },
          py::arg("degree"), py::arg("knots"), py::arg("control_points"),
          "A B-spline of control points (N, K); N + degree + 1 knots.")
      .def_static(
          "bezier",
          [](const Times& times, const py::object& controls) {
            return Path::bezier(times, pieces_of(controls));
          },
          py::arg("times"), py::arg("controls"),
          "Bezier curves one after another, control points (P, K, degree + 1).")
      .def("domain", &Path::domain, "Where the path is defined.")
      .def("coordinate_count", &Path::coordinate_count, "K.")
      .def("degree", &Path::degree, "Of the polynomials.")
      .def(
          "times", [](const Path& p) { return Times(p.times().begin(), p.times().end()); },
          "Starts of the pieces, and the end of the last.")
      .def("controls", &controls_of, "Control points (P, K, degree + 1) as bezier() takes them.")
      .def("position", &Path::position, py::arg("t"), "Coordinates (K,) at time t.")
      .def("velocity", &Path::velocity, py::arg("t"),
           "Their rates (K,); at a jump those from the right.")
      .def("bound", &bound_of, py::arg("coordinate"), py::arg("part") = py::none(),
           "Upper bounds (speed, acceleration) of a coordinate over a part of the domain, or all "
           "of\n"
           "it; the acceleration is infinite if two pieces meet inside the part.")
      .def(
          "largest_value",
          [](const Path& p, std::size_t coordinate) {
            if (coordinate >= p.coordinate_count()) throw py::index_error();
            return p.largest_value(coordinate);
          },
          py::arg("coordinate"), "Largest size of a coordinate over the domain.")
      .def("__repr__",
           [](const Path& p) {
             return "JointPath(" + std::to_string(p.coordinate_count()) + " coordinates, " +
                    std::to_string(p.times().size() - 1) + " pieces of degree " +
                    std::to_string(p.degree()) + ")";
           })
      .def(py::pickle(
          [](const Path& p) {
            return py::make_tuple(Times(p.times().begin(), p.times().end()), controls_of(p));
          },
          [](const py::tuple& state) {
            return std::make_shared<Path>(
                Path::bezier(state[0].cast<Times>(), pieces_of(state[1])));
          }));
  py::class_<LinkMotion, Motion, std::shared_ptr<LinkMotion>>(
      m, "LinkMotion", "How one link of a chain moves on a path.")
      .def(py::init([](const std::shared_ptr<KinematicChain>& chain,
                       const std::shared_ptr<Path>& path, std::size_t link,
                       const std::optional<std::size_t>& base) {
             return base ? std::make_shared<LinkMotion>(chain, path, link, *base)
                         : std::make_shared<LinkMotion>(chain, path, link);
           }),
           py::arg("chain"), py::arg("path"), py::arg("link"), py::arg("base") = py::none(),
           "In the world, or in the frame of link `base` between the root and `link`.")
      .def("__reduce__", [](const py::object& self) {
        const auto& motion = self.cast<const LinkMotion&>();
        return py::make_tuple(
            py::type::of(self),
            py::make_tuple(std::const_pointer_cast<KinematicChain>(motion.chain()),
                           std::const_pointer_cast<Path>(motion.path()), motion.link(),
                           motion.base()));
      });
}

}  // namespace

JointVector coordinates_of(py::handle source) {
  const auto numbers = Doubles::ensure(source);
  if (!numbers) PyErr_Clear();
  DYOP_REQUIRE(numbers && numbers.ndim() == 1, "coordinates must be an array (K,)");
  return Eigen::Map<const JointVector>(numbers.data(), numbers.size());
}

void bind_chain(py::module_& m) {
  bind_chain_parts(m);
  bind_chain_type(m);
  bind_joint_path(m);
}

}  // namespace dyop::python
