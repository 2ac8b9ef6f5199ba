// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "core/assert.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/half_space.h"
#include "dyop/geometry/height_field.h"
#include "dyop/geometry/primitives.h"
#include "io/file_bytes.h"
#include "io/robot/mjcf_document.h"
#include "io/robot/robot_parts.h"
#include "io/robot/robot_shapes.h"

namespace dyop::io_internal {
namespace {

using core_internal::compose_message;

// Larger models are taken for mistakes: pairs of bodies grow with the square.
constexpr std::size_t kMostBodies = 2'000;
// Bodies and frames within each other.
constexpr int kDeepestBody = 500;

// What a geom may touch: two touch if a bit of one's contype is in the other's conaffinity.
struct ContactMask {
  std::uint32_t type = 1;
  std::uint32_t affinity = 1;

  bool operator==(const ContactMask&) const = default;
  bool is_visual() const { return type == 0 && affinity == 0; }
  bool meets(const ContactMask& other) const {
    return (type & other.affinity) != 0 || (other.type & affinity) != 0;
  }
};

// A link with what decides which others it touches. A parent has a lower number than its children.
struct Body {
  std::string link;
  std::size_t parent = 0;          // the world is its own
  std::size_t weld = 0;            // the highest body that it never moves against
  std::vector<ContactMask> masks;  // of its geoms, each once
};

constexpr std::size_t kNoBody = std::numeric_limits<std::size_t>::max();
using NumberPair = std::pair<std::size_t, std::size_t>;

// What an element <body>, or a frame in it, holds. Poses are in the frame of the body.
struct BodyContent {
  struct Placed {
    MjcfElement element;
    RigidPose X_BF;  // of the frame that holds it
  };
  struct Child {
    XmlNode node;
    RigidPose X_BF;
    std::string child_class;
  };
  std::vector<Placed> geoms;
  std::vector<Placed> joints;
  std::vector<Child> bodies;
  std::optional<Scalar> mass;  // of <inertial>
};

// Reads one model.
class MjcfReader {
 public:
  MjcfReader(const XmlFile& file, const RobotFileOptions& options)
      : options_(options),
        root_(file.root()),
        document_(file),
        meshes_(file.path(), options.package_paths),
        parts_(options) {}

  Robot read();

 private:
  void read_assets();
  std::shared_ptr<const Shape> load_mesh(const MjcfElement& asset);
  std::shared_ptr<const Shape> load_height_field(const MjcfElement& asset);
  std::shared_ptr<const Shape> read_asset(const MjcfElement& geom, const char* kind);
  std::shared_ptr<const Shape> read_geom(const MjcfElement& geom, RigidPose& X_FG);

  void read_content(const XmlNode& node, const std::string& child_class, const RigidPose& X_BF,
                    int depth, BodyContent& content);
  void read_body(const XmlNode& node, const std::string& outer_class, const RigidPose& X_PF,
                 std::size_t parent, int depth);
  void add_body(const XmlNode& node, const BodyContent& content, std::size_t number, int depth);
  Scalar add_geoms(const BodyContent& content, std::size_t number, Link& link);
  std::optional<Scalar> stated_mass(const BodyContent& content) const;
  Scalar mass_of(const MjcfElement& geom, const Shape* shape, const std::string& body);
  void add_plane(const MjcfElement& geom, const ContactMask& mask, std::size_t body, Link plane,
                 const RigidPose& X_BG);
  void add_joints(const BodyContent& content, const std::string& parent, const std::string& body,
                  RigidPose X_LB);
  void add_joint(const BodyContent::Placed& placed, Joint joint);
  void read_limits(const MjcfElement& element, Joint& joint) const;

  void read_explicit_pairs();
  void read_exclusions();
  void read_equalities();
  void couple(const XmlNode& node);
  void decide_pairs();
  bool filters_parents();
  bool are_related(std::size_t first, std::size_t second, bool filters_parents) const;
  bool may_touch(std::size_t first, std::size_t second) const;
  bool are_neighbours(std::size_t first, std::size_t second) const;

