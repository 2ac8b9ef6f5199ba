// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/types.h"

namespace dyop::contact_internal {

// The cone |(x1, x2)| <= x0 and its Jordan algebra ([Nesterov1997]). With x1 = x2 = 0 throughout it
// is the half line x0 >= 0.

// x0^2 - x1^2 - x2^2: positive inside the cone, zero at its edge.
Scalar cone_determinant(const Vector3& x);

// a o b = (a . b, a0 b12 + b0 a12). Zero for a and b in the cone exactly where a . b = 0.
Vector3 cone_product(const Vector3& a, const Vector3& b);

// The x with a o x = b, for an a inside the cone.
Vector3 cone_quotient(const Vector3& a, const Vector3& b);

// How far one may go along d from an x inside the cone until its edge, in units of d; infinite if d
// stays inside.
Scalar way_to_cone(const Vector3& x, const Vector3& d);

// Nesterov and Todd's scaling: for z and x inside the cone, the symmetric W that maps the cone onto
// itself and has W x = W^-1 z.
struct ConeScaling {
  Matrix3 W = Matrix3::Identity();
  Matrix3 inverse = Matrix3::Identity();
  Vector3 middle = Vector3::Zero();  // W x

  ConeScaling() = default;
  ConeScaling(const Vector3& z, const Vector3& x);
};

}  // namespace dyop::contact_internal
