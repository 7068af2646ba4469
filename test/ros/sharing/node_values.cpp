// SPDX-License-Identifier: BSD-3-Clause
// Copies of a map, voxel by voxel and bit by bit: of a running node, and of a server that loses updates.
#include "cuboid_mapping/SaveMap.h"
#include "cuboid_mapping/SetBox.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/ros/conversions/map_messages.h"
#include "cuboid_mapping/ros/cuboid_map_client.h"
#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/sharing/map_publisher.h"
#include "cuboid_mapping/sharing/map_follower.h"
#include "ros/node_probe.h"
#include "support/snapshots.h"
#include "tools/run_program.h"

#include <ros/callback_queue.h>

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::Cell;
using cuboid_mapping::CellBox;
using cuboid_mapping::ChangeSet;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::GetMap;
using cuboid_mapping::MapDetail;
using cuboid_mapping::SetBox;
using cuboid_mapping::test::Program;
using cuboid_mapping::test::Random;
using cuboid_mapping::test::TemporaryFolder;
using cuboid_mapping::test::voxelsOf;
using Voxels = std::map<Cell, float>;

Voxels voxelsOf(const CuboidMapClient& client) {
  return client.read([](const CuboidMap& map) { return voxelsOf(map); });
}
Voxels classesOf(Voxels voxels) {
  for (auto& [cell, log_odds] : voxels) log_odds = log_odds >= 0.0F ? 1.0F : -1.0F;
  return voxels;
}

/// A server that loses chosen updates.
class LossyServer {
 public:
  static constexpr char kServer[] = "/lossy/lossy";

  LossyServer(std::uint64_t instance, const MapImageServer::Options& options)
      : instance_(instance),
        detail_(options.topic_detail),
        images_(
            withQueue(nh_, images_thread_.queue()),
            withQueue(ros::NodeHandle(nh_, "lossy"), images_thread_.queue()), options,
            [this](MapDetail wanted) { return image(wanted); }, [] { return std::string(); }) {
    delta_publisher_ = nh_.advertise<CuboidMapUpdate>("cuboid_map_updates", 20);
    images_thread_.start();
  }
  ~LossyServer() { images_thread_.stop(); }
  LossyServer(const LossyServer&) = delete;
  LossyServer& operator=(const LossyServer&) = delete;

  /// Changes the map. @param is_lost  The update is not sent.
  void change(const std::function<ChangeSet(CuboidMap&)>& work, bool is_lost) {
    DeltaMessage message;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      const std::uint64_t base = map_.revision();
      const ChangeSet changes = work(map_);
      message.delta = makeDelta(map_, changes, instance_, base, detail_);
      message.delta.label.frame_id = "map";
      message.server = kServer;
    }
    images_.noteUpdate(map_.revision());
    if (message.delta.is_everything) images_.publishSoon();
    if (!is_lost) delta_publisher_.publish(toMessage(message));
  }

  [[nodiscard]] bool hasListener() const {
    return delta_publisher_.getNumSubscribers() > 0 && num_asked_ > 0;
  }
  [[nodiscard]] const CuboidMap& map() const { return map_; }
  [[nodiscard]] int numAsked() const { return num_asked_; }

 private:
  [[nodiscard]] ImageMessage image(MapDetail detail) {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++num_asked_;
    ImageMessage message;
    message.image = makeImage(map_, instance_, detail);
    message.image.label.frame_id = "map";
    message.server = kServer;
    return message;
  }

  CallbackGuard guard_;
  GuardedQueue queue_{*ros::getGlobalCallbackQueue(), guard_, "lossy"};
  ros::NodeHandle nh_ = withQueue(ros::NodeHandle("lossy"), queue_);
  std::uint64_t instance_;
  MapDetail detail_;
  std::mutex mutex_;  ///< Guards the map: images are made in their own thread.
  CuboidMap map_;
  std::atomic<int> num_asked_{0};
  GuardedThread images_thread_{guard_, "images"};
  MapImageServer images_;
  ros::Publisher delta_publisher_;
};

