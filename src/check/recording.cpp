// SPDX-License-Identifier: BSD-3-Clause
#include "check/recording.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <sstream>

#include "check/hdf5_table.h"
#include "check/json.h"
#include "check/segments.h"

namespace dyop_check {
namespace {

constexpr double kDefaultTarget = 1e-4;  // literal: of the smaller bounding radius of a pair

std::vector<Json> lines_of(const std::string& text) {
  std::vector<Json> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    if (!line.empty()) lines.push_back(parse_json(line));
  }
  return lines;
}

std::size_t index_of(const Json& json, std::size_t limit) {
  const double value = json.to_number();
  if (!(value >= 0 && value < double(limit))) throw BadFile("an index is out of range");
  return std::size_t(value);
}

// The shapes of a file, as pieces in their own frames.
class Shapes {
 public:
  Shapes(std::vector<Json> lines, std::vector<double> vertices, std::vector<std::int32_t> triangles)
      : lines_(std::move(lines)),
        vertices_(std::move(vertices)),
        triangles_(std::move(triangles)) {}

  std::vector<Piece> pieces(std::size_t shape) const { return pieces(shape, 0); }
  std::size_t count() const { return lines_.size(); }

 private:
  std::vector<Piece> pieces(std::size_t shape, int depth) const {
    const Json& line = lines_.at(shape);
    const std::string& kind = line.at("kind").text;
    if (kind == "mesh") return triangles_of(line);
    if (kind == "compound") return children_of(line, shape, depth);
    Piece piece;
    if (kind == "hull") {
      piece.points = points_of(line);
      if (line.find("radius")) piece.radius = line.at("radius").to_number();
    } else {
      set_simple(piece, kind, line);
    }
    return {piece};
  }

  static void set_simple(Piece& piece, const std::string& kind, const Json& line) {
    const auto half_extents = [&] {
      const Vec h = vector_of(line.at("half_extents").to_numbers(3));
      for (int k = 0; k < 8; ++k) {
        piece.points.push_back({k & 1 ? h.x : -h.x, k & 2 ? h.y : -h.y, k & 4 ? h.z : -h.z});
      }
    };
    const auto radius_and_length = [&](Piece::Kind round) {
      piece.kind = round;
      piece.size = {line.at("radius").to_number(), 0, line.at("half_length").to_number()};
    };
    if (kind == "box") {
      half_extents();
    } else if (kind == "rounded_box") {
      half_extents();
      piece.radius = line.at("radius").to_number();
    } else if (kind == "sphere") {
      piece.points = {{}};
      piece.radius = line.at("radius").to_number();
    } else if (kind == "capsule") {
      const double h = line.at("half_length").to_number();
      piece.points = {{0, 0, -h}, {0, 0, h}};
      piece.radius = line.at("radius").to_number();
    } else if (kind == "cylinder") {
      radius_and_length(Piece::Kind::Cylinder);
    } else if (kind == "cone") {
      radius_and_length(Piece::Kind::Cone);
    } else if (kind == "rounded_cylinder") {
      radius_and_length(Piece::Kind::Cylinder);
      piece.radius = line.at("edge_radius").to_number();
    } else if (kind == "tapered_capsule") {
      piece.kind = Piece::Kind::TaperedCapsule;
      piece.size = {line.at("bottom_radius").to_number(), line.at("top_radius").to_number(),
                    line.at("half_length").to_number()};
    } else if (kind == "half_space") {
      piece.kind = Piece::Kind::HalfSpace;
      const Vec normal = vector_of(line.at("normal").to_numbers(3));
      const double length = norm(normal);
      if (!(length > 0) || !std::isfinite(length)) throw BadFile("a half-space has no normal");
      piece.normal = (1 / length) * normal;
      piece.offset = line.at("offset").to_number();
    } else if (kind == "ellipsoid") {
      piece.kind = Piece::Kind::Ellipsoid;
      piece.size = vector_of(line.at("semi_axes").to_numbers(3));
    } else {
      throw BadFile("the kind of shape '" + kind + "' is unknown");
    }
  }