  const RobotFileOptions& options_;
  XmlNode root_;
  MjcfDocument document_;
  MeshFinder meshes_;
  RobotParts parts_;
  std::vector<Body> bodies_;
  using AssetName = std::pair<std::string, std::string>;  // mesh or hfield, and its own
  std::map<AssetName, XmlNode> assets_;
  std::map<AssetName, std::shared_ptr<const Shape>> loaded_;
  std::map<std::string, Scalar> joint_references_;     // of hinges and slides
  std::map<std::string, std::size_t> explicit_geoms_;  // of explicit pairs: the body of each
  std::set<NumberPair> explicit_pairs_;
};

// --- assets and geoms ---------------------------------------------------------------------------

void MjcfReader::read_assets() {
  for (const XmlNode& node : document_.section("asset")) {
    if (node.name() != "mesh" && node.name() != "hfield") continue;
    const std::string name = node.has("name")
                                 ? node.text("name")
                                 : std::filesystem::path(node.text("file")).stem().string();
    if (!assets_.emplace(AssetName(node.name(), name), node).second) {
      node.fail(compose_message("a second ", node.name(), " has this name"));
    }
  }
}

// The vertices of an element <mesh>.
std::vector<Vector3> read_vertices(const XmlNode& node) {
  const std::vector<Scalar> numbers = node.numbers("vertex");
  if (numbers.size() % 3 != 0) node.fail_expected("vertex", "three numbers a vertex");
  std::vector<Vector3> vertices;
  for (std::size_t k = 0; k < numbers.size(); k += 3) {
    vertices.emplace_back(numbers[k], numbers[k + 1], numbers[k + 2]);
  }
  return vertices;
}

std::vector<TriangleIndices> read_faces(const XmlNode& node, std::size_t vertex_count) {
  const std::vector<Scalar> numbers = node.numbers("face");
  if (numbers.size() % 3 != 0) node.fail_expected("face", "three numbers a triangle");
  std::vector<TriangleIndices> faces(numbers.size() / 3);
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    const Scalar number = numbers[k];
    if (!(number >= 0 && number < Scalar(vertex_count) && number == std::floor(number))) {
      node.fail(compose_message("face: expected the number of a vertex, found ", number));
    }
    faces[k / 3][k % 3] = static_cast<std::int32_t>(number);
  }
  return faces;
}

std::shared_ptr<const Shape> MjcfReader::load_mesh(const MjcfElement& asset) {
  const Vector3 scale = asset.vector3_or("scale", Vector3::Ones());
  if (!(scale.array() != 0).all()) asset.at("scale").fail_expected("scale", "numbers other than 0");
  const Vector3 origin = asset.vector3_or("refpos", Vector3::Zero());
  const Matrix3 R = asset.has("refquat") ? quaternion_rotation(asset.at("refquat"), "refquat")
                                         : Matrix3(Matrix3::Identity());
  const bool is_moved = !origin.isZero(0) || R != Matrix3::Identity();
  if (asset.has("file") && !is_moved) {
    const XmlNode node = asset.at("file");
    return meshes_.load(node, "file", document_.mesh_path(node.text("file")).string(), scale);
  }
  std::vector<Vector3> vertices;
  std::vector<TriangleIndices> triangles;
  if (asset.has("file")) {
    const XmlNode node = asset.at("file");
    const auto mesh = meshes_.load(node, "file", document_.mesh_path(node.text("file")).string(),
                                   Vector3::Ones());
    vertices.assign(mesh->vertices().begin(), mesh->vertices().end());
    triangles.assign(mesh->triangles().begin(), mesh->triangles().end());
  } else {
    vertices = read_vertices(asset.at("vertex"));
    if (asset.has("face")) triangles = read_faces(asset.at("face"), vertices.size());
  }
  for (Vector3& p : vertices) p = scale.cwiseProduct(R.transpose() * (p - origin));
  if (triangles.empty()) return std::make_shared<ConvexHull>(std::move(vertices));
  if ((scale.array() < 0).count() % 2 == 1) {
    for (TriangleIndices& triangle : triangles) std::swap(triangle[1], triangle[2]);
  }
  return std::make_shared<TriangleMesh>(std::move(vertices), std::move(triangles));
}

// Row 0 is the one with the least y.
struct Elevations {
  std::size_t rows = 2;
  std::size_t columns = 2;
  std::vector<Scalar> values = std::vector<Scalar>(4, 0);
};

// Two counts of 32 bits, then single precision, row by row, all little-endian.
Elevations read_binary(const XmlNode& node, const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file);
  std::array<std::int32_t, 2> counts{};
  if (bytes.size() >= sizeof(counts)) std::memcpy(counts.data(), bytes.data(), sizeof(counts));
  const auto [rows, columns] = counts;
  const std::size_t held = (bytes.size() - std::min(bytes.size(), sizeof(counts))) / sizeof(float);
  const bool is_sound =
      rows > 0 && columns > 0 && std::size_t(rows) <= held &&
      std::size_t(columns) == held / std::size_t(rows) &&
      bytes.size() == sizeof(counts) + std::size_t(rows) * std::size_t(columns) * sizeof(float);
  if (!is_sound) {
    node.fail(compose_message("file: expected a binary height field, found ", bytes.size(),
                              " bytes with the counts ", rows, " and ", columns, " in '",
                              file.string(), "'"));
  }
  std::vector<float> values(std::size_t(rows) * std::size_t(columns));
  std::memcpy(values.data(), bytes.data() + sizeof(counts), values.size() * sizeof(float));
  return {std::size_t(rows), std::size_t(columns), {values.begin(), values.end()}};
}

