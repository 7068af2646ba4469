# The peers of compare_maps that are built where their headers are found.

set(CUBOID_MAPPING_PEER_SOURCES)
set(CUBOID_MAPPING_PEER_INCLUDE_DIRS)
set(CUBOID_MAPPING_PEER_LIBRARIES)
set(CUBOID_MAPPING_PEER_TABLE)

# cuboid_mapping_add_peer(NAME MAKER NEEDS INCLUDE_DIRS LIBRARIES): with peers/NAME_adapter.cpp, which defines
# MAKER, if CUBOID_MAPPING_HAS_NAME; else peers.cpp knows what it NEEDS.
macro(cuboid_mapping_add_peer name maker needs include_dirs libraries)
  string(TOUPPER ${name} upper_name)
  if(CUBOID_MAPPING_HAS_${upper_name})
    set(peer_maker ${maker})
    list(APPEND CUBOID_MAPPING_PEER_SOURCES peers/${name}_adapter.cpp)
    list(APPEND CUBOID_MAPPING_PEER_INCLUDE_DIRS ${include_dirs})
    list(APPEND CUBOID_MAPPING_PEER_LIBRARIES ${libraries})
    message(STATUS "compare_maps: with ${name}")
  else()
    set(peer_maker nullptr)
    message(STATUS "compare_maps: without ${name} (needs ${needs})")
  endif()
  string(APPEND CUBOID_MAPPING_PEER_TABLE "{\"${name}\", ${peer_maker}, \"${needs}\"},\n")
endmacro()

# Not with OpenVDB's own FindOpenVDB.cmake, which lies elsewhere with every distribution, and asks for libraries that
# are not needed here.
find_path(OPENVDB_INCLUDE_DIR openvdb/openvdb.h)
find_library(OPENVDB_LIBRARY openvdb)
find_library(TBB_LIBRARY tbb)
find_library(HALF_LIBRARY NAMES Half Imath-3_1 Imath)  # numbers of 16 bits: of OpenEXR 2, whose Imath has none, or 3
mark_as_advanced(OPENVDB_INCLUDE_DIR OPENVDB_LIBRARY TBB_LIBRARY HALF_LIBRARY)
set(OPENVDB_LIBRARIES ${OPENVDB_LIBRARY} ${TBB_LIBRARY})
if(HALF_LIBRARY)
  list(APPEND OPENVDB_LIBRARIES ${HALF_LIBRARY})
endif()
if(OPENVDB_INCLUDE_DIR AND OPENVDB_LIBRARY AND TBB_LIBRARY AND NOT CUBOID_MAPPING_HAS_OPENVDB)
  try_compile(CUBOID_MAPPING_HAS_OPENVDB
    ${CMAKE_CURRENT_BINARY_DIR}/openvdb ${CMAKE_CURRENT_SOURCE_DIR}/try_openvdb.cpp
    CMAKE_FLAGS -DINCLUDE_DIRECTORIES=${OPENVDB_INCLUDE_DIR}
    LINK_LIBRARIES ${OPENVDB_LIBRARIES}
    CXX_STANDARD 17 CXX_STANDARD_REQUIRED ON)
endif()
cuboid_mapping_add_peer(openvdb makeOpenvdbAdapter libopenvdb-dev "${OPENVDB_INCLUDE_DIR}" "${OPENVDB_LIBRARIES}")

find_path(BONXAI_INCLUDE_DIR bonxai/bonxai.hpp)
find_path(BONXAI_MAP_INCLUDE_DIR bonxai_map/probabilistic_map.hpp)
find_library(BONXAI_MAP_LIBRARY bonxai_map)
mark_as_advanced(BONXAI_INCLUDE_DIR BONXAI_MAP_INCLUDE_DIR BONXAI_MAP_LIBRARY)
set(CUBOID_MAPPING_HAS_BONXAI ${BONXAI_INCLUDE_DIR})
cuboid_mapping_add_peer(bonxai makeBonxaiAdapter "bonxai_core of Bonxai" "${BONXAI_INCLUDE_DIR}" "")
if(BONXAI_MAP_INCLUDE_DIR AND BONXAI_MAP_LIBRARY)
  set(CUBOID_MAPPING_HAS_BONXAI_MAP ${CUBOID_MAPPING_HAS_BONXAI})
endif()
cuboid_mapping_add_peer(bonxai_map makeBonxaiMapAdapter "bonxai_core and bonxai_map of Bonxai"
  "${BONXAI_MAP_INCLUDE_DIR}" "${BONXAI_MAP_LIBRARY}")

find_package(ufomap 1 CONFIG QUIET)
set(CUBOID_MAPPING_HAS_UFOMAP ${ufomap_FOUND})
cuboid_mapping_add_peer(ufomap makeUfomapAdapter "UFOMap 1.0" "" UFO::Map)

find_path(WAVEMAP_INCLUDE_DIR wavemap/core/map/hashed_chunked_wavelet_octree.h)
find_library(WAVEMAP_LIBRARY wavemap_core)
find_path(GLOG_INCLUDE_DIR glog/logging.h)
find_library(GLOG_LIBRARY glog)
mark_as_advanced(WAVEMAP_INCLUDE_DIR WAVEMAP_LIBRARY GLOG_INCLUDE_DIR GLOG_LIBRARY)
if(WAVEMAP_INCLUDE_DIR AND WAVEMAP_LIBRARY AND GLOG_INCLUDE_DIR AND GLOG_LIBRARY)
  set(CUBOID_MAPPING_HAS_WAVEMAP TRUE)
endif()
cuboid_mapping_add_peer(wavemap makeWavemapAdapter "wavemap 2 and libgoogle-glog-dev"
  "${WAVEMAP_INCLUDE_DIR};${GLOG_INCLUDE_DIR}" "${WAVEMAP_LIBRARY};${GLOG_LIBRARY}")

find_package(ohm CONFIG QUIET)
set(CUBOID_MAPPING_HAS_OHM ${ohm_FOUND})
set(CUBOID_MAPPING_HAS_OHM_RAYS ${ohm_FOUND})
cuboid_mapping_add_peer(ohm makeOhmAdapter "ohm 0.5" "" ohm::ohm)
cuboid_mapping_add_peer(ohm_rays makeOhmRaysAdapter "ohm 0.5" "" ohm::ohm)

find_package(mrpt-maps CONFIG QUIET)
set(CUBOID_MAPPING_HAS_MRPT ${mrpt-maps_FOUND})
cuboid_mapping_add_peer(mrpt makeMrptAdapter libmrpt-maps-dev "" mrpt::maps)

find_path(DMAP_INCLUDE_DIR D-Map/D-Map.h)
find_library(DMAP_LIBRARY dmap_lib)
find_path(FMT_INCLUDE_DIR fmt/color.h)
mark_as_advanced(DMAP_INCLUDE_DIR DMAP_LIBRARY FMT_INCLUDE_DIR)
if(DMAP_INCLUDE_DIR AND DMAP_LIBRARY AND FMT_INCLUDE_DIR)
  set(CUBOID_MAPPING_HAS_DMAP TRUE)
endif()
cuboid_mapping_add_peer(dmap makeDmapAdapter "D-Map and libfmt-dev"
  "${DMAP_INCLUDE_DIR};${FMT_INCLUDE_DIR};${PCL_INCLUDE_DIRS}" "${DMAP_LIBRARY}")

file(GENERATE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/generated/optional_peers.inc CONTENT "${CUBOID_MAPPING_PEER_TABLE}")
