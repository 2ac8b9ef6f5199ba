// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/contact/contact_generator.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "contact/generation/contact_search.h"
#include "contact/generation/contact_workspace.h"
#include "core/tolerance.h"
#include "distance/piece_distance.h"
#include "dyop/core/error.h"
#include "geometry/compound_tree.h"

namespace dyop {

ContactWorkspace::ContactWorkspace() : impl_(std::make_unique<Impl>()) {}
ContactWorkspace::~ContactWorkspace() = default;
ContactWorkspace::ContactWorkspace(ContactWorkspace&&) noexcept = default;
ContactWorkspace& ContactWorkspace::operator=(ContactWorkspace&&) noexcept = default;

namespace {

using internal::ContactQuery;
using internal::ContactSurface;
using internal::FoundContact;

void require_sine(const char* name, Scalar sine) {
  DYOP_REQUIRE(sine >= 0 && sine <= 0.5, "generate_contacts: ", name, " must be in [0, 0.5], not ",
               sine);
}

// Duplicates: contacts found twice at one place, by rounding or the tolerance at triangle borders.
class DoubleRemoval {
 public:
  DoubleRemoval(const ContactQuery& query, std::vector<char>& is_double)
      : query_(query), window_(spread(query.reach)), is_double_(is_double) {}

  void run(std::vector<FoundContact>& found) const;

 private:
  // How far apart two findings of one contact may be when it is `distance` from the other shape.
  Scalar spread(Scalar distance) const {
    return 2 * query_.options.border_tolerance * distance + 8 * query_.noise;
  }
  bool is_same_place(const FoundContact& x, const FoundContact& y) const {
    constexpr Scalar kSameNormal = 0.999;  // cosine of 2.6 degrees
    const Scalar apart = spread(std::max(x.upper, y.upper));
    return (x.p_a - y.p_a).squaredNorm() <= apart * apart &&
           (x.p_b - y.p_b).squaredNorm() <= apart * apart && x.normal.dot(y.normal) >= kSameNormal;
  }

  bool is_better(const FoundContact& x, const FoundContact& y) const;

