// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "contact/all_contact_solvers.h"
#include "dyop/contact/contact_problem.h"
#include "support/inputs/contact_scenes.h"
#include "support/oracles/contact_oracle.h"

namespace dyop::testing {
namespace {

constexpr Scalar kGravity = 9.81;
constexpr Scalar kStep = 0.01;

template <typename Solver>
class ClosedForms : public ::testing::Test {
 protected:
  ContactReport solve(ContactProblem& problem) {
    ContactSolverOptions options;
    options.tolerance = 1e-12;
    options.sweep_limit = 2000;
    options.few_sweep_limit = 2000;
    return solver_.solve(problem, options);
  }
  Solver solver_;
};
TYPED_TEST_SUITE(ClosedForms, AllContactSolvers);

// One step of a body that slides on a plane slows down by friction * g * h, however it is turned.
TYPED_TEST(ClosedForms, SlidingBodiesSlowDownByFrictionWithoutYaw) {
  for (const Vector3& size : {Vector3(0.4, 0.4, 0.02), Vector3(1, 1, 1), Vector3(2, 0.1, 0.1)}) {
    for (const Scalar degrees : {0, 15, 45, 80}) {
      for (const Scalar friction : {0.1, 0.3, 0.5}) {
        ContactProblem problem = box_on_plane(size, 2, degrees * std::numbers::pi / 180, friction,
                                              Vector3(2, 0, -kGravity * kStep));
        const ContactReport report = this->solve(problem);
        ASSERT_EQ(report.status, ContactStatus::Converged) << report.residual;
        const ContactBody& body = problem.bodies[1];
        EXPECT_NEAR(body.v_W[0], 2 - friction * kGravity * kStep, 1e-10) << degrees;
        EXPECT_NEAR(body.v_W[1], 0, 1e-10);
        EXPECT_NEAR(body.w_W.norm(), 0, 1e-9);
      }
    }
  }
}

// Below the cone's limit friction holds: the largest tangential speed it can take is mu g h.
TYPED_TEST(ClosedForms, SticksBelowTheCone) {
  for (const Scalar degrees : {0, 15, 45, 80}) {
    ContactProblem problem =
        box_on_plane(Vector3(0.4, 0.4, 0.02), 2, degrees * std::numbers::pi / 180, 0.5,
                     Vector3(0.49 * kGravity * kStep, 0, -kGravity * kStep));
    ASSERT_EQ(this->solve(problem).status, ContactStatus::Converged);
    EXPECT_LE(problem.bodies[1].v_W.norm(), 1e-11);
    EXPECT_LE(problem.bodies[1].w_W.norm(), 1e-11);
  }
}

// A cube pushed at its top with friction 1 tips over: the momentum about the resting edge. Before:
// velocity (v, 0, -g h); the two front corners stay. About their edge, with lever (-1/2, 1/2) to
// the centre and I = 1/6 + 1/2: angular momentum = 1/2 v - 1/2 g h.
TYPED_TEST(ClosedForms, TipsOverTheFrontEdge) {
  const Scalar v = 0.3;
  ContactProblem problem = box_on_plane(Vector3::Ones(), 1, 0, 2, Vector3(v, 0, -kGravity * kStep));
  ASSERT_EQ(this->solve(problem).status, ContactStatus::Converged);
  const Scalar spin = (v - kGravity * kStep) / 2 / (1.0 / 6 + 0.5);
  EXPECT_NEAR(problem.bodies[1].w_W[1], spin, 1e-9);
  EXPECT_NEAR(problem.bodies[1].v_W[0], spin / 2, 1e-9);
  EXPECT_NEAR(problem.bodies[1].v_W[2], spin / 2, 1e-9);
}

// A plate that counts as sticking when it goes along at 0.3: friction brings it there, or as near
// as it can in the step.
TYPED_TEST(ClosedForms, FrictionDrivesTowardsTheStickingVelocity) {
  for (const Scalar friction : {0.1, 0.5}) {
    ContactProblem problem =
        box_on_plane(Vector3(0.4, 0.4, 0.02), 2, 0.3, friction, Vector3(0, 0, -kGravity * kStep));
    const Scalar most = 0.3 * kGravity * kStep;
    for (PointContact& contact : problem.contacts) {
      contact.sticking_velocity_W = Vector3(0, most, 7);  // the normal part is ignored
    }
    ASSERT_EQ(this->solve(problem).status, ContactStatus::Converged);
    EXPECT_LE(contact_residual(problem), 1e-9);
    const Vector3 v(0, std::min(most, friction * kGravity * kStep), 0);
    EXPECT_LE((problem.bodies[1].v_W - v).norm(), 1e-10) << friction;
  }
}

// Newton's restitution as a target: equal masses exchange velocities; masses 1 and 3 meet the
// formulas of the elastic impact.
TYPED_TEST(ClosedForms, HeadOnImpactsAreElastic) {
  for (const Scalar mass : {1.0, 3.0, 1e6}) {
    ContactProblem problem;
    problem.bodies = {box_body(Vector3::Ones(), 1, Matrix3::Identity(), Vector3(2, 0, 0)),
                      box_body(Vector3::Ones(), mass, Matrix3::Identity(), Vector3::Zero())};
    PointContact contact;
    contact.body_b = 1;
    contact.r_a_W = Vector3(0.5, 0, 0);
    contact.r_b_W = Vector3(-0.5, 0, 0);
    contact.target = 2;  // e = 1
    contact.friction = 0.5;
    problem.contacts.push_back(contact);
    ASSERT_EQ(this->solve(problem).status, ContactStatus::Converged);
    EXPECT_NEAR(problem.bodies[0].v_W[0], 2 * (1 - mass) / (1 + mass), 1e-10);
    EXPECT_NEAR(problem.bodies[1].v_W[0], 4 / (1 + mass), 1e-10);
  }
}

// A cube on a face of friction 0.3 along x and 0.6 across, sliding at 45 degrees: |(p/0.3, q/0.6)|
// = N, and the impulse is normal to the ellipse: p / 0.3^2 : q / 0.6^2 = u_x : u_y.
TYPED_TEST(ClosedForms, AnEllipseOfFrictionDissipatesTheMost) {
  ContactProblem problem =
      box_on_plane(Vector3(1, 1, 0.1), 1, 0, 0.3, Vector3(5, 5, -kGravity * kStep));
  for (PointContact& contact : problem.contacts) {
    contact.ellipse = FrictionEllipse{Vector3(2, 0, 7), 0.6};
  }
  ASSERT_EQ(this->solve(problem).status, ContactStatus::Converged);
  const Vector3 v = problem.bodies[1].v_W;
  const Vector3 J = v - Vector3(5, 5, -kGravity * kStep);
  EXPECT_NEAR(std::hypot(J[0] / 0.3, J[1] / 0.6), kGravity * kStep, 1e-9);
  EXPECT_NEAR(J[0] / 0.09 * v[1], J[1] / 0.36 * v[0], 1e-8);
}

// Friction that falls with speed: mu(u) = 0.1 + 0.4 / (1 + |u|), one equation for the speed after.
TYPED_TEST(ClosedForms, ALawOfFrictionSeesTheSlidingSpeed) {
  ContactProblem problem =
      box_on_plane(Vector3(1, 1, 0.1), 1, 0, 0, Vector3(2, 0, -kGravity * kStep));
  problem.friction_law = [](std::size_t, const Vector3& sliding_W) {
    return 0.1 + 0.4 / (1 + sliding_W.norm());
  };
  ASSERT_EQ(this->solve(problem).status, ContactStatus::Converged);
  const Scalar v = problem.bodies[1].v_W[0];
  EXPECT_NEAR(v, 2 - (0.1 + 0.4 / (1 + v)) * kGravity * kStep, 1e-10);
}

// A ball of radius 1 (I = 2/5) on a plane. Rolling friction c takes the angular impulse c N off a
// rolling ball: with v = w r kept by friction, (7/5) dv = -c N.
TYPED_TEST(ClosedForms, RollingAndTorsionalFrictionSlowABall) {
  ContactProblem problem;
  ContactBody ball;
  ball.inverse_mass_W.setIdentity();
  ball.inverse_inertia_W = Matrix3::Identity() * 2.5;
  ball.free_v_W = Vector3(1, 0, -kGravity * kStep);
  ball.free_w_W = Vector3(0, 1, 3);
  problem.bodies = {ContactBody{}, ball};
  PointContact& contact = problem.contacts.emplace_back();
  contact.body_b = 1;
  contact.r_b_W = Vector3(0, 0, -1);
  contact.nhat_AB_W = Vector3::UnitZ();
  contact.friction = 0.5;
  contact.rolling_friction = 0.02;
  contact.torsional_friction = 0.01;
  ASSERT_EQ(this->solve(problem).status, ContactStatus::Converged);
  const Scalar normal = kGravity * kStep;
  EXPECT_NEAR(problem.bodies[1].v_W[0], 1 - 0.02 * normal / 1.4, 1e-10);
  EXPECT_NEAR(problem.bodies[1].w_W[1], 1 - 0.02 * normal / 1.4, 1e-10);
  EXPECT_NEAR(problem.bodies[1].w_W[2], 3 - 2.5 * 0.01 * normal, 1e-10);
}

// Painleve's rod: with large friction the normal mobility seen by a sliding point may be negative.
TYPED_TEST(ClosedForms, PainlevesRodGetsAnAnswerWithAFiniteResidual) {
  for (const Scalar degrees : {30, 45, 60, 75}) {
    const Scalar angle = degrees * std::numbers::pi / 180;
    const Matrix3 R = Eigen::AngleAxisd(angle, Vector3::UnitY()).toRotationMatrix();
    ContactProblem problem;
    problem.bodies = {ContactBody{},
                      box_body(Vector3(2, 0.01, 0.01), 1, R, Vector3(3, 0, -kGravity * kStep))};
    PointContact contact;
    contact.body_b = 1;
    contact.r_b_W = R * Vector3(1, 0, 0);
    contact.nhat_AB_W = Vector3::UnitZ();
    contact.friction = 3;
    problem.contacts.push_back(contact);
    const ContactReport report = this->solve(problem);
    EXPECT_TRUE(std::isfinite(report.residual));
    EXPECT_TRUE(problem.bodies[1].v_W.allFinite());
  }
}

}  // namespace
}  // namespace dyop::testing
