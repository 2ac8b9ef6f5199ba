// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/chain/kinematic_chain.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "chain/chain_frame.h"
#include "dyop/core/error.h"

namespace dyop {
namespace {

void require_distinct_names(std::span<const Link> links, std::span<const Joint> joints) {
  for (std::size_t i = 0; i < links.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      DYOP_REQUIRE(links[i].name != links[k].name, "two links have the name '", links[i].name, "'");
    }
  }
  for (std::size_t i = 0; i < joints.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      DYOP_REQUIRE(joints[i].name != joints[k].name, "two joints have the name '", joints[i].name,
                   "'");
    }
  }
}

KinematicChain::Step step_of(const Joint& joint) {
  KinematicChain::Step step;
  step.type = joint.type;
  step.X_PJ = joint.X_PJ;
  if (joint.type != JointType::Fixed) {
    DYOP_REQUIRE(joint.axis_J.allFinite() && !joint.axis_J.isZero(0), "axis of joint '", joint.name,
                 "' must be finite and not zero, not (", joint.axis_J.transpose(), ")");
    DYOP_REQUIRE(joint.lower <= joint.upper, "limits of joint '", joint.name,
                 "' must not be reversed: ", joint.lower, " > ", joint.upper);
    step.axis_P = (joint.X_PJ.rotation() * joint.axis_J.stableNormalized()).normalized();
  }
  chain_internal::set_turn(step);
  return step;
}

}  // namespace

KinematicChain::KinematicChain(std::vector<Link> links, std::vector<Joint> joints,
                               const Options& options)
    : links_(std::move(links)), joints_(std::move(joints)), options_(options) {
  DYOP_REQUIRE(!links_.empty(), "a chain needs a link");
  require_distinct_names(links_, joints_);
  link_up();
  sort_from_root();
  list_self_pairs();
}

void KinematicChain::link_up() {
  steps_.resize(links_.size());
  for (std::size_t number = 0; number < joints_.size(); ++number) {
    const Joint& joint = joints_[number];
    Step step = step_of(joint);
    step.parent = number_of(joint.parent, "parent");
    const std::size_t child = number_of(joint.child, "child");
    DYOP_REQUIRE(!steps_[child], "joint '", joint.name, "': link '", joint.child,
                 "' is already the child of another joint");
    if (joint.type != JointType::Fixed) {
      step.coordinate = coordinate_joints_.size();
      coordinate_joints_.push_back(number);
    }
    steps_[child] = step;
  }
}

void KinematicChain::sort_from_root() {
  depths_.resize(links_.size());
  for (std::size_t link = 0; link < links_.size(); ++link) {
    std::size_t depth = 0;
    for (std::size_t up = link; steps_[up]; up = steps_[up]->parent) {
      DYOP_REQUIRE(++depth <= joints_.size(), "the joints above link '", links_[link].name,
                   "' form a loop");
    }
    depths_[link] = depth;
    from_root_.push_back(link);
  }
  const auto root_count = std::count(depths_.begin(), depths_.end(), std::size_t{0});
  DYOP_REQUIRE(root_count == 1, "a chain needs one link without a joint above, not ", root_count);
  std::stable_sort(from_root_.begin(), from_root_.end(),
                   [this](std::size_t a, std::size_t b) { return depths_[a] < depths_[b]; });
}

std::size_t KinematicChain::number_of(const std::string& name, const char* what) const {
  const std::optional<std::size_t> number = find_link(name);
  DYOP_REQUIRE(number, what, " '", name, "' is not a link of the chain");
  return *number;
}

std::optional<std::size_t> KinematicChain::find_link(std::string_view name) const {
  for (std::size_t i = 0; i < links_.size(); ++i) {
    if (links_[i].name == name) return i;
  }
  return std::nullopt;
}

bool KinematicChain::is_within_limits(const JointVector& q) const {
  DYOP_REQUIRE(std::size_t(q.size()) == coordinate_count(), "the chain has ", coordinate_count(),
               " coordinates, not ", q.size());
  for (std::size_t i = 0; i < coordinate_count(); ++i) {
    const Joint& joint = joints_[coordinate_joints_[i]];
    const Scalar value = q[static_cast<Eigen::Index>(i)];
    if (!(joint.lower <= value && value <= joint.upper)) return false;
  }
  return true;
}

