// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/planning_scene_file.h"

#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/half_space.h"
#include "dyop/geometry/occupancy.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "dyop/io/octree_file.h"
#include "io/file_bytes.h"
#include "io/json_reader.h"
#include "io/text_scanner.h"

namespace dyop {
namespace {

using io_internal::JsonNode;
using io_internal::quote;

// Rotations in files have few digits.
constexpr Scalar kQuaternionNoise = 1e-3;  // literal: a norm farther from one is a mistake

// [x, y, z], or an object with these keys.
std::vector<Scalar> read_components(const JsonNode& node,
                                    std::initializer_list<std::string_view> keys) {
  std::vector<Scalar> numbers;
  if (node.value().is_array()) {
    for (const JsonNode& item : node.items(keys.size())) numbers.push_back(item.number());
    if (numbers.size() != keys.size()) {
      node.fail_expected("an array of " + std::to_string(keys.size()) + " numbers");
    }
    return numbers;
  }
  for (const std::string_view key : keys) numbers.push_back(node.at(key).number());
  return numbers;
}

Vector3 read_vector(const JsonNode& node) {
  const std::vector<Scalar> xyz = read_components(node, {"x", "y", "z"});
  return {xyz[0], xyz[1], xyz[2]};
}

// A pose, or a transform, which calls its parts by other names. Messages without a rotation have
// a quaternion of zeros.
RigidPose read_placement(const JsonNode& node) {
  Vector3 position = Vector3::Zero();
  Quaternion rotation = Quaternion::Identity();
  for (const char* key : {"position", "translation"}) {
    if (const auto found = node.find(key)) position = read_vector(*found);
  }
  for (const char* key : {"orientation", "rotation"}) {
    const auto found = node.find(key);
    if (!found) continue;
    const std::vector<Scalar> q = read_components(*found, {"x", "y", "z", "w"});
    const Quaternion read(q[3], q[0], q[1], q[2]);
    if (read.norm() == 0) continue;
    if (!(std::abs(read.norm() - 1) < kQuaternionNoise)) {
      found->fail_expected("a quaternion x y z w of norm one");
    }
    rotation = read.normalized();
  }
  return node.guard([&] { return RigidPose(rotation, position); });
}

std::shared_ptr<const Shape> read_primitive(const JsonNode& node) {
  enum class Kind { Box, Sphere, Cylinder, Cone };
  constexpr std::array kinds{Kind::Box, Kind::Sphere, Kind::Cylinder, Kind::Cone};
  const JsonNode type = node.at("type");
  Kind kind = Kind::Box;
  if (type.is_string()) {
    kind = type.choice<Kind>({{"box", Kind::Box},
                              {"sphere", Kind::Sphere},
                              {"cylinder", Kind::Cylinder},
                              {"cone", Kind::Cone}});
  } else {
    const Scalar number = type.number();
    if (!(number == 1 || number == 2 || number == 3 || number == 4)) {
      type.fail_expected("1 (box), 2 (sphere), 3 (cylinder) or 4 (cone)");
    }
    kind = kinds[std::size_t(number) - 1];
  }
  const JsonNode dimensions = node.at("dimensions");
  std::vector<Scalar> size;
  for (const JsonNode& item : dimensions.items()) size.push_back(item.positive_number());
  const std::size_t wanted = kind == Kind::Box ? 3 : kind == Kind::Sphere ? 1 : 2;
  if (size.size() != wanted) {
    dimensions.fail("expected " + std::to_string(wanted) + " dimensions, found " +
                    std::to_string(size.size()));
  }
  return dimensions.guard([&]() -> std::shared_ptr<const Shape> {
    if (kind == Kind::Box) {
      return std::make_shared<Box>(Vector3(size[0] / 2, size[1] / 2, size[2] / 2));
    }
    if (kind == Kind::Sphere) return std::make_shared<Sphere>(size[0]);
    if (kind == Kind::Cylinder) return std::make_shared<Cylinder>(size[1], size[0] / 2);
    return std::make_shared<Cone>(size[1], size[0] / 2);
  });
}

std::shared_ptr<const Shape> read_mesh(const JsonNode& node) {
  if (!node.has("vertices")) node.fail("only meshes with `vertices` and `triangles` are read");
  std::vector<Vector3> vertices;
  for (const JsonNode& vertex : node.at("vertices").items()) {
    vertices.push_back(read_vector(vertex));
  }
  std::vector<TriangleIndices> triangles;
  for (const JsonNode& item : node.at("triangles").items()) {
    const JsonNode corners = item.has("vertex_indices") ? item.at("vertex_indices") : item;
    TriangleIndices triangle{};
    const std::vector<JsonNode> numbers = corners.items(3);
    if (numbers.size() != 3) corners.fail_expected("three numbers of vertices");
    for (std::size_t k = 0; k < 3; ++k) {
      const bool is_index = numbers[k].value().is_number_integer() && numbers[k].number() >= 0 &&
                            numbers[k].number() < Scalar(vertices.size());
      if (!is_index) numbers[k].fail_expected("the number of a vertex");
      triangle[k] = std::int32_t(numbers[k].number());
    }
    triangles.push_back(triangle);
  }
  return node.guard(
      [&] { return std::make_shared<TriangleMesh>(std::move(vertices), std::move(triangles)); });
}

// a x + b y + c z + d = 0, with everything behind it: a floor is a solid.
std::shared_ptr<const Shape> read_plane(const JsonNode& node) {
  const std::vector<Scalar> coef = read_components(node.at("coef"), {"a", "b", "c", "d"});
  const Vector3 normal(coef[0], coef[1], coef[2]);
  return node.guard(
      [&] { return std::make_shared<HalfSpace>(normal, -coef[3] / normal.stableNorm()); });
}

// An array that may be missing.
std::vector<JsonNode> entries(const JsonNode& node, std::string_view key) {
  const auto found = node.find(key);
  if (!found || found->value().is_null()) return {};
  return found->items();
}

// Shapes and their poses, which stand in two arrays.
template <typename Read>
void append_shapes(const JsonNode& object, const char* shapes, const char* poses, const Read& read,
                   std::vector<CompoundChild>& children) {
  const std::vector<JsonNode> nodes = entries(object, shapes);
  const std::vector<JsonNode> places = entries(object, poses);
  if (nodes.size() != places.size() && !(places.empty() && nodes.size() == 1)) {
    object.fail("expected as many " + std::string(poses) + " as " + shapes + ", found " +
                std::to_string(places.size()) + " for " + std::to_string(nodes.size()));
  }
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    children.push_back({read(nodes[k]), places.empty() ? RigidPose() : read_placement(places[k])});
  }
}

struct PlacedShape {
  std::shared_ptr<const Shape> shape;
  RigidPose X_FO;  // in the frame that the object's header names
};

// The bounded parts of an object as one shape, and each of its planes. One shape keeps its own
// frame, so that a cylinder stays one.
std::vector<PlacedShape> read_shapes(const JsonNode& object) {
  std::vector<CompoundChild> children;
  append_shapes(object, "primitives", "primitive_poses", read_primitive, children);
  append_shapes(object, "meshes", "mesh_poses", read_mesh, children);
  std::vector<CompoundChild> planes;
  append_shapes(object, "planes", "plane_poses", read_plane, planes);
  if (children.empty() && planes.empty()) {
    object.fail("the object has neither primitives nor meshes nor planes");
  }
  const RigidPose X_FO = object.has("pose") ? read_placement(object.at("pose")) : RigidPose();
  if (children.size() > 1) {
    const auto compound = object.guard([&] { return std::make_shared<CompoundShape>(children); });
    children = {{compound, RigidPose()}};
  }
  children.insert(children.end(), planes.begin(), planes.end());
  std::vector<PlacedShape> placed;
  for (const CompoundChild& child : children) placed.push_back({child.shape, X_FO * child.X_CS});
  return placed;
}

class PlanningSceneReader {
 public:
  PlanningSceneReader(const JsonNode& root, const Robot& robot) : root_(root), robot_(robot) {}

