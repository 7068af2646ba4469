// SPDX-License-Identifier: BSD-3-Clause
// The list of the features. One that is removed here, with its folder and its lines in CMake, is gone:
// scripts/without.
#include "cuboid_mapping/ros/mapping/map_feature.h"

#include "cuboid_mapping/ros/corrections/pose_corrections.h"
#include "cuboid_mapping/ros/edits/map_edits.h"
#include "cuboid_mapping/ros/files/map_files.h"
#include "cuboid_mapping/ros/fleet/observation_publisher.h"
#include "cuboid_mapping/ros/fleet/robots_feature.h"
#include "cuboid_mapping/ros/forgetting/forgetting_feature.h"
#include "cuboid_mapping/ros/grids/robot_grid_feature.h"
#include "cuboid_mapping/ros/mapping/map_markers.h"
#include "cuboid_mapping/ros/octomap_server/octomap_server_feature.h"
#include "cuboid_mapping/ros/planning/planner_services.h"
#include "cuboid_mapping/ros/sharing/map_publisher.h"
#include "cuboid_mapping/ros/window/window_feature.h"

#include <memory>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

struct FeatureKind {
  FeatureParameters parameters;
  std::unique_ptr<MapFeature> (*make)(const MapHost& host);  ///< Null if it is off.
};

template <typename FeatureT>
FeatureKind kindOf() {
  return {{&FeatureT::declare, &FeatureT::check},
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
      kindOf<ForgettingFeature>(),     //
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
    for (const FeatureKind& kind : featureKinds()) parameters.push_back(kind.parameters);
    return parameters;
  }();
  return kParameters;
}

MapFeatures makeFeatures(const MapHost& host) {
  MapFeatures features;
  for (const FeatureKind& kind : featureKinds()) {
    if (auto feature = kind.make(host)) features.push_back(std::move(feature));
  }
  return features;
}

}  // namespace cuboid_mapping_ros
