// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/contact/contact_generator.h"
#include "dyop/contact/contact_solver.h"
#include "dyop/dynamics/advance_report.h"
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
      .finish();
}

namespace {

void bind_impacts(py::module_& m) {
  Record<WorldContact>(m, "WorldContact", "One touching place of two bodies at an impact.")
      .field<&WorldContact::a>("a", "BodyId: A")
      .field<&WorldContact::b>("b", "BodyId: B")
      .field<&WorldContact::contact>("contact", "WitnessPair: where")
      .field<&WorldContact::normal_velocity>("normal_velocity",
                                             "float: rate of the gap before the impulse")
      .field<&WorldContact::impulse_W>("impulse_W", "numpy.ndarray: (3,) on B; on A the opposite")
      .finish();
  Record<ImpactEvent>(m, "ImpactEvent", "Everything known about one impact.")
      .field<&ImpactEvent::t>("t", "float: when")
      .field<&ImpactEvent::a>("a", "BodyId: of the pair that met first")
      .field<&ImpactEvent::b>("b", "BodyId: of the pair that met first")
      .field<&ImpactEvent::toi>("toi", "ToiResult: of that pair")
      .field<&ImpactEvent::contacts>("contacts", "tuple[WorldContact, ...]: solved at that instant")
      .finish();
  Record<SensorEvent>(m, "SensorEvent", "The start or end of an overlap with a sensor.")
      .field<&SensorEvent::sensor>("sensor", "BodyId: the sensor")
      .field<&SensorEvent::body>("body", "BodyId: what overlaps it")
      .field<&SensorEvent::t>("t", "float: when it was noticed")
      .field<&SensorEvent::is_overlap>("is_overlap", "bool: begins or ends")
      .finish();
  Record<ContactEvent>(m, "ContactEvent", "Two bodies begin to touch, or cease to.")
      .field<&ContactEvent::a>("a", "BodyId: A")
      .field<&ContactEvent::b>("b", "BodyId: B")
      .field<&ContactEvent::t>("t", "float: of an impact, else the end of the step")
      .field<&ContactEvent::is_begin>("is_begin", "bool: begins or ends")
      .finish();
  Record<BrokenJoint>(m, "BrokenJoint", "A joint that bore more than it can and was removed.")
      .field<&BrokenJoint::joint>("joint", "JointId: names it no longer")
      .field<&BrokenJoint::name>("name", "str: of its definition")
      .field<&BrokenJoint::a>("a", "BodyId: A")
      .field<&BrokenJoint::b>("b", "BodyId: B")
      .field<&BrokenJoint::t>("t", "float: the end of the step")
      .field<&BrokenJoint::force>("force", "float: mean over the step")
      .field<&BrokenJoint::torque>("torque", "float: mean over the step")
      .finish();
}

void bind_velocity_changes(py::module_& m) {
  using Kind = VelocityChangeKind;
  py::enum_<Kind>(m, "VelocityChangeKind", "What changed velocities at an instant.")
      .value("Move", Kind::Move, "First half of a contact substep.")
      .value("End", Kind::End, "Its second half.")
      .value("Impact", Kind::Impact, "One round of the impact law.")
      .value("Stall", Kind::Stall, "No motion was found: the bodies were stopped.")
      .value("Sleep", Kind::Sleep, "The bodies fell asleep.")
      .value("Set", Kind::Set, "The caller, or ImpactPolicy.Callback.");
  py::enum_<LinkImpulse::Kind>(m, "LinkKind", "What a LinkImpulse is of.")
      .value("Joint", LinkImpulse::Kind::Joint)
      .value("Spring", LinkImpulse::Kind::Spring)
      .value("Rolling", LinkImpulse::Kind::Rolling, "Friction against rolling.");
  Record<ContactImpulse>(m, "ContactImpulse", "The impulse of one contact.")
      .field<&ContactImpulse::a>("a", "BodyId: A")
      .field<&ContactImpulse::b>("b", "BodyId: B")
      .field<&ContactImpulse::p_W>("p_W", "numpy.ndarray: (3,) where it acts on both")
      .field<&ContactImpulse::nhat_AB_W>("nhat_AB_W", "numpy.ndarray: (3,) unit")
      .field<&ContactImpulse::impulse_W>("impulse_W", "numpy.ndarray: (3,) on B")
      .field<&ContactImpulse::target>("target", "float: normal velocity that was asked for")
      .field<&ContactImpulse::friction>("friction", "float: nan under WorldOptions.friction_law")
      .finish();
  Record<LinkImpulse>(m, "LinkImpulse", "What a joint, spring or rolling friction did.")
      .field<&LinkImpulse::kind>("kind", "LinkKind: of what")
      .field<&LinkImpulse::a>("a", "BodyId: A")
      .field<&LinkImpulse::b>("b", "BodyId: B")
      .field<&LinkImpulse::impulse_W>("impulse_W", "numpy.ndarray: (3,) on B")
      .field<&LinkImpulse::angular_a_W>("angular_a_W", "numpy.ndarray: (3,) on A")
      .field<&LinkImpulse::angular_b_W>("angular_b_W", "numpy.ndarray: (3,) on B")
      .finish();
  using Change = MomentumChange;
  Record<Change>(m, "MomentumChange", "Of one body, about its centre of mass, world axes.")
      .field<&Change::body>("body", "BodyId: the body")
      .field<&Change::v_before_W>("v_before_W", "numpy.ndarray: (3,) velocity before")
      .field<&Change::L_before_W>("L_before_W", "numpy.ndarray: (3,) angular momentum before")
      .field<&Change::v_W>("v_W", "numpy.ndarray: (3,) velocity after")
      .field<&Change::L_W>("L_W", "numpy.ndarray: (3,) angular momentum after")
      .field<&Change::impulse_W>("impulse_W", "numpy.ndarray: (3,) of gravity and its own wrench")
      .field<&Change::angular_impulse_W>("angular_impulse_W", "numpy.ndarray: (3,) likewise")
      .finish();
  Record<VelocityChange>(m, "VelocityChange",
                         "Bodies whose velocities changed together, and all impulses that did it.")
      .field<&VelocityChange::kind>("kind", "VelocityChangeKind: why")
      .field<&VelocityChange::interval>("interval", "TimeInterval: the substep, or one time")
      .field<&VelocityChange::bodies>("bodies", "tuple[MomentumChange, ...]: before and after")
      .field<&VelocityChange::contacts>("contacts", "tuple[ContactImpulse, ...]: those not zero")
      .field<&VelocityChange::links>("links", "tuple[LinkImpulse, ...]: joints, springs, rolling")
      .finish();
}

void bind_statistics(py::module_& m) {
  using Work = StepStatistics;
  Record<Work>(m, "StepStatistics", "Counts over the steps of an advance.")
      .field<&Work::steps>("steps", "int: of the World")
      .field<&Work::substeps>("substeps", "int: substeps taken, summed over islands")
      .field<&Work::islands>("islands", "int: that were stepped")
      .field<&Work::rounds>("rounds", "int: contact solves with new constraints")
      .field<&Work::stalls>("stalls", "int: substeps in which an island stood still")
      .field<&Work::contacts>("contacts", "int: largest number at once")
      .field<&Work::unconverged>("unconverged", "int: contact solves above their tolerance")
      .field<&Work::residual>("residual", "float: the largest, length per time")
      .field<&Work::shortest_gap>("shortest_gap", "float: of a contact at the end of a step")
      .field<&Work::pairs_by_bound>("pairs_by_bound", "int: proven apart by a bound")
      .field<&Work::pairs_by_query>("pairs_by_query", "int: proven apart by a query")
      .field<&Work::pairs_at_rest>("pairs_at_rest", "int: neither moved")
      .field<&Work::pairs_excused>("pairs_excused", "int: not proven, see too_near")
      .field<&Work::discarded_runs>("discarded_runs", "int: islands that were stepped again")
      .finish();
  using Times = StepTimes;
  Record<Times>(m, "StepTimes", "Seconds that the parts of an advance took; sums over threads.")
      .field<&Times::broad_phase>("broad_phase", "float: finding pairs that may meet")
      .field<&Times::flight>("flight", "float: integrating bodies that nothing touches")
      .field<&Times::contacts>("contacts", "float: finding contacts")
      .field<&Times::solve>("solve", "float: solving for impulses")
      .field<&Times::ends>("ends", "float: finding where contacts are at the end of a step")
      .field<&Times::proofs>("proofs", "float: distance and impact queries")
      .field<&Times::total>("total", "float: from start to end")
      .finish();
  Record<IntegratorStatistics>(m, "IntegratorStatistics", "Work of the integrators.")
      .field<&IntegratorStatistics::steps>("steps", "int: accepted")
      .field<&IntegratorStatistics::rejected_steps>("rejected_steps", "int: rejected")
      .field<&IntegratorStatistics::function_evaluations>("function_evaluations",
                                                          "int: of the right-hand side")
      .finish();
}

void bind_advance_report(py::module_& m) {
  py::enum_<AdvanceStatus>(m, "AdvanceStatus", "How an advance ended.")
      .value("NotRun", AdvanceStatus::NotRun)
      .value("Completed", AdvanceStatus::Completed, "Reached the requested end.")
      .value("StoppedAtImpact", AdvanceStatus::StoppedAtImpact)
      .value("BudgetExhausted", AdvanceStatus::BudgetExhausted, "Safe up to time().")
      .value("NumericalLimit", AdvanceStatus::NumericalLimit, "Safe up to time().")
      .value("Blocked", AdvanceStatus::Blocked, "Safe up to time().")
      .value("Cancelled", AdvanceStatus::Cancelled, "Safe up to time().");
  Record<CommittedStep>(m, "CommittedStep", "Every body follows its motion over the interval.")
      .field<&CommittedStep::interval>("interval", "TimeInterval: of the step")
      .field<&CommittedStep::motions>("motions", "tuple[Optional[Motion], ...]: by slot")
      .finish();
  using Report = AdvanceReport;
  Record<Report>(m, "AdvanceReport", "What World.advance() did.")
      .field<&Report::status>("status", "AdvanceStatus: how it ended")
      .field<&Report::t>("t", "float: World.time() on return")
      .field<&Report::impacts>("impacts", "tuple[ImpactEvent, ...]: in order of time")
      .field<&Report::fell_asleep>("fell_asleep", "tuple[BodyId, ...]: in order of time")
      .field<&Report::woke>("woke", "tuple[BodyId, ...]: in order of time")
      .field<&Report::sensors>("sensors", "tuple[SensorEvent, ...]: overlaps with sensors")
      .field<&Report::contact_events>("contact_events",
                                      "tuple[ContactEvent, ...]: in order of steps")
      .field<&Report::broken_joints>("broken_joints", "tuple[BrokenJoint, ...]: in order of steps")
      .field<&Report::too_near>(
          "too_near", "tuple[Tuple[BodyId, BodyId], ...]: nearer than their target at first")
      .field<&Report::parted>("parted", "tuple[Tuple[BodyId, BodyId], ...]: no longer too near")
      .field<&Report::placed>("placed", "tuple[BodyId, ...]: put elsewhere since the last advance")
      .field<&Report::crossed>("crossed",
                               "tuple[Tuple[BodyId, BodyId], ...]: that no force can move apart")
      .field<&Report::steps>("steps", "tuple[CommittedStep, ...]: the proven trajectory")
      .field<&Report::velocity_changes>(
          "velocity_changes", "tuple[VelocityChange, ...]: under WorldOptions.records_impulses")
      .field<&Report::offending_pair>("offending_pair",
                                      "Tuple[BodyId, BodyId]: that stopped it, if any did")
      .field<&Report::integrator>("integrator", "IntegratorStatistics: sums")
      .field<&Report::toi>("toi", "ToiStatistics: sums over all queries")
      .field<&Report::work>("work", "StepStatistics: sums")
      .field<&Report::times>("times", "StepTimes: under WorldOptions.measures_time")
      .finish();
}

void bind_pair_records(py::module_& m) {
  py::enum_<ProofKind>(m, "ProofKind", "Why two bodies are known to have kept apart over a step.")
      .value("ByBound", ProofKind::ByBound)
      .value("ByQuery", ProofKind::ByQuery)
      .value("AtRest", ProofKind::AtRest)
      .value("Excused", ProofKind::Excused, "Not proven: they began too near.");
  Record<PairContact>(m, "PairContact", "A contact at the end of a step.")
      .field<&PairContact::point>("point", "ContactPoint: at the poses of World.time()")
      .field<&PairContact::impulse_W>("impulse_W", "numpy.ndarray: (3,) on B over the last step")
      .finish();
  Record<PairRecord>(m, "PairRecord", "What is known of two near bodies after a step.")
      .field<&PairRecord::a>("a", "BodyId: A")
      .field<&PairRecord::b>("b", "BodyId: B")
      .field<&PairRecord::proof>("proof", "ProofKind: of the last step")
      .field<&PairRecord::gap_lower>("gap_lower", "float: proven, at World.time()")
      .field<&PairRecord::gap_upper>("gap_upper", "float: infinite if it was not needed")
      .field<&PairRecord::pivot_W>("pivot_W", "numpy.ndarray: (3,) dynamic pivot point")
      .field<&PairRecord::nhat_AB_W>("nhat_AB_W", "numpy.ndarray: (3,) unit, from A to B")
      .field<&PairRecord::advancement_steps>("advancement_steps", "int: node pairs of the query")
      .field<&PairRecord::contacts>("contacts", "tuple[PairContact, ...]: of the pair")
      .field<&PairRecord::residual>("residual", "float: of the last solve, length per time")
      .finish();
}

}  // namespace

void bind_reports(py::module_& m) {
  bind_impacts(m);
  bind_velocity_changes(m);
  bind_statistics(m);
  bind_advance_report(m);
  bind_pair_records(m);
}

}  // namespace dyop::python
