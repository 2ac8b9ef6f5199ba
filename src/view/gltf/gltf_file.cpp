// SPDX-License-Identifier: BSD-3-Clause
#include <tiny_gltf.h>

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <span>
#include <sstream>
#include <vector>

#include "dyop/geometry/half_space.h"
#include "dyop/io/file_error.h"
#include "dyop/io/recording.h"
#include "dyop/view/run_files.h"
#include "io/file_bytes.h"
#include "view/shape_surface.h"

/// The path of a body as keys of glTF's cubic splines.
namespace dyop::view_internal {

using Vector4 = Eigen::Matrix<Scalar, 4, 1>;  // a quaternion, x y z w

struct AnimationKey {
  float t = 0;
  Vector3 p = Vector3::Zero();
  Vector3 v_in = Vector3::Zero();  // before t, and from t on
  Vector3 v_out = Vector3::Zero();
  Vector4 q = Vector4::UnitW();  // unit; the sign goes on that of the key before
  Vector4 q_rate_in = Vector4::Zero();
  Vector4 q_rate_out = Vector4::Zero();
};

/// When the body is there. Outside, its keys mean nothing.
struct PresenceChange {
  float t = 0;
  bool is_there = true;
};

struct BodyAnimation {
  std::vector<AnimationKey> keys;  // times strictly increasing; one: it never moves
  std::vector<PresenceChange> changes;
};

/// @param tolerance Of poses: length, also of what a rotation moves at the shape's radius.
BodyAnimation animation_of(const RecordingReader& reader, BodyId body, Scalar tolerance);

}  // namespace dyop::view_internal

namespace dyop {
namespace {

using view_internal::AnimationKey;
using view_internal::BodyAnimation;
using view_internal::Vector4;

// How often the triangles of spheres and other smooth shapes are divided.
constexpr int kFineness = 3;

// Red, green, blue of static bodies, of kinematic ones, and of the others in turn.
using Colour = std::array<double, 3>;
constexpr Colour kStaticColour{0.62, 0.64, 0.66};
constexpr Colour kKinematicColour{0.85, 0.47, 0.13};
constexpr std::array<Colour, 6> kColours{{{0.12, 0.38, 0.70},
                                          {0.80, 0.22, 0.20},
                                          {0.20, 0.55, 0.30},
                                          {0.90, 0.70, 0.15},
                                          {0.45, 0.30, 0.62},
                                          {0.15, 0.60, 0.62}}};

// Appends data to the file's one buffer.
class ModelWriter {
 public:
  ModelWriter() {
    model_.buffers.resize(1);
    model_.asset.version = "2.0";
    model_.asset.generator = "dyop";
  }

  tinygltf::Model& model() { return model_; }

  // An accessor of rows of `width` numbers.
  template <typename Number>
  int add(std::span<const Number> numbers, std::size_t width, int target = 0) {
    std::vector<unsigned char>& bytes = model_.buffers[0].data;
    tinygltf::BufferView view;
    view.buffer = 0;
    view.byteOffset = bytes.size();
    view.byteLength = numbers.size_bytes();
    view.target = target;
    bytes.resize(bytes.size() + view.byteLength);
    std::memcpy(bytes.data() + view.byteOffset, numbers.data(), view.byteLength);
    tinygltf::Accessor accessor;
    accessor.bufferView = static_cast<int>(model_.bufferViews.size());
    accessor.componentType = std::is_same_v<Number, float> ? TINYGLTF_COMPONENT_TYPE_FLOAT
                                                           : TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
    accessor.count = numbers.size() / width;
    accessor.type = width == 1   ? TINYGLTF_TYPE_SCALAR
                    : width == 3 ? TINYGLTF_TYPE_VEC3
                                 : TINYGLTF_TYPE_VEC4;
    model_.bufferViews.push_back(view);
    model_.accessors.push_back(accessor);
    return static_cast<int>(model_.accessors.size()) - 1;
  }

