// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>

#include "dyop/core/error.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/half_space.h"
#include "dyop/geometry/height_field.h"
#include "dyop/geometry/occupancy.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/io/mesh_file.h"
#include "dyop/io/octree_file.h"
#include "python/bindings.h"
#include "python/glue/record.h"

namespace dyop::python {
namespace {

using SharedShape = std::shared_ptr<Shape>;

void bind_shape_bases(py::module_& m) {
  py::enum_<ShapeKind>(m, "ShapeKind")
      .value("TriangleMesh", ShapeKind::TriangleMesh)
      .value("Convex", ShapeKind::Convex)
      .value("Compound", ShapeKind::Compound);
  py::enum_<FeatureKind>(m, "FeatureKind", "The kind of feature a witness point lies on.")
      .value("Vertex", FeatureKind::Vertex)
      .value("Edge", FeatureKind::Edge)
      .value("Face", FeatureKind::Face)
      .value("Smooth", FeatureKind::Smooth);
  Record<Feature>(m, "Feature", "A feature, named by the shape's own vertex numbers.")
      .field<&Feature::kind>("kind", "FeatureKind: ")
      .field<&Feature::vertices>("vertices",
                                 "tuple[int, ...]: as many as the kind has; the rest are 0")
      .finish();
  Record<MassProperties>(m, "MassProperties", "Mass properties of a body, in its shape's frame B.")
      .option<&MassProperties::mass>("mass", "float: > 0")
      .option<&MassProperties::p_BoBcm>("p_BoBcm", "numpy.ndarray: (3,) centre of mass, length")
      .option<&MassProperties::I_BBcm>(
          "I_BBcm", "numpy.ndarray: (3, 3) rotational inertia about the centre of mass, axes of B")
      .finish();
  m.def("with_mass", &with_mass, py::arg("properties"), py::arg("mass"),
        "The same mass distribution scaled to a total mass.");

  py::class_<Shape, SharedShape>(m, "Shape",
                                 "A rigid shape at rest in its own frame. Immutable and shared.")
      .def("kind", &Shape::kind, "Mesh, convex or compound.")
      .def(
          "bounding_box",
          [](const Shape& shape) {
            const AlignedBox box = shape.bounding_box();
            return std::pair(Vector3(box.min()), Vector3(box.max()));
          },
          "Corners (min, max), (3,) each, length, in the shape's frame.")
      .def("bounding_radius", &Shape::bounding_radius,
           "Largest distance of a point of the shape from the frame's origin, length.")
      .def("compute_mass_properties", &Shape::compute_mass_properties, py::arg("density"),
           "Mass properties of the solid of this density (mass per volume).");
}

Vector3 support_point_of(const py::handle& value) {
  const Vector3 point = vector_of(value, "core_support");
  DYOP_REQUIRE(point.allFinite(), "core_support must give a finite point, not (", point.transpose(),
               ")");
  return point;
}

// The support point that Python gives: a point, or a point and the number of its vertex.
SupportPoint support_of(const py::object& value) {
  if (py::isinstance<py::tuple>(value) && py::len(value) == 2) {
    const py::tuple pair = value;
    return {support_point_of(pair[0]),
            read_as<std::int32_t>(pair[1], "the number of a vertex must be an int")};
  }
  return {support_point_of(value), {}};
}

/// The C++ part of an object whose class derives from ConvexShape in Python.
class DerivedConvex final : public ConvexShape, public DerivedInPython {
 public:
  SupportPoint core_support(const Vector3& direction) const override {
    const py::gil_scoped_acquire lock;
    return support_of(required_method<ConvexShape>(this, "core_support")(array_of(direction)));
  }
  Scalar rounding_radius() const override {
    const py::gil_scoped_acquire lock;
    const py::function method = method_of<ConvexShape>(this, "rounding_radius");
    return method ? read_as<Scalar>(method(), "rounding_radius must return a number") : 0;
  }
  Vector3 core_center() const override {
    const py::gil_scoped_acquire lock;
    const py::function method = method_of<ConvexShape>(this, "core_center");
    if (method) return vector_of(method(), "core_center");
    Vector3 sum = Vector3::Zero();
    for (int k = 0; k < 6; ++k) sum += core_support(axis(k)).point;
    return sum / 6;
  }
  AlignedBox bounding_box() const override {
    const Scalar radius = rounding_radius();
    AlignedBox box;
    for (int k = 0; k < 6; ++k) {
      box.extend(Vector3(core_support(axis(k)).point + radius * axis(k)));
    }
    // Support points are exact up to rounding.
    constexpr Scalar kNoise = 0x1p-48;  // literal: 16 units in the last place
    const Scalar margin = kNoise * (box.min().cwiseAbs().maxCoeff() + box.diagonal().norm());
    return {Vector3(box.min() - Vector3::Constant(margin)),
            Vector3(box.max() + Vector3::Constant(margin))};
  }
  Scalar bounding_radius() const override {
    const py::gil_scoped_acquire lock;
    const py::function method = method_of<ConvexShape>(this, "bounding_radius");
    if (method) return read_as<Scalar>(method(), "bounding_radius must return a number");
    const AlignedBox box = bounding_box();
    constexpr Scalar kUp = 1 + 0x1p-48;  // literal: more than a square root is rounded by
    return kUp * box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).norm();
  }
  MassProperties compute_mass_properties(Scalar density) const override {
    const py::gil_scoped_acquire lock;
    return read_as<MassProperties>(
        required_method<ConvexShape>(this, "compute_mass_properties")(density),
        "compute_mass_properties must return MassProperties");
  }

