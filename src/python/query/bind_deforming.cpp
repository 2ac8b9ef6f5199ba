// SPDX-License-Identifier: BSD-3-Clause
#include <memory>

#include "dyop/core/error.h"
#include "dyop/toi/deforming_mesh.h"
#include "dyop/toi/deforming_time_of_impact.h"
#include "dyop/toi/vertex_time_of_impact.h"
#include "python/bindings.h"
#include "python/query/queries.h"

namespace dyop::python {
namespace {

// Queries in other threads read a mesh without the interpreter's lock: it must not change
// meanwhile.
struct SharedDeformingMesh {
  DeformingMesh mesh;
  int readers = 0;  // under the lock

  void require_unread() const {
    DYOP_REQUIRE(readers == 0, "the deforming mesh is being read by ", readers, " queries");
  }
};
using MeshPointer = std::shared_ptr<SharedDeformingMesh>;

class ReadGuard {
 public:
  explicit ReadGuard(SharedDeformingMesh& mesh) : mesh_(mesh) { ++mesh_.readers; }
  ~ReadGuard() { --mesh_.readers; }
  ReadGuard(const ReadGuard&) = delete;
  ReadGuard& operator=(const ReadGuard&) = delete;

 private:
  SharedDeformingMesh& mesh_;
};

py::array vertices_view(std::span<const Vector3> vertices) {
  // A copy: refit() changes the mesh's memory.
  return py::array_t<double>({py::ssize_t(vertices.size()), py::ssize_t{3}},
                             vertices.data()->data());
}

void bind_deforming_mesh(py::module_& m) {
  const auto rows = [](const py::object& source, const char* what) {
    return points_of(source, what, CopyRule::IfNeeded);
  };
  py::class_<SharedDeformingMesh, MeshPointer>(
      m, "DeformingMesh",
      "A mesh whose vertices move on straight lines over an interval, in world.")
      .def(py::init([rows](const py::object& begin, const py::object& end,
                           const py::object& triangles) {
             return std::make_shared<SharedDeformingMesh>(
                 SharedDeformingMesh{DeformingMesh(rows(begin, "begin"), rows(end, "end"),
                                                   triangles_of(triangles, CopyRule::IfNeeded))});
           }),
           py::arg("begin"), py::arg("end"), py::arg("triangles"),
           "Vertices (N, 3) at both ends of the interval, length, and triangles (M, 3).")
      .def(
          "refit",
          [rows](SharedDeformingMesh& self, const py::object& begin, const py::object& end) {
            self.require_unread();
            self.mesh.refit(rows(begin, "begin"), rows(end, "end"));
          },
          py::arg("begin"), py::arg("end"), "New positions (N, 3) at both ends.")
      .def(
          "advance",
          [rows](SharedDeformingMesh& self, const py::object& next_end) {
            self.require_unread();
            self.mesh.advance(rows(next_end, "next_end"));
          },
          py::arg("next_end"), "The next interval: starts where the last one ended.")
      .def_property_readonly(
          "begin", [](const SharedDeformingMesh& s) { return vertices_view(s.mesh.begin()); },
          "numpy.ndarray: (N, 3), read-only")
      .def_property_readonly(
          "end", [](const SharedDeformingMesh& s) { return vertices_view(s.mesh.end()); },
          "numpy.ndarray: (N, 3), read-only")
      .def_property_readonly(
          "triangles",
          [](const py::object& self) {
            const auto triangles = self.cast<const SharedDeformingMesh&>().mesh.triangles();
            return view_of(triangles.data()->data(), triangles.size(), self);
          },
          "numpy.ndarray: (M, 3) int32, a read-only view")
      .def(
          "snapshot",
          [](const SharedDeformingMesh& self, Scalar s) {
            return std::make_shared<TriangleMesh>(self.mesh.snapshot(s));
          },
          py::arg("s"), "The mesh at the fraction s of the interval, 0 to 1.")
      .def("__repr__",
           [](const SharedDeformingMesh& self) {
             return "DeformingMesh(" + std::to_string(self.mesh.begin().size()) + " vertices, " +
                    std::to_string(self.mesh.triangles().size()) + " triangles)";
           })
      .def("__reduce__", [](const py::object& self) {
        return py::make_tuple(
            py::type::of(self),
            py::make_tuple(self.attr("begin"), self.attr("end"), self.attr("triangles")));
      });
}

// One query in slices. `ask` and `ask_again` get the options of a slice and the workspace.
template <typename Ask, typename AskAgain>
ToiResult run_deforming_query(const PythonToiOptions* options, PythonWorkspace* given,
                              std::vector<std::shared_ptr<const void>> held, const Ask& ask,
                              const AskAgain& ask_again) {
  PythonWorkspace own;
  PythonWorkspace& kept = given != nullptr ? *given : own;
  kept.held = std::move(held);
  return answer_in_slices(
      options_or_default(options),
      [&](const ToiOptions& slice) { return ask(slice, kept.workspace); },
      [&](const ToiOptions& slice) { return ask_again(slice, kept.workspace); });
}

template <bool kResume>
ToiResult two_meshes(const MeshPointer& a, const MeshPointer& b, const IntervalArgument& interval,
                     const PythonToiOptions* options, PythonWorkspace* workspace) {
  const ReadGuard reading_a(*a);
  const ReadGuard reading_b(*b);
  const auto resume = [&](const ToiOptions& o, ToiWorkspace& w) {
    return resume_time_of_impact(a->mesh, b->mesh, interval.interval, o, w);
  };
  const auto start = [&](const ToiOptions& o, ToiWorkspace& w) {
    return kResume ? resume(o, w) : time_of_impact(a->mesh, b->mesh, interval.interval, o, w);
  };
  return run_deforming_query(options, workspace, {a, b}, start, resume);
}

template <bool kResume>
ToiResult mesh_and_rigid(const MeshPointer& a, const std::shared_ptr<TriangleMesh>& b,
                         const std::shared_ptr<Motion>& X_WB, const IntervalArgument& interval,
                         const PythonToiOptions* options, PythonWorkspace* workspace) {
  const ReadGuard reading(*a);
  const auto resume = [&](const ToiOptions& o, ToiWorkspace& w) {
    return resume_time_of_impact(a->mesh, *b, *X_WB, interval.interval, o, w);
  };
  const auto start = [&](const ToiOptions& o, ToiWorkspace& w) {
    return kResume ? resume(o, w) : time_of_impact(a->mesh, *b, *X_WB, interval.interval, o, w);
  };
  return run_deforming_query(options, workspace, {a, b, X_WB}, start, resume);
}

void bind_deforming_queries(py::module_& m) {
  m.def("time_of_impact", &two_meshes<false>, py::arg("a").none(false), py::arg("b").none(false),
        py::arg("interval"), py::arg("options") = py::none(), py::arg("workspace") = py::none(),
        "Two deforming meshes; vertices are at begin and end at the two ends of interval.");
  m.def("time_of_impact", &mesh_and_rigid<false>, py::arg("a").none(false),
        py::arg("b").none(false), py::arg("X_WB").none(false), py::arg("interval"),
        py::arg("options") = py::none(), py::arg("workspace") = py::none(),
        "A deforming mesh A and a rigid mesh B on any motion.");
  m.def("resume_time_of_impact", &two_meshes<true>, py::arg("a").none(false),
        py::arg("b").none(false), py::arg("interval"), py::arg("options"),
        py::arg("workspace").none(false), "Of two deforming meshes.");
  m.def("resume_time_of_impact", &mesh_and_rigid<true>, py::arg("a").none(false),
        py::arg("b").none(false), py::arg("X_WB").none(false), py::arg("interval"),
        py::arg("options"), py::arg("workspace").none(false), "Of a deforming and a rigid mesh.");
}

// Rows of an array as paths.
template <std::size_t kCount>
std::array<VertexPath, kCount> paths_of(py::handle begin, py::handle end) {
  const auto b = points_of(begin, "begin", CopyRule::IfNeeded);
  const auto e = points_of(end, "end", CopyRule::IfNeeded);
  DYOP_REQUIRE(b.size() == kCount && e.size() == kCount, "there must be ", kCount,
               " points at each end, not ", b.size(), " and ", e.size());
  std::array<VertexPath, kCount> paths;
  for (std::size_t k = 0; k < kCount; ++k) paths[k] = {b[k], e[k]};
  return paths;
}

void bind_vertex_paths(py::module_& m) {
  py::enum_<ContactRule>(m, "ContactRule", "What counts as an impact.")
      .value("WithinTolerance", ContactRule::WithinTolerance)
      .value("Exact", ContactRule::Exact, "A point in common, decided without rounding.");
  Record<VertexToiOptions>(m, "VertexToiOptions", "Options of queries of vertex paths.")
      .option<&VertexToiOptions::target_distance>("target_distance", "float: length, >= 0")
      .option<&VertexToiOptions::distance_tolerance>(
          "distance_tolerance",
          "Optional[float]: default a millionth of the smaller element's size")
      .option<&VertexToiOptions::contact_rule>("contact_rule", "ContactRule: what is an impact")
      .option<&VertexToiOptions::max_steps>("max_steps", "int: largest number of steps, >= 1")
      .finish();
  Record<VertexToiResult>(m, "VertexToiResult", "Result of a query of vertex paths.")
      .field<&VertexToiResult::status>("status", "ToiStatus: what is promised")
      .field<&VertexToiResult::t_safe>("t_safe", "float: proven apart until then")
      .field<&VertexToiResult::contact>("contact", "Optional[ImpactContact]: at the impact")
      .field<&VertexToiResult::rounding_allowance>("rounding_allowance", "float: length")
      .field<&VertexToiResult::steps>("steps", "int: closest points computed")
      .finish();
  m.def(
      "vertex_face_time_of_impact",
      [](const py::object& begin, const py::object& end, const IntervalArgument& interval,
         const VertexToiOptions* options) {
        const auto p = paths_of<4>(begin, end);
        return time_of_impact(VertexFacePaths{p[0], {p[1], p[2], p[3]}}, interval.interval,
                              options != nullptr ? *options : VertexToiOptions());
      },
      py::arg("begin"), py::arg("end"), py::arg("interval") = py::make_tuple(0.0, 1.0),
      py::arg("options") = py::none(),
      "When a moving vertex (A, row 0) first meets a moving triangle (B, rows 1 to 3): points\n"
      "(4, 3) at both ends of the interval, on straight lines between.");
  m.def(
      "edge_edge_time_of_impact",
      [](const py::object& begin, const py::object& end, const IntervalArgument& interval,
         const VertexToiOptions* options) {
        const auto p = paths_of<4>(begin, end);
        return time_of_impact(EdgeEdgePaths{{p[0], p[1]}, {p[2], p[3]}}, interval.interval,
                              options != nullptr ? *options : VertexToiOptions());
      },
      py::arg("begin"), py::arg("end"), py::arg("interval") = py::make_tuple(0.0, 1.0),
      py::arg("options") = py::none(),
      "When two moving edges (A rows 0 and 1, B rows 2 and 3) first meet: points (4, 3).");
}

}  // namespace

void bind_deforming(py::module_& m) {
  bind_deforming_mesh(m);
  bind_deforming_queries(m);
  bind_vertex_paths(m);
}

}  // namespace dyop::python
