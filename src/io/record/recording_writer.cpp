// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <chrono>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "dyop/io/recording.h"
#include "io/json_reader.h"
#include "io/record/motion_rows.h"
#include "io/record/recording_rows.h"

namespace dyop {
namespace {

using io_internal::EncodedMotion;
using io_internal::Hdf5File;
using io_internal::Json;
using io_internal::MotionPart;
using io_internal::OutputRows;

using Clock = std::chrono::steady_clock;

// Between two flushes pass so many times what the last one took.
constexpr int kFlushRest = 20;

constexpr Scalar kUnknown = std::numeric_limits<Scalar>::quiet_NaN();

Json optional_json(const std::optional<Scalar>& value) {
  return value ? Json(*value) : Json(nullptr);
}

constexpr std::size_t kShownScene = 40;  // letters of it in a message

Json header_json(const RunHeader& header) {
  Json json;
  json["title"] = header.title;
  json["scene"] = nullptr;
  if (!header.scene.empty()) {
    json["scene"] = Json::parse(header.scene, nullptr, /*allow_exceptions=*/false);
    DYOP_REQUIRE(!json["scene"].is_discarded(), "RunHeader::scene is not JSON: '",
                 header.scene.substr(0, kShownScene), "'");
  }
  json["target_distance"] = optional_json(header.target_distance);
  json["rest_offset"] = optional_json(header.rest_offset);
  json["begin_time"] = header.begin_time;
  json["end_time"] = header.end_time;
  json["step"] = header.step;
  return json;
}

Json list_of(const Vector3& v) {
  return {v.x(), v.y(), v.z()};
}

Json list_of(const Matrix3& m) {
  Json list = Json::array();
  for (Eigen::Index i = 0; i < 9; ++i) list.push_back(m(i / 3, i % 3));
  return list;
}

Json frame_json(const RigidPose& X) {
  return {{"R", list_of(X.rotation())}, {"p", list_of(X.translation())}};
}

Json material_json(const std::optional<Material>& material) {
  if (!material) return nullptr;
  return {{"restitution", material->restitution},
          {"friction", material->friction},
          {"rolling_friction", material->rolling_friction},
          {"torsional_friction", material->torsional_friction}};
}

std::string_view word_of(CombineRule rule) {
  switch (rule) {
    case CombineRule::GeometricMean:
      return "geometric_mean";
    case CombineRule::Mean:
      return "mean";
    case CombineRule::Product:
      return "product";
    case CombineRule::Minimum:
      return "minimum";
    case CombineRule::Maximum:
      break;
  }
  return "maximum";
}

std::string_view word_of(JointKind kind) {
  switch (kind) {
    case JointKind::Ball:
      return "ball";
    case JointKind::Hinge:
      return "hinge";
    case JointKind::Slider:
      return "slider";
    case JointKind::Fixed:
      return "fixed";
    case JointKind::Universal:
      return "universal";
    case JointKind::Cylindrical:
      return "cylindrical";
    case JointKind::Coupling:
      return "coupling";
    case JointKind::Distance:
      break;
  }
  return "distance";
}

Json body_json(const BodyId& id, const BodyDefinition& definition, std::size_t shape, Scalar from) {
  const bool is_dynamic = definition.kind == BodyKind::Dynamic;
  const MassProperties& mass = definition.mass_properties;
  Json line{{"slot", id.slot},
            {"name", definition.name},
            {"kind", io_internal::name_of_kind(definition.kind)},
            {"shape", shape},
            {"is_sensor", definition.is_sensor},
            {"mass", is_dynamic ? mass.mass : 0},
            {"p_BoBcm", list_of(is_dynamic ? mass.p_BoBcm : Vector3(Vector3::Zero()))},
            {"from", from},
            {"bounding_radius", definition.shape->bounding_radius()},
            {"size", definition.shape->size()},
            {"restitution", definition.restitution},
            {"friction", definition.friction},
            {"rolling_friction", definition.rolling_friction},
            {"torsional_friction", definition.torsional_friction}};
  if (!is_dynamic) return line;
  line["inertia"] = list_of(mass.I_BBcm);
  line["locked_translation"] = definition.locked.translation;
  line["locked_rotation"] = definition.locked.rotation;
  line["has_wrench"] = bool(definition.wrench);
  return line;
}

// Strengths that are infinite become null.
Json joint_json(const JointId& id, const JointDefinition& joint) {
  Json line{{"number", id.number},
            {"kind", word_of(joint.kind)},
            {"a", joint.a.slot},
            {"b", joint.b.slot},
            {"X_AJ", frame_json(joint.X_AJ)},
            {"X_BJ", frame_json(joint.X_BJ)},
            {"bodies_collide", joint.bodies_collide},
            {"friction", joint.friction},
            {"damping", joint.damping},
            {"break_force", joint.break_force},
            {"break_torque", joint.break_torque}};
  if (joint.limits) line["limits"] = {joint.limits->min, joint.limits->max};
  if (const auto& motor = joint.motor) {
    line["motor"] = {motor->speed, motor->strength, optional_json(motor->position),
                     motor->stiffness, motor->damping};
  }
  if (const auto& range = joint.swing_twist)
    line["swing_twist"] = {range->swing, range->twist_min, range->twist_max};
  if (joint.kind == JointKind::Coupling) {
    line["first"] = joint.first.number;
    line["second"] = joint.second.number;
    line["ratio"] = joint.ratio;
  }
  return line;
}

// Everything between bodies that holds from a time on (docs/formats.md, "/rules").
Json rules_json(const World& world, Scalar from) {
  Json json{{"from", from},
            {"target_distance", optional_json(world.options().target_distance)},
            {"rest_offset", optional_json(world.options().rest_offset)},
            {"separation_speed", optional_json(world.options().separation_speed)},
            {"gravity", list_of(world.gravity())},
            {"combine_friction", word_of(world.options().combine_friction)},
            {"combine_restitution", word_of(world.options().combine_restitution)},
            {"pairs", Json::array()},
            {"joints", Json::array()},
            {"springs", Json::array()}};
  for (const World::PairRule& rule : world.pair_rules()) {
    json["pairs"].push_back({{"a", rule.a.slot},
                             {"b", rule.b.slot},
                             {"is_enabled", rule.is_enabled},
                             {"target_distance", optional_json(rule.target_distance)},
                             {"material", material_json(rule.material)}});
  }
  for (const JointId& id : world.joints())
    json["joints"].push_back(joint_json(id, world.joint(id)));
  for (const SpringId& id : world.springs()) {
    const SpringDefinition& spring = world.spring(id);
    json["springs"].push_back({{"number", id.number},
                               {"a", spring.a.slot},
                               {"b", spring.b.slot},
                               {"p_AP", list_of(spring.p_AP)},
                               {"p_BQ", list_of(spring.p_BQ)},
                               {"rest_length", optional_json(spring.rest_length)},
                               {"stiffness", spring.stiffness},
                               {"damping", spring.damping}});
  }
  return json;
}

}  // namespace

// All datasets, each with chunks of about 8 to 16 kB: small recordings stay small.
struct RecordingWriter::Output {
  template <typename Row>
  OutputRows<Row> table(const char* name, hsize_t chunk_rows) {
    return {file, name, io_internal::row_type<Row>().get(), 1, chunk_rows};
  }
  OutputRows<char> text(const char* name) { return {file, name, H5T_NATIVE_UINT8, 1, 4096}; }

