// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/io/result_text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "support/inputs/small_impact.h"

namespace dyop {
namespace {

TEST(ResultText, WritesADistanceAsJson) {
  DistanceResult result;
  result.status = DistanceStatus::FartherThanMaxDistance;
  result.lower = 1.0 / 3;
  result.triangle_b = 5;
  const auto json = nlohmann::json::parse(to_json_text(result));
  EXPECT_EQ(json.at("status"), "FartherThanMaxDistance");
  EXPECT_EQ(json.at("lower").get<Scalar>(), 1.0 / 3);
  EXPECT_TRUE(json.at("upper").is_null());  // infinite
  EXPECT_TRUE(json.at("triangle_a").is_null());
  EXPECT_EQ(json.at("triangle_b"), 5);
  EXPECT_TRUE(json.at("penetration").is_null());
}

TEST(ResultText, WritesATimeOfImpactAsJson) {
  const auto json = nlohmann::json::parse(to_json_text(testing::small_impact_result()));
  EXPECT_EQ(json.at("status"), "Impact");
  EXPECT_EQ(json.at("t_safe").get<Scalar>(), 1.0 / 3);
  EXPECT_EQ(json.at("contact").at("feature_a").at("kind"), "Edge");
  EXPECT_EQ(json.at("contact").at("feature_a").at("vertices").size(), 2u);
  EXPECT_EQ(json.at("statistics").at("node_pairs"), 33);
}

TEST(ResultText, NeverSaysThatAnUndecidedQueryMissed) {
  ToiResult result;
  for (const ToiStatus status :
       {ToiStatus::BudgetExhausted, ToiStatus::Cancelled, ToiStatus::NumericalLimit}) {
    result.status = status;
    EXPECT_TRUE(describe(result).starts_with("Undecided: ")) << describe(result);
    EXPECT_NE(describe(result).find("proven apart only before t = 0."), std::string::npos)
        << describe(result);
  }
  DistanceResult distance;
  distance.status = DistanceStatus::Inconclusive;
  EXPECT_TRUE(describe(distance).starts_with("Undecided: "));
}

TEST(ResultText, ShowsNoNegativeZero) {
  DistanceResult result;
  result.status = DistanceStatus::Separated;
  result.nhat_AB_W = -Vector3::UnitZ();
  EXPECT_NE(describe(result).find("(0, 0, -1) from"), std::string::npos) << describe(result);
}

TEST(ResultText, TellsPlacesApartFarFromTheOrigin) {
  for (const Scalar offset : {Scalar(0), Scalar(1), Scalar(1e6), Scalar(-1e9)}) {
    for (const Scalar gap : {Scalar(1e-3), Scalar(0.25), Scalar(3)}) {
      DistanceResult result;
      result.status = DistanceStatus::Separated;
      result.p_WCa = Vector3(offset, offset, offset);
      result.p_WCb = result.p_WCa + Vector3(0, gap, 0);
      result.lower = result.upper = gap;
      const std::string text = describe(result);
      const auto y_on = [&](const std::string& name) {
        const std::size_t at = text.find(", ", text.find("on " + name + ": (")) + 2;
        return std::stod(text.substr(at));
      };
      EXPECT_NEAR(y_on("B") - y_on("A"), gap, 0.2 * gap) << text;
    }
  }
}

TEST(ResultText, TellsTheEndsOfALateBracketApart) {
  ToiResult result;
  result.status = ToiStatus::Impact;
  result.t_safe = 1e6;
  result.t_hit = std::nextafter(1e6, 2e6);
  EXPECT_NE(describe(result).find("[1000000, 1000000.0000000001]"), std::string::npos)
      << describe(result);
  result.t_hit = result.t_safe;
  EXPECT_NE(describe(result).find("[1000000, 1000000]"), std::string::npos) << describe(result);
  result.t_hit = std::nullopt;
  result.t_safe = kInfinity;
  EXPECT_NE(describe(result).find("t = inf"), std::string::npos) << describe(result);
}

TEST(ResultText, DescribesAnImpactWithAllItsFigures) {
  const std::string text = describe(testing::small_impact_result(), {"tool", "organ"});
  for (const char* part :
       {"Impact at t = 0.333333333: tool and organ are proven apart until then.",
        "bracket      [0.333333333, 0.34]", "at least 0.1, at most 0.2",
        "on tool: (0.142857143, 2, 3), edge 4 5, triangle 17", "(0.6, 0.8, 0) from tool to organ",
        "pivot", "33 node pairs, 11 box tests, 22 leaf tests"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << "\nis missing in\n" << text;
  }
}

}  // namespace
}  // namespace dyop
