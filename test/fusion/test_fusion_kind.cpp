// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/fusion_kind.h"

#include "cuboid_mapping/fusion/cuboid_tree.h"
#include "cuboid_mapping/map/cuboid_map.h"

#include <gtest/gtest.h>

#include <string>

namespace cuboid_mapping {
namespace {

constexpr FusionKind kKinds[] = {FusionKind::kClass, FusionKind::kGrowth, FusionKind::kNone};

TEST(FusionKind, isReadFromItsName) {
  for (const FusionKind kind : kKinds) EXPECT_EQ(parseFusionKind(toString(kind)), kind);
  EXPECT_EQ(parseFusionKind("class"), MapConfig().fusion) << "the default";
  for (const char* text : {"", "Class", "class ", "brick", "nothing"}) {
    EXPECT_FALSE(parseFusionKind(text)) << text;
  }
}

TEST(FusionKind, leavesTheOrderOfTheRTreeToTheConfiguration) {
  for (const FusionKind kind : kKinds) {
    MapConfig config;
    config.fusion = kind;
    config.rtree = {8, 3};
    const CuboidMap map(config);
    EXPECT_EQ(map.cuboids().inner().config().max_branches, 8);
    EXPECT_EQ(map.cuboids().inner().config().min_branches, 3);
  }
}

}  // namespace
}  // namespace cuboid_mapping
