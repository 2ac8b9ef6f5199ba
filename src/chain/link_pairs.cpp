// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/chain/link_pairs.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>
#include <optional>
#include <vector>

#include "chain/chain_frame.h"
#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/core/rigid_pose.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/compound_shape.h"
#include "dyop/geometry/convex_hull.h"
#include "dyop/geometry/half_space.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/shape.h"
#include "dyop/geometry/triangle_mesh.h"

namespace dyop::chain_internal {

/// Balls whose convex hull contains a shape, in the shape's frame. Of a half-space the point of its
/// plane nearest to the frame's origin, with an infinite radius.
struct LinkHull {
  std::vector<Vector3> centers;
  std::vector<Scalar> radii;  ///< of each ball, >= 0
};

LinkHull link_hull(const Shape& shape);

/// The largest distance of any point of a placed hull from the axis through `origin` along the unit
/// vector `axis`. The distance from a line is convex, so a corner attains it.
Scalar largest_radius(const LinkHull& hull, const RigidPose& X_CL, const Vector3& origin,
                      const Vector3& axis);

namespace {

void append_points(std::span<const Vector3> points, Scalar radius, const RigidPose& X_LS,
                   LinkHull& hull) {
  for (const Vector3& p : points) {
    hull.centers.push_back(X_LS * p);
    hull.radii.push_back(radius);
  }
}

void append_box(const AlignedBox& box, const RigidPose& X_LS, LinkHull& hull) {
  for (int corner = 0; corner < 8; ++corner) {
    const auto which = static_cast<AlignedBox::CornerType>(corner);
    hull.centers.push_back(X_LS * box.corner(which));
    hull.radii.push_back(0);
  }
}

// A prism around it, 2 % wider at its edges.
void append_cylinder(const Cylinder& cylinder, const RigidPose& X_LS, LinkHull& hull) {
  constexpr int kSides = 16;
  constexpr Scalar kUp = 1 + 0x1p-40;  // literal: more than a sine and its rounding are wrong
  const Scalar angle = 2 * std::numbers::pi_v<Scalar> / kSides;
  const Scalar radius = kUp * cylinder.radius() / std::cos(angle / 2);
  for (int k = 0; k < kSides; ++k) {
    for (const Scalar z : {-cylinder.half_length(), cylinder.half_length()}) {
      const Vector3 p(radius * std::cos(k * angle), radius * std::sin(k * angle), z);
      hull.centers.push_back(X_LS * p);
      hull.radii.push_back(0);
    }
  }
}

void append(const Shape& shape, const RigidPose& X_LS, LinkHull& hull) {
  if (const auto* compound = dynamic_cast<const CompoundShape*>(&shape)) {
    for (const CompoundChild& child : compound->children()) {
      append(*child.shape, X_LS * child.X_CS, hull);
    }
  } else if (const auto* mesh = dynamic_cast<const TriangleMesh*>(&shape)) {
    append_points(mesh->vertices(), 0, X_LS, hull);
  } else if (const auto* convex = dynamic_cast<const ConvexShape*>(&shape);
             convex != nullptr && convex->core_surface() != nullptr) {
    append_points(convex->core_surface()->vertices(), convex->rounding_radius(), X_LS, hull);
  } else if (const auto* cylinder = dynamic_cast<const Cylinder*>(&shape)) {
    append_cylinder(*cylinder, X_LS, hull);
  } else {
    append_box(shape.bounding_box(), X_LS, hull);
  }
}

}  // namespace

LinkHull link_hull(const Shape& shape) {
  if (const HalfSpace* plane = as_half_space(shape)) {
    return {{plane->normal() * plane->offset()}, {kInfinity}};
  }
  LinkHull all;
  append(shape, RigidPose(), all);
  LinkHull result;
  std::vector<Vector3> sharp;
  for (std::size_t k = 0; k < all.centers.size(); ++k) {
    if (all.radii[k] == 0) {
      sharp.push_back(all.centers[k]);
    } else {
      result.centers.push_back(all.centers[k]);
      result.radii.push_back(all.radii[k]);
    }
  }
  if (!sharp.empty()) {
    const ConvexHull hull(std::move(sharp));
    append_points(hull.vertices(), 0, RigidPose(), result);
  }
  return result;
}

Scalar largest_radius(const LinkHull& hull, const RigidPose& X_CL, const Vector3& origin,
                      const Vector3& axis) {
  // In the link's frame, so that points need not be moved.
  const Matrix3 R_LC = X_CL.rotation().transpose();
  const Vector3 origin_L = R_LC * (origin - X_CL.translation());
  const Vector3 axis_L = R_LC * axis;
  Scalar largest = 0;
  for (std::size_t k = 0; k < hull.centers.size(); ++k) {
    const Vector3 arm = hull.centers[k] - origin_L;
    largest = std::max(largest, std::sqrt(axis_L.cross(arm).squaredNorm()) + hull.radii[k]);
  }
  return largest;
}

/// The free coordinates of a robot as intervals: middle and half width.
struct JointBox {
  JointVector middle;
  JointVector half;
  Scalar share = 1;  ///< of the whole box
};

/// The smallest and largest free coordinates.
struct FreeLimits {
  JointVector lower;
  JointVector upper;
};

/// Decides one pair of links. The proof is in docs/robots.md.
class PairSearch {
 public:
  PairSearch(const Robot& robot, const LinkHull& hull_a, const LinkHull& hull_b,
             const FreeLimits& limits, LinkPairReport& report, const LinkPairOptions& options);

