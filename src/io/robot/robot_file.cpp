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
#include "io/robot/robot_shapes.h"
#include "io/robot/xml_reader.h"
#include "io/scene/shape_reader.h"
#include "io/text_scanner.h"

namespace dyop {
namespace {

using core_internal::compose_message;
using io_internal::LinkShape;
using io_internal::MeshFinder;
using io_internal::XmlFile;
using io_internal::XmlNode;

// Larger robots are taken for mistakes: pairs of links grow with the square.
constexpr std::size_t kMostLinks = 10'000;

struct Mimic {
  std::string source;
  Scalar multiplier = 1;
  Scalar offset = 0;
};

// Reads one URDF file; its members are the parts of the chain so far.
class RobotReader {
 public:
  RobotReader(const std::filesystem::path& urdf, const RobotFileOptions& options)
      : options_(options), xml_(urdf, "robot"), meshes_(urdf, options.package_paths) {}

  Robot read();

 private:
  void read_links();
  void read_joints();
  void read_joint(const XmlNode& node);
  void add_split(const std::string& name, const Joint& joint, bool is_planar);
  void read_limits(const XmlNode& node, Joint& joint) const;
  void read_srdf();
  void couple();
  KinematicChain make_chain() const;

  const RobotFileOptions& options_;
  XmlFile xml_;
  MeshFinder meshes_;
  Robot robot_;
  std::vector<Link> links_;
  std::vector<Joint> joints_;
  std::set<std::string> link_names_;
  std::set<std::string> child_names_;
  std::map<std::string, Mimic> mimics_;  // by joint
  std::map<std::string, XmlNode> joint_nodes_;
};

void RobotReader::read_links() {
  for (const XmlNode& node : xml_.root().all("link")) {
    Link link;
    link.name = node.text("name");
    if (!link_names_.insert(link.name).second) node.fail("a second link has this name");
    if (links_.size() == kMostLinks) {
      node.fail(compose_message("the robot has more than ", kMostLinks, " links"));
    }
    LinkShape read = io_internal::read_link_shape(node, meshes_);
    link.shape = std::move(read.shape);
    link.is_solid = read.is_solid;
    Scalar mass = 0;
    if (const std::optional<XmlNode> inertial = node.find("inertial")) {
      const XmlNode mass_node = inertial->at("mass");
      mass = mass_node.number("value");
      if (mass < 0) mass_node.fail_expected("value", "a number >= 0");
    }
    links_.push_back(std::move(link));
    robot_.masses.push_back(mass);
  }
  if (links_.empty()) xml_.root().fail("expected an element <link>");
}

void RobotReader::read_limits(const XmlNode& node, Joint& joint) const {
  const std::optional<XmlNode> limit = node.find("limit");
  if (!limit) node.fail("expected an element <limit>");
  joint.lower = limit->number_or("lower", 0);
  joint.upper = limit->number_or("upper", 0);
  if (joint.lower > joint.upper) {
    limit->fail(compose_message("lower: expected a number <= upper, found ", joint.lower, " > ",
                                joint.upper));
  }
}

// A joint of several coordinates becomes a row of joints of one, with links without shapes between.
void RobotReader::add_split(const std::string& name, const Joint& joint, bool is_planar) {
  struct Part {
    const char* suffix;
    JointType type;
    Vector3 axis;
  };
  constexpr auto kShift = JointType::Prismatic;
  constexpr auto kTurn = JointType::Revolute;
  std::vector<Part> parts;
  if (is_planar) {
    const Vector3 normal = joint.axis_J.stableNormalized();
    const Matrix3 R = Eigen::Quaterniond::FromTwoVectors(Vector3::UnitZ(), normal).matrix();
    parts = {{"/x", kShift, R.col(0)}, {"/y", kShift, R.col(1)}, {"/yaw", kTurn, normal}};
  } else {
    parts = {{"/x", kShift, Vector3::UnitX()},    {"/y", kShift, Vector3::UnitY()},
             {"/z", kShift, Vector3::UnitZ()},    {"/yaw", kTurn, Vector3::UnitZ()},
             {"/pitch", kTurn, Vector3::UnitY()}, {"/roll", kTurn, Vector3::UnitX()}};
  }
  std::string parent = joint.parent;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const std::string part_name = name + parts[k].suffix;
    const bool is_last = k + 1 == parts.size();
    if (!is_last) {
      Link between;
      between.name = part_name;
      links_.push_back(between);
      link_names_.insert(part_name);
      robot_.masses.push_back(0);
    }
    Joint part;
    part.name = part_name;
    part.type = parts[k].type;
    part.parent = parent;
    part.child = is_last ? joint.child : part_name;
    if (k == 0) part.X_PJ = joint.X_PJ;
    part.axis_J = parts[k].axis;
    joints_.push_back(part);
    parent = part_name;
  }
}

void RobotReader::read_joint(const XmlNode& node) {
  Joint joint;
  joint.name = node.text("name");
  if (!joint_nodes_.emplace(joint.name, node).second) node.fail("a second joint has this name");
  joint.parent = node.at("parent").text("link");
  joint.child = node.at("child").text("link");
  for (const char* end : {"parent", "child"}) {
    if (link_names_.count(node.at(end).text("link")) == 0) {
      node.at(end).fail_expected("link", "the name of a link");
    }
  }
  if (!child_names_.insert(joint.child).second) {
    node.at("child").fail_expected("link", "a link that is no other joint's child");
  }
  joint.X_PJ = node.origin();
  const std::string type = node.text("type");
  const std::optional<XmlNode> axis = node.find("axis");
  joint.axis_J = axis ? axis->vector3("xyz") : Vector3(Vector3::UnitX());
  const bool has_axis = type != "fixed" && type != "floating";
  if (has_axis && joint.axis_J.isZero(0)) axis->fail_expected("xyz", "a vector other than 0");
  if (type == "floating" || type == "planar") return add_split(joint.name, joint, type == "planar");
  if (type == "fixed") {
    joint.type = JointType::Fixed;
    joint.axis_J = Vector3::UnitZ();
  } else if (type == "revolute" || type == "prismatic") {
    joint.type = type == "revolute" ? JointType::Revolute : JointType::Prismatic;
    read_limits(node, joint);
  } else if (type != "continuous") {
    node.fail_expected("type", "revolute, continuous, prismatic, fixed, floating or planar");
  }
  if (const auto mimic = node.find("mimic"); mimic && joint.type != JointType::Fixed) {
    mimics_[joint.name] = {mimic->text("joint"), mimic->number_or("multiplier", 1),
                           mimic->number_or("offset", 0)};
  }
  joints_.push_back(joint);
}

void RobotReader::read_joints() {
  for (const XmlNode& node : xml_.root().all("joint")) read_joint(node);
  std::vector<std::string> roots;
  for (const XmlNode& node : xml_.root().all("link")) {
    if (child_names_.count(node.text("name")) == 0) roots.push_back(node.text("name"));
  }
  if (roots.empty()) xml_.root().fail("the joints form a loop: every link is a joint's child");
  if (roots.size() > 1) {
    xml_.root().fail(compose_message("expected one link that is no joint's child, found ",
                                     roots.size(), ", such as '", roots[0], "' and '", roots[1],
                                     "'"));
  }
  if (options_.base == RobotBase::Fixed) return;
  Link world;
  world.name = "world";
  while (link_names_.count(world.name) != 0) world.name += "_";
  link_names_.insert(world.name);
  links_.push_back(world);
  robot_.masses.push_back(0);
  Joint joint;
  joint.parent = world.name;
  joint.child = roots[0];
  add_split("base", joint, options_.base == RobotBase::Planar);
}

// Which free coordinate drives each coordinate of the chain.
void RobotReader::couple() {
  std::map<std::string, std::size_t> free_numbers;  // by joint
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    if (joints_[k].type == JointType::Fixed || mimics_.count(joints_[k].name) != 0) continue;
    free_numbers[joints_[k].name] = robot_.free_joints.size();
    robot_.free_joints.push_back(k);
  }
  for (const Joint& joint : joints_) {
    if (joint.type == JointType::Fixed) continue;
    CoordinateCoupling coupling;
    std::string name = joint.name;
    for (std::size_t steps = 0; mimics_.count(name) != 0; ++steps) {
      const Mimic& mimic = mimics_.at(name);
      const XmlNode node = joint_nodes_.at(name).at("mimic");
      if (steps > mimics_.size()) node.fail("joints mimic each other in a loop");
      coupling.offset += coupling.multiplier * mimic.offset;
      coupling.multiplier *= mimic.multiplier;
      name = mimic.source;
      if (mimics_.count(name) == 0 && free_numbers.count(name) == 0) {
        node.fail_expected("joint", "the name of a joint that moves");
      }
    }
    coupling.free = free_numbers.at(name);
    robot_.couplings.push_back(coupling);
  }
}