  PlanningScene read();

 private:
  void read_frames();
  RigidPose frame_of(const JsonNode& object) const;
  void read_octree(const JsonNode& octomap);
  void read_objects();
  void read_held(const JsonNode& node);
  void read_state(const JsonNode& state);
  void read_allowed();
  void require_link(const JsonNode& node, const std::string& name) const;

  const JsonNode& root_;
  const Robot& robot_;
  std::map<std::string, RigidPose> frames_;  // that rest in the world
  std::set<std::string> names_;              // of objects
  PlanningScene scene_;
};

// Links that no moving joint carries, and the file's own.
void PlanningSceneReader::read_frames() {
  const KinematicChain& chain = *robot_.chain;
  const std::vector<RigidPose> poses = chain.link_poses(robot_.expand(robot_.resting_state()));
  for (std::size_t link = 0; link < chain.links().size(); ++link) {
    bool rests = true;
    for (auto step = chain.step(link); step && rests; step = chain.step(step->parent)) {
      rests = step->type == JointType::Fixed;
    }
    if (rests) frames_[chain.links()[link].name] = poses[link];
  }
  for (const JsonNode& node : entries(root_, "fixed_frame_transforms")) {
    frames_.emplace(node.at("child_frame_id").text(), read_placement(node.at("transform")));
  }
}

RigidPose PlanningSceneReader::frame_of(const JsonNode& object) const {
  const auto header = object.find("header");
  const std::string name = header && header->has("frame_id") ? header->at("frame_id").text() : "";
  const auto found = frames_.find(name);
  if (found != frames_.end()) return found->second;
  if (!name.empty() && name != "world") {
    header->at("frame_id").fail_expected("the name of a frame that rests in the world");
  }
  return {};
}

// A map with its origin, or the map alone; without data there is none.
void PlanningSceneReader::read_octree(const JsonNode& octomap) {
  const auto inner = octomap.find("octomap");
  const JsonNode map = inner ? *inner : octomap;
  const std::vector<JsonNode> data = entries(map, "data");
  if (data.empty()) return;
  std::string bytes;
  bytes.reserve(data.size());
  for (const JsonNode& item : data) {
    const Scalar value = item.number();
    if (!(value >= -128 && value <= 255 && value == std::floor(value))) {
      item.fail_expected("a byte");
    }
    bytes.push_back(static_cast<char>(static_cast<unsigned char>(int(value) & 0xff)));
  }
  const OctreeFormat format{map.at("id").text(), map.at("binary").boolean(),
                            map.at("resolution").positive_number()};
  PlanningObject object;
  object.name = "<octomap>";
  names_.insert(object.name);
  object.shape = map.guard(
      [&] { return std::make_shared<CompoundShape>(occupancy(dyop::read_octree(format, bytes))); });
  object.X_WO = frame_of(octomap);
  if (const auto origin = octomap.find("origin"))
    object.X_WO = object.X_WO * read_placement(*origin);
  scene_.objects.push_back(std::move(object));
}

void PlanningSceneReader::read_objects() {
  const auto world = root_.find("world");
  if (!world) return;
  // A misspelt key would lose obstacles, or move them.
  world->require_object({"collision_objects", "octomap"});
  if (const auto octomap = world->find("octomap")) read_octree(*octomap);
  for (const JsonNode& node : entries(*world, "collision_objects")) {
    node.require_object({"header", "id", "type", "pose", "primitives", "primitive_poses", "meshes",
                         "mesh_poses", "planes", "plane_poses", "subframe_names", "subframe_poses",
                         "operation"});
    const std::string name = node.at("id").text();
    if (!names_.insert(name).second) node.at("id").fail("a second object has this name");
    for (const PlacedShape& placed : read_shapes(node)) {
      scene_.objects.push_back({name, placed.shape, frame_of(node) * placed.X_FO});
    }
  }
}

void PlanningSceneReader::require_link(const JsonNode& node, const std::string& name) const {
  if (!robot_.chain->find_link(name)) node.fail_expected("the name of a link of the robot");
}

void PlanningSceneReader::read_held(const JsonNode& node) {
  HeldObject held;
  const JsonNode link = node.at("link_name");
  held.link = link.text();
  require_link(link, held.link);
  const JsonNode object = node.at("object");
  held.name = object.at("id").text();
  if (robot_.chain->find_link(held.name) || !names_.insert(held.name).second) {
    object.at("id").fail("a link or another object has this name");
  }
  if (const auto header = object.find("header"); header && header->has("frame_id")) {
    const std::string frame = header->at("frame_id").text();
    if (!frame.empty() && frame != held.link) {
      header->at("frame_id")
          .fail_expected("the frame of the link that holds it, " + quote(held.link));
    }
  }
  if (!entries(object, "planes").empty()) object.at("planes").fail("a plane cannot be held");
  const PlacedShape placed = read_shapes(object).front();
  held.shape = placed.shape;
  held.X_LO = placed.X_FO;
  for (const JsonNode& touch : entries(node, "touch_links")) {
    require_link(touch, touch.text());
    held.touch_links.push_back(touch.text());
  }
  scene_.held.push_back(std::move(held));
}

void PlanningSceneReader::read_state(const JsonNode& state) {
  if (const auto joints = state.find("joint_state")) {
    const std::vector<JsonNode> names = entries(*joints, "name");
    const std::vector<JsonNode> positions = entries(*joints, "position");
    if (names.size() != positions.size()) {
      joints->fail("expected as many positions as names, found " +
                   std::to_string(positions.size()) + " for " + std::to_string(names.size()));
    }
    for (std::size_t k = 0; k < names.size(); ++k) {
      // Messages name all joints, also those that mimic others.
      const std::optional<Eigen::Index> free = robot_.free_index(names[k].text());
      if (free) scene_.state[*free] = positions[k].number();
    }
  }
  for (const JsonNode& node : entries(state, "attached_collision_objects")) read_held(node);
}

// Only what concerns objects; the first name of a pair is the link's.
void PlanningSceneReader::read_allowed() {
  const auto matrix = root_.find("allowed_collision_matrix");
  if (!matrix) return;
  const auto add = [this](const std::string& link, const std::string& object) {
    if (robot_.chain->find_link(link) && names_.count(object) != 0) {
      scene_.allowed.emplace_back(link, object);
    }
  };
  std::vector<std::string> names;
  for (const JsonNode& name : entries(*matrix, "entry_names")) names.push_back(name.text());
  const std::vector<JsonNode> rows = entries(*matrix, "entry_values");
  if (rows.size() != names.size()) matrix->fail("expected a row for every name");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    // A message has its rows in objects.
    const std::vector<JsonNode> cells =
        (rows[i].has("enabled") ? rows[i].at("enabled") : rows[i]).items();
    if (cells.size() != names.size()) rows[i].fail("expected a value for every name");
    for (std::size_t j = 0; j < cells.size(); ++j) {
      if (cells[j].boolean()) add(names[i], names[j]);
    }
  }
  const std::vector<JsonNode> defaults = entries(*matrix, "default_entry_names");
  const std::vector<JsonNode> values = entries(*matrix, "default_entry_values");
  if (defaults.size() != values.size()) matrix->fail("expected a value for every default name");
  for (std::size_t k = 0; k < defaults.size(); ++k) {
    if (!values[k].boolean()) continue;
    for (const Link& link : robot_.chain->links()) add(link.name, defaults[k].text());
  }
}

