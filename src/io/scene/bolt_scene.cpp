// SPDX-License-Identifier: BSD-3-Clause

// A nut that a torque runs down a bolt, until it is tight.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "io/scene/scene_builder.h"

namespace dyop::io_internal {
namespace {

constexpr Scalar kWholeTurn = 2 * std::numbers::pi_v<Scalar>;

constexpr Scalar kPitch = 0.4;  // of a right-handed thread
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
          mesh.add(radius_at(thread, corner, turn), i, kPitch * turn);
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
  const Ring end = add_circle(mesh, kRoot, kPitch * turns);
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
  const Scalar height = kPitch * turns;
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
  builder.add_body("nut", mesh_shape("nut.obj"), {0, 0, kPitch * n});
  builder.set_friction(0.1);
  builder.root()["forces"]["wrenches"] = {{{"body", "nut"}, {"torque", {0, 0, -40000}}}};
  return builder.finish();
}

}  // namespace dyop::io_internal
