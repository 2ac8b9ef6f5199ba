// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "dyop/core/error.h"
#include "dyop/io/file_error.h"
#include "dyop/io/scene_file.h"
#include "io/file_bytes.h"
#include "io/scene/scene_builder.h"

namespace dyop {
namespace {

struct KindRow {
  SceneKind kind;
  GeneratedScene (*make)(int n);
};

const std::vector<KindRow>& kind_rows() {
  static const std::vector<KindRow> rows{
      {{"stack", "cubes", 1, 1000}, io_internal::make_stack},
      {{"pyramid", "courses", 1, 100}, io_internal::make_pyramid},
      {{"wall", "courses of 2 N bricks", 1, 50}, io_internal::make_wall},
      {{"pile", "cubes", 1, 20000}, io_internal::make_pile},
      {{"spheres", "balls in a pit", 1, 20000}, io_internal::make_spheres},
      {{"hulls", "pebbles in a pit, hulls of 20 to 60 points", 1, 5000}, io_internal::make_hulls},
      {{"ragdolls", "ragdolls of six capsules", 1, 1000}, io_internal::make_ragdolls},
      {{"rope", "links", 1, 1000}, io_internal::make_rope},
      {{"arch", "stones", 3, 1001}, io_internal::make_arch},
      {{"cards", "levels", 1, 30}, io_internal::make_cards},
      {{"domino", "dominoes", 1, 1000}, io_internal::make_domino},
      {{"chain-net", "rings per side, not counting links", 2, 30}, io_internal::make_chain_net},
      {{"gears", "gears", 1, 100}, io_internal::make_gears},
      {{"cradle", "balls", 2, 100}, io_internal::make_cradle},
      {{"bolt", "turns of the nut", 1, 100}, io_internal::make_bolt}};
  return rows;
}

}  // namespace

const std::vector<SceneKind>& scene_kinds() {
  static const std::vector<SceneKind> kinds = [] {
    std::vector<SceneKind> list;
    for (const KindRow& row : kind_rows()) list.push_back(row.kind);
    return list;
  }();
  return kinds;
}

GeneratedScene generate_scene(const std::string& kind, int n) {
  std::string names;
  for (const KindRow& row : kind_rows()) {
    if (row.kind.name == kind) {
      DYOP_REQUIRE(n >= row.kind.least && n <= row.kind.most, "scene ", kind, ": N (",
                   row.kind.count, ") must be ", row.kind.least, " to ", row.kind.most, ", not ",
                   n);
      return row.make(n);
    }
    names += (names.empty() ? "" : ", ") + row.kind.name;
  }
  DYOP_REQUIRE(false, "no kind of scene named '", kind, "'; the kinds are ", names);
  return {};
}

void write_generated_scene(const GeneratedScene& scene, const std::filesystem::path& file) {
  for (const auto& [name, text] : scene.meshes)
    io_internal::write_whole_file(file.parent_path() / name, text);
  io_internal::write_whole_file(file, scene.text);
}

}  // namespace dyop

// A nut that a torque runs down a bolt, until it is tight.

namespace dyop::io_internal {
namespace {

constexpr Scalar kWholeTurn = 2 * std::numbers::pi_v<Scalar>;

constexpr Scalar kThreadPitch = 0.4;  // of a right-handed thread
constexpr Scalar kRoot = 0.75;
constexpr Scalar kCrest = 1;
constexpr Scalar kPlay = 0.04;  // how much larger the radius of the nut's thread is
constexpr int kColumns = 60;    // around; a multiple of six, for the corners of the hexagons

// A trapezoid: the corners' places as parts of a pitch, and whether they are on the crest.
struct Corner {
  Scalar place;
  bool is_crest;
};
constexpr std::array<Corner, 4> kCorners{{{0, false}, {0.35, true}, {0.5, true}, {0.85, false}}};

struct Mesh {
  std::vector<Vector3> vertices;
  std::vector<std::array<int, 3>> triangles;
  bool is_inside_out = false;  // for the triangles that are added next

