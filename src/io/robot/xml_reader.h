// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <tinyxml2.h>

#include <filesystem>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "dyop/core/rigid_pose.h"
#include "dyop/io/file_error.h"

namespace dyop::io_internal {

/// An element of an XML file, with errors that name file, line, element and value.
class XmlNode {
 public:
  XmlNode(const std::filesystem::path& file, const tinyxml2::XMLElement& element)
      : file_(&file), element_(&element) {}

  std::string name() const { return element_->Name(); }
  std::optional<XmlNode> find(const char* child) const;
  /// @throws FileError if there is none.
  XmlNode at(const char* child) const;
  std::vector<XmlNode> all(const char* child) const;
  std::vector<XmlNode> children() const;
  /// Names and values of all attributes.
  std::vector<std::pair<std::string, std::string>> attributes() const;

  bool has(const char* attribute) const { return element_->Attribute(attribute) != nullptr; }
  /// @throws FileError if it is missing or empty.
  std::string text(const char* attribute) const;
  /// A finite number. @throws FileError if it is missing or is not one.
  Scalar number(const char* attribute) const;
  Scalar number_or(const char* attribute, Scalar otherwise) const;
  /// A number > 0.
  Scalar positive(const char* attribute) const;
  /// Finite numbers, between blanks.
  std::vector<Scalar> numbers(const char* attribute) const;
  /// Three finite numbers.
  Vector3 vector3(const char* attribute) const;
  Vector3 vector3_or(const char* attribute, const Vector3& otherwise) const;
  /// The pose of the child `origin`, identity if there is none.
  RigidPose origin() const;

  [[noreturn]] void fail(const std::string& problem) const;
  [[noreturn]] void fail_expected(const char* attribute, const std::string& what) const;

 private:
  const std::filesystem::path* file_;
  const tinyxml2::XMLElement* element_;
};

/// A parsed file. Its nodes refer to it.
class XmlFile {
 public:
  /// @param roots The names that the root element may have; any, if there are none.
  /// @throws FileError if the file is not well-formed or its root element has another name.
  XmlFile(const std::filesystem::path& file, std::initializer_list<const char*> roots);

  const std::filesystem::path& path() const { return file_; }
  XmlNode root() const { return {file_, *document_.RootElement()}; }

 private:
  std::filesystem::path file_;
  tinyxml2::XMLDocument document_;
};

}  // namespace dyop::io_internal
