// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/robot_file.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <variant>

#include "dyop/geometry/compound_shape.h"
#include "io/file_bytes.h"
#include "io/json_reader.h"
#include "io/motion_json.h"
#include "io/robot/robot_parts.h"
#include "io/scene/shape_reader.h"
#include "io/text_scanner.h"

namespace dyop {
namespace {

using core_internal::compose_message;

// A name inside an attribute.
std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '&') {
      result += "&amp;";
    } else if (c == '<') {
      result += "&lt;";
    } else if (c == '"') {
      result += "&quot;";
    } else {
      result += c;
    }
  }
  return result;
}

// "--" may not occur in a comment.
std::string for_comment(std::string text) {
  for (std::size_t at = 0; (at = text.find("--", at)) != std::string::npos;) text[at + 1] = '_';
  return text;
}

const char* reason_of(const LinkPairReport& pair) {
  if (pair.verdict == PairVerdict::Never) return "Never";
  if (pair.is_adjacent) return "Adjacent";
  return pair.verdict == PairVerdict::Always ? "Always" : nullptr;
}

}  // namespace

Robot load_robot(const std::filesystem::path& file, const RobotFileOptions& options) {
  const io_internal::XmlFile xml(file, {"robot", "mujoco"});
  if (xml.root().name() == "robot") return io_internal::read_urdf(xml, options);
  return io_internal::read_mjcf(xml, options);
}

std::string srdf_text(const Robot& robot, std::span<const LinkPairReport> pairs) {
  const std::size_t count = robot.chain->links().size();
  for (const LinkPairReport& pair : pairs) {
    DYOP_REQUIRE(pair.first < count && pair.second < count, "srdf_text: robot '", robot.name,
                 "' has ", count, " links, not link ", std::max(pair.first, pair.second));
  }
  std::ostringstream text;
  text << "<?xml version=\"1.0\"?>\n<robot name=\"" << escaped(robot.name) << "\">\n";
  for (const LinkPairReport& pair : pairs) {
    const std::string& first = robot.chain->links()[pair.first].name;
    const std::string& second = robot.chain->links()[pair.second].name;
    if (const char* reason = reason_of(pair)) {
      text << "  <disable_collisions link1=\"" << escaped(first) << "\" link2=\"" << escaped(second)
           << "\" reason=\"" << reason << "\"/>\n";
    } else {
      text << "  <!-- " << to_string(pair.verdict) << ": " << for_comment(first) << ", "
           << for_comment(second) << " -->\n";
    }
  }
  text << "</robot>\n";
  return text.str();
}

namespace {

using io_internal::JsonNode;
using io_internal::ShapeReader;

RigidPose pose_or_identity(const JsonNode& node, std::string_view key) {
  const std::optional<JsonNode> found = node.find(key);
  return found ? io_internal::read_pose(*found) : RigidPose();
}

// One shape at the link's own pose is itself, anything else a compound.
std::shared_ptr<const Shape> read_shapes(const JsonNode& node, ShapeReader& reader) {
  std::vector<CompoundChild> children;
  bool is_placed = false;
  for (const JsonNode& item : node.items()) {
    item.require_object({"shape", "pose"});
    is_placed = is_placed || item.has("pose");
    children.push_back(
        {reader.read(item.at("shape"), /*is_shell=*/false).shape, pose_or_identity(item, "pose")});
  }
  if (children.empty()) return nullptr;
  if (children.size() == 1 && !is_placed) return children[0].shape;
  return node.guard([&] { return std::make_shared<CompoundShape>(children); });
}

std::uint32_t read_groups(const JsonNode& node) {
  std::uint32_t groups = 0;
  for (const JsonNode& item : node.items()) {
    const Scalar bit = item.number();
    if (!(bit >= 0 && bit <= 31 && bit == static_cast<std::uint32_t>(bit))) {
      item.fail_expected("a group from 0 to 31");
    }
    groups |= std::uint32_t{1} << static_cast<std::uint32_t>(bit);
  }
  return groups;
}

Link read_link(const JsonNode& node, ShapeReader& reader) {
  node.require_object({"name", "shapes", "solid", "groups"});
  Link link;
  link.name = node.at("name").text();
  if (node.has("shapes")) link.shape = read_shapes(node.at("shapes"), reader);
  if (node.has("solid")) link.is_solid = node.at("solid").boolean();
  if (node.has("groups")) link.groups = read_groups(node.at("groups"));
  return link;
}

Joint read_joint(const JsonNode& node) {
  node.require_object({"name", "type", "parent", "child", "origin", "axis", "limits"});
  Joint joint;
  joint.name = node.at("name").text();
  joint.type = node.at("type").choice<JointType>({{"fixed", JointType::Fixed},
                                                  {"revolute", JointType::Revolute},
                                                  {"prismatic", JointType::Prismatic}});
  joint.parent = node.at("parent").text();
  joint.child = node.at("child").text();
  joint.X_PJ = pose_or_identity(node, "origin");
  for (const std::string_view key : {"axis", "limits"}) {
    if (node.has(key) && joint.type == JointType::Fixed) {
      node.at(key).fail("a fixed joint has no such key");
    }
  }
  if (node.has("axis")) joint.axis_J = node.at("axis").vector3();
  if (const std::optional<JsonNode> limits = node.find("limits")) {
    const std::vector<JsonNode> ends = limits->items();
    if (ends.size() != 2) limits->fail_expected("two numbers [lower, upper]");
    joint.lower = ends[0].number();
    joint.upper = ends[1].number();
  }
  return joint;
}

}  // namespace

