// SPDX-License-Identifier: BSD-3-Clause
#include "check/trusted/kernel.h"

#include "check/direction.h"

namespace dyop_check {
namespace {

constexpr int kMostHalvings = 48;
constexpr int kFreshStart = 16;    // proofs after which a pair starts again at the roots
constexpr double kRounded = 1e-9;  // literal: more than the rounding of distances, relative

// The largest d.x over a node.
double support(const PosedNode& at, const Vec& d) {
  return dot(d, at.X->p) + at.body->support(*at.node, transposed(at.X->R, d), at.part);
}

Passage part(const Passage& whole, double begin, double end) {
  const Segment& g = *whole.segment;
  return {whole.body, &g, begin, end, g.pose(begin), g.pose(end), bounds(g, begin, end),
          whole.noise};
}

}  // namespace

Passage passage(const Body& body, const Segment& segment, double begin, double end) {
  Passage whole;
  whole.body = &body;
  whole.segment = &segment;
  whole.noise = pose_noise(segment, body.size, begin, end);
  return part(whole, begin, end);
}

double gap(const PosedNode& a, const PosedNode& b, const Vec& n) {
  return -support(b, -1.0 * n) - support(a, n);
}

// Both bodies over an interval.
struct PairProver::Window {
  Passage a, b;
  double length() const { return a.end - a.begin; }
};

struct PairProver::Slack {
  double ends = 0;  // the smaller gap at an end, above the target
  double sag = 0;   // that the motion in between may take from it
  double least() const { return ends - sag; }
};

// The direction of a half-space is turned twice.
PairProver::PairProver(const Passage& a, const Passage& b, double target, std::int64_t budget)
    : a_(a),
      b_(b),
      target_(target),
      noise_((a.body->half_space() || b.body->half_space() ? 2 : 1) * (a.noise + b.noise)),
      budget_(budget) {}

PairProver::Slack PairProver::slack(const Window& w, const Node& x, const Node& y,
                                    const Direction& d) const {
  if (d.frame != Frame::World) return turning_slack(w, x, y, d);
  const double h = w.length();
  const double sum =
      w.a.most.center + w.a.most.turn * x.reach + w.b.most.center + w.b.most.turn * y.reach;
  const double first = gap(w.a.at_first(x), w.b.at_first(y), d.n);
  const double last = gap(w.a.at_last(x), w.b.at_last(y), d.n);
  return {std::min(first, last) - target_ - noise_, h * h / 8 * sum};
}

// With n fixed in the body F. Seen from there, a point of the other body O at d from a point q of F
// accelerates by R^T (d'' - 2 w x d' - w' x d + w x (w x d)), where w is the angular velocity of F.
// For q the centre of F's box is taken, so that d and d' are those near the contact. No velocity
// differs from the mean one by more than h times the largest acceleration.
PairProver::Slack PairProver::turning_slack(const Window& w, const Node& x, const Node& y,
                                            const Direction& direction) const {
  const bool is_in_a = direction.frame == Frame::A;
  const Passage& F = is_in_a ? w.a : w.b;
  const Passage& O = is_in_a ? w.b : w.a;
  const Node& f = is_in_a ? x : y;
  const Node& o = is_in_a ? y : x;
  // As seen from a body that turns, a half-space's points accelerate without bound.
  if (O.body->half_space() || O.body->deforms() || F.body->deforms()) return {-kInfinity, 0};
  const double h = w.length();
  const double size = norm(o.half);
  const double second = O.most.center + O.most.turn * o.reach + F.most.center + F.most.turn * f.arm;
  const Vec d = O.first * o.center - F.first * f.center;
  const Vec change = O.last * o.center - F.last * f.center - d;
  const double rate = (norm(change) + 2 * noise_) / h + O.most.speed * size + h * second;
  const double distance = norm(d) + size + h * rate;
  const double sum = (1 + kRounded + F.segment->skew) *
                     (second + 2 * F.most.speed * rate + F.most.turn * distance);
  const Vec n0 = F.first.R * direction.n;
  const Vec n1 = F.last.R * direction.n;
  const double first = gap(w.a.at_first(x), w.b.at_first(y), n0);
  const double last = gap(w.a.at_last(x), w.b.at_last(y), n1);
  // What the direction is longer than one, and the heights of F change, if R is no rotation.
  const double skewed = 8 * F.segment->skew * (target_ + distance + norm(f.half));
  return {std::min(first, last) - target_ - noise_ - skewed, h * h / 8 * sum};
}

// Tries a direction that was found in the middle of the interval, fixed in the world and in each of
// the bodies, and keeps the best.
bool PairProver::improve(const Window& w, const Node& x, const Node& y, const Vec& found,
                         Slack& best, Direction& direction) const {
  bool is_better = false;
  for (const Frame frame : {Frame::World, Frame::A, Frame::B}) {
    Direction other{found, frame};
    if (frame != Frame::World) {
      const Passage& side = frame == Frame::A ? w.a : w.b;
      if (side.segment->rests()) continue;
      other.n = transposed(side.segment->pose(w.a.begin + w.length() / 2).R, found);
      other.n = (1 / norm(other.n)) * other.n;
    }
    const Slack now = slack(w, x, y, other);
    if (!(now.least() > best.least()) && (best.ends > 0 || !(now.ends > best.ends))) continue;
    best = now;
    direction = other;
    is_better = true;
    if (best.least() > 0) break;
  }
  return is_better;
}

// Is the pair nearer than its target at a time? Then the distance of two of its points shows it.
bool PairProver::refute(const PosedNode& x, const PosedNode& y, double t, const Vec& guess) {
  const Nearest nearest = nearest_direction(x, y, guess);
  const bool they_meet = nearest.they_meet && nearest.distance <= noise_;
  if (!they_meet && !(nearest.distance + noise_ < target_)) return false;
  refuted_at_ = t;
  refuted_distance_ = nearest.distance;
  return true;
}

Answer PairProver::prove(std::vector<NodePair>& front) {
  const Window w{a_, b_};
  std::vector<NodePair> next;
  for (const NodePair& pair : front) {
    const Answer answer = prove(w, pair, 0, &next);
    if (answer != Answer::Proven) return answer;
  }
  front = std::move(next);
  return Answer::Proven;
}

// Every pair of nodes that is asked for is either proven over the whole interval, or both halves of
// it are, or all pairs of its children. `front` gets the first two kinds.
Answer PairProver::prove(const Window& w, NodePair pair, int halvings,
                         std::vector<NodePair>* front) {
  if (++node_pairs_ > budget_) return Answer::Undecided;
  const Node& x = a_.body->nodes[std::size_t(pair.a)];
  const Node& y = b_.body->nodes[std::size_t(pair.b)];
  const auto proven = [&] {
    if (front != nullptr) front->push_back(pair);
    return Answer::Proven;
  };
  Slack best = slack(w, x, y, pair.direction);
  if (best.ends > best.sag) return proven();
  const double middle = w.a.begin + w.length() / 2;
  const Pose X = a_.segment->pose(middle);
  const Pose Y = b_.segment->pose(middle);
  Vec guess = pair.direction.n;
  if (pair.direction.frame == Frame::A) guess = X.R * guess;
  if (pair.direction.frame == Frame::B) guess = Y.R * guess;
  const PosedNode x_then = w.a.at(x, X, middle);
  const PosedNode y_then = w.b.at(y, Y, middle);
  const Nearest nearest = nearest_direction(x_then, y_then, guess);
  if (nearest.distance > 0) {
    const Vec found = (1 / norm(nearest.direction)) * nearest.direction;
    if (improve(w, x, y, found, best, pair.direction) && best.ends > best.sag) return proven();
  }
  // Only the motion in between is in the way: halve the time. Else open the larger node.
  const bool are_leaves = x.is_leaf() && y.is_leaf();
  if (!(best.ends > 0) && !are_leaves) return open(w, pair, halvings, front);
  if (are_leaves && (refute(w.a.at_first(x), w.b.at_first(y), w.a.begin, guess) ||
                     refute(x_then, y_then, middle, guess) ||
                     refute(w.a.at_last(x), w.b.at_last(y), w.a.end, guess))) {
    return Answer::Refuted;
  }
  const Answer answer = halve(w, middle, pair, halvings);
  return answer == Answer::Proven ? proven() : answer;
}

Answer PairProver::halve(const Window& w, double middle, const NodePair& pair, int halvings) {
  if (halvings >= kMostHalvings || !(w.a.begin < middle && middle < w.a.end))
    return Answer::Undecided;
  const Window first{part(w.a, w.a.begin, middle), part(w.b, w.a.begin, middle)};
  const Answer answer = prove(first, pair, halvings + 1, nullptr);
  if (answer != Answer::Proven) return answer;
  const Window second{part(w.a, middle, w.a.end), part(w.b, middle, w.a.end)};
  return prove(second, pair, halvings + 1, nullptr);
}

Answer PairProver::open(const Window& w, const NodePair& pair, int halvings,
                        std::vector<NodePair>* front) {
  const Node& x = a_.body->nodes[std::size_t(pair.a)];
  const Node& y = b_.body->nodes[std::size_t(pair.b)];
  const bool opens_a = !x.is_leaf() && (y.is_leaf() || norm(x.half) >= norm(y.half));
  for (std::int32_t child = 0; child < 2; ++child) {
    NodePair inner = pair;
    (opens_a ? inner.a : inner.b) = (opens_a ? x.left : y.left) + child;
    const Answer answer = prove(w, inner, halvings, front);
    if (answer != Answer::Proven) return answer;
  }
  return Answer::Proven;
}

Answer Front::prove(PairProver& prover) {
  if (proofs_++ % kFreshStart == 0) pairs_ = {{0, 0, pairs_.front().direction}};
  const Answer answer = prover.prove(pairs_);
  if (answer != Answer::Proven) proofs_ = 0;
  return answer;
}

}  // namespace dyop_check
