// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "dyop/haptics/haptic_session.h"
#include "span_oracle.h"
#include "tick_check.h"

namespace dyop::testing {

/// The same as TickCheck between the tools of a session: samples the distance of every two parts of
/// different tools over every committed motion, until it is proven that what was promised was kept
/// between the samples too.
class ToolsCheck {
 public:
  ToolsCheck(const HapticScene& scene, const HapticOptions& options);

  /// After every update().
  void check(const HapticSession& session);
  /// Of the last tick.
  const SpanStart& start(std::size_t tool) const { return starts_[tool]; }

  TickFindings findings;

 private:
  // A motion of two parts.
  struct Span {
    const SpanBody& a;
    const SpanBody& b;
    const ToolSpanPath& path_a;
    const ToolSpanPath& path_b;
  };
  struct Pair {
    std::size_t a, b;    // triangles
    Scalar distance, s;  // where it was measured last
  };

  void check_tools(const HapticSession& session, std::size_t a, std::size_t b);
  SpanDistance measure(const Span& span);
  void measure_short(const Span& span, Scalar s0, Scalar s1, SpanDistance& whole);
  void find_pairs(const Span& span, Scalar s0, Scalar s1, Scalar cap);
  Scalar distance_at(const Span& span, Scalar s, Scalar travel, Scalar cap, SpanDistance& whole);
  void sample(const Span& span, const std::array<Scalar, 2>& s, const std::array<Scalar, 2>& d,
              Scalar travel, Scalar cap, SpanDistance& whole);
  void judge(const HapticTick& tick, std::size_t a, std::size_t b, const SpanDistance& found);
  void check_clearance(const HapticTick& tick, std::size_t other, Scalar distance);

  const Scalar margin_;
  const Scalar rest_offset_;
  std::vector<std::vector<SpanBody>> tools_;
  std::vector<SpanStart> starts_;
  std::vector<Pair> pairs_;
};

}  // namespace dyop::testing
