// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/dynamics/world.h"
#include "python/bindings.h"
#include "python/query/query_options.h"
#include "python/stepping/python_world.h"
#include "python/stepping/world_functions.h"

namespace dyop::python {
namespace {

void bind_world_options(py::module_& m) {
  py::enum_<IntegratorKind>(m, "IntegratorKind", "Which solver integrates free bodies.")
      .value("Arkode", IntegratorKind::Arkode, "Explicit Runge-Kutta, order 4.")
      .value("CvodeAdams", IntegratorKind::CvodeAdams, "Multistep, smooth equations.")
      .value("CvodeBdf", IntegratorKind::CvodeBdf, "Multistep, stiff equations.");
  Record<IntegratorOptions>(m, "IntegratorOptions", "Tolerances of the integrators.")
      .option<&IntegratorOptions::relative_tolerance>("relative_tolerance", "float: per step")
      .option<&IntegratorOptions::absolute_tolerance>("absolute_tolerance", "float: of the state")
      .option<&IntegratorOptions::max_step>("max_step", "float: time")
      .option<&IntegratorOptions::max_internal_steps>("max_internal_steps", "int: per call")
      .finish();
  py::enum_<ImpactPolicy>(m, "ImpactPolicy", "What happens at an impact.")
      .value("Stop", ImpactPolicy::Stop, "advance() returns.")
      .value("Impulse", ImpactPolicy::Impulse, "Restitution and friction, then on.")
      .value("Callback", ImpactPolicy::Callback, "on_impact changes velocities, then on.");
  Record<ImpactStates>(m, "ImpactStates", "States of event.a and event.b, for on_impact to change.")
      .option<&ImpactStates::a>("a", "MotionState: of A")
      .option<&ImpactStates::b>("b", "MotionState: of B")
      .finish();
  using O = WorldOptions;
  Record<O>(m, "WorldOptions", "Options of World; lengths default to parts of bounding radii.")
      .option<&O::gravity_W>("gravity_W", "numpy.ndarray: (3,) acceleration")
      .option<&O::integrator>("integrator", "IntegratorKind: of free bodies")
      .option<&O::integrator_options>("integrator_options", "IntegratorOptions: its tolerances")
      .option<&O::max_step>("max_step", "Optional[float]: longest step, time")
      .option<&O::target_distance>("target_distance", "Optional[float]: kept, proven; length")
      .option<&O::rest_offset>("rest_offset",
                               "Optional[float]: bodies rest so far above it; length")
      .option<&O::policy>("policy", "ImpactPolicy: what happens at an impact")
      .custom(function_field<O, &O::on_impact, ImpactFunction>("on_impact"),
              "Optional[Callable[[ImpactEvent, ImpactStates], object]]: for ImpactPolicy.Callback")
      .option<&O::restitution_speed>("restitution_speed",
                                     "Optional[float]: slower approaches do not bounce")
      .option<&O::sleep_speed>("sleep_speed", "Optional[float]: slower bodies may fall asleep")
      .option<&O::sleep_steps>("sleep_steps", "int: after so many slow steps; 0: never")
      .option<&O::separation_speed>("separation_speed",
                                    "Optional[float]: largest, of bodies that began too near")
      .custom(function_field<O, &O::friction_law, ScalarFunction>("friction_law"),
              "Optional[Callable[[BodyId, BodyId, NDArray[Any]], float]]: coefficient of a pair "
              "that slides with a velocity (3,), B relative to A")
      .option<&O::solver>("solver", "ContactSolverOptions: budgets")
      .option<&O::max_node_pairs>("max_node_pairs", "int: per time-of-impact query")
      .option<&O::records_motions>("records_motions", "bool: fills AdvanceReport.steps")
      .option<&O::measures_time>("measures_time", "bool: fills AdvanceReport.times")
      .custom(function_field<O, &O::on_step, StepFunction>("on_step"),
              "Optional[Callable[[float], object]]: called with t after each committed step; must "
              "not change the World")
      .option<&O::thread_count>("thread_count", "int: 0: one per core; never changes the result")
      .finish();
}

using WorldClass = py::class_<PythonWorld>;

// add_body(definition) or add_body(name=..., shape=..., ...).
template <typename Definition>
Definition definition_of(const py::object& definition, const py::kwargs& fields) {
  const py::object type = py::type::of<Definition>();
  const std::string wanted = "definition must be a " + std::string(py::str(type.attr("__name__")));
  return read_as<Definition>(definition.is_none() ? type(**fields) : definition, wanted.c_str());
}

void bind_building(WorldClass& type) {
  type.def(py::init([](const WorldOptions* options) {
             return PythonWorld::make(options != nullptr ? *options : WorldOptions());
           }),
           py::arg("options") = py::none(), "An empty World at time 0.")
      .def(
          "add_body",
          [](PythonWorld& self, const py::object& definition, const py::kwargs& fields) {
            return self.change().add_body(definition_of<BodyDefinition>(definition, fields));
          },
          py::arg("definition") = py::none(),
          "Adds a body: a BodyDefinition, or its fields as keywords.")
      .def(
          "remove_body", [](PythonWorld& w, const BodyId& id) { w.change().remove_body(id); },
          py::arg("id"), "Bodies that rested on it wake up.")
      .def(
          "add_joint",
          [](PythonWorld& self, const py::object& definition, const py::kwargs& fields) {
            return self.change().add_joint(definition_of<JointDefinition>(definition, fields));
          },
          py::arg("definition") = py::none(),
          "Holds two bodies together: a JointDefinition, or its fields as keywords.")
      .def(
          "remove_joint", [](PythonWorld& w, const JointId& id) { w.change().remove_joint(id); },
          py::arg("id"), "Lets go.")
      .def(
          "joint", [](PythonWorld& w, const JointId& id) { return w.read().joint(id); },
          py::arg("id"), "The joint's definition, a copy.")
      .def(
          "set_motor",
          [](PythonWorld& w, const JointId& id, const JointMotor& motor) {
            w.change().set_motor(id, motor);
          },
          py::arg("id"), py::arg("motor"), "Another speed or strength.");
}

void bind_springs(WorldClass& type) {
  type.def(
          "add_spring",
          [](PythonWorld& self, const py::object& definition, const py::kwargs& fields) {
            return self.change().add_spring(definition_of<SpringDefinition>(definition, fields));
          },
          py::arg("definition") = py::none(),
          "Acts between two bodies from now on: a SpringDefinition, or its fields as keywords.")
      .def(
          "remove_spring", [](PythonWorld& w, const SpringId& id) { w.change().remove_spring(id); },
          py::arg("id"), "It acts no longer.")
      .def(
          "spring", [](PythonWorld& w, const SpringId& id) { return w.read().spring(id); },
          py::arg("id"), "The spring's definition, a copy.")
      .def(
          "spring_energy", [](PythonWorld& w) { return w.read().spring_energy(); },
          "Stored in all springs now.");
}

void bind_setters(WorldClass& type) {
  type.def(
          "set_enabled",
          [](PythonWorld& w, const BodyId& id, bool is_enabled) {
            w.change().set_enabled(id, is_enabled);
          },
          py::arg("id"), py::arg("is_enabled"), "A disabled body stays and is seen by nobody.")
      .def(
          "set_motion",
          [](PythonWorld& w, const BodyId& id, const std::shared_ptr<Motion>& motion) {
            w.change().set_motion(id, motion);
          },
          py::arg("id"), py::arg("motion"), "Of a kinematic body, from now on.")
      .def(
          "set_next_pose",
          [](PythonWorld& w, const BodyId& id, const PoseArgument& X_WB, Scalar t) {
            w.change().set_next_pose(id, X_WB.X, t);
          },
          py::arg("id"), py::arg("X_WB"), py::arg("t"),
          "Moves a kinematic body to a pose until the time t > time(); it rests there then.")
      .def(
          "set_material",
          [](PythonWorld& w, const BodyId& id, const Material& material) {
            w.change().set_material(id, material);
          },
          py::arg("id"), py::arg("material"),
          "Friction and restitution from now on; wakes what the body touches.")
      .def(
          "set_state",
          [](PythonWorld& w, const BodyId& id, const StateArgument& state) {
            w.change().set_state(id, state.state);
          },
          py::arg("id"), py::arg("state"), "Pose and twist of a dynamic body; wakes it.")
      .def(
          "set_wrench",
          [](PythonWorld& w, const BodyId& id, const py::object& wrench) {
            WrenchCallback function;
            set_function<WrenchFunction>(function, wrench);
            w.change().set_wrench(id, function);
          },
          py::arg("id"), py::arg("wrench"),
          "Of a dynamic body: wrench(t, state) gives a Wrench or (force, torque); None: no force.")
      .def(
          "set_gravity",
          [](PythonWorld& w, const Vector3& gravity_W) { w.change().set_gravity(gravity_W); },
          py::arg("gravity_W"), "(3,) acceleration.")
      .def(
          "wake", [](PythonWorld& w, const BodyId& id) { w.change().wake(id); }, py::arg("id"),
          "Wakes a sleeping body.")
      .def(
          "set_pair_enabled",
          [](PythonWorld& w, const BodyId& a, const BodyId& b, bool is_enabled) {
            w.change().set_pair_enabled(a, b, is_enabled);
          },
          py::arg("a"), py::arg("b"), py::arg("is_enabled"), "Whether a pair is examined.")
      .def(
          "set_target_distance",
          [](PythonWorld& w, const BodyId& a, const BodyId& b, Scalar target_distance) {
            w.change().set_target_distance(a, b, target_distance);
          },
          py::arg("a"), py::arg("b"), py::arg("target_distance"), "Of one pair; length, >= 0.");
}

void bind_getters(WorldClass& type) {
  type.def(
          "time", [](PythonWorld& w) { return w.read().time(); }, "Committed time.")
      .def(
          "body_count", [](PythonWorld& w) { return w.read().body_count(); }, "Number of bodies.")
      .def(
          "bodies", [](PythonWorld& w) { return w.read().bodies(); }, "All bodies, by slot.")
      .def(
          "has_body", [](PythonWorld& w, const BodyId& id) { return w.read().has_body(id); },
          py::arg("id"), "Whether the id names a body.")
      .def(
          "body",
          [](PythonWorld& w, const BodyId& id) { return BodyDefinition(w.read().body(id)); },
          py::arg("id"), "The body's definition, a copy.")
      .def(
          "state", [](PythonWorld& w, const BodyId& id) { return w.read().state(id); },
          py::arg("id"), "Pose and twist of the body's frame at time().")
      .def(
          "is_asleep", [](PythonWorld& w, const BodyId& id) { return w.read().is_asleep(id); },
          py::arg("id"), "Whether the body sleeps.")
      .def(
          "is_enabled", [](PythonWorld& w, const BodyId& id) { return w.read().is_enabled(id); },
          py::arg("id"), "Whether the body is enabled.")
      .def(
          "pairs", [](PythonWorld& w) { return w.read().pairs(); },
          "Records of all near pairs after the last step.")
      .def(
          "contacts", [](PythonWorld& w) { return w.read().contacts(); },
          "Those of them that are in contact.")
      .def(
          "kinetic_energy", [](PythonWorld& w) { return w.read().kinetic_energy(); },
          "Of all dynamic bodies.")
      .def(
          "momentum", [](PythonWorld& w) { return w.read().momentum(); },
          "(3,), of all dynamic bodies.")
      .def(
          "angular_momentum", [](PythonWorld& w) { return w.read().angular_momentum(); },
          "(3,), about the world's origin.");
}

}  // namespace

void bind_world(py::module_& m) {
  bind_world_options(m);
  py::class_<WorldSnapshot>(m, "WorldSnapshot", "A World's state at one time.");
  WorldClass type(m, "World",
                  "Rigid bodies stepped through time without ever passing through one another.");
  type.def("__repr__", [](PythonWorld& self) {
    if (self.is_advancing()) return std::string("World(advancing)");
    const World& world = self.read();
    return "World(" + std::to_string(world.bodies().size()) +
           " bodies, t=" + std::string(py::repr(py::cast(world.time()))) + ")";
  });
  bind_building(type);
  bind_springs(type);
  bind_setters(type);
  bind_getters(type);
  type.def(
          "advance",
          [](PythonWorld& self, Scalar dt, const std::stop_source* stop, const py::object& deadline,
             const std::optional<std::int64_t>& max_steps) {
            AdvanceLimits limits;
            if (stop != nullptr) limits.stop = stop->get_token();
            if (!deadline.is_none()) limits.deadline = deadline_of(deadline);
            if (max_steps) limits.max_steps = *max_steps;
            return self.advance(dt, limits);
          },
          py::arg("dt"), py::arg("stop") = py::none(), py::arg("deadline") = py::none(),
          py::arg("max_steps") = py::none(),
          "Advances by dt > 0, or less: see AdvanceStatus. deadline: seconds of time.monotonic(),\n"
          "checked within steps too. max_steps: committed steps, > 0. Ctrl-C ends it after the\n"
          "committed step.")
      .def(
          "snapshot", [](PythonWorld& w) { return w.change().snapshot(); },
          "Everything that decides what the World will do.")
      .def(
          "restore",
          [](PythonWorld& w, const WorldSnapshot& snapshot) { w.change().restore(snapshot); },
          py::arg("snapshot"), "Back to a snapshot of this World.");
}

}  // namespace dyop::python
