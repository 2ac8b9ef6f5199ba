// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <vector>

#include "contact/solver/body_matrix.h"
#include "contact/solver/contact_system.h"
#include "dyop/contact/contact_solver.h"
#include "dyop/core/types.h"

namespace dyop::contact_internal {

// Newton's method on the laws themselves: lambda = P(lambda - rho u~) for every block, solved for
// impulses and velocities at once ([AlartCurnier1991], in the form of a natural map). From a good
// start a few factorisations do; from a bad one it may go round in circles, and gives up.
//
// Steps are regularised. Without joints they stay near the impulses before, which solves most
// problems. With joints it matters which of many solutions is found: with one, jaws drop what they
// hold with another. Contacts and joints then share their loads as springs of equal stiffness would,
// springs so stiff that the tolerance does not tell.
class NonsmoothNewton {
 public:
  // Improves the impulses in the system, by at most `limit` factorisations. Returns how many it took.
  int run(ContactSystem& system, const ContactSolverOptions& options, int limit);

  // The same from impulses that nearly solve the problem: even with joints, steps stay near them.
  int polish(ContactSystem& system, const ContactSolverOptions& options, int limit);

 private:
  // One block. Between its steps, impulses may be outside their cones.
  struct Law {
    Vector3 u = Vector3::Zero();          // relative velocity, without shift
    Vector3 raw = Vector3::Zero();        // lambda - rho u~
    Vector3 missing = Vector3::Zero();    // P(raw) - lambda: zero where the law holds
    Vector3 step = Vector3::Zero();       // of lambda
    Vector3 best = Vector3::Zero();       // lambda with the least error
    Matrix3 gain = Matrix3::Zero();       // change of lambda per change of `missing`
    Matrix3 stiffness = Matrix3::Zero();  // minus its change per change of u
    Vector3 along = Vector3::Zero();      // its change per change of the bound, of turning
  };

  void begin(ContactSystem& system);
  int iterate(const ContactSolverOptions& options, int limit);
  void evaluate();
  Scalar measure(std::size_t i);
  void assemble();
  void linearise(const Block& block, Law& law) const;
  bool step();
  void share_loads(Scalar tolerance);
  void hasten_drift(Scalar before);
  bool settle(Scalar tolerance);
  const Law& owner_of(std::size_t i) const {
    return laws_[std::size_t(system_->blocks()[i].owner)];
  }
  Scalar radius_of(const Block& block) const {
    if (block.owner < 0) return 0;
    return std::max(system_->blocks()[std::size_t(block.owner)].lambda[0], Scalar{0});
  }

  ContactSystem* system_ = nullptr;
  BodyMatrix matrix_;
  std::vector<Law> laws_;
  std::vector<Vector6> y_step_;
  Scalar softness_ = 0;
  bool shares_loads_ = false;
  Scalar error_ = kInfinity;  // largest |missing| / rho, a velocity
  Scalar least_error_ = kInfinity;
};

}  // namespace dyop::contact_internal
