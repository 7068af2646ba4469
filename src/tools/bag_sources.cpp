// SPDX-License-Identifier: BSD-3-Clause
#include "bag_sources.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/clouds/source.h"
#include "cuboid_mapping/ros/clouds/source_subscriber.h"

#include <ros/serialization.h>
#include <rosbag/view.h>

#include <algorithm>
#include <map>
#include <set>
#include <stdexcept>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

const char* datatypeOf(SourceType type) {
  switch (type) {
    case SourceType::kPointCloud: return "sensor_msgs/PointCloud2";
    case SourceType::kLaserScan: return "sensor_msgs/LaserScan";
    case SourceType::kDepthImage: break;
  }
  return "sensor_msgs/Image";
}

/// As recorders write it.
std::string withSlash(const std::string& topic) {
  return topic.empty() || topic.front() != '/' ? '/' + topic : topic;
}

/// Topics of the bags, with the type of their messages.
std::map<std::string, std::string> findTopics(const Bags& bags) {
  std::map<std::string, std::string> topics;
  for (const auto& bag : bags) {
    rosbag::View view(*bag);
    for (const rosbag::ConnectionInfo* connection : view.getConnections()) {
      topics[withSlash(connection->topic)] = connection->datatype;
    }
  }
  return topics;
}

NodeParameters withTopics(const NodeParameters& parameters,
                          const std::vector<std::string>& topics) {
  NodeParameters chosen = parameters;
  chosen.source.topic = topics.front();
  if (topics.size() == 1) return chosen;
  for (const std::string& topic : topics) {
    chosen.sources.push_back(parameters);
    chosen.sources.back().source.topic = topic;
  }
  return chosen;
}

/// Without a list of sources.
NodeParameters chooseTopics(const Bags& bags, const NodeParameters& parameters,
                            const std::vector<std::string>& wanted) {
  const std::string datatype = datatypeOf(parameters.source.type);
  std::set<std::string> found;
  for (const auto& [topic, type] : findTopics(bags)) {
    if (type == datatype) found.insert(topic);
  }
  const bool are_clouds = parameters.source.type == SourceType::kPointCloud;
  if (found.empty()) {
    throw std::runtime_error("the bags contain no " + std::string(are_clouds ? "clouds (" : "(") +
                             datatype + ')');
  }
  std::vector<std::string> topics;
  for (const std::string& topic : wanted) {
    topics.push_back(withSlash(topic));
    if (found.count(topics.back()) == 0) {
      throw std::runtime_error("no " + (are_clouds ? "clouds" : datatype) + " on " + topic +
                               ": choose from " + cuboid_mapping::join(found, ", "));
    }
  }
  if (topics.empty()) topics.assign(found.begin(), found.end());
  return withTopics(parameters, topics);
}

/// @throws std::runtime_error with all that is of another type.
void checkSources(const Bags& bags, const NodeParameters& parameters,
                  std::vector<std::string>& missing) {
  const std::map<std::string, std::string> topics = findTopics(bags);
  std::string errors;
  for (const NodeParameters& source : parameters.sources) {
    const std::string topic = withSlash(source.source.topic);
    const auto found = topics.find(topic);
    if (found == topics.end()) {
      missing.push_back(topic);
    } else if (found->second != datatypeOf(source.source.type)) {
      errors += (errors.empty() ? "" : "; ") + topic + " of source " + nameOf(source) + " is " +
                found->second + ", not " + datatypeOf(source.source.type);
    }
  }
  if (!errors.empty()) throw std::runtime_error(errors);
  if (missing.size() == parameters.sources.size()) {
    throw std::runtime_error("the bags have none of the topics of the sources: " +
                             cuboid_mapping::join(missing, ", "));
  }
}

