// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/dynamics/joint.h"
#include "dyop/dynamics/rigid_body.h"
#include "dyop/dynamics/spring.h"
#include "python/bindings.h"
#include "python/stepping/world_functions.h"

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

}  // namespace dyop::python
