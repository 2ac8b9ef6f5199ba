// SPDX-License-Identifier: BSD-3-Clause
#include "check/trusted/prover.h"

#include "check/trusted/kernel.h"

namespace dyop_check {
namespace {

// A body within a step: how it passes through it, one segment after another, and the box of the
// balls about its centre of mass. A passage without a segment: its motion is not supported.
struct Sweep {
  std::vector<Passage> passages;
  Vec low{kInfinity, kInfinity, kInfinity};
  Vec high{-kInfinity, -kInfinity, -kInfinity};
};

class Checker {
 public:
  Checker(const Recording& recording, const CheckOptions& options)
      : recording_(recording), options_(options), next_(recording.bodies.size(), 0) {
    const auto count = std::uint32_t(recording.bodies.size());
    for (std::uint32_t a = 0; a < count; ++a) {
      for (std::uint32_t b = a + 1; b < count; ++b)
        verdict_.pairs += recording.is_tested(a, b, recording.rules.front());
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
      verdict_.jumps.add({k, after.begin, jump});
    }
  }

  void check_step(double begin, double end) {
    follow(at_time(recording_.rules, begin));
    std::vector<Sweep> sweeps(recording_.bodies.size());
    std::vector<std::uint32_t> order;
    for (std::uint32_t k = 0; k < sweeps.size(); ++k) {
      sweeps[k] = sweep(k, begin, end);
      if (!sweeps[k].passages.empty()) order.push_back(k);
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
        if (recording_.is_tested(a, b, *rules_)) check_pair(a, b, sweeps[a], sweeps[b]);
      }
    }
  }

  // Segments are looked up in order of time, so that each is passed once.
  Sweep sweep(std::uint32_t k, double begin, double end) {
    const RecordedBody& body = recording_.bodies[k];
    const std::vector<Segment>& segments = body.segments;
    Sweep sweep;
    std::size_t& next = next_[k];
    while (next + 1 < segments.size() && segments[next + 1].begin <= begin) ++next;
    for (std::size_t s = next; s < segments.size() && segments[s].begin < end; ++s) {
      const double t0 = std::max(begin, segments[s].begin);  // before its first, it is not there
      const double t1 = s + 1 < segments.size() ? std::min(end, segments[s + 1].begin) : end;
      if (t0 < t1) add(sweep, body, segments[s], t0, t1);
    }
    return sweep;
  }

  void add(Sweep& sweep, const RecordedBody& body, const Segment& segment, double t0,
           double t1) const {
    if (segment.kind == Segment::Kind::Absent) return;
    if (!segment.is_known() || !segment.holds(t0, t1)) {
      sweep.low = {-kInfinity, -kInfinity, -kInfinity};
      sweep.high = -1.0 * sweep.low;
      Passage& unknown = sweep.passages.emplace_back();
      unknown.begin = t0;
      unknown.end = t1;
      return;
    }
    const Passage& p = sweep.passages.emplace_back(passage(*body.shape, segment, t0, t1));
    const double h = t1 - t0;
    const double grow =
        body.shape->reach + segment.lever + h * h / 8 * p.most.center + largest_target_ + p.noise;
    for (const Pose& X : {p.first, p.last}) {
      const Vec center = X * segment.p_cm;
      sweep.low = {std::min(sweep.low.x, center.x - grow), std::min(sweep.low.y, center.y - grow),
                   std::min(sweep.low.z, center.z - grow)};
      sweep.high = {std::max(sweep.high.x, center.x + grow),
                    std::max(sweep.high.y, center.y + grow),
                    std::max(sweep.high.z, center.z + grow)};
    }
  }

  // Over every part of the step in which both are there and follow one segment.
  void check_pair(std::uint32_t a, std::uint32_t b, const Sweep& x, const Sweep& y) {
    for (std::size_t i = 0, j = 0; i < x.passages.size() && j < y.passages.size();) {
      const Passage& p = x.passages[i];
      const Passage& q = y.passages[j];
      const double begin = std::max(p.begin, q.begin);
      const double end = std::min(p.end, q.end);
      if (begin < end) check_part(a, b, within(p, begin, end), within(q, begin, end));
      if (p.end <= end) ++i;
      if (q.end <= end) ++j;
    }
  }

  static Passage within(const Passage& whole, double begin, double end) {
    if (whole.segment == nullptr || (whole.begin == begin && whole.end == end)) return whole;
    return passage(*whole.body, *whole.segment, begin, end);
  }

  void check_part(std::uint32_t a, std::uint32_t b, const Passage& p, const Passage& q) {
    const double target = options_.scale * recording_.target(a, b, *rules_);
    verdict_.least_target = std::min(verdict_.least_target, target);
    verdict_.largest_target = std::max(verdict_.largest_target, target);
    Finding finding{a, b, std::max(p.begin, q.begin), std::min(p.end, q.end), 0, target};
    if (p.segment == nullptr || q.segment == nullptr) return verdict_.undecided.add(finding);
    const bool both_rest = p.segment->rests() && q.segment->rests();
    if (both_rest && resting_[{a, b}] == std::pair(p.segment, q.segment)) return;
    PairProver prover(p, q, target, options_.most_node_pairs);
    const Answer answer = fronts_[{a, b}].prove(prover);
    verdict_.node_pairs += prover.node_pairs();
    if (answer == Answer::Proven) {
      ++verdict_.intervals;
      if (both_rest) resting_[{a, b}] = {p.segment, q.segment};
    } else if (recording_.is_uncertified(a, b, finding.begin)) {
      ++verdict_.uncertified;
    } else if (answer == Answer::Refuted) {
      finding.begin = prover.refuted_at();
      finding.distance = prover.refuted_distance();
      verdict_.refuted.add(finding);
    } else {
      verdict_.undecided.add(finding);
    }
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
