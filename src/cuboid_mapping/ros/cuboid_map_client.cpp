// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/cuboid_map_client.h"

#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/ros/conversions/map_messages.h"
#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/middleware/callbacks.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/middleware/published_topics.h"
#include "cuboid_mapping/sharing/shared_map_follower.h"

#include <ros/console.h>
#include <ros/init.h>
#include <ros/master.h>
#include <ros/names.h>
#include <ros/this_node.h>

#include <algorithm>
#include <deque>
#include <memory>
#include <optional>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

/// Queue of updates while the parts of a map are fetched.
constexpr std::uint32_t kUpdateQueue = 500;
/// Queue of parts of a map.
constexpr std::uint32_t kPartQueue = 100;
/// Time to wait for an image that the server sends.
constexpr double kImagePatience_s = 3.0;
/// Maximum number of updates that wait for their image: those of some seconds.
constexpr std::size_t kMaxEarlyDeltas = 100;
/// Time between two lines of the log that say what a client waits for.
constexpr double kReminderPeriod_s = 10.0;
/// Silence after which another server may replace the followed one, and a missing server is logged.
constexpr double kServerPatience_s = 5.0;
/// Time between two lines of the log about a missing server.
constexpr double kMissingPeriod_s = 60.0;

/// Bricks that a delta has changed.
ChangeSet changesOf(const MapDelta& delta) {
  ChangeSet changes{delta.revision, false, {}};
  for (const auto& brick : delta.bricks) changes.bricks.push_back({brick.brick, true});
  return changes;
}

/// Whether a copy is of a server's run.
bool isOfSameRun(const MapFollower& copy, std::uint64_t instance) {
  return copy.map() != nullptr && copy.instance() == instance;
}

/// Name of a topic beside the server, unless the topic is remapped in the namespace of the client.
std::string topicBeside(const ros::NodeHandle& nh, const std::string& server,
                        const std::string& topic) {
  if (nh.resolveName(topic) != nh.resolveName(topic, false)) return topic;
  return ros::names::append(ros::names::parentNamespace(server), topic);
}

/// Whether the master knows a service. Does not wait for a master that is gone: ros::service::exists() would.
bool isAdvertised(const std::string& service) {
  XmlRpc::XmlRpcValue request;
  request[0] = ros::this_node::getName();
  request[1] = service;
  XmlRpc::XmlRpcValue response;
  XmlRpc::XmlRpcValue url;
  return ros::master::execute("lookupService", request, response, url, false);
}

}  // namespace

/// State of the client's thread.
struct CuboidMapClient::Implementation {
  Implementation(const ros::NodeHandle& node, const std::string& server, Callback on_change)
      : nh(withQueue(node, thread.queue())),
        named_server(nh.resolveName(server)),
        callback(std::move(on_change)) {
    if (server != kNodeName) heard_server = named_server;
    // Updates are subscribed first, so that none is missed before the image.
    delta_subscriber = subscribeTo<CuboidMapUpdate>(
        nh, topicBeside(nh, named_server, kCuboidMapUpdatesTopic), kUpdateQueue,
        [this](const auto& message) { take(fromMessage(*message)); });
    image_subscriber = subscribeTo<FullCuboidMap>(
        nh, topicBeside(nh, named_server, kCuboidMapTopic), kPartQueue,
        [this](const auto& message) { takeFromTopic(fromMessage(*message)); });
    image_timer = Timer(nh, 1.0, [this] { askIfNoImageCame(); });
    thread.start();
  }
  ~Implementation() {
    get_map.stop();
    thread.stop();  // The thread ends before other members are destroyed.
  }

  /// @param message  Message of the topic, perhaps only a part.
  void takeFromTopic(const ImageMessage& message) {
    if (isOfOtherServer(message.server) || isKeyframeToSpare(message)) return;
    if (message.part == 0) {
      incoming = message;
    } else if (!incoming || !appendPart(message, *incoming)) {
      return;
    }
    awaited_since = ros::SteadyTime::now();  // Missing parts are requested later.
    if (incoming->part + 1 < incoming->num_parts) return;
    take(*std::exchange(incoming, std::nullopt));
  }

