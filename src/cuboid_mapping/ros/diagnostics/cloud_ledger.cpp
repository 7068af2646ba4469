// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/diagnostics/cloud_ledger.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/diagnostics/diagnostics.h"
#include "cuboid_mapping/ros/middleware/names.h"

#include <ros/console.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <sstream>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

/// Minimum time before the log repeats a reason for dropping clouds, or an advice.
constexpr std::chrono::seconds kLogPeriod{10};

/// Whether a text may be logged again; if so, notes the time.
bool isDue(std::optional<CloudLedger::Clock::time_point>& last) {
  const auto now = CloudLedger::Clock::now();
  if (last && now - *last < kLogPeriod) return false;
  last = now;
  return true;
}

SpeedWatch makeSpeedWatch(const NodeParameters& parameters) {
  return SpeedWatch(parameters.map.resolution_m, parameters.source.max_range_m,
                    sourcesOf(parameters).size());
}

/// Clouds of a source from which the rate and the time are taken.
constexpr std::size_t kWindow = 20;

/// Common resolutions.
constexpr std::array<double, 9> kResolutions_m{0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0, 2.0};
constexpr std::array<double, 9> kRanges_m{5.0, 10.0, 15.0, 20.0, 30.0, 40.0, 50.0, 80.0, 100.0};

/// A sensor that reaches farther is used outdoors, or in a hall.
constexpr double kIndoorReach_m = 25.0;
constexpr double kOutdoorResolution_m = 0.2;
constexpr double kOutdoorRange_m = 50.0;

void append(std::deque<double>& values, double value) {
  values.push_back(value);
  if (values.size() > kWindow) values.pop_front();
}

/// A number with two significant digits, or all before the point: "4.3", "10", "1234", "0.25".
std::string twoDigits(double value) {
  return value >= 10.0 ? cuboid_mapping::toText(std::round(value))
                       : cuboid_mapping::toText(value, 2);
}

std::string durationText(double duration_s) {
  return duration_s >= 1.0 ? twoDigits(duration_s) + " s" : twoDigits(1e3 * duration_s) + " ms";
}

/// The text after "try". The time of a cloud grows with the number of voxels that its beams
/// pass: with the cube of the range in voxels, as a volume.
std::string remedy(double speedup, double resolution_m, double range_m) {
  const double factor = std::cbrt(speedup);
  const auto* resolution = std::lower_bound(kResolutions_m.begin(), kResolutions_m.end(),
                                            std::max(0.95 * factor, 1.01) * resolution_m);
  const auto* after =
      std::upper_bound(kRanges_m.begin(), kRanges_m.end(), std::min(1.1 / factor, 0.99) * range_m);
  std::string text;
  if (resolution != kResolutions_m.end()) text = "resolution " + twoDigits(*resolution);
  if (after != kRanges_m.begin()) {
    text += (text.empty() ? "" : " or ") + std::string("sensor_model/max_range ") +
            twoDigits(*(after - 1));
  }
  return text.empty() ? "fewer or smaller clouds" : text;
}

}  // namespace

CloudLedger::CloudLedger(const NodeParameters& parameters)
    : speed_watch_(makeSpeedWatch(parameters)) {
  const bool has_clouds = parameters.robots.empty();  // All observations of robots enter the map.
  for (const SourceParameters& source : sourcesOf(parameters)) {
    rate_limits_.emplace_back(has_clouds ? source.max_rate_hz : 0.0);
  }
  figures_.sources.resize(rate_limits_.size());
  figures_.last_progress = Clock::now();
}

bool CloudLedger::noteReceived(std::size_t source, const std_msgs::Header& header) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Source& of = figures_.sources.at(source);
  of.last_received = Clock::now();
  of.last_arrival = ros::Time::now();
  if (!rate_limits_.at(source).allows(header.stamp)) {
    ++of.statistics.num_ignored;
    return false;
  }
  ++of.statistics.num_received;
  if (figures_.statistics.num_received++ == 0) figures_.last_progress = of.last_received;
  figures_.last_arrival = of.last_arrival;
  figures_.last_header = header;
  speed_watch_.noteReceived(header.stamp.toSec(), source);
  return true;
}

void CloudLedger::noteInserted(std::size_t source, const CloudFigures& cloud, const Times& times) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++figures_.sources.at(source).statistics.num_inserted;
  figures_.last_progress = Clock::now();
  figures_.statistics.addInserted(cloud);
  figures_.lag_s = times.lag_s;
  speed_watch_.noteInserted(times.work_s, cloud.reach_m, source);
}

void CloudLedger::noteDropped(std::size_t source, DropReason reason,
                              const std::string& text) noexcept {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++figures_.statistics.numDropped(reason);
  SourceStatistics& statistics = figures_.sources.at(source).statistics;
  ++(isEmpty(reason) ? statistics.num_empty : statistics.num_dropped);
  if (isEmpty(reason)) figures_.last_progress = Clock::now();
  try {
    std::string& said = figures_.last_drops.at(static_cast<std::size_t>(reason));
    if (!text.empty()) said = text;
    if (!isEmpty(reason)) {
      statistics.last_drop =
          std::string(toString(reason)) + ": " + (text.empty() ? toAdvice(reason) : text);
    }
    if (text.empty() || !isDue(last_logged_[static_cast<std::size_t>(reason)])) return;
    std::ostringstream line;
    line << (isEmpty(reason) ? "cloud without content, " : "cloud dropped, ") << toString(reason)
         << ": " << (reason == DropReason::kQueueFull ? speed_watch_.advice().value_or(text) : text)
         << " (" << figures_.statistics.numDropped(reason) << " for this reason so far)";
    if (isEmpty(reason) || reason == DropReason::kBeforeTf) {
      ROS_INFO_STREAM_NAMED(kNodeName, line.str());
    } else {
      ROS_WARN_STREAM_NAMED(kNodeName, line.str());
    }
  } catch (...) {
    // There is no memory for the text; the drop is counted.
  }
}

