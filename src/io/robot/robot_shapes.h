// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/shape.h"
#include "dyop/geometry/triangle_mesh.h"
#include "io/robot/xml_reader.h"

namespace dyop::io_internal {

/// Finds the files that a robot's file names, and loads meshes, each once per scale.
class MeshFinder {
 public:
  /// @param file          The robot's file.
  /// @param package_paths Folders to search before those of the file.
  MeshFinder(const std::filesystem::path& file, std::vector<std::filesystem::path> package_paths);

  /// The mesh of this name and scale; messages are about the element's attribute, which names it.
  std::shared_ptr<const TriangleMesh> load(const XmlNode& node, const char* attribute,
                                           const std::string& name, const Vector3& scale);

  /// Any other file that is named so.
  std::filesystem::path find(const XmlNode& node, const char* attribute, const std::string& name);

  /// What was found in another place than the file says, one line each.
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  // The path below a package, and the package; "file://" and no prefix at all have no package.
  struct MeshName {
    std::string package;
    std::filesystem::path path;
  };

  static MeshName parse_name(const XmlNode& node, const char* attribute, const std::string& name);
  std::optional<std::filesystem::path> find_in_paths(const MeshName& wanted) const;
  std::filesystem::path find_by_name(const XmlNode& node, const char* attribute,
                                     const std::string& name, const std::filesystem::path& wanted);

  std::filesystem::path folder_;  // of the file
  std::vector<std::filesystem::path> paths_;
  std::map<std::string, std::filesystem::path> found_;  // by the name in the file
  std::map<std::string, std::shared_ptr<const TriangleMesh>> loaded_;
  std::vector<std::string> notes_;
};

/// A link's shape, all of its collision shapes as one.
struct LinkShape {
  std::shared_ptr<const Shape> shape;  ///< null: no geometry
  bool is_solid = false;               ///< every mesh is closed
};

/// Several shapes as one; a single one in its own frame is itself.
std::shared_ptr<const Shape> joined(const std::vector<CompoundChild>& children);

/// Reads the elements <collision> of an element <link> of URDF.
LinkShape read_link_shape(const XmlNode& link, MeshFinder& meshes);

}  // namespace dyop::io_internal