std::size_t read_count(const XmlNode& node, const char* attribute) {
  const Scalar count = node.number(attribute);
  if (!(count >= 2 && count == std::floor(count))) {
    node.fail_expected(attribute, "a whole number >= 2");
  }
  return static_cast<std::size_t>(std::min(count, 0x1p53));  // literal: whole numbers end there
}

// A text goes from the top down, so its first row has the largest y. Without heights the ground is
// flat, however many there would be.
Elevations read_text(const MjcfElement& element) {
  const std::size_t rows = read_count(element.at("nrow"), "nrow");
  const std::size_t columns = read_count(element.at("ncol"), "ncol");
  if (!element.has("elevation")) return {};
  const XmlNode node = element.at("elevation");
  const std::vector<Scalar> numbers = node.numbers("elevation");
  if (numbers.size() % rows != 0 || numbers.size() / rows != columns) {
    node.fail(compose_message("elevation: expected ", rows, " x ", columns, " numbers, found ",
                              numbers.size()));
  }
  Elevations elevations{rows, columns, {}};
  for (std::size_t row = rows; row-- > 0;) {
    const auto first = numbers.begin() + std::ptrdiff_t(row * columns);
    elevations.values.insert(elevations.values.end(), first, first + std::ptrdiff_t(columns));
  }
  return elevations;
}

// The ground of an element <hfield>, in the frame of its geom. As in MuJoCo its heights are scaled to
// lie between zero and the third size; the fourth is the depth of what is below. Without a file the
// element has the numbers.
std::shared_ptr<const TriangleMesh> read_height_field(const MjcfElement& element,
                                                      const std::filesystem::path& file) {
  const XmlNode node = element.at("size");
  const std::vector<Scalar> size = node.numbers("size");
  const bool is_sized = size.size() == 4 && std::all_of(size.begin(), size.end(),
                                                        [](Scalar length) { return length > 0; });
  if (!is_sized) node.fail_expected("size", "four numbers > 0");
  Elevations elevations = file.empty() ? read_text(element) : read_binary(element.at("file"), file);
  HeightGrid grid;
  grid.rows = elevations.rows;
  grid.columns = elevations.columns;
  grid.heights = std::move(elevations.values);
  const auto [lowest, highest] = std::minmax_element(grid.heights.begin(), grid.heights.end());
  const Scalar low = *lowest;
  const Scalar scale = *highest > low ? size[2] / (*highest - low) : 0;
  for (Scalar& height : grid.heights) height = (height - low) * scale;
  grid.x = -size[0];
  grid.y = -size[1];
  grid.spacing_x = 2 * size[0] / Scalar(grid.columns - 1);
  grid.spacing_y = 2 * size[1] / Scalar(grid.rows - 1);
  grid.base = -size[3];
  return std::make_shared<TriangleMesh>(height_field(grid));
}

std::shared_ptr<const Shape> MjcfReader::load_height_field(const MjcfElement& asset) {
  if (!asset.has("file")) return read_height_field(asset, {});
  const XmlNode node = asset.at("file");
  const std::filesystem::path path = document_.mesh_path(node.text("file"));
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  if (ending == ".png") node.fail_expected("file", "a binary height field, as PNG is not read");
  return read_height_field(asset, meshes_.find(node, "file", path.string()));
}

