// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "check/trusted/kernel.h"

/// The search for directions. UNTRUSTED: whatever it returns, a proof is evaluated by kernel.cpp.
namespace dyop_check {

struct Nearest {
  Vec direction;           ///< from A to B
  double distance = 0;     ///< of a point of A and one of B, so at least that of A and B
  bool they_meet = false;  ///< as far as rounding tells
};

/// Of two nodes, by GJK [GilbertJohnsonKeerthi1988].
/// @param guess A direction from A to B.
Nearest nearest_direction(const PosedNode& a, const PosedNode& b, const Vec& guess);

}  // namespace dyop_check
