// SPDX-License-Identifier: BSD-3-Clause

// Casts random and degenerate rays, thin and thick, at triangles and convex shapes, against closed
// forms with 113 bits (triangles) or 64 bits (distances of convex shapes) that share no code with
// the library:
//   ray_cast_soak CASES [SEED]
// Sizes 1e-12 to 1e12, up to 1e9 from the origin. A ray counts as wrong if it passes the surface, if
// a miss is none, or if a hit is not within its gap of the surface; as loose if the gap is more than
// rounding. The exit code is 1 if any ray is wrong, or more than one in ten thousand loose.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <random>

#include "core/tolerance.h"
#include "dyop/distance/ray_cast.h"
#include "dyop/geometry/primitives.h"
#include "dyop/geometry/triangle_mesh.h"
#include "support/inputs/random_inputs.h"
#include "support/nearest_points.h"
#include "support/oracles/triangle_oracle.h"

namespace dyop::testing {
namespace {

using QuadPoint = Point<Quad>;
using Real = long double;
using RealVector = Eigen::Matrix<Real, 3, 1>;

QuadPoint quad_point(const Vector3& p) {
  return {Quad(p.x()), Quad(p.y()), Quad(p.z())};
}

// A ray in the frame of the shape, exactly: the rotation is inverted, not transposed.
struct QuadRay {
  QuadPoint o;
  QuadPoint d;  // unit
  Quad end;
};

QuadRay exact_ray(const RigidPose& X_WS, const Ray& ray) {
  const Matrix3& R = X_WS.rotation();
  std::array<QuadPoint, 3> columns;
  for (int k = 0; k < 3; ++k) columns[std::size_t(k)] = quad_point(R.col(k));
  const Quad det = dot(columns[0], cross(columns[1], columns[2]));
  const auto solve = [&](const QuadPoint& v) -> QuadPoint {
    return {dot(v, cross(columns[1], columns[2])) / det,
            dot(v, cross(columns[2], columns[0])) / det,
            dot(v, cross(columns[0], columns[1])) / det};
  };
  QuadRay result;
  result.o = solve(quad_point(ray.p_W) - quad_point(X_WS.translation()));
  const QuadPoint v = quad_point(ray.direction_W);
  result.d = solve(Quad(1) / square_root(dot(v, v)) * v);
  result.end = std::isfinite(ray.length) ? Quad(ray.length) : Quad(1e30);
  return result;
}

using Touch = std::optional<Quad>;

void keep_first(Touch& first, Quad s) {
  if (!first || s < *first) first = s;
}

// The ball of a point: |c + s d| <= r with c = o - q.
void touch_vertex(const QuadRay& ray, const QuadPoint& q, Quad r, Touch& first) {
  const QuadPoint c = ray.o - q;
  const Quad a = dot(ray.d, ray.d);
  const Quad b = dot(c, ray.d);
  const Quad rest = dot(c, c) - r * r;
  if (rest <= 0) return keep_first(first, 0);
  const Quad root_sq = b * b - a * rest;
  if (b >= 0 || root_sq < 0) return;
  keep_first(first, rest / (square_root(root_sq) - b));
}

// The cylinder of an edge between its ends.
void touch_edge(const QuadRay& ray, const QuadPoint& p, const QuadPoint& q, Quad r, Touch& first) {
  const QuadPoint e = q - p;
  const Quad ee = dot(e, e);
  if (!(ee > 0)) return;
  const QuadPoint c = ray.o - p;
  const QuadPoint across = c - dot(c, e) / ee * e;
  const QuadPoint turn = ray.d - dot(ray.d, e) / ee * e;
  const auto is_beside = [&](Quad s) {
    const Quad along = dot(c + s * ray.d, e);
    return along >= 0 && along <= ee;
  };
  const Quad a = dot(turn, turn);
  const Quad b = dot(across, turn);
  const Quad rest = dot(across, across) - r * r;
  if (rest <= 0) {
    if (is_beside(0)) keep_first(first, 0);
    return;
  }
  const Quad root_sq = b * b - a * rest;
  if (b >= 0 || root_sq < 0) return;
  const Quad s = rest / (square_root(root_sq) - b);
  if (is_beside(s)) keep_first(first, s);
}

// The prism over a face.
void touch_face(const QuadRay& ray, const PointTriangle<Quad>& t, Quad r, Touch& first) {
  const QuadPoint n = cross(t[1] - t[0], t[2] - t[0]);
  const Quad nn = dot(n, n);
  if (!(nn > 0)) return;
  const Quad reach = r * square_root(nn);
  const auto is_above = [&](Quad s) {
    const QuadPoint p = ray.o + s * ray.d;
    for (std::size_t k = 0; k < 3; ++k) {
      const QuadPoint& a = t[k];
      if (dot(cross(t[(k + 1) % 3] - a, p - a), n) < 0) return false;
    }
    return true;
  };
  const Quad height = dot(ray.o - t[0], n);
  const Quad speed = dot(ray.d, n);
  if (height <= reach && height >= -reach) {
    if (is_above(0)) keep_first(first, 0);
    return;
  }
  const Quad s = (height > 0 ? reach - height : -reach - height) / speed;
  if (!(s >= 0 && s < Quad(1e40))) return;
  if (is_above(s)) keep_first(first, s);
}

Touch touch_mesh(const QuadRay& ray, const TriangleMesh& mesh, Quad r) {
  Touch first;
  for (std::size_t i = 0; i < mesh.triangles().size(); ++i) {
    const PointTriangle<Quad> t = to_points<Quad>(mesh.triangle(std::int32_t(i)));
    for (std::size_t k = 0; k < 3; ++k) {
      touch_vertex(ray, t[k], r, first);
      touch_edge(ray, t[k], t[(k + 1) % 3], r, first);
    }
    touch_face(ray, t, r, first);
  }
  if (first && *first > ray.end) return std::nullopt;
  return first;
}

// Distance of a point from a solid, 0 inside, in its frame.
using PointDistanceForm = std::function<Real(const RealVector&)>;

Real beyond(Real x, Real limit) {
  return std::max(std::abs(x) - limit, Real(0));
}

Real from_segment(Real x, Real y, Real x0, Real y0, Real x1, Real y1) {
  const Real ex = x1 - x0;
  const Real ey = y1 - y0;
  const Real t =
      std::clamp(((x - x0) * ex + (y - y0) * ey) / (ex * ex + ey * ey), Real(0), Real(1));
  return std::hypot(x - x0 - t * ex, y - y0 - t * ey);
}

// In the half plane of a point and the axis the cone is a triangle.
Real from_cone(Real rho, Real z, Real radius, Real half) {
  const bool is_below_slope = rho * 2 * half + (z - half) * radius <= 0;
  if (z >= -half && is_below_slope) return 0;
  return std::min(from_segment(rho, z, 0, -half, radius, -half),
                  from_segment(rho, z, radius, -half, 0, half));
}

// The root of a falling function gives the nearest point.
Real from_ellipsoid(const RealVector& p, const RealVector& axes) {
  const auto excess = [&](Real t) {
    Real sum = -1;
    for (int k = 0; k < 3; ++k) {
      const Real x = axes[k] * p[k] / (axes[k] * axes[k] + t);
      sum += x * x;
    }
    return sum;
  };
  if (excess(0) <= 0) return 0;
  Real low = 0;
  Real high = axes.maxCoeff() * p.norm() * 2;
  for (int i = 0; i < 200 && high - low > 0; ++i) {
    const Real middle = (low + high) / 2;
    (excess(middle) > 0 ? low : high) = middle;
  }
  RealVector v;
  for (int k = 0; k < 3; ++k) v[k] = p[k] * low / (axes[k] * axes[k] + low);
  return v.norm();
}

// First root of a convex function on [0, end].
std::optional<Real> first_root(const std::function<Real(Real)>& f, Real end) {
  if (f(0) <= 0) return Real(0);
  Real a = 0;
  Real b = end;
  for (int i = 0; i < 200; ++i) {
    const Real x = a + (b - a) / 3;
    const Real y = b - (b - a) / 3;
    (f(x) > f(y) ? a : b) = f(x) > f(y) ? x : y;
  }
  const Real least = (a + b) / 2;
  if (f(least) > 0) return std::nullopt;
  Real low = 0;
  Real high = least;
  for (int i = 0; i < 120; ++i) {
    const Real middle = (low + high) / 2;
    (f(middle) > 0 ? low : high) = middle;
  }
  return high;
}

struct ConvexCase {
  std::shared_ptr<const ConvexShape> shape;
  PointDistanceForm distance;
  bool is_smooth = false;
};

ConvexCase random_convex(Scalar size, std::mt19937_64& random) {
  const Scalar r = size * random_magnitude(-2, 0, random);
  const Scalar h = size * random_magnitude(-2, 0, random);
  const Vector3 v = size * Vector3(random_magnitude(-2, 0, random), random_magnitude(-2, 0, random),
                                   random_magnitude(-2, 0, random));
  const RealVector w = v.cast<Real>();
  const auto from_box = [w](const RealVector& p) {
    return std::hypot(beyond(p.x(), w.x()), beyond(p.y(), w.y()), beyond(p.z(), w.z()));
  };
  const auto rho = [](const RealVector& p) { return std::hypot(p.x(), p.y()); };
  switch (random_index(7, random)) {
    case 0:
      return {std::make_shared<Sphere>(r),
              [r](const RealVector& p) { return std::max(p.norm() - Real(r), Real(0)); }};
    case 1:
      return {std::make_shared<Box>(v), from_box};
    case 2:
      return {std::make_shared<RoundedBox>(v, r), [r, from_box](const RealVector& p) {
                return std::max(from_box(p) - Real(r), Real(0));
              }};
    case 3:
      return {std::make_shared<Capsule>(r, h), [r, h, rho](const RealVector& p) {
                return std::max(std::hypot(rho(p), beyond(p.z(), Real(h))) - Real(r), Real(0));
              }};
    case 4:
      return {std::make_shared<Cylinder>(r, h),
              [r, h, rho](const RealVector& p) {
                return std::hypot(beyond(rho(p), Real(r)), beyond(p.z(), Real(h)));
              },
              true};
    case 5:
      return {
          std::make_shared<Cone>(r, h),
          [r, h, rho](const RealVector& p) { return from_cone(rho(p), p.z(), Real(r), Real(h)); },
          true};
    default:
      return {std::make_shared<Ellipsoid>(v),
              [w](const RealVector& p) { return from_ellipsoid(p, w); }, true};
  }
}

// A direction that often meets features exactly: towards a target, sometimes past it by the radius.
Ray aimed_ray(const Vector3& start, const Vector3& target, Scalar size, std::mt19937_64& random) {
  Ray ray;
  ray.p_W = start;
  ray.radius = random_index(2, random) == 0 ? 0 : size * random_magnitude(-4, 0.5, random);
  ray.direction_W = target - start;
  switch (random_index(6, random)) {
    case 0:
      ray.direction_W += size * random_vector(1, random);
      break;
    case 1: {  // past it: tangent
      const Vector3 side = ray.direction_W.unitOrthogonal();
      ray.direction_W += ray.radius * (1 + random_number(-1e-15, 1e-15, random)) * side;
      break;
    }
    case 2:  // along an axis
      ray.direction_W[random_index(3, random)] = 0;
      break;
    default:
      break;
  }
  if (!(ray.direction_W.cwiseAbs().maxCoeff() > 0)) ray.direction_W = random_direction(random);
  if (random_index(4, random) == 0) {
    ray.length = ray.direction_W.norm() * random_number(0.5, 1.5, random);
  }
  return ray;
}

struct Counts {
  long rays = 0;
  long hits = 0;
  long misses = 0;
  long initial = 0;
  long limits = 0;
  long wrong = 0;
  long loose = 0;
};

// `touch(r)` is where a ball of radius r first touches the shape.
template <typename FirstTouch>
void judge(const RayHit& hit, const Ray& ray, Scalar size, Scalar allowed_gap,
           const FirstTouch& touch, Counts& counts) {
  ++counts.rays;
  const Touch exact = touch(Quad(ray.radius));
  bool is_wrong = hit.status == RayStatus::NotRun;
  const Quad slack = Quad(1e-17) * Quad(size);  // of the oracle
  if (exact && Quad(hit.distance) > *exact + slack) is_wrong = true;
  if (hit.status == RayStatus::Miss) {
    ++counts.misses;
    if (exact) is_wrong = true;
  } else {
    counts.hits += hit.status == RayStatus::Hit;
    counts.initial += hit.status == RayStatus::InitiallyTouching;
    counts.limits += hit.status == RayStatus::NumericalLimit;
    // With the gap added, the ball touches no later.
    const Touch wide = touch(Quad(ray.radius) + Quad(hit.gap) * (1 + Quad(1e-9)));
    if (!wide || *wide > Quad(hit.distance) + slack) is_wrong = true;
    if (!(hit.gap <= allowed_gap)) ++counts.loose;
    const Scalar along = std::isfinite(hit.distance) ? hit.distance : 0;
    const Vector3 center = ray.p_W + along * ray.direction_W.normalized();
    const Scalar off = std::abs((center - hit.p_WC).norm() - ray.radius);
    if (hit.status == RayStatus::Hit && !(off <= 2 * allowed_gap + 1e-9 * size)) is_wrong = true;
    if (!(std::abs(hit.nhat_W.norm() - 1) < 1e-12)) is_wrong = true;
  }
  if (!is_wrong) return;
  ++counts.wrong;
  if (counts.wrong > 5) return;
  std::printf("wrong: %s at %.17g gap %.3g, exact %.17g, size %.3g radius %.17g\n",
              std::string(name_of(hit.status)).c_str(), hit.distance, hit.gap,
              exact ? double(*exact) : -1, size, ray.radius);
}

Vector3 point_of(const Triangle& t, std::mt19937_64& random) {
  switch (random_index(4, random)) {
    case 0:
      return t[std::size_t(random_index(3, random))];
    case 1: {
      const auto k = std::size_t(random_index(3, random));
      return t[k] + random_number(0, 1, random) * (t[(k + 1) % 3] - t[k]);
    }
    default: {
      const Scalar u = random_number(0, 1, random);
      return t[0] + u * (t[1] - t[0]) + random_number(0, 1 - u, random) * (t[2] - t[0]);
    }
  }
}

void cast_at_triangles(std::mt19937_64& random, Counts& counts) {
  const auto family =
      kAllTriangleFamilies[std::size_t(random_index(int(kAllTriangleFamilies.size()), random))];
  const TrianglePair pair = random_triangle_pair(family, random);
  std::vector<Vector3> vertices(pair.a.begin(), pair.a.end());
  vertices.insert(vertices.end(), pair.b.begin(), pair.b.end());
  const TriangleMesh mesh(vertices, {{0, 1, 2}, {3, 4, 5}});
  Scalar extent = mesh.bounding_box().sizes().norm();
  if (!(extent > 0)) extent = mesh.bounding_radius() + 1;
  const bool is_plain = random_index(2, random) == 0;
  const RigidPose X_WS =
      is_plain ? RigidPose()
               : RigidPose(random_rotation(random), extent * random_vector(2, random));
  const Vector3 target = X_WS * point_of(random_index(2, random) == 0 ? pair.a : pair.b, random);
  const Vector3 start =
      random_index(6, random) == 0
          ? X_WS * point_of(pair.a, random)  // in the plane, or on the surface
          : target + extent * random_magnitude(-2, 1, random) * random_direction(random);
  const Ray ray = aimed_ray(start, target, extent, random);
  const RayHit hit = ray_cast(mesh, X_WS, ray);
  const QuadRay exact = exact_ray(X_WS, ray);
  const Scalar size =
      X_WS.translation().norm() + ray.p_W.norm() + mesh.bounding_radius() + ray.radius;
  judge(
      hit, ray, size, 2048 * kUnitRoundoff * size,
      [&](Quad r) { return touch_mesh(exact, mesh, r); }, counts);
}

void cast_at_convex(std::mt19937_64& random, Counts& counts) {
  const Scalar size = random_magnitude(-4, 4, random);
  const ConvexCase convex = random_convex(size, random);
  const Scalar far = random_index(3, random) == 0 ? 1e3 * size : size;
  const RigidPose X_WS(random_rotation(random), far * random_vector(1, random));
  const Vector3 start =
      X_WS * Vector3(size * random_magnitude(-1, 1, random) * random_direction(random));
  const Vector3 side = random_direction(random);
  const Vector3 target = X_WS * convex.shape->support(side);
  const Ray ray = aimed_ray(start, target, size, random);
  const RayHit hit = ray_cast(*convex.shape, X_WS, ray);
  const QuadRay exact = exact_ray(X_WS, ray);
  const auto real = [](const QuadPoint& p) { return RealVector(Real(p.x), Real(p.y), Real(p.z)); };
  const RealVector o = real(exact.o);
  const RealVector d = real(exact.d);
  const Real end = std::min(Real(exact.end), 2 * (o.norm() + Real(size) * 4 + Real(ray.radius)));
  const Scalar all =
      X_WS.translation().norm() + ray.p_W.norm() + convex.shape->bounding_radius() + ray.radius;
  const Scalar allowed = convex.is_smooth ? 0x1p-29 * all : 2048 * kUnitRoundoff * all;
  judge(
      hit, ray, all, allowed,
      [&](Quad r) -> Touch {
        const std::optional<Real> root =
            first_root([&](Real s) { return convex.distance(o + s * d) - Real(r); }, end);
        if (!root) return std::nullopt;
        return Quad(*root);
      },
      counts);
}

int run(long cases, unsigned seed) {
  std::mt19937_64 random(seed);
  Counts triangles;
  Counts shapes;
  for (long k = 0; k < cases; ++k) {
    if (k % 4 == 3) {
      cast_at_convex(random, shapes);
    } else {
      cast_at_triangles(random, triangles);
    }
  }
  bool is_bad = false;
  for (const Counts* c : {&triangles, &shapes}) {
    std::printf(
        "%s: %ld rays, %ld hits, %ld misses, %ld touch at the start, %ld undecided, "
        "%ld wrong, %ld loose\n",
        c == &triangles ? "triangles" : "convex shapes", c->rays, c->hits, c->misses, c->initial,
        c->limits, c->wrong, c->loose);
    is_bad |= c->wrong > 0 || c->loose > c->rays / 10000 + 1;
  }
  return is_bad ? 1 : 0;
}

}  // namespace
}  // namespace dyop::testing

int main(int count, char** arguments) {
  const long cases = count > 1 ? std::atol(arguments[1]) : 10000;
  const unsigned seed = count > 2 ? unsigned(std::atol(arguments[2])) : 1;
  return dyop::testing::run(cases, seed);
}