  Vec vertex(std::size_t number) const {
    if (3 * number + 2 >= vertices_.size()) throw BadFile("a vertex is out of range");
    const Vec v = vector_of(vertices_, 3 * number);
    if (!std::isfinite(v.x + v.y + v.z)) throw BadFile("a vertex is not finite");
    return v;
  }

  std::vector<Vec> points_of(const Json& line) const {
    const std::size_t first = index_of(line.at("first_vertex"), vertices_.size() + 1);
    const std::size_t count = index_of(line.at("vertex_count"), vertices_.size() + 1);
    std::vector<Vec> points;
    for (std::size_t k = 0; k < count; ++k) points.push_back(vertex(first + k));
    if (points.empty()) throw BadFile("a hull has no points");
    return points;
  }

  std::vector<Piece> triangles_of(const Json& line) const {
    const std::size_t first_vertex = index_of(line.at("first_vertex"), vertices_.size() + 1);
    const std::size_t first = index_of(line.at("first_triangle"), triangles_.size() + 1);
    const std::size_t count = index_of(line.at("triangle_count"), triangles_.size() + 1);
    if (first + count > triangles_.size() / 3) throw BadFile("a triangle is out of range");
    if (count == 0) throw BadFile("a mesh has no triangles");
    std::vector<Piece> pieces(count);
    std::vector<std::size_t> same(index_of(line.at("vertex_count"), vertices_.size() + 1));
    std::iota(same.begin(), same.end(), 0);  // a vertex to another one of its surface
    const auto root = [&](std::size_t v) {
      while (same[v] != v) v = same[v] = same[same[v]];
      return v;
    };
    const auto corner = [&](std::size_t k) {
      const std::int32_t v = triangles_[3 * first + k];
      if (v < 0 || std::size_t(v) >= same.size()) throw BadFile("a triangle is out of range");
      return std::size_t(v);
    };
    for (std::size_t k = 0; k < 3 * count; ++k) {
      pieces[k / 3].points.push_back(vertex(first_vertex + corner(k)));
      same[root(corner(k))] = root(corner(k - k % 3));
    }
    for (std::size_t k = 0; k < count; ++k) pieces[k].surface = std::int64_t(root(corner(3 * k)));
    return pieces;
  }

  std::vector<Piece> children_of(const Json& line, std::size_t shape, int depth) const {
    constexpr int kMostNested = 20;
    constexpr std::size_t kMostPieces = 50'000'000;
    if (depth > kMostNested) throw BadFile("compounds are nested too deeply");
    std::vector<Piece> all;
    std::int64_t next_surface = 0;  // those of children are kept apart
    for (const Json& child : line.at("children").list) {
      const std::size_t number = index_of(child.at("shape"), lines_.size());
      if (number >= shape) throw BadFile("a compound contains what comes after it");
      const std::vector<double> X = child.at("X_CS").to_numbers(12);
      const Pose pose{matrix_of(X), vector_of(X, 9)};
      const std::int64_t offset = next_surface;
      for (Piece piece : pieces(number, depth + 1)) {
        if (piece.surface >= 0) piece.surface += offset;
        next_surface = std::max(next_surface, piece.surface + 1);
        if (piece.kind == Piece::Kind::HalfSpace) throw BadFile("a compound holds a half-space");
        for (Vec& point : piece.points) point = pose * point;
        piece.X = {pose.R * piece.X.R, pose * piece.X.p};
        all.push_back(std::move(piece));
      }
      if (all.size() > kMostPieces) throw BadFile("a compound has too many pieces");
    }
    if (all.empty()) throw BadFile("a compound has no children");
    return all;
  }

