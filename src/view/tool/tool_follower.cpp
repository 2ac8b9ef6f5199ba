// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/view/tool_follower.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "dyop/motion/steady_motions.h"
#include "view/tool/tissue_tracks.h"
#include "view/tool/tool_page.h"

namespace dyop {
namespace view_internal {
namespace {

constexpr Scalar kPictureEvery = 1.0 / 60;  // seconds of the session

// Pictures that may wait to be published: a sixth of a second.
constexpr std::size_t kMostPictures = 10;

// Snapshots of tissue that may wait, of all obstacles.
constexpr std::size_t kMostSnapshots = 64;

}  // namespace

// The ticks up to a moment.
struct ToolPicture {
  struct Tool {
    DevicePose device;
    bool has_device = false;
    ToolPose pose;
  };

  Scalar t = 0;
  std::vector<Tool> tools;
  HapticStatus status = HapticStatus::NotRun;  // the gravest: they are listed in this order
  std::vector<ObstacleProgress> progress;
  ToolSample sample;
};

// Vertices that a model gave.
struct GivenSnapshot {
  std::size_t obstacle = 0;
  std::int64_t number = 0;
  std::vector<Vector3> vertices;
  std::shared_ptr<const TriangleMesh> mesh = {};  // with these vertices, if it was cut
};

// A mesh of an obstacle, the first one or what a cut left, and how it deforms.
struct FollowedMesh {
  BodyId body;
  std::int64_t number = 0;  // of the snapshot in whose place it came
  TissueModes modes;
  std::size_t modes_sent = 0;
  std::vector<Vector3> vertices;                    // of the snapshot `reached`
  std::array<std::vector<Scalar>, 2> weights = {};  // of the one before it, and of it
  std::int64_t reached = 0;
};

// An obstacle that deforms: its meshes, and where its snapshots come from.
struct FollowedTissue {
  std::size_t obstacle = 0;
  std::optional<TissueFeed> formula;  // none: a model
  std::vector<FollowedMesh> meshes;
  std::size_t shown = 0;
  std::deque<GivenSnapshot> given;
};

namespace {

TissueFeed formula_of(const HapticRun& run, const TissueFeed& feed) {
  return feed_of_formula(run.title, feed.formula, feed.obstacle, run.scene);
}

// The meshes that take the place of snapshots while the run lasts, with their numbers.
std::vector<std::pair<std::int64_t, TissueMesh>> cuts_of(const HapticRun& run,
                                                         const TissueFeed& formula) {
  std::vector<std::pair<std::int64_t, TissueMesh>> cuts;
  if (!formula.cut) return cuts;
  const Scalar time = Scalar(run.runner.ticks) * run.runner.period;
  const auto count = std::int64_t(time / formula.period) + 1;
  for (std::int64_t number = 1; number <= count; ++number) {
    if (auto mesh = formula.cut(number)) cuts.emplace_back(number, std::move(*mesh));
  }
  return cuts;
}

}  // namespace

// Bodies of the page and all tissue, from a scene.
class FollowedScene {
 public:
  explicit FollowedScene(const HapticRun& run) : run_(run), bodies_(run.scene) {
    page_.title = run.title.empty() ? "A haptic run" : run.title;
    page_.bodies = bodies_.bodies();
    page_.end_time = Scalar(run.runner.ticks) * run.runner.period;
    page_.charts = ToolSample::charts();
    page_.keeps_time = true;
    for (const TissueFeed& feed : run.tissue) add(feed);
  }

  const PageScene& page() const { return page_; }
  const ToolBodies& bodies() const { return bodies_; }
  std::vector<FollowedTissue>& tissue() { return tissue_; }

  // The body as which an obstacle goes on.
  PageBody add_cut(FollowedTissue& tissue, GivenSnapshot snapshot) {
    page_.bodies.push_back(bodies_.later_mesh(tissue.obstacle, snapshot.mesh));
    add_mesh(tissue, snapshot.number, BodyId(page_.bodies.size() - 1),
             std::move(snapshot.vertices));
    return page_.bodies.back();
  }

