// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/contact/contact_generator.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "contact/generation/contact_fit.h"
#include "contact/generation/contact_search.h"
#include "core/tolerance.h"
#include "distance/near_parts.h"
#include "dyop/core/error.h"
#include "geometry/shape_tree.h"

namespace dyop {

ContactWorkspace::ContactWorkspace() : impl_(std::make_unique<Impl>()) {}
ContactWorkspace::~ContactWorkspace() = default;
ContactWorkspace::ContactWorkspace(ContactWorkspace&&) noexcept = default;
ContactWorkspace& ContactWorkspace::operator=(ContactWorkspace&&) noexcept = default;

namespace {

using contact_internal::ContactQuery;
using contact_internal::ContactSurface;
using contact_internal::ExpectedApproach;

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
  if (const ExpectedApproach* approach = workspace.impl().approach) {
    contact_internal::expect(*approach, X_WA, surface_a.radius + surface_b.radius, query);
  }
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
  std::vector<distance_internal::PartPair>& parts = workspace.impl().parts;
  distance_internal::find_near_parts(a, X_WA, b, X_WB,
                                     2 * distance_internal::pose_noise(a, X_WA, b, X_WB), reach,
                                     workspace.impl().stack, parts);
  for (const distance_internal::PartPair& pair : parts) {
    if (is_over(interrupt)) break;
    append_contacts(geometry_internal::shape_part(a, pair.a), pair.a, X_WA,
                    geometry_internal::shape_part(b, pair.b), pair.b, X_WB, reach, options,
                    workspace, contacts, interrupt);
  }
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

namespace {

// Bound on the displacement of any point of a shape when its pose in some frame changes from X to
// Y: the displacement of the middle of its bounds, plus the turn over the half diagonal.
Scalar largest_displacement(const Shape& shape, const RigidPose& X, const RigidPose& Y) {
  const AlignedBox bounds = shape.bounding_box();
  const Vector3 center = bounds.center();
  const Matrix3 turn = Y.rotation() - X.rotation();
  const Vector3 moved = turn * center + (Y.translation() - X.translation());
  //  - Y| of two rotations, twice the sine of half the angle, is the Frobenius norm over sqrt(2).
  return moved.norm() + turn.norm() / std::sqrt(Scalar{2}) * bounds.sizes().norm() / 2;
}

// The smaller of the contact's displacements on the two shapes, squared.
Scalar squared_step(const ContactPoint& from, const ContactPoint& to) {
  return std::min((from.p_ACa - to.p_ACa).squaredNorm(), (from.p_BCb - to.p_BCb).squaredNorm());
}

// Cosine of the normal's turn in the frame of the shape it belongs to, or in world if that changed.
Scalar normal_cosine(const ContactPoint& from, const ContactPoint& to) {
  if (from.normal_is_of_b == to.normal_is_of_b) return from.nhat_AB_S.dot(to.nhat_AB_S);
  return from.nhat_AB_W.dot(to.nhat_AB_W);
}

// The impulse, turned by the shortest rotation between two normals.
Vector3 turned(const Vector3& impulse, const Vector3& from, const Vector3& to) {
  if (impulse.isZero(0)) return impulse;
  return rotation_between(from, to) * impulse;
}

void continue_contact(const ContactPoint& last, std::size_t number, ContactPoint& contact) {
  contact.previous = std::int32_t(number);
  contact.impulse_W = turned(last.impulse_W, last.nhat_AB_W, contact.nhat_AB_W);
}

}  // namespace

void ContactCache::clear() {
  contacts_.clear();
  last_.clear();
  generated_reach_ = -1;
  drift_ = 0;
}

bool ContactCache::serves(Scalar reach, const ContactCacheOptions& options) const {
  const bool is_same_generator = generator_.cone_tolerance == options.generator.cone_tolerance &&
                                 generator_.border_tolerance == options.generator.border_tolerance;
  // If generated much farther out than needed, the extra contacts would only cost solver time.
  return is_same_generator && drift_ <= options.max_drift && reach + drift_ <= generated_reach_ &&
         generated_reach_ <= 2 * (reach + options.max_drift);
}

void ContactCache::carry(const RigidPose& X_WA, const RigidPose& X_WB) {
  for (std::size_t k = 0; k < contacts_.size(); ++k) {
    ContactPoint& contact = contacts_[k];
    const RigidPose& X_WS = contact.normal_is_of_b ? X_WB : X_WA;
    contact.p_WCa = X_WA * contact.p_ACa;
    contact.p_WCb = X_WB * contact.p_BCb;
    const Vector3 nhat_W = X_WS.rotation() * contact.nhat_AB_S;
    contact.previous = std::int32_t(k);
    contact.impulse_W = turned(contact.impulse_W, contact.nhat_AB_W, nhat_W);
    contact.nhat_AB_W = nhat_W;
    contact.gap = nhat_W.dot(contact.p_WCb - contact.p_WCa);
  }
}

// Matches the same features first, then the nearest contact with nearly the same normal.
void ContactCache::hand_on_impulses(Scalar reach) {
  constexpr Scalar kSameNormal = 0.9;  // cosine of 26 degrees
  is_continued_.assign(last_.size(), 0);
  for (ContactPoint& contact : contacts_) {
    const auto same = std::lower_bound(
        last_.begin(), last_.end(), contact.key,
        [](const ContactPoint& last, const ContactKey& key) { return last.key < key; });
    if (same == last_.end() || same->key != contact.key) continue;
    const auto number = std::size_t(same - last_.begin());
    is_continued_[number] = 1;
    continue_contact(*same, number, contact);
  }
  for (std::size_t k = 0; k < last_.size(); ++k) {
    if (is_continued_[k]) continue;
    ContactPoint* nearest = nullptr;
    Scalar least = reach * reach;
    for (ContactPoint& contact : contacts_) {
      if (contact.previous || normal_cosine(last_[k], contact) < kSameNormal) continue;
      const Scalar step = squared_step(last_[k], contact);
      if (step > least) continue;
      least = step;
      nearest = &contact;
    }
    if (nearest) continue_contact(last_[k], k, *nearest);
  }
}

bool ContactCache::refresh(const Shape& a, const RigidPose& X_WA, const Shape& b,
                           const RigidPose& X_WB, Scalar reach, const ContactCacheOptions& options,
                           ContactWorkspace& workspace) {
  DYOP_REQUIRE(options.max_drift >= 0 && options.max_drift < kInfinity,
               "ContactCache: max_drift must be finite and >= 0, not ", options.max_drift);
  const RigidPose X_AB = X_WA.inverse() * X_WB;
  if (generated_reach_ >= 0) {
    // Either shape may be regarded as fixed.
    drift_ = std::min(largest_displacement(b, X_AB_, X_AB),
                      largest_displacement(a, X_AB_.inverse(), X_AB.inverse()));
    if (serves(reach, options)) {
      carry(X_WA, X_WB);
      return false;
    }
  }
  generated_reach_ = -1;  // in case the generator throws
  last_.swap(contacts_);
  generate_contacts(a, X_WA, b, X_WB, reach + options.max_drift, options.generator, workspace,
                    contacts_);
  if (options.reduction.merging) {
    contact_internal::fit_ball_contacts(a, X_WA, b, X_WB, options.reduction.merging->most_sagitta,
                                        contacts_);
  }
  hand_on_impulses(reach + options.max_drift);
  reduce_contacts(options.reduction, contacts_);
  X_AB_ = X_AB;
  generated_reach_ = reach + options.max_drift;
  generator_ = options.generator;
  drift_ = 0;
  return true;
}

namespace {

bool is_nearer(const ContactPoint& x, const ContactPoint& y) {
  return std::tie(x.gap, x.key) < std::tie(y.gap, y.key);
}

// State of a contact during the reduction.
struct Standing {
  enum { Free, InCluster, Kept, Dropped } place = Free;
  Scalar apart = kInfinity;  // distance to the nearest kept one of its cluster, squared, weighted
};

class Reduction {
 public:
  Reduction(const ContactReductionOptions& options, const std::vector<ContactPoint>& contacts)
      : options_(options), contacts_(contacts), standing_(contacts.size()) {}