  int add(Scalar radius, int column, Scalar z) {
    const Scalar angle = kWholeTurn * column / kColumns;
    vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    return int(vertices.size()) - 1;
  }
  void add_triangle(int a, int b, int c) {
    if (is_inside_out) std::swap(b, c);
    triangles.push_back({a, b, c});
  }
  void add_quad(int a, int b, int c, int d) {
    add_triangle(a, b, c);
    add_triangle(a, c, d);
  }
};

// Vertices at one height, one for each column.
using Ring = std::array<int, kColumns>;

Ring add_circle(Mesh& mesh, Scalar radius, Scalar z) {
  Ring ring;
  for (int i = 0; i < kColumns; ++i) ring[std::size_t(i)] = mesh.add(radius, i, z);
  return ring;
}

Ring add_hexagon(Mesh& mesh, Scalar corner_radius, Scalar z) {
  constexpr int kSide = kColumns / 6;
  Ring ring;
  for (int i = 0; i < kColumns; ++i) {
    const Scalar from_middle = kWholeTurn * (i % kSide - kSide / 2.0) / kColumns;
    const Scalar radius = corner_radius * std::cos(kWholeTurn / 12) / std::cos(from_middle);
    ring[std::size_t(i)] = mesh.add(radius, i, z);
  }
  return ring;
}

// Between two rings; seen from outside `to` is above `from`, or further inside.
void join(Mesh& mesh, const Ring& from, const Ring& to) {
  for (std::size_t i = 0; i < kColumns; ++i) {
    const std::size_t next = (i + 1) % kColumns;
    mesh.add_quad(from[i], from[next], to[next], to[i]);
  }
}

void close(Mesh& mesh, const Ring& ring, bool is_top) {
  const int middle = mesh.add(0, 0, mesh.vertices[std::size_t(ring[0])].z());
  for (std::size_t i = 0; i < kColumns; ++i) {
    const std::size_t next = (i + 1) % kColumns;
    if (is_top) mesh.add_triangle(middle, ring[i], ring[next]);
    if (!is_top) mesh.add_triangle(middle, ring[next], ring[i]);
  }
}

struct Thread {
  Scalar low;   // radius of root
  Scalar high;  // and crest
  Scalar end;   // radius at both ends, low or high
  int turns;    // the first and the last are without thread
};

// Radius of a corner: the thread begins and ends gently.
Scalar radius_at(const Thread& thread, const Corner& corner, Scalar turn) {
  constexpr Scalar kWithout = 1.25;
  const Scalar from_end = std::min(turn, thread.turns - turn);
  const Scalar part = std::clamp<Scalar>(2 * (from_end - kWithout), 0, 1);
  const Scalar full = corner.is_crest ? thread.high : thread.low;
  return thread.end + part * (full - thread.end);
}

// Adds a threaded cylinder from z = 0 to the thread's turns, between two rings. Its columns of
// corners follow the helix, so the last column meets the first, one turn higher.
void add_thread(Mesh& mesh, const Thread& thread, const Ring& bottom, const Ring& top) {
  constexpr int kTurn = int(kCorners.size());
  const int count = kTurn * (thread.turns - 1);
  std::vector<std::array<int, kColumns>> at(static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k) {
    const Corner& corner = kCorners[std::size_t(k % kTurn)];
    for (int i = 0; i < kColumns; ++i) {
      // Half a place up, so that no corner is on the ring.
      const Scalar turn = k / kTurn + corner.place + Scalar(i + 0.5) / kColumns;
      at[std::size_t(k)][std::size_t(i)] =
          mesh.add(radius_at(thread, corner, turn), i, kThreadPitch * turn);
    }
  }
  for (std::size_t i = 0; i + 1 < kColumns; ++i) {
    mesh.add_quad(bottom[i], bottom[i + 1], at[0][i + 1], at[0][i]);
    for (std::size_t k = 0; k + 1 < at.size(); ++k) {
      mesh.add_quad(at[k][i], at[k][i + 1], at[k + 1][i + 1], at[k + 1][i]);
    }
    mesh.add_quad(at.back()[i], at.back()[i + 1], top[i + 1], top[i]);
  }
  // The seam.
  const auto first = [&](int k) { return at[std::size_t(k)][0]; };
  const auto last = [&](int k) { return at[std::size_t(k)][kColumns - 1]; };
  mesh.add_triangle(bottom.back(), bottom[0], first(0));
  for (int k = 0; k < kTurn; ++k) mesh.add_triangle(bottom.back(), first(k), first(k + 1));
  mesh.add_triangle(bottom.back(), first(kTurn), last(0));
  for (int k = 0; k + 1 + kTurn < count; ++k) {
    mesh.add_quad(last(k), first(k + kTurn), first(k + kTurn + 1), last(k + 1));
  }
  for (int k = count - kTurn - 1; k + 1 < count; ++k) {
    mesh.add_triangle(top[0], last(k + 1), last(k));
  }
  mesh.add_triangle(top[0], last(count - kTurn - 1), first(count - 1));
  mesh.add_triangle(top[0], top.back(), last(count - 1));
}

// Its head is below z = 0.
std::string bolt_obj(int turns) {
  constexpr Scalar kHead = 1.7, kHeadHeight = 0.6;
  Mesh mesh;
  const Ring under = add_hexagon(mesh, kHead, -kHeadHeight);
  const Ring head = add_hexagon(mesh, kHead, 0);
  const Ring neck = add_circle(mesh, kRoot, 0);
  const Ring end = add_circle(mesh, kRoot, kThreadPitch * turns);
  close(mesh, under, false);
  join(mesh, under, head);
  join(mesh, head, neck);
  add_thread(mesh, {kRoot, kCrest, kRoot, turns}, neck, end);
  close(mesh, end, true);
  return obj_text(mesh.vertices, mesh.triangles);
}

std::string nut_obj(int turns) {
  constexpr Scalar kCorner = 1.7;
  Mesh mesh;
  const Scalar height = kThreadPitch * turns;
  const Ring outer_bottom = add_hexagon(mesh, kCorner, 0);
  const Ring outer_top = add_hexagon(mesh, kCorner, height);
  const Ring bottom = add_circle(mesh, kCrest + kPlay, 0);
  const Ring top = add_circle(mesh, kCrest + kPlay, height);
  join(mesh, outer_bottom, outer_top);
  join(mesh, outer_top, top);
  join(mesh, bottom, outer_bottom);
  mesh.is_inside_out = true;
  add_thread(mesh, {kRoot + kPlay, kCrest + kPlay, kCrest + kPlay, turns}, bottom, top);
  return obj_text(mesh.vertices, mesh.triangles);
}

}  // namespace

GeneratedScene make_bolt(int n) {
  constexpr int kNutTurns = 5;
  SceneBuilder builder("A torque runs a nut down a bolt", 5);
  const int turns = n + kNutTurns;
  builder.add_mesh("bolt.obj", bolt_obj(turns));
  builder.add_mesh("nut.obj", nut_obj(kNutTurns));
  builder.add_static_body("bolt", mesh_shape("bolt.obj"), Vector3::Zero());
  // Turned and lifted by whole turns, the threads are in the middle of their play.
  builder.add_body("nut", mesh_shape("nut.obj"), {0, 0, kThreadPitch * n});
  builder.set_friction(0.1);
  builder.root()["forces"]["wrenches"] = {{{"body", "nut"}, {"torque", {0, 0, -40000}}}};
  return builder.finish();
}

// Hanging and linked bodies: chain net, gears, Newton's cradle.
namespace {

constexpr Scalar kHalfTurn = std::numbers::pi_v<Scalar>;

// A torus about z.
std::string torus_obj(Scalar radius, Scalar tube_radius, int around, int across) {
  std::vector<Vector3> vertices;
  std::vector<std::array<int, 3>> triangles;
  for (int i = 0; i < around; ++i) {
    const Scalar u = 2 * kHalfTurn * i / around;
    for (int j = 0; j < across; ++j) {
      const Scalar v = 2 * kHalfTurn * j / across;
      const Scalar r = radius + tube_radius * std::cos(v);
      vertices.emplace_back(r * std::cos(u), r * std::sin(u), tube_radius * std::sin(v));
      const int a = i * across + j, b = i * across + (j + 1) % across;
      const int c = (i + 1) % around * across + j, d = (i + 1) % around * across + (j + 1) % across;
      triangles.push_back({a, c, d});
      triangles.push_back({a, d, b});
    }
  }
  return obj_text(vertices, triangles);
}

struct GearSize {
  int teeth = 20;
  Scalar pitch_radius = 1;
  Scalar pressure_angle = kHalfTurn / 9;
  Scalar play = 0.06;  // fraction of a pitch left free
};

// Half the angle of an involute tooth at radius r.
Scalar half_tooth(const GearSize& gear, Scalar r) {
  const Scalar base = gear.pitch_radius * std::cos(gear.pressure_angle);
  const auto involute = [](Scalar a) { return std::tan(a) - a; };
  const Scalar at_r = r > base ? involute(std::acos(base / r)) : 0;
  return kHalfTurn / (2 * gear.teeth) * (1 - gear.play) + involute(gear.pressure_angle) - at_r;
}

// The outline of a gear with a tooth at angle 0, counterclockwise.
std::vector<Vector3> gear_outline(const GearSize& gear) {
  constexpr int kFlankPoints = 6;
  const Scalar module = 2 * gear.pitch_radius / gear.teeth;
  const Scalar root = gear.pitch_radius - 1.25 * module;
  const Scalar low = std::max(root, gear.pitch_radius * std::cos(gear.pressure_angle));
  const Scalar high = gear.pitch_radius + module;
  std::vector<Vector3> outline;
  const auto add = [&](Scalar r, Scalar angle) {
    outline.emplace_back(r * std::cos(angle), r * std::sin(angle), 0);
  };
  for (int tooth = 0; tooth < gear.teeth; ++tooth) {
    const Scalar middle = 2 * kHalfTurn * tooth / gear.teeth;
    add(root, middle - half_tooth(gear, root));
    for (int side = -1; side <= 1; side += 2) {
      for (int k = 0; k < kFlankPoints; ++k) {
        const int place = side < 0 ? k : kFlankPoints - 1 - k;
        const Scalar r = low + (high - low) * place / (kFlankPoints - 1);
        add(r, middle + side * half_tooth(gear, r));
      }
    }
    add(root, middle + half_tooth(gear, root));
  }
  return outline;
}

// The outline extruded along z; every point of it is visible from the axis.
std::string gear_obj(const GearSize& gear, Scalar half_width) {
  std::vector<Vector3> vertices = gear_outline(gear);
  const int n = int(vertices.size());
  for (int k = 0; k < n; ++k) {
    vertices[std::size_t(k)].z() = -half_width;
    vertices.push_back(vertices[std::size_t(k)] + Vector3(0, 0, 2 * half_width));
  }
  vertices.emplace_back(0, 0, -half_width);
  vertices.emplace_back(0, 0, half_width);
  // The lower points were copied one by one, so the upper ones follow in the same order.
  std::vector<std::array<int, 3>> triangles;
  for (int k = 0; k < n; ++k) {
    const int next = (k + 1) % n;
    triangles.push_back({2 * n, next, k});
    triangles.push_back({2 * n + 1, n + k, n + next});
    triangles.push_back({k, next, n + next});
    triangles.push_back({k, n + next, n + k});
  }
  return obj_text(vertices, triangles);
}

}  // namespace

GeneratedScene make_chain_net(int n) {
  constexpr Scalar kRadius = 1, kTube = 0.15;
  constexpr Scalar kToLinked = 1.3;  // between the centres of two linked rings
  constexpr int kAround = 32, kAcross = 12;
  SceneBuilder builder("A net of rings, held at its corners", 3);
  builder.add_mesh("ring.obj", torus_obj(kRadius, kTube, kAround, kAcross));
  const auto place = [&](Scalar i, Scalar j) {
    return Vector3(2 * kToLinked * (i - Scalar(n - 1) / 2), 2 * kToLinked * (j - Scalar(n - 1) / 2),
                   0);
  };
  const auto name = [](const char* word, int i, int j) {
    return word + std::to_string(i) + " " + std::to_string(j);
  };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const bool is_corner = (i == 0 || i == n - 1) && (j == 0 || j == n - 1);
      const Json shape = mesh_shape("ring.obj");
      if (is_corner) builder.add_static_body(name("ring ", i, j), shape, place(i, j));
      if (!is_corner) builder.add_body(name("ring ", i, j), shape, place(i, j));
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j + 1 < n; ++j) {
      const Json shape = mesh_shape("ring.obj");
      Json& along_x = builder.add_body(name("link x ", j, i), shape, place(j + 0.5, i));
      along_x["pose"]["axis_angle"] = turn_json({1, 0, 0}, 90);
      Json& along_y = builder.add_body(name("link y ", i, j), shape, place(i, j + 0.5));
      along_y["pose"]["axis_angle"] = turn_json({0, 1, 0}, 90);
    }
  }
  builder.set_friction(0.2);
  return builder.finish();
}

