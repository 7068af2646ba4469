# For packages that find this one: its headers are C++17, and older compilers have C++14 by default.
if(NOT DEFINED CMAKE_CXX_STANDARD OR CMAKE_CXX_STANDARD MATCHES "^(98|11|14)$")
  set(CMAKE_CXX_STANDARD 17)
endif()
# Beside catkin's variables: cuboid_mapping::core, ::io, ::client ...
include(${cuboid_mapping_DIR}/cuboid_mapping-parts.cmake)
