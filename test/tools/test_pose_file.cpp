// SPDX-License-Identifier: BSD-3-Clause
#include "pose_file.h"

#include "cuboid_mapping/io/map_file_error.h"
#include "tools/run_program.h"

#include <gtest/gtest.h>

#include <fstream>

namespace cuboid_mapping {
namespace {

using test::TemporaryFolder;

TEST(PoseFile, hasStampsToTheNanosecond) {
  const TemporaryFolder folder;
  std::ofstream(folder / "poses.txt") << "1600000000.123456789 1 2 3 0 0 0 1\n"
                                         "  1.5e9 1 2 3 0 0 0.707 0.707\n1600000001 0 0 0 0 0 0 1\n"
                                         "1600000002.1 0 0 0 0 0 0 1\n";
  const auto poses = readPoseFile(folder / "poses.txt");
  ASSERT_EQ(poses.size(), 4U);
  EXPECT_EQ(poses[0].stamp_ns, 1600000000123456789);
  EXPECT_EQ(poses[0].T_map_body.translation(), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(poses[1].stamp_ns, 1500000000000000000);
  EXPECT_NEAR(poses[1].T_map_body.linear()(1, 0), 1.0, 1e-9) << "a quarter turn";
  EXPECT_EQ(poses[2].stamp_ns, 1600000001000000000);
  EXPECT_EQ(poses[3].stamp_ns, 1600000002100000000);
  EXPECT_THROW((void)readPoseFile(folder / "none.txt"), MapFileError);
}

TEST(PoseFile, mayHaveTheColumnsAndUnitsThatItNames) {
  const TemporaryFolder folder;
  for (const char* content :
       {"#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y "
        "[], "
        "q_RS_z [], v_RS_R_x [m s^-1]\n1403636579763555584,1,2,3,0.6,0,0,0.8,7\n",
        "timestamp,tx,ty,tz,qw,qx,qy,qz\n1403636579.763555584,1,2,3,0.6,0,0,0.8\n",
        "# stamp x y z qx qy qz qw\n1.403636579763555584e+18 1 2 3 0 0 0.8 0.6\n",
        "1403636579763555.584 1 2 3 0 0 0.8 0.6\n",
        "\xEF\xBB\xBF"
        "1403636579763555.584 1 2 3 0 0 0.8 0.6\r\n",
        "1403636579763555584 1 2 3 0 0 0.8 0.6\n1403636579763555584 1 2 3 0 0 0.8 0.6\n"}) {
    std::ofstream(folder / "poses.txt") << content;
    const auto poses = readPoseFile(folder / "poses.txt");
    ASSERT_EQ(poses.size(), 1U) << content;
    EXPECT_NEAR(static_cast<double>(poses[0].stamp_ns - 1403636579763555584), 0.0, 500.0);
    EXPECT_EQ(poses[0].T_map_body.translation(), Eigen::Vector3d(1, 2, 3)) << content;
    EXPECT_NEAR(poses[0].T_map_body.linear()(1, 0), 0.96, 1e-9) << content;
  }
  std::ofstream(folder / "poses.txt")
      << "1403636579763 1 2 3 0 0 0 1\n1403636579763001 1 2 3 0 0 0 1\n";
  const auto poses = readPoseFile(folder / "poses.txt");
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_EQ(poses[0].stamp_ns, 1403636579763000000) << "milliseconds";
  EXPECT_EQ(poses[1].stamp_ns, 1403636579763001000) << "microseconds";
}

TEST(PoseFile, isRefusedWithTheLineThatIsNoPose) {
  const TemporaryFolder folder;
  const std::pair<const char*, const char*> files[] = {
      {"", "has no poses"},
      {"# nothing\n\n", "has no poses"},
      {"1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0\n", "line 2: must be \"stamp x y z"},
      {"1 0 0 nan 0 0 0 1\n", "line 1"},
      {"1 0 0 0 0 0 0 0\n", "line 1"},
      {"1e30 0 0 0 0 0 0 1\n", "line 1"},
      {"12000000000 0 0 0 0 0 0 1\n", "line 1"},  // 12 s, or a day of 1970?
      {"1 0 0 0 0 0 0 1 5\n", "line 1"},
      {"x 0 0 0 0 0 0 1\n", "line 1"}};
  for (const auto& [content, text] : files) {
    std::ofstream(folder / "bad.txt") << content;
    try {
      (void)readPoseFile(folder / "bad.txt");
      ADD_FAILURE() << content;
    } catch (const MapFileError& error) {
      EXPECT_NE(std::string(error.what()).find(text), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace cuboid_mapping
