// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/history/map_history.h"
#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/ros/diagnostics/node_statistics.h"
#include "cuboid_mapping/ros/middleware/core_names.h"
#include "cuboid_mapping/window/map_window.h"

#include <diagnostic_updater/DiagnosticStatusWrapper.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {

/// Figures of the map for the diagnostics.
struct MapSummary {
  std::uint64_t revision = 0;
  CuboidCounts cuboids;
  double num_free_voxels = 0.0;
  double num_occupied_voxels = 0.0;
  std::size_t num_bytes = 0;  ///< Size of voxels and R-tree.
};

/// Summaries of a changing map, for successive reports.
///
/// Counting reads all cuboids and their memory while no cloud can be inserted. It therefore takes at most a
/// twentieth of the time; in between, summaries have the previous counts.
class MapWatch {
 public:
  using ClockS = std::function<double()>;

  /// @param clock_s  Seconds of a clock that does not jump.
  explicit MapWatch(ClockS clock_s) : clock_s_(std::move(clock_s)) {}

  /// @complexity O(n) if cuboids are counted.
  [[nodiscard]] MapSummary summarize(const CuboidMap& map);

 private:
  ClockS clock_s_;
  CuboidCounts counts_;
  std::size_t num_bytes_ = 0;
  std::optional<std::uint64_t> counted_revision_;
  double next_count_s_ = 0.0;
};

/// Facts about the last received cloud.
struct LastCloud {
  std::string frame_id;
  double age_s = 0.0;  ///< Age at reception, by its stamp; negative: the stamp is ahead.
  bool has_stamp = true;
};

/// Cloud rate of a source.
struct SourceRate {
  std::string name;  ///< Name; empty if there is one source.
  double rate_hz = 0.0;
};

/// Content of one report.
struct NodeReport {
  NodeStatistics statistics;
  MapSummary map;
  std::string cloud_topic;  ///< Topics after remapping, separated by commas; robots' by spaces.
  std::string frame_id;     ///< Frame of the map.
  std::optional<LastCloud> last_cloud;
  std::optional<WindowFigures> window;        ///< Only with a window.
  std::uint64_t num_new_window_failures = 0;  ///< Failures since the last report.
  std::optional<HistoryFigures> kept;         ///< Kept clouds; only with keep_clouds.
  std::string kept_error;                     ///< See KeptHistory::error().
  std::size_t num_publishers = 0;             ///< Publishers of the cloud topics.
  bool is_published = false;  ///< A topic without a publisher has one at the master.
  std::string wrong_types;    ///< See describeWrongType(); set only before the first message.
  std::string other_topics;  ///< See NodeSources::otherTopics(); set only before the first message.
  /// Time from the arrival of the last cloud in the map until it was in the map.
  double lag_s = 0.0;
  LastDrops last_drops;
  std::string why_waiting;         ///< See CloudQueue::whyWaiting().
  bool is_simulated_time = false;  ///< use_sim_time, as with bags.
  bool is_paused = false;          ///< ~pause: clouds are ignored.
  double silence_s = 0.0;          ///< Time since the last cloud, or since the start of the node.
  double starved_s = 0.0;  ///< Time since the last insertion or empty cloud, or the first cloud.
  std::uint64_t num_built = 0;    ///< Number of messages built for the topics of octomap_server.
  std::vector<SourceRate> rates;  ///< Cloud rate of each source.
  std::optional<std::string> speed_advice;  ///< See SpeedWatch::advice().
  std::string autosave_error;          ///< Error of the last save to autosave_file; empty: none.
  std::uint64_t num_failures = 0;      ///< Callbacks that an exception has ended.
  std::uint64_t num_new_failures = 0;  ///< Failures since the last report.
  std::string last_failure;            ///< Text of the last failure; see CallbackGuard.
};

/// Silence after which missing clouds are a warning, and then an error.
constexpr double kMaxSilence_s = 5.0;
constexpr double kErrorSilence_s = 30.0;
/// kMaxSilence_s, or three periods of a slower sensor, whose rate its fourth cloud shows.
[[nodiscard]] inline double maxSilence_s(std::optional<double> rate_hz,
                                         std::uint64_t num_inserted) {
  const bool may_be_slow = !rate_hz && num_inserted > 0 && num_inserted < 4;
  return may_be_slow ? kErrorSilence_s : std::max(kMaxSilence_s, 3.0 / rate_hz.value_or(1.0));
}
/// Time after which it is an error that clouds arrive, but none is inserted.
constexpr double kMaxStarved_s = 10.0;
/// Maximum lead of stamps over this machine's clock without a warning.
constexpr double kMaxAhead_s = 0.5;

/// Level of a report, numbered as in diagnostic_msgs/DiagnosticStatus.
enum class ReportLevel : unsigned char { kOk = 0, kWarning = 1, kError = 2 };

/// Level and message of a report.
struct ReportSummary {
  ReportLevel level;
  std::string message;  ///< Fault and cure, or the size of the map.
};

/// The first case that applies:
///   - the map could not be saved to autosave_file: error;
///   - no cloud has ever come: warning, or error if a topic is published with another type;
///   - clouds were dropped since the last report: warning with the most frequent reason, or
///     error if none was inserted for kMaxStarved_s; during a pause always a warning. Empty clouds, and those
///     before the first transform, are no fault;
///   - clouds wait for tf, camera_info or their turn, as at the last report, and none was inserted since: the
///     same levels;
///   - no cloud for maxSilence_s(): warning, or error after kErrorSilence_s if there is a publisher. With
///     simulated time and no publisher left, the recording has ended, and all is well. If all clouds were dropped,
///     the message says why;
///   - stamps are ahead of the clock by more than kMaxAhead_s: warning;
///   - all points so far lie on the robot: warning; limits have left out all: a hint, since there may be nothing else;
///   - else: all is well, with a hint if the stamps are old, as of a bag without simulated time.
[[nodiscard]] ReportSummary summarize(const NodeReport& report, const NodeStatistics& last_report);

/// Which filter has left out all points, and what to check; empty: none has.
[[nodiscard]] std::string describeNothingLeft(const PointCounts& points);

/// A readable duration with either sign: "0.32 s", "50 min", "3 h", "5 days", "9 years".
[[nodiscard]] std::string describeAge(double age_s);

/// Writes a report with one key for each figure; counts of faults only if they have occurred. It is an error, whatever
/// summarize() says, if callbacks or the store of a window have failed since the last report, or kept clouds are lost.
void fillStatus(const NodeReport& report, const NodeStatistics& last_report,
                diagnostic_updater::DiagnosticStatusWrapper& status);

}  // namespace cuboid_mapping_ros
