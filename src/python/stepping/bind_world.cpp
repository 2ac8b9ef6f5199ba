// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/dynamics/joint.h"
#include "dyop/dynamics/rigid_body.h"
#include "dyop/dynamics/world.h"
#include "python/bindings.h"
#include "python/query/queries.h"
#include "python/stepping/python_world.h"

namespace dyop::python {
namespace {

// An id that is a number in order of creation.
template <typename Id>
void bind_number(py::module_& m, const std::string& name, const char* doc) {
  py::class_<Id>(m, name.c_str(), doc)
      .def_readonly("number", &Id::number, "int: in order of creation")
      .def(
          "__eq__", [](const Id& a, const Id& b) { return a == b; }, py::is_operator())
      .def("__hash__", [](const Id& id) { return std::hash<std::uint64_t>{}(id.number); })
      .def("__repr__",
           [name](const Id& id) { return name + "(" + std::to_string(id.number) + ")"; });
}

void bind_ids(py::module_& m) {
  py::class_<BodyId>(m, "BodyId", "Names a body of one World; refused once the body is gone.")
      .def(py::init<>(), "Of no body.")
      .def(py::init([](std::uint32_t slot, std::uint32_t generation) {
             return BodyId(slot, generation);
           }),
           py::arg("slot"), py::arg("generation") = 0, "Place in the World, and use of that place.")
      .def_readonly("slot", &BodyId::slot, "int: place in the World")
      .def_readonly("generation", &BodyId::generation, "int: use of that place")
      .def(
          "__eq__", [](const BodyId& a, const BodyId& b) { return a == b; }, py::is_operator())
      .def(
          "__lt__", [](const BodyId& a, const BodyId& b) { return a < b; }, py::is_operator())
      .def("__hash__", [](const BodyId& id) { return std::hash<BodyId>{}(id); })
      .def("__repr__",
           [](const BodyId& id) {
             return "BodyId(" + std::to_string(id.slot) + ", " + std::to_string(id.generation) +
                    ")";
           })
      .def(py::pickle([](const BodyId& id) { return py::make_tuple(id.slot, id.generation); },
                      [](const py::tuple& state) {
                        return BodyId(state[0].cast<std::uint32_t>(),
                                      state[1].cast<std::uint32_t>());
                      }));
  bind_number<JointId>(m, "JointId", "Names a joint of one World; never used again.");
  bind_number<SpringId>(m, "SpringId", "Names a spring of one World; never used again.");
}

void bind_body_parts(py::module_& m) {
  py::enum_<BodyKind>(m, "BodyKind", "What moves a body.")
      .value("Dynamic", BodyKind::Dynamic, "Forces and impulses.")
      .value("Kinematic", BodyKind::Kinematic, "A given Motion.")
      .value("Static", BodyKind::Static, "Nothing.");
  Record<Wrench>(m, "Wrench", "Force through, and torque about, the centre of mass, world axes.")
      .option<&Wrench::force>("force", "numpy.ndarray: (3,)")
      .option<&Wrench::torque>("torque", "numpy.ndarray: (3,)")
      .finish();
  Record<LockedAxes>(m, "LockedAxes", "Degrees of freedom that are locked, by world axis.")
      .option<&LockedAxes::translation>("translation", "list[bool]: three, of the centre of mass")
      .option<&LockedAxes::rotation>("rotation", "list[bool]: three, about it")
      .finish();
  Record<Material>(m, "Material", "Friction and restitution; see BodyDefinition.")
      .option<&Material::restitution>("restitution", "float: in [0, 1]")
      .option<&Material::friction>("friction", "float: >= 0")
      .option<&Material::rolling_friction>("rolling_friction", "float: length, >= 0")
      .option<&Material::torsional_friction>("torsional_friction", "float: length, >= 0")
      .finish();
}

Field user_data_field() {
  return {"user_data",
          [](const void* r, py::handle) {
            return object_in(static_cast<const BodyDefinition*>(r)->user_data);
          },
          [](void* r, py::handle value) {
            auto& data = static_cast<BodyDefinition*>(r)->user_data;
            data.reset();
            if (!value.is_none()) data = SharedObject(py::reinterpret_borrow<py::object>(value));
          }};
}

void bind_body(py::module_& m) {
  using Body = BodyDefinition;
  Record<Body> body(m, "BodyDefinition", "What a body is made of; handed to World.add_body().");
  body.option<&Body::name>("name", "str: for messages and recordings")
      .option<&Body::kind>("kind", "BodyKind: what moves it")
      .option<&Body::shape>("shape", "Optional[Shape]: required")
      .option<&Body::initial>("initial", "MotionState: of the shape's frame (dynamic, static)")
      .option<&Body::mass_properties>("mass_properties", "MassProperties: dynamic")
      .option<&Body::motion>("motion", "Optional[Motion]: kinematic")
      .custom(
          function_field<Body, &Body::wrench, WrenchFunction>("wrench"),
          "Optional[Callable[[float, MotionState], Union[Wrench, Tuple[ArrayLike, ArrayLike]]]]: "
          "dynamic, from (t, state); called many times per step, from several threads; ... if "
          "made by C++")
      .option<&Body::locked>("locked", "LockedAxes: dynamic")
      .option<&Body::restitution>("restitution", "float: in [0, 1]; a pair uses the smaller")
      .option<&Body::friction>("friction", "float: >= 0; a pair uses the geometric mean")
      .option<&Body::rolling_friction>("rolling_friction", "float: length, >= 0")
      .option<&Body::torsional_friction>("torsional_friction", "float: length, >= 0")
      .option<&Body::is_sensor>("is_sensor", "bool: feels and gives no force")
      .custom(user_data_field(), "Any: kept, never read")
      .finish();
}

void bind_joint(py::module_& m) {
  py::enum_<JointKind>(m, "JointKind", "What a joint keeps of its two frames.")
      .value("Ball", JointKind::Ball, "Their origins together.")
      .value("Hinge", JointKind::Hinge, "Origins and z axes together.")
      .value("Slider", JointKind::Slider, "B moves along z of A.")
      .value("Fixed", JointKind::Fixed, "Both together.")
      .value("Distance", JointKind::Distance, "The distance of their origins.");
  Record<JointLimits>(m, "JointLimits", "Range of a hinge, slider or distance.")
      .option<&JointLimits::min>("min", "float: radians or length")
      .option<&JointLimits::max>("max", "float: radians or length")
      .finish();
  Record<JointMotor>(m, "JointMotor", "Drives a hinge or a slider.")
      .option<&JointMotor::speed>("speed", "float: radians or length per time")
      .option<&JointMotor::strength>("strength", "float: largest torque or force, > 0")
      .finish();
  using Joint = JointDefinition;
  Record<Joint>(m, "JointDefinition", "Two bodies held together; handed to World.add_joint().")
      .option<&Joint::name>("name", "str: for messages")
      .option<&Joint::kind>("kind", "JointKind: what is kept")
      .option<&Joint::a>("a", "BodyId: A")
      .option<&Joint::b>("b", "BodyId: B")
      .option<&Joint::X_AJ>("X_AJ", "RigidPose: frame JA in the frame of A")
      .option<&Joint::X_BJ>("X_BJ", "RigidPose: frame JB in the frame of B")
      .option<&Joint::limits>("limits", "Optional[JointLimits]: hinge, slider, distance")
      .option<&Joint::motor>("motor", "Optional[JointMotor]: hinge, slider")
      .option<&Joint::bodies_collide>("bodies_collide", "bool: the pair is examined all the same")
      .finish();
}

void bind_spring(py::module_& m) {
  using Spring = SpringDefinition;
  Record<Spring>(
      m, "SpringDefinition",
      "Spring and damper between a point of A and one of B; handed to World.add_spring().")
      .option<&Spring::name>("name", "str: for messages")
      .option<&Spring::a>("a", "BodyId: A")
      .option<&Spring::b>("b", "BodyId: B")
      .option<&Spring::p_AP>("p_AP", "numpy.ndarray: (3,) point of A, in the frame of A")
      .option<&Spring::p_BQ>("p_BQ", "numpy.ndarray: (3,) point of B, in the frame of B")
      .option<&Spring::rest_length>("rest_length", "Optional[float]: None: the current distance")
      .option<&Spring::stiffness>("stiffness", "float: force per length, >= 0")
      .option<&Spring::damping>("damping", "float: force per speed, >= 0; not both zero")
      .finish();
}

}  // namespace

void bind_bodies(py::module_& m) {
  bind_ids(m);
  bind_body_parts(m);
  bind_body(m);
  bind_joint(m);
  bind_spring(m);
}

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
      .option<&O::records_impulses>("records_impulses",
                                    "bool: RecordingWriter records all impulses, for dyop-check")
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

void bind_body_setters(WorldClass& type) {
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
          "Of a dynamic body: wrench(t, state) gives a Wrench or (force, torque); None: no force.");
}

void bind_setters(WorldClass& type) {
  type.def(
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
  bind_body_setters(type);
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
