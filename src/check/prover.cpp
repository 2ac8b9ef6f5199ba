// SPDX-License-Identifier: BSD-3-Clause
#include "check/prover.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "check/kernel.h"

// TRUSTED.

namespace dyop_check {
namespace {

constexpr std::size_t kMostFindings = 100;
constexpr int kFreshStart = 16;  // proofs after which a pair starts again at the roots

// A cut through the pairs of nodes of two trees, and for how many proofs it has served.
struct Front {
  std::vector<NodePair> pairs{NodePair{}};
  int proofs = 0;
};

// Where a body is within a step: the box of a ball about its centre of mass.
struct Sweep {
  Vec low;
  Vec high;
  std::size_t first = 0;  // segments that cover the step
  std::size_t last = 0;
  bool is_there = false;
};

class Checker {
 public:
  Checker(const Recording& recording, const CheckOptions& options)
      : recording_(recording), options_(options), next_(recording.bodies.size(), 0) {
    follow(recording.rules_at(recording.begin));
    const auto count = std::uint32_t(recording.bodies.size());
    for (std::uint32_t a = 0; a < count; ++a) {
      for (std::uint32_t b = a + 1; b < count; ++b)
        verdict_.pairs += recording.is_tested(a, b, *rules_);
    }
  }

  Verdict run() {
    for (std::uint32_t k = 0; k < recording_.bodies.size(); ++k) check_joins(k);
    for (const auto& [begin, end] : recording_.steps) {
      if (end > begin) check_step(begin, end);
    }
    return std::move(verdict_);
  }

 private:
  // The rules that hold from now on.
  void follow(const Rules& rules) {
    if (rules_ == &rules) return;
    rules_ = &rules;
    resting_.clear();
    largest_target_ = rules.target_distance.value_or(0);
    for (const auto& [pair, distance] : rules.target_distances)
      largest_target_ = std::max(largest_target_, distance);
    for (std::uint32_t a = 0; a < recording_.bodies.size() && !rules.target_distance; ++a)
      largest_target_ = std::max(largest_target_, recording_.target(a, a, rules));
    largest_target_ *= options_.scale;
  }

  // Where two segments of a body meet they must agree, or it might have jumped through another.
  void check_joins(std::uint32_t k) {
    constexpr double kJoin = 1e-9;  // literal: relative to the size of body and coordinates
    const RecordedBody& body = recording_.bodies[k];
    const Segment* before = nullptr;
    if (body.continues) before = recording_.bodies[*body.continues].segment(body.from, true);
    for (const Segment& after : body.segments) {
      const Segment* last = std::exchange(before, &after);
      if (last == nullptr || !last->is_known() || !after.is_known() ||
          body.placed.contains(after.begin))
        continue;
      const Pose X = last->pose(after.begin);
      const Pose Y = after.pose(after.begin);
      double jump = norm(X.p - Y.p);
      for (std::size_t i = 0; i < 9; ++i)
        jump = std::max(jump, std::abs(X.R.m[i] - Y.R.m[i]) * body.shape->size);
      if (jump <= kJoin * (norm(X.p) + body.shape->size)) continue;
      ++verdict_.jump_count;
      if (verdict_.jumps.size() < kMostFindings) verdict_.jumps.push_back({k, after.begin, jump});
    }
  }

  void check_step(double begin, double end) {
    follow(recording_.rules_at(begin));
    std::vector<Sweep> sweeps(recording_.bodies.size());
    std::vector<std::uint32_t> order;
    for (std::uint32_t k = 0; k < sweeps.size(); ++k) {
      sweeps[k] = sweep(k, begin, end);
      if (sweeps[k].is_there) order.push_back(k);
    }
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return sweeps[a].low.x < sweeps[b].low.x; });
    for (std::size_t i = 0; i < order.size(); ++i) {
      const Sweep& x = sweeps[order[i]];
      for (std::size_t j = i + 1; j < order.size() && !(sweeps[order[j]].low.x > x.high.x); ++j) {
        const Sweep& y = sweeps[order[j]];
        if (x.low.y > y.high.y || y.low.y > x.high.y || x.low.z > y.high.z || y.low.z > x.high.z)
          continue;
        const std::uint32_t a = std::min(order[i], order[j]);
        const std::uint32_t b = std::max(order[i], order[j]);
        if (recording_.is_tested(a, b, *rules_)) check_pair(a, b, sweeps[a], sweeps[b], begin, end);
      }
    }
  }

  // Segments are looked up in order of time, so that each is passed once.
  Sweep sweep(std::uint32_t k, double begin, double end) {
    const RecordedBody& body = recording_.bodies[k];
    Sweep sweep;
    std::size_t& next = next_[k];
    while (next + 1 < body.segments.size() && body.segments[next + 1].begin <= begin) ++next;
    sweep.first = next;
    sweep.last = next;
    while (sweep.last + 1 < body.segments.size() && body.segments[sweep.last + 1].begin < end)
      ++sweep.last;
    sweep.low = {kInfinity, kInfinity, kInfinity};
    sweep.high = -1.0 * sweep.low;
    for (std::size_t s = sweep.first; s <= sweep.last && s < body.segments.size(); ++s) {
      const Segment& segment = body.segments[s];
      if (segment.kind == Segment::Kind::Absent) continue;
      sweep.is_there = true;
      const double t0 = std::max(begin, segment.begin);
      const double t1 = s < sweep.last ? body.segments[s + 1].begin : end;
      add_ball(sweep, body, segment, t0, t1);
    }
    return sweep;
  }

