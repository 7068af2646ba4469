// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/clouds/cloud_pipeline.h"

#include "cuboid_mapping/history/cloud_replay.h"
#include "cuboid_mapping/history/kept_clouds.h"
#include "cuboid_mapping/ros/clouds/self_filter.h"

#include <algorithm>
#include <iterator>
#include <thread>
#include <utility>
#include <variant>

namespace cuboid_mapping_ros {
namespace {

/// Computes NodeStatistics::reach_m from a sample of the points whose beams are not too long.
double findReach(const CloudPoints& cloud, const Eigen::Vector3d& sensor_cloud, double max_beam_m) {
  if (cloud.points.empty()) return 0.0;
  constexpr std::size_t kSamples = 1000;
  const std::size_t step = cloud.points.size() / kSamples + 1;
  const Eigen::Vector3f origin = (sensor_cloud - cloud.anchor_cloud).cast<float>();
  std::vector<float> ranges_m;
  ranges_m.reserve(kSamples);
  for (std::size_t i = 0; i < cloud.points.size(); i += step) {
    const float range_m = (cloud.points[i] - origin).norm();
    if (static_cast<double>(range_m) <= max_beam_m) ranges_m.push_back(range_m);
  }
  if (ranges_m.empty()) return 0.0;
  const auto reach = ranges_m.begin() + static_cast<std::ptrdiff_t>(ranges_m.size() * 95 / 100);
  std::nth_element(ranges_m.begin(), reach, ranges_m.end());
  return static_cast<double>(*reach);
}

/// Limits without the crop if the ground filter is on: see CloudPipeline::takeGround().
ScanLimits makeScanLimits(const SourceParameters& source) {
  ScanLimits limits;
  limits.min_range_m = source.min_range_m;
  if (!source.filter_ground) limits.crop_map = source.crop;
  return limits;
}

}  // namespace

int numThreads(const NodeParameters& parameters) {
  if (parameters.threads > 0) return parameters.threads;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

MapConfig makeMapConfig(const NodeParameters& parameters) {
  MapConfig config = parameters.map;
  config.sensor_model = parameters.source.sensor_model;
  config.threads = numThreads(parameters);
  return config;
}

CloudPipeline::CloudPipeline(const NodeParameters& parameters, const SourceParameters& source)
    : source_(source),
      map_frame_id_(parameters.frame_id),
      self_filter_(parameters.self_filter),
      grid_(parameters.map.resolution_m),
      max_beam_m_(kMaxBeamVoxels * parameters.map.resolution_m),
      checks_(source.type == SourceType::kDepthImage, {source.max_range_m, max_beam_m_}),
      sensor_model_(source.sensor_model, parameters.map.environment),
      scan_limits_(makeScanLimits(source)),
      scan_updater_(grid_, BeamRanges{source.max_range_m, source.end_margin_m},
                    numThreads(parameters), parameters.map.beamSampling()) {}

const ScanUpdate* CloudPipeline::compute(const SensorMessage& cloud, const CloudPoses& poses,
                                         NodeStatistics& statistics,
                                         std::optional<CloudError>& error) {
  Stopwatch stopwatch;
  CloudOptions options;
  options.no_return_range_m = source_.no_return_range_m;
  options.no_return_points = source_.no_return_points;
  options.no_return_ranges_m = source_.no_return_ranges_m;
  options.depth_unit_m = source_.depth_unit_m;
  options.T_cloud_sensor = poses.T_map_cloud.inverse() * poses.T_map_sensor;
  options.wants_numbers = source_.deskew;
  auto converted = convert(cloud, options);
  if (const auto* defect = std::get_if<CloudError>(&converted)) {
    error = *defect;
    return nullptr;
  }
  if (source_.deskew && poses.slices.empty()) {
    error = describeError(DropReason::kNoPointTimes, "message", cloud.header(),
                          "it has no time for each point within a second of its stamp, as deskew "
                          "needs: a field time, t, offset_time or timestamp, or a time_increment");
    return nullptr;
  }
  auto& points = std::get<CloudPoints>(converted);
  statistics.num_invalid += points.num_invalid;
  const Eigen::Vector3d sensor_cloud = options.T_cloud_sensor.translation();
  statistics.reach_m = findReach(points, sensor_cloud, max_beam_m_);
  checks_.note(points, sensor_cloud);
  if (source_.sensor_frame.empty()) checks_.noteFrame(cloud.header().frame_id, map_frame_id_);
  scans_ = makeScans(cloud, points, poses, statistics);
  if (poses.body) scans_ = keep(std::move(scans_), poses.body->T_map_body, statistics);
  statistics.convert_time.add(stopwatch.lap());

  const ScanUpdate* update = &scan_updater_.compute(scans_.data(), scans_.size());
  if (source_.use != SourceUse::kBoth) {
    used_ = *update;
    source_.use == SourceUse::kMark ? keepMarks(used_) : keepClears(used_);
    update = &used_;
  }
  statistics.ray_walk_time.add(stopwatch.lap());
  statistics.num_points += update->num_points;
  statistics.num_out_of_range += update->num_out_of_range;
  statistics.num_too_far += update->num_too_far;
  return update;
}

std::vector<Scan> CloudPipeline::makeScans(const SensorMessage& cloud, CloudPoints& points,
                                           const CloudPoses& poses,
                                           NodeStatistics& statistics) const {
  std::vector<Scan> scans;
  if (source_.deskew) {
    scans = makeSlices(cloud, points, poses, statistics);
  } else {
    leaveOutRobot(points, poses, statistics);
    const std::vector<Eigen::Vector3f> ground = takeGround(points, poses, statistics);
    scans.push_back(makeScan(points, poses, statistics));
    scans.back().open_ends = ground;
  }
  if (self_filter_.keep_free) {
    scans.front().free_points = findFreePoints(poses, scans.front());
  }
  return scans;
}

std::vector<Eigen::Vector3f> CloudPipeline::findFreePoints(const CloudPoses& poses,
                                                           const Scan& scan) const {
  if (!poses.body) {
    return findRobotVoxels(self_filter_.parts, poses.T_map_parts, grid_, scan.anchor_map);
  }
  const Eigen::Vector3d anchor_map = poses.T_map_sensor.translation();
  auto points = findRobotVoxels(self_filter_.parts, poses.T_map_parts, grid_, anchor_map);
  const Eigen::Isometry3d T_body_anchor =
      poses.body->T_map_body.inverse() * Eigen::Translation3d(anchor_map);
  for (Eigen::Vector3f& point : points)
    point = (T_body_anchor * point.cast<double>()).cast<float>();
  return points;
}

std::vector<Scan> CloudPipeline::keep(std::vector<Scan> scans_body,
                                      const Eigen::Isometry3d& T_map_body,
                                      NodeStatistics& statistics) {
  kept_scans_ = std::move(scans_body);
  for (Scan& scan : kept_scans_) {
    if (!scan.anchor_map.isZero()) {
      throw std::runtime_error(
          "the sensor is more than 500 m away from keep_clouds/body_frame: name the frame of the "
          "robot that carries it");
    }
    roundScan(scan, grid_.resolution() / kKeptStepsPerVoxel);
  }
  FilterCounts filtered;
  auto scans = placeScans(T_map_body, kept_scans_, scan_limits_, filtered);
  statistics.num_filtered += filtered.num_too_near + filtered.num_outside_crop;
  return scans;
}

std::optional<KeptObservation> CloudPipeline::takeKept(const ros::Time& stamp,
                                                       const CloudPoses& poses) {
  if (!poses.body) return std::nullopt;
  KeptObservation kept;
  kept.cloud.stamp_ns = static_cast<std::int64_t>(stamp.toNSec());
  kept.cloud.T_map_body = poses.body->T_map_body;
  kept.cloud.scans_body = std::move(kept_scans_);
  kept.config.sensor_model = source_.sensor_model;
  kept.config.ranges = {source_.max_range_m, source_.end_margin_m};
  kept.config.limits = scan_limits_;
  kept.config.marks = source_.use != SourceUse::kClear;
  kept.config.clears = source_.use != SourceUse::kMark;
  return kept;
}

std::vector<Scan> CloudPipeline::makeSlices(const SensorMessage& cloud, const CloudPoints& points,
                                            const CloudPoses& poses,
                                            NodeStatistics& statistics) const {
  std::vector<Scan> scans;
  std::vector<CloudPoints> parts =
      divideIntoSlices(points, *readSourceTimes(cloud, source_), poses.slices);
  statistics.num_odd_times += points.points.size() + points.no_returns.size();
  for (const CloudPoints& part : parts) {
    statistics.num_odd_times -= part.points.size() + part.no_returns.size();
  }
  for (std::size_t i = 0; i < parts.size(); ++i) {
    leaveOutRobot(parts[i], poses.slice_poses.at(i), statistics);
    scans.push_back(makeScan(parts[i], poses.slice_poses.at(i), statistics));
  }
  return scans;
}

Scan CloudPipeline::makeScan(const CloudPoints& points, const CloudPoses& poses,
                             NodeStatistics& statistics) const {
  if (poses.body) {
    return toScan(points, poses.body->T_body_cloud, poses.body->T_body_sensor.translation());
  }
  Scan scan = toScan(points, poses.T_map_cloud, poses.T_map_sensor.translation());
  const FilterCounts filtered = filterScan(scan, scan_limits_);
  statistics.num_filtered += filtered.num_too_near + filtered.num_outside_crop;
  return scan;
}

void CloudPipeline::leaveOutRobot(CloudPoints& points, const CloudPoses& poses,
                                  NodeStatistics& statistics) const {
  const Eigen::Isometry3d T_map_points =
      poses.T_map_cloud * Eigen::Translation3d(points.anchor_cloud);
  std::vector<Eigen::Isometry3d> T_part_points;
  for (const Eigen::Isometry3d& T_map_part : poses.T_map_parts) {
    T_part_points.push_back(T_map_part.inverse() * T_map_points);
  }
  statistics.num_on_robot += removePointsOnRobot(self_filter_.parts, T_part_points, points.points);
}

std::vector<Eigen::Vector3f> CloudPipeline::takeGround(CloudPoints& points, const CloudPoses& poses,
                                                       NodeStatistics& statistics) const {
  if (!poses.T_map_base) return {};
  const Eigen::Isometry3d T_base_points =
      poses.T_map_base->inverse() * poses.T_map_cloud * Eigen::Translation3d(points.anchor_cloud);
  // As octomap_server: points outside the limits do not take part in the search for the ground.
  const auto is_outside = [&](const Eigen::Vector3f& point) {
    return !isInside(source_.crop, T_base_points * point.cast<double>());
  };
  const auto end = std::remove_if(points.points.begin(), points.points.end(), is_outside);
  statistics.num_filtered += static_cast<std::uint64_t>(std::distance(end, points.points.end()));
  points.points.erase(end, points.points.end());
  GroundSplit split = splitGround(points.points, T_base_points, source_.ground_filter);
  points.points = std::move(split.others);
  CloudPoints ground;
  ground.anchor_cloud = points.anchor_cloud;
  ground.points = std::move(split.ground);
  return makeScan(ground, poses, statistics).points;
}

std::vector<std::unique_ptr<Source>> makeSources(const NodeParameters& parameters) {
  std::vector<std::unique_ptr<Source>> sources;
  for (const SourceParameters& source : sourcesOf(parameters)) {
    sources.push_back(std::make_unique<Source>(parameters, source));
  }
  return sources;
}

}  // namespace cuboid_mapping_ros
