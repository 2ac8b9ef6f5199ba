// SPDX-License-Identifier: BSD-3-Clause
#include "dynamics/step/ledger.h"

#include <gtest/gtest.h>

#include <memory>
#include <type_traits>

#include "dyop/core/error.h"
#include "dyop/geometry/primitives.h"

namespace dyop::dynamics_internal {
namespace {

// A proof cannot be made up.
static_assert(!std::is_constructible_v<PairProof, PairKey, TimeInterval, ProofKind>);
static_assert(!std::is_default_constructible_v<PairProof>);
static_assert(!std::is_default_constructible_v<Ledger>);

PairState pair_of(std::uint32_t a, std::uint32_t b) {
  PairState pair;
  pair.key = {a, b};
  return pair;
}

std::string refusal(const std::vector<PairKey>& candidates, const std::vector<PairProof>& proofs) {
  try {
    const Ledger ledger({0, 1}, candidates, proofs);
  } catch (const InternalError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Ledger, RefusesAPairWithoutAProof) {
  const std::vector<PairKey> candidates{{0, 1}, {0, 2}};
  const std::vector<PairProof> proofs{PairProof::at_rest({0, 2}, {0, 1})};
  EXPECT_NE(refusal(candidates, proofs).find("the pair 0, 1 is not proven from t = 0"),
            std::string::npos);
}

TEST(Ledger, RefusesAHoleBetweenProofs) {
  const std::vector<PairKey> candidates{{0, 1}};
  const std::vector<PairProof> proofs{PairProof::at_rest({0, 1}, {0, 0.25}),
                                      PairProof::at_rest({0, 1}, {0.5, 1})};
  EXPECT_NE(refusal(candidates, proofs).find("from t = 0.25 to 1"), std::string::npos);
}

TEST(Ledger, RefusesAProofThatEndsTooSoon) {
  const std::vector<PairKey> candidates{{0, 1}};
  const std::vector<PairProof> proofs{PairProof::at_rest({0, 1}, {0, 0.5})};
  EXPECT_THROW(Ledger({0, 1}, candidates, proofs), InternalError);
}

TEST(Ledger, KeepsTheWeakestProofOfAPair) {
  const PairState pair = pair_of(0, 1);
  ToiResult result;
  result.status = ToiStatus::Separated;
  const std::vector<PairKey> candidates{{0, 1}};
  const std::vector<PairProof> proofs{
      *PairProof::by_query(pair, {0.5, 1}, result),
      *PairProof::by_bound(pair, {0, 0.5}, 2, 0.5, 1),
  };
  const Ledger ledger({0, 1}, candidates, proofs);
  ASSERT_EQ(ledger.entries().size(), 1U);
  EXPECT_EQ(ledger.entries()[0].kind, ProofKind::ByQuery);
}

TEST(PairProof, AcceptsABoundOnlyAboveWhatIsKept) {
  const PairState pair = pair_of(0, 1);
  EXPECT_TRUE(PairProof::by_bound(pair, {0, 1}, 1, 0.4, 0.5).has_value());
  EXPECT_FALSE(PairProof::by_bound(pair, {0, 1}, 1, 0.5, 0.5).has_value());
  EXPECT_FALSE(PairProof::by_bound(pair, {0, 1}, kInfinity, kInfinity, 0.5).has_value());  // NaN
}

TEST(PairProof, AcceptsNoUndecidedQuery) {
  const PairState pair = pair_of(0, 1);
  for (const ToiStatus status :
       {ToiStatus::NotRun, ToiStatus::InitiallyWithinTarget, ToiStatus::BudgetExhausted,
        ToiStatus::Cancelled, ToiStatus::NumericalLimit}) {
    ToiResult result;
    result.status = status;
    result.t_safe = 1;
    EXPECT_FALSE(PairProof::by_query(pair, {0, 1}, result).has_value());
  }
  ToiResult hit;
  hit.status = ToiStatus::Impact;
  hit.t_safe = 0.5;
  EXPECT_FALSE(PairProof::by_query(pair, {0, 1}, hit).has_value());
  EXPECT_TRUE(PairProof::by_query(pair, {0, 0.5}, hit).has_value());
}

// Rounds of a substep ask again at the same poses; only bounds that a move has loosened are
// measured anew.
TEST(PairState, AKnownGapIsNotMeasuredAgain) {
  BodyDefinition ball;
  ball.kind = BodyKind::Static;
  ball.shape = std::make_shared<Sphere>(1);
  const BodyRecord body = make_body_record({}, ball, 0);
  PairState pair = pair_of(0, 1);
  pair.lengths.rest_offset = 1e-3;
  const auto measured_at = [&](Scalar x, Scalar enough) {
    measure_gap(pair, body, RigidPose(), body, RigidPose(Vector3(x, 0, 0)), enough);
    return pair.gap_lower;
  };
  EXPECT_NEAR(measured_at(2.5, 1), 0.5, 1e-12);
  EXPECT_NEAR(measured_at(2.25, 1), 0.5, 1e-12);  // the poses are taken to be those of before
  pair.loosen_bounds(1e-3);
  EXPECT_NEAR(measured_at(2.25, 1), 0.25, 1e-12);
  pair.gap_lower = -1;
  EXPECT_GE(measured_at(2.5, 0.125), 0.125);  // no more than was asked for
  EXPECT_NEAR(measured_at(2.5, 1), 0.5, 1e-12);
  // Bounds as far apart as a rest offset tell too little.
  pair.gap_lower = 0.5 - 5e-4;
  pair.gap_upper = 0.5 + 5e-4;
  EXPECT_NEAR(measured_at(2.5, 1), 0.5, 1e-12);
}

// However large the unit of length: -1 is no bound but says that there is none.
TEST(PairState, AnUnknownGapIsMeasuredAtAnyScale) {
  for (const Scalar scale : {1e-6, 1.0, 1e6, 1e12}) {
    BodyDefinition ball;
    ball.kind = BodyKind::Static;
    ball.shape = std::make_shared<Sphere>(scale);
    const BodyRecord body = make_body_record({}, ball, 0);
    PairState pair = pair_of(0, 1);
    pair.lengths.rest_offset = 1e-3 * scale;
    pair.gap_lower = -1;
    pair.gap_upper = 0;
    measure_gap(pair, body, RigidPose(), body, RigidPose(Vector3(2.5 * scale, 0, 0)), scale);
    EXPECT_NEAR(pair.gap_lower, 0.5 * scale, 1e-12 * scale);
  }
}

}  // namespace
}  // namespace dyop::dynamics_internal
