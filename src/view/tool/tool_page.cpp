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
  ToolPageMaker(const std::filesystem::path& file, const std::optional<PageVerdict>& verdict)
      : file_(file),
        verdict_(verdict),
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
    scene.verdict = verdict_;
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
    const std::vector<ToolPose> tools = bodies_.start();
    for (std::size_t k = 0; k < tools.size(); ++k) add_poses(proxy_, k, tools[k]);
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
      status_ = HapticStatus::NotRun;  // so that the next mark tells it again
    }
  }

  void add_poses(PartPoses& poses, std::size_t tool, const ToolPose& pose) const {
    for (std::size_t k = bodies_.first_part(tool); k < bodies_.first_part(tool + 1); ++k) {
      poses[k].push_back({t_, bodies_.part_pose(k, pose)});
    }
  }

  // A RecordedTick or RecordedTool.
  template <typename Tick>
  void add_tool(std::size_t number, const Tick& tick) {
    add_poses(proxy_, number, tick.tool);
    if (knows_device(tick.status)) {
      add_poses(device_, number, device_pose(tick.device));
    } else {
      hide_device(number);
    }
  }

  void add(const RecordedTick& tick) {
    t_ += tick.time_passed();
    swap_tissue();
    add_tool(0, tick);
    sample_.add(tick);
    HapticStatus status = tick.status;  // the gravest
    for (std::size_t k = 0; k < tick.others.size(); ++k) {
      add_tool(k + 1, tick.others[k]);
      sample_.add_other(tick.others[k]);
      status = std::max(status, tick.others[k].status);
    }
    sample_.add_between(tick.tool_clearances);
    if (status != status_) {
      status_ = status;
      span_.marks.push_back(mark_of(t_, status_));
    }
    if ((tick.number + 1) % stride_ == 0) write_sample();
  }

  // The device is unknown: it is not drawn.
  void hide_device(std::size_t tool) {
    write_motions_of(device_, &ToolBodies::device);
    for (std::size_t k = bodies_.first_part(tool); k < bodies_.first_part(tool + 1); ++k) {
      device_[k].clear();
      span_.segments.push_back({bodies_.device(k), {t_, t_}, nullptr});
    }
  }

  void write_sample() {
    sample_.write({sample_begin_, t_}, bodies_, shown_, span_);
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
  std::optional<PageVerdict> verdict_;
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

ToolPage make_tool_page(const std::filesystem::path& recording,
                        const std::optional<PageVerdict>& verdict) {
  return ToolPageMaker(recording, verdict).make();
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

ToolBodies::ToolBodies(const HapticScene& scene) : scene_(scene), tools_(scene.tools()) {
  for (std::size_t tool = 0; tool < tools_.size(); ++tool) {
    first_part_.push_back(parts_.size());
    for (std::size_t k = 0; k < tools_[tool].parts.size(); ++k) parts_.push_back({tool, k});
  }
  first_part_.push_back(parts_.size());
}

std::vector<ToolPose> ToolBodies::start() const {
  std::vector<ToolPose> poses;
  for (const HapticTool& tool : tools_) poses.push_back(tool.start());
  return poses;
}

std::vector<PageBody> ToolBodies::bodies() const {
  std::vector<PageBody> bodies;
  const auto add_parts = [&](const char* name, BodyKind kind, const char* color, bool is_ghost) {
    for (std::size_t k = 0; k < part_count(); ++k) {
      const auto [tool, number] = parts_[k];
      PageBody& body = bodies.emplace_back();
      body.name = name;
      if (tool_count() > 1) body.name += " " + std::to_string(tool + 1);
      if (tools_[tool].parts.size() > 1) body.name += ", part " + std::to_string(number + 1);
      body.kind = kind;
      body.shape = part(k).shape;
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
  const ToolPart& moved = part(number);
  if (!moved.hinge) return tool.X_WT * moved.X_TP;
  const RigidPose& X_TJ = tools_[parts_[number].tool].hinges[*moved.hinge].X_TJ;
  const Matrix3 turn = rotation_from_vector(Vector3(0, 0, tool.angles[*moved.hinge]));
  return tool.X_WT * X_TJ * RigidPose(turn, Vector3::Zero()) * X_TJ.inverse() * moved.X_TP;
}

Scalar ToolBodies::reach(std::size_t number) const {
  return part(number).shape->bounding_radius();
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
          {"How far tissue is behind its newest snapshot, and behind the session's time",
           {"lag", "behind"}}};
}

std::optional<std::size_t> ToolSample::nearest_of(const HapticTick& tick) {
  const auto found = std::ranges::min_element(tick.clearances, {}, &ToolClearance::upper);
  if (found == tick.clearances.end() || !(found->upper < kInfinity)) return std::nullopt;
  return std::size_t(found - tick.clearances.begin());
}

void ToolSample::add_between(std::span<const ToolClearance> pairs) {
  between.resize(pairs.size(), {kInfinity, kInfinity});
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    between[k] = {std::min(between[k].lower, pairs[k].lower),
                  std::min(between[k].upper, pairs[k].upper), pairs[k].p_WT, pairs[k].p_WO};
  }
}

namespace {

void add_witness(const ToolClearance& clearance, PageGap& gap) {
  gap.witness_W = {clearance.p_WT, clearance.p_WO};
  gap.pivot_W = (clearance.p_WT + clearance.p_WO) / 2;
}

}  // namespace

void ToolSample::write(const TimeInterval& time, const ToolBodies& bodies,
                       std::span<const BodyId> obstacles, PageSpan& span) const {
  const auto closest = std::ranges::min_element(between, {}, &ToolClearance::upper);
  const bool tools_are_nearest =
      closest != between.end() && (!nearest || closest->upper < least[*nearest].upper);
  span.samples.push_back({time.end, {force, torque, energy, latency, lag, behind}});
  PageFrame frame;
  frame.interval = time;
  span.frames.push_back(frame);
  span.steps.push_back(time);
  for (std::size_t k = 0; k < least.size(); ++k) {
    PageGap gap;
    gap.t = time.end;
    gap.a = bodies.proxy(0);
    gap.b = obstacles[k];
    gap.lower = least[k].lower;
    gap.upper = least[k].upper;
    if (nearest == k && !tools_are_nearest) add_witness(least[k], gap);
    span.gaps.push_back(gap);
  }
  std::size_t pair = 0;
  for (std::size_t second = 1; second < bodies.tool_count(); ++second) {
    for (std::size_t first = 0; first < second; ++first, ++pair) {
      PageGap gap;
      gap.t = time.end;
      gap.a = bodies.proxy(bodies.first_part(second));
      gap.b = bodies.proxy(bodies.first_part(first));
      gap.lower = between[pair].lower;
      gap.upper = between[pair].upper;
      if (tools_are_nearest && &*closest == &between[pair]) add_witness(between[pair], gap);
      span.gaps.push_back(gap);
    }
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
