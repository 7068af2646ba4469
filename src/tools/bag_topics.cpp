// SPDX-License-Identifier: BSD-3-Clause
#include "bag_topics.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/conversions/compressed_depth.h"
#include "cuboid_mapping/ros/mapping/source_subscriber.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"

#include <rosbag/view.h>
#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/LaserScan.h>
#include <sensor_msgs/PointCloud2.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::counted;
using cuboid_mapping::join;

std::string describeTopic(const std::string& name, const BagTopic& topic) {
  return name + " (" + topic.datatype + ", " + counted(topic.num_messages, "message") +
         (topic.frame_id.empty() ? "" : ", frame '" + topic.frame_id + "'") + ')';
}

/// Describes all topics, with advice for those of sensors.
std::string describeAll(const BagTopics& topics) {
  std::vector<std::string> texts;
  for (const auto& [name, topic] : topics.all()) {
    const std::string advice = adviseOn(topic.datatype);
    texts.push_back(name + " (" + topic.datatype + (advice.empty() ? "" : ": " + advice) + ')');
  }
  return texts.empty() ? "nothing" : join(texts, ", ");
}

bool isDepth(const std::string& topic, const std::string& encoding) {
  const bool is_named_so = topic.find("depth") != std::string::npos;
  return encoding == "16UC1" || encoding == "32FC1" ||
         (is_named_so && (encoding == "mono16" || encoding == "16SC1"));
}

/// Reads the first readable message, and its data about the topic.
template <typename MessageT>
boost::shared_ptr<MessageT> readFirst(BagFiles& bags, const std::string& name, BagTopic& topic) {
  for (const BagMessage& message : bags.collect({name, name.substr(1)})) {
    if (auto first = bags.read<MessageT>(message)) {
      topic.frame_id = withoutSlash(first->header.frame_id);
      return first;
    }
  }
  return nullptr;
}

NodeParameters withTopics(const NodeParameters& parameters, const BagTopics& topics,
                          const std::vector<std::string>& names) {
  const auto set = [&topics](const std::string& name, SourceParameters& source) {
    source.topic = name;
    source.type = topics.find(name)->type.value_or(source.type);
  };
  NodeParameters chosen = parameters;
  set(names.front(), chosen.source);
  if (names.size() == 1) return chosen;
  for (const std::string& name : names) {
    chosen.sources.push_back(parameters.source);
    set(name, chosen.sources.back());
  }
  return chosen;
}

/// @throws std::runtime_error for missing topics, or topics that cannot be mapped.
std::vector<std::string> checkWanted(const BagTopics& topics, const NodeParameters& parameters,
                                     bool is_type_set, const std::vector<std::string>& wanted) {
  std::vector<std::string> names;
  for (const std::string& name : wanted) {
    const BagTopic* topic = topics.find(name);
    if (topic == nullptr) {
      throw std::runtime_error("the bags have no topic " + name +
                               ". They have: " + describeAll(topics));
    }
    if (!topic->type) {
      const std::string advice = adviseOn(topic->datatype);
      throw std::runtime_error(describeTopic(name, *topic) + " cannot be mapped" +
                               (advice.empty() ? "" : ": " + advice) +
                               ". Clouds, planar scans and depth images can");
    }
    if (is_type_set && topic->type != parameters.source.type) {
      throw std::runtime_error(describeTopic(name, *topic) + " is not of type " +
                               toString(parameters.source.type) + ": set type to " +
                               toString(*topic->type) + ", or leave it out");
    }
    const bool is_new = std::find(names.begin(), names.end(), withSlash(name)) == names.end();
    if (is_new) names.push_back(withSlash(name));
  }
  return names;
}

/// Whether an image was also recorded in a better transport: uncompressed, or else "compressedDepth".
bool isSecondTransport(const BagTopics& topics, const std::string& name) {
  const std::string image = withoutTransport(name);
  if (image == name) return false;
  const std::string depth = image + "/compressedDepth";
  return topics.find(image) != nullptr || (name != depth && topics.find(depth) != nullptr);
}

/// Topics of a type, with recorded maps apart.
struct Candidates {
  std::vector<std::string> sensors;
  std::vector<std::string> maps;
};