// The mesh or hfield that a geom names.
std::shared_ptr<const Shape> MjcfReader::read_asset(const MjcfElement& geom, const char* kind) {
  const XmlNode node = geom.at(kind);
  const AssetName name(kind, node.text(kind));
  const auto asset = assets_.find(name);
  if (asset == assets_.end())
    node.fail_expected(kind, name.first == "mesh" ? "the name of a mesh" : "the name of an hfield");
  std::shared_ptr<const Shape>& shape = loaded_[name];
  if (shape) return shape;
  try {
    const MjcfElement element(document_, asset->second, "");
    shape = name.first == "mesh" ? load_mesh(element) : load_height_field(element);
  } catch (const FileError&) {
    throw;
  } catch (const InvalidArgument& error) {
    asset->second.fail(error.what());
  }
  return shape;
}

// The sizes of a geom: `count` numbers > 0, more do not count.
std::vector<Scalar> read_sizes(const MjcfElement& geom, std::size_t count) {
  const XmlNode node = geom.at("size");
  const std::vector<Scalar> sizes = node.numbers("size");
  const auto last = std::min(sizes.size(), count);
  if (last < count || std::any_of(sizes.begin(), sizes.begin() + std::ptrdiff_t(last),
                                  [](Scalar size) { return !(size > 0); })) {
    node.fail_expected("size", compose_message(count, count == 1 ? " number > 0" : " numbers > 0"));
  }
  return sizes;
}

// Along z; a segment `fromto` sets the pose and the half length.
std::shared_ptr<const Shape> long_shape(const MjcfElement& geom, const std::string& type,
                                        RigidPose& X_FG) {
  const bool is_round = type == "capsule" || type == "cylinder";
  std::vector<Scalar> sizes;
  if (geom.has("fromto")) {
    const XmlNode node = geom.at("fromto");
    const std::vector<Scalar> ends = node.numbers("fromto");
    if (ends.size() != 6) node.fail_expected("fromto", "six finite numbers");
    const Vector3 from(ends[0], ends[1], ends[2]);
    const Vector3 to(ends[3], ends[4], ends[5]);
    X_FG = RigidPose(rotation_of_z_to(from - to, node, "fromto"), (from + to) / 2);
    const Scalar radius = read_sizes(geom, 1)[0];
    const Scalar half_length = (from - to).norm() / 2;
    sizes = is_round ? std::vector{radius, half_length} : std::vector{radius, radius, half_length};
  } else {
    sizes = read_sizes(geom, is_round ? 2 : 3);
  }
  if (type == "capsule") return std::make_shared<Capsule>(sizes[0], sizes[1]);
  if (type == "cylinder") return std::make_shared<Cylinder>(sizes[0], sizes[1]);
  const Vector3 half(sizes[0], sizes[1], sizes[2]);
  if (type == "box") return std::make_shared<Box>(half);
  return std::make_shared<Ellipsoid>(half);
}

std::shared_ptr<const Shape> MjcfReader::read_geom(const MjcfElement& geom, RigidPose& X_FG) {
  const std::string type = geom.text_or("type", "sphere");
  X_FG = geom.pose();
  try {
    if (type == "mesh" || type == "hfield") return read_asset(geom, type.c_str());
    if (geom.has("mesh")) geom.at("type").fail_expected("type", "mesh, as the geom names one");
    if (type == "plane") return std::make_shared<HalfSpace>();
    if (type == "sphere") return std::make_shared<Sphere>(read_sizes(geom, 1)[0]);
    if (type == "capsule" || type == "cylinder" || type == "box" || type == "ellipsoid") {
      return long_shape(geom, type, X_FG);
    }
  } catch (const FileError&) {
    throw;
  } catch (const InvalidArgument& error) {
    geom.node().fail(error.what());
  }
  geom.at("type").fail_expected("type",
                                "plane, hfield, sphere, capsule, ellipsoid, cylinder, box or mesh");
}

std::uint32_t read_mask(const MjcfElement& geom, const char* attribute) {
  const Scalar value = geom.number_or(attribute, 1);
  // literal: a mask of 32 bits, perhaps written as a signed number.
  if (!(value >= -0x1p31 && value < 0x1p32 && value == std::floor(value))) {
    geom.at(attribute).fail_expected(attribute, "a mask of 32 bits");
  }
  return static_cast<std::uint32_t>(static_cast<std::int64_t>(value));
}

