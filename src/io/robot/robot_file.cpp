// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/robot_file.h"

#include <algorithm>
#include <map>
#include <set>
#include <sstream>

#include "io/robot/mesh_finder.h"
#include "io/robot/robot_shapes.h"
#include "io/robot/xml_reader.h"

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

}  // namespace dyop
