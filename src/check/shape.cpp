// SPDX-License-Identifier: BSD-3-Clause
#include "check/shape.h"

#include <cmath>
#include <limits>
#include <numeric>

namespace dyop_check {
namespace {

Vec round_support(const Piece& piece, const Vec& d) {
  const Vec& s = piece.size;
  const double flat = std::hypot(d.x, d.y);
  switch (piece.kind) {
    case Piece::Kind::Cylinder: {
      const double k = flat > 0 ? s.x / flat : 0;
      return {k * d.x, k * d.y, d.z >= 0 ? s.z : -s.z};
    }
    case Piece::Kind::Cone: {
      const double k = flat > 0 ? s.x / flat : 0;
      const Vec rim{k * d.x, k * d.y, -s.z};
      const Vec tip{0, 0, s.z};
      return dot(rim, d) > dot(tip, d) ? rim : tip;
    }
    case Piece::Kind::Ellipsoid: {
      const Vec scaled{s.x * d.x, s.y * d.y, s.z * d.z};
      const double k = norm(scaled);
      if (!(k > 0)) return {};
      return {s.x * scaled.x / k, s.y * scaled.y / k, s.z * scaled.z / k};
    }
    case Piece::Kind::TaperedCapsule: {
      const double length = norm(d);
      if (!(length > 0)) return {};
      const bool is_top = s.z * d.z + s.y * length > s.x * length - s.z * d.z;
      return Vec{0, 0, is_top ? s.z : -s.z} + ((is_top ? s.y : s.x) / length) * d;
    }
    case Piece::Kind::Points:
    case Piece::Kind::HalfSpace:
      break;
  }
  return {};
}

struct Box {
  Vec low{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
          std::numeric_limits<double>::infinity()};
  Vec high{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
           -std::numeric_limits<double>::infinity()};

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

double along(const Vec& v, int axis) {
  return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

class TreeBuilder {
 public:
  TreeBuilder(Body& body, const Vec& center_of_mass) : body_(body), com_(center_of_mass) {
    for (const Piece& piece : body.pieces) boxes_.push_back(box_of(piece));
    order_.resize(boxes_.size());
    std::iota(order_.begin(), order_.end(), 0);
  }

  void build() {
    body_.nodes.assign(1, {});
    fill(0, 0, order_.size());
  }

 private:
  // Splits at the median of the longest side, so that the depth is logarithmic.
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
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::size_t middle = begin + (end - begin) / 2;
    const auto first = order_.begin();
    std::nth_element(first + std::ptrdiff_t(begin), first + std::ptrdiff_t(middle),
                     first + std::ptrdiff_t(end), [&](std::size_t a, std::size_t b) {
                       return along(boxes_[a].low + boxes_[a].high, axis) <
                              along(boxes_[b].low + boxes_[b].high, axis);
                     });
    const std::size_t left = body_.nodes.size();
    body_.nodes[node].left = std::int32_t(left);
    body_.nodes.resize(left + 2);
    fill(left, begin, middle);
    fill(left + 1, middle, end);
  }

  void set_box(Node& node, const Box& box) const {
    node.center = 0.5 * (box.low + box.high);
    const Vec a = box.high - node.center;
    const Vec b = node.center - box.low;
    node.half = kUp * Vec{std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
    const Vec off = node.center - com_;
    node.arm = kUp * norm(off);
    node.reach = kUp * norm({std::abs(off.x) + node.half.x, std::abs(off.y) + node.half.y,
                             std::abs(off.z) + node.half.z});
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

}  // namespace

Vec Piece::core_support(const Vec& d) const {
  if (kind != Kind::Points) return X * round_support(*this, transposed(X.R, d));
  const Vec* best = &points.front();
  double most = dot(*best, d);
  for (const Vec& point : points) {
    const double value = dot(point, d);
    if (value > most) {
      most = value;
      best = &point;
    }
  }
  return *best;
}

// Infinite but along the normal, up to the rounding of a direction that was turned twice.
double Piece::half_space_support(const Vec& d) const {
  constexpr double kTurned = 4e-15;  // literal: relative
  const double length = norm(d);
  if (norm(d - length * normal) <= kTurned * length) return offset * length;
  return std::numeric_limits<double>::infinity();
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
  TreeBuilder(*this, center_of_mass).build();
  const Node& top = nodes.front();
  size = kUp * norm({std::abs(top.center.x) + top.half.x, std::abs(top.center.y) + top.half.y,
                     std::abs(top.center.z) + top.half.z});
}

}  // namespace dyop_check
