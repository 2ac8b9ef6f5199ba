// SPDX-License-Identifier: BSD-3-Clause

// Plans paths of a public robot through public problems, checking states at a step as planners do,
// and asks certify() about them: outside_robot_paths [PROBLEMS [STEP [SEED]]]. PROBLEMS: of each of
// the seven kinds, evenly spread (default 2); STEP: in radians, between two states that are checked
// (default 0.05). The data is looked for in the folder that DYOP_EXTERNAL_DATA names; without it
// the program says so and returns 77 (skipped).
//
// Every path that certify() accepts is looked at again at 500 times, with poses from an oracle of
// its own; at the time of every impact the oracle must find the gap closed. The exit code is 1 if
// they disagree or a path stays undecided.

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "dyop/chain/certify_chain.h"
#include "dyop/io/planning_scene_file.h"
#include "dyop/io/robot_file.h"
#include "io/file_bytes.h"
#include "io/json_reader.h"
#include "support/oracles/chain_oracle.h"
#include "support/temporary_directory.h"

namespace dyop::testing {
namespace {

namespace fs = std::filesystem;

constexpr int kSkipped = 77;
constexpr int kOracleTimes = 500;
// The tolerance of an impact is a millionth of the smaller radius, which is below a metre.
constexpr Scalar kClosed = 2e-6;  // literal: metres

// States of a robot, checked as planners do.
class StateCheck {
 public:
  StateCheck(const Robot& robot, const ObstacleSet& obstacles)
      : robot_(robot), chain_(*robot.chain), obstacles_(obstacles), ids_(obstacles.ids()) {}

  bool touches(const JointVector& free) const {
    const std::vector<RigidPose> poses = chain_.link_poses(robot_.expand(free));
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const Link& link = chain_.links()[k];
      if (!link.shape) continue;
      for (const ObstacleId id : ids_) {
        const Obstacle& other = obstacles_.obstacle(id);
        if ((other.groups & link.groups) == 0) continue;
        if (overlap(*link.shape, poses[k], *other.shape, other.X_WO->pose(0))) return true;
      }
    }
    for (const KinematicChain::LinkPair& pair : chain_.self_pairs()) {
      if (overlap(*chain_.links()[pair.first].shape, poses[pair.first],
                  *chain_.links()[pair.second].shape, poses[pair.second])) {
        return true;
      }
    }
    return false;
  }

  /// At equal steps, without the first state.
  bool is_free(const JointVector& from, const JointVector& to, Scalar step) const {
    const int count = std::max(1, int(std::ceil((to - from).norm() / step)));
    for (int k = 1; k <= count; ++k) {
      if (touches(from + (to - from) * (Scalar(k) / count))) return false;
    }
    return true;
  }

 private:
  static bool overlap(const Shape& a, const RigidPose& X_WA, const Shape& b,
                      const RigidPose& X_WB) {
    DistanceOptions options;
    options.max_distance = 0;
    return distance(a, X_WA, b, X_WB, options).status == DistanceStatus::Overlapping;
  }

  const Robot& robot_;
  const KinematicChain& chain_;
  const ObstacleSet& obstacles_;
  std::vector<ObstacleId> ids_;
};

// Two trees that grow towards each other (RRT-Connect).
class Planner {
 public:
  Planner(const StateCheck& check, const Robot& robot, Scalar step, std::mt19937_64& random)
      : check_(check), robot_(robot), step_(step), random_(random) {}

  /// Waypoints; empty if none were found in so many rounds.
  std::vector<JointVector> plan(const JointVector& start, const JointVector& goal) {
    constexpr int kRounds = 400;
    Tree from_start{{start, -1}};
    Tree from_goal{{goal, -1}};
    Tree* grown = &from_start;
    Tree* other = &from_goal;
    for (int round = 0; round < kRounds; ++round) {
      if (extend(*grown, random_state())) {
        const JointVector reached = grown->back().q;
        while (extend(*other, reached)) {
          if (other->back().q == reached) return joined(from_start, from_goal);
        }
      }
      std::swap(grown, other);
    }
    return {};
  }

 private:
  struct Node {
    JointVector q;
    int parent;
  };
  using Tree = std::vector<Node>;

