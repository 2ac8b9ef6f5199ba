// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "dyop/chain/certify_chain.h"
#include "dyop/chain/link_motion.h"
#include "dyop/chain/link_pairs.h"
#include "dyop/core/error.h"
#include "dyop/io/planning_scene_file.h"
#include "dyop/io/robot_file.h"
#include "python/bindings.h"
#include "python/glue/calls.h"
#include "python/glue/record.h"
#include "python/query/queries.h"

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

using Chain = KinematicChain;
using ChainClass = py::class_<Chain, std::shared_ptr<Chain>>;

void bind_chain_fields(ChainClass& type) {
  type.def(py::init([](std::vector<Link> links, std::vector<Joint> joints, const PoseArgument& X_WR,
                       NamePairs ignored_pairs, NamePairs checked_pairs) {
             return std::make_shared<Chain>(
                 std::move(links), std::move(joints),
                 Chain::Options{X_WR.X, std::move(ignored_pairs), std::move(checked_pairs)});
           }),
           py::arg("links"), py::arg("joints"), py::arg("X_WR") = RigidPose(),
           py::arg("ignored_pairs") = NamePairs(), py::arg("checked_pairs") = NamePairs(),
           "X_WR: pose of the root link; ignored_pairs: names of links never checked against each\n"
           "other; checked_pairs: of links that are checked although they are neighbours.")
      .def_property_readonly(
          "links",
          [](const Chain& c) { return std::vector<Link>(c.links().begin(), c.links().end()); },
          "tuple[Link, ...]: in the order given")
      .def_property_readonly(
          "joints",
          [](const Chain& c) { return std::vector<Joint>(c.joints().begin(), c.joints().end()); },
          "tuple[Joint, ...]: in the order given")
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
          "tuple[Tuple[int, int], ...]: links that self-collision checks")
      .def_property_readonly(
          "ignored_pairs", [](const Chain& c) { return c.options().ignored_pairs; },
          "tuple[Tuple[str, str], ...]: names of links never checked against each other")
      .def_property_readonly(
          "checked_pairs", [](const Chain& c) { return c.options().checked_pairs; },
          "tuple[Tuple[str, str], ...]: names of neighbours that are checked nevertheless");
}

void bind_chain_methods(ChainClass& type) {
  type.def("coordinate_count", &Chain::coordinate_count, "Number of joints that are not fixed.")
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
          "link_jacobian",
          [](const Chain& c, std::size_t link, const JointVector& q) {
            return c.link_jacobian(link, q);
          },
          py::arg("link"), py::arg("q"),
          "How a link moves with the coordinates (K,): a twist for each, per unit of it.")
      .def("is_fixed", &Chain::is_fixed, py::arg("link"),
           "Whether a link rests at all coordinates: only fixed joints are above it.")
      .def(
          "are_neighbours",
          [](const Chain& c, std::size_t first, std::size_t second) {
            const std::size_t last = std::max(first, second);
            if (last >= c.links().size()) throw py::index_error();
            return c.are_neighbours(first, second);
          },
          py::arg("first"), py::arg("second"),
          "Whether two links are joined directly, or only through links without shapes.")
      .def("__repr__",
           [](const Chain& c) {
             return "KinematicChain(" + std::to_string(c.links().size()) + " links, " +
                    std::to_string(c.coordinate_count()) + " coordinates)";
           })
      .def("__reduce__", [](const py::object& self) {
        return py::make_tuple(
            py::type::of(self),
            py::make_tuple(self.attr("links"), self.attr("joints"), self.attr("X_WR"),
                           self.attr("ignored_pairs"), self.attr("checked_pairs")));
      });
}

void bind_chain_file(py::module_& m) {
  m.def(
      "load_chain",
      [](const py::object& file) { return std::make_shared<Chain>(load_chain(path_of(file))); },
      py::arg("file"), "The chain of a JSON file (docs/algorithms/chain.md).");
}

