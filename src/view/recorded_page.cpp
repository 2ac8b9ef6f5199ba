// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/view/recorded_page.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/io/recording_reader.h"
#include "dyop/view/page_encoder.h"
#include "dyop/view/page_file.h"
#include "geometry/shape_forms.h"
#include "view/pair_rows.h"
#ifdef DYOP_HAS_TOOL_PAGE
#include "dyop/io/haptic_recording_reader.h"
#include "view/tool/tool_page.h"
#endif

namespace dyop {
namespace {

using PairName = std::pair<std::uint32_t, std::uint32_t>;

// Blocks are small enough to be shown one by one while a page loads; the first is smaller still.
constexpr std::size_t kSegmentsOfBlock = 20000;
constexpr std::size_t kSegmentsOfFirstBlock = 3000;

std::string words_of(const Shape& shape) {
  using geometry_internal::FormedShape;
  return geometry_internal::visit_shape(
      shape, geometry_internal::ShapeSink{
                 [](const TriangleMesh& mesh) {
                   return "mesh of " + std::to_string(mesh.triangles().size()) + " triangles";
                 },
                 [](const ConvexHull& hull) {
                   return "hull of " + std::to_string(hull.vertices().size()) + " points";
                 },
                 [](const CompoundShape& compound) {
                   return "compound of " + std::to_string(compound.children().size()) + " shapes";
                 },
                 [](const FormedShape& formed) { return std::string(formed.form->name); }});
}

// Contents of the scene file, if there is one.
Vector3 gravity_of(const RunHeader& header) {
  const auto scene = nlohmann::json::parse(header.scene, nullptr, false);
  const auto place = nlohmann::json::json_pointer("/forces/gravity");
  if (!scene.is_object() || !scene.contains(place)) return Vector3::Zero();
  const nlohmann::json& g = scene.at(place);
  if (!g.is_array() || g.size() != 3) return Vector3::Zero();
  for (const auto& x : g) {
    if (!x.is_number()) return Vector3::Zero();
  }
  return {g[0].get<Scalar>(), g[1].get<Scalar>(), g[2].get<Scalar>()};
}

PageScene scene_of(const RecordingReader& reader) {
  PageScene scene;
  scene.title = reader.header().title;
  scene.gravity_W = gravity_of(reader.header());
  scene.scene_file = reader.header().scene;
  scene.begin_time = reader.interval().begin;
  scene.end_time = std::max(reader.header().end_time, reader.interval().end);
  for (const RecordedBody& body : reader.bodies()) {
    PageBody& page_body = scene.bodies.emplace_back();
    page_body.name = body.name;
    page_body.kind = body.kind;
    page_body.shape = reader.shapes()[body.shape].shape;
    page_body.shape_name = words_of(*page_body.shape);
    if (body.kind == BodyKind::Dynamic) {
      page_body.mass_properties = MassProperties{body.mass, body.p_BoBcm, Matrix3::Zero()};
    }
  }
  return scene;
}

PageMark mark_of(const RunEvent& event, const PageScene& scene, AdvanceStatus status) {
  const auto name = [&](BodyId id) {
    return id.slot < scene.bodies.size() ? scene.bodies[id.slot].name : std::string("(no body)");
  };
  const std::string pair = name(event.a) + ", " + name(event.b);
  switch (event.kind) {
    case RunEventKind::FellAsleep:
      return {event.t, "asleep", "fell asleep: " + name(event.a), {event.a}};
    case RunEventKind::Woke:
      return {event.t, "woke", "woke: " + name(event.a), {event.a}};
    case RunEventKind::TooNear:
      return {event.t, "too_near", "nearer than their target: " + pair, {event.a, event.b}};
    case RunEventKind::Crossed:
      return {event.t, "crossed", "crossed: " + pair, {event.a, event.b}};
    case RunEventKind::SensorBegins:
      return {event.t, "sensor", "overlap begins: " + pair, {event.a, event.b}};
    case RunEventKind::SensorEnds:
      return {event.t, "sensor", "overlap ends: " + pair, {event.a, event.b}};
    case RunEventKind::Stalled:
      return {event.t, "stalled", "an island stood still", {}};
    case RunEventKind::Parted:
      return {event.t, "parted", "far enough apart again: " + pair, {event.a, event.b}};
    case RunEventKind::Placed:
      return {event.t, "placed", "put elsewhere: " + name(event.a), {event.a}};
    case RunEventKind::Undecided: {
      const char* words = view_internal::undecided_words(status);
      return {event.t,
              "undecided",
              std::string(words != nullptr ? words : "undecided") + ": " + pair,
              {event.a, event.b}};
    }
  }
  throw InternalError("unknown kind of event");
}

// Reads a recording frame by frame and divides it into blocks.
class RecordedPage {
 public:
  RecordedPage(RecordingReader& reader, const RecordedPageOptions& options)
      : reader_(reader), encoder_(scene_of(reader)), cursors_(reader.bodies().size()) {
    choose_pairs(options);
  }

