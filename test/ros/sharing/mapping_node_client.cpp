// SPDX-License-Identifier: BSD-3-Clause
// The running node, and a client that follows its map.
#include "cuboid_mapping/CuboidMapUpdate.h"
#include "cuboid_mapping/FullCuboidMap.h"
#include "cuboid_mapping/GetCuboids.h"
#include "cuboid_mapping/SetBox.h"
#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/ros/conversions/map_messages.h"
#include "cuboid_mapping/ros/cuboid_map_client.h"
#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/queries/service_call.h"
#include "cuboid_mapping/sharing/map_follower.h"
#include "ros/log_probe.h"
#include "ros/node_probe.h"

#include <atomic>
#include <cmath>
#include <future>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::ChangeSet;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::GetCuboids;
using cuboid_mapping::MetricBox;
using cuboid_mapping::SetBox;

class NodeClientTest : public NodeTest {
 protected:
  void SetUp() override {
    NodeTest::SetUp();
    publishStaticTf(makeTransform("map", "lidar", makeTranslation(0.05, 0.05, 0.05)));
    connect();
  }

  void connect() {
    client_.reset();
    client_.emplace(nh_, kNode, [this](const ChangeSet& changes) {
      const std::lock_guard<std::mutex> lock(changes_mutex_);
      changes_.push_back(changes);
    });
    ASSERT_TRUE(waitFor([this] { return client_->instance() != 0; }));
  }

  void sendRoom(double x_m, long count) {
    std::vector<Eigen::Vector3d> points = makeRoom({2.0, 2.0, 1.0});
    for (Eigen::Vector3d& point : points) point.x() -= x_m;
    cloud_publisher_.publish(makeCloud("lidar", ros::Time(101.5), points));
    ASSERT_TRUE(waitForInserted(count));
  }

  static void setBox(double max_m, std::uint8_t occupancy) {
    SetBox box;
    box.request.boxes.emplace_back();
    box.request.boxes.back().min = toPoint({-max_m, -0.5, -0.5});
    box.request.boxes.back().max = toPoint({max_m, 0.5, 0.5});
    box.request.occupancy = occupancy;
    ASSERT_TRUE(callService(std::string(kNode) + "/set_box", box));
    ASSERT_TRUE(box.response.info.success) << box.response.info.message;
  }

  static GetCuboids::Response serverMap() {
    GetCuboids cuboids;
    cuboids.request.everything = true;
    cuboids.request.classes = GetCuboids::Request::ALL;
    EXPECT_TRUE(callService(std::string(kNode) + "/get_cuboids", cuboids));
    return cuboids.response;
  }

  /// Waits until the client has the server's revision, and compares every voxel.
  void expectSameMap() {
    const GetCuboids::Response server = serverMap();
    ASSERT_TRUE(waitFor([&] { return client_->revision() >= server.info.revision; }));
    ASSERT_EQ(client_->revision(), server.info.revision);
    EXPECT_EQ(client_->instance(), server.info.instance);
    EXPECT_EQ(client_->replacements(), server.info.replacements);
    client_->read([&](const CuboidMap& map) {
      double num_voxels = 0.0;
      for (const cuboid_mapping::MapCuboid& cuboid : server.cuboids) {
        const auto there = queryBox(map, MetricBox{toVector(cuboid.min), toVector(cuboid.max)},
                                    cuboid_mapping::Budget::unlimited());
        EXPECT_NEAR(there->unknown_volume_m3, 0.0, 1e-9);
        const bool is_free = cuboid.occupancy == cuboid_mapping::MapCuboid::FREE;
        EXPECT_NEAR(is_free ? there->occupied_volume_m3 : there->free_volume_m3, 0.0, 1e-9);
        num_voxels += there->box.numVoxels();
      }
      EXPECT_EQ(map.voxels().numFreeVoxels() + map.voxels().numOccupiedVoxels(), num_voxels);
      return true;
    });
  }