void CloudLedger::giveAdvice(bool is_behind) {
  const std::lock_guard<std::mutex> lock(mutex_);
  is_behind_ = is_behind;
  if (!has_suggested_) {
    if (const auto suggestion = speed_watch_.suggestion()) {
      has_suggested_ = true;
      ROS_INFO_STREAM_NAMED(kNodeName, *suggestion);
    }
  }
  if (!is_behind) return;
  const auto advice = speed_watch_.advice();
  if (!advice || !isDue(last_advice_)) return;
  ROS_WARN_STREAM_NAMED(kNodeName, "too slow for these clouds: " << *advice);
}

void CloudLedger::setParameters(const NodeParameters& parameters) {
  const std::lock_guard<std::mutex> lock(mutex_);
  speed_watch_ = makeSpeedWatch(parameters);
}

CloudLedger::Figures CloudLedger::figures() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  Figures figures = figures_;
  for (std::size_t i = 0; i < figures.sources.size(); ++i) {
    figures.sources[i].rate_hz = speed_watch_.rateHz(i);
  }
  if (is_behind_) figures.speed_advice = speed_watch_.advice();
  return figures;
}

SpeedWatch::SpeedWatch(double resolution_m, double max_range_m, std::size_t num_sources)
    : resolution_m_(resolution_m), max_range_m_(max_range_m), sources_(num_sources) {}

void SpeedWatch::noteReceived(double stamp_s, std::size_t source) {
  std::deque<double>& times_s = sources_.at(source).times_s;
  const double time_s =
      1e-9 * static_cast<double>(clock_.note(std::llround(1e9 * stamp_s), source));
  if (times_s.empty() || time_s > times_s.back()) append(times_s, time_s);
}

void SpeedWatch::noteInserted(double duration_s, double reach_m, std::size_t source) {
  append(sources_.at(source).durations_s, duration_s);
  reach_m_ = std::max(reach_m_, reach_m);
  ++num_inserted_;
}

std::optional<double> SpeedWatch::rateHz(std::size_t source) const {
  const std::deque<double>& times_s = sources_.at(source).times_s;
  if (times_s.size() < 3) return std::nullopt;
  std::vector<double> periods_s;
  for (std::size_t i = 1; i < times_s.size(); ++i) periods_s.push_back(times_s[i] - times_s[i - 1]);
  std::sort(periods_s.begin(), periods_s.end());
  // Pauses do not count. Where more periods are long, several sensors send at once.
  constexpr std::size_t kMostPauses = 2;
  for (std::size_t count = 1; count <= std::min(kMostPauses, periods_s.size() - 1); ++count) {
    const std::size_t num_others = periods_s.size() - count;
    if (periods_s[num_others] <= 3.0 * periods_s[num_others - 1]) continue;
    periods_s.resize(num_others);
    break;
  }
  return static_cast<double>(periods_s.size()) /
         std::accumulate(periods_s.begin(), periods_s.end(), 0.0);
}

SpeedWatch::Load SpeedWatch::load() const {
  Load load;
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    const std::deque<double>& durations_s = sources_[i].durations_s;
    const auto rate = rateHz(i);
    if (!rate || durations_s.empty()) continue;
    load.rate_hz += *rate;
    load.share += *rate * std::accumulate(durations_s.begin(), durations_s.end(), 0.0) /
                  static_cast<double>(durations_s.size());
  }
  return load;
}

std::optional<std::string> SpeedWatch::advice() const {
  const bool is_rate_known = std::any_of(sources_.begin(), sources_.end(), [](const auto& source) {
    return source.times_s.size() == kWindow;
  });
  const Load now = load();
  if (!is_rate_known || now.share <= 1.0) return std::nullopt;
  return durationText(now.share / now.rate_hz) + " per cloud at " + twoDigits(now.rate_hz) +
         " Hz: try " + remedy(now.share, resolution_m_, std::min(max_range_m_, reach_m_));
}

std::optional<std::string> SpeedWatch::suggestion() const {
  if (num_inserted_ < kFirstClouds || reach_m_ <= kIndoorReach_m || load().share < kSmallLoad) {
    return std::nullopt;
  }
  std::string text;
  if (resolution_m_ < 0.5 * kOutdoorResolution_m) {
    text =
        "resolution " + twoDigits(kOutdoorResolution_m) + " (now " + twoDigits(resolution_m_) + ")";
  }
  if (std::isinf(max_range_m_) && reach_m_ > kOutdoorRange_m) {
    text += (text.empty() ? "" : " and ") + std::string("sensor_model/max_range ") +
            twoDigits(kOutdoorRange_m) + " (now without limit)";
  }
  if (text.empty()) return std::nullopt;
  return "the clouds reach " + twoDigits(reach_m_) + " m; a good start for such a sensor: " + text;
}

double silenceOf(const CloudLedger::Source& source, std::size_t num_publishers) {
  const bool follows_clock = ros::Time::isSimTime() && num_publishers > 0;
  if (!follows_clock || source.last_arrival.isZero()) return secondsSince(source.last_received);
  return ros::Time::now().toSec() - source.last_arrival.toSec();
}

}  // namespace cuboid_mapping_ros
