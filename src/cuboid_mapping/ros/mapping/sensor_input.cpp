// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/mapping/sensor_input.h"

#include "cuboid_mapping/history/cloud_replay.h"
#include "cuboid_mapping/history/kept_clouds.h"
#include "cuboid_mapping/ros/conversions/point_bytes.h"
#include "cuboid_mapping/ros/diagnostics/diagnostics.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <variant>

namespace cuboid_mapping_ros {
namespace {

/// Computes CloudFigures::reach_m from a sample of the points whose beams are not too long.
double findReach(const CloudPoints& cloud, const Eigen::Vector3d& sensor_cloud, double max_beam_m) {
  if (cloud.points.empty()) return 0.0;
  constexpr std::size_t kSamples = 1000;
  const std::size_t step = sampleStep(cloud.points.size(), kSamples);
  const Eigen::Vector3f origin = (sensor_cloud - cloud.anchor_cloud).cast<float>();
  std::vector<float> ranges_m;
  ranges_m.reserve(cloud.points.size() / step + 1);
  for (std::size_t i = 0; i < cloud.points.size(); i += step) {
    const float range_m = (cloud.points[i] - origin).norm();
    if (static_cast<double>(range_m) <= max_beam_m) ranges_m.push_back(range_m);
  }
  if (ranges_m.empty()) return 0.0;
  return static_cast<double>(quantileOf(ranges_m, 95));
}

/// The poses of the frames of a step. @param first  Moves on to the next step's.
StepPoses posesOf(const SensorStep& step, const CloudPoses& poses, std::size_t& first) {
  const auto begin = poses.T_map_steps.begin() + static_cast<std::ptrdiff_t>(first);
  first += step.frames().size();
  if (first > poses.T_map_steps.size()) throw std::logic_error("the poses are of other steps");
  return {begin, poses.T_map_steps.begin() + static_cast<std::ptrdiff_t>(first)};
}

/// Limits without the crop if the ground filter is on, which crops before it looks for the ground.
ScanLimits makeScanLimits(const SourceParameters& source) {
  ScanLimits limits;
  limits.min_range_m = source.min_range_m;
  const MetricBox everything = SourceParameters().crop;
  const bool has_crop =
      source.crop.min_m != everything.min_m || source.crop.max_m != everything.max_m;
  if (has_crop && !source.filter_ground) limits.crop_map = source.crop;
  return limits;
}

BeamRanges beamRangesOf(const SourceParameters& source) {
  return {source.max_range_m, 0.0, source.keep_surfaces};
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

SensorInput::SensorInput(const NodeParameters& parameters, const SourceParameters& source)
    : source_(source),
      map_frame_id_(parameters.frame_id),
      grid_(parameters.map.resolution_m),
      max_beam_m_(kMaxBeamVoxels * parameters.map.resolution_m),
      steps_(makeSteps(parameters, source)),
      checks_(source.type == SourceType::kDepthImage, {source.max_range_m, max_beam_m_}),
      sensor_model_(source.sensor_model, parameters.map.environment),
      scan_limits_(makeScanLimits(source)),
      scan_updater_(grid_, beamRangesOf(source), numThreads(parameters),
                    parameters.map.beamSampling()) {}

Observed SensorInput::compute(const SensorMessage& cloud, const CloudPoses& poses) {
  Stopwatch stopwatch;
  Observed observed;
  CloudFigures& figures = observed.figures;
  CloudOptions options;
  options.length_unit_m = lengthUnitOf(source_);
  options.T_cloud_sensor = poses.T_map_cloud.inverse() * poses.T_map_sensor;
  for (const auto& step : steps_) step->setOptions(options);
  auto converted = convert(cloud, options);
  if (const auto* defect = std::get_if<CloudError>(&converted)) observed.error = *defect;
  for (const auto& step : steps_) {
    if (!observed.error) observed.error = step->refuse(cloud, poses.slices);
  }
  if (observed.error) return observed;
  auto& points = std::get<CloudPoints>(converted);
  for (const auto& step : steps_) {
    std::string warning = step->findWarning(cloud, poses.slices);
    if (!warning.empty()) points.warnings.push_back(std::move(warning));
  }
  figures.num_invalid = points.num_invalid;
  const Eigen::Vector3d sensor_cloud = options.T_cloud_sensor.translation();
  figures.reach_m = findReach(points, sensor_cloud, max_beam_m_);
  checks_.note(points, sensor_cloud);
  if (source_.sensor_frame.empty()) checks_.noteFrame(cloud.header().frame_id, map_frame_id_);
  scans_ = makeScans(cloud, std::move(points), poses, figures);
  if (poses.body) scans_ = keep(std::move(scans_), poses.body->T_map_body, figures);
  figures.convert_ms = stopwatch.lap();

  observed.update = &scan_updater_.compute(scans_.data(), scans_.size());
  if (source_.use != SourceUse::kBoth) {
    used_ = *observed.update;
    source_.use == SourceUse::kMark ? keepMarks(used_) : keepClears(used_);
    observed.update = &used_;
  }
  figures.ray_walk_ms = stopwatch.lap();
  figures.num_points = observed.update->num_points;
  figures.num_out_of_range = observed.update->num_out_of_range;
  figures.num_too_far = observed.update->num_too_far;
  has_left_points_ = has_left_points_ || figures.num_points > 0;
  const std::string why_none = describeNothingLeft(figures);
  if (!has_left_points_ && !why_none.empty()) checks_.noteWarnings({why_none});
  return observed;
}

std::vector<Scan> SensorInput::makeScans(const SensorMessage& cloud, CloudPoints points,
                                         const CloudPoses& poses, CloudFigures& figures) {
  std::vector<Scan> scans;
  if (poses.slices.empty()) {
    scans.push_back(makeScan(std::move(points), poses, figures));
  } else {
    std::vector<CloudPoints> parts = divide(cloud, points, poses);
    checks_.noteWarnings(parts.front().warnings);
    figures.num_odd_times = points.points.size() + points.no_returns.size();
    for (std::size_t i = 0; i < parts.size(); ++i) {
      figures.num_odd_times -= parts[i].points.size() + parts[i].no_returns.size();
      scans.push_back(makeScan(std::move(parts[i]), poses.slice_poses.at(i), figures));
    }
  }
  scans.front().free_points = findFreePoints(poses, scans.front());
  return scans;
}

std::vector<CloudPoints> SensorInput::divide(const SensorMessage& cloud, const CloudPoints& points,
                                             const CloudPoses& poses) const {
  for (const auto& step : steps_) {
    auto parts = step->divide(cloud, points, poses.slices);
    if (!parts.empty()) return parts;
  }
  throw std::logic_error("no step divides the slices");
}

Scan SensorInput::makeScan(CloudPoints points, const CloudPoses& poses,
                           CloudFigures& figures) const {
  SensorPart part{std::move(points), {}, poses.T_map_cloud};
  std::size_t first = 0;
  for (const auto& step : steps_) step->apply(part, posesOf(*step, poses, first), figures);
  Scan scan = place(part.points, poses, figures);
  if (!part.open_ends.empty()) {
    CloudPoints open;
    open.anchor_cloud = part.points.anchor_cloud;
    open.points = std::move(part.open_ends);
    scan.open_ends = place(open, poses, figures).points;
  }
  return scan;
}

Scan SensorInput::place(const CloudPoints& points, const CloudPoses& poses,
                        CloudFigures& figures) const {
  if (poses.body) {
    return toScan(points, poses.body->T_body_cloud, poses.body->T_body_sensor.translation());
  }
  Scan scan = toScan(points, poses.T_map_cloud, poses.T_map_sensor.translation());
  const FilterCounts filtered = filterScan(scan, scan_limits_);
  figures.num_filtered += filtered.num_too_near + filtered.num_outside_crop;
  return scan;
}

std::vector<Eigen::Vector3f> SensorInput::findFreePoints(const CloudPoses& poses,
                                                         const Scan& scan) const {
  const Eigen::Vector3d anchor_map =
      poses.body ? Eigen::Vector3d(poses.T_map_sensor.translation()) : scan.anchor_map;
  std::vector<Eigen::Vector3f> points;
  std::size_t first = 0;
  for (const auto& step : steps_) {
    const auto found = step->findFreePoints(posesOf(*step, poses, first), anchor_map);
    points.insert(points.end(), found.begin(), found.end());
  }
  if (!poses.body) return points;
  const Eigen::Isometry3d T_body_anchor =
      poses.body->T_map_body.inverse() * Eigen::Translation3d(anchor_map);
  for (Eigen::Vector3f& point : points)
    point = (T_body_anchor * point.cast<double>()).cast<float>();
  return points;
}

std::vector<Scan> SensorInput::keep(std::vector<Scan> scans_body,
                                    const Eigen::Isometry3d& T_map_body, CloudFigures& figures) {
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
  figures.num_filtered += filtered.num_too_near + filtered.num_outside_crop;
  return scans;
}

std::optional<KeptObservation> SensorInput::takeKept(const SensorMessage& cloud,
                                                     const CloudPoses& poses) {
  if (!poses.body) return std::nullopt;
  KeptObservation kept;
  kept.cloud.stamp_ns = static_cast<std::int64_t>(cloud.header().stamp.toNSec());
  kept.cloud.T_map_body = poses.body->T_map_body;
  kept.cloud.scans_body = std::move(kept_scans_);
  kept.config.sensor_model = source_.sensor_model;
  kept.config.ranges = beamRangesOf(source_);
  kept.config.limits = scan_limits_;
  kept.config.marks = source_.use != SourceUse::kClear;
  kept.config.clears = source_.use != SourceUse::kMark;
  return kept;
}

Slices findSlices(const SensorSteps& steps, const SensorMessage& message) {
  Slices slices;
  for (const auto& step : steps) {
    if (slices.empty()) slices = step->findSlices(message);
  }
  return slices;
}

std::vector<std::unique_ptr<Source>> makeSources(const NodeParameters& parameters,
                                                 const std::atomic<bool>* is_cancelled) {
  std::vector<std::unique_ptr<Source>> sources;
  for (const SourceParameters& source : sourcesOf(parameters)) {
    sources.push_back(std::make_unique<Source>(parameters, source));
    if (is_cancelled != nullptr) sources.back()->input.cancelWhen(*is_cancelled);
  }
  return sources;
}

}  // namespace cuboid_mapping_ros
