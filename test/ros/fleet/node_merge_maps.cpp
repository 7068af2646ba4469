// SPDX-License-Identifier: BSD-3-Clause
// Robots, and a node that makes one map of their observations, over a network that loses, repeats and delays.
#include "cuboid_mapping/Observation.h"
#include "cuboid_mapping/SaveMap.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/ros/fleet/robot_merger.h"
#include "ros/node_probe.h"
#include "support/random.h"
#include "support/snapshots.h"
#include "tools/run_program.h"

#include <algorithm>
#include <csignal>
#include <exception>
#include <filesystem>
#include <memory>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::CuboidMap;
using cuboid_mapping::MapConfig;
using cuboid_mapping::Observation;
using cuboid_mapping::RobotObservation;
using cuboid_mapping::SaveMap;
using cuboid_mapping::test::Program;
using cuboid_mapping::test::Random;
using cuboid_mapping::test::TemporaryFolder;
using cuboid_mapping::test::voxelsOf;

constexpr char kMerger[] = "/merge_maps";
constexpr char kMergerWithStore[] = "/with_store/merge_maps";
constexpr int kRobotClouds = 12;  // Per robot, in each of two parts.
/// The second robot joins late: its earlier observations must be requested.
constexpr int kUnheardOfSecond = 3;
/// Delay of the node with a store. No test waits this long: stamps alone decide what goes into its map, at any speed.
constexpr double kStoreDelay_s = 2.0 * kDeadline_s;

/// Number of robots, three or more.
int numRobots() { return ros::param::param("~robots", 3); }

std::string nameOf(int robot) { return "robot" + std::to_string(robot); }

/// Forwards observations. A fifth is lost, a fifth comes twice, all are up to 2 s late; the first of the second
/// robot are lost.
class LossyNetwork {
 public:
  explicit LossyNetwork(int num_robots) {
    for (int robot = 1; robot <= num_robots; ++robot) {
      publishers_.push_back(
          nh_.advertise<Observation>("/lossy" + std::to_string(robot) + "/observations", 1000));
      const boost::function<void(const Observation::ConstPtr&)> take =
          [this, robot](const Observation::ConstPtr& message) { onSent(robot, message); };
      subscribers_.push_back(
          nh_.subscribe<Observation>('/' + nameOf(robot) + "/observations", 1000, take));
    }
  }

  [[nodiscard]] bool isConnected() const {
    return std::all_of(publishers_.begin(), publishers_.end(),
                       [](const auto& publisher) { return publisher.getNumSubscribers() > 0; }) &&
           std::all_of(subscribers_.begin(), subscribers_.end(),
                       [](const auto& subscriber) { return subscriber.getNumPublishers() > 0; });
  }

  [[nodiscard]] int numListeners() const {
    int count = 0;
    for (const ros::Publisher& publisher : publishers_) {
      count += static_cast<int>(publisher.getNumSubscribers());
    }
    return count;
  }

  /// If true, all messages arrive, in the order of sending.
  void setReliable(bool is_reliable) { is_reliable_ = is_reliable; }

  void deliver() {
    const ros::WallTime now = ros::WallTime::now();
    while (!travelling_.empty() && travelling_.begin()->first <= now) {
      const auto [robot, message] = travelling_.begin()->second;
      sendAs(robot, *message);
      travelling_.erase(travelling_.begin());
    }
  }

  /// Sends a message without losses and delays.
  void sendAs(int robot, const Observation& message) {
    publishers_[static_cast<std::size_t>(robot - 1)].publish(message);
  }

  [[nodiscard]] const std::vector<Observation>& sent() const { return sent_; }
  [[nodiscard]] int numLost() const { return num_lost_; }
  [[nodiscard]] bool isEmpty() const { return travelling_.empty(); }

