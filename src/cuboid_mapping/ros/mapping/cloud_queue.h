// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/conversions/sensor_conversions.h"
#include "cuboid_mapping/ros/mapping/tf_poses.h"

#include <ros/time.h>

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Limits of a CloudQueue.
struct CloudLimits {
  std::size_t num_sources = 1;  ///< > 0.
  std::size_t queue_size = 2;   ///< Clouds of a source that wait for the mapping thread, > 0.
  double tf_wait_s = 10.0;      ///< Longest wait for tf, in the node's time.
  /// Bytes of a source's clouds that wait for tf. One may wait, whatever its size.
  std::size_t max_waiting_bytes = 256000000;
};

/// The limits of the parameters. All sources together may keep 256 MB of clouds that wait for tf.
[[nodiscard]] CloudLimits makeCloudLimits(const NodeParameters& parameters);

/// A cloud that can be mapped.
struct PosedCloud {
  SensorMessage message;
  CloudPoses poses;
  double arrival_s = 0.0;  ///< Time of put(), by CloudQueue::Callbacks::clock_s.
};

/// Seconds of std::chrono::steady_clock.
[[nodiscard]] double steadySeconds();

/// Passes clouds (messages of any source) from the receiving thread to the mapping thread.
///
///   1. A cloud arrives, and waits for tf: at most tf_wait. It does not wait if waiting cannot help: its clock is
///      wrong, tf began after it, or it lies in a gap of tf.
///   2. With its poses it is ready, and waits for the mapping thread. It keeps its poses, even if tf forgets them.
///   3. The mapping thread takes the oldest ready cloud of the source whose last turn is longest ago.
///
/// If the mapping thread has not been idle for kBurst_s and more than queue_size clouds of a source are ready, the
/// oldest goes. The map is therefore behind by the cloud in work and the queue, and a shorter burst loses nothing.
///
/// Sources do not wait for each other: log-odds sums commute, except where they are clamped. bag_to_map keeps the
/// order of stamps.
///
/// tf2_ros::MessageFilter does not know the poses of points during a sweep, of the robot's parts, and of the
/// window, and does not say why a cloud waits.
///
/// Thread rule: waitReady() and takeNext() in the mapping thread; the rest from any.
class CloudQueue {
 public:
  struct Callbacks {
    /// Called once for each cloud, and again after searchAgain(); see SensorStep.
    std::function<Slices(const SensorMessage& cloud)> find_slices = [](const SensorMessage&) {
      return Slices();
    };
    std::function<PoseSearch(const SensorMessage& cloud, const Slices& slices)> find_poses;
    /// Called for each dropped cloud. Must not throw, nor call this object. @param text  Empty: nothing new to
    /// log.
    std::function<void(std::size_t source, DropReason reason, const std::string& text)> drop;
    /// Logs that clouds of a source wait for tf.
    std::function<void(std::size_t source, const std::string& why)> say_waiting =
        [](std::size_t, const std::string&) {};
    std::function<double()> clock_s = steadySeconds;  ///< A clock that does not jump.
    std::function<ros::Time()> now = ros::Time::now;
  };

  static constexpr double kBurst_s = 1.0;
  /// Delay before the log says that clouds wait for tf, and before it says so again.
  static constexpr double kSayWaiting_s = 1.0;
  static constexpr double kSayAgain_s = 60.0;

  CloudQueue(const CloudLimits& limits, Callbacks callbacks);
  CloudQueue(const CloudQueue&) = delete;
  CloudQueue& operator=(const CloudQueue&) = delete;

  /// Takes a cloud; drops it if there is no memory for it.
  void put(const SensorMessage& cloud);
  /// Asks again for the slices and the poses of all clouds, after a change of parameters.
  void searchAgain();
  /// Ends waitReady(), for good.
  void stop();

  /// Waits for a ready cloud. Asks tf 20 times a second for clouds that wait. @return false after stop().
  [[nodiscard]] bool waitReady();
  /// The next cloud; nothing when none is ready now.
  [[nodiscard]] std::optional<PosedCloud> takeNext();

  [[nodiscard]] bool hasReady() const;
  [[nodiscard]] std::size_t size() const;
  /// Frame of the cloud that has waited longest for tf, why, and what to do; empty when none waits.
  [[nodiscard]] std::string whyWaiting() const;

 private:
  struct Entry {
    SensorMessage cloud;
    std::size_t num_bytes = 0;  ///< Size on arrival: its publisher may still change the message.
    ros::Time since;            ///< Start of the wait, in the node's time.
    double arrival_s = 0.0;
    std::optional<Slices> slices;  ///< Slices, once they have been read.
    PoseSearch search;

    [[nodiscard]] const std_msgs::Header& header() const { return cloud.header(); }
  };
  /// A list, because clouds pass from one to the other without an allocation that may fail.
  using Entries = std::list<Entry>;

  struct Source {
    Entries waiting;  ///< For tf, in the order of arrival.
    Entries ready;
    std::size_t num_waiting_bytes = 0;
    std::uint64_t last_turn = 0;
    bool has_named_clock = false;  ///< The log has said that its clock is wrong.
    bool has_had_poses = false;    ///< A cloud of it had its transforms.
    std::optional<double> said_waiting_s;
  };

  /// Moves clouds of a source from `waiting` to `ready`, or drops them.
  void update(Source& source);
  /// Looks up the poses of a cloud, unless tf cannot have them: it lacks those of an earlier one.
  void search(Entry& entry, const Entry* blocked);
  /// Why a cloud without poses is dropped; nothing if it goes on waiting.
  [[nodiscard]] std::optional<DropReason> findReason(Entry& entry) const;
  void limitWaiting(Source& source);
  void limitReady(Source& source);
  void sayWaiting(Source& source, const Entry& entry);
  void drop(Source& source, Entries& from, Entries::iterator entry, DropReason reason);
  void refuse(std::size_t source, DropReason reason);
  [[nodiscard]] std::string describe(Source& source, const Entry& entry, DropReason reason) const;
  [[nodiscard]] std::string describeMissing(const Entry& entry) const;
  /// Why tf does not have its poses, and what to do.
  [[nodiscard]] std::string describeCause(const Entry& entry) const;
  /// Updates all sources. @return The one whose turn it is; null: no cloud is ready.
  [[nodiscard]] Source* findNext();

  CloudLimits limits_;
  Callbacks callbacks_;
  mutable std::mutex mutex_;  ///< Guards the members below, and find_poses.
  std::condition_variable wake_;
  bool has_news_ = false;
  bool is_stopped_ = false;
  std::vector<Source> sources_;
  std::uint64_t num_turns_ = 0;
  std::optional<double> busy_since_s_;  ///< Since when the mapping thread finds ready clouds.
};

}  // namespace cuboid_mapping_ros
