#include "dyop/dynamics/world.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "dynamics/world_impl.h"
#include "dyop/core/error.h"
#include "dyop/motion/rest_motion.h"
#include "dyop/toi/toi_batch.h"

namespace dyop {
namespace {

using internal::BodyRecord;
using Motions = std::vector<std::shared_ptr<const Motion>>;

BodyPair ordered(BodyId a, BodyId b) {
  return a < b ? BodyPair(a, b) : BodyPair(b, a);
}

void require_valid(const BodyDefinition& body) {
  const auto& name = body.name;
  DYOP_REQUIRE(body.shape != nullptr, "body '", name, "': shape is missing");
  DYOP_REQUIRE(body.restitution >= 0 && body.restitution <= 1, "body '", name,
               "': restitution must be in [0, 1], not ", body.restitution);
  DYOP_REQUIRE(body.friction >= 0 && body.friction < kInfinity, "body '", name,
               "': friction must be finite and >= 0, not ", body.friction);
  DYOP_REQUIRE(body.initial.twist.v_WB.allFinite() && body.initial.twist.w_WB.allFinite(), "body '",
               name, "': initial velocity must be finite");
  if (body.kind == BodyKind::Kinematic) {
    DYOP_REQUIRE(body.motion != nullptr, "body '", name, "': a kinematic body needs a motion");
  }
  if (body.kind != BodyKind::Dynamic) {
    DYOP_REQUIRE(!body.wrench, "body '", name, "': only a dynamic body can have a wrench");
    return;
  }
  const MassProperties& properties = body.mass_properties;
  DYOP_REQUIRE(properties.mass > 0 && properties.mass < kInfinity, "body '", name,
               "': mass must be finite and > 0, not ", properties.mass);
  DYOP_REQUIRE(properties.p_BoBcm.allFinite(), "body '", name, "': centre of mass must be finite");
  const Matrix3& I = properties.I_BBcm;
  DYOP_REQUIRE(I.allFinite() && I.isApprox(I.transpose()), "body '", name,
               "': inertia must be finite and symmetric");
  const Vector3 principal = Eigen::SelfAdjointEigenSolver<Matrix3>(I).eigenvalues();
  DYOP_REQUIRE(principal[0] > 0, "body '", name,
               "': inertia must be positive definite, but has "
               "principal moment ",
               principal[0]);
}

// A box that holds the body at every time of the interval: its box at the middle, grown by the
// distance that any point can move in half the interval, and by half the distance at which pairs
// matter.
AlignedBox swept_box(const Shape& shape, const Motion& motion, const TimeInterval& interval,
                     Scalar reach) {
  const RigidPose X_WB = motion.pose(interval.begin + interval.length() / 2);
  const TwistBound bound = motion.twist_bound(interval);
  const AlignedBox box = shape.bounding_box();
  const Vector3 half = X_WB.rotation().cwiseAbs() * (box.sizes() / 2);
  const Vector3 center = X_WB * Vector3(box.center());
  const Scalar radius = shape.bounding_radius();
  const Scalar motion_reach =
      (bound.linear_speed + bound.angular_speed * radius) * interval.length() / 2;
  // Generous for rounding: a part in 1e9 of the coordinates. literal: costs nothing.
  const Scalar noise = 1e-9 * (center.cwiseAbs().maxCoeff() + radius);
  const Vector3 grow = half.array() + (motion_reach + reach + noise);
  return {center - grow, center + grow};
}

}  // namespace

World::Impl::Impl(const WorldOptions& the_options)
    : options(the_options),
      smooth(the_options.integrator, the_options.integrator_options, the_options.gravity_W) {}

Scalar World::Impl::margin(BodyId a, BodyId b) const {
  const auto found = pair_margin.find(ordered(a, b));
  return found == pair_margin.end() ? options.margin : found->second;
}

Scalar World::Impl::tolerance() const {
  if (options.distance_tolerance) return *options.distance_tolerance;
  Scalar smallest = kInfinity;
  for (const BodyRecord& body : bodies) {
    smallest = std::min(smallest, body.definition.shape->bounding_radius());
  }
  // literal: a millionth of the smallest body, WorldOptions::distance_tolerance
  return 1e-6 * smallest;
}

Motions World::Impl::motions_of_step() const {
  Motions motions;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const BodyRecord& body = bodies[i];
    if (body.is_active()) {
      motions.push_back(smooth.motion(i));
    } else if (body.definition.kind == BodyKind::Kinematic) {
      motions.push_back(body.definition.motion);
    } else {
      motions.push_back(std::make_shared<RestMotion>(body.state.X_WB));
    }
  }
  return motions;
}

