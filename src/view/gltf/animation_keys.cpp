// SPDX-License-Identifier: BSD-3-Clause
#include "view/gltf/animation_keys.h"

#include <array>

namespace dyop::view_internal {
namespace {

constexpr int kMostDivisions = 24;

Vector4 coefficients(const RigidPose& X_WB) {
  return X_WB.quaternion().normalized().coeffs();
}

// dq/dt = (0, w) q / 2 with w in world axes.
Vector4 rate_of(const Vector4& q, const Vector3& w_W) {
  const Quaternion rate = Quaternion(0, w_W.x() / 2, w_W.y() / 2, w_W.z() / 2) * Quaternion(q);
  return rate.coeffs();
}

template <typename Vector>
Vector spline(const Vector& x0, const Vector& rate0, const Vector& x1, const Vector& rate1,
              Scalar h, Scalar s) {
  const Scalar s2 = s * s;
  const Scalar s3 = s2 * s;
  return (2 * s3 - 3 * s2 + 1) * x0 + (s3 - 2 * s2 + s) * h * rate0 + (3 * s2 - 2 * s3) * x1 +
         (s3 - s2) * h * rate1;
}

class KeyMaker {
 public:
  KeyMaker(Scalar t_begin, Scalar radius, Scalar tolerance)
      : t_begin_(t_begin), radius_(radius), tolerance_(tolerance) {}

  // An interval without a velocity jump.
  void add(const MotionSegment& segment) {
    const Motion& motion = *segment.motion;
    const TimeInterval& interval = segment.interval;
    open(interval.begin, motion.state(interval.begin));
    if (segment.kind != SegmentKind::Rest) {
      Scalar begin = interval.begin;
      while (begin < interval.end) {  // a given motion may have jumps of its own
        const Scalar end = std::min(interval.end, motion.smooth_until(begin));
        divide(motion, begin, end, kMostDivisions);
        begin = end;
      }
    } else {
      close(interval.end, motion.state(interval.end));
    }
  }

  std::vector<AnimationKey> take() { return std::move(keys_); }
  float time_of(Scalar t) const { return static_cast<float>(t - t_begin_); }

 private:
  void divide(const Motion& motion, Scalar begin, Scalar end, int halvings) {
    const Scalar middle = begin + (end - begin) / 2;
    const bool can_divide = halvings > 0 && time_of(begin) < time_of(middle) &&
                            time_of(middle) < time_of(end) && motion.smooth_until(begin) >= end;
    if (!can_divide || is_near(motion, begin, end)) {
      close(end, motion.state(end));
      open(end, motion.state(end));
      return;
    }
    divide(motion, begin, middle, halvings - 1);
    divide(motion, middle, end, halvings - 1);
  }

  bool is_near(const Motion& motion, Scalar begin, Scalar end) const {
    const MotionState first = motion.state(begin);
    const MotionState last = motion.state(end);
    const Vector4 q0 = coefficients(first.X_WB);
    Vector4 q1 = coefficients(last.X_WB);
    if (q0.dot(q1) < 0) q1 = -q1;
    const Scalar h = end - begin;
    // literal: points of an interval, none of them special for a cubic
    for (const Scalar s : std::array{0.2, 0.5, 0.7}) {
      const RigidPose X_WB = motion.pose(begin + s * h);
      const Vector3 p = spline(first.X_WB.translation(), first.twist.v_WB, last.X_WB.translation(),
                               last.twist.v_WB, h, s);
      const Vector4 q =
          spline(q0, rate_of(q0, first.twist.w_WB), q1, rate_of(q1, last.twist.w_WB), h, s);
      const Matrix3 R = Quaternion(Vector4(q.normalized())).toRotationMatrix();
      const Scalar distance =
          (p - X_WB.translation()).norm() + radius_ * (R - X_WB.rotation()).norm();
      if (!(distance <= tolerance_)) return false;
    }
    return true;
  }

  // The key at a time; events within the resolution of single precision share one.
  AnimationKey& key_at(Scalar t, const MotionState& state) {
    if (keys_.empty() || keys_.back().t < time_of(t)) {
      AnimationKey& key = keys_.emplace_back();
      key.t = time_of(t);
    }
    AnimationKey& key = keys_.back();
    key.p = state.X_WB.translation();
    key.q = coefficients(state.X_WB);
    if (keys_.size() > 1 && key.q.dot(keys_[keys_.size() - 2].q) < 0) key.q = -key.q;
    return key;
  }

  void open(Scalar t, const MotionState& state) {
    AnimationKey& key = key_at(t, state);
    key.v_out = state.twist.v_WB;
    key.q_rate_out = rate_of(key.q, state.twist.w_WB);
  }

  // The first that ends at the key: what came before it.
  void close(Scalar t, const MotionState& state) {
    const bool is_new = keys_.back().t < time_of(t);
    AnimationKey& key = key_at(t, state);
    if (!is_new) return;
    key.v_in = state.twist.v_WB;
    key.q_rate_in = rate_of(key.q, state.twist.w_WB);
  }

  Scalar t_begin_;
  Scalar radius_;
  Scalar tolerance_;
  std::vector<AnimationKey> keys_;
};

}  // namespace

BodyAnimation animation_of(const RecordingReader& reader, BodyId body, Scalar tolerance) {
  const RecordedBody& recorded = reader.bodies()[body.slot];
  const Scalar radius = reader.shapes()[recorded.shape].shape->bounding_radius();
  KeyMaker maker(reader.interval().begin, radius, tolerance);
  BodyAnimation animation;
  bool was_there = true;
  const std::size_t count = reader.segment_count(body);
  bool moves = false;
  for (std::size_t k = 0; k < count; ++k) {
    const MotionSegment segment = reader.segment(body, k);
    const bool is_there = segment.kind != SegmentKind::Absent;
    const float t = maker.time_of(segment.interval.begin);
    if (k == 0 && t > 0) {  // a body that came later
      animation.changes.push_back({0, false});
      was_there = false;
    }
    if (is_there != was_there) animation.changes.push_back({t, is_there});
    was_there = is_there;
    moves = moves || (segment.kind != SegmentKind::Rest && is_there) || k > 0;
    if (is_there) maker.add(segment);
  }
  animation.keys = maker.take();
  if (!moves && animation.keys.size() > 1) animation.keys.resize(1);
  return animation;
}

}  // namespace dyop::view_internal
