# The catkin package: messages, what other packages of a workspace see of it, and where things are installed.
set(packages geometry_msgs message_generation nav_msgs roscpp std_msgs)
if(CUBOID_MAPPING_NODE)
  list(APPEND packages
    diagnostic_msgs diagnostic_updater dynamic_reconfigure laser_geometry map_msgs nodelet pcl_conversions
    pluginlib rosbag rosbag_storage rosgraph_msgs sensor_msgs std_srvs tf2 tf2_eigen tf2_msgs tf2_ros visualization_msgs)
endif()
# The GMock module of Debian 11 remembers that it has found GoogleTest, but defines its targets only
# where it searches: without this, tests do not link after CMake has run again.
unset(GMOCK_FOUND CACHE)
find_package(catkin REQUIRED COMPONENTS ${packages})
find_package(octomap_msgs QUIET)

catkin_python_setup()
add_message_files(FILES AnswerInfo.msg Box.msg CuboidBricks.msg CuboidMapUpdate.msg FullCuboidMap.msg MapCuboid.msg Observation.msg)
add_service_files(FILES
  CastRays.srv CheckBoxes.srv CheckPath.srv CheckPoses.srv FindCorridor.srv FindNearest.srv FindNearestFree.srv
  CorrectPoses.srv GetCuboids.srv GetDistances.srv GetFreeGraph.srv GetFrontiers.srv GetLocks.srv GetMap.srv GetObservations.srv LoadMap.srv MoveMap.srv
  QueryBox.srv SaveMap.srv SetBox.srv)
generate_messages(DEPENDENCIES geometry_msgs nav_msgs std_msgs)
# Debian does not have octomap_msgs: its headers are made of src/octomap_msgs, and not installed.
if(NOT octomap_msgs_FOUND)
  set(octomap_msgs_INCLUDE_DIRS ${CMAKE_BINARY_DIR}/octomap_msgs)
  set(folder ${PROJECT_SOURCE_DIR}/src/octomap_msgs)
  set(octomap_headers)
  foreach(file msg/Octomap.msg srv/GetOctomap.srv srv/BoundingBoxQuery.srv)
    get_filename_component(name ${file} NAME_WE)
    set(header ${octomap_msgs_INCLUDE_DIRS}/octomap_msgs/${name}.h)
    add_custom_command(OUTPUT ${header}
      COMMAND ${CATKIN_ENV} ${PYTHON_EXECUTABLE} ${GENCPP_BIN} ${folder}/${file}
        -p octomap_msgs -o ${octomap_msgs_INCLUDE_DIRS}/octomap_msgs -e ${GENCPP_TEMPLATE_DIR}
        -Ioctomap_msgs:${folder}/msg -Istd_msgs:${std_msgs_MSG_INCLUDE_DIRS}
        -Igeometry_msgs:${geometry_msgs_MSG_INCLUDE_DIRS}
      DEPENDS ${folder}/${file} ${folder}/msg/Octomap.msg VERBATIM)
    list(APPEND octomap_headers ${header})
  endforeach()
  add_custom_target(cuboid_mapping_octomap_msgs DEPENDS ${octomap_headers})
endif()

set(exported cuboid_mapping_core cuboid_mapping_no_return cuboid_mapping_client)
if(zstd_FOUND AND SQLite3_FOUND)
  list(APPEND exported cuboid_mapping_io)
endif()
catkin_package(
  INCLUDE_DIRS include
  LIBRARIES ${exported}
  CATKIN_DEPENDS geometry_msgs message_runtime nav_msgs roscpp std_msgs
  DEPENDS EIGEN3
  CFG_EXTRAS cuboid_mapping-extras.cmake)

set(cuboid_mapping_lib_dir ${CATKIN_PACKAGE_LIB_DESTINATION})
set(cuboid_mapping_bin_dir ${CATKIN_PACKAGE_BIN_DESTINATION})
set(cuboid_mapping_include_dir ${CATKIN_GLOBAL_INCLUDE_DESTINATION})
# Beside the config: Debian's catkin has it elsewhere below /usr.
set(cuboid_mapping_cmake_dir ${CATKIN_PACKAGE_SHARE_DESTINATION}/cmake)
file(STRINGS ${catkin_EXTRAS_DIR}/catkin_package.cmake of_debian REGEX DEBIAN_CMAKE_DIR LIMIT_COUNT 1)
if(of_debian AND CMAKE_INSTALL_PREFIX STREQUAL "/usr" AND CMAKE_LIBRARY_ARCHITECTURE)
  set(cuboid_mapping_cmake_dir ${CATKIN_GLOBAL_LIB_DESTINATION}/cmake/${PROJECT_NAME})
endif()
set(cuboid_mapping_export_dir ${CATKIN_DEVEL_PREFIX}/share/${PROJECT_NAME}/cmake)
set(CUBOID_MAPPING_TESTS ${CATKIN_ENABLE_TESTING})
if(NOT CUBOID_MAPPING_NODE)
  set(CUBOID_MAPPING_TESTS OFF)  # They run the node.
  return()
endif()

catkin_install_python(PROGRAMS python/show_map python/restore_sim_time python/map_fetch python/map_view python/moveit_objects python/check_arguments
  python/publish_transforms examples/explore/explore.py
  DESTINATION ${CATKIN_PACKAGE_BIN_DESTINATION})
cuboid_mapping_link_programs(map_fetch map_view)
install(DIRECTORY launch config rviz DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
install(FILES nodelet_plugins.xml pcl_filter_plugins.xml DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})

if(CUBOID_MAPPING_TESTS)
  # Before the environment of the tests is written down: it leaves out folders that do not exist.
  file(MAKE_DIRECTORY ${CATKIN_DEVEL_PREFIX}/${CATKIN_GLOBAL_PYTHON_DESTINATION}
    ${CATKIN_DEVEL_PREFIX}/lib)
  execute_process(COMMAND ${PYTHON_EXECUTABLE}
    ${CMAKE_BINARY_DIR}/catkin_generated/generate_cached_setup.py)
endif()
