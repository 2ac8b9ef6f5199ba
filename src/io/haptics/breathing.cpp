// SPDX-License-Identifier: BSD-3-Clause
#include "io/haptics/breathing.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

namespace dyop::io_internal {
namespace {

// What is left of the obstacle from a snapshot on.
struct Cut {
  std::int64_t number;
  std::vector<TriangleIndices> triangles;
};

// A formula for every snapshot, whichever were asked for before.
struct Breathing {
  Scalar frequency;
  Vector3 amplitude;
  Scalar period;  // of snapshots
  std::vector<Vector3> rest;
  std::vector<Cut> cuts;

  // Every vertex oscillates, with a lag that grows along the mesh.
  void place(std::int64_t number, std::span<Vector3> shape) const {
    const Scalar phase = 2 * std::numbers::pi * frequency * period * Scalar(number);
    constexpr Scalar kLag = 0.005;  // radians per millimetre
    for (std::size_t k = 0; k < shape.size(); ++k) {
      const Vector3& p = rest[k];
      const Scalar lag = kLag * p.x();
      shape[k] = p + amplitude * (std::sin(phase - lag) + std::sin(lag));
    }
  }

  // Where the snapshot before put them; all vertices, so that the formula goes on.
  std::optional<TissueMesh> cut(std::int64_t number) const {
    const auto found = std::find_if(cuts.begin(), cuts.end(),
                                    [&](const Cut& cut) { return cut.number == number; });
    if (found == cuts.end()) return std::nullopt;
    TissueMesh mesh{rest, found->triangles};
    place(number - 1, mesh.vertices);
    return mesh;
  }
};

// Takes away the triangles that have a corner in a ball, as the obstacle stands at the start.
Cut read_cut(const JsonNode& node, const Breathing& before,
             const std::vector<TriangleIndices>& triangles) {
  node.require_object({"t", "position", "radius"});
  const JsonNode time = node.at("t");
  const std::int64_t last = before.cuts.empty() ? 0 : before.cuts.back().number;
  // No run has as many snapshots as that.
  constexpr Scalar kMostSnapshots = 1e15;
  const Scalar number = std::round(time.positive_number() / before.period);
  if (!(number > Scalar(last) && number < kMostSnapshots)) {
    time.fail("cuts must be at least a snapshot apart, and after the first");
  }
  const Vector3 center = node.at("position").vector3();
  const Scalar radius = node.at("radius").positive_number();
  Cut cut{std::int64_t(number), triangles};
  std::erase_if(cut.triangles, [&](const TriangleIndices& corners) {
    return std::any_of(corners.begin(), corners.end(), [&](std::int32_t corner) {
      return (before.rest[std::size_t(corner)] - center).norm() < radius;
    });
  });
  if (cut.triangles.size() == triangles.size()) node.fail("no triangle has a corner in the ball");
  if (cut.triangles.empty()) node.fail("nothing is left of the obstacle");
  return cut;
}

}  // namespace

TissueFeed read_breathing(const JsonNode& node, std::size_t obstacle,
                          const std::vector<Vector3>& vertices,
                          const std::vector<TriangleIndices>& triangles) {
  node.require_object({"frequency", "amplitude", "rate", "cuts"});
  const auto breathing = std::make_shared<Breathing>();
  breathing->frequency = node.at("frequency").positive_number();
  breathing->amplitude = node.at("amplitude").vector3();
  breathing->period = 1 / node.at("rate").positive_number();
  breathing->rest = vertices;
  if (node.has("cuts")) {
    for (const JsonNode& item : node.at("cuts").items(1)) {
      const auto& cuts = breathing->cuts;
      breathing->cuts.push_back(
          read_cut(item, *breathing, cuts.empty() ? triangles : cuts.back().triangles));
    }
  }
  TissueFeed feed;
  feed.obstacle = obstacle;
  feed.period = breathing->period;
  feed.formula = node.value().dump();
  feed.shape = [breathing](std::int64_t number, std::span<Vector3> shape) {
    breathing->place(number, shape);
  };
  if (!breathing->cuts.empty()) {
    feed.cut = [breathing](std::int64_t number) { return breathing->cut(number); };
  }
  return feed;
}

}  // namespace dyop::io_internal
