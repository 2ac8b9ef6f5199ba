// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/body_arguments.h"
#include "cli/commands.h"
#include "cli/console.h"
#include "cli/page/page_output.h"
#include "core/deadline.h"
#include "dyop/chain/certify_chain.h"
#include "dyop/chain/link_motion.h"
#include "dyop/core/error.h"
#include "dyop/geometry/half_space.h"
#include "dyop/io/planning_scene_file.h"
#include "dyop/io/result_text.h"
#include "dyop/io/robot_file.h"
#include "dyop/io/scene_file.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/toi/least_distance.h"
#include "dyop/view/page_encoder.h"
#include "dyop/view/run_files.h"
#include "io/file_bytes.h"
#include "io/json_reader.h"

/// What the commands of `dyop robot` share.
namespace dyop::cli {

struct RobotArguments {
  std::string urdf;
  std::string srdf;
  std::vector<std::string> package_paths;
  std::string base = "fixed";
  bool trusts_never = false;
};

void add_robot_options(CLI::App& command, RobotArguments& arguments);

/// The robot; what the reader had to assume goes to stderr.
Robot load_from(const RobotArguments& arguments);

void add_robot_check(CLI::App& robot, ExitCode& exit_code);

namespace {

using Json = nlohmann::ordered_json;
using io_internal::show;

constexpr const char* kRobotExamples = R"(Each of these has --help. docs/robots.md.

Examples:
  dyop robot info arm.urdf
  dyop robot pairs arm.urdf --write-srdf arm.srdf
  dyop robot check arm.urdf path.csv --scene cell.json --srdf arm.srdf
)";

constexpr const char* kInfoExamples = R"(Examples:
  dyop robot info arm.urdf --srdf arm.srdf
  A model that finds its meshes elsewhere, as JSON:
    dyop robot info arm.urdf --package-path ~/catkin_ws/src --json
)";

constexpr const char* kPairsExamples =
    R"(Each pair of links is proven never to touch within the joints' limits, always to touch, or
shown to touch at a joint value; with --srdf, its claims `Never` are compared. docs/robots.md.

Examples:
  dyop robot pairs arm.urdf --write-srdf arm.srdf
  Ends with code 1 if an SRDF file claims of links that can touch that they never do:
    dyop robot pairs arm.urdf --srdf arm.srdf --fail-on-refuted --time-limit 600 --json
)";

const char* type_name(JointType type) {
  switch (type) {
    case JointType::Revolute:
      return "revolute";
    case JointType::Prismatic:
      return "prismatic";
    case JointType::Fixed:
      break;
  }
  return "fixed";
}

Json number_or_null(Scalar value) {
  return std::isfinite(value) ? Json(value) : Json();
}

// By link: no point of it is ever farther than this from the origin of the root link.
std::vector<Scalar> reaches(const KinematicChain& chain) {
  std::vector<Scalar> result;
  for (std::size_t end = 0; end < chain.links().size(); ++end) {
    const std::shared_ptr<const Shape>& shape = chain.links()[end].shape;
    Scalar reach = 0;
    if (shape && as_half_space(*shape)) {
      reach = kInfinity;
    } else if (shape) {
      const AlignedBox box = shape->bounding_box();
      reach = box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).norm();
    }
    for (std::size_t link = end; chain.step(link); link = chain.step(link)->parent) {
      const KinematicChain::Step& step = *chain.step(link);
      reach += step.X_PJ.translation().norm();
      if (step.type != JointType::Prismatic) continue;
      const Joint& joint = chain.joints()[chain.joint_of(step.coordinate)];
      reach += std::max(std::abs(joint.lower), std::abs(joint.upper));
    }
    result.push_back(reach);
  }
  return result;
}

// By joint: "mimics", the joint that drives it.
std::map<std::size_t, std::string> sources(const Robot& robot) {
  std::map<std::size_t, std::string> result;
  for (std::size_t k = 0; k < robot.couplings.size(); ++k) {
    const std::size_t source = robot.free_joints[robot.couplings[k].free];
    const std::size_t joint = robot.chain->joint_of(k);
    if (joint != source) result[joint] = robot.chain->joints()[source].name;
  }
  return result;
}