class LossyServerTest : public ::testing::TestWithParam<MapImageServer::Options> {
 protected:
  [[nodiscard]] static bool hasValues() { return GetParam().topic_detail == MapDetail::kValues; }
  [[nodiscard]] static bool isInParts() { return GetParam().max_part_bytes < 1000; }
  /// Expected content of a copy.
  [[nodiscard]] Voxels expected() const {
    return hasValues() ? voxelsOf(server_->map()) : classesOf(voxelsOf(server_->map()));
  }
  [[nodiscard]] static Voxels shownBy(const CuboidMapClient& client) {
    return hasValues() ? voxelsOf(client) : classesOf(voxelsOf(client));
  }
  void start(std::uint64_t instance) {
    server_.reset();
    server_ = std::make_unique<LossyServer>(instance, GetParam());
  }
  std::unique_ptr<CuboidMapClient> connect() {
    auto client = std::make_unique<CuboidMapClient>(ros::NodeHandle("lossy"), LossyServer::kServer);
    EXPECT_TRUE(waitFor([&] { return server_->hasListener(); }));
    return client;
  }
  /// The first client of this process: the others share its connection, so they get no image when
  /// they connect, but request one with the next update.
  std::unique_ptr<CuboidMapClient> connectFirst() {
    auto client = connect();
    EXPECT_TRUE(waitFor([&] { return client->instance() != 0; }));
    return client;
  }
  void observe(bool is_lost) {
    const auto update = cuboid_mapping::test::randomUpdate(random_, {{-2, -2, -2}, {2, 2, 2}}, 9);
    server_->change([&](CuboidMap& map) { return map.apply(update); }, is_lost);
  }
  void expectSame(const CuboidMapClient& client) {
    EXPECT_TRUE(waitFor([&] { return client.revision() == server_->map().revision(); }));
    EXPECT_EQ(shownBy(client), expected());
  }

  Random random_{161};
  std::unique_ptr<LossyServer> server_;
};

TEST_P(LossyServerTest, IsFollowedWhileThreadsReadWithoutAPause) {
  start(1);
  const auto client = connectFirst();
  std::atomic<bool> is_over{false};
  std::vector<std::thread> readers;
  for (int i = 0; i < 4; ++i) {
    readers.emplace_back([&] {
      while (!is_over) {
        client->read([](const CuboidMap& /*map*/) {
          std::this_thread::sleep_for(std::chrono::milliseconds(1));
          return true;
        });
      }
    });
  }
  for (int i = 0; i < 10; ++i) {
    observe(false);
    EXPECT_TRUE(waitFor([&] { return client->revision() == server_->map().revision(); }));
  }
  is_over = true;
  for (std::thread& reader : readers) reader.join();
  expectSame(*client);
}

/// A server that takes the request for its map and does not answer.
TEST(CuboidMapClientTest, GoesWhileItsServerHangs) {
  CallbackGuard guard;
  GuardedThread thread(guard, "hung");
  ros::NodeHandle nh = withQueue(ros::NodeHandle("hung"), thread.queue());
  std::atomic<int> num_asked{0};
  std::promise<void> speak;
  const ros::ServiceServer server = nh.advertiseService<GetMap::Request, GetMap::Response>(
      "server/get_map",
      [&num_asked, speaks = speak.get_future().share()](GetMap::Request&, GetMap::Response&) {
        ++num_asked;
        speaks.wait();
        return true;
      });
  const ros::Publisher deltas = nh.advertise<CuboidMapUpdate>("cuboid_map_updates", 20);
  thread.start();
  auto client = std::make_unique<CuboidMapClient>(ros::NodeHandle("hung"), "/hung/server");
  DeltaMessage message;
  message.server = "/hung/server";
  message.delta.instance = 1;
  message.delta.label.frame_id = "map";
  message.delta.resolution_m = 0.1;
  EXPECT_TRUE(waitFor([&] {
    message.delta.base = message.delta.revision++;
    deltas.publish(toMessage(message));
    return num_asked > 0;
  }));
  client.reset();  // Returns while the server hangs.
  speak.set_value();
}

TEST_P(LossyServerTest, IsFollowedWhateverIsLost) {
  start(1);
  const auto client = connectFirst();
  for (int i = 0; i < 30; ++i) {
    if (random_.chance(0.5)) observe(true);
    observe(false);
    expectSame(*client);
  }
  EXPECT_GT(server_->numAsked(), 5);
  EXPECT_LT(server_->numAsked(), 30) << "only when something was lost";
  server_->change([](CuboidMap& map) { return map.clear(); }, false);
  expectSame(*client);
  EXPECT_TRUE(voxelsOf(*client).empty());
}

