// SPDX-License-Identifier: BSD-3-Clause

// A piano through a narrow slot in a thin wall, by OMPL's RRTConnect: once with OMPL's own motion
// validator, which looks at single states, and once with dyop's, which proves what is between them.
#include <dyop/dyop.h>
#include <dyop/ompl/ompl_motion_validator.h>
#include <ompl/base/spaces/SE3StateSpace.h>
#include <ompl/base/terminationconditions/IterationTerminationCondition.h>
#include <ompl/geometric/SimpleSetup.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include <cstdio>

namespace ob = ompl::base;
using Box = dyop::Box;
using dyop::RigidPose;
using dyop::Vector3;

// Two millimetres thick, two metres wide and high, with a slot of 8 by 8 centimetres.
std::shared_ptr<const dyop::ObstacleSet> wall_with_slot() {
  auto set = std::make_shared<dyop::ObstacleSet>();
  const auto side = std::make_shared<Box>(Vector3(0.001, 0.48, 1));
  const auto cover = std::make_shared<Box>(Vector3(0.001, 0.04, 0.48));
  for (const double sign : {1.0, -1.0}) {
    set->add(side, RigidPose(Vector3(0, sign * 0.52, 0)));
    set->add(cover, RigidPose(Vector3(0, 0, sign * 0.52)));
  }
  return set;
}

// An L, 3 centimetres long.
std::shared_ptr<const dyop::Shape> piano() {
  return std::make_shared<dyop::CompoundShape>(std::vector<dyop::CompoundChild>{
      {std::make_shared<Box>(Vector3(0.015, 0.004, 0.004)), RigidPose(Vector3(0, 0, -0.006))},
      {std::make_shared<Box>(Vector3(0.004, 0.004, 0.006)), RigidPose(Vector3(-0.011, 0, 0.004))}});
}

struct Count {
  int solved = 0;
  int through_the_wall = 0;
};

Count plan(bool with_proof, int runs) {
  const auto space = std::make_shared<ob::SE3StateSpace>();
  ob::RealVectorBounds bounds(3);
  bounds.setLow(-1);
  bounds.setHigh(1);
  space->setBounds(bounds);
  Count count;
  for (int run = 0; run < runs; ++run) {
    ob::IterationTerminationCondition limit(20000);
    ompl::geometric::SimpleSetup setup(space);
    const auto si = setup.getSpaceInformation();
    const auto proof = std::make_shared<dyop::OmplMotionValidator>(si, piano(), wall_with_slot());
    setup.setStateValidityChecker([proof](const ob::State* s) { return proof->is_valid(s); });
    if (with_proof) si->setMotionValidator(proof);
    ob::ScopedState<ob::SE3StateSpace> start(space), goal(space);
    start->setXYZ(-0.5, 0.3, 0.2);
    start->rotation().setIdentity();
    goal->setXYZ(0.5, -0.2, 0.1);
    goal->rotation().setIdentity();
    setup.setStartAndGoalStates(start, goal);
    setup.setPlanner(std::make_shared<ompl::geometric::RRTConnect>(si));
    if (setup.solve(limit) != ob::PlannerStatus::EXACT_SOLUTION) continue;
    ++count.solved;
    const std::vector<ob::State*>& states = setup.getSolutionPath().getStates();
    bool is_clear = true;
    for (std::size_t i = 0; i + 1 < states.size(); ++i)
      is_clear = is_clear && proof->checkMotion(states[i], states[i + 1]);
    count.through_the_wall += !is_clear;
  }
  return count;
}

int main() {
  ompl::msg::noOutputHandler();
  ompl::RNG::setSeed(1);
  const Count sampled = plan(false, 6);
  std::printf("OMPL's validator: %d of 6 runs solved, %d paths go through the wall\n",
              sampled.solved, sampled.through_the_wall);
  const Count proven = plan(true, 6);
  std::printf("dyop's validator: %d of 6 runs solved, %d paths go through the wall\n",
              proven.solved, proven.through_the_wall);
}
// Prints:
// OMPL's validator: 6 of 6 runs solved, 5 paths go through the wall
// dyop's validator: 6 of 6 runs solved, 0 paths go through the wall
