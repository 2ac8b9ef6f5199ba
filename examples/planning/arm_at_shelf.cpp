// SPDX-License-Identifier: BSD-3-Clause

// An arm takes its hand out of one compartment of a shelf and into another one. OMPL's RRTConnect
// plans with motions that dyop proves free; a World then plays the path, so that the recording also
// has the gaps. Usage: arm_at_shelf [RECORDING]
#include <dyop/chain/link_motion.h>
#include <dyop/dynamics/world.h>
#include <dyop/dyop.h>
#include <dyop/io/recording.h>
#include <dyop/ompl/ompl_motion_validator.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/base/terminationconditions/IterationTerminationCondition.h>
#include <ompl/geometric/PathSimplifier.h>
#include <ompl/geometric/SimpleSetup.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include <cstdio>
#include <optional>

namespace ob = ompl::base;
namespace og = ompl::geometric;
using dyop::Box;
using dyop::Capsule;
using dyop::CompoundChild;
using dyop::JointType;
using dyop::JointVector;
using dyop::RigidPose;
using dyop::Scalar;
using dyop::Vector3;

constexpr unsigned kJoints = 5;
constexpr Scalar kClearance = 0.005;
const Vector3 kTip_L(0, 0, 0.2);  // of the hand

std::shared_ptr<const dyop::Shape> at(Scalar z, std::shared_ptr<const dyop::Shape> shape) {
  return std::make_shared<dyop::CompoundShape>(
      std::vector<CompoundChild>{{std::move(shape), RigidPose(Vector3(0, 0, z))}});
}

std::shared_ptr<const dyop::KinematicChain> arm() {
  const auto finger = std::make_shared<Box>(Vector3(0.02, 0.008, 0.05));
  const auto hand = std::make_shared<dyop::CompoundShape>(std::vector<CompoundChild>{
      {std::make_shared<Box>(Vector3(0.03, 0.07, 0.025)), RigidPose(Vector3(0, 0, 0.07))},
      {finger, RigidPose(Vector3(0, 0.05, 0.145))},
      {finger, RigidPose(Vector3(0, -0.05, 0.145))}});
  const Vector3 y = Vector3::UnitY(), z = Vector3::UnitZ();
  const auto turn = JointType::Revolute;
  return std::make_shared<dyop::KinematicChain>(
      std::vector<dyop::Link>{{"base", at(0.1, std::make_shared<Box>(Vector3(0.14, 0.14, 0.1)))},
                              {"shoulder", at(0.11, std::make_shared<Capsule>(0.08, 0.02))},
                              {"upper arm", at(0.28, std::make_shared<Capsule>(0.06, 0.25))},
                              {"forearm", at(0.25, std::make_shared<Capsule>(0.05, 0.2))},
                              {"wrist", at(0.02, std::make_shared<Capsule>(0.045, 0.02))},
                              {"hand", hand}},
      std::vector<dyop::Joint>{
          {"j1", turn, "base", "shoulder", RigidPose(Vector3(0, 0, 0.21)), z, -3, 3},
          {"j2", turn, "shoulder", "upper arm", RigidPose(Vector3(0, 0, 0.15)), y, -2, 2},
          {"j3", turn, "upper arm", "forearm", RigidPose(Vector3(0, 0, 0.56)), y, -2.6, 2.6},
          {"j4", turn, "forearm", "wrist", RigidPose(Vector3(0, 0, 0.5)), z, -3, 3},
          {"j5", turn, "wrist", "hand", RigidPose(Vector3(0, 0, 0.06)), y, -2, 2}});
}

struct Board {
  const char* name;
  Vector3 half_extents;
  Vector3 p_W;
};

const std::vector<Board> kShelf{{"bottom", {0.2, 0.5, 0.01}, {0.75, 0, 0.32}},
                                {"middle", {0.2, 0.5, 0.01}, {0.75, 0, 0.72}},
                                {"top", {0.2, 0.5, 0.01}, {0.75, 0, 1.12}},
                                {"left", {0.2, 0.01, 0.56}, {0.75, 0.51, 0.57}},
                                {"right", {0.2, 0.01, 0.56}, {0.75, -0.51, 0.57}},
                                {"divider", {0.2, 0.01, 0.39}, {0.75, 0, 0.72}},
                                {"back", {0.01, 0.52, 0.56}, {0.97, 0, 0.57}}};

JointVector coordinates(const ob::State* state) {
  return Eigen::Map<const JointVector>(state->as<ob::RealVectorStateSpace::StateType>()->values,
                                       kJoints);
}

// A random free state in which the tip of the hand is within `reach` of a point of the world.
void sample_at(const Vector3& p_W, Scalar reach, const dyop::KinematicChain& chain,
               const ob::SpaceInformationPtr& si, ob::State* state) {
  const auto sampler = si->allocStateSampler();
  do {
    sampler->sampleUniform(state);
  } while ((chain.link_poses(coordinates(state)).back() * kTip_L - p_W).norm() > reach ||
           !si->isValid(state));
}

