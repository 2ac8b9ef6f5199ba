// SPDX-License-Identifier: BSD-3-Clause
#include "check/trusted/haptic_prover.h"

#include "check/trusted/kernel.h"
#include "check/trusted/segments.h"

namespace dyop_check {
namespace {

constexpr std::int64_t kMuchWork = 2'000;  // node pairs: most motions need some tens

// A surface that deforms, on its way to a snapshot.
struct Surface {
  Body body;
  std::vector<Vec> to;
  Waypoint::Progress at;
  bool is_known = true;  // not after missing ticks, until the next snapshot

  std::vector<Vec> places() const {
    if (at.fraction >= 1) return to;
    std::vector<Vec> all;
    for (std::size_t k = 0; k < to.size(); ++k)
      all.push_back(body.from[k] + at.fraction * body.moves[k]);
    return all;
  }
};

// A body in a motion; times are parts of it, from 0 to 1.
struct Moving {
  const Body* body = nullptr;
  Segment segment;
  bool moves = false;
  bool is_known = true;
  Passage passage;
};

// A pair of bodies, from motion to motion.
struct PairState {
  Front front;
  bool is_proven_here = false;  // where both are now
};

// What is asked of two bodies in a motion.
struct Question {
  const std::string& a;
  const std::string& b;
  std::int64_t tick;
  double margin;
  Excuse excuse;
};

class HapticChecker {
 public:
  HapticChecker(const HapticRecording& recording, const CheckOptions& options)
      : recording_(recording), options_(options), obstacles_(recording.obstacles.size()) {
    for (std::size_t k = 0; k < obstacles_.size(); ++k) {
      const Obstacle& obstacle = recording.obstacles[k];
      Moving& moving = obstacles_[k];
      if (!obstacle.deforms) {
        moving.body = obstacle.shape.get();
        moving.segment = at_rest(obstacle.X_WO);
        continue;
      }
      surface_of_.push_back(k);
      Surface& surface = surfaces_.emplace_back();
      take_mesh(surface, obstacle.vertices, obstacle.corners);
      moving.segment = at_rest({});
    }
    for (std::size_t k = 0; k < surfaces_.size(); ++k)
      obstacles_[surface_of_[k]].body = &surfaces_[k].body;
    parts_.resize(recording.parts.size());
    for (std::size_t k = 0; k < parts_.size(); ++k) parts_[k].body = recording.parts[k].shape.get();
  }

  HapticVerdict run() {
    for (std::size_t k = 0; k < recording_.waypoint_count(); ++k) {
      const Waypoint next = recording_.waypoint(k);
      follows_ = !next.is_start || (k > 0 && recording_.is_whole(last_.tick, next.tick));
      if (next.is_start) start(next);
      for (std::size_t i = 0; i < surfaces_.size(); ++i) move_surface(i, next);
      move_parts(next);
      check_motion(next.tick);
      last_ = next;
    }
    return std::move(verdict_);
  }

 private:
  void start(const Waypoint& next) {
    ++verdict_.placed;
    last_ = next;
    for (auto& [key, pair] : pairs_) pair.is_proven_here = false;
  }

  static void take_mesh(Surface& surface, std::vector<Vec> vertices,
                        std::vector<std::int32_t> corners) {
    surface.to = std::move(vertices);
    surface.body = {};
    surface.body.pieces.resize(corners.size() / 3);
    for (std::size_t k = 0; k < corners.size(); ++k)
      surface.body.pieces[k / 3].points.push_back(surface.to[std::size_t(corners[k])]);
    surface.body.build({});
    surface.body.corners = std::move(corners);
    surface.body.deform(surface.to, surface.to);
  }

  // From where it is to where the waypoint says. A snapshot sets out from where the surface is.
  void move_surface(std::size_t number, const Waypoint& next) {
    Surface& surface = surfaces_[number];
    const Waypoint::Progress to = next.progress[number];
    const bool is_next = to.snapshot == surface.at.snapshot + 1;
    if (to.snapshot != surface.at.snapshot && !is_next && follows_)
      throw BadFile("a snapshot is left out");
    if (to.snapshot != surface.at.snapshot) {
      if (follows_ &&
          !recording_.sets_out_at(surface.at.fraction, surface_of_[number], to.snapshot))
        throw BadFile("a snapshot sets out elsewhere than the inputs say");
      // After missing ticks it is known where it set out if it had arrived.
      set_out(number, to.snapshot, follows_ || (is_next && surface.at.fraction >= 1));
    } else if (follows_ && to.fraction < surface.at.fraction) {
      throw BadFile("a surface goes back");
    }
    if (next.is_start) {
      if (follows_ && to.fraction != surface.at.fraction)
        throw BadFile("a surface is elsewhere without a motion");
      surface.at.fraction = to.fraction;
    }
    Moving& moving = obstacles_[surface_of_[number]];
    moving.segment.part_first = surface.at.fraction;
    moving.segment.part_rate = to.fraction - surface.at.fraction;
    moving.moves = to.fraction != surface.at.fraction;
    moving.is_known = surface.is_known || moving.segment.part_first >= 1;
    surface.at = to;
    moving.passage = passage(surface.body, moving.segment, 0, 1);
  }

  void set_out(std::size_t number, std::int64_t snapshot, bool follows) {
    Surface& surface = surfaces_[number];
    const std::size_t obstacle = surface_of_[number];
    std::optional<Snapshot> next = recording_.snapshot(obstacle, snapshot);
    if (!next) throw BadFile("a snapshot is missing");
    if (!next->corners.empty()) {
      take_mesh(surface, std::move(next->vertices), std::move(next->corners));
      surface.at = {snapshot, 1};
      surface.is_known = true;
      ++verdict_.replaced;
      for (std::size_t part = 0; part < parts_.size(); ++part) pairs_[{part, obstacle}] = {};
      return;
    }
    std::vector<Vec> from = surface.places();
    if (next->vertices.size() != from.size())
      throw BadFile("a snapshot has another number of vertices");
    surface.is_known = follows && (surface.is_known || surface.at.fraction >= 1);
    surface.to = std::move(next->vertices);
    surface.body.deform(std::move(from), surface.to);
    surface.at = {snapshot, 0};
  }

