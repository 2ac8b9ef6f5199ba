// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/chain/certify_chain.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "chain/path_cells.h"
#include "core/batch_run.h"
#include "core/tolerance.h"
#include "dyop/core/error.h"
#include "dyop/geometry/half_space.h"
#include "dyop/motion/steady_motions.h"
#include "toi/obstacles/obstacle_data.h"
#include "toi/rigid/motion_bounds.h"

namespace dyop {
namespace chain_internal {

/// A box in the world: its centre, and its axes times its half extents.
struct PosedBox {
  PosedBox(const AlignedBox& box, const RigidPose& X_WB)
      : center(X_WB * box.center()), half_axes(X_WB.rotation() * (box.sizes() / 2).asDiagonal()) {}

  Vector3 center;
  Matrix3 half_axes;
};

/// The largest gap of two boxes along the axes of both and the line of their centres; negative or
/// NaN if none separates them. `faces` are the unit axes.
Scalar gap_of_boxes(const PosedBox& a, const Matrix3& faces_a, const PosedBox& b,
                    const Matrix3& faces_b) {
  const Vector3 between = b.center - a.center;
  const auto gap_along = [&](const Vector3& n) {
    return std::abs(n.dot(between)) - (n.transpose() * a.half_axes).cwiseAbs().sum() -
           (n.transpose() * b.half_axes).cwiseAbs().sum();
  };
  Scalar best = gap_along(between.normalized());
  for (Eigen::Index k = 0; k < 3; ++k) {
    best = std::max({best, gap_along(faces_a.col(k)), gap_along(faces_b.col(k))});
  }
  return best;
}

/// Proves that two boxes stay apart while their bodies move: along an axis that is fixed in a frame,
/// their gap changes no faster than their farthest points move as seen from that frame. So it is
/// measured at the middle of a part of the path, less the way of both until the part ends; parts are
/// halved, down to one cell, until that suffices.
///
/// Rounding is that of other gaps of moving bodies, kStepNoise times the size of both.
class BoxProof {
 public:
  /// `turns`: moving joints of the chain between the link and the frame.
  struct Side {
    const Shape* shape = nullptr;
    std::optional<std::size_t> link;  // none: at rest, at X_WB
    std::size_t turns = 0;
    RigidPose X_WB;
    Scalar size = 0;  // of the numbers that its gaps are computed from
  };

  BoxProof(const PathCells& cells, const Side& a, const Side& b, Scalar reach)
      : cells_(cells),
        a_(a),
        b_(b),
        box_a_(a.shape->bounding_box()),
        box_b_(b.shape->bounding_box()),
        reach_(reach + kStepNoise * (a.size + b.size)) {}

  /// Whether they are proven farther apart than `reach` over cells [first, last).
  bool holds(std::size_t first, std::size_t last) const {
    const std::size_t middle = (first + last) / 2;
    const RigidPose& X_WA = pose_of(a_, middle);
    const RigidPose& X_WB = pose_of(b_, middle);
    const Scalar gap = gap_of_boxes(PosedBox(box_a_, X_WA), X_WA.rotation(), PosedBox(box_b_, X_WB),
                                    X_WB.rotation());
    if (!(gap > reach_)) return false;
    const TimeInterval part = cells_.interval(first, last);
    const Scalar time =
        std::max(part.end - cells_.middle(middle), cells_.middle(middle) - part.begin);
    const Scalar way = time * (speed_of(a_, part) + speed_of(b_, part)) * (1 + 16 * kUnitRoundoff);
    if (gap - way > reach_) return true;
    return last - first > 1 && holds(first, middle) && holds(middle, last);
  }

 private:
  const RigidPose& pose_of(const Side& side, std::size_t cell) const {
    return side.link ? cells_.middle_pose(*side.link, cell) : side.X_WB;
  }
  Scalar speed_of(const Side& side, const TimeInterval& part) const {
    if (!side.link) return 0;
    const TwistBound bound = cells_.bound(*side.link, side.turns, part);
    return bound.linear_speed + bound.angular_speed * side.shape->bounding_radius();
  }

