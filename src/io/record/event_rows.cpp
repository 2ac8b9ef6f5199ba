// SPDX-License-Identifier: BSD-3-Clause
#include "io/record/event_rows.h"

#include <array>
#include <cmath>
#include <limits>

namespace dyop::io_internal {
namespace {

constexpr Scalar kNotThere = std::numeric_limits<Scalar>::quiet_NaN();

constexpr std::array<std::pair<BodyKind, std::string_view>, 3> kKinds{{
    {BodyKind::Dynamic, "dynamic"},
    {BodyKind::Kinematic, "kinematic"},
    {BodyKind::Static, "static"},
}};

FloatRow3 float_row(const Vector3& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

// The value of an enumeration whose last is `last`.
template <typename Enum>
Enum value_of(std::uint32_t number, Enum last, const char* what) {
  DYOP_REQUIRE(number <= static_cast<std::uint32_t>(last), what, " ", number, " is unknown");
  return static_cast<Enum>(number);
}

BodyId body_of(std::uint32_t slot) {
  return slot == BodyId().slot ? BodyId() : BodyId(slot);
}

std::int32_t number_row(const std::optional<std::int32_t>& number) {
  return number.value_or(-1);
}

std::optional<std::int32_t> number_of(std::int32_t row) {
  if (row < 0) return std::nullopt;
  return row;
}

FeatureRow feature_row(const Feature& feature) {
  return {static_cast<std::int32_t>(feature.kind), feature.vertices[0], feature.vertices[1],
          feature.vertices[2]};
}

Feature feature_of(const FeatureRow& row) {
  const auto kind = value_of(static_cast<std::uint32_t>(row[0]), FeatureKind::Smooth, "feature");
  return {kind, {row[1], row[2], row[3]}};
}

WitnessRow witness_row(const WitnessPair& witness) {
  return {witness.lower,
          witness.upper,
          row_of(witness.p_WCa),
          row_of(witness.p_WCb),
          row_of(witness.nhat_AB_W),
          number_row(witness.triangle_a),
          number_row(witness.triangle_b),
          number_row(witness.child_a),
          number_row(witness.child_b),
          feature_row(witness.feature_a),
          feature_row(witness.feature_b)};
}

void read_witness(const WitnessRow& row, WitnessPair& witness) {
  witness.lower = row.lower;
  witness.upper = row.upper;
  witness.p_WCa = vector_of(row.p_a);
  witness.p_WCb = vector_of(row.p_b);
  witness.nhat_AB_W = vector_of(row.normal);
  witness.triangle_a = number_of(row.triangle_a);
  witness.triangle_b = number_of(row.triangle_b);
  witness.child_a = number_of(row.child_a);
  witness.child_b = number_of(row.child_b);
  witness.feature_a = feature_of(row.feature_a);
  witness.feature_b = feature_of(row.feature_b);
}

}  // namespace

std::string_view name_of_kind(BodyKind kind) {
  for (const auto& [value, name] : kKinds) {
    if (value == kind) return name;
  }
  return "dynamic";
}

BodyKind kind_of_name(std::string_view name) {
  for (const auto& [value, known] : kKinds) {
    if (known == name) return value;
  }
  throw InvalidArgument(compose_message("unknown kind of body '", name, "'"));
}

bool is_undecided(AdvanceStatus status) {
  switch (status) {
    case AdvanceStatus::NotRun:
    case AdvanceStatus::Completed:
    case AdvanceStatus::StoppedAtImpact:
      return false;
    case AdvanceStatus::BudgetExhausted:
    case AdvanceStatus::NumericalLimit:
    case AdvanceStatus::Blocked:
    case AdvanceStatus::Cancelled:
      return true;
  }
  return true;
}

ImpactRow impact_row(const ImpactEvent& impact) {
  ImpactRow row{};
  row.t = impact.t;
  row.t_safe = impact.toi.t_safe;
  row.t_hit = impact.toi.t_hit.value_or(kNotThere);
  row.rounding_allowance = impact.toi.rounding_allowance;
  row.closing_speed = kNotThere;
  row.node_pairs = impact.toi.statistics.node_pairs;
  row.a = impact.a.slot;
  row.b = impact.b.slot;
  row.status = static_cast<std::uint32_t>(impact.toi.status);
  row.has_witness = impact.toi.contact.has_value();
  row.witness = witness_row(impact.toi.contact.value_or(ImpactContact{}));
  if (impact.toi.contact) row.closing_speed = impact.toi.contact->closing_speed;
  return row;
}

ImpactEvent impact_from(const ImpactRow& row, std::span<const ContactRow> contacts) {
  ImpactEvent impact;
  impact.t = row.t;
  impact.a = body_of(row.a);
  impact.b = body_of(row.b);
  impact.toi.status = value_of(row.status, ToiStatus::NumericalLimit, "status of an impact");
  impact.toi.t_safe = row.t_safe;
  if (!std::isnan(row.t_hit)) impact.toi.t_hit = row.t_hit;
  impact.toi.rounding_allowance = row.rounding_allowance;
  impact.toi.statistics.node_pairs = row.node_pairs;
  if (row.has_witness != 0) {
    read_witness(row.witness, impact.toi.contact.emplace());
    impact.toi.contact->closing_speed = row.closing_speed;
  }
  for (const ContactRow& contact : contacts) {
    WorldContact& world_contact = impact.contacts.emplace_back();
    world_contact.a = body_of(contact.a);
    world_contact.b = body_of(contact.b);
    world_contact.normal_velocity = contact.normal_velocity;
    world_contact.impulse_W = vector_of(contact.impulse);
    read_witness(contact.witness, world_contact.contact);
  }
  return impact;
}

ContactRow contact_row(const WorldContact& contact) {
  return {contact.a.slot, contact.b.slot, contact.normal_velocity, row_of(contact.impulse_W),
          witness_row(contact.contact)};
}

PairRow pair_row(const PairRecord& record) {
  PairRow row{};
  row.a = record.a.slot;
  row.b = record.b.slot;
  row.proof = static_cast<std::uint32_t>(record.proof);
  row.gap_lower = record.gap_lower;
  row.gap_upper = record.gap_upper;
  row.pivot = row_of(record.pivot_W);
  row.normal = row_of(record.nhat_AB_W);
  row.residual = record.residual;
  row.advancement_steps = record.advancement_steps;
  return row;
}

PairRecord pair_from(const PairRow& row, std::span<const PairContactRow> contacts) {
  PairRecord record;
  record.a = body_of(row.a);
  record.b = body_of(row.b);
  record.proof = value_of(row.proof, ProofKind::Excused, "proof of a pair");
  record.gap_lower = row.gap_lower;
  record.gap_upper = row.gap_upper;
  record.pivot_W = vector_of(row.pivot);
  record.nhat_AB_W = vector_of(row.normal);
  record.residual = row.residual;
  record.advancement_steps = row.advancement_steps;
  for (const PairContactRow& contact : contacts) {
    PairContact& pair_contact = record.contacts.emplace_back();
    pair_contact.point.p_WCa = record.pivot_W + vector_of(contact.from_pivot_a);
    pair_contact.point.p_WCb = record.pivot_W + vector_of(contact.from_pivot_b);
    pair_contact.point.nhat_AB_W = vector_of(contact.normal);
    pair_contact.point.gap = contact.gap;
    pair_contact.point.lower = contact.lower;
    pair_contact.point.upper = contact.upper;
    pair_contact.impulse_W = vector_of(contact.impulse);
  }
  return record;
}

PairContactRow pair_contact_row(const PairContact& contact, const Vector3& pivot_W) {
  const ContactPoint& point = contact.point;
  return {float_row(point.p_WCa - pivot_W),
          float_row(point.p_WCb - pivot_W),
          float_row(point.nhat_AB_W),
          float_row(contact.impulse_W),
          point.gap,
          point.lower,
          point.upper};
}

EventRow event_row(const RunEvent& event) {
  return {event.t, static_cast<std::uint32_t>(event.kind), event.a.slot, event.b.slot, 0};
}

RunEvent event_from(const EventRow& row) {
  return {value_of(row.kind, RunEventKind::Placed, "kind of event"), row.t, body_of(row.a),
          body_of(row.b)};
}

void put_report(const AdvanceReport& report, FrameRow& row) {
  row.end = report.t;
  row.status = static_cast<std::uint32_t>(report.status);
  row.a = report.offending_pair.first.slot;
  row.b = report.offending_pair.second.slot;
  const StepStatistics& work = report.work;
  row.steps = work.steps;
  row.substeps = work.substeps;
  row.islands = work.islands;
  row.rounds = work.rounds;
  row.stalls = work.stalls;
  row.contacts = work.contacts;
  row.unconverged = work.unconverged;
  row.residual = work.residual;
  row.shortest_gap = work.shortest_gap;
  row.pairs_by_bound = work.pairs_by_bound;
  row.pairs_by_query = work.pairs_by_query;
  row.pairs_at_rest = work.pairs_at_rest;
  row.pairs_excused = work.pairs_excused;
  row.integrator_steps = report.integrator.steps;
  row.rejected_steps = report.integrator.rejected_steps;
  row.function_evaluations = report.integrator.function_evaluations;
  row.box_tests = report.toi.box_tests;
  row.leaf_tests = report.toi.leaf_tests;
  row.node_pairs = report.toi.node_pairs;
  row.peak_queue = report.toi.peak_queue;
}

RecordedFrame frame_from(const FrameRow& row) {
  RecordedFrame frame;
  frame.interval = {row.begin, row.end};
  frame.status = value_of(row.status, AdvanceStatus::Cancelled, "status of a frame");
  frame.offending_pair = {body_of(row.a), body_of(row.b)};
  frame.kinetic_energy = row.kinetic_energy;
  frame.momentum = vector_of(row.momentum);
  frame.angular_momentum = vector_of(row.angular_momentum);
  frame.work = {row.steps,        row.substeps,       row.islands,        row.rounds,
                row.stalls,       row.contacts,       row.unconverged,    row.residual,
                row.shortest_gap, row.pairs_by_bound, row.pairs_by_query, row.pairs_at_rest,
                row.pairs_excused};
  frame.integrator = {row.integrator_steps, row.rejected_steps, row.function_evaluations};
  frame.toi = {row.box_tests, row.leaf_tests, row.node_pairs, row.peak_queue};
  return frame;
}

}  // namespace dyop::io_internal