  /// All changes that the callback got.
  std::vector<ChangeSet> changes() {
    const std::lock_guard<std::mutex> lock(changes_mutex_);
    return changes_;
  }

  CallbackGuard guard_;
  std::mutex changes_mutex_;
  std::vector<ChangeSet> changes_;
  std::optional<cuboid_mapping_ros::CuboidMapClient> client_;
};

TEST_F(NodeClientTest, EqualsTheMapOfTheServer) {
  for (int i = 0; i < 4; ++i) {
    sendRoom(0.3 * i, i + 1);
    if (i % 2 == 1) expectSameMap();
  }
  EXPECT_EQ(client_->frameId(), "map");
  EXPECT_EQ(client_->stamp(), ros::Time(101.5));
  EXPECT_GT(client_->read([](const CuboidMap& map) { return map.voxels().numOccupiedVoxels(); }),
            1000);
  EXPECT_GE(changes().size(), 2U);
}

TEST_F(NodeClientTest, TellsTheBricksThatHaveChanged) {
  sendRoom(0.0, 1);
  expectSameMap();
  EXPECT_TRUE(changes().front().is_everything);
  setBox(1.0, SetBox::Request::OCCUPIED);
  expectSameMap();
  // The client tells of a change after it has made it.
  ASSERT_TRUE(waitFor([this] { return changes().back().revision == client_->revision(); }));
  const ChangeSet last = changes().back();
  EXPECT_FALSE(last.is_everything);
  EXPECT_FALSE(last.bricks.empty());
  const auto box = client_->read([](const CuboidMap& map) {
    return *map.grid().toCellBox({{-1.0, -0.5, -0.5}, {1.0, 0.5, 0.5}});
  });
  for (const auto& changed : last.bricks) {
    EXPECT_TRUE(cuboid_mapping::brickBox(changed.brick).intersects(box));
  }
}

TEST_F(NodeClientTest, MissesNoUpdateThatOvertakesTheImage) {
  using cuboid_mapping::MapDetail;
  CuboidMap map;
  map.replace({{0, 0, 0}, {9, 9, 9}}, {{{{0, 0, 0}, {9, 9, 9}}, 1.0F}});
  ImageMessage image;
  image.image = cuboid_mapping::makeImage(map, 7, MapDetail::kClasses);
  const ChangeSet changes = map.replace({{0, 0, 0}, {2, 2, 2}}, {{{{0, 0, 0}, {2, 2, 2}}, -1.0F}});
  DeltaMessage delta;
  delta.delta =
      cuboid_mapping::makeDelta(map, changes, 7, image.image.revision, MapDetail::kClasses);
  ros::NodeHandle nh("early");
  const auto images = nh.advertise<cuboid_mapping::FullCuboidMap>(kCuboidMapTopic, 1);
  const auto deltas = nh.advertise<cuboid_mapping::CuboidMapUpdate>(kCuboidMapUpdatesTopic, 1);
  const CuboidMapClient client(nh);
  ASSERT_TRUE(
      waitFor([&] { return images.getNumSubscribers() > 0 && deltas.getNumSubscribers() > 0; }));
  deltas.publish(toMessage(delta));
  ros::WallDuration(0.3).sleep();
  EXPECT_FALSE(client.hasMap());
  images.publish(toMessage(image));
  ASSERT_TRUE(waitFor([&] { return client.hasMap(); }));
  ASSERT_TRUE(waitFor([&] { return client.revision() == map.revision(); }));
  client.read([&](const CuboidMap& copy) {
    EXPECT_EQ(copy.voxels().numFreeVoxels(), 8);
    return true;
  });
}

/// Another server that publishes a map as the node does, in its own namespace.
class OtherServer {
 public:
  explicit OtherServer(const std::string& ns) : nh_(ns) {
    map_.replace({{0, 0, 0}, {64, 9, 9}}, {{{{0, 0, 0}, {64, 9, 9}}, 1.0F}});
  }

