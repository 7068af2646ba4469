# The map: Eigen and threads, nothing else.
cuboid_mapping_add_part(core
  cuboid_mapping/boxes/box_cover.cpp
  cuboid_mapping/boxes/box_merger.cpp
  cuboid_mapping/boxes/cover_exchange.cpp
  cuboid_mapping/boxes/free_boxes.cpp
  cuboid_mapping/boxes/joined_cuboids.cpp
  cuboid_mapping/boxes/passages.cpp
  cuboid_mapping/fusion/cuboid_tree.cpp
  cuboid_mapping/fusion/fusion_kind.cpp
  cuboid_mapping/fusion/growing_bricks.cpp
  cuboid_mapping/fusion/growth_fusion.cpp
  cuboid_mapping/fusion/growth_rules.cpp
  cuboid_mapping/geometry/grid.cpp
  cuboid_mapping/geometry/compiler_flags.cpp
  cuboid_mapping/geometry/voxel_motion.cpp
  cuboid_mapping/io/brick_codec.cpp
  cuboid_mapping/io/map_file_error.cpp
  cuboid_mapping/map/config_check.cpp
  cuboid_mapping/map/cuboid_map.cpp
  cuboid_mapping/map/cuboid_search.cpp
  cuboid_mapping/map/locked_boxes.cpp
  cuboid_mapping/sharing/map_follower.cpp
  cuboid_mapping/sharing/shared_map_follower.cpp
  cuboid_mapping/map/map_merge.cpp
  cuboid_mapping/map/map_edit.cpp
  cuboid_mapping/map/map_snapshot.cpp
  cuboid_mapping/map/mapper.cpp
  cuboid_mapping/sharing/observation_order.cpp
  cuboid_mapping/occupancy/sensor_model.cpp
  cuboid_mapping/parallel/parallel_for.cpp
  cuboid_mapping/query/body_probe.cpp
  cuboid_mapping/query/box_query.cpp
  cuboid_mapping/query/budget.cpp
  cuboid_mapping/query/corridor_boxes.cpp
  cuboid_mapping/query/corridor_query.cpp
  cuboid_mapping/query/cuboid_query.cpp
  cuboid_mapping/query/distance_field.cpp
  cuboid_mapping/query/fit_field.cpp
  cuboid_mapping/query/fit_query.cpp
  cuboid_mapping/query/frontier_query.cpp
  cuboid_mapping/query/height_range.cpp
  cuboid_mapping/query/motion_query.cpp
  cuboid_mapping/query/near_obstacles.cpp
  cuboid_mapping/query/near_places.cpp
  cuboid_mapping/query/nearest_query.cpp
  cuboid_mapping/query/obstacle_distance.cpp
  cuboid_mapping/query/obstacles.cpp
  cuboid_mapping/query/path_query.cpp
  cuboid_mapping/query/place_graph.cpp
  cuboid_mapping/query/point_query.cpp
  cuboid_mapping/query/pose_lattice.cpp
  cuboid_mapping/query/pose_path.cpp
  cuboid_mapping/query/pose_query.cpp
  cuboid_mapping/query/pose_search.cpp
  cuboid_mapping/query/ray_query.cpp
  cuboid_mapping/query/sphere_query.cpp
  cuboid_mapping/query/value_query.cpp
  cuboid_mapping/rtree/inner_tree.cpp
  cuboid_mapping/rtree/node.cpp
  cuboid_mapping/rtree/quadratic_split.cpp
  cuboid_mapping/scan/beam_marks.cpp
  cuboid_mapping/scan/beam_samples.cpp
  cuboid_mapping/scan/brick_update.cpp
  cuboid_mapping/scan/cloud_columns.cpp
  cuboid_mapping/scan/cloud_faces.cpp
  cuboid_mapping/scan/column_walk.cpp
  cuboid_mapping/scan/face_beams.cpp
  cuboid_mapping/scan/ray_batch.cpp
  cuboid_mapping/scan/ray_walk.cpp
  cuboid_mapping/scan/scan.cpp
  cuboid_mapping/scan/scan_filter.cpp
  cuboid_mapping/scan/scan_update.cpp
  cuboid_mapping/scan/slab_beams.cpp
  cuboid_mapping/scan/slab_walk.cpp
  cuboid_mapping/scan/surface_margins.cpp
  cuboid_mapping/scan/void_space.cpp
  cuboid_mapping/voxels/brick_cuboids.cpp
  cuboid_mapping/voxels/packed_voxels.cpp
  cuboid_mapping/voxels/uniform_boxes.cpp
  cuboid_mapping/voxels/voxel_store.cpp)