std::optional<dyop::JointPath> plan(std::shared_ptr<const dyop::KinematicChain> chain) {
  auto obstacles = std::make_shared<dyop::ObstacleSet>();
  for (const Board& board : kShelf)
    obstacles->add(std::make_shared<Box>(board.half_extents), RigidPose(board.p_W));
  const auto space = std::make_shared<ob::RealVectorStateSpace>(kJoints);
  ob::RealVectorBounds bounds(kJoints);
  for (unsigned k = 0; k < kJoints; ++k) {
    bounds.setLow(k, chain->joints()[k].lower);
    bounds.setHigh(k, chain->joints()[k].upper);
  }
  space->setBounds(bounds);
  og::SimpleSetup setup(space);
  const auto si = setup.getSpaceInformation();
  const auto proof = std::make_shared<dyop::OmplMotionValidator>(
      si, chain, obstacles, dyop::OmplOptions{.clearance = kClearance});
  setup.setStateValidityChecker([proof](const ob::State* s) { return proof->is_valid(s); });
  si->setMotionValidator(proof);
  ob::ScopedState<ob::RealVectorStateSpace> start(space), goal(space);
  setup.setPlanner(std::make_shared<og::RRTConnect>(si));
  setup.setup();
  sample_at({0.78, 0.25, 0.5}, 0.08, *chain, si, start.get());
  sample_at({0.78, -0.25, 0.92}, 0.08, *chain, si, goal.get());
  setup.setStartAndGoalStates(start, goal);
  ob::IterationTerminationCondition limit(100000);
  if (setup.solve(limit) != ob::PlannerStatus::EXACT_SOLUTION) return std::nullopt;
  og::PathGeometric& path = setup.getSolutionPath();
  og::PathSimplifier(si).shortcutPath(path, 200, 200);
  std::vector<Scalar> times{0};
  std::vector<JointVector> waypoints;
  for (const ob::State* state : path.getStates()) {
    waypoints.push_back(coordinates(state));
    if (waypoints.size() == 1) continue;
    const JointVector turn = waypoints.back() - waypoints[waypoints.size() - 2];
    times.push_back(times.back() + turn.cwiseAbs().maxCoeff());  // at one radian per second
  }
  return dyop::JointPath::linear(times, waypoints);
}

// True if nothing came nearer than the clearance.
bool play(std::shared_ptr<const dyop::KinematicChain> chain, const dyop::JointPath& joint_path,
          const char* recording) {
  const auto path = std::make_shared<const dyop::JointPath>(joint_path);
  dyop::WorldOptions options;
  options.target_distance = kClearance / 2;
  dyop::World world(options);
  std::vector<dyop::BodyId> links;
  for (std::size_t k = 0; k < chain->links().size(); ++k) {
    dyop::BodyDefinition body;
    body.name = chain->links()[k].name;
    body.kind = k == 0 ? dyop::BodyKind::Static : dyop::BodyKind::Kinematic;
    body.shape = chain->links()[k].shape;
    if (k > 0) body.motion = std::make_shared<dyop::LinkMotion>(chain, path, k);
    links.push_back(world.add_body(body));
    if (k > 0) world.set_pair_enabled(links[k - 1], links[k], false);
  }
  for (const Board& board : kShelf) {
    dyop::BodyDefinition body;
    body.name = board.name;
    body.kind = dyop::BodyKind::Static;
    body.shape = std::make_shared<Box>(board.half_extents);
    body.initial.X_WB = RigidPose(board.p_W);
    world.add_body(body);
  }
  constexpr Scalar kStep = 0.01;
  const Scalar end = path->domain().end;
  std::optional<dyop::RecordingWriter> writer;
  if (recording != nullptr) {
    dyop::RunHeader header;
    header.title = "An arm takes its hand from one compartment to another";
    header.end_time = end;
    header.step = kStep;
    writer.emplace(recording, header);
  }
  bool is_clear = true;
  while (world.time() < end) {
    const dyop::AdvanceReport report = world.advance(std::min(kStep, end - world.time()));
    is_clear =
        is_clear && report.crossed.empty() && report.status == dyop::AdvanceStatus::Completed;
    if (writer) writer->write(report, world);
    if (report.status != dyop::AdvanceStatus::Completed) break;
  }
  if (writer) writer->finish();
  return is_clear;
}

int main(int argc, char** argv) {
  ompl::msg::noOutputHandler();
  ompl::RNG::setSeed(1);
  const auto chain = arm();
  const auto path = plan(chain);
  if (!path) {
    std::printf("no path\n");
    return 1;
  }
  const bool is_clear = play(chain, *path, argc > 1 ? argv[1] : nullptr);
  std::printf("a path was found; played, it %s\n", is_clear ? "is clear" : "HITS SOMETHING");
}
// Prints:
// a path was found; played, it is clear
