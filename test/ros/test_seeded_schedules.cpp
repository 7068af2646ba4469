// SPDX-License-Identifier: BSD-3-Clause
// Schedules controlled by a seed: the events of the node, their order, and the messages lost by its
// network. Everything runs in one thread, so that a failing seed repeats exactly:
//
//   CUBOID_MAPPING_TEST_SEED=1 CUBOID_MAPPING_FIRST_SCHEDULE=137 CUBOID_MAPPING_SCHEDULES=1 test_seeded_schedules
#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/ros/map/map_storage.h"
#include "ros/cloud_messages.h"
#include "ros/simulated_node.h"
#include "support/cuboid_set.h"
#include "support/random.h"
#include "support/snapshots.h"

#include <gtest/gtest.h>
#include <boost/make_shared.hpp>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::Cell;
using cuboid_mapping::CellBox;
using cuboid_mapping::FollowResult;
using cuboid_mapping::MapSnapshot;
using cuboid_mapping::UniformBox;
using cuboid_mapping::test::Random;
using cuboid_mapping::test::voxelsOf;

std::size_t numberOf(const char* variable, std::size_t otherwise) {
  const char* text = std::getenv(variable);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

/// Number of times that each event has happened in all schedules, so that no missing one goes unnoticed.
using Counts = std::map<std::string, std::size_t>;

NodeParameters makeParameters(Random& random) {
  NodeParameters parameters;
  parameters.map.resolution_m = 0.25;
  parameters.threads = 1;
  parameters.queue_size = random.integer(1, 6);
  parameters.tf_wait_s = random.real(0.5, 8.0);
  if (random.chance(0.3)) parameters.source.max_range_m = random.real(1.0, 5.0);
  return parameters;
}

/// Expects equal maps.
void expectEqual(const CuboidMap& map, const CuboidMap& expected, const char* what) {
  EXPECT_TRUE(voxelsOf(map) == voxelsOf(expected)) << what << ": other voxels";
  EXPECT_TRUE(cuboid_mapping::test::allCuboids(map) == cuboid_mapping::test::allCuboids(expected))
      << what << ": other cuboids";
}

/// A follower of the map, whose network may lose messages.
struct Listener {
  MapFollower follower;
  bool is_connected = true;
};

class Schedule {
 public:
  Schedule(std::size_t number, Counts& counts)
      : counts_(counts),
        random_(number),
        parameters_(makeParameters(random_)),
        node_(parameters_),
        file_((std::filesystem::temp_directory_path() /
               ("cuboid_schedule_" + std::to_string(::getpid()) + ".cuboids"))
                  .string()) {
    publishTf("fixed", true);
  }
  ~Schedule() { std::filesystem::remove(file_); }

  void run() {
    constexpr int kSteps = 150;
    for (int i = 0; i < kSteps; ++i) step();
    settle();
  }

  /// Checks at the end of a schedule.
  void check() {
    const NodeStatistics& statistics = node_.statistics();
    EXPECT_EQ(statistics.num_received, num_delivered_);
    EXPECT_EQ(statistics.numWaiting(), node_.numWaiting()) << "a cloud is neither in nor counted";
    EXPECT_EQ(node_.numWaiting(), 0U) << "a cloud waits for ever";
    node_.map().read([this](const CuboidMap& map, const ros::Time&) {
      expectEqual(map, node_.replay().map(), "the node and what it counted as inserted");
      for (const Listener& listener : listeners_) {
        const CuboidMap* copy = listener.follower.map();
        EXPECT_NE(copy, nullptr);
        if (copy != nullptr) expectEqual(*copy, map, "a follower and its node");
      }
      return true;
    });
    for (std::size_t i = 0; i < kNumDropReasons; ++i) {
      counts_[toString(static_cast<DropReason>(i))] += statistics.num_dropped[i];
    }
    counts_["inserted"] += statistics.num_inserted;
  }

 private:
  void step() {
    switch (random_.integer(0, 15)) {
      case 0:
      case 1:
      case 2: return sendCloud();
      case 3:
      case 4: return deliver();
      case 5: return publishTf("moving", false);
      case 6: return note("time", [&] { passTime(random_.real(0.0, 0.5)); });
      case 7: return random_.chance(0.1) ? jump() : passTime(0.1);
      case 8: return edit();
      case 9: return note("publish", [&] { publish(0.3); });
      case 10: return changeListeners();
      case 11: return random_.chance(0.3) ? reconfigure() : work();
      case 12: return random_.chance(0.3) ? useDisk() : work();
      case 13: return random_.chance(0.1) ? node_.setPaused(random_.chance(0.5)) : work();
      default: return work();
    }
  }

  template <typename WorkT>
  void note(const std::string& what, const WorkT& work) {
    ++counts_[what];
    work();
  }

  void work() {
    for (int i = random_.integer(1, 4); i > 0; --i) (void)node_.mapOne();
  }

  ros::Time stampOfCloud() {
    const double now_s = now_.toSec();
    switch (random_.integer(0, 12)) {
      case 0: return ros::Time();
      case 1: return ros::Time(now_s + random_.real(0.0, 1.0));
      case 2: return ros::Time(now_s - random_.real(0.0, 30.0));
      case 3: return random_.chance(0.05) ? ros::Time(4294967290.0) : now_;
      default: return now_;
    }
  }

  void sendCloud() {
    std::vector<Eigen::Vector3d> points;
    for (int i = random_.integer(0, 20); i > 0; --i) {
      points.emplace_back(random_.real(-6, 6), random_.real(-6, 6), random_.real(-2, 2));
    }
    CloudSpec spec;
    spec.width = static_cast<std::uint32_t>(points.size());
    auto cloud = boost::make_shared<sensor_msgs::PointCloud2>(makeMessage(spec, points));
    const std::string frames[] = {"fixed", "fixed", "moving", "moving", "moving", "nowhere"};
    cloud->header.frame_id = frames[random_.index(6)];
    cloud->header.stamp = stampOfCloud();
    if (random_.chance(0.02)) cloud->header.frame_id.clear();
    if (random_.chance(0.02)) cloud->fields.clear();
    network_.push_back(cloud);
    if (random_.chance(0.05)) network_.push_back(cloud);  // It comes twice.
    if (random_.chance(0.05)) network_.pop_back();        // It is lost.
  }

  /// Delivers messages in any order.
  void deliver() {
    for (int i = random_.integer(1, 5); i > 0 && !network_.empty(); --i) {
      const std::size_t index = random_.chance(0.7) ? 0 : random_.index(network_.size());
      node_.receive({network_[index]});
      network_.erase(network_.begin() + static_cast<std::ptrdiff_t>(index));
      ++num_delivered_;
    }
  }

  void publishTf(const std::string& frame_id, bool is_static) {
    geometry_msgs::TransformStamped transform;
    transform.header.frame_id = "map";
    transform.header.stamp = ros::Time(now_.toSec() + random_.real(-0.3, 0.3));
    transform.child_frame_id = frame_id;
    transform.transform.translation.x = random_.real(-3, 3);
    transform.transform.rotation.w = 1.0;
    node_.setTransform(transform, is_static);
  }

  void passTime(double seconds) {
    now_ += ros::Duration(seconds);
    node_.setTime(now_);
  }

  /// Time jumps, as when a recording starts again, or continues after a pause.
  void jump() {
    ++counts_["jump"];
    passTime(random_.chance(0.5) ? -random_.real(15.0, 300.0) : random_.real(15.0, 300.0));
  }

  void edit() {
    if (random_.chance(0.05)) {
      ++counts_["reset"];
      return node_.editBoth([](CuboidMap& map) { return map.clear(); });
    }
    ++counts_["edit"];
    const Cell min{random_.integer(-20, 20), random_.integer(-20, 20), random_.integer(-8, 8)};
    const CellBox box{
        min, min + Cell{random_.integer(1, 12), random_.integer(1, 12), random_.integer(1, 12)}};
    std::vector<UniformBox> boxes;
    if (random_.chance(0.7)) boxes.push_back({box, random_.chance(0.5) ? 1.0F : -1.0F});
    const bool locks = random_.chance(0.2);
    node_.editBoth([&](CuboidMap& map) {
      ChangeSet changes = map.replace(box, boxes);
      locks ? map.lock(box) : map.unlock(box);
      return changes;
    });
  }

  void reconfigure() {
    ++counts_["reconfigure"];
    parameters_.source.max_range_m = random_.real(1.0, 20.0);
    parameters_.source.min_range_m = random_.real(0.0, 1.0);
    parameters_.source.sensor_model.hit = random_.real(0.6, 0.9);
    node_.setParameters(parameters_);
  }

  void useDisk() {
    const bool saves = !saved_ || random_.chance(0.5);
    ++counts_[saves ? "save" : "load"];
    if (saves) {
      ASSERT_EQ(saveMap(node_.map(), "map", file_).error, "");
      saved_ = cuboid_mapping::takeSnapshot(node_.replay().map(), "map");
      return;
    }
    ASSERT_EQ(loadMap(node_.map(), file_).error, "");
    CuboidMap& replayed = node_.replay().map();
    const std::vector<CellBox> locks = replayed.lockedBoxes();
    (void)restoreSnapshot(*saved_, replayed);
    replayed.setLocked(locks);  // Loading a map keeps them, and ignores those of the file.
  }

  void changeListeners() {
    if (listeners_.empty() || (listeners_.size() < 3 && random_.chance(0.3))) {
      ++counts_["listener"];
      listeners_.emplace_back();
      if (random_.chance(0.8)) sendImage(listeners_.back());
      return;
    }
    Listener& listener = listeners_[random_.index(listeners_.size())];
    listener.is_connected = !listener.is_connected;
  }

  void sendImage(Listener& listener) { EXPECT_TRUE(listener.follower.take(node_.makeImage())); }

  void publish(double loss) {
    const MapDelta delta = node_.publish();
    for (Listener& listener : listeners_) {
      if (!listener.is_connected || random_.chance(loss)) continue;
      if (listener.follower.take(delta) != FollowResult::kGap) continue;
      ++counts_["gap"];
      if (!random_.chance(loss)) sendImage(listener);
    }
  }

  /// All messages arrive, all work is done, and waiting clouds give up.
  void settle() {
    node_.setPaused(false);
    while (!network_.empty()) deliver();
    for (int i = 0; i < 3; ++i) {
      while (node_.mapOne()) {
      }
      passTime(parameters_.tf_wait_s + 1.0);
      publishTf("moving", false);
    }
    while (node_.mapOne()) {
    }
    for (Listener& listener : listeners_) listener.is_connected = true;
    publish(0.0);
    for (Listener& listener : listeners_) {
      if (listener.follower.map() == nullptr) sendImage(listener);
    }
  }

  Counts& counts_;
  Random random_;
  NodeParameters parameters_;
  SimulatedNode node_;
  std::string file_;
  std::optional<MapSnapshot> saved_;
  ros::Time now_{1000.0};
  std::vector<sensor_msgs::PointCloud2::ConstPtr> network_;
  std::size_t num_delivered_ = 0;
  std::vector<Listener> listeners_;
};

TEST(SeededSchedules, EveryCloudIsInOrCountedAndTheMapIsThatOfAPlainReplay) {
  const std::size_t first = numberOf("CUBOID_MAPPING_FIRST_SCHEDULE", 0);
  const std::size_t count = numberOf("CUBOID_MAPPING_SCHEDULES", 200);
  Counts counts;
  for (std::size_t number = first; number < first + count; ++number) {
    Schedule schedule(number, counts);
    schedule.run();
    schedule.check();
    ASSERT_FALSE(HasFailure()) << "CUBOID_MAPPING_FIRST_SCHEDULE=" << number << " repeats it";
  }
  for (const auto& [what, number] : counts) std::cout << what << ": " << number << '\n';
  if (count < 100) return;
  for (const char* what : {"inserted",
                           "queue full",
                           "no transform",
                           "too old for tf",
                           "before the first transform",
                           "in a gap of tf",
                           "paused",
                           "empty frame_id",
                           "no points",
                           "no x/y/z fields",
                           "jump",
                           "reset",
                           "edit",
                           "reconfigure",
                           "save",
                           "load",
                           "listener",
                           "gap",
                           "publish",
                           "time"}) {
    EXPECT_GT(counts[what], 0U) << what << " never happened";
  }
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
