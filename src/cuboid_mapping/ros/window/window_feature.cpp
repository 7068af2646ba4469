// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/window/window_feature.h"

#include "cuboid_mapping/ros/map/map_storage.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <ros/console.h>

#include <filesystem>
#include <string>

namespace cuboid_mapping_ros {
namespace {

using P = NodeParameters;

/// The edge of the window, from which its margin follows.
ParameterKind sizeKind() {
  ParameterKind kind =
      number({&P::window, &WindowParameters::config, &WindowConfig::size_m}, 0.1, 1e6);
  kind.set = [set = kind.set](P& parameters, const XmlRpc::XmlRpcValue& value) {
    std::string refusal = set(parameters, value);
    WindowConfig& config = parameters.window.config;
    config.margin_m = 0.1 * config.size_m;
    return refusal;
  };
  return kind;
}

}  // namespace

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

std::vector<ParameterDeclaration> WindowFeature::declare() {
  return {
      {"window/frame", "", frame({&P::window, &WindowParameters::frame_id}, true),
       "Frame of the robot. Only the map around it stays in memory. Its position is taken at the "
       "stamp of each cloud. Empty: the whole map stays."},
      {"window/size", "m", sizeKind(),
       "Edge of the window, a cube along the axes of the map. Parts of the map leave memory when "
       "they are farther than a tenth of this from the window."},
      {"window/outside", "",
       choice<OutsideWindow>({&P::window, &WindowParameters::config, &WindowConfig::outside},
                             {{"keep", OutsideWindow::kKeep},
                              {"forget", OutsideWindow::kForget},
                              {"refuse", OutsideWindow::kRefuse}}),
       "What happens to the map outside the window. keep: it moves to window/file, and returns "
       "before a beam reaches it. forget: it becomes unknown. refuse: it becomes unknown, and "
       "clouds do not change it."},
      {"window/file", "", file({&P::window, &WindowParameters::file}),
       "SQLite file of the map, with window/outside: keep. The node continues the map in this "
       "file, or creates it. bag_to_map uses its output file instead."},
      {"window/queries", "",
       choice<QueriesOutside>(
           {&P::service_limits, &ServiceLimits::outside},
           {{"refuse", QueriesOutside::kRefuse}, {"load", QueriesOutside::kLoad}}),
       "Service calls about parts of the map that are in window/file only. refuse: the answer says "
       "so, and octomap_full and octomap_binary fail. load: these parts are loaded first."},
  };
}

std::vector<ParameterError> WindowFeature::check(const LoadedParameters& loaded) {
  const NodeParameters& parameters = loaded.parameters;
  if (!parameters.window.isOn()) return {};
  std::vector<ParameterError> errors;
  if (!parameters.robots.empty()) {
    errors.push_back({"window/frame",
                      "does not go with merge/robots: their clouds have several places. Remove one "
                      "of them"});
  }
  if (!parameters.window.keeps()) {
    if (!parameters.window.file.empty()) {
      errors.push_back({"window/file",
                        "does not go with window/outside: forget or refuse, which keep nothing: "
                        "set that to keep, or remove the file"});
    }
    return errors;
  }
  if (parameters.window.file.empty()) {
    errors.push_back({"window/file",
                      "is empty, but window/outside is keep: name a file, or set window/outside to "
                      "forget"});
  }
  if (parameters.source.forget_after_s > 0.0) {
    errors.push_back({"forget_after",
                      "does not go with window/outside: keep, because voxels on disk would not be "
                      "forgotten: change one of them"});
  }
  if (!parameters.map_file.empty()) {
    errors.push_back(
        {"map_file",
         "does not go with window/outside: keep, which starts with window/file: remove "
         "it, and make window/file of it with map_convert"});
  }
  return errors;
}

}  // namespace cuboid_mapping_ros
