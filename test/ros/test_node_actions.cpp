// SPDX-License-Identifier: BSD-3-Clause
// Long calls of a running node as actions: the same as services, with progress and cancel. For node and nodelet.
#include "cuboid_mapping/LoadMap.h"
#include "cuboid_mapping/LoadMapAction.h"
#include "cuboid_mapping/MoveMap.h"
#include "cuboid_mapping/MoveMapAction.h"
#include "cuboid_mapping/SaveMap.h"
#include "cuboid_mapping/SaveMapAction.h"
#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/map_files.h"
#include "ros/node_command.h"
#include "ros/node_probe.h"
#include "support/random.h"
#include "tools/run_program.h"

#include <actionlib/client/simple_action_client.h>

#include <atomic>
#include <csignal>
#include <filesystem>
#include <memory>
#include <mutex>
#include <set>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::LoadMap;
using cuboid_mapping::LoadMapAction;
using cuboid_mapping::LoadMapGoal;
using cuboid_mapping::MoveMap;
using cuboid_mapping::MoveMapAction;
using cuboid_mapping::MoveMapGoal;
using cuboid_mapping::readFile;
using cuboid_mapping::SaveMap;
using cuboid_mapping::SaveMapAction;
using cuboid_mapping::SaveMapGoal;
using cuboid_mapping::test::Random;

/// A map that takes some tenths of a second to save, load or move: random voxels of a full cube.
cuboid_mapping::MapSnapshot makeBigMap(unsigned seed, int edge = 24) {
  Random random(seed);
  cuboid_mapping::MapSnapshot map;
  map.resolution_m = kResolution_m;
  map.frame_id = "map";
  for (int i = 0; i < edge * edge * edge; ++i) {
    cuboid_mapping::BrickMask known;
    cuboid_mapping::VoxelValues values{};
    for (int voxel = 0; voxel < cuboid_mapping::kBrickVoxels; ++voxel) {
      if (random.chance(0.5)) known.set(voxel);
      values[static_cast<std::size_t>(voxel)] = static_cast<float>(random.integer(-20, 30)) / 16.0F;
    }
    const cuboid_mapping::Cell place{i % edge, i / edge % edge, i / edge / edge};
    map.bricks.push_back({{8 * place.x, 8 * place.y, 8 * place.z}, {known, values}});
  }
  sortBricks(map.bricks);
  return map;
}

/// Result and feedback at a client of an action.
template <typename ActionT>
struct Outcome {
  ACTION_DEFINITION(ActionT)
  std::string state;
  ResultConstPtr result;
  std::set<std::string> stages;  ///< Stages in its feedback.
};

enum class Patience { kEndless, kCancels };

class NodeActions : public ::testing::TestWithParam<bool> {
 protected:
  static constexpr char kName[] = "/long_caller";

  static void SetUpTestSuite() {
    big_folder = std::make_unique<cuboid_mapping::test::TemporaryFolder>();
    writeMapFile(bigFile(1), makeBigMap(1));
    writeMapFile(bigFile(2), makeBigMap(2));
  }
  static void TearDownTestSuite() { big_folder.reset(); }
  static std::string bigFile(int number) {
    return *big_folder / ("big" + std::to_string(number) + ".cuboids");
  }

  void SetUp() override {
    std::vector<std::string> command = commandOf(GetParam());
    command.insert(command.end(), {std::string("__name:=") + (kName + 1), "__log:=/dev/null",
                                   "_resolution:=0.1", "_map_file:=" + bigFile(1)});
    node_ = std::make_unique<cuboid_mapping::test::Program>(command);
    ASSERT_TRUE(
        ros::service::waitForService(std::string(kName) + "/load_map", ros::Duration(kDeadline_s)));
  }
  void TearDown() override {
    if (node_) stop();
  }
  void stop() {
    node_->send(SIGINT);
    const auto end = node_->finish();
    node_.reset();
    EXPECT_EQ(end.status, 0) << end.out << end.err;
  }

