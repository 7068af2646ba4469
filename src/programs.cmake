if(NOT (Boost_FOUND AND PNG_FOUND AND TARGET cuboid_mapping_io))
  cuboid_mapping_left_out("programs for files of maps" "libboost-program-options-dev libpng-dev")
  return()
endif()

# What command-line programs share: no ROS in it.
add_library(cuboid_mapping_command_line STATIC
  tools/command_line.cpp
  tools/progress_bar.cpp)
cuboid_mapping_configure(cuboid_mapping_command_line)
target_include_directories(cuboid_mapping_command_line PUBLIC tools)
target_link_libraries(cuboid_mapping_command_line PUBLIC cuboid_mapping::core Boost::program_options)

# Programs for files of maps.
add_library(cuboid_mapping_map_tools STATIC
  tools/box_output.cpp
  tools/box_scenes.cpp
  tools/map_comparison.cpp
  tools/map_content.cpp
  tools/pictures/map_picture.cpp
  tools/pictures/picture_cells.cpp
  tools/pictures/picture_legend.cpp)
cuboid_mapping_configure(cuboid_mapping_map_tools)
target_include_directories(cuboid_mapping_map_tools PUBLIC tools)
target_link_libraries(cuboid_mapping_map_tools PUBLIC cuboid_mapping::io PRIVATE PNG::PNG)
foreach(source map_compare map_convert map_info map_merge pictures/map_render)
  get_filename_component(target ${source} NAME)
  add_executable(${target} tools/${source}.cpp)
  cuboid_mapping_configure(${target})
  target_link_libraries(${target} PRIVATE cuboid_mapping_map_tools cuboid_mapping_command_line)
endforeach()
if(TARGET cuboid_mapping_scans)
  target_compile_definitions(map_convert PRIVATE CUBOID_MAPPING_READS_CLOUDS)
  target_link_libraries(map_convert PRIVATE cuboid_mapping::scans)
endif()
cuboid_mapping_install_programs(map_compare map_convert map_info map_merge map_render)

# A map without ROS and without a data set.
add_executable(simulated_map tools/simulation/simulated_map.cpp)
cuboid_mapping_configure(simulated_map)
target_link_libraries(simulated_map PRIVATE cuboid_mapping_map_tools cuboid_mapping_simulation cuboid_mapping_command_line)
cuboid_mapping_install_programs(simulated_map)

if(NOT CUBOID_MAPPING_NODE)
  return()
endif()

# Input for the node: a simulated lidar, and data sets of scans as messages, and as rosbags.
add_library(cuboid_mapping_scan_messages STATIC tools/scan_messages.cpp)
cuboid_mapping_configure(cuboid_mapping_scan_messages)
target_include_directories(cuboid_mapping_scan_messages SYSTEM PUBLIC ${catkin_INCLUDE_DIRS})
target_link_libraries(cuboid_mapping_scan_messages PUBLIC cuboid_mapping::data_sets ${roscpp_LIBRARIES})
add_executable(simulated_lidar
  tools/bag_output.cpp
  tools/simulation/simulated_drive.cpp
  tools/simulation/simulated_lidar.cpp
  tools/simulation/simulated_lidar_node.cpp
  tools/simulation/simulated_sensors.cpp)
add_executable(scans_to_bag
  tools/bag_output.cpp
  tools/scans_to_bag.cpp)
foreach(target simulated_lidar scans_to_bag)
  cuboid_mapping_configure(${target})
  target_include_directories(${target} SYSTEM PRIVATE ${catkin_INCLUDE_DIRS})
endforeach()
target_link_libraries(simulated_lidar
  cuboid_mapping::io cuboid_mapping_simulation cuboid_mapping_command_line
  ${roscpp_LIBRARIES} ${rosbag_storage_LIBRARIES} ${tf2_ros_LIBRARIES})