  JointVector random_state() {
    JointVector q(Eigen::Index(robot_.free_count()));
    for (std::size_t k = 0; k < robot_.free_count(); ++k) {
      const Joint& joint = robot_.chain->joints()[robot_.free_joints[k]];
      q[Eigen::Index(k)] = random_number(joint.lower, joint.upper, random_);
    }
    return q;
  }

  // By at most one radian; false if the way is blocked.
  bool extend(Tree& tree, const JointVector& towards) const {
    int nearest = 0;
    for (int k = 1; k < int(tree.size()); ++k) {
      if ((tree[std::size_t(k)].q - towards).norm() <
          (tree[std::size_t(nearest)].q - towards).norm()) {
        nearest = k;
      }
    }
    const JointVector from = tree[std::size_t(nearest)].q;
    const Scalar length = (towards - from).norm();
    if (length == 0) return false;
    const JointVector to = length <= 1 ? towards : JointVector(from + (towards - from) / length);
    if (!check_.is_free(from, to, step_)) return false;
    tree.push_back({to, nearest});
    return true;
  }

  // Both trees end at the same state.
  static std::vector<JointVector> joined(const Tree& from_start, const Tree& from_goal) {
    std::vector<JointVector> path;
    for (int k = int(from_start.size()) - 1; k >= 0; k = from_start[std::size_t(k)].parent) {
      path.insert(path.begin(), from_start[std::size_t(k)].q);
    }
    for (int k = from_goal[from_goal.size() - 1].parent; k >= 0;
         k = from_goal[std::size_t(k)].parent) {
      path.push_back(from_goal[std::size_t(k)].q);
    }
    return path;
  }

