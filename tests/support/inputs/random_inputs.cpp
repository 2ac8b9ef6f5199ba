// SPDX-License-Identifier: BSD-3-Clause
#include "support/inputs/random_inputs.h"

#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

namespace dyop::testing {
namespace {

constexpr Scalar kFullTurn = 2 * std::numbers::pi;

Triangle random_triangle(std::mt19937_64& random) {
  Triangle triangle;
  for (Vector3& p : triangle) p = random_vector(1, random);
  return triangle;
}

void translate(Triangle& triangle, const Vector3& shift) {
  for (Vector3& p : triangle) p += shift;
}

TrianglePair scaled(TrianglePair pair, Scalar factor) {
  for (Triangle* triangle : {&pair.a, &pair.b}) {
    for (Vector3& p : *triangle) p *= factor;
  }
  return pair;
}

// With weights that sum to one up to rounding; inside, or on the edge from 0 to 1.
Vector3 random_point_of(const Triangle& t, bool on_edge, std::mt19937_64& random) {
  const Scalar s = random_number(0, 1, random);
  const Scalar u = on_edge ? 0 : random_number(0, 1 - s, random);
  return (1 - s - u) * t[0] + s * t[1] + u * t[2];
}

Vector3 normal_of(const Triangle& t) {
  return (t[1] - t[0]).cross(t[2] - t[0]).normalized();
}

// The same triangle with another first vertex, and in half of the cases the other orientation.
Triangle shuffled(const Triangle& t, std::mt19937_64& random) {
  const auto first = static_cast<std::size_t>(random_index(3, random));
  Triangle result{t[first], t[(first + 1) % 3], t[(first + 2) % 3]};
  if (random_index(2, random) == 1) std::swap(result[1], result[2]);
  return result;
}

TrianglePair far_pair(std::mt19937_64& random) {
  TrianglePair pair{random_triangle(random), random_triangle(random)};
  const Scalar distance = random_number(6, 10, random);
  translate(pair.b, distance * random_direction(random));
  return pair;
}

// Side by side, moved apart along a direction until a slab of the chosen width separates them; one
// in eight is left as generated.
TrianglePair near_pair(std::mt19937_64& random) {
  TrianglePair pair{random_triangle(random), random_triangle(random)};
  const Vector3 n = random_direction(random);
  const Scalar gap = random_magnitude(-3, -0.3, random);
  if (random_index(8, random) == 0) return pair;
  Scalar overlap = -kInfinity;
  for (const Vector3& p : pair.a) {
    for (const Vector3& q : pair.b) overlap = std::max(overlap, n.dot(p - q));
  }
  translate(pair.b, (overlap + gap) * n);
  return pair;
}

TrianglePair touching_pair(std::mt19937_64& random) {
  TrianglePair pair{random_triangle(random), random_triangle(random)};
  const Vector3 target = random_point_of(pair.a, random_index(2, random) == 0, random);
  const bool with_vertex = random_index(2, random) == 0;
  const Vector3 source = with_vertex ? pair.b[0] : random_point_of(pair.b, true, random);
  translate(pair.b, target - source);
  // The rest of B on one side of A, so that this point is all they share.
  const Vector3 n = normal_of(pair.a);
  for (Vector3& p : pair.b) {
    const Scalar height = n.dot(p - target);
    if (height < 0) p -= 2 * height * n;
  }
  if (with_vertex) pair.b[0] = target;
  return pair;
}

// B has a vertex on each side of A at a distance of `depth`, and the edge between them passes
// through A at `through`.
TrianglePair pair_through(const Triangle& a, const Vector3& through, std::mt19937_64& random) {
  TrianglePair pair{a, {}};
  Vector3 up = random_direction(random);
  if (up.dot(normal_of(a)) < 0) up = -up;
  const Scalar below = random_number(0.1, 1, random);
  const Scalar above = random_number(0.1, 1, random);
  pair.b[0] = through - below * up;
  pair.b[1] = through + above * up;
  pair.b[2] = through + random_vector(1, random);
  return pair;
}

TrianglePair crossing_pair(std::mt19937_64& random) {
  const Triangle a = random_triangle(random);
  const Vector3 through = random_point_of(a, false, random);
  return pair_through(a, through, random);
}

TrianglePair nearly_crossing_pair(std::mt19937_64& random) {
  const Triangle a = random_triangle(random);
  Vector3 through = random_point_of(a, true, random);
  const Vector3 inward = normal_of(a).cross(a[1] - a[0]).normalized();
  const Scalar depth = random_magnitude(-16, -6, random);
  through += (random_index(2, random) == 0 ? depth : -depth) * inward;
  return pair_through(a, through, random);
}

Triangle random_point_triangle(std::mt19937_64& random) {
  const Vector3 p = random_vector(1, random);
  return {p, p, p};
}

Triangle random_segment(std::mt19937_64& random) {
  Triangle triangle = random_triangle(random);
  switch (random_index(3, random)) {
    case 0:  // a repeated vertex
      triangle[2] = triangle[1];
      break;
    case 1:  // a vertex between the others, up to rounding
      triangle[2] = random_point_of(triangle, true, random);
      break;
    default:  // exactly collinear and unordered
      triangle[1] = 2 * triangle[0];
      triangle[2] = -triangle[0];
      break;
  }
  return shuffled(triangle, random);
}

Triangle random_sliver(std::mt19937_64& random) {
  Triangle triangle = random_triangle(random);
  const Scalar width = random_magnitude(-16, -6, random);
  triangle[2] = random_point_of(triangle, true, random) + width * random_direction(random);
  return shuffled(triangle, random);
}

Triangle random_degenerate(std::mt19937_64& random) {
  switch (random_index(4, random)) {
    case 0:
      return random_point_triangle(random);
    case 1:
      return random_segment(random);
    case 2:
      return random_sliver(random);
    default:
      return random_triangle(random);
  }
}

TrianglePair degenerate_pair(std::mt19937_64& random) {
  TrianglePair pair{random_degenerate(random), random_degenerate(random)};
  if (random_index(4, random) == 0) pair.b[0] = pair.a[1];
  return pair;
}

TrianglePair sliver_pair(std::mt19937_64& random) {
  TrianglePair pair{random_sliver(random), random_sliver(random)};
  // In half of the cases they come near, which shows ill-conditioning.
  if (random_index(2, random) == 0) {
    const Vector3 target = random_point_of(pair.a, false, random);
    const Vector3 source = random_point_of(pair.b, false, random);
    const Scalar gap = random_magnitude(-16, -1, random);
    translate(pair.b, target - source + gap * random_direction(random));
  }
  return pair;
}

TrianglePair coplanar_pair(std::mt19937_64& random) {
  TrianglePair pair{random_triangle(random), random_triangle(random)};
  const Scalar height = random_number(-1, 1, random);
  const Scalar shift = random_number(0, 1.5, random);
  for (Vector3& p : pair.a) p.z() = height;
  for (Vector3& p : pair.b) p = Vector3(p.x() + shift, p.y(), height);
  if (random_index(2, random) == 0) return pair;
  const Matrix3 R = random_rotation(random).toRotationMatrix();
  for (Triangle* triangle : {&pair.a, &pair.b}) {
    for (Vector3& p : *triangle) p = R * p;
  }
  return pair;
}

TrianglePair parallel_edge_pair(std::mt19937_64& random) {
  TrianglePair pair = near_pair(random);
  // The factor is a power of two in half of the cases, so that only the sum rounds.
  const Scalar factor = random_index(2, random) == 0 ? 0.5 : random_number(-2, 2, random);
  pair.b[1] = pair.b[0] + factor * (pair.a[1] - pair.a[0]);
  return {shuffled(pair.a, random), shuffled(pair.b, random)};
}

TrianglePair sharing_pair(std::size_t count, std::mt19937_64& random) {
  TrianglePair pair{random_triangle(random), random_triangle(random)};
  for (std::size_t k = 0; k < count; ++k) pair.b[k] = pair.a[k];
  return {shuffled(pair.a, random), shuffled(pair.b, random)};
}

TrianglePair zero_area_pair(std::mt19937_64& random) {
  const auto one = [&] {
    return random_index(3, random) == 0 ? random_point_triangle(random) : random_segment(random);
  };
  TrianglePair pair{one(), one()};
  if (random_index(3, random) == 0) {
    const Vector3 source = random_point_of(pair.b, true, random);
    translate(pair.b, random_point_of(pair.a, true, random) - source);
  }
  return pair;
}

TrianglePair cad_pair(std::mt19937_64& random) {
  TrianglePair pair;
  for (Triangle* triangle : {&pair.a, &pair.b}) {
    for (Vector3& p : *triangle) {
      for (int k = 0; k < 3; ++k) p[k] = random_index(4, random);
    }
  }
  translate(pair.b, Vector3(random_index(4, random), 0, 0));
  return pair;
}

TrianglePair far_from_origin_pair(std::mt19937_64& random) {
  TrianglePair pair = near_pair(random);
  const Scalar distance = random_magnitude(3, 9, random);
  const Vector3 shift = distance * random_direction(random);
  translate(pair.a, shift);
  translate(pair.b, shift);
  return pair;
}

}  // namespace

const char* name_of(TriangleFamily family) {
  static constexpr std::array kNames{
      "Far",      "Near",           "Touching",     "Crossing",   "DegenerateMix", "Sliver",
      "Coplanar", "ParallelEdges",  "SharedVertex", "SharedEdge", "Duplicate",     "ZeroArea",
      "CadTies",  "NearlyCrossing", "Tiny",         "Huge",       "FarFromOrigin"};
  static_assert(kNames.size() == kAllTriangleFamilies.size());
  return kNames.at(static_cast<std::size_t>(family));
}

TrianglePair random_triangle_pair(TriangleFamily family, std::mt19937_64& random) {
  switch (family) {
    case TriangleFamily::Far:
      return far_pair(random);
    case TriangleFamily::Near:
      return near_pair(random);
    case TriangleFamily::Touching:
      return touching_pair(random);
    case TriangleFamily::Crossing:
      return crossing_pair(random);
    case TriangleFamily::DegenerateMix:
      return degenerate_pair(random);
    case TriangleFamily::Sliver:
      return sliver_pair(random);
    case TriangleFamily::Coplanar:
      return coplanar_pair(random);
    case TriangleFamily::ParallelEdges:
      return parallel_edge_pair(random);
    case TriangleFamily::SharedVertex:
      return sharing_pair(1, random);
    case TriangleFamily::SharedEdge:
      return sharing_pair(2, random);
    case TriangleFamily::Duplicate: {
      const Triangle a = random_triangle(random);
      return {a, shuffled(a, random)};
    }
    case TriangleFamily::ZeroArea:
      return zero_area_pair(random);
    case TriangleFamily::CadTies:
      return cad_pair(random);
    case TriangleFamily::NearlyCrossing:
      return nearly_crossing_pair(random);
    case TriangleFamily::Tiny:
      return scaled(near_pair(random), random_magnitude(-12, -6, random));
    case TriangleFamily::Huge:
      return scaled(near_pair(random), random_magnitude(6, 12, random));
    case TriangleFamily::FarFromOrigin:
      return far_from_origin_pair(random);
  }
  return {};
}

Scalar random_number(Scalar low, Scalar high, std::mt19937_64& random) {
  const Scalar unit = static_cast<Scalar>(random() >> 11) * 0x1p-53;
  return low + (high - low) * unit;
}

Scalar random_magnitude(Scalar low_exponent, Scalar high_exponent, std::mt19937_64& random) {
  return std::pow(10.0, random_number(low_exponent, high_exponent, random));
}

int random_index(int count, std::mt19937_64& random) {
  return static_cast<int>(random() % static_cast<std::uint64_t>(count));
}

Vector3 random_vector(Scalar half_width, std::mt19937_64& random) {
  Vector3 result;
  for (int k = 0; k < 3; ++k) result[k] = random_number(-half_width, half_width, random);
  return result;
}

Vector3 random_direction(std::mt19937_64& random) {
  // Archimedes: the height of a uniform point of the sphere is uniform.
  const Scalar z = random_number(-1, 1, random);
  const Scalar angle = random_number(0, kFullTurn, random);
  const Scalar r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

Quaternion random_rotation(std::mt19937_64& random) {
  // Two uniform circles whose squared radii add up to one are a uniform 3-sphere.
  const Scalar share = random_number(0, 1, random);
  const Scalar angle = random_number(0, kFullTurn, random);
  const Scalar other = random_number(0, kFullTurn, random);
  const Scalar r = std::sqrt(1 - share);
  const Scalar s = std::sqrt(share);
  return Quaternion(s * std::cos(other), r * std::sin(angle), r * std::cos(angle),
                    s * std::sin(other))
      .normalized();
}

RigidPose random_pose(Scalar half_width, std::mt19937_64& random) {
  const Quaternion q = random_rotation(random);
  return RigidPose(q, random_vector(half_width, random));
}

Twist random_twist(Scalar speed, Scalar turning_rate, std::mt19937_64& random) {
  Twist twist;
  const Scalar v = random_number(0, speed, random);
  twist.v_WB = v * random_direction(random);
  const Scalar w = random_number(0, turning_rate, random);
  twist.w_WB = w * random_direction(random);
  return twist;
}

}  // namespace dyop::testing