 private:
  void add(const TissueFeed& feed) {
    FollowedTissue& tissue = tissue_.emplace_back();
    tissue.obstacle = feed.obstacle;
    add_mesh(tissue, 0, bodies_.obstacle(feed.obstacle),
             run_.scene.obstacles[feed.obstacle].vertices);
    if (feed.formula.empty()) return;
    tissue.formula = formula_of(run_, feed);
    for (auto& [number, cut] : cuts_of(run_, *tissue.formula)) {
      const auto mesh = std::make_shared<const TriangleMesh>(cut.vertices, cut.triangles);
      page_.bodies.push_back(bodies_.later_mesh(feed.obstacle, mesh));
      add_mesh(tissue, number, BodyId(page_.bodies.size() - 1), std::move(cut.vertices));
    }
  }

  void add_mesh(FollowedTissue& tissue, std::int64_t number, BodyId body,
                std::vector<Vector3> vertices) {
    const Scalar tolerance = kPartOfRestOffset * run_.options.rest_offset;
    page_.deformations.push_back({body, {}, {0}, {}});
    tissue.meshes.push_back({body, number, {vertices, tolerance, kMostModes}, 0, vertices});
    tissue.meshes.back().reached = number;
  }

  const HapticRun& run_;
  ToolBodies bodies_;
  PageScene page_;
  std::vector<FollowedTissue> tissue_;
};

// Turns pictures into spans; one thread.
class PictureWriter {
 public:
  explicit PictureWriter(const HapticRun& run)
      : run_(run), scene_(run), poses_(2 * scene_.bodies().part_count()) {}

  PageSpan start() {
    PageSpan span;
    for (std::size_t k = 0; k < run_.scene.obstacles.size(); ++k) {
      shown_.push_back(scene_.bodies().obstacle(k));
      rest(shown_[k], run_.scene.obstacles[k].X_WO, span);
    }
    for (const FollowedTissue& tissue : scene_.tissue()) {
      for (std::size_t k = 1; k < tissue.meshes.size(); ++k) hide(tissue.meshes[k].body, span);
    }
    const ToolBodies& bodies = scene_.bodies();
    const std::vector<ToolPose> start = bodies.start();
    for (std::size_t tool = 0; tool < start.size(); ++tool) {
      for (std::size_t k = bodies.first_part(tool); k < bodies.first_part(tool + 1); ++k) {
        poses_[k] = bodies.part_pose(k, start[tool]);
        rest(bodies.proxy(k), *poses_[k], span);
        hide(bodies.device(k), span);
      }
    }
    return span;
  }

  void take(GivenSnapshot snapshot, PageSpan& span) {
    for (FollowedTissue& tissue : scene_.tissue()) {
      if (tissue.obstacle != snapshot.obstacle) continue;
      if (snapshot.mesh) {
        span.bodies.push_back(scene_.add_cut(tissue, std::move(snapshot)));
      } else {
        tissue.given.push_back(std::move(snapshot));
      }
      return;
    }
  }

  void add(const ToolPicture& picture, PageSpan& span) {
    if (!(picture.t > t_)) return;
    for (std::size_t k = 0; k < picture.tools.size(); ++k) {
      const ToolPicture::Tool& tool = picture.tools[k];
      move(0, k, tool.pose, picture.t, span);
      if (tool.has_device) {
        move(scene_.bodies().part_count(), k, device_pose(tool.device), picture.t, span);
      } else {
        hide_device(k, picture.t, span);
      }
    }
    if (picture.status != status_) {
      status_ = picture.status;
      span.marks.push_back(mark_of(picture.t, status_));
    }
    for (FollowedTissue& tissue : scene_.tissue()) {
      deform(tissue, picture.progress[tissue.obstacle], picture.t, span);
    }
    picture.sample.write({t_, picture.t}, scene_.bodies(), shown_, span);
    t_ = picture.t;
  }

  void end(const std::string& why, PageSpan& span) const {
    if (!why.empty()) span.marks.push_back({t_, "end", why, {}});
  }

 private:
  void rest(BodyId body, const RigidPose& X_WB, PageSpan& span) const {
    span.segments.push_back({body, {t_, t_}, std::make_shared<const RestMotion>(X_WB)});
  }
  void hide(BodyId body, PageSpan& span) const {
    span.segments.push_back({body, {t_, t_}, nullptr});
  }