  const PathCells& cells_;
  const Side& a_;
  const Side& b_;
  AlignedBox box_a_;
  AlignedBox box_b_;
  Scalar reach_;
};

struct ChainMemory {
  ObstacleWorkspace obstacles;
  ToiWorkspace pair;
  PathCells cells;
};

}  // namespace chain_internal

ChainWorkspace::ChainWorkspace() : memory_(std::make_unique<chain_internal::ChainMemory>()) {}
ChainWorkspace::~ChainWorkspace() = default;
ChainWorkspace::ChainWorkspace(ChainWorkspace&&) noexcept = default;
ChainWorkspace& ChainWorkspace::operator=(ChainWorkspace&&) noexcept = default;

namespace {

using chain_internal::BoxProof;
using chain_internal::CellMotion;

// A pointer that does not keep its object.
template <typename Object>
std::shared_ptr<const Object> borrow(const Object& object) {
  return std::shared_ptr<const Object>(std::shared_ptr<const Object>(), &object);
}

void move_to_world(WitnessPair& pair, const RigidPose& X_WC) {
  pair.p_WCa = X_WC * pair.p_WCa;
  pair.p_WCb = X_WC * pair.p_WCb;
  pair.nhat_AB_W = X_WC.rotation() * pair.nhat_AB_W;
}

void add(ToiStatistics& sum, const ToiStatistics& part) {
  sum.box_tests += part.box_tests;
  sum.leaf_tests += part.leaf_tests;
  sum.node_pairs += part.node_pairs;
  sum.peak_queue = std::max(sum.peak_queue, part.peak_queue);
}

// Of a path of several pieces, for the search among obstacles.
constexpr int kTimeParts = 16;

// Body after body, each only up to the first event found so far.
class ChainSearch {
 public:
  ChainSearch(const KinematicChain& chain, const JointPath& path, const ObstacleSet& obstacles,
              const ChainOptions& options, chain_internal::ChainMemory& memory)
      : chain_(borrow(chain)),
        path_(borrow(path)),
        obstacles_(obstacles),
        options_(options),
        memory_(memory) {
    best_.toi.status = ToiStatus::Separated;
    best_.toi.t_safe = path.domain().end;
    links_.reserve(chain.links().size());
    for (std::size_t link = 0; link < chain.links().size(); ++link) {
      links_.emplace_back(chain_, path_, link);
    }
    memory_.cells.set(chain, path, links_);
    // A path of one piece has its cells at the same times.
    const bool is_one_piece = path.times().size() == 2;
    memory_.obstacles.memory().time_parts = is_one_piece ? int(memory_.cells.count()) : kTimeParts;
    sizes_.resize(links_.size());
    for (std::size_t link = 0; link < links_.size(); ++link) sizes_[link] = size_of(link);
  }

  ChainResult run();

 private:
  void examine_link(std::size_t link);
  void examine_pair(const KinematicChain::LinkPair& pair);
  BoxProof::Side side_of(std::size_t link, std::size_t base_turns) const;
  bool stays_apart(const BoxProof::Side& a, const BoxProof::Side& b) const;
  bool stays_apart(const BoxProof::Side& link, const Obstacle& obstacle) const;
  Scalar size_of(std::size_t link) const;
  ToiOptions rest_of_options() const;
  TimeInterval rest() const { return {path_->domain().begin, best_.toi.t_safe}; }
  // Keeps the event if it is earlier than the best one.
  bool take(const ToiResult& found);

