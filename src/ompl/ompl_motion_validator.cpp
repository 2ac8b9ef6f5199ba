// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/ompl/ompl_motion_validator.h"

#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/base/spaces/SE3StateSpace.h>

#include <atomic>
#include <cmath>

#include "dyop/core/error.h"
#include "ompl/edge_check.h"

namespace dyop {
namespace {

const ompl::base::SpaceInformationPtr& require_sound(const ompl::base::SpaceInformationPtr& si,
                                                     const void* body, const void* obstacles,
                                                     const OmplOptions& options) {
  DYOP_REQUIRE(si && body && obstacles,
               "OmplMotionValidator needs a space information, a body and obstacles, one is null");
  DYOP_REQUIRE(options.clearance >= 0 && options.clearance < kInfinity,
               "clearance must be finite and >= 0, not ", options.clearance);
  DYOP_REQUIRE(!options.distance_tolerance || *options.distance_tolerance > 0,
               "distance tolerance must be > 0, not ", *options.distance_tolerance);
  DYOP_REQUIRE(options.max_node_pairs >= 1, "max_node_pairs must be >= 1, not ",
               options.max_node_pairs);
  return si;
}

}  // namespace

OmplMotionValidator::OmplMotionValidator(const ompl::base::SpaceInformationPtr& si,
                                         std::shared_ptr<const Shape> body,
                                         std::shared_ptr<const ObstacleSet> obstacles,
                                         const OmplOptions& options)
    : MotionValidator(require_sound(si, body.get(), obstacles.get(), options)) {
  const bool is_se3 =
      dynamic_cast<const ompl::base::SE3StateSpace*>(si->getStateSpace().get()) != nullptr;
  DYOP_REQUIRE(is_se3, "a rigid body needs an SE3StateSpace, not ", si->getStateSpace()->getName());
  check_ = ompl_internal::make_body_check(std::move(body), std::move(obstacles), options);
}

OmplMotionValidator::OmplMotionValidator(const ompl::base::SpaceInformationPtr& si,
                                         std::shared_ptr<const KinematicChain> chain,
                                         std::shared_ptr<const ObstacleSet> obstacles,
                                         const OmplOptions& options)
    : MotionValidator(require_sound(si, chain.get(), obstacles.get(), options)) {
  const auto* space =
      dynamic_cast<const ompl::base::RealVectorStateSpace*>(si->getStateSpace().get());
  DYOP_REQUIRE(space && space->getDimension() == chain->coordinate_count(), "a chain of ",
               chain->coordinate_count(),
               " coordinates needs a RealVectorStateSpace of as many dimensions, not ",
               si->getStateSpace()->getName(), " of ", si->getStateSpace()->getDimension());
  check_ = ompl_internal::make_chain_check(std::move(chain), std::move(obstacles), options);
}

OmplMotionValidator::OmplMotionValidator(const ompl::base::SpaceInformationPtr& si, Bodies bodies,
                                         std::shared_ptr<const ObstacleSet> obstacles,
                                         const OmplOptions& options)
    : MotionValidator(require_sound(si, bodies ? &bodies : nullptr, obstacles.get(), options)),
      check_(ompl_internal::make_bodies_check(std::move(bodies), std::move(obstacles), options)) {}

OmplMotionValidator::~OmplMotionValidator() = default;

bool OmplMotionValidator::count(bool is_valid) const {
  std::atomic_ref(is_valid ? valid_ : invalid_).fetch_add(1, std::memory_order_relaxed);
  return is_valid;
}

bool OmplMotionValidator::checkMotion(const ompl::base::State* s1,
                                      const ompl::base::State* s2) const {
  return count(check_->examine(s1, s2).is_free);
}

bool OmplMotionValidator::checkMotion(const ompl::base::State* s1, const ompl::base::State* s2,
                                      std::pair<ompl::base::State*, double>& lastValid) const {
  const ompl_internal::EdgeVerdict verdict = check_->examine(s1, s2);
  if (!verdict.is_free) {
    lastValid.second = verdict.t_safe;
    if (lastValid.first) {
      si_->getStateSpace()->interpolate(s1, s2, verdict.t_safe, lastValid.first);
    }
  }
  return count(verdict.is_free);
}

bool OmplMotionValidator::is_valid(const ompl::base::State* state) const {
  return check_->examine(state, state).is_free;
}

}  // namespace dyop
