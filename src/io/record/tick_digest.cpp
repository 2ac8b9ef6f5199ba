// SPDX-License-Identifier: BSD-3-Clause
#include <bit>

#include "dyop/io/recorded_tick.h"

namespace dyop {
namespace {

// As FNV-1a, with words of 64 bits in place of bytes.
class Digest {
 public:
  void add(std::uint64_t word) {
    hash_ ^= word;
    hash_ *= 0x100000001b3u;
    hash_ ^= hash_ >> 32;
  }
  void add(std::int64_t word) { add(std::bit_cast<std::uint64_t>(word)); }
  void add(Scalar number) { add(std::bit_cast<std::uint64_t>(number)); }
  void add(const Vector3& v) {
    for (const Scalar x : v) add(x);
  }
  void add(const ToolPose& tool) {
    for (Eigen::Index k = 0; k < 3; ++k) add(Vector3(tool.X_WT.rotation().col(k)));
    add(tool.X_WT.translation());
    for (const Scalar angle : tool.angles) add(angle);
  }
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325u;
};

}  // namespace

std::uint64_t tick_digest(const HapticTick& tick) {
  Digest digest;
  digest.add(std::int64_t(tick.status));
  digest.add(tick.tool);
  for (const ToolWaypoint& waypoint : tick.path) {
    digest.add(waypoint.time);
    digest.add(waypoint.tool);
  }
  digest.add(tick.wrench.force_W);
  digest.add(tick.wrench.torque_W);
  for (const ToolContactPoint& contact : tick.contacts) {
    digest.add(std::uint64_t(contact.obstacle));
    digest.add(std::uint64_t(contact.part));
    digest.add(contact.p_W);
    digest.add(contact.nhat_W);
    digest.add(contact.gap);
    digest.add(contact.force_W);
  }
  for (const ToolClearance& clearance : tick.clearances) {
    digest.add(clearance.lower);
    digest.add(clearance.upper);
    digest.add(clearance.p_WT);
    digest.add(clearance.p_WO);
    digest.add(std::int64_t(clearance.is_breached));
    digest.add(clearance.time_to_breach);
  }
  digest.add(tick.energy_returned);
  digest.add(tick.tissue_lag);
  digest.add(tick.tissue_stopped);
  for (const std::int64_t count : tick.snapshots) digest.add(count);
  const TickCutoff cutoff = tick.cutoff.value_or(TickCutoff{});
  digest.add(cutoff.checkpoint);
  digest.add(cutoff.node_pairs);
  return digest.value();
}

}  // namespace dyop
