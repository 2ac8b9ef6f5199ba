// SPDX-License-Identifier: BSD-3-Clause
#include "toi/rigid/safe_step.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "core/tolerance.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/primitives.h"

namespace dyop::toi_internal {
namespace {

TEST(FirstRoot, IsTheRootOfTheQuadraticAndNeverLater) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<Scalar> uniform(-2, 2);
  int with_root = 0;
  for (int i = 0; i < 200000; ++i) {
    const Scalar c0 = std::abs(uniform(random)) + 1e-9;
    const Scalar c1 = uniform(random);
    const Scalar c2 = uniform(random);
    const Scalar h = std::pow(10.0, 3 * uniform(random));
    const Scalar root = first_root(c0, c1, c2, h);
    const auto value = [&](Scalar x) {
      return c0 * (1 - x) * (1 - x) + 2 * c1 * x * (1 - x) + c2 * x * x;
    };
    const Scalar end = std::min(root / h, 1.0);
    for (int k = 0; k < 20; ++k) {
      EXPECT_GE(value(end * k / 20), -1e-14) << c0 << " " << c1 << " " << c2;
    }
    if (root <= h) {
      ++with_root;
      EXPECT_NEAR(value(root / h), 0, 1e-13);
    } else {
      EXPECT_EQ(root, kInfinity);
    }
  }
  EXPECT_GT(with_root, 60000);
  EXPECT_LT(with_root, 180000);
}

// b^2 - a c0 overflows: nothing is known of the root, which is at 0.81.
TEST(FirstRoot, TakesNoStepWhereTheDiscriminantOverflows) {
  EXPECT_EQ(first_root(1e200, 2e200, -1e200, 1), 0);
  EXPECT_EQ(first_root(kInfinity, kInfinity, kInfinity, 1), 0);
}

TEST(FirstRoot, TakesNoStepOnNonFiniteCoefficients) {
  EXPECT_EQ(first_root(1, std::nan(""), 1, 1), 0);
  EXPECT_EQ(first_root(1, 1, -kInfinity, 1), 0);
}

struct RandomPair {
  PairInstant pair;
  OrientedBox a;
  OrientedBox b;
  Vector3 n;
};

class SafeStepProperty : public ::testing::Test {
 protected:
  Vector3 direction() { return vector().normalized(); }
  Vector3 vector() { return {normal_(random_), normal_(random_), normal_(random_)}; }
  Scalar uniform() { return std::uniform_real_distribution<Scalar>(0, 1)(random_); }

  TurningNormal normal(Scalar rate) {
    const Vector3 n = direction();
    return {n, rate * n.cross(vector())};
  }

  OrientedBox box() {
    OrientedBox box;
    box.axes = rotation_from_vector(vector());
    box.center = vector();
    box.half_extents = vector().cwiseAbs();
    return box;
  }

  BodyInstant body(Scalar rate) {
    return {rotation_from_vector(vector()), vector(), vector(), rate * vector()};
  }

