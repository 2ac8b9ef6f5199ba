// SPDX-License-Identifier: BSD-3-Clause
#include "check/prover.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "check/direction.h"

// TRUSTED, except for the choice of directions and of what is split.
//
// The kernel. Take a node of A and one of B, an interval [t0, t1] of length h throughout which both
// bodies follow one segment each, and any unit vector n. The height n.x(t) of a point that
// accelerates by at most a stays above the chord between its heights at t0 and t1 less h^2 a / 8.
// So if, at both ends, the lowest point of B is higher along n than the highest point of A by more
// than the distance plus h^2 / 8 times the sum of the largest accelerations of both nodes, then no
// two points of the nodes come nearer than the distance at any time between.

namespace dyop_check {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kMostFindings = 100;
constexpr int kMostHalvings = 48;

// A body over an interval in which it follows one segment.
struct Side {
  const Body* body = nullptr;
  const Segment* segment = nullptr;
};

// Both poses and accelerations of two sides over an interval.
struct Window {
  double begin = 0;
  double end = 0;
  Pose a0, a1, b0, b1;
  Acceleration a, b;
};

// The largest d.x over a node that is posed by X.
double support(const Body& body, const Node& node, const Pose& X, const Vec& d) {
  const Vec in = transposed(X.R, d);
  const double offset = dot(d, X.p);
  if (node.is_leaf()) return offset + body.pieces[std::size_t(node.piece)].support(in);
  return offset + dot(in, node.center) + std::abs(in.x) * node.half.x +
         std::abs(in.y) * node.half.y + std::abs(in.z) * node.half.z;
}

// The same point, for the untrusted search.
Vec support_point(const Body& body, const Node& node, const Pose& X, const Vec& d) {
  const Vec in = transposed(X.R, d);
  if (node.is_leaf()) {
    const Piece& piece = body.pieces[std::size_t(node.piece)];
    return X * (piece.core_support(in) +
                (piece.radius / std::max(norm(in), std::numeric_limits<double>::min())) * in);
  }
  return X * (node.center + Vec{std::copysign(node.half.x, in.x), std::copysign(node.half.y, in.y),
                                std::copysign(node.half.z, in.z)});
}

enum class Answer { Proven, Refuted, Undecided };

// One pair of bodies over an interval.
class PairProver {
 public:
  PairProver(const Side& a, const Side& b, double target, double noise, std::int64_t budget)
      : a_(a), b_(b), target_(target), noise_(noise), budget_(budget) {}

  Answer prove(double begin, double end, Vec guess) {
    last_direction_ = guess;
    return prove(window(begin, end), 0, 0, guess, 0);
  }

  std::int64_t node_pairs() const { return node_pairs_; }
  double refuted_at() const { return refuted_at_; }
  double refuted_distance() const { return refuted_distance_; }
  const Vec& last_direction() const { return last_direction_; }

 private:
  Window window(double begin, double end) const {
    Window w;
    w.begin = begin;
    w.end = end;
    w.a0 = a_.segment->pose(begin);
    w.a1 = a_.segment->pose(end);
    w.b0 = b_.segment->pose(begin);
    w.b1 = b_.segment->pose(end);
    w.a = acceleration(*a_.segment, begin, end);
    w.b = acceleration(*b_.segment, begin, end);
    return w;
  }

  // The gap of two nodes along the unit vector n, at the poses given.
  double gap(const Node& x, const Node& y, const Pose& X, const Pose& Y, const Vec& n) const {
    return -support(*b_.body, y, Y, -1.0 * n) - support(*a_.body, x, X, n);
  }

  struct Slack {
    double ends = 0;  // the smaller gap at an end, above the target
    double sag = 0;   // that the motion in between may take from it
  };
  Slack slack(const Window& w, const Node& x, const Node& y, const Vec& n) const {
    const double h = w.end - w.begin;
    const double sum = w.a.center + w.a.turn * x.reach + w.b.center + w.b.turn * y.reach;
    const double lowest = std::min(gap(x, y, w.a0, w.b0, n), gap(x, y, w.a1, w.b1, n));
    return {lowest - target_ - noise_, h * h / 8 * sum};
  }

  // Of a half-space and a convex piece the gap along the normal is their distance.
  Nearest along(const Node& x, const Node& y, const Pose& X, const Pose& Y, const Vec& n) const {
    const double distance = std::max(0.0, gap(x, y, X, Y, n));
    return {(distance > 0 ? distance : 1) * n, distance};
  }