  std::shared_ptr<const KinematicChain> chain_;
  std::shared_ptr<const JointPath> path_;
  const ObstacleSet& obstacles_;
  const ChainOptions& options_;
  chain_internal::ChainMemory& memory_;
  std::vector<LinkMotion> links_;  // in the world
  std::vector<Scalar> sizes_;      // largest_coordinate() of each
  ChainResult best_;
  ToiStatistics statistics_;
  Scalar rounding_allowance_ = 0;
};

ToiOptions ChainSearch::rest_of_options() const {
  ToiOptions options = options_.toi;
  options.max_node_pairs =
      std::max<std::int64_t>(1, options.max_node_pairs - statistics_.node_pairs);
  return options;
}

bool ChainSearch::take(const ToiResult& found) {
  add(statistics_, found.statistics);
  rounding_allowance_ = std::max(rounding_allowance_, found.rounding_allowance);
  if (found.status == ToiStatus::Separated) return false;
  // An event at the very end of the remaining time is not earlier than the known one, unless there
  // is none, or that one is an impact at the start, where this pair is too near already.
  const bool is_worse = found.status == ToiStatus::InitiallyWithinTarget &&
                        best_.toi.status != ToiStatus::InitiallyWithinTarget;
  const bool is_first = best_.toi.status == ToiStatus::Separated;
  if (!is_first && !is_worse && !(found.t_safe < best_.toi.t_safe)) return false;
  best_ = ChainResult();
  best_.toi = found;
  return true;
}

Scalar ChainSearch::size_of(std::size_t link) const {
  const Shape* const shape = chain_->links()[link].shape.get();
  if (!shape) return 0;
  const TimeInterval whole = path_->domain();
  const TwistBound bound = memory_.cells.bound(link, links_[link].turns().size(), whole);
  return toi_internal::largest_coordinate(links_[link], bound, shape->bounding_radius(), whole);
}

// As seen from a frame with so many moving joints between it and the world.
BoxProof::Side ChainSearch::side_of(std::size_t link, std::size_t base_turns) const {
  return {chain_->links()[link].shape.get(), link, links_[link].turns().size() - base_turns,
          RigidPose(), sizes_[link]};
}

// What this does not prove may still be so.
bool ChainSearch::stays_apart(const BoxProof::Side& a, const BoxProof::Side& b) const {
  const Scalar radius = std::min(a.shape->bounding_radius(), b.shape->bounding_radius());
  const Scalar tolerance =
      options_.toi.distance_tolerance.value_or(kDefaultRelativeTolerance * radius);
  const BoxProof proof(memory_.cells, a, b, options_.toi.target_distance + tolerance);
  return proof.holds(0, memory_.cells.count_until(best_.toi.t_safe));
}

bool ChainSearch::stays_apart(const BoxProof::Side& link, const Obstacle& obstacle) const {
  const auto* const motion = dynamic_cast<const RestMotion*>(obstacle.X_WO.get());
  if (!motion || as_half_space(*obstacle.shape)) return false;
  const RigidPose X_WO = motion->pose(0);
  const Scalar size = X_WO.translation().norm() + 2 * obstacle.shape->bounding_radius();
  return stays_apart(link, {obstacle.shape.get(), std::nullopt, 0, X_WO, size});
}

void ChainSearch::examine_link(std::size_t link) {
  const Link& body = chain_->links()[link];
  if (!body.shape) return;
  ObstacleFilter filter = options_.obstacles;
  filter.groups &= body.groups;
  if (filter.groups == 0) return;
  ToiOptions options = rest_of_options();
  options.solid_a = body.is_solid;
  const BoxProof::Side side = side_of(link, 0);
  filter.accepts = [&](ObstacleId id) {
    const auto& accepts = options_.obstacles.accepts;
    return (!accepts || accepts(id)) && !stays_apart(side, obstacles_.obstacle(id));
  };
  const CellMotion motion(links_[link], link, CellMotion::Frame::World, memory_.cells);
  const ObstacleImpact found =
      obstacles_.first_impact(*body.shape, motion, rest(), options, filter, memory_.obstacles);
  if (!take(found.toi)) return;
  best_.link_a = link;
  best_.obstacle = found.obstacle;
}

void ChainSearch::examine_pair(const KinematicChain::LinkPair& pair) {
  const Link& a = chain_->links()[pair.first];
  const Link& b = chain_->links()[pair.second];
  const std::size_t base = chain_->common_ancestor(pair.first, pair.second);
  const std::size_t base_turns = links_[base].turns().size();
  if (stays_apart(side_of(pair.first, base_turns), side_of(pair.second, base_turns))) return;
  ToiOptions options = rest_of_options();
  options.solid_a = a.is_solid;
  options.solid_b = b.is_solid;
  const LinkMotion motion_a(chain_, path_, pair.first, base);
  const LinkMotion motion_b(chain_, path_, pair.second, base);
  constexpr auto kLink = CellMotion::Frame::Link;
  const CellMotion cell_a(motion_a, pair.first, kLink, memory_.cells);
  const CellMotion cell_b(motion_b, pair.second, kLink, memory_.cells);
  const ToiResult found =
      time_of_impact(*a.shape, cell_a, *b.shape, cell_b, rest(), options, memory_.pair);
  if (!take(found)) return;
  best_.link_a = pair.first;
  best_.link_b = pair.second;
  const RigidPose X_WC = links_[base].pose(found.t_safe);
  best_.toi.X_WA = X_WC * found.X_WA;
  best_.toi.X_WB = X_WC * found.X_WB;
  if (best_.toi.contact) move_to_world(*best_.toi.contact, X_WC);
  for (Contact& contact : best_.toi.contacts) move_to_world(contact, X_WC);
}

ChainResult ChainSearch::run() {
  // The last links move most, and are most likely to shorten the remaining time for the others.
  for (std::size_t link = chain_->links().size(); link-- > 0;) examine_link(link);
  if (options_.with_self_collision) {
    for (const KinematicChain::LinkPair& pair : chain_->self_pairs()) examine_pair(pair);
  }
  best_.toi.statistics = statistics_;
  best_.toi.rounding_allowance = rounding_allowance_;
  const TimeInterval whole = path_->domain();
  const bool is_free = best_.toi.status == ToiStatus::Separated;
  best_.free_fraction = is_free ? 1 : (best_.toi.t_safe - whole.begin) / whole.length();
  return best_;
}

void require_fitting(const KinematicChain& chain, const JointPath& path,
                     const ChainOptions& options) {
  DYOP_REQUIRE(path.coordinate_count() == chain.coordinate_count(), "certify: the path has ",
               path.coordinate_count(), " coordinates, the chain ", chain.coordinate_count());
  DYOP_REQUIRE(!options.toi.solid_a && !options.toi.solid_b,
               "certify: use Link::is_solid and Obstacle::is_solid");
}

}  // namespace

ChainResult certify(const KinematicChain& chain, const JointPath& path,
                    const ObstacleSet& obstacles, const ChainOptions& options) {
  ChainWorkspace workspace;
  return certify(chain, path, obstacles, options, workspace);
}

ChainResult certify(const KinematicChain& chain, const JointPath& path,
                    const ObstacleSet& obstacles, const ChainOptions& options,
                    ChainWorkspace& workspace) {
  require_fitting(chain, path, options);
  return ChainSearch(chain, path, obstacles, options, workspace.memory()).run();
}

void certify_batch(const KinematicChain& chain, std::span<const JointPath> paths,
                   const ObstacleSet& obstacles, std::span<ChainResult> results,
                   const ChainOptions& options, const BatchOptions& batch) {
  DYOP_REQUIRE(paths.size() == results.size(), "certify: ", paths.size(), " paths, but space for ",
               results.size(), " results");
  for (std::size_t i = 0; i < paths.size(); ++i) {
    try {
      require_fitting(chain, paths[i], options);
    } catch (const InvalidArgument& error) {
      throw InvalidArgument(core_internal::compose_message("path ", i, ": ", error.what()));
    }
    results[i] = ChainResult();
    results[i].toi.t_safe = paths[i].domain().begin;
  }
  const core_internal::EitherStop stop(options.toi.stop, batch.stop);
  ChainOptions stoppable = options;
  if (batch.stop.stop_possible()) stoppable.toi.stop = stop.token();
  std::vector<ChainWorkspace> workspaces(core_internal::batch_worker_count(paths.size(), batch));
  core_internal::run_batch(paths.size(), batch, [&](std::size_t index, std::size_t worker) {
    results[index] = certify(chain, paths[index], obstacles, stoppable, workspaces[worker]);
  });
}

}  // namespace dyop
