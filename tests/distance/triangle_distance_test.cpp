#include "dyop/distance/triangle_distance.h"

#include <gtest/gtest.h>

#include "support/random_inputs.h"
#include "support/triangle_oracle.h"

namespace dyop {
namespace {

TEST(TriangleDistance, IsBracketedInEveryFamilyAsTheOracleSays) {
  for (const testing::TriangleFamily family : testing::kAllTriangleFamilies) {
    std::mt19937_64 random(static_cast<std::uint64_t>(family) + 100);
    for (int i = 0; i < 300; ++i) {
      const testing::TrianglePair pair = testing::random_triangle_pair(family, random);
      const testing::OracleDistance truth = testing::oracle_triangle_distance(pair.a, pair.b);
      const TriangleDistance result = triangle_distance(pair.a, pair.b);
      ASSERT_LE(result.lower, truth.upper()) << testing::name_of(family) << " " << i;
      ASSERT_GE(result.upper, truth.lower()) << testing::name_of(family) << " " << i;
      ASSERT_NEAR(result.normal.norm(), 1, 1e-12) << testing::name_of(family) << " " << i;
      if (family != testing::TriangleFamily::Sliver && !result.is_crossing) {
        ASSERT_LE(result.upper - result.lower, triangle_noise(pair.a, pair.b))
            << testing::name_of(family) << " " << i;
      }
    }
  }
}

}  // namespace
}  // namespace dyop
