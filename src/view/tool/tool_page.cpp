// SPDX-License-Identifier: BSD-3-Clause
#include "view/tool/tool_page.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/constant_twist_motion.h"
#include "dyop/motion/rest_motion.h"
#include "view/tool/tissue_tracks.h"

namespace dyop::view_internal {
namespace {

// Ticks of a block of the page.
constexpr std::int64_t kTicksOfBlock = 2048;

// Times at which the run is sampled for diagrams, at most.
constexpr std::int64_t kMostSamples = 4000;

// How far a drawn tool and drawn tissue may be from the recorded ones, as a part of the rest
// offset: what rests on tissue is not seen in it.
constexpr Scalar kPartOfRestOffset = 0.25;

// The proxy or the device: of each part the poses that wait to be written.
using PartPoses = std::vector<std::vector<TimedPose>>;

// The extremes of a number of ticks.
struct Sample {
  Scalar force = 0;
  Scalar torque = 0;
  Scalar latency = 0;
  Scalar energy = 0;
  Scalar lag = 0;
  std::vector<ToolClearance> least;  // by lower bound; the upper bound is the least of all
};

class ToolPageMaker {
 public:
  explicit ToolPageMaker(const std::filesystem::path& file)
      : file_(file),
        reader_(file),
        bodies_(reader_.scene()),
        tissue_(reader_, file, bodies_, kPartOfRestOffset * reader_.options().rest_offset),
        proxy_(bodies_.part_count()),
        device_(bodies_.part_count()),
        stride_(
            std::max<std::int64_t>(1, (reader_.tick_count() + kMostSamples - 1) / kMostSamples)) {}

  ToolPage make() {
    PageScene scene = page_scene();
    tissue_.add_to(scene);
    const PageEncoder encoder(std::move(scene));
    ToolPage page{encoder.scene().title, {encoder.head()}};
    start();
    for (const TissueSwap& swap : tissue_.swaps()) {
      span_.segments.push_back({swap.body, {0, 0}, nullptr});
    }
    std::int64_t waiting = 0;
    reader_.for_each_tick([&](const RecordedTick& tick) {
      add(tick);
      if (++waiting < kTicksOfBlock) return;
      write_motions();
      page.blocks.push_back(encoder.span(std::exchange(span_, {})));
      waiting = 0;
    });
    write_motions();
    add_end();
    page.blocks.push_back(encoder.span(span_));
    return page;
  }

 private:
  PageScene page_scene() const {
    PageScene scene;
    scene.title =
        reader_.header().title.empty() ? file_.filename().string() : reader_.header().title;
    scene.bodies = bodies_.bodies();
    scene.end_time = Scalar(reader_.tick_count()) * reader_.header().period;
    scene.charts = {{"Force on the hand, largest of each sample", {"force"}},
                    {"Torque on the hand, largest of each sample", {"torque"}},
                    {"Energy returned to the hand", {"energy"}},
                    {"Time of a tick in microseconds, longest of each sample", {"latency in us"}},
                    {"How far tissue lags behind its newest snapshot", {"lag"}}};
    return scene;
  }

  void start() {
    for (std::size_t k = 0; k < reader_.scene().obstacles.size(); ++k) {
      const RigidPose& X_WO = reader_.scene().obstacles[k].X_WO;
      shown_.push_back(bodies_.obstacle(k));
      span_.segments.push_back({shown_[k], {0, 0}, std::make_shared<const RestMotion>(X_WO)});
    }
    ToolPose tool{reader_.scene().X_WT, {}};
    for (std::size_t k = 0; k < reader_.scene().hinges.size(); ++k) {
      tool.angles[k] = reader_.scene().hinges[k].angle;
    }
    add_poses(proxy_, tool);
  }

  // Obstacles that have become other meshes by now.
  void swap_tissue() {
    for (; swapped_ < tissue_.swaps().size(); ++swapped_) {
      const TissueSwap& swap = tissue_.swaps()[swapped_];
      if (swap.time > t_) return;
      BodyId& shown = shown_[swap.obstacle];
      span_.segments.push_back({shown, {swap.time, swap.time}, nullptr});
      shown = swap.body;
      span_.segments.push_back(
          {shown, {swap.time, swap.time}, std::make_shared<const RestMotion>(RigidPose())});
      span_.marks.push_back({swap.time, "status", "tissue is cut", {}});
    }
  }

  void add_poses(PartPoses& poses, const ToolPose& tool) const {
    for (std::size_t k = 0; k < poses.size(); ++k) {
      poses[k].push_back({t_, bodies_.part_pose(k, tool)});
    }
  }

  void add(const RecordedTick& tick) {
    t_ += tick.time_passed();
    swap_tissue();
    add_poses(proxy_, tick.tool);
    if (tick.status == HapticStatus::InvalidInput || tick.status == HapticStatus::Outlier) {
      hide_device();
    } else {
      const RigidPose X_WD(tick.device.q_WD.normalized(), tick.device.p_WD);
      add_poses(device_, {X_WD, tick.device.angles});
    }
    if (tick.status != status_) {
      status_ = tick.status;
      span_.marks.push_back({t_, mark_kind(status_), words_of(status_), {}});
    }
    gather(tick);
    if ((tick.number + 1) % stride_ == 0) write_sample();
  }

