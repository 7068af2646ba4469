// SPDX-License-Identifier: BSD-3-Clause
// Names of topics, services and nodelets, as they are before remapping.
#pragma once

namespace cuboid_mapping_ros {

/// Type under which the nodelet is declared in nodelet_plugins.xml.
constexpr char kMappingNodeletType[] = "cuboid_mapping/MappingNodelet";
/// Name of the node unless `__name:=` says otherwise.
constexpr char kNodeName[] = "cuboid_mapping";

// In the namespace of the node.
constexpr char kCloudTopic[] = "cloud_in";                    ///< sensor_msgs/PointCloud2
constexpr char kOccupiedCuboidsTopic[] = "occupied_cuboids";  ///< visualization_msgs/MarkerArray
constexpr char kFreeCuboidsTopic[] = "free_cuboids";          ///< visualization_msgs/MarkerArray

// In the private namespace.
constexpr char kQueryBoxService[] = "query_box";  ///< cuboid_mapping/QueryBox
constexpr char kResetService[] = "reset";         ///< std_srvs/Empty

}  // namespace cuboid_mapping_ros