std::vector<BodyPair> World::Impl::candidate_pairs(const Motions& motions,
                                                   const TimeInterval& interval) {
  Scalar largest_margin = options.margin;
  for (const auto& [pair, value] : pair_margin) largest_margin = std::max(largest_margin, value);
  const Scalar reach = (largest_margin + 2 * tolerance()) / 2;
  std::vector<bool> may_move;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    may_move.push_back(bodies[i].may_move());
    broad_phase.update(static_cast<std::int32_t>(i),
                       swept_box(*bodies[i].definition.shape, *motions[i], interval, reach));
  }
  std::vector<BodyPair> pairs = broad_phase.find_pairs(may_move);
  std::erase_if(pairs, [&](const BodyPair& pair) {
    const auto found = pair_enabled.find(pair);
    if (found != pair_enabled.end()) return !found->second;
    // Two bodies on given paths cannot answer an impact.
    const auto is_dynamic = [&](BodyId id) {
      return bodies[static_cast<std::size_t>(id)].definition.kind == BodyKind::Dynamic;
    };
    return !is_dynamic(pair.first) && !is_dynamic(pair.second);
  });
  return pairs;
}

// All pairs are queried over the whole step, so that the answers do not depend on which thread
// finishes first.
std::vector<ToiResult> World::Impl::query_pairs(const std::vector<BodyPair>& pairs,
                                                const Motions& motions,
                                                const TimeInterval& interval,
                                                const std::stop_token& stop) const {
  const Scalar distance_tolerance = tolerance();
  std::vector<ToiQuery> queries;
  for (const auto& [id_a, id_b] : pairs) {
    const auto a = static_cast<std::size_t>(id_a);
    const auto b = static_cast<std::size_t>(id_b);
    ToiQuery query{bodies[a].definition.shape.get(),
                   motions[a].get(),
                   bodies[b].definition.shape.get(),
                   motions[b].get(),
                   interval,
                   {}};
    query.options.target_distance = margin(id_a, id_b);
    query.options.distance_tolerance = distance_tolerance;
    query.options.max_node_pairs = options.max_node_pairs;
    queries.push_back(query);
  }
  BatchOptions batch;
  batch.thread_count = options.threads;
  batch.stop = stop;
  std::vector<ToiResult> results(pairs.size());
  time_of_impact_batch(queries, results, batch);
  return results;
}

void World::Impl::commit(const Motions& motions, Scalar t, AdvanceReport& report) {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    BodyRecord& body = bodies[i];
    if (body.is_active()) {
      body.state = smooth.state(i, *motions[i], t);
    } else if (body.definition.kind == BodyKind::Kinematic) {
      body.state = {motions[i]->pose(t), motions[i]->twist(t)};
    }
  }
  if (t > time) report.steps.push_back({{time, t}, motions});
  must_restart = must_restart || t < smooth.time() || smooth.needs_restart();
  time = t;
}

