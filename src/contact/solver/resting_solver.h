// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact/solver/body_matrix.h"
#include "contact/solver/contact_system.h"
#include "contact/solver/second_order_cone.h"
#include "dyop/contact/contact_solver.h"

namespace dyop::contact_internal {

// Solves a system as if nothing that presses slid: without De Saxce's shift the laws are the optimum
// of a convex problem,
//   min 1/2 |y|^2  such that  free + G y  in the dual cone of every contact,
// found by a primal-dual interior point method with Mehrotra's predictor ([Mehrotra1992]) in about
// ten factorisations, however many contacts are redundant. Where bodies rest that is the answer.
// Where something slides it is not: the run is given up as soon as that shows. Only for systems
// that consist of contacts.
class RestingSolver {
 public:
  // Leaves the impulses found in the system if they nearly solve it, else those it had. Counts its
  // factorisations as Newton's, whose limit it obeys.
  void improve(ContactSystem& system, const ContactSolverOptions& options, ContactReport& report);

 private:
  // Of one contact. Scaled by the coefficient, impulses and velocities are both in the same cone.
  struct Pair {
    Vector3 scale;              // velocity = scale * u, lambda = scale * impulse, by component
    Vector3 impulse, velocity;  // inside the cone
    Vector3 gap;                // what the velocity lacks to be that of y
    Vector3 wanted;             // change of the scaled product of impulse and velocity
    Vector3 impulse_step, velocity_step;
    ConeScaling scaling;
  };

  void begin(ContactSystem& system);
  // Updates gaps and the mean product, and puts the impulses into the system.
  void evaluate();
  void measure();
  bool factorise();
  void solve();
  Scalar longest_step() const;
  void predict_and_correct();
  bool keeps_going(Scalar before, Scalar step) const;

  ContactSystem* system_ = nullptr;
  BodyMatrix matrix_;
  std::vector<Pair> pairs_;
  std::vector<Vector3> start_lambda_, best_lambda_;
  std::vector<Vector6> y_, step_, lacking_;  // lacking_: what y lacks to be that of the impulses
  Scalar product_ = 0;                       // mean of impulse . velocity
  Scalar residual_ = 0;                      // of the laws
  Scalar held_residual_ = 0;                 // of the laws without shift
  Scalar best_residual_ = 0;
};

}  // namespace dyop::contact_internal