  const ContactQuery& query_;
  const Scalar window_;
  std::vector<char>& is_double_;
};

// Of two at one place: on a finely faceted surface the tolerance reaches over several facets, and
// only the nearest has the surface's normal there.
bool DoubleRemoval::is_better(const FoundContact& x, const FoundContact& y) const {
  const Scalar unit = 8 * query_.noise;  // distances that rounding may swap are the same
  const Scalar x_upper = std::floor(x.upper / unit);
  const Scalar y_upper = std::floor(y.upper / unit);
  return std::tie(x.rank, x_upper, x.key) < std::tie(y.rank, y_upper, y.key);
}

// Marks the worse of any two contacts at one place; sweeps along x.
void DoubleRemoval::run(std::vector<FoundContact>& found) const {
  std::sort(found.begin(), found.end(), [](const FoundContact& x, const FoundContact& y) {
    return std::tie(x.p_a.x(), x.rank, x.key) < std::tie(y.p_a.x(), y.rank, y.key);
  });
  is_double_.assign(found.size(), 0);
  for (std::size_t i = 0; i < found.size(); ++i) {
    for (std::size_t j = i + 1; j < found.size(); ++j) {
      if (found[j].p_a.x() - found[i].p_a.x() > window_) break;
      if (!is_same_place(found[i], found[j])) continue;
      is_double_[is_better(found[i], found[j]) ? j : i] = 1;
    }
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (!is_double_[i]) found[kept++] = found[i];
  }
  found.resize(kept);
  std::sort(found.begin(), found.end(),
            [](const FoundContact& x, const FoundContact& y) { return x.key < y.key; });
}

// Translates a feature into the shape's own vertex numbers.
Feature named_feature(const ContactSurface& surface, const FeatureKey& key) {
  switch (key.kind) {
    case FeatureKind::Vertex:
      return {key.kind, {key.number}};
    case FeatureKind::Edge: {
      const auto& ends = surface.topology->edge(key.number);
      return {key.kind, {ends[0], ends[1]}};
    }
    case FeatureKind::Face:
      return {key.kind, surface.indices(key.number)};
    case FeatureKind::Smooth:
      break;
  }
  return {};
}

// Adds the rounding radii of the cores, and transforms to world.
ContactPoint finished(const ContactQuery& query, const RigidPose& X_WA, const FoundContact& found) {
  ContactPoint contact;
  const Scalar radii = query.a.radius + query.b.radius;
  const Matrix3& R_WA = X_WA.rotation();
  contact.p_ACa = found.p_a + query.a.radius * found.normal;
  const Vector3 p_ACb = found.p_b - query.b.radius * found.normal;
  contact.p_BCb = query.X_BA * p_ACb;
  contact.p_WCa = X_WA * contact.p_ACa;
  contact.p_WCb = X_WA * p_ACb;
  contact.nhat_AB_W = R_WA * found.normal;
  contact.gap = found.normal.dot(found.p_b - found.p_a) - radii;
  contact.lower = std::max(Scalar{0}, found.lower - radii);
  contact.upper = std::max(contact.lower, found.upper - radii);
  contact.normal_is_of_b = found.normal_is_of_b;
  contact.nhat_AB_S =
      found.normal_is_of_b ? Vector3(query.X_BA.rotation() * found.normal) : found.normal;
  contact.key = found.key;
  contact.feature_a = named_feature(query.a, found.key.a);
  contact.feature_b = named_feature(query.b, found.key.b);
  if (query.a.is_mesh) contact.triangle_a = found.triangle_a;
  if (query.b.is_mesh) contact.triangle_b = found.triangle_b;
  return contact;
}

// Appends the contacts of two meshes or convex shapes, pieces `piece_a` and `piece_b` of their
// bodies.
void append_contacts(const Shape& a, std::int32_t piece_a, const RigidPose& X_WA, const Shape& b,
                     std::int32_t piece_b, const RigidPose& X_WB, Scalar reach,
                     const ContactGeneratorOptions& options, ContactWorkspace& workspace,
                     std::vector<ContactPoint>& contacts, Interrupt* interrupt) {
  auto& [stack, found, is_double, first_pairs, neighbours] = workspace.impl();
  ContactSurface surface_a(a);
  ContactSurface surface_b(b);
  const bool is_smooth = !surface_a.mesh || !surface_b.mesh;
  // Distances to a smooth core already include its radius.
  if (is_smooth) surface_a.radius = surface_b.radius = 0;
  ContactQuery query{surface_a, surface_b, X_WA.inverse() * X_WB, {}, 0, 0, options, interrupt};
  query.X_BA = query.X_AB.inverse();
  query.reach = reach + surface_a.radius + surface_b.radius;
  // The noise of the poses, and as much again for what is computed from posed points.
  query.noise = 2 * internal::pose_noise(a, X_WA, b, X_WB);
  if (options.region) {
    const Vector3 center_A = X_WA.inverse() * options.region->center_W;
    const Scalar radius = options.region->radius + surface_a.radius + query.noise;
    query.place = {center_A, query.X_BA * center_A, radius};
  }
  found.clear();
  if (neighbours && neighbours->is_built()) {
    const auto placement = neighbours->place(a, X_WA, b, X_WB);
    if (neighbours->covers(placement, {reach})) {
      neighbours->collect(placement, {reach}, first_pairs);
      query.first_pairs = first_pairs;
    }
  }
  if (is_smooth) {
    internal::search_smooth(query, a, b, stack, found);
  } else {
    internal::search_surfaces(query, stack, found);
  }
  if (is_over(interrupt)) return;
  DoubleRemoval(query, is_double).run(found);
  const auto is_wanted = [&](const ContactPoint& contact) {
    if (!options.region) return true;
    const Scalar radius = options.region->radius;
    return (contact.p_WCa - options.region->center_W).squaredNorm() <= radius * radius;
  };
  for (const FoundContact& each : found) {
    const ContactPoint contact = finished(query, X_WA, each);
    if (!is_wanted(contact)) continue;
    contacts.push_back(contact);
    contacts.back().key.a.piece = piece_a;
    contacts.back().key.b.piece = piece_b;
  }
}

// Calls visit(shape, number) for each mesh or convex shape that a shape consists of, all in its
// frame.
template <typename Visit>
void for_each_piece(const Shape& shape, const Visit& visit) {
  if (shape.kind() != ShapeKind::Compound) return visit(shape, 0);
  std::int32_t number = 0;
  for (const internal::CompoundPart& part : static_cast<const CompoundShape&>(shape).tree().parts) {
    visit(part.shape(), number++);
  }
}

}  // namespace

bool generate_contacts(const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB,
                       Scalar reach, const ContactGeneratorOptions& options,
                       ContactWorkspace& workspace, std::vector<ContactPoint>& contacts,
                       Interrupt* interrupt) {
  DYOP_REQUIRE(reach >= 0 && reach < kInfinity,
               "generate_contacts: reach must be finite and >= 0, not ", reach);
  require_sine("cone_tolerance", options.cone_tolerance);
  require_sine("border_tolerance", options.border_tolerance);
  if (options.region) {
    const auto& [center_W, radius] = *options.region;
    DYOP_REQUIRE(center_W.allFinite() && radius >= 0 && radius < kInfinity,
                 "generate_contacts: region must be finite with a radius >= 0, not ", center_W,
                 " and ", radius);
  }
  contacts.clear();
  for_each_piece(a, [&](const Shape& piece_a, std::int32_t number_a) {
    for_each_piece(b, [&](const Shape& piece_b, std::int32_t number_b) {
      append_contacts(piece_a, number_a, X_WA, piece_b, number_b, X_WB, reach, options, workspace,
                      contacts, interrupt);
    });
  });
  if (is_over(interrupt)) {
    contacts.clear();
    return false;
  }
  if (a.kind() == ShapeKind::Compound || b.kind() == ShapeKind::Compound) {
    std::sort(contacts.begin(), contacts.end(),
              [](const ContactPoint& x, const ContactPoint& y) { return x.key < y.key; });
  }
  return true;
}

std::vector<ContactPoint> generate_contacts(const Shape& a, const RigidPose& X_WA, const Shape& b,
                                            const RigidPose& X_WB, Scalar reach,
                                            const ContactGeneratorOptions& options) {
  ContactWorkspace workspace;
  std::vector<ContactPoint> contacts;
  generate_contacts(a, X_WA, b, X_WB, reach, options, workspace, contacts);
  return contacts;
}

}  // namespace dyop