 private:
  void onSent(int robot, const Observation::ConstPtr& message) {
    sent_.push_back(*message);
    const bool is_unheard = robot == 2 && message->sequence <= kUnheardOfSecond;
    if (is_unheard || (!is_reliable_ && random_.chance(0.2))) {
      ++num_lost_;
      return;
    }
    const int times = !is_reliable_ && random_.chance(0.2) ? 2 : 1;
    for (int i = 0; i < times; ++i) {
      const double delay_s = is_reliable_ ? 0.0 : random_.real(0.0, 2.0);
      travelling_.emplace(ros::WallTime::now() + ros::WallDuration(delay_s),
                          std::make_pair(robot, message));
    }
  }

  ros::NodeHandle nh_;
  Random random_;
  bool is_reliable_ = false;
  std::vector<ros::Publisher> publishers_;
  std::vector<ros::Subscriber> subscribers_;
  std::vector<Observation> sent_;
  std::multimap<ros::WallTime, std::pair<int, Observation::ConstPtr>> travelling_;
  int num_lost_ = 0;
};

class MergeMaps : public ::testing::Test {
 protected:
  MergeMaps() {
    for (int robot = 1; robot <= num_robots_; ++robot) {
      clouds_.push_back(
          nh_.advertise<sensor_msgs::PointCloud2>('/' + nameOf(robot) + "/cloud_in", 100));
      robots_.push_back(start(robot));
    }
  }

  static std::unique_ptr<Program> start(int robot) {
    const std::string node = '/' + nameOf(robot) + "/cuboid_mapping/";
    ros::param::set(node + "resolution", kResolution_m);
    ros::param::set(node + "observation_memory", 300);
    ros::param::set(node + "queue_size", 100);
    if (robot == 2) ros::param::set(node + "sensor_model/hit", 0.8);
    return std::make_unique<Program>(std::vector<std::string>{
        CUBOID_MAPPING_NODE, "__ns:=/" + nameOf(robot), "__name:=cuboid_mapping"});
  }

  /// A merging node of this test, started as in merge_maps.launch, that keeps its map in a store.
  static std::unique_ptr<Program> startMerger(const std::string& store) {
    const std::string node = std::string(kMergerWithStore) + '/';
    std::string robots;
    for (int robot = 1; robot <= numRobots(); ++robot) robots += " /lossy" + std::to_string(robot);
    ros::param::set(node + "merge/robots", robots);
    ros::param::set(node + "merge/delay", kStoreDelay_s);
    ros::param::set(node + "resolution", kResolution_m);
    ros::param::set(node + "autosave_file", store);
    ros::param::set(node + "autosave_period", 1.0);
    ros::param::set(node + "diagnostic_period", 0.1);
    return std::make_unique<Program>(
        std::vector<std::string>{CUBOID_MAPPING_NODE, "__ns:=/with_store", "__name:=merge_maps"});
  }

  void TearDown() override {
    for (auto& robot : robots_) stop(robot);
    stop(merger_with_store_);
  }

  static void stop(std::unique_ptr<Program>& program) {
    if (program == nullptr) return;
    program->send(SIGINT);
    EXPECT_EQ(program->finish().status, 0);
    program.reset();
  }

  bool waitUntilConnected() {
    const bool is_connected = waitFor([this] {
      return network_.isConnected() &&
             std::all_of(clouds_.begin(), clouds_.end(),
                         [](const auto& cloud) { return cloud.getNumSubscribers() > 0; });
    });
    ros::WallDuration(1.0)
        .sleep();  // Robots may notice a little later: they send nothing without a subscriber.
    return is_connected;
  }

  bool waitForSent(std::size_t count) {
    return waitFor([this, count] {
      network_.deliver();
      return network_.sent().size() >= count && network_.isEmpty();
    });
  }

  /// @return Sent observations, when none has come for two seconds.
  std::size_t waitUntilAllIsSent() {
    std::size_t count = 0;
    do {
      count = network_.sent().size();
      const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(2.0);
      (void)waitFor([&] {
        network_.deliver();
        return ros::WallTime::now() >= end;
      });
    } while (network_.sent().size() > count || !network_.isEmpty());
    return count;
  }