PlanningScene PlanningSceneReader::read() {
  root_.require_object({"name", "robot_state", "robot_model_name", "fixed_frame_transforms",
                        "allowed_collision_matrix", "link_padding", "link_scale", "object_colors",
                        "world", "is_diff"});
  if (root_.has("name") && root_.at("name").is_string()) scene_.name = root_.at("name").text();
  scene_.state = robot_.resting_state();
  read_frames();
  read_objects();
  if (const auto state = root_.find("robot_state")) read_state(*state);
  read_allowed();
  return std::move(scene_);
}

// By object: one bit for each set of links that may touch an object, the first one for none.
std::vector<std::uint32_t> groups_of(const PlanningScene& scene) {
  std::map<std::string, std::set<std::string>> links_of;
  for (const auto& [link, object] : scene.allowed) links_of[object].insert(link);
  std::map<std::set<std::string>, std::uint32_t> bits{{{}, 1}};
  std::vector<std::uint32_t> groups;
  for (const PlanningObject& object : scene.objects) {
    const auto [bit, is_new] = bits.emplace(links_of[object.name], 0);
    DYOP_REQUIRE(bits.size() <= 32, "objects differ in more than 31 ways in which links may ",
                 "touch them, such as '", object.name, "'");
    if (is_new) bit->second = std::uint32_t{1} << (bits.size() - 1);
    groups.push_back(bit->second);
  }
  return groups;
}

}  // namespace

