// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/distance/find_contacts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <tuple>
#include <vector>

#include "core/tolerance.h"
#include "distance/piece_distance.h"
#include "distance/point_grid.h"
#include "dyop/core/error.h"
#include "dyop/distance/triangle_distance.h"
#include "geometry/compound_tree.h"
#include "geometry/shape_tree.h"
#include "hierarchy/box_gaps.h"

namespace dyop {
namespace {

using geometry_internal::ShapeTree;

// The surface of a shape's core as a mesh, and the radius around it. A smooth core has no surface.
struct CoreSurface {
  explicit CoreSurface(const Shape& shape) {
    if (shape.kind() == ShapeKind::TriangleMesh) {
      mesh = static_cast<const TriangleMesh*>(&shape);
      is_mesh = true;
    } else {
      const auto& convex = static_cast<const ConvexShape&>(shape);
      mesh = convex.core_surface();
      radius = convex.rounding_radius();
    }
  }
  const TriangleMesh* mesh = nullptr;
  Scalar radius = 0;
  bool is_mesh = false;
};

// A vertex, edge or face of a triangle, as a degenerate triangle.
struct TriangleFeature {
  Triangle triangle;
  Feature feature;  // with the mesh's vertex numbers
};

TriangleFeature vertex_of(const Triangle& t, const TriangleIndices& indices, std::size_t i) {
  return {{t[i], t[i], t[i]}, {FeatureKind::Vertex, {indices[i]}}};
}

TriangleFeature edge_of(const Triangle& t, const TriangleIndices& indices, std::size_t i) {
  const std::size_t j = (i + 1) % 3;
  return {{t[i], t[j], t[j]}, {FeatureKind::Edge, {indices[i], indices[j]}}};
}

bool is_vertex(const Feature& feature) {
  return feature.kind == FeatureKind::Vertex;
}

// A mesh or convex shape that a shape consists of, in the shape's frame.
struct ContactPart {
  const Shape& shape;
  std::optional<std::int32_t> child;
};

std::vector<ContactPart> contact_parts(const Shape& shape) {
  if (shape.kind() != ShapeKind::Compound) return {{shape, std::nullopt}};
  std::vector<ContactPart> parts;
  for (const geometry_internal::CompoundPart& part :
       static_cast<const CompoundShape&>(shape).tree().parts) {
    parts.push_back({part.shape(), std::int32_t(parts.size())});
  }
  return parts;
}

// What is left of the limits of a search.
class ContactBudget {
 public:
  explicit ContactBudget(const ContactSearchLimits& limits) : limits_(limits) {}

  void count_box_pair() {
    constexpr std::int64_t kPatience = 1024;  // box pairs between two looks at the stop token
    if (++box_pairs_ % kPatience == 0 && limits_.stop.stop_requested()) is_spent_ = true;
  }
  void count_triangle_pair() {
    if (++triangle_pairs_ > limits_.max_triangle_pairs) is_spent_ = true;
  }
  bool is_spent() const { return is_spent_; }

 private:
  const ContactSearchLimits& limits_;
  std::int64_t box_pairs_ = 0;
  std::int64_t triangle_pairs_ = 0;
  bool is_spent_ = false;
};

// Collects the contacts of two triangle surfaces in frame A.
class ContactGathering {
 public:
  ContactGathering(const CoreSurface& a, const CoreSurface& b, const RigidPose& X_AB, Scalar noise,
                   Scalar max_distance, ContactBudget& budget)
      : a_(a), b_(b), X_AB_(X_AB), noise_(noise), max_distance_(max_distance), budget_(budget) {}

  void run();
  std::vector<Contact> contacts;  // points and normals still in frame A

 private:
  void add_triangle_pair(std::int32_t triangle_a, std::int32_t triangle_b);
  void add_edge_pairs(const Triangle& a, const Triangle& b);
  void add(const TriangleFeature& a, const TriangleFeature& b, bool only_interior,
           std::vector<Contact>& list);