  std::vector<Json> lines_;
  std::vector<double> vertices_;
  std::vector<std::int32_t> triangles_;
};

Pair ordered(std::uint32_t a, std::uint32_t b) {
  return {std::min(a, b), std::max(a, b)};
}

// What a scene says about pairs of bodies.
void read_scene(const Json& scene, Recording& recording, Rules& rules) {
  recording.has_rules = true;
  std::map<std::string, std::uint32_t> slots;
  for (std::uint32_t k = 0; k < recording.bodies.size(); ++k) slots[recording.bodies[k].name] = k;
  const auto slot = [&](const Json& name) -> std::optional<std::uint32_t> {
    const auto found = slots.find(name.text);
    return found == slots.end() ? std::nullopt : std::optional(found->second);
  };
  const auto pair_of = [&](const Json& json) -> std::optional<Pair> {
    if (json.find("a") == nullptr || json.find("b") == nullptr) return std::nullopt;
    const auto a = slot(json.at("a"));
    const auto b = slot(json.at("b"));
    return a && b ? std::optional(ordered(*a, *b)) : std::nullopt;
  };
  if (const Json* joints = scene.find("joints")) {
    for (const Json& joint : joints->list) {
      if (const auto pair = pair_of(joint)) rules.untested.insert(*pair);
    }
  }
  if (const Json* distances = scene.find("target_distances")) {
    for (const Json& entry : distances->list) {
      if (const auto pair = pair_of(entry))
        rules.target_distances[*pair] = entry.at("distance").to_number();
    }
  }
  if (const Json* filters = scene.find("filters")) {
    for (const Json& group : filters->list) {
      for (const Json& a : group.list) {
        for (const Json& b : group.list) {
          if (slot(a) && slot(b) && *slot(a) != *slot(b))
            rules.untested.insert(ordered(*slot(a), *slot(b)));
        }
      }
    }
  }
}

Combine combine_from(const Json& word) {
  const std::map<std::string, Combine> rules{{"geometric_mean", Combine::GeometricMean},
                                             {"mean", Combine::Mean},
                                             {"product", Combine::Product},
                                             {"minimum", Combine::Minimum},
                                             {"maximum", Combine::Maximum}};
  const auto found = rules.find(word.text);
  if (found == rules.end()) throw BadFile("the rule '" + word.text + "' is unknown");
  return found->second;
}

// A line of /rules.
Rules rules_from(const Json& line) {
  constexpr double kMostSlots = 1e7;
  const auto pair_of = [&](const Json& json) {
    return ordered(std::uint32_t(index_of(json.at("a"), std::size_t(kMostSlots))),
                   std::uint32_t(index_of(json.at("b"), std::size_t(kMostSlots))));
  };
  Rules rules;
  rules.from = line.at("from").to_number();
  rules.gravity = vector_of(line.at("gravity").to_numbers(3));
  const Json& target = line.at("target_distance");
  if (target.kind != Json::Kind::Null) rules.target_distance = target.to_number();
  for (const Json& rule : line.at("pairs").list) {
    if (!rule.at("is_enabled").boolean) rules.untested.insert(pair_of(rule));
    const Json& own = rule.at("target_distance");
    if (own.kind != Json::Kind::Null) rules.target_distances[pair_of(rule)] = own.to_number();
    const Json* material = rule.find("material");
    if (material != nullptr && material->kind == Json::Kind::Object)
      rules.materials[pair_of(rule)] = {material->at("friction").to_number(),
                                        material->at("restitution").to_number()};
  }
  if (const Json* word = line.find("combine_friction")) rules.friction = combine_from(*word);
  if (const Json* word = line.find("combine_restitution")) rules.restitution = combine_from(*word);
  for (const Json& joint : line.at("joints").list) {
    if (!joint.at("bodies_collide").boolean) rules.untested.insert(pair_of(joint));
  }
  return rules;
}

// The counts in the last row of /frames: what lies beyond them is not yet part of the run.
struct Counts {
  explicit Counts(const Hdf5Reader& file) : frames(file.length("frames")), file_(file) {}
  std::uint64_t of(const char* column) const {
    if (frames == 0) return 0;
    return file_.integers("frames", column).back();
  }
  std::uint64_t frames;

