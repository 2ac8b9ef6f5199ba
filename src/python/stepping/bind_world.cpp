// SPDX-License-Identifier: BSD-3-Clause
#include <functional>
#include <optional>

#include "dyop/dynamics/joint.h"
#include "dyop/dynamics/rigid_body.h"
#include "dyop/dynamics/world.h"
#include "python/bindings.h"
#include "python/query/queries.h"
#include "python/stepping/python_world.h"

namespace dyop::python {
namespace {

// An id that is a number in order of creation; the largest one names nothing.
template <typename Id>
void bind_number(py::module_& m, const std::string& name, const char* doc) {
  py::class_<Id>(m, name.c_str(), doc)
      .def(py::init<>(), "Names nothing.")
      .def(py::init([](std::uint64_t number) { return Id{number}; }), py::arg("number"),
           "In order of creation.")
      .def_readonly("number", &Id::number, "int: in order of creation")
      .def(
          "__eq__", [](const Id& a, const Id& b) { return a == b; }, py::is_operator())
      .def(
          "__lt__", [](const Id& a, const Id& b) { return a < b; }, py::is_operator())
      .def("__hash__", [](const Id& id) { return std::hash<std::uint64_t>{}(id.number); })
      .def("__repr__",
           [name](const Id& id) {
             return name + "(" + (id == Id() ? "" : std::to_string(id.number)) + ")";
           })
      .def(py::pickle([](const Id& id) { return py::make_tuple(id.number); },
                      [](const py::tuple& state) { return Id{state[0].cast<std::uint64_t>()}; }));
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
      .option<&LockedAxes::translation>("translation",
                                        "tuple[bool, ...]: three, of the centre of mass")
      .option<&LockedAxes::rotation>("rotation", "tuple[bool, ...]: three, about it")
      .finish();
  Record<Material>(m, "Material", "Friction and restitution; see BodyDefinition.")
      .option<&Material::restitution>("restitution", "float: in [0, 1]")
      .option<&Material::friction>("friction", "float: >= 0")
      .option<&Material::rolling_friction>("rolling_friction", "float: length, >= 0")
      .option<&Material::torsional_friction>("torsional_friction", "float: length, >= 0")
      .finish();
  using Filter = CollisionFilter;
  Record<Filter>(m, "CollisionFilter",
                 "Two bodies collide if the category of each has a bit of the other's mask.")
      .option<&Filter::category>("category", "int: bit set, what the body is")
      .option<&Filter::mask>("mask", "int: bit set, what it collides with")
      .option<&Filter::group>("group", "int: two of one group collide always (> 0), never (< 0)")
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
      .option<&Body::restitution>("restitution",
                                  "float: in [0, 1]; see WorldOptions.combine_restitution")
      .option<&Body::friction>("friction", "float: >= 0; see WorldOptions.combine_friction")
      .option<&Body::rolling_friction>("rolling_friction", "float: length, >= 0")
      .option<&Body::torsional_friction>("torsional_friction", "float: length, >= 0")
      .option<&Body::filter>("filter", "CollisionFilter: which pairs are examined")
      .option<&Body::is_sensor>("is_sensor", "bool: feels and gives no contact force")
      .custom(user_data_field(), "Any: kept, never read")
      .finish();
}

void bind_joint_parts(py::module_& m) {
  py::enum_<JointKind>(m, "JointKind", "What a joint holds of its two frames JA and JB.")
      .value("Ball", JointKind::Ball, "Their origins together.")
      .value("Hinge", JointKind::Hinge, "Origins and z axes together.")
      .value("Slider", JointKind::Slider, "B moves along z of A.")
      .value("Fixed", JointKind::Fixed, "Both together.")
      .value("Distance", JointKind::Distance, "The distance of their origins, or a range of it.")
      .value("Universal", JointKind::Universal, "Origins; x of JA at right angles to y of JB.")
      .value("Cylindrical", JointKind::Cylindrical, "z axes on one line.")
      .value("Coupling", JointKind::Coupling, "A sum of coordinates of two other joints.");
  Record<JointLimits>(m, "JointLimits",
                      "Range of a hinge, slider, cylindrical joint, distance or coupling.")
      .option<&JointLimits::min>("min", "float: radians or length")
      .option<&JointLimits::max>("max", "float: radians or length")
      .finish();
  Record<SwingTwistLimits>(m, "SwingTwistLimits", "How far a ball joint may turn.")
      .option<&SwingTwistLimits::swing>("swing", "float: radians, between the z axes, in (0, pi)")
      .option<&SwingTwistLimits::twist_min>("twist_min", "float: radians, about z")
      .option<&SwingTwistLimits::twist_max>("twist_max", "float: radians, about z")
      .finish();
  Record<JointMotor>(
      m, "JointMotor",
      "Drives a hinge, slider or cylindrical joint to a speed; with gains by the torque or force\n"
      "stiffness (position - q) + damping (speed - q').")
      .option<&JointMotor::speed>("speed", "float: radians or length per time")
      .option<&JointMotor::strength>("strength",
                                     "float: largest torque or force, > 0; may be inf with gains")
      .option<&JointMotor::position>("position", "Optional[float]: with a stiffness")
      .option<&JointMotor::stiffness>("stiffness", "float: torque per radian, force per length")
      .option<&JointMotor::damping>("damping", "float: torque or force per speed")
      .finish();
}

void bind_joint(py::module_& m) {
  using Joint = JointDefinition;
  Record<Joint>(m, "JointDefinition", "Two bodies held together; handed to World.add_joint().")
      .option<&Joint::name>("name", "str: for messages")
      .option<&Joint::kind>("kind", "JointKind: what is held")
      .option<&Joint::a>("a", "BodyId: A; of a coupling found by the World")
      .option<&Joint::b>("b", "BodyId: B; of a coupling found by the World")
      .option<&Joint::X_AJ>("X_AJ", "RigidPose: frame JA in the frame of A")
      .option<&Joint::X_BJ>("X_BJ", "RigidPose: frame JB in the frame of B")
      .option<&Joint::limits>("limits", "Optional[JointLimits]: not of all kinds")
      .option<&Joint::motor>("motor", "Optional[JointMotor]: hinge, slider, cylindrical")
      .option<&Joint::bodies_collide>("bodies_collide", "bool: the pair is examined all the same")
      .option<&Joint::swing_twist>("swing_twist", "Optional[SwingTwistLimits]: ball")
      .option<&Joint::friction>("friction", "float: dry, torque or force >= 0")
      .option<&Joint::damping>("damping", "float: torque or force per speed, >= 0")
      .option<&Joint::break_force>("break_force", "float: it breaks above; inf: never")
      .option<&Joint::break_torque>("break_torque", "float: it breaks above; inf: never")
      .option<&Joint::first>("first", "JointId: coupling: whose coordinate plus")
      .option<&Joint::second>("second", "JointId: ratio times whose coordinate is held")
      .option<&Joint::ratio>("ratio", "float: not 0")
      .finish();
  using Values = JointValues;
  Record<Values>(m, "JointValues", "Where a joint is, how it moves and what it bears.")
      .field<&Values::angle>("angle", "float: radians, of JB about z of JA; turns are counted")
      .field<&Values::angle_rate>("angle_rate", "float: radians per time")
      .field<&Values::second_angle>("second_angle", "float: universal: about y of JB")
      .field<&Values::second_rate>("second_rate", "float: radians per time")
      .field<&Values::swing>("swing", "float: ball: radians, between the z axes")
      .field<&Values::position>("position",
                                "float: along z of JA; the distance; the sum of a coupling")
      .field<&Values::position_rate>("position_rate", "float: length per time")
      .field<&Values::separation>("separation", "float: of the places held together, length")
      .field<&Values::force_W>("force_W", "numpy.ndarray: (3,) on B; mean over the last step")
      .field<&Values::torque_W>("torque_W", "numpy.ndarray: (3,) on B, about the origin of JB")
      .field<&Values::drive>("drive", "float: the part of motor, friction and damping")
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
  bind_joint_parts(m);
  bind_joint(m);
  bind_spring(m);
}

namespace {

void bind_option_parts(py::module_& m) {
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
  py::enum_<CombineRule>(m, "CombineRule", "How coefficients of two bodies give one of a pair.")
      .value("GeometricMean", CombineRule::GeometricMean)
      .value("Mean", CombineRule::Mean)
      .value("Product", CombineRule::Product)
      .value("Minimum", CombineRule::Minimum)
      .value("Maximum", CombineRule::Maximum);
}

void bind_world_options(py::module_& m) {
  using O = WorldOptions;
  Record<O>(m, "WorldOptions", "Options of World; lengths default to parts of the shapes' sizes.")
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
      .option<&O::combine_friction>("combine_friction", "CombineRule: of two bodies")
      .option<&O::combine_restitution>("combine_restitution", "CombineRule: of two bodies")
      .custom(function_field<O, &O::friction_law, ScalarFunction>("friction_law"),
              "Optional[Callable[[BodyId, BodyId, NDArray[Any]], float]]: coefficient of a pair "
              "that slides with a velocity (3,), B relative to A")
      .option<&O::solver>("solver", "ContactSolverOptions: budgets")
      .option<&O::max_node_pairs>("max_node_pairs", "int: per time-of-impact query")
      .option<&O::records_motions>("records_motions", "bool: fills AdvanceReport.steps")
      .option<&O::records_impulses>("records_impulses",
                                    "bool: fills AdvanceReport.velocity_changes, for dyop-check")
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
          py::arg("id"), "Bodies that rested on it wake up.");
}

void bind_world_joints(WorldClass& type) {
  type.def(
          "add_joint",
          [](PythonWorld& self, const py::object& definition, const py::kwargs& fields) {
            return self.change().add_joint(definition_of<JointDefinition>(definition, fields));
          },
          py::arg("definition") = py::none(),
          "Holds two bodies together: a JointDefinition, or its fields as keywords.")
      .def(
          "remove_joint", [](PythonWorld& w, const JointId& id) { w.change().remove_joint(id); },
          py::arg("id"), "Lets go. With it go couplings of its coordinates.")
      .def(
          "joint",
          [](PythonWorld& w, const JointId& id) {
            return LookedUp<JointDefinition>{w.read().joint(id)};
          },
          py::arg("id"), "The joint's definition, frozen.")
      .def(
          "joints", [](PythonWorld& w) { return w.read().joints(); }, "All joints.")
      .def(
          "joint_values",
          [](PythonWorld& w, const JointId& id) { return w.read().joint_values(id); },
          py::arg("id"), "Angle, position and rates at time(), and what it bore in the last step.")
      .def(
          "set_motor",
          [](PythonWorld& w, const JointId& id, const std::optional<JointMotor>& motor) {
            w.change().set_motor(id, motor);
          },
          py::arg("id"), py::arg("motor"), "A new motor, or None; wakes the joint's bodies.");
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
          "spring",
          [](PythonWorld& w, const SpringId& id) {
            return LookedUp<SpringDefinition>{w.read().spring(id)};
          },
          py::arg("id"), "The spring's definition, frozen.")
      .def(
          "springs", [](PythonWorld& w) { return w.read().springs(); }, "All springs.")
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

void bind_body_changes(WorldClass& type) {
  type.def(
          "set_mass_properties",
          [](PythonWorld& w, const BodyId& id, const MassProperties& mass_properties) {
            w.change().set_mass_properties(id, mass_properties);
          },
          py::arg("id"), py::arg("mass_properties"),
          "Of a dynamic body; wakes it. Pose and twist stay: the momentum changes.")
      .def(
          "set_shape",
          [](PythonWorld& w, const BodyId& id, const std::shared_ptr<Shape>& shape) {
            w.change().set_shape(id, shape);
          },
          py::arg("id"), py::arg("shape").none(false),
          "Another shape in the same frame; mass properties stay. Wakes what it touched.")
      .def(
          "set_filter",
          [](PythonWorld& w, const BodyId& id, const CollisionFilter& filter) {
            w.change().set_filter(id, filter);
          },
          py::arg("id"), py::arg("filter"), "Which pairs are examined from now on.")
      .def(
          "apply_impulse",
          [](PythonWorld& w, const BodyId& id, const Vector3& impulse_W,
             const std::optional<Vector3>& p_W) {
            if (p_W) return w.change().apply_impulse(id, impulse_W, *p_W);
            w.change().apply_impulse(id, impulse_W);
          },
          py::arg("id"), py::arg("impulse_W"), py::arg("p_W") = py::none(),
          "Changes a dynamic body's momentum at once, force times time (3,), through the point "
          "p_W\n"
          "(3,), or None: its centre of mass; wakes it.")
      .def(
          "apply_angular_impulse",
          [](PythonWorld& w, const BodyId& id, const Vector3& angular_impulse_W) {
            w.change().apply_angular_impulse(id, angular_impulse_W);
          },
          py::arg("id"), py::arg("angular_impulse_W"),
          "Changes its angular momentum (3,) about its centre of mass at once; wakes it.");
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
          py::arg("a"), py::arg("b"), py::arg("target_distance"), "Of one pair; length, >= 0.")
      .def(
          "set_pair_material",
          [](PythonWorld& w, const BodyId& a, const BodyId& b,
             const std::optional<Material>& material) {
            w.change().set_pair_material(a, b, material);
          },
          py::arg("a"), py::arg("b"), py::arg("material"),
          "In place of what follows from the materials of both; None: as before. Wakes both.");
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
          [](PythonWorld& w, const BodyId& id) {
            return LookedUp<BodyDefinition>{w.read().body(id)};
          },
          py::arg("id"), "The body's definition, frozen.")
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
          "pair_material",
          [](PythonWorld& w, const BodyId& a, const BodyId& b) {
            return LookedUp<Material>{w.read().pair_material(a, b)};
          },
          py::arg("a"), py::arg("b"), "What a pair has: given for it, or combined.")
      .def(
          "pair_rules", [](PythonWorld& w) { return w.read().pair_rules(); },
          "Pairs named by set_pair_enabled() or set_target_distance().")
      .def(
          "options", [](PythonWorld& w) { return LookedUp<WorldOptions>{w.options()}; },
          "Those that the World was made with, frozen.")
      .def(
          "gravity", [](PythonWorld& w) { return w.read().gravity(); }, "(3,) acceleration.")
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

