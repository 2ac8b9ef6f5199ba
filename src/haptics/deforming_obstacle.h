// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "dyop/geometry/mesh_topology.h"
#include "dyop/haptics/haptic_observer.h"
#include "dyop/haptics/haptic_session.h"
#include "dyop/toi/deforming_mesh.h"
#include "haptics/obstacle.h"

namespace dyop::haptics_internal {

/// Tissue whose vertices move on straight lines from snapshot to snapshot.
///
/// Two meshes alternate. One is shown; the other is free for give(), which refits or replaces it in
/// the caller's thread, or holds the next motion. A single flag hands it over, so neither side ever
/// waits, and the tick never frees a mesh.
///
/// retarget() ends the shown motion at a fraction of it (turn_at_), from which the next one sets
/// out. Each tick reads that fraction when it starts. If it has come farther by then, tissue stands
/// where it is and the tick tells where that is (adopted_).
class DeformingObstacle final : public Obstacle {
 public:
  DeformingObstacle(const std::vector<Vector3>& vertices,
                    const std::vector<TriangleIndices>& triangles);

  /// See HapticSession::give_snapshot(). From one thread at a time.
  bool give(std::span<const Vector3> vertices, Scalar duration);
  /// See HapticSession::give_mesh(). From the same thread.
  bool give_mesh(std::span<const Vector3> vertices, std::span<const TriangleIndices> triangles);
  /// See HapticSession::retarget(). From the same thread.
  bool retarget(std::span<const Vector3> vertices, Scalar duration, Scalar lead);
  /// See HapticSession::find_contacts(). From the same thread; `kept` is memory for that.
  bool find_holds(const ObstacleProgress& where, const ToolBody& body, const RigidPose& X_WB,
                  const ContactSearch& search, PairMemory& kept,
                  std::vector<HoldPoint>& holds) const;

  /// The current position of the mesh: shown().triangle(i, fraction()).
  const DeformingMesh& shown() const { return surface().mesh; }
  Scalar fraction() const { return fraction_; }
  /// Position of a vertex.
  Vector3 place(std::int32_t vertex) const;
  std::int64_t snapshots_taken() const { return snapshots_taken_; }
  bool has_next() const { return next_.load(std::memory_order_acquire) != Next::None; }
  /// See HapticSession::replay_turn(); no other thread uses the obstacle meanwhile.
  void replay_turn(Scalar end);
  /// See HapticSession::expect_snapshots().
  void expect_snapshots();
  /// The observer, or null, is told of what is handed over, as of the obstacle with this number.
  void observe(HapticObserver* observer, std::size_t number);
  /// Nothing was given, nor asked for.
  bool is_fresh() const { return next_given_ == 0 && turns_asked_.load() == 0; }

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
  ObstacleProgress progress() const override { return {snapshots_taken_, fraction_}; }
  ObstacleInput input() const override { return input_; }
  Scalar speed() const override { return shown().largest_displacement() * rate(); }
  Scalar time_left() const override;
  void stop(Scalar dt) override;
  void stand(bool is_standing) override { is_standing_ = is_standing; }
  Scalar lag() const override { return fraction_ < 1 || is_next_seen_ ? lag_ : 0; }
  Scalar behind() const override { return behind_.value_or(0); }
  bool start_tick() override;
  void end_tick() override;
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
    std::int64_t version;       // counts the meshes given
    std::int64_t snapshot = 0;  // its number, or that of the mesh
    Scalar duration = 0;        // of its motion
  };
  // A surface at a fraction of its motion.
  struct Place {
    const Surface& surface;
    Scalar fraction;
    Scalar rate;  // of the fraction, per time
  };
  // What the giver hands over: it may take back what is only offered.
  enum class Next { None, Offered, InUse };

  const Surface& surface() const { return meshes_[shown_.load(std::memory_order_relaxed)]; }
  Place place_now() const { return {surface(), fraction_, rate()}; }
  static StandingPair standing(const Place& place, const CorePiece& piece, const RigidPose& X_WB) {
    return {place.surface.mesh, place.fraction, piece.mesh, X_WB, &place.surface.slabs};
  }
  StandingPair standing(Scalar fraction, const CorePiece& piece, const RigidPose& X_WB) const {
    return standing({surface(), fraction, rate()}, piece, X_WB);
  }
  // Rate of the fraction, per time; 0 at rest.
  Scalar rate() const { return is_standing_ ? 0 : rate_; }
  Surface& spare() { return meshes_[1 - shown_.load(std::memory_order_relaxed)]; }
  void require_count(std::span<const Vector3> vertices) const;
  void refit_spare(Scalar from, std::span<const Vector3> vertices);
  void hand_over(Scalar duration, Scalar from, bool is_retarget);
  static Vector3 vertex_at(const Place& place, std::int32_t vertex);
  static SurfacePoint surface_at(const Place& place, std::int32_t triangle, const Vector3& p_W);
  static Vector3 velocity_of(const Place& place, const SurfacePoint& point);
  static bool is_minimum(const Place& place, const CorePiece& piece, const RigidPose& X_WB,
                         const PieceDistance& pair, std::int32_t triangle_a,
                         std::int32_t triangle_b, Scalar least_sine);
  template <typename IsOver>
  static bool find_minima(const Place& place, const CorePiece& piece, std::int32_t number,
                          const RigidPose& X_WB, const ExpectedApproach& approach,
                          Scalar least_sine, const IsOver& is_over, PairFront& front,
                          std::vector<HoldPoint>& holds);
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
  std::atomic<std::size_t> shown_{0};
  Scalar fraction_ = 1;
  Scalar end_fraction_ = 1;  // where the motion ends
  Scalar rate_ = 0;          // unless it stands
  bool is_standing_ = false;
  Scalar lag_ = 0;  // since the newest snapshot was seen, or it got there
  bool expects_snapshots_ = false;
  std::optional<Scalar> behind_;                  // since the first one expected
  std::atomic<std::int64_t> snapshots_taken_{0};  // changed by ticks, read by the giver as well
  // Whether the mesh that is not shown is the next one. Offered by give(), cleared by the tick.
  std::atomic<Next> next_{Next::None};
  Scalar next_duration_ = 0;      // 0: another mesh, at rest
  Scalar next_from_ = 1;          // where the shown motion ends for it
  std::int64_t next_given_ = 0;   // counts what was handed over
  std::int64_t newest_seen_ = 0;  // the last of them that a tick has seen
  // Between retarget() and the ticks: the end of the shown motion that is asked for, with a number
  // that counts such requests, and what the last tick has made of it.
  std::atomic<Scalar> turn_at_{1};
  std::atomic<std::int64_t> turns_asked_{0};
  std::atomic<std::int64_t> turns_seen_{0};
  std::atomic<Scalar> adopted_{1};
  std::atomic<Scalar> fraction_told_{1};  // at the end of the last tick
  std::atomic<std::int64_t> ticks_{0};    // twice their number; odd during a tick
  std::vector<Vector3> places_;           // memory of retarget()
  std::int64_t snapshots_seen_ = 0;
  std::int64_t most_seen_ = std::numeric_limits<std::int64_t>::max();
  bool is_next_seen_ = false;  // as it was when the tick started
  ObstacleInput input_;
  HapticObserver* observer_ = nullptr;
  std::size_t number_ = 0;  // for the observer
};

}  // namespace dyop::haptics_internal
