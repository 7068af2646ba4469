// SPDX-License-Identifier: BSD-3-Clause
#include "bag_transforms.h"

#include "command_line.h"
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/middleware/static_publishers.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "cuboid_mapping/ros/middleware/to_and_fro.h"

#include <console_bridge/console.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_msgs/TFMessage.h>
#include <boost/algorithm/string/predicate.hpp>
#include <boost/lexical_cast/try_lexical_convert.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <stdexcept>

namespace cuboid_mapping_ros {
namespace {

constexpr char kStaticEnding[] = "_static";

bool isStatic(const std::string& topic) {
  return boost::algorithm::ends_with(topic, kStaticEnding);
}

/// The name without _static.
std::string mainTopic(const std::string& topic) {
  return isStatic(topic) ? topic.substr(0, topic.size() - (sizeof(kStaticEnding) - 1)) : topic;
}

/// Parses "parent child x y z yaw pitch roll", or "... x y z qx qy qz qw", in metres and radians, the arguments
/// of static_transform_publisher; nothing for another text.
std::optional<geometry_msgs::TransformStamped> parseTransform(const std::string& text) {
  const std::vector<std::string> words = wordsOf(text);
  if (words.size() != 8 && words.size() != 9) return std::nullopt;
  std::vector<double> numbers(words.size() - 2);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (!boost::conversion::try_lexical_convert(words[i + 2], numbers[i]) ||
        !std::isfinite(numbers[i])) {
      return std::nullopt;
    }
  }
  Eigen::Quaterniond rotation = Eigen::AngleAxisd(numbers[3], Eigen::Vector3d::UnitZ()) *
                                Eigen::AngleAxisd(numbers[4], Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(numbers[5], Eigen::Vector3d::UnitX());
  if (numbers.size() == 7) {
    rotation = Eigen::Quaterniond(numbers[6], numbers[3], numbers[4], numbers[5]);
    if (!(std::abs(rotation.norm() - 1.0) <= 0.1)) return std::nullopt;
  }
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = words[0];
  transform.child_frame_id = words[1];
  tf2::toMsg(Eigen::Vector3d(numbers[0], numbers[1], numbers[2]), transform.transform.translation);
  transform.transform.rotation = tf2::toMsg(rotation);
  return tidyTransform(transform);
}

/// Counts messages of tf2 about transforms, instead of printing each line.
class TfLog : public console_bridge::OutputHandler {
 public:
  TfLog() { console_bridge::useOutputHandler(this); }
  ~TfLog() override { console_bridge::restorePreviousOutputHandler(); }
  TfLog(const TfLog&) = delete;
  TfLog& operator=(const TfLog&) = delete;

  void log(const std::string& text, console_bridge::LogLevel level, const char* /*file*/,
           int /*line*/) override {
    if (level < console_bridge::CONSOLE_BRIDGE_LOG_WARN) return;  // rosbag logs every message.
    auto& [count, first] = kinds_[text.substr(0, text.find(' '))];
    if (count++ == 0) first = text;
  }

  [[nodiscard]] std::vector<std::string> describe() const {
    std::vector<std::string> lines;
    for (const auto& [kind, said] : kinds_) {
      std::string line = cuboid_mapping::counted(said.first, "transform");
      line += " left out by tf, " + kind;
      if (kind == "TF_REPEATED_DATA") line += ", since it has one of this time already";
      line += "; the first: " + said.second.substr(0, said.second.find('\n'));
      lines.push_back(line);
    }
    return lines;
  }

