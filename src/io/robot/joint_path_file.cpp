// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/joint_path_file.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <variant>

#include "io/file_bytes.h"
#include "io/json_reader.h"
#include "io/text_scanner.h"

namespace dyop {
namespace {

using core_internal::compose_message;
using io_internal::JsonNode;
using io_internal::TextScanner;

struct Waypoints {
  std::vector<Scalar> times;
  std::vector<JointVector> positions;
  std::vector<JointVector> velocities;  // as many as positions, or none
};

// Zero, or the limit nearest to it.
JointVector resting(const Robot& robot) {
  JointVector q(Eigen::Index(robot.free_count()));
  for (std::size_t k = 0; k < robot.free_count(); ++k) {
    const Joint& joint = robot.chain->joints()[robot.free_joints[k]];
    q[Eigen::Index(k)] = std::clamp<Scalar>(0, joint.lower, joint.upper);
  }
  return q;
}

// The free coordinate of a joint; else what is wrong with the name.
std::variant<Eigen::Index, std::string> free_coordinate(const Robot& robot,
                                                        const std::string& name) {
  for (std::size_t k = 0; k < robot.free_count(); ++k) {
    if (robot.chain->joints()[robot.free_joints[k]].name == name) return Eigen::Index(k);
  }
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
  header.has_time = first == "time" || first == "t" || first == "time_from_start";
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

Waypoints read_csv(const std::filesystem::path& file, std::string text, const Robot& robot) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) text.erase(0, kByteOrderMark.size());
  // An empty cell is then a missing word, which the count of words tells.
  std::replace(text.begin(), text.end(), ',', ' ');
  TextScanner scanner(file, text);
  Waypoints waypoints;
  std::optional<CsvHeader> header;
  const JointVector rest = resting(robot);
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

Waypoints read_trajectory(const std::filesystem::path& file, const std::string& text,
                          const Robot& robot) {
  const io_internal::Json json = io_internal::parse_json(file, text);
  JsonNode root(file, json);
  if (const auto inner = root.find("joint_trajectory")) root = *inner;
  std::vector<std::string> names;
  const JsonNode names_node = root.at("joint_names");
  for (const JsonNode& name : names_node.items(1)) names.push_back(name.text());
  const auto columns =
      columns_of(robot, names, [&](const std::string& problem) { names_node.fail(problem); });
  const JointVector rest = resting(robot);
  const JointVector still = JointVector::Zero(rest.size());
  const std::vector<JsonNode> points = root.at("points").items(2);
  Waypoints waypoints;
  for (const JsonNode& point : points) {
    const auto time_node = point.find("time_from_start");
    const Scalar time = time_node ? read_time(*time_node) : Scalar(waypoints.times.size());
    if (!waypoints.times.empty() && !(time > waypoints.times.back())) {
      (time_node ? *time_node : point)
          .fail(
              compose_message("expected a time after ", waypoints.times.back(), ", found ", time));
    }
    waypoints.times.push_back(time);
    waypoints.positions.push_back(read_numbers(point.at("positions"), columns, rest));
    const auto velocities = point.find("velocities");
    if (!velocities || velocities->items().empty()) continue;
    if (waypoints.velocities.size() + 1 != waypoints.positions.size()) {
      velocities->fail("earlier points have no velocities");
    }
    waypoints.velocities.push_back(read_numbers(*velocities, columns, still));
  }
  if (!waypoints.velocities.empty() && waypoints.velocities.size() != waypoints.positions.size()) {
    points[waypoints.velocities.size()].fail("expected velocities, as the points before have");
  }
  return waypoints;
}

}  // namespace

JointPath load_joint_path(const std::filesystem::path& file, const Robot& robot,
                          PathInterpolation interpolation) {
  DYOP_REQUIRE(robot.chain, "load_joint_path: the robot has no chain");
  std::string text = io_internal::read_bytes(file);
  const Waypoints waypoints = file.extension() == ".json" ? read_trajectory(file, text, robot)
                                                          : read_csv(file, std::move(text), robot);
  try {
    if (interpolation == PathInterpolation::Linear) {
      return JointPath::linear(waypoints.times, waypoints.positions);
    }
    if (waypoints.velocities.empty()) return JointPath::cubic(waypoints.times, waypoints.positions);
    return JointPath::cubic(waypoints.times, waypoints.positions, waypoints.velocities);
  } catch (const InvalidArgument& error) {
    throw FileError(file, error.what());
  }
}

}  // namespace dyop
