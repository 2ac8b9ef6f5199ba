// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/paper/distance_algorithm.h"

#include <array>
#include <string>

#include "distance/gjk/triangle_core.h"
#include "dyop/core/error.h"
#include "dyop/distance/gjk.h"
#include "dyop/distance/triangle_distance.h"
#include "dyop/paper/libccd_distance.h"
#include "dyop/paper/lin_canny.h"
#include "dyop/paper/planar_distance.h"
#include "dyop/paper/published_dyop.h"
#include "dyop/paper/textbook_gjk.h"

namespace dyop {

std::optional<DistanceBounds> DistanceAlgorithm::distance(const ConvexHull&, const ConvexHull&,
                                                          const RigidPose&) const {
  return std::nullopt;
}

namespace {

class CertifiedDyop final : public DistanceAlgorithm {
 public:
  using DistanceAlgorithm::distance;
  std::string_view name() const override { return "certified DyOP"; }
  bool is_certified() const override { return true; }
  DistanceBounds distance(const PlanarTriangle& a, const PlanarTriangle& b) const override {
    const PlanarDistance d = planar_triangle_distance(a, b);
    return {d.lower, d.upper};
  }
  DistanceBounds distance(const Triangle& a, const Triangle& b) const override {
    const TriangleDistance d = triangle_distance(a, b);
    return {d.lower, d.upper};
  }
};

class PublishedDyopAlgorithm final : public DistanceAlgorithm {
 public:
  using DistanceAlgorithm::distance;
  std::string_view name() const override { return "published DyOP"; }
  bool is_certified() const override { return false; }
  DistanceBounds distance(const PlanarTriangle& a, const PlanarTriangle& b) const override {
    return {0, published_dyop(a, b).distance};
  }
  DistanceBounds distance(const Triangle& a, const Triangle& b) const override {
    return {0, published_dyop(a, b).distance};
  }
};

class TextbookGjk final : public DistanceAlgorithm {
 public:
  using DistanceAlgorithm::distance;
  std::string_view name() const override { return "GJK"; }
  bool is_certified() const override { return false; }
  DistanceBounds distance(const PlanarTriangle& a, const PlanarTriangle& b) const override {
    return {0, textbook_gjk(a, b).distance};
  }
  DistanceBounds distance(const Triangle& a, const Triangle& b) const override {
    return {0, textbook_gjk(a, b).distance};
  }
};

class LinCanny final : public DistanceAlgorithm {
 public:
  std::string_view name() const override { return "Lin-Canny"; }
  bool is_certified() const override { return true; }
  DistanceBounds distance(const PlanarTriangle& a, const PlanarTriangle& b) const override {
    const PlanarDistance d = lin_canny_distance(a, b);
    return {d.lower, d.upper};
  }
  DistanceBounds distance(const Triangle& a, const Triangle& b) const override {
    const TriangleDistance d = lin_canny_distance(a, b);
    return {d.lower, d.upper};
  }
  std::optional<DistanceBounds> distance(const ConvexHull& a, const ConvexHull& b,
                                         const RigidPose& X_AB) const override {
    const GjkResult d = lin_canny_distance(HullFeatures(a), HullFeatures(b), X_AB);
    return DistanceBounds{d.lower, d.upper};
  }
};

class LibccdGjk final : public DistanceAlgorithm {
 public:
  using DistanceAlgorithm::distance;
  std::string_view name() const override { return "libccd GJK"; }
  bool is_certified() const override { return false; }
  DistanceBounds distance(const PlanarTriangle& a, const PlanarTriangle& b) const override {
    return {0, libccd_distance(a, b)};
  }
  DistanceBounds distance(const Triangle& a, const Triangle& b) const override {
    return {0, libccd_distance(a, b)};
  }
};

class CertifiedGjk final : public DistanceAlgorithm {
 public:
  std::string_view name() const override { return "certified GJK"; }
  bool is_certified() const override { return true; }
  DistanceBounds distance(const PlanarTriangle& a, const PlanarTriangle& b) const override {
    return distance(in_space(a), in_space(b));
  }
  DistanceBounds distance(const Triangle& a, const Triangle& b) const override {
    const GjkResult d = gjk_distance(distance_internal::TriangleCore(a),
                                     distance_internal::TriangleCore(b), RigidPose());
    return {d.lower, d.upper};
  }
  std::optional<DistanceBounds> distance(const ConvexHull& a, const ConvexHull& b,
                                         const RigidPose& X_AB) const override {
    const GjkResult d = gjk_distance(a, b, X_AB);
    return DistanceBounds{d.lower, d.upper};
  }

 private:
  static Triangle in_space(const PlanarTriangle& t) {
    return {Vector3(t[0].x(), t[0].y(), 0), Vector3(t[1].x(), t[1].y(), 0),
            Vector3(t[2].x(), t[2].y(), 0)};
  }
};

}  // namespace

std::span<const DistanceAlgorithm* const> distance_algorithms() {
  static const CertifiedDyop certified_dyop;
  static const PublishedDyopAlgorithm published_dyop_algorithm;
  static const TextbookGjk gjk;
  static const LinCanny lin_canny;
  static const LibccdGjk libccd;
  static const CertifiedGjk certified_gjk;
  // To add an algorithm: its name goes here.
  static constexpr std::array<const DistanceAlgorithm*, 6> kAll{
      &certified_dyop, &published_dyop_algorithm, &gjk, &lin_canny, &libccd, &certified_gjk};
  return kAll;
}

const DistanceAlgorithm& distance_algorithm(std::string_view name) {
  std::string names;
  for (const DistanceAlgorithm* algorithm : distance_algorithms()) {
    if (algorithm->name() == name) return *algorithm;
    names += (names.empty() ? "" : ", ") + std::string(algorithm->name());
  }
  throw InvalidArgument("no distance algorithm named '" + std::string(name) +
                        "'; the names are: " + names);
}

}  // namespace dyop