  void run();
  /// The coordinates without limits that joints of a pair follow so that they never come back
  /// together: they come as near as wanted to any values. If there are some, and run() had an end.
  std::vector<Eigen::Index> dense() const;
  /// Of a pair with such coordinates: decides by the same pair of a robot whose joints turn
  /// independently, and by samples.
  void run_dense(PairSearch& independent, const LinkPairReport& proof);

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
    Scalar sum_after = 0;  // of movement_b, of the joints nearer to B
  };

  void collect_joints();
  void bound_coordinates();
  void bound_coordinate(Eigen::Index free);
  std::vector<Scalar> turning_speeds(Eigen::Index free) const;
  bool is_bounded() const;
  bool take_first_samples();
  void place(const JointVector& middle);
  RigidPose place_branch(std::size_t link, const JointVector& q);
  Scalar movement(const JointBox& box);
  Scalar least_movement();
  Scalar movement_factor(const PathJoint& joint, const JointBox& box) const;
  Eigen::Index widest(const JointBox& box) const;
  DistanceResult measure(Scalar max_distance);
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
  const FreeLimits& limits_;
  JointBox whole_;
  LinkPairReport& report_;
  const LinkPairOptions& options_;

  std::size_t meeting_ = 0;
  std::vector<PathJoint> joints_;
  std::vector<Eigen::Index> free_;  // coordinates that matter
  std::vector<Eigen::Index> dense_;
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

namespace {

// Samples that every pair gets: they find most pairs that touch, and how often they do.
constexpr int kFirstSamples = 200;
// Boxes before the long search for a witness: most pairs that never touch need fewer.
constexpr std::int64_t kFirstBoxes = 2000;
// Steps of the search from the nearest sample, and halvings of its step.
constexpr int kMostDescents = 400;
constexpr Scalar kLastStep = 1e-4;  // literal: of the half width; finer steps find little
// Bounds on a distance only need to decide whether a box is split.
constexpr Scalar kDistanceTolerance = 0.1;
// A box whose joints move the links less than this share of their size is given up: the links are
// as good as touching there.
constexpr Scalar kSmallestMovement = 1e-7;  // literal: far above rounding, below any drawing
// Turns of one joint after which all that follow the same coordinate have made whole turns, at most.
constexpr int kMostTurns = 60;
constexpr Scalar kHalfTurn = std::numbers::pi_v<Scalar> * (1 + 0x1p-50);  // literal: rounded up

Scalar unit_random(std::uint64_t& state) {
  // SplitMix64: the same numbers everywhere.
  state += 0x9E3779B97F4A7C15u;
  std::uint64_t z = state;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  z ^= z >> 31;
  return Scalar(z >> 11) * 0x1p-53;
}

// After how many turns of the slowest joint all have made whole turns. A ratio is taken for the
// fraction that it is but for rounding: the difference is a rounding of the joint's own value.
std::optional<int> turns_together(const std::vector<Scalar>& speeds) {
  if (speeds.empty()) return std::nullopt;
  for (int turns = 1; turns <= kMostTurns; ++turns) {
    const bool all_are_back = std::all_of(speeds.begin(), speeds.end(), [&](Scalar speed) {
      const Scalar others = turns * (speed / speeds[0]);
      return std::abs(others - std::round(others)) <= 4 * kUnitRoundoff * others;
    });
    if (all_are_back) return turns;
  }
  return std::nullopt;
}

}  // namespace

PairSearch::PairSearch(const Robot& robot, const LinkHull& hull_a, const LinkHull& hull_b,
                       const FreeLimits& limits, LinkPairReport& report,
                       const LinkPairOptions& options)
    : robot_(robot),
      chain_(*robot.chain),
      hull_a_(hull_a),
      hull_b_(hull_b),
      limits_(limits),
      report_(report),
      options_(options),
      meeting_(chain_.common_ancestor(report.first, report.second)),
      random_(report.first * 1'000'003 + report.second) {
  collect_joints();
  bound_coordinates();
  best_ = whole_.middle;
}

void PairSearch::collect_joints() {
  const auto add_branch = [this](std::size_t end) {
    for (std::size_t link = end; link != meeting_; link = chain_.step(link)->parent) {
      const KinematicChain::Step& step = *chain_.step(link);
      if (step.type == JointType::Fixed) continue;
      PathJoint joint;
      joint.link = link;
      joint.type = step.type;
      joint.coupling = robot_.couplings[step.coordinate];
      joints_.push_back(joint);
    }
  };
  add_branch(report_.first);
  const auto first_of_b = static_cast<std::ptrdiff_t>(joints_.size());
  add_branch(report_.second);
  std::reverse(joints_.begin() + first_of_b, joints_.end());
}

// The box of all joint values that matter. Coordinates of other joints stay in its middle.
void PairSearch::bound_coordinates() {
  const Eigen::Index count = limits_.lower.size();
  whole_.middle = JointVector::Zero(count).cwiseMin(limits_.upper).cwiseMax(limits_.lower);
  whole_.half = JointVector::Zero(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Scalar width = limits_.upper[k] - limits_.lower[k];
    if (std::isfinite(width)) whole_.middle[k] = limits_.lower[k] + width / 2;
  }
  for (const PathJoint& joint : joints_) {
    const auto free = Eigen::Index(joint.coupling.free);
    if (joint.coupling.multiplier == 0 || limits_.lower[free] == limits_.upper[free]) continue;
    if (std::find(free_.begin(), free_.end(), free) == free_.end()) free_.push_back(free);
  }
  std::sort(free_.begin(), free_.end());
  report_.joints = free_.size();
  for (const Eigen::Index free : free_) bound_coordinate(free);
}

// How fast the joints on the path turn that follow a coordinate; none if some slide.
std::vector<Scalar> PairSearch::turning_speeds(Eigen::Index free) const {
  std::vector<Scalar> speeds;
  for (const PathJoint& joint : joints_) {
    if (Eigen::Index(joint.coupling.free) != free || joint.coupling.multiplier == 0) continue;
    if (joint.type == JointType::Prismatic) return {};
    speeds.push_back(std::abs(joint.coupling.multiplier));
  }
  std::sort(speeds.begin(), speeds.end());
  return speeds;
}

// Joints that turn need no more than what they do before they come back, whatever their limits.
void PairSearch::bound_coordinate(Eigen::Index free) {
  const Scalar lower = limits_.lower[free];
  const Scalar upper = limits_.upper[free];
  const bool has_limits = std::isfinite(upper - lower);
  const std::vector<Scalar> speeds = turning_speeds(free);
  const std::optional<int> turns = turns_together(speeds);
  Scalar half = turns ? *turns * kHalfTurn / speeds[0] : kInfinity;
  if (has_limits && !(upper - lower > 2 * half)) {
    const Scalar middle = whole_.middle[free];
    half = std::max(middle - lower, upper - middle);
  } else if (!turns && !speeds.empty()) {
    dense_.push_back(free);
    half = kMostTurns * kHalfTurn / speeds[0];
  }
  whole_.half[free] = half;
  if (half == kInfinity || has_limits) return;
  if (std::isfinite(lower)) whole_.middle[free] = lower + half;
  if (std::isfinite(upper)) whole_.middle[free] = upper - half;
}

bool PairSearch::is_bounded() const {
  return (whole_.half.array() < kInfinity).all();
}

std::vector<Eigen::Index> PairSearch::dense() const {
  return is_bounded() ? dense_ : std::vector<Eigen::Index>();
}

// The pose of a link in the frame of the common ancestor, and the axes of the joints above it.
RigidPose PairSearch::place_branch(std::size_t end, const JointVector& q) {
  std::vector<std::size_t> way;
  for (std::size_t link = end; link != meeting_; link = chain_.step(link)->parent) {
    way.push_back(link);
  }
  RigidPose X_CL;
  for (auto link = way.rbegin(); link != way.rend(); ++link) {
    const KinematicChain::Step& step = *chain_.step(*link);
    Scalar value = 0;
    if (step.type != JointType::Fixed) {
      const CoordinateCoupling& coupling = robot_.couplings[step.coordinate];
      value = coupling.multiplier * q[Eigen::Index(coupling.free)] + coupling.offset;
      const auto joint = std::find_if(joints_.begin(), joints_.end(),
                                      [&](const PathJoint& each) { return each.link == *link; });
      joint->origin = X_CL * step.X_PJ.translation();
      joint->axis = X_CL.rotation() * step.axis_P;
    }
    X_CL = X_CL * step_pose(step, value);
  }
  return X_CL;
}

void PairSearch::place(const JointVector& q) {
  X_Ca_ = place_branch(report_.first, q);
  X_Cb_ = place_branch(report_.second, q);
}

// How far a point moves at most per unit of its distance from the axis: a chord. Prismatic: how
// far it moves.
Scalar PairSearch::movement_factor(const PathJoint& joint, const JointBox& box) const {
  if (joint.coupling.multiplier == 0) return 0;  // of a coordinate that may have no limits
  const Scalar half =
      std::abs(joint.coupling.multiplier) * box.half[Eigen::Index(joint.coupling.free)];
  if (joint.type == JointType::Prismatic) return half;
  return 2 * std::sin(std::min(half, std::numbers::pi_v<Scalar>) / 2);
}

// Seen from a link between the two, the joints on A's side move A and the others B: the least sum
// over these links. Nothing is subtracted, as some may be infinite.
Scalar PairSearch::least_movement() {
  Scalar sum_b = 0;
  for (auto joint = joints_.rbegin(); joint != joints_.rend(); ++joint) {
    joint->sum_after = sum_b;
    sum_b += joint->movement_b;
  }
  Scalar least = sum_b;
  best_split_ = 0;
  Scalar sum_a = 0;
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    sum_a += joints_[k].movement_a;
    if (sum_a + joints_[k].sum_after < least) {
      least = sum_a + joints_[k].sum_after;
      best_split_ = k + 1;
    }
  }
  return least;
}

