// SPDX-License-Identifier: BSD-3-Clause
// Makes a map from rosbags or scan folders, without a roscore, as fast as the machine allows.
#include "bag_clouds.h"
#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/clouds/forgetting.h"
#include "cuboid_mapping/ros/clouds/moving_filter.h"
#include "cuboid_mapping/ros/map/map_storage.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "cuboid_mapping/ros/parameters/parameters.h"
#include "map_content.h"
#include "progress_bar.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::counted;

cuboid_mapping::MapConfig readAtTheEnd(cuboid_mapping::MapConfig config) {
  config.fuse = cuboid_mapping::FusionTime::kWhenRead;
  return config;
}

/// The map of the clouds of bags, with a window or without.
class BagMap {
 public:
  /// @param frees_passed  Whether freePassed() will be called.
  BagMap(const NodeParameters& parameters, bool frees_passed)
      : map_(readAtTheEnd(makeMapConfig(parameters))),
        forgetting_(parameters),
        moving_(parameters.map.resolution_m,
                frees_passed && parameters.moving_points == MovingPoints::kIgnore
                    ? MovingPoints::kPublish
                    : parameters.moving_points,
                parameters.window),
        window_(makeWindow(parameters, map_)) {}

  void put(const cuboid_mapping::ScanUpdate& update, const BagClouds::Origin& origin,
           const cuboid_mapping::SensorModel& model) {
    if (!first_place_map_) first_place_map_ = origin.sensor_map;
    last_place_map_ = origin.sensor_map;
    const auto& taken = moving_.take(update, origin.window_center_map);
    if (window_) {
      cuboid_mapping::ChangeSet changes;
      const auto& admitted = window_->admit(taken, origin.window_center_map, changes);
      auto change = map_.prepare(admitted, model);
      window_->commit(change, changes);
    } else {
      map_.apply(taken, model);
    }
    throwIfFailed();
    forgetting_.note(update, origin.stamp, origin.source);
    while (forgetting_.hasDue()) forgetting_.forgetSome(map_);
  }

  /// Writes the whole map to the store, and closes it. @return Number of its pages.
  std::size_t finishStore() {
    (void)window_->save();
    throwIfFailed();
    const auto figures = window_->figures();
    window_.reset();
    return figures.num_in_memory + figures.num_on_disk_only;
  }

  /// Frees voxels of objects that passed. @return Number of voxels.
  std::size_t freePassed() { return freeVoidVoxels(moving_.voidSpace(), map_); }

  [[nodiscard]] const cuboid_mapping::CuboidMap& map() const { return map_; }

  /// Text such as "the sensor moved from (0, 0, 0.4) to (3.2, 1, 0.4)": places for the first questions to the map.
  [[nodiscard]] std::string describeWay() const {
    const auto text = [](const Eigen::Vector3d& place_map) {
      return cuboid_mapping::toText(Eigen::Vector3d((100.0 * place_map).array().round() / 100.0));
    };
    return "the sensor moved from " + text(first_place_map_.value_or(last_place_map_)) + " to " +
           text(last_place_map_);
  }

 private:
  /// A node continues after a failure of the window; this program would end with an incomplete map.
  void throwIfFailed() const {
    if (window_ && window_->figures().num_failures > 0) {
      throw std::runtime_error(window_->figures().last_failure);
    }
  }

  cuboid_mapping::CuboidMap map_;
  Forgetting forgetting_;
  MovingFilter moving_;
  std::optional<Eigen::Vector3d> first_place_map_;
  Eigen::Vector3d last_place_map_ = Eigen::Vector3d::Zero();
  std::unique_ptr<cuboid_mapping::MapWindow> window_;
};

void putAll(BagClouds& clouds, BagMap& map) {
  clouds.walk(
      {},
      [&](const cuboid_mapping::ScanUpdate* update, const BagClouds::Origin& origin) {
        if (update != nullptr) map.put(*update, origin, clouds.sensorModel(origin.source));
      },
      cuboid_mapping::showProgress("clouds"));
  clouds.report(clouds.leftOut(), clouds.statistics());
  if (const auto advice = clouds.advice()) {
    std::cerr << "bag_to_map: a node could not keep up with these clouds: " << *advice
              << " (here: --set NAME=VALUE)" << std::endl;
  }
  const NodeStatistics& statistics = clouds.statistics();
  if (statistics.num_inserted == 0) {
    throw std::runtime_error("none of " + counted(statistics.num_received, "cloud") +
                             " could be used: nothing was written");
  }
  std::cerr << "bag_to_map: " << map.describeWay() << std::endl;
}

