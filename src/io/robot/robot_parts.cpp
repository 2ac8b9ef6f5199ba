// SPDX-License-Identifier: BSD-3-Clause
#include "io/robot/robot_parts.h"

#include <algorithm>
#include <numeric>
#include <string_view>
#include <utility>

#include "core/assert.h"

namespace dyop::io_internal {
namespace {

using core_internal::compose_message;

// Larger robots are taken for mistakes: pairs of links grow with the square.
constexpr std::size_t kMostLinks = 10'000;

struct Part {
  const char* suffix;
  JointType type;
  Vector3 axis;
};

std::vector<Part> parts_of(SplitJoint kind, const Vector3& axis) {
  constexpr auto kShift = JointType::Prismatic;
  constexpr auto kTurn = JointType::Revolute;
  if (kind == SplitJoint::Planar) {
    const Vector3 normal = axis.stableNormalized();
    const Matrix3 R = rotation_between(Vector3::UnitZ(), normal).matrix();
    return {{"/x", kShift, R.col(0)}, {"/y", kShift, R.col(1)}, {"/yaw", kTurn, normal}};
  }
  std::vector<Part> parts;
  if (kind == SplitJoint::Floating) {
    parts = {{"/x", kShift, Vector3::UnitX()},
             {"/y", kShift, Vector3::UnitY()},
             {"/z", kShift, Vector3::UnitZ()}};
  }
  parts.push_back({"/yaw", kTurn, Vector3::UnitZ()});
  parts.push_back({"/pitch", kTurn, Vector3::UnitY()});
  parts.push_back({"/roll", kTurn, Vector3::UnitX()});
  return parts;
}

// The prefixes of names that belong to xacro, such as "xacro:".
std::vector<std::string> xacro_prefixes(const XmlNode& root) {
  constexpr std::string_view kDeclaration = "xmlns:";
  std::vector<std::string> prefixes{"xacro:"};
  for (const auto& [name, value] : root.attributes()) {
    const bool is_xacro = value.ends_with("/wiki/xacro");
    if (is_xacro && name.starts_with(kDeclaration)) {
      prefixes.push_back(name.substr(kDeclaration.size()) + ":");
    }
  }
  return prefixes;
}

// How to expand it: "`xacro arm.urdf.xacro > arm.urdf`".
std::string xacro_command(const std::filesystem::path& file) {
  std::filesystem::path expanded = file.stem();
  if (file.extension() != ".xacro") expanded = "expanded" + file.extension().string();
  if (!expanded.has_extension()) expanded += ".urdf";
  return compose_message("`xacro ", file.filename().string(), " > ", expanded.string(), "`");
}

class XacroFinder {
 public:
  explicit XacroFinder(const XmlFile& file)
      : command_(xacro_command(file.path())), prefixes_(xacro_prefixes(file.root())) {}

  // `is_read`: values of its attributes count. Elsewhere, as in plugins, "${" may be meant.
  void refuse(const XmlNode& node, bool is_read) const {
    if (is_xacros(node.name())) fail(node, "this element");
    for (const auto& [name, value] : node.attributes()) {
      const bool is_open = value.find("${") != value.npos || value.find("$(") != value.npos;
      if (is_xacros(name) || (is_read && is_open)) fail(node, "the attribute '" + name + "'");
    }
  }

  void refuse_below(const XmlNode& node, bool is_read) const {
    refuse(node, is_read);
    for (const XmlNode& child : node.children()) refuse_below(child, is_read);
  }

 private:
  bool is_xacros(const std::string& name) const {
    return std::any_of(prefixes_.begin(), prefixes_.end(),
                       [&](const std::string& prefix) { return name.starts_with(prefix); });
  }

  [[noreturn]] void fail(const XmlNode& node, const std::string& what) const {
    node.fail(compose_message(what, " has yet to be expanded by xacro: run ", command_,
                              " and read its output"));
  }

  std::string command_;
  std::vector<std::string> prefixes_;
};

}  // namespace

void require_expanded(const XmlFile& file) {
  const XacroFinder finder(file);
  const XmlNode root = file.root();
  finder.refuse(root, true);
  for (const XmlNode& node : root.children()) {
    const bool is_foreign = node.name() == "gazebo" || node.name() == "ros2_control";
    finder.refuse_below(node, !is_foreign);
  }
}

void RobotParts::add_link(const XmlNode& node, Link link, Scalar mass) {
  if (!link_names_.insert(link.name).second) {
    node.fail(compose_message("a second link has the name '", link.name, "'"));
  }
  if (links_.size() == kMostLinks) {
    node.fail(compose_message("the robot has more than ", kMostLinks, " links"));
  }
  links_.push_back(std::move(link));
  robot_.masses.push_back(mass);
}

void RobotParts::set_total_mass(Scalar total) {
  const Scalar sum = std::accumulate(robot_.masses.begin(), robot_.masses.end(), Scalar(0));
  if (!(sum > 0)) return;
  for (Scalar& mass : robot_.masses) mass *= total / sum;
}

void RobotParts::add_split(const XmlNode& node, SplitJoint kind, const Joint& joint) {
  const std::vector<Part> parts = parts_of(kind, joint.axis_J);
  std::string parent = joint.parent;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const std::string part_name = joint.name + parts[k].suffix;
    const bool is_last = k + 1 == parts.size();
    if (!is_last) add_link(node, Link{.name = part_name}, 0);
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

std::string RobotParts::free_name(std::string name) const {
  while (has_link(name)) name += "_";
  return name;
}

// Which free coordinate drives each coordinate of the chain.
void RobotParts::couple() {
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
      if (steps > mimics_.size()) mimic.node.fail("joints mimic each other in a loop");
      coupling.offset += coupling.multiplier * mimic.offset;
      coupling.multiplier *= mimic.multiplier;
      name = mimic.source;
      if (mimics_.count(name) == 0 && free_numbers.count(name) == 0) {
        mimic.node.fail(
            compose_message("expected the name of a joint that moves, found '", name, "'"));
      }
    }
    coupling.free = free_numbers.at(name);
    robot_.couplings.push_back(coupling);
  }
}