  void move_parts(const Waypoint& next) {
    for (std::size_t k = 0; k < parts_.size(); ++k) {
      const ToolPart& part = recording_.parts[k];
      Moving& moving = parts_[k];
      moving.segment = motion_of(part, last_.tools[part.tool], next.tools[part.tool]);
      moving.is_known = moving.segment.is_known();
      moving.moves = !moving.is_known || !moving.segment.rests();
      if (moving.is_known) moving.passage = passage(*moving.body, moving.segment, 0, 1);
    }
    for (Moving& obstacle : obstacles_) {
      if (!obstacle.passage.body)
        obstacle.passage = passage(*obstacle.body, obstacle.segment, 0, 1);
    }
  }

  // The tool's origin moves on a line, and the tool and its hinges turn at constant rates.
  static Segment motion_of(const ToolPart& part, const Waypoint::Tool& from,
                           const Waypoint::Tool& to) {
    const Pose& X = from.X_WT;
    const Vec turn =
        X.R.m == to.X_WT.R.m ? Vec{} : X.R * rotation_vector(transpose(X.R) * to.X_WT.R);
    if (!(norm(turn) <= kLargestTurn)) return {};  // it may have been the other way round
    const Vec way = to.X_WT.p - X.p;
    const bool rests = norm(way) == 0 && norm(turn) == 0;
    Segment frame = rests ? at_rest(X) : twist(X.R, X.p, way, turn, 0);
    if (!part.hinge) return frame;
    const double angle = from.angles[*part.hinge];
    const double change = to.angles[*part.hinge] - angle;
    const Mat R = part.X_TJ.R * rotation({0, 0, angle});
    if (rests && change == 0) return at_rest(X * Pose{R, part.X_TJ.p});
    Segment hinge = twist(R, part.X_TJ.p, {}, R * Vec{0, 0, change}, 0);
    hinge.outer = std::make_shared<Segment>(std::move(frame));
    return hinge;
  }

  void check_motion(std::int64_t tick) {
    ++verdict_.motions;
    for (std::size_t b = 0; b < parts_.size(); ++b) {
      const ToolPart& part = recording_.parts[b];
      const Excuse excuse = recording_.excuse(tick, part.tool);
      for (std::size_t k = 0; k < obstacles_.size(); ++k) {
        const Obstacle& obstacle = recording_.obstacles[k];
        if (!obstacle.is_hard) continue;
        check(obstacles_[k], parts_[b], {obstacle.name, part.name, tick, obstacle.margin, excuse},
              pairs_[{b, k}]);
      }
      for (std::size_t a = 0; a < b; ++a) {
        const ToolPart& other = recording_.parts[a];
        if (other.tool == part.tool) continue;
        check(parts_[a], parts_[b],
              {other.name, part.name, tick, recording_.tool_margin,
               std::max(excuse, recording_.excuse(tick, other.tool))},
              pairs_[{b, obstacles_.size() + a}]);
      }
    }
  }

  void check(const Moving& a, const Moving& b, const Question& question, PairState& pair) {
    if (!a.moves && !b.moves && pair.is_proven_here) return;
    const double margin = options_.scale * question.margin;
    pair.is_proven_here = false;
    HapticFinding finding{question.a, question.b, question.tick, 0, margin};
    if (!a.is_known || !b.is_known) return verdict_.undecided.add(finding);
    PairProver prover(a.passage, b.passage, margin, most_node_pairs_);
    Answer answer = prove(prover, pair);
    if (answer == Answer::Proven) {
      ++verdict_.proven;
      pair.is_proven_here = true;
      return;
    }
    finding.distance = prover.refuted_distance();
    if (question.excuse != Excuse::None) {
      PairProver apart(a.passage, b.passage, 0, most_node_pairs_);
      answer = prove(apart, pair);
      if (answer == Answer::Proven) {
        ++verdict_.leaving;
        return;
      }
      if (question.excuse == Excuse::Crossing) {
        ++verdict_.crossing;
        return;
      }
      finding.distance = apart.refuted_distance();
      finding.margin = 0;
    }
    if (answer == Answer::Refuted) return verdict_.refuted.add(finding);
    // The run is not proven then: the rest is worth less work.
    most_node_pairs_ = std::min(most_node_pairs_, kMuchWork);
    verdict_.undecided.add(finding);
  }

  Answer prove(PairProver& prover, PairState& pair) {
    const Answer answer = pair.front.prove(prover);
    verdict_.node_pairs += prover.node_pairs();
    return answer;
  }

  const HapticRecording& recording_;
  CheckOptions options_;
  std::int64_t most_node_pairs_ = options_.most_node_pairs;
  HapticVerdict verdict_;
  std::vector<Surface> surfaces_;
  std::vector<std::size_t> surface_of_;  // by surface: its obstacle
  std::vector<Moving> obstacles_;
  std::vector<Moving> parts_;
  // By part, and by obstacle or, after all of these, other part.
  std::map<std::pair<std::size_t, std::size_t>, PairState> pairs_;
  Waypoint last_;
  bool follows_ = false;  // no tick is missing between the last waypoint and the next
};

}  // namespace

HapticVerdict check_haptic_run(const HapticRecording& recording, const CheckOptions& options) {
  return HapticChecker(recording, options).run();
}

}  // namespace dyop_check