std::vector<RigidPose> KinematicChain::link_poses(const JointVector& q) const {
  DYOP_REQUIRE(std::size_t(q.size()) == coordinate_count(), "the chain has ", coordinate_count(),
               " coordinates, not ", q.size());
  DYOP_REQUIRE(q.allFinite(), "coordinates must be finite, not (", q.transpose(), ")");
  std::vector<RigidPose> poses(links_.size());
  for (const std::size_t link : from_root_) {
    if (!steps_[link]) {
      poses[link] = X_WR();
      continue;
    }
    const Step& step = *steps_[link];
    const bool is_fixed = step.type == JointType::Fixed;
    const Scalar value = is_fixed ? 0 : q[static_cast<Eigen::Index>(step.coordinate)];
    poses[link] = poses[step.parent] * chain_internal::step_pose(step, value);
  }
  return poses;
}

std::vector<Twist> KinematicChain::link_jacobian(std::size_t link, const JointVector& q) const {
  DYOP_REQUIRE(link < links_.size(), "the chain has ", links_.size(), " links, no link ", link);
  const std::vector<RigidPose> poses = link_poses(q);
  std::vector<Twist> twists(coordinate_count());
  for (std::size_t up = link; steps_[up]; up = steps_[up]->parent) {
    const Step& step = *steps_[up];
    if (step.type == JointType::Fixed) continue;
    const RigidPose& X_WP = poses[step.parent];
    const Vector3 axis_W = X_WP.rotation() * step.axis_P;
    Twist& twist = twists[step.coordinate];
    if (step.type == JointType::Prismatic) {
      twist.v_WB = axis_W;
    } else {
      const Vector3 p_WJ = X_WP * step.X_PJ.translation();
      twist = {axis_W.cross(poses[link].translation() - p_WJ), axis_W};
    }
  }
  return twists;
}

bool KinematicChain::is_fixed(std::size_t link) const {
  DYOP_REQUIRE(link < links_.size(), "the chain has ", links_.size(), " links, no link ", link);
  for (; steps_[link]; link = steps_[link]->parent) {
    if (steps_[link]->type != JointType::Fixed) return false;
  }
  return true;
}

std::size_t KinematicChain::common_ancestor(std::size_t first, std::size_t second) const {
  while (first != second) {
    std::size_t& deeper = depths_[first] >= depths_[second] ? first : second;
    deeper = steps_[deeper]->parent;
  }
  return first;
}

// Whether no other link with a shape lies between them.
bool KinematicChain::are_neighbours(std::size_t first, std::size_t second) const {
  const std::size_t meeting = common_ancestor(first, second);
  if (meeting != first && meeting != second && links_[meeting].shape) return false;
  for (const std::size_t end : {first, second}) {
    if (end == meeting) continue;
    for (std::size_t up = steps_[end]->parent; up != meeting; up = steps_[up]->parent) {
      if (links_[up].shape) return false;
    }
  }
  return true;
}

void KinematicChain::list_self_pairs() {
  using Numbers = std::set<std::pair<std::size_t, std::size_t>>;
  const auto numbers_of = [this](std::span<const std::pair<std::string, std::string>> names,
                                 const char* what) {
    Numbers numbers;
    for (const auto& [first, second] : names) {
      numbers.insert(std::minmax(number_of(first, what), number_of(second, what)));
    }
    return numbers;
  };
  const Numbers ignored = numbers_of(options_.ignored_pairs, "ignored pair:");
  const Numbers checked = numbers_of(options_.checked_pairs, "checked pair:");
  for (std::size_t first = 0; first < links_.size(); ++first) {
    for (std::size_t second = first + 1; second < links_.size(); ++second) {
      if (!links_[first].shape || !links_[second].shape) continue;
      if (ignored.count({first, second}) != 0) continue;
      if (are_neighbours(first, second) && checked.count({first, second}) == 0) continue;
      self_pairs_.push_back({first, second});
    }
  }
}

}  // namespace dyop