Json info_json(const Robot& robot) {
  const std::vector<Scalar> reach = reaches(*robot.chain);
  Json json;
  json["name"] = robot.name;
  json["free_coordinates"] = robot.free_count();
  json["links"] = Json::array();
  for (std::size_t k = 0; k < reach.size(); ++k) {
    const Link& link = robot.chain->links()[k];
    json["links"].push_back({{"name", link.name},
                             {"has_shape", link.shape != nullptr},
                             {"is_solid", link.is_solid},
                             {"mass", robot.masses[k]},
                             {"reach", number_or_null(reach[k])}});
  }
  json["joints"] = Json::array();
  const std::map<std::size_t, std::string> mimicked = sources(robot);
  for (std::size_t k = 0; k < robot.chain->joints().size(); ++k) {
    const Joint& joint = robot.chain->joints()[k];
    Json row{{"name", joint.name},
             {"type", type_name(joint.type)},
             {"parent", joint.parent},
             {"child", joint.child}};
    if (joint.type != JointType::Fixed) {
      row["lower"] = number_or_null(joint.lower);
      row["upper"] = number_or_null(joint.upper);
    }
    if (mimicked.count(k) != 0) row["mimics"] = mimicked.at(k);
    json["joints"].push_back(std::move(row));
  }
  json["disabled_pairs"] = robot.disabled_pairs.size();
  json["notes"] = robot.notes;
  return json;
}

void print_info(const Robot& robot) {
  const std::vector<Scalar> reach = reaches(*robot.chain);
  Scalar mass = 0;
  for (const Scalar each : robot.masses) mass += each;
  Scalar farthest = 0;
  for (std::size_t k = 0; k < reach.size(); ++k) {
    if (robot.chain->links()[k].shape) farthest = std::max(farthest, reach[k]);
  }
  std::cout << "robot '" << robot.name << "': " << reach.size() << " links, "
            << robot.chain->joints().size() << " joints, " << robot.free_count()
            << " free coordinates\n  mass " << show(mass) << ", reach at most " << show(farthest)
            << ", " << robot.chain->self_pairs().size() << " pairs in self-collision\nlinks\n";
  for (std::size_t k = 0; k < reach.size(); ++k) {
    const Link& link = robot.chain->links()[k];
    std::cout << "  " << link.name << ": mass " << show(robot.masses[k]);
    if (link.shape) {
      std::cout << ", reach at most " << show(reach[k]) << (link.is_solid ? ", solid\n" : "\n");
    } else {
      std::cout << ", no shape\n";
    }
  }
  std::cout << "joints\n";
  const std::map<std::size_t, std::string> mimicked = sources(robot);
  for (std::size_t k = 0; k < robot.chain->joints().size(); ++k) {
    const Joint& joint = robot.chain->joints()[k];
    std::cout << "  " << joint.name << ": " << type_name(joint.type) << ", " << joint.parent
              << " -> " << joint.child;
    if (joint.type != JointType::Fixed) {
      std::cout << ", " << show(joint.lower) << " to " << show(joint.upper);
    }
    if (mimicked.count(k) != 0) std::cout << ", mimics " << mimicked.at(k);
    std::cout << '\n';
  }
}

struct PairsArguments {
  RobotArguments robot;
  LinkPairOptions options;
  std::optional<Scalar> time_limit;
  std::string out;
  bool is_json = false;
  bool no_progress = false;
  bool fails_on_refuted = false;
};

// Pairs that the SRDF file claims never to touch, first < second.
using Claims = std::map<std::pair<std::size_t, std::size_t>, bool>;

Claims claims_of(const Robot& robot) {
  Claims claims;
  for (const DisabledPair& pair : robot.disabled_pairs) {
    if (pair.reason != "Never") continue;
    const std::size_t a = *robot.chain->find_link(pair.first);
    const std::size_t b = *robot.chain->find_link(pair.second);
    claims[std::minmax(a, b)] = true;
  }
  return claims;
}

Json values_json(const Robot& robot, const JointVector& free) {
  Json values = Json::object();
  for (std::size_t k = 0; k < robot.free_count(); ++k) {
    values[robot.chain->joints()[robot.free_joints[k]].name] = free[Eigen::Index(k)];
  }
  return values;
}

struct PairCounts {
  std::map<PairVerdict, int> verdicts;
  int claimed = 0;
  int held = 0;
  int refuted = 0;
};