// --- bodies and joints --------------------------------------------------------------------------

void MjcfReader::read_content(const XmlNode& node, const std::string& child_class,
                              const RigidPose& X_BF, int depth, BodyContent& content) {
  if (depth > kDeepestBody) node.fail("bodies are nested too deep");
  for (const XmlNode& child : document_.children(node)) {
    const std::string name = child.name();
    if (name == "geom") {
      content.geoms.push_back({MjcfElement(document_, child, child_class), X_BF});
    } else if (name == "joint" || name == "freejoint") {
      content.joints.push_back({MjcfElement(document_, child, child_class), X_BF});
    } else if (name == "inertial") {
      content.mass = child.number("mass");
      if (*content.mass < 0) child.fail_expected("mass", "a number >= 0");
    } else if (name == "body") {
      content.bodies.push_back({child, X_BF, child_class});
    } else if (name == "frame") {
      const std::string inner = child.has("childclass") ? child.text("childclass") : child_class;
      const RigidPose X_FG = MjcfElement(document_, child, "").pose();
      read_content(child, inner, X_BF * X_FG, depth + 1, content);
    } else if (name == "replicate" || name == "attach" || name == "composite" ||
               name == "flexcomp") {
      child.fail("elements that generate bodies are not read: save the model that they give");
    }
  }
}

// The mass that a body states, if that counts.
std::optional<Scalar> MjcfReader::stated_mass(const BodyContent& content) const {
  switch (document_.mass_source()) {
    case MjcfDocument::MassSource::Auto:
      break;
    case MjcfDocument::MassSource::Inertial:
      return content.mass.value_or(0);
    case MjcfDocument::MassSource::Geoms:
      if (!content.geoms.empty()) return std::nullopt;
  }
  return content.mass;
}

// What the geom weighs: as it states, or by its density. Visual meshes are not read, and a mesh that
// is not closed has no volume. Planes and height fields weigh nothing.
Scalar MjcfReader::mass_of(const MjcfElement& geom, const Shape* shape, const std::string& body) {
  if (geom.has("mass")) return geom.number_or("mass", 0);
  constexpr Scalar kWater = 1000;  // literal: the format's default
  const Scalar density = geom.number_or("density", kWater);
  if (density == 0) return 0;
  const auto* mesh = dynamic_cast<const TriangleMesh*>(shape);
  if (shape == nullptr || (mesh != nullptr && !mesh->is_closed())) {
    parts_.add_note(compose_message("the mass of '", body, "' leaves out a mesh"));
    return 0;
  }
  try {
    return shape->compute_mass_properties(density).mass;
  } catch (const InvalidArgument& error) {
    geom.node().fail(error.what());
  }
}

// A plane has no end, so it cannot be part of a compound: each is a link of its own.
void MjcfReader::add_plane(const MjcfElement& geom, const ContactMask& mask, std::size_t body,
                           Link plane, const RigidPose& X_BG) {
  if (bodies_[body].weld != 0) geom.node().fail("expected a plane to be fixed to the world");
  Joint joint;
  joint.name = joint.child = plane.name;
  joint.type = JointType::Fixed;
  joint.parent = bodies_[body].link;
  joint.X_PJ = X_BG;
  bodies_.push_back({plane.name, body, 0, {mask}});
  parts_.add_link(geom.node(), std::move(plane), 0);
  parts_.add_joint(joint);
}

