// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/self_stress.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "dyop/contact/contact_solver.h"
#include "support/inputs/random_inputs.h"

namespace dyop {
namespace {

using namespace testing;
using dynamics_internal::find_self_stress;
using dynamics_internal::SelfStress;

ContactBody movable_body(Scalar mass, Scalar inertia) {
  ContactBody body;
  body.inverse_mass_W = Matrix3::Identity() / mass;
  body.inverse_inertia_W = Matrix3::Identity() / inertia;
  return body;
}

PointContact contact_of(std::size_t a, std::size_t b, const Vector3& r_b_W, const Vector3& nhat_W,
                        Scalar friction) {
  PointContact contact;
  contact.body_a = a;
  contact.body_b = b;
  contact.r_b_W = r_b_W;
  contact.nhat_AB_W = nhat_W;
  contact.friction = friction;
  return contact;
}

// Checks the proof by its own words: cones, balance on every movable body, work.
void expect_proof(const ContactProblem& problem, std::size_t movable, const SelfStress& stress) {
  std::vector<Vector3> force(movable, Vector3::Zero());
  std::vector<Vector3> torque(movable, Vector3::Zero());
  Scalar work = 0;
  Scalar largest = 0;
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    const PointContact& contact = problem.contacts[i];
    const Vector3& impulse = stress.impulses_W[i];
    const Scalar normal = impulse.dot(contact.nhat_AB_W);
    largest = std::max(largest, impulse.norm());
    EXPECT_LE((impulse - normal * contact.nhat_AB_W).norm(),
              contact.friction * normal * (1 + 1e-12) + 1e-12);
    work -= contact.target * normal;
    const Vector3& angular = stress.angular_impulses_W[i];
    const Scalar spin = angular.dot(contact.nhat_AB_W);
    EXPECT_LE(std::abs(spin), contact.torsional_friction * normal * (1 + 1e-12) + 1e-12);
    EXPECT_LE((angular - spin * contact.nhat_AB_W).norm(),
              contact.rolling_friction * normal * (1 + 1e-12) + 1e-12);
    const auto act = [&](std::size_t body, const Vector3& r_W, Scalar sign) {
      if (body < movable) {
        force[body] += sign * impulse;
        torque[body] += sign * (r_W.cross(impulse) + angular);
      } else {
        const ContactBody& given = problem.bodies[body];
        work += sign * (impulse.dot(given.free_v_W + given.free_w_W.cross(r_W)) +
                        angular.dot(given.free_w_W));
      }
    };
    act(contact.body_a, contact.r_a_W, -1);
    act(contact.body_b, contact.r_b_W, 1);
  }
  EXPECT_LT(work, 0);
  for (std::size_t i = 0; i < movable; ++i) {
    EXPECT_LT(force[i].norm(), 1e-4 * largest);
    EXPECT_LT(torque[i].norm(), 1e-4 * largest);
  }
}

// A body that two planes touch; their normals make the angle of the wedge with each other's
// opposite. The line between the two contacts of a ball makes half of it with both.
ContactProblem wedge(Scalar angle, Scalar friction, const Matrix3& R, Scalar closing) {
  ContactProblem problem;
  problem.bodies = {movable_body(3, 0.02), ContactBody(), ContactBody()};
  const Vector3 floor = R * Vector3::UnitZ();
  const Vector3 plate = R * Vector3(std::sin(angle), 0, -std::cos(angle));
  problem.bodies[2].free_v_W = closing * plate;
  problem.contacts = {contact_of(1, 0, -0.2 * floor, floor, friction),
                      contact_of(2, 0, -0.2 * plate, plate, friction)};
  return problem;
}

TEST(SelfStress, LocksABallInAWedgeBelowTheFrictionAngleOnly) {
  std::mt19937_64 random(1);
  for (const Scalar degrees : {1.0, 10.0, 40.0, 75.0, 120.0}) {
    const Scalar angle = degrees * std::numbers::pi / 180;
    const Scalar limit = std::tan(angle / 2);
    const Matrix3 R = random_rotation(random).toRotationMatrix();
    const ContactProblem locked = wedge(angle, 1.001 * limit, R, 1e-3);
    const auto stress = find_self_stress(locked, 1);
    ASSERT_TRUE(stress) << degrees;
    EXPECT_EQ(stress->hardest_contact, 1u);
    expect_proof(locked, 1, *stress);
    EXPECT_FALSE(find_self_stress(wedge(angle, 0.999 * limit, R, 1e-3), 1)) << degrees;
    EXPECT_FALSE(find_self_stress(wedge(angle, 1.001 * limit, R, -1e-3), 1)) << "it opens";
  }
}

// A ball between a floor and a ceiling that slides or spins: it rolls or spins along, unless it
// resists that, however little.
TEST(SelfStress, CountsRollingAndTorsionalFriction) {
  std::mt19937_64 random(7);
  for (const bool spins : {false, true}) {
    for (const Scalar resistance : {0.0, 1e-3, 0.1}) {
      const Matrix3 R = random_rotation(random).toRotationMatrix();
      const Vector3 up = R * Vector3::UnitZ();
      ContactProblem problem;
      problem.bodies = {movable_body(3, 0.02), ContactBody(), ContactBody()};
      problem.contacts = {contact_of(1, 0, -0.2 * up, up, 0.5),
                          contact_of(2, 0, 0.2 * up, -up, 0.5)};
      (spins ? problem.bodies[2].free_w_W : problem.bodies[2].free_v_W) = R * Vector3::UnitZ();
      if (!spins) problem.bodies[2].free_v_W = R * Vector3::UnitX();
      for (PointContact& contact : problem.contacts) {
        (spins ? contact.torsional_friction : contact.rolling_friction) = resistance;
      }
      const auto stress = find_self_stress(problem, 1);
      EXPECT_EQ(stress.has_value(), resistance > 0) << spins << ' ' << resistance;
      if (stress) expect_proof(problem, 1, *stress);
    }
  }
}

// Just short of a lock there is none, but impulses nearly balance.
TEST(SelfStress, NearlyLocksABallInAWedgeJustShortOfTheFrictionAngle) {
  for (const Scalar degrees : {10.0, 40.0, 75.0}) {
    const Scalar angle = degrees * std::numbers::pi / 180;
    const Scalar limit = std::tan(angle / 2);
    const ContactProblem nearly = wedge(angle, (1 - 1e-4) * limit, Matrix3::Identity(), 1e-3);
    EXPECT_FALSE(find_self_stress(nearly, 1)) << degrees;
    EXPECT_TRUE(find_self_stress(nearly, 1, 1e-3)) << degrees;
    EXPECT_FALSE(find_self_stress(wedge(angle, 0.9 * limit, Matrix3::Identity(), 1e-3), 1, 1e-3));
    EXPECT_FALSE(
        find_self_stress(wedge(angle, (1 - 1e-4) * limit, Matrix3::Identity(), -1e-3), 1, 1e-3))
        << "it opens";
  }
}

// Targets ask for work as prescribed motions do. However much faster they are, what does not
// balance is no proof: below the friction angle a ball can leave the wedge at any speed.
TEST(SelfStress, IsNotFoundBecauseTargetsAreFast) {
  const Scalar angle = std::numbers::pi / 6;
  const Scalar limit = std::tan(angle / 2);
  for (const Scalar target : {1e-3, 1.0, 1e3, 1e6, 1e9}) {
    for (const Scalar part : {0.9, 0.999, 1.001}) {
      ContactProblem problem = wedge(angle, part * limit, Matrix3::Identity(), 1e-3);
      for (PointContact& contact : problem.contacts) contact.target = target;
      const auto stress = find_self_stress(problem, 1);
      EXPECT_EQ(stress.has_value(), part > 1) << target << ' ' << part;
      if (stress) expect_proof(problem, 1, *stress);
      problem.bodies[2].free_v_W.setZero();
      EXPECT_FALSE(find_self_stress(problem, 1)) << "nothing moves";
    }
  }
}

TEST(SelfStress, CountsAnEllipseWithItsSmallerCoefficientAndALawAsNone) {
  const Scalar angle = std::numbers::pi / 6;
  const Scalar limit = std::tan(angle / 2);
  for (const Scalar along : {0.9, 1.1}) {
    for (const Scalar across : {0.9, 1.1}) {
      ContactProblem problem = wedge(angle, along * limit, Matrix3::Identity(), 1e-3);
      for (PointContact& contact : problem.contacts) {
        contact.ellipse = FrictionEllipse{Vector3::UnitY(), across * limit};
      }
      EXPECT_EQ(find_self_stress(problem, 1).has_value(), along > 1 && across > 1)
          << along << ' ' << across;
    }
  }
  ContactProblem problem = wedge(angle, 2 * limit, Matrix3::Identity(), 1e-3);
  EXPECT_TRUE(find_self_stress(problem, 1));
  problem.friction_law = [&](std::size_t, const Vector3&) { return 2 * limit; };
  EXPECT_FALSE(find_self_stress(problem, 1));
}

// A rod across a slot between two parallel walls, of which one slides. It reaches `along` the slot
// for 1 across it, and locks if friction exceeds that, but only where the wall pulls it upright.
ContactProblem slot(Scalar along, Scalar friction, Scalar pull, Scalar size = 1) {
  ContactProblem problem;
  problem.bodies = {movable_body(3, 0.02 * size * size), ContactBody(), ContactBody()};
  problem.bodies[2].free_v_W = Vector3(pull, 0, 0);
  const Vector3 end = size * Vector3(along / 2, 0, 0.5);
  problem.contacts = {contact_of(1, 0, -end, Vector3::UnitZ(), friction),
                      contact_of(2, 0, end, -Vector3::UnitZ(), friction)};
  return problem;
}

// At any size: a torque counts over the lever arms at hand, not over the unit of length.
TEST(SelfStress, LocksARodInASlotWhereTheWallPullsItUpright) {
  for (const Scalar size : {1e-7, 1.0, 1e7}) {
    for (const Scalar along : {0.1, 0.5, 1.5}) {
      for (const Scalar part : {0.999, 1.001}) {
        for (const Scalar pull : {-1.0, 1.0}) {
          const ContactProblem problem = slot(along, part * along, pull * size, size);
          const auto stress = find_self_stress(problem, 1);
          EXPECT_EQ(stress.has_value(), part > 1 && pull < 0)
              << size << " " << along << " " << part << " " << pull;
          if (stress) expect_proof(problem, 1, *stress);
        }
      }
    }
  }
}

// A surface that moves along itself, as a belt does, pulls like a wall that slides.
TEST(SelfStress, CountsWhereAContactWantsToStick) {
  for (const Scalar pull : {-1.0, 1.0}) {
    for (const Scalar belt : {-3.0, 0.0, 3.0}) {
      ContactProblem problem = slot(0.5, 0.6, pull);
      problem.contacts[1].sticking_velocity_W = Vector3(belt, 0, 0);
      EXPECT_EQ(find_self_stress(problem, 1).has_value(), pull + belt < 0) << pull << " " << belt;
    }
  }
}

// A plate that comes down on a body which a row of a joint holds from below; or up, and from above.
TEST(SelfStress, TakesImpulsesOfRigidRowsAlongThoseOfTheirSignsThatHaveNoBound) {
  const auto locks = [](Scalar lower, Scalar upper, Scalar compliance, Scalar up = -1) {
    ContactProblem problem;
    problem.bodies = {movable_body(3, 0.02), ContactBody(), ContactBody()};
    problem.bodies[2].free_v_W = up * Vector3::UnitZ();
    problem.contacts = {contact_of(2, 0, Vector3(0, 0, -0.2 * up), up * Vector3::UnitZ(), 0)};
    JointRow row;
    row.body_a = 1;
    row.body_b = 0;
    row.j_av_W = -Vector3::UnitZ();
    row.j_bv_W = Vector3::UnitZ();
    row.lower = lower;
    row.upper = upper;
    row.compliance = compliance;
    problem.rows = {row};
    return find_self_stress(problem, 1).has_value();
  };
  EXPECT_TRUE(locks(-kInfinity, kInfinity, 0));
  EXPECT_TRUE(locks(0, kInfinity, 0));
  EXPECT_FALSE(locks(-kInfinity, 0, 0)) << "it pulls down only";
  EXPECT_TRUE(locks(-kInfinity, 0, 0, 1));
  EXPECT_FALSE(locks(0, kInfinity, 0, 1)) << "it pushes up only";
  EXPECT_FALSE(locks(-1e6, 1e6, 0)) << "a motor";
  EXPECT_FALSE(locks(-kInfinity, kInfinity, 1e-9)) << "a spring";
}

// Bodies between moving ones, at random: what is found is a proof, and where nothing is found the
// problem has a solution.
TEST(SelfStress, IsFoundWhereNothingSolvesTheContacts) {
  std::mt19937_64 random(7);
  int found = 0;
  int unsolved = 0;
  constexpr int kProblems = 400;
  for (int k = 0; k < kProblems; ++k) {
    ContactProblem problem;
    const auto movable = std::size_t(1 + random_index(3, random));
    for (std::size_t i = 0; i < movable; ++i) {
      problem.bodies.push_back(movable_body(random_number(0.5, 2, random), 0.1));
    }
    problem.bodies.resize(movable + 2);
    problem.bodies[movable].free_v_W = random_vector(1, random);
    problem.bodies[movable].free_w_W = random_vector(1, random);
    const int contacts = 2 + random_index(5, random);
    for (int i = 0; i < contacts; ++i) {
      const auto b = std::size_t(random_index(int(movable), random));
      auto a = std::size_t(random_index(int(movable + 2), random));
      if (a == b) a = movable;
      PointContact contact = contact_of(a, b, random_vector(0.3, random), random_direction(random),
                                        random_number(0, 1, random));
      contact.r_a_W = random_vector(0.3, random);
      problem.contacts.push_back(contact);
    }
    const auto stress = find_self_stress(problem, movable);
    ContactCascade solver;
    ContactSolverOptions options;
    options.tolerance = 1e-7;
    const bool is_solved = solver.solve(problem, options).status == ContactStatus::Converged;
    if (stress) {
      ++found;
      expect_proof(problem, movable, *stress);
    } else {
      unsolved += is_solved ? 0 : 1;
    }
  }
  EXPECT_GT(found, kProblems / 20);  // recorded: 26
  EXPECT_LT(found, kProblems / 2);
  EXPECT_EQ(unsolved, 0);
}

}  // namespace
}  // namespace dyop
