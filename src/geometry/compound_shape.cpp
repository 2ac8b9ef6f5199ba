// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/compound_shape.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/geometry/half_space.h"
#include "geometry/compound_tree.h"
#include "geometry/solid.h"

namespace dyop {
namespace {

std::vector<CompoundChild> flattened(const std::vector<CompoundChild>& children) {
  DYOP_REQUIRE(!children.empty(), "a compound needs at least one child");
  std::vector<CompoundChild> result;
  for (std::size_t i = 0; i < children.size(); ++i) {
    const CompoundChild& child = children[i];
    DYOP_REQUIRE(child.shape != nullptr, "child ", i, " of a compound has no shape");
    DYOP_REQUIRE(!as_half_space(*child.shape), "child ", i,
                 " of a compound is a half-space, which has no bounds: give it a body of its own");
    if (child.shape->kind() != ShapeKind::Compound) {
      result.push_back(child);
      continue;
    }
    for (const CompoundChild& inner : static_cast<const CompoundShape&>(*child.shape).children()) {
      result.push_back({inner.shape, child.X_CS * inner.X_CS});
    }
  }
  return result;
}

}  // namespace

CompoundShape::CompoundShape(const std::vector<CompoundChild>& children)
    : children_(flattened(children)),
      tree_(std::make_shared<const geometry_internal::CompoundTree>(children_)) {
  for (const geometry_internal::CompoundPart& part : tree_->parts) {
    bounding_box_.extend(part.shape().bounding_box());
    bounding_radius_ = std::max(bounding_radius_, part.shape().bounding_radius());
  }
}

// The parallel axis theorem about the common centre of mass.
MassProperties CompoundShape::compute_mass_properties(Scalar density) const {
  geometry_internal::require_density(density);
  std::vector<MassProperties> parts;
  MassProperties whole;
  Vector3 moment = Vector3::Zero();
  for (std::size_t i = 0; i < children_.size(); ++i) {
    try {
      parts.push_back(geometry_internal::posed(children_[i].shape->compute_mass_properties(density),
                                               children_[i].X_CS));
    } catch (const InvalidArgument& error) {
      throw InvalidArgument(
          core_internal::compose_message("child ", i, " of the compound: ", error.what()));
    }
    whole.mass += parts.back().mass;
    moment += parts.back().mass * parts.back().p_BoBcm;
  }
  whole.p_BoBcm = moment / whole.mass;
  for (const MassProperties& part : parts) {
    const Vector3 arm = part.p_BoBcm - whole.p_BoBcm;
    whole.I_BBcm +=
        part.I_BBcm + part.mass * (arm.squaredNorm() * Matrix3::Identity() - arm * arm.transpose());
  }
  return geometry_internal::require_representable(whole);
}

}  // namespace dyop