 private:
  const Hdf5Reader& file_;
};

// Bodies by slot: after one was removed, its slot may be another's.
class Slots {
 public:
  explicit Slots(Recording& recording) : recording_(recording) {}
  RecordedBody* last(std::size_t slot) {
    return slot < bodies_.size() ? &recording_.bodies[bodies_[slot].back()] : nullptr;
  }
  void add(std::size_t slot) {
    if (slot > bodies_.size()) throw BadFile("a body is missing");
    if (slot == bodies_.size()) bodies_.emplace_back();
    bodies_[slot].push_back(std::uint32_t(recording_.bodies.size() - 1));
  }
  /// The body in a slot at a time.
  std::uint32_t at(std::uint64_t slot, double t) const {
    if (slot >= bodies_.size()) throw BadFile("a row is of no body");
    const auto& all = bodies_[std::size_t(slot)];
    std::size_t k = all.size() - 1;
    while (k > 0 && recording_.bodies[all[k]].from > t) --k;
    return all[k];
  }

 private:
  Recording& recording_;
  std::vector<std::vector<std::uint32_t>> bodies_;
};

// The bounding radius of docs/formats.md: about the frame's origin.
double bounding_radius(const Body& body) {
  if (body.half_space()) return body.reach;
  double radius = 0;
  for (const Piece& piece : body.pieces) {
    if (piece.kind == Piece::Kind::Points) {
      for (const Vec& point : piece.points) radius = std::max(radius, norm(point) + piece.radius);
    } else {
      double reach = std::hypot(piece.size.x, piece.size.z);
      if (piece.kind == Piece::Kind::Ellipsoid) {
        reach = std::max({piece.size.x, piece.size.y, piece.size.z});
      } else if (piece.kind == Piece::Kind::TaperedCapsule) {
        reach = piece.size.z + std::max(piece.size.x, piece.size.y);
      }
      radius = std::max(radius, norm(piece.X.p) + reach + piece.radius);
    }
  }
  return radius;
}

// What is there since version 3.
void read_laws_of_body(const Json& line, RecordedBody& body) {
  body.bounding_radius = line.at("bounding_radius").to_number();
  body.mass = line.at("mass").to_number();
  if (!body.is_dynamic) return;
  const std::vector<double> inertia = line.at("inertia").to_numbers(9);
  std::copy(inertia.begin(), inertia.end(), body.inertia.m.begin());
  for (std::size_t k = 0; k < 3; ++k) {
    body.locked_translation[k] = line.at("locked_translation").list.at(k).boolean;
    body.locked_rotation[k] = line.at("locked_rotation").list.at(k).boolean;
  }
}

Material material_from(const Json& line) {
  const Json* has_wrench = line.find("has_wrench");
  return {line.at("from").to_number(), line.at("restitution").to_number(),
          line.at("friction").to_number(), has_wrench != nullptr && has_wrench->boolean};
}

bool has_mass_of(const RecordedBody& body, const Json& line) {
  const Vec center = vector_of(line.at("p_BoBcm").to_numbers(3));
  RecordedBody other;
  other.is_dynamic = body.is_dynamic;
  read_laws_of_body(line, other);
  return norm(center - body.center_of_mass) == 0 && other.mass == body.mass &&
         other.inertia.m == body.inertia.m;
}

void read_bodies(const Hdf5Reader& file, const Counts& counts, bool has_laws, Recording& recording,
                 Slots& slots) {
  const Shapes shapes(lines_of(file.bytes("shapes", counts.of("shape_bytes"))),
                      file.numbers("vertices", counts.of("vertex_count")),
                      file.indices("triangles", counts.of("triangle_count")));
  std::map<std::pair<std::size_t, std::array<double, 3>>, std::shared_ptr<const Body>> built;
  std::map<std::size_t, double> shape_lines;  // of the last line of each slot
  for (const Json& line : lines_of(file.bytes("bodies", counts.of("body_bytes")))) {
    constexpr std::size_t kMostBodies = 10'000'000;
    const std::size_t slot = index_of(line.at("slot"), kMostBodies);
    RecordedBody body;
    if (has_laws && !line.at("is_new").boolean) {
      if (slots.last(slot) == nullptr) throw BadFile("a body is missing");
      if (line.at("shape").number == shape_lines[slot] && has_mass_of(*slots.last(slot), line)) {
        slots.last(slot)->materials.push_back(material_from(line));
        continue;
      }
      body.continues = std::uint32_t(slots.last(slot) - recording.bodies.data());
    }
    body.slot = std::uint32_t(slot);
    body.from = line.at("from").to_number();
    body.name = line.at("name").text;
    body.is_dynamic = line.at("kind").text == "dynamic";
    body.is_sensor = line.at("is_sensor").boolean;
    const Vec p_cm = vector_of(line.at("p_BoBcm").to_numbers(3));
    body.center_of_mass = p_cm;
    const std::size_t shape = index_of(line.at("shape"), shapes.count());
    shape_lines[slot] = double(shape);
    auto& tree = built[{shape, {p_cm.x, p_cm.y, p_cm.z}}];
    if (!tree) {
      auto fresh = std::make_shared<Body>();
      fresh->pieces = shapes.pieces(shape);
      fresh->build(p_cm);
      tree = fresh;
    }
    body.shape = tree;
    body.bounding_radius = bounding_radius(*tree);
    if (has_laws) {
      read_laws_of_body(line, body);
      body.materials.push_back(material_from(line));
    }
    recording.bodies.push_back(std::move(body));
    slots.add(slot);
  }
}

// Where a slot has passed on, the body before is absent from then.
void end_replaced(Recording& recording) {
  std::map<std::uint32_t, double> next;
  for (std::size_t k = recording.bodies.size(); k-- > 0;) {
    RecordedBody& body = recording.bodies[k];
    const auto replaced = next.find(body.slot);
    if (replaced != next.end()) {
      Segment absent;
      absent.begin = replaced->second;
      body.segments.push_back(absent);
    }
    next[body.slot] = body.from;
  }
}

void read_segments(const Hdf5Reader& file, const Counts& counts, const Slots& slots,
                   Recording& recording) {
  const auto count = std::int64_t(counts.of("segment_count"));
  const std::vector<double> begin = file.reals("segments", "begin", count);
  const auto first = file.integers("segments", "first", count);
  const auto slot = file.integers("segments", "body", count);
  const auto kind = file.integers("segments", "kind", count);
  SegmentReader reader(file.numbers("numbers", counts.of("number_count")),
                       file.bytes("given", counts.of("given_bytes")), recording.bodies.size());
  std::vector<double> last(recording.bodies.size(), -std::numeric_limits<double>::infinity());
  for (std::size_t k = 0; k < begin.size(); ++k) {
    const std::uint32_t number = slots.at(slot[k], begin[k]);
    RecordedBody& body = recording.bodies[number];
    if (!std::isfinite(begin[k]) || begin[k] < last[number])
      throw BadFile("the segments of a body are not in order of time");
    // What a prescribed motion would have done later than this row.
    while (!body.segments.empty() && body.segments.back().begin > begin[k])
      body.segments.pop_back();
    last[number] = begin[k];
    for (const Segment& segment :
         reader.read(std::uint32_t(kind[k]), first[k], number, begin[k], body.center_of_mass))
      body.segments.push_back(segment);
  }
  end_replaced(recording);
}

void read_steps(const Hdf5Reader& file, const Counts& counts, Recording& recording) {
  const auto count = std::int64_t(counts.of("step_count"));
  const std::vector<double> begin = file.reals("steps", "begin", count);
  const std::vector<double> end = file.reals("steps", "end", count);
  for (std::size_t k = 0; k < begin.size(); ++k) {
    if (!(begin[k] <= end[k]) || (k > 0 && begin[k] != end[k - 1]))
      throw BadFile("the steps leave a gap in time");
    recording.steps.emplace_back(begin[k], end[k]);
  }
  if (recording.steps.empty()) throw BadFile("nothing was committed");
  if (recording.steps.front().first != recording.begin)
    throw BadFile("the first step does not begin with the run");
  recording.end = end.back();
}

void read_events(const Hdf5Reader& file, const Counts& counts, const Slots& slots,
                 Recording& recording) {
  enum Kind : std::uint64_t { kTooNear = 2, kCrossed = 3, kParted = 8, kPlaced = 9 };
  const auto count = std::int64_t(counts.of("event_count"));
  const auto kind = file.integers("events", "kind", count);
  const auto a = file.integers("events", "a", count);
  const auto b = file.integers("events", "b", count);
  const std::vector<double> t = file.reals("events", "t", count);
  std::map<std::uint64_t, std::set<double>> afresh;  // by slot: put elsewhere, or another body
  for (const RecordedBody& body : recording.bodies) {
    if (!body.continues) afresh[body.slot].insert(body.from);
  }
  for (std::size_t k = 0; k < kind.size(); ++k) {
    if (kind[k] != kPlaced) continue;
    recording.bodies[slots.at(a[k], t[k])].placed.insert(t[k]);
    afresh[a[k]].insert(t[k]);
  }
  for (std::size_t k = 0; k < kind.size(); ++k) {
    if (kind[k] != kTooNear && kind[k] != kCrossed && kind[k] != kParted) continue;
    auto& spans = recording.uncertified[ordered(recording.bodies[slots.at(a[k], t[k])].slot,
                                                recording.bodies[slots.at(b[k], t[k])].slot)];
    if (kind[k] == kParted) {
      if (!spans.empty()) spans.back().second = std::min(spans.back().second, t[k]);
      continue;
    }
    // What the caller puts elsewhere is looked at afresh.
    double until = std::numeric_limits<double>::infinity();
    for (const std::uint64_t slot : {a[k], b[k]}) {
      const auto next = afresh[slot].upper_bound(t[k]);
      if (next != afresh[slot].end()) until = std::min(until, *next);
    }
    spans.emplace_back(t[k], until);
  }
}

Vec from_row(const std::array<double, 3>& x) {
  return {x[0], x[1], x[2]};
}

// Rows of a table that belong to changes one after another.
template <typename Row>
void deal_out(const std::vector<std::uint64_t>& counts, std::vector<Row>& rows,
              std::vector<Change>& changes, std::vector<Row> Change::*part) {
  std::size_t next = 0;
  for (std::size_t k = 0; k < changes.size(); ++k) {
    if (counts[k] > rows.size() - next) throw BadFile("a change has more rows than there are");
    const auto begin = rows.begin() + std::ptrdiff_t(next);
    (changes[k].*part).assign(begin, begin + std::ptrdiff_t(counts[k]));
    next += std::size_t(counts[k]);
  }
}

class ChangeReader {
 public:
  ChangeReader(const Hdf5Reader& file, const Counts& counts, const Slots& slots)
      : file_(file), counts_(counts), slots_(slots) {}

