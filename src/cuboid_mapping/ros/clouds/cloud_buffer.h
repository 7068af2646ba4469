// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/clouds/cloud_poses.h"
#include "cuboid_mapping/ros/conversions/sensor_conversions.h"
#include "cuboid_mapping/ros/diagnostics/node_statistics.h"

#include <ros/time.h>

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Limits of waiting clouds.
struct CloudLimits {
  std::size_t queue_size = 10;        ///< Clouds of a source that have their poses, > 0.
  std::size_t max_bytes = 256000000;  ///< Bytes of all clouds. One may wait, whatever its size.
  double tf_wait_s = 10.0;            ///< Limit in the node's time.
  std::size_t num_sources = 1;        ///< Number of sources, > 0.
  double order_wait_s = 0.2;          ///< Wait for earlier clouds of other sources, in wall time.
};

/// The limits of the parameters.
[[nodiscard]] CloudLimits makeCloudLimits(const NodeParameters& parameters);

/// The next cloud in turn, with its poses.
struct PosedCloud {
  SensorMessage message;
  CloudPoses poses;
};

/// Seconds of std::chrono::steady_clock.
[[nodiscard]] double steadySeconds();

/// Queue between the threads that receive clouds and the one that maps them: clouds wait here for tf and for
/// their turn. A cloud is a message of any source. Needs no master.
///
/// A cloud waits for tf for at most tf_wait_s. The poses from tf are kept with the cloud, even if tf forgets
/// them before its turn. Clouds of one source whose poses are there pass others, and go in the order of
/// arrival.
///
/// Clouds of several sources go in the order of (stamp, source): each waits until every other source has sent a
/// cloud that is not earlier, and until tf has the poses of the clouds before it; but at most order_wait_s
/// after its own poses are there. Clouds do not wait for a source that has sent nothing for order_wait_s, is
/// silent for much longer than the time between its last two messages, or whose clock is wrong. A cloud that
/// comes too late for its place goes anyway, and is counted.
///
/// A cloud whose time tf has forgotten is dropped, since the clock of its source is wrong: this is logged once.
/// Other sources are not affected.
///
/// Beyond max_bytes, the source with the most bytes loses clouds, the newest that wait for tf first; at least
/// one cloud stays. Beyond half of max_bytes, clouds do not wait for the order. If more than
/// queue_size clouds of a source have their poses, and did not become fewer for kBurst_s, the newest are
/// dropped: neither a burst nor clouds that came while a service held the map are lost.
///
/// Thread rule: put(), noteTfChanged(), setSearch() and stop() from any thread; the rest in the mapping thread.
class CloudBuffer {
 public:
  using FindPoses = std::function<PoseSearch(const SensorMessage& cloud, const Slices& slices)>;

  struct Callbacks {
    FindPoses find_poses;
    /// Result of readSlices(), made once for each cloud.
    std::function<Slices(const SensorMessage& cloud)> read_slices = [](const SensorMessage&) {
      return Slices();
    };
    /// Called for each dropped cloud. Must not throw, nor call this object. @param text  Empty: nothing
    /// new to log.
    std::function<void(std::size_t source, DropReason reason, const std::string& text)> drop;
    /// Logs that clouds of a source wait for tf. @param why  Called in wall time, also while the node's time
    /// stands still.
    std::function<void(std::size_t source, const std::string& why)> say_waiting =
        [](std::size_t, const std::string&) {};
    std::function<double()> clock_s = steadySeconds;  ///< A clock that does not jump.
    std::function<ros::Time()> now = ros::Time::now;
  };

  /// Time after which more clouds than queue_size are an overload, unless they became fewer.
  static constexpr double kBurst_s = 1.0;
  /// Delay before the log says that clouds wait for tf, and the delay before it says so again.
  static constexpr double kSayWaiting_s = 1.0;
  static constexpr double kSayAgain_s = 60.0;

  CloudBuffer(const CloudLimits& limits, Callbacks callbacks);
  CloudBuffer(const CloudBuffer&) = delete;
  CloudBuffer& operator=(const CloudBuffer&) = delete;

