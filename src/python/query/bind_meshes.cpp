// SPDX-License-Identifier: BSD-3-Clause
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "dyop/core/error.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/geometry/winding_number.h"
#include "dyop/io/mesh_file.h"
#include "python/bindings.h"
#include "python/glue/record.h"

namespace dyop::python {
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
           py::arg("area_density"), "Mass spread evenly over the surface (mass per area).")
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
      "All surfaces of an OBJ, OFF, PLY or STL file (and .gz) as one mesh.");
  m.def(
      "place_mesh",
      [](const TriangleMesh& mesh, Scalar scale, MeshCenter center, bool is_shell) {
        return std::make_shared<TriangleMesh>(place_mesh(mesh, {scale, center, is_shell}));
      },
      py::arg("mesh"), py::kw_only(), py::arg("scale") = 1.0, py::arg("center") = MeshCenter::None,
      py::arg("is_shell") = false, "The same triangles scaled, then moved to a centre.");
}

}  // namespace

void bind_meshes(py::module_& m) {
  bind_triangle_mesh(m);
  bind_mesh_files(m);
}

}  // namespace dyop::python
