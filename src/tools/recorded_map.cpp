// SPDX-License-Identifier: BSD-3-Clause
#include "recorded_map.h"

#include "bag_files.h"
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/map/progress_counter.h"
#include "cuboid_mapping/ros/conversions/map_messages.h"
#include "cuboid_mapping/sharing/map_follower.h"

#include <rosbag/view.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <deque>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::CuboidMapUpdate;
using cuboid_mapping::FollowResult;
using cuboid_mapping::FullCuboidMap;
using cuboid_mapping::join;
using cuboid_mapping::MapDetail;

/// Maximum number of updates that wait for a keyframe, for example between its parts.
constexpr std::size_t kMaxEarlyUpdates = 100;

/// Follows a recorded map as CuboidMapClient does a live one, but without ~get_map: after a lost update it
/// waits for a keyframe.
class RecordedMapFollower {
 public:
  /// @param server  Empty: the only one.
  RecordedMapFollower(BagFiles& bags, std::string map_topic, std::string server)
      : bags_(bags), map_topic_(std::move(map_topic)), server_(std::move(server)) {}

  /// @throws std::runtime_error  for a second server.
  void take(const BagMessage& message) {
    if (withSlash(message.instance.getTopic()) == map_topic_) return takeImage(message);
    if (follower_.map() == nullptr) return keepForImage(message);
    if (const auto update = readUpdate(message)) takeUpdate(*update, message);
  }

  [[nodiscard]] const cuboid_mapping::CuboidMap* map() const { return follower_.map(); }
  [[nodiscard]] const std::string& frameId() const { return follower_.label().frame_id; }
  /// Detail of the last keyframe.
  [[nodiscard]] MapDetail detail() const { return detail_; }
  [[nodiscard]] const std::set<std::string>& servers() const { return servers_; }
  /// Time of recording of the last change of the map.
  [[nodiscard]] const ros::Time& time() const { return time_; }
  /// Time at which an update was lost, if no keyframe has followed.
  [[nodiscard]] const std::optional<ros::Time>& behindSince() const { return behind_since_; }

 private:
  void takeImage(const BagMessage& message) {
    const auto part = bags_.read<FullCuboidMap>(message);
    if (!part || isOfOtherServer(part->server)) return;
    if (part->part == 0) {
      incoming_.reset();
      if (!isKeyframeToSpare(*part)) incoming_ = fromMessage(*part);
    } else if (incoming_) {
      (void)appendPart(fromMessage(*part), *incoming_);
    }
    if (!incoming_ || incoming_->part + 1 < incoming_->num_parts) return;
    const ImageMessage whole = *std::exchange(incoming_, std::nullopt);
    if (!follower_.take(whole.image)) return;  // It is damaged.
    noteTaken(message);
    detail_ = whole.image.detail;
    behind_since_.reset();
    for (const BagMessage& early : std::exchange(early_updates_, {})) {
      const auto update = readUpdate(early);
      if (update && update->instance == follower_.instance()) takeUpdate(*update, early);
    }
  }

  /// Whether a keyframe can be ignored, since updates arrive.
  bool isKeyframeToSpare(const FullCuboidMap& keyframe) {
    const bool is_followed =
        follower_.map() != nullptr && !behind_since_ && keyframe.instance == follower_.instance();
    return is_followed && std::exchange(is_updated_, false);
  }

  boost::shared_ptr<CuboidMapUpdate> readUpdate(const BagMessage& message) {
    auto update = bags_.read<CuboidMapUpdate>(message);
    if (update && isOfOtherServer(update->server)) update.reset();
    return update;
  }

  void takeUpdate(const CuboidMapUpdate& update, const BagMessage& message) {
    switch (follower_.take(fromMessage(update).delta)) {
      case FollowResult::kApplied: noteTaken(message); [[fallthrough]];
      case FollowResult::kOld: is_updated_ = true; return;
      case FollowResult::kDamaged:
      case FollowResult::kGap:
        if (!behind_since_) behind_since_ = message.instance.getTime();
        keepForImage(message);
    }
  }

  /// Keeps updates that overtake their keyframe. The oldest may be dropped: the keyframe then shows a gap.
  void keepForImage(const BagMessage& message) {
    if (early_updates_.size() == kMaxEarlyUpdates) early_updates_.pop_front();
    early_updates_.push_back(message);
  }

  bool isOfOtherServer(const std::string& name) {
    servers_.insert(name);
    if (!server_.empty()) return name != server_;
    if (servers_.size() == 1) return false;
    throw std::runtime_error("several nodes publish " + map_topic_ + ": " + join(servers_, ", ") +
                             ": choose one with --server");
  }

  void noteTaken(const BagMessage& message) { time_ = std::max(time_, message.instance.getTime()); }

  BagFiles& bags_;
  std::string map_topic_;
  std::string server_;
  std::set<std::string> servers_;  ///< All servers on the topics.
  cuboid_mapping::MapFollower follower_;
  MapDetail detail_ = MapDetail::kClasses;
  ros::Time time_;
  std::optional<ros::Time> behind_since_;
  bool is_updated_ = false;               ///< Updates have come since the last keyframe.
  std::optional<ImageMessage> incoming_;  ///< Parts of a keyframe that have come.
  std::deque<BagMessage> early_updates_;
};

