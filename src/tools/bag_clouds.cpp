// SPDX-License-Identifier: BSD-3-Clause
#include "bag_clouds.h"

#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/clouds/self_filter.h"
#include "cuboid_mapping/ros/conversions/point_cloud.h"
#include "stamps.h"
#include "transform_message.h"
#include "yaml_parameters.h"

#include <rosbag/view.h>
#include <tf2_msgs/TFMessage.h>
#include <boost/make_shared.hpp>

#include <algorithm>
#include <iostream>
#include <stdexcept>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

/// Nothing when there are bags.
std::optional<ScanFolders> openFolders(const std::vector<std::string>& paths) {
  const auto count = std::count_if(paths.begin(), paths.end(), ScanFolders::isOne);
  if (count == 0) return std::nullopt;
  if (static_cast<std::size_t>(count) < paths.size()) {
    throw std::runtime_error("rosbags and scan folders do not go together: map one kind of them");
  }
  return ScanFolders(paths);
}

Bags openBags(const std::vector<std::string>& files) {
  Bags bags;
  for (const std::string& file : files) {
    try {
      bags.push_back(std::make_unique<rosbag::Bag>(file));
    } catch (const rosbag::BagException& error) {
      throw std::runtime_error("cannot read " + file + " as a rosbag: " + error.what());
    }
  }
  return bags;
}

NodeParameters readOptionParameters(const std::string& program, const BagOptions& options) {
  const LoadedParameters loaded =
      readParameters(loadYamlParameters(options.parameter_file, options.settings));
  for (const ParameterError& warning : loaded.warnings) {
    std::cerr << program << ": parameter " << warning.key << ": " << warning.message << std::endl;
  }
  for (const ParameterError& error : loaded.errors) {
    std::cerr << program << ": parameter " << error.key << ": " << error.message << std::endl;
  }
  if (!loaded.errors.empty()) throw std::runtime_error("bad parameters");
  return loaded.parameters;
}

/// @throws std::runtime_error  for what only bags have.
NodeParameters checkForFolders(const NodeParameters& parameters, const BagOptions& options) {
  if (!options.topics.empty()) throw std::runtime_error("--topic does not go with scan folders");
  if (!parameters.sources.empty() || parameters.source.type != SourceType::kPointCloud) {
    throw std::runtime_error("scan folders are one source of clouds: set no sources and no type");
  }
  if (parameters.source.max_rate_hz > 0.0) {
    throw std::runtime_error("scan folders have no stamps: set max_rate to 0");
  }
  if (withoutSlash(parameters.frame_id) == ScanNames().sensor_frame) {
    throw std::runtime_error("frame_id: this is the frame of the clouds of scan folders");
  }
  return parameters;
}

/// The parameters, with topics of the bags.
NodeParameters readAll(const std::string& program, const BagOptions& options, bool are_folders,
                       const Bags& bags) {
  std::vector<std::string> missing;
  const NodeParameters read = readOptionParameters(program, options);
  NodeParameters parameters = are_folders ? checkForFolders(read, options)
                                          : chooseSources(bags, read, options.topics, missing);
  for (const std::string& topic : missing) {
    std::cerr << program << ": the bags have no topic " << topic << std::endl;
  }
  loadRobotParts(parameters, [](const std::string& /*name*/) -> std::optional<std::string> {
    throw std::runtime_error(
        "self_filter/robot_description: there is no parameter server here; name a file in "
        "self_filter/urdf_file");
  });
  return parameters;
}

}  // namespace

std::optional<int> parseBagOptions(cuboid_mapping::CommandLine& line, int argc, char** argv,
                                   BagOptions& options) {
  line.addArgument("inputs", options.inputs,
                   "rosbags with sensor_msgs/PointCloud2 and tf, or folders with poses.txt and "
                   "scans/NNNN.pcd, or OctoMap .graph files");
  line.addText("output,o", options.output, "map to write: " + cuboid_mapping::knownEndings());
  line.addTexts("topic", options.topics, "topics of the clouds; without it, all of them");
  line.addText("params", options.parameter_file,
               "YAML file with parameters of the node, such as config/default.yaml");
  line.addTexts(
      "set", options.settings,
      "a parameter as key=value: resolution=0.1, sensor_model/max_range=30; overrides --params");
  if (const auto status = line.parse(argc, argv)) return status;
  if (options.output.empty()) throw std::runtime_error("--output is missing");
  return std::nullopt;
}

cuboid_mapping::MapFormat checkOutput(const BagOptions& options) {
  const auto format = cuboid_mapping::formatOfName(options.output);
  if (!format) {
    throw std::runtime_error(options.output + ": its name must end in one of " +
                             cuboid_mapping::knownEndings());
  }
  cuboid_mapping::checkReplaceable(options.output);
  return *format;
}

BagClouds::BagClouds(std::string program, const BagOptions& options)
    : program_(std::move(program)),
      folders_(openFolders(options.inputs)),
      bags_(folders_ ? Bags() : openBags(options.inputs)),
      parameters_(readAll(program_, options, folders_.has_value(), bags_)),
      messages_(bags_, parameters_) {
  if (messages_.numWithoutCamera() == 0) return;
  std::cerr << program_ << ": "
            << cuboid_mapping::counted(messages_.numWithoutCamera(), "depth image")
            << " left out, which have no camera_info of the same stamp" << std::endl;
}

