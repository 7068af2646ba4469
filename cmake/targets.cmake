# How targets are made: what all have in common, libraries that other projects use, and what these find.

# A unit for each folder of the ROS layer: without one of them (scripts/without), the others stay as they are, and
# ccache has them. Needs CMake 3.18.
function(cuboid_mapping_unite_folders target)
  get_target_property(sources ${target} SOURCES)
  list(FILTER sources INCLUDE REGEX "(^|/)ros/")
  if(NOT sources)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD_MODE GROUP)
  foreach(source IN LISTS sources)
    get_filename_component(folder ${source} DIRECTORY)
    get_filename_component(folder ${folder} NAME)
    set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${folder})
  endforeach()
endfunction()

function(cuboid_mapping_configure target)
  target_compile_features(${target} PUBLIC cxx_std_17)
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR}/src)  # internal headers
  # No contraction to fused multiply-add: the ray walk has OctoMap's arithmetic to the last bit.
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -ffp-contract=off)
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 10)
    # g++ 9 warns when an empty std::optional is copied.
    target_compile_options(${target} PRIVATE -Wno-maybe-uninitialized)
  endif()
  # Sources of a target share no name of an unnamed namespace.
  if(CUBOID_MAPPING_UNITY)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON)
    if(CUBOID_MAPPING_UNITY STREQUAL WHOLE)
      set_target_properties(${target} PROPERTIES UNITY_BUILD_BATCH_SIZE 0)
    elseif(CUBOID_MAPPING_UNITY STREQUAL FOLDERS)
      cuboid_mapping_unite_folders(${target})
    endif()
    # Said of types in unnamed namespaces of every source that is not the unit itself.
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
  endif()
  if(CUBOID_MAPPING_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  if(CUBOID_MAPPING_FUZZ)  # The fuzzers learn from what they have run through.
    target_compile_options(${target} PRIVATE -fsanitize=fuzzer-no-link)
  endif()
  get_target_property(type ${target} TYPE)
  if(type STREQUAL SHARED_LIBRARY AND NOT CUBOID_MAPPING_SANITIZE AND NOT CUBOID_MAPPING_FUZZ)
    target_link_options(${target} PRIVATE LINKER:--no-undefined)  # Not all linkers say it when they link a program.
  endif()
  if(CUBOID_MAPPING_SANITIZE)
    target_compile_options(${target} PUBLIC
      -fsanitize=${CUBOID_MAPPING_SANITIZE} -fno-omit-frame-pointer)
    target_link_options(${target} PUBLIC -fsanitize=${CUBOID_MAPPING_SANITIZE})
    # Eigen would switch its allocator under ASan, and not fit the installed PCL.
    target_compile_definitions(${target} PUBLIC EIGEN_MALLOC_ALREADY_ALIGNED=1)
  endif()
endfunction()

# A library for other projects, which they link as cuboid_mapping::PART. What it takes from the system is found again
# by those who use it (cmake/find_parts.cmake), so that no path of this machine is installed.
function(cuboid_mapping_add_part part)
  set(target cuboid_mapping_${part})
  add_library(${target} ${ARGN})
  add_library(cuboid_mapping::${part} ALIAS ${target})
  cuboid_mapping_configure(${target})
  target_include_directories(${target} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${cuboid_mapping_include_dir}>)
  set_target_properties(${target} PROPERTIES
    EXPORT_NAME ${part}
    POSITION_INDEPENDENT_CODE ON
    VERSION ${PROJECT_VERSION}
    SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})  # Before 1.0 each 0.x may break what 0.y had.
  install(TARGETS ${target} EXPORT ${target}
    ARCHIVE DESTINATION ${cuboid_mapping_lib_dir}
    LIBRARY DESTINATION ${cuboid_mapping_lib_dir}
    RUNTIME DESTINATION ${cuboid_mapping_bin_dir})
  install(EXPORT ${target} NAMESPACE cuboid_mapping:: DESTINATION ${cuboid_mapping_cmake_dir})
  export(EXPORT ${target} NAMESPACE cuboid_mapping:: FILE ${cuboid_mapping_export_dir}/${target}.cmake)
  set_property(GLOBAL APPEND PROPERTY cuboid_mapping_parts ${part})
