// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <utility>

#include "dyop/io/file_error.h"
#include "dyop/io/recording.h"
#include "io/json_reader.h"
#include "io/record/motion_rows.h"
#include "io/record/recording_input.h"
#include "io/record/recording_rows.h"

namespace dyop {

using io_internal::Input;
using io_internal::Json;
using io_internal::json_lines;
using io_internal::text_of;

struct RecordingReader::Impl {
  struct Segment {
    Scalar begin;
    std::uint64_t row;  // of /segments
  };
  // The segments of a body, with the motion of the one that was asked for last.
  struct Path {
    std::vector<Segment> segments;
    std::vector<std::pair<Scalar, Vector3>> centers;  // p_BoBcm from a time on
    std::optional<std::size_t> last;
    std::shared_ptr<const Motion> last_motion;
  };

  template <typename Function>
  auto guard(Function f) const {
    return io_internal::guard_content(file, f);
  }

  explicit Impl(std::filesystem::path path) : file(std::move(path)) { refresh(); }

  const Input& in() const {
    if (!input) throw FileError(file, "cannot be read any more");
    return *input;
  }

  bool refresh();
  void read_new(const io_internal::FrameRow& last);
  void read_shapes(const io_internal::FrameRow& last);
  void read_bodies(const io_internal::FrameRow& last);
  void read_gravity(const io_internal::FrameRow& last);
  void read_segments(const io_internal::FrameRow& last);
  void read_impacts(const io_internal::FrameRow& before);
  void read_end();
  TimeInterval interval() const;
  static Vector3 center_at(const Path& path, Scalar t);
  Path& path(BodyId body);
  std::size_t segment_at(BodyId body, Scalar t);
  std::vector<Scalar> numbers_at(std::uint64_t first, std::size_t count);
  io_internal::SegmentRow row(const Path& of_body, std::size_t index);
  std::vector<Scalar> cubic(const io_internal::HermiteForm& form, const io_internal::SegmentRow& at,
                            const Path& of_body, std::size_t index);
  io_internal::EncodedMotion encoded(const Path& of_body, std::size_t index);
  MotionSegment segment(BodyId body, std::size_t index);
  const Motion& motion(BodyId body, Scalar t);
  std::span<const io_internal::PairRow> pair_rows(std::size_t frame);
  std::vector<PairRecord> pairs(std::size_t frame);
  std::vector<NearPair> near_pairs(std::size_t frame);
  std::vector<VelocityChange> velocity_changes();