void BagClouds::setThreads(int threads) {
  parameters_.threads = threads;
  for (NodeParameters& source : parameters_.sources) source.threads = threads;
}

cuboid_mapping::SensorModel BagClouds::sensorModel(std::size_t source) const {
  const cuboid_mapping::MapConfig map = sourcesOf(parameters_).at(source).map;
  return cuboid_mapping::SensorModel(map.sensor_model, map.environment);
}

/// All transforms count, also those that were recorded behind a cloud.
void BagClouds::readTransforms() {
  const std::vector<std::string> topics{"/tf", "tf", "/tf_static", "tf_static"};
  for (const auto& bag : bags_) {
    rosbag::View view(*bag, rosbag::TopicQuery(topics));
    for (const rosbag::MessageInstance& instance : view) {
      cuboid_mapping::throwIfInterrupted();
      const auto message = instance.instantiate<tf2_msgs::TFMessage>();
      if (!message) continue;
      const bool is_static = instance.getTopic().find("static") != std::string::npos;
      for (geometry_msgs::TransformStamped transform : message->transforms) {
        transform.header.frame_id = withoutSlash(transform.header.frame_id);
        transform.child_frame_id = withoutSlash(transform.child_frame_id);
        tf_.setTransform(transform, "bag", is_static);
      }
    }
  }
}

void BagClouds::walk(const CloudShare& share, const Take& take,
                     const cuboid_mapping::ProgressListener& listener) {
  sources_ = makeSources(parameters_);
  watch_.emplace(parameters_.map.resolution_m, parameters_.max_range_m);
  readTransforms();
  for (std::uint64_t number = share.begin; number < numClouds(); ++number) {
    cuboid_mapping::throwIfInterrupted();
    if (number % share.step == share.first) {
      if (const auto cloud = read(number)) {
        walkOne(*cloud, take);
      } else {
        take(nullptr, {});
      }
    }
    if (listener) listener(number + 1, numClouds());
  }
}

/// A scan brings its transform along.
std::optional<SensorMessage> BagClouds::read(std::uint64_t number) {
  if (!folders_) return messages_.read(number);
  const cuboid_mapping::ScanDataset::Item scan = folders_->read(number);
  const ros::Time stamp = computeStamp(kFirstStamp, number, kScanRate_hz);
  const ScanNames names;
  tf_.setTransform(toTransformMessage(scan.T_map_sensor, stamp, withoutSlash(parameters_.frame_id),
                                      names.sensor_frame),
                   "scans");
  return SensorMessage{boost::make_shared<sensor_msgs::PointCloud2>(
      toCloud(scan.points_sensor, makeHeader(names.sensor_frame, stamp)))};
}

void BagClouds::walkOne(const SensorMessage& cloud, const Take& take) {
  ++statistics_.num_received;
  watch_->noteReceived(cloud.header().stamp.toSec());
  Stopwatch stopwatch;
  Origin origin{cloud.header().stamp, cloud.source};
  const cuboid_mapping::ScanUpdate* update = compute(cloud, origin);
  if (update != nullptr) ++statistics_.num_inserted;
  take(update, origin);
  if (update == nullptr) return;
  watch_->noteInserted(1e-3 * stopwatch.lap(), statistics_.reach_m);
  suggestOnce();
}

const cuboid_mapping::ScanUpdate* BagClouds::compute(const SensorMessage& cloud, Origin& origin) {
  Source& source = *sources_.at(cloud.source);
  std::string tf_error;
  const auto poses = lookupPoses(tf_, source.parameters, cloud, tf_error);
  if (!poses) {
    leaveOut(DropReason::kNoTransform, tf_error);
    return nullptr;
  }
  origin.window_center_map = poses->window_center_map;
  std::optional<CloudError> error;
  const auto* update = source.pipeline.compute(cloud, *poses, statistics_, error);
  if (update == nullptr) leaveOut(toDropReason(error->defect), error->text);
  return update;
}

/// Of the first clouds, while there is time to start again.
void BagClouds::suggestOnce() {
  if (statistics_.num_inserted != SpeedWatch::kFirstClouds) return;
  if (const auto suggestion = watch_->suggestion()) {
    std::cerr << program_ << ": " << *suggestion << std::endl;
  }
}

void BagClouds::leaveOut(DropReason reason, const std::string& text) {
  const auto i = static_cast<std::size_t>(reason);
  if (left_out_.counts[i]++ == 0) left_out_.first_texts[i] = text;
}

void BagClouds::report(const LeftOutClouds& left_out) const {
  for (std::size_t i = 0; i < kNumDropReasons; ++i) {
    if (left_out.counts[i] == 0) continue;
    std::cerr << program_ << ": " << cuboid_mapping::counted(left_out.counts[i], "cloud")
              << " dropped, " << toString(static_cast<DropReason>(i)) << ": "
              << left_out.first_texts[i] << std::endl;
  }
}

}  // namespace cuboid_mapping_ros
