#include "motion/bernstein.h"

namespace dyop::internal {

Bernstein<4> cubic_hermite(const Vector3& x0, const Vector3& v0, const Vector3& x1,
                           const Vector3& v1, Scalar h) {
  return {x0, x0 + h / 3 * v0, x1 - h / 3 * v1, x1};
}

// Coefficient k of a product of Bernstein polynomials of degrees 3 and 2:
// sum over i + j = k of C(3,i) C(2,j) / C(5,k) x_i x y_j.
Bernstein<6> cross_product(const Bernstein<4>& x, const Bernstein<3>& y) {
  return {x[0].cross(y[0]),
          0.6 * x[1].cross(y[0]) + 0.4 * x[0].cross(y[1]),
          0.3 * x[2].cross(y[0]) + 0.6 * x[1].cross(y[1]) + 0.1 * x[0].cross(y[2]),
          0.1 * x[3].cross(y[0]) + 0.6 * x[2].cross(y[1]) + 0.3 * x[1].cross(y[2]),
          0.4 * x[3].cross(y[1]) + 0.6 * x[2].cross(y[2]),
          x[3].cross(y[2])};
}

}  // namespace dyop::internal
