// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/contact/contact_generator.h"
#include "dyop/contact/contact_solver.h"
#include "python/bindings.h"
#include "python/glue/record.h"

namespace dyop::python {
namespace {

void bind_contact_points(py::module_& m) {
  Record<FeatureKey>(m, "FeatureKey", "Names one side of a contact from step to step.")
      .field<&FeatureKey::kind>("kind", "FeatureKind: vertex, edge, face")
      .field<&FeatureKey::piece>("piece", "int: of a compound")
      .field<&FeatureKey::number>("number", "int: in the shape's topology")
      .finish();
  Record<ContactKey>(m, "ContactKey", "Both sides of a contact.")
      .field<&ContactKey::a>("a", "FeatureKey: of A")
      .field<&ContactKey::b>("b", "FeatureKey: of B")
      .finish();
  Record<ContactPoint>(m, "ContactPoint", "Where the gap of two shapes has a local minimum.")
      .field<&ContactPoint::p_WCa>("p_WCa", "numpy.ndarray: (3,) witness point on A")
      .field<&ContactPoint::p_WCb>("p_WCb", "numpy.ndarray: (3,) witness point on B")
      .field<&ContactPoint::nhat_AB_W>("nhat_AB_W", "numpy.ndarray: (3,) unit, from A to B")
      .field<&ContactPoint::gap>("gap", "float: length along the normal")
      .field<&ContactPoint::lower>("lower", "float: proven bound of the features' distance")
      .field<&ContactPoint::upper>("upper", "float: proven bound of the features' distance")
      .field<&ContactPoint::p_ACa>("p_ACa", "numpy.ndarray: (3,) the point in frame A")
      .field<&ContactPoint::p_BCb>("p_BCb", "numpy.ndarray: (3,) the point in frame B")
      .field<&ContactPoint::normal_is_of_b>("normal_is_of_b", "bool: the normal turns with B")
      .field<&ContactPoint::nhat_AB_S>("nhat_AB_S", "numpy.ndarray: (3,) in that shape's frame")
      .field<&ContactPoint::key>("key", "ContactKey: its name from step to step")
      .field<&ContactPoint::feature_a>("feature_a", "Feature: of A")
      .field<&ContactPoint::feature_b>("feature_b", "Feature: of B")
      .field<&ContactPoint::triangle_a>("triangle_a", "Optional[int]: if A is a mesh")
      .field<&ContactPoint::triangle_b>("triangle_b", "Optional[int]: if B is a mesh")
      .field<&ContactPoint::impulse_W>("impulse_W", "numpy.ndarray: (3,) on B, world axes")
      .field<&ContactPoint::previous>("previous", "Optional[int]: the contact it continues")
      .finish();
}

}  // namespace

void bind_contacts(py::module_& m) {
  bind_contact_points(m);
  m.def(
      "generate_contacts",
      [](const Shape& a, const PoseArgument& X_WA, const Shape& b, const PoseArgument& X_WB,
         Scalar reach, Scalar cone_tolerance, Scalar border_tolerance) {
        return generate_contacts(a, X_WA.X, b, X_WB.X, reach, {cone_tolerance, border_tolerance});
      },
      py::arg("a"), py::arg("X_WA"), py::arg("b"), py::arg("X_WB"), py::arg("reach"), py::kw_only(),
      py::arg("cone_tolerance") = ContactGeneratorOptions().cone_tolerance,
      py::arg("border_tolerance") = ContactGeneratorOptions().border_tolerance,
      "Pairs of features at most reach (length) apart where the gap has a local minimum: what a\n"
      "World solves its contacts for. Tolerances are sines of angles.");
  Record<ContactSolverOptions>(m, "ContactSolverOptions", "Budgets of the contact solvers.")
      .option<&ContactSolverOptions::tolerance>("tolerance", "float: length per time")
      .option<&ContactSolverOptions::sweep_limit>("sweep_limit", "int: of Gauss-Seidel")
      .option<&ContactSolverOptions::few_contacts>("few_contacts", "int: with at most as many")
      .option<&ContactSolverOptions::few_sweep_limit>("few_sweep_limit", "int: this many sweeps")
      .option<&ContactSolverOptions::newton_limit>("newton_limit", "int: of factorisations")
      .option<&ContactSolverOptions::admm_limit>("admm_limit", "int: of iterations")
      .option<&ContactSolverOptions::patience>("patience",
                                               "int: factorisations that must halve the residual")
      .option<&ContactSolverOptions::cascade_rounds>("cascade_rounds", "int: through all solvers")
      .option<&ContactSolverOptions::restart_contacts>("restart_contacts",
                                                       "int: with at most as many")
      .option<&ContactSolverOptions::friction_steps>("friction_steps", "int: of continuation")
      .option<&ContactSolverOptions::scattered_starts>("scattered_starts", "int: at random")
      .option<&ContactSolverOptions::follows_drift>("follows_drift", "bool: in Newton's iteration")
      .finish();
}

}  // namespace dyop::python
