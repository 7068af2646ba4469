// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/voxels/uniform_boxes.h"
#include "support/snapshots.h"
#include "tools/run_program.h"

#include <gtest/gtest.h>

namespace cuboid_mapping {
namespace {

using test::ProgramEnd;
using test::runProgram;
using test::TemporaryFolder;

bool says(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(MapTools, putMapsTogether) {
  const TemporaryFolder folder;
  const auto write = [&folder](const std::string& name, const CellBox& box, float log_odds,
                               const std::string& frame_id) {
    MapSnapshot map;
    map.resolution_m = 0.5;
    map.frame_id = frame_id;
    map.bricks = toBricks({{box, log_odds}}).bricks;
    writeMapFile(folder / name, map);
  };
  write("a.cuboids", {{0, 0, 0}, {4, 2, 1}}, 1.0F, "map");
  write("b.cuboids", {{0, 0, 0}, {4, 2, 1}}, -0.5F, "map");
  const auto merge = [&folder](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{MAP_MERGE_PROGRAM, folder / "a.cuboids",
                                       folder / "b.cuboids", "-o", folder / "ab.cuboids"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return runProgram(arguments);
  };
  const auto voxels = [&folder] {
    return test::voxelsOf(readMapFile(folder / "ab.cuboids").snapshot.bricks);
  };
  ProgramEnd end = merge({});
  EXPECT_EQ(end.status, 0) << end.err;
  EXPECT_TRUE(says(end.out, "8 voxels known to both (8 of another class)")) << end.out;
  EXPECT_TRUE(says(end.out, "not the map that one mapper with all clouds")) << end.out;
  EXPECT_EQ(voxels().at({0, 0, 0}), 0.5F);
  end = merge({"--rule", "later"});
  EXPECT_EQ(voxels().at({0, 0, 0}), -0.5F) << end.err;
  end = merge({"--rule", "occupied"});
  EXPECT_EQ(voxels().at({0, 0, 0}), 1.0F) << end.err;
  // The box is rotated to x = -2 to 0, y = 0 to 4, and shifted to x = 0 to 2.
  end = merge({"--turn", "0", "0", "90", "--shift", "1", "0", "0"});
  EXPECT_TRUE(says(end.out, "exact")) << end.out << end.err;
  EXPECT_TRUE(says(end.out, "4 voxels known to both")) << end.out;
  EXPECT_EQ(voxels().size(), 12U);
  EXPECT_EQ(voxels().count({1, 3, 0}), 1U);
  end = merge({"--turn", "0", "0", "30"});
  EXPECT_TRUE(says(end.out, "resampled: voxels lie up to 0.")) << end.out << end.err;
  write("b.cuboids", {{0, 0, 0}, {1, 1, 1}}, 1.0F, "odom");
  end = merge({});
  EXPECT_EQ(end.status, 1);
  EXPECT_TRUE(says(end.err, "'map' and 'odom'")) << end.err;
  EXPECT_EQ(merge({"--shift", "0", "0", "0"}).status, 0);
  MapSnapshot coarse;
  coarse.resolution_m = 1.0;
  writeMapFile(folder / "b.cuboids", coarse);
  EXPECT_TRUE(says(merge({}).err, "different resolutions"));
  EXPECT_EQ(merge({"--rule", "mean"}).status, 1);
}

}  // namespace
}  // namespace cuboid_mapping