// A bound of how much the distance of the two links changes over the box, from its middle, where
// place() has put them.
Scalar PairSearch::movement(const JointBox& box) {
  Scalar size = 0;
  for (PathJoint& joint : joints_) {
    const Scalar factor = movement_factor(joint, box);
    const auto moved_by = [&](const LinkHull& hull, const RigidPose& X_CL) {
      if (joint.type != JointType::Revolute) return factor;
      const Scalar radius = largest_radius(hull, X_CL, joint.origin, joint.axis);
      // Only a half-space has no end: the other shape bounds what is near of it.
      size = std::max(size, radius < kInfinity ? radius : hull.centers[0].norm());
      return factor == 0 ? 0 : factor * radius;
    };
    joint.movement_a = moved_by(hull_a_, X_Ca_);
    joint.movement_b = moved_by(hull_b_, X_Cb_);
    size = std::max(size, joint.origin.norm());
  }
  const Scalar least = least_movement();
  const Scalar scale = size + X_Ca_.translation().norm() + X_Cb_.translation().norm();
  const Scalar steps = Scalar(chain_.depth(report_.first) + chain_.depth(report_.second) + 2);
  return least + kPoseNoise * steps * (scale + least);
}

// The free coordinate that contributes most to the movement.
Eigen::Index PairSearch::widest(const JointBox& box) const {
  JointVector parts = JointVector::Zero(box.middle.size());
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    const PathJoint& joint = joints_[k];
    parts[Eigen::Index(joint.coupling.free)] +=
        k < best_split_ ? joint.movement_a : joint.movement_b;
  }
  Eigen::Index widest = 0;
  parts.maxCoeff(&widest);
  return widest;
}

