// SPDX-License-Identifier: BSD-3-Clause
#include "c/sized_struct.h"

#include <gtest/gtest.h>

namespace dyop::c {

// A struct as it was released first, as it is, and as a newer header has it.
struct Older {
  std::uint32_t size;
  std::int32_t x;
};
struct Current {
  std::uint32_t size;
  std::int32_t x;
  double y;
};
struct Newer {
  std::uint32_t size;
  std::int32_t x;
  double y;
  double z;
};
template <>
inline constexpr std::uint32_t kFirstSize<Current> = sizeof(Older);

namespace {

const Current kDefaults{sizeof(Current), 1, 2};

TEST(SizedStruct, AnOlderCallerGetsTheDefaultsOfWhatItDoesNotKnow) {
  const Older older{sizeof(Older), 7};
  const Current read = read_struct(&older, kDefaults, "options");
  EXPECT_EQ(read.x, 7);
  EXPECT_EQ(read.y, 2);
}

TEST(SizedStruct, ANewerCallerMayUseOnlyWhatIsKnown) {
  Newer newer{sizeof(Newer), 7, 8, 0};
  EXPECT_EQ(read_struct(&newer, kDefaults, "options").y, 8);
  newer.z = 9;
  EXPECT_THROW(read_struct(&newer, kDefaults, "options"), Unsupported);
}

TEST(SizedStruct, NullMeansTheDefaultsAndAnUnsetSizeIsRefused) {
  EXPECT_EQ(read_struct<Current>(nullptr, kDefaults, "options").x, 1);
  const Current unset{0, 7, 8};
  EXPECT_THROW(read_struct(&unset, kDefaults, "options"), InvalidArgument);
}

TEST(SizedStruct, WritesNoMoreThanTheCallerHas) {
  struct {
    Older result;
    std::uint64_t guard;
  } older{{sizeof(Older), 0}, 0x1234};
  write_struct(Current{0, 5, 6}, sizeof(Older), &older.result);
  EXPECT_EQ(older.result.x, 5);
  EXPECT_EQ(older.result.size, sizeof(Older));
  EXPECT_EQ(older.guard, 0x1234u);
  Newer newer{sizeof(Newer), 0, 0, 3};
  write_struct(Current{0, 5, 6}, sizeof(Newer), &newer);
  EXPECT_EQ(newer.y, 6);
  EXPECT_EQ(newer.z, 0);
  EXPECT_EQ(newer.size, sizeof(Newer));
}

TEST(SizedStruct, ArraysGoByTheSizeOfTheFirst) {
  Newer newer[2] = {{sizeof(Newer), 1, 2, 0}, {sizeof(Newer), 3, 4, 0}};
  const SizedArray<Current, const std::byte> array(reinterpret_cast<const std::byte*>(newer), 2,
                                                   "queries");
  EXPECT_EQ(array.read(1).x, 3);
  newer[1].size = sizeof(Current);
  EXPECT_THROW(array.read(1), InvalidArgument);
  EXPECT_THROW((SizedArray<Current, std::byte>(nullptr, 1, "results")), InvalidArgument);
}

}  // namespace
}  // namespace dyop::c
