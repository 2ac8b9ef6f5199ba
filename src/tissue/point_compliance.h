// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "tissue/tissue_body.h"

namespace dyop::tissue_internal {

/// How points of the surface answer each other's impulses within a step, from the factor: near to
/// J A^-1 J^T. Points are added one after the other, each at the cost of its own blocks.
class PointCompliance {
 public:
  /// @param body Must outlive this, and not move meanwhile.
  explicit PointCompliance(TissueBody& body)
      : body_(body), place_of_(body.lattice().nodes().size(), -1) {}

  /// Finds what add() needs of points, for all of them together.
  void prepare(std::span<const CarriedPoint* const> points);
  /// Of a further point that is prepared: the velocities that an impulse on it makes at every point, its own last.
  /// Until the next call.
  std::span<const Matrix3> add(const CarriedPoint& point);

 private:
  struct Carrier {
    Eigen::Index place;  // of the node among all
    Scalar weight;
  };

  std::vector<Carrier> carriers_of(const CarriedPoint& point);
  void extend(std::vector<Matrix3>& column, std::int32_t node) const;

  TissueBody& body_;
  std::vector<std::int32_t> place_of_;  // among nodes_, of all nodes; -1: not there
  std::vector<std::int32_t> nodes_;
  std::vector<std::vector<Carrier>> points_;
  // Of each node: the velocities of all nodes, perhaps not yet of the newest.
  std::vector<std::vector<Matrix3>> columns_;
  std::vector<Matrix3> sum_;
  std::vector<Matrix3> blocks_;
};

}  // namespace dyop::tissue_internal