  std::vector<Change> read() {
    const auto count = std::int64_t(counts_.of("change_count"));
    const std::vector<double> begin = file_.reals(kChanges, "begin", count);
    const std::vector<double> end = file_.reals(kChanges, "end", count);
    const auto kind = file_.integers(kChanges, "kind", count);
    changes_.resize(begin.size());
    for (std::size_t k = 0; k < changes_.size(); ++k) {
      if (kind[k] > std::uint64_t(Change::Kind::Set) || !(begin[k] <= end[k]))
        throw BadFile("a velocity change is none");
      changes_[k].kind = Change::Kind(kind[k]);
      changes_[k].begin = begin[k];
      changes_[k].end = end[k];
    }
    read_momenta();
    read_contacts();
    read_links();
    read_wrenches();
    return std::move(changes_);
  }

 private:
  static constexpr const char* kChanges = "velocity_changes";

  // The number of rows of each change.
  std::vector<std::uint64_t> each(const char* column) const {
    return file_.integers(kChanges, column, std::int64_t(counts_.of("change_count")));
  }
  void read_momenta() {
    const char* table = "momenta";
    const auto count = std::int64_t(counts_.of("momentum_count"));
    const auto body = file_.integers(table, "body", count);
    const auto is_before = file_.integers(table, "is_before", count);
    const auto v = file_.vectors(table, "v", count);
    const auto L = file_.vectors(table, "L", count);
    std::vector<MomentumRow> rows(body.size());
    for (std::size_t k = 0; k < rows.size(); ++k)
      rows[k] = {std::uint32_t(body[k]), is_before[k] != 0, from_row(v[k]), from_row(L[k])};
    deal_out(each("momentum_count"), rows, changes_, &Change::momenta);
    for (Change& change : changes_) {
      for (MomentumRow& row : change.momenta) row.body = slots_.at(row.body, change.begin);
    }
  }

