// SPDX-License-Identifier: BSD-3-Clause
#include "support/oracles/recording_oracle.h"

#include <algorithm>
#include <functional>
#include <utility>

#include "dyop/core/error.h"
#include "support/oracles/fast_distance_oracle.h"
#include "support/oracles/mesh_intersection_oracle.h"
#include "support/oracles/shape_oracle.h"

namespace dyop::testing {
namespace {

constexpr std::size_t kMaxFaults = 100;

// Contains the posed box; rounded up by a fraction of its size that exceeds the roundings.
AlignedBox posed_box(const AlignedBox& box, const RigidPose& X_WB) {
  const Vector3 center = X_WB * box.center();
  const Vector3 half = X_WB.rotation().cwiseAbs() * (box.sizes() / 2);
  const Vector3 noise = 0x1p-40 * (half + center.cwiseAbs());
  return {center - half - noise, center + half + noise};
}

// A run, recorded or drawn.
struct RunView {
  std::string scene;
  bool is_complete = false;
  Scalar end = 0;
  std::vector<std::vector<Scalar>> steps;  // times of each that are examined
  std::function<RigidPose(std::size_t step, BodyId body, Scalar t)> pose;
};

class Checker {
 public:
  Checker(const Scene& scene, const RunView& recording, int times_between)
      : scene_(scene), recording_(recording), times_between_(times_between) {
    for (const BodyDefinition& body : scene.bodies) bodies_.emplace_back(*body.shape);
    find_pairs();
  }

  RecordingReport run() {
    check_frame();
    for (std::size_t step = 0; step < recording_.steps.size(); ++step) check_step(step);
    return std::move(report_);
  }

 private:
  struct Pair {
    std::size_t a = 0;
    std::size_t b = 0;
    PairSeed seed;
  };

  const std::string& name(std::size_t body) const { return scene_.bodies[body].name; }

  template <typename... Parts>
  void fault(const Parts&... parts) {
    if (report_.faults.size() < kMaxFaults) {
      report_.faults.push_back(core_internal::compose_message(parts...));
    }
  }

  // The library does not examine pairs of bodies that cannot move either.
  void find_pairs() {
    const auto moves = [&](std::size_t k) { return scene_.bodies[k].kind != BodyKind::Static; };
    const auto is_disabled = [&](std::size_t a, std::size_t b) {
      return std::any_of(
          scene_.disabled_pairs.begin(), scene_.disabled_pairs.end(), [&](const auto& pair) {
            const std::size_t x = pair.first.slot;
            const std::size_t y = pair.second.slot;
            return std::min(a, b) == std::min(x, y) && std::max(a, b) == std::max(x, y);
          });
    };
    for (std::size_t a = 0; a < scene_.bodies.size(); ++a) {
      for (std::size_t b = a + 1; b < scene_.bodies.size(); ++b) {
        if ((moves(a) || moves(b)) && !is_disabled(a, b)) pairs_.push_back({a, b, {}});
      }
    }
  }

  void check_frame() {
    if (!recording_.is_complete) fault("the recording has no end");
    if (recording_.scene != scene_.source) fault("the recording is of another scene");
    if (recording_.steps.empty()) return fault("the recording has no step");
    Scalar t = 0;
    for (const std::vector<Scalar>& times : recording_.steps) {
      if (times.front() != t) fault("a step begins at ", times.front(), ", not at ", t);
      t = times.back();
    }
    if (recording_.is_complete && recording_.end != t) {
      fault("the last step ends at ", t, ", the run at ", recording_.end);
    }
  }

  void check_step(std::size_t step) {
    const std::vector<Scalar>& times = recording_.steps[step];
    ++report_.steps;
    // A step starts where the previous one ended, except for what an impact changed.
    check_time(step, times.front());
    for (std::size_t k = 1; k < times.size(); ++k) {
      const Scalar begin = times[k - 1];
      for (int i = 1; i <= times_between_; ++i) {
        check_time(step, begin + (times[k] - begin) * i / (times_between_ + 1));
      }
      check_time(step, times[k]);
    }
  }