  std::filesystem::path file;
  std::optional<Input> input;
  io_internal::BlockCache<Scalar> numbers;
  io_internal::BlockCache<io_internal::SegmentRow> segment_rows;
  std::vector<io_internal::PairRow> pair_memory;  // of the frame that was asked for last
  RunHeader header;
  std::optional<Vector3> gravity;
  std::vector<RecordedShape> shapes;
  std::vector<std::shared_ptr<const Shape>> all_shapes;  // the same
  std::vector<RecordedBody> bodies;
  std::vector<Path> paths;
  std::vector<TimeInterval> steps;
  std::vector<RecordedFrame> frames;
  std::vector<io_internal::FrameRow> frame_rows;
  std::vector<ImpactEvent> impacts;
  std::vector<RunEvent> events;
  std::optional<RunEnd> end;
  io_internal::FrameRow known{};  // lengths of what was read
};

bool RecordingReader::Impl::refresh() {
  // An open file caches the lengths; a new one reads that of /frames first.
  input.reset();
  input.emplace(file);
  const std::uint64_t count = in().frames.length();
  return guard([&] {
    header = io_internal::header_from(Json::parse(in().file.text_attribute("header")));
    const bool had_end = end.has_value();
    const auto rows = in().frames.read(frames.size(), count - frames.size());
    for (const io_internal::FrameRow& row : rows) frames.push_back(io_internal::frame_from(row));
    frame_rows.insert(frame_rows.end(), rows.begin(), rows.end());
    if (!rows.empty()) read_new(rows.back());
    read_end();
    return !rows.empty() || end.has_value() != had_end;
  });
}

void RecordingReader::Impl::read_new(const io_internal::FrameRow& last) {
  read_shapes(last);
  read_bodies(last);
  read_gravity(last);
  read_segments(last);
  for (const io_internal::StepRow& row :
       in().steps.read(known.step_count, last.step_count - known.step_count)) {
    steps.push_back({row.begin, row.end});
  }
  for (const io_internal::EventRow& row :
       in().events.read(known.event_count, last.event_count - known.event_count)) {
    events.push_back(io_internal::event_from(row));
  }
  const io_internal::FrameRow before = known;
  known = last;
  read_impacts(before);
}

void RecordingReader::Impl::read_shapes(const io_internal::FrameRow& last) {
  if (last.shape_bytes == known.shape_bytes) return;
  // Vertex and triangle numbers of a line count from the first row of all.
  const io_internal::ShapeRows rows{in().vertices.read(0, last.vertex_count),
                                    in().triangles.read(0, last.triangle_count)};
  const std::string text =
      text_of(in().shapes.read(known.shape_bytes, last.shape_bytes - known.shape_bytes));
  for (const Json& line : json_lines(text)) {
    all_shapes.push_back(io_internal::shape_from(line, rows, all_shapes));
    shapes.push_back(
        {std::stoull(line.at("hash").get<std::string>(), nullptr, 16), all_shapes.back()});
  }
}

void RecordingReader::Impl::read_bodies(const io_internal::FrameRow& last) {
  const std::string text =
      text_of(in().bodies.read(known.body_bytes, last.body_bytes - known.body_bytes));
  for (const Json& line : json_lines(text)) {
    const auto slot = line.at("slot").get<std::uint32_t>();
    if (slot >= bodies.size()) bodies.resize(slot + 1);
    RecordedBody& body = bodies[slot];
    body.name = line.at("name").get<std::string>();
    body.kind = io_internal::kind_of_name(line.at("kind").get<std::string>());
    body.shape = line.at("shape").get<std::size_t>();
    DYOP_REQUIRE(body.shape < shapes.size(), "body ", slot, " has the shape ", body.shape,
                 ", which is missing");
    body.is_sensor = line.at("is_sensor").get<bool>();
    body.mass = line.at("mass").get<Scalar>();
    const auto center = line.at("p_BoBcm").get<std::array<Scalar, 3>>();
    body.p_BoBcm = Vector3(center[0], center[1], center[2]);
    paths.resize(bodies.size());
    paths[slot].centers.emplace_back(line.value("from", header.begin_time), body.p_BoBcm);
  }
}

// Of the first line of /rules.
void RecordingReader::Impl::read_gravity(const io_internal::FrameRow& last) {
  if (gravity || !in().rules || last.rule_bytes == 0) return;
  const std::vector<Json> lines = json_lines(text_of(in().rules->read(0, last.rule_bytes)));
  DYOP_REQUIRE(!lines.empty(), "the rules are missing");
  const auto g = lines.front().at("gravity").get<std::array<Scalar, 3>>();
  gravity = Vector3(g[0], g[1], g[2]);
}

void RecordingReader::Impl::read_segments(const io_internal::FrameRow& last) {
  constexpr std::uint64_t kRowsAtOnce = 1 << 16;
  for (std::uint64_t first = known.segment_count; first < last.segment_count;
       first += kRowsAtOnce) {
    const std::uint64_t count = std::min(kRowsAtOnce, last.segment_count - first);
    std::uint64_t number = first;
    for (const io_internal::SegmentRow& row : in().segments.read(first, count)) {
      DYOP_REQUIRE(row.body < paths.size(), "segment ", number, " is of body ", row.body,
                   ", which is missing");
      paths[row.body].segments.push_back({row.begin, number++});
    }
  }
}

void RecordingReader::Impl::read_impacts(const io_internal::FrameRow& before) {
  for (const io_internal::ImpactRow& row :
       in().impacts.read(before.impact_count, known.impact_count - before.impact_count)) {
    ImpactEvent impact =
        io_internal::impact_from(row, in().contacts.read(row.first_contact, row.contact_count));
    if (interval().contains(impact.toi.t_safe)) {
      impact.toi.X_WA = motion(impact.a, impact.toi.t_safe).pose(impact.toi.t_safe);
      impact.toi.X_WB = motion(impact.b, impact.toi.t_safe).pose(impact.toi.t_safe);
    }
    impacts.push_back(std::move(impact));
  }
}

void RecordingReader::Impl::read_end() {
  if (end || in().end.length() == 0) return;
  const Json json = Json::parse(text_of(in().end.read(0, in().end.length())));
  RunEnd result;
  result.status = frames.empty() ? AdvanceStatus::NotRun : frames.back().status;
  result.error = json.at("error").get<std::string>();
  end = std::move(result);
}

TimeInterval RecordingReader::Impl::interval() const {
  return {header.begin_time, frames.empty() ? header.begin_time : frames.back().interval.end};
}

Vector3 RecordingReader::Impl::center_at(const Path& path, Scalar t) {
  if (path.centers.empty()) return Vector3::Zero();  // of a slot that was empty all along
  std::size_t k = path.centers.size() - 1;
  while (k > 0 && path.centers[k].first > t) --k;
  return path.centers[k].second;
}

RecordingReader::Impl::Path& RecordingReader::Impl::path(BodyId body) {
  DYOP_REQUIRE(body.slot < paths.size(), "the recording has ", paths.size(),
               " bodies, there is no ", body);
  return paths[body.slot];
}

std::size_t RecordingReader::Impl::segment_at(BodyId body, Scalar t) {
  const Path& of_body = path(body);
  DYOP_REQUIRE(
      interval().contains(t) && !of_body.segments.empty() && of_body.segments.front().begin <= t,
      "body ", body, " has no motion at the time ", t, ": the recording goes from ",
      interval().begin, " to ", interval().end);
  const auto after =
      std::upper_bound(of_body.segments.begin(), of_body.segments.end(), t,
                       [](Scalar x, const Segment& segment) { return x < segment.begin; });
  return std::size_t(after - of_body.segments.begin()) - 1;
}

std::vector<Scalar> RecordingReader::Impl::numbers_at(std::uint64_t first, std::size_t count) {
  return numbers.read(in().numbers, first, count, known.number_count);
}

io_internal::SegmentRow RecordingReader::Impl::row(const Path& of_body, std::size_t index) {
  return segment_rows.at(in().segments, of_body.segments[index].row, known.segment_count);
}

// A cubic made whole from what the rows before it hold.
std::vector<Scalar> RecordingReader::Impl::cubic(const io_internal::HermiteForm& form,
                                                 const io_internal::SegmentRow& at,
                                                 const Path& of_body, std::size_t index) {
  const std::vector<Scalar> stored = numbers_at(at.first, form.count());
  std::uint64_t chart_place = at.first;
  if (!form.has_own_chart) {
    const bool is_place = stored[0] >= 0 && stored[0] < static_cast<Scalar>(at.first);
    DYOP_REQUIRE(is_place, "the chart of a cubic is said to be in the place ", stored[0]);
    chart_place = static_cast<std::uint64_t>(stored[0]);
  }
  std::vector<Scalar> end_of_before;
  if (form.continues()) {
    DYOP_REQUIRE(index > 0, "a cubic continues nothing");
    const io_internal::SegmentRow before = row(of_body, index - 1);
    const io_internal::HermiteForm* form_before = io_internal::hermite_form(before.kind);
    DYOP_REQUIRE(form_before != nullptr, "a cubic continues a segment of kind ", before.kind);
    end_of_before = numbers_at(before.first + form_before->count() - io_internal::kNodeNumbers,
                               io_internal::kNodeNumbers);
  }
  return io_internal::whole_numbers(form, numbers_at(chart_place, io_internal::kChartNumbers),
                                    end_of_before, stored);
}

io_internal::EncodedMotion RecordingReader::Impl::encoded(const Path& of_body, std::size_t index) {
  const io_internal::SegmentRow at = row(of_body, index);
  io_internal::EncodedMotion result;
  if (const io_internal::HermiteForm* form = io_internal::hermite_form(at.kind)) {
    result.kind = SegmentKind::Hermite;
    result.numbers = cubic(*form, at, of_body, index);
    return result;
  }
  DYOP_REQUIRE(at.kind <= static_cast<std::uint32_t>(SegmentKind::Approximate),
               "unknown kind of segment ", at.kind);
  result.kind = static_cast<SegmentKind>(at.kind);
  const std::vector<Scalar> stored = numbers_at(at.first, io_internal::number_count(result.kind));
  if (result.kind == SegmentKind::Given) {
    result.given = text_of(in().given.read(std::uint64_t(stored[0]), std::uint64_t(stored[1])));
  } else {
    result.numbers = stored;
  }
  return result;
}

MotionSegment RecordingReader::Impl::segment(BodyId body, std::size_t index) {
  const Path& of_body = path(body);
  DYOP_REQUIRE(index < of_body.segments.size(), "body ", body, " has ", of_body.segments.size(),
               " segments, there is no ", index);
  const bool is_last = index + 1 == of_body.segments.size();
  MotionSegment result;
  result.interval = {of_body.segments[index].begin,
                     is_last ? interval().end : of_body.segments[index + 1].begin};
  io_internal::EncodedMotion motion_numbers = encoded(of_body, index);
  result.kind = motion_numbers.kind;
  result.motion = io_internal::decode(motion_numbers, center_at(of_body, result.interval.begin));
  result.numbers = std::move(motion_numbers.numbers);
  result.given = std::move(motion_numbers.given);
  return result;
}

const Motion& RecordingReader::Impl::motion(BodyId body, Scalar t) {
  const std::size_t index = segment_at(body, t);
  Path& of_body = path(body);
  if (of_body.last != index) {
    of_body.last_motion = io_internal::decode(encoded(of_body, index),
                                              center_at(of_body, of_body.segments[index].begin));
    of_body.last = index;
  }
  DYOP_REQUIRE(of_body.last_motion != nullptr, "body ", body, " is absent at the time ", t);
  return *of_body.last_motion;
}

// Until the next call.
std::span<const io_internal::PairRow> RecordingReader::Impl::pair_rows(std::size_t frame) {
  DYOP_REQUIRE(frame < frames.size(), "the recording has ", frames.size(), " frames, there is no ",
               frame);
  const std::uint64_t first = frame == 0 ? 0 : frame_rows[frame - 1].pair_count;
  in().pairs.read(first, frame_rows[frame].pair_count - first, pair_memory);
  return pair_memory;
}

std::vector<PairRecord> RecordingReader::Impl::pairs(std::size_t frame) {
  const std::span<const io_internal::PairRow> rows = pair_rows(frame);
  std::vector<PairRecord> records;
  records.reserve(rows.size());
  for (const io_internal::PairRow& row : rows) {
    in().pair_contacts.require(row.first_contact, row.contact_count);
  }
  // Contacts stand one after another, pair by pair: one read serves many pairs.
  std::vector<io_internal::PairContactRow> held;
  std::uint64_t held_from = 0;
  std::uint64_t held_until = 0;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const std::uint64_t first = rows[k].first_contact;
    if (first < held_from || first > held_until || rows[k].contact_count > held_until - first) {
      held_from = held_until = first;
      for (std::size_t j = k; j < rows.size() && rows[j].first_contact == held_until; ++j) {
        held_until += rows[j].contact_count;
      }
      held = in().pair_contacts.read(held_from, held_until - held_from);
    }
    records.push_back(io_internal::pair_from(
        rows[k], std::span(held).subspan(first - held_from, rows[k].contact_count)));
  }
  return records;
}

