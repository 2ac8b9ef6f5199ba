// SPDX-License-Identifier: BSD-3-Clause
#include "view/tool/tissue_tracks.h"

#include <algorithm>
#include <cmath>

#include "dyop/io/haptic_replay.h"

namespace dyop::view_internal {

TissueTracks::TissueTracks(const HapticRecordingReader& reader, const std::filesystem::path& file,
                           const ToolBodies& bodies, Scalar tolerance)
    : scene_(reader.scene()),
      bodies_(bodies),
      tolerance_(tolerance),
      shown_(reader.scene().obstacles.size()),
      given_(shown_.size()) {
  RecordedTissue tissue(reader, file);
  Scalar t = 0;
  reader.for_each_tick([&](const RecordedTick& tick) {
    tissue.for_each_step(tick, [&](const TissueStep& step) {
      if (step.turn) turn(t, *step.turn);
      if (step.next) add(step.obstacle, t, *step.next);
    });
    t += tick.time_passed();
    delay(tick.tissue_stopped, t);
  });
  std::stable_sort(swaps_.begin(), swaps_.end(),
                   [](const TissueSwap& x, const TissueSwap& y) { return x.time < y.time; });
}

TissueTracks::Track TissueTracks::start(std::size_t obstacle, Scalar t,
                                        const RecordedSnapshot* mesh) {
  if (mesh == nullptr) {
    return {bodies_.obstacle(obstacle),
            obstacle,
            nullptr,
            {scene_.obstacles[obstacle].vertices, tolerance_, kMostModes},
            {t},
            {{}}};
  }
  return {bodies_.later(mesh_count_++),
          obstacle,
          std::make_shared<const TriangleMesh>(mesh->vertices, mesh->triangles),
          {mesh->vertices, tolerance_, kMostModes},
          {t},
          {{}}};
}

// A snapshot that was given at time t starts where the one before ends, or now if tissue rests. So
// does another mesh.
void TissueTracks::add(std::size_t obstacle, Scalar t, const RecordedSnapshot& snapshot) {
  std::optional<std::size_t>& shown = shown_[obstacle];
  ++given_[obstacle];
  if (snapshot.is_mesh()) {
    const Scalar begin = shown ? std::max(t, tracks_[*shown].times.back()) : t;
    tracks_.push_back(start(obstacle, begin, &snapshot));
    shown = tracks_.size() - 1;
    swaps_.push_back({begin, obstacle, tracks_.back().body});
    return;
  }
  if (!shown) {
    tracks_.push_back(start(obstacle, t, nullptr));
    shown = tracks_.size() - 1;
  }
  Track& track = tracks_[*shown];
  const std::size_t keyframes = track.times.size();
  const std::vector<Scalar> start_weights = track.weights.back();
  if (track.times.back() < t) track.add_keyframe(t, start_weights);
  track.add_keyframe(track.times.back() + snapshot.duration, track.modes.add(snapshot.vertices));
  track.motions.push_back({keyframes, snapshot.duration, start_weights, track.weights.back()});
}

// Found at time t: what had been given for that number is not, and the motion before ends early.
void TissueTracks::turn(Scalar t, const RecordedTurn& turn) {
  const std::optional<std::size_t>& shown = shown_[turn.obstacle];
  if (!shown) return;
  Track& track = tracks_[*shown];
  if (given_[turn.obstacle] >= turn.snapshot) {
    --given_[turn.obstacle];
    track.take_back();
  }
  track.end_motion(turn.from, t);
}

void TissueTracks::Track::take_back() {
  if (motions.empty()) return;
  remove_keyframes(motions.back().keyframes);
  motions.pop_back();
}

void TissueTracks::Track::end_motion(Scalar part, Scalar t) {
  if (motions.empty() || motions.back().end == part) return;
  Motion& motion = motions.back();
  Scalar then = times.back();
  if (motion.end < 1 && then < t) {  // it has stood there
    add_keyframe(t, std::vector<Scalar>(weights.back()));
    then = t;
  } else {
    remove_keyframes(times.size() - 1);
  }
  motion.start.resize(motion.goal.size());
  std::vector<Scalar> place(motion.start);
  for (std::size_t k = 0; k < place.size(); ++k) {
    place[k] += part * (motion.goal[k] - motion.start[k]);
  }
  add_keyframe(then + (part - motion.end) * motion.duration, place);
  motion.end = part;
}

// Tissue was stopped before time t: it arrives later.
void TissueTracks::delay(Scalar by, Scalar t) {
  if (!(by > 0)) return;
  for (Track& track : tracks_) {
    for (std::size_t k = track.times.size(); k-- > 0 && track.times[k] >= t;) track.times[k] += by;
  }
  for (TissueSwap& swap : swaps_) swap.time += swap.time >= t ? by : 0;
}

void TissueTracks::add_to(PageScene& scene) const {
  for (const Track& track : tracks_) {
    if (track.mesh) scene.bodies.push_back(bodies_.later_mesh(track.obstacle, track.mesh));
    PageDeformation& deformation = scene.deformations.emplace_back();
    deformation.body = track.body;
    deformation.modes = track.modes.modes();
    deformation.times = track.times;
    for (std::vector<Scalar> weights : track.weights) {
      weights.resize(deformation.modes.size());
      deformation.weights.insert(deformation.weights.end(), weights.begin(), weights.end());
    }
  }
}

namespace {

Scalar product(std::span<const Vector3> a, std::span<const Vector3> b) {
  Scalar sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += a[k].dot(b[k]);
  return sum;
}

void subtract(Scalar weight, std::span<const Vector3> mode, std::vector<Vector3>& from) {
  for (std::size_t k = 0; k < from.size(); ++k) from[k] -= weight * mode[k];
}

Scalar longest(std::span<const Vector3> vectors) {
  Scalar most = 0;
  for (const Vector3& v : vectors) most = std::max(most, v.norm());
  return most;
}

}  // namespace

TissueModes::TissueModes(std::vector<Vector3> vertices, Scalar tolerance, std::size_t most_modes)
    : vertices_(std::move(vertices)), tolerance_(tolerance), most_modes_(most_modes) {}

std::vector<Scalar> TissueModes::add(std::span<const Vector3> snapshot) {
  rest_.resize(vertices_.size());
  for (std::size_t k = 0; k < rest_.size(); ++k) rest_[k] = snapshot[k] - vertices_[k];
  std::vector<Scalar> weights(modes_.size());
  for (int pass = 0; pass < 2; ++pass) {  // the second for what rounding left
    for (std::size_t k = 0; k < modes_.size(); ++k) {
      const Scalar weight = product(rest_, modes_[k]);
      subtract(weight, modes_[k], rest_);
      weights[k] += weight;
    }
  }
  const Scalar error = longest(rest_);
  if (error > tolerance_ && modes_.size() < most_modes_) {
    const Scalar size = std::sqrt(product(rest_, rest_));
    for (Vector3& v : rest_) v /= size;
    modes_.push_back(rest_);
    weights.push_back(size);
  } else {
    worst_ = std::max(worst_, error);
  }
  return weights;
}

}  // namespace dyop::view_internal