  void check_time(std::size_t step, Scalar t) {
    ++report_.poses;
    std::vector<RigidPose> poses;
    for (std::size_t k = 0; k < bodies_.size(); ++k) {
      poses.push_back(recording_.pose(step, BodyId(k), t));
    }
    const bool is_end = t == 0 || t == recording_.steps.back().back();
    for (Pair& pair : pairs_) {
      ++report_.pairs;
      const RigidPose& X_WA = poses[pair.a];
      const RigidPose& X_WB = poses[pair.b];
      if (!boxes_meet(pair, X_WA, X_WB)) continue;
      ++report_.examined_pairs;
      const Shape& a = bodies_[pair.a].shape();
      const Shape& b = bodies_[pair.b].shape();
      if (surfaces_meet(pair, X_WA, X_WB) || (is_end && oracle_contains(a, X_WA, b, X_WB))) {
        fault(name(pair.a), " and ", name(pair.b), " intersect at t = ", t);
      }
    }
  }

  bool boxes_meet(const Pair& pair, const RigidPose& X_WA, const RigidPose& X_WB) const {
    const auto box = [&](std::size_t body, const RigidPose& X_W) {
      return posed_box(scene_.bodies[body].shape->bounding_box(), X_W);
    };
    return box(pair.a, X_WA).intersects(box(pair.b, X_WB));
  }

  bool surfaces_meet(Pair& pair, const RigidPose& X_WA, const RigidPose& X_WB) const {
    const OracleBody& a = bodies_[pair.a];
    const OracleBody& b = bodies_[pair.b];
    if (a.surface().rounding_radius + b.surface().rounding_radius == 0) {
      return oracle_meshes_intersect(*a.surface().triangles, X_WA, *b.surface().triangles, X_WB);
    }
    return !(fast_oracle_distance(a, X_WA, b, X_WB, {}, pair.seed).lower > 0);
  }

  const Scene& scene_;
  const RunView& recording_;
  int times_between_;
  std::vector<OracleBody> bodies_;
  std::vector<Pair> pairs_;
  RecordingReport report_;
};

RecordingReport check_view(const Scene& scene, const RunView& view, std::size_t body_count,
                           int times_between) {
  DYOP_REQUIRE(times_between >= 0, "times_between must be >= 0, not ", times_between);
  DYOP_REQUIRE(scene.bodies.size() == body_count, "the scene has ", scene.bodies.size(),
               " bodies, the recording ", body_count);
  return Checker(scene, view, times_between).run();
}

}  // namespace

RecordingReport check_poses(const Scene& scene, const std::vector<Scalar>& times,
                            const std::function<RigidPose(BodyId body, std::size_t time)>& pose) {
  DYOP_REQUIRE(times.size() >= 2, "two times are needed, not ", times.size());
  RunView view{scene.source, true, times.back(), {times}, {}};
  view.pose = [&](std::size_t, BodyId body, Scalar t) {
    const auto place = std::lower_bound(times.begin(), times.end(), t) - times.begin();
    return pose(body, std::size_t(place));
  };
  return check_view(scene, view, scene.bodies.size(), 0);
}

#ifdef DYOP_HAS_RECORDING
RecordingReport check_recording(const Scene& scene, const RecordingReader& recording,
                                int times_between) {
  RunView view{
      recording.header().scene, recording.end().has_value(), recording.interval().end, {}, {}};
  for (const TimeInterval& step : recording.steps()) view.steps.push_back({step.begin, step.end});
  view.pose = [&](std::size_t, BodyId body, Scalar t) { return recording.pose(body, t); };
  return check_view(scene, view, recording.bodies().size(), times_between);
}
#endif

}  // namespace dyop::testing
