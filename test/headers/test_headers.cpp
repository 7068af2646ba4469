// SPDX-License-Identifier: BSD-3-Clause
// All public headers, with those of the client, messages and services, in one file.
#include "all_headers.h"

#include <gtest/gtest.h>

namespace cuboid_mapping {
namespace {

TEST(AllHeaders, areManyAndAreIncludedTogether) {
  EXPECT_GT(NUM_HEADERS, CUBOID_MAPPING_HAS_MESSAGES ? 50 : 30);
  EXPECT_EQ(CuboidMap().revision(), 0U);
}

#if CUBOID_MAPPING_HAS_MESSAGES
TEST(AllHeaders, tellTheMapFromItsMessage) {
  FullCuboidMap message;
  message.revision = 7;
  const CuboidMap map;
  EXPECT_NE(map.revision(), message.revision);
}
#endif

}  // namespace
}  // namespace cuboid_mapping
