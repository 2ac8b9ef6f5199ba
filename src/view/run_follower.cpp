// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <span>
#include <tuple>

#include "dyop/motion/steady_motions.h"
#include "dyop/view/live_server.h"
#include "view/motion_rows.h"

namespace dyop {
namespace {

PageMark mark_of(Scalar t, const char* kind, std::string text, std::vector<BodyId> bodies) {
  return {t, kind, std::move(text), std::move(bodies)};
}

std::string names_of(const World& world, const std::vector<BodyId>& bodies) {
  std::string names;
  for (const BodyId id : bodies) {
    if (!world.has_body(id)) continue;
    if (!names.empty()) names += ", ";
    names += world.body(id).name;
  }
  return names;
}

constexpr std::ptrdiff_t kWitnesses = 4;

// The pairs with the smallest proven gaps get witness points and tight bounds from queries.
void add_witnesses(const World& world, std::span<PageGap> gaps) {
  const auto count = std::min(kWitnesses, std::ssize(gaps));
  std::partial_sort(gaps.begin(), gaps.begin() + count, gaps.end(),
                    [](const PageGap& x, const PageGap& y) { return x.lower < y.lower; });
  for (PageGap& gap : gaps.first(std::size_t(count))) {
    DistanceCache cache;
    view_internal::add_witness(gap, *world.body(gap.a).shape, world.state(gap.a).X_WB,
                               *world.body(gap.b).shape, world.state(gap.b).X_WB, cache);
  }
}

// On the committed motions, which end with the step at whose end the event is.
void place_event(ImpactEvent& event, const AdvanceReport& report, const World& world) {
  const auto step = std::ranges::find_if(report.steps, [&](const CommittedStep& one) {
    return one.interval.begin <= event.t && event.t <= one.interval.end;
  });
  const auto [a, b] = std::pair(std::size_t(event.a.slot), std::size_t(event.b.slot));
  if (step == report.steps.end() || std::max(a, b) >= step->motions.size()) return;
  const auto& [motion_a, motion_b] = std::tie(step->motions[a], step->motions[b]);
  if (motion_a == nullptr || motion_b == nullptr) return;
  if (!world.has_body(event.a) || !world.has_body(event.b)) return;
  view_internal::place_impact(event, *world.body(event.a).shape, motion_a->pose(event.t),
                              *world.body(event.b).shape, motion_b->pose(event.t));
}

}  // namespace

PageScene RunFollower::scene_of(const World& world, const std::string& title,
                                const Vector3& gravity_W, Scalar end_time) {
  PageScene scene;
  scene.title = title;
  scene.gravity_W = gravity_W;
  scene.begin_time = world.time();
  scene.end_time = end_time;
  for (const BodyId id : world.bodies()) {
    const BodyDefinition& body = world.body(id);
    PageBody& page_body = scene.bodies.emplace_back();
    page_body.name = body.name;
    page_body.kind = body.kind;
    page_body.shape = body.shape;
    if (body.kind == BodyKind::Dynamic) page_body.mass_properties = body.mass_properties;
  }
  return scene;
}

PageSpan RunFollower::start(const World& world) {
  PageSpan span;
  for (const BodyId id : world.bodies()) {
    const TimeInterval instant{world.time(), world.time()};
    span.segments.push_back({id, instant, std::make_shared<RestMotion>(world.state(id).X_WB)});
  }
  return span;
}

PageSpan RunFollower::ended(const World& world, AdvanceStatus status, Scalar planned_end) {
  const Scalar t = world.time();
  PageSpan span;
  span.marks.push_back(mark_of(t, "end", view_internal::ending_words(status, t, planned_end), {}));
  return span;
}

void RunFollower::add_segments(const AdvanceReport& report, PageSpan& span) {
  for (const CommittedStep& step : report.steps) {
    span.steps.push_back(step.interval);
    rests_.resize(std::max(rests_.size(), step.motions.size()));
    for (std::size_t slot = 0; slot < step.motions.size(); ++slot) {
      const auto& motion = step.motions[slot];
      const bool is_rest =
          motion == nullptr || dynamic_cast<const RestMotion*>(motion.get()) != nullptr;
      if (is_rest && has_started_ && motion == rests_[slot]) continue;
      rests_[slot] = is_rest ? motion : nullptr;
      span.segments.push_back({BodyId(slot), step.interval, motion});
    }
    has_started_ = true;
  }
}

void RunFollower::add_frame(const AdvanceReport& report, const World& world, PageSpan& span) {
  PageFrame frame;
  frame.interval = {report.steps.empty() ? report.t : report.steps.front().interval.begin,
                    report.t};
  frame.work = report.work;
  frame.kinetic_energy = world.kinetic_energy();
  frame.momentum_W = world.momentum();
  frame.angular_momentum_W = world.angular_momentum();
  for (const BodyId id : world.bodies()) {
    const BodyDefinition& body = world.body(id);
    if (body.kind != BodyKind::Dynamic || !world.is_enabled(id)) continue;
    const Vector3 p_WBcm = world.state(id).X_WB * body.mass_properties.p_BoBcm;
    frame.potential_energy -= body.mass_properties.mass * gravity_W_.dot(p_WBcm);
  }
  span.frames.push_back(frame);
}

void RunFollower::add_pairs(const World& world, PageSpan& span) {
  const TimeInterval interval = span.frames.back().interval;
  std::vector<std::pair<BodyId, BodyId>> resting;
  const std::size_t first = span.gaps.size();
  for (const PairRecord& pair : world.pairs()) {
    const bool is_resting = pair.proof == ProofKind::AtRest;
    if (is_resting) resting.emplace_back(pair.a, pair.b);
    if (is_resting && std::binary_search(resting_.begin(), resting_.end(), resting.back())) {
      continue;  // the page knows it already
    }
    view_internal::add_pair(pair, interval, span);
  }
  std::sort(resting.begin(), resting.end());
  resting_ = std::move(resting);
  add_witnesses(world, std::span(span.gaps).subspan(first));
}

void RunFollower::add_marks(const AdvanceReport& report, const World& world, PageSpan& span) const {
  const auto add = [&](const char* kind, const char* words, const std::vector<BodyId>& bodies) {
    if (bodies.empty()) return;
    span.marks.push_back(mark_of(report.t, kind, words + names_of(world, bodies), bodies));
  };
  add("woke", "woke: ", report.woke);
  add("asleep", "fell asleep: ", report.fell_asleep);
  for (const auto& [a, b] : report.too_near) add("too_near", "nearer than their target: ", {a, b});
  for (const auto& [a, b] : report.crossed) add("crossed", "crossed: ", {a, b});
  if (report.work.stalls > 0) {
    span.marks.push_back(mark_of(report.t, "stalled",
                                 std::to_string(report.work.stalls) + " islands stood still", {}));
  }
  if (const char* words = view_internal::undecided_words(report.status)) {
    const auto [a, b] = report.offending_pair;
    const std::string names = names_of(world, {a, b});
    span.marks.push_back(
        mark_of(report.t, "undecided", words + (names.empty() ? "" : ": " + names), {a, b}));
  }
}

PageSpan RunFollower::follow(const AdvanceReport& report, const World& world) {
  PageSpan span;
  add_segments(report, span);
  add_frame(report, world, span);
  span.impacts = report.impacts;
  for (ImpactEvent& event : span.impacts) place_event(event, report, world);
  add_pairs(world, span);
  add_marks(report, world, span);
  return span;
}

}  // namespace dyop
