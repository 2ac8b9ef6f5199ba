#include "dynamics/impact_law.h"

#include <gtest/gtest.h>

#include <random>

#include "dyop/core/rigid_pose.h"

namespace dyop::internal {
namespace {

ImpactBody ball(const Vector3& p, const Vector3& v, const Vector3& w, Scalar mass, Scalar radius) {
  const Scalar inertia = 0.4 * mass * radius * radius;
  return {1 / mass, Matrix3::Identity() / inertia, p, v, w};
}

ImpactBody support() {
  return {};
}

ImpactPoint touch(std::size_t a, std::size_t b, const Vector3& p, const Vector3& n, Scalar e,
                  Scalar mu) {
  ImpactPoint point;
  point.a = a;
  point.b = b;
  point.p_WCa = point.p_WCb = p;
  point.nhat_AB_W = n;
  point.restitution = e;
  point.friction = mu;
  return point;
}

TEST(ImpactLaw, ExchangesVelocitiesOfEqualBalls) {
  std::vector<ImpactBody> bodies{ball({0, 0, 0}, {3, 0, 0}, {0, 0, 0}, 2, 1),
                                 ball({2, 0, 0}, {-1, 0, 0}, {0, 0, 0}, 2, 1)};
  std::vector<ImpactPoint> points{touch(0, 1, {1, 0, 0}, {1, 0, 0}, 1, 0)};
  resolve_impact(bodies, points);
  EXPECT_NEAR(bodies[0].v_WBcm.x(), -1, 1e-12);
  EXPECT_NEAR(bodies[1].v_WBcm.x(), 3, 1e-12);
  EXPECT_NEAR(points[0].normal_velocity, -4, 1e-12);
  EXPECT_NEAR(points[0].impulse_W.x(), 8, 1e-12);
}

TEST(ImpactLaw, BouncesOffAFloorWithTheCoefficient) {
  std::vector<ImpactBody> bodies{support(), ball({0, 0, 1}, {0, 0, -2}, {0, 0, 0}, 3, 1)};
  std::vector<ImpactPoint> points{touch(0, 1, {0, 0, 0}, {0, 0, 1}, 0.5, 0.3)};
  resolve_impact(bodies, points);
  EXPECT_LT((bodies[1].v_WBcm - Vector3(0, 0, 1)).norm(), 1e-12);
  EXPECT_TRUE(bodies[0].v_WBcm.isZero(0));
}

TEST(ImpactLaw, RollsOrSlidesAsCoulombSays) {
  // Ball of radius 1 with tangential speed u, no spin: sticking needs the impulse (2/7) m u, as
  // dv = J/m and r dw = J r^2 / (0.4 m r^2) = 2.5 J/m must sum to u.
  const Scalar u = 1;
  const auto run = [&](Scalar mu) {
    std::vector<ImpactBody> bodies{support(), ball({0, 0, 1}, {u, 0, -2}, {0, 0, 0}, 1, 1)};
    std::vector<ImpactPoint> points{touch(0, 1, {0, 0, 0}, {0, 0, 1}, 0, mu)};
    resolve_impact(bodies, points);
    return bodies[1];
  };
  const ImpactBody sticking = run(1);
  EXPECT_NEAR(sticking.v_WBcm.x(), u - 2.0 / 7 * u, 1e-12);
  EXPECT_NEAR(sticking.v_WBcm.x() - sticking.w_WB.y(), 0, 1e-12);  // v + w x r at the contact
  const ImpactBody sliding = run(0.1);                             // friction impulse mu * 2 m
  EXPECT_NEAR(sliding.v_WBcm.x(), u - 0.2, 1e-12);
}

TEST(ImpactLaw, LandsABoxFlatOnItsFourCorners) {
  std::vector<ImpactBody> bodies{support(), ball({0, 0, 0.5}, {0, 0, -3}, {0, 0, 0}, 2, 1)};
  std::vector<ImpactPoint> points;
  for (const Scalar x : {-1, 1}) {
    for (const Scalar y : {-1, 1}) points.push_back(touch(0, 1, {x, y, 0}, {0, 0, 1}, 0.5, 0.4));
  }
  // Redundant copies must not change the answer.
  for (int copy = 0; copy < 25; ++copy) {
    for (int k = 0; k < 4; ++k) points.push_back(points[static_cast<std::size_t>(k)]);
  }
  const ImpactOutcome outcome = resolve_impact(bodies, points);
  EXPECT_LT(outcome.residual, 1e-9);
  EXPECT_NEAR(bodies[1].v_WBcm.z(), 1.5, 1e-9);
  EXPECT_LT(bodies[1].w_WB.norm(), 1e-9);
}

TEST(ImpactLaw, DoesNothingWithoutPointsOrBetweenImmovableBodies) {
  std::vector<ImpactBody> bodies{support(), support()};
  std::vector<ImpactPoint> none;
  EXPECT_EQ(resolve_impact(bodies, none).residual, 0);
  std::vector<ImpactPoint> points{touch(0, 1, {0, 0, 0}, {0, 0, 1}, 0.5, 0.3)};
  EXPECT_EQ(resolve_impact(bodies, points).residual, 0);
}

Scalar energy_of(const std::vector<ImpactBody>& bodies) {
  Scalar energy = 0;
  for (const ImpactBody& body : bodies) {
    if (body.inverse_mass == 0) continue;
    energy += 0.5 * body.v_WBcm.squaredNorm() / body.inverse_mass +
              0.5 * body.w_WB.dot(body.inverse_inertia_W.inverse() * body.w_WB);
  }
  return energy;
}

TEST(ImpactLaw, KeepsItsPromisesOnRandomPiles) {
  std::mt19937_64 random(17);
  std::normal_distribution<Scalar> normal;
  std::uniform_real_distribution<Scalar> uniform(0, 1);
  const auto vector = [&] { return Vector3(normal(random), normal(random), normal(random)); };
  for (int trial = 0; trial < 3000; ++trial) {
    const std::size_t count = 2 + static_cast<std::size_t>(trial % 4);
    std::vector<ImpactBody> bodies;
    Scalar speed = 0;
    for (std::size_t i = 0; i < count; ++i) {
      ImpactBody body = ball(vector(), vector(), vector(), 0.2 + uniform(random), 1);
      const Matrix3 R = rotation_from_vector(vector());
      body.inverse_inertia_W =
          R * Vector3(1 + uniform(random), 1 + uniform(random), 1 + uniform(random)).asDiagonal() *
          R.transpose();
      if (i == 0 && trial % 2) body = support();
      speed += body.v_WBcm.norm() + body.w_WB.norm();
      bodies.push_back(body);
    }
    std::vector<ImpactPoint> points;
    for (std::size_t i = 1; i < count; ++i) {
      for (int k = 0; k < 1 + trial % 3; ++k) {
        points.push_back(
            touch(i - 1, i, vector(), vector().normalized(), uniform(random), 2 * uniform(random)));
      }
    }
    Vector3 momentum = Vector3::Zero();
    Vector3 angular = Vector3::Zero();
    const auto add_momenta = [&](Scalar sign) {
      for (const ImpactBody& body : bodies) {
        if (body.inverse_mass == 0) continue;
        const Vector3 p = body.v_WBcm / body.inverse_mass;
        momentum += sign * p;
        angular += sign * (body.p_WBcm.cross(p) + body.inverse_inertia_W.inverse() * body.w_WB);
      }
    };
    const Scalar before = energy_of(bodies);
    const bool is_free = bodies[0].inverse_mass > 0;
    add_momenta(-1);
    const ImpactOutcome outcome = resolve_impact(bodies, points);
    add_momenta(1);
    EXPECT_LE(outcome.residual, 1e-6 * speed) << trial;
    EXPECT_LE(energy_of(bodies), before * (1 + 1e-9)) << trial;
    if (is_free) {
      EXPECT_LT(momentum.norm(), 1e-10 * speed) << trial;
      EXPECT_LT(angular.norm(), 1e-9 * speed) << trial;
    } else {
      EXPECT_TRUE(bodies[0].v_WBcm.isZero(0));
    }
    for (const ImpactPoint& point : points) {
      const Scalar along = point.impulse_W.dot(point.nhat_AB_W);
      const Scalar across = (point.impulse_W - along * point.nhat_AB_W).norm();
      EXPECT_GE(along, -1e-12);
      EXPECT_LE(across, point.friction * along * (1 + 1e-9) + 1e-12);
    }
  }
}

}  // namespace
}  // namespace dyop::internal
