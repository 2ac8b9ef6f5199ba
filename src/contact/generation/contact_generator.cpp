// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/contact/contact_generator.h"

#include <algorithm>

#include "contact/generation/contact_query.h"
#include "contact/generation/contact_search.h"
#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "geometry/compound_tree.h"

namespace dyop {

ContactWorkspace::ContactWorkspace() : impl_(std::make_unique<Impl>()) {}
ContactWorkspace::~ContactWorkspace() = default;
ContactWorkspace::ContactWorkspace(ContactWorkspace&&) noexcept = default;
ContactWorkspace& ContactWorkspace::operator=(ContactWorkspace&&) noexcept = default;

namespace {

using contact_internal::ContactQuery;
using contact_internal::ContactSurface;

void require_sine(const char* name, Scalar sine) {
  DYOP_REQUIRE(sine >= 0 && sine <= 0.5, "generate_contacts: ", name, " must be in [0, 0.5], not ",
               sine);
}

// Two solids are convex shapes.
bool search_as_solids(const ContactQuery& query, const Shape& a, const Shape& b,
                      std::vector<contact_internal::FoundContact>& found) {
  if (!query.a.is_solid || !query.b.is_solid) return false;
  return contact_internal::search_convex(query, static_cast<const ConvexShape&>(a),
                                         static_cast<const ConvexShape&>(b), found);
}

// Appends the contacts of two meshes or convex shapes, pieces `piece_a` and `piece_b` of their
// bodies.
void append_contacts(const Shape& a, std::int32_t piece_a, const RigidPose& X_WA, const Shape& b,
                     std::int32_t piece_b, const RigidPose& X_WB, Scalar reach,
                     const ContactGeneratorOptions& options, ContactWorkspace& workspace,
                     std::vector<ContactPoint>& contacts, Interrupt* interrupt) {
  distance_internal::BoxPairStack& stack = workspace.impl().stack;
  std::vector<contact_internal::FoundContact>& found = workspace.impl().found;
  ContactSurface surface_a(a);
  ContactSurface surface_b(b);
  const bool is_smooth = !surface_a.mesh || !surface_b.mesh;
  // Distances to a smooth core already include its radius.
  if (is_smooth) surface_a.radius = surface_b.radius = 0;
  ContactQuery query =
      contact_internal::contact_query(surface_a, a, X_WA, surface_b, b, X_WB, reach, options);
  query.interrupt = interrupt;
  found.clear();
  if (!search_as_solids(query, a, b, found)) {
    if (contact_internal::list_neighbours(workspace, a, X_WA, b, X_WB, reach)) {
      query.first_pairs = workspace.impl().first_pairs;
      if (!is_smooth && contact_internal::has_small_surface(query)) {
        contact_internal::split_small_surface(query, workspace.impl().split_pairs);
        query.first_pairs = workspace.impl().split_pairs;
      }
    }
    if (is_smooth) {
      contact_internal::search_smooth(query, a, b, stack, found);
    } else {
      contact_internal::search_surfaces(query, stack, found);
    }
  }
  if (is_over(interrupt)) return;
  contact_internal::finish_contacts(query, X_WA, found, workspace, contacts, piece_a, piece_b);
}

// Calls visit(shape, number) for each mesh or convex shape that a shape consists of, all in its
// frame.
template <typename Visit>
void for_each_piece(const Shape& shape, const Visit& visit) {
  if (shape.kind() != ShapeKind::Compound) return visit(shape, 0);
  std::int32_t number = 0;
  for (const geometry_internal::CompoundPart& part :
       static_cast<const CompoundShape&>(shape).tree().parts) {
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
