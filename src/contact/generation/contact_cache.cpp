// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/contact/contact_cache.h"

#include <algorithm>
#include <cmath>

#include "contact/generation/contact_fit.h"
#include "dyop/core/error.h"

namespace dyop {
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
  return Quaternion::FromTwoVectors(from, to) * impulse;
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

}  // namespace dyop
