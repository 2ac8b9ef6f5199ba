// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "dyop/chain/certify_chain.h"
#include "dyop/distance/distance_result.h"
#include "dyop/distance/point_distance.h"
#include "dyop/toi/toi_result.h"

namespace dyop::python {

/// Rows of structured arrays: plain numbers without gaps, so that equal answers are equal bytes.
/// What is not there is NaN (numbers) or -1 (indices).
struct WitnessRow {
  double lower;
  double upper;
  double p_WCa[3];
  double p_WCb[3];
  double nhat_AB_W[3];
  std::int32_t feature_a[4];  ///< kind, vertices
  std::int32_t feature_b[4];
  std::int32_t triangle_a;
  std::int32_t triangle_b;
  std::int32_t child_a;
  std::int32_t child_b;
};

struct ToiRow {
  double t_safe;
  double t_hit;
  WitnessRow contact;
  double closing_speed;
  double rounding_allowance;
  std::int64_t box_tests;
  std::int64_t leaf_tests;
  std::int64_t node_pairs;
  std::int64_t peak_queue;
  std::int64_t status;
};
static_assert(sizeof(WitnessRow) == 11 * 8 + 12 * 4);
static_assert(sizeof(ToiRow) == sizeof(WitnessRow) + 9 * 8);

struct DistanceRow {
  WitnessRow witness;
  double penetration_depth;
  double penetration_nhat_AB_W[3];
  double penetration_p_W[3];
  std::int64_t box_tests;
  std::int64_t leaf_tests;
  std::int64_t gjk_iterations;
  std::int64_t status;
};
static_assert(sizeof(DistanceRow) == sizeof(WitnessRow) + 11 * 8);

struct ChainRow {
  ToiRow toi;
  double free_fraction;
  std::int64_t link_a;
  std::int64_t link_b;
  std::int64_t obstacle;
};
static_assert(sizeof(ChainRow) == sizeof(ToiRow) + 4 * 8);

struct PointRow {
  double lower;
  double upper;
  double p_WC[3];
  double nhat_W[3];
  std::int32_t feature[4];
  std::int32_t triangle;
  std::int32_t child;
};
static_assert(sizeof(PointRow) == 8 * 8 + 6 * 4);

void fill_row(ToiRow& row, const ToiResult& result);
void fill_row(ChainRow& row, const ChainResult& result);
void fill_row(DistanceRow& row, const DistanceResult& result);
void fill_row(PointRow& row, const PointDistance& result);

}  // namespace dyop::python
