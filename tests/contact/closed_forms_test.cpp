#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "contact/all_contact_solvers.h"
#include "support/contact_scenes.h"

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
        // Down far enough for no corner to lift: the torque of friction, mu g h size_z / 2, is less
        // than that of the weight on the nearest edge.
        if (friction * size[2] > 0.6 * size.head<2>().minCoeff()) continue;
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

}  // namespace
}  // namespace dyop::testing
