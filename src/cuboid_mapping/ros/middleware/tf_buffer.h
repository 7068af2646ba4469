// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/middleware/static_publishers.h"
#include "cuboid_mapping/ros/middleware/to_and_fro.h"

#include <geometry_msgs/TransformStamped.h>
#include <ros/duration.h>
#include <ros/message_event.h>
#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <ros/time.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>

namespace cuboid_mapping_ros {

/// A time without transforms of a frame.
struct TfGap {
  std::string frame_id;
  double begin_s = 0.0;  ///< Last transform before it, ...
  double end_s = 0.0;    ///< ... and the first one after it.
};

/// tf2's buffer, with the gaps that tf2 interpolates across, however long they are. Thread-safe, but for
/// setMaxGap().
class TfBuffer : public tf2::BufferCore {
 public:
  /// @param max_gap_s  Shorter gaps are none; infinity: there are no gaps.
  explicit TfBuffer(ros::Duration cache = ros::Duration(tf2::BufferCore::DEFAULT_CACHE_TIME),
                    double max_gap_s = std::numeric_limits<double>::infinity())
      : tf2::BufferCore(cache), cache_s_(cache.toSec()), max_gap_s_(max_gap_s) {}

  /// As tf2's, also for rotations that were written with few digits; see tidyTransform(). A stamp that leads its frame's
  /// newest by more than half of the cache holds when the frame's next one is nearer to it than to the newest: tf2 would
  /// forget the right transforms, and refuse those to come.
  bool setTransform(const geometry_msgs::TransformStamped& transform, const std::string& authority,
                    bool is_static = false);
  void clear();

  void setMaxGap(double max_gap_s) { max_gap_s_ = max_gap_s; }
  /// Time that it keeps.
  [[nodiscard]] double cache_s() const { return cache_s_; }

  /// Time by which a transform is older than its frame's newest; nothing before the first one. @pre tidyTransform().
  [[nodiscard]] std::optional<double> delay_s(
      const geometry_msgs::TransformStamped& transform) const;
  /// Notes why the latest transform of a frame is not to be trusted; empty: it is. @param frame_id  Without slash.
  void noteFault(const std::string& frame_id, const std::string& fault);
  /// Whether all moving frames above a frame had transforms before and after a time: tf will have no better ones.
  [[nodiscard]] bool covers(const std::string& frame_id, const ros::Time& stamp) const;
  /// Faults of the latest transforms of a frame and its ancestors; empty: none.
  [[nodiscard]] std::string describeFaults(const std::string& frame_id) const;

  /// The gap between two frames at a time, for which tf2 has a transform; nothing at time 0.
  [[nodiscard]] std::optional<TfGap> findGap(const std::string& target, const std::string& source,
                                             const ros::Time& stamp) const;

 private:
  /// Times of a moving frame.
  struct Times {
    double oldest_s = 0.0;
    double newest_s = 0.0;
    std::map<double, double> gap_ends_s;                     ///< Ends of the gaps, by their begins.
    std::optional<geometry_msgs::TransformStamped> doubted;  ///< It leads, until the next one.
  };

  bool insert(const geometry_msgs::TransformStamped& transform, const std::string& authority,
              Times& times);

  void noteTime(Times& times, double stamp_s) const;
  double cache_s_;
  double max_gap_s_;
  mutable std::mutex mutex_;
  std::map<std::string, Times> times_;         ///< By child frame.
  std::map<std::string, std::string> faults_;  ///< Of the latest transforms, by child frame.
};

/// Fills a buffer from /tf and /tf_static. Clears it when the node's time jumps back by more than kMinJump_s:
/// tf2_ros::TransformListener clears it at any step back, even if two /clock messages overtake each other.
/// Thread rule: works in the queue of the node handle, which must have one thread.
class TfReceiver {
 public:
  static constexpr double kMinJump_s = 1.0;

  /// @param buffer  Must outlive this object.
  TfReceiver(ros::NodeHandle nh, TfBuffer& buffer);
  TfReceiver(const TfReceiver&) = delete;
  TfReceiver& operator=(const TfReceiver&) = delete;

 private:
  using Event = ros::MessageEvent<const tf2_msgs::TFMessage>;

  /// A moving frame, and who publishes its transforms.
  struct Moving {
    ToAndFro jumps;
    std::set<std::string> publishers;
    bool is_said = false;
    std::string parent;                          ///< Of its latest transform.
    std::map<std::string, std::string> parents;  ///< Publisher of each parent that takes its turn.
    double changed_s = 0.0;                      ///< Stamp of the latest change of the parent.
    std::size_t num_changes = 0;                 ///< Of the parent, without a long pause.
  };

  void take(const Event& event, bool is_static);
  /// The fault of a frame that two publishers give different parents; empty: none.
  std::string noteParent(const geometry_msgs::TransformStamped& transform,
                         const std::string& publisher);
  /// Warns once if two runs, robots or publishers share the name of a frame.
  void noteMove(const geometry_msgs::TransformStamped& transform, const std::string& publisher);

  TfBuffer& buffer_;
  std::map<std::string, Moving> moving_;
  StaticPublishers statics_;
  ros::Time latest_;   ///< Latest time of the node.
  ros::Time settled_;  ///< After a jump back, messages of the run before may come until this time.
  ros::Subscriber subscriber_;
  ros::Subscriber static_subscriber_;
};

}  // namespace cuboid_mapping_ros