  Hdf5File file;
  OutputRows<io_internal::FrameRow> frames = table<io_internal::FrameRow>("frames", 32);
  OutputRows<io_internal::StepRow> steps = table<io_internal::StepRow>("steps", 512);
  OutputRows<io_internal::SegmentRow> segments = table<io_internal::SegmentRow>("segments", 512);
  OutputRows<Scalar> numbers{file, "numbers", H5T_NATIVE_DOUBLE, 1, 2048};
  OutputRows<io_internal::ImpactRow> impacts = table<io_internal::ImpactRow>("impacts", 32);
  OutputRows<io_internal::ContactRow> contacts = table<io_internal::ContactRow>("contacts", 64);
  OutputRows<io_internal::PairRow> pairs = table<io_internal::PairRow>("pairs", 64);
  OutputRows<io_internal::PairContactRow> pair_contacts =
      table<io_internal::PairContactRow>("pair_contacts", 128);
  OutputRows<io_internal::EventRow> events = table<io_internal::EventRow>("events", 256);
  OutputRows<char> bodies = text("bodies");
  OutputRows<char> shapes = text("shapes");
  OutputRows<std::array<double, 3>> vertices{file, "vertices", H5T_NATIVE_DOUBLE, 3, 512};
  OutputRows<std::array<std::int32_t, 3>> triangles{file, "triangles", H5T_NATIVE_INT32, 3, 1024};
  OutputRows<char> given = text("given");
  OutputRows<io_internal::VelocityChangeRow> changes =
      table<io_internal::VelocityChangeRow>("velocity_changes", 128);
  OutputRows<io_internal::MomentumRow> momenta = table<io_internal::MomentumRow>("momenta", 256);
  OutputRows<io_internal::ContactImpulseRow> contact_impulses =
      table<io_internal::ContactImpulseRow>("contact_impulses", 128);
  OutputRows<io_internal::LinkImpulseRow> link_impulses =
      table<io_internal::LinkImpulseRow>("link_impulses", 64);
  OutputRows<io_internal::WrenchImpulseRow> wrench_impulses =
      table<io_internal::WrenchImpulseRow>("wrench_impulses", 64);
  OutputRows<char> rules = text("rules");
  OutputRows<char> end = text("end");

