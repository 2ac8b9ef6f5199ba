// SPDX-License-Identifier: BSD-3-Clause
#include "contact/solver/impulse_drift.h"

#include <algorithm>
#include <cmath>

#include "contact/solver/contact_law.h"

namespace dyop::contact_internal {
namespace {

// Changes whose angle has at least this cosine are parallel. Found by measurement.
constexpr Scalar kParallel = 0.99;
// A change of at least this part of the last one, for the same penalty, does not converge.
constexpr Scalar kSteady = 0.9;
// Impulses at the edge of a cone turn by at most about this angle, radians.
constexpr Scalar kMostTurn = 0.3;
// Impulses nearer to their bound than this part of it are at it.
constexpr Scalar kAtBound = 1e-9;  // literal: relative; rounding of a projection is far smaller

// Smallest s > 0 at which |x + s dx| = r + s dr, for |x| < r; infinite if there is none. Of an x at
// the bound: at which the bound vanishes or x has turned too far to be followed.
Scalar way_to_disc(const Vector2& x, const Vector2& dx, Scalar r, Scalar dr) {
  if (!(x.norm() < (1 - kAtBound) * r)) {
    const Scalar turn = std::abs(x[0] * dx[1] - x[1] * dx[0]);
    const Scalar to_end = dr < 0 ? -r / dr : kInfinity;
    return turn > 0 ? std::min(to_end, kMostTurn * x.squaredNorm() / turn) : to_end;
  }
  const Scalar a = dx.squaredNorm() - dr * dr;
  const Scalar b = x.dot(dx) - r * dr;
  const Scalar c = x.squaredNorm() - r * r;  // < 0
  const Scalar discriminant = b * b - a * c;
  if (!(discriminant >= 0)) return kInfinity;
  // The root of the sign that avoids cancellation; a <= 0 may have none ahead.
  const Scalar root = std::sqrt(discriminant);
  const Scalar s = b > 0 ? -c / (b + root) : (root - b) / a;
  return s > 0 ? s : kInfinity;
}

Scalar way_to_interval(Scalar x, Scalar dx, Scalar lower, Scalar upper) {
  if (x <= lower || x >= upper || dx == 0) return kInfinity;
  return (dx > 0 ? upper - x : lower - x) / dx;
}

// How often the change can be repeated before the block's impulse is at its bounds; infinite if it
// is there already and does not become free.
Scalar way(const std::vector<Block>& blocks, const std::vector<Vector3>& change, std::size_t i) {
  const Block& block = blocks[i];
  const Vector3& x = block.lambda;
  const Vector3& dx = change[i];
  const std::size_t owner = block.owner < 0 ? i : std::size_t(block.owner);
  const Scalar normal = blocks[owner].lambda[0];
  switch (block.kind) {
    case BlockKind::Contact: {
      const Scalar mu = block.friction;
      const Scalar to_cone =
          mu > 0 ? way_to_disc(x.tail<2>(), dx.tail<2>(), mu * x[0], mu * dx[0]) : kInfinity;
      return dx[0] < 0 ? std::min(to_cone, -x[0] / dx[0]) : to_cone;
    }
    case BlockKind::Row:
      return way_to_interval(x[0], dx[0], block.lower, block.upper);
    case BlockKind::Rolling:
    case BlockKind::Torsion:
      return way_to_disc(x.head<2>(), dx.head<2>(), normal, change[owner][0]);
  }
  return kInfinity;  // not reached
}

}  // namespace

void ImpulseDrift::clear() {
  previous_.clear();
  previous_penalty_ = 0;
}

// Whether the change goes on like the last one. What converges changes less each time; a drift
// does not, and is proportional to the penalty.
bool ImpulseDrift::is_steady(const std::vector<Block>& blocks, Scalar growth) const {
  Scalar product = 0;
  Scalar change_sq = 0;
  Scalar previous_sq = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    product += blocks[i].weight * change_[i].dot(previous_[i]);
    change_sq += blocks[i].weight * change_[i].squaredNorm();
    previous_sq += blocks[i].weight * previous_[i].squaredNorm();
  }
  return change_sq > 0 && product >= kParallel * std::sqrt(change_sq * previous_sq) &&
         std::sqrt(change_sq) >= kSteady * growth * std::sqrt(previous_sq);
}

bool ImpulseDrift::follow(ContactSystem& system, const std::vector<Vector3>& before,
                          Scalar penalty) {
  std::vector<Block>& blocks = system.blocks();
  std::swap(previous_, change_);
  change_.resize(blocks.size());
  for (std::size_t i = 0; i < blocks.size(); ++i) change_[i] = blocks[i].lambda - before[i];
  const Scalar growth = previous_penalty_ > 0 ? penalty / previous_penalty_ : kInfinity;
  previous_penalty_ = penalty;
  if (growth == kInfinity || !is_steady(blocks, growth)) return false;
  Scalar times = kInfinity;
  for (std::size_t i = 0; i < blocks.size(); ++i) times = std::min(times, way(blocks, change_, i));
  if (!(times > 0 && times < kInfinity)) return false;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    Block& block = blocks[i];
    block.lambda += times * change_[i];
    const Scalar normal = block.owner >= 0 ? blocks[std::size_t(block.owner)].lambda[0] : 0;
    block.lambda = project(block, block.lambda, normal);
  }
  system.update_velocities();
  clear();
  return true;
}

}  // namespace dyop::contact_internal
