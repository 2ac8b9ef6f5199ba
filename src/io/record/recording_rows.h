// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/core/types.h"
#include "dyop/dynamics/advance_report.h"
#include "dyop/geometry/shape.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/io/recording.h"
#include "io/json_reader.h"
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

/// Impulse on a body with a wrench of its own, gravity included.
struct WrenchImpulseRow {
  std::uint32_t body;
  std::uint32_t unused;
  Row3 impulse;
  Row3 angular;
};

/// A snapshot of a tool's run, whose vertices are rows of /snapshot_vertices; or another mesh, of
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

// Velocity changes as rows, and back.

/// The rows of one change, without its own.
struct VelocityChangeRows {
  std::vector<MomentumRow> momenta;
  std::vector<ContactImpulseRow> contacts;
  std::vector<LinkImpulseRow> links;
  std::vector<WrenchImpulseRow> wrenches;
};

/// Velocity and angular momentum of a body, as the last change left them.
struct KnownMomentum {
  bool is_known = false;
  Vector3 v_W = Vector3::Zero();
  Vector3 L_W = Vector3::Zero();
};

/// @param known By slot; updated.
/// @param has_wrench By slot.
VelocityChangeRows rows_of(const VelocityChange& change, std::vector<KnownMomentum>& known,
                           const std::vector<bool>& has_wrench);

/// Only the impulses of wrenches that have a row are known; the others are zero.
VelocityChange change_from(const VelocityChangeRow& row, const VelocityChangeRows& rows,
                           std::vector<KnownMomentum>& known);

// The datasets of a recording as rows of one type.

/// A dataset that is written; rows wait for the end of the frame.
template <typename Row>
class OutputRows {
 public:
  OutputRows(Hdf5File& file, const char* name, hid_t type, hsize_t columns, hsize_t chunk_rows)
      : dataset_(file, name, type, columns, chunk_rows) {}

  void add(const Row& row) { waiting_.push_back(row); }
  template <typename Range>
  void add_all(const Range& rows) {
    waiting_.insert(waiting_.end(), std::begin(rows), std::end(rows));
  }
  /// Including the rows that wait.
  std::uint64_t length() const { return dataset_.length() + waiting_.size(); }
  void flush() {
    if (waiting_.empty()) return;
    dataset_.append(waiting_.data(), waiting_.size());
    dataset_.flush();
    waiting_.clear();
  }

 private:
  Hdf5Dataset dataset_;
  std::vector<Row> waiting_;
};

/// A dataset that is read.
template <typename Row>
class InputRows {
 public:
  InputRows(Hdf5File& file, const char* name, hid_t type, hsize_t columns)
      : dataset_(Hdf5Dataset::open(file, name, type, columns)) {}

  std::uint64_t length() const { return dataset_.length(); }
  /// Throws unless these rows exist.
  void require(std::uint64_t first, std::uint64_t count) const { dataset_.require(first, count); }
  std::vector<Row> read(std::uint64_t first, std::uint64_t count) const {
    std::vector<Row> rows;
    read(first, count, rows);
    return rows;
  }
  /// The same in memory that was used before.
  void read(std::uint64_t first, std::uint64_t count, std::vector<Row>& rows) const {
    dataset_.require(first, count);
    rows.resize(count);
    dataset_.read(first, count, rows.data());
  }

 private:
  Hdf5Dataset dataset_;
};

/// A long dataset that is read at random: caches the blocks that were read last.
template <typename Row>
class BlockCache {
 public:
  /// @param known Number of final rows: only they are cached.
  std::vector<Row> read(const InputRows<Row>& rows, std::uint64_t first, std::uint64_t count,
                        std::uint64_t known) {
    if (first > known || count > known - first) return rows.read(first, count);
    std::vector<Row> result;
    result.reserve(count);
    for (std::uint64_t next = first; next < first + count;) {
      const std::vector<Row>& block = block_of(rows, next, known);
      const std::uint64_t start = next / kBlockRows * kBlockRows;
      const std::uint64_t end = std::min(first + count, start + kBlockRows);
      result.insert(result.end(), block.begin() + std::ptrdiff_t(next - start),
                    block.begin() + std::ptrdiff_t(end - start));
      next = end;
    }
    return result;
  }

  Row at(const InputRows<Row>& rows, std::uint64_t number, std::uint64_t known) {
    if (number >= known) return rows.read(number, 1).front();
    return block_of(rows, number, known)[number % kBlockRows];
  }

