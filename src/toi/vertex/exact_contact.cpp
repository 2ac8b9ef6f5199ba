// SPDX-License-Identifier: BSD-3-Clause
#include "toi/vertex/exact_contact.h"

#include <algorithm>
#include <limits>

#include "exact/polynomial.h"

namespace dyop::toi_internal {
namespace {

// A vector whose coordinates are polynomials of time, 0 at the start and 1 at the end.
using ExactVector = std::array<ExactPolynomial, 3>;

using FourPaths = std::array<VertexPath, 4>;

ExactVector operator-(const ExactVector& x, const ExactVector& y) {
  return {x[0] - y[0], x[1] - y[1], x[2] - y[2]};
}

ExactPolynomial exact_dot(const ExactVector& x, const ExactVector& y) {
  return x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
}

ExactPolynomial cross_component(const ExactVector& x, const ExactVector& y, std::size_t axis) {
  const std::size_t next = (axis + 1) % 3;
  const std::size_t last = (axis + 2) % 3;
  return x[next] * y[last] - x[last] * y[next];
}

ExactVector cross(const ExactVector& x, const ExactVector& y) {
  return {cross_component(x, y, 0), cross_component(x, y, 1), cross_component(x, y, 2)};
}

// All coordinates as integers in one common unit, a power of two.
std::array<ExactVector, 4> to_whole_numbers(const FourPaths& paths) {
  int unit = std::numeric_limits<int>::max();
  for (const VertexPath& path : paths) {
    for (int axis = 0; axis < 3; ++axis) {
      if (path.begin[axis] != 0) unit = std::min(unit, lowest_exponent(path.begin[axis]));
      if (path.end[axis] != 0) unit = std::min(unit, lowest_exponent(path.end[axis]));
    }
  }
  std::array<ExactVector, 4> points;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto row = static_cast<Eigen::Index>(axis);
      const BigInteger begin = BigInteger::from_scaled(paths[i].begin[row], unit);
      points[i][axis].c[0] = begin;
      points[i][axis].c[1] = BigInteger::from_scaled(paths[i].end[row], unit) - begin;
    }
  }
  return points;
}

// The instant 0, as a root of the zero polynomial.
ExactRoot begin_instant() {
  ExactRoot root;
  root.numerator = 0;
  return root;
}

// A moving point and a moving segment pq: the point x is on the segment where (q - p) x (x - p) = 0
// and (x - p).(x - q) <= 0. For p = q the second condition alone means x = p.
class VertexOnEdge {
 public:
  VertexOnEdge(const ExactVector& x, const ExactVector& p, const ExactVector& q)
      : off_line_(cross(q - p, x - p)), beyond_ends_(exact_dot(x - p, x - q)) {}

  bool holds_at(const ExactPolynomial& polynomial, ExactRoot& root) const {
    for (const ExactPolynomial& component : off_line_) {
      if (sign_at(component, polynomial, root) != 0) return false;
    }
    return sign_at(beyond_ends_, polynomial, root) <= 0;
  }

  bool holds_at_some_time() const {
    for (const ExactPolynomial& component : off_line_) {
      if (component.is_zero()) continue;
      for (ExactRoot& root : roots_in_unit_interval(component)) {
        if (holds_at(component, root)) return true;
      }
      return false;
    }
    return is_between_at_some_time();
  }

 private:
  // Always on the line: is the quadratic w0 + w1 s + w2 s^2 at most zero somewhere in [0, 1]?
  bool is_between_at_some_time() const {
    const auto& [w0, w1, w2, unused] = beyond_ends_.c;
    if (w0.sign() <= 0 || (w0 + w1 + w2).sign() <= 0) return true;
    const bool has_least_value_inside = w2.sign() > 0 && w1.sign() < 0 && (w1 + 2 * w2).sign() > 0;
    return has_least_value_inside && (w1 * w1 - 4 * (w2 * w0)).sign() >= 0;
  }

  ExactVector off_line_;
  ExactPolynomial beyond_ends_;
};

