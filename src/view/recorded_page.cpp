// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <deque>
#include <future>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <thread>
#include <unordered_map>
#include <utility>

#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/io/recording.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/view/page_encoder.h"
#include "dyop/view/run_files.h"
#include "geometry/shape_forms.h"
#include "view/motion_rows.h"
#ifdef DYOP_HAS_TOOL_PAGE
#include "dyop/io/haptic_recording.h"
#include "view/tool/tool_page.h"
#endif

namespace dyop {
namespace {

using PairName = std::pair<std::uint32_t, std::uint32_t>;

struct PairHash {
  std::size_t operator()(const PairName& pair) const {
    constexpr std::uint64_t kOdd = 0x9e3779b97f4a7c15;  // spreads the slots over all bits
    return std::size_t((std::uint64_t{pair.first} << 32 | pair.second) * kOdd >> 16);
  }
};

// Without an order: a large run has millions of rows of pairs.
template <typename Value>
using PairMap = std::unordered_map<PairName, Value, PairHash>;

// Blocks are small enough to be shown one by one while a page loads; the first is smaller still.
constexpr std::size_t kSegmentsOfBlock = 20000;
constexpr std::size_t kSegmentsOfFirstBlock = 3000;
constexpr double kOrdinary = 0.9;  // part of the impulses that are no larger than an ordinary one
constexpr std::size_t kOutlines = 32;  // times at which a large run is known before it is read

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

// Recordings before version 3 have it in the scene file, if there is one.
Vector3 gravity_of(const RecordingReader& reader) {
  if (!reader.gravity().isZero(0)) return reader.gravity();
  const RunHeader& header = reader.header();
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

PageScene scene_of(const RecordingReader& reader, const std::filesystem::path& file,
                   const RecordedPageOptions& options) {
  PageScene scene;
  scene.title = reader.header().title;
  scene.source = file.filename().string();
  scene.verdict = options.verdict;
  scene.gravity_W = gravity_of(reader);
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

// Blocks in order, each encoded in a thread of its own, a few at a time.
class BlockQueue {
 public:
  template <typename Encode>
  void add(Encode encode) {
    waiting_.push_back(std::async(std::launch::async, std::move(encode)));
    const auto threads = std::max<std::size_t>(1, std::thread::hardware_concurrency());
    if (waiting_.size() > threads) finish_first();
  }

  std::vector<std::string> take() {
    while (!waiting_.empty()) finish_first();
    return std::move(done_);
  }

 private:
  // Frees what the block was made of, too.
  void finish_first() {
    done_.push_back(waiting_.front().get());
    waiting_.pop_front();
  }

  std::deque<std::future<std::string>> waiting_;
  std::vector<std::string> done_;
};

// Poses of all bodies at a few times, and between them motions of constant twist.
class Outlines {
 public:
  using Poses = std::vector<std::optional<RigidPose>>;

  void add(Scalar t, Poses poses) {
    if (!times_.empty() && !(t > times_.back())) return;
    times_.push_back(t);
    poses_.push_back(std::move(poses));
  }

  PageSpan span() const {
    PageSpan span;
    for (std::size_t k = 0; k + 1 < times_.size(); ++k) {
      for (std::size_t slot = 0; slot < poses_[k].size(); ++slot) {
        span.segments.push_back({BodyId(slot), {times_[k], times_[k + 1]}, between(k, slot)});
      }
    }
    return span;
  }

 private:
  std::shared_ptr<const Motion> between(std::size_t k, std::size_t slot) const {
    const std::optional<RigidPose>& from = poses_[k][slot];
    const std::optional<RigidPose>& to = poses_[k + 1][slot];
    if (!from) return nullptr;
    if (!to) return std::make_shared<RestMotion>(*from);
    const Scalar dt = times_[k + 1] - times_[k];
    const Twist twist{(to->translation() - from->translation()) / dt,
                      rotation_vector(to->rotation() * from->rotation().transpose()) / dt};
    return std::make_shared<ConstantTwistMotion>(*from, twist, times_[k]);
  }

  std::vector<Scalar> times_;
  std::vector<Poses> poses_;
};

// Finds pairs that come into contact without an impact of their own.
class TouchFinder {
 public:
  explicit TouchFinder(Scalar begin) : begin_(begin) {}

  void add_impact(const ImpactEvent& event) { hits_[{event.a.slot, event.b.slot}] = event.t; }

  // The pair is in contact over a frame that does not begin before those added so far.
  void add_contact(const PairRecord& pair, const TimeInterval& frame, PageSpan& span) {
    const bool is_start = !(frame.begin > begin_);
    const PairName name{pair.a.slot, pair.b.slot};
    const auto [entry, is_first] = last_.try_emplace(name);
    const Scalar shortly = kTouchFrames * frame.length();
    const bool is_apart =
        is_first || (frame.begin - entry->second.end > shortly && !entry->second.is_resting);
    const auto hit = hits_.find(name);
    const bool has_hit = hit != hits_.end() && hit->second > frame.begin - shortly;
    entry->second = {frame.end, pair.proof == ProofKind::AtRest};
    if (is_apart && !has_hit && !is_start) span.touches.push_back({frame.end, pair.a, pair.b});
  }

 private:
  static constexpr int kTouchFrames = 10;  // without contact, after which a pair touches anew

  Scalar begin_;  // of the run; pairs in contact from then on do not touch anew
  struct Last {
    Scalar end = 0;
    bool is_resting = false;
  };
  PairMap<Scalar> hits_;
  PairMap<Last> last_;
};

// Of all gaps that are added, the pairs with the smallest, and where each is.
class NearestPairs {
 public:
  struct Entry {
    Scalar gap = 0;
    PairName name;
    std::size_t frame = 0;
  };

  explicit NearestPairs(std::size_t count) : count_(count) {}

  // Most gaps of a large run are not even looked up.
  void add(Scalar gap, const PairName& name, std::size_t frame) {
    if (count_ == 0) return;
    const auto key = [](const Entry& entry) { return std::pair(entry.gap, entry.name); };
    const bool is_full = entries_.size() == count_;
    if (is_full && !(std::pair(gap, name) < key(entries_.back()))) return;
    const auto known = std::ranges::find(entries_, name, &Entry::name);
    if (known != entries_.end()) {
      if (!(gap < known->gap)) return;
      entries_.erase(known);
    } else if (is_full) {
      entries_.pop_back();
    }
    const auto place = std::ranges::lower_bound(entries_, std::pair(gap, name), {}, key);
    entries_.insert(place, {gap, name, frame});
  }

  const std::vector<Entry>& entries() const { return entries_; }

 private:
  std::size_t count_;
  std::vector<Entry> entries_;  // in order
};

// What a frame says of the pairs that were near.
struct NearPairs {
  TimeInterval frame;
  std::vector<PairRecord> pairs;
};

// The last record of a pair whose bodies both rest, and its frame.
using RestingPair = std::pair<PairRecord, TimeInterval>;

// Only the nearest pair of a frame is drawn.
void drop_places(std::vector<PageGap>& gaps, std::size_t first) {
  const auto is_drawn = [](const PageGap& gap) { return gap.witness_W || gap.pivot_W; };
  const PageGap* nearest = nullptr;
  for (std::size_t k = first; k < gaps.size(); ++k) {
    if (is_drawn(gaps[k]) && !(nearest != nullptr && nearest->upper <= gaps[k].upper)) {
      nearest = &gaps[k];
    }
  }
  for (std::size_t k = first; k < gaps.size(); ++k) {
    if (&gaps[k] == nearest || gaps[k].is_resting) continue;
    gaps[k].witness_W.reset();
    gaps[k].pivot_W.reset();
  }
}

// What a chunk holds; its rows of pairs are made where it is encoded, in another thread.
struct ChunkRows {
  TimeInterval time;
  std::vector<PageSegment> segments;
  std::vector<RestingPair> resting;         // at its begin
  std::shared_ptr<const NearPairs> before;  // of the frame that ends there; null: none
  std::vector<std::shared_ptr<const NearPairs>> frames;
  std::size_t contact_count = 0;

  std::size_t rows() const { return segments.size() + contact_count; }

  PageSpan span() const {
    PageSpan span;
    span.segments = segments;
    span.frames.resize(frames.size());
    std::size_t gaps = resting.size() + (before != nullptr ? before->pairs.size() : 0);
    for (const auto& near : frames) gaps += near->pairs.size();
    span.gaps.reserve(gaps);
    span.contacts.reserve(contact_count);
    for (const auto& [pair, frame] : resting) view_internal::add_pair(pair, frame, span);
    if (before != nullptr) add(*before, span, true);
    for (const auto& near : frames) add(*near, span, false);
    return span;
  }

 private:
  static void add(const NearPairs& near, PageSpan& span, bool is_before) {
    const std::size_t first = span.gaps.size();
    for (const PairRecord& pair : near.pairs) {
      if (is_before && pair.proof == ProofKind::AtRest) continue;  // among those at rest
      view_internal::add_pair(pair, near.frame, span);
    }
    drop_places(span.gaps, first);
  }
};

// Reads a recording frame by frame and divides it into blocks. Of a large run, motions, gaps and
// contacts go into chunks that the page reads one by one.
class RecordedPage {
 public:
  RecordedPage(RecordingReader& reader, const std::filesystem::path& file,
               const RecordedPageOptions& options)
      : reader_(reader),
        encoder_(scene_of(reader, file, options)),
        touches_(reader.interval().begin),
        nearest_(std::size_t(std::max(0, options.gap_pairs))),
        cursors_(reader.bodies().size()) {
    for (std::size_t slot = 0; slot < cursors_.size(); ++slot) {
      rows_ += reader_.segment_count(BodyId(slot));
    }
    DYOP_REQUIRE(options.rows_of_chunk >= 1, "rows_of_chunk must be positive, not ",
                 options.rows_of_chunk);
    rows_of_chunk_ = std::size_t(options.rows_of_chunk);
    const auto samples = std::size_t(std::max(1, options.gap_samples));
    frames_of_sample_ = (reader_.frames().size() + samples - 1) / samples;
    const auto most_rows = std::size_t(std::max<std::int64_t>(0, options.most_rows));
    // Pairs of a large run are many, and read once.
    is_large_ = rows_ > most_rows;
    if (is_large_) return;
    read_pairs();
    is_large_ = rows_ > most_rows;
    for (const NearestPairs::Entry& pair : nearest_.entries()) measured_[pair.name] = {};
  }

  std::vector<std::string> blocks() { return is_large_ ? blocks_of_large() : blocks_of_ordinary(); }

 private:
  // A frame at whose end gaps are measured, and all Cursor::next there.
  struct Sample {
    std::size_t frame = 0;
    std::vector<std::size_t> next;
  };

  struct Cursor {
    std::size_t next = 0;
    TimeInterval interval;
    std::shared_ptr<const Motion> motion;
  };

  std::vector<std::string> blocks_of_ordinary() {
    BlockQueue blocks;
    blocks.add([this] { return encoder_.head(); });
    const auto emit = [&] {
      blocks.add([this, span = std::exchange(span_, {})] { return encoder_.span(span); });
    };
    std::size_t limit = kSegmentsOfFirstBlock;
    for (std::size_t k = 0; k < reader_.frames().size(); ++k) {
      add_frame(k);
      add_pairs(k, reader_.frames()[k].interval);
      if (span_.segments.size() + span_.contacts.size() < limit) continue;
      emit();
      limit = kSegmentsOfBlock;
    }
    add_end();
    emit();
    return blocks.take();
  }

  // After the head come outlines, then chunks, and last all else.
  std::vector<std::string> blocks_of_large() {
    BlockQueue blocks;
    const std::size_t count = reader_.frames().size();
    const std::size_t every = (count + kOutlines - 1) / kOutlines;
    PageSpan whole;
    ChunkRows chunk;
    chunk.time.begin = reader_.interval().begin;
    for (std::size_t k = 0; k < count; ++k) {
      const TimeInterval frame = reader_.frames()[k].interval;
      add_frame(k);
      if (k == 0) outlines_.add(frame.begin, first_poses());
      if (k % every == 0 || k + 1 == count) outlines_.add(frame.end, poses_at(frame.end));
      move_segments(chunk);
      note_pairs(chunk, k);
      append(whole, std::exchange(span_, {}));
      if (chunk.rows() < rows_of_chunk_ && k + 1 < count) continue;
      chunk.time.end = frame.end;
      ChunkRows next = rows_after(chunk);
      blocks.add([this, rows = std::exchange(chunk, std::move(next))] {
        return encoder_.chunk(rows.time, rows.span());
      });
    }
    add_end();
    append(whole, std::exchange(span_, {}));
    measure_nearest(whole);
    std::vector<std::string> result{encoder_.head(), encoder_.span(outlines_.span())};
    for (std::string& block : blocks.take()) result.push_back(std::move(block));
    if (!impulses_.empty()) {
      const auto place = impulses_.begin() + std::ptrdiff_t(kOrdinary * double(impulses_.size()));
      std::nth_element(impulses_.begin(), place, impulses_.end());
      whole.ordinary_impulse = Scalar(*place);
    }
    result.push_back(encoder_.span(whole));
    return result;
  }

  void move_segments(ChunkRows& chunk) {
    for (PageSegment& segment : span_.segments) chunk.segments.push_back(std::move(segment));
    span_.segments.clear();
  }

  // Reads the pairs of a frame into a chunk, and finds what the page says of all of the run.
  void note_pairs(ChunkRows& chunk, std::size_t k) {
    const TimeInterval frame = reader_.frames()[k].interval;
    auto near = std::make_shared<const NearPairs>(NearPairs{frame, reader_.pairs(k)});
    for (const PairRecord& pair : near->pairs) {
      const PairName name{pair.a.slot, pair.b.slot};
      nearest_.add(pair.gap_lower, name, k);
      if (pair.proof == ProofKind::AtRest) {
        resting_.insert_or_assign(name, std::pair(pair, frame));
      } else if (!resting_.empty()) {
        resting_.erase(name);
      }
      if (pair.contacts.empty()) continue;
      chunk.contact_count += pair.contacts.size();
      touches_.add_contact(pair, frame, span_);
      for (const PairContact& contact : pair.contacts) {
        const Scalar size = contact.impulse_W.norm();
        if (size > 0) impulses_.push_back(float(size));
      }
    }
    chunk.frames.push_back(std::move(near));
    if (k % frames_of_sample_ != 0 && k + 1 != reader_.frames().size()) return;
    Sample& sample = samples_.emplace_back(Sample{k, {}});
    for (const Cursor& cursor : cursors_) sample.next.push_back(cursor.next);
  }

  // A chunk begins with where bodies are, what rests, and the gaps and contacts of the frame before.
  ChunkRows rows_after(const ChunkRows& chunk) const {
    ChunkRows next;
    next.time.begin = chunk.time.end;
    for (std::size_t slot = 0; slot < cursors_.size(); ++slot) {
      const Cursor& cursor = cursors_[slot];
      if (cursor.next == 0) continue;
      next.segments.push_back({BodyId(slot), cursor.interval, cursor.motion});
    }
    for (const auto& [name, pair] : resting_) {
      next.resting.push_back(pair);
      next.contact_count += pair.first.contacts.size();
    }
    next.before = chunk.frames.back();
    for (const PairRecord& pair : next.before->pairs) {
      if (pair.proof != ProofKind::AtRest) next.contact_count += pair.contacts.size();
    }
    return next;
  }

  // The pairs that come nearest, at the sampled frames and where each is nearest: the page draws
  // their curves, and what was measured here is shown in place of what a chunk knows.
  void measure_nearest(PageSpan& whole) {
    for (const NearestPairs::Entry& nearest : nearest_.entries()) {
      DistanceCache cache;
      const BodyId a(nearest.name.first);
      const BodyId b(nearest.name.second);
      for (const auto& [frame, next] : samples_) {
        if (next[a.slot] == 0 || next[b.slot] == 0) continue;
        const auto at_a = reader_.segment(a, next[a.slot] - 1).motion;
        const auto at_b = reader_.segment(b, next[b.slot] - 1).motion;
        if (at_a == nullptr || at_b == nullptr) continue;
        const Scalar t = reader_.frames()[frame].interval.end;
        measure(whole, t, a, at_a->pose(t), b, at_b->pose(t), cache);
      }
      if (std::ranges::count(samples_, nearest.frame, &Sample::frame) > 0) continue;
      const Scalar t = reader_.frames()[nearest.frame].interval.end;
      measure(whole, t, a, reader_.pose(a, t), b, reader_.pose(b, t), cache);
    }
    std::ranges::stable_sort(whole.gaps, {}, &PageGap::t);
  }

  void measure(PageSpan& span, Scalar t, BodyId a, const RigidPose& X_WA, BodyId b,
               const RigidPose& X_WB, DistanceCache& cache) const {
    PageGap& gap = span.gaps.emplace_back();
    gap.t = t;
    gap.a = a;
    gap.b = b;
    view_internal::add_witness(gap, *encoder_.scene().bodies[a.slot].shape, X_WA,
                               *encoder_.scene().bodies[b.slot].shape, X_WB, cache);
  }

  Outlines::Poses first_poses() const {
    Outlines::Poses poses(cursors_.size());
    for (std::size_t slot = 0; slot < cursors_.size(); ++slot) {
      if (reader_.segment_count(BodyId(slot)) == 0) continue;
      const MotionSegment first = reader_.segment(BodyId(slot), 0);
      if (first.motion) poses[slot] = first.motion->pose(first.interval.begin);
    }
    return poses;
  }

  Outlines::Poses poses_at(Scalar t) const {
    Outlines::Poses poses(cursors_.size());
    for (std::size_t slot = 0; slot < cursors_.size(); ++slot) {
      const Cursor& cursor = cursors_[slot];
      if (cursor.motion) poses[slot] = cursor.motion->pose(std::min(t, cursor.interval.end));
    }
    return poses;
  }

  // Finds the nearest pairs, and counts contacts as rows.
  void read_pairs() {
    for (std::size_t k = 0; k < reader_.frames().size(); ++k) {
      for (const NearPair& pair : reader_.near_pairs(k)) {
        rows_ += std::size_t(pair.contacts);
        nearest_.add(pair.gap_lower, {pair.a.slot, pair.b.slot}, k);
      }
    }
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
      if (is_large_) touches_.add_impact(span_.impacts.back());
    }
    const auto events = reader_.events();
    for (; next_event_ < events.size() && events[next_event_].t <= recorded.interval.end;
         ++next_event_) {
      span_.marks.push_back(mark_of(events[next_event_], encoder_.scene(), recorded.status));
    }
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
      cursor.interval = segment.interval;
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
    for (const PairRecord& pair : reader_.pairs(k)) {
      view_internal::add_pair(pair, frame, span_);
    }
    if (k % frames_of_sample_ != 0 && k + 1 != reader_.frames().size()) return;
    for (auto& [name, cache] : measured_) {
      const auto a = name.first;
      const auto b = name.second;
      if (cursors_[a].motion == nullptr || cursors_[b].motion == nullptr) continue;
      auto gap =
          std::find_if(span_.gaps.begin() + std::ptrdiff_t(first), span_.gaps.end(),
                       [&](const PageGap& one) { return one.a.slot == a && one.b.slot == b; });
      if (gap == span_.gaps.end()) {
        gap = span_.gaps.insert(gap, PageGap{});
        gap->t = frame.end;
        gap->a = BodyId(a);
        gap->b = BodyId(b);
      }
      view_internal::add_witness(
          *gap, *encoder_.scene().bodies[a].shape, cursors_[a].motion->pose(frame.end),
          *encoder_.scene().bodies[b].shape, cursors_[b].motion->pose(frame.end), cache);
    }
  }

  void add_end() {
    if (!reader_.end()) {
      span_.marks.push_back({reader_.interval().end,
                             "end",
                             "the recording ends here: the run goes on, or was killed",
                             {}});
      return;
    }
    const Scalar t = reader_.interval().end;
    const std::string& error = reader_.end()->error;
    if (!error.empty()) span_.marks.push_back({t, "undecided", error, {}});
    const char* words =
        view_internal::ending_words(reader_.end()->status, t, reader_.header().end_time);
    span_.marks.push_back({t, "end", error.empty() ? words : error, {}});
  }

  RecordingReader& reader_;
  PageEncoder encoder_;
  std::size_t rows_ = 0;  // segments and contacts of the whole run
  std::size_t rows_of_chunk_ = 0;
  bool is_large_ = false;
  Outlines outlines_;
  TouchFinder touches_;
  std::map<PairName, RestingPair> resting_;
  std::vector<float> impulses_;  // of all contacts
  NearestPairs nearest_;
  std::vector<Sample> samples_;
  std::vector<Cursor> cursors_;
  std::map<PairName, DistanceCache> measured_;  // of an ordinary run
  std::size_t frames_of_sample_ = 1;
  std::size_t next_step_ = 0;
  std::size_t next_impact_ = 0;
  std::size_t next_event_ = 0;
  PageSpan span_;
};

}  // namespace

std::string compared_page_html(const std::filesystem::path& first,
                               const std::filesystem::path& second,
                               const RecordedPageOptions& options) {
  std::vector<std::string> blocks;
  std::string title;
  for (const std::filesystem::path& file : {first, second}) {
#ifdef DYOP_HAS_TOOL_PAGE
    DYOP_REQUIRE(!is_haptic_recording(file), "two runs are shown side by side if both are of a ",
                 "World, and ", file.string(), " is that of a tool");
#endif
    RecordingReader reader(file);
    for (std::string& block : RecordedPage(reader, file, options).blocks()) {
      blocks.push_back(std::move(block));
    }
    if (title.empty()) title = reader.header().title;
  }
  return page_html(title.empty() ? first.filename().string() : title, blocks);
}

std::string recorded_page_html(const std::filesystem::path& recording,
                               const RecordedPageOptions& options) {
#ifdef DYOP_HAS_TOOL_PAGE
  if (is_haptic_recording(recording)) {
    const view_internal::ToolPage page = view_internal::make_tool_page(recording, options.verdict);
    return page_html(page.title, page.blocks);
  }
#endif
  RecordingReader reader(recording);
  const std::vector<std::string> blocks = RecordedPage(reader, recording, options).blocks();
  const std::string& title = reader.header().title;
  return page_html(title.empty() ? recording.filename().string() : title, blocks);
}

}  // namespace dyop