  [[nodiscard]] const ros::NodeHandle& nh() const { return nh_; }
  [[nodiscard]] const CuboidMap& map() const { return map_; }
  bool waitForListener() {
    return waitFor(
        [&] { return images_.getNumSubscribers() > 0 && deltas_.getNumSubscribers() > 0; });
  }

  /// One part for each brick.
  std::vector<cuboid_mapping::FullCuboidMap> parts(const std::string& server) {
    ImageMessage image;
    image.image = cuboid_mapping::makeImage(map_, 7, cuboid_mapping::MapDetail::kClasses);
    image.server = server;
    std::vector<cuboid_mapping::FullCuboidMap> parts;
    for (const cuboid_mapping::VoxelBrick& brick : image.image.bricks) {
      parts.push_back(toMessage(image, &brick, &brick + 1));
      parts.back().part = static_cast<std::uint32_t>(parts.size() - 1);
    }
    for (auto& part : parts) part.num_parts = static_cast<std::uint32_t>(parts.size());
    return parts;
  }
  void publish(const cuboid_mapping::FullCuboidMap& part) { images_.publish(part); }
  void publish(const DeltaMessage& delta) { deltas_.publish(toMessage(delta)); }

  /// The update after the parts.
  DeltaMessage lateDelta(const std::string& server) {
    DeltaMessage message;
    message.server = server;
    message.delta.instance = 7;
    message.delta.base = map_.revision();
    message.delta.revision = map_.revision() + 1;
    message.delta.resolution_m = map_.grid().resolution();
    return message;
  }

 private:
  ros::NodeHandle nh_;
  CuboidMap map_;
  ros::Publisher images_ = nh_.advertise<cuboid_mapping::FullCuboidMap>(kCuboidMapTopic, 100);
  ros::Publisher deltas_ =
      nh_.advertise<cuboid_mapping::CuboidMapUpdate>(kCuboidMapUpdatesTopic, 9);
};

TEST_F(NodeClientTest, TakesAMapInPartsFromTheTopicAlone) {
  OtherServer server("parts");
  const CuboidMapClient client(server.nh());
  ASSERT_TRUE(server.waitForListener());
  const auto parts = server.parts("/nobody");
  ASSERT_GT(parts.size(), 8U);
  for (const auto& part : parts) server.publish(part);
  ASSERT_TRUE(waitFor([&] { return client.hasMap(); }));
  EXPECT_EQ(client.read([](const CuboidMap& copy) { return copy.voxels().numOccupiedVoxels(); }),
            64 * 9 * 9);
}

TEST_F(NodeClientTest, AsksTheServerThatTheMessagesNameHoweverLongItTakes) {
  OtherServer server("slow");
  const auto parts = server.parts("/slow/mapper");
  GuardedThread thread(guard_, "slow server");
  int num_calls = 0;
  const boost::function<bool(cuboid_mapping::GetMap::Request&, cuboid_mapping::GetMap::Response&)>
      answer = [&](cuboid_mapping::GetMap::Request& request,
                   cuboid_mapping::GetMap::Response& response) {
        if (++num_calls == 1) ros::WallDuration(11.0).sleep();
        response.info.success = static_cast<std::uint8_t>(true);
        response.map = parts[request.part];
        return true;
      };
  ros::NodeHandle nh = withQueue(server.nh(), thread.queue());
  const auto service = nh.advertiseService("mapper/get_map", answer);
  thread.start();
  const CuboidMapClient client(server.nh());
  ASSERT_TRUE(server.waitForListener());
  server.publish(server.lateDelta("/slow/mapper"));
  ASSERT_TRUE(waitFor([&] { return client.hasMap(); }));
  EXPECT_EQ(num_calls, static_cast<int>(parts.size()));
}

TEST_F(NodeClientTest, SaysThatTwoNodesPublishAndFollowsOne) {
  LogProbe log;
  OtherServer server("two");
  const CuboidMapClient client(server.nh());
  ASSERT_TRUE(server.waitForListener());
  for (const auto& part : server.parts("/a")) server.publish(part);
  ASSERT_TRUE(waitFor([&] { return client.hasMap(); }));
  for (const auto& part : server.parts("/b")) server.publish(part);
  EXPECT_TRUE(log.waitForLine("ignored the map of /b on /two/cuboid_map: /a is followed"));
}