std::vector<NearPair> RecordingReader::Impl::near_pairs(std::size_t frame) {
  const std::span<const io_internal::PairRow> rows = pair_rows(frame);
  std::vector<NearPair> found;
  found.reserve(rows.size());
  for (const io_internal::PairRow& row : rows) {
    const PairRecord record = io_internal::pair_from(row, {});
    found.push_back(
        {record.a, record.b, record.gap_lower, static_cast<std::int64_t>(row.contact_count)});
  }
  return found;
}

std::vector<VelocityChange> RecordingReader::Impl::velocity_changes() {
  const Input& from = in();
  std::vector<VelocityChange> changes;
  if (!from.changes) return changes;
  std::vector<io_internal::KnownMomentum> momenta;
  for (const io_internal::VelocityChangeRow& row : from.changes->read(0, known.change_count)) {
    changes.push_back(
        io_internal::change_from(row,
                                 {from.momenta->read(row.first_momentum, row.momentum_count),
                                  from.contact_impulses->read(row.first_contact, row.contact_count),
                                  from.link_impulses->read(row.first_link, row.link_count),
                                  from.wrench_impulses->read(row.first_wrench, row.wrench_count)},
                                 momenta));
  }
  return changes;
}

RecordingReader::RecordingReader(const std::filesystem::path& file)
    : impl_(std::make_unique<Impl>(file)) {}

