// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "check/trusted/vec.h"

/// Recorded motions, all in one form. TRUSTED.
namespace dyop_check {

/// The polynomial whose value at x is the sum of the k-th vector times x^k.
using Curve = std::vector<Vec>;

inline constexpr std::size_t kMostTerms = 16;  // of a curve

/// The value of a curve.
Vec value(const Curve& curve, double x);

/// The motion of a body from `begin` to its next segment. With x = t - t0 the frame M is at
/// `place`(x), with its axes at R exp(`turn`(x)); the body's frame B has the same axes, and M's
/// origin is at `p_cm` in it. That is seen from the world, or from a frame that follows `outer`.
struct Segment {
  enum class Kind { Absent, Moving, Unsupported };
  Kind kind = Kind::Absent;
  double begin = 0;
  double t0 = 0;
  double length = kInfinity;  ///< the curves hold from t0 for so long
  Mat R;
  Curve place{Vec{}};
  Curve turn{Vec{}};
  Vec p_cm;
  double lever = 0;  ///< distance of M's origin from the centre of mass, mostly zero
  /// Sizes of the numbers of which differences made the curves: their rounding stays.
  double rough_place = 0;
  double rough_turn = 0;
  double skew = 0;  ///< by how much R^T R is not 1
  std::shared_ptr<const Segment> outer;
  /// Of a surface that deforms: the part of its way at t0, and its rate.
  double part_first = 0;
  double part_rate = 0;

  bool is_known() const { return kind == Kind::Moving; }
  bool rests() const { return place.size() == 1 && turn.size() == 1 && !outer; }
  /// A cubic: how dynamic bodies fly, between substeps of contact.
  bool is_flight() const { return place.size() == 4; }
  /// Whether its curves hold over an interval: a hundredth more is covered by the rounding.
  bool holds(double from, double to) const;
  Pose pose(double t) const;
  double part(double t) const { return part_first + (t - t0) * part_rate; }
};

/// How a body moves over an interval: a point at a distance r from M's origin (for a segment with a
/// lever: from the centre of mass) accelerates by at most `center` + r * `turn`; `turn` is at least
/// |w'| + |w|^2, with w the angular velocity, of at most `speed`.
struct Bounds {
  double center = 0;
  double turn = 0;
  double speed = 0;
};

Bounds bounds(const Segment& segment, double begin, double end);

/// How far any point within `size` of the body's origin may be from where pose() puts it.
double pose_noise(const Segment& segment, double size, double begin, double end);

}  // namespace dyop_check
