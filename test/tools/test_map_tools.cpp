// SPDX-License-Identifier: BSD-3-Clause
// The programs for files of maps, and bag_to_map.
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/voxels/uniform_boxes.h"
#include "support/snapshots.h"
#include "tools/run_program.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace cuboid_mapping {
namespace {

using test::mentions;
using test::ProgramEnd;
using test::Random;
using test::readText;
using test::runProgram;
using test::TemporaryFolder;

MapSnapshot makeSnapshot() {
  Random random(71);
  MapSnapshot snapshot = test::randomSnapshot(random);
  snapshot.resolution_m = 0.1;
  snapshot.environment = Environment::kDynamic;
  return snapshot;
}

TEST(MapTools, explainThemselves) {
  for (const char* program : {BAG_TO_MAP_PROGRAM, MAP_INFO_PROGRAM, MAP_CONVERT_PROGRAM,
                              MAP_COMPARE_PROGRAM, MAP_MERGE_PROGRAM, MAP_RENDER_PROGRAM}) {
    const ProgramEnd help = runProgram({program, "--help"});
    EXPECT_EQ(help.status, 0) << program;
    EXPECT_TRUE(mentions(help.out, "Usage")) << help.out;
    EXPECT_EQ(runProgram({program}).status, 1) << program;
    const ProgramEnd wrong = runProgram({program, "/no/map", "/no/other.ot", "-o", "x.cuboids"});
    EXPECT_EQ(wrong.status, 1) << program;
    EXPECT_FALSE(wrong.err.empty()) << program;
  }
}

TEST(MapTools, convertAndCompare) {
  const TemporaryFolder folder;
  const MapSnapshot snapshot = makeSnapshot();
  const std::string first = folder / "map.cuboids";
  writeMapFile(first, snapshot);
  for (const std::string ending : {".ot", ".bt", ".cuboids", ".sqlite"}) {
    const std::string second = folder / ("other" + ending);
    EXPECT_EQ(runProgram({MAP_CONVERT_PROGRAM, first, second}).status, 0);
    const ProgramEnd end = runProgram({MAP_COMPARE_PROGRAM, first, second});
    EXPECT_EQ(end.status, 0) << end.out << end.err;
    EXPECT_TRUE(mentions(end.out, "the maps agree")) << end.out;
  }
  EXPECT_EQ(runProgram({MAP_CONVERT_PROGRAM, first, folder / "map.txt"}).status, 1);
  for (const std::string name : {"none.txt", "none.sqlite"}) {
    const std::string missing = folder / name;
    const std::string error = runProgram({MAP_CONVERT_PROGRAM, missing, first}).err;
    EXPECT_TRUE(mentions(error, missing) && mentions(error, "No such file")) << error;
  }
}

TEST(MapTools, sayWhatTheyHaveWritten) {
  const TemporaryFolder folder;
  MapSnapshot snapshot;
  snapshot.bricks =
      toBricks({{{{0, 0, 0}, {2, 2, 2}}, 1.0F}, {{{-2, 0, 0}, {0, 1, 1}}, -1.0F}}).bricks;
  writeMapFile(folder / "map.cuboids", snapshot);
  const std::vector<std::pair<std::string, std::string>> cases{
      {"b.cuboids", "10 voxels"}, {"b.ot", "10 voxels"}, {"b.bt", "10 voxels"},
      {"b.pcd", "8 points"},      {"b.ply", "8 points"}, {"b.csv", "2 cuboids"}};
  for (const auto& [name, content] : cases) {
    const std::string file = folder / name;
    const ProgramEnd end = runProgram({MAP_CONVERT_PROGRAM, folder / "map.cuboids", file});
    EXPECT_EQ(end.out.rfind(file + ": " + content + ", ", 0), 0U) << end.out << end.err;
  }
}

TEST(MapTools, readAStoreAsAMap) {
  const TemporaryFolder folder;
  const MapSnapshot snapshot = makeSnapshot();
  const std::string file = folder / "map.cuboids";
  const std::string store = folder / "map.sqlite";
  writeMapFile(file, snapshot);
  writeMapFile(store, snapshot);
  const auto content = [](const std::string& map) {
    const std::string out = runProgram({MAP_INFO_PROGRAM, map}).out;
    return out.substr(std::min(out.size(), out.find("resolution:")));
  };
  EXPECT_EQ(content(store), content(file));
  EXPECT_TRUE(mentions(runProgram({MAP_INFO_PROGRAM, store}).out, "pages:        "));
  EXPECT_EQ(runProgram({MAP_RENDER_PROGRAM, store, folder / "map.png"}).status, 0);
  // Copies it to another store, page by page, and a part of it to every format alike.
  const std::string copy = folder / "copy.sqlite";
  EXPECT_EQ(runProgram({MAP_CONVERT_PROGRAM, store, copy, "--frame", "mars"}).status, 0);
  EXPECT_EQ(readMapFile(copy).snapshot.frame_id, "mars");
  EXPECT_TRUE(mentions(runProgram({MAP_COMPARE_PROGRAM, copy, file}).out, "the maps agree"));
  std::map<Cell, float> part = test::voxelsOf(snapshot.bricks);
  for (auto voxel = part.begin(); voxel != part.end();) {
    voxel = CellBox{{-10, -5, 0}, {5, 5, 10}}.contains(voxel->first) ? std::next(voxel)
                                                                     : part.erase(voxel);
  }
  for (const std::string& input : {file, store}) {
    for (const std::string name : {"part.cuboids", "copy.sqlite", "part.ot"}) {
      const std::string output = folder / name;
      const ProgramEnd end = runProgram({MAP_CONVERT_PROGRAM, input, output, "--min", "-1", "-0.5",
                                         "0", "--max", "0.5", "0.5", "1"});
      EXPECT_EQ(end.status, 0) << end.err;
      EXPECT_EQ(test::voxelsOf(readMapFile(output).snapshot.bricks), part) << output;
    }
  }
  const ProgramEnd one = runProgram({MAP_CONVERT_PROGRAM, store, copy, "--min", "1", "1", "1"});
  EXPECT_TRUE(mentions(one.err, "both --min and --max")) << one.err;
}

TEST(MapTools, copyFusedCuboidsFromStoreToStore) {
  const TemporaryFolder folder;
  MapSnapshot snapshot;
  const CellBox fused{{0, 0, 0}, {12, 2, 2}};
  snapshot.bricks = toBricks({{fused, 1.0F}}).bricks;
  snapshot.cuboids = {{fused, Occupancy::kOccupied}};
  const std::string store = folder / "map.sqlite";
  const std::string copy = folder / "copy.sqlite";
  writeMapFile(store, snapshot);
  ASSERT_EQ(runProgram({MAP_CONVERT_PROGRAM, store, copy}).status, 0);
  const std::vector<Cuboid> copied = readMapFile(copy).snapshot.cuboids;
  ASSERT_EQ(copied.size(), 1U);
  EXPECT_EQ(copied.front().box, fused);
}

TEST(MapTools, tellHowMapsDiffer) {
  const TemporaryFolder folder;
  const MapSnapshot snapshot = makeSnapshot();
  MapSnapshot other = snapshot;
  PackedVoxels& changed = other.bricks[other.bricks.size() / 2].voxels;
  const int num_changed = changed.occupied().count();
  ASSERT_GT(num_changed, 0);
  (void)changed.replace(changed.occupied(), PackedVoxels(BrickMask::all(), -1.0F), changed);
  other.bricks.erase(other.bricks.begin());
  writeMapFile(folder / "a.cuboids", snapshot);
  writeMapFile(folder / "b.cuboids", other);
  ProgramEnd end = runProgram({MAP_COMPARE_PROGRAM, folder / "a.cuboids", folder / "b.cuboids"});
  EXPECT_EQ(end.status, 2) << end.out;
  const int num_missing = snapshot.bricks[0].voxels.known().count();
  EXPECT_TRUE(mentions(end.out, "only in the first: " + std::to_string(num_missing))) << end.out;
  EXPECT_TRUE(mentions(end.out, "different class:   " + std::to_string(num_changed))) << end.out;
  other.resolution_m = 0.2;
  writeMapFile(folder / "b.cuboids", other);
  end = runProgram({MAP_COMPARE_PROGRAM, folder / "a.cuboids", folder / "b.cuboids"});
  EXPECT_EQ(end.status, 1);
  EXPECT_TRUE(mentions(end.err, "different resolutions")) << end.err;
}

TEST(MapTools, takeTheSensorModelByTheNamesOfTheNode) {
  const TemporaryFolder folder;
  writeMapFile(folder / "map.bt", makeSnapshot());
  ASSERT_EQ(runProgram({MAP_CONVERT_PROGRAM, folder / "map.bt", folder / "map.cuboids",
                        "--sensor_model/min", "0.2", "--sensor_model/max=0.9"})
                .status,
            0);
  const ProgramEnd end = runProgram({MAP_INFO_PROGRAM, folder / "map.cuboids"});
  EXPECT_TRUE(mentions(end.out, "min 0.2, max 0.9")) << end.out;
}

TEST(MapTools, sayWhatIsInAMap) {
  const TemporaryFolder folder;
  MapSnapshot snapshot;
  snapshot.resolution_m = 0.5;
  snapshot.frame_id = "odom";
  snapshot.bricks =
      toBricks({{{{0, 0, 0}, {2, 2, 2}}, 1.0F}, {{{-2, 0, 0}, {0, 1, 1}}, -1.0F}}).bricks;
  writeMapFile(folder / "map.cuboids", snapshot);
  const ProgramEnd end = runProgram({MAP_INFO_PROGRAM, folder / "map.cuboids"});
  EXPECT_EQ(end.status, 0);
  EXPECT_TRUE(mentions(end.out, "native") && mentions(end.out, "odom")) << end.out;
  EXPECT_TRUE(mentions(end.out, "1 cuboid, 8 voxels, 1 m^3")) << end.out;
  EXPECT_TRUE(mentions(end.out, "1 cuboid, 2 voxels, 0.25 m^3")) << end.out;
}

/// Expects that a program reports why it cannot write: on a full disk, into a missing folder,
/// and over a folder.
/// @param run  Runs it. Gets the file to write and a function to call before.
void expectErrorsOfWriting(
    const std::string& ending,
    const std::function<ProgramEnd(const std::string&, const std::function<void()>&)>& run) {
  const TemporaryFolder folder;
  const std::string file = folder / ("map." + ending);
  const auto expect_error = [&](const std::string& output, const std::string& reason,
                                const std::function<void()>& prepare) {
    const ProgramEnd end = run(output, prepare);
    EXPECT_EQ(end.status, 1) << output;
    EXPECT_TRUE(mentions(end.err, "cannot write " + output)) << end.err;
    EXPECT_TRUE(mentions(end.err, reason)) << end.err;
  };
  std::ofstream(file) << "old";
  expect_error(file, "", [] { test::limitFileSize(300); });
  EXPECT_EQ(readText(file), "old");
  EXPECT_EQ(folder.list().size(), 1U) << ending << ": nothing half-written";
  expect_error(folder / ("none/map." + ending), "No such file or directory", {});
  std::filesystem::create_directory(folder / ("folder." + ending));
  expect_error(folder / ("folder." + ending), "Is a directory", {});
}

TEST(MapTools, sayWhyTheyCannotWrite) {
  const TemporaryFolder folder;
  const std::string map = folder / "map.cuboids";
  writeMapFile(map, makeSnapshot());
  for (const std::string ending : {"cuboids", "ot", "bt", "csv", "pcd", "ply"}) {
    expectErrorsOfWriting(ending, [&](const std::string& output, const auto& prepare) {
      return runProgram({MAP_CONVERT_PROGRAM, map, output}, prepare);
    });
  }
  expectErrorsOfWriting("png", [&](const std::string& output, const auto& prepare) {
    return runProgram({MAP_RENDER_PROGRAM, map, output}, prepare);
  });
}

TEST(MapTools, leaveNoNewStoreBehindThatTheyCouldNotFill) {
  const TemporaryFolder folder;
  const std::string store = folder / "map.sqlite";
  ASSERT_EQ(runProgram({SIMULATED_MAP_PROGRAM, store, "--duration", "1"}).status, 0);
  const ProgramEnd end = runProgram({MAP_CONVERT_PROGRAM, store, folder / "copy.sqlite"},
                                    [] { test::limitFileSize(50000); });
  EXPECT_EQ(end.status, 1) << std::filesystem::file_size(store);
  EXPECT_FALSE(std::filesystem::exists(folder / "copy.sqlite")) << end.err;
}

TEST(MapTools, failWhereTheirAnswerCannotBeWritten) {
  const TemporaryFolder folder;
  const std::string map = folder / "map.cuboids";
  writeMapFile(map, makeSnapshot());
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{MAP_INFO_PROGRAM, map},
                                                    {MAP_COMPARE_PROGRAM, map, map},
                                                    {MAP_INFO_PROGRAM, "--help"}}) {
    const ProgramEnd end =
        runProgram(arguments, [] { dup2(open("/dev/full", O_WRONLY), STDOUT_FILENO); });
    EXPECT_EQ(end.status, 1) << arguments[0];
    EXPECT_TRUE(mentions(end.err, "cannot write the output")) << end.err;
  }
}