  void read_contacts() {
    const char* table = "contact_impulses";
    const auto count = std::int64_t(counts_.of("contact_impulse_count"));
    const auto a = file_.integers(table, "a", count);
    const auto b = file_.integers(table, "b", count);
    const auto p = file_.vectors(table, "p", count);
    const auto normal = file_.vectors(table, "normal", count);
    const auto impulse = file_.vectors(table, "impulse", count);
    const std::vector<double> target = file_.reals(table, "target", count);
    const std::vector<double> friction = file_.reals(table, "friction", count);
    std::vector<ContactRow> rows(a.size());
    for (std::size_t k = 0; k < rows.size(); ++k) {
      rows[k] = {std::uint32_t(a[k]),  std::uint32_t(b[k]), from_row(p[k]), from_row(normal[k]),
                 from_row(impulse[k]), target[k],           friction[k]};
    }
    deal_out(each("contact_count"), rows, changes_, &Change::contacts);
    for (Change& change : changes_) name_pairs(change.contacts, change.begin);
  }

  void read_links() {
    const char* table = "link_impulses";
    const auto count = std::int64_t(counts_.of("link_impulse_count"));
    const auto a = file_.integers(table, "a", count);
    const auto b = file_.integers(table, "b", count);
    const auto impulse = file_.vectors(table, "impulse", count);
    const auto angular_a = file_.vectors(table, "angular_a", count);
    const auto angular_b = file_.vectors(table, "angular_b", count);
    std::vector<LinkRow> rows(a.size());
    for (std::size_t k = 0; k < rows.size(); ++k) {
      rows[k] = {std::uint32_t(a[k]), std::uint32_t(b[k]), from_row(impulse[k]),
                 from_row(angular_a[k]), from_row(angular_b[k])};
    }
    deal_out(each("link_count"), rows, changes_, &Change::links);
    for (Change& change : changes_) name_pairs(change.links, change.begin);
  }

