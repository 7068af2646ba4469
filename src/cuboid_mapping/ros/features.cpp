// SPDX-License-Identifier: BSD-3-Clause
// The lists of the features and of the steps of the sensors. One that is removed here, with its folder, is gone:
// scripts/without.
#include "cuboid_mapping/ros/mapping/map_feature.h"
#include "cuboid_mapping/ros/mapping/sensor_step.h"

#include "cuboid_mapping/ros/corrections/pose_corrections.h"
#include "cuboid_mapping/ros/deskew/deskew_step.h"
#include "cuboid_mapping/ros/edits/map_edits.h"
#include "cuboid_mapping/ros/files/map_files.h"
#include "cuboid_mapping/ros/fleet/observation_publisher.h"
#include "cuboid_mapping/ros/fleet/robots_feature.h"
#include "cuboid_mapping/ros/forgetting/forgetting_feature.h"
#include "cuboid_mapping/ros/grids/robot_grid_feature.h"
#include "cuboid_mapping/ros/ground/ground_step.h"
#include "cuboid_mapping/ros/markers/map_markers.h"
#include "cuboid_mapping/ros/moving_points/moving_points_feature.h"
#include "cuboid_mapping/ros/no_returns/no_return_step.h"
#include "cuboid_mapping/ros/octomap_server/octomap_server_feature.h"
#include "cuboid_mapping/ros/planning/planner_services.h"
#include "cuboid_mapping/ros/self_filter/self_filter_step.h"
#include "cuboid_mapping/ros/sharing/map_publisher.h"
#include "cuboid_mapping/ros/start/start_volume.h"
#include "cuboid_mapping/ros/window/window_feature.h"

#include <memory>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

struct StepKind {
  FeatureParameters parameters;
  /// Null if it is off for the source.
  std::unique_ptr<const SensorStep> (*make)(const NodeParameters& parameters,
                                            const SourceParameters& source);
};

template <typename StepT>
StepKind stepOf() {
  return {{&StepT::declare, &StepT::check, &StepT::readReferences},
          [](const NodeParameters& parameters,
             const SourceParameters& source) -> std::unique_ptr<const SensorStep> {
            if (!StepT::isOn(parameters, source)) return nullptr;
            return std::make_unique<StepT>(parameters, source);
          }};
}

/// From a message to beams, in this order.
const std::vector<StepKind>& stepKinds() {
  static const std::vector<StepKind> kKinds{
      stepOf<NoReturnStep>(),    //
      stepOf<DeskewStep>(),      //
      stepOf<SelfFilterStep>(),  //
      stepOf<GroundStep>(),      //
  };
  return kKinds;
}

struct FeatureKind {
  FeatureParameters parameters;
  std::unique_ptr<MapFeature> (*make)(const MapHost& host);  ///< Null if it is off.
};

template <typename FeatureT>
FeatureKind kindOf() {
  return {{&FeatureT::declare, &FeatureT::check, &FeatureT::readReferences},
          [](const MapHost& host) -> std::unique_ptr<MapFeature> {
            if (!FeatureT::isOn(host.parameters)) return nullptr;
            return std::make_unique<FeatureT>(host);
          }};
}

/// In the order in which they are made and called: those that say what the map is come first.
const std::vector<FeatureKind>& featureKinds() {
  static const std::vector<FeatureKind> kKinds{
      kindOf<WindowFeature>(),         //
      kindOf<PoseCorrections>(),       //
      kindOf<MovingPointsFeature>(),   //
      kindOf<ForgettingFeature>(),     //
      kindOf<StartVolume>(),           //
      kindOf<RobotsFeature>(),         //
      kindOf<MapFiles>(),              //
      kindOf<MapMarkers>(),            //
      kindOf<MapPublisher>(),          //
      kindOf<ObservationPublisher>(),  //
      kindOf<MapEdits>(),              //
      kindOf<PlannerServices>(),       //
      kindOf<OctomapServerFeature>(),  //
      kindOf<RobotGridFeature>(),      //
  };
  return kKinds;
}

}  // namespace

const std::vector<FeatureParameters>& featureParameters() {
  static const std::vector<FeatureParameters> kParameters = [] {
    std::vector<FeatureParameters> parameters;
    for (const StepKind& kind : stepKinds()) parameters.push_back(kind.parameters);
    for (const FeatureKind& kind : featureKinds()) parameters.push_back(kind.parameters);
    return parameters;
  }();
  return kParameters;
}

SensorSteps makeSteps(const NodeParameters& parameters, const SourceParameters& source) {
  SensorSteps steps;
  for (const StepKind& kind : stepKinds()) {
    if (auto step = kind.make(parameters, source)) steps.push_back(std::move(step));
  }
  return steps;
}

MapFeatures makeFeatures(const MapHost& host) {
  MapFeatures features;
  for (const FeatureKind& kind : featureKinds()) {
    if (auto feature = kind.make(host)) features.push_back(std::move(feature));
  }
  return features;
}

}  // namespace cuboid_mapping_ros
