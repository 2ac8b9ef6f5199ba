// SPDX-License-Identifier: BSD-3-Clause
#include <atomic>
#include <memory>
#include <mutex>
#include <optional>

#include "dyop/core/error.h"
#include "dyop/haptics/haptic_runner.h"
#include "dyop/tissue/soft_tissue.h"
#include "python/bindings.h"
#include "python/glue/arguments.h"
#include "python/glue/record.h"
#include "python/haptics/mesh_fields.h"
#include "python/haptics/python_session.h"

namespace dyop::python {
namespace {

// --- what C++ and Python do without the lock ----------------------------------------------------

// A SoftTissue that threads of Python use in turn, without the interpreter's lock.
class PythonTissue {
 public:
  explicit PythonTissue(SoftTissue tissue) : tissue_(std::move(tissue)) {}

  template <typename Use>
  auto use(const Use& use) {
    const py::gil_scoped_release unlocked;
    const std::lock_guard one(mutex_);
    require_here();
    return use(*tissue_);
  }
  std::string describe() {
    const py::gil_scoped_release unlocked;
    const std::lock_guard one(mutex_);
    if (!tissue_) return "SoftTissue(handed to a SoftTissueModel)";
    return "SoftTissue(" + std::to_string(tissue_->cube_count()) + " cubes)";
  }
  SoftTissue take() {
    const std::lock_guard one(mutex_);
    require_here();
    SoftTissue taken = std::move(*tissue_);
    tissue_.reset();
    return taken;
  }

 private:
  void require_here() const {
    DYOP_REQUIRE(tissue_.has_value(), "the SoftTissue was handed to a SoftTissueModel");
  }
  std::mutex mutex_;
  std::optional<SoftTissue> tissue_;
};

// A SoftTissueModel that Python may look at while a session asks it in another thread.
class PythonTissueModel final : public TissueModel {
 public:
  PythonTissueModel(SoftTissue tissue, const ModelledObstacle& obstacle)
      : model_(std::move(tissue), obstacle) {}

  ContactSearch search() const override {
    const std::lock_guard one(mutex_);
    return model_.search();
  }
  std::optional<TissueMesh> cut(const TissueNews& news) override {
    const std::lock_guard one(mutex_);
    return model_.cut(news);
  }
  void step(const TissueNews& news, std::span<Vector3> vertices) override {
    const std::lock_guard one(mutex_);
    model_.step(news, vertices);
  }

  /// With the interpreter's lock, which it does not hold meanwhile.
  template <typename Use>
  auto use(const Use& use) {
    const py::gil_scoped_release unlocked;
    const std::lock_guard one(mutex_);
    return use(model_);
  }

 private:
  mutable std::mutex mutex_;
  SoftTissueModel model_;
};

// What a model of Python gives for a mesh: nothing, a TissueMesh, or a pair of arrays.
std::optional<TissueMesh> mesh_of(const py::object& mesh) {
  if (mesh.is_none()) return std::nullopt;
  if (py::isinstance<TissueMesh>(mesh)) return mesh.cast<TissueMesh>();
  if (!py::isinstance<py::tuple>(mesh) || py::len(mesh) != 2) {
    throw py::type_error(
        "cut must return None, a TissueMesh or a pair (vertices, triangles), not a value of type " +
        std::string(py::str(py::type::handle_of(mesh).attr("__name__"))));
  }
  const auto pair = py::reinterpret_borrow<py::tuple>(mesh);
  return TissueMesh{points_of(pair[0], "vertices", CopyRule::IfNeeded),
                    triangles_of(pair[1], CopyRule::IfNeeded)};
}

// Calls shape(an array with the vertices), which may change it or return another one.
template <typename Shape>
void reshape(const Shape& shape, const char* what, std::span<Vector3> vertices) {
  const py::array_t<double> given = copy_of(vertices);
  const py::object result = shape(given);
  const Doubles rows =
      rows_of(result.is_none() ? py::object(given) : result, 3, what, CopyRule::IfNeeded);
  const auto points = points_in(rows);
  DYOP_REQUIRE(points.size() == vertices.size(), what, " must give ", vertices.size(),
               " vertices, not ", points.size());
  std::copy(points.begin(), points.end(), vertices.begin());
}

// The C++ part of an object whose class derives from TissueModel in Python.
class DerivedTissueModel final : public TissueModel, public DerivedInPython {
 public:
  ContactSearch search() const override {
    const TissueCall call;
    return read_as<ContactSearch>(required_method<TissueModel>(this, "search")(),
                                  "search must return a ContactSearch");
  }
  std::optional<TissueMesh> cut(const TissueNews& news) override {
    const TissueCall call;
    const py::function method = method_of<TissueModel>(this, "cut");
    return method ? mesh_of(method(news)) : std::nullopt;
  }
  void step(const TissueNews& news, std::span<Vector3> vertices) override {
    const TissueCall call;
    const py::function method = required_method<TissueModel>(this, "step");
    reshape([&](const py::array& given) { return py::object(method(news, given)); }, "step",
            vertices);
  }
};

// Gives tissue to a session whose loop is Python's.
class PythonFeeder {
 public:
  PythonFeeder(std::shared_ptr<PythonSession> session, const TissueFeed& feed)
      : session_(std::move(session)), feeder_(session_->own(), feed) {}

