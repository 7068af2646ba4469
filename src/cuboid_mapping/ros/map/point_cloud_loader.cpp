// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/map/point_cloud_loader.h"

#include "cuboid_mapping/io/pcd_file.h"

#ifdef CUBOID_MAPPING_SCANS_LIBRARY
#include <dlfcn.h>

#include <stdexcept>
#endif

namespace cuboid_mapping_ros {

using namespace cuboid_mapping;

#ifdef CUBOID_MAPPING_SCANS_LIBRARY
MapSnapshot loadPointCloudMap(const std::string& file, double resolution_m,
                              const SensorModelConfig& model) {
  void* library = dlopen(CUBOID_MAPPING_SCANS_LIBRARY, RTLD_NOW);  // Stays loaded.
  void* function = library ? dlsym(library, "cuboid_mapping_read_point_cloud_map") : nullptr;
  if (function == nullptr) {
    throw std::runtime_error("cannot read " + file + ": " + dlerror() +
                             " (Debian: libcuboid-mapping-interop); map_convert makes a .cuboids "
                             "file of it on another machine");
  }
  MapSnapshot snapshot;
  reinterpret_cast<decltype(&cuboid_mapping_read_point_cloud_map)>(function)(file, resolution_m,
                                                                             model, snapshot);
  return snapshot;
}
#else
MapSnapshot loadPointCloudMap(const std::string& file, double resolution_m,
                              const SensorModelConfig& model) {
  return readPointCloudMap(file, resolution_m, model);
}
#endif

}  // namespace cuboid_mapping_ros