// What the two kinds of pair share. Where the four points are coplanar and the normal n of the pair
// is not zero, one coordinate of cross products decides sides; where it is zero, and for pairs that
// are coplanar at all times, contact is contact of a vertex with an edge.
template <typename Pair>
bool has_contact_of(const Pair& pair) {
  const ExactPolynomial coplanar = exact_dot(pair.normal, pair.offset);
  if (!coplanar.is_zero()) {
    for (ExactRoot& root : roots_in_unit_interval(coplanar)) {
      if (pair.meets_at(coplanar, root)) return true;
    }
    return false;
  }
  ExactRoot begin = begin_instant();
  if (pair.meets_at(coplanar, begin)) return true;
  // The first contact of a pair that stays in one plane involves the border of a triangle or the
  // end of an edge: a crossing of interiors would have started before.
  const auto edges = pair.vertices_and_edges();
  return std::any_of(edges.begin(), edges.end(),
                     [](const VertexOnEdge& edge) { return edge.holds_at_some_time(); });
}

template <typename Pair>
bool meets_somewhere_at(const Pair& pair, const ExactPolynomial& polynomial, ExactRoot& root) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int sign = sign_at(pair.normal[axis], polynomial, root);
    if (sign != 0) return pair.meets_in_projection(polynomial, root, axis, sign);
  }
  const auto edges = pair.vertices_and_edges();
  return std::any_of(edges.begin(), edges.end(),
                     [&](const VertexOnEdge& edge) { return edge.holds_at(polynomial, root); });
}

struct ExactVertexFace {
  explicit ExactVertexFace(const std::array<ExactVector, 4>& points)
      : v(points[0]),
        f{points[1], points[2], points[3]},
        normal(cross(f[1] - f[0], f[2] - f[0])),
        offset(v - f[0]) {}

  bool meets_at(const ExactPolynomial& polynomial, ExactRoot& root) const {
    return meets_somewhere_at(*this, polynomial, root);
  }

  // v is on the inner side of all three edges.
  bool meets_in_projection(const ExactPolynomial& polynomial, ExactRoot& root, std::size_t axis,
                           int normal_sign) const {
    for (std::size_t i = 0; i < 3; ++i) {
      const ExactPolynomial side = cross_component(f[(i + 1) % 3] - f[i], v - f[i], axis);
      if (sign_at(side, polynomial, root) * normal_sign < 0) return false;
    }
    return true;
  }

  std::vector<VertexOnEdge> vertices_and_edges() const {
    return {{v, f[0], f[1]}, {v, f[1], f[2]}, {v, f[2], f[0]}};
  }

  ExactVector v;
  std::array<ExactVector, 3> f;
  ExactVector normal;
  ExactVector offset;
};

struct ExactEdgeEdge {
  explicit ExactEdgeEdge(const std::array<ExactVector, 4>& points)
      : a{points[0], points[1]},
        b{points[2], points[3]},
        normal(cross(a[1] - a[0], b[1] - b[0])),
        offset(b[0] - a[0]) {}

  bool meets_at(const ExactPolynomial& polynomial, ExactRoot& root) const {
    return meets_somewhere_at(*this, polynomial, root);
  }

  // The ends of either edge are not on the same side of the other.
  bool meets_in_projection(const ExactPolynomial& polynomial, ExactRoot& root, std::size_t axis,
                           int /*normal_sign*/) const {
    const auto is_split = [&](const auto& edge, const auto& ends) {
      const ExactVector along = edge[1] - edge[0];
      const int first = sign_at(cross_component(along, ends[0] - edge[0], axis), polynomial, root);
      return first == 0 ||
             first * sign_at(cross_component(along, ends[1] - edge[0], axis), polynomial, root) <=
                 0;
    };
    return is_split(a, b) && is_split(b, a);
  }

  std::vector<VertexOnEdge> vertices_and_edges() const {
    return {{a[0], b[0], b[1]}, {a[1], b[0], b[1]}, {b[0], a[0], a[1]}, {b[1], a[0], a[1]}};
  }

  std::array<ExactVector, 2> a;
  std::array<ExactVector, 2> b;
  ExactVector normal;
  ExactVector offset;
};

}  // namespace

bool has_contact(const VertexFacePaths& paths) {
  return has_contact_of(ExactVertexFace(
      to_whole_numbers({paths.vertex, paths.face[0], paths.face[1], paths.face[2]})));
}

bool has_contact(const EdgeEdgePaths& paths) {
  return has_contact_of(ExactEdgeEdge(
      to_whole_numbers({paths.edge_a[0], paths.edge_a[1], paths.edge_b[0], paths.edge_b[1]})));
}

}  // namespace dyop::toi_internal
