// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/make_fusion.h"

#include "cuboid_mapping/fusion/class_fusion.h"
#include "cuboid_mapping/fusion/growth_fusion.h"

#include <gtest/gtest.h>

#include <string>

namespace cuboid_mapping {
namespace {

constexpr FusionKind kKinds[] = {FusionKind::kClass, FusionKind::kGrowth, FusionKind::kNone};

TEST(FusionKind, isReadFromItsName) {
  for (const FusionKind kind : kKinds) EXPECT_EQ(parseFusionKind(toString(kind)), kind);
  EXPECT_EQ(parseFusionKind("class"), FusionConfig().kind) << "the default";
  for (const char* text : {"", "Class", "class ", "brick", "nothing"}) {
    EXPECT_FALSE(parseFusionKind(text)) << text;
  }
}

TEST(FusionKind, makesItsBackEndWithATreeOfTheGivenOrder) {
  for (const FusionKind kind : kKinds) {
    FusionConfig config;
    config.kind = kind;
    config.rtree = {8, 3};
    const std::unique_ptr<Fusion> fusion = makeFusion(config, SensorModel());
    ASSERT_NE(fusion, nullptr);
    EXPECT_EQ(dynamic_cast<const GrowthFusion*>(fusion.get()) != nullptr,
              kind == FusionKind::kGrowth);
    EXPECT_EQ(dynamic_cast<const ClassFusion*>(fusion.get()) != nullptr,
              kind != FusionKind::kGrowth);
    EXPECT_EQ(fusion->tree().config().max_branches, 8);
    EXPECT_TRUE(fusion->tree().isEmpty());
    EXPECT_FALSE(fusion->isAnyWaiting());
  }
}

}  // namespace
}  // namespace cuboid_mapping