TEST_P(LossyServerTest, IsFollowedAfterEverythingWasReplaced) {
  start(1);
  const auto client = connectFirst();
  observe(false);
  expectSame(*client);
  for (int i = 0; i < 3; ++i) {
    const auto snapshot = cuboid_mapping::test::randomSnapshot(random_);
    server_->change(
        [&](CuboidMap& map) {
          ChangeSet changes = map.replace(cuboid_mapping::kAllCells, snapshot.bricks);
          changes.is_everything = true;
          changes.bricks.clear();
          return changes;
        },
        false);
    expectSame(*client);
    observe(false);
    expectSame(*client);
  }
}

TEST_P(LossyServerTest, IsFollowedByOneThatComesLate) {
  start(1);
  for (int i = 0; i < 5; ++i) observe(false);
  const auto first = connectFirst();
  expectSame(*first);
  observe(false);
  const auto late = connect();
  observe(false);
  for (const auto* client : {first.get(), late.get()}) expectSame(*client);
}

TEST_P(LossyServerTest, IsFollowedWhenItIsStartedAnew) {
  start(1);
  const auto client = connectFirst();
  for (int i = 0; i < 9; ++i) observe(false);
  expectSame(*client);
  start(2);  // Its revisions start again, too.
  ASSERT_TRUE(waitFor([&] { return server_->hasListener(); }));
  for (int i = 0; i < 3; ++i) observe(false);
  expectSame(*client);
}

/// Requests a part of the map.
GetMap askForPart(MapDetail detail, std::uint32_t part, std::uint64_t revision) {
  GetMap service;
  service.request.with_values = static_cast<std::uint8_t>(detail == MapDetail::kValues);
  service.request.part = part;
  service.request.revision = revision;
  // The server works in this thread during the call.
  auto call = std::async(std::launch::async,
                         [&service] { return callService("/lossy/lossy/get_map", service); });
  EXPECT_TRUE(
      waitFor([&] { return call.wait_for(std::chrono::seconds(0)) == std::future_status::ready; }));
  EXPECT_TRUE(call.get());
  return service;
}

TEST_P(LossyServerTest, KeepsThePartsOfTheLastMaps) {
  const MapDetail detail = GetParam().topic_detail;
  start(1);
  std::vector<cuboid_mapping::FullCuboidMap> first;
  for (std::size_t i = 0; i <= MapImageServer::kKept; ++i) {
    observe(false);
    const GetMap answer = askForPart(detail, 0, 0);
    ASSERT_TRUE(answer.response.info.success) << answer.response.info.message;
    first.push_back(answer.response.map);
    ASSERT_EQ(first.back().num_parts > 1, isInParts());
  }
  if (!isInParts()) return;
  const GetMap forgotten = askForPart(detail, 1, first[0].revision);
  EXPECT_FALSE(forgotten.response.info.success);
  EXPECT_NE(forgotten.response.info.message.find("begin again with part 0"), std::string::npos);
  for (std::uint32_t part = 0; part < first[1].num_parts; ++part) {
    const auto map = askForPart(detail, part, first[1].revision).response.map;
    EXPECT_TRUE(part == 0 || map.revision == first[1].revision) << "0: of the map as it is now";
    EXPECT_EQ(map.part, part);
    EXPECT_GT(map.bricks.num_bricks, 0U);
  }
  EXPECT_FALSE(askForPart(detail, first[1].num_parts, first[1].revision).response.info.success);
}

INSTANTIATE_TEST_SUITE_P(Details, LossyServerTest,
                         ::testing::Values(MapImageServer::Options{MapDetail::kClasses},
                                           MapImageServer::Options{MapDetail::kValues},
                                           MapImageServer::Options{MapDetail::kClasses, 1},
                                           MapImageServer::Options{MapDetail::kValues, 1}));

/// A node that publishes log-odds.
class NodeValues : public ::testing::Test {
 protected:
  static constexpr char kName[] = "/with_values";

  void SetUp() override { start(); }
  void TearDown() override { stop(); }

