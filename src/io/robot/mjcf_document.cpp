// SPDX-License-Identifier: BSD-3-Clause
#include "io/robot/mjcf_document.h"

#include <array>
#include <cctype>
#include <numbers>

#include "core/assert.h"

namespace dyop::io_internal {
namespace {

using core_internal::compose_message;

// More are taken for files that include each other.
constexpr int kMostInclusions = 1000;
constexpr int kDeepestInclusion = 20;
// The library of XML has its own, larger limit for one file.
constexpr int kDeepestDefault = 100;

constexpr std::array kOrientations{"quat", "axisangle", "euler", "xyaxes", "zaxis"};

Vector3 unit_of(const Vector3& v, const XmlNode& node, const char* attribute) {
  if (v.isZero(0)) node.fail_expected(attribute, "vectors other than 0");
  return v.stableNormalized();
}

std::vector<Scalar> numbers_of(const XmlNode& node, const char* attribute, std::size_t count) {
  const std::vector<Scalar> numbers = node.numbers(attribute);
  if (numbers.size() != count) {
    node.fail_expected(attribute, compose_message(count, " finite numbers"));
  }
  return numbers;
}

Matrix3 axis_rotation(const Vector3& axis, Scalar angle) {
  return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}

Matrix3 euler_rotation(const Vector3& angles, const std::string& sequence) {
  Matrix3 R = Matrix3::Identity();
  for (int k = 0; k < 3; ++k) {
    const char letter = sequence[static_cast<std::size_t>(k)];
    const bool turns_along = std::islower(static_cast<unsigned char>(letter)) != 0;
    const int axis = std::tolower(static_cast<unsigned char>(letter)) - 'x';
    const Matrix3 turn = axis_rotation(Vector3::Unit(axis), angles[k]);
    R = turns_along ? Matrix3(R * turn) : Matrix3(turn * R);
  }
  return R;
}

Matrix3 axes_rotation(const XmlNode& node) {
  const std::vector<Scalar> v = numbers_of(node, "xyaxes", 6);
  const Vector3 x = unit_of({v[0], v[1], v[2]}, node, "xyaxes");
  const Vector3 given = unit_of({v[3], v[4], v[5]}, node, "xyaxes");
  const Vector3 y = unit_of(given - x.dot(given) * x, node, "xyaxes");
  Matrix3 R;
  R << x, y, x.cross(y);
  return R;
}

Matrix3 rotation(const XmlNode& node, const std::string& attribute, const MjcfDocument& document) {
  if (attribute == "quat") return quaternion_rotation(node, "quat");
  if (attribute == "axisangle") {
    const std::vector<Scalar> v = numbers_of(node, "axisangle", 4);
    return axis_rotation(unit_of({v[0], v[1], v[2]}, node, "axisangle"),
                         v[3] * document.angle_unit());
  }
  if (attribute == "euler") {
    return euler_rotation(node.vector3("euler") * document.angle_unit(), document.euler_sequence());
  }
  if (attribute == "xyaxes") return axes_rotation(node);
  return rotation_of_z_to(node.vector3("zaxis"), node, "zaxis");
}

}  // namespace

Matrix3 rotation_of_z_to(const Vector3& direction, const XmlNode& node, const char* attribute) {
  return rotation_between(Vector3::UnitZ(), unit_of(direction, node, attribute)).toRotationMatrix();
}

Matrix3 quaternion_rotation(const XmlNode& node, const char* attribute) {
  const std::vector<Scalar> v = numbers_of(node, attribute, 4);
  const Eigen::Vector4d q(v[0], v[1], v[2], v[3]);
  if (q.isZero(0)) node.fail_expected(attribute, "a quaternion other than 0");
  const Eigen::Vector4d unit = q.stableNormalized();
  return Eigen::Quaterniond(unit[0], unit[1], unit[2], unit[3]).toRotationMatrix();
}

// --- the document -------------------------------------------------------------------------------

MjcfDocument::MjcfDocument(const XmlFile& main)
    : root_(main.root()), folder_(main.path().parent_path()), angle_unit_(std::numbers::pi / 180) {
  classes_["main"];
  for (const XmlNode& node : children(root_)) {
    if (node.name() == "compiler") read_compiler(node);
    if (node.name() == "default") read_defaults(node, "", 0);
  }
}

const XmlFile& MjcfDocument::included(const XmlNode& node) {
  const std::string name = node.text("file");
  if (++inclusions_ > kMostInclusions) node.fail("files are included too often");
  std::unique_ptr<XmlFile>& file = files_[(folder_ / name).lexically_normal()];
  if (!file) file = std::make_unique<XmlFile>(folder_ / name, std::initializer_list<const char*>{});
  return *file;
}

void MjcfDocument::expand(const XmlNode& node, int depth, std::vector<XmlNode>& children) {
  for (const XmlNode& child : node.children()) {
    if (child.name() != "include") {
      children.push_back(child);
    } else if (depth == kDeepestInclusion) {
      child.fail("files include each other too deep");
    } else {
      expand(included(child).root(), depth + 1, children);
    }
  }
}

std::vector<XmlNode> MjcfDocument::children(const XmlNode& node) {
  std::vector<XmlNode> found;
  expand(node, 0, found);
  return found;
}

std::vector<XmlNode> MjcfDocument::section(const char* name) {
  std::vector<XmlNode> found;
  for (const XmlNode& node : children(root_)) {
    if (node.name() == name) expand(node, 0, found);
  }
  return found;
}

void MjcfDocument::read_compiler(const XmlNode& node) {
  if (node.has("angle")) {
    const std::string unit = node.text("angle");
    if (unit != "degree" && unit != "radian") node.fail_expected("angle", "degree or radian");
    angle_unit_ = unit == "radian" ? 1 : std::numbers::pi / 180;
  }
  if (node.has("coordinate") && node.text("coordinate") != "local") {
    node.fail_expected("coordinate", "local");
  }
  if (node.has("eulerseq")) {
    euler_sequence_ = node.text("eulerseq");
    if (euler_sequence_.size() != 3 ||
        euler_sequence_.find_first_not_of("xyzXYZ") != std::string::npos) {
      node.fail_expected("eulerseq", "three letters of x, y, z, X, Y, Z");
    }
  }
  if (node.has("assetdir")) mesh_folder_ = node.text("assetdir");
  if (node.has("meshdir")) mesh_folder_ = node.text("meshdir");
  if (node.has("strippath")) strips_paths_ = node.text("strippath") == "true";
  if (node.has("inertiafromgeom")) {
    const std::string source = node.text("inertiafromgeom");
    if (source != "true" && source != "false" && source != "auto") {
      node.fail_expected("inertiafromgeom", "true, false or auto");
    }
    mass_source_ = source == "true"    ? MassSource::Geoms
                   : source == "false" ? MassSource::Inertial
                                       : MassSource::Auto;
  }
  least_mass_ = node.number_or("boundmass", least_mass_);
  total_mass_ = node.number_or("settotalmass", total_mass_);
}

void MjcfDocument::read_defaults(const XmlNode& node, const std::string& parent, int depth) {
  if (depth == kDeepestDefault) node.fail("defaults are nested too deep");
  const bool is_top = parent.empty();
  // The outermost class is the main one, also by another name.
  const std::string name = is_top ? "main" : node.text("class");
  if (!is_top && has_class(name)) node.fail_expected("class", "a class that is new");
  if (is_top && node.has("class") && node.text("class") != name) {
    classes_[node.text("class")].parent = name;
  }
  Class& cls = classes_[name];
  if (!is_top) cls.parent = parent;
  for (const XmlNode& child : children(node)) {
    if (child.name() == "default") {
      read_defaults(child, name, depth + 1);
    } else {
      cls.elements.push_back(child);
    }
  }
}

std::optional<XmlNode> MjcfDocument::default_of(const std::string& cls, const char* element,
                                                const char* attribute) const {
  for (auto at = classes_.find(cls); at != classes_.end(); at = classes_.find(at->second.parent)) {
    const std::vector<XmlNode>& elements = at->second.elements;
    for (auto node = elements.rbegin(); node != elements.rend(); ++node) {
      if (node->name() == element && node->has(attribute)) return *node;
    }
  }
  return std::nullopt;
}

std::filesystem::path MjcfDocument::mesh_path(const std::string& file) const {
  const std::filesystem::path path = file;
  return mesh_folder_ / (strips_paths_ ? path.filename() : path);
}

// --- an element ---------------------------------------------------------------------------------

MjcfElement::MjcfElement(const MjcfDocument& document, const XmlNode& node,
                         const std::string& child_class)
    : document_(document),
      node_(node),
      class_(node.has("class")     ? node.text("class")
             : child_class.empty() ? "main"
                                   : child_class) {
  if (!document.has_class(class_)) {
    node.fail(
        compose_message("class: expected the name of a class of defaults, found '", class_, "'"));
  }
}

std::optional<XmlNode> MjcfElement::holder(const char* attribute) const {
  if (node_.has(attribute)) return node_;
  return document_.default_of(class_, node_.name().c_str(), attribute);
}

XmlNode MjcfElement::at(const char* attribute) const {
  return holder(attribute).value_or(node_);
}

std::string MjcfElement::text_or(const char* attribute, const std::string& otherwise) const {
  const auto found = holder(attribute);
  return found ? found->text(attribute) : otherwise;
}

Scalar MjcfElement::number_or(const char* attribute, Scalar otherwise) const {
  const auto found = holder(attribute);
  return found ? found->number(attribute) : otherwise;
}

Vector3 MjcfElement::vector3_or(const char* attribute, const Vector3& otherwise) const {
  const auto found = holder(attribute);
  return found ? found->vector3(attribute) : otherwise;
}

RigidPose MjcfElement::pose() const {
  const Vector3 position = vector3_or("pos", Vector3::Zero());
  const char* stated = nullptr;
  for (const char* attribute : kOrientations) {
    if (!node_.has(attribute)) continue;
    if (stated) node_.fail(compose_message("expected one of '", stated, "' and '", attribute, "'"));
    stated = attribute;
  }
  if (stated) return RigidPose(rotation(node_, stated, document_), position);
  for (const char* attribute : kOrientations) {
    if (const auto found = holder(attribute)) {
      return RigidPose(rotation(*found, attribute, document_), position);
    }
  }
  return RigidPose(position);
}

}  // namespace dyop::io_internal