DistanceResult PairSearch::measure(Scalar max_distance) {
  DistanceOptions options;
  options.max_distance = max_distance;
  options.relative_tolerance = kDistanceTolerance;
  return distance(*chain_.links()[report_.first].shape, X_Ca_,
                  *chain_.links()[report_.second].shape, X_Cb_, options, cache_);
}

// Once true it stays true. A distance costs more than a look at the clock.
bool PairSearch::is_stopped() {
  if (is_stopped_) return true;
  is_stopped_ = options_.stop.stop_requested() ||
                (options_.deadline && std::chrono::steady_clock::now() >= *options_.deadline);
  return is_stopped_;
}

void PairSearch::settle_touch(const JointVector& q) {
  report_.verdict = free_.empty() ? PairVerdict::Always : PairVerdict::Can;
  report_.witness = q;
}

// Corners of the box first, then points drawn evenly.
JointVector PairSearch::sample_point(int number) {
  JointVector q = whole_.middle;
  const bool is_corner = free_.size() < 6 && number < (1 << free_.size());
  for (std::size_t k = 0; k < free_.size(); ++k) {
    const bool is_upper = ((number >> k) & 1) != 0;
    const Scalar offset = is_corner ? (is_upper ? 1 : -1) : 2 * unit_random(random_) - 1;
    q[free_[k]] += offset * whole_.half[free_[k]];
  }
  return q.cwiseMax(limits_.lower).cwiseMin(limits_.upper);  // a witness keeps to the limits
}