TEST(MapTools, refuseAResolutionThatWouldDoNothing) {
  const TemporaryFolder folder;
  writeMapFile(folder / "map.cuboids", makeSnapshot());
  const ProgramEnd end = runProgram(
      {MAP_CONVERT_PROGRAM, folder / "map.cuboids", folder / "out.cuboids", "--resolution", "0.2"});
  EXPECT_EQ(end.status, 1);
  EXPECT_TRUE(mentions(end.err, "--resolution is for .pcd")) << end.err;
  EXPECT_EQ(folder.list().size(), 1U);
}

TEST(MapTools, checkTheNameOfTheOutputFirst) {
  const auto start = std::chrono::steady_clock::now();
  const ProgramEnd end = runProgram({SIMULATED_MAP_PROGRAM, "map.txt", "--duration", "3600"});
  EXPECT_EQ(end.status, 1);
  EXPECT_TRUE(mentions(end.err, "map.txt: its name must end in one of .cuboids")) << end.err;
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
}

class BagToMap : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder = new TemporaryFolder();
    ASSERT_EQ(
        runProgram({SIMULATED_LIDAR_PROGRAM, "--bag", *folder / "a.bag", "--duration", "2"}).status,
        0);
  }
  static void TearDownTestSuite() {
    delete folder;
    folder = nullptr;
  }

  static ProgramEnd convert(const std::string& map, const std::vector<std::string>& more = {},
                            const std::function<void()>& prepare = {}) {
    std::vector<std::string> arguments{BAG_TO_MAP_PROGRAM, *folder / "a.bag", "-o", map, "--set",
                                       "resolution=0.2"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return runProgram(arguments, prepare);
  }

  static TemporaryFolder* folder;
};

