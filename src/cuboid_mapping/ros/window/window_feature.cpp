// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/window/window_feature.h"

#include "cuboid_mapping/ros/mapping/map_storage.h"
#include "cuboid_mapping/ros/middleware/names.h"

#include <ros/console.h>

#include <filesystem>

namespace cuboid_mapping_ros {

WindowFeature::WindowFeature(const MapHost& host) : map_(host.map) {
  const WindowParameters& window = host.parameters.window;
  const bool is_continued = window.keeps() && hasMap(window.file);
  if (window.keeps() && !is_continued) {
    std::filesystem::remove(locksFile(window.file));  // Of a map that is gone.
  }
  host.map.setWindow([&](CuboidMap& map) { return makeWindow(host.parameters, map); });
  if (window.keeps()) lockAsSaved(host.map, window.file);
  if (is_continued) ROS_INFO_STREAM_NAMED(kNodeName, "goes on with the map of " << window.file);
}

void WindowFeature::report(NodeReport& report) {
  report.window = map_.windowFigures();
  report.num_new_window_failures = report.window->num_failures - num_reported_failures_;
  num_reported_failures_ = report.window->num_failures;
}

}  // namespace cuboid_mapping_ros