void bind_query_results(py::module_& m) {
  using Filter = BodyFilter;
  Record<Filter>(m, "BodyFilter",
                 "Which bodies a query of a World considers: enabled ones whose "
                 "CollisionFilter.category\nhas a bit of mask, and whose mask has one of category.")
      .option<&Filter::mask>("mask", "int: bit set")
      .option<&Filter::category>("category", "int: bit set")
      .option<&Filter::includes_sensors>("includes_sensors", "bool: sensors too")
      .custom(function_field<Filter, &Filter::accepts, BoolFunction>("accepts"),
              "Optional[Callable[[BodyId], bool]]: leaves bodies out")
      .finish();
  Record<BodyRayHit>(m, "BodyRayHit", "What a ray meets first; result of World.cast_ray().")
      .field<&BodyRayHit::status>("status", "ToiStatus: Impact, Separated; others: see distance")
      .field<&BodyRayHit::body>("body", "Optional[BodyId]: that is met")
      .field<&BodyRayHit::distance>("distance", "float: proven free up to here; length")
      .field<&BodyRayHit::p_W>("p_W", "numpy.ndarray: (3,) the place on the body")
      .field<&BodyRayHit::nhat_W>("nhat_W", "numpy.ndarray: (3,) unit normal, against the ray")
      .field<&BodyRayHit::triangle>("triangle", "Optional[int]: if the body is a mesh")
      .finish();
  Record<ShapeHit>(m, "ShapeHit", "What a moving shape meets first; of World.cast_shape().")
      .field<&ShapeHit::toi>("toi", "ToiResult: A is the shape, B the body")
      .field<&ShapeHit::body>("body", "Optional[BodyId]: that is met")
      .field<&ShapeHit::free_fraction>("free_fraction", "float: of the interval, proven free")
      .finish();
  Record<NearestBody>(m, "NearestBody", "The body nearest to a shape; of World.nearest().")
      .field<&NearestBody::distance>("distance", "DistanceResult: A is the shape, B the body")
      .field<&NearestBody::body>("body", "Optional[BodyId]: None if there is none")
      .finish();
  Record<BodyOverlaps>(m, "BodyOverlaps", "The bodies near a shape; of World.overlaps().")
      .field<&BodyOverlaps::bodies>("bodies",
                                    "tuple[BodyId, ...]: at most the distance away, proven")
      .field<&BodyOverlaps::undecided>("undecided", "tuple[BodyId, ...]: rounding does not tell")
      .finish();
  using Rule = World::PairRule;
  Record<Rule>(m, "PairRule", "A pair named by World.set_pair_enabled(), set_target_distance().")
      .field<&Rule::a>("a", "BodyId: A")
      .field<&Rule::b>("b", "BodyId: B")
      .field<&Rule::is_enabled>("is_enabled", "bool: whether the pair is examined")
      .field<&Rule::target_distance>("target_distance", "Optional[float]: None: as for all pairs")
      .finish();
}