PairCounts count(const std::vector<LinkPairReport>& pairs, const Claims& claims) {
  PairCounts counts;
  for (const LinkPairReport& pair : pairs) {
    ++counts.verdicts[pair.verdict];
    if (claims.count({pair.first, pair.second}) == 0) continue;
    ++counts.claimed;
    if (pair.verdict == PairVerdict::Never) ++counts.held;
    if (pair.witness) ++counts.refuted;
  }
  return counts;
}

void print_pairs_json(const Robot& robot, const std::vector<LinkPairReport>& pairs,
                      const Claims& claims, const PairCounts& counts) {
  Json json;
  json["robot"] = robot.name;
  for (const auto verdict :
       {PairVerdict::Never, PairVerdict::Always, PairVerdict::Can, PairVerdict::Undecided}) {
    const auto found = counts.verdicts.find(verdict);
    json[to_string(verdict)] = found == counts.verdicts.end() ? 0 : found->second;
  }
  json["claimed_never"] = {
      {"pairs", counts.claimed}, {"proven", counts.held}, {"refuted", counts.refuted}};
  json["pairs"] = Json::array();
  for (const LinkPairReport& pair : pairs) {
    Json row{{"link_a", robot.chain->links()[pair.first].name},
             {"link_b", robot.chain->links()[pair.second].name},
             {"verdict", to_string(pair.verdict)},
             {"is_adjacent", pair.is_adjacent},
             {"is_claimed_never", claims.count({pair.first, pair.second}) != 0},
             {"joints", pair.joints},
             {"boxes", pair.boxes},
             {"touching_share", pair.touching_share},
             {"undecided_share", pair.undecided_share}};
    if (pair.witness) row["witness"] = values_json(robot, *pair.witness);
    json["pairs"].push_back(std::move(row));
  }
  std::cout << json.dump() << '\n';
}

void print_pairs(const Robot& robot, const std::vector<LinkPairReport>& pairs, const Claims& claims,
                 PairCounts counts) {
  for (const LinkPairReport& pair : pairs) {
    std::cout << to_string(pair.verdict) << "  " << robot.chain->links()[pair.first].name << "  "
              << robot.chain->links()[pair.second].name;
    if (pair.is_adjacent) std::cout << "  (adjacent)";
    if (pair.verdict == PairVerdict::Undecided) {
      std::cout << "  " << show(100 * pair.undecided_share) << " % left";
    }
    if (pair.verdict == PairVerdict::Can) {
      std::cout << "  at";
      for (Eigen::Index k = 0; k < pair.witness->size(); ++k) {
        std::cout << ' ' << show((*pair.witness)[k]);
      }
    }
    if (pair.witness && claims.count({pair.first, pair.second}) != 0) {
      std::cout << "  REFUTED: the SRDF file says never";
    }
    std::cout << '\n';
  }
  std::cout << pairs.size() << " pairs: " << counts.verdicts[PairVerdict::Never] << " never, "
            << counts.verdicts[PairVerdict::Always] << " always, "
            << counts.verdicts[PairVerdict::Can] << " can, "
            << counts.verdicts[PairVerdict::Undecided] << " undecided\n";
  if (counts.claimed == 0) return;
  std::cout << counts.claimed << " claims `Never`: " << counts.held << " proven, " << counts.refuted
            << " refuted\n";
}

ExitCode run_pairs(const PairsArguments& arguments) {
  DYOP_REQUIRE(arguments.out != "-" || !arguments.is_json,
               "--write-srdf - and --json both print to stdout: name a file");
  io_internal::require_other_than(arguments.out, {arguments.robot.urdf});
  const InterruptGuard interrupt;
  const Robot robot = load_from(arguments.robot);
  LinkPairOptions options = arguments.options;
  options.stop = interrupt.token();
  if (arguments.time_limit) {
    options.deadline = core_internal::deadline_after(*arguments.time_limit);
  }
  std::vector<LinkPairReport> pairs;
  {
    ProgressBar progress(!arguments.no_progress, "pair");
    options.on_progress = [&](std::size_t done, std::size_t all) {
      progress.update(double(done) / double(all), std::int64_t(done));
    };
    pairs = decide_link_pairs(robot, options);
  }
  const Claims claims = claims_of(robot);
  const PairCounts counts = count(pairs, claims);
  if (arguments.out == "-") {
    std::cout << srdf_text(robot, pairs);
  } else if (arguments.is_json) {
    print_pairs_json(robot, pairs, claims, counts);
  } else {
    print_pairs(robot, pairs, claims, counts);
  }
  if (!arguments.out.empty() && arguments.out != "-") {
    io_internal::write_whole_file(arguments.out, srdf_text(robot, pairs));
  }
  if (arguments.fails_on_refuted && counts.refuted > 0) return ExitCode::Impact;
  return counts.verdicts.count(PairVerdict::Undecided) != 0 ? ExitCode::Undecided
                                                            : ExitCode::Answered;
}