GeneratedScene make_gears(int n) {
  constexpr Scalar kHalfWidth = 0.15;
  const GearSize gear;
  SceneBuilder builder("A torque drives a train of gears", 3);
  builder.add_mesh("gear.obj", gear_obj(gear, kHalfWidth));
  for (int k = 0; k < n; ++k) {
    Json& body = builder.add_body("gear " + std::to_string(k), mesh_shape("gear.obj"),
                                  {2 * gear.pitch_radius * k, 0, 0});
    body["locked"] = {{"translation", {true, true, true}}, {"rotation", {true, true, false}}};
    // A gap where the previous gear has a tooth.
    if (k % 2 == 1) body["pose"]["axis_angle"] = turn_json({0, 0, 1}, 180.0 / gear.teeth);
  }
  builder.set_friction(0.1);
  builder.root()["forces"]["wrenches"] = {{{"body", "gear 0"}, {"torque", {0, 0, 500}}}};
  return builder.finish();
}

GeneratedScene make_cradle(int n) {
  constexpr Scalar kRadius = 0.25, kLength = 2, kDegrees = 30;
  constexpr Scalar kHalfBeam = 0.1;
  // A small gap: a blow then passes from ball to ball. Touching balls would share it.
  constexpr Scalar kBetweenBalls = 0.002;
  const Scalar pitch = 2 * kRadius + kBetweenBalls;
  SceneBuilder builder("Newton's cradle", 10);
  builder.add_static_body("beam", box_shape({1 + pitch * n / 2, kHalfBeam, kHalfBeam}),
                          {pitch * (n - 1) / 2, 0, kLength + kHalfBeam});
  Json joints = Json::array();
  for (int k = 0; k < n; ++k) {
    const Scalar angle = k == 0 ? kDegrees * kHalfTurn / 180 : 0;
    const std::string name = "ball " + std::to_string(k);
    Json& ball = builder.add_body(
        name, sphere_shape(kRadius),
        {pitch * k - kLength * std::sin(angle), 0, kLength * (1 - std::cos(angle))});
    ball["restitution"] = 1;
    joints.push_back({{"kind", "hinge"},
                      {"a", "beam"},
                      {"b", name},
                      {"point", {pitch * k, 0, kLength}},
                      {"axis", {0, 1, 0}}});
  }
  builder.set_friction(0);
  builder.root()["joints"] = std::move(joints);
  return builder.finish();
}

