// SPDX-License-Identifier: BSD-3-Clause
#include "chain/pair_search.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "chain/chain_step.h"
#include "core/tolerance.h"

namespace dyop::chain_internal {
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

Scalar unit_random(std::uint64_t& state) {
  // SplitMix64: the same numbers everywhere.
  state += 0x9E3779B97F4A7C15u;
  std::uint64_t z = state;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  z ^= z >> 31;
  return Scalar(z >> 11) * 0x1p-53;
}

}  // namespace

PairSearch::PairSearch(const Robot& robot, const LinkHull& hull_a, const LinkHull& hull_b,
                       const JointBox& whole, LinkPairReport& report,
                       const LinkPairOptions& options)
    : robot_(robot),
      chain_(*robot.chain),
      hull_a_(hull_a),
      hull_b_(hull_b),
      whole_(whole),
      report_(report),
      options_(options),
      meeting_(chain_.common_ancestor(report.first, report.second)),
      random_(report.first * 1'000'003 + report.second),
      best_(whole.middle) {
  collect_joints();
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
  for (const PathJoint& joint : joints_) {
    const auto free = Eigen::Index(joint.coupling.free);
    if (joint.coupling.multiplier == 0 || whole_.half[free] == 0) continue;
    if (std::find(free_.begin(), free_.end(), free) == free_.end()) free_.push_back(free);
  }
  std::sort(free_.begin(), free_.end());
  report_.joints = free_.size();
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

// A bound of how much the distance of the two links changes over the box, from its middle, where
// place() has put them. Seen from a link between them, the joints on A's side move A and the others
// B; the best such link counts.
Scalar PairSearch::movement(const JointBox& box) {
  Scalar size = 0;
  for (PathJoint& joint : joints_) {
    const Scalar factor = movement_factor(joint, box);
    joint.movement_a = joint.movement_b = factor;
    if (joint.type == JointType::Revolute) {
      const Scalar radius_a = largest_radius(hull_a_, X_Ca_, joint.origin, joint.axis);
      const Scalar radius_b = largest_radius(hull_b_, X_Cb_, joint.origin, joint.axis);
      joint.movement_a *= radius_a;
      joint.movement_b *= radius_b;
      size = std::max({size, radius_a, radius_b});
    }
    size = std::max(size, joint.origin.norm());
  }
  Scalar moved = 0;
  for (const PathJoint& joint : joints_) moved += joint.movement_b;
  Scalar least = moved;
  best_split_ = 0;
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    moved += joints_[k].movement_a - joints_[k].movement_b;
    if (moved < least) {
      least = moved;
      best_split_ = k + 1;
    }
  }
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

// Whether shapes inside the links touch, where place() has put them.
bool PairSearch::touches_here() {
  const std::shared_ptr<const Shape>& a = robot_.inner_shapes[report_.first];
  const std::shared_ptr<const Shape>& b = robot_.inner_shapes[report_.second];
  const bool is_exact =
      a == chain_.links()[report_.first].shape && b == chain_.links()[report_.second].shape;
  if (is_exact) return true;
  DistanceOptions options;
  options.max_distance = 0;
  return distance(*a, X_Ca_, *b, X_Cb_, options).status == DistanceStatus::Overlapping;
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
  return q;
}

bool PairSearch::take_sample(const JointVector& q, Scalar& nearest, JointVector& best) {
  place(q);
  const DistanceResult found = measure(nearest);
  if (found.status == DistanceStatus::Overlapping) return touches_here();
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
  if (found.status == DistanceStatus::Overlapping && touches_here()) {
    settle_touch(box.middle);
    return;
  }
  const AlignedBox bounds = chain_.links()[report_.first].shape->bounding_box();
  if (free_.empty() || reach <= kSmallestMovement * bounds.diagonal().norm()) {
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

void PairSearch::run() {
  const bool is_bounded = std::all_of(free_.begin(), free_.end(), [this](Eigen::Index free) {
    return whole_.half[free] < kInfinity;
  });
  if (!is_bounded) {  // only prismatic joints have no end
    report_.undecided_share = 1;
    place(whole_.middle);
    if (measure(0).status == DistanceStatus::Overlapping && touches_here()) {
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
  if (report_.witness || bound(std::min(kFirstBoxes, options_.max_boxes))) return;
  if (sample(first, options_.samples) || descend()) return;
  if (bound(options_.max_boxes)) return;
  report_.undecided_share = given_up_;
  for (const JointBox& box : stack_) report_.undecided_share += box.share;
}

}  // namespace dyop::chain_internal