namespace dyop::geometry_internal {
namespace {

using Node = MeshHierarchy::Node;

constexpr int kColumns = MeshHierarchy::kWidth;

// A box that contains boxes.
OrientedBox box_around(std::span<const OrientedBox> boxes) {
  AlignedBox bounds;
  for (const OrientedBox& box : boxes) {
    const Vector3 reach = box.axes.cwiseAbs() * box.half_extents;
    bounds.extend(box.center - reach);
    bounds.extend(box.center + reach);
  }
  OrientedBox result;
  result.center = bounds.center();
  const Scalar size = bounds.min().cwiseAbs().cwiseMax(bounds.max().cwiseAbs()).sum();
  result.half_extents = (bounds.sizes() / 2).array() + kBoxNoise * size;
  return result;
}

// Stores a box in units of another scale, `ratio` times this one: exactly, except for numbers that
// underflow.
void copy_box(const BoxGroup& from, int from_column, float ratio, BoxGroup& to, int to_column) {
  for (int row = 0; row < BoxGroup::kRows; ++row) {
    const float number = from.rows[row][from_column];
    const bool is_axis = row >= BoxGroup::kAxes && row < BoxGroup::kHalfExtents;
    to.rows[row][to_column] = is_axis ? number : number * ratio;
  }
  bool is_exact = true;
  for (int i = 0; i < 3; ++i) {
    for (const int row : {BoxGroup::kCenter + i, BoxGroup::kHalfExtents + i}) {
      is_exact = is_exact && to.rows[row][to_column] / ratio == from.rows[row][from_column];
    }
  }
  if (is_exact) return;
  for (int row = BoxGroup::kHalfExtents; row < BoxGroup::kRows; ++row) {
    // literal: more than the absolute error of numbers that underflow in single precision.
    to.rows[row][to_column] = float_above(Scalar(to.rows[row][to_column]) + 0x1p-140);
  }
}

void fill_columns(Node& node, int count) {
  for (int column = count; column < kColumns; ++column) {
    node.child[column] = MeshHierarchy::kNothing;
    copy_box(node.boxes, count - 1, 1, node.boxes, column);
  }
}

class TreeBuilder {
 public:
  explicit TreeBuilder(CompoundTree& tree) : tree_(tree) {
    for (const CompoundPart& part : tree_.parts) boxes_.push_back(root_box(part));
    const OrientedBox root = box_around(boxes_);
    tree_.frame = BoxFrame::around(root);
    for (const OrientedBox& box : boxes_) tree_.frame.make_room(box);
    for (const CompoundPart& part : tree_.parts) {
      if (!part.mesh) continue;
      tree_.frame.scale = std::max(tree_.frame.scale, part.mesh->hierarchy().frame().scale);
    }
  }

  void build() {
    std::vector<std::int32_t> all;
    for (std::size_t i = 0; i < boxes_.size(); ++i) all.push_back(std::int32_t(i));
    tree_.nodes.emplace_back();
    set_column(0, 0, all);
    fill_columns(tree_.nodes[0], 1);
    tree_.part_boxes.resize(tree_.nodes.size() * std::size_t(kColumns));
    for (const std::size_t box : part_boxes_) tree_.part_boxes[box] = true;
  }

 private:
  static OrientedBox root_box(const CompoundPart& part) {
    if (!part.mesh) return part.convex->box();
    const MeshHierarchy& tree = part.mesh->hierarchy();
    return tree.nodes()[0].boxes.box(0, tree.frame());
  }
  const OrientedBox& box(std::int32_t child) const { return boxes_[std::size_t(child)]; }

  // Adds the node with the parts of a group of several children.
  std::int32_t add_node(const std::vector<std::int32_t>& children) {
    const auto number = std::int32_t(tree_.nodes.size());
    tree_.nodes.emplace_back();
    const std::vector<std::vector<std::int32_t>> groups = divide(children);
    for (std::size_t i = 0; i < groups.size(); ++i) set_column(number, int(i), groups[i]);
    fill_columns(tree_.nodes[std::size_t(number)], int(groups.size()));
    return number;
  }

  void set_column(std::int32_t number, int column, const std::vector<std::int32_t>& children) {
    const auto node = [&]() -> Node& { return tree_.nodes[std::size_t(number)]; };
    const CompoundPart& first = tree_.part(children[0]);
    if (children.size() == 1) part_boxes_.push_back(std::size_t(number * kColumns + column));
    if (children.size() == 1 && first.mesh) {
      const MeshHierarchy& mesh = first.mesh->hierarchy();
      take_box(mesh, mesh.nodes()[0], 0, node(), column);
      const std::int32_t link = add_mesh(mesh, first.first_piece);
      node().child[column] = link;
      return;
    }
    std::vector<OrientedBox> boxes;
    for (const std::int32_t child : children) boxes.push_back(box(child));
    node().boxes.set_box(column, boxes.size() == 1 ? boxes[0] : box_around(boxes), tree_.frame);
    const std::int32_t link = children.size() == 1 ? -1 - first.first_piece : add_node(children);
    node().child[column] = link;
  }

