// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <charconv>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "dyop/io/file_error.h"
#include "io/mesh/mesh_reader.h"

#ifdef DYOP_HAS_ASSIMP
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <tinyxml2.h>

#include <assimp/Importer.hpp>
#endif

namespace dyop::io_internal {

#ifdef DYOP_HAS_ASSIMP

namespace {

// assimp takes memory for whatever length a block of a binary glTF file claims.
void check_blocks(const std::filesystem::path& file, std::string_view bytes) {
  constexpr std::size_t kHead = 12;
  constexpr std::size_t kBlockHead = 8;
  for (std::size_t at = kHead; at + kBlockHead <= bytes.size();) {
    std::uint32_t length = 0;
    for (std::size_t k = 4; k-- > 0;)
      length = length << 8 | static_cast<unsigned char>(bytes[at + k]);
    if (length > bytes.size() - at - kBlockHead) {
      throw FileError(file, compose_message("a block of ", length, " bytes at byte ", at,
                                            " is longer than the file"));
    }
    at += kBlockHead + length;
  }
}

// What assimp 5.2 takes on trust in COLLADA: it never gets past what is no number in a list of
// indices, and reads beyond an array that is shorter than its accessor says.
class ColladaCheck {
 public:
  ColladaCheck(const std::filesystem::path& file, std::string_view bytes)
      : file_(file), most_(bytes.size()) {
    tinyxml2::XMLDocument document;
    if (document.Parse(bytes.data(), bytes.size()) != tinyxml2::XML_SUCCESS) {
      throw FileError(file, compose_message("not a readable mesh: ", document.ErrorStr()));
    }
    if (document.RootElement() != nullptr) visit(*document.RootElement());
    for (const Accessor& accessor : accessors_) {
      const auto found = arrays_.find(accessor.array);
      if (found != arrays_.end() && accessor.size > found->second) {
        throw FileError(file_,
                        compose_message("the array '", accessor.array, "' has ", found->second,
                                        " numbers, ", accessor.size, " are used"));
      }
    }
  }

 private:
  struct Accessor {
    std::string array;
    std::uint64_t size;
  };

  void visit(const tinyxml2::XMLElement& element) {
    const std::string_view name = element.Name();
    const std::uint64_t count = number(element, "count", 0);
    if (name.ends_with("_array") && element.Attribute("id") != nullptr) {
      arrays_[element.Attribute("id")] = count;
    } else if (name == "accessor" && element.Attribute("source") != nullptr) {
      const std::string_view source = element.Attribute("source");
      accessors_.push_back({std::string(source.substr(source.starts_with("#") ? 1 : 0)),
                            number(element, "offset", 0) + count * number(element, "stride", 1)});
    } else if (name == "input") {
      number(element, "offset", 0);
    }
    const bool has_indices = name == "p" || name == "h" || name == "v" || name == "vcount";
    for (const auto* child = element.FirstChild(); child != nullptr; child = child->NextSibling()) {
      if (child->ToElement() != nullptr) visit(*child->ToElement());
      if (has_indices && child->ToText() != nullptr) check_indices(element, child->Value());
    }
  }

  void check_indices(const tinyxml2::XMLElement& element, std::string_view text) const {
    const std::size_t other = text.find_first_not_of("0123456789+- \t\r\n");
    if (other == text.npos) return;
    throw FileError(file_, FilePosition{std::size_t(element.GetLineNum()), {}},
                    compose_message("expected an index in <", element.Name(), ">, found '",
                                    text.substr(other, 1), "'"));
  }

  // An attribute that counts what is in the file, so that it is no larger than this.
  std::uint64_t number(const tinyxml2::XMLElement& element, const char* name,
                       std::uint64_t missing) const {
    const char* text = element.Attribute(name);
    if (text == nullptr) return missing;
    std::uint64_t value = 0;
    const char* end = text + std::string_view(text).size();
    const auto [rest, error] = std::from_chars(text, end, value);
    if (error == std::errc() && rest == end && value <= most_) return value;
    throw FileError(file_, FilePosition{std::size_t(element.GetLineNum()), {}},
                    compose_message("<", element.Name(), "> has ", name, " = '", text, "'"));
  }