  std::mt19937_64 random_{5};
  std::normal_distribution<Scalar> normal_;
};

// Separation of two boxes along a normal after time s, with each body continuing its twist and, on
// top, accelerating at the given linear rates against each other.
Scalar separation(const PairInstant& pair, const OrientedBox& a, const OrientedBox& b,
                  const TurningNormal& normal, Scalar s) {
  const Vector3 n = rotation_from_vector(s * normal.turn_W) * normal.n_W;
  const Matrix3 R_a = rotation_from_vector(s * pair.a.w_WB) * pair.a.R_WB;
  const Matrix3 R_b = rotation_from_vector(s * pair.b.w_WB) * pair.b.R_WB;
  const Scalar origins = n.dot(pair.b.p_WB + s * pair.b.v_WB - pair.a.p_WB - s * pair.a.v_WB) -
                         pair.linear_acceleration * s * s / 2;
  return origins - largest_along(b, -(R_b.transpose() * n)) - largest_along(a, R_a.transpose() * n);
}

TEST_F(SafeStepProperty, NeverPassesTheFloorAndIsNotWasteful) {
  int limited = 0;
  Scalar worst_loss = 0;
  std::vector<Scalar> efficiency;
  for (int i = 0; i < 20000; ++i) {
    PairInstant pair;
    const Scalar rate = std::pow(10.0, 4 * uniform() - 3);
    pair.a = body(rate);
    pair.b = body(rate);
    const OrientedBox a = box();
    OrientedBox b = box();
    const bool is_turning = i % 3 != 0;
    TurningNormal n = normal(is_turning ? rate : 0);
    // The origin of B far away, and the normal turning with it or B not turning at all: then the
    // terms of the origins and of one body decide.
    if (i % 3 == 2) {
      n.turn_W = pair.b.w_WB;
      const Vector3 aside = 10 * n.n_W.cross(vector());
      pair.b.p_WB += aside;
      b.center -= pair.b.R_WB.transpose() * aside;
    } else if (i % 3 == 1) {
      pair.b.w_WB = Vector3::Zero();
      b.center += 10 * vector();
    }
    const Scalar start = separation(pair, a, b, n, 0);
    pair.b.p_WB += n.n_W * (uniform() * 3 - start);  // a gap of 0 to 3 along n
    pair.remaining = pair.horizon = 2;
    pair.linear_acceleration = i % 2 ? uniform() : 0;
    // The largest speeds prove the separation along the normal at its first place.
    pair.linear_speed =
        is_turning ? kInfinity
                   : pair.a.v_WB.norm() + pair.b.v_WB.norm() + 2 * pair.linear_acceleration;
    pair.angular_speed_a = pair.a.w_WB.norm();
    pair.angular_speed_b = pair.b.w_WB.norm();
    pair.noise = 1e-14;
    const Scalar floor = 1e-3;
    const Scalar radius_a = a.center.norm() + a.half_extents.norm();
    const Scalar radius_b = b.center.norm() + b.half_extents.norm();
    const SafeStep step = safe_step(pair, a, radius_a, b, radius_b, n, floor);
    const Scalar end = std::min(step.time, pair.remaining);
    // Along this very n the coupled bound must hold; the ball bound proves another direction.
    if (safe_time_of_balls(pair, radius_a, radius_b, floor) >= end) continue;
    for (int k = 0; k <= 20; ++k) {
      const Scalar value = separation(pair, a, b, n, end * k / 20);
      EXPECT_GE(value, std::min(floor, separation(pair, a, b, n, 0)) - 1e-11);
    }
    if (step.time < pair.remaining && step.gap > 0) {
      ++limited;
      // Where the separation along n really reaches the floor.
      Scalar truth = step.time;
      while (truth < pair.remaining && separation(pair, a, b, n, truth) > floor) truth += 1e-3;
      efficiency.push_back(step.time / truth);
      worst_loss = std::max(worst_loss, truth - step.time);
    }
  }
  ASSERT_GT(limited, 2000);
  std::sort(efficiency.begin(), efficiency.end());
  EXPECT_GT(efficiency[efficiency.size() / 2], 0.6);
}

TEST_F(SafeStepProperty, HoldsWhateverClosingSpeedIsGuessed) {
  int limited = 0;
  for (int i = 0; i < 5000; ++i) {
    PairInstant pair;
    const Scalar rate = std::pow(10.0, 4 * uniform() - 3);
    pair.a = body(rate);
    pair.b = body(rate);
    const OrientedBox a = box();
    const OrientedBox b = box();
    const TurningNormal n = normal(i % 3 == 0 ? 0 : rate);
    const Scalar gap = 0.1 + 3 * uniform();
    pair.b.p_WB += n.n_W * (gap - separation(pair, a, b, n, 0));
    pair.remaining = pair.horizon = 2;
    pair.linear_speed = kInfinity;  // no bound but the coupled one, and balls
    pair.noise = 1e-13;
    const Scalar floor = 1e-3;
    const Scalar radius_a = a.center.norm() + a.half_extents.norm();
    const Scalar radius_b = b.center.norm() + b.half_extents.norm();
    for (const Scalar closing : {-1.0, 0.0, 1e-3, 1.0, 1e6, kInfinity, std::nan("")}) {
      const Slab slab{n, gap - 1e-12, closing};
      const SafeStep step = safe_step(pair, a, radius_a, b, radius_b, slab, floor);
      const Scalar end = std::min(step.time, pair.remaining);
      if (safe_time_of_balls(pair, radius_a, radius_b, floor) >= end) continue;
      limited += step.time < pair.remaining;
      for (int k = 0; k <= 10; ++k) {
        EXPECT_GE(separation(pair, a, b, n, end * k / 10), floor - 1e-11);
      }
    }
  }
  EXPECT_GT(limited, 5000);
}

// Balls are sums of a few numbers: in long double the roundings of safe_time_of_balls() are
// visible.
class BallSteps : public SafeStepProperty {
 protected:
  using Number = long double;
  using Vector = Eigen::Matrix<Number, 3, 1>;

