// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "dyop/distance/distance.h"
#include "dyop/toi/toi_batch.h"

namespace dyop::cli {

/// A time-of-impact query and its answer as an SVG file: both shapes at t_safe with their paths,
/// witness points, normal and pivot; the same from near; and the gap over time with the proven
/// lower bound.
std::string toi_picture(const ToiQuery& query, const ToiResult& result);

/// A distance query and its answer: the shapes, witness points, normal and pivot.
std::string distance_picture(const Shape& a, const RigidPose& X_WA, const Shape& b,
                             const RigidPose& X_WB, const DistanceResult& result);

}  // namespace dyop::cli
