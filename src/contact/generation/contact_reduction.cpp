// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/contact/contact_reduction.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

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
    keep(farthest);
  }
  for (Standing& standing : standing_) {
    if (standing.place == Standing::InCluster) standing.place = Standing::Dropped;
  }
}

void Reduction::run() {
  for (std::size_t leader; (leader = nearest_free()) < contacts_.size();) thin_cluster(leader);
}

// Lets the contacts of curved surfaces stand for their neighbours, the nearest first. Within three
// ways of the step: one that touches at its end is one way ahead, and the solve at the end feels
// those up to two ways ahead. Facets longer than that are a polygon's.
void merge_contacts(const ContactMerging& merging, std::vector<ContactPoint>& contacts) {
  const auto shift = [&](const ContactPoint& contact) -> Vector3 {
    return merging.shift_W + merging.turn_W.cross(contact.p_WCb);
  };
  std::vector<std::size_t> order(contacts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t x, std::size_t y) { return is_nearer(contacts[x], contacts[y]); });
  std::vector<char> is_merged(contacts.size(), 0);
  for (auto leader = order.begin(); leader != order.end(); ++leader) {
    ContactPoint& first = contacts[*leader];
    if (is_merged[*leader] || first.gap > merging.active_gap) continue;
    const Vector3& n = first.nhat_AB_W;
    const Scalar change = n.dot(shift(first));
    const Scalar sliding = (shift(first) - change * n).norm();
    const Scalar rolling = merging.turn_W.cross(n).norm() * merging.radius;
    const Scalar way = std::min(kContactMeasuredWays * (sliding + rolling),
                                kContactMergedRadiusFraction * merging.radius);
    for (auto next = leader + 1; next != order.end(); ++next) {
      ContactPoint& other = contacts[*next];
      if (is_merged[*next] || other.nhat_AB_W.dot(n) < kContactMergedCosine) continue;
      const Scalar apart = (other.p_WCb - first.p_WCb).norm();
      const Scalar difference = std::abs(other.nhat_AB_W.dot(shift(other)) - change);
      if (!(apart < way) || difference * merging.radius < merging.gap_change * apart) continue;
      is_merged[*next] = 1;
      first.merged_way = way;
      if (first.impulse_W.isZero(0)) first.impulse_W = other.impulse_W;
    }
  }
  std::size_t kept = 0;
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    if (!is_merged[k]) contacts[kept++] = contacts[k];
  }
  contacts.resize(kept);
}

}  // namespace

void reduce_contacts(const ContactReductionOptions& options, std::vector<ContactPoint>& contacts) {
  DYOP_REQUIRE(options.points_per_cluster >= 1,
               "reduce_contacts: points_per_cluster must be >= 1, not ",
               options.points_per_cluster);
  DYOP_REQUIRE(options.same_normal_cosine >= -1 && options.same_normal_cosine <= 1,
               "reduce_contacts: same_normal_cosine must be in [-1, 1], not ",
               options.same_normal_cosine);
  if (options.merging) merge_contacts(*options.merging, contacts);
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
