// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/cloud_checks.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/conversions/point_bytes.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::toText;

/// Number of points of a cloud that are checked.
constexpr std::size_t kCheckedPoints = 1000;
/// Minimum number of points before a source is judged.
constexpr std::size_t kLeastJudgedPoints = 100;
/// Maximum number of points for judging a source: the table of ranges stops growing, and later clouds cost
/// nothing.
constexpr std::size_t kMaxJudgedPoints = 100000;
/// Depth cameras rarely see farther, except in single pixels.
constexpr double kMaxUsualDepth_m = 8.0;
/// Lidars on the ground hardly see half of their points farther away.
constexpr double kMaxUsualRange_m = 150.0;
/// Share of a far clip above which a depth is near it.
constexpr double kNearClip = 0.9;
/// The warning about points beyond max_range.
constexpr char kMaxRange[] = "max range";

std::string percentOf(std::size_t part, std::size_t whole) {
  return std::to_string(100 * part / whole) + " %";
}

}  // namespace

void CloudChecks::note(const CloudPoints& cloud, const Eigen::Vector3d& sensor_cloud) {
  noteWarnings(cloud.warnings);
  if (num_points_ >= kMaxJudgedPoints) return;
  const Eigen::Vector3f origin = (sensor_cloud - cloud.anchor_cloud).cast<float>();
  const std::size_t step = sampleStep(cloud.points.size(), kCheckedPoints);
  std::vector<double> ranges_m;
  for (std::size_t i = 0; i < cloud.points.size(); i += step) {
    const Eigen::Vector3f beam = cloud.points[i] - origin;
    ranges_m.push_back(static_cast<double>(is_depth_ ? beam.z() : beam.norm()));
    const auto range_mm =
        static_cast<std::int64_t>(std::llround(1e3 * std::min(ranges_m.back(), 1e9)));
    const auto length_m = static_cast<double>(beam.norm());
    if (length_m > limits_.max_range_m) ++num_beyond_range_;
    if (length_m > limits_.max_beam_m) {
      ++num_beyond_beam_;
    } else {
      ++counts_[range_mm];
    }
  }
  num_points_ += ranges_m.size();
  if (num_points_ < kLeastJudgedPoints) return;
  checkOneRange();
  checkLimits();
  checkUnit(ranges_m);
}

void CloudChecks::noteFrame(const std::string& frame_id, const std::string& map_frame_id) {
  static const std::set<std::string> kFixed{"map", "odom", "world", "earth", "utm"};
  const std::string name = withoutSlash(frame_id);
  if (name != withoutSlash(map_frame_id) && kFixed.count(name) == 0) return;
  warnOnce("frame",
           "the clouds are in the frame '" + name +
               "', in which nothing moves. If they are a recorded map, leave them out; if "
               "they are transformed clouds of a sensor, set sensor_frame: otherwise beams "
               "start at the origin of '" +
               name + "'");
}

void CloudChecks::noteWarnings(const std::vector<std::string>& warnings) {
  for (const std::string& warning : warnings) warnOnce(warning, warning);
}

void CloudChecks::goOnFrom(const CloudChecks& earlier) {
  said_ = earlier.said_;
  if (limits_.max_range_m != earlier.limits_.max_range_m) said_.erase(kMaxRange);
}

std::vector<std::string> CloudChecks::takeWarnings() { return std::exchange(warnings_, {}); }

void CloudChecks::warnOnce(const std::string& kind, const std::string& text) {
  if (!std::exchange(said_[kind], true)) warnings_.push_back(text);
}

/// Warns if a tenth of the points have one range, as values for no return do.
void CloudChecks::checkOneRange() {
  const auto most =
      std::max_element(counts_.begin(), counts_.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most == counts_.end() || 10 * most->second < num_points_) return;
  if (is_depth_) {
    const auto least_near = static_cast<std::int64_t>(kNearClip * static_cast<double>(most->first));
    const bool is_apart = most != counts_.begin() && counts_.lower_bound(least_near) == most &&
                          std::next(most) == counts_.end();
    if (!is_apart) return;
  }
  const std::string range_m = toText(1e-3 * static_cast<double>(most->first));
  warnOnce("one range", percentOf(most->second, num_points_) + " of the points have one " +
                            (is_depth_ ? "depth" : "range") + ", " + range_m +
                            " m. If this stands for no return, name it: "
                            "sensor_model/no_return_points: \"rep_117 " +
                            range_m + '"');
}

void CloudChecks::checkLimits() {
  if (10 * num_beyond_beam_ >= 9 * num_points_) {
    warnOnce("beam", percentOf(num_beyond_beam_, num_points_) + " of the points are more than " +
                         toText(limits_.max_beam_m) +
                         " m from the start of their beams, which is the origin of the clouds' "
                         "frame: they mark nothing. If the points were transformed into another "
                         "frame, such as utm, set sensor_frame to the sensor's own");
    return;
  }
  if (10 * num_beyond_range_ < 9 * num_points_) return;
  warnOnce(kMaxRange, percentOf(num_beyond_range_, num_points_) +
                          " of the points lie beyond sensor_model/max_range, " +
                          toText(limits_.max_range_m) +
                          " m: nothing there becomes occupied. Raise it, or set length_unit to "
                          "their unit in metres (millimetres: 0.001)");
}

void CloudChecks::checkUnit(std::vector<double>& ranges_m) {
  if (ranges_m.empty()) return;
  const double median_m = quantileOf(ranges_m);
  if (median_m <= (is_depth_ ? kMaxUsualDepth_m : kMaxUsualRange_m)) return;
  warnOnce("unit", std::string("half of the ") + (is_depth_ ? "depths" : "ranges") + " are above " +
                       toText(std::floor(median_m)) + " m, farther than most " +
                       (is_depth_ ? "depth cameras" : "lidars") +
                       " measure. If their unit is another, set length_unit " +
                       (is_depth_ ? "(1/5000 m: 0.0002)" : "(centimetres: 0.01)"));
}

}  // namespace cuboid_mapping_ros