  const StateCheck& check_;
  const Robot& robot_;
  Scalar step_;
  std::mt19937_64& random_;
};

struct Tally {
  int unusable = 0;  // start or goal touches something
  int unplanned = 0;
  int planned = 0;
  int refuted = 0;
  int undecided = 0;
  int wrong = 0;
  double check_seconds = 0;
  double certify_seconds = 0;
};

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// The joint values of a request: where it starts, and what it asks for.
std::pair<JointVector, JointVector> read_request(const fs::path& file, const Robot& robot) {
  const io_internal::Json json = io_internal::parse_yaml(file, io_internal::read_bytes(file));
  const io_internal::JsonNode root(file, json);
  JointVector start = JointVector::Zero(Eigen::Index(robot.free_count()));
  const auto set = [&robot](JointVector& q, const std::string& name, Scalar value) {
    for (std::size_t k = 0; k < robot.free_count(); ++k) {
      if (robot.chain->joints()[robot.free_joints[k]].name == name) q[Eigen::Index(k)] = value;
    }
  };
  const io_internal::JsonNode state = root.at("start_state").at("joint_state");
  const auto names = state.at("name").items();
  const auto values = state.at("position").items(names.size());
  for (std::size_t k = 0; k < names.size(); ++k) set(start, names[k].text(), values[k].number());
  JointVector goal = start;
  for (const auto& wish : root.at("goal_constraints").items(1)[0].at("joint_constraints").items()) {
    set(goal, wish.at("joint_name").text(), wish.at("position").number());
  }
  return {start, goal};
}

JointPath timed(const std::vector<JointVector>& waypoints) {
  std::vector<Scalar> times{0};
  for (std::size_t k = 1; k < waypoints.size(); ++k) {
    times.push_back(times.back() + (waypoints[k] - waypoints[k - 1]).norm());
  }
  return JointPath::linear(times, waypoints);
}

bool agrees(const KinematicChain& chain, const JointPath& path, const ObstacleSet& obstacles,
            const ChainResult& result) {
  if (result.toi.status == ToiStatus::Impact) {
    return oracle_gap(chain, path, obstacles, result.toi.t_safe, 1) <= kClosed;
  }
  const TimeInterval domain = path.domain();
  for (int k = 0; k <= kOracleTimes; ++k) {
    const Scalar t = domain.begin + domain.length() * k / kOracleTimes;
    if (oracle_gap(chain, path, obstacles, std::min(t, domain.end), 1e-3) <= 0) return false;
  }
  return true;
}

void examine(const Robot& robot, const fs::path& folder, const std::string& number, Scalar step,
             std::mt19937_64& random, Tally& tally) {
  const PlanningScene scene = load_planning_scene(folder / ("scene" + number + ".yaml"), robot);
  const auto [start, goal] = read_request(folder / ("request" + number + ".yaml"), robot);
  const Robot placed = scene.place(robot);
  const ObstacleSet obstacles = scene.obstacles();
  const StateCheck check(placed, obstacles);
  if (check.touches(start) || check.touches(goal)) {
    ++tally.unusable;
    return;
  }
  const std::vector<JointVector> waypoints = Planner(check, placed, step, random).plan(start, goal);
  if (waypoints.empty()) {
    ++tally.unplanned;
    return;
  }
  ++tally.planned;
  const auto begin = std::chrono::steady_clock::now();
  for (std::size_t k = 1; k < waypoints.size(); ++k) {
    check.is_free(waypoints[k - 1], waypoints[k], step);
  }
  tally.check_seconds += seconds_since(begin);
  const JointPath path = placed.expand(timed(waypoints));
  const auto middle = std::chrono::steady_clock::now();
  const ChainResult result = certify(*placed.chain, path, obstacles);
  tally.certify_seconds += seconds_since(middle);
  const bool is_decided =
      result.toi.status == ToiStatus::Separated || result.toi.status == ToiStatus::Impact;
  tally.undecided += is_decided ? 0 : 1;
  tally.refuted += result.toi.status == ToiStatus::Impact ? 1 : 0;
  if (is_decided && !agrees(*placed.chain, path, obstacles, result)) {
    ++tally.wrong;
    std::printf("the oracle disagrees: %s %s\n", folder.filename().c_str(), number.c_str());
  }
}

int run(int problems, Scalar step, std::uint64_t seed) {
  const char* data = std::getenv("DYOP_EXTERNAL_DATA");
  const fs::path home = fs::path(data == nullptr ? "" : data) / "robots" / "ur5";
  if (data == nullptr || !exists(home / "problems.tar.bz2")) {
    std::printf("skipped: DYOP_EXTERNAL_DATA names no folder that holds robots/ur5\n");
    return kSkipped;
  }
  const TemporaryDirectory scratch;
  const std::string unpack = "tar -xjf '" + (home / "problems.tar.bz2").string() + "' -C '" +
                             scratch.path().string() + "'";
  if (std::system(unpack.c_str()) != 0) return kSkipped;
  RobotFileOptions options;
  options.srdf = home / "ur5.srdf";
  options.trusts_never = true;
  const Robot robot = load_robot(home / "ur5.urdf", options);
  std::mt19937_64 random(seed);
  Tally all;
  std::vector<fs::path> kinds(fs::directory_iterator(scratch.path() / "problems"), {});
  std::sort(kinds.begin(), kinds.end());
  for (const fs::path& kind : kinds) {
    Tally tally;
    for (int k = 0; k < problems; ++k) {
      const std::string digits = std::to_string(10'001 + 100 * k / problems);
      const std::string number = digits.substr(1);
      examine(robot, kind, number, step, random, tally);
    }
    std::printf(
        "%-24s %3d planned, %d refuted, %d undecided, %d unplanned, %d unusable;"
        " states %.2f s, certify %.2f s\n",
        kind.filename().c_str(), tally.planned, tally.refuted, tally.undecided, tally.unplanned,
        tally.unusable, tally.check_seconds, tally.certify_seconds);
    all.planned += tally.planned;
    all.refuted += tally.refuted;
    all.undecided += tally.undecided;
    all.wrong += tally.wrong;
  }
  std::printf("of %d paths that are free at every %g rad, certify() refutes %d; wrong: %d\n",
              all.planned, step, all.refuted, all.wrong);
  return all.wrong == 0 && all.undecided == 0 && all.planned > 0 ? 0 : 1;
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  const int problems = argc > 1 ? std::atoi(argv[1]) : 2;
  const double step = argc > 2 ? std::atof(argv[2]) : 0.05;
  const auto seed = std::uint64_t(argc > 3 ? std::atoll(argv[3]) : 1);
  return dyop::testing::run(problems, step, seed);
}
