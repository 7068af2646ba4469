// SPDX-License-Identifier: BSD-3-Clause
// Files that a running node writes by itself, and errors of writing. For node and nodelet.
#include "cuboid_mapping/LoadMap.h"
#include "cuboid_mapping/SaveMap.h"
#include "cuboid_mapping/SetBox.h"
#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/map_files.h"
#include "ros/node_command.h"
#include "ros/node_probe.h"
#include "support/random.h"
#include "tools/run_program.h"

#include <filesystem>
#include <future>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::LoadMap;

using cuboid_mapping::test::limitFileSize;
using cuboid_mapping::test::Program;
using cuboid_mapping::test::TemporaryFolder;

constexpr double kVoxelsOfBox = 8.0;

class NodeFiles : public ::testing::TestWithParam<bool> {
 protected:
  static constexpr char kName[] = "/file_writer";

  /// Starts it, with parameters as "_key:=value".
  void start(const std::vector<std::string>& parameters,
             const std::function<void()>& prepare = {}) {
    std::vector<std::string> command = commandOf(GetParam());
    command.insert(command.end(),
                   {std::string("__name:=") + (kName + 1), "__log:=/dev/null", "_resolution:=0.1"});
    command.insert(command.end(), parameters.begin(), parameters.end());
    node_ = std::make_unique<Program>(command, prepare);
    ASSERT_TRUE(
        ros::service::waitForService(std::string(kName) + "/set_box", ros::Duration(kDeadline_s)));
  }

  void stop(int signal = SIGINT) {
    node_->send(signal);
    const auto end = node_->finish();
    node_.reset();
    EXPECT_EQ(end.status, 0) << end.out << end.err;
  }

  void TearDown() override {
    if (node_) stop();
  }

  /// Makes a box occupied; each number has its own place.
  static void setBox(int number, bool is_locked = false) {
    cuboid_mapping::SetBox set;
    set.request.lock = static_cast<std::uint8_t>(is_locked);
    set.request.occupancy = cuboid_mapping::SetBox::Request::OCCUPIED;
    set.request.boxes.emplace_back();
    set.request.boxes.back().min = tf2::toMsg(Eigen::Vector3d(number, 0.0, 0.0));
    set.request.boxes.back().max = tf2::toMsg(Eigen::Vector3d(number + 0.2, 0.2, 0.2));
    ASSERT_TRUE(callService(std::string(kName) + "/set_box", set));
    ASSERT_TRUE(set.response.info.success) << set.response.info.message;
  }

  std::unique_ptr<Program> node_;
  TemporaryFolder folder_;
};

/// A map that takes some tenths of a second to save: random voxels of a full cube.
cuboid_mapping::MapSnapshot makeBigMap(unsigned seed, int edge) {
  cuboid_mapping::test::Random random(seed);
  cuboid_mapping::MapSnapshot map;
  map.resolution_m = kResolution_m;
  for (int i = 0; i < edge * edge * edge; ++i) {
    cuboid_mapping::BrickMask known;
    cuboid_mapping::VoxelValues values{};
    for (int voxel = 0; voxel < cuboid_mapping::kBrickVoxels; ++voxel) {
      if (random.chance(0.5)) known.set(voxel);
      values[static_cast<std::size_t>(voxel)] = static_cast<float>(random.integer(-20, 30)) / 16.0F;
    }
    map.bricks.push_back(
        {{8 * (i % edge), 8 * (i / edge % edge), 8 * (i / edge / edge)}, {known, values}});
  }
  sortBricks(map.bricks);
  return map;
}

/// Number of voxels in a file of a map; 0 if there is no file.
double numVoxelsIn(const std::string& file) {
  try {
    double num_voxels = 0.0;
    for (const auto& brick : cuboid_mapping::readMapFile(file).snapshot.bricks) {
      num_voxels += brick.voxels.known().count();
    }
    return num_voxels;
  } catch (const cuboid_mapping::MapFileError&) {
    return 0.0;
  }
}

TEST_P(NodeFiles, AreSavedByThemselvesAfterChanges) {
  const std::string file = folder_ / "map.cuboids";
  start({"_autosave_file:=" + file, "_autosave_period:=1.0"});
  for (int i = 1; i <= 2; ++i) {
    setBox(i);
    EXPECT_TRUE(waitFor([&] { return numVoxelsIn(file) == i * kVoxelsOfBox; })) << i;
  }
}