void bind_queries(WorldClass& type) {
  type.def(
          "cast_ray",
          [](PythonWorld& self, const Vector3& origin_W, const Vector3& direction_W, Scalar length,
             const BodyFilter* filter) {
            return self.ask(filter, [&](const World& world, const BodyFilter& used) {
              const py::gil_scoped_release unlocked;
              return world.cast_ray(origin_W, direction_W, length, used);
            });
          },
          py::arg("origin_W"), py::arg("direction_W"), py::arg("length"),
          py::arg("filter") = py::none(),
          "What a ray meets first of the bodies as they stand; closed meshes count as solids.")
      .def(
          "cast_shape",
          [](PythonWorld& self, const Shape& shape, const Motion& motion,
             const IntervalArgument& interval, const PythonToiOptions* options,
             const BodyFilter* filter) {
            return self.ask(filter, [&](const World& world, const BodyFilter& used) {
              const auto cast = [&](const ToiOptions& limited) {
                return world.cast_shape(shape, motion, interval.interval, limited, used);
              };
              return answer_or_start_over(options_or_default(options), cast,
                                          std::mem_fn(&ShapeHit::toi));
            });
          },
          py::arg("shape"), py::arg("motion"), py::arg("interval"), py::arg("options") = py::none(),
          py::arg("filter") = py::none(), "What a shape on a motion meets first of them.")
      .def(
          "nearest",
          [](PythonWorld& self, const Shape& shape, const PoseArgument& X_WS,
             const DistanceOptions* options, const BodyFilter* filter) {
            const DistanceOptions limits = options != nullptr ? *options : DistanceOptions();
            return self.ask(filter, [&](const World& world, const BodyFilter& used) {
              const py::gil_scoped_release unlocked;
              return world.nearest(shape, X_WS.X, limits, used);
            });
          },
          py::arg("shape"), py::arg("X_WS"), py::arg("options") = py::none(),
          py::arg("filter") = py::none(), "The one nearest to a shape.")
      .def(
          "overlaps",
          [](PythonWorld& self, const Shape& shape, const PoseArgument& X_WS, Scalar max_distance,
             const BodyFilter* filter) {
            return self.ask(filter, [&](const World& world, const BodyFilter& used) {
              const py::gil_scoped_release unlocked;
              return world.overlaps(shape, X_WS.X, max_distance, used);
            });
          },
          py::arg("shape"), py::arg("X_WS"), py::arg("max_distance") = 0.0,
          py::arg("filter") = py::none(),
          "All at most max_distance from a shape; 0: those that it overlaps or touches.");
}

}  // namespace

void bind_world(py::module_& m) {
  bind_option_parts(m);
  bind_world_options(m);
  bind_query_results(m);
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
  bind_world_joints(type);
  bind_springs(type);
  bind_body_setters(type);
  bind_body_changes(type);
  bind_setters(type);
  bind_getters(type);
  bind_queries(type);
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
