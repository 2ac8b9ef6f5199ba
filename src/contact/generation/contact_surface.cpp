// SPDX-License-Identifier: BSD-3-Clause
#include "contact/generation/contact_surface.h"

#include <algorithm>
#include <cmath>

#include "core/tolerance.h"

namespace dyop::contact_internal {
namespace {

// If a triangle's normal is longer than this, relative to the product of two sides, rounding moves
// its plane by less than kPlaneSlack times the distance from its corner.
constexpr Scalar kLeastNormalSine = 1.0 / (1 << 20);
constexpr Scalar kPlaneSlack = kLeastNormalSine * kLeastNormalSine;

// The nearest point on the three sides and corners.
TriangleFoot border_foot(const Triangle& t, const Vector3& p) {
  TriangleFoot best;
  Scalar best_sq = kInfinity;
  for (int k = 0; k < 3; ++k) {
    const int next = k < 2 ? k + 1 : 0;
    const Vector3& from = t[std::size_t(k)];
    const Vector3 along = t[std::size_t(next)] - from;
    const Scalar length_sq = along.squaredNorm();
    const Scalar s = length_sq > 0 ? along.dot(p - from) / length_sq : 0;
    TriangleFoot foot;
    if (s > 0 && s < 1) {
      foot.kind = foot.place = FeatureKind::Edge;
      foot.index = k;
      foot.point = from + s * along;
    } else {
      foot.kind = foot.place = FeatureKind::Vertex;
      foot.index = s > 0 ? next : k;
      foot.point = t[std::size_t(foot.index)];
    }
    const Scalar distance_sq = (p - foot.point).squaredNorm();
    if (!(distance_sq < best_sq)) continue;
    best_sq = distance_sq;
    best = foot;
  }
  return best;
}

}  // namespace

std::optional<TriangleFoot> find_foot(const Triangle& t, const Vector3& p, Scalar reach,
                                      Scalar border_sine, Scalar noise) {
  const Vector3 e = t[1] - t[0];
  const Vector3 f = t[2] - t[0];
  const Vector3 r = p - t[0];
  const Vector3 n = e.cross(f);
  const Scalar n_sq = n.squaredNorm();
  const bool has_plane =
      n_sq > kLeastNormalSine * kLeastNormalSine * e.squaredNorm() * f.squaredNorm();
  Scalar height = 0;
  TriangleFoot foot;
  if (has_plane) {
    const Scalar length = std::sqrt(n_sq);
    height = n.dot(r) / length;
    if (std::abs(height) > reach + kPlaneSlack * r.norm()) return std::nullopt;
    foot.is_outer = height >= 0;
    foot.normal = foot.is_outer ? Vector3(n / length) : Vector3(-n / length);
    const Scalar u = r.cross(f).dot(n);
    const Scalar v = e.cross(r).dot(n);
    if (u >= 0 && v >= 0 && u + v <= n_sq) {
      foot.point = t[0] + (u / n_sq) * e + (v / n_sq) * f;
      return foot;
    }
  }
  const TriangleFoot border = border_foot(t, p);
  const Vector3 w = p - border.point;
  const Scalar distance_sq = w.squaredNorm();
  if (distance_sq > reach * reach) return std::nullopt;
  const Scalar lateral_sq = (w - std::abs(height) * foot.normal).squaredNorm();
  const Scalar slack = border_sine * std::abs(height) + noise;
  if (!has_plane || lateral_sq > slack * slack) return border;
  foot.place = border.place;
  foot.index = border.index;
  foot.point = border.point;
  return foot;
}

std::optional<EdgeCrossing> find_crossing(const Vector3& a0, const Vector3& a1, const Vector3& b0,
                                          const Vector3& b1, Scalar reach, Scalar noise) {
  const Vector3 e = a1 - a0;
  const Vector3 f = b1 - b0;
  const Vector3 r = b0 - a0;
  const Vector3 n = e.cross(f);
  const Scalar n_sq = n.squaredNorm();
  const Scalar height = n.dot(r);
  // Slightly farther than reach: the bounds decide.
  if (height * height > 1.0625 * reach * reach * n_sq) return std::nullopt;
  const Scalar e_sq = e.squaredNorm();
  const Scalar f_sq = f.squaredNorm();
  if (!(n_sq > kContactNoCrossingSine * kContactNoCrossingSine * e_sq * f_sq)) return std::nullopt;
  Scalar s = r.cross(f).dot(n) / n_sq;
  Scalar t = r.cross(e).dot(n) / n_sq;
  const Scalar off_a = std::max(-s, s - 1);
  const Scalar off_b = std::max(-t, t - 1);
  if (off_a > 0 && off_a * off_a * e_sq > noise * noise) return std::nullopt;
  if (off_b > 0 && off_b * off_b * f_sq > noise * noise) return std::nullopt;
  s = std::clamp(s, Scalar{0}, Scalar{1});
  t = std::clamp(t, Scalar{0}, Scalar{1});
  const Scalar length = std::sqrt(n_sq);
  return EdgeCrossing{a0 + s * e, b0 + t * f, n / length, length / std::sqrt(e_sq * f_sq)};
}

namespace {

bool rises(const Vector3& ray, const Vector3& n, Scalar sine) {
  const Scalar along = n.dot(ray);
  return along > 0 && along * along > sine * sine * ray.squaredNorm();
}

// Whether some direction between two rays rises by more than `sine`. Between rays at an acute angle
// nothing rises by more than sqrt(2) times the steeper one, so only wide sectors are tested inside.
bool sector_rises(const Vector3& e, const Vector3& f, const Vector3& n, Scalar sine) {
  if (rises(e, n, sine) || rises(f, n, sine)) return true;
  if (e.dot(f) >= 0) return false;
  const Vector3 m = e.cross(f);
  const bool is_within = e.cross(n).dot(m) > 0 && n.cross(f).dot(m) > 0;
  if (!is_within) return false;
  return n.cross(m).squaredNorm() > sine * sine * m.squaredNorm();
}

// Where the steepest path along n on a triangle, from its point p, reaches the border; p itself if
// it leaves the triangle at once.
Vector3 steepest_end(const Triangle& t, const Vector3& p, const Vector3& n) {
  const Vector3 m = (t[1] - t[0]).cross(t[2] - t[0]);
  const Scalar m_sq = m.squaredNorm();
  if (!(m_sq > 0)) return p;
  const Vector3 along = n - m * (n.dot(m) / m_sq);
  Scalar length = kInfinity;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector3 inwards = m.cross(t[(k + 1) % 3] - t[k]);
    const Scalar rate = inwards.dot(along);
    if (rate < 0) length = std::min(length, std::max(Scalar{0}, inwards.dot(t[k] - p) / rate));
  }
  return length < kInfinity ? Vector3(p + length * along) : p;
}

}  // namespace