  explicit Output(const std::filesystem::path& path) : file(Hdf5File::create(path)) {}

  // The rows of /frames last: they count the others.
  void flush() {
    steps.flush();
    segments.flush();
    numbers.flush();
    impacts.flush();
    contacts.flush();
    pairs.flush();
    pair_contacts.flush();
    events.flush();
    bodies.flush();
    shapes.flush();
    vertices.flush();
    triangles.flush();
    given.flush();
    changes.flush();
    momenta.flush();
    contact_impulses.flush();
    link_impulses.flush();
    wrench_impulses.flush();
    rules.flush();
    frames.flush();
  }

  void put_lengths(io_internal::FrameRow& row) const {
    row.step_count = steps.length();
    row.segment_count = segments.length();
    row.number_count = numbers.length();
    row.impact_count = impacts.length();
    row.contact_count = contacts.length();
    row.pair_count = pairs.length();
    row.pair_contact_count = pair_contacts.length();
    row.event_count = events.length();
    row.body_bytes = bodies.length();
    row.shape_bytes = shapes.length();
    row.given_bytes = given.length();
    row.vertex_count = vertices.length();
    row.triangle_count = triangles.length();
    row.change_count = changes.length();
    row.momentum_count = momenta.length();
    row.contact_impulse_count = contact_impulses.length();
    row.link_impulse_count = link_impulses.length();
    row.wrench_impulse_count = wrench_impulses.length();
    row.rule_bytes = rules.length();
  }
};

struct RecordingWriter::Impl {
  // What may change while a body is there.
  struct Changeable {
    Material material;
    bool has_wrench = false;
    std::shared_ptr<const Shape> shape;
    MassProperties mass_properties;

    bool has_form_of(const Changeable& other) const {
      return shape == other.shape && mass_properties.mass == other.mass_properties.mass &&
             mass_properties.p_BoBcm == other.mass_properties.p_BoBcm &&
             mass_properties.I_BBcm == other.mass_properties.I_BBcm;
    }
  };
  // The last data written for a body.
  struct Body {
    std::optional<BodyId> id;
    Vector3 p_BoBcm = Vector3::Zero();
    std::shared_ptr<const Motion> motion;  // of the last segment
    EncodedMotion last;
    bool has_segment = false;
    std::vector<Scalar> chart;      // R_WC of the last cubic; empty if there was none
    std::uint64_t chart_place = 0;  // in /numbers
    std::size_t shape = 0;
    Changeable last_written;
  };

  Impl(const std::filesystem::path& path, const RunHeader& header,
       const RecordingOptions& the_options)
      : output(path), options(the_options) {
    output.file.write_attribute("format", std::string(io_internal::kRecordingFormat));
    output.file.write_attribute("version", io_internal::kRecordingVersion);
    output.file.write_attribute("header", header_json(header).dump());
    output.file.share_with_readers();
    time = header.begin_time;
    DYOP_REQUIRE(options.longest_delay >= 0, "longest_delay must be >= 0, not ",
                 options.longest_delay);
  }

  void put_body(const BodyId& id, const BodyDefinition& definition);
  std::size_t put_shape(const std::shared_ptr<const Shape>& shape);
  void put_step(const CommittedStep& step);
  void put_motion(std::uint32_t slot, const MotionPart& part);
  void put_segment(std::uint32_t slot, Scalar begin, EncodedMotion encoded);
  std::uint32_t put_cubic(Body& body, std::span<const Scalar> whole);
  void put_impact(const ImpactEvent& impact);
  void put_pairs(const std::vector<PairRecord>& records);
  void put_events(const AdvanceReport& report);
  void put_rules(const AdvanceReport& report, const World& world);
  void put_change(const VelocityChange& change);
  void put_frame(const AdvanceReport& report, io_internal::FrameRow row);
  void flush();
  void flush_if_due();
  void end(const std::string& error);