  static const char* mark_kind(HapticStatus status) {
    const bool is_warning = status == HapticStatus::Overlapping ||
                            status == HapticStatus::Trapped || status == HapticStatus::InvalidInput;
    return is_warning ? "stalled" : "status";
  }

  // The device is unknown: it is not drawn.
  void hide_device() {
    write_motions_of(device_, &ToolBodies::device);
    for (std::size_t k = 0; k < device_.size(); ++k) {
      device_[k].clear();
      span_.segments.push_back({bodies_.device(k), {t_, t_}, nullptr});
    }
  }

  void gather(const RecordedTick& tick) {
    sample_.force = std::max(sample_.force, tick.wrench.force_W.norm());
    sample_.torque = std::max(sample_.torque, tick.wrench.torque_W.norm());
    sample_.latency = std::max(sample_.latency, Scalar(tick.latency.count()) / 1e3);
    sample_.energy = tick.energy_returned;
    sample_.lag = std::max(sample_.lag, tick.tissue_lag);
    sample_.least.resize(tick.clearances.size());
    for (std::size_t k = 0; k < tick.clearances.size(); ++k) {
      ToolClearance& least = sample_.least[k];
      const Scalar lower =
          std::min(is_new_sample_ ? kInfinity : least.lower, tick.clearances[k].lower);
      const Scalar upper =
          std::min(is_new_sample_ ? kInfinity : least.upper, tick.clearances[k].upper);
      least = tick.clearances[k];
      least.lower = lower;
      least.upper = upper;
    }
    nearest_ = tick.nearest;
    is_new_sample_ = false;
  }

  void write_sample() {
    span_.samples.push_back(
        {t_, {sample_.force, sample_.torque, sample_.energy, sample_.latency, sample_.lag}});
    PageFrame frame;
    frame.interval = {sample_begin_, t_};
    span_.frames.push_back(frame);
    span_.steps.push_back(frame.interval);
    for (std::size_t k = 0; k < sample_.least.size(); ++k) {
      PageGap gap;
      gap.t = t_;
      gap.a = bodies_.proxy(0);
      gap.b = shown_[k];
      gap.lower = sample_.least[k].lower;
      gap.upper = sample_.least[k].upper;
      if (nearest_ == k) {
        gap.witness_W = {sample_.least[k].p_WT, sample_.least[k].p_WO};
        gap.pivot_W = (sample_.least[k].p_WT + sample_.least[k].p_WO) / 2;
      }
      span_.gaps.push_back(gap);
    }
    sample_begin_ = t_;
    sample_ = {};
    is_new_sample_ = true;
  }

  void write_motions() {
    write_motions_of(proxy_, &ToolBodies::proxy);
    write_motions_of(device_, &ToolBodies::device);
  }

  // Keeps the last pose, from which the next motion starts.
  void write_motions_of(PartPoses& poses, BodyId (ToolBodies::*id)(std::size_t) const) {
    for (std::size_t k = 0; k < poses.size(); ++k) {
      if (poses[k].empty()) continue;
      const ThinningLimits limits{kPartOfRestOffset * reader_.options().rest_offset,
                                  bodies_.reach(k)};
      add_thinned((bodies_.*id)(k), poses[k], limits, span_.segments);
      poses[k].erase(poses[k].begin(), poses[k].end() - 1);
    }
  }

  void add_end() {
    if (!reader_.end()) {
      span_.marks.push_back(
          {t_, "end", "the recording ends here: the run goes on, or was killed", {}});
    } else if (!reader_.end()->error.empty()) {
      span_.marks.push_back({t_, "undecided", reader_.end()->error, {}});
    }
  }

