// SPDX-License-Identifier: BSD-3-Clause
#include "check/kernel.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace dyop_check {

// A body at the ends of an interval, and how it moves in between.
struct Passage {
  Pose begin;
  Pose end;
  Acceleration most;
  Velocity velocity;  // at the beginning
  double skew = 0;    // by how much its rotations are none
};

namespace {

constexpr int kMostHalvings = 48;
constexpr double kRounded = 1e-9;  // literal: more than the rounding of velocities, relative

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

Passage passage_of(const Side& side, double begin, double end) {
  const Segment& g = *side.segment;
  return {g.pose(begin), g.pose(end), acceleration(g, begin, end), g.velocity(begin), g.skew};
}

Vec point_velocity(const Passage& body, const Vec& p_W) {
  return body.velocity.v + cross(body.velocity.w, p_W - body.begin.p);
}

}  // namespace

// Both bodies over an interval.
struct PairProver::Window {
  double begin = 0;
  double end = 0;
  Passage a, b;
};

struct PairProver::Slack {
  double ends = 0;  // the smaller gap at an end, above the target
  double sag = 0;   // that the motion in between may take from it
  double least() const { return ends - sag; }
};

PairProver::PairProver(const Side& a, const Side& b, double target, std::int64_t budget)
    : a_(a), b_(b), target_(target), budget_(budget) {}

PairProver::Window PairProver::window(double begin, double end) const {
  return {begin, end, passage_of(a_, begin, end), passage_of(b_, begin, end)};
}

// The gap of two nodes along the unit vector n, at the poses given.
double PairProver::gap(const Node& x, const Node& y, const Pose& X, const Pose& Y,
                       const Vec& n) const {
  return -support(*b_.body, y, Y, -1.0 * n) - support(*a_.body, x, X, n);
}

PairProver::Slack PairProver::slack(const Window& w, const Node& x, const Node& y,
                                    const Direction& d) const {
  if (d.frame != Frame::World) return turning_slack(w, x, y, d);
  const double h = w.end - w.begin;
  const double sum =
      w.a.most.center + w.a.most.turn * x.reach + w.b.most.center + w.b.most.turn * y.reach;
  const double lowest =
      std::min(gap(x, y, w.a.begin, w.b.begin, d.n), gap(x, y, w.a.end, w.b.end, d.n));
  return {lowest - target_ - noise_, h * h / 8 * sum};
}

// With n fixed in the body F. Seen from there, a point of the other body O at d from a point q of F
// accelerates by R^T (d'' - 2 w x d' - w' x d + w x (w x d)), where w is the angular velocity of F.
// For q the centre of F's box is taken, so that d and d' are those near the contact.
PairProver::Slack PairProver::turning_slack(const Window& w, const Node& x, const Node& y,
                                            const Direction& direction) const {
  const bool is_in_a = direction.frame == Frame::A;
  const Passage& F = is_in_a ? w.a : w.b;
  const Passage& O = is_in_a ? w.b : w.a;
  const Node& f = is_in_a ? x : y;
  const Node& o = is_in_a ? y : x;
  // As seen from a body that turns, a half-space's points accelerate without bound.
  if ((is_in_a ? b_ : a_).body->half_space()) return {-kInfinity, 0};
  const double h = w.end - w.begin;
  const double size = norm(o.half);
  const double second = O.most.center + O.most.turn * o.reach + F.most.center + F.most.turn * f.arm;
  const Vec p = O.begin * o.center;
  const Vec q = F.begin * f.center;
  const Vec u = point_velocity(O, p);
  const Vec v = point_velocity(F, q);
  const double rate =
      norm(u - v) + O.most.speed * size + kRounded * (norm(u) + norm(v)) + h * second;
  const double distance = (1 + kRounded) * (norm(p - q) + size) + h * rate;
  const double sum =
      (1 + kRounded + F.skew) * (second + 2 * F.most.speed * rate + F.most.turn * distance);
  const double lowest = std::min(gap(x, y, w.a.begin, w.b.begin, F.begin.R * direction.n),
                                 gap(x, y, w.a.end, w.b.end, F.end.R * direction.n));
  // What the direction is longer than one, and the heights of F change, if R is no rotation.
  const double skewed = 8 * F.skew * (target_ + distance + norm(f.half));
  return {lowest - target_ - noise_ - skewed, h * h / 8 * sum};
}

