// SPDX-License-Identifier: BSD-3-Clause
#include "haptics/deforming_obstacle.h"

#include <algorithm>
#include <optional>
#include <span>
#include <utility>

#include "core/assert.h"
#include "dyop/core/error.h"
#include "dyop/core/types.h"
#include "dyop/geometry/mesh_topology.h"
#include "dyop/geometry/shape.h"
#include "toi/deforming/deforming_pair.h"
#include "toi/deforming/standing_pair.h"
#include "toi/impact_band.h"

namespace dyop::haptics_internal {

/// The topology of a mesh whose vertices may move; the caller passes their positions.
struct SurfaceCone {
  const MeshTopology& topology;
  std::span<const TriangleIndices> triangles;

  /// Whether n . t <= sine for all unit directions t in which the surface leaves a point p of a
  /// feature of a triangle: no neighbouring piece of surface comes nearer along n than p does, as
  /// far as vertex numbers tell who is a neighbour.
  /// @param place Called with a vertex number, returns its position.
  template <typename Place>
  bool admits(const Feature& feature, std::int32_t triangle, const Vector3& n, Scalar sine,
              const Place& place) const;
};

/// Whether a direction between the rays e and f, or one of them, rises along n by more than `sine`.
bool sector_rises(const Vector3& e, const Vector3& f, const Vector3& n, Scalar sine);
/// Whether the part of `up` across `along` does.
bool side_rises(const Vector3& along, const Vector3& up, const Vector3& n, Scalar sine);

template <typename Place>
bool SurfaceCone::admits(const Feature& feature, std::int32_t triangle, const Vector3& n,
                         Scalar sine, const Place& place) const {
  switch (feature.kind) {
    case FeatureKind::Vertex: {
      const Vector3 p = place(feature.vertices[0]);
      for (const std::int32_t corner : topology.corners_of_vertex(feature.vertices[0])) {
        const TriangleIndices& t = triangles[std::size_t(corner / 3)];
        const int k = corner % 3;
        const Vector3 e = place(t[std::size_t(k < 2 ? k + 1 : 0)]) - p;
        const Vector3 f = place(t[std::size_t(k > 0 ? k - 1 : 2)]) - p;
        if (sector_rises(e, f, n, sine)) return false;
      }
      return true;
    }
    case FeatureKind::Edge: {
      const TriangleIndices& own = triangles[std::size_t(triangle)];
      for (int k = 0; k < 3; ++k) {
        const std::int32_t from = own[std::size_t(k)];
        const std::int32_t to = own[std::size_t(k < 2 ? k + 1 : 0)];
        const bool is_this = (from == feature.vertices[0] && to == feature.vertices[1]) ||
                             (from == feature.vertices[1] && to == feature.vertices[0]);
        const auto edge =
            is_this ? topology.edge_of_side(3 * triangle + k) : std::optional<std::int32_t>();
        if (!edge) continue;
        const Vector3 p = place(from);
        const Vector3 along = place(to) - p;
        for (const std::int32_t side : topology.sides_of_edge(*edge)) {
          const TriangleIndices& t = triangles[std::size_t(side / 3)];
          const int corner = side % 3;
          const Vector3 up = place(t[std::size_t(corner > 0 ? corner - 1 : 2)]) - p;
          if (side_rises(along, up, n, sine)) return false;
        }
        return true;
      }
      return true;
    }
    case FeatureKind::Face:
    case FeatureKind::Smooth:
      break;
  }
  return true;
}

namespace {

// How much a neighbouring piece of surface may rise along a contact's normal, as for
// ContactGeneratorOptions.
constexpr Scalar kConeSine = 0.02;
constexpr Scalar kBorderSine = 1e-3;

// A motion is long if it is longer than this part of a body's thickness.
constexpr Scalar kThicknesses = 8;

// The tolerance for one side of a pair of features. Unless a vertex is over a face or two edges
// cross, the normal tilts with every sideways shift.
Scalar sine_for(const PieceDistance& pair) {
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
    : meshes_{Surface({vertices, vertices, triangles}, 0),
              Surface({vertices, vertices, triangles}, 0)} {}

bool DeformingObstacle::give(std::span<const Vector3> vertices, Scalar duration) {
  DYOP_REQUIRE(duration > 0 && duration < kInfinity,
               "give_snapshot: duration must be finite and > 0, not ", duration);
  if (has_next()) return false;
  // The tick changes the shown mesh only while there is a next one. 1 but in a replay: retarget()
  // leaves another end only together with a next one.
  const Scalar from = turn_at_.load();
  refit_spare(from, vertices);
  hand_over(duration, from, false);
  return true;
}

void DeformingObstacle::require_count(std::span<const Vector3> vertices) const {
  const std::size_t count = surface().mesh.end().size();
  DYOP_REQUIRE(vertices.size() == count, "give_snapshot: the mesh has ", count, " vertices, not ",
               vertices.size());
}

// The spare mesh sets out where the shown one is at a fraction of its motion.
void DeformingObstacle::refit_spare(Scalar from, std::span<const Vector3> vertices) {
  require_count(vertices);
  const Surface& last = surface();
  if (spare().version != last.version) spare() = last;
  if (from < 1) {
    places_.resize(vertices.size());
    for (std::size_t k = 0; k < places_.size(); ++k) {
      places_[k] = vertex_at({last, from, 0}, std::int32_t(k));
    }
  }
  spare().mesh.refit(from < 1 ? std::span<const Vector3>(places_) : last.mesh.end(), vertices);
  spare().slabs.fit(spare().mesh);
}

// If the fraction was read, and the turn announced, between two ticks, the next tick knows of it
// before tissue moves. Otherwise a tick may come past it first: then tissue stands where adopted_
// says until the second attempt is through.
bool DeformingObstacle::retarget(std::span<const Vector3> vertices, Scalar duration, Scalar lead) {
  DYOP_REQUIRE(duration > 0 && duration < kInfinity,
               "retarget: duration must be finite and > 0, not ", duration);
  DYOP_REQUIRE(lead >= 0 && lead < kInfinity, "retarget: lead must be finite and >= 0, not ", lead);
  const bool has_next_mesh = has_next() && !(next_duration_ > 0);
  if (has_next_mesh) return false;
  require_count(vertices);  // before tissue is told to turn
  if (has_next()) {
    Next offered = Next::Offered;
    if (!next_.compare_exchange_strong(offered, Next::None)) return false;
  }
  const std::int64_t ticks = ticks_.load();
  const Scalar rate = surface().duration > 0 ? 1 / surface().duration : 0;
  Scalar from = std::min(Scalar{1}, fraction_told_.load() + lead * rate);
  turn_at_.store(from);
  turns_asked_.fetch_add(1);
  const bool is_between_ticks = ticks % 2 == 0 && ticks_.load() == ticks;
  refit_spare(from, vertices);
  bool is_sure = is_between_ticks;
  if (!is_sure && turns_seen_.load() == turns_asked_.load()) {
    const Scalar adopted = adopted_.load();
    if (adopted != from) refit_spare(adopted, vertices);
    from = adopted;
    turn_at_.store(from);
    is_sure = true;
  }
  if (is_sure) {
    hand_over(duration, from, true);
  } else {
    turn_at_.store(1);
  }
  return is_sure;
}

bool DeformingObstacle::give_mesh(std::span<const Vector3> vertices,
                                  std::span<const TriangleIndices> triangles) {
  if (has_next()) return false;
  const std::vector<Vector3> places(vertices.begin(), vertices.end());
  DeformingMesh mesh(places, places, {triangles.begin(), triangles.end()});
  spare() = Surface(std::move(mesh), surface().version + 1);
  hand_over(0, 1, false);
  return true;
}

void DeformingObstacle::hand_over(Scalar duration, Scalar from, bool is_retarget) {
  spare().snapshot = surface().snapshot + 1;
  spare().duration = duration;
  next_duration_ = duration;
  next_from_ = from;
  ++next_given_;
  if (observer_) {
    const DeformingMesh& mesh = spare().mesh;
    const auto triangles = duration > 0 ? std::span<const TriangleIndices>() : mesh.triangles();
    observer_->on_tissue({number_, spare().snapshot, mesh.end(), triangles, duration, is_retarget});
  }
  next_.store(Next::Offered, std::memory_order_release);
}

void DeformingObstacle::replay_turn(Scalar end) {
  DYOP_REQUIRE(end >= fraction_ && end <= 1, "replay_turn: the motion cannot end at ", end,
               ", it has come to ", fraction_);
  next_.store(Next::None);
  turn_at_.store(end);
}

void DeformingObstacle::observe(HapticObserver* observer, std::size_t number) {
  observer_ = observer;
  number_ = number;
}

bool DeformingObstacle::start_tick() {
  ticks_.fetch_add(1);
  Next offered = Next::Offered;
  is_next_seen_ =
      snapshots_taken_ < most_seen_ && next_.compare_exchange_strong(offered, Next::InUse);
  const std::int64_t turns = turns_asked_.load();
  end_fraction_ = std::max(fraction_, turn_at_.load());
  adopted_.store(end_fraction_);
  turns_seen_.store(turns);
  input_ = {snapshots_taken_, end_fraction_, is_next_seen_ ? next_given_ : 0};
  if (fraction_ < end_fraction_ && surface().duration > 0) rate_ = 1 / surface().duration;
  const bool is_newer = is_next_seen_ && std::exchange(newest_seen_, next_given_) != next_given_;
  const bool is_there = fraction_ >= 1 && !is_next_seen_;
  if (is_newer || is_there) lag_ = 0;
  snapshots_seen_ = std::max(snapshots_seen_, snapshots_taken() + (is_next_seen_ ? 1 : 0));
  return time_left() == kInfinity && go_on();
}

void DeformingObstacle::end_tick() {
  Next used = Next::InUse;
  next_.compare_exchange_strong(used, Next::Offered);
  fraction_told_.store(fraction_);
  ticks_.fetch_add(1);
}

Scalar DeformingObstacle::time_left() const {
  return rate() > 0 ? (end_fraction_ - fraction_) / rate() : kInfinity;
}

Scalar DeformingObstacle::fraction_after(Scalar dt) const {
  return dt >= time_left() ? end_fraction_ : std::min(end_fraction_, fraction_ + dt * rate());
}

void DeformingObstacle::expect_snapshots() {
  expects_snapshots_ = true;
  behind_.reset();
}

void DeformingObstacle::stop(Scalar dt) {
  lag_ += dt;
  if (behind_) *behind_ += dt;
}

// Where it stands while the tool moves, stop() counts the time.
void DeformingObstacle::pass(Scalar dt) {
  const bool is_waiting = !is_standing_ && !(rate_ > 0);
  if (behind_ && is_waiting) *behind_ += dt;
  fraction_ = fraction_after(dt);
}

bool DeformingObstacle::go_on() {
  if (fraction_ < end_fraction_) return false;
  rate_ = 0;
  if (!is_next_seen_) return false;
  DYOP_ASSERT(fraction_ == next_from_, fraction_, ' ', next_from_);
  is_next_seen_ = false;
  shown_ = 1 - shown_;
  const bool is_other_mesh = !(next_duration_ > 0);
  fraction_ = is_other_mesh ? 1 : 0;
  end_fraction_ = 1;
  turn_at_.store(1);
  fraction_told_.store(fraction_);
  if (!is_other_mesh) {
    rate_ = 1 / next_duration_;
    if (expects_snapshots_ && !behind_) behind_ = 0;
  }
  ++snapshots_taken_;
  next_.store(Next::None, std::memory_order_release);
  return is_other_mesh;
}

Vector3 DeformingObstacle::vertex_at(const Place& place, std::int32_t vertex) {
  const Vector3& begin = place.surface.mesh.begin()[std::size_t(vertex)];
  const Vector3& end = place.surface.mesh.end()[std::size_t(vertex)];
  return place.fraction >= 1 ? end : Vector3(begin + place.fraction * (end - begin));
}

Vector3 DeformingObstacle::place(std::int32_t vertex) const {
  return vertex_at(place_now(), vertex);
}

SurfacePoint DeformingObstacle::surface_at(const Place& place, std::int32_t triangle,
                                           const Vector3& p_W) {
  return {triangle, weights_at(place.surface.mesh.triangle(triangle, place.fraction), p_W)};
}

Vector3 DeformingObstacle::velocity_of(const Place& place, const SurfacePoint& point) {
  const DeformingMesh& mesh = place.surface.mesh;
  const TriangleIndices& t = mesh.triangles()[std::size_t(point.triangle)];
  Vector3 sum = Vector3::Zero();
  for (std::size_t k = 0; k < 3; ++k) {
    const auto vertex = std::size_t(t[k]);
    sum += point.weights[k] * place.rate * (mesh.end()[vertex] - mesh.begin()[vertex]);
  }
  return sum;
}

// The pairs that neither their distance nor their places at both ends prove apart: triangles, and
// of a long motion boxes too, since all triangles that it could reach would be too many. One that
// crosses at the start is enough: to list the others may take longer than a tick has.
DeformingObstacle::Search DeformingObstacle::find_suspects(const CorePiece& piece,
                                                           const BodyMotion& motion,
                                                           const Approach& approach,
                                                           WorkClock& clock, PairFront& front,
                                                           std::vector<BoxPair>& suspects) const {
  suspects.clear();
  const StandingPair sides = standing(fraction_, piece, motion.X_WB.pose(0));
  const auto nearest = front.measure_again(sides);
  if (nearest && nearest->is_overlapping) return Search::Crossing;
  const ChordGap chord(shown(), {fraction_, fraction_after(motion.duration)}, piece.mesh,
                       motion.X_WB, motion.duration);
  const Scalar far = approach.far + motion.displacement;
  const Scalar reach = std::min(far, approach.far + motion.body.thickness / kThicknesses);
  const auto is_over = [&] { return clock.is_over_small(); };
  bool is_crossing = false;
  bool is_through = front.refine(
      sides, reach, is_over, [&](const PieceDistance& found, std::int32_t a, std::int32_t b) {
        if (found.is_overlapping) {
          is_crossing = true;
          front.seed({0, a, b});
          return -kInfinity;
        }
        const bool is_apart =
            found.lower > 0 &&
            chord.least(sides.a.triangle(a), sides.b.triangle(b), found.nhat_AB) > approach.near;
        if (!is_apart) suspects.push_back({0, a, b});
        return reach;
      });
  if (is_crossing) return Search::Crossing;
  if (!is_through || reach == far) return is_through ? Search::Through : Search::CutOff;
  const StandingPair sides_after =
      standing(fraction_after(motion.duration), piece, motion.X_WB.pose(motion.duration));
  is_through = front.for_each_between(
      reach, far, is_over, [&](std::int32_t a, std::int32_t b, const Vector3& n_W) {
        const bool is_apart = chord.least_of_boxes(sides, sides_after, a, b, n_W) > approach.near;
        if (!is_apart) suspects.push_back({0, a, b});
      });
  return is_through ? Search::Through : Search::CutOff;
}

PairImpact DeformingObstacle::first_impact(const BodyMotion& motion, const ToiOptions& options,
                                           WorkClock& clock, PairMemory& kept,
                                           QueryMemory& memory) const {
  kept.resize(motion.body.pieces.size());
  PairImpact impact;
  impact.status = ToiStatus::Separated;
  impact.t_safe = motion.duration;
  for (std::size_t k = 0; k < kept.size(); ++k) {
    const CorePiece& piece = motion.body.pieces[k];
    const Scalar target = options.target_distance + piece.radius;
    const ImpactBand band(target, options.distance_tolerance.value());
    const BodyMotion rest{motion.body, motion.X_WB, impact.t_safe, motion.displacement};
    const Search search = clock.is_over()
                              ? Search::CutOff
                              : find_suspects(piece, rest, {band.leaf_target, band.largest_impact},
                                              clock, kept[k].front, memory.pairs);
    if (search == Search::Crossing) {
      impact.status = ToiStatus::InitiallyWithinTarget;
      impact.t_safe = 0;
      return impact;
    }
    if (search == Search::CutOff || (!memory.pairs.empty() && clock.is_over())) {
      impact.status = ToiStatus::BudgetExhausted;
      impact.t_safe = 0;
      return impact;
    }
    if (memory.pairs.empty()) continue;
    ask(piece, rest, options, clock, memory, impact);
    if (impact.status == ToiStatus::Separated) continue;
    if (!(impact.t_safe > 0) || impact.status != ToiStatus::Impact) return impact;
  }
  return impact;
}

// Asks about the suspects.
void DeformingObstacle::ask(const CorePiece& piece, const BodyMotion& motion,
                            const ToiOptions& options, WorkClock& clock, QueryMemory& memory,
                            PairImpact& impact) const {
  ToiOptions lent = options;
  clock.lend(lent);
  lent.target_distance += piece.radius;
  const ToiResult result = time_of_listed_impact(
      shown(), {fraction_, fraction_after(motion.duration)}, piece.mesh, motion.X_WB,
      {0, motion.duration}, lent, memory.workspace, memory.pairs);
  clock.take_back(result);
  ++impact.queries;
  impact.node_pairs += result.statistics.node_pairs;
  if (result.status == ToiStatus::Separated) return;
  impact.status = result.status;
  impact.t_safe = safe_time(result);
  impact.has_hit = result.status == ToiStatus::Impact && result.contact.has_value();
  if (!impact.has_hit) return;
  const ImpactContact& contact = *result.contact;
  const Vector3 p_WB = contact.p_WCb - piece.radius * contact.nhat_AB_W;
  const Place then{surface(), fraction_after(impact.t_safe), rate()};
  impact.hit.surface = surface_at(then, contact.triangle_a.value_or(0), contact.p_WCa);
  impact.hit.v_WA = velocity_of(then, *impact.hit.surface);
  impact.hit.p_WA = contact.p_WCa - impact.t_safe * impact.hit.v_WA;
  impact.hit.p_WB = motion.X_WB.pose(0) * (result.X_WB.inverse() * p_WB);
  impact.hit.nhat_AB_W = contact.nhat_AB_W;
}

bool DeformingObstacle::is_minimum(const Place& place, const CorePiece& piece,
                                   const RigidPose& X_WB, const PieceDistance& pair,
                                   std::int32_t triangle_a, std::int32_t triangle_b,
                                   Scalar least_sine) {
  const Scalar sine = std::max(sine_for(pair), least_sine);
  const SurfaceCone own{place.surface.topology, place.surface.mesh.triangles()};
  const Vector3& n_W = pair.nhat_AB;
  if (!own.admits(pair.feature_a, triangle_a, n_W, sine,
                  [&](std::int32_t vertex) { return vertex_at(place, vertex); })) {
    return false;
  }
  const SurfaceCone other{piece.mesh.topology(), piece.mesh.triangles()};
  const Vector3 n_B = -(X_WB.rotation().transpose() * n_W);
  return other.admits(pair.feature_b, triangle_b, n_B, sine, [&](std::int32_t vertex) {
    return piece.mesh.vertices()[std::size_t(vertex)];
  });
}

// Appends the local minima of the gap between the surface and a piece of a body.
template <typename IsOver>
bool DeformingObstacle::find_minima(const Place& place, const CorePiece& piece, std::int32_t number,
                                    const RigidPose& X_WB, const ExpectedApproach& approach,
                                    Scalar least_sine, const IsOver& is_over, PairFront& front,
                                    std::vector<HoldPoint>& holds) {
  const StandingPair sides = standing(place, piece, X_WB);
  ExpectedApproach of_core = approach;
  of_core.least += piece.radius;
  of_core.reach += piece.radius;
  PieceDistance last;
  return front.refine(
      sides, of_core, is_over, [&](const PieceDistance& pair, std::int32_t a, std::int32_t b) {
        const std::int32_t triangle_a = sides.a.triangle(a), triangle_b = sides.b.triangle(b);
        // Triangles around the same vertices or edges have the same nearest points.
        const bool is_same = pair.nhat_AB == last.nhat_AB && pair.p_a == last.p_a &&
                             pair.feature_a == last.feature_a && pair.feature_b == last.feature_b;
        last = pair;
        if (is_same || !(pair.lower > 0) ||
            !is_minimum(place, piece, X_WB, pair, triangle_a, triangle_b, least_sine)) {
          return;
        }
        HoldPoint hold;
        hold.p_WA = pair.p_a;
        hold.p_WB = pair.p_b - piece.radius * pair.nhat_AB;
        hold.nhat_AB_W = pair.nhat_AB;
        hold.surface = surface_at(place, triangle_a, pair.p_a);
        hold.v_WA = velocity_of(place, *hold.surface);
        hold.key = {key_of(pair.feature_a, triangle_a, 0),
                    key_of(pair.feature_b, triangle_b, number)};
        holds.push_back(hold);
      });
}

void DeformingObstacle::add_holds(const ToolBody& body, const RigidPose& X_WB,
                                  const ExpectedApproach& approach, WorkShare& share,
                                  PairMemory& kept, QueryMemory& /*memory*/,
                                  std::vector<HoldPoint>& holds) const {
  kept.resize(body.pieces.size());
  const auto is_over = [&] { return share.is_over_small(); };
  for (std::size_t k = 0; k < kept.size(); ++k) {
    if (!find_minima(place_now(), body.pieces[k], std::int32_t(k), X_WB, approach, 0, is_over,
                     kept[k].front, holds)) {
      return;
    }
  }
}

bool DeformingObstacle::find_holds(const ObstacleProgress& where, const ToolBody& body,
                                   const RigidPose& X_WB, const ContactSearch& search,
                                   PairMemory& kept, std::vector<HoldPoint>& holds) const {
  const auto surface = std::find_if(meshes_.begin(), meshes_.end(), [&](const Surface& mesh) {
    return mesh.snapshot == where.snapshot;
  });
  if (surface == meshes_.end()) return false;
  const Scalar rate =
      surface->duration > 0 && where.fraction < 1 ? 1 / surface->duration : Scalar{0};
  kept.resize(body.pieces.size());
  for (std::size_t k = 0; k < kept.size(); ++k) {
    kept[k].restart();
    find_minima(
        {*surface, where.fraction, rate}, body.pieces[k], std::int32_t(k), X_WB,
        {.least = search.reach, .reach = search.reach}, search.rise, [] { return false; },
        kept[k].front, holds);
  }
  return true;
}

namespace {

// Joins what is known of a piece to the least of its body.
void join(const CorePiece& piece, Scalar lower, const NearestPoints& nearest, PairDistance& least) {
  least.lower = std::min(least.lower, std::max(Scalar{0}, lower - piece.radius));
  const Scalar upper = std::max(Scalar{0}, nearest.upper - piece.radius);
  if (!(upper < least.upper)) return;
  least.upper = upper;
  least.p_WA = nearest.p_a;
  least.p_WB = nearest.p_b - piece.radius * nearest.nhat_AB;
}

}  // namespace

PairDistance DeformingObstacle::measure(const ToolBody& body, const RigidPose& X_WB,
                                        const DistanceWish& wish, WorkShare& share,
                                        PairMemory& kept) const {
  kept.resize(body.pieces.size());
  PairDistance least;
  least.lower = kInfinity;
  for (std::size_t k = 0; k < kept.size(); ++k) {
    PairFront& front = kept[k].front;
    PieceDistance best;
    const StandingPair sides = standing(fraction_, body.pieces[k], X_WB);
    // Then a search would find no less.
    if (const auto again = front.measure_again(sides); again && again->is_overlapping) {
      join(body.pieces[k], 0, *again, least);
      continue;
    }
    front.find_nearest(
        sides, {wish.farthest + body.pieces[k].radius, wish.allowed, wish.tight},
        [&] { return share.is_over_small(); }, kept[k].cache.stack, best);
    join(body.pieces[k], best.is_overlapping ? 0 : std::min(front.lower(), best.upper), best,
         least);
  }
  return least;
}

PairDistance DeformingObstacle::measure_again(const ToolBody& body, const RigidPose& X_WB,
                                              const PairMemory& kept) const {
  PairDistance least;
  for (std::size_t k = 0; k < kept.size(); ++k) {
    const StandingPair sides = standing(fraction_, body.pieces[k], X_WB);
    if (const auto again = kept[k].front.measure_again(sides)) {
      join(body.pieces[k], 0, *again, least);
    }
  }
  return least;
}

std::optional<bool> DeformingObstacle::is_apart_at(const ToolBody& body, const RigidPose& X_WB,
                                                   WorkClock& clock, PairMemory& kept) const {
  kept.resize(body.pieces.size());
  for (std::size_t k = 0; k < kept.size(); ++k) {
    const Scalar least = margin + body.pieces[k].radius;
    const StandingPair sides = standing(fraction_, body.pieces[k], X_WB);
    const auto is_apart = sides.is_apart_by(
        least, [&] { return clock.is_over_small(); }, kept[k].cache.stack);
    if (!is_apart || !*is_apart) return is_apart;
  }
  return true;
}

namespace {

bool rises(const Vector3& ray, const Vector3& n, Scalar sine) {
  const Scalar along = n.dot(ray);
  return along > 0 && along * along > sine * sine * ray.squaredNorm();
}

}  // namespace

// Within the sector the steepest direction is the projection of n on its plane, if that lies there.
bool sector_rises(const Vector3& e, const Vector3& f, const Vector3& n, Scalar sine) {
  if (rises(e, n, sine) || rises(f, n, sine)) return true;
  const Vector3 m = e.cross(f);
  const bool is_within = e.cross(n).dot(m) > 0 && n.cross(f).dot(m) > 0;
  return is_within && n.cross(m).squaredNorm() > sine * sine * m.squaredNorm();
}

bool side_rises(const Vector3& along, const Vector3& up, const Vector3& n, Scalar sine) {
  const Scalar length_sq = along.squaredNorm();
  if (!(length_sq > 0)) return rises(up, n, sine);
  return rises(up - along * (along.dot(up) / length_sq), n, sine);
}

}  // namespace dyop::haptics_internal
