// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of SOFA as of 2025 with just what the adapter and its tests use.
#pragma once

#include <sofa/core/CollisionModel.h>

namespace sofa::core::collision {

class Intersection {
 public:
  virtual ~Intersection() = default;
  virtual SReal getAlarmDistance() const { return 0; }
  virtual SReal getContactDistance() const { return 0; }
};

}  // namespace sofa::core::collision