 private:
  static Vector3 axis(int k) { return Scalar(k < 3 ? 1 : -1) * Vector3::Unit(k % 3); }
};

void bind_convex_shape(py::module_& m) {
  py::class_<ConvexShape, Shape, DerivedConvex, std::shared_ptr<ConvexShape>>(
      m, "ConvexShape",
      "A convex core inflated by a ball of radius rounding_radius(). A class of yours may derive\n"
      "from it: core_support(direction) gives a point (3,) of the core that is farthest along any\n"
      "direction (3,), or a pair of it and the number of its vertex; exact up to rounding, as all\n"
      "proofs depend on it. Where it is not 0, rounding_radius(); for a World,\n"
      "compute_mass_properties(density). Faster with core_center() and bounding_radius(). Slow, "
      "as\n"
      "each call takes the interpreter's lock.")
      .def(py::init_alias<>(), "For classes that derive from it.")
      .def(py::pickle(
          [](const py::object& self) {
            return py::make_tuple(py::getattr(self, "__dict__", py::dict()));
          },
          [](const py::tuple& state) {
            return std::make_pair(static_cast<ConvexShape*>(new DerivedConvex()),
                                  state[0].cast<py::dict>());
          }))
      .def(
          "core_support",
          [](const ConvexShape& shape, const Vector3& direction) {
            return shape.core_support(direction).point;
          },
          py::arg("direction"), "A point (3,) of the core farthest along any direction (3,).")
      .def("core_center", &ConvexShape::core_center, "A point (3,) of the core, rather central.")
      .def(
          "support",
          [](const ConvexShape& shape, const Vector3& direction) {
            return shape.support(direction);
          },
          py::arg("unit_direction"), "A farthest point (3,) along a unit direction (3,).")
      .def("rounding_radius", &ConvexShape::rounding_radius, "Length, >= 0.");
}

void bind_convex_shapes(py::module_& m) {
  bind_convex_shape(m);
  py::class_<Sphere, ConvexShape, std::shared_ptr<Sphere>>(m, "Sphere", "Ball about the origin.")
      .def(py::init<Scalar>(), py::arg("radius"), "Radius > 0, length.")
      .def_property_readonly("radius", &Sphere::radius, "float: length")
      .def("__repr__",
           [](const Sphere& s) {
             return "Sphere(" + std::string(py::repr(py::cast(s.radius()))) + ")";
           })
      .def(py::pickle([](const Sphere& s) { return py::make_tuple(s.radius()); },
                      [](const py::tuple& state) {
                        return std::make_shared<Sphere>(state[0].cast<Scalar>());
                      }));
  py::class_<Box, ConvexShape, std::shared_ptr<Box>>(m, "Box", "Axis-aligned box about the origin.")
      .def(py::init<const Vector3&>(), py::arg("half_extents"), "(3,) lengths, > 0.")
      .def_property_readonly("half_extents", &Box::half_extents, "numpy.ndarray: (3,) lengths")
      .def("__repr__",
           [](const Box& b) {
             const py::object list = array_of(b.half_extents()).attr("tolist")();
             return "Box(" + std::string(py::str(list)) + ")";
           })
      .def(py::pickle([](const Box& b) { return py::make_tuple(b.half_extents()); },
                      [](const py::tuple& state) {
                        return std::make_shared<Box>(vector_of(state[0], "half_extents"));
                      }));
  py::class_<Capsule, ConvexShape, std::shared_ptr<Capsule>>(
      m, "Capsule", "All points within a radius of a segment on the z axis, about the origin.")
      .def(py::init<Scalar, Scalar>(), py::arg("radius"), py::arg("half_length"),
           "Lengths, radius > 0, half_length >= 0.")
      .def_property_readonly("radius", &Capsule::radius, "float: length")
      .def_property_readonly("half_length", &Capsule::half_length, "float: length")
      .def("__repr__",
           [](const Capsule& c) {
             return "Capsule" + std::string(py::repr(py::make_tuple(c.radius(), c.half_length())));
           })
      .def(py::pickle([](const Capsule& c) { return py::make_tuple(c.radius(), c.half_length()); },
                      [](const py::tuple& state) {
                        return std::make_shared<Capsule>(state[0].cast<Scalar>(),
                                                         state[1].cast<Scalar>());
                      }));
}

// Shapes of a radius and a half length.
template <typename Round>
void bind_round(py::module_& m, const char* name, const char* doc) {
  py::class_<Round, ConvexShape, std::shared_ptr<Round>>(m, name, doc)
      .def(py::init<Scalar, Scalar>(), py::arg("radius"), py::arg("half_length"), "Lengths > 0.")
      .def_property_readonly("radius", &Round::radius, "float: length")
      .def_property_readonly("half_length", &Round::half_length, "float: length")
      .def("__repr__",
           [name = std::string(name)](const Round& shape) {
             return name +
                    std::string(py::repr(py::make_tuple(shape.radius(), shape.half_length())));
           })
      .def(py::pickle(
          [](const Round& shape) { return py::make_tuple(shape.radius(), shape.half_length()); },
          [](const py::tuple& state) {
            return std::make_shared<Round>(state[0].cast<Scalar>(), state[1].cast<Scalar>());
          }));
}

// Shapes of three lengths.
template <typename Round>
void bind_three(py::module_& m, const char* name, const char* doc,
                const std::array<const char*, 3>& names,
                const std::array<Scalar (Round::*)() const, 3>& lengths) {
  const auto numbers = [lengths](const Round& shape) {
    return py::make_tuple((shape.*lengths[0])(), (shape.*lengths[1])(), (shape.*lengths[2])());
  };
  py::class_<Round, ConvexShape, std::shared_ptr<Round>>(m, name, doc)
      .def(py::init<Scalar, Scalar, Scalar>(), py::arg(names[0]), py::arg(names[1]),
           py::arg(names[2]), "Lengths > 0.")
      .def_property_readonly(names[0], lengths[0], "float: length")
      .def_property_readonly(names[1], lengths[1], "float: length")
      .def_property_readonly(names[2], lengths[2], "float: length")
      .def("__repr__",
           [name = std::string(name), numbers](const Round& shape) {
             return name + std::string(py::repr(numbers(shape)));
           })
      .def(py::pickle(numbers, [](const py::tuple& state) {
        return std::make_shared<Round>(state[0].cast<Scalar>(), state[1].cast<Scalar>(),
                                       state[2].cast<Scalar>());
      }));
}

void bind_curved(py::module_& m) {
  bind_round<Cylinder>(m, "Cylinder", "Solid cylinder about the z axis, centred at the origin.");
  bind_round<Cone>(m, "Cone",
                   "Solid cone about the z axis: tip at half_length, base at -half_length.");
  py::class_<Ellipsoid, ConvexShape, std::shared_ptr<Ellipsoid>>(
      m, "Ellipsoid", "Solid ellipsoid about the origin, along the axes of its frame.")
      .def(py::init<const Vector3&>(), py::arg("semi_axes"), "(3,) lengths, > 0.")
      .def_property_readonly("semi_axes", &Ellipsoid::semi_axes, "numpy.ndarray: (3,) lengths")
      .def("__repr__",
           [](const Ellipsoid& e) {
             const py::object list = array_of(e.semi_axes()).attr("tolist")();
             return "Ellipsoid(" + std::string(py::str(list)) + ")";
           })
      .def(py::pickle([](const Ellipsoid& e) { return py::make_tuple(e.semi_axes()); },
                      [](const py::tuple& state) {
                        return std::make_shared<Ellipsoid>(vector_of(state[0], "semi_axes"));
                      }));
}

void bind_rounded(py::module_& m) {
  py::class_<RoundedBox, ConvexShape, std::shared_ptr<RoundedBox>>(
      m, "RoundedBox", "All points within a radius of an axis-aligned box about the origin.")
      .def(py::init<const Vector3&, Scalar>(), py::arg("half_extents"), py::arg("radius"),
           "half_extents of the core (3,), radius: lengths > 0.")
      .def_property_readonly("half_extents", &RoundedBox::half_extents,
                             "numpy.ndarray: (3,) lengths of the core")
      .def_property_readonly("radius", &RoundedBox::radius, "float: length")
      .def("__repr__",
           [](const RoundedBox& b) {
             const py::object list = array_of(b.half_extents()).attr("tolist")();
             return "RoundedBox(" + std::string(py::str(list)) + ", " +
                    std::string(py::repr(py::cast(b.radius()))) + ")";
           })
      .def(py::pickle(
          [](const RoundedBox& b) { return py::make_tuple(b.half_extents(), b.radius()); },
          [](const py::tuple& state) {
            return std::make_shared<RoundedBox>(vector_of(state[0], "half_extents"),
                                                state[1].cast<Scalar>());
          }));
  bind_three<RoundedCylinder>(
      m, "RoundedCylinder", "All points within an edge radius of a cylinder about the z axis.",
      {"radius", "half_length", "edge_radius"},
      {&RoundedCylinder::radius, &RoundedCylinder::half_length, &RoundedCylinder::edge_radius});
  bind_three<TaperedCapsule>(
      m, "TaperedCapsule",
      "Convex hull of a ball about z = -half_length and one about z = half_length.",
      {"bottom_radius", "top_radius", "half_length"},
      {&TaperedCapsule::bottom_radius, &TaperedCapsule::top_radius, &TaperedCapsule::half_length});
}

void bind_half_space(py::module_& m) {
  py::class_<HalfSpace, ConvexShape, std::shared_ptr<HalfSpace>>(
      m, "HalfSpace",
      "All points p with normal . p <= offset: a floor or a wall without an end. A solid. In a "
      "World static or kinematic.")
      .def(py::init<const Vector3&, Scalar>(), py::arg("normal") = Vector3(0, 0, 1),
           py::arg("offset") = 0.0, "normal (3,) outwards, of any length > 0; offset: length.")
      .def_property_readonly("normal", &HalfSpace::normal, "numpy.ndarray: (3,) unit")
      .def_property_readonly("offset", &HalfSpace::offset, "float: length")
      .def("__repr__",
           [](const HalfSpace& h) {
             const py::object list = array_of(h.normal()).attr("tolist")();
             return "HalfSpace(" + std::string(py::str(list)) + ", " +
                    std::string(py::repr(py::cast(h.offset()))) + ")";
           })
      .def(py::pickle([](const HalfSpace& h) { return py::make_tuple(h.normal(), h.offset()); },
                      [](const py::tuple& state) {
                        return std::make_shared<HalfSpace>(vector_of(state[0], "normal"),
                                                           state[1].cast<Scalar>());
                      }));
}

void bind_hull(py::module_& m) {
  py::class_<ConvexHull, ConvexShape, std::shared_ptr<ConvexHull>>(
      m, "ConvexHull", "Convex hull of points, found on exact predicates.")
      .def(py::init([](py::handle points, Scalar radius, const py::object& copy) {
             return std::make_shared<ConvexHull>(points_of(points, "points", copy_rule_of(copy)),
                                                 radius);
           }),
           py::arg("points"), py::arg("radius") = 0.0, py::kw_only(), py::arg("copy") = py::none(),
           "Points (N, 3), N >= 1, in any order; all points within a radius >= 0 of their hull.\n"
           "copy=False: InvalidArgument if they had to be brought into another layout first.")
      .def_property_readonly(
          "vertices",
          [](const py::object& self) {
            const auto vertices = self.cast<const ConvexHull&>().vertices();
            return view_of(vertices.data()->data(), vertices.size(), self);
          },
          "numpy.ndarray: (N, 3) corners in the order of the input, a read-only view")
      .def("dimension", &ConvexHull::dimension,
           "3 for a volume, 2 a polygon, 1 a segment, 0 a point.")
      .def("__repr__",
           [](const ConvexHull& h) {
             return "ConvexHull(" + std::to_string(h.vertices().size()) + " corners)";
           })
      .def("__reduce__", [](const py::object& self) {
        return py::make_tuple(py::type::of(self), py::make_tuple(self.attr("vertices"),
                                                                 self.attr("rounding_radius")()));
      });
}

void bind_compound(py::module_& m) {
  using Child = std::pair<std::shared_ptr<const Shape>, PoseArgument>;
  py::class_<CompoundShape, Shape, std::shared_ptr<CompoundShape>>(
      m, "CompoundShape", "Several shapes in one body, each at a fixed pose: their union.")
      .def(py::init([](const std::vector<Child>& children) {
             std::vector<CompoundChild> list;
             for (const auto& [shape, pose] : children) list.push_back({shape, pose.X});
             return std::make_shared<CompoundShape>(list);
           }),
           py::arg("children"),
           "Pairs (shape, pose X_CS); a compound in it is replaced by its own.")
      .def_property_readonly(
          "children",
          [](const CompoundShape& compound) {
            py::list list;
            for (const CompoundChild& child : compound.children()) {
              list.append(py::make_tuple(std::const_pointer_cast<Shape>(child.shape), child.X_CS));
            }
            return list;
          },
          "tuple[tuple[Shape, RigidPose], ...]: meshes and convex shapes, with their poses")
      .def("__repr__",
           [](const CompoundShape& c) {
             return "CompoundShape(" + std::to_string(c.children().size()) + " children)";
           })
      .def("__reduce__", [](const py::object& self) {
        return py::make_tuple(py::type::of(self), py::make_tuple(self.attr("children")));
      });
}

void bind_occupancy(py::module_& m) {
  m.def(
      "point_cloud",
      [](py::handle points, Scalar radius) {
        const auto rows = points_of(points, "points", CopyRule::IfNeeded);
        const py::gil_scoped_release unlocked;
        return std::make_shared<CompoundShape>(point_cloud(rows, radius));
      },
      py::arg("points"), py::arg("radius"),
      "All points within a radius > 0 of measured ones (N, 3): a compound of balls.");
  m.def(
      "occupancy",
      [](py::handle centers, const std::vector<Scalar>& sizes) {
        const auto rows = points_of(centers, "centers", CopyRule::IfNeeded);
        DYOP_REQUIRE(rows.size() == sizes.size(), "occupancy: ", rows.size(), " centers and ",
                     sizes.size(), " sizes");
        std::vector<OccupiedCube> cubes;
        for (std::size_t k = 0; k < rows.size(); ++k) cubes.push_back({rows[k], sizes[k]});
        const py::gil_scoped_release unlocked;
        return std::make_shared<CompoundShape>(occupancy(cubes));
      },
      py::arg("centers"), py::arg("sizes"),
      "Cubes along the axes as a compound of boxes: centers (N, 3) and lengths of edges (N,).");
  m.def(
      "load_octree",
      [](const py::object& file) {
        const auto path = path_of(file);
        const py::gil_scoped_release unlocked;
        return std::make_shared<CompoundShape>(occupancy(load_octree(path)));
      },
      py::arg("file"),
      "The occupied leaves of an OctoMap file (.bt or .ot) as a compound of boxes.");
}

}  // namespace