  // With the smallest and largest number of each column, where glTF wants them.
  int add_with_bounds(std::span<const float> numbers, std::size_t width, int target = 0) {
    const int index = add(numbers, width, target);
    tinygltf::Accessor& accessor = model_.accessors.back();
    accessor.minValues.assign(numbers.begin(), numbers.begin() + std::ptrdiff_t(width));
    accessor.maxValues = accessor.minValues;
    for (std::size_t k = 0; k < numbers.size(); ++k) {
      const double x = static_cast<double>(numbers[k]);
      accessor.minValues[k % width] = std::min(accessor.minValues[k % width], x);
      accessor.maxValues[k % width] = std::max(accessor.maxValues[k % width], x);
    }
    return index;
  }

 private:
  tinygltf::Model model_;
};

template <typename Vector>
void append(std::vector<float>& numbers, const Vector& v) {
  for (const Scalar x : v) numbers.push_back(static_cast<float>(x));
}

// Meshes of glTF: one for each shape and colour; colours of a shape share its data.
class MeshMaker {
 public:
  MeshMaker(ModelWriter& writer, const RecordingReader& reader) : writer_(writer), reader_(reader) {
    std::vector<const Shape*> shapes;
    for (const auto& recorded : reader.shapes()) shapes.push_back(recorded.shape.get());
    plate_ = view_internal::plate_beside(shapes);
  }

  int mesh(std::size_t shape, const Colour& colour) {
    const auto [entry, is_new] = meshes_.try_emplace({shape, colour}, 0);
    if (!is_new) return entry->second;
    const auto [surface, is_new_shape] = surfaces_.try_emplace(shape);
    if (is_new_shape) surface->second = add_surface(shape);
    tinygltf::Primitive primitive;
    primitive.attributes["POSITION"] = surface->second.first;
    primitive.indices = surface->second.second;
    primitive.material = material(colour);
    primitive.mode = TINYGLTF_MODE_TRIANGLES;
    tinygltf::Mesh mesh;
    mesh.primitives.push_back(primitive);
    writer_.model().meshes.push_back(mesh);
    entry->second = static_cast<int>(writer_.model().meshes.size()) - 1;
    return entry->second;
  }

 private:
  // Accessors of vertices and of triangles.
  std::pair<int, int> add_surface(std::size_t shape) {
    const view_internal::ShapeSurface surface =
        view_internal::surface_of(*reader_.shapes()[shape].shape, kFineness, plate_);
    std::vector<float> vertices;
    for (const Vector3& v : surface.vertices) append(vertices, v);
    std::vector<std::uint32_t> indices;
    for (const TriangleIndices& t : surface.triangles)
      indices.insert(indices.end(), t.begin(), t.end());
    const int positions = writer_.add_with_bounds(vertices, 3, TINYGLTF_TARGET_ARRAY_BUFFER);
    return {positions,
            writer_.add<std::uint32_t>(indices, 1, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER)};
  }

  int material(const Colour& colour) {
    const auto [entry, is_new] = materials_.try_emplace(colour, 0);
    if (!is_new) return entry->second;
    tinygltf::Material material;
    material.pbrMetallicRoughness.baseColorFactor = {colour[0], colour[1], colour[2], 1};
    material.pbrMetallicRoughness.metallicFactor = 0;
    material.pbrMetallicRoughness.roughnessFactor = 0.7;
    material.doubleSided = true;
    writer_.model().materials.push_back(material);
    entry->second = static_cast<int>(writer_.model().materials.size()) - 1;
    return entry->second;
  }

