// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "check/laws/law_data.h"

/// Newton's, Coulomb's and the impact law. What is checked is that the recorded impulses explain
/// the recorded velocities, and obey the laws: residuals are backward errors, the least change of
/// the data that makes them true. They say nothing about how near a run is to the exact solution.
namespace dyop_check {

/// The largest of many residuals, and where it was.
struct Worst {
  double value = 0;
  double t = 0;
  std::uint32_t a = 0;  ///< bodies
  std::uint32_t b = 0;

  void take(double residual, double time, std::uint32_t body, std::uint32_t other) {
    if (residual <= value) return;  // NaN is taken
    *this = {residual, time, body, other};
  }
};

/// Flights: segments in which a dynamic body follows a cubic.
struct FlightLaw {
  std::int64_t flights = 0;
  std::int64_t with_wrench = 0;  ///< not checked: nothing says what the body's own wrench was
  /// Change of momentum that gravity does not explain, over momentum; about the centre of mass the
  /// change of angular momentum, over its size. Over each half of a segment, and across joins.
  Worst linear;
  Worst angular;

  bool holds() const;
};

/// Contacts, joints and springs: all changes of velocity that are no flight.
struct ContactLaw {
  std::int64_t changes = 0;
  std::int64_t contacts = 0;
  std::int64_t links = 0;
  std::int64_t stalls = 0;    ///< changes in which bodies were stopped
  std::int64_t settings = 0;  ///< the caller's
  /// |change of momentum - sum of impulses| / sum of |impulse| for one body in one change; about
  /// the centre of mass the same.
  Worst linear;
  Worst angular;
  /// Velocity at the start of a change that is not that at the end of the last one or of the flight
  /// in between, over its size.
  Worst gap;
  /// Impulse outside the friction cone, over the largest impulse of the change.
  Worst cone;
  /// For each contact the smaller of |normal velocity after - target| over the largest speed and
  /// normal impulse over the largest impulse, both of the change.
  Worst complementarity;
  /// Target above restitution times approach, in impacts, over the approach.
  Worst restitution;
  /// Work of the impulses of an impact on the bodies, where it is positive, over kinetic energy.
  Worst energy;
  /// By how much the way of a body's points in a substep differs from what its velocity says, as
  /// gaps recover and joints close, over the most that these need.
  Worst recovery;
  /// Speed that a body lost when it fell asleep.
  Worst sleep;
  /// An impulse on a body that did not change, a wrong coefficient, more recovery than needed.
  std::vector<std::string> faults;  ///< the first ten
  std::int64_t fault_count = 0;
  /// Balances to 1e-9, no velocity jumps, no impulse is outside its cone, no restitution or energy
  /// beyond the law, no fault. Complementarity is what the run's solver reached: it is only told.
  bool holds() const;
  std::int64_t without_law =
      0;  ///< contacts whose coefficient is a function, or with unknown motion
};

FlightLaw check_flights(const Recording& recording, const LawData& data);
ContactLaw check_contacts(const Recording& recording, const LawData& data);

}  // namespace dyop_check
