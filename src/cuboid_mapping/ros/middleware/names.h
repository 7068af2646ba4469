// SPDX-License-Identifier: BSD-3-Clause
// Names of topics, services and nodelets before remapping.
#pragma once

namespace cuboid_mapping_ros {

/// Type under which the nodelet is declared in nodelet_plugins.xml.
constexpr char kMappingNodeletType[] = "cuboid_mapping/MappingNodelet";
/// Name of the node unless `__name:=` says otherwise.
constexpr char kNodeName[] = "cuboid_mapping";

// Topics in the namespace of the node.
constexpr char kCloudTopic[] = "cloud_in";                       ///< sensor_msgs/PointCloud2
constexpr char kOccupiedCuboidsTopic[] = "occupied_cuboids";     ///< visualization_msgs/MarkerArray
constexpr char kFreeCuboidsTopic[] = "free_cuboids";             ///< visualization_msgs/MarkerArray
constexpr char kCuboidMapTopic[] = "cuboid_map";                 ///< cuboid_mapping/FullCuboidMap
constexpr char kCuboidMapUpdatesTopic[] = "cuboid_map_updates";  ///< cuboid_mapping/CuboidMapUpdate
constexpr char kObservationsTopic[] = "observations";            ///< cuboid_mapping/Observation
constexpr char kCorrectedPathTopic[] = "corrected_path";         ///< nav_msgs/Path, subscribed
constexpr char kMovingPointsTopic[] = "moving_points";           ///< sensor_msgs/PointCloud2
constexpr char kRobotGridTopic[] = "robot_grid";                 ///< nav_msgs/OccupancyGrid
constexpr char kRobotGridUpdatesTopic[] = "robot_grid_updates";  ///< OccupancyGridUpdate

// Topics of octomap_server in the namespace of the node; the first two are services, too.
constexpr char kOctomapBinaryTopic[] = "octomap_binary";                   ///< octomap_msgs/Octomap
constexpr char kOctomapFullTopic[] = "octomap_full";                       ///< octomap_msgs/Octomap
constexpr char kOccupiedCellsTopic[] = "occupied_cells_vis_array";         ///< MarkerArray
constexpr char kFreeCellsTopic[] = "free_cells_vis_array";                 ///< MarkerArray
constexpr char kPointCloudCentersTopic[] = "octomap_point_cloud_centers";  ///< PointCloud2
constexpr char kProjectedMapTopic[] = "projected_map";  ///< nav_msgs/OccupancyGrid
constexpr char kProjectedMapUpdatesTopic[] =
    "projected_map_updates";  ///< map_msgs/OccupancyGridUpdate

// Services in the private namespace.
constexpr char kQueryBoxService[] = "query_box";                ///< cuboid_mapping/QueryBox
constexpr char kResetService[] = "reset";                       ///< std_srvs/Empty
constexpr char kCheckBoxesService[] = "check_boxes";            ///< cuboid_mapping/CheckBoxes
constexpr char kCheckPathService[] = "check_path";              ///< cuboid_mapping/CheckPath
constexpr char kCheckPosesService[] = "check_poses";            ///< cuboid_mapping/CheckPoses
constexpr char kCastRaysService[] = "cast_rays";                ///< cuboid_mapping/CastRays
constexpr char kNearestService[] = "nearest";                   ///< cuboid_mapping/FindNearest
constexpr char kNearestFreeService[] = "nearest_free";          ///< cuboid_mapping/FindNearestFree
constexpr char kGetCuboidsService[] = "get_cuboids";            ///< cuboid_mapping/GetCuboids
constexpr char kGetFreeGraphService[] = "get_free_graph";       ///< cuboid_mapping/GetFreeGraph
constexpr char kGetDistancesService[] = "get_distances";        ///< cuboid_mapping/GetDistances
constexpr char kGetFrontiersService[] = "get_frontiers";        ///< cuboid_mapping/GetFrontiers
constexpr char kFindCorridorService[] = "find_corridor";        ///< cuboid_mapping/FindCorridor
constexpr char kGetObservationsService[] = "get_observations";  ///< GetObservations
constexpr char kGetMapService[] = "get_map";                    ///< cuboid_mapping/GetMap
constexpr char kCorrectPosesService[] = "correct_poses";        ///< cuboid_mapping/CorrectPoses
constexpr char kGetLocksService[] = "get_locks";                ///< cuboid_mapping/GetLocks
constexpr char kUndoEditService[] = "undo_edit";                ///< std_srvs/Trigger
constexpr char kSetBoxService[] = "set_box";                    ///< cuboid_mapping/SetBox
constexpr char kPauseService[] = "pause";                       ///< std_srvs/SetBool
constexpr char kClearBoxService[] = "clear_bbx";                ///< octomap_msgs/BoundingBoxQuery
constexpr char kLoadMapService[] = "load_map";                  ///< cuboid_mapping/LoadMap
constexpr char kMoveMapService[] = "move_map";                  ///< cuboid_mapping/MoveMap
constexpr char kSaveMapService[] = "save_map";                  ///< cuboid_mapping/SaveMap

// Names of dynamic_reconfigure in the private namespace.
constexpr char kSetParametersService[] = "set_parameters";  ///< Reconfigure
constexpr char kRefusedName[] = "refused";  ///< Name of the answer's text with the reason.
constexpr char kParameterDescriptionsTopic[] = "parameter_descriptions";  ///< ConfigDescription
constexpr char kParameterUpdatesTopic[] = "parameter_updates";            ///< Config

}  // namespace cuboid_mapping_ros
