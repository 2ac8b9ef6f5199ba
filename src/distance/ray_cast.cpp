// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/distance/ray_cast.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <ostream>
#include <string>

#include "core/batch_run.h"
#include "core/tolerance.h"
#include "distance/core_distance.h"
#include "distance/distance_traversal.h"
#include "distance/gjk/triangle_core.h"
#include "distance/piece_distance.h"
#include "distance/point_search.h"
#include "dyop/core/error.h"
#include "dyop/distance/gjk.h"
#include "geometry/shape_tree.h"

namespace dyop {
namespace {

using distance_internal::core_distance;
using distance_internal::point_triangle_distance;
using distance_internal::PointTriangleDistance;
using geometry_internal::LeafPiece;
using geometry_internal::ShapeTree;

constexpr int kRayGroupSize = BoxGroup::kWidth;
using GroupNumbers = std::array<Scalar, kRayGroupSize>;

// A ray in the shape's frame, in lengths.
struct LocalRay {
  Vector3 origin;
  Vector3 direction;  // unit
  Scalar end;         // nothing can be touched beyond
  Scalar radius;
  Scalar noise;   // how far a point of the ray is off by rounding
  Scalar extent;  // how far from the frame's origin the shape matters

  Vector3 at(Scalar s) const { return origin + s * direction; }
};

// Where a ball meets the boxes of a group: entry > exit if it never does.
struct BoxTimes {
  GroupNumbers entry;
  GroupNumbers exit;
};

// The slabs of a box, each widened by the ball and by rounding: see point_search.cpp for that of
// the axes. All in units of the hierarchy's scale.
BoxTimes box_times(const BoxGroup& boxes, const Vector3& o, const Vector3& d, Scalar reach) {
  BoxTimes times;
  times.entry.fill(0);
  times.exit.fill(kInfinity);
  GroupNumbers x, y, z, slack;
  for (int i = 0; i < kRayGroupSize; ++i) {
    const auto k = static_cast<std::size_t>(i);
    x[k] = o.x() - static_cast<Scalar>(boxes.rows[BoxGroup::kCenter][i]);
    y[k] = o.y() - static_cast<Scalar>(boxes.rows[BoxGroup::kCenter + 1][i]);
    z[k] = o.z() - static_cast<Scalar>(boxes.rows[BoxGroup::kCenter + 2][i]);
    const Scalar size = static_cast<Scalar>(boxes.rows[BoxGroup::kHalfExtents][i]) +
                        static_cast<Scalar>(boxes.rows[BoxGroup::kHalfExtents + 1][i]) +
                        static_cast<Scalar>(boxes.rows[BoxGroup::kHalfExtents + 2][i]);
    slack[k] = kPointBoxNoise * size + reach;
  }
  for (int axis = 0; axis < 3; ++axis) {
    const auto* row = boxes.rows + BoxGroup::kAxes + 3 * axis;
    const float* half = boxes.rows[BoxGroup::kHalfExtents + axis];
    for (int i = 0; i < kRayGroupSize; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const auto u0 = static_cast<Scalar>(row[0][i]);
      const auto u1 = static_cast<Scalar>(row[1][i]);
      const auto u2 = static_cast<Scalar>(row[2][i]);
      const Scalar along = x[k] * u0 + y[k] * u1 + z[k] * u2;
      const Scalar inverse = 1 / (d.x() * u0 + d.y() * u1 + d.z() * u2);
      const Scalar width = static_cast<Scalar>(half[i]) + slack[k];
      const Scalar t0 = (-width - along) * inverse;
      const Scalar t1 = (width - along) * inverse;
      const Scalar nearer = t0 < t1 ? t0 : t1;
      const Scalar farther = t0 < t1 ? t1 : t0;
      // A ray along a face gives NaN, which changes nothing.
      times.entry[k] = nearer > times.entry[k] ? nearer : times.entry[k];
      times.exit[k] = farther < times.exit[k] ? farther : times.exit[k];
    }
  }
  return times;
}

// What is known about a piece from one point of the ray.
struct PointGap {
  Scalar lower = 0;  // of the distance of the centre
  Scalar upper = kInfinity;
  Vector3 p = Vector3::Zero();      // of the piece
  Vector3 nhat = Vector3::UnitX();  // from the piece to the point; proves `lower`
  Feature feature;
};

PointGap gap_of(const PointTriangleDistance& found) {
  return {found.lower, found.upper, found.p_C, found.nhat_C, found.feature};
}

PointGap gap_of(const NearestPoints& found) {
  return {found.lower, found.upper, found.p_a, found.nhat_AB, found.feature_a};
}

PointGap point_gap(const LeafPiece& piece, const Vector3& p) {
  if (piece.mesh) return gap_of(point_triangle_distance(p, piece.corners()));
  NearestPoints nearest;
  const Matrix3 same = Matrix3::Identity();
  static const SimpleCore kPoint{.kind = CoreKind::Point};
  if (core_distance(piece.convex->simple_core(), kPoint, {same, same, p}, nearest)) {
    return gap_of(nearest);
  }
  const distance_internal::TriangleCore point({p, p, p});
  return gap_of(gjk_distance(*piece.convex, point, RigidPose()));
}

// The first touch of one ray with any piece of a tree.
class RaySearch {
 public:
  RaySearch(const ShapeTree& tree, const LocalRay& ray)
      : tree_(tree),
        ray_(ray),
        scale_(tree.frame().scale),
        reach_((ray.radius + tree.rounding() + ray.noise) * (1 + 8 * kUnitRoundoff) / scale_),
        o_(tree.frame().local(ray.origin)),
        first_(ray.end) {}