 private:
  static constexpr std::uint64_t kBlockRows = 1 << 15;
  static constexpr std::size_t kMostBlocks = 1 << 10;  // 256 MB of doubles

  // The last block is read again once more of its rows are known.
  const std::vector<Row>& block_of(const InputRows<Row>& rows, std::uint64_t row,
                                   std::uint64_t known) {
    const std::size_t number = row / kBlockRows;
    const std::uint64_t start = number * kBlockRows;
    const std::uint64_t count = std::min(kBlockRows, known - start);
    if (number >= blocks_.size()) blocks_.resize(number + 1);
    if (blocks_[number].size() == count) return blocks_[number];
    if (blocks_[number].empty()) make_space_for(number);
    blocks_[number] = rows.read(start, count);
    return blocks_[number];
  }

  void make_space_for(std::size_t number) {
    if (loaded_.size() < kMostBlocks) {
      loaded_.push_back(number);
      return;
    }
    std::vector<Row>().swap(blocks_[loaded_[oldest_]]);
    loaded_[oldest_] = number;
    oldest_ = (oldest_ + 1) % kMostBlocks;
  }

  std::vector<std::vector<Row>> blocks_;  // by number; empty: not loaded
  std::vector<std::size_t> loaded_;       // numbers, a ring once it is full
  std::size_t oldest_ = 0;
};

// Shapes as the lines and rows of docs/formats.md, and back with every bit.

/// Rows of /vertices and /triangles.
struct ShapeRows {
  std::vector<std::array<double, 3>> vertices;
  std::vector<std::array<std::int32_t, 3>> triangles;
};

/// Stores each shape once. Numbers shapes from 0 in the order of their lines.
class ShapeWriter {
 public:
  /// The number of the shape. A new shape is appended to `lines` and `rows`.
  /// @throws InvalidArgument for a shape of a kind that dyop does not define.
  std::size_t add(const std::shared_ptr<const Shape>& shape, std::string& lines, ShapeRows& rows);

 private:
  struct Stored {
    std::shared_ptr<const Shape> shape;
    std::uint64_t hash;
  };
  std::vector<Stored> stored_;
  std::uint64_t vertex_count_ = 0;
  std::uint64_t triangle_count_ = 0;
};

/// A pose as 12 numbers, the rotation row by row and then the position, and back with every bit.
Json pose_numbers(const RigidPose& X);
RigidPose pose_from_numbers(const Json& json);

/// The hash of docs/formats.md.
std::uint64_t content_hash(const Shape& shape);

/// The shape of a line.
/// @param earlier Shapes of the lines before it.
/// @throws FileError, InvalidArgument, or an exception of nlohmann for a line of the wrong form.
std::shared_ptr<const Shape> shape_from(const Json& line, const ShapeRows& rows,
                                        std::span<const std::shared_ptr<const Shape>> earlier);

// Impacts, pairs, events and reports as rows, and back.

inline Row3 row_of(const Vector3& v) {
  return {v.x(), v.y(), v.z()};
}

inline Vector3 vector_of(const Row3& row) {
  return {row[0], row[1], row[2]};
}
inline Vector3 vector_of(const FloatRow3& row) {
  return {Scalar(row[0]), Scalar(row[1]), Scalar(row[2])};
}

std::string_view name_of_kind(BodyKind kind);
/// Throws InvalidArgument.
BodyKind kind_of_name(std::string_view name);

/// A report with one of these statuses did not reach its end.
bool is_undecided(AdvanceStatus status);

/// Does not set the rows of contacts; the caller does.
ImpactRow impact_row(const ImpactEvent& impact);
ImpactEvent impact_from(const ImpactRow& row, std::span<const ContactRow> contacts);
ContactRow contact_row(const WorldContact& contact);

PairRow pair_row(const PairRecord& record);
PairRecord pair_from(const PairRow& row, std::span<const PairContactRow> contacts);
PairContactRow pair_contact_row(const PairContact& contact, const Vector3& pivot_W);

EventRow event_row(const RunEvent& event);
RunEvent event_from(const EventRow& row);

/// Everything in a frame except its start, its energies and the lengths.
void put_report(const AdvanceReport& report, FrameRow& row);
RecordedFrame frame_from(const FrameRow& row);

}  // namespace dyop::io_internal
