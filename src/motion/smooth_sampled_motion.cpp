// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/motion/smooth_sampled_motion.h"

#include <cstddef>
#include <memory>

#include "dyop/motion/hermite_motion.h"

namespace dyop {
namespace {

// x + s (y - x), for both halves of a twist.
Twist mix(const Twist& x, const Twist& y, Scalar s) {
  return {x.v_WB + s * (y.v_WB - x.v_WB), x.w_WB + s * (y.w_WB - x.w_WB)};
}

}  // namespace

SequenceMotion smooth_sampled_motion(const std::vector<SampledMotion::Sample>& samples) {
  const SampledMotion steady(samples);  // checks the samples
  const std::size_t last = samples.size() - 1;
  const auto length = [&](std::size_t i) { return samples[i + 1].t - samples[i].t; };
  // Between stamps i and i + 1 the parabola has the mean velocity steady.twist(samples[i].t) at the
  // middle; in between it is linear.
  const auto at_inner = [&](std::size_t i) {
    return mix(steady.twist(samples[i - 1].t), steady.twist(samples[i].t),
               length(i - 1) / (length(i - 1) + length(i)));
  };
  const auto twist_at = [&](std::size_t i) {
    if (last == 1) return steady.twist(samples[0].t);
    if (i == 0) return mix(at_inner(1), steady.twist(samples[0].t), 2);
    if (i == last) return mix(at_inner(last - 1), steady.twist(samples[last - 1].t), 2);
    return at_inner(i);
  };
  std::vector<SequenceMotion::Part> parts;
  parts.reserve(last);
  for (std::size_t i = 0; i < last; ++i) {
    const TimeInterval interval{samples[i].t, samples[i + 1].t};
    parts.push_back({interval, std::make_shared<HermiteMotion>(
                                   interval, MotionState{samples[i].X_WB, twist_at(i)},
                                   MotionState{samples[i + 1].X_WB, twist_at(i + 1)})});
  }
  return SequenceMotion(std::move(parts));
}

}  // namespace dyop
