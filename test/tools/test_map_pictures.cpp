// SPDX-License-Identifier: BSD-3-Clause
// map_render draws what it is asked for.
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/voxels/uniform_boxes.h"
#include "tools/run_program.h"

#include <gtest/gtest.h>
#include <png.h>

#include <array>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::mentions;
using test::ProgramEnd;
using test::readText;
using test::runProgram;
using test::TemporaryFolder;

/// Red, green and blue of a pixel of a PNG.
std::array<int, 3> pixelOf(const std::string& file, int x, int y, int width) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  EXPECT_NE(png_image_begin_read_from_file(&image, file.c_str()), 0) << image.message;
  image.format = PNG_FORMAT_RGB;
  std::vector<std::uint8_t> rgb(PNG_IMAGE_SIZE(image));
  EXPECT_NE(png_image_finish_read(&image, nullptr, rgb.data(), 0, nullptr), 0);
  EXPECT_EQ(image.width, static_cast<png_uint_32>(width));
  const std::uint8_t* pixel = rgb.data() + 3 * (y * width + x);
  return {pixel[0], pixel[1], pixel[2]};
}

TEST(MapRender, drawsAMap) {
  const TemporaryFolder folder;
  MapSnapshot snapshot;
  snapshot.resolution_m = 1.0;
  // Free from x = 0 to 10, y = 0 to 10; a low block in its lower left quarter, a high one in the
  // upper right quarter.
  snapshot.bricks = toBricks({{{{0, 0, 0}, {5, 5, 1}}, 1.0F},
                              {{{5, 5, 0}, {10, 10, 6}}, 1.0F},
                              {{{0, 5, 0}, {5, 10, 1}}, -1.0F},
                              {{{5, 0, 0}, {10, 5, 1}}, -1.0F}})
                        .bricks;
  writeMapFile(folder / "map.cuboids", snapshot);
  const std::string picture = folder / "map.png";
  const auto draw = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments{
        MAP_RENDER_PROGRAM, folder / "map.cuboids", picture, "--width", "100", "--height", "100"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramEnd end = runProgram(arguments);
    EXPECT_EQ(end.status, 0) << end.err;
  };
  draw({});
  const auto low = pixelOf(picture, 30, 70, 100);
  const auto high = pixelOf(picture, 70, 30, 100);
  EXPECT_GT(low[2], low[0]) << "low is blue";
  EXPECT_GT(high[0], high[2]) << "high is red";
  EXPECT_EQ(pixelOf(picture, 30, 30, 100), (std::array<int, 3>{225, 228, 225})) << "free";
  EXPECT_EQ(pixelOf(picture, 1, 1, 100), (std::array<int, 3>{255, 255, 255})) << "unknown";
  draw({"--max-z", "1"});
  EXPECT_EQ(pixelOf(picture, 30, 70, 100), pixelOf(picture, 70, 30, 100)) << "cut at one height";
  draw({"--eye", "-20", "7.5", "3.5", "--look-at", "5", "7.5", "3.5"});
  const auto front = pixelOf(picture, 50, 50, 100);
  EXPECT_NE(front, (std::array<int, 3>{255, 255, 255})) << "the high block is in the middle";
  EXPECT_EQ(
      runProgram({MAP_RENDER_PROGRAM, folder / "map.cuboids", picture, "--min-z", "50"}).status, 1);
}

TEST(MapRender, drawsWhatColoursAreAskedToStandFor) {
  const TemporaryFolder folder;
  MapSnapshot snapshot;
  snapshot.resolution_m = 1.0;
  // A large cuboid on the left with high probability, then a small one with low; free on the right.
  snapshot.bricks = toBricks({{{{0, 0, 0}, {8, 8, 1}}, 3.0F},
                              {{{8, 0, 0}, {10, 8, 1}}, 0.0F},
                              {{{10, 0, 0}, {16, 8, 1}}, -1.0F}})
                        .bricks;
  writeMapFile(folder / "map.cuboids", snapshot);
  const std::string picture = folder / "map.png";
  const auto draw = [&](const std::string& colors) {
    return runProgram({MAP_RENDER_PROGRAM, folder / "map.cuboids", picture, "--width", "100",
                       "--height", "100", "--color-by", colors})
        .status;
  };
  const auto large = [&] { return pixelOf(picture, 26, 50, 100); };
  const auto small = [&] { return pixelOf(picture, 56, 50, 100); };
  ASSERT_EQ(draw("height"), 0);
  EXPECT_EQ(large(), small());
  ASSERT_EQ(draw("probability"), 0);
  EXPECT_GT(large()[0], small()[0]) << "redder";
  EXPECT_LT(large()[1], small()[1]) << "less green";
  ASSERT_EQ(draw("size"), 0);
  EXPECT_GT(large()[0], small()[0]) << "redder";
  ASSERT_EQ(draw("class"), 0);
  EXPECT_EQ(large(), small());
  EXPECT_GT(large()[2], large()[0]) << "blue";
  EXPECT_EQ(draw("taste"), 1);
}