TemporaryFolder* BagToMap::folder = nullptr;

TEST_F(BagToMap, givesTheSameBytesEveryTime) {
  const std::string first = *folder / "first.cuboids";
  const std::string second = *folder / "second.cuboids";
  const ProgramEnd end = convert(first);
  ASSERT_EQ(end.status, 0) << end.err;
  ASSERT_EQ(convert(second, {"--set", "threads=3"}).status, 0);
  EXPECT_GT(readText(first).size(), 1000U);
  EXPECT_EQ(readText(first), readText(second)) << "whatever threads";
  const MapSnapshot map = readMapFile(first).snapshot;
  EXPECT_TRUE(mentions(end.out, " voxels, ")) << end.out;
  EXPECT_EQ(map.resolution_m, 0.2);
  EXPECT_EQ(map.frame_id, "map");
}

TEST_F(BagToMap, takesTheParametersOfTheNode) {
  const std::string map = *folder / "parameters.cuboids";
  ASSERT_EQ(convert(map, {"--params", CUBOID_MAPPING_SOURCE_DIR "/config/default.yaml", "--set",
                          "sensor_model/hit=0.8"})
                .status,
            0);
  EXPECT_EQ(readMapFile(map).snapshot.sensor_model.hit, 0.8);
  EXPECT_EQ(readMapFile(map).snapshot.resolution_m, 0.2) << "--set wins over the file";
  for (const std::vector<std::string>& wrong :
       std::vector<std::vector<std::string>>{{"--set", "resolutoin=0.1"},
                                             {"--set", "sensor_model/hit=0.2"},
                                             {"--set", "fusion"},
                                             {"--set", "sources=&a [*a]"},
                                             {"--set", "hot_bricks=0"},
                                             {"--params", "/no/file.yaml"},
                                             {"--topic", "/nothing"},
                                             {"--set", "frame_id=mars"}}) {
    const ProgramEnd end = convert(*folder / "none.cuboids", wrong);
    EXPECT_EQ(end.status, 1) << wrong[1];
    EXPECT_FALSE(end.err.empty());
    EXPECT_FALSE(std::filesystem::exists(*folder / "none.cuboids"));
  }
}

