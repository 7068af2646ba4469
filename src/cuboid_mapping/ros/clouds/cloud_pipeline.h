// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/conversions/cloud_checks.h"
#include "cuboid_mapping/ros/conversions/cloud_conversions.h"
#include "cuboid_mapping/ros/conversions/sensor_conversions.h"
#include "cuboid_mapping/ros/diagnostics/node_statistics.h"
#include "cuboid_mapping/ros/mapping/kept_history.h"
#include "cuboid_mapping/ros/mapping/tf_poses.h"
#include "cuboid_mapping/ros/parameters/parameters.h"
#include "cuboid_mapping/scan/scan_filter.h"
#include "cuboid_mapping/scan/scan_update.h"

#include <Eigen/Geometry>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Threads for the work on a cloud: the parameter, or one for each core.
[[nodiscard]] int numThreads(const NodeParameters& parameters);

/// Configuration of the map, with the sensor model of the parameters outside the list of sources.
[[nodiscard]] MapConfig makeMapConfig(const NodeParameters& parameters);

/// Converts a message of one source to observed voxels: conversion, ground, filters, ray walk. The node and
/// bag_to_map use it. Not thread-safe.
///
/// Points on the robot (self_filter) are left out first, with their beams. Beams to the ground (filter_ground)
/// free the voxels before their last one, and do not observe that one.
///
/// With keep_clouds scans are made in the frame of the body and rounded, see MapHistory; then the limits apply.
class CloudPipeline {
 public:
  /// @param source  One of sourcesOf().
  CloudPipeline(const NodeParameters& parameters, const SourceParameters& source);

  /// @param statistics  Gets counts and times, also of a cloud that is refused.
  /// @param error  Set when the cloud is refused.
  /// @return Valid until the next call; null when the cloud is refused.
  const ScanUpdate* compute(const SensorMessage& cloud, const CloudPoses& poses,
                            NodeStatistics& statistics, std::optional<CloudError>& error);

  /// Filtered measurements of the last accepted cloud, map frame; one scan for each slice.
  [[nodiscard]] const std::vector<Scan>& scans() const { return scans_; }

  /// The last accepted cloud, for the history; nothing without keep_clouds.
  [[nodiscard]] std::optional<KeptObservation> takeKept(const ros::Time& stamp,
                                                        const CloudPoses& poses);

  /// Warnings about the clouds so far, each once; see CloudChecks.
  [[nodiscard]] std::vector<std::string> takeWarnings() { return checks_.takeWarnings(); }

  /// The map's sensor model, with the source's hit and miss.
  [[nodiscard]] const SensorModel& sensorModel() const { return sensor_model_; }

 private:
  /// A scan in the map, or with keep_clouds in the frame of the body.
  [[nodiscard]] Scan makeScan(const CloudPoints& points, const CloudPoses& poses,
                              NodeStatistics& statistics) const;
  /// Voxels of the robot, for a scan of makeScan().
  [[nodiscard]] std::vector<Eigen::Vector3f> findFreePoints(const CloudPoses& poses,
                                                            const Scan& scan) const;
  /// Keeps scans that are in the frame of the body. @return The scans in the map.
  [[nodiscard]] std::vector<Scan> keep(std::vector<Scan> scans_body,
                                       const Eigen::Isometry3d& T_map_body,
                                       NodeStatistics& statistics);
  void leaveOutRobot(CloudPoints& points, const CloudPoses& poses,
                     NodeStatistics& statistics) const;
  /// Removes and returns the points of the ground within the crop; none without filter_ground.
  [[nodiscard]] std::vector<Eigen::Vector3f> takeGround(CloudPoints& points,
                                                        const CloudPoses& poses,
                                                        NodeStatistics& statistics) const;
  /// One scan, with the ends of beams to the ground, or one for each slice. The first has the free points.
  [[nodiscard]] std::vector<Scan> makeScans(const SensorMessage& cloud, CloudPoints& points,
                                            const CloudPoses& poses,
                                            NodeStatistics& statistics) const;
  /// A scan for each slice. @pre The poses have slices.
  [[nodiscard]] std::vector<Scan> makeSlices(const SensorMessage& cloud, const CloudPoints& points,
                                             const CloudPoses& poses,
                                             NodeStatistics& statistics) const;

  SourceParameters source_;
  std::string map_frame_id_;
  SelfFilterParameters self_filter_;
  Grid grid_;
  double max_beam_m_;
  CloudChecks checks_;
  SensorModel sensor_model_;
  ScanLimits scan_limits_;
  ScanUpdater scan_updater_;
  std::vector<Scan> scans_;
  std::vector<Scan> kept_scans_;  ///< Scans in the frame of the body.
  ScanUpdate used_;               ///< The part of the update that the source's `use` leaves.
};

/// Processing of a sensor's messages, without the topic. Not thread-safe.
struct Source {
  Source(const NodeParameters& node, const SourceParameters& source)
      : parameters(source), frames(node, source), pipeline(node, source) {}

  SourceParameters parameters;
  PoseFrames frames;
  CloudPipeline pipeline;
};

/// One for each of sourcesOf().
[[nodiscard]] std::vector<std::unique_ptr<Source>> makeSources(const NodeParameters& parameters);

}  // namespace cuboid_mapping_ros