// Tries a direction that was found in the middle of the interval, fixed in the world and in each of
// the bodies, and keeps the best.
bool PairProver::improve(const Window& w, const Node& x, const Node& y, const Vec& found,
                         Slack& best, Direction& direction) const {
  bool is_better = false;
  const double middle = w.begin + (w.end - w.begin) / 2;
  for (const Frame frame : {Frame::World, Frame::A, Frame::B}) {
    Direction other{found, frame};
    if (frame != Frame::World) {
      const Side& side = frame == Frame::A ? a_ : b_;
      if (side.segment->kind == Segment::Kind::Rest) continue;
      other.n = transposed(side.segment->pose(middle).R, found);
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

Nearest PairProver::search(const Node& x, const Node& y, const Pose& X, const Pose& Y,
                           const Vec& guess) const {
  // Of a half-space and a convex piece the gap along the normal is their distance.
  const auto along = [&](const Vec& n) {
    const double distance = std::max(0.0, gap(x, y, X, Y, n));
    return Nearest{(distance > 0 ? distance : 1) * n, distance};
  };
  if (const Piece* plane = a_.body->half_space()) return along(X.R * plane->normal);
  if (const Piece* plane = b_.body->half_space()) return along(-1.0 * (Y.R * plane->normal));
  return nearest_direction(
      [&](const Vec& d) {
        return support_point(*b_.body, y, Y, d) - support_point(*a_.body, x, X, -1.0 * d);
      },
      guess);
}

// Is the pair nearer than its target at a time? Then the distance of two of its points shows it.
bool PairProver::refute(const Node& x, const Node& y, double t, const Pose& X, const Pose& Y,
                        const Vec& n) {
  const Nearest nearest = search(x, y, X, Y, n);
  const bool they_meet = !(nearest.distance > 0);
  if (!they_meet && !(nearest.distance + noise_ < target_)) return false;
  refuted_at_ = t;
  refuted_distance_ = nearest.distance;
  return true;
}

Answer PairProver::prove(double begin, double end, std::vector<NodePair>& front) {
  // The direction of a half-space is turned twice.
  const double turns = a_.body->half_space() || b_.body->half_space() ? 2 : 1;
  noise_ = turns * (pose_noise(*a_.segment, a_.body->size, begin, end) +
                    pose_noise(*b_.segment, b_.body->size, begin, end));
  const Window w = window(begin, end);
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
  const double middle = w.begin + (w.end - w.begin) / 2;
  const Pose X = a_.segment->pose(middle);
  const Pose Y = b_.segment->pose(middle);
  Vec guess = pair.direction.n;
  if (pair.direction.frame == Frame::A) guess = X.R * guess;
  if (pair.direction.frame == Frame::B) guess = Y.R * guess;
  const Nearest nearest = search(x, y, X, Y, guess);
  if (nearest.distance > 0) {
    const Vec found = (1 / nearest.distance) * nearest.direction;
    if (improve(w, x, y, found, best, pair.direction) && best.ends > best.sag) return proven();
  }
  // Only the motion in between is in the way: halve the time. Else open the larger node.
  const bool are_leaves = x.is_leaf() && y.is_leaf();
  if (!(best.ends > 0) && !are_leaves) return open(w, pair, halvings, front);
  if (are_leaves &&
      (refute(x, y, w.begin, w.a.begin, w.b.begin, guess) || refute(x, y, middle, X, Y, guess) ||
       refute(x, y, w.end, w.a.end, w.b.end, guess))) {
    return Answer::Refuted;
  }
  const Answer answer = halve(w, middle, pair, halvings);
  return answer == Answer::Proven ? proven() : answer;
}

Answer PairProver::halve(const Window& w, double middle, const NodePair& pair, int halvings) {
  if (halvings >= kMostHalvings || !(w.begin < middle && middle < w.end)) return Answer::Undecided;
  const Answer first = prove(window(w.begin, middle), pair, halvings + 1, nullptr);
  if (first != Answer::Proven) return first;
  return prove(window(middle, w.end), pair, halvings + 1, nullptr);
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

}  // namespace dyop_check