  /// Whether a keyframe can be ignored, since updates arrive.
  bool isKeyframeToSpare(const ImageMessage& message) {
    const bool is_followed = !is_behind && isOfSameRun(*follower.read(), message.image.instance);
    return is_followed && std::exchange(is_updated, false);
  }

  /// Whether the message of a node is ignored: the client follows the named node, or, if it has the default name,
  /// the first that it hears.
  bool isOfOtherServer(const std::string& name) {
    const ros::SteadyTime now = ros::SteadyTime::now();
    const bool is_kept =
        heard_server == named_server || now - heard < ros::WallDuration(kServerPatience_s);
    if (!heard_server.empty() && name != heard_server && name != named_server && is_kept) {
      if (!said_other.isZero() && now - said_other < ros::WallDuration(kReminderPeriod_s))
        return true;
      said_other = now;
      ROS_WARN_STREAM("ignored the map of " << name << " on " << image_subscriber.getTopic() << ": "
                                            << heard_server
                                            << " is followed; start each node in a namespace of "
                                               "its own, or give the other name as `server`");
      return true;
    }
    heard_server = name;
    heard = now;
    return false;
  }

  /// Name of the service ~get_map, from the server's messages if they have it.
  std::string getMapName() const {
    return (heard_server.empty() ? named_server : heard_server) + "/" + kGetMapService;
  }

  bool isOld(const ImageMessage& message) const {
    const auto now = follower.read();
    return isOfSameRun(*now, message.image.instance) && message.image.revision <= now->revision();
  }

  void take(const ImageMessage& message) {
    awaited_since = ros::SteadyTime();
    is_behind = false;
    if (isOld(message)) return;
    if (!follower.take(message.image)) {
      ROS_WARN_THROTTLE(10.0, "ignored a damaged FullCuboidMap");
      return;
    }
    if (callback) callback({message.image.revision, true, {}});
    for (const DeltaMessage& early : std::exchange(early_deltas, {})) {
      if (early.delta.instance == message.image.instance) take(early);
    }
  }

  void take(const DeltaMessage& message) {
    if (isOfOtherServer(message.server)) return;
    has_values = message.delta.detail == MapDetail::kValues;
    switch (follower.take(message.delta)) {
      case FollowResult::kApplied:
        is_updated = true;
        if (callback) callback(changesOf(message.delta));
        return;
      case FollowResult::kOld: is_updated = true; return;
      case FollowResult::kDamaged:
        ROS_WARN_THROTTLE(10.0, "received a damaged CuboidMapUpdate: asking for the whole map");
        [[fallthrough]];
      case FollowResult::kGap:
        is_behind = true;
        if (!isImageOnItsWay(message.delta)) return askForImage();
        // Updates may overtake the image. The oldest may be dropped: the image then shows a gap.
        if (early_deltas.size() == kMaxEarlyDeltas) early_deltas.pop_front();
        early_deltas.push_back(message);
    }
  }

  /// Whether the server will send an image by itself, as it does for each new connection, also after a restart:
  /// asking for it, too, would fetch the map twice.
  bool isImageOnItsWay(const MapDelta& delta) {
    if (isOfSameRun(*follower.read(), delta.instance)) return false;
    const ros::SteadyTime now = ros::SteadyTime::now();
    if (awaited_since.isZero()) awaited_since = now;
    return now - awaited_since < ros::WallDuration(kImagePatience_s);
  }

  /// Says so if no message has come, and either the topic or the service of the named server is not there.
  void noticeMissingServer() {
    const ros::SteadyTime now = ros::SteadyTime::now();
    if (!heard.isZero() || now < missing_due) return;
    missing_due = now + ros::WallDuration(kMissingPeriod_s);
    const std::string service = getMapName();
    if (isAdvertised(service)) {
      if (image_subscriber.getNumPublishers() == 0) sayWhatIsMissing();
      return;
    }
    ROS_WARN_STREAM("no map has come on " << image_subscriber.getTopic() << ", and no node offers "
                                          << service
                                          << ": start the node, or give its name as `server`");
  }