void bind_shapes(py::module_& m) {
  bind_shape_bases(m);
  bind_convex_shapes(m);
  bind_curved(m);
  bind_rounded(m);
  bind_half_space(m);
  bind_hull(m);
  bind_compound(m);
  bind_occupancy(m);
}

namespace {

using SharedMesh = std::shared_ptr<TriangleMesh>;

// Reads the caller's memory as it is; nothing if it is of another type or layout.
template <typename Number, typename Index>
SharedMesh read_in_place(const py::array& vertices, const py::array& triangles) {
  const auto points = rows_in_place<Number>(vertices);
  const auto corners = rows_in_place<Index>(triangles);
  if (points.data == nullptr || corners.data == nullptr) return nullptr;
  const py::gil_scoped_release unlocked;
  return std::make_shared<TriangleMesh>(TriangleMesh::from_arrays(points, corners));
}

// The arrays of another library's mesh, by the names that trimesh, Open3D, meshio and PyVista use.
std::pair<py::object, py::object> arrays_of(const py::object& mesh) {
  const auto first = [&](std::initializer_list<const char*> names) -> py::object {
    for (const char* name : names) {
      if (py::hasattr(mesh, name)) return mesh.attr(name);
    }
    return py::none();
  };
  const py::object vertices = first({"vertices", "points"});
  if (py::hasattr(mesh, "cells_dict")) {
    const py::dict cells = mesh.attr("cells_dict");
    for (const auto& [kind, numbers] : cells) {
      const std::string name = py::str(kind);
      DYOP_REQUIRE(name == "triangle" || name == "line" || name == "vertex",
                   "a mesh of triangles is wanted, this one has cells '", name, "'");
    }
    DYOP_REQUIRE(cells.contains("triangle"), "the mesh has no cells 'triangle'");
    return {vertices, cells["triangle"]};
  }
  const py::object triangles = first({"regular_faces", "faces", "triangles"});
  DYOP_REQUIRE(
      !vertices.is_none() && !triangles.is_none(),
      "without triangles, an object with vertices and faces is wanted, not a value of type ",
      std::string(py::str(py::type::of(mesh).attr("__name__"))));
  const py::object asarray = py::module_::import("numpy").attr("asarray");
  return {asarray(vertices), asarray(triangles)};
}

SharedMesh make_mesh(const py::object& vertices, const py::object& triangles,
                     const py::object& copy) {
  if (triangles.is_none()) {
    const auto [points, corners] = arrays_of(vertices);
    return make_mesh(points, corners, copy);
  }
  if (py::isinstance<py::array>(vertices) && py::isinstance<py::array>(triangles)) {
    SharedMesh mesh = read_in_place<double, std::int32_t>(vertices, triangles);
    if (!mesh) mesh = read_in_place<float, std::int32_t>(vertices, triangles);
    if (!mesh) mesh = read_in_place<double, std::uint32_t>(vertices, triangles);
    if (!mesh) mesh = read_in_place<float, std::uint32_t>(vertices, triangles);
    if (mesh) return mesh;
  }
  const CopyRule rule = copy_rule_of(copy);
  auto points = points_of(vertices, "vertices", rule);
  auto corners = triangles_of(triangles, rule);
  const py::gil_scoped_release unlocked;
  return std::make_shared<TriangleMesh>(std::move(points), std::move(corners));
}

SharedMesh with_vertices(const TriangleMesh& mesh, const py::object& vertices,
                         const py::object& copy) {
  if (py::isinstance<py::array>(vertices)) {
    const py::array array = vertices;
    if (const auto rows = rows_in_place<double>(array); rows.data != nullptr) {
      return std::make_shared<TriangleMesh>(mesh.with_vertices(rows));
    }
    if (const auto rows = rows_in_place<float>(array); rows.data != nullptr) {
      return std::make_shared<TriangleMesh>(mesh.with_vertices(rows));
    }
  }
  return std::make_shared<TriangleMesh>(
      mesh.with_vertices(points_of(vertices, "vertices", copy_rule_of(copy))));
}

void bind_triangle_mesh(py::module_& m) {
  py::class_<TriangleMesh, Shape, SharedMesh>(
      m, "TriangleMesh",
      "A set of triangles with a bounding hierarchy, built once: a surface with two sides.")
      .def(py::init(&make_mesh), py::arg("vertices"), py::arg("triangles") = py::none(),
           py::kw_only(), py::arg("copy") = py::none(),
           "Vertices (N, 3), length, and triangles (M, 3), vertex numbers; or one object that has\n"
           "both, such as a mesh of trimesh, Open3D, meshio or PyVista. float64 or float32 and "
           "int32\n"
           "or uint32 arrays are read where they are, rows at any stride; others are copied first, "
           "or\n"
           "refused under copy=False.")
      .def("with_vertices", &with_vertices, py::arg("vertices"), py::kw_only(),
           py::arg("copy") = py::none(),
           "The same triangles with other vertices (N, 3): refits the hierarchy.")
      .def_property_readonly(
          "vertices",
          [](const py::object& self) {
            const auto vertices = self.cast<const TriangleMesh&>().vertices();
            return view_of(vertices.empty() ? nullptr : vertices.data()->data(), vertices.size(),
                           self);
          },
          "numpy.ndarray: (N, 3) float64, length, a read-only view of the mesh's memory")
      .def_property_readonly(
          "triangles",
          [](const py::object& self) {
            const auto triangles = self.cast<const TriangleMesh&>().triangles();
            return view_of(triangles.data()->data(), triangles.size(), self);
          },
          "numpy.ndarray: (M, 3) int32 vertex numbers, a read-only view of the mesh's memory")
      .def("is_closed", &TriangleMesh::is_closed,
           "Whether every edge is used exactly twice, once in each direction.")
      .def("compute_shell_mass_properties", &TriangleMesh::compute_shell_mass_properties,
           py::arg("density"),
           "Mass spread evenly over the surface (density: mass per area), along segments where "
           "there\n"
           "is no area (mass per length), over points where there is no length (mass of each).")
      .def("__repr__",
           [](const TriangleMesh& mesh) {
             return "TriangleMesh(" + std::to_string(mesh.vertices().size()) + " vertices, " +
                    std::to_string(mesh.triangles().size()) + " triangles)";
           })
      // The hierarchy is built again: nobody can hand over one that does not fit.
      .def("__reduce__", [](const py::object& self) {
        return py::make_tuple(py::type::of(self),
                              py::make_tuple(self.attr("vertices"), self.attr("triangles")));
      });
  m.def(
      "winding_number",
      [](const TriangleMesh& mesh, const Vector3& p_B) { return winding_number(mesh, p_B); },
      py::arg("mesh"), py::arg("p_B"),
      "How many times the closed mesh winds around the point (3,), found exactly.");
  m.def(
      "contains", [](const TriangleMesh& mesh, const Vector3& p_B) { return contains(mesh, p_B); },
      py::arg("mesh"), py::arg("p_B"), "Whether the closed mesh winds around the point (3,).");
}

using Pair = std::pair<Scalar, Scalar>;

SharedMesh make_height_field(py::handle source, const Pair& spacing, const Pair& origin,
                             std::optional<Scalar> base) {
  using Array = py::array_t<Scalar, py::array::c_style | py::array::forcecast>;
  const Array heights = Array::ensure(source);
  DYOP_REQUIRE(heights, "heights must be an array of numbers");
  DYOP_REQUIRE(heights.ndim() == 2, "heights must be an array (rows, columns), not one of ",
               heights.ndim(), " dimensions");
  HeightGrid grid;
  grid.rows = std::size_t(heights.shape(0));
  grid.columns = std::size_t(heights.shape(1));
  grid.heights.assign(heights.data(), heights.data() + heights.size());
  grid.x = origin.first;
  grid.y = origin.second;
  grid.spacing_x = spacing.first;
  grid.spacing_y = spacing.second;
  grid.base = base;
  const py::gil_scoped_release unlocked;
  return std::make_shared<TriangleMesh>(height_field(grid));
}

void bind_scaled(py::module_& m) {
  m.def(
      "scaled",
      [](const Shape& shape, const std::variant<Scalar, Vector3>& factors) {
        const auto* const one = std::get_if<Scalar>(&factors);
        const Vector3 each = one ? Vector3::Constant(*one) : std::get<Vector3>(factors);
        const py::gil_scoped_release unlocked;
        return std::const_pointer_cast<Shape>(scaled(shape, each));
      },
      py::arg("shape"), py::arg("factors"),
      "The shape stretched along its axes by a factor or (3,), none of them zero; negative ones\n"
      "mirror it. A sphere may become an ellipsoid, a child of a compound a hull. What is round "
      "or\n"
      "rounded does not take all factors (InvalidArgument).");
}

void bind_height_field(py::module_& m) {
  m.def(
      "height_field", &make_height_field, py::arg("heights"), py::arg("spacing") = Pair{1, 1},
      py::kw_only(), py::arg("origin") = Pair{0, 0}, py::arg("base") = py::none(),
      "Ground as a closed mesh. heights (R, C), lengths along z: rows go along y, columns along "
      "x.\n"
      "spacing: (x, y) lengths > 0; origin: (x, y) of heights[0, 0]; base: height of the bottom,\n"
      "below all others.");
}

void bind_mesh_files(py::module_& m) {
  py::enum_<MeshCenter>(m, "MeshCenter", "Where the origin of a mesh is placed.")
      .value("None_", MeshCenter::None, "Left as it is.")
      .value("Bounds", MeshCenter::Bounds, "Middle of the bounding box.")
      .value("Mass", MeshCenter::Mass, "Centre of mass.");
  m.def(
      "load_mesh",
      [](const py::object& file, std::size_t most_unpacked_bytes) {
        const auto path = path_of(file);
        const py::gil_scoped_release unlocked;
        return std::make_shared<TriangleMesh>(load_mesh(path, {most_unpacked_bytes}));
      },
      py::arg("file"), py::kw_only(),
      py::arg("most_unpacked_bytes") = MeshFileLimits().most_unpacked_bytes,
      "All surfaces of an OBJ, OFF, PLY or STL file, or a grid of heights (.asc), as one mesh; "
      "also .gz.");
  m.def(
      "place_mesh",
      [](const TriangleMesh& mesh, Scalar scale, MeshCenter center, bool is_shell) {
        return std::make_shared<TriangleMesh>(place_mesh(mesh, {scale, center, is_shell}));
      },
      py::arg("mesh"), py::kw_only(), py::arg("scale") = 1.0, py::arg("center") = MeshCenter::None,
      py::arg("is_shell") = false, "The same triangles scaled, then moved to a centre.");
}

bool is_mesh_of_others(const py::object& thing) {
  const auto has_any = [&](std::initializer_list<const char*> names) {
    return std::any_of(names.begin(), names.end(),
                       [&](const char* name) { return py::hasattr(thing, name); });
  };
  const std::string home = py::str(py::getattr(py::type::of(thing), "__module__", py::str("")));
  return !home.starts_with("dyop") && has_any({"vertices", "points"}) &&
         has_any({"cells_dict", "regular_faces", "faces", "triangles"});
}

// They are taken wherever a shape is, as a mesh that lives as long as the call needs it.
void accept_meshes_of_others() {
  py::detail::get_type_info(typeid(Shape))
      ->implicit_conversions.push_back([](PyObject* object, PyTypeObject*) -> PyObject* {
        const auto thing = py::reinterpret_borrow<py::object>(object);
        if (!is_mesh_of_others(thing)) return nullptr;
        return py::cast(make_mesh(thing, py::none(), py::none())).release().ptr();
      });
}

}  // namespace

void bind_meshes(py::module_& m) {
  bind_triangle_mesh(m);
  bind_scaled(m);
  bind_height_field(m);
  bind_mesh_files(m);
  accept_meshes_of_others();
}

}  // namespace dyop::python