  void run();
  bool is_kept(std::size_t k) const { return standing_[k].place == Standing::Kept; }

 private:
  std::size_t nearest_free() const;
  void keep(std::size_t chosen);
  void gather(std::size_t leader);
  bool is_wanted_before(std::size_t x, std::size_t y) const;
  std::size_t lowest_beside(std::size_t wanted) const;
  void thin_cluster(std::size_t leader);

  const ContactReductionOptions& options_;
  const std::vector<ContactPoint>& contacts_;
  std::vector<Standing> standing_;
};

std::size_t Reduction::nearest_free() const {
  std::size_t best = contacts_.size();
  for (std::size_t k = 0; k < contacts_.size(); ++k) {
    if (standing_[k].place != Standing::Free) continue;
    if (best == contacts_.size() || is_nearer(contacts_[k], contacts_[best])) best = k;
  }
  return best;
}

void Reduction::gather(std::size_t leader) {
  for (std::size_t k = 0; k < contacts_.size(); ++k) {
    if (standing_[k].place != Standing::Free) continue;
    const Scalar cosine = contacts_[k].nhat_AB_W.dot(contacts_[leader].nhat_AB_W);
    if (k == leader || cosine > options_.same_normal_cosine) {
      standing_[k].place = Standing::InCluster;
    }
  }
}

void Reduction::keep(std::size_t chosen) {
  standing_[chosen].place = Standing::Kept;
  for (std::size_t k = 0; k < contacts_.size(); ++k) {
    if (standing_[k].place != Standing::InCluster) continue;
    const bool is_loaded = !contacts_[k].impulse_W.isZero(0);
    const Scalar weight = is_loaded ? kContactLoadPreference * kContactLoadPreference : 1;
    const Scalar apart = (contacts_[k].p_WCa - contacts_[chosen].p_WCa).squaredNorm() * weight;
    standing_[k].apart = std::min(standing_[k].apart, apart);
  }
}

// Those that may carry before the others, then the farther one.
bool Reduction::is_wanted_before(std::size_t x, std::size_t y) const {
  const Scalar active_gap = options_.merging ? options_.merging->active_gap : kInfinity;
  const bool is_active_x = contacts_[x].gap <= active_gap;
  const bool is_active_y = contacts_[y].gap <= active_gap;
  if (is_active_x != is_active_y) return is_active_x;
  if (standing_[x].apart != standing_[y].apart) return standing_[x].apart > standing_[y].apart;
  return contacts_[x].key < contacts_[y].key;
}

// With two rims side by side, or two ends of a rim, the cluster's nearest contact is on one; on the
// other the lowest one touches first, not the one that is farthest from the first. It lowers the
// gap by more than a tenth of a change that counts, and none lower is close to it: on a tilted
// plane that is no place of its own.
std::size_t Reduction::lowest_beside(std::size_t wanted) const {
  if (!options_.merging) return wanted;
  const Scalar apart = standing_[wanted].apart;
  const auto is_within = [&](std::size_t x, std::size_t y, Scalar part) {
    return (contacts_[x].p_WCa - contacts_[y].p_WCa).squaredNorm() < part * part * apart;
  };
  std::size_t lowest = wanted;
  for (std::size_t k = 0; k < contacts_.size(); ++k) {
    if (standing_[k].place != Standing::InCluster || !is_within(k, wanted, 0.5)) continue;
    if (is_nearer(contacts_[k], contacts_[lowest])) lowest = k;
  }
  const Scalar gain = contacts_[wanted].gap - contacts_[lowest].gap;
  if (!(gain > 0.1 * options_.merging->gap_change)) return wanted;
  for (std::size_t k = 0; k < contacts_.size(); ++k) {
    if (contacts_[k].gap < contacts_[lowest].gap && is_within(k, lowest, 0.25)) return wanted;
  }
  return lowest;
}

void Reduction::thin_cluster(std::size_t leader) {
  gather(leader);
  keep(leader);
  for (std::size_t count = 1; count < options_.points_per_cluster; ++count) {
    std::size_t farthest = contacts_.size();
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
      if (standing_[k].place != Standing::InCluster) continue;
      if (farthest == contacts_.size() || is_wanted_before(k, farthest)) farthest = k;
    }
    if (farthest == contacts_.size()) break;
    keep(lowest_beside(farthest));
  }
  for (Standing& standing : standing_) {
    if (standing.place == Standing::InCluster) standing.place = Standing::Dropped;
  }
}

void Reduction::run() {
  for (std::size_t leader; (leader = nearest_free()) < contacts_.size();) thin_cluster(leader);
}

// Lets the nearest of the contacts on a curved surface stand for all that are linked to it by
// facets shorter than three ways of the step: one that touches at its end is one way ahead, and the
// solve at the end feels those up to two ways ahead. Longer facets are a polygon's. Links lead on,
// because a contact beyond three ways would measure its gap at the end where the first one is by
// then, and brake or drive.
class Merging {
 public:
  Merging(const ContactMerging& merging, std::vector<ContactPoint>& contacts)
      : merging_(merging), contacts_(contacts), is_merged_(contacts.size(), 0) {}