using Times = std::vector<Scalar>;
using PathClass = py::class_<JointPath, std::shared_ptr<JointPath>>;

void bind_path_makers(PathClass& type) {
  using Path = JointPath;
  type.def_static(
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
          "quintic",
          [](const Times& times, const py::object& waypoints, const py::object& velocities,
             const py::object& accelerations) {
            return Path::quintic(times, rows_of_coordinates(waypoints, "waypoints"),
                                 rows_of_coordinates(velocities, "velocities"),
                                 rows_of_coordinates(accelerations, "accelerations"));
          },
          py::arg("times"), py::arg("waypoints"), py::arg("velocities"), py::arg("accelerations"),
          "Quintics through waypoints (N, K) with velocities and accelerations (N, K).")
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
          "Bezier curves one after another, control points (P, K, degree + 1).");
}

void bind_path_values(PathClass& type) {
  using Path = JointPath;
  type.def("domain", &Path::domain, "Where the path is defined.")
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
}

void bind_link_motion(py::module_& m) {
  using Path = JointPath;
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
  ChainClass chain(m, "KinematicChain", "Links in a tree of joints, such as a robot's arm.");
  bind_chain_fields(chain);
  bind_chain_methods(chain);
  bind_chain_file(m);
  PathClass path(m, "JointPath", "Coordinates of a chain as piecewise polynomials of time.");
  bind_path_makers(path);
  bind_path_values(path);
  bind_link_motion(m);
}