// Boxes on top of each other: stack, pyramid, wall, pile.
namespace {

constexpr Scalar kCubeHalf = 0.5;

std::string numbered(const std::string& word, int number) {
  return word + " " + std::to_string(number);
}

// The height of the centre of a body of half height `half` in the given course, counted from 0.
Scalar course_height(int course, Scalar half, Scalar gap = kGeneratedGap) {
  return half + gap + course * (2 * half + gap);
}

// A number in [0, 1) that looks random, the same on all machines.
Scalar scattered(int k) {
  // literal: the golden ratio spreads its multiples evenly
  const Scalar value = k * 0.6180339887498949;
  return value - std::floor(value);
}

// A floor and four walls of half height `height` around a square of half side `half`.
void add_pit(SceneBuilder& builder, Scalar half, Scalar height) {
  builder.add_floor(Vector3::Zero(), half + 1, half + 1);
  for (const Scalar sign : {-1.0, 1.0}) {
    const std::string which = sign < 0 ? " 0" : " 1";
    builder.add_static_body("wall x" + which, box_shape({0.5, half + 1, height}),
                            {sign * (half + 0.5), 0, height});
    builder.add_static_body("wall y" + which, box_shape({half + 1, 0.5, height}),
                            {0, sign * (half + 0.5), height});
  }
}

// Bodies in layers of side x side, `pitch` apart, from the floor of a pit of this side up.
struct PitPlace {
  int number;
  int side;
  Scalar pitch;
  Scalar jitter = 0;  // to the sides, as a fraction of the pitch
};

// Turned as if by chance.
void add_above_pit(SceneBuilder& builder, const std::string& name, Json shape,
                   const PitPlace& place) {
  const int k = place.number, side = place.side;
  const Scalar half = place.pitch * side / 2;
  const Vector3 cell(k % side, k / side % side, k / (side * side));
  const Vector3 aside =
      place.jitter * Vector3(2 * scattered(5 * k) - 1, 2 * scattered(8 * k) - 1, 0);
  const Vector3 p = place.pitch * (cell + Vector3::Constant(0.5) + aside) - Vector3(half, half, 0);
  Json& body = builder.add_body(name, std::move(shape), p);
  const Vector3 axis(scattered(3 * k + 1) - 0.5, scattered(3 * k + 2) - 0.5, 1);
  body["pose"]["axis_angle"] = turn_json(axis, 360 * scattered(7 * k + 3));
}

}  // namespace

