// SPDX-License-Identifier: BSD-3-Clause
#include "check/trusted/shape.h"

#include <numeric>

namespace dyop_check {
namespace {

// The point of a round core, in its own frame.
Vec round_support(const Piece& piece, const Vec& d) {
  const Vec& s = piece.size;
  if (piece.kind == Piece::Kind::Ellipsoid) {
    const Vec scaled{s.x * d.x, s.y * d.y, s.z * d.z};
    const double k = norm(scaled) > 0 ? 1 / norm(scaled) : 0;
    return k * Vec{s.x * scaled.x, s.y * scaled.y, s.z * scaled.z};
  }
  // Of a disc the point of the rim, of a ball that along d.
  const bool is_ball = piece.kind == Piece::Kind::Balls;
  const Vec along{d.x, d.y, is_ball ? d.z : 0};
  const double k = norm(along) > 0 ? 1 / norm(along) : 0;
  const Vec below = (s.x * k) * along - Vec{0, 0, s.z};
  const Vec above = (s.y * k) * along + Vec{0, 0, s.z};
  return dot(above, d) > dot(below, d) ? above : below;
}

// Its normal, when it was turned into the world and back, differs from itself by rounding.
double half_space_support(const Piece& piece, const Vec& d) {
  constexpr double kTurned = 4e-15;  // literal: relative
  const double length = norm(d);
  return norm(d - length * piece.normal) <= kTurned * length ? piece.offset * length : kInfinity;
}

struct Box {
  Vec low{kInfinity, kInfinity, kInfinity};
  Vec high{-kInfinity, -kInfinity, -kInfinity};

  Vec center() const { return 0.5 * (low + high); }
  // Of the box about center().
  Vec half() const {
    const Vec a = high - center();
    const Vec b = center() - low;
    return kUp * Vec{std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
  }
  void add(const Vec& p) { add(Box{p, p}); }
  void add(const Box& other) {
    low = {std::min(low.x, other.low.x), std::min(low.y, other.low.y),
           std::min(low.z, other.low.z)};
    high = {std::max(high.x, other.high.x), std::max(high.y, other.high.y),
            std::max(high.z, other.high.z)};
  }
};

Box box_of(const Piece& piece) {
  return {{-piece.support({-1, 0, 0}), -piece.support({0, -1, 0}), -piece.support({0, 0, -1})},
          {piece.support({1, 0, 0}), piece.support({0, 1, 0}), piece.support({0, 0, 1})}};
}

class TreeBuilder {
 public:
  TreeBuilder(Body& body, const Vec& center_of_mass)
      : body_(body), com_(center_of_mass), order_(body.pieces.size()) {
    for (const Piece& piece : body.pieces) boxes_.push_back(box_of(piece));
    std::iota(order_.begin(), order_.end(), 0);
    body_.nodes.assign(1, {});
    fill(0, 0, order_.size());
  }

 private:
  // The node of pieces order_[begin] to order_[end - 1]. Splits at the median of the longest side,
  // so that the depth is logarithmic.
  void fill(std::size_t node, std::size_t begin, std::size_t end) {
    Box box;
    for (std::size_t i = begin; i < end; ++i) box.add(boxes_[order_[i]]);
    set_box(body_.nodes[node], box);
    if (node == 0) body_.reach = body_.nodes[0].reach;
    if (end - begin == 1) {
      body_.nodes[node].piece = std::int32_t(order_[begin]);
      set_core_reach(body_.nodes[node], body_.pieces[order_[begin]]);
      return;
    }
    const Vec size = box.high - box.low;
    const Vec axis = size.x >= size.y && size.x >= size.z ? Vec{1, 0, 0}
                     : size.y >= size.z                   ? Vec{0, 1, 0}
                                                          : Vec{0, 0, 1};
    const auto height = [&](std::size_t k) { return dot(boxes_[k].low + boxes_[k].high, axis); };
    const std::size_t middle = begin + (end - begin) / 2;
    const auto at = [&](std::size_t k) { return order_.begin() + std::ptrdiff_t(k); };
    std::nth_element(at(begin), at(middle), at(end),
                     [&](std::size_t a, std::size_t b) { return height(a) < height(b); });
    const std::size_t left = body_.nodes.size();
    body_.nodes[node].left = std::int32_t(left);
    body_.nodes.resize(left + 2);
    fill(left, begin, middle);
    fill(left + 1, middle, end);
  }

