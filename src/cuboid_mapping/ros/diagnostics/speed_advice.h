// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <deque>
#include <limits>
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

  /// Notes an arrived cloud, also if it is dropped later. Ignores stamps that do not rise.
  void noteReceived(double stamp_s, std::size_t source = 0);
  /// Notes a cloud in the map. @param reach_m  See NodeStatistics::reach_m.
  void noteInserted(double duration_s, double reach_m, std::size_t source = 0);

  /// Rate of a source over its last clouds, without gaps from lost clouds; nothing before the third.
  [[nodiscard]] std::optional<double> rateHz(std::size_t source = 0) const;
  [[nodiscard]] double reach_m() const { return reach_m_; }

  /// Settings that would keep up, such as "4.3 s per cloud at 10 Hz: try resolution 0.2 or sensor_model/max_range
  /// 30"; nothing if clouds take less time than there is between them, or too few have come.
  [[nodiscard]] std::optional<std::string> advice() const;

  /// Parameters that suit a sensor of this reach, if the current ones suit rooms.
  /// Nothing before kFirstClouds clouds are in the map, while clouds take less than kSmallLoad of the time between them
  /// (as planar scans do), or when there is nothing to suggest.
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
    std::deque<double> stamps_s;
    std::deque<double> durations_s;
  };
  std::vector<Source> sources_;
  std::size_t num_inserted_ = 0;
  double reach_m_ = 0.0;  ///< Greatest reach of all clouds.
};

}  // namespace cuboid_mapping_ros
