// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/run_summary.h"

#include <gtest/gtest.h>

#include <sstream>

#include "io/scene/small_run.h"

namespace dyop {
namespace {

std::string summary_of(std::size_t impacts) {
  RunTotals totals;
  totals.add(testing::small_report());
  std::ostringstream out;
  write_summary(out, testing::small_scene(),
                std::vector<ImpactEvent>(impacts, testing::small_impact()), totals, 1.5);
  return out.str();
}

TEST(RunSummary, TellsWhatHappenedInWordsAndFigures) {
  const std::string text = summary_of(1);
  for (const char* part :
       {"Small\n", "  mover: sphere, dynamic\n", "  rester: sphere, static\n",
        "From t = 0 to t = 1 of 2: 1 impact. Completed at t = 1.\n",
        "Started too near and were pushed apart: mover and rester\n",
        "Impact 1 at t = 0.333333333: mover meets rester\n",
        "  proven apart until t = 0.333333333, in contact by t = 0.34\n",
        "  gap at that time: at least 0.1, at most 0.2; closing at 2.5\n",
        "  on mover: (0.142857143, 2, 3), edge 4 5, triangle 17\n",
        "  on rester: (0, 0, 0), smooth surface\n",
        "  normal from mover to rester: (0.6, 0.8, 0); pivot (0.0714285714, 1, 1.5)\n",
        "  found with 33 node pairs, 22 leaf tests\n", "1 place in contact", "impulse on rester",
        "  2 proven steps, 0 of islands", "8 by query",
        "  integrator: 5 steps, 6 rejected, 7 force evaluations", "  time spent: 1.5 s\n"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << "\nis missing in\n" << text;
  }
}

TEST(RunSummary, TellsTheFirstTwentyImpactsInFull) {
  const std::string text = summary_of(25);
  EXPECT_NE(text.find("Impact 20 at"), std::string::npos);
  EXPECT_EQ(text.find("Impact 21 at"), std::string::npos);
  EXPECT_NE(text.find("... and 5 more, in the recording."), std::string::npos);
}

TEST(RunSummary, NeverCallsAnUndecidedRunCompleted) {
  RunTotals totals;
  totals.t = 0.5;
  totals.offending_pair = {BodyId(0), BodyId(1)};
  for (const AdvanceStatus status :
       {AdvanceStatus::BudgetExhausted, AdvanceStatus::NumericalLimit}) {
    totals.status = status;
    const std::string text = describe_end(testing::small_scene(), totals);
    EXPECT_TRUE(text.starts_with("Undecided after t = 0.5")) << text;
    EXPECT_NE(text.find("mover and rester"), std::string::npos) << text;
  }
  totals.status = AdvanceStatus::Cancelled;
  EXPECT_EQ(describe_end(testing::small_scene(), totals), "Cancelled at t = 0.5. Safe until then.");
}

}  // namespace
}  // namespace dyop