GeneratedScene make_stack(int n) {
  SceneBuilder builder("A stack of cubes", 5);
  builder.add_floor(Vector3::Zero(), 2, 2);
  for (int k = 0; k < n; ++k) {
    builder.add_body(numbered("cube", k), box_shape(Vector3::Constant(kCubeHalf)),
                     {0, 0, course_height(k, kCubeHalf)});
  }
  return builder.finish();
}

GeneratedScene make_pyramid(int n) {
  constexpr Scalar kPitch = 1.1;  // of the cubes in a course
  SceneBuilder builder("A pyramid of cubes", 5);
  builder.add_floor(Vector3::Zero(), 2 + kPitch * n / 2, 2);
  for (int course = 0, number = 0; course < n; ++course) {
    for (int k = 0; k < n - course; ++k, ++number) {
      builder.add_body(
          numbered("cube", number), box_shape(Vector3::Constant(kCubeHalf)),
          {kPitch * (k - Scalar(n - course - 1) / 2), 0, course_height(course, kCubeHalf)});
    }
  }
  return builder.finish();
}

GeneratedScene make_wall(int n) {
  // Larger than usual: a strike is solved to parts of the rest offset.
  constexpr Scalar kTarget = 10 * kGeneratedTarget;
  constexpr Scalar kGap = 10 * kGeneratedGap;
  const Vector3 half(0.5, 0.25, 0.25);
  const Scalar pitch = 2 * half.x() + kGap;
  const Scalar half_brick = (half.x() - kGap / 2) / 2;
  const Scalar end = n * pitch;  // of the wall, from its middle
  SceneBuilder builder("A ball strikes a wall of bricks", 3);
  builder.set_lengths(kTarget, kGap - kTarget);
  builder.add_floor(Vector3::Zero(), end + 5, 15);
  for (int course = 0, number = 0; course < n; ++course) {
    const Scalar z = course_height(course, half.z(), kGap);
    const bool is_offset = course % 2 == 1;
    for (int k = 0; k < 2 * n - int(is_offset); ++k, ++number) {
      builder.add_body(numbered("brick", number), box_shape(half),
                       {(k + (is_offset ? 1 : 0.5)) * pitch - end, 0, z});
    }
    if (!is_offset) continue;
    const Scalar x = end - kGap / 2 - half_brick;
    for (const Scalar side : {-x, x}) {
      builder.add_body(numbered("half brick", number++),
                       box_shape({half_brick, half.y(), half.z()}), {side, 0, z});
    }
  }
  const Scalar radius = 0.25 + 0.05 * n;
  Json& ball = builder.add_body("ball", sphere_shape(radius),
                                {0, -3 - radius, std::max(0.5 * half.z() * n, radius + 0.25)});
  ball["density"] = 5000;
  ball["velocity"] = {{"linear", {0, 12, 0}}};
  return builder.finish();
}

