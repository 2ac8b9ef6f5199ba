// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "dyop/motion/motion.h"

namespace DYOP_EXPORT dyop {

/// A motion made of the caller's functions. Proofs are only as good as `twist_bound`: each function
/// must meet the contract of the member of Motion with its name, also when called from several
/// threads at once, and poses must round as the default Motion::pose_scale() states. check_motion()
/// tests all this.
class UserMotion final : public Motion {
 public:
  struct Functions {
    std::function<RigidPose(Scalar)> pose;
    std::function<Twist(Scalar)> twist;
    std::function<TwistBound(const TimeInterval&)> twist_bound;
    std::function<Scalar(Scalar)> smooth_until;  ///< empty: no jumps within the domain
  };

  /// @throws InvalidArgument if one of the first three functions is empty, or the domain is
  ///         reversed or NaN; its ends may be infinite.
  explicit UserMotion(Functions functions, const TimeInterval& domain = {-kInfinity, kInfinity});

  RigidPose pose(Scalar t) const override;
  Twist twist(Scalar t) const override;

  /// @throws InvalidArgument if the function returned a negative number or NaN.
  TwistBound twist_bound(const TimeInterval& interval) const override;
  TimeInterval domain() const override { return domain_; }

  /// @throws InvalidArgument if the function returned a time that is not after t.
  Scalar smooth_until(Scalar t) const override;

 private:
  Functions functions_;
  TimeInterval domain_;
};

}  // namespace dyop