void World::Impl::sub_step(Scalar t_end, const std::stop_token& stop, AdvanceReport& report) {
  if (must_restart) smooth.restart(time, bodies);
  must_restart = false;
  smooth.step(t_end);
  const TimeInterval interval{time, smooth.time()};
  const Motions motions = motions_of_step();
  const std::vector<BodyPair> pairs = candidate_pairs(motions, interval);
  const std::vector<ToiResult> results = query_pairs(pairs, motions, interval, stop);
  report.broad_phase_pairs += static_cast<std::int64_t>(pairs.size());

  // The earliest undecided or met pair; among equals the first.
  std::size_t first = pairs.size();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const ToiStatistics& work = results[i].statistics;
    report.toi.box_tests += work.box_tests;
    report.toi.leaf_tests += work.leaf_tests;
    report.toi.node_pairs += work.node_pairs;
    report.toi.peak_queue = std::max(report.toi.peak_queue, work.peak_queue);
    if (results[i].status == ToiStatus::Separated) continue;
    if (first == pairs.size() || results[i].t_safe < results[first].t_safe) first = i;
  }
  if (first == pairs.size()) {
    commit(motions, interval.end, report);
    return;
  }
  const ToiResult& met = results[first];
  commit(motions, met.t_safe, report);
  must_restart = true;
  switch (met.status) {
    case ToiStatus::Impact:
      handle_impact({time, pairs[first].first, pairs[first].second, met, {}, false}, pairs, report);
      return;
    case ToiStatus::InitiallyWithinTarget:
      report.status = AdvanceStatus::InitialOverlap;
      break;
    case ToiStatus::NumericalLimit:
      report.status = AdvanceStatus::NumericalLimit;
      break;
    case ToiStatus::NotRun:  // stopped before its turn: t_safe is the begin
    case ToiStatus::Cancelled:
      report.status = AdvanceStatus::Cancelled;
      return;
    default:
      report.status = AdvanceStatus::BudgetExhausted;
      break;
  }
  report.offending_pair = pairs[first];
}

AdvanceReport World::Impl::advance(Scalar dt, const std::stop_token& stop) {
  DYOP_REQUIRE(dt > 0 && dt < kInfinity, "World::advance: dt must be finite and > 0, not ", dt);
  const Scalar t_end = time + dt;
  for (const BodyRecord& body : bodies) {
    if (body.definition.kind != BodyKind::Kinematic) continue;
    const std::string what = "the motion of body '" + body.definition.name + "'";
    require_defined(*body.definition.motion, {time, t_end}, what.c_str());
  }
  AdvanceReport report;
  const IntegratorStatistics before = smooth.statistics();
  while (time < t_end && report.status == AdvanceStatus::NotRun) {
    if (stop.stop_requested()) {
      report.status = AdvanceStatus::Cancelled;
    } else if (static_cast<int>(report.impacts.size()) >= options.max_impacts_per_advance) {
      report.status = AdvanceStatus::ImpactLimit;
    } else {
      sub_step(t_end, stop, report);
    }
  }
  if (report.status == AdvanceStatus::NotRun) report.status = AdvanceStatus::Completed;
  report.t = time;
  const IntegratorStatistics after = smooth.statistics();
  report.integrator.steps = after.steps - before.steps;
  report.integrator.rejected_steps = after.rejected_steps - before.rejected_steps;
  report.integrator.function_evaluations = after.function_evaluations - before.function_evaluations;
  return report;
}

World::World(const WorldOptions& options) : impl_(std::make_unique<Impl>(options)) {
  DYOP_REQUIRE(options.gravity_W.allFinite(), "World: gravity must be finite, not (",
               options.gravity_W.transpose(), ")");
  DYOP_REQUIRE(options.margin >= 0 && options.margin < kInfinity,
               "World: margin must be finite and >= 0, not ", options.margin);
  DYOP_REQUIRE(!options.distance_tolerance ||
                   (*options.distance_tolerance > 0 && *options.distance_tolerance < kInfinity),
               "World: distance_tolerance must be finite and > 0, not ",
               *options.distance_tolerance);
  DYOP_REQUIRE(options.max_node_pairs > 0, "World: max_node_pairs must be > 0, not ",
               options.max_node_pairs);
  DYOP_REQUIRE(options.zeno_impacts > 0 && options.zeno_window > 0 && options.zeno_speed >= 0,
               "World: zeno_impacts and zeno_window must be > 0 and zeno_speed >= 0, not ",
               options.zeno_impacts, ", ", options.zeno_window, ", ", options.zeno_speed);
  DYOP_REQUIRE(options.threads >= 0, "World: threads must be >= 0, not ", options.threads);
  DYOP_REQUIRE(options.policy != ImpactPolicy::Callback || options.on_impact,
               "World: policy Callback needs on_impact");
}