  // The parts of a tool or, from part_count() on, those of its device.
  void move(std::size_t first, std::size_t tool, const ToolPose& pose, Scalar t, PageSpan& span) {
    const ToolBodies& bodies = scene_.bodies();
    for (std::size_t part = bodies.first_part(tool); part < bodies.first_part(tool + 1); ++part) {
      std::optional<RigidPose>& last = poses_[first + part];
      const TimedPose now{t, bodies.part_pose(part, pose)};
      const BodyId body(first + part);
      if (last) {
        span.segments.push_back({body, {t_, t}, motion_between({t_, *last}, now)});
      } else {
        span.segments.push_back({body, {t, t}, std::make_shared<const RestMotion>(now.X_WB)});
      }
      last = now.X_WB;
    }
  }

  void hide_device(std::size_t tool, Scalar t, PageSpan& span) {
    const ToolBodies& bodies = scene_.bodies();
    for (std::size_t part = bodies.first_part(tool); part < bodies.first_part(tool + 1); ++part) {
      std::optional<RigidPose>& last = poses_[bodies.part_count() + part];
      if (!std::exchange(last, std::nullopt)) continue;
      span.segments.push_back({bodies.device(part), {t, t}, nullptr});
    }
  }

  void deform(FollowedTissue& tissue, const ObstacleProgress& progress, Scalar t, PageSpan& span) {
    while (tissue.shown + 1 < tissue.meshes.size() &&
           tissue.meshes[tissue.shown + 1].number <= progress.snapshot) {
      swap(tissue, t, span);
    }
    FollowedMesh& mesh = tissue.meshes[tissue.shown];
    while (mesh.reached < progress.snapshot) advance(tissue, mesh);
    PageDeformation now{mesh.body, {}, {t}, {}};
    now.modes.assign(mesh.modes.modes().begin() + std::ptrdiff_t(mesh.modes_sent),
                     mesh.modes.modes().end());
    mesh.modes_sent = mesh.modes.modes().size();
    for (std::vector<Scalar>& weights : mesh.weights) weights.resize(mesh.modes_sent);
    for (std::size_t k = 0; k < mesh.modes_sent; ++k) {
      now.weights.push_back(std::lerp(mesh.weights[0][k], mesh.weights[1][k], progress.fraction));
    }
    span.deformations.push_back(std::move(now));
  }

  void swap(FollowedTissue& tissue, Scalar t, PageSpan& span) {
    span.segments.push_back({tissue.meshes[tissue.shown].body, {t, t}, nullptr});
    const BodyId body = tissue.meshes[++tissue.shown].body;
    shown_[tissue.obstacle] = body;
    span.segments.push_back({body, {t, t}, std::make_shared<const RestMotion>(RigidPose())});
    span.marks.push_back({t, "status", "tissue is cut", {}});
    status_ = HapticStatus::NotRun;  // so that the next mark tells it again
  }

  // To the next snapshot; where a model's was left out, nothing moves.
  static void advance(FollowedTissue& tissue, FollowedMesh& mesh) {
    ++mesh.reached;
    if (tissue.formula) {
      tissue.formula->shape(mesh.reached, mesh.vertices);
    } else {
      std::erase_if(tissue.given, [&](const auto& one) { return one.number < mesh.reached; });
      if (!tissue.given.empty() && tissue.given.front().number == mesh.reached) {
        mesh.vertices = std::move(tissue.given.front().vertices);
      }
    }
    mesh.weights[0] = std::exchange(mesh.weights[1], mesh.modes.add(mesh.vertices));
  }

  const HapticRun& run_;
  FollowedScene scene_;
  std::vector<BodyId> shown_;  // of each obstacle
  std::vector<std::optional<RigidPose>> poses_;
  HapticStatus status_ = HapticStatus::NotRun;
  Scalar t_ = 0;
};

}  // namespace view_internal

using view_internal::GivenSnapshot;
using view_internal::ToolPicture;

struct ToolFollower::Impl {
  Impl(const HapticRun& the_run, std::function<void(PageSpan)> the_publish)
      : run(the_run),
        writer(run),
        publish(std::move(the_publish)),
        given(run.scene.obstacles.size()) {}