  void start() {
    node_ = std::make_unique<Program>(
        std::vector<std::string>{CUBOID_MAPPING_NODE, std::string("__name:=") + (kName + 1),
                                 "__log:=/dev/null", "_resolution:=0.1", "_publish_rate:=20.0",
                                 "_publish_values:=true"},
        std::function<void()>());
    ASSERT_TRUE(
        ros::service::waitForService(std::string(kName) + "/set_box", ros::Duration(kDeadline_s)));
  }
  void stop() {
    node_->send(SIGINT);
    const auto end = node_->finish();
    EXPECT_EQ(end.status, 0) << end.out << end.err;
  }

  /// Gives the inside of a box a probability. @return The revision after it.
  static std::uint64_t setBox(double min_m, double max_m, double probability) {
    SetBox set;
    set.request.occupancy = probability < 0.5 ? SetBox::Request::FREE : SetBox::Request::OCCUPIED;
    set.request.probability = static_cast<float>(probability);
    set.request.boxes.emplace_back();
    set.request.boxes.back().min = tf2::toMsg(Eigen::Vector3d(min_m, min_m, min_m));
    set.request.boxes.back().max = tf2::toMsg(Eigen::Vector3d(max_m, max_m, max_m));
    EXPECT_TRUE(callService(std::string(kName) + "/set_box", set));
    EXPECT_TRUE(set.response.info.success) << set.response.info.message;
    return set.response.info.revision;
  }

  /// Voxels in one message of ~get_map.
  Voxels getMap(MapDetail detail) {
    ImageMessage message;
    std::string error;
    GetMapClient client(nh_);
    EXPECT_TRUE(client.call(std::string(kName) + "/get_map", detail, message, error)) << error;
    cuboid_mapping::MapFollower follower;
    EXPECT_TRUE(follower.take(message.image));
    EXPECT_EQ(message.image.detail, detail);
    return voxelsOf(*follower.map());
  }

  /// Voxels in a file written by the node.
  static Voxels saveMap() {
    const TemporaryFolder folder;
    cuboid_mapping::SaveMap save;
    save.request.filename = folder / "map.cuboids";
    EXPECT_TRUE(callService(std::string(kName) + "/save_map", save));
    return cuboid_mapping::test::voxelsOf(
        cuboid_mapping::readMapFile(save.request.filename).snapshot.bricks);
  }

  void expectSame(const CuboidMapClient& client, std::uint64_t revision) {
    EXPECT_TRUE(waitFor([&] { return client.revision() >= revision; }));
    const Voxels voxels = saveMap();
    EXPECT_EQ(voxelsOf(client), voxels);
    EXPECT_EQ(getMap(MapDetail::kValues), voxels);
    EXPECT_EQ(classesOf(getMap(MapDetail::kClasses)), classesOf(voxels));
  }

  ros::NodeHandle nh_;
  std::unique_ptr<Program> node_;
};

TEST_F(NodeValues, AreCopiedBitByBitByEarlyAndLateListenersAndAfterARestart) {
  const CuboidMapClient client(nh_, kName);
  ASSERT_TRUE(waitFor([&] { return client.instance() != 0; })) << "the map is empty";
  setBox(-1.0, 1.0, 0.3);
  setBox(-0.5, 0.5, 0.8);
  expectSame(client, setBox(0.0, 0.7, 0.31));
  const CuboidMapClient late(nh_, kName);
  const std::uint64_t revision = setBox(0.2, 0.4, 0.32);
  for (const CuboidMapClient* each : {&client, &late}) expectSame(*each, revision);

  stop();
  EXPECT_FALSE(voxelsOf(client).empty()) << "it stays when the node goes";
  start();
  (void)setBox(2.0, 2.3, 0.77);
  const auto is_new = [](const CuboidMapClient& each) { return voxelsOf(each).size() == 27; };
  for (const CuboidMapClient* each : {&client, &late}) {
    EXPECT_TRUE(waitFor([&] { return is_new(*each); }));
    expectSame(*each, 1);
  }
}

TEST_F(NodeValues, AreThereAfterTheMapWasReplacedAsAWhole) {
  const CuboidMapClient client(nh_, kName);
  ASSERT_TRUE(waitFor([&] { return client.instance() != 0; })) << "the map is empty";
  expectSame(client, setBox(-1.0, 1.0, 0.3));
  std_srvs::Empty empty;
  ASSERT_TRUE(callService(std::string(kName) + "/reset", empty));
  ASSERT_TRUE(waitFor([&] { return voxelsOf(client).empty(); }));
  expectSame(client, setBox(-0.3, 0.3, 0.29));
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
