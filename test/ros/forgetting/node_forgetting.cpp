// SPDX-License-Identifier: BSD-3-Clause
// A running node that forgets: what clouds saw before a file was loaded says nothing about the voxels of the file.
#include "cuboid_mapping/LoadMap.h"
#include "ros/driven_node.h"

#include <algorithm>

namespace cuboid_mapping_ros::test {
namespace {

class NodeForgetting : public DrivenNode {};

TEST_P(NodeForgetting, KeepsLoadedVoxelsThatNoCloudHasSeenSince) {
  start({"_forget_after:=3"});
  drive(0.0, 1.0);
  const auto before = saveMap();
  cuboid_mapping::LoadMap load;
  load.request.filename = folder_ / "saved.cuboids";
  ASSERT_TRUE(callService(std::string(kName) + "/load_map", load));
  ASSERT_TRUE(load.response.info.success) << load.response.info.message;
  drive(20.0, 45.0);
  const auto after = saveMap();
  EXPECT_GT(before.size(), 1000U);
  EXPECT_TRUE(std::all_of(before.begin(), before.end(),
                          [&](const auto& voxel) { return after.count(voxel.first) > 0; }));
  const bool has_first_places = std::any_of(after.begin(), after.end(), [](const auto& voxel) {
    return voxel.first.x > 150 && voxel.first.x < 210;
  });
  EXPECT_FALSE(has_first_places) << "clouds after the file are forgotten";
}

INSTANTIATE_TEST_SUITE_P(NodeAndNodelet, NodeForgetting, ::testing::Bool());

}  // namespace
}  // namespace cuboid_mapping_ros::test
