// SPDX-License-Identifier: BSD-3-Clause
#include "view/tool/tool_page.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "dyop/geometry/triangle_mesh.h"
#include "dyop/motion/steady_motions.h"
#include "view/tool/tissue_tracks.h"

namespace dyop::view_internal {
namespace {

// Ticks of a block of the page.
constexpr std::int64_t kTicksOfBlock = 2048;

// Times at which the run is sampled for diagrams, at most.
constexpr std::int64_t kMostSamples = 4000;

// The proxy or the device: of each part the poses that wait to be written.
using PartPoses = std::vector<std::vector<TimedPose>>;

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
    scene.charts = ToolSample::charts();
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
    if (knows_device(tick.status)) {
      add_poses(device_, device_pose(tick.device));
    } else {
      hide_device();
    }
    if (tick.status != status_) {
      status_ = tick.status;
      span_.marks.push_back(mark_of(t_, status_));
    }
    sample_.add(tick);
    if ((tick.number + 1) % stride_ == 0) write_sample();
  }

  // The device is unknown: it is not drawn.
  void hide_device() {
    write_motions_of(device_, &ToolBodies::device);
    for (std::size_t k = 0; k < device_.size(); ++k) {
      device_[k].clear();
      span_.segments.push_back({bodies_.device(k), {t_, t_}, nullptr});
    }
  }

  void write_sample() {
    sample_.write({sample_begin_, t_}, bodies_.proxy(0), shown_, span_);
    sample_ = {};
    sample_begin_ = t_;
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
  ToolSample sample_;
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

bool knows_device(HapticStatus status) {
  return status != HapticStatus::InvalidInput && status != HapticStatus::Outlier;
}

ToolPose device_pose(const DevicePose& device) {
  return {RigidPose(device.q_WD.normalized(), device.p_WD), device.angles};
}

PageMark mark_of(Scalar t, HapticStatus status) {
  const bool is_warning = status == HapticStatus::Overlapping || status == HapticStatus::Trapped ||
                          status == HapticStatus::InvalidInput;
  return {t, is_warning ? "stalled" : "status", words_of(status), {}};
}

std::vector<PageChart> ToolSample::charts() {
  return {{"Force on the hand, largest of each sample", {"force"}},
          {"Torque on the hand, largest of each sample", {"torque"}},
          {"Energy returned to the hand", {"energy"}},
          {"Time of a tick in microseconds, longest of each sample", {"latency in us"}},
          {"How far tissue lags behind its newest snapshot", {"lag"}}};
}

std::optional<std::size_t> ToolSample::nearest_of(const HapticTick& tick) {
  const auto found = std::ranges::min_element(tick.clearances, {}, &ToolClearance::upper);
  if (found == tick.clearances.end() || !(found->upper < kInfinity)) return std::nullopt;
  return std::size_t(found - tick.clearances.begin());
}

void ToolSample::write(const TimeInterval& time, BodyId tool, std::span<const BodyId> obstacles,
                       PageSpan& span) const {
  span.samples.push_back({time.end, {force, torque, energy, latency, lag}});
  PageFrame frame;
  frame.interval = time;
  span.frames.push_back(frame);
  span.steps.push_back(time);
  for (std::size_t k = 0; k < least.size(); ++k) {
    PageGap gap;
    gap.t = time.end;
    gap.a = tool;
    gap.b = obstacles[k];
    gap.lower = least[k].lower;
    gap.upper = least[k].upper;
    if (nearest == k) {
      gap.witness_W = {least[k].p_WT, least[k].p_WO};
      gap.pivot_W = (least[k].p_WT + least[k].p_WO) / 2;
    }
    span.gaps.push_back(gap);
  }
}

std::shared_ptr<const Motion> motion_between(const TimedPose& from, const TimedPose& to) {
  const Scalar dt = to.t - from.t;
  const Matrix3 turn = to.X_WB.rotation() * from.X_WB.rotation().transpose();
  const Twist twist{(to.X_WB.translation() - from.X_WB.translation()) / dt,
                    rotation_vector(turn) / dt};
  return std::make_shared<const ConstantTwistMotion>(from.X_WB, twist, from.t);
}

namespace {

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
