// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "chain/link_hull.h"
#include "dyop/chain/link_pairs.h"
#include "dyop/distance/distance.h"

namespace dyop::chain_internal {

/// The free coordinates of a robot as intervals: middle and half width.
struct JointBox {
  JointVector middle;
  JointVector half;
  Scalar share = 1;  ///< of the whole box
};

/// Decides one pair of links. The proof is in docs/robots.md.
class PairSearch {
 public:
  PairSearch(const Robot& robot, const LinkHull& hull_a, const LinkHull& hull_b,
             const JointBox& whole, LinkPairReport& report, const LinkPairOptions& options);

  void run();

 private:
  // A joint between the two links, in order from A to B.
  struct PathJoint {
    std::size_t link = 0;  // above which it is
    JointType type = JointType::Revolute;
    CoordinateCoupling coupling;
    Vector3 origin = Vector3::Zero();  // of its axis, in the frame of the common ancestor, now
    Vector3 axis = Vector3::UnitZ();
    Scalar movement_a = 0;  // of A if seen from beyond the joint, and of B, over the box
    Scalar movement_b = 0;
  };

  void collect_joints();
  void place(const JointVector& middle);
  RigidPose place_branch(std::size_t link, const JointVector& q);
  Scalar movement(const JointBox& box);
  Scalar movement_factor(const PathJoint& joint, const JointBox& box) const;
  Eigen::Index widest(const JointBox& box) const;
  DistanceResult measure(Scalar max_distance);
  bool touches_here();
  bool is_stopped();
  bool take_sample(const JointVector& q, Scalar& nearest, JointVector& best);
  bool sample(int first, int last);
  bool descend();
  bool bound(std::int64_t last_box);
  void examine(const JointBox& box);
  void conclude_apart();
  JointVector sample_point(int number);
  void settle_touch(const JointVector& q);

  const Robot& robot_;
  const KinematicChain& chain_;
  const LinkHull& hull_a_;
  const LinkHull& hull_b_;
  const JointBox& whole_;
  LinkPairReport& report_;
  const LinkPairOptions& options_;

  std::size_t meeting_ = 0;
  std::vector<PathJoint> joints_;
  std::vector<Eigen::Index> free_;  // coordinates that matter
  RigidPose X_Ca_, X_Cb_;
  std::size_t best_split_ = 0;
  DistanceCache cache_;
  std::vector<JointBox> stack_;
  Scalar given_up_ = 0;
  bool is_stopped_ = false;
  std::uint64_t random_ = 0;
  Scalar nearest_ = kInfinity;
  JointVector best_;
};

}  // namespace dyop::chain_internal
