// SPDX-License-Identifier: BSD-3-Clause
#include "contact/generation/contact_fit.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/triangle_mesh.h"
#include "geometry/shape_tree.h"

namespace dyop::contact_internal {
namespace {

// Cosine of the angle up to which normals are taken together: facets that turn more are not fine.
constexpr Scalar kFitCosine = 0.999;
// By how much neighbours may leave the straight line, of their distance, and how uneven the two
// distances may be.
constexpr Scalar kFitBend = 0.1;
constexpr Scalar kFitUneven = 3;

Vector3 middle_of(const ContactPoint& contact) {
  return (contact.p_WCa + contact.p_WCb) / 2;
}

// From the nearest contact to another, along the surface.
Vector3 way_to_other(const ContactPoint& nearest, const ContactPoint& other) {
  const Vector3 apart = middle_of(other) - middle_of(nearest);
  return apart - nearest.nhat_AB_W * nearest.nhat_AB_W.dot(apart);
}

bool is_alike(const ContactPoint& x, const ContactPoint& y) {
  return x.key.a.kind == y.key.a.kind && x.key.b.kind == y.key.b.kind &&
         x.normal_is_of_b == y.normal_is_of_b && x.nhat_AB_W.dot(y.nhat_AB_W) > kFitCosine;
}

// The nearest contact and its neighbours at the signed ways ahead > 0 and behind < 0.
struct Row {
  const ContactPoint* next = nullptr;
  const ContactPoint* last = nullptr;
  Scalar ahead = 0;
  Scalar behind = 0;
};

std::optional<Row> find_row(const ContactPoint& nearest,
                            std::span<const ContactPoint* const> near) {
  // The closest of those on one side of the nearest contact, on any if `side` is zero.
  const auto closest = [&](const Vector3& side) {
    const ContactPoint* best = nullptr;
    Scalar least = kInfinity;
    for (const ContactPoint* other : near) {
      if (other == &nearest || !is_alike(nearest, *other)) continue;
      const Vector3 to = way_to_other(nearest, *other);
      const Scalar apart = to.squaredNorm();
      if (apart == 0 || apart >= least || (!side.isZero(0) && side.dot(to) <= 0)) continue;
      best = other;
      least = apart;
    }
    return best;
  };
  Row row;
  row.next = closest(Vector3::Zero());
  if (!row.next) return std::nullopt;
  const Vector3 to_next = way_to_other(nearest, *row.next);
  row.last = closest(-to_next);
  if (!row.last) return std::nullopt;
  row.ahead = to_next.norm();
  const Vector3 along = to_next / row.ahead;
  row.behind = along.dot(way_to_other(nearest, *row.last));
  if (!(-row.behind <= kFitUneven * row.ahead)) return std::nullopt;
  const bool is_row = std::all_of(near.begin(), near.end(), [&](const ContactPoint* other) {
    const Vector3 to = way_to_other(nearest, *other);
    const Scalar apart = to.norm();
    return apart > -1.5 * row.behind || (to - along * along.dot(to)).norm() <= kFitBend * apart;
  });
  return is_row ? std::optional(row) : std::nullopt;
}

}  // namespace

std::optional<ContactPoint> fitted_contact(const ContactPoint& nearest,
                                           std::span<const ContactPoint* const> near,
                                           Scalar most_sagitta) {
  const std::optional<Row> row = find_row(nearest, near);
  if (!row) return std::nullopt;
  // gap(x) = gap + slope x + bend x^2
  const auto& [next, last, ahead, behind] = *row;
  const Scalar rise_ahead = (next->gap - nearest.gap) / ahead;
  const Scalar rise_behind = (last->gap - nearest.gap) / behind;
  const Scalar bend = (rise_ahead - rise_behind) / (ahead - behind);
  const Scalar slope = rise_ahead - bend * ahead;
  const Scalar facet = std::max(ahead, -behind);
  if (!(bend > 0) || !(bend * facet * facet / 4 <= most_sagitta)) return std::nullopt;
  const Scalar x = std::clamp(-slope / (2 * bend), behind, ahead);
  const Scalar part_next = x * (x - behind) / (ahead * (ahead - behind));
  const Scalar part_last = x * (x - ahead) / (behind * (behind - ahead));
  const auto blend = [&, next = next, last = last](Vector3 ContactPoint::*field) -> Vector3 {
    return (1 - part_next - part_last) * nearest.*field + part_next * next->*field +
           part_last * last->*field;
  };
  ContactPoint fitted = nearest;
  for (const auto field :
       {&ContactPoint::p_WCa, &ContactPoint::p_WCb, &ContactPoint::p_ACa, &ContactPoint::p_BCb}) {
    fitted.*field = blend(field);
  }
  fitted.nhat_AB_W = blend(&ContactPoint::nhat_AB_W).normalized();
  fitted.nhat_AB_S = blend(&ContactPoint::nhat_AB_S).normalized();
  fitted.gap = fitted.nhat_AB_W.dot(fitted.p_WCb - fitted.p_WCa);
  return fitted;
}

namespace {

// Cosine of the angle from a triangle's normal to those of its vertices up to which it is a facet
// of something smooth.
constexpr Scalar kSmoothCosine = 0.99;

const TriangleMesh* mesh_of(const Shape& shape) {
  if (shape.kind() != ShapeKind::TriangleMesh) return nullptr;
  return static_cast<const TriangleMesh*>(&shape);
}

// Exact for vertices on a sphere; none at a border or where a triangle turns too far.
std::optional<Vector3> vertex_normal(const TriangleMesh& mesh, std::int32_t vertex,
                                     const Vector3& facet_normal) {
  const MeshTopology& topology = mesh.topology();
  Vector3 sum = Vector3::Zero();
  for (const std::int32_t corner : topology.corners_of_vertex(vertex)) {
    const std::int32_t first = corner - corner % 3;
    const TriangleIndices& indices = mesh.triangles()[std::size_t(first / 3)];
    const std::array<int, 2> others{(corner + 1) % 3, (corner + 2) % 3};
    for (const std::int32_t side : {corner, first + others[1]}) {
      const auto edge = topology.edge_of_side(side);
      if (!edge || topology.sides_of_edge(*edge).size() != 2) return std::nullopt;
    }
    const Vector3& p = mesh.vertices()[std::size_t(vertex)];
    const Vector3 to_next = mesh.vertices()[std::size_t(indices[std::size_t(others[0])])] - p;
    const Vector3 to_last = mesh.vertices()[std::size_t(indices[std::size_t(others[1])])] - p;
    const Vector3 area = to_next.cross(to_last);
    if (!(area.dot(facet_normal) > kSmoothCosine * area.norm())) return std::nullopt;
    sum += area / (to_next.squaredNorm() * to_last.squaredNorm());
  }
  if (!(sum.squaredNorm() > 0)) return std::nullopt;
  return sum.normalized();
}

// A facet and the normals at its corners, on the side of the ball; in the frame of the mesh.
struct SmoothFacet {
  Triangle triangle;
  Vector3 normal;
  std::array<Vector3, 3> normals;

