// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "dyop/dynamics/world.h"

namespace dyop::testing {

/// Adds one body that rolls, rocks, slides or pivots on a fixed one, friction 1, without losses, to
/// a World with gravity along -z:
/// - disc, half-disc: meshes of radius 1 on a floor; the disc rolls at speed 1, the half one rocks;
/// - coin: Euler's disc, spins on its edge at a lean of 0.3;
/// - oloid: a hull, rolls down from a line of contact off its equilibrium;
/// - trough, bowl (FACETS: strips, rings): a ball rolls in them; slick-trough: slides;
/// - ball, capsule: shapes without facets roll off the top of a ball, spinning about the normal
/// too;
/// - rod: a box falls over its lower edge.
/// "compound-" before a name makes both bodies the only children of compounds whose frames are
/// elsewhere. The scene is turned by `azimuth` about z.
/// @throws std::runtime_error for another name.
void add_rolling_scene(World& world, const std::string& name, int facets, Scalar azimuth);

/// The largest |error| of the energy on the way to the time `end` in steps h, relative to the
/// largest kinetic energy on it.
Scalar rolling_energy_error(const std::string& scene, int facets, Scalar azimuth, Scalar h,
                            Scalar end);

}  // namespace dyop::testing
