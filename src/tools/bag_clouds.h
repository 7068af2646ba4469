// SPDX-License-Identifier: BSD-3-Clause
// Common parts of bag_to_map and bag_to_map_mpi: options, and clouds of rosbags or scan folders.
#pragma once

#include "bag_poses.h"
#include "bag_sources.h"
#include "bag_transforms.h"
#include "command_line.h"
#include "cuboid_mapping/map/progress_listener.h"
#include "cuboid_mapping/ros/diagnostics/cloud_ledger.h"
#include "cuboid_mapping/ros/mapping/sensor_input.h"
#include "scan_messages.h"

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Options of the programs.
struct BagOptions {
  std::vector<std::string> inputs;  ///< Rosbags, or only scan folders, see ScanFolders::isOne().
  std::string output;
  std::vector<std::string> topics;      ///< Empty: see chooseSources().
  std::string tf;                       ///< See BagTransforms::read().
  std::string bin_row;                  ///< See parseBinRow(); empty: found from the data.
  std::vector<std::string> transforms;  ///< Static transforms that the bags lack.
  std::string poses;                    ///< See readBagPoses(); empty: poses of tf.
  std::string poses_of;  ///< Frame of the body; empty: that of the topic, or else of the clouds.
  std::string parameter_file;
  std::vector<std::string> settings;
};

/// As CommandLine::parse(). Without --output, the map gets the name of the first input, and lies in the working
/// folder.
[[nodiscard]] std::optional<int> parseBagOptions(cuboid_mapping::CommandLine& line, int argc,
                                                 char** argv, BagOptions& options);

/// The clouds of a process: numbers `first`, `first` + `step`, ..., from `begin` on, a multiple of `step`.
struct CloudShare {
  std::uint64_t first = 0;
  std::uint64_t step = 1;
  std::uint64_t begin = 0;
};

/// Clouds that were left out, and the text of the first one for each reason.
struct LeftOutClouds {
  std::array<std::uint64_t, kNumDropReasons> counts{};
  std::array<std::string, kNumDropReasons> first_texts;
};

/// The clouds of bags (messages of any source), in the order of BagMessages, and their observations; or the
/// clouds of scan folders, as scans_to_bag would write them to a bag, in the map's frame.
/// Errors, warnings and advice go to stderr, after the name of the program.
class BagClouds {
 public:
  /// Stamp of a cloud, number of its source, and places of the sensor and of the robot.
  struct Origin {
    ros::Time stamp;
    std::size_t source = 0;
    Eigen::Vector3d sensor_map = Eigen::Vector3d::Zero();
    Eigen::Vector3d window_center_map = Eigen::Vector3d::Zero();  ///< See CloudPoses.
  };
  /// Gets a cloud's update, null if it is left out, and its source. Valid during the call.
  using Take = std::function<void(const cuboid_mapping::ScanUpdate*, const Origin& origin)>;

  /// Opens the inputs. @throws std::runtime_error for bad parameters, unreadable inputs, missing topics,
  /// and parameters and options that scan folders cannot have.
  BagClouds(std::string program, const BagOptions& options);

  /// Parameters of the options, with topics of the bags as sources. Number of threads: the parameter, unless
  /// set.
  ///@{
  [[nodiscard]] const NodeParameters& parameters() const { return parameters_; }
  void setThreads(int threads);
  ///@}
  [[nodiscard]] std::uint64_t numClouds() const {
    return folders_ ? folders_->size() : messages_->size();
  }
  /// Sensor model of a source.
  [[nodiscard]] cuboid_mapping::SensorModel sensorModel(std::size_t source) const;

  /// Reads the clouds one after the other. To be called once. @param listener  Reports finished
  /// clouds.
  void walk(const CloudShare& share, const Take& take,
            const cuboid_mapping::ProgressListener& listener);

  /// Statistics of the clouds of the share.
  ///@{
  [[nodiscard]] const NodeStatistics& statistics() const { return statistics_; }
  [[nodiscard]] const LeftOutClouds& leftOut() const { return left_out_; }
  [[nodiscard]] std::optional<std::string> advice() const { return watch_->advice(); }
  ///@}

  /// Damage of the bags, to report that of other processes, too. See BagFiles.
  ///@{
  [[nodiscard]] std::string failures() const { return bags_.failures(); }
  void addFailures(const std::string& failures) { bags_.addFailures(failures); }
  ///@}

  /// Writes a line to stderr for each reason why messages, clouds or points were left out.
  void report(const LeftOutClouds& left_out, const PointCounts& points) const;

 private:
  void chooseFrame(const BagTopics& topics);
  void readPoses(const BagTopics& topics, const BagOptions& options, bool has_frame);
  [[nodiscard]] PoseSearch findPosesOf(const SensorMessage& cloud, const Source& source) const;
  void say(const std::vector<std::string>& lines) const;
  [[nodiscard]] std::optional<SensorMessage> read(std::uint64_t number);
  void walkOne(const SensorMessage& cloud, const Take& take);
  [[nodiscard]] const cuboid_mapping::ScanUpdate* compute(const SensorMessage& cloud,
                                                          Origin& origin);
  void suggestOnce();
  void leaveOut(DropReason reason, const std::string& text);

  std::string program_;
  std::optional<ScanFolders> folders_;  ///< Set if the inputs are folders.
  BagFiles bags_;
  BagTransforms transforms_;
  std::optional<BagPoses> poses_;  ///< Replaces the poses of tf.
  NodeParameters parameters_;
  std::optional<BagMessages> messages_;  ///< Set if the inputs are bags.
  ros::Time recorded_;                   ///< Time at which the current message was recorded.
  bool has_named_stamps_ = false;        ///< Clouds without a stamp were named.
  std::vector<std::unique_ptr<Source>> sources_;
  std::optional<SpeedWatch> watch_;
  NodeStatistics statistics_;
  LeftOutClouds left_out_;
};

}  // namespace cuboid_mapping_ros
