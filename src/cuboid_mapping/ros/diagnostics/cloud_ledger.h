// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/diagnostics/node_statistics.h"
#include "cuboid_mapping/ros/middleware/rate_limit.h"
#include "cuboid_mapping/ros/middleware/stamp_clock.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <ros/time.h>
#include <std_msgs/Header.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Watches the rate, time and reach of the clouds of each source, and suggests parameters. Not
/// thread-safe.
class SpeedWatch {
 public:
  /// @param max_range_m  Limit of the beams; infinity: none.
  explicit SpeedWatch(double resolution_m,
                      double max_range_m = std::numeric_limits<double>::infinity(),
                      std::size_t num_sources = 1);

  /// Notes an arrived cloud, also if it is dropped later. Stamps that jump, see StampClock.
  void noteReceived(double stamp_s, std::size_t source = 0);
  /// Notes a cloud in the map. @param reach_m  See CloudFigures::reach_m.
  void noteInserted(double duration_s, double reach_m, std::size_t source = 0);

  /// Rate of a source over its last clouds, without gaps from lost clouds; nothing before the third.
  [[nodiscard]] std::optional<double> rateHz(std::size_t source = 0) const;

  /// Settings that would keep up, such as "4.3 s per cloud at 10 Hz: try resolution 0.2 or
  /// sensor_model/max_range 30"; nothing if clouds take less time than there is between them, or too few have
  /// come.
  [[nodiscard]] std::optional<std::string> advice() const;

  /// Parameters that suit a sensor of this reach, if the current ones suit rooms.
  /// Nothing before kFirstClouds clouds are in the map, while clouds take less than kSmallLoad of the time
  /// between them (as planar scans do), or when there is nothing to suggest.
  [[nodiscard]] std::optional<std::string> suggestion() const;

  static constexpr std::size_t kFirstClouds = 5;
  static constexpr double kSmallLoad = 0.1;

 private:
  /// Load of all sources together.
  struct Load {
    double rate_hz = 0.0;
    double share = 0.0;  ///< Processing time of clouds over the time between them.
  };
  [[nodiscard]] Load load() const;

  double resolution_m_;
  double max_range_m_;
  struct Source {
    std::deque<double> times_s;  ///< Of its last clouds, by the clock.
    std::deque<double> durations_s;
  };
  std::vector<Source> sources_;
  StampClock clock_;
  std::size_t num_inserted_ = 0;
  double reach_m_ = 0.0;  ///< Greatest reach of all clouds.
};

/// Counts of the messages of one source since the start of the node.
struct SourceStatistics {
  std::uint64_t num_received = 0;  ///< Messages without those beyond max_rate, ...
  std::uint64_t num_ignored = 0;   ///< ... which are counted here.
  std::uint64_t num_inserted = 0;
  std::uint64_t num_dropped = 0;
  std::uint64_t num_empty = 0;  ///< Messages with nothing to map.
  std::string last_drop;        ///< Reason and cure of the last drop; empty: none was dropped.

  [[nodiscard]] std::uint64_t numWaiting() const {
    return num_received - num_inserted - num_dropped - num_empty;
  }
};

/// Counts each message on arrival, and its outcome, so that every lost cloud has a reason. Thread-safe.
class CloudLedger {
 public:
  using Clock = std::chrono::steady_clock;

  struct Source {
    SourceStatistics statistics;
    std::optional<double> rate_hz;
    /// Arrival of the last message, also if it was ignored, by two clocks. Before it: the start, and 0.
    ///@{
    Clock::time_point last_received = Clock::now();
    ros::Time last_arrival;
    ///@}
  };

  /// A copy of all counts.
  struct Figures {
    NodeStatistics statistics;
    std::vector<Source> sources;
    std_msgs::Header last_header;  ///< Header of the last message, ...
    ros::Time last_arrival;        ///< ... and its arrival.
    /// Time of the last insertion or empty cloud, or of the first cloud.
    Clock::time_point last_progress;
    double lag_s = 0.0;  ///< Of the last cloud in the map.
    LastDrops last_drops;
    std::optional<std::string> speed_advice;
  };

  explicit CloudLedger(const NodeParameters& parameters);

  /// Counts a message. @return false if it is beyond max_rate, and to be ignored.
  [[nodiscard]] bool noteReceived(std::size_t source, const std_msgs::Header& header);
  /// Times of a cloud in the map.
  struct Times {
    double work_s = 0.0;
    double lag_s = 0.0;  ///< From its arrival until it was in the map.
  };
  /// Notes that a received message is in the map.
  void noteInserted(std::size_t source, const CloudFigures& cloud, const Times& times);
  /// Notes that a received message is not in the map; logs why, the same reason every 10 s at most. Throws
  /// nothing.
  /// @param text  Empty: nothing new to log.
  void noteDropped(std::size_t source, DropReason reason, const std::string& text) noexcept;
  /// Logs now and then settings that would keep up, or suit the sensor. @param is_behind  Clouds wait for their
  /// turn.
  void giveAdvice(bool is_behind);

  /// Sets parameters that were changed while the node runs.
  void setParameters(const NodeParameters& parameters);

  [[nodiscard]] Figures figures() const;

 private:
  mutable std::mutex mutex_;
  Figures figures_;
  std::vector<RateLimit> rate_limits_;
  SpeedWatch speed_watch_;
  bool is_behind_ = false;
  bool has_suggested_ = false;
  std::optional<Clock::time_point> last_advice_;
  std::array<std::optional<Clock::time_point>, kNumDropReasons> last_logged_;
};

/// Seconds since a time.
[[nodiscard]] inline double secondsSince(CloudLedger::Clock::time_point time) {
  return std::chrono::duration<double>(CloudLedger::Clock::now() - time).count();
}

/// Seconds since the last message of a source, or since the start. With simulated time and a publisher, in that time: a
/// bag may be paused.
[[nodiscard]] double silenceOf(const CloudLedger::Source& source, std::size_t num_publishers);

}  // namespace cuboid_mapping_ros