  /// Takes a cloud; drops it if there is no memory for it.
  void put(const SensorMessage& cloud);
  /// Asks tf again for the waiting clouds.
  void noteTfChanged();
  /// Asks tf again for all clouds, for example after a change of the needed frames.
  void setSearch(FindPoses find_poses);
  /// Ends waitNext(), for good.
  void stop();

  /// The next cloud in turn. @return Nothing after stop().
  [[nodiscard]] std::optional<PosedCloud> waitNext();
  /// As waitNext(), but nothing when no cloud may go now.
  [[nodiscard]] std::optional<PosedCloud> takeNext();
  [[nodiscard]] bool hasNext();

  /// Thread-safe.
  ///@{
  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] std::size_t numBytes() const;
  /// Number of clouds that came too late for their place among several sources.
  [[nodiscard]] std::uint64_t numOutOfOrder() const;
  /// Reason why the oldest cloud waits for tf; empty when none waits.
  [[nodiscard]] std::string whyItWaits() const;
  ///@}

 private:
  struct Entry {
    SensorMessage cloud;
    ros::Time since;  ///< Start of the wait, in the node's time.
    double put_s = 0.0;
    std::optional<Slices> slices;  ///< Slices, once they have been read.
    PoseSearch search;
    double ready_since_s = 0.0;  ///< Time at which its poses were found.

    [[nodiscard]] bool isReady() const { return search.poses.has_value(); }
    [[nodiscard]] const ros::Time& stamp() const { return cloud.header().stamp; }
  };
  using Entries = std::deque<Entry>;

  /// State while more than queue_size clouds of a source have their poses.
  struct Backlog {
    std::size_t least = 0;  ///< Least number since the backlog began.
    double since_s = 0.0;   ///< Time at which it was reached.
  };

  struct Source {
    std::optional<Backlog> backlog;
    ros::Time newest;           ///< Stamp of its last cloud.
    double last_put_s = 0.0;    ///< Arrival of that cloud, or of the first cloud of any source.
    double gap_s = 0.0;         ///< Time between its last two clouds.
    std::size_t num_bytes = 0;  ///< Bytes of its waiting clouds.
    bool has_spoken = false;
    bool is_off_clock = false;  ///< tf has forgotten the time of its last cloud.
    bool has_named_clock = false;
    std::optional<double> said_waiting_s;
    const Entry* blocked = nullptr;  ///< In update(): first cloud that tf does not reach yet.
  };

  void refuse(std::size_t source, DropReason reason);
  void insert(const SensorMessage& cloud);
  void noteStamp(const SensorMessage& cloud, double now_s);
  [[nodiscard]] Entries::iterator placeOf(const SensorMessage& cloud);
  void update();
  /// @return false if the cloud is to be dropped.
  [[nodiscard]] bool updateEntry(Entry& entry, double now_s, DropReason& reason);
  void search(Entry& entry, double now_s);
  void sayWaiting(const Entry& entry, double now_s);
  void dropOverload();
  [[nodiscard]] std::size_t countReady(std::size_t source) const;
  void makeRoom();
  [[nodiscard]] Entries::iterator newestOf(std::size_t source, bool is_ready);
  void drop(const Entries::iterator& entry, DropReason reason);
  [[nodiscard]] std::string describe(const Entry& entry, DropReason reason);
  [[nodiscard]] std::string describeMissing(const Entry& entry) const;
  [[nodiscard]] Entry take(const Entries::iterator& entry);
  [[nodiscard]] Entries::iterator findNext();
  [[nodiscard]] bool isHeldUp(const Entry& entry, double now_s) const;
  [[nodiscard]] std::optional<PosedCloud> takeNextLocked();

  CloudLimits limits_;
  Callbacks callbacks_;
  mutable std::mutex mutex_;  ///< Guards the members below, and find_poses.
  std::condition_variable wake_;
  bool has_news_ = false;
  bool is_stopped_ = false;
  Entries entries_;  ///< Clouds in the order of arrival; of several sources, by stamp.
  std::vector<Source> sources_;
  std::size_t num_bytes_ = 0;
  ros::Time last_taken_;
  std::uint64_t num_out_of_order_ = 0;
};

}  // namespace cuboid_mapping_ros
