// SPDX-License-Identifier: BSD-3-Clause
#include "view/tool/thinned_motion.h"

#include "dyop/motion/constant_twist_motion.h"

namespace dyop::view_internal {
namespace {

std::shared_ptr<const ConstantTwistMotion> motion_between(const TimedPose& from,
                                                          const TimedPose& to) {
  const Scalar dt = to.t - from.t;
  const Matrix3 turn = to.X_WB.rotation() * from.X_WB.rotation().transpose();
  const Twist twist{(to.X_WB.translation() - from.X_WB.translation()) / dt,
                    rotation_vector(turn) / dt};
  return std::make_shared<const ConstantTwistMotion>(from.X_WB, twist, from.t);
}

bool passes(const Motion& motion, std::span<const TimedPose> poses, const ThinningLimits& limits) {
  for (const TimedPose& pose : poses) {
    const RigidPose X = motion.pose(pose.t);
    const Matrix3 turn = X.rotation().transpose() * pose.X_WB.rotation();
    const Scalar off = (X.translation() - pose.X_WB.translation()).norm() +
                       limits.reach * rotation_vector(turn).norm();
    if (!(off <= limits.tolerance)) return false;
  }
  return true;
}

}  // namespace

void add_thinned(BodyId body, std::span<const TimedPose> poses, const ThinningLimits& limits,
                 std::vector<PageSegment>& segments) {
  // Spans that still must be tried; the next one last. Each is halved at most as often as it can
  // be.
  std::vector<std::span<const TimedPose>> waiting{poses};
  while (!waiting.empty()) {
    const std::span<const TimedPose> span = waiting.back();
    waiting.pop_back();
    if (span.size() < 2 || !(span.front().t < span.back().t)) continue;
    auto motion = motion_between(span.front(), span.back());
    if (span.size() == 2 || passes(*motion, span.subspan(1, span.size() - 2), limits)) {
      segments.push_back({body, {span.front().t, span.back().t}, std::move(motion)});
      continue;
    }
    const std::size_t middle = span.size() / 2;
    waiting.push_back(span.subspan(middle));
    waiting.push_back(span.first(middle + 1));
  }
}

}  // namespace dyop::view_internal
