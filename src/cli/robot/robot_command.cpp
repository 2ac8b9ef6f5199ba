// SPDX-License-Identifier: BSD-3-Clause
#include <chrono>
#include <cmath>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/body_arguments.h"
#include "cli/interrupt.h"
#include "cli/progress_bar.h"
#include "cli/robot/robot_arguments.h"
#include "io/output_file.h"
#include "io/words.h"

namespace dyop::cli {
namespace {

using Json = nlohmann::ordered_json;
using io_internal::show;

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
    if (shape) {
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
  io_internal::require_other_than(arguments.out, {arguments.robot.urdf});
  const InterruptGuard interrupt;
  const Robot robot = load_from(arguments.robot);
  LinkPairOptions options = arguments.options;
  options.stop = interrupt.token();
  if (arguments.time_limit) {
    using Clock = std::chrono::steady_clock;
    // A year is as good as no limit, and can be added to the clock.
    constexpr Scalar kLongest = 365 * 24 * 3600;
    const std::chrono::duration<Scalar> limit(std::min(*arguments.time_limit, kLongest));
    options.deadline = Clock::now() + std::chrono::duration_cast<Clock::duration>(limit);
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
  command.add_option("ROBOT", arguments.urdf, "URDF file")->required();
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
  CLI::App* robot =
      app.add_subcommand("robot", "Robots from URDF files: their parts, their pairs, their paths");
  robot->require_subcommand(1);
  add_robot_info(*robot, exit_code);
  add_robot_pairs(*robot, exit_code);
  add_robot_check(*robot, exit_code);
}

}  // namespace dyop::cli