TEST(MapRender, drawsALegend) {
  const TemporaryFolder folder;
  MapSnapshot snapshot;
  snapshot.resolution_m = 1.0;
  snapshot.bricks = toBricks({{{{0, 0, 0}, {100, 100, 1}}, 1.0F}}).bricks;
  writeMapFile(folder / "map.cuboids", snapshot);
  const std::string picture = folder / "map.ppm";
  ASSERT_EQ(runProgram({MAP_RENDER_PROGRAM, folder / "map.cuboids", picture, "--width", "420",
                        "--height", "420"})
                .status,
            0);
  const std::string bytes = readText(picture);
  const std::string head = "P6\n420 420\n255\n";
  ASSERT_EQ(bytes.substr(0, head.size()), head);
  ASSERT_EQ(bytes.size(), head.size() + 3 * 420 * 420);
  const auto red_at = [&](std::size_t x, std::size_t y) {
    return static_cast<unsigned char>(bytes[head.size() + 3 * (y * 420 + x)]);
  };
  // 105 m are 420 pixels high: the scale of 20 m is 80 pixels long, black from x = 16 on.
  EXPECT_EQ(red_at(16, 420 - 17), 20);
  EXPECT_EQ(red_at(16 + 79, 420 - 17), 20);
  EXPECT_EQ(red_at(16 + 80, 420 - 17), 255);
}

TEST(MapRender, drawsAndCountsTheCellsThatAreAskedFor) {
  const TemporaryFolder folder;
  const std::string map = folder / "map.cuboids";
  MapSnapshot snapshot;
  snapshot.resolution_m = 1.0;
  // Across a border of bricks, one log-odds: two leaves of 4 x 4 x 4 voxels, two cuboids, one joined cuboid.
  snapshot.bricks = toBricks({{{{4, 0, 0}, {12, 4, 4}}, 1.0F}}).bricks;
  writeMapFile(map, snapshot);
  const auto draw = [&](const std::string& cells) {
    return runProgram({MAP_RENDER_PROGRAM, map, folder / "map.png", "--cells", cells, "--edges",
                       "--bare", "--width", "90", "--height", "60"});
  };
  const std::vector<std::pair<std::string, std::string>> counts{{"cuboids", " 2 occupied cells"},
                                                                {"joined", " 1 occupied cells"},
                                                                {"octomap", " 2 occupied cells"},
                                                                {"voxels", " 128 occupied cells"}};
  for (const auto& [cells, count] : counts) {
    const ProgramEnd end = draw(cells);
    EXPECT_EQ(end.status, 0);
    EXPECT_TRUE(mentions(end.out, count)) << cells << ": " << end.out;
    // The border between the two bricks is in the middle of the picture, and dark unless they are joined.
    const auto middle = pixelOf(folder / "map.png", 45, 28, 90);
    const auto beside = pixelOf(folder / "map.png", 50, 28, 90);
    if (cells == "joined") {
      EXPECT_EQ(middle, beside);
    } else {
      EXPECT_LT(middle[2] + middle[1], beside[2] + beside[1]) << cells;
    }
  }
  EXPECT_EQ(runProgram({MAP_RENDER_PROGRAM, map, folder / "map.png", "--cells", "voxels"}).status,
            1)
      << "they would not show";
}

TEST(MapRender, doesNotLetAFewVoxelsTakeTheColours) {
  const TemporaryFolder folder;
  MapSnapshot snapshot;
  snapshot.resolution_m = 1.0;
  // Two levels of ground, and a bird high above.
  snapshot.bricks = toBricks({{{{0, 0, 0}, {10, 10, 1}}, 1.0F},
                              {{{10, 0, 2}, {20, 10, 3}}, 1.0F},
                              {{{0, 0, 500}, {1, 1, 501}}, 1.0F}})
                        .bricks;
  writeMapFile(folder / "map.cuboids", snapshot);
  ASSERT_EQ(runProgram({MAP_RENDER_PROGRAM, folder / "map.cuboids", folder / "map.png", "--width",
                        "100", "--height", "100"})
                .status,
            0);
  const auto low = pixelOf(folder / "map.png", 30, 50, 100);
  const auto high = pixelOf(folder / "map.png", 70, 50, 100);
  EXPECT_GT(low[2], low[0]) << "blue";
  EXPECT_GT(high[0], high[2]) << "red";
}

TEST(MapRender, refusesWhatIsNoPictureAndNoNumber) {
  const TemporaryFolder folder;
  const std::string map = folder / "map.cuboids";
  MapSnapshot snapshot;
  snapshot.resolution_m = 1.0;
  snapshot.bricks = toBricks({{{{0, 0, 0}, {8, 8, 1}}, 1.0F}}).bricks;
  writeMapFile(map, snapshot);
  const ProgramEnd jpg = runProgram({MAP_RENDER_PROGRAM, map, folder / "map.jpg"});
  EXPECT_EQ(jpg.status, 1);
  EXPECT_TRUE(mentions(jpg.err, "its name must end in .png or .ppm")) << jpg.err;
  for (const std::vector<std::string>& wrong :
       std::vector<std::vector<std::string>>{{"--eye", "nan", "0", "0", "--look-at", "1", "0", "0"},
                                             {"--eye", "0", "0", "0", "--look-at", "inf", "0", "0"},
                                             {"--max-z", "nan"}}) {
    std::vector<std::string> arguments{MAP_RENDER_PROGRAM, map, folder / "map.png"};
    arguments.insert(arguments.end(), wrong.begin(), wrong.end());
    const ProgramEnd end = runProgram(arguments);
    EXPECT_EQ(end.status, 1) << wrong[0];
    EXPECT_FALSE(end.err.empty());
  }
  EXPECT_EQ(folder.list().size(), 1U) << "nothing was written";
}

}  // namespace
}  // namespace cuboid_mapping