TEST_F(NodeClientTest, PrefersTheServerOfTheDefaultName) {
  LogProbe log;
  OtherServer server("named");
  const CuboidMapClient client(server.nh());
  ASSERT_TRUE(server.waitForListener());
  for (const auto& part : server.parts("/a")) server.publish(part);
  ASSERT_TRUE(waitFor([&] { return client.hasMap(); })) << "there is nobody else";
  for (auto part : server.parts("/named/cuboid_mapping")) {
    part.instance = 8;
    part.header.frame_id = "of_b";
    server.publish(part);
  }
  ASSERT_TRUE(waitFor([&] { return client.frameId() == "of_b"; }));
  for (const auto& part : server.parts("/a")) server.publish(part);
  EXPECT_TRUE(log.waitForLine("on /named/cuboid_map: /named/cuboid_mapping is followed"));
  EXPECT_EQ(client.frameId(), "of_b");
}

TEST_F(NodeClientTest, FollowsOnlyTheServerThatItIsGivenByTheTopicsBesideIt) {
  LogProbe log;
  OtherServer server("given");
  const CuboidMapClient client(ros::NodeHandle("elsewhere"), "/given/b");
  ASSERT_TRUE(server.waitForListener());
  for (const auto& part : server.parts("/given/a")) server.publish(part);
  EXPECT_TRUE(
      log.waitForLine("ignored the map of /given/a on /given/cuboid_map: /given/b is followed"));
  EXPECT_EQ(client.instance(), 0U);
  for (const auto& part : server.parts("/given/b")) server.publish(part);
  EXPECT_TRUE(waitFor([&] { return client.hasMap(); }));
}

TEST_F(NodeClientTest, FollowsTheServerThatItIsGivenByRemappedTopics) {
  OtherServer server("remapped");
  const ros::NodeHandle nh("elsewhere", {{kCuboidMapTopic, "/remapped/cuboid_map"},
                                         {kCuboidMapUpdatesTopic, "/remapped/cuboid_map_updates"}});
  const CuboidMapClient client(nh, "/given/b");
  ASSERT_TRUE(server.waitForListener());
  for (const auto& part : server.parts("/given/b")) server.publish(part);
  EXPECT_TRUE(waitFor([&] { return client.hasMap(); }));
}

TEST_F(NodeClientTest, FollowsEditsAndResets) {
  sendRoom(0.0, 1);
  setBox(20.0, SetBox::Request::OCCUPIED);
  expectSameMap();
  setBox(10.0, SetBox::Request::UNKNOWN);
  expectSameMap();
  const std::uint64_t replacements = client_->replacements();
  reset();
  expectSameMap();
  EXPECT_EQ(client_->read([](const CuboidMap& map) { return map.voxels().size(); }), 0U);
  EXPECT_FALSE(client_->hasMap()) << "an empty map is of no use to a planner";
  EXPECT_EQ(client_->replacements(), replacements + 1);
  sendRoom(0.2, 2);
  expectSameMap();
}

TEST_F(NodeClientTest, FollowsThoughSomebodyAlwaysReads) {
  sendRoom(0.0, 1);
  expectSameMap();
  std::atomic<bool> is_over{false};
  std::vector<std::future<void>> readers;
  for (int i = 0; i < 3; ++i) {
    readers.push_back(std::async(std::launch::async, [&] {
      while (!is_over) {
        client_->read([](const CuboidMap&) {
          ros::WallDuration(0.02).sleep();
          return 0;
        });
      }
    }));
  }
  setBox(1.0, SetBox::Request::FREE);
  const std::uint64_t revision = serverMap().info.revision;
  EXPECT_TRUE(waitFor([&] { return client_->revision() >= revision; }));
  is_over = true;
}

