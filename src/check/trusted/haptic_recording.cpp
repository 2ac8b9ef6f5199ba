// SPDX-License-Identifier: BSD-3-Clause
#include "check/trusted/haptic_recording.h"

#include "check/trusted/segments.h"

namespace dyop_check {
namespace {

constexpr std::int64_t kVersion = 7;
constexpr std::int64_t kOldestVersion = 5;
constexpr std::size_t kMostTools = 100;
constexpr std::size_t kMostHinges = 100;
constexpr std::uint64_t kMostNumber = 0xffffffff;  // of ticks and snapshots

std::string text_of(const Hdf5Reader& file, const char* dataset) {
  return file.bytes(dataset, file.length(dataset));
}

double not_negative(const Json& json, const char* key) {
  const double x = json.at(key).to_number();
  if (x < 0) throw BadFile(std::string(key) + " is negative");
  return x;
}

// X^-1 Y.
Pose seen_from(const Pose& X, const Pose& Y) {
  return {transpose(X.R) * Y.R, transposed(X.R, Y.p - X.p)};
}

// x, y, z, w.
Mat rotation_of(const double* q) {
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(length > 0.5 && length < 2)) throw BadFile("a waypoint's rotation is none");
  const double x = q[0] / length;
  const double y = q[1] / length;
  const double z = q[2] / length;
  const double w = q[3] / length;
  Mat R;
  R.m = {1 - 2 * (y * y + z * z), 2 * (x * y - z * w),     2 * (x * z + y * w),
         2 * (x * y + z * w),     1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
         2 * (x * z - y * w),     2 * (y * z + x * w),     1 - 2 * (x * x + y * y)};
  return R;
}

// Every vertex oscillates, with a lag that grows along x.
std::vector<Vec> places(const Breathing& breathing, const std::vector<Vec>& rest,
                        std::int64_t number) {
  constexpr double kLag = 0.005;
  const double phase = 2 * kPi * breathing.frequency * breathing.period * double(number);
  std::vector<Vec> all;
  for (const Vec& p : rest) {
    const double lag = kLag * p.x;
    all.push_back(p + (std::sin(phase - lag) + std::sin(lag)) * breathing.amplitude);
  }
  return all;
}

Breathing breathing_from(const Json& json, const Obstacle& obstacle) {
  Breathing breathing;
  breathing.frequency = json.at("frequency").to_number();
  breathing.amplitude = vector_of(json.at("amplitude").to_numbers(3));
  breathing.period = 1 / json.at("rate").to_number();
  if (!json.find("cuts")) return breathing;
  std::vector<std::int32_t> left = obstacle.corners;
  for (const Json& item : json.at("cuts").list) {
    const Vec center = vector_of(item.at("position").to_numbers(3));
    const double radius = item.at("radius").to_number();
    std::vector<std::int32_t> corners;
    for (std::size_t k = 0; k < left.size(); k += 3) {
      bool is_cut = false;
      for (std::size_t i = k; i < k + 3; ++i)
        is_cut |= norm(obstacle.vertices[std::size_t(left[i])] - center) < radius;
      for (std::size_t i = k; i < k + 3 && !is_cut; ++i) corners.push_back(left[i]);
    }
    left = corners;
    if (left.empty()) throw BadFile("a cut leaves nothing");
    const double number = std::round(item.at("t").to_number() / breathing.period);
    if (!(number >= 1 && number <= double(kMostNumber))) throw BadFile("a cut has no time");
    breathing.cuts.push_back({std::int64_t(number), std::move(corners)});
  }
  return breathing;
}

}  // namespace

HapticRecording::HapticRecording(const Hdf5Reader& file) : file_(file) {
  const std::int64_t version = file.integer_attribute("version");
  if (version < kOldestVersion || version > kVersion) {
    throw BadFile("the recording of a tool has version " + std::to_string(version) +
                  ", and versions " + std::to_string(kOldestVersion) + " to " +
                  std::to_string(kVersion) + " are checked");
  }
  tells_turns_ = version > kOldestVersion;
  read_session();
  if (tells_turns_) read_turns();
  snapshot_rows_ = read_rows("snapshots", "first_vertex", "vertex_count");
  mesh_rows_ = read_rows("meshes", "first_triangle", "triangle_count");
  read_waypoints();
  read_ticks();
  is_complete = file.length("end") > 0;
}