// The shape of what collides of a body's geoms, and the mass of all.
Scalar MjcfReader::add_geoms(const BodyContent& content, std::size_t number, Link& link) {
  std::vector<CompoundChild> children;
  bool has_mesh = false;
  bool is_closed = true;
  const std::optional<Scalar> stated = stated_mass(content);
  Scalar mass = 0;
  for (const BodyContent::Placed& placed : content.geoms) {
    const MjcfElement& geom = placed.element;
    const ContactMask mask{read_mask(geom, "contype"), read_mask(geom, "conaffinity")};
    const auto paired = explicit_geoms_.find(geom.text_or("name", ""));
    const bool collides = !mask.is_visual() || paired != explicit_geoms_.end();
    if (!collides && (stated || number == 0)) continue;
    RigidPose X_FG;
    const std::string type = geom.text_or("type", "sphere");
    const bool is_read = collides || (type != "mesh" && type != "hfield");
    const std::shared_ptr<const Shape> shape = is_read ? read_geom(geom, X_FG) : nullptr;
    const bool is_plane = shape && as_half_space(*shape) != nullptr;
    const bool has_mass = !is_plane && type != "hfield";
    if (!stated && number != 0 && has_mass) mass += mass_of(geom, shape.get(), link.name);
    if (!collides) continue;
    const RigidPose X_BG = placed.X_BF * X_FG;
    if (paired != explicit_geoms_.end()) paired->second = is_plane ? bodies_.size() : number;
    if (is_plane) {
      add_plane(geom, mask, number, {parts_.free_name(geom.text_or("name", "plane")), shape}, X_BG);
      continue;
    }
    if (const auto* mesh = dynamic_cast<const TriangleMesh*>(shape.get())) {
      has_mesh = true;
      is_closed = is_closed && mesh->is_closed();
    }
    children.push_back({shape, X_BG});
    std::vector<ContactMask>& masks = bodies_[number].masks;
    if (std::find(masks.begin(), masks.end(), mask) == masks.end()) masks.push_back(mask);
  }
  link.is_solid = has_mesh && is_closed;
  if (!children.empty()) link.shape = joined(children);
  return number == 0 ? 0 : std::max(stated.value_or(mass), document_.least_mass());
}

void MjcfReader::read_limits(const MjcfElement& element, Joint& joint) const {
  const std::string limited = element.text_or("limited", "auto");
  if (limited == "false" || (limited != "true" && !element.has("range"))) return;
  const XmlNode node = element.at("range");
  const std::vector<Scalar> range = node.numbers("range");
  if (range.size() != 2 || !(range[0] < range[1])) {
    node.fail_expected("range", "two numbers that grow");
  }
  const Scalar unit = joint.type == JointType::Revolute ? document_.angle_unit() : 1;
  joint.lower = range[0] * unit;
  joint.upper = range[1] * unit;
}

// Of a joint whose name, parent, child and pose are known.
void MjcfReader::add_joint(const BodyContent::Placed& placed, Joint joint) {
  const MjcfElement& element = placed.element;
  const XmlNode& node = element.node();
  const std::string type = node.name() == "freejoint" ? "free" : element.text_or("type", "hinge");
  if (type == "free") return parts_.add_split(node, SplitJoint::Floating, joint);
  if (type == "ball") {
    if (element.has("range")) {
      parts_.add_note(
          compose_message("the limit of the ball joint '", joint.name, "' was left out"));
    }
    return parts_.add_split(node, SplitJoint::Ball, joint);
  }
  if (type != "hinge" && type != "slide") {
    element.at("type").fail_expected("type", "hinge, slide, ball or free");
  }
  joint.type = type == "hinge" ? JointType::Revolute : JointType::Prismatic;
  const Vector3 axis = element.vector3_or("axis", Vector3::UnitZ());
  if (axis.isZero(0)) element.at("axis").fail_expected("axis", "a vector other than 0");
  joint.axis_J = placed.X_BF.rotation() * axis.stableNormalized();
  read_limits(element, joint);
  // The pose in the file is the one at the reference, not at zero.
  const bool turns = joint.type == JointType::Revolute;
  const Scalar reference = element.number_or("ref", 0) * (turns ? document_.angle_unit() : 1);
  const RigidPose back =
      turns ? RigidPose(rotation_from_vector(-reference * joint.axis_J), Vector3::Zero())
            : RigidPose(Vector3(-reference * joint.axis_J));
  joint.X_PJ = joint.X_PJ * back;
  joint_references_[joint.name] = reference;
  parts_.add_joint(joint);
}

