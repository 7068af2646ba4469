// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/conversions/cloud_checks.h"
#include "cuboid_mapping/ros/conversions/cloud_conversions.h"
#include "cuboid_mapping/ros/conversions/sensor_conversions.h"
#include "cuboid_mapping/ros/diagnostics/node_statistics.h"
#include "cuboid_mapping/ros/map/kept_history.h"
#include "cuboid_mapping/ros/mapping/sensor_step.h"
#include "cuboid_mapping/ros/mapping/tf_poses.h"
#include "cuboid_mapping/ros/parameters/parameters.h"
#include "cuboid_mapping/scan/scan_filter.h"
#include "cuboid_mapping/scan/scan_update.h"

#include <Eigen/Geometry>

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Threads for the work on a cloud: the parameter, or one for each core.
[[nodiscard]] int numThreads(const NodeParameters& parameters);

/// Configuration of the map, with the sensor model of the parameters outside the list of sources.
[[nodiscard]] MapConfig makeMapConfig(const NodeParameters& parameters);

/// The voxels that a message observes.
struct Observed {
  /// Valid until the next message; null: the message is refused.
  const ScanUpdate* update = nullptr;
  std::optional<CloudError> error;  ///< Why it is refused.
  CloudFigures figures;
};

/// Messages of one source become beams, and beams become observed voxels: conversion, steps (see sensor_step.h), poses,
/// limits, ray walk. The node and bag_to_map use it. Not thread-safe.
///
/// With keep_clouds scans are made in the frame of the body and rounded, see MapHistory; then the limits apply.
class SensorInput {
 public:
  /// @param source  One of sourcesOf().
  SensorInput(const NodeParameters& parameters, const SourceParameters& source);

  [[nodiscard]] Observed compute(const SensorMessage& cloud, const CloudPoses& poses);

  /// Filtered measurements of the last accepted cloud, map frame; one scan for each slice.
  [[nodiscard]] const std::vector<Scan>& scans() const { return scans_; }

  /// The last accepted cloud, for the history; nothing without keep_clouds.
  [[nodiscard]] std::optional<KeptObservation> takeKept(const SensorMessage& cloud,
                                                        const CloudPoses& poses);

  /// Warnings about the clouds so far, each once; see CloudChecks.
  [[nodiscard]] std::vector<std::string> takeWarnings() { return checks_.takeWarnings(); }

  /// Has compute() throw std::runtime_error soon after this has become true.
  void cancelWhen(const std::atomic<bool>& is_cancelled) { scan_updater_.cancelWhen(is_cancelled); }
  /// Does not give again the warnings of the same source before a change of parameters.
  void goOnFrom(const SensorInput& earlier) { checks_.goOnFrom(earlier.checks_); }

  /// findSlices() of its steps.
  [[nodiscard]] Slices findSlices(const SensorMessage& cloud) const {
    return cuboid_mapping_ros::findSlices(steps_, cloud);
  }

  /// The map's sensor model, with the source's hit and miss.
  [[nodiscard]] const SensorModel& sensorModel() const { return sensor_model_; }

 private:
  /// A scan for each slice, or one. The first has the free points.
  [[nodiscard]] std::vector<Scan> makeScans(const SensorMessage& cloud, CloudPoints points,
                                            const CloudPoses& poses, CloudFigures& figures);
  /// Points of the slices of a message.
  [[nodiscard]] std::vector<CloudPoints> divide(const SensorMessage& cloud,
                                                const CloudPoints& points,
                                                const CloudPoses& poses) const;
  /// The scan of points of one time, after all steps.
  [[nodiscard]] Scan makeScan(CloudPoints points, const CloudPoses& poses,
                              CloudFigures& figures) const;
  /// Places points in the map, or with keep_clouds in the frame of the body.
  [[nodiscard]] Scan place(const CloudPoints& points, const CloudPoses& poses,
                           CloudFigures& figures) const;
  /// Points that are free without a beam, for a scan of makeScans().
  [[nodiscard]] std::vector<Eigen::Vector3f> findFreePoints(const CloudPoses& poses,
                                                            const Scan& scan) const;
  /// Keeps scans that are in the frame of the body. @return The scans in the map.
  [[nodiscard]] std::vector<Scan> keep(std::vector<Scan> scans_body,
                                       const Eigen::Isometry3d& T_map_body, CloudFigures& figures);

  SourceParameters source_;
  std::string map_frame_id_;
  Grid grid_;
  double max_beam_m_;
  SensorSteps steps_;
  CloudChecks checks_;
  bool has_left_points_ = false;  ///< The filters have left points of some cloud.
  SensorModel sensor_model_;
  ScanLimits scan_limits_;
  ScanUpdater scan_updater_;
  std::vector<Scan> scans_;
  std::vector<Scan> kept_scans_;  ///< Scans in the frame of the body.
  ScanUpdate used_;               ///< The part of the update that the source's `use` leaves.
};

/// A sensor without its topic. Not thread-safe.
struct Source {
  Source(const NodeParameters& node, const SourceParameters& source)
      : parameters(source), frames(node, source), input(node, source) {}

  SourceParameters parameters;
  PoseFrames frames;
  SensorInput input;
};

/// One for each of sourcesOf(). @param is_cancelled  See ScanUpdater::cancelWhen(); null: never.
[[nodiscard]] std::vector<std::unique_ptr<Source>> makeSources(
    const NodeParameters& parameters, const std::atomic<bool>* is_cancelled = nullptr);

}  // namespace cuboid_mapping_ros