bool PairSearch::take_sample(const JointVector& q, Scalar& nearest, JointVector& best) {
  place(q);
  const DistanceResult found = measure(nearest);
  if (found.status == DistanceStatus::Overlapping) return true;
  if (found.upper < nearest) {
    nearest = found.upper;
    best = q;
  }
  return false;
}

bool PairSearch::sample(int first, int last) {
  for (int number = first; number < last && !is_stopped(); ++number) {
    const JointVector q = sample_point(number);
    if (!take_sample(q, nearest_, best_)) continue;
    settle_touch(q);
    return true;
  }
  return false;
}

// From the nearest sample along one coordinate after another, with shorter and shorter steps.
bool PairSearch::descend() {
  int count = 0;
  for (Scalar step = 0.25; step > kLastStep && count < kMostDescents; step /= 2) {
    for (bool is_better = true; is_better && count < kMostDescents && !is_stopped();) {
      is_better = false;
      for (const Eigen::Index free : free_) {
        for (const Scalar sign : {-1, 1}) {
          JointVector q = best_;
          const Scalar low = whole_.middle[free] - whole_.half[free];
          const Scalar high = whole_.middle[free] + whole_.half[free];
          q[free] = std::clamp(q[free] + sign * step * whole_.half[free], low, high);
          q[free] = std::clamp(q[free], limits_.lower[free], limits_.upper[free]);
          const Scalar before = nearest_;
          ++count;
          if (take_sample(q, nearest_, best_)) {
            settle_touch(q);
            return true;
          }
          is_better = is_better || nearest_ < before;
        }
      }
    }
  }
  return false;
}

// Examines one box: proven, a witness, given up, or halved.
void PairSearch::examine(const JointBox& box) {
  ++report_.boxes;
  place(box.middle);
  const Scalar reach = movement(box);
  const DistanceResult found = measure(reach);
  if (found.lower > reach) return;
  if (found.status == DistanceStatus::Overlapping) {
    settle_touch(box.middle);
    return;
  }
  const Scalar size =
      std::min(chain_.links()[report_.first].shape->bounding_box().diagonal().norm(),
               chain_.links()[report_.second].shape->bounding_box().diagonal().norm());
  if (free_.empty() || reach <= kSmallestMovement * size) {
    given_up_ += box.share;
    return;
  }
  const Eigen::Index split = widest(box);
  JointBox half = box;
  half.share /= 2;
  const Scalar quarter = box.half[split] / 2;
  // More than the middles are rounded by, so that the halves cover the box.
  half.half[split] = quarter + 4 * kUnitRoundoff * (std::abs(box.middle[split]) + quarter);
  half.middle[split] = box.middle[split] - quarter;
  stack_.push_back(half);
  half.middle[split] = box.middle[split] + quarter;
  stack_.push_back(half);
}