ContactSurface::ContactSurface(const Shape& shape) {
  if (shape.kind() == ShapeKind::TriangleMesh) {
    mesh = static_cast<const TriangleMesh*>(&shape);
    is_mesh = true;
  } else {
    const auto& convex = static_cast<const ConvexShape&>(shape);
    mesh = convex.core_surface();
    radius = convex.rounding_radius();
    is_solid = mesh != nullptr && mesh->is_closed();
  }
  if (!mesh) return;
  has_parts = mesh->part_vertices().size() > 1;
  features = &mesh->contact_features();
  topology = &mesh->topology();
  vertices_ = mesh->vertices();
  triangles_ = mesh->triangles();
}

bool ContactSurface::admits_at_vertex(std::int32_t vertex, const Vector3& n, Scalar sine,
                                      Scalar noise) const {
  if (vertices_.size() == 1) return true;  // a ball's core
  const Vector3& p = vertices_[std::size_t(vertex)];
  for (const std::int32_t corner : topology->corners_of_vertex(vertex)) {
    const TriangleIndices& t = triangles_[std::size_t(corner / 3)];
    const auto k = std::size_t(corner % 3);
    const Vector3 e = vertices_[std::size_t(t[k < 2 ? k + 1 : 0])] - p;
    const Vector3 f = vertices_[std::size_t(t[k > 0 ? k - 1 : 2])] - p;
    if (sector_rises(e, f, n, sine)) return false;
  }
  return (!has_parts && !features->is_doubtful_vertex(vertex)) || touches_clear(p, n, sine, noise);
}

