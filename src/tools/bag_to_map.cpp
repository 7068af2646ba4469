// SPDX-License-Identifier: BSD-3-Clause
// Makes a map of the clouds in rosbags, without a roscore, as fast as the machine.
#include "command_line.h"
#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/cloud_pipeline.h"
#include "cuboid_mapping/ros/speed_advice.h"
#include "map_content.h"
#include "progress_bar.h"
#include "yaml_parameters.h"

#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <chrono>
#include <iomanip>
#include <iostream>
#include <memory>
#include <set>
#include <stdexcept>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::counted;
using cuboid_mapping::CuboidMap;

struct Options {
  std::vector<std::string> bags;
  std::string output;
  std::vector<std::string> topics;
  std::string parameter_file;
  std::vector<std::string> settings;
};

using Bags = std::vector<std::unique_ptr<rosbag::Bag>>;

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

NodeParameters readOptionParameters(const Options& options) {
  const LoadedParameters loaded =
      readParameters(loadYamlParameters(options.parameter_file, options.settings));
  for (const ParameterError& warning : loaded.warnings) {
    std::cerr << "bag_to_map: parameter " << warning.key << ": " << warning.message << std::endl;
  }
  for (const ParameterError& error : loaded.errors) {
    std::cerr << "bag_to_map: parameter " << error.key << ": " << error.message << std::endl;
  }
  if (!loaded.errors.empty()) throw std::runtime_error("bad parameters");
  return loaded.parameters;
}

std::string join(const std::set<std::string>& names) {
  std::string joined;
  for (const std::string& name : names) joined += (joined.empty() ? "" : ", ") + name;
  return joined;
}

/// The topics asked for; all that there are when none is.
std::vector<std::string> chooseTopics(const Bags& bags, const std::vector<std::string>& wanted) {
  std::set<std::string> found;
  for (const auto& bag : bags) {
    rosbag::View view(*bag, rosbag::TypeQuery("sensor_msgs/PointCloud2"));
    for (const rosbag::ConnectionInfo* connection : view.getConnections()) {
      found.insert(connection->topic);
    }
  }
  if (found.empty())
    throw std::runtime_error("the bags contain no clouds (sensor_msgs/PointCloud2)");
  for (const std::string& topic : wanted) {
    if (found.count(topic) == 0) {
      throw std::runtime_error("no clouds on " + topic + ": choose from " + join(found));
    }
  }
  return wanted.empty() ? std::vector<std::string>(found.begin(), found.end()) : wanted;
}

/// All transforms count, also those that were recorded behind a cloud.
void readTransforms(const Bags& bags, tf2::BufferCore& tf) {
  const std::vector<std::string> topics{"/tf", "tf", "/tf_static", "tf_static"};
  for (const auto& bag : bags) {
    rosbag::View view(*bag, rosbag::TopicQuery(topics));
    for (const rosbag::MessageInstance& instance : view) {
      cuboid_mapping::throwIfInterrupted();
      const auto message = instance.instantiate<tf2_msgs::TFMessage>();
      if (!message) continue;
      const bool is_static = instance.getTopic().find("static") != std::string::npos;
      for (geometry_msgs::TransformStamped transform : message->transforms) {
        transform.header.frame_id = withoutSlash(transform.header.frame_id);
        transform.child_frame_id = withoutSlash(transform.child_frame_id);
        tf.setTransform(transform, "bag", is_static);
      }
    }
  }
}

/// Puts clouds into a map, one after the other.
class Mapper {
 public:
  explicit Mapper(const NodeParameters& parameters)
      : parameters_(parameters),
        pipeline_(parameters),
        map_(makeMapConfig(parameters)),
        watch_(parameters.map.resolution_m, parameters.max_range_m) {}

  [[nodiscard]] tf2::BufferCore& tf() { return tf_; }

  void add(const sensor_msgs::PointCloud2& cloud) {
    ++statistics_.num_received;
    watch_.noteReceived(cloud.header.stamp.toSec());
    Stopwatch stopwatch;
    std::string tf_error;
    const auto poses = lookupPoses(tf_, parameters_, cloud.header, tf_error);
    if (!poses) return drop(DropReason::kNoTransform, tf_error);
    std::optional<CloudError> error;
    const auto* update = pipeline_.compute(cloud, *poses, statistics_, error);
    if (update == nullptr) return drop(toDropReason(error->defect), error->text);
    map_.apply(*update);
    ++statistics_.num_inserted;
    watch_.noteInserted(1e-3 * stopwatch.lap(), statistics_.reach_m);
    suggestOnce();
  }

  [[nodiscard]] cuboid_mapping::MapSnapshot finish() {
    return takeSnapshot(map_, withoutSlash(parameters_.frame_id));
  }