  void set_box(Node& node, const Box& box) const {
    node.center = box.center();
    node.half = box.half();
    const Vec off = node.center - com_;
    node.arm = kUp * norm(off);
    node.reach = kUp * norm(absolute(off) + node.half);
  }

  void set_core_reach(Node& node, const Piece& piece) const {
    if (piece.kind != Piece::Kind::Points) return;
    node.reach = 0;
    for (const Vec& point : piece.points)
      node.reach = std::max(node.reach, kUp * norm(point - com_));
  }

  Body& body_;
  Vec com_;
  std::vector<Box> boxes_;
  std::vector<std::size_t> order_;
};

// Boxes at the start and at the end of all that is below a node. A point that is in one box at first
// and in another one at last is at any part of its way in the box whose centre and size are at that
// part of theirs.
std::pair<Box, Box> fit_boxes(Body& body, const std::vector<Vec>& to, std::size_t number) {
  Node& node = body.nodes[number];
  Box first;
  Box last;
  for (std::size_t k = 0; k < 3 && node.is_leaf(); ++k) {
    const auto corner = std::size_t(body.corners[3 * std::size_t(node.piece) + k]);
    first.add(body.from[corner]);
    last.add(to[corner]);
  }
  for (std::size_t k = 0; k < 2 && !node.is_leaf(); ++k) {
    const auto [child_first, child_last] = fit_boxes(body, to, std::size_t(node.left) + k);
    first.add(child_first);
    last.add(child_last);
  }
  node.center = first.center();
  node.half = first.half();
  body.box_moves[number] = {last.center() - node.center, last.half() - node.half};
  return {first, last};
}

}  // namespace

Vec Piece::core_support(const Vec& d) const {
  if (kind != Kind::Points) return X * round_support(*this, transposed(X.R, d));
  const Vec* best = &points.front();
  double most = dot(*best, d);
  for (const Vec& point : points) {
    const double height = dot(point, d);
    if (height > most) {
      most = height;
      best = &point;
    }
  }
  return *best;
}

double Piece::support(const Vec& d) const {
  if (kind == Kind::HalfSpace) return half_space_support(*this, d);
  return dot(core_support(d), d) + radius * norm(d);
}

Vec Body::core_support(const Node& leaf, const Vec& d, double part) const {
  const auto number = std::size_t(leaf.piece);
  if (!deforms()) return pieces[number].core_support(d);
  const auto place = [&](std::size_t k) {
    const auto corner = std::size_t(corners[3 * number + k]);
    return from[corner] + part * moves[corner];
  };
  const Vec a = place(0);
  const Vec b = place(1);
  const Vec c = place(2);
  const Vec& ab = dot(b, d) > dot(a, d) ? b : a;
  return dot(c, d) > dot(ab, d) ? c : ab;
}

double Body::deformed_support(const Node& node, const Vec& d, double part) const {
  if (node.is_leaf()) return dot(core_support(node, d, part), d);
  const NodeBox at = box(node, part);
  return dot(d, at.center) + dot(absolute(d), at.half);
}

void Body::build(const Vec& center_of_mass) {
  if (half_space()) {
    // No turn is small beside its reach, and no other body is out of it.
    constexpr double kEverywhere = 1e300;  // literal: times zero is zero
    reach = kEverywhere;
    size = std::abs(half_space()->offset);
    Node node;
    node.reach = kEverywhere;
    node.arm = kUp * norm(center_of_mass);
    node.piece = 0;
    nodes.assign(1, node);
    return;
  }
  TreeBuilder(*this, center_of_mass);
  const Node& top = nodes.front();
  size = kUp * norm(absolute(top.center) + top.half);
}

void Body::deform(std::vector<Vec> places, const std::vector<Vec>& to) {
  from = std::move(places);
  moves.clear();
  for (std::size_t k = 0; k < from.size(); ++k) moves.push_back(to[k] - from[k]);
  box_moves.resize(nodes.size());
  const auto [first, last] = fit_boxes(*this, to, 0);
  size = 0;
  for (const Box& top : {first, last})
    size = std::max(size, kUp * norm(absolute(top.center()) + top.half()));
}

}  // namespace dyop_check