TEST_P(NodeFiles, AreSavedAtTheEnd) {
  const std::string file = folder_ / "map.ot";
  start({"_autosave_file:=" + file, "_autosave_period:=86400"});
  setBox(1);
  stop();
  EXPECT_EQ(numVoxelsIn(file), kVoxelsOfBox);
}

TEST_P(NodeFiles, AreSavedAgainIfTheyWereRemoved) {
  const std::string file = folder_ / "map.cuboids";
  start({"_autosave_file:=" + file, "_autosave_period:=1.0"});
  setBox(1);
  EXPECT_TRUE(waitFor([&] { return numVoxelsIn(file) == kVoxelsOfBox; }));
  std::filesystem::remove(file);
  stop();
  EXPECT_EQ(numVoxelsIn(file), kVoxelsOfBox) << "though nothing has changed";
}

TEST_P(NodeFiles, AreSavedAgainIfAnotherMapIsThere) {
  const std::string file = folder_ / "map.cuboids";
  writeMapFile(file, makeBigMap(1, 4));
  const double num_read = numVoxelsIn(file);
  start({"_autosave_file:=" + file, "_autosave_period:=1.0"});
  writeMapFile(file, makeBigMap(2, 4));
  EXPECT_TRUE(waitFor([&] { return numVoxelsIn(folder_ / "map-2.cuboids") == num_read; }))
      << "though nothing has changed";
}

TEST_P(NodeFiles, AreSavedAtTheEndWhateverSignalAsksForIt) {
  for (const int signal : {SIGTERM, SIGHUP}) {
    const std::string file = folder_ / ("map" + std::to_string(signal) + ".cuboids");
    start({"_autosave_file:=" + file, "_autosave_period:=86400"});
    setBox(1);
    if (GetParam()) {  // The signals belong to the manager, which roscpp ends at SIGINT only.
      node_->send(signal);
      EXPECT_EQ(node_->finish().status, -1) << "killed by signal " << signal;
      node_.reset();
    } else {
      stop(signal);
      EXPECT_EQ(numVoxelsIn(file), kVoxelsOfBox) << signal;
    }
  }
}

TEST_P(NodeFiles, GoOnWithTheMapOfTheRunBefore) {
  const std::string file = folder_ / "map.cuboids";
  for (int run = 1; run <= 3; ++run) {
    start({"_autosave_file:=" + file, "_autosave_period:=86400"});
    setBox(run, run == 1);
    stop();
    EXPECT_EQ(numVoxelsIn(file), run * kVoxelsOfBox);
    const auto locked = cuboid_mapping::readMapFile(file).snapshot.locked;
    ASSERT_EQ(locked.size(), 1U) << "still locked";
    EXPECT_EQ(locked.front().min, (cuboid_mapping::Cell{10, 0, 0}));
  }
  start({"_autosave_file:=" + file, "_autosave_period:=86400"});
  setBox(2, true);  // No voxel changes, but there is another locked box.
  stop();
  EXPECT_EQ(cuboid_mapping::readMapFile(file).snapshot.locked.size(), 2U);
  EXPECT_EQ(folder_.list().size(), 1U);
}

TEST_P(NodeFiles, LeaveTheMapThatAnotherNodeSavedThere) {
  for (const std::string ending : {".cuboids", ".sqlite"}) {
    const std::string file = folder_ / ("map" + ending);
    const std::string beside = folder_ / ("map-2" + ending);
    for (const bool is_there : {false, true}) {  // When the node starts.
      start({"_autosave_file:=" + file, "_autosave_period:=86400"});
      setBox(-1);
      writeMapFile(file, makeBigMap(1, 4));
      const double num_of_other = numVoxelsIn(file);
      stop();
      EXPECT_EQ(numVoxelsIn(file), num_of_other) << ending << is_there;
      EXPECT_EQ(numVoxelsIn(beside), kVoxelsOfBox + (is_there ? num_of_other : 0.0)) << ending;
      std::filesystem::remove(beside);
    }
  }
}

