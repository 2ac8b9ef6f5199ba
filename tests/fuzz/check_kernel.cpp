// SPDX-License-Identifier: BSD-3-Clause

// The kernel that dyop-check trusts: two bodies of a few triangles, one of which may deform, in two
// motions of any kind. Where it says "proven" they are as far apart, at many times, as dyop's own
// distances say, with which it shares no code; where it says "refuted" they are as near.

#include <algorithm>

#include "check/trusted/kernel.h"
#include "check/trusted/segments.h"
#include "dyop/core/error.h"
#include "dyop/distance/distance.h"
#include "dyop/geometry/triangle_mesh.h"
#include "fuzz/fuzz_motion.h"
#include "io/motion_json.h"

namespace dyop::fuzz {
namespace {

constexpr int kSamples = 17;
constexpr std::int64_t kNodePairs = 3000;
constexpr MotionLimits kLimits{16, 2};

dyop_check::Vec plain(const Vector3& v) {
  return {v.x(), v.y(), v.z()};
}

std::vector<dyop_check::Vec> plain(const std::vector<Vector3>& points) {
  std::vector<dyop_check::Vec> all;
  for (const Vector3& point : points) all.push_back(plain(point));
  return all;
}

// For dyop and for the checker.
struct Side {
  std::vector<Vector3> from;
  std::vector<Vector3> to;  // the same unless it deforms
  std::vector<TriangleIndices> triangles;
  Scalar radius = 0;  // around the triangles
  std::shared_ptr<const Motion> motion;
  dyop_check::Body body;
  dyop_check::Segment segment;

  TriangleMesh at(Scalar part) const {
    std::vector<Vector3> vertices = from;
    for (std::size_t k = 0; k < from.size(); ++k) vertices[k] += part * (to[k] - from[k]);
    return TriangleMesh(std::move(vertices), triangles);
  }
};

void make_body(const TimeInterval& span, bool deforms, Side& side) {
  std::vector<std::int32_t> corners;
  for (const TriangleIndices& t : side.triangles) {
    dyop_check::Piece& piece = side.body.pieces.emplace_back();
    piece.radius = side.radius;
    for (const std::int32_t corner : t) {
      piece.points.push_back(plain(side.from[std::size_t(corner)]));
      corners.push_back(corner);
    }
  }
  side.body.build({});
  const std::string motion = io_internal::record_motion(*side.motion).dump();
  auto parts = dyop_check::prescribed(dyop_check::parse_json(motion), span.begin, {});
  if (parts.size() > 1 && parts[1].begin < span.end) return;  // its segment stays unknown
  side.segment = parts.front();
  if (!deforms) return;
  side.body.corners = corners;
  side.body.deform(plain(side.from), plain(side.to));
  side.segment.part_rate = 1 / span.length();
  side.segment.part_first = (side.segment.t0 - span.begin) * side.segment.part_rate;
}

Side read_side(Input& in, const TimeInterval& span, bool deforms) {
  Side side;
  const int vertices = 3 + in.index(4);
  for (int k = 0; k < vertices; ++k) side.from.push_back(in.vector_within(kLimits.length));
  side.to = side.from;
  for (Vector3& p : side.to) {
    if (deforms) p += in.vector_within(kLimits.length);
  }
  for (int k = 1 + in.index(4); k > 0; --k) {
    TriangleIndices& t = side.triangles.emplace_back();
    for (std::int32_t& corner : t) corner = in.index(vertices);
  }
  // What deforms has no radius, and is seen in the world.
  if (deforms) {
    side.motion = std::make_shared<RestMotion>(RigidPose());
  } else {
    side.radius = std::abs(in.number_within(1));
    side.motion = read_motion(in, span, kLimits);
  }
  make_body(span, deforms, side);
  return side;
}

void check(Input& in) {
  const TimeInterval span = read_interval(in, 4);
  if (!(span.length() > 1e-6)) return;  // literal: shorter ones try nothing else
  const bool deforms = in.flag();
  const Side a = read_side(in, span, deforms);
  const Side b = read_side(in, span, false);
  const Scalar target = std::abs(in.number_within(8));
  if (!a.segment.is_known() || !b.segment.is_known() || !a.segment.holds(span.begin, span.end) ||
      !b.segment.holds(span.begin, span.end))
    return;
  const auto x = dyop_check::passage(a.body, a.segment, span.begin, span.end);
  const auto y = dyop_check::passage(b.body, b.segment, span.begin, span.end);
  dyop_check::PairProver prover(x, y, target, kNodePairs);
  std::vector<dyop_check::NodePair> front{dyop_check::NodePair{}};
  const dyop_check::Answer answer = prover.prove(front);
  const auto distance_at = [&](Scalar t) {
    const TriangleMesh mesh = a.at(std::clamp((t - span.begin) / span.length(), 0.0, 1.0));
    return distance(mesh, a.motion->pose(t), b.at(0), b.motion->pose(t));
  };
  // What rounding may change of dyop's poses and distances.
  const Scalar noise = 2 * (x.noise + y.noise) + 1e-10 * (1 + target);  // literal: relative
  const Scalar radii = a.radius + b.radius;
  if (answer == dyop_check::Answer::Refuted) {
    const DistanceResult found = distance_at(prover.refuted_at());
    require(std::max(0.0, found.lower - radii) <= target + noise, "what is refuted is so near");
  }
  if (answer != dyop_check::Answer::Proven) return;
  for (int k = 0; k < kSamples; ++k) {
    const Scalar t =
        std::clamp(span.begin + span.length() * k / (kSamples - 1), span.begin, span.end);
    require(distance_at(t).upper - radii >= target - noise, "what is proven is so far");
  }
}

}  // namespace
}  // namespace dyop::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  dyop::fuzz::Input in(data, size);
  try {
    dyop::fuzz::check(in);
  } catch (const dyop::InvalidArgument& error) {
    dyop::fuzz::require_readable(error.what());
  } catch (const dyop_check::BadFile& error) {
    dyop::fuzz::require_readable(error.what());
  }
  return 0;
}
