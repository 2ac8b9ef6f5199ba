// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <limits>
#include <span>

#include "dyop/geometry/mesh_topology.h"
#include "dyop/toi/deforming_mesh.h"
#include "haptics/obstacle.h"

namespace dyop::haptics_internal {

/// Tissue whose vertices move on straight lines from snapshot to snapshot.
///
/// Two meshes alternate. One is shown; the other is free for give(), which refits or replaces it in
/// the caller's thread, or holds the next motion. A single flag hands it over, so neither side ever
/// waits, and the tick never frees a mesh.
class DeformingObstacle final : public Obstacle {
 public:
  DeformingObstacle(const std::vector<Vector3>& vertices,
                    const std::vector<TriangleIndices>& triangles);

  /// See HapticSession::give_snapshot(). From one thread at a time.
  bool give(std::span<const Vector3> vertices, Scalar duration);
  /// See HapticSession::give_mesh(). From the same thread.
  bool give_mesh(std::span<const Vector3> vertices, std::span<const TriangleIndices> triangles);

  /// The current position of the mesh: shown().triangle(i, fraction()).
  const DeformingMesh& shown() const { return meshes_[shown_].mesh; }
  Scalar fraction() const { return fraction_; }
  /// Position of a vertex.
  Vector3 place(std::int32_t vertex) const;
  std::int64_t snapshots_taken() const { return snapshots_taken_; }
  bool has_next() const { return has_next_.load(std::memory_order_acquire); }

  PairImpact first_impact(const BodyMotion& motion, const ToiOptions& options, WorkClock& clock,
                          PairMemory& kept, QueryMemory& memory) const override;
  void add_holds(const ToolBody& body, const RigidPose& X_WB, const ExpectedApproach& approach,
                 WorkShare& share, PairMemory& kept, QueryMemory& memory,
                 std::vector<HoldPoint>& holds) const override;
  PairDistance measure(const ToolBody& body, const RigidPose& X_WB, const DistanceWish& wish,
                       WorkShare& share, PairMemory& kept) const override;
  PairDistance measure_again(const ToolBody& body, const RigidPose& X_WB,
                             const PairMemory& kept) const override;
  std::optional<bool> is_apart_at(const ToolBody& body, const RigidPose& X_WB, WorkClock& clock,
                                  PairMemory& kept) const override;
  void let_see(std::int64_t snapshots) override { most_seen_ = snapshots; }
  std::int64_t snapshots_seen() const override { return snapshots_seen_; }
  Scalar speed() const override { return shown().largest_displacement() * rate(); }
  Scalar time_left() const override;
  void stop(Scalar dt) override { lag_ += dt; }
  void stand(bool is_standing) override { is_standing_ = is_standing; }
  Scalar lag() const override { return fraction_ < 1 || is_next_seen_ ? lag_ : 0; }
  bool start_tick() override;
  void pass(Scalar dt) override;
  bool go_on() override;

 private:
  struct Surface {
    Surface(DeformingMesh given, std::int64_t number)
        : mesh(std::move(given)),
          topology(mesh.begin().size(), mesh.triangles()),
          slabs(mesh),
          version(number) {}

    DeformingMesh mesh;
    MeshTopology topology;
    MeshSlabs slabs;
    std::int64_t version;  // counts the meshes given
  };

  StandingPair standing(Scalar fraction, const CorePiece& piece, const RigidPose& X_WB) const {
    return {shown(), fraction, piece.mesh, X_WB, &meshes_[shown_].slabs};
  }
  // Rate of the fraction, per time; 0 at rest.
  Scalar rate() const { return is_standing_ ? 0 : rate_; }
  Surface& spare() { return meshes_[1 - shown_]; }
  void hand_over(Scalar duration);
  Vector3 velocity_at(std::int32_t triangle, const Vector3& p_W, Scalar s) const;
  bool is_minimum(const CorePiece& piece, const RigidPose& X_WB, const PieceDistance& pair,
                  std::int32_t triangle_a, std::int32_t triangle_b) const;
  struct Approach {
    Scalar near;  // what a motion must keep
    Scalar far;   // at the start, plus the displacement: surely apart
  };
  enum class Search { Through, CutOff, Crossing };
  Search find_suspects(const CorePiece& piece, const BodyMotion& motion, const Approach& approach,
                       WorkClock& clock, PairFront& front, std::vector<BoxPair>& suspects) const;
  void ask(const CorePiece& piece, const BodyMotion& motion, const ToiOptions& options,
           WorkClock& clock, QueryMemory& memory, PairImpact& impact) const;
  Scalar fraction_after(Scalar dt) const;

  std::array<Surface, 2> meshes_;
  std::size_t shown_ = 0;
  Scalar fraction_ = 1;
  Scalar rate_ = 0;  // unless it stands
  bool is_standing_ = false;
  Scalar lag_ = 0;  // since the newest snapshot was seen, or it got there
  std::int64_t snapshots_taken_ = 0;
  // Whether the mesh that is not shown is the next one. Set by give(), cleared by the tick.
  std::atomic<bool> has_next_{false};
  Scalar next_duration_ = 0;  // 0: another mesh, at rest
  std::int64_t snapshots_seen_ = 0;
  std::int64_t most_seen_ = std::numeric_limits<std::int64_t>::max();
  bool is_next_seen_ = false;  // as it was when the tick started
};

}  // namespace dyop::haptics_internal