  // A model that is being asked in another thread, or that calls this itself, has nothing to give.
  bool offer() {
    if (is_offering_.exchange(true)) return false;
    const std::unique_ptr<std::atomic<bool>, void (*)(std::atomic<bool>*)> end(
        &is_offering_, [](std::atomic<bool>* flag) { *flag = false; });
    const py::gil_scoped_release unlocked;
    return feeder_.offer();
  }
  void tell(const std::vector<DevicePose>& devices, const std::vector<HapticTick>& ticks,
            Scalar dt) {
    feeder_.tell(devices, dt, ticks);
  }

 private:
  std::shared_ptr<PythonSession> session_;
  TissueFeeder feeder_;
  std::atomic<bool> is_offering_{false};
};

// --- records ------------------------------------------------------------------------------------

Field fixed_field() {
  return {"fixed",
          [](const void* r, py::handle) {
            const auto& boxes = static_cast<const SoftTissueOptions*>(r)->fixed;
            std::vector<Vector3> corners;
            for (const AlignedBox& box : boxes) {
              corners.push_back(box.min());
              corners.push_back(box.max());
            }
            return sealed(copy_of(corners).attr("reshape")(boxes.size(), 2, 3));
          },
          [](void* r, py::handle value) {
            const py::object array = py::module_::import("numpy").attr("asarray")(value);
            const py::tuple shape = array.attr("shape");
            const bool is_empty = array.attr("size").cast<std::size_t>() == 0;
            DYOP_REQUIRE(is_empty || (shape.size() == 3 && shape[1].cast<int>() == 2 &&
                                      shape[2].cast<int>() == 3),
                         "fixed must be boxes (N, 2, 3), each its least and largest corner, not ",
                         std::string(py::str(py::handle(shape))));
            std::vector<AlignedBox> boxes;
            if (!is_empty) {
              const auto corners =
                  points_of(array.attr("reshape")(-1, 3), "fixed", CopyRule::IfNeeded);
              for (std::size_t k = 0; k < corners.size(); k += 2) {
                DYOP_REQUIRE(!(corners[k].array() > corners[k + 1].array()).any(), "fixed[", k / 2,
                             "] is empty: from ", corners[k], " to ", corners[k + 1]);
                boxes.emplace_back(corners[k], corners[k + 1]);
              }
            }
            static_cast<SoftTissueOptions*>(r)->fixed = std::move(boxes);
          }};
}

void bind_tissue_options(py::module_& m) {
  using M = TissueMaterial;
  Record<M>(
      m, "TissueMaterial",
      "An isotropic elastic material, in any consistent units. With millimetres, newtons and\n"
      "seconds a liver has a modulus of 5e-3, a ratio of 0.45 and a density of 1.05e-9.")
      .option<&M::youngs_modulus>("youngs_modulus", "float: force per area, > 0")
      .option<&M::poissons_ratio>("poissons_ratio", "float: between -1 and 0.5")
      .option<&M::density>("density", "float: mass per volume, > 0")
      .option<&M::drag>("drag", "float: force per mass and velocity, 1 / time, >= 0")
      .option<&M::viscosity>("viscosity", "float: stress of a strain rate per strain, time, >= 0")
      .finish();
  using O = SoftTissueOptions;
  Record<O>(m, "SoftTissueOptions", "Options of a SoftTissue.")
      .option<&O::material>("material", "TissueMaterial: of all of it")
      .option<&O::cube_edge>("cube_edge", "float: of the lattice's cubes, length, > 0")
      .option<&O::period>("period", "float: of a step, time, > 0")
      .option<&O::gravity_W>("gravity_W", "numpy.ndarray: (3,), length per time squared")
      .custom(
          fixed_field(),
          "numpy.ndarray: (N, 2, 3), read-only: boxes from their least to their largest corner, "
          "world, at rest; nodes inside never move, which holds the tissue there to within a "
          "cube. About a single point: a box one cube_edge wide")
      .option<&O::tolerance>("tolerance", "float: relative, of a step's velocities, 0 to 1")
      .option<&O::most_iterations>("most_iterations", "int: of a solve, >= 1")
      .finish();
  using F = SurfaceForce;
  Record<F>(m, "SurfaceForce", "A force on a point of the surface.")
      .option<&F::triangle>("triangle", "int: number")
      .option<&F::weights>("weights", "numpy.ndarray: (3,), of its corners, with sum one")
      .option<&F::force_W>("force_W", "numpy.ndarray: (3,)")
      .finish();
  Record<TissueKerf>(m, "TissueKerf", "What a blade takes out of tissue: a thin box.")
      .option<&TissueKerf::X_WK>("X_WK", "RigidPose: of its middle and axes")
      .option<&TissueKerf::half_extents>("half_extents", "numpy.ndarray: (3,), length, > 0")
      .finish();
}

void bind_tissue_results(py::module_& m) {
  using B = TissueBalance;
  Record<B> balance(m, "TissueBalance", "Sums over the nodes that can move.");
  balance.field<&B::kinetic_energy>("kinetic_energy", "float: force times length")
      .field<&B::elastic_energy>("elastic_energy", "float: the same")
      .field<&B::potential_energy>("potential_energy", "float: of gravity, about the origin")
      .field<&B::momentum_W>("momentum_W", "numpy.ndarray: (3,)")
      .field<&B::angular_momentum_W>("angular_momentum_W", "numpy.ndarray: (3,), about the origin")
      .field<&B::mass>("mass", "float: of them")
      .finish();
  balance.type.def_property_readonly("energy", &B::energy, "float: the sum of the three energies");
  py::enum_<CutStatus>(m, "CutStatus", "What came of a cut.")
      .value("NotRun", CutStatus::NotRun, "There was none.")
      .value("Missed", CutStatus::Missed, "The kerf does not meet the tissue.")
      .value("Cut", CutStatus::Cut, "The tissue has another surface.")
      .value("NothingLeft", CutStatus::NothingLeft, "The kerf holds all; nothing is cut.")
      .value("Unclear", CutStatus::Unclear, "Sides lie over each other there; nothing is cut.");
  Record<CutReport>(m, "CutReport", "What came of a cut.")
      .field<&CutReport::status>("status", "CutStatus: only after Cut the tissue is another")
      .field<&CutReport::parts>("parts", "int: of the tissue that are not connected")
      .finish();
  Record<TissueMesh>(m, "TissueMesh", "Another mesh that a deforming obstacle goes on as.")
      .custom(vertices_field<TissueMesh>(), "numpy.ndarray: (N, 3), world, read-only")
      .custom(triangles_field<TissueMesh>(), "numpy.ndarray: (M, 3) int32, read-only")
      .finish();
}

void bind_joint_records(py::module_& m) {
  using T = JointTool;
  Record<T>(m, "JointTool", "The tool on its springs, as step_jointly() sees it.")
      .option<&T::coupling>("coupling", "CouplingOptions: its springs, of which none may be 0")
      .option<&T::hinges>("hinges", "tuple[ToolHinge, ...]: assign all of them")
      .option<&T::tool>("tool", "ToolPose: where the contacts were found")
      .option<&T::device>("device", "ToolPose: to where the springs pull it")
      .option<&T::start>("start", "Optional[ToolPose]: when the step begins; None: as tool")
      .option<&T::rest_offset>("rest_offset", "float: gap of a loaded contact, >= 0")
      .option<&T::friction>("friction", "float: Coulomb's, >= 0")
      .finish();
  using R = JointReport;
  Record<R>(m, "JointReport", "What a joint step was like.")
      .field<&R::iterations>("iterations", "int: of the tissue's solves")
      .field<&R::rounds>("rounds", "int: of the contacts' solves")
      .field<&R::is_exact>("is_exact", "bool: every contact was found open, sticking or slipping")
      .field<&R::springs_share>("springs_share", "float: of the contacts' compliance, 0 to 1")
      .field<&R::tools>("tools", "tuple[ToolPose, ...]: at the step's end")
      .finish();
  Record<ModelledTool>(m, "ModelledTool", "A further tool of a session with a SoftTissueModel.")
      .option<&ModelledTool::coupling>("coupling", "CouplingOptions: its springs")
      .option<&ModelledTool::hinges>("hinges", "tuple[ToolHinge, ...]: assign all of them")
      .finish();
  Record<ModelledCut>(m, "ModelledCut", "A cut of a SoftTissueModel.")
      .option<&ModelledCut::steps>("steps", "int: after so many steps, >= 0")
      .option<&ModelledCut::kerf>("kerf", "TissueKerf: what is taken out")
      .finish();
  using O = ModelledObstacle;
  Record<O>(m, "ModelledObstacle", "What a SoftTissueModel needs to know: modelled_obstacle().")
      .option<&O::coupling>("coupling",
                            "CouplingOptions: of the first tool, of which none may be 0")
      .option<&O::hinges>("hinges", "tuple[ToolHinge, ...]: of the first tool; assign a whole list")
      .option<&O::rest_gap>("rest_gap", "float: the obstacle's margin plus the rest offset")
      .option<&O::friction>("friction", "float: Coulomb's, >= 0")
      .option<&O::more_tools>("more_tools", "tuple[ModelledTool, ...]: as hinges")
      .option<&O::cuts>("cuts", "tuple[ModelledCut, ...]: in order of time; as hinges")
      .finish();
}

void bind_news(py::module_& m) {
  Record<ToolNews>(m, "ToolNews", "What a model of tissue is told of a tool.")
      .option<&ToolNews::device>("device", "DevicePose: of the last tick")
      .option<&ToolNews::tick>("tick", "HapticTick: the last one; NotRun before the first")
      .option<&ToolNews::impulse_W>(
          "impulse_W",
          "numpy.ndarray: (3,), what the obstacle did to the tool since the model was last told, "
          "force times the time in which the obstacle moved")
      .finish();
  using N = TissueNews;
  Record<N>(m, "TissueNews", "What a model of tissue is told when a snapshot is wanted of it.")
      .option<&N::number>("number", "int: of the snapshot, counted from 1")
      .option<&N::tools>("tools", "tuple[ToolNews, ...]: all of the session")
      .option<&N::progress>("progress", "ObstacleProgress: at the end of the last tick")
      .option<&N::contacts>(
          "contacts",
          "tuple[ToolContactPoint, ...]: where tools touch the obstacle or soon may, "
          "without forces")
      .finish();
}

// --- tissue by itself ---------------------------------------------------------------------------

// None, SurfaceForces, or three arrays.
std::vector<SurfaceForce> forces_of(const py::object& source) {
  std::vector<SurfaceForce> forces;
  if (source.is_none()) return forces;
  const bool is_arrays = py::isinstance<py::tuple>(source) && py::len(source) == 3 &&
                         !py::isinstance<SurfaceForce>(source[py::int_(0)]);
  if (!is_arrays) {
    for (const py::handle one : py::iter(source)) {
      forces.push_back(read_as<SurfaceForce>(
          one, "forces must be SurfaceForces or (triangles, weights, forces_W)"));
    }
    return forces;
  }
  const auto arrays = py::reinterpret_borrow<py::tuple>(source);
  const auto numbers = read_as<std::vector<std::int32_t>>(
      arrays[0], "the triangles of forces must be (N,) integers");
  const auto weights = points_of(arrays[1], "the weights of forces", CopyRule::IfNeeded);
  const auto given = points_of(arrays[2], "forces_W", CopyRule::IfNeeded);
  DYOP_REQUIRE(weights.size() == numbers.size() && given.size() == numbers.size(),
               "forces: ", numbers.size(), " triangles, ", weights.size(), " weights and ",
               given.size(), " forces_W");
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    forces.push_back({numbers[k], weights[k], given[k]});
  }
  return forces;
}

SoftTissue make_tissue(const TriangleMesh& mesh, const SoftTissueOptions& options) {
  const py::gil_scoped_release unlocked;
  return SoftTissue(mesh, options);
}

std::shared_ptr<PythonTissue> tissue_of_arrays(const py::object& vertices,
                                               const py::object& triangles,
                                               const SoftTissueOptions& options) {
  return std::make_shared<PythonTissue>(
      make_tissue(TriangleMesh(points_of(vertices, "vertices", CopyRule::IfNeeded),
                               triangles_of(triangles, CopyRule::IfNeeded)),
                  options));
}

std::shared_ptr<PythonTissue> tissue_of_mesh(const std::shared_ptr<const Shape>& mesh,
                                             const SoftTissueOptions& options) {
  const auto* triangles = dynamic_cast<const TriangleMesh*>(mesh.get());
  DYOP_REQUIRE(triangles != nullptr, "SoftTissue: the surface must be a TriangleMesh");
  return std::make_shared<PythonTissue>(make_tissue(*triangles, options));
}

// Of a SoftTissue as it is now, copied in use().
constexpr auto kVertices = [](const SoftTissue& tissue) {
  return std::vector<Vector3>(tissue.vertices().begin(), tissue.vertices().end());
};
constexpr auto kTriangles = [](const SoftTissue& tissue) {
  return std::vector<TriangleIndices>(tissue.triangles().begin(), tissue.triangles().end());
};

using TissueClass = py::class_<PythonTissue, std::shared_ptr<PythonTissue>>;

void bind_making_tissue(TissueClass& tissue) {
  tissue
      .def(py::init(&tissue_of_mesh), py::arg("mesh").none(false), py::arg("options"),
           "A closed mesh with positive volume, in world, at rest.")
      .def(py::init(&tissue_of_arrays), py::arg("vertices"), py::arg("triangles"),
           py::arg("options"), "Vertices (N, 3) and triangles (M, 3) of such a mesh.")
      .def_property_readonly(
          "options",
          [](PythonTissue& self) { return self.use([](const auto& t) { return t.options(); }); },
          "SoftTissueOptions: those it was made with")
      .def_property_readonly(
          "cube_count",
          [](PythonTissue& self) { return self.use([](const auto& t) { return t.cube_count(); }); },
          "int: of the lattice")
      .def_property_readonly(
          "node_count",
          [](PythonTissue& self) { return self.use([](const auto& t) { return t.node_count(); }); },
          "int: of the lattice")
      .def_property_readonly(
          "vertices", [](PythonTissue& self) { return copy_of(self.use(kVertices)); },
          "numpy.ndarray: (N, 3), of the surface, now, in world; read-only")
      .def_property_readonly(
          "triangles", [](PythonTissue& self) { return copy_of(self.use(kTriangles)); },
          "numpy.ndarray: (M, 3) int32, changed by cut() alone; read-only");
}

void bind_moving_tissue(TissueClass& tissue) {
  tissue
      .def(
          "step",
          [](PythonTissue& self, const py::object& forces) {
            const auto read = forces_of(forces);
            return self.use([&](SoftTissue& t) { return t.step(read); });
          },
          py::arg("forces") = py::none(),
          "One period on, under these forces, held over the step: SurfaceForces, or a tuple of\n"
          "arrays (triangles (N,), weights (N, 3), forces_W (N, 3)). The iterations of the solve;\n"
          "options.most_iterations: it may not have converged.")
      .def(
          "velocity",
          [](PythonTissue& self, std::int32_t triangle, const Vector3& weights) {
            return self.use([&](const SoftTissue& t) { return t.velocity(triangle, weights); });
          },
          py::arg("triangle"), py::arg("weights"), "(3,), of a point of the surface.")
      .def(
          "set_velocity",
          [](PythonTissue& self, const Vector3& v_W, const Vector3& w_W) {
            self.use([&](SoftTissue& t) { t.set_velocity(v_W, w_W); });
          },
          py::arg("v_W"), py::arg("w_W"),
          "Gives all nodes that can move v + w x p; p from the world's origin.")
      .def(
          "move",
          [](PythonTissue& self, const PoseArgument& X) {
            self.use([&](SoftTissue& t) { t.move(X.X); });
          },
          py::arg("X"), "Moves every node to X p and turns velocities: the body, elsewhere.")
      .def(
          "balance",
          [](PythonTissue& self) { return self.use([](const auto& t) { return t.balance(); }); },
          "Energies, momenta and mass.")
      .def(
          "cut",
          [](PythonTissue& self, const TissueKerf& kerf) {
            return self.use([&](SoftTissue& t) { return t.cut(kerf); });
          },
          py::arg("kerf"),
          "Takes everything inside the kerf away, as the tissue is now, and closes it by caps.\n"
          "Vertices and triangles have other numbers after CutStatus.Cut. Both sides of a kerf\n"
          "move on their own, however thin it is.");
}

void bind_soft_tissue(py::module_& m) {
  TissueClass type(
      m, "SoftTissue",
      "A body of soft tissue: a closed mesh embedded in a lattice of cubes of corotational linear\n"
      "elasticity, with implicit Euler steps of a fixed period. Calls release the interpreter's\n"
      "lock, and those from several threads take turns.");
  type.def("__repr__", &PythonTissue::describe);
  bind_making_tissue(type);
  bind_moving_tissue(type);
  m.def(
      "step_jointly",
      [](PythonTissue& tissue, const std::vector<JointTool>& tools,
         std::vector<ToolContactPoint> contacts, const py::object& forces) {
        const auto read = forces_of(forces);
        JointReport report = tissue.use(
            [&](SoftTissue& t) { return step_jointly(t, std::span(tools), contacts, read); });
        return std::pair(std::move(report), std::move(contacts));
      },
      py::arg("tissue"), py::arg("tools"), py::arg("contacts"), py::arg("forces") = py::none(),
      "One step of tissue and tools on their springs together: gaps are kept, and friction holds\n"
      "or slips. contacts: of HapticSession.find_contacts(). The report, and the contacts with\n"
      "their state and the mean force of the step on the tool. The first call does what\n"
      "prepare_joint_steps() would have done.");
  m.def(
      "prepare_joint_steps",
      [](PythonTissue& tissue) { tissue.use([](SoftTissue& t) { prepare_joint_steps(t); }); },
      py::arg("tissue"), "Computes what joint steps need once, on all cores.");
}

// --- tissue in a session ------------------------------------------------------------------------

using ModelClass = py::class_<TissueModel, DerivedTissueModel, std::shared_ptr<TissueModel>>;

void bind_model_base(py::module_& m) {
  ModelClass(
      m, "TissueModel",
      "A model of tissue that answers the tool: SoftTissueModel, or a class of yours that derives\n"
      "from this with search() and step(), and perhaps cut(). They are called in the thread that\n"
      "gives tissue, with the interpreter's lock; ticks go on meanwhile. What they raise ends the\n"
      "run, and comes out of HapticRunner.stop() or TissueFeeder.offer().")
      .def(py::init_alias<>(), "For classes that derive from it.")
      .def("search", &TissueModel::search, py::call_guard<py::gil_scoped_release>(),
           "The ContactSearch of the contacts it wants to be told of.")
      .def(
          "cut",
          [](TissueModel& self, const TissueNews& news) {
            const TissueNews mine = news;  // others may change it without the lock
            const py::gil_scoped_release unlocked;
            return self.cut(mine);
          },
          py::arg("news"),
          "Called before step(): None, or a TissueMesh or pair (vertices, triangles) that takes\n"
          "the place of this snapshot, and whose vertices step() gets from then on.")
      .def(
          "step",
          [](TissueModel& self, const TissueNews& news, const py::object& vertices) {
            const TissueNews mine = news;
            auto points = points_of(vertices, "vertices", CopyRule::IfNeeded);
            {
              const py::gil_scoped_release unlocked;
              self.step(mine, points);
            }
            return copy_of(points);
          },
          py::arg("news"), py::arg("vertices"),
          "The vertices that the obstacle shall reach one period after `vertices`, the last ones:\n"
          "(N, 3), world. A class of yours returns an array, or changes `vertices`, a copy, and\n"
          "returns None.");
}

std::shared_ptr<PythonTissueModel> make_model(PythonTissue& tissue,
                                              const ModelledObstacle& obstacle) {
  const ModelledObstacle mine = obstacle;
  mine.require_valid();
  const py::gil_scoped_release unlocked;
  return std::make_shared<PythonTissueModel>(tissue.take(), mine);
}

using SoftModelClass =
    py::class_<PythonTissueModel, TissueModel, std::shared_ptr<PythonTissueModel>>;

void bind_looking_at_model(SoftModelClass& model) {
  model
      .def_property_readonly(
          "vertices",
          [](PythonTissueModel& self) {
            return copy_of(self.use([](const auto& s) { return kVertices(s.tissue()); }));
          },
          "numpy.ndarray: (N, 3), of the newest step; read-only")
      .def_property_readonly(
          "triangles",
          [](PythonTissueModel& self) {
            return copy_of(self.use([](const auto& s) { return kTriangles(s.tissue()); }));
          },
          "numpy.ndarray: (M, 3) int32; read-only")
      .def_property_readonly(
          "options",
          [](PythonTissueModel& self) {
            return self.use([](const auto& s) { return s.tissue().options(); });
          },
          "SoftTissueOptions: of its tissue")
      .def(
          "balance",
          [](PythonTissueModel& self) {
            return self.use([](const auto& s) { return s.tissue().balance(); });
          },
          "The tissue's energies, momenta and mass.")
      .def(
          "given_impulse_W",
          [](PythonTissueModel& self, std::size_t tool) {
            return self.use([&](const auto& s) { return s.given_impulse_W(tool); });
          },
          py::arg("tool") = 0, "(3,): on a tool, whose opposite the tissue has taken.")
      .def(
          "owed_impulse_W",
          [](PythonTissueModel& self, std::size_t tool) {
            return self.use([&](const auto& s) { return s.owed_impulse_W(tool); });
          },
          py::arg("tool") = 0, "(3,): what it has still to take.");
}

void bind_soft_model(py::module_& m) {
  m.def("modelled_obstacle", &modelled_obstacle, py::arg("scene"), py::arg("options"),
        py::arg("obstacle") = 0, "The ModelledObstacle of an obstacle of a scene, without cuts.");
  SoftModelClass model(
      m, "SoftTissueModel", py::is_final(),
      "A SoftTissue as an obstacle of a session: each snapshot is a joint step with the session's\n"
      "tools, without the interpreter's lock. It may be looked at while a session asks it. No "
      "class\n"
      "derives from it: one that derives from TissueModel may call its methods.");
  model
      .def(py::init(&make_model), py::arg("tissue").none(false), py::arg("obstacle"),
           "Takes the tissue over: the SoftTissue is empty from then on.")
      .def(
          "add_cut",
          [](PythonTissueModel& self, const TissueKerf& kerf) {
            const TissueKerf mine = kerf;
            return self.use([&](SoftTissueModel& s) { return s.add_cut(mine); });
          },
          py::arg("kerf"),
          "A cut in place of the next snapshot. The number that it will have in cut_reports.")
      .def_property_readonly(
          "cut_reports",
          [](PythonTissueModel& self) {
            return self.use([](const auto& s) { return s.cut_reports(); });
          },
          "tuple[CutReport, ...]: of the cuts that were tried; one that is not Cut changed nothing")
      .def_property_readonly(
          "steps",
          [](PythonTissueModel& self) { return self.use([](const auto& s) { return s.steps(); }); },
          "int: made so far");
  show_properties(model, {"steps"});
  bind_looking_at_model(model);
}

TissueFeed make_feed(const std::shared_ptr<TissueModel>& model, std::size_t obstacle,
                     const std::optional<Scalar>& period, const py::object& shape,
                     const py::object& cut) {
  TissueFeed feed;
  feed.obstacle = obstacle;
  feed.model = model;
  auto* soft = dynamic_cast<PythonTissueModel*>(model.get());
  const Scalar own =
      soft ? soft->use([](const auto& s) { return s.tissue().options().period; }) : feed.period;
  feed.period = period.value_or(own);
  DYOP_REQUIRE(!soft || feed.period == own, "TissueFeed: the period of the tissue is ", own,
               ", not ", feed.period);
  DYOP_REQUIRE(!model || (shape.is_none() && cut.is_none()),
               "TissueFeed: a model takes the place of shape and cut");
  DYOP_REQUIRE(model || !shape.is_none(), "TissueFeed: a model or a shape is wanted");
  if (!shape.is_none()) {
    feed.shape = [function = SharedObject(shape)](std::int64_t number, std::span<Vector3> places) {
      const TissueCall call;
      reshape([&](const py::array& given) { return function.get()(number, given); }, "shape",
              places);
    };
  }
  if (!cut.is_none()) {
    feed.cut = [function = SharedObject(cut)](std::int64_t number) {
      const TissueCall call;
      return mesh_of(function.get()(number));
    };
  }
  return feed;
}

void bind_feeds(py::module_& m) {
  py::class_<TissueFeed> feed_class(m, "TissueFeed",
                                    "Shapes of a deforming obstacle, one after the other.");
  show_properties(feed_class, {"obstacle", "period", "model"});
  feed_class
      .def(
          py::init(&make_feed), py::arg("model") = py::none(), py::arg("obstacle") = 0,
          py::arg("period") = py::none(), py::arg("shape") = py::none(),
          py::arg("cut") = py::none(),
          "A model that is told of the tool, or functions: shape(number, vertices) as\n"
          "TissueModel.step(), and cut(number), called first, as TissueModel.cut(); number counts\n"
          "the snapshots from 1. period: from one to the next; None: that of a SoftTissueModel's\n"
          "tissue, otherwise 0.02.")
      .def_readonly("obstacle", &TissueFeed::obstacle, "int: number")
      .def_readonly("period", &TissueFeed::period, "float: time of the session")
      .def_readonly("model", &TissueFeed::model, "Optional[TissueModel]: of the feed");
  py::class_<PythonFeeder>(
      m, "TissueFeeder",
      "Gives the shapes of a feed to a session whose loop is your own. One thread calls offer();\n"
      "the loop calls tell() after each tick. A HapticRunner does both by itself.")
      .def(py::init([](const std::shared_ptr<PythonSession>& session, const TissueFeed& feed) {
             return std::make_unique<PythonFeeder>(session, feed);
           }),
           py::arg("session").none(false), py::arg("feed"),
           "While no tick runs. Nothing else may give that obstacle snapshots.")
      .def("offer", &PythonFeeder::offer,
           "To be called again and again, some times a period: makes the next snapshot or mesh as\n"
           "soon as it may be made, and gives it as soon as the session takes it. Whether one was\n"
           "given; False also while another thread is in here.")
      .def(
          "tell",
          [](PythonFeeder& self, const py::object& device, const HapticTick& tick, Scalar dt) {
            self.tell({device_of(device, {})}, {tick}, dt);
          },
          py::arg("device"), py::arg("tick"), py::arg("dt"),
          "What a tick was like. Never waits for a model.")
      .def(
          "tell_all",
          [](PythonFeeder& self, const py::iterable& devices, const std::vector<HapticTick>& ticks,
             Scalar dt) { self.tell(devices_of(devices), ticks, dt); },
          py::arg("devices"), py::arg("ticks"), py::arg("dt"), "The same with all tools.");
}

}  // namespace

void bind_tissue(py::module_& m) {
  bind_tissue_options(m);
  bind_tissue_results(m);
  bind_joint_records(m);
  bind_news(m);
  bind_soft_tissue(m);
  bind_model_base(m);
  bind_soft_model(m);
  bind_feeds(m);
}

}  // namespace dyop::python