  void run();

 private:
  Vector3 shift(const ContactPoint& contact) const {
    return merging_.shift_W + merging_.turn_W.cross(contact.p_WCb);
  }
  bool can_stand_for(const ContactPoint& leader, const ContactPoint& other) const;
  bool is_linked(const ContactPoint& other, Scalar link) const;
  void gather(std::size_t leader);
  Scalar link_of(const ContactPoint& leader) const;
  void fit(ContactPoint& leader) const;

  const ContactMerging& merging_;
  std::vector<ContactPoint>& contacts_;
  std::vector<char> is_merged_;
  std::vector<std::size_t> order_;    // by gap
  std::vector<std::size_t> members_;  // of the leader at hand
};

bool Merging::can_stand_for(const ContactPoint& leader, const ContactPoint& other) const {
  if (other.nhat_AB_W.dot(leader.nhat_AB_W) < kContactMergedCosine) return false;
  const Scalar apart = (other.p_WCb - leader.p_WCb).norm();
  const Scalar difference =
      std::abs(other.nhat_AB_W.dot(shift(other)) - leader.nhat_AB_W.dot(shift(leader)));
  return apart < kContactMergedRadiusFraction * merging_.radius &&
         difference * merging_.radius >= merging_.gap_change * apart;
}

bool Merging::is_linked(const ContactPoint& other, Scalar link) const {
  return std::any_of(members_.begin(), members_.end(), [&](std::size_t k) {
    return (contacts_[k].p_WCb - other.p_WCb).squaredNorm() < link * link;
  });
}

// Three ways of the step; facets in a row that are fine enough to be a curve are linked however
// slowly it rolls: their corners are too low to be felt.
Scalar Merging::link_of(const ContactPoint& leader) const {
  const Vector3& n = leader.nhat_AB_W;
  const Scalar sliding = (shift(leader) - n.dot(shift(leader)) * n).norm();
  const Scalar rolling = merging_.turn_W.cross(n).norm() * merging_.radius;
  const Scalar most = kContactMergedRadiusFraction * merging_.radius;
  const Scalar ways = std::min(kContactMeasuredWays * (sliding + rolling), most);
  // A chord of this length has that sagitta.
  const Scalar fine = std::min(std::sqrt(8 * merging_.radius * merging_.most_sagitta), most);
  if (fine <= ways) return ways;
  std::vector<const ContactPoint*> row;
  for (const ContactPoint& other : contacts_) {
    const bool is_close = (other.p_WCb - leader.p_WCb).squaredNorm() < fine * fine;
    if (is_close && can_stand_for(leader, other)) row.push_back(&other);
  }
  return contact_internal::fitted_contact(leader, row, merging_.most_sagitta) ? fine : ways;
}

void Merging::gather(std::size_t leader) {
  ContactPoint& first = contacts_[leader];
  const Scalar link = link_of(first);
  members_.assign(1, leader);
  for (const std::size_t k : order_) {
    ContactPoint& other = contacts_[k];
    if (k == leader || is_merged_[k] || !is_nearer(first, other)) continue;
    if (!can_stand_for(first, other) || !is_linked(other, link)) continue;
    is_merged_[k] = 1;
    members_.push_back(k);
    const Scalar apart = (other.p_WCb - first.p_WCb).norm();
    first.merged_way = std::max({first.merged_way, apart, link});
    if (first.impulse_W.isZero(0)) first.impulse_W = other.impulse_W;
  }
  fit(first);
}

void Merging::fit(ContactPoint& leader) const {
  std::vector<const ContactPoint*> row;
  for (const std::size_t k : members_) row.push_back(&contacts_[k]);
  if (const auto fitted = contact_internal::fitted_contact(leader, row, merging_.most_sagitta)) {
    leader = *fitted;
  }
}

void Merging::run() {
  order_.resize(contacts_.size());
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  std::sort(order_.begin(), order_.end(),
            [&](std::size_t x, std::size_t y) { return is_nearer(contacts_[x], contacts_[y]); });
  for (const std::size_t leader : order_) {
    if (!is_merged_[leader] && contacts_[leader].gap <= merging_.active_gap) gather(leader);
  }
  std::size_t kept = 0;
  for (std::size_t k = 0; k < contacts_.size(); ++k) {
    if (!is_merged_[k]) contacts_[kept++] = contacts_[k];
  }
  contacts_.resize(kept);
}

}  // namespace

void reduce_contacts(const ContactReductionOptions& options, std::vector<ContactPoint>& contacts) {
  DYOP_REQUIRE(options.points_per_cluster >= 1,
               "reduce_contacts: points_per_cluster must be >= 1, not ",
               options.points_per_cluster);
  DYOP_REQUIRE(options.same_normal_cosine >= -1 && options.same_normal_cosine <= 1,
               "reduce_contacts: same_normal_cosine must be in [-1, 1], not ",
               options.same_normal_cosine);
  if (options.merging) Merging(*options.merging, contacts).run();
  if (contacts.size() <= options.points_per_cluster) return;
  Reduction reduction(options, contacts);
  reduction.run();
  std::size_t kept = 0;
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    if (reduction.is_kept(k)) contacts[kept++] = contacts[k];
  }
  contacts.resize(kept);
}

}  // namespace dyop
