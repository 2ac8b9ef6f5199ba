// SPDX-License-Identifier: BSD-3-Clause
#include "tool/deforming_obstacle.h"

#include <algorithm>

#include "dyop/core/error.h"
#include "dyop/toi/deforming_distance.h"
#include "dyop/toi/deforming_time_of_impact.h"
#include "tool/surface_cone.h"

namespace dyop::internal {
namespace {

// Pairs of triangles near a point where the tool is held: a few hundred.
constexpr std::size_t kMostNearPairs = 2000;

// How much a neighbouring piece of surface may rise along a contact's normal, as for
// ContactGeneratorOptions.
constexpr Scalar kConeSine = 0.02;
constexpr Scalar kBorderSine = 1e-3;

// The tolerance for one side of a pair of features. Unless a vertex is over a face or two edges
// cross, the normal tilts with every sideways shift.
Scalar sine_for(const WitnessPair& pair) {
  const bool is_face =
      pair.feature_a.kind == FeatureKind::Face || pair.feature_b.kind == FeatureKind::Face;
  const bool is_crossing =
      pair.feature_a.kind == FeatureKind::Edge && pair.feature_b.kind == FeatureKind::Edge;
  return is_face || is_crossing ? kConeSine : kBorderSine;
}

FeatureKey key_of(const Feature& feature, std::int32_t triangle, std::int32_t piece) {
  // An edge is named by its first vertex: unique enough for a warm start.
  const bool is_face = feature.kind == FeatureKind::Face;
  return {feature.kind, piece, is_face ? triangle : feature.vertices[0]};
}

// Weights of the corners of a triangle at its point nearest to p, by areas; any that sum to one if
// the triangle has none.
std::array<Scalar, 3> weights_at(const Triangle& t, const Vector3& p) {
  const Vector3 m = (t[1] - t[0]).cross(t[2] - t[0]);
  const Scalar m_sq = m.squaredNorm();
  if (!(m_sq > 0)) return {1, 0, 0};
  const Scalar u = (p - t[0]).cross(t[2] - t[0]).dot(m) / m_sq;
  const Scalar v = (t[1] - t[0]).cross(p - t[0]).dot(m) / m_sq;
  return {1 - u - v, u, v};
}

}  // namespace

DeformingObstacle::DeformingObstacle(const std::vector<Vector3>& vertices,
                                     const std::vector<TriangleIndices>& triangles)
    : meshes_{DeformingMesh(vertices, vertices, triangles),
              DeformingMesh(vertices, vertices, triangles)},
      topology_(vertices.size(), triangles) {}

bool DeformingObstacle::give(std::span<const Vector3> vertices, Scalar duration) {
  DYOP_REQUIRE(duration > 0 && duration < kInfinity,
               "give_snapshot: duration must be finite and > 0, not ", duration);
  if (has_next_.load(std::memory_order_acquire)) return false;
  // The tick changes the shown mesh only while there is a next one.
  meshes_[1 - shown_].refit(meshes_[shown_].end(), vertices);
  next_duration_ = duration;
  has_next_.store(true, std::memory_order_release);
  return true;
}

void DeformingObstacle::start_tick() {
  is_next_seen_ = has_next_.load(std::memory_order_acquire);
  snapshots_seen_ = snapshots_taken_ + (is_next_seen_ ? 1 : 0);
  if (time_left() == kInfinity) go_on();
}

Scalar DeformingObstacle::time_left() const {
  return rate_ > 0 ? (1 - fraction_) / rate_ : kInfinity;
}

Scalar DeformingObstacle::fraction_after(Scalar dt) const {
  return dt >= time_left() ? 1 : std::min(Scalar{1}, fraction_ + dt * rate_);
}

void DeformingObstacle::pass(Scalar dt) {
  fraction_ = fraction_after(dt);
}

void DeformingObstacle::go_on() {
  if (fraction_ < 1) return;
  rate_ = 0;
  if (!is_next_seen_) return;
  is_next_seen_ = false;
  shown_ = 1 - shown_;
  fraction_ = 0;
  rate_ = 1 / next_duration_;
  ++snapshots_taken_;
  has_next_.store(false, std::memory_order_release);
}

Vector3 DeformingObstacle::place(std::int32_t vertex) const {
  const Vector3& begin = shown().begin()[std::size_t(vertex)];
  const Vector3& end = shown().end()[std::size_t(vertex)];
  return fraction_ >= 1 ? end : Vector3(begin + fraction_ * (end - begin));
}

Vector3 DeformingObstacle::velocity_at(std::int32_t triangle, const Vector3& p_W, Scalar s) const {
  const std::array<Scalar, 3> weights = weights_at(shown().triangle(triangle, s), p_W);
  const TriangleIndices& t = shown().triangles()[std::size_t(triangle)];
  Vector3 sum = Vector3::Zero();
  for (std::size_t k = 0; k < 3; ++k) {
    const auto vertex = std::size_t(t[k]);
    sum += weights[k] * rate_ * (shown().end()[vertex] - shown().begin()[vertex]);
  }
  return sum;
}

PairImpact DeformingObstacle::first_impact(const BodyMotion& motion, const ToiOptions& options,
                                           WorkClock& clock, QueryMemory& memory) const {
  PairImpact impact;
  impact.status = ToiStatus::Separated;
  impact.t_safe = motion.duration;
  for (const CorePiece& piece : motion.body.pieces) {
    if (clock.is_over()) {
      impact.status = ToiStatus::BudgetExhausted;
      impact.t_safe = 0;
      return impact;
    }
    ToiOptions lent = options;
    clock.lend(lent);
    lent.target_distance += piece.radius;
    const Scalar duration = impact.t_safe;
    const ToiResult result =
        time_of_impact(shown(), {fraction_, fraction_after(duration)}, piece.mesh, motion.X_WB,
                       {0, duration}, lent, memory.workspace);
    clock.take_back(result);
    ++impact.queries;
    impact.node_pairs += result.statistics.node_pairs;
    if (result.status == ToiStatus::Separated) continue;
    impact.status = result.status;
    impact.t_safe = safe_time(result);
    impact.has_hit = result.status == ToiStatus::Impact && result.contact.has_value();
    if (impact.has_hit) {
      const ImpactContact& contact = *result.contact;
      const Vector3 p_WB = contact.p_WCb - piece.radius * contact.nhat_AB_W;
      impact.hit.v_WA =
          velocity_at(contact.triangle_a.value_or(0), contact.p_WCa, fraction_after(impact.t_safe));
      impact.hit.p_WA = contact.p_WCa - impact.t_safe * impact.hit.v_WA;
      impact.hit.p_WB = motion.X_WB.pose(0) * (result.X_WB.inverse() * p_WB);
      impact.hit.nhat_AB_W = contact.nhat_AB_W;
    }
    if (!(impact.t_safe > 0) || result.status != ToiStatus::Impact) return impact;
  }
  return impact;
}

bool DeformingObstacle::is_minimum(const CorePiece& piece, const RigidPose& X_WB,
                                   const WitnessPair& pair) const {
  const Scalar sine = sine_for(pair);
  const SurfaceCone own{topology_, shown().triangles()};
  const Vector3& n_W = pair.nhat_AB_W;
  if (!own.admits(pair.feature_a, *pair.triangle_a, n_W, sine,
                  [&](std::int32_t vertex) { return place(vertex); })) {
    return false;
  }
  const SurfaceCone other{piece.mesh.topology(), piece.mesh.triangles()};
  const Vector3 n_B = -(X_WB.rotation().transpose() * n_W);
  return other.admits(pair.feature_b, *pair.triangle_b, n_B, sine, [&](std::int32_t vertex) {
    return piece.mesh.vertices()[std::size_t(vertex)];
  });
}

void DeformingObstacle::add_holds(const ToolBody& body, const RigidPose& X_WB, Scalar reach,
                                  PairCaches& caches, QueryMemory& memory,
                                  std::vector<HoldPoint>& holds) const {
  caches.resize(body.pieces.size());
  for (std::size_t k = 0; k < body.pieces.size(); ++k) {
    const CorePiece& piece = body.pieces[k];
    find_near_pairs(shown(), fraction_, piece.mesh, X_WB, reach + piece.radius, kMostNearPairs,
                    caches[k], memory.pairs);
    for (const WitnessPair& pair : memory.pairs) {
      if (!(pair.lower > 0) || !is_minimum(piece, X_WB, pair)) continue;
      HoldPoint hold;
      hold.p_WA = pair.p_WCa;
      hold.p_WB = pair.p_WCb - piece.radius * pair.nhat_AB_W;
      hold.nhat_AB_W = pair.nhat_AB_W;
      hold.v_WA = velocity_at(*pair.triangle_a, pair.p_WCa, fraction_);
      hold.key = {key_of(pair.feature_a, *pair.triangle_a, 0),
                  key_of(pair.feature_b, *pair.triangle_b, std::int32_t(k))};
      holds.push_back(hold);
    }
  }
}

PairDistance DeformingObstacle::measure(const ToolBody& body, const RigidPose& X_WB,
                                        PairCaches& caches) const {
  caches.resize(body.pieces.size());
  PairDistance least;
  least.lower = kInfinity;
  for (std::size_t k = 0; k < body.pieces.size(); ++k) {
    const CorePiece& piece = body.pieces[k];
    const DistanceResult result = distance(shown(), fraction_, piece.mesh, X_WB, {}, caches[k]);
    least.lower = std::min(least.lower, std::max(Scalar{0}, result.lower - piece.radius));
    const Scalar upper = std::max(Scalar{0}, result.upper - piece.radius);
    if (!(upper < least.upper)) continue;
    least.upper = upper;
    least.p_WA = result.p_WCa;
    least.p_WB = result.p_WCb - piece.radius * result.nhat_AB_W;
  }
  return least;
}

}  // namespace dyop::internal
