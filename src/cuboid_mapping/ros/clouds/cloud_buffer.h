// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/clouds/cloud_poses.h"
#include "cuboid_mapping/ros/conversions/sensor_message.h"
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

/// How many clouds may wait, and how long.
struct CloudLimits {
  std::size_t queue_size = 10;        ///< > 0; of a source, that have their poses.
  std::size_t max_bytes = 256000000;  ///< For all clouds. One may wait, whatever its size.
  double tf_wait_s = 10.0;            ///< In the node's time.
  std::size_t num_sources = 1;        ///< > 0.
  double order_wait_s = 0.2;          ///< For earlier clouds of other sources, in wall time.
};

/// The limits of the parameters.
[[nodiscard]] CloudLimits makeCloudLimits(const NodeParameters& parameters);

/// A cloud whose turn it is.
struct PosedCloud {
  SensorMessage message;
  CloudPoses poses;
};

/// Seconds of std::chrono::steady_clock.
[[nodiscard]] double steadySeconds();

/// Clouds between the threads that receive them and the one that maps them: they wait here for tf, and for their turn.
/// A cloud is a message of any source. Needs no master.
///
/// A cloud waits for tf for tf_wait_s at most. The poses that tf gave go with the cloud, whatever tf forgets before its
/// turn. Of one source, clouds whose poses are there pass others, and go in the order in which they came.
///
/// Clouds of several sources go in the order of (stamp, source): each waits until every other source has sent one that
/// is not earlier, and until tf has the poses of those before it; but no longer than order_wait_s from when its own poses
/// are there. Nobody waits for a source that has not spoken for order_wait_s, has fallen silent for much longer than
/// between its last two messages, or whose clock is wrong. A cloud that comes too late for its place goes all the same,
/// and is counted.
///
/// A cloud whose time tf has forgotten is dropped: the clock of its source is wrong, which is said once. The other sources
/// do not notice.
///
/// The next cloud in turn is never dropped for want of room. Beyond max_bytes the newest cloud of the source that takes most
/// of them goes; beyond half of them nobody waits for the order. Where more than queue_size clouds of a source have their
/// poses, and did not become fewer for kBurst_s, the newest go: a burst loses none, nor do clouds that came while a
/// service held the map.
///
/// Thread rule: put(), noteTfChanged(), setSearch() and stop() from any thread; the rest in the one that maps.
class CloudBuffer {
 public:
  using FindPoses = std::function<PoseSearch(const SensorMessage& cloud, const Slices& slices)>;

  struct Callbacks {
    FindPoses find_poses;
    /// Result of readSlices(), made once for each cloud.
    std::function<Slices(const SensorMessage& cloud)> read_slices = [](const SensorMessage&) {
      return Slices();
    };
    /// For each cloud that goes without being mapped. Must not throw, nor call this object. @param text  Empty: nothing
    /// that has not been said.
    std::function<void(std::size_t source, DropReason reason, const std::string& text)> drop;
    /// Clouds of a source wait for tf. @param why  In wall time, also while the node's time stands still.
    std::function<void(std::size_t source, const std::string& why)> say_waiting =
        [](std::size_t, const std::string&) {};
    std::function<double()> clock_s = steadySeconds;  ///< A clock that does not jump.
    std::function<ros::Time()> now = ros::Time::now;
  };

  /// More clouds than queue_size are an overload when they did not become fewer for this time.
  static constexpr double kBurst_s = 1.0;
  /// Waiting for tf is said after this time, and again after the other one.
  static constexpr double kSayWaiting_s = 1.0;
  static constexpr double kSayAgain_s = 60.0;

  CloudBuffer(const CloudLimits& limits, Callbacks callbacks);
  CloudBuffer(const CloudBuffer&) = delete;
  CloudBuffer& operator=(const CloudBuffer&) = delete;

  /// Takes a cloud; drops it when it cannot be kept for want of memory.
  void put(const SensorMessage& cloud);
  /// Has tf asked again for the clouds that wait for it.
  void noteTfChanged();
  /// Has tf asked anew for all clouds, as after a change of the frames that are needed.
  void setSearch(FindPoses find_poses);
  /// Ends waitNext(), for good.
  void stop();

  /// The next cloud in turn. @return Nothing when it has been stopped.
  [[nodiscard]] std::optional<PosedCloud> waitNext();
  /// As waitNext(), but nothing when no cloud may go now.
  [[nodiscard]] std::optional<PosedCloud> takeNext();
  [[nodiscard]] bool hasNext();

  /// Thread-safe.
  ///@{
  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] std::size_t numBytes() const;
  /// Several sources: those that came too late for their place.
  [[nodiscard]] std::uint64_t numOutOfOrder() const;
  /// Reason why the oldest cloud waits for tf; empty when none waits.
  [[nodiscard]] std::string whyItWaits() const;
  ///@}

 private:
  struct Entry {
    SensorMessage cloud;
    ros::Time since;  ///< The node's time.
    double put_s = 0.0;
    std::optional<Slices> slices;  ///< Once they have been read.
    PoseSearch search;
    double ready_since_s = 0.0;  ///< When its poses were found.

    [[nodiscard]] bool isReady() const { return search.poses.has_value(); }
    [[nodiscard]] const ros::Time& stamp() const { return cloud.header().stamp; }
  };
  using Entries = std::deque<Entry>;

  /// Clouds of a source that have their poses are more than queue_size.
  struct Backlog {
    std::size_t least = 0;  ///< Since there has been a backlog.
    double since_s = 0.0;   ///< When they became so few.
  };

  struct Source {
    std::optional<Backlog> backlog;
    ros::Time newest;           ///< Its last stamp.
    double last_put_s = 0.0;    ///< When that came, or the first cloud of any.
    double gap_s = 0.0;         ///< Between its last two.
    std::size_t num_bytes = 0;  ///< That wait.
    bool has_spoken = false;
    bool is_off_clock = false;  ///< tf has forgotten the time of its last cloud.
    bool has_named_clock = false;
    std::optional<double> said_waiting_s;
    const Entry* blocked = nullptr;  ///< In update(): tf does not reach it, nor what is later.
  };

  void refuse(std::size_t source, DropReason reason);
  void insert(const SensorMessage& cloud);
  void noteStamp(const SensorMessage& cloud, double now_s);
  [[nodiscard]] Entries::iterator placeOf(const SensorMessage& cloud);
  void update();
  /// @return false when the cloud has to go.
  [[nodiscard]] bool updateEntry(Entry& entry, double now_s, DropReason& reason);
  void search(Entry& entry, double now_s);
  static void waitAs(const Entry& blocked, Entry& entry);
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
  mutable std::mutex mutex_;  ///< Guards what follows, and find_poses.
  std::condition_variable wake_;
  bool has_news_ = false;
  bool is_stopped_ = false;
  Entries entries_;  ///< In the order in which they came; of several sources, by stamp.
  std::vector<Source> sources_;
  std::size_t num_bytes_ = 0;
  ros::Time last_taken_;
  std::uint64_t num_out_of_order_ = 0;
};

}  // namespace cuboid_mapping_ros
