#include "dynamics/local_contacts.h"

#include <algorithm>

#include "distance/point_grid.h"
#include "dyop/distance/triangle_distance.h"
#include "dyop/geometry/triangle_mesh.h"

namespace dyop::internal {
namespace {

// How far a point may be off a face that holds it, as a share of the reach: far above rounding, far
// below what parts the faces of a corner.
constexpr Scalar kOnFace = 1.0 / 1024;

// One of the two sides of a contact.
struct Side {
  const Feature& feature;
  const std::optional<std::int32_t>& triangle;
  const Vector3& p_W;
};

// The face that `nearer` is on holds the point of `side`; where the shape has no triangles, its
// feature holds the other feature.
bool holds(const Shape& shape, const RigidPose& X_WS, const Side& nearer, const Side& side,
           Scalar slack) {
  if (nearer.triangle && shape.kind() == ShapeKind::TriangleMesh) {
    const Vector3 p = X_WS.inverse() * side.p_W;
    const auto& mesh = static_cast<const TriangleMesh&>(shape);
    return triangle_distance({p, p, p}, mesh.triangle(*nearer.triangle)).lower <= slack;
  }
  const auto& face = nearer.feature.vertices;
  return std::all_of(side.feature.vertices.begin(), side.feature.vertices.end(),
                     [&](std::int32_t v) {
                       return v < 0 || std::find(face.begin(), face.end(), v) != face.end();
                     });
}

}  // namespace

std::vector<Contact> local_contacts(const std::vector<Contact>& contacts, const Shape& a,
                                    const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB,
                                    Scalar reach) {
  const auto gap = [](const Contact& c) { return (c.lower + c.upper) / 2; };
  const auto side_a = [](const Contact& c) { return Side{c.feature_a, c.triangle_a, c.p_WCa}; };
  const auto side_b = [](const Contact& c) { return Side{c.feature_b, c.triangle_b, c.p_WCb}; };
  const auto is_beside = [&](const Contact& contact, const Contact& nearer) {
    return gap(nearer) < gap(contact) && (nearer.p_WCa - contact.p_WCa).norm() <= reach &&
           (nearer.p_WCb - contact.p_WCb).norm() <= reach &&
           holds(a, X_WA, side_a(nearer), side_a(contact), kOnFace * reach) &&
           holds(b, X_WB, side_b(nearer), side_b(contact), kOnFace * reach);
  };
  PointGrid grid(reach);
  for (std::size_t i = 0; i < contacts.size(); ++i) grid.add(contacts[i].p_WCa, i);
  std::vector<Contact> local;
  for (const Contact& contact : contacts) {
    const auto hides = [&](std::size_t other) { return is_beside(contact, contacts[other]); };
    if (!grid.any_near(contact.p_WCa, hides)) local.push_back(contact);
  }
  return local;
}

}  // namespace dyop::internal