  const std::filesystem::path& file_;
  std::uint64_t most_;
  std::map<std::string, std::uint64_t> arrays_;  // lengths by id
  std::vector<Accessor> accessors_;
};

void check_before_assimp(const std::filesystem::path& file, std::string_view bytes) {
  if (bytes.starts_with("glTF")) check_blocks(file, bytes);
  if (bytes.find("<COLLADA") != bytes.npos) ColladaCheck(file, bytes);
}

// assimp does not check indices.
void check_face(const std::filesystem::path& file, const aiMesh& mesh, unsigned number) {
  const aiFace& face = mesh.mFaces[number];
  if (face.mNumIndices == 0) {
    throw FileError(file, compose_message("face ", number, " has no vertices"));
  }
  for (unsigned k = 0; k < face.mNumIndices; ++k) {
    if (face.mIndices[k] < mesh.mNumVertices) continue;
    throw FileError(
        file, compose_message("face ", number, ": vertex index ", face.mIndices[k],
                              " is out of range: the mesh has ", mesh.mNumVertices, " vertices"));
  }
}

// Appends one mesh of the file, placed by its node.
void append_mesh(const std::filesystem::path& file, const aiMesh& mesh, const aiMatrix4x4& X_WN,
                 PolygonMesh& all) {
  const std::size_t first = all.vertices.size();
  for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
    const aiVector3D p = X_WN * mesh.mVertices[v];
    const Vector3 p_W(Scalar(p.x), Scalar(p.y), Scalar(p.z));
    if (!p_W.allFinite()) {
      throw FileError(file, compose_message("vertex ", v, ": expected finite numbers, found (",
                                            p_W.x(), ", ", p_W.y(), ", ", p_W.z(), ")"));
    }
    all.vertices.push_back(p_W);
  }
  const bool is_mirrored = X_WN.Determinant() < 0;
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    check_face(file, mesh, f);
    const aiFace& face = mesh.mFaces[f];
    all.begin_polygon();
    for (unsigned k = 0; k < face.mNumIndices; ++k) {
      const unsigned corner = is_mirrored ? face.mNumIndices - 1 - k : k;
      all.add_corner(std::int64_t(first + face.mIndices[corner]));
    }
  }
}

void append_node(const std::filesystem::path& file, const aiScene& scene, const aiNode& node,
                 const aiMatrix4x4& X_WP, PolygonMesh& all) {
  const aiMatrix4x4 X_WN = X_WP * node.mTransformation;
  for (unsigned k = 0; k < node.mNumMeshes; ++k) {
    append_mesh(file, *scene.mMeshes[node.mMeshes[k]], X_WN, all);
  }
  for (unsigned k = 0; k < node.mNumChildren; ++k) {
    append_node(file, scene, *node.mChildren[k], X_WN, all);
  }
}

std::string problem_of(std::string reason) {
  if (reason.find("contains no faces") != std::string::npos) return "the file has no triangles";
  std::replace_if(
      reason.begin(), reason.end(), [](unsigned char c) { return c < ' '; }, ' ');
  return "not a readable mesh: " + (reason.empty() ? "no reason given" : reason);
}

}  // namespace

PolygonMesh read_with_assimp(const std::filesystem::path& file, std::string_view bytes, UpAxis up) {
  check_before_assimp(file, bytes);
  Assimp::Importer importer;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, up == UpAxis::AsWritten);
  const aiScene* scene = importer.ReadFile(file.string(), aiProcess_ValidateDataStructure);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    throw FileError(file, problem_of(importer.GetErrorString()));
  }
  PolygonMesh all;
  append_node(file, *scene, *scene->mRootNode, aiMatrix4x4(), all);
  return all;
}

#else

PolygonMesh read_with_assimp(const std::filesystem::path& file, std::string_view, UpAxis) {
  throw FileError(file,
                  "this format needs assimp, which this build of dyop lacks "
                  "(CMake option DYOP_WITH_ASSIMP); supported without it: .obj, .off, .ply, .stl");
}

#endif

}  // namespace dyop::io_internal
