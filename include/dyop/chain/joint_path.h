// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "dyop/core/time_interval.h"
#include "dyop/core/types.h"

namespace dyop::chain_internal {
class JointChords;
}

namespace DYOP_EXPORT dyop {

/// One number per coordinate of a chain: radians for a revolute joint, length for a prismatic one.
using JointVector = Eigen::VectorXd;

/// The coordinates of a chain as functions of time: piecewise polynomials of one degree,
/// continuous; velocities may jump where two pieces meet. Immutable.
class JointPath {
 public:
  static constexpr std::size_t kMaxDegree = 9;

  /// Straight lines between waypoints; the velocity jumps at each of them.
  /// @param times  Strictly increasing, at least two; one per waypoint.
  /// @throws InvalidArgument naming the value if this does not hold, waypoints differ in size or
  ///         are empty, or a number or a resulting velocity is not finite; so do all functions
  ///         below.
  static JointPath linear(std::span<const Scalar> times, std::span<const JointVector> waypoints);

  /// Cubics through the waypoints with these velocities [Farin2002].
  static JointPath cubic(std::span<const Scalar> times, std::span<const JointVector> waypoints,
                         std::span<const JointVector> velocities);

  /// The cubic spline through the waypoints whose velocity is zero at both ends and whose
  /// acceleration is continuous.
  static JointPath cubic(std::span<const Scalar> times, std::span<const JointVector> waypoints);

  /// Quintics through the waypoints with these velocities and accelerations.
  static JointPath quintic(std::span<const Scalar> times, std::span<const JointVector> waypoints,
                           std::span<const JointVector> velocities,
                           std::span<const JointVector> accelerations);

  /// A B-spline, defined from knots[degree] to knots[control_points.size()].
  /// @param degree 1 to kMaxDegree.
  /// @param knots  control_points.size() + degree + 1 times in non-decreasing order; an inner knot
  ///               repeats at most `degree` times.
  static JointPath bspline(std::size_t degree, std::span<const Scalar> knots,
                           std::span<const JointVector> control_points);

  /// Bezier curves, one after another: piece k lasts from times[k] to times[k + 1], and its control
  /// points are the columns of controls[k].
  /// @param controls One row per coordinate; 2 to kMaxDegree + 1 columns, the same number in each
  ///                 piece. A piece starts exactly at the last control point of the previous one.
  static JointPath bezier(std::span<const Scalar> times, std::span<const Eigen::MatrixXd> controls);

  TimeInterval domain() const { return {times_.front(), times_.back()}; }
  std::size_t coordinate_count() const { return coordinate_count_; }
  std::size_t degree() const { return degree_; }
  /// Start of every piece, and the end of the last one.
  std::span<const Scalar> times() const { return times_; }

  /// Bezier control points of piece k, as bezier() takes them: bezier(times(), all of them) is the
  /// same path.
  Eigen::MatrixXd controls(std::size_t piece) const;

  /// Coordinates and their rates at a time of the domain; at a jump the rates from the right.
  /// @throws InvalidArgument if t is outside the domain.
  JointVector position(Scalar t) const;
  JointVector velocity(Scalar t) const;

  /// One coordinate at one time.
  struct Sample {
    Scalar value = 0;
    Scalar rate = 0;
  };
  /// Upper bounds over a part of the domain, rounded up.
  struct Bound {
    Scalar speed = 0;         ///< sup |rate|
    Scalar acceleration = 0;  ///< sup |d rate/dt|; infinite if two pieces meet inside the part
  };

  /// For inner loops, unchecked: the piece at t, from the right.
  std::size_t piece_at(Scalar t) const;
  /// For inner loops, unchecked: t in the domain, `piece` = piece_at(t).
  Sample sample(std::size_t coordinate, std::size_t piece, Scalar t) const;
  /// For inner loops, unchecked: `part` in the domain.
  Bound bound(std::size_t coordinate, const TimeInterval& part) const;
  /// Largest size of a coordinate over the domain, rounded up.
  Scalar largest_value(std::size_t coordinate) const { return largest_values_[coordinate]; }
  /// For inner loops: across many pieces at once; null if there are few.
  const chain_internal::JointChords* chords() const { return chords_.get(); }

 private:
  JointPath(std::vector<Scalar> times, std::span<const Eigen::MatrixXd> controls);
  void set_chords();

  // By piece and coordinate: `degree + 1` values, `degree` rates, `degree - 1` accelerations.
  std::size_t stride() const { return 3 * degree_; }
  const Scalar* row(std::size_t piece, std::size_t coordinate) const {
    return coefficients_.data() + (piece * coordinate_count_ + coordinate) * stride();
  }
  Bound bound_of_piece(std::size_t coordinate, std::size_t piece, const TimeInterval& part) const;

  std::size_t coordinate_count_ = 0;
  std::size_t degree_ = 1;
  std::vector<Scalar> times_;
  std::vector<Scalar> coefficients_;  // Bernstein coefficients, see row()
  std::vector<Bound> piece_bounds_;   // by piece, then by coordinate
  std::vector<Scalar> largest_values_;
  std::shared_ptr<const chain_internal::JointChords> chords_;
};

}  // namespace dyop