void add_robot_info(CLI::App& robot, ExitCode& exit_code) {
  auto arguments = std::make_shared<RobotArguments>();
  auto is_json = std::make_shared<bool>(false);
  CLI::App* command = robot.add_subcommand("info", "Links, joints, limits, masses and reach");
  command->footer(kInfoExamples);
  add_robot_options(*command, *arguments);
  command->add_flag("--json", *is_json, "Print one JSON object to stdout");
  command->callback([arguments, is_json, &exit_code] {
    const Robot loaded = load_from(*arguments);
    if (*is_json) {
      std::cout << info_json(loaded).dump() << '\n';
    } else {
      print_info(loaded);
    }
    exit_code = ExitCode::Answered;
  });
}

void add_robot_pairs(CLI::App& robot, ExitCode& exit_code) {
  auto arguments = std::make_shared<PairsArguments>();
  CLI::App* command =
      robot.add_subcommand("pairs", "Which pairs of links can ever touch, by proof");
  command->footer(kPairsExamples);
  add_robot_options(*command, arguments->robot);
  command->add_option("--write-srdf", arguments->out,
                      "SRDF file to write with the proven pairs; - prints it instead of the table");
  command
      ->add_option("--max-boxes", arguments->options.max_boxes,
                   "Limit on the work for each pair, in boxes of joint values")
      ->check(require_count)
      ->capture_default_str();
  command
      ->add_option("--samples", arguments->options.samples,
                   "Joint values to try before the long search of each pair")
      ->check(CLI::Range(0, 1'000'000'000))
      ->capture_default_str();
  command->add_option("--time-limit", arguments->time_limit, "Limit on the time, in seconds")
      ->check(require_non_negative);
  command->add_flag("--fail-on-refuted", arguments->fails_on_refuted,
                    "Exit code 1 if links can touch that the SRDF file says never do");
  command->add_flag("--no-progress", arguments->no_progress, "No progress bar on a terminal");
  command->add_flag("--json", arguments->is_json, "Print one JSON object to stdout");
  command->callback([arguments, &exit_code] { exit_code = run_pairs(*arguments); });
}

}  // namespace

void add_robot_options(CLI::App& command, RobotArguments& arguments) {
  command.add_option("ROBOT", arguments.urdf, "URDF file, or a model in MuJoCo's format MJCF")
      ->required();
  command.add_option("--srdf", arguments.srdf, "SRDF file of the robot");
  command.add_option("--package-path", arguments.package_paths,
                     "Directory to search for package:// in; may be repeated");
  command.add_option("--base", arguments.base, "How the root link is held")
      ->check(CLI::IsMember({"fixed", "planar", "floating"}))
      ->capture_default_str();
}

Robot load_from(const RobotArguments& arguments) {
  RobotFileOptions options;
  options.srdf = arguments.srdf;
  options.package_paths.assign(arguments.package_paths.begin(), arguments.package_paths.end());
  options.trusts_never = arguments.trusts_never;
  if (arguments.base == "planar") options.base = RobotBase::Planar;
  if (arguments.base == "floating") options.base = RobotBase::Floating;
  Robot robot = load_robot(arguments.urdf, options);
  for (const std::string& note : robot.notes) std::cerr << "dyop: note: " << note << '\n';
  return robot;
}

void add_robot_command(CLI::App& app, ExitCode& exit_code) {
  CLI::App* robot = app.add_subcommand(
      "robot", "Robots from URDF and MJCF: their parts, their pairs, their paths");
  robot->require_subcommand(1);
  robot->footer(kRobotExamples);
  add_robot_info(*robot, exit_code);
  add_robot_pairs(*robot, exit_code);
  add_robot_check(*robot, exit_code);
}

namespace {

using Json = nlohmann::ordered_json;
using io_internal::show;

constexpr const char* kCheckExamples =
    R"(PATH is a CSV file, with names of joints in its first row and perhaps a column `time`, or a
joint-trajectory message as JSON or YAML. The scene is one of dyop, whose bodies are obstacles where
they start (kinematic ones move), or a planning-scene message as YAML or JSON. docs/robots.md.

Examples:
  dyop robot check arm.urdf path.csv --scene cell.json --srdf arm.srdf --allow base_link floor
  At least 2 cm from everything, along cubics, for a script:
    dyop robot check arm.urdf path.json --scene cell.json --target 0.02 --interpolation cubic --json
)";

struct CheckArguments {
  RobotArguments robot;
  std::string path;
  std::string scene;
  std::vector<std::string> mesh_path;
  std::vector<std::pair<std::string, std::string>> allowed;
  std::string interpolation = "linear";
  ToiOptions options;
  std::optional<Scalar> tolerance;
  std::optional<Scalar> time_limit;
  bool with_clearance = false;
  std::string page;
  bool is_json = false;
  bool fails_on_impact = false;
};

// The obstacles of a scene and how they are called, and the robot among them.
struct Surroundings {
  Robot robot;
  ObstacleSet set;
  std::vector<ObstacleId> ids;
  std::vector<std::string> names;
  std::optional<JointVector> rest;  // of joints that the path does not name

  std::string name(ObstacleId id) const {
    const auto found = std::find(ids.begin(), ids.end(), id);
    return names[static_cast<std::size_t>(found - ids.begin())];
  }
};

// Obstacles named by --allow each have a bit of their own; all others share the first one.
std::uint32_t group_of(const std::string& body, const std::vector<std::string>& allowed) {
  const auto found = std::find(allowed.begin(), allowed.end(), body);
  if (found == allowed.end()) return 1;
  return std::uint32_t{2} << (found - allowed.begin());
}

std::vector<std::string> allowed_bodies(const CheckArguments& arguments) {
  constexpr std::size_t kMost = 31;
  std::vector<std::string> bodies;
  for (const auto& [link, body] : arguments.allowed) {
    if (std::find(bodies.begin(), bodies.end(), body) == bodies.end()) bodies.push_back(body);
  }
  DYOP_REQUIRE(bodies.size() <= kMost, "--allow can name ", kMost, " bodies, not ", bodies.size());
  return bodies;
}

// The robot's chain, whose links ignore what they may touch.
KinematicChain make_chain(const Robot& robot, const CheckArguments& arguments) {
  const KinematicChain& chain = *robot.chain;
  std::vector<Link> links(chain.links().begin(), chain.links().end());
  const std::vector<std::string> bodies = allowed_bodies(arguments);
  for (const auto& [name, body] : arguments.allowed) {
    const std::optional<std::size_t> link = chain.find_link(name);
    DYOP_REQUIRE(link, "--allow: the robot has no link '", name, "'");
    links[*link].groups &= ~group_of(body, bodies);
  }
  return KinematicChain(std::move(links), {chain.joints().begin(), chain.joints().end()},
                        chain.options());
}

// A planning scene: what its matrix allows is allowed too.
Surroundings load_planned(const CheckArguments& arguments, const Robot& robot) {
  PlanningScene scene = load_planning_scene(arguments.scene, robot);
  Surroundings around;
  for (const PlanningObject& object : scene.objects) around.names.push_back(object.name);
  for (const auto& [link, body] : arguments.allowed) {
    DYOP_REQUIRE(std::find(around.names.begin(), around.names.end(), body) != around.names.end(),
                 "--allow: the scene has no body '", body, "'");
    DYOP_REQUIRE(robot.chain->find_link(link), "--allow: the robot has no link '", link, "'");
    scene.allowed.emplace_back(link, body);
  }
  around.robot = scene.place(robot);
  around.set = scene.obstacles();
  around.ids = around.set.ids();
  around.rest = scene.state;
  return around;
}

Surroundings load_surroundings(const CheckArguments& arguments, const Robot& robot) {
  if (!arguments.scene.empty() && is_planning_scene(arguments.scene)) {
    return load_planned(arguments, robot);
  }
  Surroundings around;
  around.robot = robot;
  around.robot.chain = std::make_shared<const KinematicChain>(make_chain(robot, arguments));
  const std::vector<std::string> allowed = allowed_bodies(arguments);
  if (!arguments.scene.empty()) {
    const Scene scene = load_scene(arguments.scene, mesh_directories(arguments.mesh_path));
    for (const BodyDefinition& body : scene.bodies) {
      if (body.is_sensor) continue;
      Obstacle obstacle;
      obstacle.shape = body.shape;
      obstacle.X_WO = body.motion;
      if (body.kind != BodyKind::Kinematic) {
        obstacle.X_WO = std::make_shared<RestMotion>(body.initial.X_WB);
      }
      obstacle.groups = group_of(body.name, allowed);
      around.ids.push_back(around.set.add(obstacle));
      around.names.push_back(body.name);
    }
  }
  for (const std::string& body : allowed) {
    DYOP_REQUIRE(std::find(around.names.begin(), around.names.end(), body) != around.names.end(),
                 "--allow: the scene has no body '", body, "'");
  }
  return around;
}

// The first waypoint with a joint beyond its limits, in words; empty if there is none.
std::string limit_words(const Robot& robot, const JointPath& path) {
  for (const Scalar t : path.times()) {
    const JointVector q = path.position(t);
    for (std::size_t k = 0; k < robot.chain->coordinate_count(); ++k) {
      const Joint& joint = robot.chain->joints()[robot.chain->joint_of(k)];
      const Scalar value = q[Eigen::Index(k)];
      if (joint.lower <= value && value <= joint.upper) continue;
      return "joint '" + joint.name + "' is at " + show(value) + " at t = " + show(t) +
             ", beyond its limits " + show(joint.lower) + " to " + show(joint.upper);
    }
  }
  return {};
}

struct Clearance {
  LeastDistanceResult distance;
  std::string a;
  std::string b;
};

// The least of all links, from obstacles and from each other.
class ClearanceSearch {
 public:
  ClearanceSearch(std::shared_ptr<const KinematicChain> chain,
                  std::shared_ptr<const JointPath> path, const ToiOptions& limits)
      : chain_(std::move(chain)), path_(std::move(path)) {
    options_.deadline = limits.deadline;
    options_.stop = limits.stop;
  }

  std::optional<Clearance> run(const Surroundings& around) {
    for (std::size_t k = 0; k < chain_->links().size(); ++k) {
      const Link& link = chain_->links()[k];
      if (!link.shape) continue;
      const LinkMotion motion(chain_, path_, k);
      ObstacleFilter filter;
      filter.groups = link.groups;
      options_.solid_a = link.is_solid;
      options_.solid_b = false;
      const ObstacleClearance found =
          around.set.least_distance(*link.shape, motion, path_->domain(), next_options(), filter);
      if (found.obstacle) take(found.distance, link.name, around.name(*found.obstacle));
    }
    for (const KinematicChain::LinkPair& pair : chain_->self_pairs()) measure(pair);
    return best_;
  }

 private:
  // What is proven farther away than the best so far needs no bounds of its own.
  LeastDistanceOptions next_options() const {
    LeastDistanceOptions options = options_;
    if (best_) options.max_distance = best_->distance.upper;
    return options;
  }
  void measure(const KinematicChain::LinkPair& pair) {
    const Link& a = chain_->links()[pair.first];
    const Link& b = chain_->links()[pair.second];
    const std::size_t base = chain_->common_ancestor(pair.first, pair.second);
    const LinkMotion X_Ca(chain_, path_, pair.first, base);
    const LinkMotion X_Cb(chain_, path_, pair.second, base);
    options_.solid_a = a.is_solid;
    options_.solid_b = b.is_solid;
    take(least_distance(*a.shape, X_Ca, *b.shape, X_Cb, path_->domain(), next_options()), a.name,
         b.name);
  }
  // The lower bound is that of all queries.
  void take(const LeastDistanceResult& found, const std::string& a, const std::string& b) {
    const Scalar lower = best_ ? std::min(best_->distance.lower, found.lower) : found.lower;
    if (!best_ || found.upper < best_->distance.upper) best_ = Clearance{found, a, b};
    best_->distance.lower = lower;
  }

  std::shared_ptr<const KinematicChain> chain_;
  std::shared_ptr<const JointPath> path_;
  LeastDistanceOptions options_;
  std::optional<Clearance> best_;
};

struct Answer {
  ChainResult result;
  PairNames names{"the robot", "what it could hit"};
  JointVector free;  // where the proof ended
  std::string limits;
  std::optional<Clearance> clearance;
};

void print_answer(const Robot& robot, const Answer& answer) {
  std::cout << describe(answer.result.toi, answer.names) << "  free         "
            << show(100 * answer.result.free_fraction) << " % of the path\n";
  if (answer.result.link_a) {
    std::cout << "  joints       ";
    for (std::size_t k = 0; k < robot.free_count(); ++k) {
      std::cout << (k == 0 ? "" : ", ") << robot.chain->joints()[robot.free_joints[k]].name << ' '
                << show(answer.free[Eigen::Index(k)]);
    }
    std::cout << '\n';
  }
  if (!answer.limits.empty()) std::cout << "  limits       " << answer.limits << '\n';
  if (!answer.clearance) return;
  std::cout << "  clearance    " << show(answer.clearance->distance.lower) << " to "
            << show(answer.clearance->distance.upper) << ", between " << answer.clearance->a
            << " and " << answer.clearance->b
            << " at t = " << show(answer.clearance->distance.t_upper) << '\n';
}

void print_answer_json(const Robot& robot, const Answer& answer) {
  Json json;
  json["free_fraction"] = answer.result.free_fraction;
  if (answer.result.link_a) {
    json["a"] = answer.names.a;
    json["b"] = answer.names.b;
    json["is_self_collision"] = answer.result.link_b.has_value();
    for (std::size_t k = 0; k < robot.free_count(); ++k) {
      json["joint_values"][robot.chain->joints()[robot.free_joints[k]].name] =
          answer.free[Eigen::Index(k)];
    }
  }
  json["beyond_limits"] = answer.limits.empty() ? Json() : Json(answer.limits);
  if (answer.clearance) {
    json["clearance"] = {{"lower", answer.clearance->distance.lower},
                         {"upper", answer.clearance->distance.upper},
                         {"t", answer.clearance->distance.t_upper},
                         {"a", answer.clearance->a},
                         {"b", answer.clearance->b}};
  }
  json["toi"] = Json::parse(to_json_text(answer.result.toi));
  std::cout << json.dump() << '\n';
}

// The page that plays the path among its obstacles; what is hit is marked.
std::string path_page(const Surroundings& around, const std::shared_ptr<const JointPath>& path,
                      const Answer& answer) {
  PageScene scene;
  scene.title = around.robot.name;
  scene.begin_time = path->domain().begin;
  scene.end_time = path->domain().end;
  PageSpan span;
  span.steps.push_back(path->domain());
  PageMark mark{
      answer.result.toi.t_safe, "too_near", answer.names.a + " meets " + answer.names.b, {}};
  const auto add = [&](const std::string& name, BodyKind kind, const auto& shape,
                       std::shared_ptr<const Motion> motion) {
    const BodyId id(scene.bodies.size());
    if (name == answer.names.a || name == answer.names.b) mark.bodies.push_back(id);
    PageBody body;
    body.name = name;
    body.kind = kind;
    body.shape = shape;
    scene.bodies.push_back(std::move(body));
    span.segments.push_back({id, path->domain(), std::move(motion)});
  };
  const std::span<const Link> links = around.robot.chain->links();
  for (std::size_t k = 0; k < links.size(); ++k) {
    if (!links[k].shape) continue;
    const bool is_fixed = around.robot.chain->is_fixed(k);
    add(links[k].name, is_fixed ? BodyKind::Static : BodyKind::Kinematic, links[k].shape,
        std::make_shared<LinkMotion>(around.robot.chain, path, k));
  }
  for (std::size_t k = 0; k < around.ids.size(); ++k) {
    const Obstacle& obstacle = around.set.obstacle(around.ids[k]);
    add(around.names[k], BodyKind::Static, obstacle.shape, obstacle.X_WO);
  }
  if (answer.result.link_a) span.marks.push_back(mark);
  const PageEncoder encoder(std::move(scene));
  const std::vector<std::string> blocks{encoder.head(), encoder.span(span)};
  return page_html(around.robot.name, blocks);
}

ToiOptions make_options(const CheckArguments& arguments, const InterruptGuard& interrupt) {
  ToiOptions options = arguments.options;
  options.distance_tolerance = arguments.tolerance;
  options.stop = interrupt.token();
  if (arguments.time_limit) {
    options.deadline = core_internal::deadline_after(*arguments.time_limit);
  }
  return options;
}

PathInterpolation interpolation_of(const CheckArguments& arguments) {
  if (arguments.interpolation == "cubic") return PathInterpolation::Cubic;
  if (arguments.interpolation == "quintic") return PathInterpolation::Quintic;
  return PathInterpolation::Linear;
}

ExitCode run_check(const CheckArguments& arguments) {
  const InterruptGuard interrupt;
  DYOP_REQUIRE(arguments.page.empty() || has_page(),
               "--page: this dyop was built without its page: that needs npm packages, see "
               "docs/player.md");
  const Surroundings around = load_surroundings(arguments, load_from(arguments.robot));
  const Robot& robot = around.robot;
  const std::shared_ptr<const KinematicChain>& chain = robot.chain;
  const JointPath free =
      load_joint_path(input_file(arguments.path), robot, interpolation_of(arguments), around.rest);
  const auto path = std::make_shared<const JointPath>(robot.expand(free));
  ChainOptions options;
  options.toi = make_options(arguments, interrupt);
  Answer answer;
  answer.result = certify(*chain, *path, around.set, options);
  const ChainResult& result = answer.result;
  if (result.link_a) answer.names.a = chain->links()[*result.link_a].name;
  if (result.link_b) answer.names.b = chain->links()[*result.link_b].name;
  if (result.obstacle) answer.names.b = around.name(*result.obstacle);
  answer.free = free.position(result.toi.t_safe);
  answer.limits = limit_words(robot, *path);
  const ToiStatus status = result.toi.status;
  if (arguments.with_clearance && status == ToiStatus::Separated) {
    answer.clearance = ClearanceSearch(chain, path, options.toi).run(around);
  }
  if (!arguments.page.empty()) write_page(arguments.page, path_page(around, path, answer));
  if (arguments.is_json) {
    print_answer_json(robot, answer);
  } else {
    print_answer(robot, answer);
  }
  if (status == ToiStatus::Separated) return ExitCode::Answered;
  const bool is_hit = status == ToiStatus::Impact || status == ToiStatus::InitiallyWithinTarget;
  return is_hit ? exit_code_of_impact(arguments.fails_on_impact) : ExitCode::Undecided;
}

}  // namespace