  // At scales from 1e-4 to 1e4, radii from nothing to more than the distance, and paths that pass at
  // every distance, many of them at nearly the sum of the radii.
  PairInstant draw(Scalar& radius_a, Scalar& radius_b) {
    const Scalar scale = std::pow(10.0, 8 * uniform() - 4);
    PairInstant pair;
    pair.a = body(1);
    pair.b = body(1);
    radius_a = scale * std::pow(10.0, -6 * uniform());
    radius_b = scale * std::pow(10.0, -6 * uniform());
    const Scalar ahead = std::pow(10.0, 4 * uniform() - 1) * (radius_a + radius_b);
    const Scalar aside =
        (radius_a + radius_b) *
        (uniform() < 0.5 ? 1 + (uniform() - 0.5) * std::pow(10.0, -12 * uniform()) : 3 * uniform());
    const Vector3 along = direction();
    const Vector3 across = along.cross(direction()).normalized();
    pair.a.p_WB *= scale * (uniform() < 0.5 ? 0 : 100);
    pair.b.p_WB = pair.a.p_WB + ahead * along + aside * across;
    pair.a.v_WB = pair.b.v_WB + scale * std::pow(10.0, 4 * uniform() - 2) * along;
    pair.remaining = pair.horizon = scale * std::pow(10.0, 4 * uniform() - 2);
    pair.linear_speed = kInfinity;
    const Scalar size = pair.a.p_WB.norm() + pair.b.p_WB.norm() +
                        (pair.a.v_WB.norm() + pair.b.v_WB.norm()) * pair.horizon;
    pair.noise = kStepNoise * size;
    return pair;
  }
};

TEST_F(BallSteps, AreExactWithoutAcceleration) {
  int hits = 0;
  int misses = 0;
  for (int i = 0; i < 300000; ++i) {
    Scalar radius_a;
    Scalar radius_b;
    PairInstant pair = draw(radius_a, radius_b);
    if (i % 4 == 0) {  // places and speeds without rounding: nothing else may need the noise
      pair.b.p_WB -= pair.a.p_WB;
      pair.b.v_WB = pair.a.p_WB = Vector3::Zero();
      pair.noise = 0;
    }
    const Scalar floor = i % 2 ? 0 : uniform() * radius_a;
    const Vector p = pair.b.p_WB.cast<Number>() - pair.a.p_WB.cast<Number>();
    const Vector v = pair.b.v_WB.cast<Number>() - pair.a.v_WB.cast<Number>();
    const Number reach = Number(radius_a) + radius_b + floor;
    const Scalar time = safe_time_of_balls(pair, radius_a, radius_b, floor);
    const Number middle = -p.dot(v) / v.squaredNorm();
    const auto nearest_until = [&](Number t) -> Number {
      return (p + std::clamp<Number>(middle, 0, t) * v).norm();
    };
    ASSERT_GE(time, 0);
    ASSERT_LE(time, pair.horizon);
    if (time == 0) continue;
    ASSERT_GE(nearest_until(time), reach) << i;
    // What is lost beyond the noise.
    const Number size = p.norm() + v.norm() * pair.horizon;
    const Number loss = 128 * kUnitRoundoff * size * size / reach + 2 * pair.noise;
    const bool is_miss = nearest_until(pair.horizon) > reach + loss;
    (is_miss ? misses : hits) += 1;
    if (is_miss) {
      ASSERT_EQ(time, pair.horizon) << i;
    } else if (time < pair.horizon) {
      ASSERT_LE((p + Number(time) * v).norm(), reach + loss) << i;
    }
  }
  EXPECT_GT(hits, 50000);
  EXPECT_GT(misses, 50000);
}

// The worst that an acceleration can do: it pulls towards the other body from the start, or from
// some time on, in any direction near that.
TEST_F(BallSteps, HoldWhateverAccelerates) {
  int shortened = 0;
  int longer = 0;
  for (int i = 0; i < 100000; ++i) {
    Scalar radius_a;
    Scalar radius_b;
    PairInstant pair = draw(radius_a, radius_b);
    const Vector3 p = pair.b.p_WB - pair.a.p_WB;
    const Vector3 v = pair.b.v_WB - pair.a.v_WB;
    const Scalar h = pair.horizon;
    pair.linear_acceleration =
        std::pow(10.0, 6 * uniform() - 5) * (p.norm() + v.norm() * h) / h / h;
    const Scalar time = safe_time_of_balls(pair, radius_a, radius_b, 0);
    if (time == 0) continue;
    shortened += time < h;
    const Scalar reach = radius_a + radius_b;
    for (int k = 1; k <= 20; ++k) {
      const Scalar s = time * k / 20;
      const Vector3 there = p + s * v;
      const Scalar pulled = pair.linear_acceleration * s * s / 2;
      ASSERT_GE(there.norm() - pulled, reach * (1 - 1e-12)) << i;
    }
    // Along the first direction the bound would be shorter.
    const Scalar opening = p.dot(v) / p.norm();
    longer += p.norm() - reach + time * opening - pair.linear_acceleration * time * time / 2 < 0;
  }
  EXPECT_GT(shortened, 10000);
  EXPECT_GT(longer, 10000);
}

// A corner above a face that tilts: along a fixed normal the face's far corners come up, along the
// normal of the face there is nothing but the corner.
TEST(SafeStep, IsTenTimesLongerAlongTheNormalOfATurningFace) {
  PairInstant pair;
  pair.a = {Matrix3::Identity(), Vector3::Zero(), Vector3::Zero(), Vector3(0, 2, 0)};
  pair.b = {Matrix3::Identity(), Vector3(0, 0, 1.01), Vector3(0, 0, -0.1), Vector3::Zero()};
  pair.remaining = pair.horizon = 1;
  pair.linear_speed = 0.1;
  pair.angular_speed_a = 2;
  OrientedBox box;
  box.half_extents = Vector3(1, 1, 1);
  const Triangle corner{Vector3(0, 0, 0), Vector3(0, 0, 1), Vector3(0, 0.1, 1)};
  const auto step_along = [&](const Vector3& turn) {
    return safe_step(pair, box, 2, corner, 2, TurningNormal{Vector3::UnitZ(), turn}, 0);
  };
  const std::array<Vector3, 2> face{Vector3(1, 0, 0), Vector3(0, 1, 0)};
  const Vector3 turn = turn_with_edges(Vector3::UnitZ(), face, pair.a.w_WB, {}, pair.b.w_WB);
  EXPECT_EQ(turn, pair.a.w_WB);
  // The corner's height over the face is (1.01 - s / 10) cos(2 s) - 1.
  const Scalar hit = 0.0508;
  EXPECT_LT((1.01 - hit / 10) * std::cos(2 * hit), 1);
  EXPECT_LE(step_along(turn).time, hit);
  EXPECT_GT(step_along(turn).time, 0.9 * hit);
  EXPECT_LT(step_along(Vector3::Zero()).time, 0.1 * hit);
}

TEST(TurnWithEdges, KeepsTheNormalSquareToThem) {
  std::mt19937_64 random(8);
  std::normal_distribution<Scalar> normal;
  const auto vector = [&] { return Vector3(normal(random), normal(random), normal(random)); };
  for (int i = 0; i < 1000; ++i) {
    const Vector3 e = vector();
    const Vector3 f = vector();
    const Vector3 n = e.cross(f).normalized();
    const Vector3 w_a = vector();
    const Vector3 w_b = vector();
    const std::array<Vector3, 1> edge_a{e};
    const std::array<Vector3, 1> edge_b{f};
    // Rate of the product of the normal and an edge of a body.
    const auto slip = [&](const Vector3& turn, const Vector3& edge, const Vector3& w) {
      return turn.cross(n).dot(edge) + n.dot(w.cross(edge));
    };
    const Vector3 both = turn_with_edges(n, edge_a, w_a, edge_b, w_b);
    const Scalar sine = e.cross(f).norm() / (e.norm() * f.norm());
    const Scalar tolerance = 1e-12 / sine;
    EXPECT_NEAR(both.dot(n), 0, tolerance);
    EXPECT_NEAR(slip(both, e, w_a), 0, tolerance);
    if (sine > 0.21) {
      EXPECT_NEAR(slip(both, f, w_b), 0, tolerance);
    }
    EXPECT_NEAR(slip(turn_with_edges(n, {}, w_a, edge_b, w_b), f, w_b), 0, 1e-12);
    const std::array<Vector3, 2> face{e, f};
    EXPECT_NEAR(slip(turn_with_edges(n, {}, w_a, face, w_b), f, w_b), 0, 1e-12);
    EXPECT_EQ(turn_with_edges(n, {}, w_a, {}, w_b), Vector3::Zero());
  }
  // Edges without length and parallel ones add nothing, but do no harm.
  const std::array<Vector3, 1> point{Vector3::Zero()};
  EXPECT_EQ(turn_with_edges(Vector3::UnitZ(), point, vector(), point, vector()), Vector3::Zero());
  const std::array<Vector3, 1> along{Vector3::UnitX()};
  const Vector3 w = vector();
  EXPECT_EQ(turn_with_edges(Vector3::UnitZ(), along, w, along, vector()),
            turn_with_edges(Vector3::UnitZ(), along, w, {}, vector()));
}

TEST(SafeStep, IsExactForPureTranslation) {
  PairInstant pair;
  pair.a = {Matrix3::Identity(), Vector3::Zero(), Vector3::Zero(), Vector3::Zero()};
  pair.b = {Matrix3::Identity(), Vector3(5, 0, 0), Vector3(-1, 0, 0), Vector3::Zero()};
  pair.remaining = pair.horizon = 100;
  pair.linear_speed = 1;
  OrientedBox box;
  box.half_extents = Vector3(1, 1, 1);
  const SafeStep step = safe_step(pair, box, 2, box, 2, TurningNormal{Vector3::UnitX()}, 0.5);
  EXPECT_NEAR(step.gap, 2.5, 1e-12);
  EXPECT_NEAR(step.time, 2.5, 1e-9);
  EXPECT_LE(step.time, 2.5);
}

TEST(SafeStep, IsUnlimitedWhenThePairRecedes) {
  PairInstant pair;
  pair.a = {Matrix3::Identity(), Vector3::Zero(), Vector3::Zero(), Vector3::Zero()};
  pair.b = {Matrix3::Identity(), Vector3(5, 0, 0), Vector3(1, 0, 0), Vector3::Zero()};
  pair.remaining = pair.horizon = 100;
  pair.linear_speed = 1;
  OrientedBox box;
  box.half_extents = Vector3(1, 1, 1);
  EXPECT_EQ(safe_step(pair, box, 2, box, 2, TurningNormal{Vector3::UnitX()}, 0.5).time, kInfinity);
}

TEST(SafeStep, TakesNoStepWithoutAGapOrWithInfiniteBounds) {
  PairInstant pair;
  pair.a = {Matrix3::Identity(), Vector3::Zero(), Vector3::Zero(), Vector3::Zero()};
  pair.b = {Matrix3::Identity(), Vector3(5, 0, 0), Vector3(-1, 0, 0), Vector3::Zero()};
  pair.remaining = pair.horizon = 100;
  pair.linear_speed = kInfinity;
  pair.linear_acceleration = kInfinity;
  pair.angular_acceleration_a = kInfinity;
  OrientedBox box;
  box.half_extents = Vector3(1, 1, 1);
  EXPECT_EQ(safe_step(pair, box, 0, box, 2, TurningNormal{Vector3::UnitX()}, 0.5).time, 0);
  pair.linear_speed = 1;
  EXPECT_EQ(safe_step(pair, box, 2, box, 2, TurningNormal{Vector3::UnitX()}, 4.0).time, 0);
}

}  // namespace
}  // namespace dyop::toi_internal
