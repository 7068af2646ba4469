// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/parameters/parameters.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <stdexcept>

namespace cuboid_mapping_ros {

using P = NodeParameters;

std::vector<ParameterDeclaration> declareWindow() {
  return {
      {"window/frame", "", frame({&P::window, &WindowParameters::frame_id}, true),
       "Frame of the robot. The map around it stays in memory, by the stamps of the clouds. Empty: "
       "the whole map stays."},
      {"window/size", "m",
       number({&P::window, &WindowParameters::config, &WindowConfig::size_m}, 0.1, 1e6),
       "Edge of the window, a cube along the axes of the map."},
      {"window/margin", "m",
       number({&P::window, &WindowParameters::config, &WindowConfig::margin_m}, 0.0, 1e6),
       "The map in memory stays there up to this distance from the window."},
      {"window/outside", "",
       choice<OutsideWindow>({&P::window, &WindowParameters::config, &WindowConfig::outside},
                             {{"keep", OutsideWindow::kKeep},
                              {"forget", OutsideWindow::kForget},
                              {"refuse", OutsideWindow::kRefuse}}),
       "The map outside the window. keep: it is in window/file, and comes back before a beam "
       "reaches it. forget: it becomes unknown. refuse: it becomes unknown, and clouds change "
       "nothing there."},
      {"window/file", "", file({&P::window, &WindowParameters::file}),
       "SQLite file of the map, with window/outside: keep. The node goes on with the map in it, or "
       "makes the file. bag_to_map writes its output instead."},
      {"window/queries", "",
       choice<QueriesOutside>(
           {&P::service_limits, &ServiceLimits::outside},
           {{"refuse", QueriesOutside::kRefuse}, {"load", QueriesOutside::kLoad}}),
       "Service calls about parts of the map that are in window/file only. refuse: the answer says "
       "so, and octomap_full and octomap_binary fail. load: these parts are loaded first."},
  };
}

std::vector<ParameterError> checkWindow(const NodeParameters& parameters) {
  if (!parameters.window.isOn()) return {};
  std::vector<ParameterError> errors;
  if (!parameters.fleet.robots.empty()) {
    errors.push_back({"window/frame",
                      "does not go with merge/robots: their clouds have several places. Remove one "
                      "of them"});
  }
  if (!parameters.window.keeps()) return errors;
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

std::string describePages(std::size_t num_pages) {
  return counted(num_pages, "part") + " of the map, of 64 x 64 x 64 voxels";
}

std::unique_ptr<MapWindow> makeWindow(const NodeParameters& parameters, const CuboidMap& map) {
  const WindowParameters& window = parameters.window;
  if (!window.isOn()) return nullptr;
  // Checked again: a map to start with may come from the command line.
  for (const ParameterError& error : checkWindow(parameters)) {
    throw std::runtime_error(error.key + ' ' + error.message);
  }
  std::unique_ptr<MapStore> store;
  if (window.keeps()) {
    store = openStoreOf({map.config().resolution_m,
                         map.config().sensor_model,
                         map.config().environment,
                         withoutSlash(parameters.frame_id),
                         {}},
                        window.file);
  }
  return std::make_unique<MapWindow>(window.config, std::move(store), map);
}

}  // namespace cuboid_mapping_ros
