// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <atomic>
#include <mutex>
#include <utility>

#include "dyop/core/error.h"
#include "dyop/haptics/haptic_runner.h"

namespace dyop {
namespace haptics_internal {

// Carries the news of ticks to a model in another thread. The loop never waits: while the model
// reads, news are kept for the next tick.
class NewsBox {
 public:
  NewsBox(std::size_t tools, const ObstacleProgress& start)
      : tools_(tools), before_(start), waiting_(tools, Vector3::Zero()) {}

  std::size_t tool_count() const { return waiting_.size(); }

  // For the loop, after each tick.
  void post(const TissueFeed& feed, std::span<const DevicePose> devices, Scalar dt,
            std::span<const HapticTick> ticks) {
    const ObstacleProgress& now = ticks[0].progress[feed.obstacle];
    const std::int64_t mesh = mesh_.load(std::memory_order_acquire);
    const bool is_cut = before_.snapshot < mesh && mesh <= now.snapshot;  // which is no motion
    const std::int64_t begun = now.snapshot - before_.snapshot - (is_cut ? 1 : 0);
    const Scalar moved = now.fraction - before_.fraction + Scalar(begun);
    before_ = now;
    if (dt > 0) {
      const Scalar part = std::clamp(moved * feed.period / dt, Scalar{0}, Scalar{1});
      for (std::size_t k = 0; k < ticks.size(); ++k) {
        add_impulses(feed.obstacle, part, ticks[k], waiting_[k]);
      }
    }
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock) return;
    for (std::size_t k = 0; k < ticks.size(); ++k) give(devices[k], ticks[k], k);
  }

  // For the model: the number of its newest mesh, before it is given.
  void tell_mesh(std::int64_t number) { mesh_.store(number, std::memory_order_release); }

  // For the model.
  void take(TissueNews& news) {
    const std::lock_guard lock(mutex_);
    news.tools = tools_;
    for (ToolNews& tool : tools_) tool.impulse_W.setZero();
  }

 private:
  static void add_impulses(std::size_t obstacle, Scalar part, const HapticTick& tick,
                           Vector3& sum) {
    for (const ToolImpulse& impulse : tick.impulses) {
      if (impulse.obstacle == obstacle) sum += part * impulse.impulse_W;
    }
  }

  void give(const DevicePose& device, const HapticTick& tick, std::size_t number) {
    ToolNews& news = tools_[number];
    news.device = device;
    news.tick = tick;
    news.impulse_W += waiting_[number];
    waiting_[number].setZero();
  }

  std::mutex mutex_;
  std::vector<ToolNews> tools_;
  std::atomic<std::int64_t> mesh_{-1};
  ObstacleProgress before_;
  std::vector<Vector3> waiting_;  // impulses
};

}  // namespace haptics_internal

// A feed and the snapshot or mesh it has prepared.
struct TissueFeeder::State {
  State(HapticSession& fed, const TissueFeed& given)
      : session(fed),
        feed(given),
        vertices(fed.tissue_vertices(given.obstacle)),
        taken_before(fed.snapshots_taken(given.obstacle)),
        box(fed.tool_count(), fed.last().progress[given.obstacle]) {
    DYOP_REQUIRE(feed.period > 0 && feed.period < kInfinity,
                 "TissueFeed: period must be finite and > 0, not ", feed.period);
    DYOP_REQUIRE(feed.model || feed.shape, "TissueFeed: obstacle ", feed.obstacle,
                 " has neither a model nor a shape");
    session.expect_snapshots(feed.obstacle);
    if (!feed.model) prepare();
  }

  bool offer() {
    if (feed.model && !ask()) return false;
    const bool is_taken = mesh ? session.give_mesh(feed.obstacle, mesh->vertices, mesh->triangles)
                               : session.give_snapshot(feed.obstacle, vertices, feed.period);
    if (!is_taken) return false;
    ++number;
    if (feed.model) {
      mesh.reset();
      is_ready = false;
    } else {
      prepare();
    }
    return true;
  }

  // Whether the model's snapshot is ready to be given.
  bool ask() {
    if (is_ready) return true;
    if (session.snapshots_taken(feed.obstacle) + 1 < taken_before + number) return false;
    gather_news();
    mesh = feed.model->cut(news);
    if (mesh) {
      vertices = mesh->vertices;
      box.tell_mesh(taken_before + number);
      if (feed.given_mesh) feed.given_mesh(*mesh);
    } else {
      feed.model->step(news, vertices);
      if (feed.given) feed.given(vertices);
    }
    is_ready = true;
    return true;
  }

  void gather_news() {
    box.take(news);
    news.number = number;
    news.contacts.clear();
    if (news.tools[0].tick.status == HapticStatus::NotRun) return;
    news.progress = news.tools[0].tick.progress[feed.obstacle];
    for (std::size_t k = 0; k < news.tools.size(); ++k) find_contacts(k, news.tools[k].tick.tool);
  }

  void find_contacts(std::size_t tool, const ToolPose& pose) {
    session.find_contacts(feed.obstacle, news.progress, pose, feed.model->search(), found, tool);
    news.contacts.insert(news.contacts.end(), found.begin(), found.end());
    found.clear();
  }

  void prepare() {
    mesh = feed.cut ? feed.cut(number) : std::nullopt;
    if (mesh) {
      vertices = mesh->vertices;
    } else {
      feed.shape(number, vertices);
    }
  }

  HapticSession& session;
  const TissueFeed feed;
  std::vector<Vector3> vertices;
  std::optional<TissueMesh> mesh;
  const std::int64_t taken_before;  // by the obstacle, when the feeder began
  std::int64_t number = 1;
  bool is_ready = false;
  TissueNews news;
  std::vector<ToolContactPoint> found;
  haptics_internal::NewsBox box;  // two threads
};

TissueFeeder::TissueFeeder(HapticSession& session, const TissueFeed& feed)
    : state_(std::make_unique<State>(session, feed)) {}
TissueFeeder::~TissueFeeder() = default;
TissueFeeder::TissueFeeder(TissueFeeder&&) noexcept = default;
TissueFeeder& TissueFeeder::operator=(TissueFeeder&&) noexcept = default;

std::size_t TissueFeeder::obstacle() const {
  return state_->feed.obstacle;
}

bool TissueFeeder::offer() {
  return state_->offer();
}

void TissueFeeder::tell(std::span<const DevicePose> devices, Scalar dt,
                        std::span<const HapticTick> ticks) {
  const std::size_t tools = state_->box.tool_count();
  DYOP_REQUIRE(devices.size() == tools && ticks.size() == tools, "TissueFeeder: ", devices.size(),
               " devices and ", ticks.size(), " ticks for ", tools, " tools");
  for (const HapticTick& tick : ticks) {
    DYOP_REQUIRE(tick.progress.size() > state_->feed.obstacle, "TissueFeeder: a tick of ",
                 tick.progress.size(), " obstacles, not of this session");
  }
  if (state_->feed.model) state_->box.post(state_->feed, devices, dt, ticks);
}

std::vector<TissueFeeder> make_feeders(HapticSession& session,
                                       const std::vector<TissueFeed>& tissue) {
  std::vector<TissueFeeder> feeders;
  for (const TissueFeed& feed : tissue) {
    const bool is_fed = std::ranges::any_of(
        feeders, [&](const TissueFeeder& other) { return other.obstacle() == feed.obstacle; });
    DYOP_REQUIRE(!is_fed, "TissueFeed: two feeds are of obstacle ", feed.obstacle);
    feeders.emplace_back(session, feed);
  }
  return feeders;
}

}  // namespace dyop