// Returns whether the pair is decided.
bool PairSearch::bound(std::int64_t last_box) {
  while (!stack_.empty() && report_.boxes < last_box && !is_stopped()) {
    const JointBox box = stack_.back();
    stack_.pop_back();
    examine(box);
    if (report_.witness) return true;
  }
  if (!stack_.empty() || given_up_ > 0) return false;
  conclude_apart();
  return true;
}

// The surfaces never meet, so a link is inside the other at all joint values or at none.
void PairSearch::conclude_apart() {
  const Link& a = chain_.links()[report_.first];
  const Link& b = chain_.links()[report_.second];
  report_.verdict = PairVerdict::Never;
  if (!a.is_solid && !b.is_solid) return;
  place(whole_.middle);
  DistanceOptions options;
  options.max_distance = 0;
  options.solid_a = a.is_solid;
  options.solid_b = b.is_solid;
  const DistanceResult found = distance(*a.shape, X_Ca_, *b.shape, X_Cb_, options);
  if (found.lower > 0) return;
  report_.verdict = PairVerdict::Always;
  report_.witness = whole_.middle;
  report_.touching_share = 1;
}

bool PairSearch::take_first_samples() {
  const int first = std::min(kFirstSamples, options_.samples);
  int touching = 0;
  int taken = 0;
  for (; taken < first && !is_stopped(); ++taken) {
    const JointVector q = sample_point(taken);
    if (!take_sample(q, nearest_, best_)) continue;
    ++touching;
    if (!report_.witness) settle_touch(q);
  }
  report_.touching_share = taken == 0 ? 0 : Scalar(touching) / taken;
  return report_.witness.has_value();
}

void PairSearch::run() {
  if (!is_bounded()) {  // only prismatic joints have no end
    report_.undecided_share = 1;
    place(whole_.middle);
    if (measure(0).status == DistanceStatus::Overlapping) {
      settle_touch(whole_.middle);
      report_.undecided_share = 0;
    }
    return;
  }
  stack_.push_back(whole_);
  if (free_.empty()) {
    bound(1);
    report_.touching_share = report_.witness ? 1 : 0;
    report_.undecided_share = report_.verdict == PairVerdict::Undecided ? 1 : 0;
    return;
  }
  if (take_first_samples() || bound(std::min(kFirstBoxes, options_.max_boxes))) return;
  if (sample(kFirstSamples, options_.samples) || descend()) return;
  if (bound(options_.max_boxes)) return;
  report_.undecided_share = given_up_;
  for (const JointBox& box : stack_) report_.undecided_share += box.share;
}

// What holds for all values of independent joints holds for those that they take together.
void PairSearch::run_dense(PairSearch& independent, const LinkPairReport& proof) {
  if (take_first_samples()) return;
  independent.run();
  report_.boxes = proof.boxes;
  if (proof.verdict == PairVerdict::Never || proof.verdict == PairVerdict::Always) {
    report_.verdict = proof.verdict;
    if (proof.verdict == PairVerdict::Never) return;
    report_.witness = whole_.middle;
    report_.touching_share = 1;
  } else if (!sample(kFirstSamples, options_.samples) && !descend()) {
    report_.undecided_share = 1;
  }
}

}  // namespace dyop::chain_internal