TEST_P(NodeFiles, AreSavedToAFileThatTheUserSavesOrLoads) {
  const std::string file = folder_ / "map.sqlite";
  start({"_autosave_file:=" + file, "_autosave_period:=86400"});
  setBox(1);
  cuboid_mapping::SaveMap save;
  save.request.filename = file;
  ASSERT_TRUE(callService(std::string(kName) + "/save_map", save));
  setBox(2);
  stop();
  EXPECT_EQ(numVoxelsIn(file), 2.0 * kVoxelsOfBox);
  start({"_autosave_file:=" + file, "_autosave_period:=86400"});
  writeMapFile(file, makeBigMap(1, 4));
  const double num_of_other = numVoxelsIn(file);
  LoadMap load;
  load.request.filename = file;
  ASSERT_TRUE(callService(std::string(kName) + "/load_map", load));
  ASSERT_TRUE(load.response.info.success) << load.response.info.message;
  setBox(-2);
  stop();
  EXPECT_EQ(numVoxelsIn(file), num_of_other + kVoxelsOfBox);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "map-2.sqlite"));
}

TEST_P(NodeFiles, AreSavedAtTheEndAlthoughALongCallRuns) {
  const std::string file = folder_ / "map.cuboids";
  writeMapFile(file, makeBigMap(1, 44));
  const double num_before = numVoxelsIn(file);
  start({"_autosave_file:=" + file, "_autosave_period:=86400"});
  setBox(-1);
  cuboid_mapping::SaveMap save;
  save.request.filename = folder_ / "saved.ply";  // Written while it is made.
  auto call = std::async(std::launch::async,
                         [&] { return callService(std::string(kName) + "/save_map", save); });
  EXPECT_TRUE(waitFor([&] { return std::filesystem::exists(save.request.filename + ".partial"); }));
  stop();
  call.get();
  EXPECT_FALSE(std::filesystem::exists(save.request.filename)) << "the call ends with the node";
  EXPECT_FALSE(std::filesystem::exists(save.request.filename + ".partial"));
  EXPECT_EQ(numVoxelsIn(file), num_before + kVoxelsOfBox);
}

TEST_P(NodeFiles, DoNotStartWithAMapOfAnotherResolution) {
  const std::string file = folder_ / "map.cuboids";
  cuboid_mapping::MapSnapshot map;
  map.resolution_m = 0.2;
  writeMapFile(file, map);
  cuboid_mapping::test::Program node({CUBOID_MAPPING_NODE, "__name:=coarse", "__log:=/dev/null",
                                      "_resolution:=0.1", "_autosave_file:=" + file});
  const auto end = node.finish();
  EXPECT_NE(end.status, 0);
  EXPECT_NE((end.out + end.err).find("name another autosave_file"), std::string::npos) << end.err;
}

TEST_P(NodeFiles, SymbolicLinksStayAndTheirTargetsAreWritten) {
  const std::string target = folder_ / "map7.cuboids";
  const std::string link = folder_ / "map.cuboids";
  std::filesystem::create_symlink("map7.cuboids", link);
  start({"_autosave_file:=" + link, "_autosave_period:=86400"});
  setBox(1);
  stop();
  EXPECT_TRUE(std::filesystem::is_symlink(link));
  EXPECT_EQ(numVoxelsIn(target), kVoxelsOfBox);
}

TEST_P(NodeFiles, APathThatCannotBeWrittenIsSaidAtTheStart) {
  DiagnosticsProbe diagnostics(kName);
  start({"_autosave_file:=" + (folder_ / "none/map.ot"), "_autosave_period:=86400"});
  EXPECT_TRUE(waitFor([&] {
    return diagnostics.status().message.find("the map could not be saved: ") == 0;
  })) << diagnostics.status().message;
}

TEST_P(NodeFiles, AnAutosaveThatFailsIsAnErrorOfTheDiagnostics) {
  DiagnosticsProbe diagnostics(kName);
  const std::string folder = folder_ / "none";
  start({"_autosave_file:=" + folder + "/map.ot", "_autosave_period:=1.0"});
  setBox(1);
  EXPECT_TRUE(waitFor([&] {
    return diagnostics.status().level == diagnostic_msgs::DiagnosticStatus::ERROR;
  })) << diagnostics.status().message;
  EXPECT_EQ(diagnostics.status().message.find("the map could not be saved: "), 0U)
      << diagnostics.status().message;
  std::filesystem::create_directory(folder);
  EXPECT_TRUE(waitFor([&] {
    return diagnostics.status().level == diagnostic_msgs::DiagnosticStatus::WARN;
  })) << diagnostics.status().message;
}