const std::filesystem::path& RecordingReader::file() const {
  return impl_->file;
}

RecordingReader::~RecordingReader() = default;
RecordingReader::RecordingReader(RecordingReader&&) noexcept = default;
RecordingReader& RecordingReader::operator=(RecordingReader&&) noexcept = default;

bool RecordingReader::refresh() {
  return impl_->refresh();
}

Vector3 RecordingReader::gravity() const {
  return impl_->gravity.value_or(Vector3::Zero());
}

const RunHeader& RecordingReader::header() const {
  return impl_->header;
}

std::span<const RecordedShape> RecordingReader::shapes() const {
  return impl_->shapes;
}

std::span<const RecordedBody> RecordingReader::bodies() const {
  return impl_->bodies;
}

TimeInterval RecordingReader::interval() const {
  return impl_->interval();
}

const std::optional<RunEnd>& RecordingReader::end() const {
  return impl_->end;
}

std::span<const TimeInterval> RecordingReader::steps() const {
  return impl_->steps;
}

std::span<const RecordedFrame> RecordingReader::frames() const {
  return impl_->frames;
}

std::span<const ImpactEvent> RecordingReader::impacts() const {
  return impl_->impacts;
}

std::span<const RunEvent> RecordingReader::events() const {
  return impl_->events;
}