GeneratedScene make_pile(int n) {
  constexpr Scalar kPitch = 2;  // more than the diagonal of a cube
  const int side = std::max(1, int(std::ceil(std::cbrt(Scalar(n)))));
  SceneBuilder builder("Cubes fall into a pit", 5);
  add_pit(builder, kPitch * side / 2, kPitch * side / 2 + 1);
  for (int k = 0; k < n; ++k) {
    add_above_pit(builder, numbered("cube", k), box_shape(Vector3::Constant(kCubeHalf)),
                  {k, side, kPitch});
  }
  return builder.finish();
}

// Crowds in a pit, ragdolls and a rope.
namespace {

// Straight columns of balls would stand.
constexpr Scalar kJitter = 0.02;

// A pit that half of a cube of n bodies fits in, `pitch` apart: they lie several layers deep.
int narrow_side(int n) {
  return std::max(1, int(std::ceil(std::cbrt(Scalar(n) / 2))));
}

// Points on an ellipsoid about its middle, 20 to 60 of them.
std::vector<Vector3> pebble(int number) {
  const int count = 20 + number % 41;
  std::vector<Vector3> points;
  for (int i = 0; i < count; ++i) {
    // Evenly over the height, and turned by the golden angle: a spiral over the sphere.
    const Scalar z = (2 * i + 1 - Scalar(count)) / count;
    const Scalar angle = 2 * kHalfTurn * scattered(i + number);
    const Scalar around = std::sqrt(1 - z * z);
    const Vector3 p(around * std::cos(angle), around * std::sin(angle), z);
    points.push_back(Vector3(0.55, 0.5, 0.42).cwiseProduct(p));
  }
  return points;
}

Json capsule_shape(Scalar radius, Scalar half_length) {
  return {{"capsule", {{"radius", radius}, {"half_length", half_length}}}};
}

Json ball_joint(const std::string& a, const std::string& b, const Vector3& p_W) {
  return {{"kind", "ball"}, {"a", a}, {"b", b}, {"point", vector_json(p_W)}};
}

// A trunk, upright at p_W, with a head, two arms and two legs.
void add_ragdoll(SceneBuilder& builder, const std::string& name, const Vector3& p_W, Json& joints) {
  const std::string trunk = name + " trunk";
  builder.add_body(trunk, capsule_shape(0.15, 0.25), p_W);
  const auto add_limb = [&](const std::string& word, Json shape, const Vector3& p, bool is_level,
                            const Vector3& joint) {
    Json& body = builder.add_body(name + " " + word, std::move(shape), p_W + p);
    if (is_level) body["pose"]["axis_angle"] = turn_json(Vector3::UnitY(), 90);
    joints.push_back(ball_joint(trunk, name + " " + word, p_W + joint));
  };
  add_limb("head", capsule_shape(0.12, 0.05), {0, 0, 0.62}, false, {0, 0, 0.42});
  for (const Scalar side : {-1.0, 1.0}) {
    const std::string which = side < 0 ? " 0" : " 1";
    add_limb("arm" + which, capsule_shape(0.07, 0.25), {side * 0.56, 0, 0.25}, true,
             {side * 0.2, 0, 0.25});
    add_limb("leg" + which, capsule_shape(0.09, 0.35), {side * 0.12, 0, -0.9}, false,
             {side * 0.12, 0, -0.42});
  }
}

}  // namespace

