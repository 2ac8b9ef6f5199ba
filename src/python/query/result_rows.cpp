// SPDX-License-Identifier: BSD-3-Clause
#include "python/query/result_rows.h"

#include <algorithm>
#include <limits>
#include <optional>

namespace dyop::python {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

void fill(double (&out)[3], const Vector3& v) {
  std::copy_n(v.data(), 3, out);
}

void fill(std::int32_t (&out)[4], const Feature& feature) {
  out[0] = std::int32_t(feature.kind);
  std::copy_n(feature.vertices.begin(), 3, out + 1);
}

void fill_witness(WitnessRow& row, const WitnessPair& pair) {
  row.lower = pair.lower;
  row.upper = pair.upper;
  fill(row.p_WCa, pair.p_WCa);
  fill(row.p_WCb, pair.p_WCb);
  fill(row.nhat_AB_W, pair.nhat_AB_W);
  fill(row.feature_a, pair.feature_a);
  fill(row.feature_b, pair.feature_b);
  row.triangle_a = pair.triangle_a.value_or(-1);
  row.triangle_b = pair.triangle_b.value_or(-1);
  row.child_a = pair.child_a.value_or(-1);
  row.child_b = pair.child_b.value_or(-1);
}

// Of a query without a contact.
WitnessPair no_witness() {
  WitnessPair pair;
  pair.lower = pair.upper = kNone;
  pair.p_WCa.setConstant(kNone);
  pair.p_WCb.setConstant(kNone);
  pair.nhat_AB_W.setConstant(kNone);
  return pair;
}

}  // namespace

void fill_row(ToiRow& row, const ToiResult& result) {
  row.t_safe = result.t_safe;
  row.t_hit = result.t_hit.value_or(kNone);
  fill_witness(row.contact,
               result.contact ? static_cast<const WitnessPair&>(*result.contact) : no_witness());
  row.closing_speed = result.contact ? result.contact->closing_speed : kNone;
  row.rounding_allowance = result.rounding_allowance;
  row.box_tests = result.statistics.box_tests;
  row.leaf_tests = result.statistics.leaf_tests;
  row.node_pairs = result.statistics.node_pairs;
  row.peak_queue = result.statistics.peak_queue;
  row.status = std::int64_t(result.status);
}

void fill_row(ChainRow& row, const ChainResult& result) {
  fill_row(row.toi, result.toi);
  row.free_fraction = result.free_fraction;
  row.link_a = result.link_a ? std::int64_t(*result.link_a) : -1;
  row.link_b = result.link_b ? std::int64_t(*result.link_b) : -1;
  row.obstacle = result.obstacle ? std::int64_t(*result.obstacle) : -1;
}

void fill_row(DistanceRow& row, const DistanceResult& result) {
  fill_witness(row.witness, result);
  row.penetration_depth = result.penetration ? result.penetration->depth : kNone;
  const Vector3 none = Vector3::Constant(kNone);
  fill(row.penetration_nhat_AB_W, result.penetration ? result.penetration->nhat_AB_W : none);
  fill(row.penetration_p_W, result.penetration ? result.penetration->p_W : none);
  row.box_tests = result.statistics.box_tests;
  row.leaf_tests = result.statistics.leaf_tests;
  row.gjk_iterations = result.statistics.gjk_iterations;
  row.status = std::int64_t(result.status);
}

void fill_row(PointRow& row, const PointDistance& result) {
  row.lower = result.lower;
  row.upper = result.upper;
  fill(row.p_WC, result.p_WC);
  fill(row.nhat_W, result.nhat_W);
  fill(row.feature, result.feature);
  row.triangle = result.triangle.value_or(-1);
  row.child = result.child.value_or(-1);
}

}  // namespace dyop::python