  Vector3 parts(const Vector3& p) const {  // barycentric coordinates
    const Vector3 area = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
    const auto part = [&](std::size_t i, std::size_t j) {
      return (triangle[i] - p).cross(triangle[j] - p).dot(area) / area.squaredNorm();
    };
    return {part(1, 2), part(2, 0), part(0, 1)};
  }
  Vector3 normal_at(const Vector3& p) const {
    const Vector3 part = parts(p);
    return (part[0] * normals[0] + part[1] * normals[1] + part[2] * normals[2]).normalized();
  }
  // Above the facet's plane: half of what the planes at the corners reach there, which is exact for
  // a surface of second degree.
  Scalar height_at(const Vector3& p) const {
    const Vector3 part = parts(p);
    Scalar height = 0;
    for (Eigen::Index i = 0; i < 3; ++i) {
      const auto k = std::size_t(i);
      height += part[i] * (triangle[k] - p).dot(normals[k]) / normals[k].dot(normal) / 2;
    }
    return height;
  }
};

std::optional<SmoothFacet> smooth_facet(const TriangleMesh& mesh, std::int32_t number,
                                        const Vector3& center) {
  SmoothFacet facet;
  const TriangleIndices& indices = mesh.triangles()[std::size_t(number)];
  for (std::size_t k = 0; k < 3; ++k) facet.triangle[k] = mesh.vertices()[std::size_t(indices[k])];
  const Vector3 area =
      (facet.triangle[1] - facet.triangle[0]).cross(facet.triangle[2] - facet.triangle[0]);
  if (!(area.squaredNorm() > 0)) return std::nullopt;
  facet.normal = area.normalized();
  for (std::size_t k = 0; k < 3; ++k) {
    const auto normal = vertex_normal(mesh, indices[k], facet.normal);
    if (!normal) return std::nullopt;
    facet.normals[k] = *normal;
  }
  constexpr Scalar kFlat = 1e-9;  // literal: of a right angle; a plane keeps its own contacts
  const bool is_flat = std::all_of(
      facet.normals.begin(), facet.normals.end(),
      [&](const Vector3& normal) { return (normal - facet.normal).squaredNorm() < kFlat * kFlat; });
  if (is_flat) return std::nullopt;
  if ((center - facet.triangle[0]).dot(facet.normal) < 0) {
    facet.normal = -facet.normal;
    for (Vector3& normal : facet.normals) normal = -normal;
  }
  return facet;
}

// The point of the smooth surface nearest to the ball's centre, begun at a point of the facet.
std::optional<Vector3> nearest_point(const SmoothFacet& facet, const Vector3& center,
                                     const Vector3& begin, Scalar most_sagitta) {
  constexpr int kSteps = 3;
  const Vector3 along = (facet.triangle[1] - facet.triangle[0]).normalized();
  const Vector3 across = facet.normal.cross(along);
  Eigen::Matrix<Scalar, 3, 2> plane;
  plane << along, across;
  const Scalar size = (facet.triangle[2] - facet.triangle[0]).norm() +
                      (facet.triangle[1] - facet.triangle[0]).norm();
  Vector3 p = begin;
  for (int k = 0; k < kSteps; ++k) {
    const Scalar height = (center - p).dot(facet.normal);
    // What the direction to the centre and the normal differ by, and how that changes along the
    // plane.
    const auto difference = [&](const Vector3& at) -> Eigen::Matrix<Scalar, 2, 1> {
      const Vector3 n = facet.normal_at(at);
      return plane.transpose() * ((center - at) / height - n / n.dot(facet.normal));
    };
    const Scalar step = 1e-3 * size;  // literal: of a facet, over which normals are linear
    const Eigen::Matrix<Scalar, 2, 1> at = difference(p);
    Eigen::Matrix<Scalar, 2, 2> slope;
    slope << (difference(p + step * along) - at) / step,
        (difference(p + step * across) - at) / step;
    if (!(std::abs(slope.determinant()) > 0)) return std::nullopt;
    p -= plane * (slope.inverse() * at);
    if (!((p - begin).norm() < size)) return std::nullopt;
  }
  const Vector3 middle = (facet.triangle[0] + facet.triangle[1] + facet.triangle[2]) / 3;
  if (!(std::abs(facet.height_at(middle)) <= most_sagitta)) return std::nullopt;
  return p + facet.height_at(p) * facet.normal;
}

// A rounded shape, or child of a compound, on a mesh.
struct BallOnMesh {
  const TriangleMesh* mesh = nullptr;
  RigidPose X_WM;
  Scalar radius = 0;
  bool ball_is_a = false;
};

std::optional<BallOnMesh> ball_on_mesh(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                       const RigidPose& X_WB, const ContactKey& key) {
  const Shape& part_a = shape_part(a, key.a.piece);
  const Shape& part_b = shape_part(b, key.b.piece);
  BallOnMesh pair;
  pair.ball_is_a = mesh_of(part_b) != nullptr;
  pair.mesh = mesh_of(pair.ball_is_a ? part_b : part_a);
  const Shape& ball = pair.ball_is_a ? part_a : part_b;
  if (!pair.mesh || ball.kind() != ShapeKind::Convex) return std::nullopt;
  pair.radius = static_cast<const ConvexShape&>(ball).rounding_radius();
  if (!(pair.radius > 0)) return std::nullopt;
  pair.X_WM = pair.ball_is_a ? X_WB : X_WA;
  return pair;
}

bool fit_ball_contact(const BallOnMesh& pair, const RigidPose& X_WA, const RigidPose& X_WB,
                      Scalar most_sagitta, ContactPoint& contact) {
  const auto& triangle = pair.ball_is_a ? contact.triangle_b : contact.triangle_a;
  const FeatureKey& of_ball = pair.ball_is_a ? contact.key.a : contact.key.b;
  if (!triangle || of_ball.kind != FeatureKind::Vertex) return false;
  const RigidPose X_MW = pair.X_WM.inverse();
  const Scalar outwards = pair.ball_is_a ? 1 : -1;  // from the ball along nhat_AB
  const Vector3 center_W =
      (pair.ball_is_a ? contact.p_WCa : contact.p_WCb) - outwards * pair.radius * contact.nhat_AB_W;
  const Vector3 center_M = X_MW * center_W;
  const auto facet = smooth_facet(*pair.mesh, *triangle, center_M);
  if (!facet) return false;
  const auto nearest = nearest_point(
      *facet, center_M, X_MW * (pair.ball_is_a ? contact.p_WCb : contact.p_WCa), most_sagitta);
  if (!nearest) return false;
  const Vector3 on_mesh_W = pair.X_WM * *nearest;
  const Vector3 n = outwards * (on_mesh_W - center_W).normalized();
  const Vector3 on_ball_W = center_W + outwards * pair.radius * n;
  contact.p_WCa = pair.ball_is_a ? on_ball_W : on_mesh_W;
  contact.p_WCb = pair.ball_is_a ? on_mesh_W : on_ball_W;
  contact.p_ACa = X_WA.inverse() * contact.p_WCa;
  contact.p_BCb = X_WB.inverse() * contact.p_WCb;
  contact.nhat_AB_W = n;
  contact.nhat_AB_S = (contact.normal_is_of_b ? X_WB : X_WA).rotation().transpose() * n;
  contact.gap = n.dot(contact.p_WCb - contact.p_WCa);
  return true;
}

}  // namespace

bool fit_ball_contacts(const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB,
                       Scalar most_sagitta, std::vector<ContactPoint>& contacts) {
  if (!(most_sagitta > 0)) return false;
  bool has_moved = false;
  for (ContactPoint& contact : contacts) {
    const auto pair = ball_on_mesh(a, X_WA, b, X_WB, contact.key);
    if (!pair) continue;
    has_moved = fit_ball_contact(*pair, X_WA, X_WB, most_sagitta, contact) || has_moved;
  }
  return has_moved;
}

}  // namespace dyop::contact_internal