namespace dyop {
namespace {

using chain_internal::LinkHull;

using chain_internal::FreeLimits;
using chain_internal::PairSearch;

FreeLimits limits_of(const Robot& robot) {
  FreeLimits limits{robot.lower(), robot.upper()};
  for (Eigen::Index k = 0; k < limits.lower.size(); ++k) {
    DYOP_REQUIRE(limits.lower[k] <= limits.upper[k], "decide_link_pairs: the limits of joint '",
                 robot.chain->joints()[robot.free_joints[std::size_t(k)]].name,
                 "' and of those that mimic it leave it no value");
  }
  return limits;
}

// The robot whose joints that followed one of these coordinates have coordinates of their own.
Robot loosened(Robot robot, const std::vector<Eigen::Index>& dense, FreeLimits& limits) {
  for (std::size_t k = 0; k < robot.couplings.size(); ++k) {
    const auto free = Eigen::Index(robot.couplings[k].free);
    if (std::find(dense.begin(), dense.end(), free) == dense.end()) continue;
    robot.couplings[k].free = robot.free_count();
    robot.free_joints.push_back(robot.chain->joint_of(k));
  }
  const Eigen::Index before = limits.lower.size();
  limits.lower.conservativeResize(Eigen::Index(robot.free_count()));
  limits.upper.conservativeResize(Eigen::Index(robot.free_count()));
  limits.lower.tail(limits.lower.size() - before).setConstant(-kInfinity);
  limits.upper.tail(limits.upper.size() - before).setConstant(kInfinity);
  return robot;
}

void decide_pair(const Robot& robot, const std::vector<LinkHull>& hulls, const FreeLimits& limits,
                 LinkPairReport& report, const LinkPairOptions& options) {
  const LinkHull& a = hulls[report.first];
  const LinkHull& b = hulls[report.second];
  LinkPairReport proof = report;
  PairSearch search(robot, a, b, limits, report, options);
  const std::vector<Eigen::Index> dense = search.dense();
  if (dense.empty()) return search.run();
  FreeLimits loose_limits = limits;
  const Robot loose = loosened(robot, dense, loose_limits);
  LinkPairOptions without_samples = options;
  without_samples.samples = 0;
  PairSearch independent(loose, a, b, loose_limits, proof, without_samples);
  search.run_dense(independent, proof);
}

std::size_t index_of(const Robot& robot, const std::string& name) {
  const std::optional<std::size_t> link = robot.chain->find_link(name);
  DYOP_REQUIRE(link, "decide_link_pairs: '", name, "' is not a link of robot '", robot.name, "'");
  return *link;
}

LinkPairReport report_of(const Robot& robot, std::size_t first, std::size_t second) {
  LinkPairReport report;
  report.first = std::min(first, second);
  report.second = std::max(first, second);
  report.is_adjacent = robot.chain->are_neighbours(report.first, report.second);
  return report;
}

std::vector<LinkPairReport> list_pairs(const Robot& robot, const LinkPairOptions& options) {
  const std::span<const Link> links = robot.chain->links();
  std::vector<LinkPairReport> reports;
  for (const auto& [first, second] : options.only) {
    const LinkPairReport report = report_of(robot, index_of(robot, first), index_of(robot, second));
    DYOP_REQUIRE(report.first != report.second, "decide_link_pairs: '", first,
                 "' is not a pair of links");
    if (links[report.first].shape && links[report.second].shape) reports.push_back(report);
  }
  if (!options.only.empty()) return reports;
  for (std::size_t first = 0; first < links.size(); ++first) {
    for (std::size_t second = first + 1; second < links.size(); ++second) {
      if (!links[first].shape || !links[second].shape) continue;
      reports.push_back(report_of(robot, first, second));
    }
  }
  return reports;
}

}  // namespace

const char* to_string(PairVerdict verdict) {
  switch (verdict) {
    case PairVerdict::Never:
      return "never";
    case PairVerdict::Always:
      return "always";
    case PairVerdict::Can:
      return "can";
    case PairVerdict::Undecided:
      break;
  }
  return "undecided";
}

std::vector<LinkPairReport> decide_link_pairs(const Robot& robot, const LinkPairOptions& options) {
  DYOP_REQUIRE(robot.chain, "decide_link_pairs: the robot has no chain");
  DYOP_REQUIRE(options.max_boxes >= 1, "max_boxes must be at least 1, not ", options.max_boxes);
  DYOP_REQUIRE(options.samples >= 0, "samples must be at least 0, not ", options.samples);
  const std::size_t link_count = robot.chain->links().size();
  std::vector<LinkPairReport> reports = list_pairs(robot, options);
  const FreeLimits limits = limits_of(robot);
  std::vector<LinkHull> hulls(link_count);
  tbb::parallel_for(std::size_t{0}, link_count, [&](std::size_t link) {
    const auto& shape = robot.chain->links()[link].shape;
    if (shape) hulls[link] = chain_internal::link_hull(*shape);
  });
  std::mutex progress;
  std::size_t done = 0;
  tbb::parallel_for(std::size_t{0}, reports.size(), [&](std::size_t k) {
    LinkPairReport& report = reports[k];
    decide_pair(robot, hulls, limits, report, options);
    if (!options.on_progress) return;
    const std::lock_guard lock(progress);
    options.on_progress(++done, reports.size());
  });
  return reports;
}

}  // namespace dyop