// From the link of the parent, in which the body has the pose X_LB, to that of the body: a joint
// turns about its anchor, so a link without a shape sits there unless the anchor is the origin.
void MjcfReader::add_joints(const BodyContent& content, const std::string& parent,
                            const std::string& body, RigidPose X_LB) {
  std::string link = parent;
  for (std::size_t k = 0; k < content.joints.size(); ++k) {
    const BodyContent::Placed& placed = content.joints[k];
    const MjcfElement& element = placed.element;
    const std::string type = element.text_or("type", "hinge");
    const bool has_anchor = type == "hinge" || type == "ball";
    const Vector3 anchor = has_anchor ? placed.X_BF * element.vector3_or("pos", Vector3::Zero())
                                      : Vector3(Vector3::Zero());
    const bool is_last = k + 1 == content.joints.size() && anchor.isZero(0);
    Joint joint;
    joint.name = element.text_or("name", compose_message(body, "/joint", k == 0 ? "" : "_",
                                                         k == 0 ? "" : std::to_string(k)));
    joint.parent = link;
    joint.child = is_last ? body : parts_.free_name(joint.name + "/link");
    joint.X_PJ = X_LB * RigidPose(anchor);
    if (!is_last) parts_.add_link(element.node(), Link{.name = joint.child}, 0);
    link = joint.child;
    X_LB = RigidPose(Vector3(-anchor));
    add_joint(placed, std::move(joint));
  }
  if (link == body) return;
  Joint fixed;
  fixed.name = body + "/fixed";
  fixed.type = JointType::Fixed;
  fixed.parent = link;
  fixed.child = body;
  fixed.X_PJ = X_LB;
  parts_.add_joint(fixed);
}

// A body whose number, names and joints are known, and what hangs on it.
void MjcfReader::add_body(const XmlNode& node, const BodyContent& content, std::size_t number,
                          int depth) {
  Link link;
  link.name = bodies_[number].link;
  const Scalar mass = add_geoms(content, number, link);
  parts_.add_link(node, std::move(link), mass);
  for (const BodyContent::Child& child : content.bodies) {
    read_body(child.node, child.child_class, child.X_BF, number, depth + 1);
  }
}

void MjcfReader::read_body(const XmlNode& node, const std::string& outer_class,
                           const RigidPose& X_PF, std::size_t parent, int depth) {
  const std::size_t number = bodies_.size();
  if (number > kMostBodies) {
    node.fail(compose_message("the model has more than ", kMostBodies, " bodies"));
  }
  const std::string child_class = node.has("childclass") ? node.text("childclass") : outer_class;
  BodyContent content;
  read_content(node, child_class, RigidPose(), depth, content);
  Body body;
  body.link =
      node.has("name") ? node.text("name") : parts_.free_name(compose_message("body", number));
  body.parent = parent;
  body.weld = content.joints.empty() ? bodies_[parent].weld : number;
  bodies_.push_back(body);
  const RigidPose X_PB = X_PF * MjcfElement(document_, node, "").pose();
  add_joints(content, bodies_[parent].link, body.link, X_PB);
  add_body(node, content, number, depth);
}

// --- pairs and couplings ------------------------------------------------------------------------

void MjcfReader::read_explicit_pairs() {
  for (const XmlNode& node : document_.section("contact")) {
    if (node.name() != "pair") continue;
    for (const char* geom : {"geom1", "geom2"}) explicit_geoms_[node.text(geom)] = kNoBody;
  }
}

void MjcfReader::read_exclusions() {
  for (const XmlNode& node : document_.section("contact")) {
    if (node.name() == "exclude") {
      for (const char* body : {"body1", "body2"}) {
        if (!parts_.has_link(node.text(body))) node.fail_expected(body, "the name of a body");
      }
      parts_.add_disabled({node.text("body1"), node.text("body2"), "excluded"});
    } else if (node.name() == "pair") {
      NumberPair pair;
      for (auto [number, geom] : {std::pair{&pair.first, "geom1"}, {&pair.second, "geom2"}}) {
        *number = explicit_geoms_.at(node.text(geom));
        if (*number == kNoBody) node.fail_expected(geom, "the name of a geom");
      }
      explicit_pairs_.insert(std::minmax(pair.first, pair.second));
    }
  }
}

// q1 = ref1 + c0 + c1 (q2 - ref2); a polynomial of higher order couples nothing here.
void MjcfReader::couple(const XmlNode& node) {
  const std::string driven = node.text("joint1");
  std::vector<Scalar> c{0, 1, 0, 0, 0};
  if (node.has("polycoef")) {
    const std::vector<Scalar> given = node.numbers("polycoef");
    std::copy_n(given.begin(), std::min(given.size(), c.size()), c.begin());
  }
  const bool is_linear = c[2] == 0 && c[3] == 0 && c[4] == 0;
  if (!node.has("joint2") || !is_linear) {
    parts_.add_note(compose_message("joint '", driven, "' moves freely: its equality is not a ",
                                    "linear one of two joints"));
    return;
  }
  const std::string source = node.text("joint2");
  for (const char* joint : {"joint1", "joint2"}) {
    if (joint_references_.count(node.text(joint)) == 0) {
      node.fail_expected(joint, "the name of a hinge or slide");
    }
  }
  const Scalar offset = joint_references_[driven] + c[0] - c[1] * joint_references_[source];
  if (!parts_.add_mimic(driven, {source, c[1], offset, node})) {
    parts_.add_note(
        compose_message("joint '", driven, "' follows the first of its equalities only"));
  }
}