void RobotReader::read_srdf() {
  if (options_.srdf.empty()) return;
  const XmlFile srdf(options_.srdf, "robot");
  for (const XmlNode& node : srdf.root().all("disable_collisions")) {
    const DisabledPair pair{node.text("link1"), node.text("link2"),
                            node.has("reason") ? node.text("reason") : ""};
    for (const char* link : {"link1", "link2"}) {
      if (link_names_.count(node.text(link)) == 0) {
        node.fail_expected(link, "the name of a link of the robot");
      }
    }
    if (pair.first == pair.second) node.fail_expected("link2", "another link than link1");
    robot_.disabled_pairs.push_back(pair);
  }
  for (const XmlNode& node : srdf.root().all("group")) {
    RobotGroup group;
    group.name = node.text("name");
    for (const XmlNode& link : node.all("link")) group.links.push_back(link.text("name"));
    for (const XmlNode& joint : node.all("joint")) group.joints.push_back(joint.text("name"));
    std::map<std::string, const Joint*> above;
    for (const Joint& joint : joints_) above[joint.child] = &joint;
    for (const XmlNode& chain : node.all("chain")) {
      const std::string base = chain.text("base_link");
      std::vector<std::string> joints;
      std::vector<std::string> links;
      std::string link = chain.text("tip_link");
      for (std::size_t steps = 0; link != base; ++steps) {
        const auto joint = above.find(link);
        if (joint == above.end() || steps > joints_.size()) {
          chain.fail_expected("tip_link", "a link below '" + base + "'");
        }
        links.push_back(link);
        joints.push_back(joint->second->name);
        link = joint->second->parent;
      }
      group.links.insert(group.links.end(), links.rbegin(), links.rend());
      group.joints.insert(group.joints.end(), joints.rbegin(), joints.rend());
    }
    robot_.groups.push_back(std::move(group));
  }
}

KinematicChain RobotReader::make_chain() const {
  KinematicChain::Options options;
  for (const DisabledPair& pair : robot_.disabled_pairs) {
    if (pair.reason == "Never" && !options_.trusts_never) continue;
    options.ignored_pairs.emplace_back(pair.first, pair.second);
  }
  return KinematicChain(links_, joints_, options);
}

Robot RobotReader::read() {
  if (xml_.root().has("name")) robot_.name = xml_.root().text("name");
  read_links();
  read_joints();
  couple();
  read_srdf();
  try {
    robot_.chain = std::make_shared<const KinematicChain>(make_chain());
  } catch (const InvalidArgument& error) {
    xml_.root().fail(error.what());
  }
  robot_.notes = meshes_.notes();
  return std::move(robot_);
}

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

Robot load_robot(const std::filesystem::path& urdf, const RobotFileOptions& options) {
  return RobotReader(urdf, options).read();
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

Waypoints read_csv(const std::filesystem::path& file, std::string text, const Robot& robot,
                   const JointVector& rest) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) text.erase(0, kByteOrderMark.size());
  // An empty cell is then a missing word, which the count of words tells.
  std::replace(text.begin(), text.end(), ',', ' ');
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
