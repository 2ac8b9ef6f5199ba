// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

#include "io/record/hdf5_file.h"

/// The rows of the tables of docs/formats.md, as stored in the file.
namespace dyop::io_internal {

using Row3 = std::array<double, 3>;
using FloatRow3 = std::array<float, 3>;
using FeatureRow = std::array<std::int32_t, 4>;

/// Version 2 added the rows of cubics that do not repeat their chart, version 3 what a run is
/// checked with. Readers of a version read those before it.
constexpr std::int64_t kRecordingVersion = 3;
constexpr std::int64_t kVersionWithImpulses = 3;
constexpr const char* kRecordingFormat = "dyop recording";

struct SegmentRow {
  double begin;
  std::uint64_t first;
  std::uint32_t body;
  std::uint32_t kind;
};

struct StepRow {
  double begin;
  double end;
};

struct WitnessRow {
  double lower;
  double upper;
  Row3 p_a;
  Row3 p_b;
  Row3 normal;
  std::int32_t triangle_a;
  std::int32_t triangle_b;
  std::int32_t child_a;
  std::int32_t child_b;
  FeatureRow feature_a;
  FeatureRow feature_b;
};

struct ImpactRow {
  double t;
  double t_safe;
  double t_hit;
  double rounding_allowance;
  double closing_speed;
  std::int64_t node_pairs;
  std::uint64_t first_contact;
  std::uint64_t contact_count;
  std::uint32_t a;
  std::uint32_t b;
  std::uint32_t status;
  std::uint32_t has_witness;
  WitnessRow witness;
};

struct ContactRow {
  std::uint32_t a;
  std::uint32_t b;
  double normal_velocity;
  Row3 impulse;
  WitnessRow witness;
};

struct PairRow {
  std::uint32_t frame;
  std::uint32_t a;
  std::uint32_t b;
  std::uint32_t proof;
  double gap_lower;
  double gap_upper;
  Row3 pivot;
  Row3 normal;
  double residual;
  std::int64_t advancement_steps;
  std::uint64_t first_contact;
  std::uint64_t contact_count;
};

/// Drawn, not computed with: places, relative to the pair's pivot, in single precision.
struct PairContactRow {
  FloatRow3 from_pivot_a;
  FloatRow3 from_pivot_b;
  FloatRow3 normal;
  FloatRow3 impulse;
  double gap;
  double lower;
  double upper;
};

struct EventRow {
  double t;
  std::uint32_t kind;
  std::uint32_t a;
  std::uint32_t b;
  std::uint32_t unused;
};

/// A VelocityChange: the rows of the other tables that belong to it.
struct VelocityChangeRow {
  double begin;
  double end;
  std::uint32_t kind;
  std::uint32_t momentum_count;
  std::uint32_t contact_count;
  std::uint32_t link_count;
  std::uint32_t wrench_count;
  std::uint32_t unused;
  std::uint64_t first_momentum;
  std::uint64_t first_contact;
  std::uint64_t first_link;
  std::uint64_t first_wrench;
};

/// Before a change (only where that is not what the last one left), or after it.
struct MomentumRow {
  std::uint32_t body;
  std::uint32_t is_before;
  Row3 v;
  Row3 L;
};

struct ContactImpulseRow {
  std::uint32_t a;
  std::uint32_t b;
  Row3 p;
  Row3 normal;
  Row3 impulse;
  double target;
  double friction;
};

struct LinkImpulseRow {
  std::uint32_t kind;
  std::uint32_t a;
  std::uint32_t b;
  std::uint32_t unused;
  Row3 impulse;
  Row3 angular_a;
  Row3 angular_b;
};

/// Of a body with a wrench of its own, gravity included.
struct WrenchImpulseRow {
  std::uint32_t body;
  std::uint32_t unused;
  Row3 impulse;
  Row3 angular;
};

/// Of a tool's run: a snapshot whose vertices are rows of /snapshot_vertices; or another mesh, of
/// duration 0, whose triangles are rows of /snapshot_triangles.
struct SnapshotRow {
  std::uint32_t obstacle;
  std::uint32_t number;  // of the obstacle, from 1
  double duration;
  std::uint64_t first_vertex;
  std::uint64_t vertex_count;
};

/// The triangles of a mesh among the snapshots.
struct MeshRow {
  std::uint32_t obstacle;
  std::uint32_t number;  // of the snapshot
  std::uint64_t first_triangle;
  std::uint64_t triangle_count;
};

struct FrameRow {
  double begin;
  double end;
  std::uint32_t status;
  std::uint32_t a;
  std::uint32_t b;
  std::uint32_t unused;
  double kinetic_energy;
  Row3 momentum;
  Row3 angular_momentum;
  std::int64_t steps, substeps, islands, rounds, stalls, contacts, unconverged;
  double residual;
  double shortest_gap;
  std::int64_t pairs_by_bound, pairs_by_query, pairs_at_rest, pairs_excused;
  std::int64_t integrator_steps, rejected_steps, function_evaluations;
  std::int64_t box_tests, leaf_tests, node_pairs, peak_queue;
  /// Lengths of the other datasets at the end of this frame.
  std::uint64_t step_count, segment_count, number_count, impact_count, contact_count, pair_count,
      pair_contact_count, event_count, body_bytes, shape_bytes, given_bytes, vertex_count,
      triangle_count;
  /// Since version 3; 0 in older files.
  std::uint64_t change_count, momentum_count, contact_impulse_count, link_impulse_count,
      wrench_impulse_count, rule_bytes;
};

/// For the structs above.
template <typename Row>
Hdf5RowType row_type();

}  // namespace dyop::io_internal
