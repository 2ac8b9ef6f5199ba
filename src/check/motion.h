// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "check/vec.h"

/// Recorded motions. TRUSTED.
namespace dyop_check {

/// An end of a cubic: time, place and velocity of the centre of mass, rotation vector and its rate.
struct CubicNode {
  double t = 0;
  Vec p, v, theta, theta_rate;
};

/// How the body's frame moves at an instant: its origin, and its angular velocity.
struct Velocity {
  Vec v;
  Vec w;
};

/// The motion of a body over part of a run: of the frame M at its centre of mass with its axes.
struct Segment {
  enum class Kind { Absent, Rest, Twist, Cubic, Unsupported };
  Kind kind = Kind::Absent;
  double begin = 0;  ///< holds from here to the next segment
  Vec p_cm;          ///< the origin of M in the body's frame
  double lever = 0;  ///< its distance from the centre of mass, mostly zero
  Mat R;             ///< Rest: of the body; Twist: of M at t0; Cubic: the chart R_WC
  Vec p;             ///< Rest: of the body's origin; Twist: of M at t0
  Vec v, w;          ///< Twist
  double t0 = 0;     ///< Twist
  CubicNode first, last;
  double skew = 0;  ///< by how much R^T R is not 1

  bool is_known() const { return kind != Kind::Absent && kind != Kind::Unsupported; }
  /// The pose of the body's frame.
  Pose pose(double t) const;
  Velocity velocity(double t) const;
};

/// How a body accelerates over an interval: a point at a distance r from the centre of mass by at
/// most `center` + r * `turn`; the latter is at least |w'| + |w|^2, with w the angular velocity, of
/// at most `speed`.
struct Acceleration {
  double center = 0;
  double turn = 0;
  double speed = 0;
};

Acceleration acceleration(const Segment& segment, double begin, double end);

/// How far any point within `size` of the body's origin may be from where pose() puts it.
double pose_noise(const Segment& segment, double size, double begin, double end);

}  // namespace dyop_check