World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

BodyId World::add_body(const BodyDefinition& definition) {
  require_valid(definition);
  BodyRecord body;
  body.definition = definition;
  body.state = definition.initial;
  if (definition.kind == BodyKind::Static) body.state.twist = {};
  if (definition.kind == BodyKind::Kinematic) {
    const TimeInterval domain = definition.motion->domain();
    DYOP_REQUIRE(domain.contains(impl_->time), "body '", definition.name,
                 "': its motion is not defined at the time ", impl_->time);
    body.state = {definition.motion->pose(impl_->time), definition.motion->twist(impl_->time)};
  }
  impl_->broad_phase.add(AlignedBox(Vector3::Zero(), Vector3::Zero()));
  impl_->bodies.push_back(std::move(body));
  impl_->must_restart = true;
  return static_cast<BodyId>(impl_->bodies.size() - 1);
}

void World::set_pair_enabled(BodyId a, BodyId b, bool enabled) {
  body(a);
  body(b);
  DYOP_REQUIRE(a != b, "World: a pair needs two bodies, not ", a, " twice");
  impl_->pair_enabled[ordered(a, b)] = enabled;
}

void World::set_margin(BodyId a, BodyId b, Scalar margin) {
  body(a);
  body(b);
  DYOP_REQUIRE(a != b, "World: a pair needs two bodies, not ", a, " twice");
  DYOP_REQUIRE(margin >= 0 && margin < kInfinity, "World: margin must be finite and >= 0, not ",
               margin);
  impl_->pair_margin[ordered(a, b)] = margin;
}

Scalar World::time() const {
  return impl_->time;
}

std::size_t World::body_count() const {
  return impl_->bodies.size();
}

const BodyDefinition& World::body(BodyId id) const {
  DYOP_REQUIRE(id >= 0 && static_cast<std::size_t>(id) < impl_->bodies.size(),
               "World: there is no body ", id, " among ", impl_->bodies.size());
  return impl_->bodies[static_cast<std::size_t>(id)].definition;
}

const MotionState& World::state(BodyId id) const {
  body(id);
  return impl_->bodies[static_cast<std::size_t>(id)].state;
}

void World::set_state(BodyId id, const MotionState& state) {
  DYOP_REQUIRE(body(id).kind == BodyKind::Dynamic, "body '", body(id).name,
               "': only the state of a dynamic body can be set");
  DYOP_REQUIRE(state.twist.v_WB.allFinite() && state.twist.w_WB.allFinite(), "body '",
               body(id).name, "': velocity must be finite");
  BodyRecord& record = impl_->bodies[static_cast<std::size_t>(id)];
  record.state = state;
  record.is_settled = false;
  record.impact_times.clear();
  impl_->must_restart = true;
}

bool World::is_settled(BodyId id) const {
  body(id);
  return impl_->bodies[static_cast<std::size_t>(id)].is_settled;
}

Scalar World::kinetic_energy() const {
  Scalar energy = 0;
  for (const BodyRecord& body : impl_->bodies) {
    if (body.definition.kind != BodyKind::Dynamic) continue;
    const Vector3& w = body.state.twist.w_WB;
    energy += (body.definition.mass_properties.mass * body.center_velocity().squaredNorm() +
               w.dot(body.inertia_W() * w)) /
              2;
  }
  return energy;
}

Vector3 World::angular_momentum() const {
  Vector3 sum = Vector3::Zero();
  for (const BodyRecord& body : impl_->bodies) {
    if (body.definition.kind != BodyKind::Dynamic) continue;
    sum +=
        body.center_of_mass().cross(body.definition.mass_properties.mass * body.center_velocity()) +
        body.inertia_W() * body.state.twist.w_WB;
  }
  return sum;
}

AdvanceReport World::advance(Scalar dt, std::stop_token stop) {
  return impl_->advance(dt, stop);
}

}  // namespace dyop
