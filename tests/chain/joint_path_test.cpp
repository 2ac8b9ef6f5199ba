// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/chain/joint_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "dyop/core/error.h"
#include "support/inputs/random_inputs.h"
#include "support/message_of.h"

namespace dyop::testing {
namespace {

constexpr int kCoordinates = 3;

std::vector<JointVector> random_points(int count, std::mt19937_64& random, Scalar size = 2) {
  std::vector<JointVector> points;
  for (int i = 0; i < count; ++i) {
    points.emplace_back(kCoordinates);
    for (int j = 0; j < kCoordinates; ++j) points.back()[j] = random_number(-size, size, random);
  }
  return points;
}

std::vector<Scalar> random_times(int count, std::mt19937_64& random) {
  std::vector<Scalar> times{random_number(-3, 3, random)};
  while (int(times.size()) < count) times.push_back(times.back() + random_number(0.1, 2, random));
  return times;
}

struct NamedPath {
  const char* name;
  JointPath path;
};

std::vector<NamedPath> random_paths(std::mt19937_64& random) {
  const std::vector<Scalar> times = random_times(6, random);
  const std::vector<Scalar> knots{0, 0, 0.1, 0.3, 0.3, 1, 1.5, 2, 2.1, 2.1};
  return {{"linear", JointPath::linear(times, random_points(6, random))},
          {"cubic", JointPath::cubic(times, random_points(6, random), random_points(6, random))},
          {"rest to rest", JointPath::cubic(times, random_points(6, random))},
          {"quintic", JointPath::quintic(times, random_points(6, random), random_points(6, random),
                                         random_points(6, random))},
          {"bspline", JointPath::bspline(3, knots, random_points(6, random))}};
}

TEST(JointPath, PassesThroughItsWaypoints) {
  std::mt19937_64 random(1);
  const std::vector<Scalar> times = random_times(6, random);
  const std::vector<JointVector> points = random_points(6, random);
  const JointPath lines = JointPath::linear(times, points);
  const JointPath curve = JointPath::cubic(times, points);
  for (std::size_t i = 0; i < times.size(); ++i) {
    EXPECT_EQ(lines.position(times[i]), points[i]);
    EXPECT_EQ(curve.position(times[i]), points[i]);
  }
  const JointVector middle = lines.position((times[0] + times[1]) / 2);
  EXPECT_LT((middle - (points[0] + points[1]) / 2).norm(), 1e-14);
}

TEST(JointPath, QuinticHasTheVelocitiesAndAccelerationsAsked) {
  std::mt19937_64 random(3);
  const std::vector<Scalar> times = random_times(5, random);
  const std::vector<JointVector> points = random_points(5, random);
  const std::vector<JointVector> velocities = random_points(5, random);
  const std::vector<JointVector> accelerations = random_points(5, random);
  const JointPath path = JointPath::quintic(times, points, velocities, accelerations);
  for (std::size_t i = 0; i < times.size(); ++i) {
    EXPECT_EQ(path.position(times[i]), points[i]);
    EXPECT_LT((path.velocity(times[i]) - velocities[i]).norm(), 1e-12);
    // One-sided second-order differences of the velocity.
    const Scalar h = i + 1 < times.size() ? 1e-4 : -1e-4;
    const JointVector slope =
        (4 * path.velocity(times[i] + h) - path.velocity(times[i] + 2 * h) - 3 * velocities[i]) /
        (2 * h);
    EXPECT_LT((slope - accelerations[i]).norm(), 1e-3);
  }
}

TEST(JointPath, CubicHasTheVelocitiesAsked) {
  std::mt19937_64 random(2);
  const std::vector<Scalar> times = random_times(5, random);
  const std::vector<JointVector> velocities = random_points(5, random);
  const JointPath path = JointPath::cubic(times, random_points(5, random), velocities);
  for (std::size_t i = 0; i < times.size(); ++i) {
    EXPECT_LT((path.velocity(times[i]) - velocities[i]).norm(), 1e-12);
  }
}

TEST(JointPath, CubicWithoutVelocitiesRestsAtTheEndsAndHasAContinuousAcceleration) {
  std::mt19937_64 random(3);
  const std::vector<Scalar> times = random_times(7, random);
  const JointPath path = JointPath::cubic(times, random_points(7, random));
  EXPECT_LT(path.velocity(times.front()).norm(), 1e-12);
  EXPECT_LT(path.velocity(times.back()).norm(), 1e-12);
  const Scalar h = 1e-4;  // differences of a piecewise quadratic velocity, exact to first order
  for (std::size_t i = 1; i + 1 < times.size(); ++i) {
    const JointVector before = (3 * path.velocity(times[i]) - 4 * path.velocity(times[i] - h) +
                                path.velocity(times[i] - 2 * h)) /
                               (2 * h);
    const JointVector after = (-3 * path.velocity(times[i]) + 4 * path.velocity(times[i] + h) -
                               path.velocity(times[i] + 2 * h)) /
                              (2 * h);
    EXPECT_LT((after - before).norm(), 1e-8 * (1 + before.norm())) << i;
  }
}

// From the definition: the Cox-de Boor recursion of the basis functions.
Scalar basis(std::size_t i, std::size_t degree, std::span<const Scalar> knots, Scalar t) {
  if (degree == 0) return knots[i] <= t && t < knots[i + 1] ? 1 : 0;
  Scalar sum = 0;
  const Scalar left = knots[i + degree] - knots[i];
  if (left > 0) sum += (t - knots[i]) / left * basis(i, degree - 1, knots, t);
  const Scalar right = knots[i + degree + 1] - knots[i + 1];
  if (right > 0) {
    sum += (knots[i + degree + 1] - t) / right * basis(i + 1, degree - 1, knots, t);
  }
  return sum;
}

TEST(JointPath, BsplineIsTheSumOfItsBasisFunctions) {
  std::mt19937_64 random(4);
  const std::vector<Scalar> knots{0, 0, 0.1, 0.3, 0.3, 1, 1.5, 2, 2.1, 2.1};
  const std::vector<JointVector> points = random_points(6, random);
  const JointPath path = JointPath::bspline(3, knots, points);
  EXPECT_EQ(path.domain(), (TimeInterval{0.3, 1.5}));
  for (int k = 0; k < 200; ++k) {
    const Scalar t = random_number(0.3, 1.5, random);
    JointVector expected = JointVector::Zero(kCoordinates);
    for (std::size_t i = 0; i < points.size(); ++i) expected += basis(i, 3, knots, t) * points[i];
    ASSERT_LT((path.position(t) - expected).norm(), 1e-13);
  }
}

TEST(JointPath, VelocityIsTheDerivativeOfThePosition) {
  std::mt19937_64 random(5);
  for (const auto& [name, path] : random_paths(random)) {
    SCOPED_TRACE(name);
    const Scalar h = 1e-5;
    for (int k = 0; k < 100; ++k) {
      const TimeInterval whole = path.domain();
      const Scalar t = random_number(whole.begin + h, whole.end - h, random);
      if (path.piece_at(t - h) != path.piece_at(t + h)) continue;
      const JointVector difference = (path.position(t + h) - path.position(t - h)) / (2 * h);
      ASSERT_LT((difference - path.velocity(t)).norm(), 1e-6 * (1 + difference.norm()));
    }
  }
}

TEST(JointPath, BoundsHoldOnEveryPart) {
  std::mt19937_64 random(6);
  for (int round = 0; round < 50; ++round) {
    for (const auto& [name, path] : random_paths(random)) {
      SCOPED_TRACE(name);
      const TimeInterval whole = path.domain();
      const Scalar length = whole.length() * random_magnitude(-4, 0, random);
      const Scalar begin = whole.begin + random_number(0, 1, random) * (whole.length() - length);
      const TimeInterval part{begin, std::min(begin + length, whole.end)};
      for (std::size_t j = 0; j < kCoordinates; ++j) {
        const JointPath::Bound bound = path.bound(j, part);
        const bool is_one_piece = path.piece_at(part.begin) == path.piece_at(part.end);
        ASSERT_EQ(std::isfinite(bound.acceleration), is_one_piece);
        Scalar fastest = 0;
        for (int k = 0; k <= 100; ++k) {
          const Scalar t = std::min(part.begin + k * part.length() / 100, part.end);
          const JointPath::Sample sample = path.sample(j, path.piece_at(t), t);
          ASSERT_LE(std::abs(sample.rate), bound.speed);
          ASSERT_LE(std::abs(sample.value), path.largest_value(j));
          if (is_one_piece) {
            const Scalar first = path.sample(j, path.piece_at(part.begin), part.begin).rate;
            ASSERT_LE(std::abs(sample.rate - first),
                      bound.acceleration * (t - part.begin) + 1e-13 * (1 + bound.speed));
          }
          fastest = std::max(fastest, std::abs(sample.rate));
        }
        // Bounds of short parts are close.
        if (length < 0.01 * whole.length() && is_one_piece) {
          ASSERT_LE(bound.speed, fastest + bound.acceleration * part.length() + 1e-12);
        }
      }
    }
  }
}

TEST(JointPath, AJumpWhereAPartEndsDoesNotCount) {
  const std::vector<Scalar> times{0, 1, 2};
  const JointVector zero = JointVector::Zero(1), one = JointVector::Ones(1);
  const JointPath path = JointPath::linear(times, std::vector{zero, one, zero});
  EXPECT_NEAR(path.bound(0, {0, 1}).speed, 1, 1e-12);
  EXPECT_EQ(path.bound(0, {0, 1}).acceleration, 0);
  EXPECT_EQ(path.bound(0, {1, 2}).acceleration, 0);
  EXPECT_EQ(path.bound(0, {0, 1.5}).acceleration, kInfinity);
}

TEST(JointPath, IsMadeAgainFromItsControlPoints) {
  std::mt19937_64 random(8);
  for (const auto& [name, path] : random_paths(random)) {
    std::vector<Eigen::MatrixXd> controls;
    for (std::size_t k = 0; k + 1 < path.times().size(); ++k) controls.push_back(path.controls(k));
    const JointPath again = JointPath::bezier(path.times(), controls);
    for (int k = 0; k <= 20; ++k) {
      const Scalar t =
          std::min(path.domain().begin + path.domain().length() * k / 20, path.domain().end);
      EXPECT_EQ(again.position(t), path.position(t)) << name;
      EXPECT_EQ(again.velocity(t), path.velocity(t)) << name;
    }
    EXPECT_THROW(path.controls(path.times().size() - 1), InvalidArgument);
  }
}

TEST(JointPath, RefusesBadInputByName) {
  const JointVector two = JointVector::Zero(2), three = JointVector::Zero(3);
  const std::vector<Scalar> times{0, 1};
  const auto message = [](const auto& f) { return message_of<InvalidArgument>(f); };
  EXPECT_NE(message([&] {
              JointPath::linear(std::vector<Scalar>{0}, std::vector{two});
            }).find("two times, not 1"),
            std::string::npos);
  EXPECT_NE(message([&] {
              JointPath::linear(std::vector<Scalar>{1, 1}, std::vector{two, two});
            }).find("1 follows 1"),
            std::string::npos);
  EXPECT_NE(message([&] {
              JointPath::linear(times, std::vector{two, three});
            }).find("has 3 coordinates, the first one has 2"),
            std::string::npos);
  EXPECT_NE(message([&] { JointPath::linear(times, std::vector{two}); }).find("not 1"),
            std::string::npos);
  EXPECT_NE(message([&] {
              JointPath::linear(times, std::vector{two, JointVector(two.array() + kInfinity)});
            }).find("inf"),
            std::string::npos);
  EXPECT_NE(message([&] {
              JointPath::bspline(2, std::vector<Scalar>{0, 0, 0, 0, 1, 1, 1},
                                 std::vector{two, two, two, two});
            }).find("more than 2 times"),
            std::string::npos);
  EXPECT_NE(message([&] {
              JointPath::linear(std::vector<Scalar>{0, 1e-300},
                                std::vector{two, JointVector(two.array() + 1e10)});
            }).find("too fast"),
            std::string::npos);
  EXPECT_NE(message([&] {
              JointPath::linear(times, std::vector{two, two}).position(2);
            }).find("not at t = 2"),
            std::string::npos);
  const std::vector<Eigen::MatrixXd> torn{Eigen::MatrixXd::Zero(1, 2), Eigen::MatrixXd::Ones(1, 2)};
  EXPECT_NE(message([&] {
              JointPath::bezier(std::vector<Scalar>{0, 1, 2}, torn);
            }).find("must start where the previous one ends"),
            std::string::npos);
}

}  // namespace
}  // namespace dyop::testing