  ModelWriter& writer_;
  const RecordingReader& reader_;
  Scalar plate_ = 1;  // half the side of what shows a half-space
  std::map<std::pair<std::size_t, Colour>, int> meshes_;
  std::map<std::size_t, std::pair<int, int>> surfaces_;
  std::map<Colour, int> materials_;
};

Colour colour_of(const RecordedBody& body, std::size_t number) {
  switch (body.kind) {
    case BodyKind::Static:
      return kStaticColour;
    case BodyKind::Kinematic:
      return kKinematicColour;
    case BodyKind::Dynamic:
      return kColours[number % kColours.size()];
  }
  return kStaticColour;
}

void add_channel(tinygltf::Animation& animation, int node, const char* path, int input, int output,
                 const char* interpolation) {
  tinygltf::AnimationSampler sampler;
  sampler.input = input;
  sampler.output = output;
  sampler.interpolation = interpolation;
  animation.samplers.push_back(sampler);
  tinygltf::AnimationChannel channel;
  channel.sampler = static_cast<int>(animation.samplers.size()) - 1;
  channel.target_node = node;
  channel.target_path = path;
  animation.channels.push_back(channel);
}

void add_motion(ModelWriter& writer, tinygltf::Animation& animation, int node,
                const std::vector<AnimationKey>& keys) {
  std::vector<float> times;
  std::vector<float> places;
  std::vector<float> rotations;
  for (const AnimationKey& key : keys) {
    times.push_back(key.t);
    append(places, key.v_in);
    append(places, key.p);
    append(places, key.v_out);
    append(rotations, key.q_rate_in);
    append(rotations, key.q);
    append(rotations, key.q_rate_out);
  }
  const int input = writer.add_with_bounds(times, 1);
  add_channel(animation, node, "translation", input, writer.add<float>(places, 3), "CUBICSPLINE");
  add_channel(animation, node, "rotation", input, writer.add<float>(rotations, 4), "CUBICSPLINE");
}

// An absent body is scaled to zero.
void add_presence(ModelWriter& writer, tinygltf::Animation& animation, int node,
                  const std::vector<view_internal::PresenceChange>& changes) {
  std::vector<float> times;
  std::vector<float> sizes;
  const auto add = [&](float t, bool is_there) {
    times.push_back(t);
    for (int k = 0; k < 3; ++k) sizes.push_back(is_there ? 1.0F : 0.0F);
  };
  if (changes.front().t > 0) add(0, true);
  for (const view_internal::PresenceChange& change : changes) {
    if (!times.empty() && !(times.back() < change.t)) continue;
    add(change.t, change.is_there);
  }
  const int input = writer.add_with_bounds(times, 1);
  add_channel(animation, node, "scale", input, writer.add<float>(sizes, 3), "STEP");
}

// The largest deviation from the run that the options allow.
Scalar tolerance_of(const RecordingReader& reader, const GltfOptions& options) {
  Scalar radius = kInfinity;
  for (const RecordedBody& body : reader.bodies()) {
    if (body.kind == BodyKind::Static) continue;
    if (as_half_space(*reader.shapes()[body.shape].shape)) continue;
    radius = std::min(radius, reader.shapes()[body.shape].shape->bounding_radius());
  }
  return options.tolerance * radius;
}

tinygltf::Node root_node(bool z_is_up) {
  tinygltf::Node root;
  root.name = "run";
  const double half = std::sqrt(0.5);
  if (z_is_up) root.rotation = {-half, 0, 0, half};
  return root;
}

void add_bodies(ModelWriter& writer, const RecordingReader& reader, const GltfOptions& options) {
  tinygltf::Animation animation;
  animation.name = "run";
  MeshMaker meshes(writer, reader);
  const Scalar tolerance = tolerance_of(reader, options);
  for (std::size_t k = 0; k < reader.bodies().size(); ++k) {
    const RecordedBody& body = reader.bodies()[k];
    const BodyAnimation path = view_internal::animation_of(reader, BodyId(k), tolerance);
    if (body.is_sensor || path.keys.empty()) continue;
    tinygltf::Node node;
    node.name = body.name;
    node.mesh = meshes.mesh(body.shape, colour_of(body, k));
    const Vector3& p = path.keys.front().p;
    const Vector4& q = path.keys.front().q;
    node.translation.assign(p.begin(), p.end());
    node.rotation.assign(q.begin(), q.end());
    const auto number = static_cast<int>(writer.model().nodes.size());
    writer.model().nodes.push_back(node);
    writer.model().nodes[0].children.push_back(number);
    if (path.keys.size() > 1) add_motion(writer, animation, number, path.keys);
    if (!path.changes.empty()) add_presence(writer, animation, number, path.changes);
  }
  if (!animation.channels.empty()) writer.model().animations.push_back(animation);
}

}  // namespace

void write_gltf(const std::filesystem::path& recording, const std::filesystem::path& out,
                const GltfOptions& options) {
  DYOP_REQUIRE(options.tolerance > 0, "the tolerance must be > 0, not ", options.tolerance);
  const RecordingReader reader(recording);
  if (!(reader.interval().length() > 0)) throw FileError(recording, "holds no committed step");
  ModelWriter writer;
  writer.model().nodes.push_back(root_node(options.z_is_up));
  add_bodies(writer, reader, options);
  tinygltf::Scene scene;
  scene.name = reader.header().title;
  scene.nodes = {0};
  writer.model().scenes = {scene};
  writer.model().defaultScene = 0;
  std::ostringstream bytes;
  constexpr bool kPretty = false;
  constexpr bool kBinary = true;
  const bool is_written =
      tinygltf::TinyGLTF().WriteGltfSceneToStream(&writer.model(), bytes, kPretty, kBinary);
  if (!is_written) throw FileError(out, "cannot be written as glTF");
  io_internal::require_other_than(out, {recording});
  io_internal::write_whole_file(out, bytes.str());
}

}  // namespace dyop