ObstacleSet PlanningScene::obstacles() const {
  const std::vector<std::uint32_t> groups = groups_of(*this);
  ObstacleSet set;
  for (std::size_t k = 0; k < objects.size(); ++k) {
    set.add(objects[k].shape, objects[k].X_WO, groups[k]);
  }
  return set;
}

Robot PlanningScene::place(const Robot& robot) const {
  DYOP_REQUIRE(robot.chain, "place: robot '", robot.name, "' has no chain");
  const std::vector<std::uint32_t> groups = groups_of(*this);
  std::vector<Link> links(robot.chain->links().begin(), robot.chain->links().end());
  for (const auto& [link_name, object] : allowed) {
    const std::optional<std::size_t> link = robot.chain->find_link(link_name);
    DYOP_REQUIRE(link, "place: robot '", robot.name, "' has no link '", link_name, "'");
    for (std::size_t k = 0; k < objects.size(); ++k) {
      if (objects[k].name == object) links[*link].groups &= ~groups[k];
    }
  }
  Robot result = robot;
  result.chain = std::make_shared<const KinematicChain>(
      std::move(links),
      std::vector<Joint>(robot.chain->joints().begin(), robot.chain->joints().end()),
      robot.chain->options());
  for (const HeldObject& each : held) {
    Link link;
    link.name = each.name;
    link.shape = each.shape;
    result = attach(result, std::move(link), each.link, each.X_LO, each.touch_links);
  }
  return result;
}

PlanningScene load_planning_scene(const std::filesystem::path& file, const Robot& robot) {
  DYOP_REQUIRE(robot.chain, "load_planning_scene: the robot has no chain");
  const io_internal::Json json = io_internal::parse_structured(file, io_internal::read_bytes(file));
  const JsonNode root(file, json);
  if (!json.is_object()) root.fail_expected("an object");
  if (!root.has("world") && !root.has("robot_state")) {
    root.fail("expected a planning scene, with the key `world`");
  }
  return PlanningSceneReader(root, robot).read();
}

bool is_planning_scene(const std::filesystem::path& file) {
  if (io_internal::has_yaml_name(file)) return true;
  try {
    const io_internal::Json json = io_internal::parse_json(file, io_internal::read_bytes(file));
    return json.is_object() && (json.contains("world") || json.contains("robot_state"));
  } catch (const FileError&) {
    return false;
  }
}

}  // namespace dyop
