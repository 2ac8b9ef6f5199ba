// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "io/robot/xml_reader.h"

namespace dyop::io_internal {

/// A model in MuJoCo's format, MJCF: its files, the settings of its compiler and the defaults of
/// its classes. Semantics: "XML reference" and "Modeling" of MuJoCo's documentation.
class MjcfDocument {
 public:
  explicit MjcfDocument(const XmlFile& main);

  /// The children of an element; those of an included file stand in place of <include>.
  std::vector<XmlNode> children(const XmlNode& node);
  /// The children of all elements of this name below the root.
  std::vector<XmlNode> section(const char* name);

  /// The default of an attribute of an element of this class, if it has one.
  std::optional<XmlNode> default_of(const std::string& cls, const char* element,
                                    const char* attribute) const;
  bool has_class(const std::string& cls) const { return classes_.count(cls) != 0; }

  Scalar angle_unit() const { return angle_unit_; }  ///< in radians
  /// Rotations in this order, each about an axis that turns along (lower case) or rests.
  const std::string& euler_sequence() const { return euler_sequence_; }
  /// Whether the geoms of a body give its mass: only where it states none, always, or never.
  enum class MassSource { Auto, Geoms, Inertial };
  MassSource mass_source() const { return mass_source_; }
  /// The least mass of a body, and the mass of all bodies; unless that is above 0, they weigh what
  /// they state.
  Scalar least_mass() const { return least_mass_; }
  Scalar total_mass() const { return total_mass_; }
  /// The path of a mesh file.
  std::filesystem::path mesh_path(const std::string& file) const;

 private:
  struct Class {
    std::string parent;             // empty: none
    std::vector<XmlNode> elements;  // defaults of elements, of any name
  };

  void expand(const XmlNode& node, int depth, std::vector<XmlNode>& children);
  const XmlFile& included(const XmlNode& node);
  void read_compiler(const XmlNode& node);
  void read_defaults(const XmlNode& node, const std::string& parent, int depth);

  XmlNode root_;
  std::filesystem::path folder_;
  std::map<std::filesystem::path, std::unique_ptr<XmlFile>> files_;
  int inclusions_ = 0;
  std::map<std::string, Class> classes_;
  Scalar angle_unit_;
  std::string euler_sequence_ = "xyz";
  std::filesystem::path mesh_folder_;
  bool strips_paths_ = false;
  MassSource mass_source_ = MassSource::Auto;
  Scalar least_mass_ = 0;
  Scalar total_mass_ = -1;
};

/// An element with the attributes that its class gives it.
class MjcfElement {
 public:
  /// @param child_class Its class, if it names none itself.
  MjcfElement(const MjcfDocument& document, const XmlNode& node, const std::string& child_class);

  const XmlNode& node() const { return node_; }
  bool has(const char* attribute) const { return holder(attribute).has_value(); }
  /// The element that has the attribute: this one or a default. @throws FileError if none has it.
  XmlNode at(const char* attribute) const;
  std::string text_or(const char* attribute, const std::string& otherwise) const;
  Scalar number_or(const char* attribute, Scalar otherwise) const;
  Vector3 vector3_or(const char* attribute, const Vector3& otherwise) const;
  /// Position and orientation in the frame of the parent, in any of the ways to state it.
  RigidPose pose() const;

 private:
  std::optional<XmlNode> holder(const char* attribute) const;

  const MjcfDocument& document_;
  XmlNode node_;
  std::string class_;
};

/// A rotation that turns z into this direction.
/// @throws FileError at the element if the direction is zero.
Matrix3 rotation_of_z_to(const Vector3& direction, const XmlNode& node, const char* attribute);

/// A quaternion w, x, y, z of any length > 0.
Matrix3 quaternion_rotation(const XmlNode& node, const char* attribute);

}  // namespace dyop::io_internal