target_link_libraries(cuboid_mapping_core PUBLIC Eigen3::Eigen Threads::Threads)
# Its threads live until the program ends, so it must not be unloaded with a nodelet.
target_link_options(cuboid_mapping_core PRIVATE -Wl,-z,nodelete)
# Each alone: sources with vectors, and the work on a cloud, whose speed depends on what the compiler inlines.
# A WHOLE unit is for builds that need no speed.
if(NOT CUBOID_MAPPING_UNITY STREQUAL WHOLE)
  get_target_property(alone cuboid_mapping_core SOURCES)
  list(FILTER alone INCLUDE REGEX "/(scan|voxels)/")
  set_source_files_properties(${alone} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endif()

# Square roots of what is never negative, in loops that become vectors.
set_source_files_properties(cuboid_mapping/scan/cloud_faces.cpp PROPERTIES
  COMPILE_OPTIONS "-fno-math-errno;-fno-trapping-math")

# Where beams without a return went, as sensors lay out their clouds: knows no map.
cuboid_mapping_add_part(no_return
  cuboid_mapping/no_return/no_return_beams.cpp
  cuboid_mapping/no_return/spherical_layout.cpp)
target_link_libraries(cuboid_mapping_no_return PUBLIC Eigen3::Eigen)

# Files of maps, and windows with a store on disk.
if(zstd_FOUND AND ZLIB_FOUND AND SQLite3_FOUND)
  cuboid_mapping_add_part(io
    cuboid_mapping/io/compression.cpp
    cuboid_mapping/io/csv_format.cpp
    cuboid_mapping/io/file_replacement.cpp
    cuboid_mapping/io/map_files.cpp
    cuboid_mapping/io/map_store.cpp
    cuboid_mapping/io/native_format.cpp
    cuboid_mapping/io/octomap_files.cpp
    cuboid_mapping/io/octree_reader.cpp
    cuboid_mapping/io/octree_stream.cpp
    cuboid_mapping/io/point_cloud_files.cpp
    cuboid_mapping/io/scan_update_codec.cpp
    cuboid_mapping/io/sqlite_database.cpp
    cuboid_mapping/window/map_window.cpp
    cuboid_mapping/window/stored_pages.cpp
    cuboid_mapping/history/cloud_replay.cpp
    cuboid_mapping/history/kept_clouds.cpp
    cuboid_mapping/history/map_correction.cpp
    cuboid_mapping/history/map_history.cpp
    cuboid_mapping/history/pose_track.cpp)
  target_link_libraries(cuboid_mapping_io
    PUBLIC cuboid_mapping::core PRIVATE PkgConfig::zstd ZLIB::ZLIB SQLite::SQLite3)
else()
  cuboid_mapping_left_out(io "pkg-config libzstd-dev zlib1g-dev libsqlite3-dev")
endif()

# OctoMap as oracle and peer.
if(octomap_FOUND)
  cuboid_mapping_add_part(octomap cuboid_mapping/interop/octomap_parity.cpp)
  target_include_directories(cuboid_mapping_octomap SYSTEM PUBLIC "$<BUILD_INTERFACE:${OCTOMAP_INCLUDE_DIRS}>")
  target_link_libraries(cuboid_mapping_octomap
    PUBLIC cuboid_mapping::core "$<BUILD_INTERFACE:${OCTOMAP_LIBRARIES}>")
else()
  cuboid_mapping_left_out(octomap liboctomap-dev)
endif()

# Obstacles for the Flexible Collision Library.
if(fcl_FOUND)
  cuboid_mapping_add_part(fcl cuboid_mapping/interop/fcl_obstacles.cpp)
  target_link_libraries(cuboid_mapping_fcl PUBLIC cuboid_mapping::core fcl)
else()
  cuboid_mapping_left_out(fcl "libfcl-dev 0.6 or later")
endif()

# Clouds as maps: PCL reads .pcd.
if(PCL_FOUND)
  cuboid_mapping_add_part(scans cuboid_mapping/io/pcd_file.cpp)
  target_include_directories(cuboid_mapping_scans SYSTEM PRIVATE ${PCL_INCLUDE_DIRS})
  target_link_libraries(cuboid_mapping_scans PUBLIC cuboid_mapping::core PRIVATE ${PCL_LIBRARIES})
else()
  cuboid_mapping_left_out(scans libpcl-dev)
endif()

if(NOT CUBOID_MAPPING_ROS)
  return()
endif()

# For nodes that follow the map of another one.
if(NOT ZLIB_FOUND)
  message(FATAL_ERROR "cuboid_mapping::client needs ZLIB (install zlib1g-dev)")
endif()
cuboid_mapping_add_part(client
  cuboid_mapping/io/packed_bricks.cpp
  cuboid_mapping/ros/cuboid_map_client.cpp
  cuboid_mapping/ros/conversions/map_messages.cpp
  cuboid_mapping/ros/middleware/callback_guard.cpp
  cuboid_mapping/ros/middleware/published_topics.cpp)
add_dependencies(cuboid_mapping_client
  ${cuboid_mapping_EXPORTED_TARGETS} ${catkin_EXPORTED_TARGETS})
target_include_directories(cuboid_mapping_client SYSTEM PUBLIC "$<BUILD_INTERFACE:${catkin_INCLUDE_DIRS}>")
target_link_libraries(cuboid_mapping_client
  PUBLIC cuboid_mapping::core "$<BUILD_INTERFACE:${roscpp_LIBRARIES}>" PRIVATE ZLIB::ZLIB)

if(NOT CUBOID_MAPPING_NODE)
  return()
endif()

# The shape of the robot, for self_filter.
set(left_out_description robot_description_missing)
if(NOT urdf_FOUND OR NOT geometric_shapes_FOUND)
  cuboid_mapping_left_out(self_filter/robot_description "liburdf-dev libgeometric-shapes-dev")
  set(left_out_description robot_description)
  unset(urdf_LIBRARIES)
  unset(geometric_shapes_LIBRARIES)
endif()

# The ROS layer: parameters, conversions, the node, and a folder for each feature of ros/features.cpp.
file(GLOB sources CONFIGURE_DEPENDS RELATIVE ${CMAKE_CURRENT_SOURCE_DIR} cuboid_mapping/ros/features.cpp cuboid_mapping/ros/*/*.cpp)
list(FILTER sources EXCLUDE REGEX
  "/(callback_guard|map_messages|mapping_node_main|nodelet_plugin|published_topics|${left_out_description})\\.cpp$")
add_library(cuboid_mapping_ros ${sources})
# Three units of the same size keep two cores busy to the end of a build.
set_target_properties(cuboid_mapping_ros PROPERTIES UNITY_BUILD_BATCH_SIZE 20)
cuboid_mapping_configure(cuboid_mapping_ros)
target_include_directories(cuboid_mapping_ros
  SYSTEM PUBLIC ${catkin_INCLUDE_DIRS} ${octomap_msgs_INCLUDE_DIRS}
  PRIVATE ${PCL_INCLUDE_DIRS} ${urdf_INCLUDE_DIRS} ${geometric_shapes_INCLUDE_DIRS})
if(TARGET cuboid_mapping_octomap_msgs)
  add_dependencies(cuboid_mapping_ros cuboid_mapping_octomap_msgs)
endif()
target_link_libraries(cuboid_mapping_ros
  PUBLIC cuboid_mapping::client cuboid_mapping::io ${catkin_LIBRARIES}
  PRIVATE cuboid_mapping::no_return PNG::PNG ${PCL_COMMON_LIBRARIES} ${PCL_SAMPLE_CONSENSUS_LIBRARIES} ${urdf_LIBRARIES}
    ${geometric_shapes_LIBRARIES} nlohmann_json::nlohmann_json ${CMAKE_DL_LIBS})
if(BUILD_SHARED_LIBS)
  # Loaded when it is needed, from where the others are.
  add_dependencies(cuboid_mapping_ros cuboid_mapping_scans)
  target_compile_definitions(cuboid_mapping_ros PRIVATE
    CUBOID_MAPPING_SCANS_LIBRARY="$<TARGET_SONAME_FILE_NAME:cuboid_mapping_scans>")
else()
  target_link_libraries(cuboid_mapping_ros PRIVATE cuboid_mapping::scans)
endif()

# The nodelet, and the node that runs it.
add_library(cuboid_mapping_nodelet cuboid_mapping/ros/node/nodelet_plugin.cpp)
cuboid_mapping_configure(cuboid_mapping_nodelet)
target_link_libraries(cuboid_mapping_nodelet PUBLIC cuboid_mapping_ros)
add_executable(cuboid_mapping_node cuboid_mapping/ros/node/mapping_node_main.cpp)
cuboid_mapping_configure(cuboid_mapping_node)
target_link_libraries(cuboid_mapping_node PRIVATE cuboid_mapping_nodelet)
set_target_properties(cuboid_mapping_ros cuboid_mapping_nodelet PROPERTIES
  VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
install(TARGETS cuboid_mapping_ros cuboid_mapping_nodelet cuboid_mapping_node
  ARCHIVE DESTINATION ${cuboid_mapping_lib_dir}
  LIBRARY DESTINATION ${cuboid_mapping_lib_dir}
  RUNTIME DESTINATION ${cuboid_mapping_bin_dir})