TEST_P(NodeFiles, ArePutIntoTheMapByRuleAndTransform) {
  start({});
  const std::string file = folder_ / "box.cuboids";
  setBox(1);
  cuboid_mapping::SaveMap save;
  save.request.filename = std::filesystem::relative(file);
  ASSERT_TRUE(callService(std::string(kName) + "/save_map", save));
  EXPECT_EQ(save.response.info.message,
            "saved to " + std::filesystem::absolute(save.request.filename).string());
  const auto load = [&](std::uint8_t rule, double x, double quaternion_z) {
    LoadMap service;
    service.request.filename = file;
    service.request.rule = rule;
    service.request.transform.translation.x = x;
    service.request.transform.rotation.z = quaternion_z;
    service.request.transform.rotation.w = quaternion_z;  // A quarter turn, or none.
    EXPECT_TRUE(ros::service::call(std::string(kName) + "/load_map", service));
    return service.response.info;
  };
  // The box is at x = 1 to 1.2 m; a quarter turn moves it to y = 1 to 1.2 m, x = -0.2 to 0 m.
  const auto both = load(LoadMap::Request::SUM, 0.0, 0.7071);
  EXPECT_TRUE(both.success) << both.message;
  EXPECT_NE(both.message.find("exact"), std::string::npos) << both.message;
  EXPECT_NE(both.message.find("0 voxels known to both"), std::string::npos) << both.message;
  EXPECT_NE(both.message.find("not the map"), std::string::npos) << both.message;
  const auto shifted = load(LoadMap::Request::LATER, 0.13, 0.0);
  EXPECT_NE(shifted.message.find("resampled"), std::string::npos) << shifted.message;
  save.request.filename = folder_ / "both.cuboids";
  ASSERT_TRUE(callService(std::string(kName) + "/save_map", save));
  EXPECT_EQ(numVoxelsIn(save.request.filename), 2.5 * kVoxelsOfBox) << "shifted by one voxel";
  const auto unknown = load(4, 0.0, 0.0);
  EXPECT_FALSE(unknown.success);
  EXPECT_NE(unknown.message.find("REPLACE (0)"), std::string::npos) << unknown.message;
  const auto stretched = load(LoadMap::Request::SUM, 0.0, 5.0);
  EXPECT_FALSE(stretched.success);
  EXPECT_FALSE(stretched.message.empty());
  const auto alone = load(LoadMap::Request::REPLACE, 0.0, 0.0);
  EXPECT_TRUE(alone.success) << alone.message;
  EXPECT_EQ(alone.message, "loaded from " + file);
}

TEST_P(NodeFiles, SayWhyTheyCannotBeWritten) {
  start({}, [] { std::signal(SIGXFSZ, SIG_IGN); });
  limitFileSize(50, node_->pid());  // Not before: ThreadSanitizer writes a file at the start.
  setBox(1);
  const std::pair<std::string, std::string> cases[] = {
      {folder_ / "map.cuboids", "File too large"},  // as a full disk, in the middle of a file
      {folder_ / "map.pcd", "cannot write"},
      {folder_ / ".", "must end in"},
      {folder_ / "folder.ot", "Is a directory"},
      {folder_ / "none/map.ot", "No such file or directory"}};
  std::filesystem::create_directory(folder_ / "folder.ot");
  for (const auto& [file, reason] : cases) {
    cuboid_mapping::SaveMap save;
    save.request.filename = file;
    ASSERT_TRUE(callService(std::string(kName) + "/save_map", save));
    EXPECT_FALSE(save.response.info.success) << file;
    EXPECT_NE(save.response.info.message.find(reason), std::string::npos)
        << save.response.info.message;
    EXPECT_NE(save.response.info.message.find(file), std::string::npos)
        << save.response.info.message;
  }
  EXPECT_EQ(folder_.list(), std::vector<std::string>{"folder.ot"}) << "nothing half-written";
  setBox(2);  // the node goes on
}

INSTANTIATE_TEST_SUITE_P(NodeAndNodelet, NodeFiles, ::testing::Bool(),
                         [](const auto& instance) { return instance.param ? "nodelet" : "node"; });

}  // namespace
}  // namespace cuboid_mapping_ros::test
