// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/contact/contact_reduction.h"

#include <algorithm>
#include <cmath>
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

void Reduction::thin_cluster(std::size_t leader) {
  gather(leader);
  keep(leader);
  for (std::size_t count = 1; count < options_.points_per_cluster; ++count) {
    std::size_t farthest = contacts_.size();
    for (std::size_t k = 0; k < contacts_.size(); ++k) {
      if (standing_[k].place != Standing::InCluster) continue;
      const bool is_first = farthest == contacts_.size();
      if (is_first || standing_[k].apart > standing_[farthest].apart ||
          (standing_[k].apart == standing_[farthest].apart &&
           contacts_[k].key < contacts_[farthest].key)) {
        farthest = k;
      }
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

}  // namespace

void reduce_contacts(const ContactReductionOptions& options, std::vector<ContactPoint>& contacts) {
  DYOP_REQUIRE(options.points_per_cluster >= 1,
               "reduce_contacts: points_per_cluster must be >= 1, not ",
               options.points_per_cluster);
  DYOP_REQUIRE(options.same_normal_cosine >= -1 && options.same_normal_cosine <= 1,
               "reduce_contacts: same_normal_cosine must be in [-1, 1], not ",
               options.same_normal_cosine);
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