TEST_F(NodeClientTest, ALongReaderKeepsItsRevisionAndHoldsUpNothing) {
  sendRoom(0.0, 1);
  expectSameMap();
  const CuboidMap own = client_->copy();
  client_->read([&](const ClientMap& kept) {
    const std::uint64_t revision = kept.revision();
    for (int i = 1; i <= 5; ++i) {
      setBox(0.1 * i, SetBox::Request::OCCUPIED);
      expectSameMap();
    }
    EXPECT_EQ(kept.revision(), revision);
    EXPECT_LT(kept.revision(), client_->revision());
    EXPECT_EQ(kept.stamp(), ros::Time(101.5));
    EXPECT_EQ(kept.frameId(), "map");
    EXPECT_EQ(kept.map().voxels().numOccupiedVoxels(), own.voxels().numOccupiedVoxels());
    EXPECT_NE(client_->copy().voxels().numOccupiedVoxels(), own.voxels().numOccupiedVoxels());
  });
}

TEST_F(NodeClientTest, GetsTheMapWhenItComesLate) {
  sendRoom(0.0, 1);
  expectSameMap();
  connect();
  expectSameMap();
  setBox(1.0, SetBox::Request::FREE);
  expectSameMap();
}

TEST_F(NodeClientTest, HasAnEmptyMapWithoutAServer) {
  ros::NodeHandle elsewhere("elsewhere");
  const cuboid_mapping_ros::CuboidMapClient client(elsewhere, "nobody");
  LogProbe log;
  EXPECT_FALSE(client.waitForMap(ros::WallDuration(3.5)));
  EXPECT_TRUE(log.waitForLine("no map has come on /elsewhere/cuboid_map, nobody publishes it"));
  EXPECT_FALSE(client.hasMap());
  EXPECT_EQ(client.revision(), 0U);
  EXPECT_EQ(client.frameId(), "");
  EXPECT_EQ(client.read([](const CuboidMap& map) { return map.voxels().size(); }), 0U);
}

TEST_F(NodeClientTest, NamesTheServerThatNobodyHasStartedUnlessItHearsAnother) {
  LogProbe log;
  OtherServer server("unnamed");
  const CuboidMapClient fed(server.nh());
  ASSERT_TRUE(server.waitForListener());
  for (const auto& part : server.parts("/a")) server.publish(part);
  ros::NodeHandle elsewhere("elsewhere");
  const CuboidMapClient client(elsewhere, "misspelt");
  EXPECT_TRUE(log.waitForLine("no node offers /elsewhere/misspelt/get_map"));
  EXPECT_TRUE(fed.hasMap());
  EXPECT_FALSE(log.has("/unnamed/cuboid_mapping"));
}

TEST_F(NodeClientTest, SaysWhatIsMissingWhenItGivesUp) {
  ros::NodeHandle elsewhere("elsewhere");
  const cuboid_mapping_ros::CuboidMapClient client(elsewhere, "nobody");
  LogProbe log;
  EXPECT_FALSE(client.waitForMap(ros::WallDuration(0.2)));
  EXPECT_TRUE(log.waitForLine("no map has come on /elsewhere/cuboid_map, nobody publishes it"));
}

TEST_F(NodeClientTest, SaysThatItsTopicIsPublishedButDoesNotConnect) {
  ros::NodeHandle elsewhere("elsewhere", {{kCuboidMapTopic, "/elsewhere/other_map"},
                                          {kCuboidMapUpdatesTopic, "/elsewhere/updates"}});
  auto options = ros::AdvertiseOptions::create<cuboid_mapping::FullCuboidMap>(kCuboidMapTopic, 1,
                                                                              {}, {}, {}, nullptr);
  options.md5sum = std::string(options.md5sum.size(), '1');
  const CuboidMapClient client(elsewhere, kNode);  // First: roscpp refuses it in the same process.
  const ros::Publisher publisher = elsewhere.advertise(options);
  LogProbe log;
  EXPECT_TRUE(log.waitForLine("no map has come on /elsewhere/other_map, though it is published"));
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