GeneratedScene make_spheres(int n) {
  constexpr Scalar kRadius = 0.5, kPitch = 1.1;
  const int side = narrow_side(n);
  SceneBuilder builder("Balls are poured into a pit", 5);
  add_pit(builder, kPitch * side / 2, kPitch * (1 + n / (side * side)) / 2);
  for (int k = 0; k < n; ++k) {
    add_above_pit(builder, numbered("ball", k), sphere_shape(kRadius), {k, side, kPitch, kJitter});
  }
  return builder.finish();
}

GeneratedScene make_hulls(int n) {
  constexpr Scalar kPitch = 1.2;  // more than the diameter of a pebble
  const int side = narrow_side(n);
  SceneBuilder builder("Pebbles are poured into a pit", 5);
  add_pit(builder, kPitch * side / 2, kPitch * (1 + n / (side * side)) / 2);
  for (int k = 0; k < n; ++k) {
    add_above_pit(builder, numbered("pebble", k), hull_shape(pebble(k)),
                  {k, side, kPitch, kJitter});
  }
  return builder.finish();
}

GeneratedScene make_ragdolls(int n) {
  const int side = std::max(1, int(std::ceil(std::cbrt(Scalar(n)))));
  SceneBuilder builder("Ragdolls fall to the floor", 4);
  builder.add_floor(Vector3::Zero(), 3 + 1.1 * side, 3 + 0.6 * side);
  Json joints = Json::array();
  for (int k = 0; k < n; ++k) {
    // Staggered, so that those above do not fall straight onto those below.
    const Vector3 place(2.2 * (k % side - Scalar(side - 1) / 2),
                        1.2 * (k / side % side - Scalar(side - 1) / 2),
                        1.8 + 2.6 * (k / side / side));
    add_ragdoll(builder, numbered("doll", k),
                place + Vector3(0.4 * scattered(3 * k + 1), 0.2 * scattered(3 * k + 2), 0), joints);
  }
  builder.root()["joints"] = std::move(joints);
  return builder.finish();
}

GeneratedScene make_rope(int n) {
  constexpr Scalar kRadius = 0.04, kHalf = 0.1;
  constexpr Scalar kBall = 0.25;  // its mass is about 60 times a link's
  SceneBuilder builder("A rope swings a heavy ball", 5);
  const Scalar z = 2 * kHalf * n + 2;
  builder.add_floor(Vector3::Zero(), z, z);
  builder.add_static_body("hook", sphere_shape(kRadius), {-2 * kRadius, 0, z});
  Json joints = Json::array();
  std::string previous = "hook";
  for (int k = 0; k < n; ++k) {
    const std::string name = numbered("link", k);
    Json& link = builder.add_body(name, capsule_shape(kRadius, kHalf - kRadius),
                                  {2 * kHalf * (k + 0.5), 0, z});
    link["pose"]["axis_angle"] = turn_json(Vector3::UnitY(), 90);
    joints.push_back(ball_joint(previous, name, {2 * kHalf * k, 0, z}));
    previous = name;
  }
  const Scalar end = 2 * kHalf * n;
  builder.add_body("ball", sphere_shape(kBall), {end + kBall + kRadius, 0, z});
  joints.push_back(ball_joint(previous, "ball", {end, 0, z}));
  builder.root()["joints"] = std::move(joints);
  return builder.finish();
}

// Structures held by friction and shape: arch, card house, dominoes.
namespace {

// The stone of an arch between two joints at these angles from the x axis; half a gap is left on
// either side, a whole one at a foot.
struct ArchStone {
  Scalar begin = 0, end = 0;
  Scalar begin_gap = 0, end_gap = 0;
};

// Corners in the plane x, z: those of the first joint, then those of the second.
std::array<Vector3, 4> corners(const ArchStone& stone, Scalar inner, Scalar outer) {
  const auto corner = [](Scalar angle, Scalar radius, Scalar offset) {
    const Vector3 along(std::cos(angle), 0, std::sin(angle));
    const Vector3 across(-std::sin(angle), 0, std::cos(angle));
    return Vector3(radius * along + offset * across);
  };
  return {corner(stone.begin, inner, stone.begin_gap), corner(stone.begin, outer, stone.begin_gap),
          corner(stone.end, inner, -stone.end_gap), corner(stone.end, outer, -stone.end_gap)};
}

void add_stone(SceneBuilder& builder, const std::string& name,
               const std::array<Vector3, 4>& corners_W) {
  constexpr Scalar kHalfWidth = 0.25;
  Vector3 middle = Vector3::Zero();
  for (const Vector3& corner : corners_W) middle += corner / 4;
  std::vector<Vector3> points;
  for (const Vector3& corner : corners_W) {
    for (const Scalar y : {-kHalfWidth, kHalfWidth}) {
      points.push_back(corner - middle + Vector3(0, y, 0));
    }
  }
  builder.add_body(name, hull_shape(points), middle);
}

}  // namespace