void HapticRecording::read_session() {
  const ShapeReader shapes(file_.json_lines("shapes", file_.length("shapes")),
                           file_.numbers("vertices", file_.length("vertices"), 3),
                           file_.indices("triangles", file_.length("triangles"), 3));
  const Json session = parse_json(text_of(file_, "session"));
  read_tool(session, shapes);
  if (const Json* more = session.find("more_tools")) {
    if (more->list.size() > kMostTools) throw BadFile("there are too many tools");
    for (const Json& tool : more->list) read_tool(tool, shapes);
    tool_margin = not_negative(session, "tool_margin");
  }
  for (const Json& obstacle : session.at("obstacles").list) read_obstacle(obstacle, shapes);
}

void HapticRecording::read_tool(const Json& json, const ShapeReader& shapes) {
  const std::vector<Json>& hinges = json.at("hinges").list;
  if (hinges.size() > kMostHinges) throw BadFile("a tool has too many hinges");
  if (first_angle_.empty()) first_angle_.push_back(0);
  first_angle_.push_back(first_angle_.back() + hinges.size());
  std::map<std::size_t, Body> bodies;  // 0: what is fixed, then one for each hinge
  for (const Json& item : json.at("parts").list) {
    const Json& hinge = item.at("hinge");
    const bool is_fixed = hinge.kind == Json::Kind::Null;
    const std::size_t number = is_fixed ? 0 : 1 + index_of(hinge, hinges.size());
    const Pose X_TP = pose_of(item.at("X_TP"));
    const Pose X = is_fixed ? X_TP : seen_from(pose_of(hinges[number - 1].at("X_TJ")), X_TP);
    for (Piece& piece : shapes.pieces(index_of(item.at("shape"), shapes.count())))
      bodies[number].pieces.push_back(placed(X, std::move(piece)));
  }
  for (auto& [number, body] : bodies) {
    ToolPart part;
    part.name = "tool " + std::to_string(tool_count + 1);
    part.tool = tool_count;
    if (number > 0) {
      part.name += ", hinge " + std::to_string(number);
      part.hinge = number - 1;
      part.X_TJ = pose_of(hinges[number - 1].at("X_TJ"));
    }
    body.build({});
    part.shape = std::make_shared<Body>(std::move(body));
    parts.push_back(std::move(part));
  }
  ++tool_count;
}

void HapticRecording::read_obstacle(const Json& json, const ShapeReader& shapes) {
  Obstacle obstacle;
  obstacle.name = json.at("name").text;
  const std::string& role = json.at("role").text;
  if (role != "tissue" && role != "hard" && role != "soft" && role != "monitor")
    throw BadFile("the role '" + role + "' of an obstacle is unknown");
  obstacle.is_hard = role == "tissue" || role == "hard";
  obstacle.margin = not_negative(json, "margin");
  obstacle.deforms = json.at("deforms").to_boolean();
  const std::size_t shape = index_of(json.at("shape"), shapes.count());
  if (obstacle.deforms) {
    ++deforming_;
    obstacle.vertices = shapes.vertices(shape);
    obstacle.corners = shapes.corners(shape);
    if (const Json* formula = json.find("formula"))
      obstacle.formula = breathing_from(*formula, obstacle);
  } else {
    Body body;
    body.pieces = shapes.pieces(shape);
    body.build({});
    obstacle.X_WO = pose_of(json.at("X_WO"));
    obstacle.shape = std::make_shared<Body>(std::move(body));
  }
  obstacles.push_back(std::move(obstacle));
}

HapticRecording::RowsByNumber HapticRecording::read_rows(const char* table, const char* first,
                                                         const char* count) const {
  RowsByNumber rows;
  const std::uint64_t length = file_.length(table);
  const auto obstacle = file_.integers(table, "obstacle", length);
  const auto number = file_.integers(table, "number", length);
  const auto begin = file_.integers(table, first, length);
  const auto size = file_.integers(table, count, length);
  for (std::size_t k = 0; k < length; ++k) rows[{obstacle[k], number[k]}] = {begin[k], size[k]};
  return rows;
}

