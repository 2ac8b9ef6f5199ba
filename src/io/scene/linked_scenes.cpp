// SPDX-License-Identifier: BSD-3-Clause

// Hanging and linked bodies: chain net, gears, Newton's cradle.
#include <cmath>
#include <numbers>

#include "io/scene/scene_builder.h"

namespace dyop::io_internal {
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

}  // namespace dyop::io_internal