  std::vector<std::string> blocks() {
    std::vector<std::string> blocks{encoder_.head()};
    std::size_t limit = kSegmentsOfFirstBlock;
    for (std::size_t k = 0; k < reader_.frames().size(); ++k) {
      add_frame(k);
      if (span_.segments.size() + span_.contacts.size() < limit) continue;
      blocks.push_back(encoder_.span(std::exchange(span_, {})));
      limit = kSegmentsOfBlock;
    }
    add_end();
    blocks.push_back(encoder_.span(span_));
    return blocks;
  }

 private:
  struct Cursor {
    std::size_t next = 0;
    std::shared_ptr<const Motion> motion;
  };

  // The pairs with the smallest proven gaps, and how often they are measured.
  void choose_pairs(const RecordedPageOptions& options) {
    std::map<PairName, Scalar> least;
    for (std::size_t k = 0; k < reader_.frames().size(); ++k) {
      for (const PairRecord& pair : reader_.pairs(k)) {
        const auto [entry, is_new] = least.try_emplace({pair.a.slot, pair.b.slot}, pair.gap_lower);
        if (!is_new) entry->second = std::min(entry->second, pair.gap_lower);
      }
    }
    std::vector<std::pair<Scalar, PairName>> order;
    for (const auto& [name, gap] : least) order.emplace_back(gap, name);
    std::sort(order.begin(), order.end());
    const auto count = std::min(order.size(), std::size_t(std::max(0, options.gap_pairs)));
    for (std::size_t k = 0; k < count; ++k) measured_[order[k].second] = {};
    const auto samples = std::size_t(std::max(1, options.gap_samples));
    frames_of_sample_ = (reader_.frames().size() + samples - 1) / samples;
  }

  void add_frame(std::size_t k) {
    const RecordedFrame& recorded = reader_.frames()[k];
    PageFrame frame;
    frame.interval = recorded.interval;
    frame.work = recorded.work;
    frame.kinetic_energy = recorded.kinetic_energy;
    frame.momentum_W = recorded.momentum;
    frame.angular_momentum_W = recorded.angular_momentum;
    for (std::size_t slot = 0; slot < cursors_.size(); ++slot) {
      add_segments(slot, recorded.interval.end);
      frame.potential_energy += potential_energy(slot, recorded.interval.end);
    }
    span_.frames.push_back(frame);
    const auto steps = reader_.steps();
    for (; next_step_ < steps.size() && steps[next_step_].end <= recorded.interval.end;
         ++next_step_) {
      span_.steps.push_back(steps[next_step_]);
    }
    const auto impacts = reader_.impacts();
    for (; next_impact_ < impacts.size() && impacts[next_impact_].t <= recorded.interval.end;
         ++next_impact_) {
      span_.impacts.push_back(impacts[next_impact_]);
      place(span_.impacts.back());
    }
    const auto events = reader_.events();
    for (; next_event_ < events.size() && events[next_event_].t <= recorded.interval.end;
         ++next_event_) {
      span_.marks.push_back(mark_of(events[next_event_], encoder_.scene(), recorded.status));
    }
    add_pairs(k, recorded.interval);
  }