TEST_F(BagToMap, readsATopicOnceThatIsGivenTwice) {
  const ProgramEnd end = convert(*folder / "twice.cuboids", {"--topic", "/cloud", "cloud"});
  EXPECT_TRUE(mentions(end.out, "20 of 20 clouds")) << end.out;
}

TEST_F(BagToMap, namesTheFileThatItCannotRead) {
  const std::string none = *folder / "none.bag";
  EXPECT_TRUE(mentions(runProgram({BAG_TO_MAP_PROGRAM, none}).err,
                       none + " as a rosbag: No such file or directory"));
  const std::string folder_error = convert(*folder / "x.bt", {"--params", *folder / "."}).err;
  EXPECT_TRUE(mentions(folder_error, "cannot read " + (*folder / ".") + ": ")) << folder_error;
  const std::string list = *folder / "list.yaml";
  std::ofstream(list) << "- resolution: 0.1\n";
  const std::string list_error = convert(*folder / "x.bt", {"--params", list}).err;
  EXPECT_TRUE(mentions(list_error, "cannot read " + list + ": it must have lines")) << list_error;
}

TEST_F(BagToMap, makesAStoreThatIsTheMapWithoutAWindow) {
  const std::vector<std::string> near{"--set", "resolution=0.02", "--set",
                                      "sensor_model/max_range=1.0"};
  const auto with = [&near](std::vector<std::string> settings) {
    std::vector<std::string> options = near;
    settings.insert(settings.end(), {"window/frame=base_link", "window/size=1.0"});
    for (const std::string& setting : settings) options.insert(options.end(), {"--set", setting});
    return options;
  };
  const auto keep = with({"window/file=is_not_used"});
  const std::string plain = *folder / "plain.cuboids";
  const std::string store = *folder / "window.sqlite";
  ASSERT_EQ(convert(plain, near).status, 0);
  const ProgramEnd end = convert(store, keep);
  ASSERT_EQ(end.status, 0) << end.err;
  EXPECT_TRUE(mentions(end.out, " pages, ")) << end.out;
  EXPECT_FALSE(std::filesystem::exists("is_not_used"));
  EXPECT_FALSE(std::filesystem::exists(store + ".partial"));
  EXPECT_EQ(test::voxelsOf(readMapFile(store).snapshot.bricks),
            test::voxelsOf(readMapFile(plain).snapshot.bricks));
  EXPECT_TRUE(mentions(convert(*folder / "a.cuboids", keep).err, "must end in .sqlite"));
  const std::string forgot = *folder / "forgot.cuboids";
  ASSERT_EQ(convert(forgot, with({"window/outside=forget"})).status, 0);
  EXPECT_LT(readMapFile(forgot).snapshot.bricks.size(), readMapFile(plain).snapshot.bricks.size());
  const auto both = with({"window/file=is_not_used", "forget_after=10.0"});
  EXPECT_TRUE(mentions(convert(store, both).err, "forget_after: does not go with")) << "together";
}

