// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <random>

#include "dyop/core/rigid_pose.h"
#include "dyop/core/types.h"
#include "dyop/motion/motion.h"

/// Random inputs that depend only on the generator's seed: the standard library's distributions,
/// whose results differ between implementations, are not used.
namespace dyop::testing {

/// Kinds of triangle pairs. Sizes are about one unless stated.
enum class TriangleFamily {
  Far,             ///< 6 to 10 apart
  Near,            ///< disjoint or not; gaps of about 1e-3 to 0.5
  Touching,        ///< a vertex or edge point of one on the other, up to rounding
  Crossing,        ///< an edge of one pierces the interior of the other
  DegenerateMix,   ///< points, segments and slivers against each other and against triangles
  Sliver,          ///< both a million to 1e16 times longer than wide
  Coplanar,        ///< in one plane: up to rounding, or exactly with z = const
  ParallelEdges,   ///< one edge of each parallel, exactly or up to rounding
  SharedVertex,    ///< one vertex in common, like neighbours in a mesh
  SharedEdge,      ///< two vertices in common
  Duplicate,       ///< the same triangle, vertices in any order
  ZeroArea,        ///< both without area: collinear or repeated vertices
  CadTies,         ///< small-integer coordinates: parallel, coplanar and equidistant throughout
  NearlyCrossing,  ///< an edge 1e-16 to 1e-6 beside or into the other triangle
  Tiny,            ///< Near, at 1e-12 to 1e-6
  Huge,            ///< Near, at 1e6 to 1e12
  FarFromOrigin,   ///< Near, at 1e3 to 1e9 from the origin
};

inline constexpr std::array kAllTriangleFamilies{
    TriangleFamily::Far,        TriangleFamily::Near,           TriangleFamily::Touching,
    TriangleFamily::Crossing,   TriangleFamily::DegenerateMix,  TriangleFamily::Sliver,
    TriangleFamily::Coplanar,   TriangleFamily::ParallelEdges,  TriangleFamily::SharedVertex,
    TriangleFamily::SharedEdge, TriangleFamily::Duplicate,      TriangleFamily::ZeroArea,
    TriangleFamily::CadTies,    TriangleFamily::NearlyCrossing, TriangleFamily::Tiny,
    TriangleFamily::Huge,       TriangleFamily::FarFromOrigin};

/// The enumerator's name, for messages.
const char* name_of(TriangleFamily family);

struct TrianglePair {
  Triangle a;
  Triangle b;
};

TrianglePair random_triangle_pair(TriangleFamily family, std::mt19937_64& random);

/// Uniform in [low, high).
Scalar random_number(Scalar low, Scalar high, std::mt19937_64& random);

/// 10^x for x uniform in [low_exponent, high_exponent).
Scalar random_magnitude(Scalar low_exponent, Scalar high_exponent, std::mt19937_64& random);

/// Uniform in 0 ... count - 1.
int random_index(int count, std::mt19937_64& random);

/// Coordinates uniform in [-half_width, half_width).
Vector3 random_vector(Scalar half_width, std::mt19937_64& random);

/// Uniform on the unit sphere.
Vector3 random_direction(std::mt19937_64& random);

/// Uniform over all rotations.
Quaternion random_rotation(std::mt19937_64& random);

/// Any rotation; coordinates of the origin up to `half_width`.
RigidPose random_pose(Scalar half_width, std::mt19937_64& random);

/// Random directions; |v| up to `speed` and |w| up to `turning_rate`, both uniform.
Twist random_twist(Scalar speed, Scalar turning_rate, std::mt19937_64& random);

}  // namespace dyop::testing
