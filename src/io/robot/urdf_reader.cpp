// SPDX-License-Identifier: BSD-3-Clause
#include <map>
#include <optional>
#include <set>

#include "core/assert.h"
#include "io/robot/robot_parts.h"
#include "io/robot/robot_shapes.h"

namespace dyop::io_internal {
namespace {

using core_internal::compose_message;

// Reads one URDF file.
class UrdfReader {
 public:
  UrdfReader(const XmlFile& file, const RobotFileOptions& options)
      : options_(options),
        root_(file.root()),
        meshes_(file.path(), options.package_paths),
        parts_(options) {}

  Robot read();

 private:
  void read_links();
  void read_joints();
  void read_joint(const XmlNode& node);
  void read_limits(const XmlNode& node, Joint& joint) const;
  std::string find_root() const;
  void add_base(const std::string& link);

  const RobotFileOptions& options_;
  XmlNode root_;
  MeshFinder meshes_;
  RobotParts parts_;
  std::set<std::string> joint_names_;
  std::set<std::string> child_names_;
};

void UrdfReader::read_links() {
  const std::vector<XmlNode> nodes = root_.all("link");
  if (nodes.empty()) root_.fail("expected an element <link>");
  for (const XmlNode& node : nodes) {
    LinkShape read = read_link_shape(node, meshes_);
    Scalar mass = 0;
    if (const std::optional<XmlNode> inertial = node.find("inertial")) {
      const XmlNode mass_node = inertial->at("mass");
      mass = mass_node.number("value");
      if (mass < 0) mass_node.fail_expected("value", "a number >= 0");
    }
    parts_.add_link(node, {node.text("name"), std::move(read.shape), read.is_solid}, mass);
  }
}

void UrdfReader::read_limits(const XmlNode& node, Joint& joint) const {
  const std::optional<XmlNode> limit = node.find("limit");
  if (!limit) node.fail("expected an element <limit>");
  joint.lower = limit->number_or("lower", 0);
  joint.upper = limit->number_or("upper", 0);
  if (joint.lower > joint.upper) {
    limit->fail(compose_message("lower: expected a number <= upper, found ", joint.lower, " > ",
                                joint.upper));
  }
}

void UrdfReader::read_joint(const XmlNode& node) {
  Joint joint;
  joint.name = node.text("name");
  if (!joint_names_.insert(joint.name).second) node.fail("a second joint has this name");
  joint.parent = node.at("parent").text("link");
  joint.child = node.at("child").text("link");
  for (const char* end : {"parent", "child"}) {
    if (!parts_.has_link(node.at(end).text("link"))) {
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
  if (type == "floating") return parts_.add_split(node, SplitJoint::Floating, joint);
  if (type == "planar") return parts_.add_split(node, SplitJoint::Planar, joint);
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
    parts_.add_mimic(joint.name, {mimic->text("joint"), mimic->number_or("multiplier", 1),
                                  mimic->number_or("offset", 0), *mimic});
  }
  parts_.add_joint(joint);
}

std::string UrdfReader::find_root() const {
  std::vector<std::string> roots;
  for (const XmlNode& node : root_.all("link")) {
    if (child_names_.count(node.text("name")) == 0) roots.push_back(node.text("name"));
  }
  if (roots.empty()) root_.fail("the joints form a loop: every link is a joint's child");
  if (roots.size() > 1) {
    root_.fail(compose_message("expected one link that is no joint's child, found ", roots.size(),
                               ", such as '", roots[0], "' and '", roots[1], "'"));
  }
  return roots[0];
}

void UrdfReader::add_base(const std::string& link) {
  if (options_.base == RobotBase::Fixed) return;
  Joint joint;
  joint.name = "base";
  joint.parent = parts_.free_name("world");
  joint.child = link;
  parts_.add_link(root_, Link{.name = joint.parent}, 0);
  const bool is_planar = options_.base == RobotBase::Planar;
  parts_.add_split(root_, is_planar ? SplitJoint::Planar : SplitJoint::Floating, joint);
}

void UrdfReader::read_joints() {
  for (const XmlNode& node : root_.all("joint")) read_joint(node);
  add_base(find_root());
}

Robot UrdfReader::read() {
  read_links();
  read_joints();
  return parts_.finish(root_, "name", meshes_.notes());
}

}  // namespace

Robot read_urdf(const XmlFile& file, const RobotFileOptions& options) {
  require_expanded(file);
  return UrdfReader(file, options).read();
}

}  // namespace dyop::io_internal
