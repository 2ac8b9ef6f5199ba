// SPDX-License-Identifier: BSD-3-Clause
#include "contact/generation/placed_contacts.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "contact/generation/contact_search.h"

namespace dyop::contact_internal {
namespace {

// How far apart the features of a contact can be before B is moved: with g its gap by then and c
// the cosine of its normal, g^2 - 2 g lift c + lift^2, which is largest at an end of [0, reach].
Scalar unlifted_reach(const ContactPlace& place) {
  const Scalar at_reach = place.reach * place.reach - 2 * place.reach * place.lift * kPlacedCosine +
                          place.lift * place.lift;
  return std::sqrt(std::max(at_reach, place.lift * place.lift));
}

// Which places the triangles in a box of A can hold contacts of.
class PlacesOfBoxes {
 public:
  PlacesOfBoxes(const PlacedSearch& search, const ShapeTree& tree, Scalar slack);

  std::span<const std::int32_t> in(std::int32_t box);

 private:
  struct Place {
    Vector3 center;
    Scalar radius;
    Vector3 p, q;
  };
  struct Known {
    std::size_t first = 0;
    std::size_t count = 0;
  };

  const ShapeTree& tree_;
  Scalar slack_;
  std::vector<Place> places_;    // in frame A
  std::vector<Vector3> points_;  // likewise
  std::unordered_map<std::int32_t, Known> known_;
  std::vector<std::int32_t> numbers_;
};

PlacesOfBoxes::PlacesOfBoxes(const PlacedSearch& search, const ShapeTree& tree, Scalar slack)
    : tree_(tree), slack_(slack) {
  const RigidPose X_AW = search.X_WA.inverse();
  for (const ContactPlace& place : search.places) {
    places_.push_back({X_AW * place.region.center_W, place.region.radius, X_AW * place.p_WCa,
                       X_AW * place.p_WCb});
  }
  for (const Vector3& p_W : search.points_W) points_.push_back(X_AW * p_W);
}

std::span<const std::int32_t> PlacesOfBoxes::in(std::int32_t box) {
  const auto [entry, is_new] = known_.try_emplace(box);
  Known& known = entry->second;
  if (is_new) {
    const Vector3 center = tree_.box(box).center;
    const Scalar radius =
        (1 + kPointBoxNoise) * std::sqrt(tree_.squared_half_diagonal(box)) + slack_;
    Scalar nearest_sq = kInfinity;
    for (const Vector3& p : points_) nearest_sq = std::min(nearest_sq, (p - center).squaredNorm());
    // A point of the box may be nearer to a place than to the nearest point.
    const Scalar most = std::sqrt(nearest_sq) + 2 * radius;
    known.first = numbers_.size();
    for (std::size_t k = 0; k < places_.size(); ++k) {
      const Place& place = places_[k];
      const Scalar within = place.radius + radius;
      if ((place.center - center).squaredNorm() > within * within) continue;
      const Scalar own_sq =
          std::min((place.p - center).squaredNorm(), (place.q - center).squaredNorm());
      if (own_sq <= most * most) numbers_.push_back(std::int32_t(k));
    }
    known.count = numbers_.size() - known.first;
  }
  return std::span(numbers_).subspan(known.first, known.count);
}

}  // namespace

bool generate_placed_contacts(
    const PlacedSearch& search, ContactWorkspace& workspace,
    const std::function<void(std::size_t, const std::vector<ContactPoint>&)>& take) {
  const ContactSurface surface_a(search.a);
  const ContactSurface surface_b(search.b);
  std::vector<ContactQuery> queries;
  std::vector<std::vector<FoundContact>> found(search.places.size());
  Scalar reach = 0;
  Scalar farthest = 0;
  for (const ContactPlace& place : search.places) {
    ContactGeneratorOptions options;
    options.region = place.region;
    queries.push_back(contact_query(surface_a, search.a, search.X_WA, surface_b, search.b,
                                    lifted(place, search.X_WB), place.reach, options));
    reach = std::max(reach, unlifted_reach(place));
    farthest = std::max(farthest, place.reach);
  }
  ContactQuery query =
      contact_query(surface_a, search.a, search.X_WA, surface_b, search.b, search.X_WB, reach, {});
  query.reach += query.noise;
  query.interrupt = search.interrupt;
  if (list_neighbours(workspace, search.a, search.X_WA, search.b, search.X_WB, query.reach)) {
    query.first_pairs = workspace.impl().first_pairs;
  }
  // Either of two finds of one contact, at the border between two places, may be the better one.
  const Scalar slack = 2 * spread_of_doubles(query, farthest);
  const ShapeTree tree_a(*surface_a.mesh);
  PlacesOfBoxes places(search, tree_a, slack);
  std::vector<FeaturePairs> pairs;
  for (std::size_t k = 0; k < queries.size(); ++k) pairs.emplace_back(queries[k], found[k]);
  const auto is_wanted = [&](std::int32_t box_a) { return !places.in(box_a).empty(); };
  visit_near_triangles(query, workspace.impl().stack, is_wanted,
                       [&](std::int32_t leaf_a, std::int32_t triangle_a, std::int32_t triangle_b) {
                         const Triangle a = surface_a.mesh->triangle(triangle_a);
                         for (const std::int32_t number : places.in(leaf_a)) {
                           const auto k = std::size_t(number);
                           Triangle b = surface_b.mesh->triangle(triangle_b);
                           for (Vector3& vertex : b) vertex = queries[k].X_AB * vertex;
                           pairs[k].add_triangles(triangle_a, a, triangle_b, b);
                         }
                       });
  if (is_over(search.interrupt)) return false;
  std::vector<ContactPoint> contacts;
  for (std::size_t k = 0; k < queries.size(); ++k) {
    contacts.clear();
    finish_contacts(queries[k], search.X_WA, found[k], workspace, contacts);
    take(k, contacts);
  }
  return true;
}

}  // namespace dyop::contact_internal