  void add_ball(Sweep& sweep, const RecordedBody& body, const Segment& segment, double t0,
                double t1) const {
    if (segment.kind == Segment::Kind::Unsupported) {
      sweep.low = {-kInfinity, -kInfinity, -kInfinity};
      sweep.high = {kInfinity, kInfinity, kInfinity};
      return;
    }
    const double h = t1 - t0;
    const Acceleration a = acceleration(segment, t0, t1);
    const double reach = body.shape->reach + segment.lever;
    const double grow = reach + h * h / 8 * a.center + largest_target_ +
                        pose_noise(segment, body.shape->size, t0, t1);
    for (const double t : {t0, t1}) {
      const Pose X = segment.pose(t);
      const Vec center = X * segment.p_cm;
      sweep.low = {std::min(sweep.low.x, center.x - grow), std::min(sweep.low.y, center.y - grow),
                   std::min(sweep.low.z, center.z - grow)};
      sweep.high = {std::max(sweep.high.x, center.x + grow),
                    std::max(sweep.high.y, center.y + grow),
                    std::max(sweep.high.z, center.z + grow)};
    }
  }

  // Over every part of the step in which both follow one segment.
  void check_pair(std::uint32_t a, std::uint32_t b, const Sweep& x, const Sweep& y, double begin,
                  double end) {
    const auto& p = recording_.bodies[a].segments;
    const auto& q = recording_.bodies[b].segments;
    std::size_t i = x.first;
    std::size_t j = y.first;
    for (double t = begin; t < end;) {
      const double next_a = i < x.last ? p[i + 1].begin : end;
      const double next_b = j < y.last ? q[j + 1].begin : end;
      const double next = std::min({next_a, next_b, end});
      if (next > t) check_part(a, b, p[i], q[j], t, next);
      t = next;
      if (next_a <= next && i < x.last) ++i;
      if (next_b <= next && j < y.last) ++j;
    }
  }

  void check_part(std::uint32_t a, std::uint32_t b, const Segment& p, const Segment& q, double from,
                  double end) {
    const double begin = std::max({from, p.begin, q.begin});  // before, a body is not there
    if (!(begin < end)) return;
    using Kind = Segment::Kind;
    if (p.kind == Kind::Absent || q.kind == Kind::Absent) return;
    const Body& A = *recording_.bodies[a].shape;
    const Body& B = *recording_.bodies[b].shape;
    const bool both_rest = p.kind == Kind::Rest && q.kind == Kind::Rest;
    if (both_rest && resting_[{a, b}] == std::pair(&p, &q)) return;
    const double target = options_.scale * recording_.target(a, b, *rules_);
    Finding finding{a, b, begin, end, 0, target};
    if (p.kind == Kind::Unsupported || q.kind == Kind::Unsupported) return note_undecided(finding);
    PairProver prover({&A, &p}, {&B, &q}, target, options_.most_node_pairs);
    Front& front = fronts_[{a, b}];
    if (front.proofs++ % kFreshStart == 0) front.pairs = {{0, 0, front.pairs.front().direction}};
    const Answer answer = prover.prove(begin, end, front.pairs);
    if (answer != Answer::Proven) front.proofs = 0;
    verdict_.node_pairs += prover.node_pairs();
    if (answer == Answer::Proven) {
      ++verdict_.intervals;
      if (both_rest) resting_[{a, b}] = {&p, &q};
    } else if (recording_.is_uncertified(a, b, begin)) {
      ++verdict_.uncertified;
    } else if (answer == Answer::Refuted) {
      finding.begin = prover.refuted_at();
      finding.distance = prover.refuted_distance();
      ++verdict_.refuted_count;
      if (verdict_.refuted.size() < kMostFindings) verdict_.refuted.push_back(finding);
    } else {
      note_undecided(finding);
    }
  }

  void note_undecided(const Finding& finding) {
    ++verdict_.undecided_count;
    if (verdict_.undecided.size() < kMostFindings) verdict_.undecided.push_back(finding);
  }

  const Recording& recording_;
  CheckOptions options_;
  Verdict verdict_;
  std::vector<std::size_t> next_;  // by body: the segment of the present step
  const Rules* rules_ = nullptr;
  double largest_target_ = 0;
  std::map<Pair, std::pair<const Segment*, const Segment*>> resting_;  // proven already
  std::map<Pair, Front> fronts_;                                       // of near pairs
};

}  // namespace

Verdict check_geometry(const Recording& recording, const CheckOptions& options) {
  return Checker(recording, options).run();
}

}  // namespace dyop_check