  const CoreSurface& a_;
  const CoreSurface& b_;
  const RigidPose& X_AB_;
  Scalar noise_;
  Scalar max_distance_;
  ContactBudget& budget_;
  std::int32_t triangle_a_ = 0;
  std::int32_t triangle_b_ = 0;
  std::vector<Contact> inner_contacts_;  // of edges inside a flat area
};

// Adds the witness pair of two features if it is near enough. Edge pairs count only if both witness
// points are inside their edges: the ends are found as vertex-face pairs.
void ContactGathering::add(const TriangleFeature& a, const TriangleFeature& b, bool only_interior,
                           std::vector<Contact>& list) {
  const TriangleDistance d = triangle_distance(a.triangle, b.triangle);
  const Scalar radii = a_.radius + b_.radius;
  if (d.lower - noise_ - radii > max_distance_) return;
  if (only_interior && (is_vertex(d.feature_a) || is_vertex(d.feature_b))) return;
  Contact contact;
  contact.nhat_AB_W = d.nhat_AB;
  contact.p_WCa = d.p_a + a_.radius * d.nhat_AB;
  contact.p_WCb = d.p_b - b_.radius * d.nhat_AB;
  contact.lower = std::max(0.0, d.lower - radii - noise_);
  contact.upper = std::max(0.0, d.upper - radii) + noise_;
  contact.feature_a = a.feature;
  contact.feature_b = b.feature;
  if (a_.is_mesh) contact.triangle_a = triangle_a_;
  if (b_.is_mesh) contact.triangle_b = triangle_b_;
  list.push_back(contact);
}

// Whether side k of a triangle joins two coplanar triangles.
bool is_inner_side(const TriangleMesh& mesh, std::int32_t triangle, std::size_t k) {
  const auto edge = mesh.topology().edge_of_side(3 * triangle + std::int32_t(k));
  return edge && mesh.contact_features().edge_kind(*edge) == EdgeKind::Flat;
}

// Where another edge crosses it, an edge inside a flat area is not the border of the area.
void ContactGathering::add_edge_pairs(const Triangle& a, const Triangle& b) {
  const TriangleIndices& indices_a = a_.mesh->triangles()[static_cast<std::size_t>(triangle_a_)];
  const TriangleIndices& indices_b = b_.mesh->triangles()[static_cast<std::size_t>(triangle_b_)];
  std::array<bool, 3> is_inner_b;
  for (std::size_t k = 0; k < 3; ++k) is_inner_b[k] = is_inner_side(*b_.mesh, triangle_b_, k);
  for (std::size_t i = 0; i < 3; ++i) {
    const bool is_inner_a = is_inner_side(*a_.mesh, triangle_a_, i);
    for (std::size_t j = 0; j < 3; ++j) {
      add(edge_of(a, indices_a, i), edge_of(b, indices_b, j), true,
          is_inner_a || is_inner_b[j] ? inner_contacts_ : contacts);
    }
  }
}

void ContactGathering::add_triangle_pair(std::int32_t triangle_a, std::int32_t triangle_b) {
  triangle_a_ = triangle_a;
  triangle_b_ = triangle_b;
  const TriangleIndices& indices_a = a_.mesh->triangles()[static_cast<std::size_t>(triangle_a)];
  const TriangleIndices& indices_b = b_.mesh->triangles()[static_cast<std::size_t>(triangle_b)];
  const Triangle a = a_.mesh->triangle(triangle_a);
  Triangle b = b_.mesh->triangle(triangle_b);
  for (Vector3& vertex : b) vertex = X_AB_ * vertex;
  const TriangleFeature face_a{a, {FeatureKind::Face, indices_a}};
  const TriangleFeature face_b{b, {FeatureKind::Face, indices_b}};
  // Most pairs of neighbouring boxes are not in contact, so one test of the whole triangles first.
  if (triangle_distance(a, b).lower - noise_ - a_.radius - b_.radius > max_distance_) return;
  budget_.count_triangle_pair();
  for (std::size_t i = 0; i < 3; ++i) {
    add(vertex_of(a, indices_a, i), face_b, false, contacts);
    add(face_a, vertex_of(b, indices_b, i), false, contacts);
  }
  add_edge_pairs(a, b);
}

void ContactGathering::run() {
  const ShapeTree tree_a(*a_.mesh);
  const ShapeTree tree_b(*b_.mesh);
  const Scalar reach = max_distance_ + a_.radius + b_.radius;
  const RigidPose X_BA = X_AB_.inverse();
  const auto box_gaps = hierarchy_internal::box_gaps_kernel(core_internal::best_instruction_set());
  std::vector<std::pair<std::int32_t, std::int32_t>> stack{{ShapeTree::kRoot, ShapeTree::kRoot}};
  while (!stack.empty() && !budget_.is_spent()) {
    const auto [box_a, box_b] = stack.back();
    stack.pop_back();
    budget_.count_box_pair();
    if (tree_a.is_leaf(box_a) && tree_b.is_leaf(box_b)) {
      add_triangle_pair(tree_a.triangle(box_a), tree_b.triangle(box_b));
      continue;
    }
    const bool opens_a = geometry_internal::opens_first(tree_a, box_a, tree_b, box_b);
    const ShapeTree& tree = opens_a ? tree_a : tree_b;
    const std::int32_t child = tree.child(opens_a ? box_a : box_b);
    const int count = tree.node(child).count();
    std::array<Scalar, BoxGroup::kWidth> gaps;
    box_gaps(tree.rows(child), count,
             opens_a ? geometry_internal::facing_box(tree_b.box(box_b), X_AB_)
                     : geometry_internal::facing_box(tree_a.box(box_a), X_BA),
             noise_ * (kStepNoise / kPoseNoise), gaps.data());
    for (int column = count - 1; column >= 0; --column) {
      if (gaps[std::size_t(column)] > reach) continue;
      const std::int32_t part = ShapeTree::box_number(child, column);
      stack.emplace_back(opens_a ? part : box_a, opens_a ? box_b : part);
    }
  }
  // Flatness has a tolerance: if the area's border is just out of reach, its inner edges count.
  if (contacts.empty()) contacts = std::move(inner_contacts_);
}

// How far apart, on either body, witness points of one place may be: in a right triangle with a gap
// of at most `max_distance` as hypotenuse, the substeps are the least gap and the distance along
// the surface.
Scalar place_radius(Scalar least_gap, Scalar max_distance) {
  return std::sqrt(std::max(0.0, max_distance - least_gap) * (max_distance + least_gap));
}

// Keeps the nearest contact of each place: drops those within `radius` of one already kept, on both
// bodies and with nearly its normal. Contacts must be sorted. A grid of cells of that size finds
// neighbours.
std::vector<Contact> one_per_place(const std::vector<Contact>& contacts, Scalar radius) {
  constexpr Scalar kSameNormal = 0.99;  // cosine of 8 degrees
  distance_internal::PointGrid grid(radius);
  std::vector<Contact> kept;
  const auto is_new = [&](const Contact& contact) {
    return !grid.any_near(contact.p_WCa, [&](std::size_t other) {
      return (kept[other].p_WCa - contact.p_WCa).norm() <= radius &&
             (kept[other].p_WCb - contact.p_WCb).norm() <= radius &&
             kept[other].nhat_AB_W.dot(contact.nhat_AB_W) >= kSameNormal;
    });
  };
  for (const Contact& contact : contacts) {
    if (!is_new(contact)) continue;
    grid.add(contact.p_WCa, kept.size());
    kept.push_back(contact);
  }
  return kept;
}

bool comes_first(const Contact& x, const Contact& y) {
  const auto key = [](const Contact& c) {
    return std::make_tuple(c.lower, c.p_WCa.x(), c.p_WCa.y(), c.p_WCa.z(), c.p_WCb.x(), c.p_WCb.y(),
                           c.p_WCb.z(), c.feature_a.vertices, c.feature_b.vertices);
  };
  return key(x) < key(y);
}

// For cores without a surface: one contact, at the nearest points.
std::vector<Contact> nearest_contact(const ContactPart& a, const RigidPose& X_WA,
                                     const ContactPart& b, const RigidPose& X_WB,
                                     Scalar max_distance) {
  DistanceOptions options;
  options.max_distance = max_distance;
  const DistanceResult nearest = distance(a.shape, X_WA, b.shape, X_WB, options);
  if (nearest.status == DistanceStatus::FartherThanMaxDistance) return {};
  Contact contact;
  contact.p_WCa = nearest.p_WCa;
  contact.p_WCb = nearest.p_WCb;
  contact.nhat_AB_W = nearest.nhat_AB_W;
  contact.lower = nearest.lower;
  contact.upper = nearest.upper;
  contact.feature_a = nearest.feature_a;
  contact.feature_b = nearest.feature_b;
  contact.triangle_a = nearest.triangle_a;
  contact.triangle_b = nearest.triangle_b;
  contact.child_a = a.child;
  contact.child_b = b.child;
  return {contact};
}

// Merges both lists into one, sorted, in world.
std::vector<Contact> merged(std::vector<Contact> gathered_A, std::vector<Contact> nearest_W,
                            const RigidPose& X_WA, Scalar max_distance, Scalar noise) {
  if (gathered_A.empty()) {
    std::sort(nearest_W.begin(), nearest_W.end(), comes_first);
    return nearest_W;
  }
  std::sort(gathered_A.begin(), gathered_A.end(), comes_first);
  const Scalar radius = place_radius(gathered_A.front().lower, max_distance);
  std::vector<Contact> kept = one_per_place(gathered_A, radius + noise);
  for (Contact& contact : kept) {
    contact.p_WCa = X_WA * contact.p_WCa;
    contact.p_WCb = X_WA * contact.p_WCb;
    contact.nhat_AB_W = X_WA.rotation() * contact.nhat_AB_W;
  }
  if (nearest_W.empty()) return kept;
  kept.insert(kept.end(), nearest_W.begin(), nearest_W.end());
  std::sort(kept.begin(), kept.end(), comes_first);
  return kept;
}

}  // namespace

std::vector<Contact> find_contacts(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                   const RigidPose& X_WB, Scalar max_distance) {
  return find_contacts(a, X_WA, b, X_WB, max_distance, ContactSearchLimits()).value();
}

std::optional<std::vector<Contact>> find_contacts(const Shape& a, const RigidPose& X_WA,
                                                  const Shape& b, const RigidPose& X_WB,
                                                  Scalar max_distance,
                                                  const ContactSearchLimits& limits) {
  DYOP_REQUIRE(limits.max_triangle_pairs >= 0,
               "find_contacts: max_triangle_pairs must be >= 0, not ", limits.max_triangle_pairs);
  DYOP_REQUIRE(max_distance >= 0 && max_distance < kInfinity,
               "find_contacts: max_distance must be finite and >= 0, not ", max_distance);
  const Scalar noise = distance_internal::pose_noise(a, X_WA, b, X_WB);
  const RigidPose X_AB = X_WA.inverse() * X_WB;
  ContactBudget budget(limits);
  std::vector<Contact> gathered;  // in frame A
  std::vector<Contact> nearest;   // in world, for parts without a surface
  for (const ContactPart& part_a : contact_parts(a)) {
    for (const ContactPart& part_b : contact_parts(b)) {
      const CoreSurface surface_a(part_a.shape);
      const CoreSurface surface_b(part_b.shape);
      if (!surface_a.mesh || !surface_b.mesh) {
        for (const Contact& contact : nearest_contact(part_a, X_WA, part_b, X_WB, max_distance)) {
          nearest.push_back(contact);
        }
        continue;
      }
      ContactGathering gathering(surface_a, surface_b, X_AB, noise, max_distance, budget);
      gathering.run();
      if (budget.is_spent() || limits.stop.stop_requested()) return std::nullopt;
      for (Contact& contact : gathering.contacts) {
        contact.child_a = part_a.child;
        contact.child_b = part_b.child;
        gathered.push_back(contact);
      }
    }
  }
  return merged(std::move(gathered), std::move(nearest), X_WA, max_distance, 4 * noise);
}

}  // namespace dyop