namespace {

using RobotClass = py::class_<Robot, std::shared_ptr<Robot>>;
using Names = std::vector<std::string>;

void bind_robot_parts(py::module_& m) {
  py::enum_<RobotBase>(m, "RobotBase", "How a robot's root link is held.")
      .value("Fixed", RobotBase::Fixed, "In the world.")
      .value("Planar", RobotBase::Planar, "On a plane: two shifts and a turn.")
      .value("Floating", RobotBase::Floating, "Not at all: three shifts and three turns.");
  py::enum_<PathInterpolation>(m, "PathInterpolation", "What runs through the waypoints of a file.")
      .value("Linear", PathInterpolation::Linear, "Straight lines.")
      .value("Cubic", PathInterpolation::Cubic, "Cubics with the file's velocities, or a spline.")
      .value("Quintic", PathInterpolation::Quintic,
             "Quintics with the file's velocities and accelerations.");
  Record<CoordinateCoupling>(m, "CoordinateCoupling",
                             "A coordinate of a chain: multiplier * f + offset, f a free one.")
      .field<&CoordinateCoupling::free>("free", "int: number of the free coordinate f")
      .field<&CoordinateCoupling::multiplier>("multiplier", "float: 1 for one that mimics none")
      .field<&CoordinateCoupling::offset>("offset", "float: radians or length")
      .finish();
  Record<DisabledPair>(m, "DisabledPair", "Links that an SRDF file exempts from self-collision.")
      .field<&DisabledPair::first>("first", "str: name of a link")
      .field<&DisabledPair::second>("second", "str: name of a link")
      .field<&DisabledPair::reason>("reason", "str: `Never` is a claim about all joint values")
      .finish();
  Record<RobotGroup>(m, "RobotGroup", "A named set of links and joints of an SRDF file.")
      .field<&RobotGroup::name>("name", "str: of the group")
      .field<&RobotGroup::links>("links", "tuple[str, ...]: names")
      .field<&RobotGroup::joints>("joints", "tuple[str, ...]: names")
      .finish();
}

void bind_robot_fields(RobotClass& type) {
  type.def_readonly("name", &Robot::name, "str: of the file")
      .def_property_readonly(
          "chain", [](const Robot& r) { return std::const_pointer_cast<KinematicChain>(r.chain); },
          "KinematicChain: one coordinate for each joint that moves, mimicking ones included")
      .def_property_readonly(
          "links",
          [](const Robot& r) {
            return std::vector<Link>(r.chain->links().begin(), r.chain->links().end());
          },
          "tuple[Link, ...]: of the chain")
      .def_property_readonly(
          "joints",
          [](const Robot& r) {
            return std::vector<Joint>(r.chain->joints().begin(), r.chain->joints().end());
          },
          "tuple[Joint, ...]: of the chain")
      .def_readonly("masses", &Robot::masses,
                    "tuple[float, ...]: by link; 0 if the file states none")
      .def_readonly("couplings", &Robot::couplings,
                    "tuple[CoordinateCoupling, ...]: by coordinate of the chain")
      .def_readonly("free_joints", &Robot::free_joints,
                    "tuple[int, ...]: number of the joint of each free coordinate")
      .def_property_readonly(
          "lower", &Robot::lower,
          "numpy.ndarray: (F,) smallest free coordinates within the limits of all joints")
      .def_property_readonly(
          "upper", &Robot::upper,
          "numpy.ndarray: (F,) largest free coordinates within the limits of all joints")
      .def_readonly("disabled_pairs", &Robot::disabled_pairs,
                    "tuple[DisabledPair, ...]: as the SRDF file lists them")
      .def_readonly("groups", &Robot::groups, "tuple[RobotGroup, ...]: of the SRDF file")
      .def_readonly("notes", &Robot::notes, "tuple[str, ...]: what the reader had to assume");
}

void bind_robot_methods(RobotClass& type) {
  type.def("free_count", &Robot::free_count, "F: number of free coordinates.")
      .def(
          "expand", [](const Robot& r, const JointPath& path) { return r.expand(path); },
          py::arg("path"), "The chain's path along a path of the free coordinates.")
      .def(
          "expand", [](const Robot& r, const JointVector& q) { return r.expand(q); }, py::arg("q"),
          "The chain's coordinates (K,) at free ones (F,).")
      .def("expand_rates", &Robot::expand_rates, py::arg("rates"),
           "The chain's rates (K,) at rates (F,) of the free coordinates.")
      .def(
          "link_poses",
          [](const Robot& r, const JointVector& q) { return r.chain->link_poses(r.expand(q)); },
          py::arg("q"), "Poses X_WL of all links at free coordinates (F,).")
      .def("is_within_limits", &Robot::is_within_limits, py::arg("q"),
           "Whether free coordinates (F,), and all that mimic them, lie in limits.")
      .def(
          "attach",
          [](const Robot& r, const Link& object, const std::string& parent,
             const PoseArgument& X_PO, const Names& touch_links) {
            return std::make_shared<Robot>(attach(r, object, parent, X_PO.X, touch_links));
          },
          py::arg("object"), py::arg("parent"), py::arg("X_PO") = RigidPose(),
          py::arg("touch_links") = Names(),
          "The robot that holds an object: a Link with a new name, fixed to the link `parent`,\n"
          "which it may touch, like touch_links.")
      .def("__repr__", [](const Robot& r) {
        return "Robot('" + r.name + "', " + std::to_string(r.chain->links().size()) + " links, " +
               std::to_string(r.free_count()) + " free coordinates)";
      });
}

py::tuple parts_of(const Robot& r) {
  return py::make_tuple(r.name, std::const_pointer_cast<KinematicChain>(r.chain), r.masses,
                        r.couplings, r.free_joints, r.disabled_pairs, r.groups, r.notes);
}

std::shared_ptr<Robot> robot_of_parts(const py::tuple& parts) {
  auto robot = std::make_shared<Robot>();
  robot->name = parts[0].cast<std::string>();
  robot->chain = parts[1].cast<std::shared_ptr<KinematicChain>>();
  robot->masses = parts[2].cast<std::vector<Scalar>>();
  robot->couplings = parts[3].cast<std::vector<CoordinateCoupling>>();
  robot->free_joints = parts[4].cast<std::vector<std::size_t>>();
  robot->disabled_pairs = parts[5].cast<std::vector<DisabledPair>>();
  robot->groups = parts[6].cast<std::vector<RobotGroup>>();
  robot->notes = parts[7].cast<Names>();
  return robot;
}

void bind_robot(py::module_& m) {
  RobotClass type(m, "Robot",
                  "A tree of links, and what its files say beyond geometry. Immutable.");
  bind_robot_fields(type);
  bind_robot_methods(type);
  type.def(py::pickle(&parts_of, &robot_of_parts));
  m.def(
      "make_robot",
      [](const std::string& name, const KinematicChain& chain) {
        return std::make_shared<Robot>(make_robot(name, chain));
      },
      py::arg("name"), py::arg("chain"), "A robot of a chain whose joints are all independent.");
}

void bind_robot_files(py::module_& m) {
  m.def(
      "load_robot",
      [](const py::object& file, const py::object& srdf, const py::iterable& package_paths,
         RobotBase base, bool trusts_never) {
        RobotFileOptions options;
        if (!srdf.is_none()) options.srdf = path_of(srdf);
        for (const py::handle item : package_paths) options.package_paths.push_back(path_of(item));
        options.base = base;
        options.trusts_never = trusts_never;
        const std::filesystem::path urdf = path_of(file);
        const py::gil_scoped_release unlocked;
        return std::make_shared<Robot>(load_robot(urdf, options));
      },
      py::arg("file"), py::arg("srdf") = py::none(), py::arg("package_paths") = py::tuple(),
      py::arg("base") = RobotBase::Fixed, py::arg("trusts_never") = false,
      "The robot of a URDF or MJCF file (docs/robots.md). package_paths: where "
      "`package://NAME/PATH` is\n"
      "searched for. trusts_never: leave out of self-collision the pairs too that the SRDF file\n"
      "exempts for the reason `Never`.");
  m.def(
      "load_joint_path",
      [](const py::object& file, const Robot& robot, PathInterpolation interpolation,
         const std::optional<JointVector>& rest) {
        return std::make_shared<JointPath>(
            load_joint_path(path_of(file), robot, interpolation, rest));
      },
      py::arg("file"), py::arg("robot"), py::arg("interpolation") = PathInterpolation::Linear,
      py::arg("rest") = py::none(),
      "The path of a robot's free coordinates of a CSV file or a joint-trajectory message as\n"
      "JSON or YAML. rest: (F,) free coordinates for joints that the file does not name.");
  m.def(
      "load_planning_scene",
      [](const py::object& file, const Robot& robot) {
        return load_planning_scene(path_of(file), robot);
      },
      py::arg("file"), py::arg("robot"),
      "The planning-scene message of a YAML or JSON file, as MoveIt writes it (docs/robots.md).");
}

Field shape_field(py::object (*get)(const void*, py::handle), void (*set)(void*, py::handle)) {
  return {"shape", get, set};
}

template <typename Object>
py::object get_shape(const void* object, py::handle) {
  const auto& shape = static_cast<const Object*>(object)->shape;
  return py::cast(std::const_pointer_cast<Shape>(shape));
}
template <typename Object>
void set_shape(void* object, py::handle value) {
  static_cast<Object*>(object)->shape = value.cast<std::shared_ptr<Shape>>();
}

void bind_planning_scene(py::module_& m) {
  Record<PlanningObject> object(m, "PlanningObject", "A collision object of a planning scene.");
  object.option<&PlanningObject::name>("name", "str: in the file")
      .custom(shape_field(&get_shape<PlanningObject>, &set_shape<PlanningObject>),
              "Shape: in its own frame")
      .option<&PlanningObject::X_WO>("X_WO", "RigidPose: in the world")
      .finish();
  Record<HeldObject> held(m, "HeldObject", "An object that a link of the robot holds.");
  held.option<&HeldObject::name>("name", "str: in the file")
      .custom(shape_field(&get_shape<HeldObject>, &set_shape<HeldObject>),
              "Shape: in its own frame")
      .option<&HeldObject::link>("link", "str: the link that holds it")
      .option<&HeldObject::X_LO>("X_LO", "RigidPose: in the link's frame")
      .option<&HeldObject::touch_links>("touch_links", "tuple[str, ...]: links that it may touch")
      .finish();
  Record<PlanningScene> scene(m, "PlanningScene",
                              "What stands around a robot, and the robot's state there.");
  scene.option<&PlanningScene::name>("name", "str: in the file")
      .option<&PlanningScene::objects>("objects", "tuple[PlanningObject, ...]: what stands around")
      .option<&PlanningScene::held>("held", "tuple[HeldObject, ...]: what the robot holds")
      .option<&PlanningScene::state>("state", "numpy.ndarray: (F,) free coordinates of the robot")
      .option<&PlanningScene::allowed>(
          "allowed", "tuple[tuple[str, str], ...]: names of links and objects that may touch");
  scene.type
      .def(
          "obstacles",
          [](const PlanningScene& self) {
            auto set = std::make_shared<SharedObstacleSet>();
            set->change() = self.obstacles();
            return set;
          },
          "The objects, in their order.")
      .def(
          "place",
          [](const PlanningScene& self, const Robot& robot) {
            return std::make_shared<Robot>(self.place(robot));
          },
          py::arg("robot"),
          "The robot that holds what is held, and whose links ignore what they may touch.");
  scene.finish();
}

/// Calls of Python that C++ may not see fail: the first exception stops the work, and is thrown
/// when that has ended.
class GuardedProgress {
 public:
  explicit GuardedProgress(const py::object& progress) : call_(make_progress(progress)) {}