  void run() {
    open(0);
    while (count_ > 0) {
      const OpenBox box = stack_[--count_];
      if (box.entry * scale_ > first_) continue;
      if (tree_.is_leaf(box.number)) {
        visit(box.number, box.entry * scale_);
      } else {
        open(tree_.child(box.number));
      }
    }
  }

  /// In the shape's frame; a miss if nothing was found.
  RayHit hit;

 private:
  struct OpenBox {
    Scalar entry;  // in units of the scale
    std::int32_t number;
  };

  // Pushes the boxes of a node, the first to be entered on top.
  void open(std::int32_t number) {
    const MeshHierarchy::Node& node = tree_.node(number);
    const BoxTimes times = box_times(node.boxes, o_, ray_.direction, reach_);
    const std::size_t bottom = count_;
    const int count = node.count();
    for (int i = 0; i < count; ++i) {
      const Scalar entry = times.entry[static_cast<std::size_t>(i)];
      const bool is_missed = entry > times.exit[static_cast<std::size_t>(i)];
      if (is_missed || entry * scale_ > first_) continue;
      std::size_t place = count_++;
      for (; place > bottom && stack_[place - 1].entry < entry; --place) {
        stack_[place] = stack_[place - 1];
      }
      stack_[place] = {entry, ShapeTree::box_number(number, i)};
    }
  }

  // Newton's method from the left on the distance of the centre, which is convex along the ray: a
  // supporting line never lies above it, so no step passes the surface.
  void visit(std::int32_t leaf, Scalar s) {
    const LeafPiece piece = tree_.piece(leaf);
    Vector3 nhat = -ray_.direction;
    PointGap found;
    for (int i = 0; i < kRayStepLimit; ++i) {
      found = point_gap(piece, ray_.at(s));
      const Scalar free = found.lower - ray_.radius - ray_.noise;
      if (found.lower > ray_.noise) nhat = found.nhat;
      if (!(free > ray_.noise)) break;
      // literal: the rounding of a scalar product of two unit vectors.
      const Scalar rate = 8 * kUnitRoundoff - found.nhat.dot(ray_.direction);
      if (!(rate > 0)) return;  // moves away for good
      const Scalar step = free / rate * (1 - 4 * kUnitRoundoff);
      const Scalar next = (s + step) * (1 - kUnitRoundoff);
      if (next > first_) return;
      if (!(next > s)) break;
      s = next;
    }
    keep(piece, found, nhat, s);
  }

  // The first one in the tree counts among equally near pieces.
  void keep(const LeafPiece& piece, const PointGap& found, const Vector3& nhat, Scalar s) {
    if (hit.status == RayStatus::Hit && !(s < first_)) return;
    first_ = s;
    hit.status = RayStatus::Hit;
    hit.distance = s;
    const Scalar left = found.upper - ray_.radius;
    hit.gap = (left < 0 ? 0 : left) + ray_.noise;  // NaN stays: nothing is known
    hit.p_WC = found.p;
    hit.nhat_W = nhat;
    hit.feature = found.feature;
    hit.triangle = distance_internal::triangle_number(piece);
    hit.child = piece.child;
    if (!piece.mesh) return;
    hit.feature = distance_internal::mesh_feature(found.feature, piece.indices());
    if (found.feature.kind != FeatureKind::Face) return;
    hit.nhat_W = found.nhat.dot(ray_.direction) > 0 ? Vector3(-found.nhat) : found.nhat;
  }

