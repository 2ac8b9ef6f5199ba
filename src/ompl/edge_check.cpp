// SPDX-License-Identifier: BSD-3-Clause
#include "ompl/edge_check.h"

#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/base/spaces/SE3StateSpace.h>

#include <array>
#include <cmath>

#include "dyop/chain/certify_chain.h"
#include "dyop/motion/interpolated_motion.h"

namespace dyop::ompl_internal {
namespace {

constexpr TimeInterval kEdge{0, 1};

ToiOptions toi_options(const OmplOptions& options) {
  ToiOptions result;
  result.target_distance = options.clearance;
  result.distance_tolerance = options.distance_tolerance;
  result.max_node_pairs = options.max_node_pairs;
  return result;
}

EdgeVerdict verdict_of(const ToiResult& result) {
  return {result.status == ToiStatus::Separated, result.t_safe};
}

using Se3State = ompl::base::SE3StateSpace::StateType;

// Along OMPL's arc, which the sign of the quaternions' product decides: at half a turn, rounding
// must not choose the other one.
InterpolatedMotion motion_between(const Se3State& from, const Se3State& to) {
  const auto& q0 = from.rotation();
  const auto& q1 = to.rotation();
  const Scalar product = q0.x * q1.x + q0.y * q1.y + q0.z * q1.z + q0.w * q1.w;
  const Scalar sign = product < 0 ? -1 : 1;
  const RigidPose X_WC(Quaternion(q0.w, q0.x, q0.y, q0.z), Vector3::Zero());
  const Quaternion turn = Quaternion(q0.w, q0.x, q0.y, q0.z).conjugate() *
                          Quaternion(sign * q1.w, sign * q1.x, sign * q1.y, sign * q1.z);
  const Scalar size = turn.vec().norm();
  const Scalar angle = 2 * std::atan2(size, std::abs(product));
  const Vector3 theta = size > 0 ? Vector3(angle / size * turn.vec()) : Vector3::Zero();
  return InterpolatedMotion::from_chart(
      kEdge, X_WC, {Vector3(from.getX(), from.getY(), from.getZ()), Vector3::Zero()},
      {Vector3(to.getX(), to.getY(), to.getZ()), theta});
}

class BodyCheck final : public EdgeCheck {
 public:
  BodyCheck(std::shared_ptr<const Shape> body, std::shared_ptr<const ObstacleSet> obstacles,
            const OmplOptions& options)
      : body_(std::move(body)), obstacles_(std::move(obstacles)), options_(toi_options(options)) {
    options_.solid_a = options.solid_body;
  }

  EdgeVerdict examine(const ompl::base::State* from, const ompl::base::State* to) const override {
    const InterpolatedMotion motion = motion_between(*from->as<Se3State>(), *to->as<Se3State>());
    typename WorkspacePool<ObstacleWorkspace>::Loan workspace(pool_);
    return verdict_of(
        obstacles_->first_impact(*body_, motion, kEdge, options_, {}, *workspace).toi);
  }

 private:
  std::shared_ptr<const Shape> body_;
  std::shared_ptr<const ObstacleSet> obstacles_;
  ToiOptions options_;
  mutable WorkspacePool<ObstacleWorkspace> pool_;
};

class ChainCheck final : public EdgeCheck {
 public:
  ChainCheck(std::shared_ptr<const KinematicChain> chain,
             std::shared_ptr<const ObstacleSet> obstacles, const OmplOptions& options)
      : chain_(std::move(chain)), obstacles_(std::move(obstacles)) {
    options_.toi = toi_options(options);
  }

  EdgeVerdict examine(const ompl::base::State* from, const ompl::base::State* to) const override {
    const std::array<JointVector, 2> ends{coordinates(from), coordinates(to)};
    const JointPath path = JointPath::linear(std::array{kEdge.begin, kEdge.end}, ends);
    typename WorkspacePool<ChainWorkspace>::Loan workspace(pool_);
    return verdict_of(certify(*chain_, path, *obstacles_, options_, *workspace).toi);
  }

 private:
  JointVector coordinates(const ompl::base::State* state) const {
    const double* values = state->as<ompl::base::RealVectorStateSpace::StateType>()->values;
    return Eigen::Map<const JointVector>(values, Eigen::Index(chain_->coordinate_count()));
  }

  std::shared_ptr<const KinematicChain> chain_;
  std::shared_ptr<const ObstacleSet> obstacles_;
  ChainOptions options_;
  mutable WorkspacePool<ChainWorkspace> pool_;
};

class BodiesCheck final : public EdgeCheck {
 public:
  BodiesCheck(OmplMotionValidator::Bodies bodies, std::shared_ptr<const ObstacleSet> obstacles,
              const OmplOptions& options)
      : bodies_(std::move(bodies)),
        obstacles_(std::move(obstacles)),
        options_(toi_options(options)) {}

  // Body after body, each only up to the first event among those before.
  EdgeVerdict examine(const ompl::base::State* from, const ompl::base::State* to) const override {
    typename WorkspacePool<ObstacleWorkspace>::Loan workspace(pool_);
    EdgeVerdict verdict{true, kEdge.end};
    for (const OmplMotionValidator::Body& body : bodies_(from, to)) {
      DYOP_REQUIRE(body.shape && body.X_WB, "a body of a motion to validate lacks shape or motion");
      ToiOptions options = options_;
      options.solid_a = body.is_solid;
      const ToiResult found =
          obstacles_
              ->first_impact(*body.shape, *body.X_WB, {kEdge.begin, verdict.t_safe}, options, {},
                             *workspace)
              .toi;
      if (found.status != ToiStatus::Separated) verdict = verdict_of(found);
    }
    return verdict;
  }

 private:
  OmplMotionValidator::Bodies bodies_;
  std::shared_ptr<const ObstacleSet> obstacles_;
  ToiOptions options_;
  mutable WorkspacePool<ObstacleWorkspace> pool_;
};

}  // namespace

std::unique_ptr<const EdgeCheck> make_body_check(std::shared_ptr<const Shape> body,
                                                 std::shared_ptr<const ObstacleSet> obstacles,
                                                 const OmplOptions& options) {
  return std::make_unique<BodyCheck>(std::move(body), std::move(obstacles), options);
}

std::unique_ptr<const EdgeCheck> make_chain_check(std::shared_ptr<const KinematicChain> chain,
                                                  std::shared_ptr<const ObstacleSet> obstacles,
                                                  const OmplOptions& options) {
  return std::make_unique<ChainCheck>(std::move(chain), std::move(obstacles), options);
}

std::unique_ptr<const EdgeCheck> make_bodies_check(OmplMotionValidator::Bodies bodies,
                                                   std::shared_ptr<const ObstacleSet> obstacles,
                                                   const OmplOptions& options) {
  return std::make_unique<BodiesCheck>(std::move(bodies), std::move(obstacles), options);
}

}  // namespace dyop::ompl_internal