  void take_box(const MeshHierarchy& mesh, const Node& from, int from_column, Node& to,
                int to_column) const {
    if (mesh.frame().origin == tree_.frame.origin) {
      const auto ratio = static_cast<float>(mesh.frame().scale / tree_.frame.scale);
      copy_box(from.boxes, from_column, ratio, to.boxes, to_column);
    } else {
      to.boxes.set_box(to_column, from.boxes.box(from_column, mesh.frame()), tree_.frame);
    }
  }

  // Appends the tree of a mesh without its first node; returns what that node links to.
  std::int32_t add_mesh(const MeshHierarchy& mesh, std::int32_t first_piece) {
    const std::int32_t base = std::int32_t(tree_.nodes.size()) - 1;
    const auto link = [&](std::int32_t child) {
      if (child == MeshHierarchy::kNothing) return child;
      return child >= 0 ? base + child : child - first_piece;
    };
    for (std::size_t i = 1; i < mesh.nodes().size(); ++i) {
      const Node& from = mesh.nodes()[i];
      Node& to = tree_.nodes.emplace_back();
      for (int column = 0; column < kColumns; ++column) {
        take_box(mesh, from, column, to, column);
        to.child[column] = link(from.child[column]);
      }
    }
    return link(mesh.nodes()[0].child[0]);
  }

  // Divides children into groups for the columns of a node: the largest group is halved along the
  // axis on which its centers spread most, until there are enough.
  std::vector<std::vector<std::int32_t>> divide(const std::vector<std::int32_t>& children) const {
    std::vector<std::vector<std::int32_t>> groups{children};
    const auto is_smaller = [](const auto& x, const auto& y) { return x.size() < y.size(); };
    while (groups.size() < std::size_t(kColumns)) {
      const auto largest = std::max_element(groups.begin(), groups.end(), is_smaller);
      if (largest->size() < 2) break;
      std::vector<std::int32_t> upper = cut_half(*largest);
      groups.push_back(std::move(upper));
    }
    return groups;
  }

  std::vector<std::int32_t> cut_half(std::vector<std::int32_t>& group) const {
    AlignedBox centers;
    for (const std::int32_t child : group) centers.extend(box(child).center);
    Eigen::Index axis = 0;
    centers.sizes().maxCoeff(&axis);
    std::sort(group.begin(), group.end(), [&](std::int32_t x, std::int32_t y) {
      return std::make_pair(box(x).center[axis], x) < std::make_pair(box(y).center[axis], y);
    });
    const auto middle = group.begin() + std::ptrdiff_t(group.size() / 2);
    std::vector<std::int32_t> upper(middle, group.end());
    group.erase(middle, group.end());
    return upper;
  }

