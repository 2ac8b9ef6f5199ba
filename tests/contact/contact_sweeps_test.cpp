// SPDX-License-Identifier: BSD-3-Clause
#include "contact/solver/contact_sweeps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "support/inputs/contact_scenes.h"
#include "support/inputs/random_inputs.h"
#include "support/runnable_sets.h"

namespace dyop::contact_internal {
namespace {

using dyop::testing::random_index;
using dyop::testing::random_number;

// Bodies and normals of a random problem, but all bodies balls that touch: nothing is coupled.
void make_balls(ContactProblem& problem) {
  for (ContactBody& body : problem.bodies) {
    body.inverse_inertia_W = 2.5 * body.inverse_mass_W(0, 0) * Matrix3::Identity();
    body.inverse_mass_W = body.inverse_mass_W(0, 0) * Matrix3::Identity();
  }
  for (PointContact& contact : problem.contacts) {
    contact.r_a_W = contact.r_a_W.norm() * contact.nhat_AB_W;
    contact.r_b_W = -contact.r_b_W.norm() * contact.nhat_AB_W;
  }
}

// Every third problem of balls, every third with some balls, at sizes from 1e-4 to 1e4.
ContactProblem random_problem(int number, std::mt19937_64& random) {
  testing::RandomContacts wanted;
  wanted.bodies = 12 + random_index(40, random);
  wanted.contacts = wanted.bodies / 2 + random_index(wanted.bodies, random);
  const Scalar size = std::pow(10.0, number % 9 - 4);
  wanted.length = size;
  wanted.speed = number % 2 == 0 ? 1 : size;
  wanted.has_degenerates = number % 4 == 0;
  ContactProblem problem = testing::random_contact_problem(wanted, random);
  if (number % 3 == 0) make_balls(problem);
  if (number % 3 == 1) {
    for (std::size_t i = 0; i < problem.contacts.size(); i += 2) {
      problem.contacts[i].r_a_W = problem.contacts[i].r_b_W = Vector3::Zero();
    }
  }
  return problem;
}

void relax_one(ContactSystem& system, Block& block) {
  const Vector3 q = system.relative_velocity(block) - block.W * block.lambda;
  const Vector3 change = block.local.solve(q, block.friction, block.slip) - block.lambda;
  block.lambda += change;
  if (block.slot_a >= 0) {
    system.velocities()[std::size_t(block.slot_a)] += block.G_a.transpose() * change;
  }
  if (block.slot_b >= 0) {
    system.velocities()[std::size_t(block.slot_b)] += block.G_b.transpose() * change;
  }
}

Scalar largest_speed(const ContactSystem& system) {
  Scalar largest = 0;
  for (const Block& block : system.blocks()) largest = std::max(largest, block.free.norm());
  return largest;
}

// The largest difference of two systems' impulses, as velocities.
Scalar difference(const ContactSystem& x, const ContactSystem& y) {
  Scalar largest = 0;
  for (std::size_t i = 0; i < x.blocks().size(); ++i) {
    const Vector3 change = x.blocks()[i].lambda - y.blocks()[i].lambda;
    largest = std::max(largest, x.blocks()[i].weight * change.norm());
  }
  return largest;
}

TEST(ContactSweeps, DoWhatOneContactAfterTheOtherDoes) {
  std::mt19937_64 random(53);
  int together = 0;
  constexpr int kProblems = 180;
  for (int i = 0; i < kProblems; ++i) {
    ContactSystem one, many;
    one.build(random_problem(i, random));
    many = one;
    ContactSweeps sweeps;
    if (!sweeps.begin(many)) continue;
    ++together;
    for (int k = 0; k < 3; ++k) {
      for (Block& block : one.blocks()) relax_one(one, block);
      for (auto block = one.blocks().rbegin(); block != one.blocks().rend(); ++block) {
        relax_one(one, *block);
      }
      sweeps.sweep();
    }
    sweeps.write(many);
    const Scalar noise = 1e-9 * largest_speed(one);
    EXPECT_LE(difference(one, many), noise) << "problem " << i;
    EXPECT_NEAR(one.residual(), many.residual(), noise) << "problem " << i;
    EXPECT_NEAR(sweeps.residual(), many.residual(), noise) << "problem " << i;
    many.update_velocities();  // velocities are those of the impulses
    EXPECT_NEAR(sweeps.residual(), many.residual(), noise) << "problem " << i;
  }
  EXPECT_GT(together, kProblems / 2);
}

TEST(ContactSweeps, EveryInstructionSetGivesTheSameBits) {
  std::mt19937_64 random(54);
  for (int i = 0; i < 40; ++i) {
    ContactSystem start;
    start.build(random_problem(i, random));
    std::optional<ContactSystem> first;
    for (const InstructionSet set : testing::runnable_sets()) {
      ContactSystem system = start;
      ContactSweeps sweeps(set);
      if (!sweeps.begin(system)) break;
      for (int k = 0; k < 10; ++k) {
        sweeps.sweep();
        sweeps.accelerate();
      }
      sweeps.write(system);
      if (!first) first = system;
      EXPECT_EQ(difference(*first, system), 0) << "problem " << i;
      EXPECT_EQ(first->velocities(), system.velocities()) << "problem " << i;
    }
  }
}

TEST(ContactSweeps, ConjugateDirectionsConvergeFaster) {
  ContactSystem system;
  system.build(testing::pile_scene(4, 4));
  const auto residual_after = [&](bool is_accelerated) {
    ContactSweeps sweeps;
    EXPECT_TRUE(sweeps.begin(system));
    for (int k = 0; k < 60; ++k) {
      sweeps.sweep();
      if (is_accelerated && k + 1 < 60) sweeps.accelerate();
    }
    return sweeps.residual();
  };
  EXPECT_LT(residual_after(true), 0.5 * residual_after(false));
}

TEST(ContactSweeps, ANumberThatIsNoneGivesAResidualThatIsNone) {
  ContactSystem system;
  system.build(testing::pile_scene(3, 3));
  system.velocities()[5][2] = std::numeric_limits<Scalar>::quiet_NaN();
  ContactSweeps sweeps;
  ASSERT_TRUE(sweeps.begin(system));
  EXPECT_FALSE(sweeps.residual() <= 1e9);
}

// Joints' rows, and a column, whose contacts all wait for one another.
TEST(ContactSweeps, AreNotForEverySystem) {
  ContactSweeps sweeps;
  ContactProblem problem = testing::pile_scene(3, 3);
  ContactSystem system;
  system.build(problem);
  EXPECT_TRUE(sweeps.begin(system));
  problem.contacts[0].rolling_friction = 0.1;
  system.build(problem);
  EXPECT_FALSE(sweeps.begin(system));
  system.build(testing::stack_scene(10));
  EXPECT_FALSE(sweeps.begin(system));
}

}  // namespace
}  // namespace dyop::contact_internal
