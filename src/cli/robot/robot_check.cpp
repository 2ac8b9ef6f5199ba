// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <chrono>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/body_arguments.h"
#include "cli/interrupt.h"
#include "cli/mesh_path.h"
#include "cli/page/page_output.h"
#include "cli/robot/robot_arguments.h"
#include "dyop/chain/certify_chain.h"
#include "dyop/chain/link_motion.h"
#include "dyop/core/error.h"
#include "dyop/io/joint_path_file.h"
#include "dyop/io/planning_scene_file.h"
#include "dyop/io/result_text.h"
#include "dyop/io/scene_file.h"
#include "dyop/motion/rest_motion.h"
#include "dyop/toi/least_distance.h"
#include "dyop/view/page_encoder.h"
#include "dyop/view/page_file.h"
#include "io/words.h"

namespace dyop::cli {
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
  KinematicChain::Options options;
  options.X_WR = chain.X_WR();
  options.ignored_pairs.assign(chain.ignored_pairs().begin(), chain.ignored_pairs().end());
  return KinematicChain(std::move(links), {chain.joints().begin(), chain.joints().end()}, options);
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
    add(links[k].name, BodyKind::Kinematic, links[k].shape,
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
    using Clock = std::chrono::steady_clock;
    // A year is as good as no limit, and can be added to the clock.
    constexpr Scalar kLongest = 365 * 24 * 3600;
    const std::chrono::duration<Scalar> limit(std::min(*arguments.time_limit, kLongest));
    options.deadline = Clock::now() + std::chrono::duration_cast<Clock::duration>(limit);
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