  std::filesystem::path file_;
  HapticRecordingReader reader_;
  ToolBodies bodies_;
  TissueTracks tissue_;
  std::vector<BodyId> shown_;  // of each obstacle
  std::size_t swapped_ = 0;
  PartPoses proxy_;
  PartPoses device_;
  std::int64_t stride_;
  PageSpan span_;
  Scalar t_ = 0;
  HapticStatus status_ = HapticStatus::NotRun;
  Sample sample_;
  bool is_new_sample_ = true;
  std::optional<std::size_t> nearest_;
  Scalar sample_begin_ = 0;
};

}  // namespace

ToolPage make_tool_page(const std::filesystem::path& recording) {
  return ToolPageMaker(recording).make();
}

namespace {

const char* color_of(ObstacleRole role) {
  switch (role) {
    case ObstacleRole::Tissue:
      return "#d39a8c";
    case ObstacleRole::HardRegion:
      return "#c0392b";
    case ObstacleRole::SoftRegion:
      return "#d9a521";
    case ObstacleRole::Monitor:
      return "#4fb3bf";
  }
  return "";
}

const char* words_of_role(ObstacleRole role) {
  switch (role) {
    case ObstacleRole::Tissue:
      return "tissue";
    case ObstacleRole::HardRegion:
      return "forbidden region";
    case ObstacleRole::SoftRegion:
      return "region that pushes back";
    case ObstacleRole::Monitor:
      return "region that is watched";
  }
  return "";
}

// An open sheet would hide what is behind it.
bool is_open(const Shape& shape) {
  const auto* mesh = dynamic_cast<const TriangleMesh*>(&shape);
  return mesh != nullptr && !mesh->is_closed();
}

PageBody obstacle_body(const ToolObstacle& obstacle, std::shared_ptr<const Shape> shape) {
  PageBody body;
  body.name = obstacle.name;
  body.kind = BodyKind::Static;
  body.shape = std::move(shape);
  body.shape_name = words_of_role(obstacle.role);
  body.color = color_of(obstacle.role);
  body.is_ghost = obstacle.role == ObstacleRole::SoftRegion ||
                  obstacle.role == ObstacleRole::Monitor || is_open(*body.shape);
  return body;
}

constexpr const char* kToolColor = "#8a9bb0";
constexpr const char* kDeviceColor = "#3b82f6";

}  // namespace

std::vector<PageBody> ToolBodies::bodies() const {
  std::vector<PageBody> bodies;
  const auto add_parts = [&](const char* name, BodyKind kind, const char* color, bool is_ghost) {
    for (std::size_t k = 0; k < part_count(); ++k) {
      PageBody& body = bodies.emplace_back();
      body.name = part_count() > 1 ? std::string(name) + ", part " + std::to_string(k + 1) : name;
      body.kind = kind;
      body.shape = scene_.tool[k].shape;
      body.color = color;
      body.is_ghost = is_ghost;
    }
  };
  add_parts("tool", BodyKind::Dynamic, kToolColor, false);
  add_parts("device", BodyKind::Kinematic, kDeviceColor, true);
  for (const ToolObstacle& obstacle : scene_.obstacles) {
    const auto shape = obstacle.shape != nullptr ? obstacle.shape
                                                 : std::make_shared<const TriangleMesh>(
                                                       obstacle.vertices, obstacle.triangles);
    bodies.push_back(obstacle_body(obstacle, shape));
  }
  return bodies;
}

PageBody ToolBodies::later_mesh(std::size_t number, std::shared_ptr<const Shape> mesh) const {
  PageBody body = obstacle_body(scene_.obstacles[number], std::move(mesh));
  body.name += ", cut";
  return body;
}

RigidPose ToolBodies::part_pose(std::size_t number, const ToolPose& tool) const {
  const ToolPart& part = scene_.tool[number];
  if (!part.hinge) return tool.X_WT * part.X_TP;
  const RigidPose& X_TJ = scene_.hinges[*part.hinge].X_TJ;
  const Matrix3 turn = rotation_from_vector(Vector3(0, 0, tool.angles[*part.hinge]));
  return tool.X_WT * X_TJ * RigidPose(turn, Vector3::Zero()) * X_TJ.inverse() * part.X_TP;
}

Scalar ToolBodies::reach(std::size_t part) const {
  return scene_.tool[part].shape->bounding_radius();
}

namespace {

std::shared_ptr<const ConstantTwistMotion> motion_between(const TimedPose& from,
                                                          const TimedPose& to) {
  const Scalar dt = to.t - from.t;
  const Matrix3 turn = to.X_WB.rotation() * from.X_WB.rotation().transpose();
  const Twist twist{(to.X_WB.translation() - from.X_WB.translation()) / dt,
                    rotation_vector(turn) / dt};
  return std::make_shared<const ConstantTwistMotion>(from.X_WB, twist, from.t);
}

bool passes(const Motion& motion, std::span<const TimedPose> poses, const ThinningLimits& limits) {
  for (const TimedPose& pose : poses) {
    const RigidPose X = motion.pose(pose.t);
    const Matrix3 turn = X.rotation().transpose() * pose.X_WB.rotation();
    const Scalar off = (X.translation() - pose.X_WB.translation()).norm() +
                       limits.reach * rotation_vector(turn).norm();
    if (!(off <= limits.tolerance)) return false;
  }
  return true;
}

}  // namespace

void add_thinned(BodyId body, std::span<const TimedPose> poses, const ThinningLimits& limits,
                 std::vector<PageSegment>& segments) {
  // Spans that still must be tried; the next one last. Each is halved at most as often as it can
  // be.
  std::vector<std::span<const TimedPose>> waiting{poses};
  while (!waiting.empty()) {
    const std::span<const TimedPose> span = waiting.back();
    waiting.pop_back();
    if (span.size() < 2 || !(span.front().t < span.back().t)) continue;
    auto motion = motion_between(span.front(), span.back());
    if (span.size() == 2 || passes(*motion, span.subspan(1, span.size() - 2), limits)) {
      segments.push_back({body, {span.front().t, span.back().t}, std::move(motion)});
      continue;
    }
    const std::size_t middle = span.size() / 2;
    waiting.push_back(span.subspan(middle));
    waiting.push_back(span.first(middle + 1));
  }
}

}  // namespace dyop::view_internal