endfunction()

# Says what a build leaves out: cuboid_mapping_left_out(PART PACKAGE), a package of Debian.
function(cuboid_mapping_left_out part package)
  message(STATUS "cuboid_mapping: without ${part} (install ${package} to have it)")
endfunction()

# Lets a shell find programs that are installed where rosrun looks for them.
function(cuboid_mapping_link_programs)
  foreach(program IN LISTS ARGN)
    install(CODE "
      set(bin \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CATKIN_GLOBAL_BIN_DESTINATION}\")
      file(MAKE_DIRECTORY \"\${bin}\")
      execute_process(COMMAND \${CMAKE_COMMAND} -E create_symlink
        ../${CATKIN_PACKAGE_BIN_DESTINATION}/${program} \"\${bin}/${program}\")")
  endforeach()
endfunction()

# Installed programs that a user types.
function(cuboid_mapping_install_programs)
  install(TARGETS ${ARGN} RUNTIME DESTINATION ${cuboid_mapping_bin_dir})
  if(CUBOID_MAPPING_ROS)
    cuboid_mapping_link_programs(${ARGN})
  endif()
endfunction()

# Programs that few need: built with CUBOID_MAPPING_ALL, by tests that run them, or by name.
function(cuboid_mapping_install_extras)
  if(NOT CUBOID_MAPPING_ALL)
    set_target_properties(${ARGN} PROPERTIES EXCLUDE_FROM_ALL ON)
  endif()
  install(TARGETS ${ARGN} RUNTIME DESTINATION ${cuboid_mapping_bin_dir} OPTIONAL)
endfunction()

# Headers, and the files with which find_package(cuboid_mapping) finds the parts; after all parts.
function(cuboid_mapping_install_config)
  get_property(CUBOID_MAPPING_PARTS GLOBAL PROPERTY cuboid_mapping_parts)
  list(JOIN CUBOID_MAPPING_PARTS " " CUBOID_MAPPING_PARTS)
  message(STATUS "cuboid_mapping: libraries ${CUBOID_MAPPING_PARTS}")
  set(files ${cuboid_mapping_export_dir}/cuboid_mapping-parts.cmake)
  configure_file(${PROJECT_SOURCE_DIR}/cmake/find_parts.cmake.in ${files} @ONLY)
  if(NOT CUBOID_MAPPING_ROS)  # catkin writes these two.
    include(CMakePackageConfigHelpers)
    set(config ${cuboid_mapping_export_dir}/cuboid_mapping-config)
    configure_file(${PROJECT_SOURCE_DIR}/cmake/plain_config.cmake.in ${config}.cmake @ONLY)
    write_basic_package_version_file(${config}-version.cmake COMPATIBILITY SameMinorVersion)
    list(APPEND files ${config}.cmake ${config}-version.cmake)
    set(cuboid_mapping_pc_libraries "-lcuboid_mapping_no_return -lcuboid_mapping_core")
    if(TARGET cuboid_mapping_io)
      string(PREPEND cuboid_mapping_pc_libraries "-lcuboid_mapping_io ")
      set(cuboid_mapping_pc_needs "libzstd zlib sqlite3")
    endif()
    configure_file(${PROJECT_SOURCE_DIR}/cmake/plain_package.pc.in ${PROJECT_BINARY_DIR}/cuboid_mapping.pc @ONLY)
    install(FILES ${PROJECT_BINARY_DIR}/cuboid_mapping.pc DESTINATION ${cuboid_mapping_lib_dir}/pkgconfig)
  endif()
  install(FILES ${files} DESTINATION ${cuboid_mapping_cmake_dir})

  set(left_out)
  foreach(part_and_headers client=ros octomap=octomap_parity.h fcl=fcl_obstacles.h)
    string(REGEX MATCH "(.+)=(.+)" match ${part_and_headers})
    if(NOT TARGET cuboid_mapping_${CMAKE_MATCH_1})
      list(APPEND left_out PATTERN ${CMAKE_MATCH_2} EXCLUDE)
    endif()
  endforeach()
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/cuboid_mapping DESTINATION ${cuboid_mapping_include_dir}
    ${left_out})
endfunction()