  /// Publishes one cloud of each robot: rooms that overlap.
  /// @param later_s  Added to the stamps, which are 0.1 s apart.
  void publishClouds(int number, double later_s = 0.0) {
    for (int robot = 1; robot <= num_robots_; ++robot) {
      std::vector<Eigen::Vector3d> points = makeRoom({1.0, 1.0 + 0.1 * (number % 4), 0.5});
      const Eigen::Vector3d sensor(0.45 * robot + 0.1 * number + 0.05, 0.05, 0.05);
      for (Eigen::Vector3d& point : points) point += sensor;
      publishStaticTf(makeTransform("map", nameOf(robot), Eigen::Isometry3d::Identity()));
      clouds_[static_cast<std::size_t>(robot - 1)].publish(
          makeCloud("map", ros::Time(100.0 + later_s + 0.1 * number + 0.01 * robot), points));
    }
    const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(0.1);
    (void)waitFor([&] {
      network_.deliver();
      return ros::WallTime::now() >= end;
    });
  }

  const int num_robots_ = numRobots();
  ros::NodeHandle nh_;
  std::vector<ros::Publisher> clouds_;
  LossyNetwork network_{num_robots_};
  DiagnosticsProbe diagnostics_{kMerger};
  DiagnosticsProbe merging_{kMerger, "merging"};
  std::vector<std::unique_ptr<Program>> robots_;
  std::unique_ptr<Program> merger_with_store_;
};

/// Applies all observations to one map, in the order of their stamps.
void applyAll(const std::vector<Observation>& sent, CuboidMap& map) {
  NodeParameters parameters;
  parameters.map.resolution_m = kResolution_m;
  std::vector<RobotObservation> all;
  for (const Observation& message : sent) {
    auto read = readObservation(message, parameters);
    ASSERT_TRUE(std::holds_alternative<RobotObservation>(read)) << std::get<std::string>(read);
    all.push_back(std::get<RobotObservation>(std::move(read)));
  }
  std::sort(all.begin(), all.end(),
            [](const auto& a, const auto& b) { return a.stamp_ns < b.stamp_ns; });
  for (const RobotObservation& observation : all) {
    map.setSensorModel(observation.sensor_model);
    map.apply(observation.update);
  }
}

TEST_F(MergeMaps, IsTheMapOfAllCloudsInTheOrderOfStampsWhateverTheNetworkDoes) {
  ASSERT_TRUE(waitUntilConnected());
  for (int i = 0; i < kRobotClouds - 2; ++i) publishClouds(i);
  // Observations from before a restart cannot be requested: all must have arrived by then.
  network_.setReliable(true);
  for (int i = kRobotClouds - 2; i < kRobotClouds; ++i) publishClouds(i);
  ASSERT_TRUE(waitForSent(static_cast<std::size_t>(num_robots_ * kRobotClouds)));
  ASSERT_TRUE(waitFor([this] {
    return merging_.status().number("observations received") >= num_robots_ * kRobotClouds;
  })) << merging_.status().number("observations received");
  stop(robots_[2]);
  robots_[2] = start(3);
  ASSERT_TRUE(waitUntilConnected());
  network_.setReliable(false);
  for (int i = kRobotClouds; i < 2 * kRobotClouds; ++i) publishClouds(i);
  const int num_all = 2 * num_robots_ * kRobotClouds;
  ASSERT_TRUE(waitForSent(static_cast<std::size_t>(num_all)));
  EXPECT_GT(network_.numLost(), 3);
  ASSERT_TRUE(waitFor([&] {
    network_.deliver();
    return diagnostics_.status().number("clouds inserted") >= num_all;
  })) << diagnostics_.status().number("clouds inserted");
  ASSERT_TRUE(diagnostics_.waitForNextReport());
  EXPECT_EQ(diagnostics_.status().number("clouds inserted"), num_all) << "each once";

  MapConfig config;
  config.resolution_m = kResolution_m;
  CuboidMap reference(config);
  applyAll(network_.sent(), reference);
  const TemporaryFolder folder;
  SaveMap save;
  save.request.filename = folder / "merged.cuboids";
  ASSERT_TRUE(callService(std::string(kMerger) + "/save_map", save));
  const auto file = cuboid_mapping::readMapFile(save.request.filename);
  EXPECT_GT(voxelsOf(reference).size(), 10000U);
  EXPECT_TRUE(voxelsOf(reference) == voxelsOf(file.snapshot.bricks));
  EXPECT_EQ(merging_.status().number("observations received"), num_all);
  EXPECT_EQ(merging_.status().number("observations missing"), 0);
  EXPECT_EQ(merging_.status().number("observations late"), 0);
  EXPECT_EQ(merging_.status().number("sessions"), num_robots_ + 1);
  EXPECT_GE(merging_.status().number("observations asked for"), kUnheardOfSecond);

  // An unknown session: its first observation is in time, and the second older than all observations in the map.
  Observation late = network_.sent().back();
  late.session = 1;
  late.sequence = 1;
  network_.sendAs(1, late);
  ASSERT_TRUE(
      waitFor([&] { return merging_.status().number("observations received") == num_all + 1; }));
  late.sequence = 2;
  late.header.stamp = ros::Time(50.0);
  network_.sendAs(1, late);
  ASSERT_TRUE(waitFor([this] { return merging_.status().number("observations late") == 1; }));
  EXPECT_TRUE(
      waitFor([&] { return diagnostics_.status().number("clouds inserted") == num_all + 2; }));
  // An observation with another resolution is refused.
  late.sequence = 3;
  late.resolution = 0.2;
  network_.sendAs(1, late);
  EXPECT_TRUE(waitFor([this] { return merging_.status().number("observations refused") == 1; }));
}