  Nearest search(const Node& x, const Node& y, const Pose& X, const Pose& Y,
                 const Vec& guess) const {
    if (const Piece* plane = a_.body->half_space()) return along(x, y, X, Y, X.R * plane->normal);
    if (const Piece* plane = b_.body->half_space()) {
      return along(x, y, X, Y, -1.0 * (Y.R * plane->normal));
    }
    return nearest_direction(
        [&](const Vec& d) {
          return support_point(*b_.body, y, Y, d) - support_point(*a_.body, x, X, -1.0 * d);
        },
        guess);
  }

  // Is the pair nearer than its target at a time? Then the distance of two of its points shows it.
  bool refute(const Node& x, const Node& y, double t, const Pose& X, const Pose& Y,
              const Vec& guess) {
    const Nearest nearest = search(x, y, X, Y, guess);
    const bool they_meet = !(nearest.distance > 0);
    if (!they_meet && !(nearest.distance + noise_ < target_)) return false;
    refuted_at_ = t;
    refuted_distance_ = nearest.distance;
    return true;
  }

  Answer prove(const Window& w, std::size_t i, std::size_t j, Vec n, int halvings) {
    if (++node_pairs_ > budget_) return Answer::Undecided;
    const Node& x = a_.body->nodes[i];
    const Node& y = b_.body->nodes[j];
    Slack best = slack(w, x, y, n);
    if (best.ends > best.sag) return Answer::Proven;
    const double middle = w.begin + (w.end - w.begin) / 2;
    const Pose X = a_.segment->pose(middle);
    const Pose Y = b_.segment->pose(middle);
    const Nearest nearest = search(x, y, X, Y, n);
    if (nearest.distance > 0) {
      const Vec found = (1 / nearest.distance) * nearest.direction;
      const Slack other = slack(w, x, y, found);
      if (other.ends - other.sag > best.ends - best.sag || !(best.ends > 0)) {
        best = other;
        n = found;
      }
      if (best.ends > best.sag) {
        last_direction_ = n;
        return Answer::Proven;
      }
    }
    // Only the motion in between is in the way: halve the time. Else open the larger node.
    const bool are_leaves = x.is_leaf() && y.is_leaf();
    if (best.ends > 0 || are_leaves) {
      if (are_leaves && (refute(x, y, w.begin, w.a0, w.b0, n) || refute(x, y, middle, X, Y, n) ||
                         refute(x, y, w.end, w.a1, w.b1, n))) {
        return Answer::Refuted;
      }
      return halve(w, middle, i, j, n, halvings);
    }
    return open(w, i, j, n, halvings);
  }

  Answer halve(const Window& w, double middle, std::size_t i, std::size_t j, const Vec& n,
               int halvings) {
    if (halvings >= kMostHalvings || !(w.begin < middle && middle < w.end))
      return Answer::Undecided;
    const Answer first = prove(window(w.begin, middle), i, j, n, halvings + 1);
    if (first != Answer::Proven) return first;
    return prove(window(middle, w.end), i, j, n, halvings + 1);
  }

  Answer open(const Window& w, std::size_t i, std::size_t j, const Vec& n, int halvings) {
    const Node& x = a_.body->nodes[i];
    const Node& y = b_.body->nodes[j];
    const bool opens_a = !x.is_leaf() && (y.is_leaf() || norm(x.half) >= norm(y.half));
    for (std::size_t child = 0; child < 2; ++child) {
      const Answer answer = opens_a ? prove(w, std::size_t(x.left) + child, j, n, halvings)
                                    : prove(w, i, std::size_t(y.left) + child, n, halvings);
      if (answer != Answer::Proven) return answer;
    }
    return Answer::Proven;
  }

  Side a_;
  Side b_;
  double target_;
  double noise_;
  std::int64_t budget_;
  std::int64_t node_pairs_ = 0;
  double refuted_at_ = 0;
  double refuted_distance_ = 0;
  Vec last_direction_;
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
    // The direction of a half-space is turned twice.
    const double turns = A.half_space() || B.half_space() ? 2 : 1;
    const double noise =
        turns * (pose_noise(p, A.size, begin, end) + pose_noise(q, B.size, begin, end));
    PairProver prover({&A, &p}, {&B, &q}, target, noise, options_.most_node_pairs);
    Vec& hint = hints_.try_emplace({a, b}, Vec{1, 0, 0}).first->second;
    const Answer answer = prover.prove(begin, end, hint);
    hint = prover.last_direction();
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
  std::map<Pair, Vec> hints_;  // the direction that served last
};

}  // namespace

Verdict check_geometry(const Recording& recording, const CheckOptions& options) {
  return Checker(recording, options).run();
}

}  // namespace dyop_check
