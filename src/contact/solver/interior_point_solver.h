// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact/solver/body_matrix.h"
#include "contact/solver/contact_system.h"
#include "contact/solver/nonsmooth_newton.h"
#include "contact/solver/row_barrier.h"
#include "dyop/contact/contact_solver.h"
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

// Solves a system as if nothing that presses slid: without De Saxce's shift the laws are the
// optimum of a convex problem,
//   min 1/2 |y|^2  such that  free + G y  in the dual cone of every contact,
// and likewise for the rows of joints; found by a primal-dual interior point method with Mehrotra's
// predictor ([Mehrotra1992]) in about ten factorisations, however many contacts are redundant.
// Where bodies rest that is the answer. Where something slides it is not: the run is given up as
// soon as that shows. Impulses of rolling and torsional friction stay as they are: where bodies
// rest they are as good as any.
//
// Or solves the laws with the shift, which every step linearises: the problem is then not convex and
// the matrix not symmetric, but nearly always it converges as fast. Newton's method on the laws then
// finds the digits that rounding hides.
class InteriorPointSolver {
 public:
  enum class Sliding { None, Any };

  // Leaves the impulses found in the system if they are good enough to go on from, else those it
  // had. Counts its factorisations as Newton's, whose limit it obeys.
  void improve(ContactSystem& system, const ContactSolverOptions& options, ContactReport& report,
               Sliding sliding = Sliding::None);

 private:
  // State of one contact. Scaled by the coefficient, impulses and velocities are both in the same
  // cone.
  struct Pair {
    std::size_t block;
    Vector3 scale;              // velocity = scale * u, lambda = scale * impulse, by component
    Vector3 impulse, velocity;  // inside the cone
    Vector3 gap;                // what the velocity lacks to be that of y
    Vector2 along;              // direction of the sliding velocity; zero without shift
    Vector3 wanted;             // change of the scaled product of impulse and velocity
    Vector3 impulse_step, velocity_step;
    Scalar way;  // that these may go until an edge of a cone
    ConeScaling scaling;
    Matrix3 stiffness;  // minus what impulses change per change of u

    // With the shift, velocity[0] is room + |velocity's tangential part|: the room, which belongs to
    // the normal velocity, changes linearly with u, the length does not.
    Scalar room() const { return velocity[0] - velocity.tail<2>().norm(); }
    Scalar room_step() const { return velocity_step[0] - along.dot(velocity_step.tail<2>()); }
  };
  static constexpr std::size_t kNoPair = std::size_t(-1);

  void list_pairs();
  void begin(ContactSystem& system);
  void begin_pair(Pair& pair) const;
  void measure_gap(Pair& pair) const;
  void find_way(Pair& pair) const;
  void go(Pair& pair, Scalar step) const;
  // Updates gaps and the mean product, and puts the impulses into the system.
  void evaluate();
  void measure();
  bool factorise();
  void solve();
  void predict_and_correct();
  bool keeps_going(Scalar before, Scalar step) const;
  void put_back(bool is_kept);
  void polish(const ContactSolverOptions& options, ContactReport& report);

  ContactSystem* system_ = nullptr;
  bool has_shift_ = false;
  BodyMatrix matrix_;
  NonsmoothNewton newton_;
  std::vector<Pair> pairs_;                          // of contacts
  std::vector<std::size_t> pair_of_block_;           // or kNoPair
  std::vector<RowBarrier> rows_;                     // of joints: the first blocks
  std::vector<Vector3> start_lambda_, best_lambda_;  // by block
  std::size_t products_ = 0;                         // of contacts and of bounds of rows
  std::vector<Vector6> y_, step_, lacking_;  // lacking_: what y lacks to be that of the impulses
  Scalar longest_step_ = 0;                  // until an edge of a cone, in units of the step
  Scalar product_ = 0;        // mean of impulse . velocity, and of what is like it at rows' bounds
  Scalar residual_ = 0;       // of the laws
  Scalar held_residual_ = 0;  // of the laws without shift
  Scalar best_residual_ = 0;
};

}  // namespace dyop::contact_internal