  template <typename ActionT, typename GoalT>
  static Outcome<ActionT> act(const std::string& name, const GoalT& goal,
                              Patience patience = Patience::kEndless) {
    actionlib::SimpleActionClient<ActionT> client(std::string(kName) + name, true);
    EXPECT_TRUE(client.waitForServer(ros::Duration(kDeadline_s)));
    Outcome<ActionT> outcome;
    std::mutex mutex;
    client.sendGoal(goal, {}, {}, [&](const typename Outcome<ActionT>::FeedbackConstPtr& feedback) {
      const std::lock_guard<std::mutex> lock(mutex);
      outcome.stages.insert(feedback->stage);
      EXPECT_GE(feedback->share, 0.0F);
      EXPECT_LE(feedback->share, 1.0F);
      if (patience == Patience::kCancels) client.cancelGoal();
    });
    EXPECT_TRUE(client.waitForResult(ros::Duration(kDeadline_s)));
    outcome.state = client.getState().toString();
    outcome.result = client.getResult();
    client.stopTrackingGoal();
    const std::lock_guard<std::mutex> lock(mutex);
    return outcome;
  }

  /// The map as the bytes of a file: equal maps have equal bytes.
  [[nodiscard]] std::string saveMap() const {
    SaveMap save;
    save.request.filename = folder_ / "now.cuboids";
    EXPECT_TRUE(callService(std::string(kName) + "/save_map", save));
    EXPECT_TRUE(save.response.info.success) << save.response.info.message;
    return readFile(save.request.filename);
  }

  [[nodiscard]] static MoveMapGoal shiftOf(double x_m) {
    MoveMapGoal goal;
    goal.transform.translation.x = x_m;
    goal.transform.rotation.w = 1.0;
    return goal;
  }

  static inline std::unique_ptr<cuboid_mapping::test::TemporaryFolder> big_folder;
  std::unique_ptr<cuboid_mapping::test::Program> node_;
  cuboid_mapping::test::TemporaryFolder folder_;
};

TEST_P(NodeActions, AnswerAsTheServices) {
  const std::string before = saveMap();
  SaveMapGoal save;
  save.filename = folder_ / "saved.cuboids";
  const auto saved = act<SaveMapAction>("/save_map", save);
  EXPECT_EQ(saved.state, "SUCCEEDED");
  EXPECT_TRUE(readFile(save.filename) == before);
  EXPECT_EQ(saved.result->bytes, before.size());
  EXPECT_GT(saved.result->cuboids, 1000U);
  EXPECT_EQ(saved.stages.count("writing"), 1U);

  LoadMapGoal load;
  load.filename = bigFile(2);
  const auto loaded = act<LoadMapAction>("/load_map", load);
  EXPECT_EQ(loaded.state, "SUCCEEDED");
  EXPECT_EQ(loaded.stages.count("building"), 1U);
  const std::string other = saveMap();
  EXPECT_FALSE(other == before);
  LoadMap load_again;
  load_again.request.filename = bigFile(2);
  ASSERT_TRUE(callService(std::string(kName) + "/load_map", load_again));
  EXPECT_EQ(loaded.result->cuboids, load_again.response.cuboids);
  EXPECT_TRUE(saveMap() == other);

  const auto moved = act<MoveMapAction>("/move_map", shiftOf(0.3));
  EXPECT_EQ(moved.state, "SUCCEEDED");
  EXPECT_EQ(moved.stages.count("moving"), 1U);
  EXPECT_FALSE(saveMap() == other);
  MoveMap back;
  back.request.transform = shiftOf(-0.3).transform;
  ASSERT_TRUE(callService(std::string(kName) + "/move_map", back));
  EXPECT_TRUE(saveMap() == other);
}