KinematicChain load_chain(const std::filesystem::path& file) {
  const io_internal::Json json = io_internal::parse_json(file, io_internal::read_bytes(file));
  const JsonNode root(file, json);
  root.require_object({"links", "joints", "base", "ignored_pairs"});
  ShapeReader reader({file.parent_path()});
  std::vector<Link> links;
  for (const JsonNode& item : root.at("links").items(1)) links.push_back(read_link(item, reader));
  std::vector<Joint> joints;
  if (root.has("joints")) {
    for (const JsonNode& item : root.at("joints").items()) joints.push_back(read_joint(item));
  }
  KinematicChain::Options options;
  options.X_WR = pose_or_identity(root, "base");
  if (root.has("ignored_pairs")) {
    for (const JsonNode& item : root.at("ignored_pairs").items()) {
      const std::vector<JsonNode> names = item.items();
      if (names.size() != 2) item.fail_expected("two names of links");
      options.ignored_pairs.emplace_back(names[0].text(), names[1].text());
    }
  }
  return root.guard([&] { return KinematicChain(links, joints, options); });
}

namespace {

using core_internal::compose_message;
using io_internal::JsonNode;
using io_internal::TextScanner;

struct Waypoints {
  std::vector<Scalar> times;
  std::vector<JointVector> positions;
  std::vector<JointVector> velocities;  // as many as positions, or none; so are accelerations
  std::vector<JointVector> accelerations;
};

// The free coordinate of a joint; else what is wrong with the name.
std::variant<Eigen::Index, std::string> free_coordinate(const Robot& robot,
                                                        const std::string& name) {
  if (const auto free = robot.free_index(name)) return *free;
  const auto joints = robot.chain->joints();
  const bool is_joint = std::any_of(joints.begin(), joints.end(),
                                    [&](const Joint& joint) { return joint.name == name; });
  const std::string quoted = io_internal::quote(name);
  if (is_joint) return "joint " + quoted + " is fixed or mimics another one";
  return "robot '" + robot.name + "' has no joint " + quoted;
}

// Which free coordinate each column is.
template <typename Fail>
std::vector<Eigen::Index> columns_of(const Robot& robot, const std::vector<std::string>& names,
                                     const Fail& fail) {
  std::vector<Eigen::Index> columns;
  for (const std::string& name : names) {
    const auto found = free_coordinate(robot, name);
    if (const auto* problem = std::get_if<std::string>(&found)) fail(*problem);
    const Eigen::Index column = std::get<Eigen::Index>(found);
    if (std::find(columns.begin(), columns.end(), column) != columns.end()) {
      fail("joint " + io_internal::quote(name) + " is named twice");
    }
    columns.push_back(column);
  }
  return columns;
}

bool is_number(std::string_view word) {
  Scalar value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc() && end == word.data() + word.size();
}

std::string unquoted(std::string_view word) {
  if (word.size() >= 2 && word.front() == '"' && word.back() == '"') {
    word = word.substr(1, word.size() - 2);
  }
  return std::string(word);
}

// The columns of a CSV file, in order.
struct CsvHeader {
  bool has_time = false;
  std::vector<std::string> names;  // of joints
  std::vector<Eigen::Index> columns;
};

CsvHeader read_header(const TextScanner& scanner, const Robot& robot) {
  CsvHeader header;
  for (const std::string_view word : scanner.words()) header.names.push_back(unquoted(word));
  const std::string& first = header.names.front();
  header.has_time =
      first == "time" || first == "Time" || first == "t" || first == "time_from_start";
  if (header.has_time) header.names.erase(header.names.begin());
  header.columns =
      columns_of(robot, header.names, [&](const std::string& problem) { scanner.fail(problem); });
  if (header.columns.empty()) scanner.fail("expected the name of a joint");
  return header;
}

CsvHeader default_header(const Robot& robot) {
  CsvHeader header;
  for (std::size_t k = 0; k < robot.free_count(); ++k) {
    header.names.push_back(robot.chain->joints()[robot.free_joints[k]].name);
    header.columns.push_back(Eigen::Index(k));
  }
  return header;
}

void read_row(const TextScanner& scanner, const CsvHeader& header, JointVector q,
              Waypoints& waypoints) {
  const auto& words = scanner.words();
  const std::size_t skipped = header.has_time ? 1 : 0;
  if (words.size() != header.columns.size() + skipped) {
    scanner.fail(compose_message("expected ", header.columns.size() + skipped, " numbers, found ",
                                 words.size(), " words"));
  }
  const Scalar time = header.has_time ? scanner.finite_number(words[0], "time")
                                      : Scalar(waypoints.positions.size());
  if (!waypoints.times.empty() && !(time > waypoints.times.back())) {
    scanner.fail(
        compose_message("expected a time after ", waypoints.times.back(), ", found ", time));
  }
  for (std::size_t k = 0; k < header.columns.size(); ++k) {
    q[header.columns[k]] = scanner.finite_number(words[k + skipped], header.names[k]);
  }
  waypoints.times.push_back(time);
  waypoints.positions.push_back(std::move(q));
}

// A semicolon where the first line that is no comment has one. Commas then stay, and are refused
// within a number.
char separator_of(const std::string& text) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos || line[first] == '#') continue;
    return line.find(';') == std::string::npos ? ',' : ';';
  }
  return ',';
}

