// SPDX-License-Identifier: BSD-3-Clause
// The seam between the message of a sensor and the beams that enter the map. features.cpp lists the steps.
#pragma once

#include "cuboid_mapping/ros/conversions/cloud_conversions.h"
#include "cuboid_mapping/ros/conversions/cloud_error.h"
#include "cuboid_mapping/ros/conversions/sensor_conversions.h"
#include "cuboid_mapping/ros/diagnostics/node_statistics.h"
#include "cuboid_mapping/ros/mapping/tf_poses.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"
#include "cuboid_mapping/ros/parameters/parameters.h"
#include "cuboid_mapping/scan/scan.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Poses of the frames of one step, in the order of SensorStep::frames().
using StepPoses = std::vector<Eigen::Isometry3d>;

/// Points of a message that were measured at one time.
struct SensorPart {
  CloudPoints points;
  std::vector<Eigen::Vector3f> open_ends;  ///< See Scan::open_ends; positions as in `points`.
  Eigen::Isometry3d T_map_cloud;           ///< Pose of the points.
};

/// A step on the way from a message to beams, with parameters of its own. Each source has its steps; a step that is
/// off is not there. The functions are called in the order in which they stand here; thread-safe.
class SensorStep {
 public:
  SensorStep() = default;
  virtual ~SensorStep() = default;
  SensorStep(const SensorStep&) = delete;
  SensorStep& operator=(const SensorStep&) = delete;

  // Each step has a constructor and a static `bool isOn`, both with (const NodeParameters&, const SourceParameters&).
  // It hides these if it has parameters; see FeatureParameters.
  [[nodiscard]] static std::vector<ParameterDeclaration> declare() { return {}; }
  [[nodiscard]] static std::vector<ParameterError> check(const LoadedParameters& /*loaded*/) {
    return {};
  }
  static void readReferences(NodeParameters& /*parameters*/, const FindText& /*find_text*/) {}

  /// Frames whose poses it needs.
  [[nodiscard]] virtual std::vector<StepFrame> frames() const { return {}; }
  /// The slices of a message whose points have their own poses; empty: all have the pose of the stamp.
  [[nodiscard]] virtual Slices findSlices(const SensorMessage& /*message*/) const { return {}; }
  /// Sets what it needs of the conversion of messages.
  virtual void setOptions(CloudOptions& /*options*/) const {}
  /// Why the message cannot be mapped.
  [[nodiscard]] virtual std::optional<CloudError> refuse(const SensorMessage& /*message*/,
                                                         const Slices& /*slices*/) const {
    return std::nullopt;
  }
  /// A warning about a message that is mapped; else empty.
  [[nodiscard]] virtual std::string findWarning(const SensorMessage& /*message*/,
                                                const Slices& /*slices*/) const {
    return {};
  }
  /// Points of each slice, and warnings in the first; empty: the next step is asked. Called if a step has found slices.
  [[nodiscard]] virtual std::vector<CloudPoints> divide(const SensorMessage& /*message*/,
                                                        const CloudPoints& /*points*/,
                                                        const Slices& /*slices*/) const {
    return {};
  }
  /// Takes points out of a part. @param poses  Those of the time of the part.
  virtual void apply(SensorPart& /*part*/, const StepPoses& /*poses*/,
                     CloudFigures& /*figures*/) const {}
  /// Voxels that are free without a beam: their centres, relative to `anchor_map`. @param poses  Those of the stamp.
  [[nodiscard]] virtual std::vector<Eigen::Vector3f> findFreePoints(
      const StepPoses& /*poses*/, const Eigen::Vector3d& /*anchor_map*/) const {
    return {};
  }
};

using SensorSteps = std::vector<std::unique_ptr<const SensorStep>>;

/// The steps of a source, in the order of the list.
[[nodiscard]] SensorSteps makeSteps(const NodeParameters& parameters,
                                    const SourceParameters& source);

/// The slices that the first of the steps finds. Thread-safe.
[[nodiscard]] Slices findSlices(const SensorSteps& steps, const SensorMessage& message);

}  // namespace cuboid_mapping_ros