TEST_P(NodeActions, LeaveEverythingAsItWasWhenTheyAreCancelled) {
  const std::string before = saveMap();
  for (const std::string ending : {"cuboids", "sqlite", "pcd"}) {
    SaveMapGoal save;
    save.filename = folder_ / ("saved." + ending);
    cuboid_mapping::writeMapFile(save.filename, makeBigMap(3, 2));
    const std::string old = readFile(save.filename);
    const auto saved = act<SaveMapAction>("/save_map", save, Patience::kCancels);
    EXPECT_EQ(saved.state, "PREEMPTED") << ending;
    EXPECT_EQ(saved.result->info.success, 0);
    EXPECT_NE(saved.result->info.message.find("cancelled"), std::string::npos);
    EXPECT_TRUE(readFile(save.filename) == old) << ending;
    EXPECT_FALSE(std::filesystem::exists(save.filename + ".partial"));
  }
  LoadMapGoal load;
  load.filename = bigFile(2);
  for (const std::uint8_t rule : {LoadMapGoal::REPLACE, LoadMapGoal::SUM}) {
    load.rule = rule;
    EXPECT_EQ(act<LoadMapAction>("/load_map", load, Patience::kCancels).state, "PREEMPTED");
    EXPECT_TRUE(saveMap() == before);
  }
  EXPECT_EQ(act<MoveMapAction>("/move_map", shiftOf(0.3), Patience::kCancels).state, "PREEMPTED");
  EXPECT_TRUE(saveMap() == before);
  EXPECT_EQ(act<MoveMapAction>("/move_map", shiftOf(0.3)).state, "SUCCEEDED") << "the next one";
}

TEST_P(NodeActions, AreAbortedWhereTheServiceRefuses) {
  const auto moved = act<MoveMapAction>("/move_map", shiftOf(0.32));
  EXPECT_EQ(moved.state, "ABORTED");
  EXPECT_NE(moved.result->info.message.find("(0.3, 0, 0)"), std::string::npos);
  LoadMapGoal load;
  load.filename = folder_ / "nothing.cuboids";
  EXPECT_EQ(act<LoadMapAction>("/load_map", load).state, "ABORTED");
}

TEST_P(NodeActions, AnswerManyGoalsAtOnce) {
  ros::NodeHandle nh;
  const auto goals =
      nh.advertise<cuboid_mapping::MoveMapActionGoal>(std::string(kName) + "/move_map/goal", 10000);
  ASSERT_TRUE(waitFor([&] { return goals.getNumSubscribers() > 0; }));
  cuboid_mapping::MoveMapActionGoal goal;
  goal.goal = shiftOf(0.32);
  for (int i = 0; i < 5000; ++i) {
    goal.goal_id.id = std::to_string(i);
    goals.publish(goal);
  }
  EXPECT_EQ(act<MoveMapAction>("/move_map", shiftOf(0.3)).state, "SUCCEEDED");
}

TEST_P(NodeActions, EndWithTheNode) {
  SaveMapGoal save;
  save.filename = folder_ / "saved.csv";  // The slowest format.
  actionlib::SimpleActionClient<SaveMapAction> client(std::string(kName) + "/save_map", true);
  ASSERT_TRUE(client.waitForServer(ros::Duration(kDeadline_s)));
  std::atomic<bool> has_begun{false};
  client.sendGoal(save, {}, {}, [&](const cuboid_mapping::SaveMapFeedbackConstPtr& feedback) {
    if (feedback->stage == "writing") has_begun = true;
  });
  EXPECT_TRUE(waitFor([&] { return has_begun.load(); }));
  stop();
  EXPECT_FALSE(std::filesystem::exists(save.filename));
  EXPECT_FALSE(std::filesystem::exists(save.filename + ".partial"));
}

INSTANTIATE_TEST_SUITE_P(AsNodeAndNodelet, NodeActions, ::testing::Bool());

}  // namespace
}  // namespace cuboid_mapping_ros::test