target_link_libraries(scans_to_bag
  cuboid_mapping::io cuboid_mapping_scan_messages cuboid_mapping_command_line
  ${roscpp_LIBRARIES} ${rosbag_storage_LIBRARIES} ${tf2_ros_LIBRARIES})

# Messages of bags; map_convert reads the map that a node published.
add_library(cuboid_mapping_bag_files STATIC tools/bag_files.cpp)
cuboid_mapping_configure(cuboid_mapping_bag_files)
target_include_directories(cuboid_mapping_bag_files SYSTEM PUBLIC ${catkin_INCLUDE_DIRS})
target_link_libraries(cuboid_mapping_bag_files
  PUBLIC cuboid_mapping::core ${roscpp_LIBRARIES} ${rosbag_storage_LIBRARIES})
target_sources(map_convert PRIVATE tools/recorded_map.cpp)
target_compile_definitions(map_convert PRIVATE CUBOID_MAPPING_READS_BAGS)
target_link_libraries(map_convert PRIVATE cuboid_mapping_bag_files cuboid_mapping::client)

# A bag into a file of a map.
add_library(cuboid_mapping_bag_clouds STATIC
  tools/bag_clouds.cpp
  tools/bag_poses.cpp
  tools/bag_sources.cpp
  tools/bag_topics.cpp
  tools/bag_transforms.cpp
  tools/pose_file.cpp
  tools/yaml_parameters.cpp)
cuboid_mapping_configure(cuboid_mapping_bag_clouds)
target_include_directories(cuboid_mapping_bag_clouds SYSTEM PRIVATE ${YAML_CPP_INCLUDE_DIR})
target_link_libraries(cuboid_mapping_bag_clouds
  PUBLIC cuboid_mapping_bag_files cuboid_mapping_ros cuboid_mapping_map_tools cuboid_mapping_command_line
    cuboid_mapping_scan_messages
  PRIVATE ${YAML_CPP_LIBRARIES})
add_executable(bag_to_map tools/bag_to_map.cpp)
cuboid_mapping_configure(bag_to_map)
target_link_libraries(bag_to_map PRIVATE cuboid_mapping_bag_clouds)
if(cuboid_mapping_has_extras)
  find_package(MPI QUIET COMPONENTS C)
endif()
if(MPI_C_FOUND)
  add_executable(bag_to_map_mpi
    tools/mpi/bag_to_map_mpi.cpp
    tools/mpi/brick_owner.cpp
    tools/mpi/cloud_parts.cpp
    tools/mpi/mpi_checkpoint.cpp
    tools/mpi/mpi_output.cpp
    tools/mpi/mpi_ranks.cpp)
  cuboid_mapping_configure(bag_to_map_mpi)
  target_compile_definitions(bag_to_map_mpi PRIVATE OMPI_SKIP_MPICXX)  # Its C++ interface is none of MPI 3.
  target_link_libraries(bag_to_map_mpi PRIVATE cuboid_mapping_bag_clouds nlohmann_json::nlohmann_json MPI::MPI_C)
  cuboid_mapping_install_extras(bag_to_map_mpi)
elseif(cuboid_mapping_has_extras)
  cuboid_mapping_left_out(bag_to_map_mpi "libopenmpi-dev openmpi-bin")
endif()

# An example of a planner, which follows the map: made of what is exported, as a user's would be.
add_executable(example_planner tools/example_planner.cpp)
cuboid_mapping_configure(example_planner)
target_link_libraries(example_planner PRIVATE cuboid_mapping::client ${tf2_ros_LIBRARIES})

# For scripts/reference.
add_executable(print_parameters tools/print_parameters.cpp tools/parameter_pages.cpp)
cuboid_mapping_configure(print_parameters)
target_link_libraries(print_parameters PRIVATE cuboid_mapping_ros cuboid_mapping_command_line)

cuboid_mapping_install_programs(bag_to_map scans_to_bag)
install(TARGETS example_planner print_parameters simulated_lidar RUNTIME DESTINATION ${cuboid_mapping_bin_dir})
