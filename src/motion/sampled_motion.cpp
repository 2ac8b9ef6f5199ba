#include "dyop/motion/sampled_motion.h"

#include <algorithm>

#include "motion/rotation_rate.h"

namespace dyop {

SampledMotion::SampledMotion(const std::vector<Sample>& samples) {
  DYOP_REQUIRE(samples.size() >= 2, "sampled motion needs at least 2 samples, not ",
               samples.size());
  const std::size_t count = samples.size() - 1;
  stamps_.reserve(count + 1);
  pieces_.reserve(count);
  speed_tree_.resize(2 * count);
  for (std::size_t i = 0; i <= count; ++i) {
    const Scalar t = samples[i].t;
    DYOP_REQUIRE(std::isfinite(t), "time stamp ", i, " of sampled motion must be finite, not ", t);
    DYOP_REQUIRE(i == 0 || t > stamps_.back(),
                 "time stamps of sampled motion must increase, but stamp ", i, " = ", t,
                 " follows stamp ", i - 1, " = ", stamps_.back());
    stamps_.push_back(t);
  }
  for (std::size_t i = 0; i < count; ++i) {
    const RigidPose& X_WB0 = samples[i].X_WB;
    const RigidPose& X_WB1 = samples[i + 1].X_WB;
    const Scalar h = stamps_[i + 1] - stamps_[i];
    const Matrix3 R_B0B1 = X_WB0.rotation().transpose() * X_WB1.rotation();
    const Twist twist{(X_WB1.translation() - X_WB0.translation()) / h,
                      X_WB0.rotation() * rotation_vector(R_B0B1) / h};
    DYOP_REQUIRE(twist.v_WB.allFinite() && twist.w_WB.allFinite(), "time stamps ", i, " = ",
                 stamps_[i], " and ", i + 1, " = ", stamps_[i + 1],
                 " of sampled motion are too close: the velocity between them overflows");
    pieces_.push_back({SteadyTurn(X_WB0.rotation(), twist.w_WB), X_WB0.translation(), twist});
    speed_tree_[count + i] = {internal::round_up(twist.v_WB.norm()),
                              internal::round_up(twist.w_WB.norm())};
  }
  for (std::size_t i = count - 1; i > 0; --i) {
    const Speeds& x = speed_tree_[2 * i];
    const Speeds& y = speed_tree_[2 * i + 1];
    speed_tree_[i] = {std::max(x.linear, y.linear), std::max(x.angular, y.angular)};
  }
}

// The piece that is valid from t on; the first before the domain, the last at its end.
std::size_t SampledMotion::piece_at(Scalar t) const {
  const auto next = std::upper_bound(stamps_.begin() + 1, stamps_.end() - 1, t);
  return static_cast<std::size_t>(next - stamps_.begin()) - 1;
}

RigidPose SampledMotion::pose(Scalar t) const {
  const std::size_t i = piece_at(t);
  const Piece& piece = pieces_[i];
  const Scalar tau = t - stamps_[i];
  return RigidPose::from_trusted(piece.R_WB.at(tau), piece.p_WB0 + tau * piece.twist_WB.v_WB);
}

Twist SampledMotion::twist(Scalar t) const {
  return pieces_[piece_at(t)].twist_WB;
}

// Largest speeds of the pieces first to last, bottom up: at most two nodes of each level.
SampledMotion::Speeds SampledMotion::largest_speeds(std::size_t first, std::size_t last) const {
  Speeds largest;
  const auto take = [&](const Speeds& x) {
    largest = {std::max(largest.linear, x.linear), std::max(largest.angular, x.angular)};
  };
  std::size_t begin = first + pieces_.size();
  std::size_t end = last + 1 + pieces_.size();
  for (; begin < end; begin /= 2, end /= 2) {
    if (begin % 2 == 1) take(speed_tree_[begin++]);
    if (end % 2 == 1) take(speed_tree_[--end]);
  }
  return largest;
}

TwistBound SampledMotion::twist_bound(const TimeInterval& interval) const {
  const std::size_t first = piece_at(interval.begin);
  std::size_t last = std::max(first, piece_at(interval.end));
  // A stamp at the very end of the interval is not inside it.
  if (last > first && stamps_[last] >= interval.end) --last;
  const Speeds speeds = largest_speeds(first, last);
  const Scalar acceleration = last == first ? 0 : kInfinity;
  return {speeds.linear, speeds.angular, acceleration, acceleration};
}

Scalar SampledMotion::smooth_until(Scalar t) const {
  const auto next = std::upper_bound(stamps_.begin(), stamps_.end(), t);
  return next == stamps_.end() ? kInfinity : *next;
}

}  // namespace dyop
