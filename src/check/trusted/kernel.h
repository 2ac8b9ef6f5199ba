// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "check/trusted/motion.h"
#include "check/trusted/shape.h"

/// Proofs that two bodies keep a distance over an interval of time. TRUSTED; which directions are
/// tried, and what is split, needs no trust.
///
/// The kernel. Take a node of A and one of B, an interval [t0, t1] of length h throughout which both
/// bodies follow one segment each, and any unit vector n. The height n.x(t) of a point that
/// accelerates by at most a stays above the chord between its heights at t0 and t1 less h^2 a / 8.
/// So if, at both ends, the lowest point of B is higher along n than the highest point of A by more
/// than the distance plus h^2 / 8 times the sum of the largest accelerations of both nodes, then no
/// two points of the nodes come nearer than the distance at any time between.
///
/// The same holds if n is fixed in one of the bodies: then the heights of its own points above a
/// point of it do not change, and what accelerates is the other body as seen from there. Bodies
/// that roll, slide or rest on each other's faces need it.
///
/// The corners of a surface that deforms move on lines, at constant rates: they do not accelerate,
/// and the first of these holds.
namespace dyop_check {

/// A node of a body at a pose, and of a surface that deforms at a part of its way.
struct PosedNode {
  const Body* body = nullptr;
  const Node* node = nullptr;
  const Pose* X = nullptr;
  double part = 0;
};

/// A body over an interval in which it follows one segment.
struct Passage {
  const Body* body = nullptr;
  const Segment* segment = nullptr;
  double begin = 0;
  double end = 0;
  Pose first;  ///< at the ends
  Pose last;
  Bounds most;
  double noise = 0;  ///< of its poses

  PosedNode at_first(const Node& node) const { return at(node, first, begin); }
  PosedNode at_last(const Node& node) const { return at(node, last, end); }
  PosedNode at(const Node& node, const Pose& X, double t) const {
    return {body, &node, &X, segment->part(t)};
  }
};

Passage passage(const Body& body, const Segment& segment, double begin, double end);

/// The least height of b along n above the greatest of a.
double gap(const PosedNode& a, const PosedNode& b, const Vec& n);

enum class Frame { World, A, B };

/// A unit vector from A to B, fixed in a frame.
struct Direction {
  Vec n{1, 0, 0};
  Frame frame = Frame::World;
};

/// Nodes of both trees, and the direction that served them last.
struct NodePair {
  std::int32_t a = 0;
  std::int32_t b = 0;
  Direction direction;
};

enum class Answer { Proven, Refuted, Undecided };

/// One pair of bodies over an interval.
class PairProver {
 public:
  /// @param a, b Over the same interval.
  /// @param budget Pairs of nodes to try before it is undecided.
  PairProver(const Passage& a, const Passage& b, double target, std::int64_t budget);

  /// @param front Pairs of nodes that together cover both trees, as an earlier proof left them; the
  ///              pair of roots is one. Becomes those of this proof, if it succeeds.
  Answer prove(std::vector<NodePair>& front);

  std::int64_t node_pairs() const { return node_pairs_; }
  double refuted_at() const { return refuted_at_; }
  /// That of two points of the bodies then.
  double refuted_distance() const { return refuted_distance_; }

 private:
  struct Window;
  struct Slack;
  Slack slack(const Window& w, const Node& x, const Node& y, const Direction& direction) const;
  Slack turning_slack(const Window& w, const Node& x, const Node& y, const Direction& d) const;
  bool improve(const Window& w, const Node& x, const Node& y, const Vec& found, Slack& best,
               Direction& direction) const;
  bool refute(const PosedNode& x, const PosedNode& y, double t, const Vec& guess);
  Answer prove(const Window& w, NodePair pair, int halvings, std::vector<NodePair>* front);
  Answer halve(const Window& w, double middle, const NodePair& pair, int halvings);
  Answer open(const Window& w, const NodePair& pair, int halvings, std::vector<NodePair>* front);

  const Passage& a_;
  const Passage& b_;
  double target_;
  double noise_;
  std::int64_t budget_;
  std::int64_t node_pairs_ = 0;
  double refuted_at_ = 0;
  double refuted_distance_ = 0;
};

/// A pair of bodies, from one interval to the next.
class Front {
 public:
  /// Tries the pairs of nodes that proved the last interval first.
  Answer prove(PairProver& prover);

 private:
  std::vector<NodePair> pairs_{NodePair{}};
  int proofs_ = 0;
};

}  // namespace dyop_check