  std::stop_source& stop() { return stop_; }
  void operator()(std::size_t done, std::size_t total) noexcept {
    if (failure_) return;
    try {
      call_(done, total);
    } catch (...) {
      failure_ = std::current_exception();
      stop_.request_stop();
    }
  }
  void rethrow() const {
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  std::function<void(std::size_t, std::size_t)> call_;
  std::exception_ptr failure_;
  std::stop_source stop_;
};

std::vector<LinkPairReport> decide(const Robot& robot, LinkPairOptions options,
                                   const std::stop_source* stop, const py::object& progress) {
  GuardedProgress guarded(progress);
  if (!progress.is_none()) options.on_progress = std::ref(guarded);
  std::vector<LinkPairReport> reports;
  const auto forward = [&guarded] { guarded.stop().request_stop(); };
  run_interruptible(stop != nullptr ? stop->get_token() : std::stop_token(),
                    [&](const std::stop_token& token) {
                      const std::stop_callback stopping(token, forward);
                      options.stop = guarded.stop().get_token();
                      reports = decide_link_pairs(robot, options);
                    });
  guarded.rethrow();
  return reports;
}

void bind_link_pairs(py::module_& m) {
  py::enum_<PairVerdict>(m, "PairVerdict", "What is proven of two links within the joints' limits.")
      .value("Never", PairVerdict::Never, "Apart at all joint values.")
      .value("Always", PairVerdict::Always, "They touch at all joint values.")
      .value("Can", PairVerdict::Can, "They touch at the witness.")
      .value("Undecided", PairVerdict::Undecided, "Neither is proven.");
  Record<LinkPairReport>(m, "LinkPairReport", "What decide_link_pairs() finds of two links.")
      .field<&LinkPairReport::first>("first", "int: number of a link")
      .field<&LinkPairReport::second>("second", "int: number of a link, > first")
      .field<&LinkPairReport::verdict>("verdict", "PairVerdict: proven")
      .field<&LinkPairReport::is_adjacent>("is_adjacent",
                                           "bool: joined directly, or through shapeless links")
      .field<&LinkPairReport::witness>(
          "witness", "Optional[numpy.ndarray]: (F,) free coordinates at which they touch")
      .field<&LinkPairReport::touching_share>("touching_share", "float: of samples that touch")
      .field<&LinkPairReport::undecided_share>("undecided_share",
                                               "float: of joint values left if Undecided")
      .field<&LinkPairReport::joints>("joints", "int: free coordinates between the links")
      .field<&LinkPairReport::boxes>("boxes", "int: boxes of joint values examined")
      .finish();
  m.def(
      "decide_link_pairs",
      [](const Robot& robot, const std::vector<std::pair<std::string, std::string>>& only,
         std::int64_t max_boxes, int samples, const py::object& deadline,
         const std::stop_source* stop, const py::object& progress) {
        LinkPairOptions options;
        options.only = only;
        options.max_boxes = max_boxes;
        options.samples = samples;
        if (!deadline.is_none()) options.deadline = deadline_of(deadline);
        return decide(robot, options, stop, progress);
      },
      py::arg("robot"), py::kw_only(),
      py::arg("only") = std::vector<std::pair<std::string, std::string>>(),
      py::arg("max_boxes") = LinkPairOptions().max_boxes,
      py::arg("samples") = LinkPairOptions().samples, py::arg("deadline") = py::none(),
      py::arg("stop") = py::none(), py::arg("progress") = py::none(),
      "Proves for every pair of links, or those that `only` names, whether they can touch within\n"
      "the limits of the joints (docs/robots.md). deadline: of time.monotonic(); what is left "
      "then\n"
      "is Undecided. progress(done, total) is called at most ten times a second.");
  m.def(
      "srdf_text",
      [](const Robot& robot, const std::vector<LinkPairReport>& pairs) {
        return srdf_text(robot, pairs);
      },
      py::arg("robot"), py::arg("pairs"), "The text of an SRDF file of what is proven.");
}

void bind_certify(py::module_& m) {
  Record<ChainResult>(m, "ChainResult", "Result of certify(); see ToiStatus.")
      .field<&ChainResult::toi>("toi", "ToiResult: A is link_a, B is link_b or the obstacle")
      .field<&ChainResult::link_a>("link_a", "Optional[int]: that was hit, or not decided")
      .field<&ChainResult::link_b>("link_b", "Optional[int]: the other link, in self-collision")
      .custom(id_field<ChainResult>(), "Optional[int]: the obstacle, otherwise", false)
      .field<&ChainResult::free_fraction>("free_fraction", "float: part of the path proven free")
      .finish();
  m.def(
      "certify",
      [](const ChainArgument& chain, const JointPath& path, SharedObstacleSet& obstacles,
         const PythonToiOptions* options, std::uint32_t groups, const py::object& accepts,
         bool with_self_collision) {
        const ObstacleFilter filter = make_filter(groups, accepts);
        const JointPath expanded = chain.expand(path);
        return obstacles.read([&](const ObstacleSet& set) {
          const auto ask = [&](const ToiOptions& limited) {
            return certify(*chain.chain, expanded, set, {limited, filter, with_self_collision});
          };
          return answer_or_start_over(options_or_default(options), ask,
                                      std::mem_fn(&ChainResult::toi));
        });
      },
      py::arg("chain"), py::arg("path"), py::arg("obstacles"), py::arg("options") = py::none(),
      py::arg("groups") = ~std::uint32_t{0}, py::arg("accepts") = py::none(),
      py::arg("with_self_collision") = true,
      "Proves that a chain, or a robot on a path of its free coordinates, stays clear of "
      "obstacles\n"
      "and of itself, or tells until when, and what is hit first. accepts(id) leaves obstacles "
      "out.");
}

}  // namespace

void bind_robots(py::module_& m) {
  bind_robot_parts(m);
  bind_robot(m);
  bind_planning_scene(m);
  bind_robot_files(m);
  bind_link_pairs(m);
  bind_certify(m);
}

}  // namespace dyop::python