Waypoints read_csv(const std::filesystem::path& file, std::string text, const Robot& robot,
                   const JointVector& rest) {
  // An empty cell is then a missing word, which the count of words tells.
  std::replace(text.begin(), text.end(), separator_of(text), ' ');
  TextScanner scanner(file, text);
  Waypoints waypoints;
  std::optional<CsvHeader> header;
  while (scanner.next_line_with_words()) {
    if (!header) {
      const bool has_names = !is_number(scanner.words().front());
      header = has_names ? read_header(scanner, robot) : default_header(robot);
      if (has_names) continue;
    }
    read_row(scanner, *header, rest, waypoints);
  }
  if (waypoints.positions.size() < 2) {
    throw FileError(file, compose_message("expected at least two waypoints, found ",
                                          waypoints.positions.size()));
  }
  return waypoints;
}

// {"sec", "nanosec"}, {"secs", "nsecs"}, or a number of seconds.
Scalar read_time(const JsonNode& node) {
  if (!node.value().is_object()) return node.number();
  const bool is_ros1 = node.has("secs");
  constexpr Scalar kNanosecond = 1e-9;  // literal: the unit of the message
  return node.at(is_ros1 ? "secs" : "sec").number() +
         kNanosecond * node.at(is_ros1 ? "nsecs" : "nanosec").number();
}

JointVector read_numbers(const JsonNode& node, const std::vector<Eigen::Index>& columns,
                         JointVector q) {
  const std::vector<JsonNode> numbers = node.items();
  if (numbers.size() != columns.size()) {
    node.fail(compose_message("expected ", columns.size(), " numbers, found ", numbers.size()));
  }
  for (std::size_t k = 0; k < columns.size(); ++k) q[columns[k]] = numbers[k].number();
  return q;
}

std::size_t first_sign(const std::string& text) {
  return text.find_first_not_of(" \t\r\n");
}

// Files without such a name, as standard input, go by their content: no table has this word.
bool is_message(const std::filesystem::path& file, const std::string& text) {
  if (file.extension() == ".json" || io_internal::has_yaml_name(file)) return true;
  return file.extension().empty() && text.find("joint_names") != std::string::npos;
}

