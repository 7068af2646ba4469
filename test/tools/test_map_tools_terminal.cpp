// SPDX-License-Identifier: BSD-3-Clause
// The programs for files of maps on a terminal: progress bars and Ctrl-C.
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/voxels/uniform_boxes.h"
#include "tools/run_program.h"
#include "tools/terminal.h"

#include <gtest/gtest.h>

namespace cuboid_mapping {
namespace {

using test::Program;
using test::ProgramEnd;
using test::readText;
using test::runProgram;
using test::TemporaryFolder;
using test::Terminal;

using Arguments = std::vector<std::string>;

class MapToolsTerminal : public testing::Test {
 protected:
  void SetUp() override {
    if (!Terminal().isThere()) GTEST_SKIP() << "no pseudo-terminals on this machine";
    MapSnapshot snapshot;
    snapshot.resolution_m = 1.0;
    snapshot.bricks =
        toBricks({{{{0, 0, 0}, {5, 5, 1}}, 1.0F}, {{{5, 5, 0}, {10, 10, 6}}, -1.0F}}).bricks;
    writeMapFile(map_, snapshot);
  }

  /// An older file in the place of a program's output.
  std::string makeOldFile(const std::string& name) const {
    const std::string file = folder_ / name;
    std::ofstream(file) << "old";
    return file;
  }

  void expectOnlyOldFile(const std::string& file) const {
    EXPECT_EQ(readText(file), "old");
    EXPECT_FALSE(std::filesystem::exists(file + ".partial"));
  }

  TemporaryFolder folder_;
  std::string map_ = folder_ / "map.cuboids";
};

TEST_F(MapToolsTerminal, showsProgressBars) {
  const std::pair<Arguments, std::string> cases[] = {
      {{MAP_CONVERT_PROGRAM, map_, folder_ / "new.csv"}, "4 of 4 bricks written"},
      {{MAP_COMPARE_PROGRAM, map_, map_}, "4 of 4 bricks compared"},
      {{MAP_RENDER_PROGRAM, map_, folder_ / "new.png"}, "768 of 768 rows drawn"}};
  for (const auto& [arguments, bar] : cases) {
    Terminal terminal;
    EXPECT_EQ(runProgram(arguments, [&] { terminal.attach(); }).status, 0) << bar;
    EXPECT_NE(terminal.shown().find("\r[....."), std::string::npos) << terminal.shown();
    EXPECT_NE(terminal.shown().find("100 %  " + bar + " in "), std::string::npos)
        << terminal.shown();
    EXPECT_EQ(runProgram(arguments).err, "") << "a progress bar is for terminals";
  }
}

TEST_F(MapToolsTerminal, endsOnCtrlCWhileAMapIsRead) {
  MapSnapshot snapshot;
  snapshot.resolution_m = 1.0;
  // Reading takes much longer than pressing a key.
  snapshot.bricks = toBricks({{{{0, 0, 0}, {512, 512, 256}}, -1.0F}}).bricks;
  const std::string map = folder_ / "large.cuboids";
  writeMapFile(map, snapshot);
  const std::string output = makeOldFile("old.ot");
  const std::string picture = makeOldFile("old.png");
  const std::pair<std::string, Arguments> cases[] = {
      {"map_info", {MAP_INFO_PROGRAM, map}},
      {"map_convert", {MAP_CONVERT_PROGRAM, map, output}},
      {"map_compare", {MAP_COMPARE_PROGRAM, map, map_}},
      {"map_merge", {MAP_MERGE_PROGRAM, map, map_, "-o", output}},
      {"map_render", {MAP_RENDER_PROGRAM, map, picture}}};
  for (const auto& [name, arguments] : cases) {
    Terminal terminal;
    Program program(arguments, [&] { terminal.attach(); });
    ASSERT_TRUE(program.waitUntilItCatches(SIGINT)) << name;
    terminal.pressCtrlC();
    const ProgramEnd end = program.finish();
    EXPECT_EQ(end.status, 128 + SIGINT) << name << end.out;
    EXPECT_EQ(end.out, "") << name;
    EXPECT_NE(terminal.shown().find(name + ": interrupted"), std::string::npos) << terminal.shown();
    expectOnlyOldFile(output);
    expectOnlyOldFile(picture);
  }
}

TEST_F(MapToolsTerminal, endsOnCtrlCWhileAPictureIsDrawn) {
  const std::string picture = makeOldFile("old.png");
  Terminal terminal;
  // Many more rows than can be drawn before the key is pressed.
  Program program({MAP_RENDER_PROGRAM, map_, picture, "--width", "4096", "--height", "16384"},
                  [&] { terminal.attach(); });
  ASSERT_TRUE(terminal.waitFor("rows drawn")) << terminal.shown();
  terminal.pressCtrlC();
  EXPECT_EQ(program.finish().status, 128 + SIGINT);
  EXPECT_NE(terminal.shown().find("\nmap_render: interrupted"), std::string::npos)
      << terminal.shown();
  expectOnlyOldFile(picture);
}

TEST_F(MapToolsTerminal, endsOnCtrlCWhileABagIsRead) {
  const std::string bag = folder_ / "long.bag";
  ASSERT_EQ(runProgram({SIMULATED_LIDAR_PROGRAM, "--bag", bag, "--duration", "20"}).status, 0);
  const std::string map = makeOldFile("old.cuboids");
  Terminal terminal;
  Program program({BAG_TO_MAP_PROGRAM, bag, "-o", map, "--set", "resolution=0.02"},
                  [&] { terminal.attach(); });
  ASSERT_TRUE(terminal.waitFor("of 200 clouds")) << terminal.shown();
  terminal.pressCtrlC();
  EXPECT_EQ(program.finish().status, 128 + SIGINT);
  EXPECT_NE(terminal.shown().find("\nbag_to_map: interrupted"), std::string::npos)
      << terminal.shown();
  expectOnlyOldFile(map);
}

}  // namespace
}  // namespace cuboid_mapping
