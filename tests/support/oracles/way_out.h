// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "dyop/haptics/haptic_tick.h"

namespace dyop::testing {

/// A direction of motion of a tool without hinges.
struct ToolDirection {
  Vector3 v_W = Vector3::Zero();
  Vector3 w_W = Vector3::Zero();  ///< times `reach` as long as v_W where both move a point alike
};

/// A direction in which the gaps of all active contacts of a tick grow: a solution of the linear
/// program n_i . (v + w x r_i / reach) > 0, with a margin of at least `least` for unit (v, w) and
/// rows of unit length.
///
/// Rosenblatt's rule finds one within 1 / margin^2 corrections if there is any; nothing is found
/// without a certificate, so an answer is right.
inline std::optional<ToolDirection> way_out(const HapticTick& tick, Scalar reach, Scalar least) {
  using Row = Eigen::Matrix<Scalar, 6, 1>;
  std::vector<Row> rows;
  for (const ToolContactPoint& contact : tick.contacts) {
    const Vector3 r_W = contact.p_W - tick.tool.X_WT.translation();
    Row row;
    row << contact.nhat_W, r_W.cross(contact.nhat_W) / reach;
    rows.push_back(row.normalized());
  }
  if (rows.empty()) return std::nullopt;
  Row sum = Row::Zero();
  for (const Row& row : rows) sum += row;
  for (int k = 0; k < 20'000; ++k) {
    const Row* worst = &rows.front();
    for (const Row& row : rows) {
      if (row.dot(sum) < worst->dot(sum)) worst = &row;
    }
    if (worst->dot(sum) > least * sum.norm()) {
      const Row x = sum.normalized();
      return ToolDirection{x.head<3>(), x.tail<3>()};
    }
    sum += *worst;
  }
  return std::nullopt;
}

}  // namespace dyop::testing