  void askIfNoImageCame() {
    noticeMissingServer();
    if (awaited_since.isZero()) return;
    if (ros::SteadyTime::now() - awaited_since < ros::WallDuration(kImagePatience_s)) return;
    askForImage();
  }

  void askForImage() {
    const MapDetail detail = has_values ? MapDetail::kValues : MapDetail::kClasses;
    ImageMessage message;
    std::string error;
    // Completes a map whose first parts came on the topic.
    const bool has_part = incoming.has_value();
    if (has_part) message = *std::exchange(incoming, std::nullopt);
    const bool has_all = has_part ? get_map.callForRest(getMapName(), message, error)
                                  : get_map.call(getMapName(), detail, message, error);
    if (has_all) return take(message);
    awaited_since = ros::SteadyTime::now();
    ROS_WARN_STREAM_THROTTLE(10.0, "cannot follow the map: " << error
                                                             << "; it is asked for again, or comes "
                                                                "with a keyframe on "
                                                             << image_subscriber.getTopic());
  }

  void sayWhatIsMissing() const {
    const std::string topic = image_subscriber.getTopic();
    const bool is_published = publishedTypes().count(topic) > 0;
    const std::string reason =
        describeUnheard(image_subscriber.getNumPublishers(), is_published,
                        "check that the node runs in this namespace, and maps clouds");
    ROS_WARN_STREAM("no map has come on " << topic << reason);
  }

  CallbackGuard guard;
  GuardedThread thread{guard, "cuboid map client"};
  ros::NodeHandle nh;
  std::string named_server;
  GetMapClient get_map{nh};
  Callback callback;
  SharedMapFollower follower;            ///< Only this thread updates it.
  std::optional<ImageMessage> incoming;  ///< Parts of an image that have arrived.
  bool has_values = false;               ///< Updates carry log-odds.
  bool is_updated = false;               ///< Updates have arrived since the last keyframe.
  bool is_behind = false;                ///< Updates were lost.
  std::string heard_server;              ///< The followed server, ...
  ros::SteadyTime heard;                 ///< ... and the last time it was heard.
  ros::SteadyTime said_other;            ///< Last time another server was logged.
  ros::SteadyTime missing_due =          ///< Time of the next look for a missing server.
      ros::SteadyTime::now() + ros::WallDuration(kServerPatience_s);
  ros::SteadyTime awaited_since;          ///< Start of the wait for a sent image; zero: none.
  std::deque<DeltaMessage> early_deltas;  ///< Updates that arrived before the image.
  Timer image_timer;
  ros::Subscriber delta_subscriber;
  ros::Subscriber image_subscriber;
};

CuboidMapClient::CuboidMapClient(const ros::NodeHandle& nh, const std::string& server,
                                 Callback callback)
    : implementation_(std::make_unique<Implementation>(nh, server, std::move(callback))) {}

CuboidMapClient::~CuboidMapClient() = default;

ClientMap CuboidMapClient::current() const { return ClientMap(implementation_->follower.read()); }

CuboidMap CuboidMapClient::copy() const { return copyOf(current().map()); }

bool CuboidMapClient::hasMap() const { return current().map().voxels().size() > 0; }

bool CuboidMapClient::waitForMap(const ros::WallDuration& timeout) const {
  const ros::SteadyTime start = ros::SteadyTime::now();
  double reminder_s = kImagePatience_s;
  while (!hasMap() && ros::ok()) {
    const double waited_s = (ros::SteadyTime::now() - start).toSec();
    const bool is_over = waited_s >= timeout.toSec();
    if (is_over || waited_s >= reminder_s) {
      implementation_->sayWhatIsMissing();
      reminder_s += kReminderPeriod_s;
    }
    if (is_over) break;
    ros::WallDuration(std::min(0.05, timeout.toSec() - waited_s)).sleep();
  }
  return hasMap();
}

const CuboidMap& ClientMap::map() const {
  static const CuboidMap kNothing;
  const CuboidMap* map = version_->map();
  return map != nullptr ? *map : kNothing;
}

ros::Time ClientMap::stamp() const {
  ros::Time stamp;
  stamp.fromNSec(static_cast<std::uint64_t>(version_->label().stamp_ns));
  return stamp;
}

}  // namespace cuboid_mapping_ros
