// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "dyop/dynamics/world.h"

namespace dyop::testing {

/// The boxes of a World, in Bullet: the same places, masses, friction and gravity. Bodies never
/// fall asleep; all else is what Bullet does by default (single precision in Debian's packages, ten
/// iterations of its solver, margins within the boxes).
class BulletCopy {
 public:
  /// @throws InvalidArgument for a body that is neither a static nor a dynamic box.
  BulletCopy(const World& world, const Vector3& gravity_W);
  ~BulletCopy();
  BulletCopy(const BulletCopy&) = delete;
  BulletCopy& operator=(const BulletCopy&) = delete;

  void step(Scalar h);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace dyop::testing