  Output output;
  RecordingOptions options;
  io_internal::ShapeWriter shapes;
  std::vector<Body> bodies;                         // by slot
  std::vector<bool> has_wrench;                     // by slot
  std::vector<io_internal::KnownMomentum> momenta;  // by slot
  std::optional<std::uint64_t> rules_version;       // of the last line of /rules
  Json last_joints = Json::array();                 // of that line
  std::set<std::pair<BodyId, BodyId>> pairs_at_rest;
  Scalar time = 0;  // committed
  AdvanceStatus status = AdvanceStatus::NotRun;
  Clock::time_point last_flush = Clock::now();
  Clock::duration rest{};  // that passes before the next flush
  bool has_ended = false;
};

// Returns its line.
std::size_t RecordingWriter::Impl::put_shape(const std::shared_ptr<const Shape>& shape) {
  io_internal::ShapeRows rows;
  std::string lines;
  const std::size_t line = shapes.add(shape, lines, rows);
  output.shapes.add_all(lines);
  output.vertices.add_all(rows.vertices);
  output.triangles.add_all(rows.triangles);
  return line;
}

// A body's line is written again when what it says changes. With another shape or other mass
// properties its motions begin anew, too: they are about its centre of mass.
void RecordingWriter::Impl::put_body(const BodyId& id, const BodyDefinition& definition) {
  if (id.slot >= bodies.size()) bodies.resize(id.slot + 1);
  Body& body = bodies[id.slot];
  const bool is_new = body.id != id;
  Changeable now{{definition.restitution, definition.friction, definition.rolling_friction,
                  definition.torsional_friction},
                 bool(definition.wrench),
                 definition.shape,
                 definition.mass_properties};
  const bool has_same_form = !is_new && body.last_written.has_form_of(now);
  const Changeable& last = body.last_written;
  if (has_same_form && last.material == now.material && last.has_wrench == now.has_wrench) return;
  if (!has_same_form) {
    const std::size_t shape = put_shape(definition.shape);
    body = Body{};
    body.id = id;
    body.shape = shape;
    if (definition.kind == BodyKind::Dynamic) body.p_BoBcm = definition.mass_properties.p_BoBcm;
  }
  if (is_new && id.slot < momenta.size()) momenta[id.slot] = {};
  has_wrench.resize(std::max(has_wrench.size(), std::size_t(id.slot) + 1));
  has_wrench[id.slot] = now.has_wrench;
  body.last_written = std::move(now);
  Json line = body_json(id, definition, body.shape, time);
  line["is_new"] = is_new;
  output.bodies.add_all(line.dump() + '\n');
}

// Returns the kind of its row.
std::uint32_t RecordingWriter::Impl::put_cubic(Body& body, std::span<const Scalar> whole) {
  const bool follows_cubic = body.has_segment && body.last.kind == SegmentKind::Hermite;
  const io_internal::HermiteForm& form = io_internal::shortest_form(
      follows_cubic ? std::span<const Scalar>(body.last.numbers) : std::span<const Scalar>(),
      body.chart, whole);
  if (form.has_own_chart) {
    body.chart.assign(whole.begin(), whole.begin() + io_internal::kChartNumbers);
    body.chart_place = output.numbers.length();
  }
  output.numbers.add_all(io_internal::stored_numbers(form, body.chart_place, whole));
  return form.kind;
}

void RecordingWriter::Impl::put_segment(std::uint32_t slot, Scalar begin, EncodedMotion encoded) {
  Body& body = bodies[slot];
  const bool is_same = body.has_segment && body.last.kind == encoded.kind &&
                       (encoded.kind == SegmentKind::Rest || encoded.kind == SegmentKind::Absent) &&
                       body.last.numbers == encoded.numbers;
  if (is_same) return;
  io_internal::SegmentRow row{begin, output.numbers.length(), slot,
                              static_cast<std::uint32_t>(encoded.kind)};
  if (encoded.kind == SegmentKind::Given) {
    output.numbers.add(static_cast<Scalar>(output.given.length()));
    output.numbers.add(static_cast<Scalar>(encoded.given.size()));
    output.given.add_all(encoded.given);
  } else if (encoded.kind == SegmentKind::Hermite) {
    row.kind = put_cubic(body, encoded.numbers);
  } else {
    output.numbers.add_all(encoded.numbers);
  }
  output.segments.add(row);
  body.last = std::move(encoded);
  body.has_segment = true;
}

void RecordingWriter::Impl::put_motion(std::uint32_t slot, const MotionPart& part) {
  Body& body = bodies[slot];
  if (body.has_segment && body.motion == part.motion &&
      body.last.kind != SegmentKind::Approximate) {
    return;
  }
  EncodedMotion encoded = io_internal::encode(part, body.p_BoBcm);
  put_segment(slot, part.interval.begin, std::move(encoded));
  body.motion = part.motion;
}

void RecordingWriter::Impl::put_step(const CommittedStep& step) {
  output.steps.add({step.interval.begin, step.interval.end});
  for (std::uint32_t slot = 0; slot < bodies.size(); ++slot) {
    if (slot >= step.motions.size() || step.motions[slot] == nullptr) {
      bodies[slot].motion.reset();
      put_segment(slot, step.interval.begin, {});
      continue;
    }
    for (const MotionPart& part : io_internal::parts_of(step.motions[slot], step.interval)) {
      put_motion(slot, part);
    }
  }
}

void RecordingWriter::Impl::put_impact(const ImpactEvent& impact) {
  io_internal::ImpactRow row = io_internal::impact_row(impact);
  row.first_contact = output.contacts.length();
  row.contact_count = impact.contacts.size();
  output.impacts.add(row);
  for (const WorldContact& contact : impact.contacts) {
    output.contacts.add(io_internal::contact_row(contact));
  }
}

void RecordingWriter::Impl::put_pairs(const std::vector<PairRecord>& records) {
  std::set<std::pair<BodyId, BodyId>> at_rest;
  for (const PairRecord& record : records) {
    const std::pair<BodyId, BodyId> key{record.a, record.b};
    if (record.proof == ProofKind::AtRest) {
      at_rest.insert(at_rest.end(), key);
      if (pairs_at_rest.contains(key)) continue;
    }
    io_internal::PairRow row = io_internal::pair_row(record);
    row.frame = static_cast<std::uint32_t>(output.frames.length());
    row.first_contact = output.pair_contacts.length();
    if (options.pairs == PairDetail::Contacts) {
      row.contact_count = record.contacts.size();
      for (const PairContact& contact : record.contacts) {
        output.pair_contacts.add(io_internal::pair_contact_row(contact, record.pivot_W));
      }
    }
    output.pairs.add(row);
  }
  pairs_at_rest = std::move(at_rest);
}

void RecordingWriter::Impl::put_events(const AdvanceReport& report) {
  const auto put = [&](RunEventKind kind, Scalar t, const BodyId& a, const BodyId& b) {
    output.events.add(io_internal::event_row({kind, t, a, b}));
  };
  for (const auto& [a, b] : report.too_near) put(RunEventKind::TooNear, time, a, b);
  for (const auto& [a, b] : report.crossed) put(RunEventKind::Crossed, report.t, a, b);
  for (const BodyId& id : report.woke) put(RunEventKind::Woke, report.t, id, {});
  for (const BodyId& id : report.fell_asleep) put(RunEventKind::FellAsleep, report.t, id, {});
  for (const SensorEvent& event : report.sensors) {
    put(event.is_overlap ? RunEventKind::SensorBegins : RunEventKind::SensorEnds, event.t,
        event.sensor, event.body);
  }
  for (const BodyId& id : report.placed) put(RunEventKind::Placed, time, id, {});
  for (const auto& [a, b] : report.parted) put(RunEventKind::Parted, report.t, a, b);
  if (report.work.stalls > 0) put(RunEventKind::Stalled, report.t, {}, {});
  if (io_internal::is_undecided(report.status)) {
    put(RunEventKind::Undecided, report.t, report.offending_pair.first,
        report.offending_pair.second);
  }
}

void RecordingWriter::Impl::put_rules(const AdvanceReport& report, const World& world) {
  if (rules_version == world.rules_version()) return;
  rules_version = world.rules_version();
  Json rules = rules_json(world, time);
  const Json joints = std::exchange(last_joints, rules["joints"]);
  // A joint that broke held until then.
  const auto number_of = [](const Json& joint) { return joint["number"].get<std::uint64_t>(); };
  std::map<std::uint64_t, Scalar> broken;
  for (const BrokenJoint& joint : report.broken_joints) broken[joint.joint.number] = joint.t;
  std::set<Scalar> changes{time};
  for (const auto& [number, t] : broken) changes.insert(t);
  for (const Scalar from : changes) {
    rules["from"] = from;
    rules["joints"] = last_joints;
    for (const Json& joint : joints) {
      const auto found = broken.find(number_of(joint));
      if (found != broken.end() && found->second > from) rules["joints"].push_back(joint);
    }
    output.rules.add_all(rules.dump() + '\n');
  }
}

void RecordingWriter::Impl::put_change(const VelocityChange& change) {
  const io_internal::VelocityChangeRows rows = io_internal::rows_of(change, momenta, has_wrench);
  output.changes.add({change.interval.begin, change.interval.end,
                      static_cast<std::uint32_t>(change.kind),
                      static_cast<std::uint32_t>(rows.momenta.size()),
                      static_cast<std::uint32_t>(rows.contacts.size()),
                      static_cast<std::uint32_t>(rows.links.size()),
                      static_cast<std::uint32_t>(rows.wrenches.size()), 0, output.momenta.length(),
                      output.contact_impulses.length(), output.link_impulses.length(),
                      output.wrench_impulses.length()});
  output.momenta.add_all(rows.momenta);
  output.contact_impulses.add_all(rows.contacts);
  output.link_impulses.add_all(rows.links);
  output.wrench_impulses.add_all(rows.wrenches);
}

void RecordingWriter::Impl::flush() {
  const Clock::time_point begin = Clock::now();
  output.flush();
  last_flush = Clock::now();
  rest = kFlushRest * (last_flush - begin);
}

void RecordingWriter::Impl::flush_if_due() {
  const std::chrono::duration<Scalar> waited = Clock::now() - last_flush;
  if (waited >= rest || waited.count() >= options.longest_delay) flush();
}

// A frame is in the file, and whole, once its row is.
void RecordingWriter::Impl::put_frame(const AdvanceReport& report, io_internal::FrameRow row) {
  for (const CommittedStep& step : report.steps) put_step(step);
  for (const ImpactEvent& impact : report.impacts) put_impact(impact);
  for (const VelocityChange& change : report.velocity_changes) put_change(change);
  put_events(report);
  io_internal::put_report(report, row);
  row.begin = time;
  output.put_lengths(row);
  output.frames.add(row);
  time = report.t;
  status = report.status;
  flush_if_due();
}

void RecordingWriter::Impl::end(const std::string& error) {
  flush();
  const Json json{{"status", static_cast<std::uint32_t>(status)}, {"error", error}};
  output.end.add_all(json.dump());
  output.end.flush();
  output.file.close();
  has_ended = true;
}

RecordingWriter::RecordingWriter(const std::filesystem::path& file, const RunHeader& header,
                                 const RecordingOptions& options)
    : impl_(std::make_unique<Impl>(file, header, options)) {}

RecordingWriter::~RecordingWriter() {
  if (!impl_ || impl_->has_ended) return;
  try {
    impl_->flush();
  } catch (
      const std::exception&) {  // the disk is full, say: the file is whole up to the last flush
  }
}

RecordingWriter::RecordingWriter(RecordingWriter&&) noexcept = default;
RecordingWriter& RecordingWriter::operator=(RecordingWriter&&) noexcept = default;

void RecordingWriter::write(const AdvanceReport& report, const World& world) {
  for (const BodyId& id : world.bodies()) impl_->put_body(id, world.body(id));
  impl_->put_rules(report, world);
  if (impl_->options.pairs != PairDetail::None) impl_->put_pairs(world.pairs());
  io_internal::FrameRow row{};
  row.kinetic_energy = world.kinetic_energy();
  row.momentum = io_internal::row_of(world.momentum());
  row.angular_momentum = io_internal::row_of(world.angular_momentum());
  impl_->put_frame(report, row);
}

void RecordingWriter::write(const AdvanceReport& report, std::span<const BodyDefinition> bodies) {
  for (std::size_t k = 0; k < bodies.size(); ++k) impl_->put_body(BodyId(k), bodies[k]);
  io_internal::FrameRow row{};
  row.kinetic_energy = kUnknown;
  row.momentum = {kUnknown, kUnknown, kUnknown};
  row.angular_momentum = {kUnknown, kUnknown, kUnknown};
  impl_->put_frame(report, row);
}

void RecordingWriter::finish() {
  impl_->end("");
}

void RecordingWriter::fail(const std::string& error) {
  impl_->end(error);
}

}  // namespace dyop
