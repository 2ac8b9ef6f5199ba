// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/chain_file.h"

#include "dyop/geometry/compound_shape.h"
#include "io/file_bytes.h"
#include "io/scene/motion_reader.h"
#include "io/scene/shape_reader.h"

namespace dyop {
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

}  // namespace dyop
