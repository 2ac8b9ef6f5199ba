// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/chain/robot.h"

#include <algorithm>
#include <cmath>

#include "dyop/core/error.h"

namespace dyop {
namespace {

void require_free(const Robot& robot, const JointVector& free) {
  DYOP_REQUIRE(std::size_t(free.size()) == robot.free_count(), "robot '", robot.name, "' has ",
               robot.free_count(), " free coordinates, not ", free.size());
  DYOP_REQUIRE(free.allFinite(), "coordinates must be finite, not (", free.transpose(), ")");
}

Scalar value_at(const CoordinateCoupling& coupling, Scalar free) {
  return coupling.multiplier * free + coupling.offset;
}

// The last free coordinate, on the way to `far`, that does not take q beyond `limit`.
Scalar last_free(const CoordinateCoupling& coupling, Scalar limit, Scalar far) {
  Scalar free = (limit - coupling.offset) / coupling.multiplier;
  if (!std::isfinite(free)) return far;
  const bool grows = (coupling.multiplier > 0) == (far > 0);
  // The quotient is rounded by a few units.
  for (int k = 0; k < 16; ++k) {
    const Scalar value = value_at(coupling, free);
    if (grows ? value <= limit : value >= limit) break;
    free = std::nextafter(free, -far);
  }
  return free;
}

// Smallest and largest free coordinate within the limits of all that it drives.
std::pair<Scalar, Scalar> range_of(const Robot& robot, std::size_t free) {
  std::pair<Scalar, Scalar> all{-kInfinity, kInfinity};
  for (std::size_t k = 0; k < robot.couplings.size(); ++k) {
    if (robot.couplings[k].free != free) continue;
    const Joint& joint = robot.chain->joints()[robot.chain->joint_of(k)];
    const auto [lower, upper] = robot.couplings[k].free_limits(joint.lower, joint.upper);
    all = {std::max(all.first, lower), std::min(all.second, upper)};
  }
  return all;
}

}  // namespace

std::pair<Scalar, Scalar> CoordinateCoupling::free_limits(Scalar lower, Scalar upper) const {
  if (multiplier == 0) {
    const bool is_within = lower <= offset && offset <= upper;
    return is_within ? std::pair(-kInfinity, kInfinity) : std::pair(kInfinity, -kInfinity);
  }
  if (multiplier < 0) std::swap(lower, upper);
  return {last_free(*this, lower, -kInfinity), last_free(*this, upper, kInfinity)};
}

JointVector Robot::expand(const JointVector& free) const {
  require_free(*this, free);
  JointVector q(Eigen::Index(couplings.size()));
  for (std::size_t k = 0; k < couplings.size(); ++k) {
    q[Eigen::Index(k)] = value_at(couplings[k], free[Eigen::Index(couplings[k].free)]);
  }
  return q;
}

JointVector Robot::expand_rates(const JointVector& free_rates) const {
  require_free(*this, free_rates);
  JointVector rates(Eigen::Index(couplings.size()));
  for (std::size_t k = 0; k < couplings.size(); ++k) {
    rates[Eigen::Index(k)] = couplings[k].multiplier * free_rates[Eigen::Index(couplings[k].free)];
  }
  return rates;
}

// Mimicking is affine, so it maps control points.
JointPath Robot::expand(const JointPath& free) const {
  DYOP_REQUIRE(free.coordinate_count() == free_count(), "robot '", name, "' has ", free_count(),
               " free coordinates, the path has ", free.coordinate_count());
  std::vector<Eigen::MatrixXd> controls;
  for (std::size_t piece = 0; piece + 1 < free.times().size(); ++piece) {
    const Eigen::MatrixXd from = free.controls(piece);
    Eigen::MatrixXd to(Eigen::Index(couplings.size()), from.cols());
    for (Eigen::Index k = 0; k < from.cols(); ++k) to.col(k) = expand(JointVector(from.col(k)));
    controls.push_back(std::move(to));
  }
  return JointPath::bezier(free.times(), controls);
}

JointVector Robot::lower() const {
  JointVector limits(static_cast<Eigen::Index>(free_count()));
  for (std::size_t k = 0; k < free_count(); ++k) limits[Eigen::Index(k)] = range_of(*this, k).first;
  return limits;
}

JointVector Robot::upper() const {
  JointVector limits(static_cast<Eigen::Index>(free_count()));
  for (std::size_t k = 0; k < free_count(); ++k)
    limits[Eigen::Index(k)] = range_of(*this, k).second;
  return limits;
}

bool Robot::is_within_limits(const JointVector& free) const {
  return chain->is_within_limits(expand(free));
}

JointVector Robot::resting_state() const {
  return JointVector::Zero(Eigen::Index(free_count())).cwiseMin(upper()).cwiseMax(lower());
}

std::optional<Eigen::Index> Robot::free_index(const std::string& joint) const {
  for (std::size_t k = 0; k < free_count(); ++k) {
    if (chain->joints()[free_joints[k]].name == joint) return Eigen::Index(k);
  }
  return std::nullopt;
}

Robot make_robot(std::string name, KinematicChain chain) {
  Robot robot;
  robot.name = std::move(name);
  robot.masses.assign(chain.links().size(), 0);
  for (std::size_t k = 0; k < chain.coordinate_count(); ++k) {
    robot.couplings.push_back({k, 1, 0});
    robot.free_joints.push_back(chain.joint_of(k));
  }
  robot.chain = std::make_shared<const KinematicChain>(std::move(chain));
  return robot;
}

KinematicChain attach(const KinematicChain& chain, Link object, const std::string& parent,
                      const RigidPose& X_PO, const std::vector<std::string>& touch_links) {
  std::vector<Link> links(chain.links().begin(), chain.links().end());
  std::vector<Joint> joints(chain.joints().begin(), chain.joints().end());
  KinematicChain::Options options = chain.options();
  for (const std::string& link : touch_links) {
    options.ignored_pairs.emplace_back(object.name, link);
  }
  options.ignored_pairs.emplace_back(object.name, parent);
  Joint joint;
  joint.name = object.name + "/attached";
  joint.type = JointType::Fixed;
  joint.parent = parent;
  joint.child = object.name;
  joint.X_PJ = X_PO;
  joints.push_back(joint);
  links.push_back(std::move(object));
  return KinematicChain(std::move(links), std::move(joints), options);
}

// The new joint is the last one and fixed, so numbers of links, joints and coordinates stay.
Robot attach(const Robot& robot, Link object, const std::string& parent, const RigidPose& X_PO,
             const std::vector<std::string>& touch_links) {
  DYOP_REQUIRE(robot.chain, "attach: robot '", robot.name, "' has no chain");
  Robot result = robot;
  result.masses.push_back(0);
  result.chain = std::make_shared<const KinematicChain>(
      attach(*robot.chain, std::move(object), parent, X_PO, touch_links));
  return result;
}

}  // namespace dyop
