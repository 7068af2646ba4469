// SPDX-License-Identifier: BSD-3-Clause
// What bag_to_map and bag_to_map_mpi have in common: options, and clouds of rosbags.
#pragma once

#include "command_line.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/io/progress_listener.h"
#include "cuboid_mapping/ros/cloud_pipeline.h"
#include "cuboid_mapping/ros/speed_advice.h"

#include <rosbag/bag.h>

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// What the programs are told.
struct BagOptions {
  std::vector<std::string> bags;
  std::string output;
  std::vector<std::string> topics;  ///< Empty: all.
  std::string parameter_file;
  std::vector<std::string> settings;
};

/// As CommandLine::parse(). @throws std::runtime_error without --output.
[[nodiscard]] std::optional<int> parseBagOptions(cuboid_mapping::CommandLine& line, int argc,
                                                 char** argv, BagOptions& options);

/// The format of the output. @throws std::runtime_error when it cannot be written.
[[nodiscard]] cuboid_mapping::MapFormat checkOutput(const BagOptions& options);

/// Which clouds are walked: number `first`, `first` + `step`, ...
struct CloudShare {
  std::uint64_t first = 0;
  std::uint64_t step = 1;
};

/// Clouds that were left out, and the text of the first one for each reason.
struct LeftOutClouds {
  std::array<std::uint64_t, kNumDropReasons> counts{};
  std::array<std::string, kNumDropReasons> first_texts;
};

/// The clouds of some bags in the order of their stamps, and what they say about the map. Errors,
/// warnings and advice go to stderr, behind the name of the program.
class BagClouds {
 public:
  /// What a cloud says; null when it is left out. Valid during the call.
  using Take = std::function<void(const cuboid_mapping::ScanUpdate*)>;

  /// Opens the bags. @throws std::runtime_error for bad parameters, a bag that cannot be read, topics
  /// that are not there.
  BagClouds(std::string program, const BagOptions& options);

  /// As the options have them. Number of threads: of the parameter, unless set.
  ///@{
  [[nodiscard]] const NodeParameters& parameters() const { return parameters_; }
  void setThreads(int threads) { parameters_.threads = threads; }
  ///@}
  [[nodiscard]] std::uint64_t numClouds() const { return num_clouds_; }

  /// Reads all transforms, then the clouds one after the other. @param listener  Is told how many of all
  /// clouds are done.
  void walk(const CloudShare& share, const Take& take,
            const cuboid_mapping::ProgressListener& listener);

  /// Of the clouds of the share.
  ///@{
  [[nodiscard]] const NodeStatistics& statistics() const { return statistics_; }
  [[nodiscard]] const LeftOutClouds& leftOut() const { return left_out_; }
  [[nodiscard]] std::optional<std::string> advice() const { return watch_->advice(); }
  ///@}

  /// A line on stderr for each reason to leave clouds out.
  void report(const LeftOutClouds& left_out) const;

 private:
  void readTransforms();
  void walkOne(const sensor_msgs::PointCloud2& cloud, const Take& take);
  [[nodiscard]] const cuboid_mapping::ScanUpdate* compute(const sensor_msgs::PointCloud2& cloud);
  void suggestOnce();
  void leaveOut(DropReason reason, const std::string& text);

  std::string program_;
  NodeParameters parameters_;
  std::vector<std::unique_ptr<rosbag::Bag>> bags_;
  std::vector<std::string> topics_;
  std::uint64_t num_clouds_ = 0;
  tf2::BufferCore tf_{ros::Duration(1e6)};  // long enough for any bag
  std::optional<CloudPipeline> pipeline_;
  std::optional<SpeedWatch> watch_;
  NodeStatistics statistics_;
  LeftOutClouds left_out_;
};

}  // namespace cuboid_mapping_ros