/// Whether the file has been saved: it exists a moment before.
bool isStore(const std::string& file) {
  try {
    return std::filesystem::exists(file) &&
           !cuboid_mapping::readMapFile(file).snapshot.bricks.empty();
  } catch (const std::exception&) {
    return false;
  }
}

TEST_F(MergeMaps, GoesOnWithItsStoreAfterKill) {
  const TemporaryFolder folder;
  const std::string store = folder / "merged.sqlite";
  DiagnosticsProbe merging(kMergerWithStore, "merging");
  ASSERT_TRUE(waitUntilConnected());
  if (num_robots_ > 3) GTEST_SKIP() << "is tested with three robots";
  merger_with_store_ = startMerger(store);
  ASSERT_TRUE(waitFor([this] { return network_.numListeners() == 2 * num_robots_; }));
  const auto wait_until_all_is_received = [&] {
    const auto num_sent = static_cast<long>(waitUntilAllIsSent());
    EXPECT_TRUE(waitFor([&] {
      return merging.status().number("observations received") >= num_sent;
    })) << merging.status().number("observations received");
    EXPECT_EQ(merging.status().number("observations received"), num_sent) << "each once";
    return num_sent;
  };
  int number = 0;
  while (number < kRobotClouds) publishClouds(number++);
  wait_until_all_is_received();
  // The stamps are so much later that earlier observations go into the map. The node is killed before all are in the
  // map and saved, so that work is under way.
  do {
    publishClouds(number++, kStoreDelay_s);
  } while (!isStore(store));
  merger_with_store_->send(SIGKILL);
  EXPECT_NE(merger_with_store_->finish().status, 0);
  for (int i = 0; i < kRobotClouds; ++i) publishClouds(number++, kStoreDelay_s);
  merger_with_store_ = startMerger(store);
  const long num_all = wait_until_all_is_received();
  EXPECT_GE(num_all, 2 * num_robots_ * kRobotClouds);
  const std::vector<Observation> in_map = network_.sent();
  publishClouds(number, 3.0 * kStoreDelay_s);
  ASSERT_TRUE(waitFor([&] {
    network_.deliver();
    return merging.status().number("observations received") == num_all + num_robots_ &&
           merging.status().number("observations waiting") == num_robots_;
  })) << merging.status().number("observations waiting");
  EXPECT_EQ(merging.status().number("observations late"), 0);

  MapConfig config;
  config.resolution_m = kResolution_m;
  CuboidMap reference(config);
  applyAll(in_map, reference);
  stop(merger_with_store_);
  const auto file = cuboid_mapping::readMapFile(store);
  EXPECT_TRUE(voxelsOf(reference) == voxelsOf(file.snapshot.bricks));
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
