// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ompl/base/MotionValidator.h>
#include <ompl/base/SpaceInformation.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "dyop/chain/kinematic_chain.h"
#include "dyop/geometry/shape.h"
#include "dyop/motion/motion.h"
#include "dyop/toi/obstacle_set.h"

namespace DYOP_EXPORT dyop {

namespace ompl_internal {
class EdgeCheck;
}

struct OmplOptions {
  /// A motion is valid if the distance stays above this; length, >= 0.
  Scalar clearance = 0;
  /// ToiOptions::distance_tolerance and max_node_pairs, for one motion.
  std::optional<Scalar> distance_tolerance = {};
  std::int64_t max_node_pairs = 10'000'000;
  /// Treat the moving body as a solid if it is a closed mesh. For chains see Link::is_solid.
  bool solid_body = false;
};

/// Validates motions for the planners of OMPL by proof instead of by samples: a motion is valid
/// only if every state between its ends is at least `clearance` away from all obstacles. Motions
/// that could not be decided within the budget are not valid.
///
/// Thread-safe as long as the obstacles do not change. Updates the counters of OMPL's base class.
///
///     si->setMotionValidator(std::make_shared<dyop::OmplMotionValidator>(si, body, obstacles));
class OmplMotionValidator final : public ompl::base::MotionValidator {
 public:
  /// A body with a given motion, between two states of any space.
  struct Body {
    std::shared_ptr<const Shape> shape;
    std::shared_ptr<const Motion> X_WB;  ///< defined on [0, 1]: the first state to the second
    bool is_solid = false;
  };
  /// Returns the moving bodies between two states: forward kinematics given as one motion per link.
  /// Must match StateSpace::interpolate(); called from several threads.
  using Bodies =
      std::function<std::vector<Body>(const ompl::base::State* from, const ompl::base::State* to)>;

  /// One rigid body in an SE3StateSpace, whose states are poses of its frame. Between two states
  /// the origin moves linearly and the body turns along OMPL's shortest arc.
  /// @throws InvalidArgument if a pointer is null, the space is of another type, or an option is
  ///         out of range; so do the two below.
  OmplMotionValidator(const ompl::base::SpaceInformationPtr& si, std::shared_ptr<const Shape> body,
                      std::shared_ptr<const ObstacleSet> obstacles,
                      const OmplOptions& options = {});
  /// A chain in a RealVectorStateSpace of its coordinates, with self-collision.
  OmplMotionValidator(const ompl::base::SpaceInformationPtr& si,
                      std::shared_ptr<const KinematicChain> chain,
                      std::shared_ptr<const ObstacleSet> obstacles,
                      const OmplOptions& options = {});
  /// Bodies on the caller's motions, each against the obstacles.
  OmplMotionValidator(const ompl::base::SpaceInformationPtr& si, Bodies bodies,
                      std::shared_ptr<const ObstacleSet> obstacles,
                      const OmplOptions& options = {});
  ~OmplMotionValidator() override;

  bool checkMotion(const ompl::base::State* s1, const ompl::base::State* s2) const override;

  /// If the motion is not valid, lastValid.second is the time up to which it is proven free, from 0
  /// for s1 to 1 for s2 (ToiResult::t_safe exactly), and lastValid.first, unless null, the state
  /// there.
  bool checkMotion(const ompl::base::State* s1, const ompl::base::State* s2,
                   std::pair<ompl::base::State*, double>& lastValid) const override;

  /// Whether one state is valid, by the same rule: for SpaceInformation::setStateValidityChecker().
  /// No valid motion starts at an invalid state.
  bool is_valid(const ompl::base::State* state) const;

 private:
  bool count(bool is_valid) const;

  std::unique_ptr<const ompl_internal::EdgeCheck> check_;
};

}  // namespace dyop
