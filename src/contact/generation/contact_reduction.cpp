// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/contact/contact_reduction.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "contact/generation/contact_fit.h"
#include "core/tolerance.h"
#include "dyop/core/error.h"

namespace dyop {
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

// Of two rims side by side, or two ends of a rim, the cluster's nearest contact is on one; on the
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
