// SPDX-License-Identifier: BSD-3-Clause
#include "check/trusted/recording.h"

#include "check/trusted/segments.h"
#include "check/trusted/shape_reader.h"

namespace dyop_check {
namespace {

constexpr std::int64_t kVersion = 3;
constexpr double kDefaultTarget = 1e-4;  // literal: of the smaller size of a pair
constexpr std::size_t kMostBodies = 10'000'000;

// Null is none.
std::optional<double> distance_at(const Json& json, const char* key) {
  if (json.at(key).kind == Json::Kind::Null) return std::nullopt;
  const double distance = json.at(key).to_number();
  if (distance < 0) throw BadFile("a target distance is negative");
  return distance;
}

Pair pair_of(const Json& json) {
  return ordered(index_of(json.at("a"), kMostBodies), index_of(json.at("b"), kMostBodies));
}

Rules rules_from(const Json& line) {
  Rules rules;
  rules.from = line.at("from").to_number();
  rules.target_distance = distance_at(line, "target_distance");
  for (const Json& rule : line.at("pairs").list) {
    if (!rule.at("is_enabled").to_boolean()) rules.untested.insert(pair_of(rule));
    if (const auto own = distance_at(rule, "target_distance"))
      rules.target_distances[pair_of(rule)] = *own;
  }
  for (const Json& joint : line.at("joints").list) {
    if (!joint.at("bodies_collide").to_boolean()) rules.untested.insert(pair_of(joint));
  }
  rules.line = line;
  return rules;
}

class Reader {
 public:
  explicit Reader(const Hdf5Reader& file) : file_(file) {}

  Recording read() {
    const Json header = parse_json(file_.text_attribute("header"));
    recording_.begin = header.at("begin_time").to_number();
    read_bodies();
    read_segments();
    end_replaced();
    read_steps();
    read_events();
    read_rules(header);
    recording_.is_complete = file_.length("end") > 0;
    return std::move(recording_);
  }

 private:
  void read_bodies() {
    const ShapeReader shapes(file_.json_lines("shapes", count_of(file_, "shape_bytes")),
                             file_.numbers("vertices", count_of(file_, "vertex_count"), 3),
                             file_.indices("triangles", count_of(file_, "triangle_count"), 3));
    for (const Json& line : file_.json_lines("bodies", count_of(file_, "body_bytes"))) {
      const std::size_t slot = index_of(line.at("slot"), kMostBodies);
      const bool is_new = line.at("is_new").to_boolean();
      auto& in_slot = recording_.in_slot[slot];
      if (in_slot.empty() && !is_new) throw BadFile("a body is missing");
      if (!is_new && has_only_other_material(recording_.bodies[in_slot.back()], line)) {
        recording_.bodies[in_slot.back()].lines.push_back({time_of(line), line});
        continue;
      }
      recording_.bodies.push_back(body_from(line, slot, shapes));
      if (!is_new) recording_.bodies.back().continues = in_slot.back();
      in_slot.push_back(std::uint32_t(recording_.bodies.size() - 1));
    }
  }

  static double time_of(const Json& line) { return line.at("from").to_number(); }

  static bool has_only_other_material(const RecordedBody& body, const Json& line) {
    const Json& last = body.lines.back().json;
    const auto is_same = [&](const char* key) {
      const Json* x = last.find(key);
      const Json* y = line.find(key);
      return (x == nullptr) == (y == nullptr) && (x == nullptr || *x == *y);
    };
    return is_same("kind") && is_same("is_sensor") && is_same("shape") && is_same("p_BoBcm") &&
           is_same("mass") && is_same("inertia") && is_same("bounding_radius") && is_same("size");
  }