std::optional<Snapshot> HapticRecording::snapshot(std::size_t number_of_obstacle,
                                                  std::int64_t number) const {
  const Obstacle& obstacle = obstacles[number_of_obstacle];
  Snapshot found;
  if (obstacle.formula) {
    const Breathing& formula = *obstacle.formula;
    const auto cut = std::find_if(formula.cuts.begin(), formula.cuts.end(),
                                  [&](const auto& entry) { return entry.number == number; });
    if (cut == formula.cuts.end()) return Snapshot{places(formula, obstacle.vertices, number), {}};
    return Snapshot{places(formula, obstacle.vertices, number - 1), cut->corners};
  }
  const std::pair<std::uint64_t, std::uint64_t> key{number_of_obstacle, number};
  const auto rows = snapshot_rows_.find(key);
  if (rows == snapshot_rows_.end()) return std::nullopt;
  const std::vector<double> numbers =
      file_.numbers("snapshot_vertices", rows->second.count, 3, rows->second.first);
  for (std::size_t k = 0; k < numbers.size(); k += 3) {
    found.vertices.push_back(vector_of(numbers, k));
    if (!std::isfinite(norm(found.vertices.back()))) throw BadFile("a vertex is not finite");
  }
  const auto mesh = mesh_rows_.find(key);
  if (mesh == mesh_rows_.end()) return found;
  found.corners = file_.indices("snapshot_triangles", mesh->second.count, 3, mesh->second.first);
  if (found.corners.empty()) throw BadFile("a mesh has no triangles");
  for (const std::int32_t corner : found.corners) {
    if (corner < 0 || std::size_t(corner) >= found.vertices.size())
      throw BadFile("a triangle is out of range");
  }
  return found;
}

// Of a snapshot that was taken back the last line counts, as its number has come again.
void HapticRecording::read_turns() {
  for (const Json& line : file_.json_lines("inputs", file_.length("inputs"))) {
    const Json* obstacle = line.find("obstacle");
    if (!obstacle) continue;
    const std::size_t snapshot = index_of(line.at("snapshot"), kMostNumber);
    turns_[{index_of(*obstacle, obstacles.size()), snapshot}] = line.at("from").to_number();
  }
}

bool HapticRecording::sets_out_at(double part, std::size_t obstacle, std::int64_t number) const {
  const auto turn = turns_.find({obstacle, std::uint64_t(number)});
  return !tells_turns_ || part == (turn == turns_.end() ? 1 : turn->second);
}

bool HapticRecording::is_whole(std::int64_t first, std::int64_t last) const {
  const auto ticks = std::distance(excuses_.lower_bound(first), excuses_.upper_bound(last));
  return ticks == last - first + 1;
}

void HapticRecording::read_waypoints() {
  const char* const table = "waypoints";
  const std::uint64_t ticks = file_.length("ticks");
  std::uint64_t count = ticks == 0 ? 0 : file_.length(table);
  waypoint_ticks_ = file_.integers(table, "tick", count);
  // The file may have been cut off after them and before their tick.
  const std::uint64_t last = ticks == 0 ? 0 : file_.integers("ticks", "number", ticks).back();
  while (count > 0 && waypoint_ticks_[count - 1] > last) --count;
  waypoint_ticks_.resize(count);
  is_start_ = file_.integers(table, "is_start", count);
  p_ = file_.reals(table, "p", count, 3 * tool_count);
  q_ = file_.reals(table, "q", count, 4 * tool_count);
  angles_ = file_.reals(table, "angles", count, first_angle_.back());
  snapshots_ = file_.integers(table, "snapshot", count, deforming_);
  fractions_ = file_.reals(table, "fraction", count, deforming_);
  if (count == 0 || !is_start_.front()) throw BadFile("no motion has a start");
  for (const auto* numbers : {&p_, &q_, &angles_, &fractions_}) {
    for (const double x : *numbers) {
      if (!std::isfinite(x)) throw BadFile("a waypoint is not finite");
    }
  }
  for (const auto* numbers : {&waypoint_ticks_, &snapshots_}) {
    for (const std::uint64_t x : *numbers) {
      if (x > kMostNumber) throw BadFile("a number is too large");
    }
  }
  for (const double fraction : fractions_) {
    if (!(fraction >= 0 && fraction <= 1)) throw BadFile("a fraction is not within 0 and 1");
  }
}

Waypoint HapticRecording::waypoint(std::size_t number) const {
  Waypoint waypoint;
  waypoint.tick = std::int64_t(waypoint_ticks_[number]);
  waypoint.is_start = is_start_[number] != 0;
  for (std::size_t tool = 0; tool < tool_count; ++tool) {
    const std::size_t at = number * tool_count + tool;
    Waypoint::Tool& place = waypoint.tools.emplace_back();
    place.X_WT = {rotation_of(&q_[4 * at]), vector_of(p_, 3 * at)};
    const auto angle = angles_.begin() + std::ptrdiff_t(number * first_angle_.back());
    place.angles.assign(angle + std::ptrdiff_t(first_angle_[tool]),
                        angle + std::ptrdiff_t(first_angle_[tool + 1]));
  }
  for (std::size_t k = 0; k < deforming_; ++k) {
    const std::size_t at = number * deforming_ + k;
    waypoint.progress.push_back({std::int64_t(snapshots_[at]), fractions_[at]});
  }
  return waypoint;
}