  void place(ImpactEvent& event) {
    const std::vector<PageBody>& bodies = encoder_.scene().bodies;
    view_internal::place_impact(event, *bodies.at(event.a.slot).shape,
                                reader_.pose(event.a, event.t), *bodies.at(event.b.slot).shape,
                                reader_.pose(event.b, event.t));
  }

  // Those that begin before t.
  void add_segments(std::size_t slot, Scalar t) {
    Cursor& cursor = cursors_[slot];
    const BodyId id(slot);
    const std::size_t count = reader_.segment_count(id);
    for (; cursor.next < count; ++cursor.next) {
      MotionSegment segment = reader_.segment(id, cursor.next);
      if (segment.interval.begin >= t) break;
      cursor.motion = segment.motion;
      span_.segments.push_back({id, segment.interval, std::move(segment.motion)});
    }
  }

  Scalar potential_energy(std::size_t slot, Scalar t) const {
    const PageBody& body = encoder_.scene().bodies[slot];
    const auto& motion = cursors_[slot].motion;
    if (!body.mass_properties || motion == nullptr) return 0;
    const Vector3 p_WBcm = motion->pose(t) * body.mass_properties->p_BoBcm;
    return -body.mass_properties->mass * encoder_.scene().gravity_W.dot(p_WBcm);
  }

  void add_pairs(std::size_t k, const TimeInterval& frame) {
    const std::size_t first = span_.gaps.size();
    std::set<PairName> known;
    for (const PairRecord& pair : reader_.pairs(k)) {
      view_internal::add_pair(pair, frame, span_);
      known.insert({pair.a.slot, pair.b.slot});
    }
    if (k % frames_of_sample_ != 0 && k + 1 != reader_.frames().size()) return;
    for (auto& [name, cache] : measured_) {
      const auto a = name.first;
      const auto b = name.second;
      if (cursors_[a].motion == nullptr || cursors_[b].motion == nullptr) continue;
      if (!known.contains(name)) {
        PageGap gap;
        gap.t = frame.end;
        gap.a = BodyId(a);
        gap.b = BodyId(b);
        span_.gaps.push_back(gap);
      }
      const auto gap =
          std::find_if(span_.gaps.begin() + std::ptrdiff_t(first), span_.gaps.end(),
                       [&](const PageGap& one) { return one.a.slot == a && one.b.slot == b; });
      view_internal::add_witness(
          *gap, *encoder_.scene().bodies[a].shape, cursors_[a].motion->pose(frame.end),
          *encoder_.scene().bodies[b].shape, cursors_[b].motion->pose(frame.end), cache);
    }
  }

  void add_end() {
    if (!reader_.end()) {
      span_.marks.push_back({reader_.interval().end,
                             "end",
                             "the recording ends here: the run goes "
                             "on, or was killed",
                             {}});
    } else if (!reader_.end()->error.empty()) {
      span_.marks.push_back({reader_.interval().end, "undecided", reader_.end()->error, {}});
    }
  }

  RecordingReader& reader_;
  PageEncoder encoder_;
  std::vector<Cursor> cursors_;
  std::map<PairName, DistanceCache> measured_;
  std::size_t frames_of_sample_ = 1;
  std::size_t next_step_ = 0;
  std::size_t next_impact_ = 0;
  std::size_t next_event_ = 0;
  PageSpan span_;
};

}  // namespace

std::string recorded_page_html(const std::filesystem::path& recording,
                               const RecordedPageOptions& options) {
#ifdef DYOP_HAS_TOOL_PAGE
  if (is_haptic_recording(recording)) {
    const view_internal::ToolPage page = view_internal::make_tool_page(recording);
    return page_html(page.title, page.blocks);
  }
#endif
  RecordingReader reader(recording);
  const std::vector<std::string> blocks = RecordedPage(reader, options).blocks();
  const std::string& title = reader.header().title;
  return page_html(title.empty() ? recording.filename().string() : title, blocks);
}

}  // namespace dyop