/// The map of a bag.
class MapBag {
 public:
  MapBag(const std::string& file, const RecordedMapOptions& options)
      : file_(file), bags_({file}), options_(options) {
    rosbag::View view(bags_[0]);
    begin_ = view.getBeginTime();
    end_ = view.getEndTime();
    for (const rosbag::ConnectionInfo* connection : view.getConnections()) {
      topics_[withSlash(connection->topic)] = connection;
    }
  }

  RecordedMap read(const cuboid_mapping::ProgressListener& listener) {
    const std::string topic = chooseTopic();
    const std::string updates = topic + "_updates";
    RecordedMap result;
    if (topics_.count(updates) == 0) result.notes.push_back("there is no topic " + updates);
    RecordedMapFollower follower(bags_, topic,
                                 options_.server.empty() ? "" : withSlash(options_.server));
    follow(bags_.collect({topic, topic.substr(1), updates, updates.substr(1)}), listener, follower);
    checkFollowed(topic, follower);
    result.snapshot = takeSnapshot(*follower.map(), follower.frameId());
    note(topic, follower, result.notes);
    return result;
  }

 private:
  [[noreturn]] void fail(const std::string& text) const {
    throw std::runtime_error(file_ + ": " + text);
  }

  /// Text of a time since the start. Rounded up, so that --at includes the message of that time.
  [[nodiscard]] std::string seconds(const ros::Time& time) const {
    return cuboid_mapping::toText(std::ceil(1e3 * (time - begin_).toSec()) / 1e3) + " s";
  }

  [[nodiscard]] std::string describeTopics() const {
    std::vector<std::string> texts;
    for (const auto& [name, connection] : topics_) {
      texts.push_back(name + " (" + connection->datatype + ')');
    }
    return texts.empty() ? "nothing" : join(texts, ", ");
  }

  /// The given topic of maps, or the only one.
  [[nodiscard]] std::string chooseTopic() const {
    const std::string datatype = ros::message_traits::datatype<FullCuboidMap>();
    std::vector<std::string> names;
    for (const auto& [name, connection] : topics_) {
      if (connection->datatype == datatype) names.push_back(name);
    }
    const std::string wanted = options_.topic.empty() ? "" : withSlash(options_.topic);
    if (names.empty()) {
      fail("it has no recorded map, which is a topic of " + datatype +
           ". It has: " + describeTopics() + ". bag_to_map makes a map of clouds");
    }
    if (wanted.empty() && names.size() > 1) {
      fail("it has several maps: choose one with --topic: " + join(names, ", "));
    }
    std::string name = wanted.empty() ? names.front() : wanted;
    if (std::find(names.begin(), names.end(), name) == names.end()) {
      fail("it has no map on " + name + ", but on " + join(names, ", "));
    }
    if (topics_.at(name)->md5sum != ros::message_traits::md5sum<FullCuboidMap>()) {
      fail(name + " was recorded with another version of cuboid_mapping: read it with that one");
    }
    return name;
  }

  /// Reads up to the requested time; and further if there is no map by then, to report when there is one.
  void follow(const std::vector<BagMessage>& messages,
              const cuboid_mapping::ProgressListener& listener, RecordedMapFollower& follower) {
    cuboid_mapping::ProgressCounter progress(listener, messages.size());
    for (const BagMessage& message : messages) {
      const bool is_later = isLater(message.instance.getTime());
      if (is_later && follower.map() != nullptr) return;
      try {
        follower.take(message);
      } catch (const std::runtime_error& error) {
        fail(error.what());
      }
      progress.advance();
    }
  }

  [[nodiscard]] bool isLater(const ros::Time& time) const {
    return (time - begin_).toSec() > options_.at_s;
  }

  void checkFollowed(const std::string& topic, const RecordedMapFollower& follower) const {
    if (follower.map() == nullptr) {
      const auto& servers = follower.servers();
      if (!options_.server.empty() && servers.count(withSlash(options_.server)) == 0) {
        fail("nobody named " + withSlash(options_.server) + " published " + topic + ", but " +
             join(servers, ", "));
      }
      const auto damage = bags_.describeDamage();
      fail("no map on " + topic + " is whole: record for longer than keyframe_period" +
           (damage.empty() ? "" : ". " + join(damage, "; ")));
    }
    if (isLater(follower.time())) {
      fail("the first whole map on " + topic + " is at " + seconds(follower.time()) +
           ": give --at a later time");
    }
  }

  void note(const std::string& topic, const RecordedMapFollower& follower,
            std::vector<std::string>& notes) const {
    if (const auto& since = follower.behindSince()) {
      notes.push_back("warning: an update was lost before " + seconds(*since) +
                      ", and no keyframe has come since: the map is older");
    }
    for (const std::string& line : bags_.describeDamage()) notes.push_back("warning: " + line);
    if (follower.detail() == MapDetail::kClasses) {
      notes.push_back("classes only: log-odds are recorded with publish_values");
    }
    notes.push_back(file_ + ": the map on " + topic + " at " + seconds(follower.time()) + " of " +
                    seconds(end_));
  }

  std::string file_;
  BagFiles bags_;
  RecordedMapOptions options_;
  ros::Time begin_;
  ros::Time end_;
  std::map<std::string, const rosbag::ConnectionInfo*> topics_;  ///< Topics by names with a slash.
};

}  // namespace

bool isBagFile(const std::string& file) {
  return isRosbag(file) || std::filesystem::path(file).extension() == ".bag";
}

RecordedMap readRecordedMap(const std::string& file, const RecordedMapOptions& options,
                            const cuboid_mapping::ProgressListener& listener) {
  return MapBag(file, options).read(listener);
}

}  // namespace cuboid_mapping_ros