  CompoundTree& tree_;
  std::vector<OrientedBox> boxes_;  // of the children
  std::vector<std::size_t> part_boxes_;
};

}  // namespace

CompoundTree::CompoundTree(std::span<const CompoundChild> children) {
  std::size_t piece_count = 0;
  for (const CompoundChild& child : children) {
    CompoundPart& part = parts.emplace_back();
    part.first_piece = std::int32_t(piece_count);
    if (child.shape->kind() == ShapeKind::TriangleMesh) {
      const auto& mesh = static_cast<const TriangleMesh&>(*child.shape);
      piece_count += mesh.triangles().size();
      part.mesh = mesh.with_vertices(posed_vertices(mesh, child.X_CS));
    } else {
      ++piece_count;
      part.convex = std::make_unique<const PosedConvex>(
          std::static_pointer_cast<const ConvexShape>(child.shape), child.X_CS);
    }
    DYOP_REQUIRE(piece_count <= kLargestTriangleCount, "a compound has at most ",
                 kLargestTriangleCount, " triangles and convex shapes, not ", piece_count);
  }
  TreeBuilder(*this).build();
}

std::int32_t CompoundTree::child_of(std::int32_t piece) const {
  const auto next = std::upper_bound(
      parts.begin(), parts.end(), piece,
      [](std::int32_t number, const CompoundPart& part) { return number < part.first_piece; });
  return std::int32_t(next - parts.begin()) - 1;
}

std::int32_t CompoundTree::part_in(std::int32_t box) const {
  const auto child = [&] {
    return nodes[std::size_t(box / kColumns)].child[std::size_t(box % kColumns)];
  };
  while (child() >= 0) box = child() * kColumns;
  return child_of(-1 - child());
}

MassProperties posed(const MassProperties& properties, const RigidPose& X_CS) {
  const Matrix3& R_CS = X_CS.rotation();
  return {properties.mass, X_CS * properties.p_BoBcm, R_CS * properties.I_BBcm * R_CS.transpose()};
}

std::vector<Vector3> posed_vertices(const TriangleMesh& mesh, const RigidPose& X_CS) {
  std::vector<Vector3> vertices(mesh.vertices().begin(), mesh.vertices().end());
  for (Vector3& vertex : vertices) vertex = X_CS * vertex;
  return vertices;
}

namespace {

// A box keeps its closed forms only in its own frame.
SimpleCore posed_core(const ConvexShape& shape, const RigidPose& X_CS) {
  SimpleCore core = shape.simple_core();
  if (core.kind == CoreKind::Box) core.kind = CoreKind::General;
  if (core.kind == CoreKind::General) return core;
  core.center = X_CS * core.center;
  core.half_extents = X_CS.rotation() * core.half_extents;
  core.is_centred = false;
  core.bounding_radius =
      (X_CS.translation().norm() + core.bounding_radius) * (1 + 8 * kUnitRoundoff);
  return core;
}

}  // namespace

PosedConvex::PosedConvex(std::shared_ptr<const ConvexShape> shape, const RigidPose& X_CS)
    : ConvexShape(posed_core(*shape, X_CS)), shape_(std::move(shape)), X_CS_(X_CS) {}

const TriangleMesh* PosedConvex::core_surface() const {
  const TriangleMesh* surface = shape_->core_surface();
  if (!surface) return nullptr;
  return &surface_.get([&] { return surface->with_vertices(posed_vertices(*surface, X_CS_)); });
}

FlatPart PosedConvex::flat_part(const Vector3& unit_direction, Scalar sine) const {
  FlatPart part = shape_->flat_part(X_CS_.rotation().transpose() * unit_direction, sine);
  part.center = X_CS_ * part.center;
  part.axis = X_CS_.rotation() * part.axis;
  return part;
}

OrientedBox PosedConvex::box() const {
  const AlignedBox bounds = shape_->bounding_box();
  OrientedBox box;
  box.center = X_CS_ * bounds.center();
  box.axes = X_CS_.rotation();
  const Scalar size =
      X_CS_.translation().norm() + bounds.min().cwiseAbs().cwiseMax(bounds.max().cwiseAbs()).norm();
  box.half_extents = (bounds.sizes() / 2).array() + kBoxNoise * size;
  return box;
}

AlignedBox PosedConvex::bounding_box() const {
  const OrientedBox turned = box();
  const Scalar noise = kBoxNoise * (turned.center.norm() + turned.half_extents.norm());
  const Vector3 reach = (turned.axes.cwiseAbs() * turned.half_extents).array() + noise;
  return {turned.center - reach, turned.center + reach};
}

Scalar PosedConvex::bounding_radius() const {
  const Scalar by_center = X_CS_.translation().norm() + shape_->bounding_radius();
  const OrientedBox turned = box();
  // A corner's coordinates along the axes of the box.
  const Vector3 middle = turned.axes.transpose() * turned.center;
  const Scalar by_corner = (middle.cwiseAbs() + turned.half_extents).norm();
  return std::min(by_center, by_corner) * (1 + kBoxNoise);
}

MassProperties PosedConvex::compute_mass_properties(Scalar density) const {
  return posed(shape_->compute_mass_properties(density), X_CS_);
}

}  // namespace dyop::geometry_internal
