// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/view/gltf_file.h"

#include <tiny_gltf.h>

#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <span>
#include <sstream>

#include "dyop/io/file_error.h"
#include "dyop/io/recording_reader.h"
#include "io/output_file.h"
#include "view/gltf/animation_keys.h"
#include "view/shape_surface.h"

namespace dyop {
namespace {

using view_internal::AnimationKey;
using view_internal::BodyAnimation;
using view_internal::Vector4;

// Of spheres and other smooth shapes.
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
  MeshMaker(ModelWriter& writer, const RecordingReader& reader)
      : writer_(writer), reader_(reader) {}

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
        view_internal::surface_of(*reader_.shapes()[shape].shape, kFineness);
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