/// All types of sources begin with a header.
ros::Time stampOf(const rosbag::MessageInstance& message) {
  std::vector<std::uint8_t> bytes(message.size());
  ros::serialization::OStream out(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  message.write(out);
  ros::serialization::IStream in(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  std_msgs::Header header;
  ros::serialization::deserialize(in, header);
  return header.stamp;
}

}  // namespace

NodeParameters chooseSources(const Bags& bags, const NodeParameters& parameters,
                             const std::vector<std::string>& wanted,
                             std::vector<std::string>& missing) {
  if (parameters.sources.empty()) return chooseTopics(bags, parameters, wanted);
  if (!wanted.empty()) throw std::runtime_error("--topic does not go with a list of sources");
  checkSources(bags, parameters, missing);
  return parameters;
}

BagMessages::BagMessages(const Bags& bags, const NodeParameters& parameters)
    : sources_(sourcesOf(parameters)) {
  for (std::size_t source = 0; source < sources_.size(); ++source) add(bags, source);
  if (sources_.size() == 1) return;
  std::stable_sort(messages_.begin(), messages_.end(), [](const Message& a, const Message& b) {
    return std::make_pair(a.stamp, a.source) < std::make_pair(b.stamp, b.source);
  });
}

/// @return The instances, as they were recorded.
BagMessages::Range BagMessages::collect(const Bags& bags, const std::string& topic) {
  const std::string name = withSlash(topic);
  const std::vector<std::string> names{name, name.substr(1)};
  rosbag::View view;
  for (const auto& bag : bags) view.addQuery(*bag, rosbag::TopicQuery(names));
  const std::size_t first = instances_.size();
  for (const rosbag::MessageInstance& instance : view) instances_.push_back(instance);
  return {first, instances_.size()};
}

void BagMessages::add(const Bags& bags, std::size_t source) {
  const SourceParameters& parameters = sources_[source].source;
  const bool is_depth = parameters.type == SourceType::kDepthImage;
  const bool has_info = !parameters.camera_info.empty();
  const Range range = collect(bags, parameters.topic);
  Range cameras{};
  if (is_depth) {
    cameras = collect(
        bags, has_info ? parameters.camera_info : cameraInfoBeside(withSlash(parameters.topic)));
  }
  std::map<ros::Time, std::size_t> camera_at;
  for (std::size_t i = cameras.first; i < cameras.second; ++i) {
    camera_at.emplace(stampOf(instances_[i]), i);
  }
  const bool needs_stamp = is_depth || sources_.size() > 1 || parameters.max_rate_hz > 0.0;
  RateLimit rate_limit(parameters.max_rate_hz);
  for (std::size_t i = range.first; i < range.second; ++i) {
    const ros::Time stamp = needs_stamp ? stampOf(instances_[i]) : ros::Time();
    const auto camera = camera_at.find(stamp);
    if (is_depth && camera == camera_at.end()) {
      ++num_without_camera_;
    } else if (rate_limit.lets(stamp)) {
      messages_.push_back({source, i, is_depth ? camera->second : 0, stamp});
    }
  }
}

std::optional<SensorMessage> BagMessages::read(std::size_t number) const {
  const Message& message = messages_.at(number);
  const rosbag::MessageInstance& instance = instances_[message.instance];
  switch (sources_[message.source].source.type) {
    case SourceType::kPointCloud:
      if (const auto cloud = instance.instantiate<sensor_msgs::PointCloud2>()) {
        return SensorMessage{cloud, message.source};
      }
      return std::nullopt;
    case SourceType::kLaserScan:
      if (const auto scan = instance.instantiate<sensor_msgs::LaserScan>()) {
        return SensorMessage{scan, message.source};
      }
      return std::nullopt;
    case SourceType::kDepthImage: break;
  }
  const auto image = instance.instantiate<sensor_msgs::Image>();
  const auto camera = instances_[message.camera].instantiate<sensor_msgs::CameraInfo>();
  if (!image || !camera) return std::nullopt;
  return SensorMessage{DepthImage{image, camera}, message.source};
}

}  // namespace cuboid_mapping_ros