 private:
  std::map<std::string, std::pair<std::uint64_t, std::string>> kinds_;
};

/// Topics without _static that have transforms.
std::set<std::string> findMainTopics(const BagTopics& topics) {
  std::set<std::string> found;
  for (const auto& [name, topic] : topics.all()) {
    const bool is_tf = topic.datatype == "tf2_msgs/TFMessage" || topic.datatype == "tf/tfMessage";
    if (is_tf && topic.num_messages > 0) found.insert(mainTopic(name));
  }
  return found;
}

/// Completes an option: a topic with or without _static, or a namespace.
std::string completeTopic(const BagTopics& topics, const std::string& given) {
  const std::string topic = withSlash(mainTopic(given));
  return boost::algorithm::ends_with(topic, "/tf") || topics.find(topic) != nullptr ? topic
                                                                                    : topic + "/tf";
}

}  // namespace

void BagTransforms::read(BagFiles& bags, const BagTopics& topics, const std::string& topic,
                         const std::vector<std::string>& added) {
  const std::set<std::string> found = findMainTopics(topics);
  std::string main_topic = topic.empty() ? "/tf" : completeTopic(topics, topic);
  if (found.count(main_topic) == 0 && !found.empty()) {
    const std::string others = cuboid_mapping::join(found, ", ");
    if (!topic.empty()) {
      throw std::runtime_error("the bags have no transforms on " + main_topic +
                               "; they have some on: " + others);
    }
    if (found.size() == 1) {
      main_topic = *found.begin();
      notes_.push_back("takes transforms from " + main_topic + " and " + main_topic +
                       kStaticEnding + ", since there are none on /tf (as --tf " + main_topic +
                       " does; a node: /tf:=" + main_topic + " /tf_static:=" + main_topic +
                       kStaticEnding + ')');
    } else {
      notes_.push_back("there are no transforms on /tf, but on " + others +
                       ": choose one of them with --tf");
    }
  }
  readTopics(bags, {main_topic, main_topic.substr(1), main_topic + kStaticEnding,
                    main_topic.substr(1) + kStaticEnding});
  for (const std::string& text : added) {
    const auto transform = parseTransform(text);
    if (!transform) {
      throw std::runtime_error(
          "--transform \"" + text +
          "\": must be \"parent child x y z yaw pitch roll\", or \"parent child x "
          "y z qx qy qz qw\", in metres and radians");
    }
    (void)tf_.setTransform(*transform, "option", true);
  }
}

void BagTransforms::readTopics(BagFiles& bags, const std::vector<std::string>& topics) {
  TfLog log;
  std::map<std::string, Moving> moving;
  StaticPublishers publishers;
  for (const BagMessage& message : bags.collect(topics)) {
    cuboid_mapping::throwIfInterrupted();
    const auto transforms = bags.read<tf2_msgs::TFMessage>(message);
    if (!transforms) continue;
    const bool is_static = isStatic(message.instance.getTopic());
    for (const geometry_msgs::TransformStamped& transform : transforms->transforms) {
      if (is_static) {
        statics_.push_back({message.instance.getTime(), tidyTransform(transform)});
        const std::string warning = publishers.note(transform, message.instance.getCallerId());
        if (!warning.empty()) notes_.push_back("warning: " + warning);
      } else {
        (void)tf_.setTransform(transform, "bag");
        Moving& frame = moving[withoutSlash(transform.child_frame_id)];
        const auto& position = transform.transform.translation;
        frame.positions.emplace_back(transform.header.stamp,
                                     Eigen::Vector3d(position.x, position.y, position.z));
        frame.files.insert(bags[message.bag].getFileName());
      }
    }
  }
  setFirstStatics();
  findRuns(moving);
  const std::vector<std::string> left_out = log.describe();
  notes_.insert(notes_.end(), left_out.begin(), left_out.end());
}

void BagTransforms::findRuns(std::map<std::string, Moving>& frames) {
  for (auto& [name, frame] : frames) {
    auto& positions = frame.positions;
    std::stable_sort(positions.begin(), positions.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    ToAndFro jumps;
    for (const auto& item : positions) jumps.add(item.second);
    if (jumps.isSeen()) torn_[name] = std::move(frame.files);
  }
}

void BagTransforms::checkRuns(const BagTopics& topics) const {
  for (const auto& [name, topic] : topics.all()) {
    if (!topic.type || torn_.empty()) continue;
    for (const std::string& frame_id : findAncestors(tf_, topic.frame_id)) {
      const auto torn = torn_.find(frame_id);
      if (torn == torn_.end()) continue;
      throw std::runtime_error(
          "'" + frame_id +
          "' jumps to and fro between two places: " + cuboid_mapping::join(torn->second, ", ") +
          " has transforms of two runs, robots or publishers. Map each run by "
          "itself (rosbag filter divides a bag), and merge the maps with map_merge");
    }
  }
}

void BagTransforms::setFirstStatics() {
  std::set<std::string> children;
  for (const StaticTransform& item : statics_) {
    if (!children.insert(item.transform.child_frame_id).second) continue;
    (void)tf_.setTransform(item.transform, "bag", true);
  }
}

void BagTransforms::advance(const ros::Time& time) {
  for (; num_taken_ < statics_.size() && statics_[num_taken_].recorded <= time; ++num_taken_) {
    (void)tf_.setTransform(statics_[num_taken_].transform, "bag", true);
  }
}

}  // namespace cuboid_mapping_ros