void MjcfReader::read_equalities() {
  for (const XmlNode& node : document_.section("equality")) {
    if (node.has("active") && node.text("active") == "false") continue;
    if (node.name() == "joint") {
      couple(node);
    } else {
      parts_.add_note(compose_message("an equality of the kind '", node.name(),
                                      "' was left out: what it ties moves freely"));
    }
  }
}

bool MjcfReader::filters_parents() {
  bool filters = true;
  for (const XmlNode& node : document_.section("option")) {
    if (node.name() == "flag" && node.has("filterparent")) {
      filters = node.text("filterparent") != "disable";
    }
  }
  return filters;
}

// Whether they never move against each other, or one hangs on the other.
bool MjcfReader::are_related(std::size_t first, std::size_t second, bool filters_parents) const {
  const std::size_t a = bodies_[first].weld;
  const std::size_t b = bodies_[second].weld;
  if (a == b) return true;
  const std::size_t above_a = bodies_[bodies_[a].parent].weld;
  const std::size_t above_b = bodies_[bodies_[b].parent].weld;
  return filters_parents && a != 0 && b != 0 && (above_a == b || above_b == a);
}

bool MjcfReader::may_touch(std::size_t first, std::size_t second) const {
  for (const ContactMask& a : bodies_[first].masks) {
    for (const ContactMask& b : bodies_[second].masks) {
      if (a.meets(b)) return true;
    }
  }
  return false;
}

// Whether no other body with a shape lies between them, as KinematicChain::are_neighbours().
bool MjcfReader::are_neighbours(std::size_t first, std::size_t second) const {
  std::size_t a = first;
  std::size_t b = second;
  while (a != b) {
    std::size_t& later = a > b ? a : b;
    later = bodies_[later].parent;
    if (later != first && later != second && !bodies_[later].masks.empty()) return false;
  }
  return true;
}

// Which pairs of links are checked, as MuJoCo decides it ("Computation", "Selection").
void MjcfReader::decide_pairs() {
  const bool filters = filters_parents();
  for (std::size_t first = 0; first < bodies_.size(); ++first) {
    for (std::size_t second = first + 1; second < bodies_.size(); ++second) {
      const std::string& a = bodies_[first].link;
      const std::string& b = bodies_[second].link;
      if (bodies_[first].masks.empty() || bodies_[second].masks.empty()) continue;
      const bool is_near = are_neighbours(first, second);
      const bool is_explicit = explicit_pairs_.count({first, second}) != 0;
      const bool is_related = are_related(first, second, filters);
      if (is_explicit || (!is_related && may_touch(first, second))) {
        if (is_near) parts_.add_checked(a, b);
      } else if (!is_near) {
        parts_.add_disabled({a, b, is_related ? "joined" : "contype and conaffinity"});
      }
    }
  }
}

Robot MjcfReader::read() {
  if (options_.base != RobotBase::Fixed) {
    root_.fail("the base must be fixed by option: a model says itself what moves freely");
  }
  read_assets();
  read_explicit_pairs();
  bodies_.push_back({"world", 0, 0, {}});
  BodyContent world;
  for (const XmlNode& node : document_.children(root_)) {
    if (node.name() == "worldbody") read_content(node, "", RigidPose(), 0, world);
  }
  if (world.geoms.empty() && world.bodies.empty()) root_.fail("expected a body in <worldbody>");
  if (!world.joints.empty()) world.joints[0].element.node().fail("the world has no joints");
  add_body(root_, world, 0, 0);
  if (document_.total_mass() > 0) parts_.set_total_mass(document_.total_mass());
  read_exclusions();
  decide_pairs();
  read_equalities();
  return parts_.finish(root_, "model", meshes_.notes());
}

}  // namespace

Robot read_mjcf(const XmlFile& file, const RobotFileOptions& options) {
  return MjcfReader(file, options).read();
}

}  // namespace dyop::io_internal