std::vector<PairRecord> RecordingReader::pairs(std::size_t frame) const {
  return impl_->pairs(frame);
}

std::vector<NearPair> RecordingReader::near_pairs(std::size_t frame) const {
  return impl_->near_pairs(frame);
}

std::vector<VelocityChange> RecordingReader::velocity_changes() const {
  return impl_->guard([this] { return impl_->velocity_changes(); });
}

std::size_t RecordingReader::segment_count(BodyId body) const {
  return impl_->path(body).segments.size();
}

MotionSegment RecordingReader::segment(BodyId body, std::size_t index) const {
  return impl_->segment(body, index);
}

std::size_t RecordingReader::segment_at(BodyId body, Scalar t) const {
  return impl_->segment_at(body, t);
}

RigidPose RecordingReader::pose(BodyId body, Scalar t) const {
  return impl_->motion(body, t).pose(t);
}

MotionState RecordingReader::state(BodyId body, Scalar t) const {
  return impl_->motion(body, t).state(t);
}

std::string_view name_of(BodyKind kind) {
  switch (kind) {
    case BodyKind::Dynamic:
      return "dynamic";
    case BodyKind::Kinematic:
      return "kinematic";
    case BodyKind::Static:
      return "static";
  }
  return "dynamic";
}

std::string_view name_of(SegmentKind kind) {
  switch (kind) {
    case SegmentKind::Absent:
      return "absent";
    case SegmentKind::Rest:
      return "rest";
    case SegmentKind::Twist:
      return "twist";
    case SegmentKind::Hermite:
      return "hermite";
    case SegmentKind::Given:
      return "given";
    case SegmentKind::Approximate:
      return "approximate";
  }
  return "absent";
}

std::string_view name_of(RunEventKind kind) {
  switch (kind) {
    case RunEventKind::FellAsleep:
      return "fell_asleep";
    case RunEventKind::Woke:
      return "woke";
    case RunEventKind::TooNear:
      return "too_near";
    case RunEventKind::Crossed:
      return "crossed";
    case RunEventKind::SensorBegins:
      return "sensor_begins";
    case RunEventKind::SensorEnds:
      return "sensor_ends";
    case RunEventKind::Stalled:
      return "stalled";
    case RunEventKind::Undecided:
      return "undecided";
    case RunEventKind::Parted:
      return "parted";
    case RunEventKind::Placed:
      return "placed";
  }
  return "undecided";
}

}  // namespace dyop
