// SPDX-License-Identifier: BSD-3-Clause

// The constructors of JointPath: each is converted to Bezier pieces.

#include <cmath>

#include "dyop/chain/joint_path.h"
#include "dyop/core/error.h"

namespace dyop {
namespace {

using Controls = std::vector<Eigen::MatrixXd>;

void require_times(std::span<const Scalar> times) {
  DYOP_REQUIRE(times.size() >= 2, "a joint path needs at least two times, not ", times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    DYOP_REQUIRE(std::isfinite(times[i]), "time ", i, " of a joint path must be finite, not ",
                 times[i]);
    DYOP_REQUIRE(i == 0 || times[i] > times[i - 1], "times of a joint path must increase, but ",
                 times[i], " follows ", times[i - 1]);
  }
}

void require_vectors(std::span<const JointVector> vectors, std::size_t count, const char* what) {
  DYOP_REQUIRE(vectors.size() == count, "a joint path with ", count, " times needs as many ", what,
               ", not ", vectors.size());
  for (std::size_t i = 0; i < count; ++i) {
    DYOP_REQUIRE(vectors[i].size() == vectors[0].size() && vectors[i].size() > 0, what, " ", i,
                 " of a joint path has ", vectors[i].size(), " coordinates, the first one has ",
                 vectors[0].size());
    DYOP_REQUIRE(vectors[i].allFinite(), what, " ", i, " of a joint path must be finite, not (",
                 vectors[i].transpose(), ")");
  }
}

void require_knots(std::size_t degree, std::span<const Scalar> knots, std::size_t point_count) {
  DYOP_REQUIRE(degree >= 1 && degree <= JointPath::kMaxDegree,
               "degree of a joint path must be 1 to ", JointPath::kMaxDegree, ", not ", degree);
  DYOP_REQUIRE(point_count > degree && knots.size() == point_count + degree + 1,
               "a B-spline of degree ", degree, " needs at least ", degree + 1,
               " control points and ", degree + 1, " more knots than these, not ", point_count,
               " and ", knots.size());
  for (std::size_t i = 0; i < knots.size(); ++i) {
    DYOP_REQUIRE(std::isfinite(knots[i]), "knot ", i, " of a joint path must be finite, not ",
                 knots[i]);
    DYOP_REQUIRE(i == 0 || knots[i] >= knots[i - 1],
                 "knots of a joint path must not decrease, but ", knots[i], " follows ",
                 knots[i - 1]);
    // degree + 1 equal knots inside the domain would break the path.
    DYOP_REQUIRE(i <= degree || i >= point_count || knots[i] > knots[i - degree], "knot ", i, " = ",
                 knots[i], " of a B-spline of degree ", degree, " occurs more than ", degree,
                 " times");
  }
  DYOP_REQUIRE(knots[degree] < knots[point_count],
               "domain of a joint path must have a positive length, not [", knots[degree], ", ",
               knots[point_count], "]");
}

// The polar form of the spline on the span from knot i, with knot i + 1 `count` times and otherwise
// knot i: de Boor's algorithm with a different argument at every level.
JointVector polar_form(std::size_t degree, std::span<const Scalar> knots,
                       std::span<const JointVector> points, std::size_t i, std::size_t count) {
  std::vector<JointVector> x(points.begin() + std::ptrdiff_t(i - degree),
                             points.begin() + std::ptrdiff_t(i + 1));
  for (std::size_t level = 1; level <= degree; ++level) {
    const Scalar u = knots[level <= count ? i + 1 : i];
    for (std::size_t k = degree; k >= level; --k) {
      const Scalar low = knots[i - degree + k];
      const Scalar high = knots[i + 1 + k - level];
      const Scalar s = (u - low) / (high - low);
      x[k] = (1 - s) * x[k - 1] + s * x[k];
    }
  }
  return x[degree];
}

// Velocities of the cubic spline that rests at both ends: the tridiagonal system of continuous
// accelerations, which is diagonally dominant, by elimination without pivoting.
std::vector<JointVector> spline_velocities(std::span<const Scalar> times,
                                           std::span<const JointVector> points) {
  const std::size_t count = times.size();
  std::vector<JointVector> velocity(count, JointVector::Zero(points[0].size()));
  std::vector<Scalar> upper(count, 0);
  for (std::size_t i = 1; i + 1 < count; ++i) {
    const Scalar before = times[i] - times[i - 1];
    const Scalar after = times[i + 1] - times[i];
    // after v(i-1) + 2 (before + after) v(i) + before v(i+1)
    //     = 3 (after slope before i + before slope after i)
    const Scalar pivot = 2 * (before + after) - after * upper[i - 1];
    upper[i] = before / pivot;
    const JointVector right = 3 * (after / before * (points[i] - points[i - 1]) +
                                   before / after * (points[i + 1] - points[i]));
    velocity[i] = (right - after * velocity[i - 1]) / pivot;
  }
  for (std::size_t i = count - 1; i-- > 1;) velocity[i] -= upper[i] * velocity[i + 1];
  return velocity;
}

}  // namespace

JointPath JointPath::bezier(std::span<const Scalar> times,
                            std::span<const Eigen::MatrixXd> controls) {
  require_times(times);
  DYOP_REQUIRE(controls.size() + 1 == times.size(), "a joint path with ", times.size(),
               " times needs one piece fewer, not ", controls.size());
  const Eigen::Index rows = controls[0].rows();
  const Eigen::Index columns = controls[0].cols();
  DYOP_REQUIRE(rows >= 1 && columns >= 2 && columns <= Eigen::Index(kMaxDegree) + 1,
               "a piece of a joint path needs a coordinate and 2 to ", kMaxDegree + 1,
               " control points, not ", rows, " and ", columns);
  for (std::size_t i = 0; i < controls.size(); ++i) {
    DYOP_REQUIRE(controls[i].rows() == rows && controls[i].cols() == columns, "piece ", i,
                 " of a joint path has ", controls[i].rows(), " coordinates and ",
                 controls[i].cols(), " control points, the first one has ", rows, " and ", columns);
    DYOP_REQUIRE(controls[i].allFinite(), "control points of piece ", i,
                 " of a joint path must be finite");
    DYOP_REQUIRE(i == 0 || controls[i].col(0) == controls[i - 1].col(columns - 1), "piece ", i,
                 " of a joint path must start where the previous one ends, at (",
                 controls[i - 1].col(columns - 1).transpose(), "), not at (",
                 controls[i].col(0).transpose(), ")");
  }
  return JointPath({times.begin(), times.end()}, controls);
}

JointPath JointPath::linear(std::span<const Scalar> times, std::span<const JointVector> waypoints) {
  require_times(times);
  require_vectors(waypoints, times.size(), "waypoints");
  Controls controls;
  for (std::size_t i = 0; i + 1 < times.size(); ++i) {
    controls.emplace_back(waypoints[i].size(), 2);
    controls.back() << waypoints[i], waypoints[i + 1];
  }
  return bezier(times, controls);
}

JointPath JointPath::cubic(std::span<const Scalar> times, std::span<const JointVector> waypoints,
                           std::span<const JointVector> velocities) {
  require_times(times);
  require_vectors(waypoints, times.size(), "waypoints");
  require_vectors(velocities, times.size(), "velocities");
  DYOP_REQUIRE(velocities[0].size() == waypoints[0].size(), "velocities of a joint path have ",
               velocities[0].size(), " coordinates, waypoints have ", waypoints[0].size());
  Controls controls;
  for (std::size_t i = 0; i + 1 < times.size(); ++i) {
    const Scalar third = (times[i + 1] - times[i]) / 3;
    controls.emplace_back(waypoints[i].size(), 4);
    controls.back() << waypoints[i], waypoints[i] + third * velocities[i],
        waypoints[i + 1] - third * velocities[i + 1], waypoints[i + 1];
  }
  return bezier(times, controls);
}

JointPath JointPath::cubic(std::span<const Scalar> times, std::span<const JointVector> waypoints) {
  require_times(times);
  require_vectors(waypoints, times.size(), "waypoints");
  return cubic(times, waypoints, spline_velocities(times, waypoints));
}

JointPath JointPath::bspline(std::size_t degree, std::span<const Scalar> knots,
                             std::span<const JointVector> control_points) {
  require_knots(degree, knots, control_points.size());
  require_vectors(control_points, control_points.size(), "control points");
  std::vector<Scalar> times{knots[degree]};
  Controls controls;
  for (std::size_t i = degree; i < control_points.size(); ++i) {
    if (knots[i] == knots[i + 1]) continue;
    times.push_back(knots[i + 1]);
    Eigen::MatrixXd control(control_points[0].size(), Eigen::Index(degree + 1));
    for (std::size_t k = 0; k <= degree; ++k) {
      control.col(Eigen::Index(k)) = polar_form(degree, knots, control_points, i, k);
    }
    // Equal up to rounding; leaves no gap between the pieces.
    if (!controls.empty()) control.col(0) = controls.back().col(Eigen::Index(degree));
    controls.push_back(std::move(control));
  }
  return bezier(times, controls);
}

}  // namespace dyop
