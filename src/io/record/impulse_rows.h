// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "dyop/dynamics/advance_report.h"
#include "io/record/recording_rows.h"

/// Velocity changes as rows, and back.
namespace dyop::io_internal {

/// The rows of one change, without its own.
struct VelocityChangeRows {
  std::vector<MomentumRow> momenta;
  std::vector<ContactImpulseRow> contacts;
  std::vector<LinkImpulseRow> links;
  std::vector<WrenchImpulseRow> wrenches;
};

/// Velocity and angular momentum of a body, as the last change left them.
struct KnownMomentum {
  bool is_known = false;
  Vector3 v_W = Vector3::Zero();
  Vector3 L_W = Vector3::Zero();
};

/// @param known By slot; updated.
/// @param has_wrench By slot.
VelocityChangeRows rows_of(const VelocityChange& change, std::vector<KnownMomentum>& known,
                           const std::vector<bool>& has_wrench);

/// Only the impulses of wrenches that have a row are known; the others are zero.
VelocityChange change_from(const VelocityChangeRow& row, const VelocityChangeRows& rows,
                           std::vector<KnownMomentum>& known);

}  // namespace dyop::io_internal