Candidates findCandidates(const BagTopics& topics, const NodeParameters& parameters,
                          SourceType type) {
  const bool has_sensor_frame = !parameters.source.sensor_frame.empty();
  Candidates candidates;
  for (const auto& [name, topic] : topics.all()) {
    if (topic.type != type || topic.num_messages == 0) continue;
    const bool has_camera =
        !parameters.source.camera_info.empty() || topics.find(cameraInfoBeside(name)) != nullptr;
    if (type == SourceType::kDepthImage && (!has_camera || isSecondTransport(topics, name))) {
      continue;
    }
    const bool is_map = type == SourceType::kPointCloud && !has_sensor_frame &&
                        topic.frame_id == withoutSlash(parameters.frame_id);
    (is_map ? candidates.maps : candidates.sensors).push_back(name);
  }
  return candidates;
}

std::vector<std::string> findTopics(const BagTopics& topics, const NodeParameters& parameters,
                                    bool is_type_set) {
  std::vector<SourceType> types{SourceType::kPointCloud, SourceType::kLaserScan,
                                SourceType::kDepthImage};
  if (is_type_set) types = {parameters.source.type};
  std::vector<std::string> maps;
  for (const SourceType type : types) {
    const Candidates candidates = findCandidates(topics, parameters, type);
    if (!candidates.sensors.empty()) return candidates.sensors;
    if (maps.empty()) maps = candidates.maps;
  }
  return maps;
}

[[noreturn]] void refuseAll(const BagTopics& topics, const NodeParameters& parameters,
                            bool is_type_set) {
  std::string others;
  for (const auto& [name, topic] : topics.all()) {
    if (!topic.type) continue;
    others += (others.empty() ? "" : ", or ") + std::string("--topic ") + name +
              " --set type=" + toString(*topic.type);
    if (topic.type == SourceType::kDepthImage && topics.find(cameraInfoBeside(name)) == nullptr) {
      others += " camera_info=TOPIC, since there is no " + cameraInfoBeside(name);
    }
  }
  const std::string what =
      is_type_set ? std::string("no ") + datatypeOf(parameters.source.type, "") + " (type " +
                        toString(parameters.source.type) + ')'
                  : "no clouds (sensor_msgs/PointCloud2), planar scans (sensor_msgs/LaserScan) or "
                    "depth images with camera_info";
  throw std::runtime_error(
      "the bags contain " + what + ". " +
      (others.empty() ? "They have: " + describeAll(topics) : "Try " + others));
}

/// Notes on the topics that are used, and on the others.
std::vector<std::string> makeNotes(const BagTopics& topics, const NodeParameters& parameters,
                                   const std::vector<std::string>& names) {
  std::vector<std::string> notes;
  notes.reserve(names.size());
  for (const std::string& name : names) {
    notes.push_back("takes " + describeTopic(name, *topics.find(name)));
  }
  for (const auto& [name, topic] : topics.all()) {
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    const std::string advice = adviseOn(topic.datatype);
    if (topic.type) {
      const bool is_map = topic.type == SourceType::kPointCloud &&
                          topic.frame_id == withoutSlash(parameters.frame_id);
      notes.push_back((is_map ? "warning: leaves " : "leaves ") + describeTopic(name, topic) +
                      (is_map ? ", which is in the frame of the map, as a recorded map is" : "") +
                      "; --topic " + name + " takes it");
    } else if (!advice.empty()) {
      notes.push_back("leaves " + describeTopic(name, topic) + ": " + advice);
    }
  }
  return notes;
}

/// Checks a list of sources. @throws std::runtime_error naming all topics of another type.
ChosenSources checkSources(const BagTopics& topics, const NodeParameters& parameters) {
  ChosenSources chosen{parameters, {}};
  std::vector<std::string> errors;
  std::vector<std::string> missing;
  for (const SourceParameters& source : parameters.sources) {
    const std::string name = withSlash(source.topic);
    const BagTopic* topic = topics.find(name);
    if (topic == nullptr) {
      missing.push_back(name);
    } else if (const std::string wrong = describeWrongType(source, name, topic->datatype);
               !wrong.empty()) {
      errors.push_back("source " + nameOf(source) + ": " + wrong);
    } else {
      chosen.notes.push_back("takes " + describeTopic(name, *topic));
    }
  }
  if (!errors.empty()) throw std::runtime_error(join(errors, "; "));
  if (missing.size() == parameters.sources.size()) {
    throw std::runtime_error("the bags have none of the topics of the sources: " +
                             join(missing, ", ") + ". They have: " + describeAll(topics));
  }
  for (const std::string& name : missing) chosen.notes.push_back("the bags have no topic " + name);
  return chosen;
}

}  // namespace