  const ShapeTree& tree_;
  const LocalRay& ray_;
  const Scalar scale_;
  const Scalar reach_;
  const Vector3 o_;
  Scalar first_;  // nothing that comes later is sought
  std::size_t count_ = 0;
  std::array<OpenBox, MeshHierarchy::kMaxDepth * kRayGroupSize + 1> stack_;
};

// How far from its frame's origin the shape can matter for a ray in that frame: of a half-space, up
// to where the ray meets it.
Scalar size_for_ray(const Shape& shape, const Vector3& origin, const Vector3& direction,
                    Scalar length) {
  const HalfSpace* half_space = as_half_space(shape);
  if (!half_space) return shape.bounding_radius();
  // literal: the rounding of a scalar product of two unit vectors.
  const Scalar rate = 16 * kUnitRoundoff - half_space->normal().dot(direction);
  const Scalar way = rate > 0 ? std::max(Scalar(0), half_space->height(origin)) / rate : 0;
  return origin.norm() + std::min(way, length);
}

LocalRay local_ray(const Shape& shape, const RigidPose& X_WS, const Ray& ray) {
  LocalRay local;
  local.origin = X_WS.inverse() * ray.p_W;
  local.direction = X_WS.rotation().transpose() * ray.direction_W.stableNormalized();
  local.radius = ray.radius;
  local.extent = size_for_ray(shape, local.origin, local.direction, ray.length);
  const Scalar size = distance_internal::length_for_noise(X_WS.translation()) +
                      distance_internal::length_for_noise(ray.p_W) + local.extent + ray.radius;
  // Once for the origin and once for the direction, over at most this size.
  local.noise = 2 * kPoseNoise * size;
  local.end = std::min(ray.length, 2 * size);
  return local;
}

RayHit cast(const Shape& shape, const RigidPose& X_WS, const Ray& ray) {
  const LocalRay local = local_ray(shape, X_WS, ray);
  const ShapeTree tree(shape, local.extent + local.radius);
  RaySearch search(tree, local);
  search.run();
  RayHit hit = search.hit;
  if (hit.status != RayStatus::Hit) {
    hit.status = RayStatus::Miss;
    hit.distance = ray.length;
    return hit;
  }
  hit.p_WC = X_WS * hit.p_WC;
  hit.nhat_W = X_WS.rotation() * hit.nhat_W;
  if (!(hit.distance > 0)) {
    hit.status = RayStatus::InitiallyTouching;
  } else if (!(hit.gap <= kRayGap * local.noise / kPoseNoise)) {
    hit.status = RayStatus::NumericalLimit;
  }
  return hit;
}

}  // namespace

std::string_view name_of(RayStatus status) {
  switch (status) {
    case RayStatus::NotRun:
      return "NotRun";
    case RayStatus::Miss:
      return "Miss";
    case RayStatus::Hit:
      return "Hit";
    case RayStatus::InitiallyTouching:
      return "InitiallyTouching";
    case RayStatus::NumericalLimit:
      return "NumericalLimit";
  }
  return "NotRun";
}

std::ostream& operator<<(std::ostream& out, RayStatus status) {
  return out << name_of(status);
}

std::ostream& operator<<(std::ostream& out, const RayHit& hit) {
  return out << hit.status << " at " << hit.distance << ", gap <= " << hit.gap;
}

namespace distance_internal {

void require_valid_ray(const Ray& ray, const char* query) {
  DYOP_REQUIRE(ray.p_W.allFinite(), query, ": p_W must be finite, not (", ray.p_W.transpose(), ")");
  DYOP_REQUIRE(ray.direction_W.allFinite() && ray.direction_W.cwiseAbs().maxCoeff() > 0, query,
               ": direction_W must be finite and not zero, not (", ray.direction_W.transpose(),
               ")");
  DYOP_REQUIRE(ray.length >= 0, query, ": length must be >= 0, not ", ray.length);
  DYOP_REQUIRE(ray.radius >= 0 && ray.radius < kInfinity, query,
               ": radius must be finite and >= 0, not ", ray.radius);
}

}  // namespace distance_internal

RayHit ray_cast(const Shape& shape, const RigidPose& X_WS, const Ray& ray) {
  distance_internal::require_valid_ray(ray, "ray_cast");
  return cast(shape, X_WS, ray);
}

void ray_cast_batch(const Shape& shape, const RigidPose& X_WS, std::span<const Ray> rays,
                    std::span<RayHit> hits, const BatchOptions& options) {
  DYOP_REQUIRE(rays.size() == hits.size(), "ray_cast_batch: ", rays.size(), " rays, but space for ",
               hits.size(), " hits");
  for (std::size_t i = 0; i < rays.size(); ++i) {
    try {
      distance_internal::require_valid_ray(rays[i], "ray_cast_batch");
    } catch (const InvalidArgument& error) {
      throw InvalidArgument("ray " + std::to_string(i) + ": " + error.what());
    }
  }
  std::fill(hits.begin(), hits.end(), RayHit());
  core_internal::run_batch_in_portions(
      rays.size(), options, [&](std::size_t i) { hits[i] = cast(shape, X_WS, rays[i]); });
}

}  // namespace dyop
