// SPDX-License-Identifier: BSD-3-Clause
#include "support/oracles/contact_generation_oracle.h"

#include <algorithm>
#include <cmath>

#include "dyop/geometry/convex_shape.h"
#include "dyop/geometry/triangle_mesh.h"
#include "support/nearest_points.h"

namespace dyop::testing {
namespace {

using Wide = long double;

Point<Wide> wide(const Vector3& p) {
  return {Wide(p.x()), Wide(p.y()), Wide(p.z())};
}

PointTriangle<Wide> wide(const Triangle& t) {
  return {wide(t[0]), wide(t[1]), wide(t[2])};
}

Vector3 narrow(const Point<Wide>& p) {
  return {Scalar(p.x), Scalar(p.y), Scalar(p.z)};
}

Vector3 nearest(const Vector3& p, const Triangle& t) {
  return narrow(nearest_on_triangle(wide(p), wide(t)));
}

// Points all over a triangle, its corners included.
template <typename Visit>
void visit_samples(const Triangle& t, const Visit& visit) {
  constexpr int kSteps = 24;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps - i; ++j) {
      const Scalar u = Scalar(i) / kSteps;
      const Scalar v = Scalar(j) / kSteps;
      visit(Vector3(t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0])));
    }
  }
}

}  // namespace

ContactOracle::ContactOracle(const Shape& a, const Shape& b, const RigidPose& X_AB) {
  const auto gather = [](const Shape& shape, const RigidPose& X, Side& side) {
    const TriangleMesh* mesh;
    if (shape.kind() == ShapeKind::TriangleMesh) {
      mesh = static_cast<const TriangleMesh*>(&shape);
    } else {
      mesh = static_cast<const ConvexShape&>(shape).core_surface();
      side.is_solid = mesh->is_closed();
    }
    for (std::size_t k = 0; k < mesh->triangles().size(); ++k) {
      Triangle t = mesh->triangle(std::int32_t(k));
      for (Vector3& p : t) p = X * p;
      side.triangles.push_back(t);
    }
  };
  gather(a, RigidPose(), a_);
  gather(b, X_AB, b_);
  for (const Side* side : {&a_, &b_}) {
    for (const Triangle& t : side->triangles) {
      for (const Vector3& p : t) size_ = std::max(size_, p.cwiseAbs().maxCoeff());
    }
  }
}

Scalar ContactOracle::distance_to(const Side& side, const Vector3& p) {
  Scalar least = kInfinity;
  for (const Triangle& t : side.triangles) least = std::min(least, (nearest(p, t) - p).norm());
  return least;
}

Scalar ContactOracle::rise_of(const Side& side, const Vector3& p, const Vector3& n, Scalar slack) {
  Scalar largest = -1;
  for (const Triangle& t : side.triangles) {
    if (!side.is_solid && (nearest(p, t) - p).norm() > slack) continue;
    visit_samples(t, [&](const Vector3& x) {
      const Vector3 ray = x - p;
      const Scalar length = ray.norm();
      if (length > 1024 * slack) largest = std::max(largest, n.dot(ray) / length);
    });
  }
  return largest;
}

Scalar ContactOracle::rise(const OraclePoints& points, const Vector3& nhat_AB_A,
                           Scalar slack) const {
  return std::max(rise_of(a_, points.p_a, nhat_AB_A, slack),
                  rise_of(b_, points.p_b, -nhat_AB_A, slack));
}

// Whether a point is on the inner side of all faces.
bool ContactOracle::holds(const Side& solid, const Vector3& p) {
  return std::all_of(solid.triangles.begin(), solid.triangles.end(), [&](const Triangle& t) {
    return (t[1] - t[0]).cross(t[2] - t[0]).dot(p - t[0]) <= 0;
  });
}

bool ContactOracle::is_enclosed() const {
  const auto holds_any = [](const Side& solid, const Side& other) {
    return solid.is_solid && std::any_of(other.triangles.begin(), other.triangles.end(),
                                         [&](const Triangle& t) { return holds(solid, t[0]); });
  };
  return holds_any(a_, b_) || holds_any(b_, a_);
}

std::vector<OraclePoints> ContactOracle::minima(Scalar reach, Scalar sine) const {
  std::vector<OraclePoints> found;
  // literal: a hundred roundings
  const Scalar slack = 1e-14 * size_;
  const auto add = [&](const Vector3& p_a, const Vector3& p_b) {
    const Vector3 w = p_b - p_a;
    const Scalar length = w.norm();
    if (length > reach || !(length > 0)) return;
    const OraclePoints points{p_a, p_b};
    const bool is_known = std::any_of(found.begin(), found.end(), [&](const OraclePoints& other) {
      return (other.p_a - p_a).norm() + (other.p_b - p_b).norm() <= slack;
    });
    if (!is_known && rise(points, w / length, slack) <= sine) found.push_back(points);
  };
  for (const Triangle& s : a_.triangles) {
    for (const Triangle& t : b_.triangles) {
      const PointTriangle<Wide> ws = wide(s);
      const PointTriangle<Wide> wt = wide(t);
      for (std::size_t i = 0; i < 3; ++i) {
        add(s[i], nearest(s[i], t));
        add(nearest(t[i], s), t[i]);
        for (std::size_t j = 0; j < 3; ++j) {
          NearestPair<Wide> best{ws[i], ws[i], Wide(kInfinity)};
          keep_perpendicular(best, ws[i], ws[(i + 1) % 3], wt[j], wt[(j + 1) % 3]);
          if (best.squared_distance < Wide(kInfinity)) add(narrow(best.on_a), narrow(best.on_b));
        }
      }
    }
  }
  return found;
}

}  // namespace dyop::testing