void HapticRecording::read_ticks() {
  const std::uint64_t count = file_.length("ticks");
  tick_count = std::int64_t(count);
  const auto numbers = file_.integers("ticks", "number", count);
  for (std::size_t k = 0; k < count; ++k) {
    const std::uint64_t due = k == 0 ? 0 : numbers[k - 1] + 1;
    if (numbers[k] < due || numbers[k] > kMostNumber) throw BadFile("the ticks are not in order");
    missing_ticks += std::int64_t(numbers[k] - due);
  }
  require_same_ends(numbers);
  enum Status : std::uint64_t { kRecovering = 6, kOverlapping = 7, kInvalid = 8, kOutlier = 9 };
  std::vector<std::vector<std::uint64_t>> status{file_.integers("ticks", "status", count)};
  if (tool_count > 1) {
    const auto others = file_.integers("ticks", "other_status", count, tool_count - 1);
    for (std::size_t tool = 1; tool < tool_count; ++tool) {
      auto& own = status.emplace_back();
      for (std::size_t k = 0; k < count; ++k)
        own.push_back(others[k * (tool_count - 1) + tool - 1]);
    }
  }
  for (const std::uint64_t number : numbers)
    excuses_[std::int64_t(number)].assign(tool_count, Excuse::None);
  for (std::size_t tool = 0; tool < tool_count; ++tool) {
    auto now = Excuse::None;
    const auto pass = [&](std::size_t k) {
      const std::uint64_t own = status[tool][k];
      if (own != kInvalid && own != kOutlier) {
        now = own == kRecovering    ? Excuse::Leaving
              : own == kOverlapping ? Excuse::Crossing
                                    : Excuse::None;
      }
      Excuse& excuse = excuses_[std::int64_t(numbers[k])][tool];
      excuse = std::max(excuse, now);
    };
    for (std::size_t k = 0; k < count; ++k) pass(k);
    now = Excuse::None;
    for (std::size_t k = count; k-- > 0;) pass(k);
  }
}

// What the table of ticks shows is where the motions that are proven have led.
void HapticRecording::require_same_ends(const std::vector<std::uint64_t>& numbers) const {
  constexpr double kSingle = 1e-6;  // literal: rotations and angles are there in single precision
  const std::size_t others = tool_count - 1;
  const std::size_t hinges = first_angle_[1];
  require_same_ends(numbers, "tool_p", 3, 3 * others, p_, 0);
  require_same_ends(numbers, "tool_q", 4, 4 * others, q_, kSingle);
  require_same_ends(numbers, "tool_angles", hinges, first_angle_.back() - hinges, angles_, kSingle);
}

// @param column Of the first tool, `width` numbers; the others' has `rest` of them.
// @param ends The same of all waypoints.
void HapticRecording::require_same_ends(const std::vector<std::uint64_t>& numbers,
                                        const std::string& column, std::size_t width,
                                        std::size_t rest, const std::vector<double>& ends,
                                        double tolerance) const {
  const auto first = file_.reals("ticks", column.c_str(), numbers.size(), width);
  const auto others = file_.reals("ticks", ("other_" + column).c_str(), numbers.size(), rest);
  const auto is_same = [&](const double* x, const double* y, std::size_t count) {
    return std::equal(x, x + count, y, [&](double a, double b) {
      return std::abs(a - b) <= tolerance * std::max(1.0, std::abs(a));
    });
  };
  std::size_t next = 0;
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    while (next < waypoint_ticks_.size() && waypoint_ticks_[next] <= numbers[k]) ++next;
    if (next == 0) throw BadFile("a tick begins nowhere");
    const double* end = ends.data() + (width + rest) * (next - 1);
    if (!is_same(end, first.data() + width * k, width) ||
        !is_same(end + width, others.data() + rest * k, rest))
      throw BadFile("tick " + std::to_string(numbers[k]) + " ends elsewhere than its motions");
  }
}

Excuse HapticRecording::excuse(std::int64_t tick, std::size_t tool) const {
  const auto found = excuses_.find(tick);
  return found == excuses_.end() ? Excuse::None : found->second[tool];
}

}  // namespace dyop_check