  RecordedBody body_from(const Json& line, std::size_t slot, const ShapeReader& shapes) {
    RecordedBody body;
    body.slot = std::uint32_t(slot);
    body.from = time_of(line);
    body.name = line.at("name").text;
    const std::string& kind = line.at("kind").text;
    if (kind != "dynamic" && kind != "kinematic" && kind != "static")
      throw BadFile("the kind of body '" + kind + "' is unknown");
    body.is_dynamic = kind == "dynamic";
    body.is_sensor = line.at("is_sensor").to_boolean();
    body.center_of_mass = vector_of(line.at("p_BoBcm").to_numbers(3));
    body.bounding_radius = line.at("bounding_radius").to_number();
    if (body.bounding_radius < 0) throw BadFile("a bounding radius is negative");
    const Json* size = line.find("size");  // files of earlier versions: the bounding radius
    body.size = size == nullptr ? body.bounding_radius : size->to_number();
    if (body.size < 0) throw BadFile("a size is negative");
    body.lines.push_back({body.from, line});
    const std::size_t shape = index_of(line.at("shape"), shapes.count());
    const Vec& center = body.center_of_mass;
    auto& tree = built_[{shape, {center.x, center.y, center.z}}];
    if (!tree) {
      auto fresh = std::make_shared<Body>();
      fresh->pieces = shapes.pieces(shape);
      fresh->build(center);
      tree = fresh;
    }
    body.shape = tree;
    return body;
  }

  void read_segments() {
    const Table segments(file_, "segments", "segment_count");
    const std::vector<double> begin = segments.reals("begin");
    const auto first = segments.integers("first");
    const auto slot = segments.integers("body");
    const auto kind = segments.integers("kind");
    SegmentReader reader(file_.numbers("numbers", count_of(file_, "number_count")),
                         file_.bytes("given", count_of(file_, "given_bytes")),
                         recording_.bodies.size());
    std::vector<double> last(recording_.bodies.size(), -kInfinity);
    for (std::size_t k = 0; k < begin.size(); ++k) {
      constexpr std::uint64_t kAbsent = 0;
      if (kind[k] == kAbsent && !recording_.in_slot.contains(slot[k])) continue;
      const std::uint32_t number = recording_.body_at(slot[k], begin[k]);
      RecordedBody& body = recording_.bodies[number];
      if (!std::isfinite(begin[k]) || begin[k] < last[number])
        throw BadFile("the segments of a body are not in order of time");
      // What a prescribed motion would have done later than this row.
      while (!body.segments.empty() && body.segments.back().begin > begin[k])
        body.segments.pop_back();
      last[number] = begin[k];
      for (Segment& segment : reader.read(kind[k], first[k], number, begin[k], body.center_of_mass))
        body.segments.push_back(std::move(segment));
    }
  }

  // Where a slot has passed on, the body before is absent from then.
  void end_replaced() {
    for (const auto& [slot, bodies] : recording_.in_slot) {
      for (std::size_t k = 0; k + 1 < bodies.size(); ++k) {
        Segment absent;
        absent.begin = recording_.bodies[bodies[k + 1]].from;
        recording_.bodies[bodies[k]].segments.push_back(absent);
      }
    }
  }

  void read_steps() {
    const Table steps(file_, "steps", "step_count");
    const std::vector<double> begin = steps.reals("begin");
    const std::vector<double> end = steps.reals("end");
    if (begin.empty()) throw BadFile("nothing was committed");
    for (std::size_t k = 0; k < begin.size(); ++k) {
      if (!(begin[k] <= end[k]) || begin[k] != (k > 0 ? end[k - 1] : recording_.begin))
        throw BadFile("the steps leave a gap in time");
      recording_.steps.emplace_back(begin[k], end[k]);
    }
    recording_.end = end.back();
    if (!std::isfinite(recording_.end)) throw BadFile("the run has no end");
  }

  void read_events() {
    enum Kind : std::uint64_t { kTooNear = 2, kCrossed = 3, kParted = 8, kPlaced = 9 };
    const Table events(file_, "events", "event_count");
    const auto kind = events.integers("kind");
    const auto a = events.integers("a");
    const auto b = events.integers("b");
    const std::vector<double> t = events.reals("t");
    std::map<std::uint64_t, std::set<double>> afresh;  // by slot: put elsewhere, or another body
    for (const RecordedBody& body : recording_.bodies) {
      if (!body.continues) afresh[body.slot].insert(body.from);
    }
    for (std::size_t k = 0; k < kind.size(); ++k) {
      if (kind[k] != kPlaced) continue;
      RecordedBody& body = recording_.bodies[recording_.body_at(a[k], t[k])];
      body.placed.insert(t[k]);
      // Others move by next to nothing, where they get another motion, unless it is another shape.
      if (body.is_dynamic || body.from == t[k]) afresh[a[k]].insert(t[k]);
    }
    for (std::size_t k = 0; k < kind.size(); ++k) {
      if (kind[k] != kTooNear && kind[k] != kCrossed && kind[k] != kParted) continue;
      auto& spans = recording_.uncertified[ordered(a[k], b[k])];
      if (kind[k] == kParted) {
        if (!spans.empty()) spans.back().second = std::min(spans.back().second, t[k]);
        continue;
      }
      // What the caller puts elsewhere is looked at afresh.
      double until = kInfinity;
      for (const std::uint64_t slot : {a[k], b[k]}) {
        const auto next = afresh[slot].upper_bound(t[k]);
        if (next != afresh[slot].end()) until = std::min(until, *next);
      }
      spans.emplace_back(t[k], until);
    }
  }

