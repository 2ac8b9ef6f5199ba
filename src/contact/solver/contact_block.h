// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/types.h"

namespace dyop::contact_internal {

using Vector6 = Eigen::Matrix<Scalar, 6, 1>;
using Rows6 = Eigen::Matrix<Scalar, 3, 6, Eigen::RowMajor>;

enum class BlockKind {
  Contact,  // impulse (normal, two tangents) in Coulomb's cone
  Row,      // of a joint: lower <= impulse <= upper
  Rolling,  // two components, bounded by the normal impulse of the contact `owner`
  Torsion,  // one component, bounded likewise
};

// What one contact or row requires of the bodies, in coordinates in which every body has unit mass:
// body velocity = free velocity + S y with S S^T the mobility, relative velocity minus target u =
// free + G_a y_a + G_b y_b, and y = sum of G^T lambda. Rows that a kind does not have are zero.
// Tangents of an ellipse are scaled so that its cone is round; rolling and torsional rows are
// scaled by their coefficient (a length), which makes it one and u a length per time.
struct Block {
  BlockKind kind = BlockKind::Contact;
  int slot_a = -1;  // index into y; negative: immovable
  int slot_b = -1;
  int owner = -1;  // the contact block whose normal impulse bounds this one
  Rows6 G_a = Rows6::Zero();
  Rows6 G_b = Rows6::Zero();
  Vector3 free = Vector3::Zero();
  Matrix3 W = Matrix3::Zero();  // G_a G_a^T + G_b G_b^T
  Scalar weight = 0;            // trace of W with compliance
  Scalar friction = 0;
  Scalar lower = 0;
  Scalar upper = 0;
  Scalar compliance = 0;
  Vector3 lambda = Vector3::Zero();
  Scalar slip = 0;  // of the last local solution, see solve_contact(); starts the next one
};

}  // namespace dyop::contact_internal