bool ContactSurface::admits_at_edge(std::int32_t edge, const Vector3& p, const Vector3& n,
                                    Scalar sine, Scalar noise) const {
  const auto& ends = topology->edge(edge);
  const Vector3& from = vertices_[std::size_t(ends[0])];
  const Vector3 along = vertices_[std::size_t(ends[1])] - from;
  const Scalar length_sq = along.squaredNorm();
  if (length_sq > 0) {
    const Scalar lean = n.dot(along) * n.dot(along) / length_sq;
    if (lean > sine * sine) return false;
    for (const std::int32_t side : topology->sides_of_edge(edge)) {
      const TriangleIndices& t = triangles_[std::size_t(side / 3)];
      const auto k = std::size_t(side % 3);
      const Vector3 up = vertices_[std::size_t(t[k > 0 ? k - 1 : 2])] - from;
      const Vector3 leaving = up - along * (along.dot(up) / length_sq);
      const Scalar height_sq = leaving.squaredNorm();
      // Across its longest side, a triangle without area has nothing but rounding.
      if (!(height_sq > kFlatEdgeSine * kFlatEdgeSine * kFlatEdgeSine * kFlatEdgeSine *
                            std::max(length_sq, up.squaredNorm()))) {
        continue;
      }
      const Scalar across = n.dot(leaving);
      if (across > 0 && lean * height_sq + across * across > sine * sine * height_sq) return false;
    }
  }
  return (!has_parts && !features->is_doubtful_edge(edge)) || touches_clear(p, n, sine, noise);
}

bool ContactSurface::admits_at_foot(std::int32_t triangle, const TriangleFoot& foot,
                                    const Vector3& p, const Vector3& n, Scalar sine,
                                    Scalar noise) const {
  switch (foot.place) {
    case FeatureKind::Vertex:
      return admits_at_vertex(indices(triangle)[std::size_t(foot.index)], n, sine, noise);
    case FeatureKind::Edge:
      return admits_at_edge(*topology->edge_of_side(3 * triangle + foot.index), p, n, sine, noise);
    case FeatureKind::Face:
    case FeatureKind::Smooth:
      break;
  }
  return true;
}

FeatureKey ContactSurface::foot_key(std::int32_t triangle, const TriangleFoot& foot) const {
  switch (foot.kind) {
    case FeatureKind::Vertex:
      return {foot.kind, 0, indices(triangle)[std::size_t(foot.index)]};
    case FeatureKind::Edge:
      return {foot.kind, 0, *topology->edge_of_side(3 * triangle + foot.index)};
    case FeatureKind::Face:
    case FeatureKind::Smooth:
      break;
  }
  return {FeatureKind::Face, 0, triangle};
}

bool ContactSurface::triangle_is_clear(std::int32_t triangle, const Vector3& p, const Vector3& n,
                                       Scalar sine, Scalar noise) const {
  const Triangle t = mesh->triangle(triangle);
  Scalar size = 0;
  for (const Vector3& vertex : t) size = std::max(size, (vertex - p).lpNorm<Eigen::Infinity>());
  // Files in single precision separate parts that were meant to touch.
  const Scalar slack = noise + kFlatEdgeSine * size;
  const std::optional<TriangleFoot> foot = find_foot(t, p, slack, 0, 0);
  if (!foot) return true;
  const auto climbs = [&](const Vector3& x) {
    const Vector3 ray = x - p;
    return n.dot(ray) > sine * ray.norm() + slack;
  };
  return std::none_of(t.begin(), t.end(), climbs) && !climbs(steepest_end(t, foot->point, n));
}

bool ContactSurface::touches_clear(const Vector3& p, const Vector3& n, Scalar sine,
                                   Scalar noise) const {
  const MeshHierarchy& hierarchy = mesh->hierarchy();
  // Each level leaves at most seven siblings waiting.
  std::array<std::int32_t, (MeshHierarchy::kWidth - 1) * (MeshHierarchy::kMaxDepth + 1) + 1> stack;
  std::size_t height = 0;
  stack[height++] = 0;
  while (height > 0) {
    const MeshHierarchy::Node& node = hierarchy.nodes()[std::size_t(stack[--height])];
    for (int column = 0; column < node.count(); ++column) {
      const OrientedBox box = node.boxes.box(column, hierarchy.frame());
      const Vector3 local = box.axes.transpose() * (p - box.center);
      const Vector3 off = local.cwiseAbs() - box.half_extents;
      const Scalar slack = noise + kFlatEdgeSine * (2 * box.half_extents.sum() + off.maxCoeff());
      if (off.maxCoeff() > slack) continue;
      const std::int32_t child = node.child[column];
      if (child >= 0) {
        stack[height++] = child;
      } else if (!triangle_is_clear(-1 - child, p, n, sine, noise)) {
        return false;
      }
    }
  }
  return true;
}

}  // namespace dyop::contact_internal