// The message, within one that holds it: a robot trajectory, or a list of one of them.
JsonNode trajectory_of(JsonNode root) {
  if (const auto outer = root.find("trajectory")) {
    const bool is_list = outer->value().is_array();
    if (is_list && outer->items(1).size() > 1) outer->fail("expected one trajectory");
    root = is_list ? outer->items(1)[0] : *outer;
  }
  if (const auto inner = root.find("joint_trajectory")) root = *inner;
  return root;
}

// Velocities or accelerations of a point: all points before have some, or none.
void read_rates(const JsonNode& point, const char* key, const std::vector<Eigen::Index>& columns,
                std::size_t before, const JointVector& still, std::vector<JointVector>& rates) {
  const auto found = point.find(key);
  const bool is_there = found && !found->value().is_null() && !found->items().empty();
  if (is_there != (rates.size() == before) && before > 0) {
    point.fail(std::string("expected ") + key + " at all points or at none");
  }
  if (is_there) rates.push_back(read_numbers(*found, columns, still));
}

Waypoints read_trajectory(const std::filesystem::path& file, const std::string& text,
                          const Robot& robot, const JointVector& rest) {
  const bool is_json =
      !io_internal::has_yaml_name(file) && text.find_first_of("{[") == first_sign(text);
  const io_internal::Json json =
      is_json ? io_internal::parse_json(file, text) : io_internal::parse_yaml(file, text);
  const JsonNode root = trajectory_of(JsonNode(file, json));
  std::vector<std::string> names;
  const JsonNode names_node = root.at("joint_names");
  for (const JsonNode& name : names_node.items(1)) names.push_back(name.text());
  const auto columns =
      columns_of(robot, names, [&](const std::string& problem) { names_node.fail(problem); });
  const JointVector still = JointVector::Zero(rest.size());
  Waypoints waypoints;
  for (const JsonNode& point : root.at("points").items(2)) {
    const std::size_t before = waypoints.times.size();
    const auto time_node = point.find("time_from_start");
    const Scalar time = time_node ? read_time(*time_node) : Scalar(before);
    if (before > 0 && !(time > waypoints.times.back())) {
      (time_node ? *time_node : point)
          .fail(
              compose_message("expected a time after ", waypoints.times.back(), ", found ", time));
    }
    waypoints.times.push_back(time);
    waypoints.positions.push_back(read_numbers(point.at("positions"), columns, rest));
    read_rates(point, "velocities", columns, before, still, waypoints.velocities);
    read_rates(point, "accelerations", columns, before, still, waypoints.accelerations);
  }
  return waypoints;
}

JointPath make_path(const Waypoints& waypoints, PathInterpolation interpolation) {
  switch (interpolation) {
    case PathInterpolation::Linear:
      return JointPath::linear(waypoints.times, waypoints.positions);
    case PathInterpolation::Quintic:
      DYOP_REQUIRE(!waypoints.accelerations.empty() && !waypoints.velocities.empty(),
                   "quintics need the velocities and accelerations of a trajectory message");
      return JointPath::quintic(waypoints.times, waypoints.positions, waypoints.velocities,
                                waypoints.accelerations);
    case PathInterpolation::Cubic:
      break;
  }
  if (waypoints.velocities.empty()) return JointPath::cubic(waypoints.times, waypoints.positions);
  return JointPath::cubic(waypoints.times, waypoints.positions, waypoints.velocities);
}

}  // namespace

JointPath load_joint_path(const std::filesystem::path& file, const Robot& robot,
                          PathInterpolation interpolation, const std::optional<JointVector>& rest) {
  DYOP_REQUIRE(robot.chain, "load_joint_path: the robot has no chain");
  DYOP_REQUIRE(!rest || (std::size_t(rest->size()) == robot.free_count() && rest->allFinite()),
               "load_joint_path: `rest` needs ", robot.free_count(), " finite numbers");
  std::string text = io_internal::read_bytes(file);
  const JointVector others = rest ? *rest : robot.resting_state();
  const Waypoints waypoints = is_message(file, text)
                                  ? read_trajectory(file, text, robot, others)
                                  : read_csv(file, std::move(text), robot, others);
  try {
    return make_path(waypoints, interpolation);
  } catch (const InvalidArgument& error) {
    throw FileError(file, error.what());
  }
}

}  // namespace dyop
