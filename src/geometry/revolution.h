// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <numbers>

#include "geometry/solid.h"

namespace dyop::geometry_internal {

/// The mass of a solid of revolution about the z axis, whose outline is integrated piece by piece.
class Revolution {
 public:
  /// Adds the part of the outline over [from, to] of a parameter at which z, the squared radius and
  /// dz are given. Exact up to rounding for polynomials of degree 9.
  template <typename Outline>
  void add(Scalar from, Scalar to, const Outline& outline) {
    // Nodes and weights of Gauss and Legendre.
    static constexpr std::array<Scalar, 5> kNodes{0, -0.53846931010568309104,
                                                  0.53846931010568309104, -0.90617984593866399280,
                                                  0.90617984593866399280};
    static constexpr std::array<Scalar, 5> kWeights{0.56888888888888888889, 0.47862867049936646804,
                                                    0.47862867049936646804, 0.23692688505618908751,
                                                    0.23692688505618908751};
    for (std::size_t k = 0; k < kNodes.size(); ++k) {
      const Scalar x = (from + to) / 2 + (to - from) / 2 * kNodes[k];
      const auto [z, radius_sq, dz] = outline(x);
      const Scalar slice = kWeights[k] * (to - from) / 2 * dz * std::numbers::pi * radius_sq;
      volume_ += slice;
      first_ += slice * z;
      axial_ += slice * radius_sq / 2;
      across_ += slice * (radius_sq / 4 + z * z);
    }
  }

  MassProperties mass_properties(Scalar density) const {
    const Scalar middle = first_ / volume_;
    const Scalar across = across_ - volume_ * middle * middle;
    MassProperties properties;
    properties.mass = density * volume_;
    properties.p_BoBcm = Vector3(0, 0, middle);
    properties.I_BBcm = (density * Vector3(across, across, axial_)).asDiagonal();
    return require_representable(properties);
  }

 private:
  Scalar volume_ = 0;
  Scalar first_ = 0;  // integrals of z, of half the squared radius, and of x^2 + z^2
  Scalar axial_ = 0;
  Scalar across_ = 0;
};

/// What an outline gives: height, squared radius, and how fast the height changes.
struct OutlinePoint {
  Scalar z;
  Scalar radius_sq;
  Scalar dz;
};

}  // namespace dyop::geometry_internal
