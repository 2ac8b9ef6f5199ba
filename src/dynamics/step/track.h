// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "distance/neighbour_list.h"
#include "dynamics/body_record.h"
#include "dynamics/step/separating_directions.h"
#include "dyop/core/time_interval.h"
#include "dyop/motion/steady_motions.h"

namespace dyop::dynamics_internal {

/// How one body moves over a span of time, and what bounds need to know of it.
struct BodyMove {
  const BodyRecord* body = nullptr;
  std::shared_ptr<const Motion> motion;  // of B
  bool is_rest = false;
  /// With a constant twist about the centre of mass.
  bool is_twist = false;
  Vector3 center = Vector3::Zero();  // of mass, at the start
  Vector3 v_W = Vector3::Zero();
  Vector3 w_W = Vector3::Zero();
  /// Bound on the speed of any point of B over this interval, if bound_speed() was called.
  TimeInterval bounded;
  Scalar most_speed = kInfinity;

  /// Bounds the speed once for all pairs of the body.
  void bound_speed(const TimeInterval& interval);
};

/// The proposed path of a body over a step of the World: motions one after another, and the state
/// at their end.
struct Track {
  struct Piece {
    TimeInterval interval;
    std::shared_ptr<const Motion> motion;
    bool is_rest = false;
  };
  std::vector<Piece> pieces;
  CentralState end;
  std::shared_ptr<FreeFlight> flight;  // continues beyond the end; or null
  Scalar most_travel = kInfinity;      // bound on the way of any point of B, where one is known

  bool is_rest() const;
  /// All pieces as one motion.
  std::shared_ptr<const Motion> joined() const;
};

/// A move with constant twist from `state`, and the pose it reaches after tau.
BodyMove twist_move(const BodyRecord& body, const CentralState& state, Scalar t, const Vector3& v_W,
                    const Vector3& w_W);

/// Bound on the way of any point of B in so long a time, rounded up; infinite but for constant
/// twists and rest.
Scalar most_travel(const BodyMove& move, Scalar tau);

BodyMove rest_move(const BodyRecord& body, std::shared_ptr<const Motion> rest);

/// An arbitrary motion of a body, from time t on.
BodyMove motion_move(const BodyRecord& body, std::shared_ptr<const Motion> motion, Scalar t);

/// Pose of the frame at the centre of mass.
RigidPose central_pose(const BodyRecord& body, const RigidPose& X_WB);

/// Upper bound on how much the gap of two bodies can shrink over an interval, rounded up. For two
/// constant twists, with D = c_B - c_A between the centres of mass, all points of B move relative
/// to A at most at |v_B - v_A - w_A x D| + tau |w_A| |v_B - v_A| + |w_B - w_A| r_B; the same with A
/// and B exchanged. Otherwise from the bounds of the twists.
Scalar closing_bound(const BodyMove& a, const BodyMove& b, const TimeInterval& interval);

/// Upper bound on how far any point of B moves in the frame of A over an interval: `reach` for one
/// that is at the pivot when it begins, and `slope` more per distance from there, rounded up.
NearBound approach_bound(const BodyMove& a, const BodyMove& b, const TimeInterval& interval,
                         const Vector3& pivot_W);

/// How two bodies with constant twists move relative to each other; none for other moves. With w,
/// c and r twist, centre and radius, S the body of a plane and O the other one, a point of O has
/// in the frame of S an acceleration of at most w_O^2 r_O + 2 w_S V + w_S^2 (l + tau V), where V
/// = |v_O - v_S| + w_O r_O. It leaves the chord between its two places by at most tau^2 / 8 times
/// that.
std::optional<ChordMotion> chord_motion(const BodyMove& a, const BodyMove& b,
                                        const TimeInterval& interval);

}  // namespace dyop::dynamics_internal