BagTopics::BagTopics(BagFiles& bags) {
  std::map<std::pair<std::string, std::string>, std::size_t> counts;
  for (std::size_t number = 0; number < bags.size(); ++number) {
    rosbag::View view(bags[number]);
    for (const rosbag::ConnectionInfo* connection : view.getConnections()) {
      const auto is_it = [id = connection->id](const auto* other) { return other->id == id; };
      counts[{withSlash(connection->topic), connection->datatype}] +=
          rosbag::View(bags[number], is_it).size();
    }
  }
  // Of two types under one name, that of more messages counts.
  for (const auto& [key, count] : counts) {
    BagTopic& topic = topics_[key.first];
    if (!topic.datatype.empty() && count < topic.num_messages) continue;
    topic.datatype = key.second;
    topic.num_messages = count;
  }
  for (auto& [name, topic] : topics_) look(bags, name, topic);
}

void BagTopics::look(BagFiles& bags, const std::string& name, BagTopic& topic) const {
  using ros::message_traits::datatype;
  if (topic.datatype == datatype<sensor_msgs::PointCloud2>()) {
    topic.type = SourceType::kPointCloud;
    (void)readFirst<sensor_msgs::PointCloud2>(bags, name, topic);
  } else if (topic.datatype == datatype<sensor_msgs::LaserScan>()) {
    topic.type = SourceType::kLaserScan;
    (void)readFirst<sensor_msgs::LaserScan>(bags, name, topic);
  } else if (topic.datatype == datatype<sensor_msgs::Image>()) {
    topic.is_image = true;
    const auto image = readFirst<sensor_msgs::Image>(bags, name, topic);
    if (image && isDepth(name, image->encoding)) topic.type = SourceType::kDepthImage;
  } else if (topic.datatype == datatype<sensor_msgs::CompressedImage>() && isCompressed(name)) {
    topic.is_image = true;
    const auto image = readFirst<sensor_msgs::CompressedImage>(bags, name, topic);
    const std::string format = image ? image->format : ";";
    const std::size_t end = format.find(';');
    // A format such as "png" alone may be of depths, if the topic is called so.
    const std::string encoding = end == std::string::npos ? "mono16" : format.substr(0, end);
    if (isDepth(name, encoding)) topic.type = SourceType::kDepthImage;
  }
}

const BagTopic* BagTopics::find(const std::string& topic) const {
  const auto found = topics_.find(withSlash(topic));
  return found == topics_.end() ? nullptr : &found->second;
}

BagTopics BagTopics::withDepth(const std::vector<std::string>& wanted) const {
  const bool has_depth = std::any_of(topics_.begin(), topics_.end(), [](const auto& item) {
    return item.second.type == SourceType::kDepthImage;
  });
  BagTopics topics = *this;
  for (auto& [name, topic] : topics.topics_) {
    const bool is_wanted =
        std::any_of(wanted.begin(), wanted.end(),
                    [&name = name](const std::string& given) { return withSlash(given) == name; });
    if (topic.is_image && (is_wanted || !has_depth)) topic.type = SourceType::kDepthImage;
  }
  return topics;
}

ChosenSources chooseSources(const BagTopics& all, const NodeParameters& parameters,
                            bool is_type_set, const std::vector<std::string>& wanted) {
  const bool wants_depth = is_type_set && parameters.source.type == SourceType::kDepthImage;
  const BagTopics topics = wants_depth ? all.withDepth(wanted) : all;
  if (!parameters.sources.empty()) {
    if (!wanted.empty()) throw std::runtime_error("--topic does not go with a list of sources");
    return checkSources(topics, parameters);
  }
  const std::vector<std::string> names = wanted.empty()
                                             ? findTopics(topics, parameters, is_type_set)
                                             : checkWanted(topics, parameters, is_type_set, wanted);
  if (names.empty()) refuseAll(topics, parameters, is_type_set);
  return {withTopics(parameters, topics, names), makeNotes(topics, parameters, names)};
}

}  // namespace cuboid_mapping_ros