  void read_rules(const Json& header) {
    for (const Json& line : file_.json_lines("rules", count_of(file_, "rule_bytes"))) {
      recording_.rules.push_back(rules_from(line));
      const std::size_t count = recording_.rules.size();
      if (count > 1 && recording_.rules[count - 1].from < recording_.rules[count - 2].from)
        throw BadFile("the rules are not in order of time");
    }
    if (!recording_.rules.empty()) return;
    Rules& rules = recording_.rules.emplace_back();
    rules.from = recording_.begin;
    rules.target_distance = distance_at(header, "target_distance");
  }

  const Hdf5Reader& file_;
  Recording recording_;
  // Shapes by line and centre of mass.
  std::map<std::pair<std::size_t, std::array<double, 3>>, std::shared_ptr<const Body>> built_;
};

}  // namespace

Pair ordered(std::uint64_t a, std::uint64_t b) {
  return {std::uint32_t(std::min(a, b)), std::uint32_t(std::max(a, b))};
}

const Segment* RecordedBody::segment(double t, bool before) const {
  auto next = std::upper_bound(segments.begin(), segments.end(), t,
                               [](double x, const Segment& g) { return x < g.begin; });
  if (next == segments.begin()) return nullptr;
  --next;
  if (before && next->begin == t && next != segments.begin()) --next;
  return next->is_known() ? &*next : nullptr;
}

std::uint32_t Recording::body_at(std::uint64_t slot, double t) const {
  const auto found = in_slot.find(slot);
  if (found == in_slot.end()) throw BadFile("a row is of no body");
  const std::vector<std::uint32_t>& all = found->second;
  std::size_t k = all.size() - 1;
  while (k > 0 && bodies[all[k]].from > t) --k;
  return all[k];
}

double Recording::target(std::uint32_t a, std::uint32_t b, const Rules& at) const {
  const auto own = at.target_distances.find(ordered(bodies[a].slot, bodies[b].slot));
  if (own != at.target_distances.end()) return own->second;
  if (at.target_distance) return *at.target_distance;
  return kDefaultTarget * std::min(bodies[a].size, bodies[b].size);
}

bool Recording::is_tested(std::uint32_t a, std::uint32_t b, const Rules& at) const {
  const RecordedBody& x = bodies[a];
  const RecordedBody& y = bodies[b];
  if (!x.is_dynamic && !y.is_dynamic) return false;
  if (x.is_sensor || y.is_sensor || x.slot == y.slot) return false;
  return !at.untested.contains(ordered(x.slot, y.slot));
}

bool Recording::is_uncertified(std::uint32_t a, std::uint32_t b, double t) const {
  const auto found = uncertified.find(ordered(bodies[a].slot, bodies[b].slot));
  if (found == uncertified.end()) return false;
  return std::any_of(found->second.begin(), found->second.end(),
                     [&](const auto& span) { return span.first <= t && t < span.second; });
}

std::uint64_t count_of(const Hdf5Reader& file, const char* column) {
  const std::uint64_t frames = file.length("frames");
  return frames == 0 ? 0 : file.integers("frames", column, frames).back();
}

Recording read_recording(const Hdf5Reader& file) {
  if (file.text_attribute("format") != "dyop recording") throw BadFile("not a recording of a run");
  const std::int64_t version = file.integer_attribute("version");
  if (version != kVersion) {
    throw BadFile("the recording has version " + std::to_string(version) + ", and version " +
                  std::to_string(kVersion) + " is checked");
  }
  return Reader(file).read();
}

}  // namespace dyop_check