  void read_wrenches() {
    const char* table = "wrench_impulses";
    const auto count = std::int64_t(counts_.of("wrench_impulse_count"));
    const auto body = file_.integers(table, "body", count);
    const auto impulse = file_.vectors(table, "impulse", count);
    const auto angular = file_.vectors(table, "angular", count);
    std::vector<WrenchRow> rows(body.size());
    for (std::size_t k = 0; k < rows.size(); ++k)
      rows[k] = {std::uint32_t(body[k]), from_row(impulse[k]), from_row(angular[k])};
    deal_out(each("wrench_count"), rows, changes_, &Change::wrenches);
    for (Change& change : changes_) {
      for (WrenchRow& row : change.wrenches) row.body = slots_.at(row.body, change.begin);
    }
  }

  template <typename Row>
  void name_pairs(std::vector<Row>& rows, double t) const {
    for (Row& row : rows) {
      row.a = slots_.at(row.a, t);
      row.b = slots_.at(row.b, t);
    }
  }

  const Hdf5Reader& file_;
  const Counts& counts_;
  const Slots& slots_;
  std::vector<Change> changes_;
};

// The rules of a file without any: what its header and its scene say.
void read_old_rules(const Json& header, Recording& recording) {
  Rules rules;
  rules.from = -std::numeric_limits<double>::infinity();
  const Json& distance = header.at("target_distance");
  if (distance.kind != Json::Kind::Null) rules.target_distance = distance.to_number();
  const Json& scene = header.at("scene");
  if (scene.kind == Json::Kind::Object) read_scene(scene, recording, rules);
  recording.rules.push_back(std::move(rules));
}

void read_rules(const Hdf5Reader& file, const Counts& counts, Recording& recording) {
  for (const Json& line : lines_of(file.bytes("rules", counts.of("rule_bytes")))) {
    recording.rules.push_back(rules_from(line));
    const std::size_t count = recording.rules.size();
    if (count > 1 && recording.rules[count - 1].from < recording.rules[count - 2].from)
      throw BadFile("the rules are not in order of time");
  }
  recording.has_rules = !recording.rules.empty();
}

}  // namespace