  [[nodiscard]] const NodeStatistics& statistics() const { return statistics_; }

  /// A line on stderr for each reason to leave clouds out, and what would keep up with a sensor.
  void report() const {
    for (std::size_t i = 0; i < kNumDropReasons; ++i) {
      if (statistics_.num_dropped[i] == 0) continue;
      std::cerr << "bag_to_map: " << counted(statistics_.num_dropped[i], "cloud") << " dropped, "
                << toString(static_cast<DropReason>(i)) << ": " << first_texts_[i] << std::endl;
    }
    if (const auto advice = watch_.advice()) {
      std::cerr << "bag_to_map: a node could not keep up with these clouds: " << *advice
                << std::endl;
    }
  }

 private:
  /// Of the first clouds, while there is time to start again.
  void suggestOnce() {
    if (statistics_.num_inserted != SpeedWatch::kFirstClouds) return;
    if (const auto suggestion = watch_.suggestion()) {
      std::cerr << "bag_to_map: " << *suggestion << std::endl;
    }
  }

  void drop(DropReason reason, const std::string& text) {
    if (statistics_.numDropped(reason)++ == 0)
      first_texts_[static_cast<std::size_t>(reason)] = text;
  }

  NodeParameters parameters_;
  tf2::BufferCore tf_{ros::Duration(1e6)};  // long enough for any bag
  CloudPipeline pipeline_;
  CuboidMap map_;
  SpeedWatch watch_;
  NodeStatistics statistics_;
  std::array<std::string, kNumDropReasons> first_texts_;
};

void addClouds(const Bags& bags, const std::vector<std::string>& topics, Mapper& mapper) {
  rosbag::View view;
  for (const auto& bag : bags) view.addQuery(*bag, rosbag::TopicQuery(topics));
  cuboid_mapping::ProgressBar progress("clouds", std::max<std::uint32_t>(1, view.size()));
  std::uint64_t num_done = 0;
  for (const rosbag::MessageInstance& instance : view) {
    cuboid_mapping::throwIfInterrupted();
    if (const auto cloud = instance.instantiate<sensor_msgs::PointCloud2>()) mapper.add(*cloud);
    progress.update(++num_done);
  }
}

int makeMap(const Options& options) {
  const auto start = std::chrono::steady_clock::now();
  const auto format = cuboid_mapping::formatOfName(options.output);
  if (!format) {
    throw std::runtime_error(options.output + ": its name must end in one of " +
                             cuboid_mapping::knownEndings());
  }
  cuboid_mapping::checkReplaceable(options.output);
  Mapper mapper(readOptionParameters(options));
  const Bags bags = openBags(options.bags);
  const std::vector<std::string> topics = chooseTopics(bags, options.topics);
  readTransforms(bags, mapper.tf());
  addClouds(bags, topics, mapper);
  mapper.report();
  const NodeStatistics& statistics = mapper.statistics();
  if (statistics.num_inserted == 0) {
    throw std::runtime_error("none of " + counted(statistics.num_received, "cloud") +
                             " could be used: nothing was written");
  }
  const cuboid_mapping::MapSnapshot map = mapper.finish();
  cuboid_mapping::throwIfInterrupted();
  const std::size_t num_bytes = cuboid_mapping::writeMapFile(options.output, map);
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
  std::cout << std::fixed << std::setprecision(1) << options.output << ": "
            << statistics.num_inserted << " of " << counted(statistics.num_received, "cloud")
            << ", " << counted(statistics.num_points, "point") << ", "
            << cuboid_mapping::describeContent(map, *format) << ", " << num_bytes << " bytes, in "
            << time.count() << " s" << std::endl;
  return 0;
}

int run(int argc, char** argv) {
  Options options;
  cuboid_mapping::CommandLine line("bag_to_map",
                                   "Maps the clouds in rosbags, without a roscore. The result is "
                                   "the same as the node's, byte for byte.");
  line.addArgument("bags", options.bags, "rosbags with sensor_msgs/PointCloud2 and tf");
  line.addText("output,o", options.output, "map to write: " + cuboid_mapping::knownEndings());
  line.addTexts("topic", options.topics, "topics of the clouds; without it, all of them");
  line.addText("params", options.parameter_file,
               "YAML file with parameters of the node, such as config/default.yaml");
  line.addTexts(
      "set", options.settings,
      "a parameter as key=value: resolution=0.1, sensor_model/max_range=30; overrides --params");
  if (const auto status = line.parse(argc, argv)) return *status;
  if (options.output.empty()) throw std::runtime_error("--output is missing");
  return makeMap(options);
}

}  // namespace
}  // namespace cuboid_mapping_ros

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("bag_to_map", argc, argv, cuboid_mapping_ros::run);
}