GeneratedScene make_arch(int n) {
  constexpr Scalar kInner = 2, kOuter = 2.6;
  SceneBuilder builder("An arch of stones", 5);
  builder.add_floor(Vector3::Zero(), kOuter + 1, 1);
  const Scalar turn = std::numbers::pi_v<Scalar> / n;
  for (int k = 0; k < n; ++k) {
    ArchStone stone{k * turn, (k + 1) * turn, kGeneratedGap / 2, kGeneratedGap / 2};
    if (k == 0) stone.begin_gap = kGeneratedGap;
    if (k == n - 1) stone.end_gap = kGeneratedGap;
    add_stone(builder, "stone " + std::to_string(k), corners(stone, kInner, kOuter));
  }
  builder.set_friction(0.7);
  return builder.finish();
}

GeneratedScene make_cards(int n) {
  constexpr Scalar kHalfLength = 0.5, kHalfWidth = 0.35, kHalfThickness = 0.01;
  constexpr Scalar kDegrees = 70;  // from the floor
  constexpr Scalar kBetweenFeet = 0.02;
  const Scalar angle = kDegrees * std::numbers::pi_v<Scalar> / 180;
  const Scalar cosine = std::cos(angle), sine = std::sin(angle);
  // Half the extent of a leaning card, along and up.
  const Scalar reach = kHalfLength * cosine + kHalfThickness * sine;
  const Scalar rise = kHalfLength * sine + kHalfThickness * cosine;
  const Scalar pitch = 4 * reach + kGeneratedGap + kBetweenFeet;  // of the pairs in a level
  const Vector3 card(kHalfLength, kHalfWidth, kHalfThickness);
  const Vector3 flat((pitch - kGeneratedGap) / 2, kHalfWidth, kHalfThickness);
  SceneBuilder builder("A house of cards", 5);
  builder.add_floor(Vector3::Zero(), 1 + pitch * n / 2, 2);
  Scalar base = 0;  // height of the base of the level
  int number = 0;
  for (int level = 0; level < n; ++level) {
    const int pairs = n - level;
    for (int k = 0; k < pairs; ++k) {
      const Scalar middle = pitch * (k - Scalar(pairs - 1) / 2);
      for (const Scalar side : {-1.0, 1.0}) {
        Json& body = builder.add_body(
            "card " + std::to_string(number++), box_shape(card),
            {middle + side * (reach + kGeneratedGap / 2), 0, base + kGeneratedGap + rise});
        body["pose"]["axis_angle"] = turn_json({0, 1, 0}, side * kDegrees);
      }
    }
    base += 2 * (kGeneratedGap + rise);
    for (int k = 0; k < pairs - 1; ++k) {
      builder.add_body("card " + std::to_string(number++), box_shape(flat),
                       {pitch * (k - Scalar(pairs - 2) / 2), 0, base + kHalfThickness});
    }
    base += 2 * kHalfThickness;
  }
  builder.set_friction(0.6);
  return builder.finish();
}

GeneratedScene make_domino(int n) {
  const Vector3 half(0.05, 0.25, 0.5);
  constexpr Scalar kPitch = 0.5;
  constexpr Scalar kRadius = 0.15;
  SceneBuilder builder("A ball tips a row of dominoes", 2 + 0.2 * n);
  builder.add_floor({kPitch * n / 2, 0, 0}, 3 + kPitch * n / 2, 1);
  for (int k = 0; k < n; ++k) {
    builder.add_body("domino " + std::to_string(k), box_shape(half),
                     {kPitch * k, 0, half.z() + kGeneratedGap});
  }
  Json& ball = builder.add_body("ball", sphere_shape(kRadius), {-0.5, 0, 0.85});
  ball["velocity"] = {{"linear", {3, 0, 0}}};
  builder.set_friction(0.4);
  return builder.finish();
}

}  // namespace dyop::io_internal