double combine(Combine rule, double a, double b) {
  switch (rule) {
    case Combine::GeometricMean:
      return std::sqrt(a * b);
    case Combine::Mean:
      return (a + b) / 2;
    case Combine::Product:
      return a * b;
    case Combine::Minimum:
      return std::min(a, b);
    case Combine::Maximum:
      break;
  }
  return std::max(a, b);
}

const Material& RecordedBody::material(double t) const {
  std::size_t k = materials.size() - 1;
  while (k > 0 && materials[k].from > t) --k;
  return materials[k];
}

const Segment* RecordedBody::segment(double t, bool before) const {
  auto next = std::upper_bound(segments.begin(), segments.end(), t,
                               [](double x, const Segment& g) { return x < g.begin; });
  if (next == segments.begin()) return nullptr;
  --next;
  if (before && next->begin == t && next != segments.begin()) --next;
  return next->is_known() ? &*next : nullptr;
}

const Rules& Recording::rules_at(double t) const {
  std::size_t k = rules.size() - 1;
  while (k > 0 && rules[k].from > t) --k;
  return rules[k];
}

double Recording::target(std::uint32_t a, std::uint32_t b, const Rules& at) const {
  const auto own = at.target_distances.find(ordered(bodies[a].slot, bodies[b].slot));
  if (own != at.target_distances.end()) return own->second;
  if (at.target_distance) return *at.target_distance;
  return kDefaultTarget * std::min(bodies[a].bounding_radius, bodies[b].bounding_radius);
}

bool Recording::is_tested(std::uint32_t a, std::uint32_t b, const Rules& at) const {
  const RecordedBody& x = bodies[a];
  const RecordedBody& y = bodies[b];
  if (!x.is_dynamic && !y.is_dynamic) return false;
  if (x.is_sensor || y.is_sensor || x.slot == y.slot) return false;
  return !at.untested.contains(ordered(x.slot, y.slot));
}

PairMaterial Recording::pair_material(std::uint32_t a, std::uint32_t b, double t) const {
  const Rules& now = rules_at(t);
  const auto own = now.materials.find(ordered(bodies[a].slot, bodies[b].slot));
  if (own != now.materials.end()) return own->second;
  const Material& x = bodies[a].material(t);
  const Material& y = bodies[b].material(t);
  return {combine(now.friction, x.friction, y.friction),
          combine(now.restitution, x.restitution, y.restitution)};
}

bool Recording::is_uncertified(std::uint32_t a, std::uint32_t b, double t) const {
  const auto found = uncertified.find(ordered(bodies[a].slot, bodies[b].slot));
  if (found == uncertified.end()) return false;
  return std::any_of(found->second.begin(), found->second.end(),
                     [&](const auto& span) { return span.first <= t && t < span.second; });
}

Recording read_recording(const std::string& path) {
  const Hdf5Reader file(path);
  if (file.text_attribute("format") != "dyop recording") throw BadFile("not a recording of a run");
  constexpr std::int64_t kNewestVersion = 3;
  const std::int64_t version = file.integer_attribute("version");
  if (version > kNewestVersion) throw BadFile("the recording's version is newer than this program");
  const bool has_laws = version >= 3;
  const Json header = parse_json(file.text_attribute("header"));
  const Counts counts(file);
  Recording recording;
  Slots slots(recording);
  read_bodies(file, counts, has_laws, recording, slots);
  read_segments(file, counts, slots, recording);
  recording.begin = header.at("begin_time").to_number();
  read_steps(file, counts, recording);
  read_events(file, counts, slots, recording);
  if (has_laws) {
    read_rules(file, counts, recording);
    recording.changes = ChangeReader(file, counts, slots).read();
  }
  if (recording.rules.empty()) read_old_rules(header, recording);
  recording.is_complete = file.length("end") > 0;
  return recording;
}

}  // namespace dyop_check