/// Warns if nothing in the map is occupied.
void warnIfNothingIsOccupied(const cuboid_mapping::MapSnapshot& snapshot,
                             const NodeStatistics& statistics) {
  const bool has_occupied =
      std::any_of(snapshot.bricks.begin(), snapshot.bricks.end(),
                  [](const auto& brick) { return !brick.voxels.occupied().isEmpty(); });
  if (has_occupied) return;
  std::cerr << "bag_to_map: warning: nothing in the map is occupied. Of "
            << counted(statistics.num_points, "point") << " that took part, none is within "
            << "sensor_model/max_range; " << statistics.num_invalid << " were no returns, "
            << statistics.num_filtered << " were cut off by min_range or pointcloud_*, "
            << statistics.num_too_far << " were too far from the start of their beams" << std::endl;
}

/// Writes the map in memory to a file. @return Description of its content.
std::string makeFile(BagClouds& clouds, const std::string& output, cuboid_mapping::MapFormat format,
                     bool frees_passed) {
  BagMap map(clouds.parameters(), frees_passed);
  putAll(clouds, map);
  const std::size_t num_freed = frees_passed ? map.freePassed() : 0;
  const cuboid_mapping::MapSnapshot snapshot =
      takeSnapshot(map.map(), withoutSlash(clouds.parameters().frame_id));
  warnIfNothingIsOccupied(snapshot, clouds.statistics());
  cuboid_mapping::throwIfInterrupted();
  cuboid_mapping::writeMapFile(output, snapshot);
  std::string content = describeContent(snapshot, format);
  if (frees_passed) {
    content += ", " + counted(num_freed, "occupied voxel") + " of passed objects freed";
  }
  return content;
}

/// Writes the map to the store of the window. @return Description of its content.
std::string makeStore(BagClouds& clouds, const std::string& output,
                      cuboid_mapping::MapFormat format) {
  if (format != cuboid_mapping::MapFormat::kStore) {
    throw std::runtime_error(output +
                             ": with window/outside: keep its name must end in .sqlite; "
                             "map_convert makes other files of it");
  }
  std::size_t num_pages = 0;
  cuboid_mapping::replaceFile(output, [&](const std::string& partial) {
    NodeParameters parameters = clouds.parameters();
    parameters.window.file = partial;
    BagMap map(parameters, false);
    putAll(clouds, map);
    num_pages = map.finishStore();
    // Removes files left by a killed program that was replacing a store.
    std::filesystem::remove(output + "-wal");
  });
  return counted(num_pages, "page");
}

/// @param frees_passed  Whether objects that passed are removed from the map at the end.
int makeMap(const BagOptions& options, bool frees_passed) {
  const auto start = std::chrono::steady_clock::now();
  const auto format = cuboid_mapping::checkOutput(options.output);
  BagClouds clouds("bag_to_map", options);
  const bool is_store = clouds.parameters().window.keeps();
  if (is_store && frees_passed) {
    throw std::runtime_error(
        "--free-passed needs the whole map in memory: it does not go with window/outside: keep");
  }
  const std::string content = is_store ? makeStore(clouds, options.output, format)
                                       : makeFile(clouds, options.output, format, frees_passed);
  const NodeStatistics& statistics = clouds.statistics();
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
  std::cout << std::fixed << std::setprecision(1) << options.output << ": "
            << statistics.num_inserted << " of " << counted(statistics.num_received, "cloud")
            << ", " << counted(statistics.num_points, "point") << ", " << content << ", "
            << std::filesystem::file_size(options.output) << " bytes, in " << time.count() << " s"
            << std::endl;
  return 0;
}

int run(int argc, char** argv) {
  BagOptions options;
  cuboid_mapping::CommandLine line("bag_to_map",
                                   "Maps the clouds in rosbags, or in scan folders, without a "
                                   "roscore. With one source, the result is that of a node without "
                                   "edits that drops no cloud, byte for byte with the same zstd.");
  bool frees_passed = false;
  line.addFlag("free-passed", frees_passed,
               "at the end, make occupied voxels free if they were seen empty at any time");
  if (const auto status = parseBagOptions(line, argc, argv, options)) return *status;
  return makeMap(options, frees_passed);
}

}  // namespace
}  // namespace cuboid_mapping_ros

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("bag_to_map", argc, argv, cuboid_mapping_ros::run);
}