namespace dyop::view_internal {
namespace {

constexpr int kMostDivisions = 24;

Vector4 coefficients(const RigidPose& X_WB) {
  return X_WB.quaternion().normalized().coeffs();
}

// dq/dt = (0, w) q / 2 with w in world axes.
Vector4 rate_of(const Vector4& q, const Vector3& w_W) {
  const Quaternion rate = Quaternion(0, w_W.x() / 2, w_W.y() / 2, w_W.z() / 2) * Quaternion(q);
  return rate.coeffs();
}

template <typename Vector>
Vector spline(const Vector& x0, const Vector& rate0, const Vector& x1, const Vector& rate1,
              Scalar h, Scalar s) {
  const Scalar s2 = s * s;
  const Scalar s3 = s2 * s;
  return (2 * s3 - 3 * s2 + 1) * x0 + (s3 - 2 * s2 + s) * h * rate0 + (3 * s2 - 2 * s3) * x1 +
         (s3 - s2) * h * rate1;
}

class KeyMaker {
 public:
  KeyMaker(Scalar t_begin, Scalar radius, Scalar tolerance)
      : t_begin_(t_begin), radius_(radius), tolerance_(tolerance) {}

  // An interval without a velocity jump.
  void add(const MotionSegment& segment) {
    const Motion& motion = *segment.motion;
    const TimeInterval& interval = segment.interval;
    open(interval.begin, motion.state(interval.begin));
    if (segment.kind != SegmentKind::Rest) {
      Scalar begin = interval.begin;
      while (begin < interval.end) {  // a given motion may have jumps of its own
        const Scalar end = std::min(interval.end, motion.smooth_until(begin));
        divide(motion, begin, end, kMostDivisions);
        begin = end;
      }
    } else {
      close(interval.end, motion.state(interval.end));
    }
  }

  std::vector<AnimationKey> take() { return std::move(keys_); }
  float time_of(Scalar t) const { return static_cast<float>(t - t_begin_); }

 private:
  void divide(const Motion& motion, Scalar begin, Scalar end, int halvings) {
    const Scalar middle = begin + (end - begin) / 2;
    const bool can_divide = halvings > 0 && time_of(begin) < time_of(middle) &&
                            time_of(middle) < time_of(end) && motion.smooth_until(begin) >= end;
    if (!can_divide || is_near(motion, begin, end)) {
      close(end, motion.state(end));
      open(end, motion.state(end));
      return;
    }
    divide(motion, begin, middle, halvings - 1);
    divide(motion, middle, end, halvings - 1);
  }

