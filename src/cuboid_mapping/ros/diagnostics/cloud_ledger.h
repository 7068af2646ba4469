// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/diagnostics/node_statistics.h"
#include "cuboid_mapping/ros/diagnostics/speed_advice.h"
#include "cuboid_mapping/ros/middleware/rate_limit.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <ros/time.h>
#include <std_msgs/Header.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Counts of the messages of one source since the start of the node.
struct SourceStatistics {
  std::uint64_t num_received = 0;  ///< Messages without those beyond max_rate, ...
  std::uint64_t num_ignored = 0;   ///< ... which are counted here.
  std::uint64_t num_inserted = 0;
  std::uint64_t num_dropped = 0;
  std::string last_drop;  ///< Reason and cure of the last drop; empty: none was dropped.
};

/// Counts each message on arrival, and its outcome, so that every loss has its cause. Thread-safe.
class CloudLedger {
 public:
  using Clock = std::chrono::steady_clock;

  struct Source {
    SourceStatistics statistics;
    std::optional<double> rate_hz;
    Clock::time_point last_received = Clock::now();
  };

  /// A copy of all counts.
  struct Page {
    NodeStatistics statistics;
    std::vector<Source> sources;
    std_msgs::Header last_header;  ///< Header of the last message, ...
    std::size_t last_source = 0;   ///< ... its source, ...
    ros::Time last_arrival;        ///< ... and its arrival.
    Clock::time_point last_received;
    Clock::time_point last_progress;  ///< Time of the last insertion, or of the first cloud.
    std::optional<std::string> speed_advice;
  };

  explicit CloudLedger(const NodeParameters& parameters);

  /// Counts a message. @return false if it is beyond max_rate, and to be ignored.
  [[nodiscard]] bool noteReceived(std::size_t source, const std_msgs::Header& header);
  /// Notes that a received message is in the map. @param work  Figures of the points and times of all clouds so far.
  void noteInserted(std::size_t source, const NodeStatistics& work, double duration_s);
  /// Notes that a received message is not in the map; logs why, the same reason every 10 s at most. Throws nothing.
  /// @param text  Empty: nothing new to log.
  void noteDropped(std::size_t source, DropReason reason, const std::string& text) noexcept;
  /// Logs now and then settings that would keep up, or suit the sensor. @param is_behind  Clouds wait for their turn.
  void giveAdvice(bool is_behind);

  /// Sets parameters that were changed while the node runs.
  void setParameters(const NodeParameters& parameters);

  [[nodiscard]] Page page() const;

 private:
  mutable std::mutex mutex_;
  Page page_;
  std::vector<RateLimit> rate_limits_;
  SpeedWatch speed_watch_;
  bool is_behind_ = false;
  bool has_suggested_ = false;
  std::optional<Clock::time_point> last_advice_;
  std::array<std::optional<Clock::time_point>, kNumDropReasons> last_logged_;
};

}  // namespace cuboid_mapping_ros