  // In the follower's thread.
  void work() {
    publish(writer.start());
    for (bool is_last = false; !is_last;) {
      std::deque<ToolPicture> pictures;
      {
        std::unique_lock lock(mutex);
        changed.wait(lock, [this] { return !waiting.empty() || has_ended; });
        pictures.swap(waiting);
        is_last = has_ended;
      }
      PageSpan span;
      take_snapshots(span);  // after the pictures, which may not be ahead of them
      for (const ToolPicture& picture : pictures) writer.add(picture, span);
      if (is_last) writer.end(why, span);
      publish(std::move(span));
    }
  }

  void take_snapshots(PageSpan& span) {
    std::deque<GivenSnapshot> taken;
    {
      const std::lock_guard lock(snapshot_mutex);
      taken.swap(snapshots);
    }
    for (GivenSnapshot& snapshot : taken) writer.take(std::move(snapshot), span);
  }

  const HapticRun run;
  view_internal::PictureWriter writer;  // the thread's
  const std::function<void(PageSpan)> publish;

  // The log's.
  ToolPicture next;
  Scalar due = 0;

  std::mutex mutex;
  std::condition_variable changed;
  std::deque<ToolPicture> waiting;
  bool has_ended = false;
  std::string why;

  std::mutex snapshot_mutex;
  std::deque<GivenSnapshot> snapshots;
  std::vector<std::int64_t> given;  // per obstacle; tissue's thread

  std::jthread thread;
};

PageScene ToolFollower::scene_of(const HapticRun& run) {
  return view_internal::FollowedScene(run).page();
}

ToolFollower::ToolFollower(const HapticRun& run, std::function<void(PageSpan)> publish)
    : impl_(std::make_unique<Impl>(run, std::move(publish))) {
  impl_->thread = std::jthread([impl = impl_.get()] { impl->work(); });
}

ToolFollower::~ToolFollower() {
  finish("");
}

void ToolFollower::add(const TickRecord& record) {
  const HapticTick& tick = record.tick;
  ToolPicture& next = impl_->next;
  next.t = tick.time;
  next.tools.clear();
  const auto add_tool = [&](const DevicePose& device, const HapticTick& of_tool) {
    next.tools.push_back({device, view_internal::knows_device(of_tool.status), of_tool.tool});
    next.status = std::max(next.status, of_tool.status);
  };
  add_tool(record.device, tick);
  next.sample.add(tick);
  for (const ToolRecord& other : record.others) {
    add_tool(other.device, other.tick);
    next.sample.add_other(other.tick);
  }
  next.sample.add_between(record.tool_clearances());
  next.progress = tick.progress;
  if (!(tick.time >= impl_->due)) return;
  {
    const std::unique_lock lock(impl_->mutex, std::try_to_lock);
    // Otherwise a later tick hands over this one's extremes with its own.
    if (!lock || impl_->waiting.size() >= view_internal::kMostPictures) return;
    impl_->waiting.push_back(std::exchange(next, {}));
  }
  impl_->due = tick.time + view_internal::kPictureEvery;
  impl_->changed.notify_one();
}

void ToolFollower::add_snapshot(std::size_t obstacle, std::span<const Vector3> vertices) {
  const std::int64_t number = ++impl_->given[obstacle];
  GivenSnapshot snapshot{obstacle, number, {vertices.begin(), vertices.end()}};
  const std::lock_guard lock(impl_->snapshot_mutex);  // held by the other thread for a swap only
  if (impl_->snapshots.size() < view_internal::kMostSnapshots) {
    impl_->snapshots.push_back(std::move(snapshot));
  }
}

// Cuts are few, and none is left out.
void ToolFollower::add_cut(std::size_t obstacle, const TissueMesh& mesh) {
  const std::int64_t number = ++impl_->given[obstacle];
  GivenSnapshot snapshot{obstacle, number, mesh.vertices,
                         std::make_shared<const TriangleMesh>(mesh.vertices, mesh.triangles)};
  const std::lock_guard lock(impl_->snapshot_mutex);
  impl_->snapshots.push_back(std::move(snapshot));
}

void ToolFollower::finish(const std::string& why) {
  if (!impl_->thread.joinable()) return;
  {
    const std::lock_guard lock(impl_->mutex);
    if (impl_->next.status != HapticStatus::NotRun) impl_->waiting.push_back(impl_->next);
    impl_->why = why;
    impl_->has_ended = true;
  }
  impl_->changed.notify_one();
  impl_->thread.join();
}

}  // namespace dyop