  bool is_near(const Motion& motion, Scalar begin, Scalar end) const {
    const MotionState first = motion.state(begin);
    const MotionState last = motion.state(end);
    const Vector4 q0 = coefficients(first.X_WB);
    Vector4 q1 = coefficients(last.X_WB);
    if (q0.dot(q1) < 0) q1 = -q1;
    const Scalar h = end - begin;
    // literal: points of an interval, none of them special for a cubic
    for (const Scalar s : std::array{0.2, 0.5, 0.7}) {
      const RigidPose X_WB = motion.pose(begin + s * h);
      const Vector3 p = spline(first.X_WB.translation(), first.twist.v_WB, last.X_WB.translation(),
                               last.twist.v_WB, h, s);
      const Vector4 q =
          spline(q0, rate_of(q0, first.twist.w_WB), q1, rate_of(q1, last.twist.w_WB), h, s);
      const Matrix3 R = Quaternion(Vector4(q.normalized())).toRotationMatrix();
      const Scalar distance =
          (p - X_WB.translation()).norm() + radius_ * (R - X_WB.rotation()).norm();
      if (!(distance <= tolerance_)) return false;
    }
    return true;
  }

  // The key at a time; events within the resolution of single precision share one.
  AnimationKey& key_at(Scalar t, const MotionState& state) {
    if (keys_.empty() || keys_.back().t < time_of(t)) {
      AnimationKey& key = keys_.emplace_back();
      key.t = time_of(t);
    }
    AnimationKey& key = keys_.back();
    key.p = state.X_WB.translation();
    key.q = coefficients(state.X_WB);
    if (keys_.size() > 1 && key.q.dot(keys_[keys_.size() - 2].q) < 0) key.q = -key.q;
    return key;
  }

  void open(Scalar t, const MotionState& state) {
    AnimationKey& key = key_at(t, state);
    key.v_out = state.twist.v_WB;
    key.q_rate_out = rate_of(key.q, state.twist.w_WB);
  }

  // The first that ends at the key: what came before it.
  void close(Scalar t, const MotionState& state) {
    const bool is_new = keys_.back().t < time_of(t);
    AnimationKey& key = key_at(t, state);
    if (!is_new) return;
    key.v_in = state.twist.v_WB;
    key.q_rate_in = rate_of(key.q, state.twist.w_WB);
  }

  Scalar t_begin_;
  Scalar radius_;
  Scalar tolerance_;
  std::vector<AnimationKey> keys_;
};

}  // namespace

BodyAnimation animation_of(const RecordingReader& reader, BodyId body, Scalar tolerance) {
  const RecordedBody& recorded = reader.bodies()[body.slot];
  const Scalar radius = reader.shapes()[recorded.shape].shape->bounding_radius();
  KeyMaker maker(reader.interval().begin, radius, tolerance);
  BodyAnimation animation;
  bool was_there = true;
  const std::size_t count = reader.segment_count(body);
  bool moves = false;
  for (std::size_t k = 0; k < count; ++k) {
    const MotionSegment segment = reader.segment(body, k);
    const bool is_there = segment.kind != SegmentKind::Absent;
    const float t = maker.time_of(segment.interval.begin);
    if (k == 0 && t > 0) {  // a body that came later
      animation.changes.push_back({0, false});
      was_there = false;
    }
    if (is_there != was_there) animation.changes.push_back({t, is_there});
    was_there = is_there;
    moves = moves || (segment.kind != SegmentKind::Rest && is_there) || k > 0;
    if (is_there) maker.add(segment);
  }
  animation.keys = maker.take();
  if (!moves && animation.keys.size() > 1) animation.keys.resize(1);
  return animation;
}

}  // namespace dyop::view_internal
