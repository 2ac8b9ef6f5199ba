// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "dyop/chain/joint_path.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/geometry/shape.h"
#include "dyop/motion/motion.h"

namespace DYOP_EXPORT dyop {

/// A rigid part of a chain. Several shapes make one CompoundShape.
struct Link {
  std::string name = {};
  std::shared_ptr<const Shape> shape = {};  ///< in the link's frame L; none: the link hits nothing
  bool is_solid = false;  ///< treat a closed mesh as a solid, as ToiOptions::solid_a
  /// Obstacles that share none of these groups with the link are ignored for it, such as the floor
  /// under a base.
  std::uint32_t groups = ~std::uint32_t{0};
};

enum class JointType { Fixed, Revolute, Prismatic };

/// How a child link C moves relative to its parent link P, at the coordinate q:
///     X_PC = X_PJ exp(q axis_J)         (Revolute)
///     X_PC = X_PJ shifted by q axis_J   (Prismatic)
///     X_PC = X_PJ                       (Fixed)
struct Joint {
  std::string name = {};
  JointType type = JointType::Revolute;
  std::string parent = {};
  std::string child = {};
  RigidPose X_PJ = RigidPose();
  Vector3 axis_J = Vector3::UnitZ();  ///< any nonzero length; unused for a fixed joint
  Scalar lower = -kInfinity;          ///< smallest and largest coordinate; see is_within_limits()
  Scalar upper = kInfinity;
};

/// Links in a tree of joints, such as a robot's arm. One link, the root, has no joint above it and
/// rests in the world. Immutable; queries are const and thread-safe.
class KinematicChain {
 public:
  struct Options {
    RigidPose X_WR;  ///< pose of the root link in the world
    /// Pairs of names of links that are never checked against each other.
    std::vector<std::pair<std::string, std::string>> ignored_pairs = {};
    /// Pairs that are checked although they are neighbours, such as the ground and the first link
    /// that moves on it. An ignored pair stays ignored.
    std::vector<std::pair<std::string, std::string>> checked_pairs = {};
  };
  /// Two links that self-collision checks, by index, first < second.
  struct LinkPair {
    std::size_t first = 0;
    std::size_t second = 0;
  };
  /// A joint prepared for computing: indices for names, unit axis in the parent's frame.
  struct Step {
    JointType type = JointType::Fixed;
    std::size_t parent = 0;      ///< number of the parent link
    std::size_t coordinate = 0;  ///< of the joint, unless Fixed
    RigidPose X_PJ;
    Vector3 axis_P = Vector3::UnitZ();
    /// The rotation at q is turn_fixed + cos(q) turn_cosine + sin(q) turn_sine.
    Matrix3 turn_fixed = Matrix3::Identity();
    Matrix3 turn_cosine = Matrix3::Zero();
    Matrix3 turn_sine = Matrix3::Zero();
  };

  /// @throws InvalidArgument naming the link or joint if links are missing, names repeat or are
  ///         unknown, joints do not make one tree of all links, an axis is zero, or limits are
  ///         reversed.
  KinematicChain(std::vector<Link> links, std::vector<Joint> joints, const Options& options);
  KinematicChain(std::vector<Link> links, std::vector<Joint> joints)
      : KinematicChain(std::move(links), std::move(joints), Options()) {}

  std::span<const Link> links() const { return links_; }
  std::span<const Joint> joints() const { return joints_; }
  const RigidPose& X_WR() const { return options_.X_WR; }
  const Options& options() const { return options_; }

  /// The number of joints that are not fixed. Coordinates are in the order of these joints.
  std::size_t coordinate_count() const { return coordinate_joints_.size(); }
  /// The index of the joint of a coordinate.
  std::size_t joint_of(std::size_t coordinate) const { return coordinate_joints_[coordinate]; }

  /// The index of the link with this name, if there is one.
  std::optional<std::size_t> find_link(std::string_view name) const;

  /// Whether every coordinate lies within its joint's limits. Queries do not check this: they
  /// accept any path.
  bool is_within_limits(const JointVector& q) const;

  /// Poses X_WL of all links, in their order.
  /// @throws InvalidArgument unless q has as many coordinates as the chain, all finite.
  std::vector<RigidPose> link_poses(const JointVector& q) const;

  /// How a link moves with the coordinates: one twist for each, per unit of it, zero for joints
  /// that are not above the link. With distance_derivatives(): dd/dq_k is the sum over both links
  /// of PoseGradient::along() of their twist k.
  /// @throws InvalidArgument as link_poses(), or if there is no such link.
  std::vector<Twist> link_jacobian(std::size_t link, const JointVector& q) const;

  /// Whether the link rests at all coordinates, as the root does: only fixed joints are above it.
  /// @throws InvalidArgument if there is no such link.
  bool is_fixed(std::size_t link) const;

  /// Pairs that self-collision checks: both links have shapes, they are not neighbours (joined
  /// directly, or only through links without shapes) or among Options::checked_pairs, and the pair
  /// is not ignored.
  std::span<const LinkPair> self_pairs() const { return self_pairs_; }

  /// For inner loops: the joint above a link; none for the root.
  const std::optional<Step>& step(std::size_t link) const { return steps_[link]; }
  /// The last link on both paths from the root.
  std::size_t common_ancestor(std::size_t first, std::size_t second) const;
  /// Whether two links are joined directly, or only through links without shapes.
  bool are_neighbours(std::size_t first, std::size_t second) const;
  /// Number of joints between the root and a link.
  std::size_t depth(std::size_t link) const { return depths_[link]; }

 private:
  void link_up();
  void sort_from_root();
  void list_self_pairs();
  std::size_t number_of(const std::string& name, const char* what) const;

  std::vector<Link> links_;
  std::vector<Joint> joints_;
  Options options_;
  std::vector<std::optional<Step>> steps_;      // by link
  std::vector<std::size_t> from_root_;          // links, parents first
  std::vector<std::size_t> depths_;             // by link
  std::vector<std::size_t> coordinate_joints_;  // by coordinate
  std::vector<LinkPair> self_pairs_;
};

}  // namespace dyop