// Files often give mimicking joints limits of another sign, or none but zero. Such limits would hold
// what they mimic in one place.
void RobotParts::reconcile_limits() {
  std::vector<std::pair<Scalar, Scalar>> ranges;  // of free coordinates
  for (const std::size_t k : robot_.free_joints) {
    ranges.emplace_back(joints_[k].lower, joints_[k].upper);
  }
  std::size_t coordinate = 0;
  for (Joint& joint : joints_) {
    if (joint.type == JointType::Fixed) continue;
    const CoordinateCoupling& coupling = robot_.couplings[coordinate++];
    auto& [least, most] = ranges[coupling.free];
    const auto [lower, upper] = coupling.free_limits(joint.lower, joint.upper);
    if (lower <= least && most <= upper) continue;
    const Scalar low = std::max(lower, least);
    const Scalar high = std::min(upper, most);
    const std::string& source = joints_[robot_.free_joints[coupling.free]].name;
    if (low < high || (low == high && least == most)) {
      add_note(compose_message("the limits of '", joint.name, "', which mimics it, hold joint '",
                               source, "' to ", low, " to ", high));
      least = low;
      most = high;
    } else {
      add_note(compose_message("the limits of '", joint.name, "' are ignored: they leave joint '",
                               source, "', which it mimics, no way to go"));
      joint.lower = -kInfinity;
      joint.upper = kInfinity;
    }
  }
}

void RobotParts::read_group(const XmlNode& node) {
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

// A URDF file has the same root element, and would exempt nothing; so would groups of other names.
void RobotParts::require_own_srdf(const XmlNode& root) const {
  for (const char* name : {"link", "joint"}) {
    if (const auto node = root.find(name)) node->fail("this is a URDF file, not an SRDF file");
  }
  const auto is_own = [&](const std::string& name) {
    return has_link(name) || std::any_of(joints_.begin(), joints_.end(),
                                         [&](const Joint& joint) { return joint.name == name; });
  };
  bool names_any = !robot_.disabled_pairs.empty();
  bool names_own = names_any;  // their links are known
  for (const RobotGroup& group : robot_.groups) {
    for (const std::vector<std::string>& names : {group.links, group.joints}) {
      names_any = names_any || !names.empty();
      names_own = names_own || std::any_of(names.begin(), names.end(), is_own);
    }
  }
  if (names_any && !names_own) root.fail("this SRDF file names no link and no joint of the robot");
}

void RobotParts::read_srdf() {
  if (options_.srdf.empty()) return;
  const XmlFile srdf(options_.srdf, {"robot"});
  require_expanded(srdf);
  for (const XmlNode& node : srdf.root().all("disable_collisions")) {
    const DisabledPair pair{node.text("link1"), node.text("link2"),
                            node.has("reason") ? node.text("reason") : ""};
    for (const char* link : {"link1", "link2"}) {
      if (!has_link(node.text(link))) node.fail_expected(link, "the name of a link of the robot");
    }
    if (pair.first == pair.second) node.fail_expected("link2", "another link than link1");
    robot_.disabled_pairs.push_back(pair);
  }
  for (const XmlNode& node : srdf.root().all("group")) read_group(node);
  require_own_srdf(srdf.root());
}

KinematicChain RobotParts::make_chain() const {
  KinematicChain::Options options;
  for (const DisabledPair& pair : robot_.disabled_pairs) {
    if (pair.reason == "Never" && !options_.trusts_never) continue;
    options.ignored_pairs.emplace_back(pair.first, pair.second);
  }
  options.checked_pairs = checked_;
  return KinematicChain(links_, joints_, options);
}

Robot RobotParts::finish(const XmlNode& root, const char* name,
                         const std::vector<std::string>& notes) {
  if (root.has(name)) robot_.name = root.text(name);
  robot_.notes.insert(robot_.notes.end(), notes.begin(), notes.end());
  couple();
  reconcile_limits();
  read_srdf();
  try {
    robot_.chain = std::make_shared<const KinematicChain>(make_chain());
  } catch (const InvalidArgument& error) {
    root.fail(error.what());
  }
  return std::move(robot_);
}

}  // namespace dyop::io_internal