void add_robot_check(CLI::App& robot, ExitCode& exit_code) {
  auto arguments = std::make_shared<CheckArguments>();
  CLI::App* command =
      robot.add_subcommand("check", "Proves that a path is free, or finds its first impact");
  command->footer(kCheckExamples);
  add_robot_options(*command, arguments->robot);
  command->add_option("PATH", arguments->path, "File of the path, see below; - is standard input")
      ->required();
  command->add_option("--scene", arguments->scene, "Scene file with the obstacles");
  command->add_option("--mesh-path", arguments->mesh_path,
                      "Directory to search for the scene's meshes in; may be repeated");
  command->add_option("--allow", arguments->allowed,
                      "LINK and BODY of the scene that may touch; may be repeated");
  command->add_flag("--trust-never", arguments->robot.trusts_never,
                    "Leave out pairs that the SRDF file says never touch");
  command->add_option("--interpolation", arguments->interpolation, "Between waypoints")
      ->check(CLI::IsMember({"linear", "cubic", "quintic"}))
      ->capture_default_str();
  command->add_option("--target", arguments->options.target_distance, "Distance to keep")
      ->check(require_non_negative)
      ->capture_default_str();
  command
      ->add_option("--tolerance", arguments->tolerance,
                   "How far above the target an impact may be reported")
      ->check(require_positive);
  command->add_option("--time-limit", arguments->time_limit, "Limit on the time, in seconds")
      ->check(require_non_negative);
  command->add_flag("--clearance", arguments->with_clearance,
                    "Bound the least distance of a free path, too");
  command->add_option("--page", arguments->page, "Page to write that plays the path in a browser");
  command->add_flag("--json", arguments->is_json, "Print one JSON object to stdout");
  command->add_flag("--fail-on-impact", arguments->fails_on_impact,
                    "Exit code 1 if something is hit");
  command->callback([arguments, &exit_code] { exit_code = run_check(*arguments); });
}

}  // namespace dyop::cli