TEST_F(BagToMap, checksWhereItWritesBeforeItWorks) {
  const ProgramEnd end =
      runProgram({BAG_TO_MAP_PROGRAM, *folder / "no.bag", "-o", *folder / "no/folder/map.cuboids"});
  EXPECT_EQ(end.status, 1);
  EXPECT_TRUE(mentions(end.err, "cannot write")) << "before it reads the bag: " << end.err;
  EXPECT_FALSE(mentions(end.err, "no.bag")) << end.err;
}

TEST_F(BagToMap, saysWhichCloudsItLeftOut) {
  const ProgramEnd end = convert(*folder / "none.cuboids", {"--set", "frame_id=mars"});
  EXPECT_EQ(end.status, 1);
  EXPECT_TRUE(mentions(end.err, "clouds dropped, no transform: ")) << end.err;
  EXPECT_TRUE(mentions(end.err, "mars")) << end.err;
  EXPECT_TRUE(mentions(end.err, "could be used: nothing was written")) << end.err;
}

TEST_F(BagToMap, saysWhatWouldKeepUp) {
  const std::string bag = *folder / "fast.bag";
  ASSERT_EQ(runProgram(
                {SIMULATED_LIDAR_PROGRAM, "--bag", bag, "--cloud-rate", "100", "--duration", "0.3"})
                .status,
            0);
  // Ten milliseconds are too few for 14,000 beams through voxels of 2 cm.
  const ProgramEnd end = runProgram({BAG_TO_MAP_PROGRAM, bag, "-o", *folder / "fast.cuboids",
                                     "--set", "resolution=0.02", "--set", "threads=1"});
  ASSERT_EQ(end.status, 0) << end.err;
  EXPECT_TRUE(mentions(end.err, "per cloud at 100 Hz: try resolution 0.")) << end.err;
  EXPECT_TRUE(mentions(end.err, "(here: --set NAME=VALUE)")) << end.err;
}

TEST_F(BagToMap, saysWhyItCannotWrite) {
  expectErrorsOfWriting("cuboids", [](const std::string& output, const auto& prepare) {
    return convert(output, {}, prepare);
  });
}

}  // namespace
}  // namespace cuboid_mapping
