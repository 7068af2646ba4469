// SPDX-License-Identifier: BSD-3-Clause
// Writes a map in another format.
#include "box_output.h"
#include "box_scenes.h"
#include "command_line.h"
#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/io/map_store.h"
#include "cuboid_mapping/io/pcd_file.h"
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/map/progress_counter.h"
#include "map_content.h"
#include "progress_bar.h"
#include "recorded_map.h"

#include <cmath>
#include <filesystem>
#include <iostream>
#include <optional>
#include <vector>

namespace cuboid_mapping {
namespace {

struct Options {
  std::string input;
  std::string output;
  std::string frame_id;
  double resolution_m = 0.0;  ///< Resolution of a map of points.
  SensorModelConfig model;
  std::vector<double> min_m;
  std::vector<double> max_m;
  BoxOptions boxes;
  cuboid_mapping_ros::RecordedMapOptions recorded;
};

/// The requested part of a map; nothing for the whole map.
std::optional<CellBox> partOf(const Options& options, double resolution_m) {
  if (options.min_m.empty()) return std::nullopt;
  const MetricBox box{Eigen::Vector3d(options.min_m.data()), Eigen::Vector3d(options.max_m.data())};
  const auto part = Grid(resolution_m).toCellBox(box);
  if (!part)
    throw std::runtime_error(
        "--min and --max must be finite, and --min less than --max on every axis");
  return part;
}

/// The bricks of a map without the voxels outside a box.
std::vector<VoxelBrick> cut(const std::vector<VoxelBrick>& bricks, const CellBox& box) {
  CuboidMap map;
  map.replace(box, bricks);
  return takeSnapshot(map, "").bricks;
}

/// Copies a store to another one, page by page: it may be larger than the memory.
int copyStore(const Options& options) {
  const MapStore input(options.input, StoreAccess::kRead);
  MapSnapshot head = *input.head();
  if (!options.frame_id.empty()) head.frame_id = options.frame_id;
  const auto part = partOf(options, head.resolution_m);
  std::vector<Cell> pages;
  for (const Cell& page : input.pages()) {
    if (!part || part->intersects(pageBox(page))) pages.push_back(page);
  }
  if (!part) {  // As elsewhere, a part has no fused cuboids: they may reach beyond it.
    for (const Cell& page : pages) (void)input.read(page, &head.cuboids);
  }
  const ProgressListener listener = showProgress("pages written");
  ProgressCounter progress(listener, pages.size());
  std::size_t num_pages = 0;
  writeStore(options.output, head, pages, [&](const Cell& page) {
    throwIfInterrupted();
    progress.advance();
    std::vector<VoxelBrick> bricks = input.read(page);
    if (part) bricks = cut(bricks, *part);
    num_pages += bricks.empty() ? 0 : 1;
    return bricks;
  });
  std::cout << options.output << ": " << counted(num_pages, "page") << std::endl;
  return 0;
}

#ifdef CUBOID_MAPPING_READS_BAGS
void addBagOptions(CommandLine& line, cuboid_mapping_ros::RecordedMapOptions& options) {
  line.addText("topic", options.topic,
               "rosbag with several maps: topic of the one to read, such as cuboid_map");
  line.addText("server", options.server,
               "rosbag with several nodes on that topic: name of the one to read");
  line.addNumber("at", options.at_s,
                 "rosbag: time of the map, in seconds after the start of the bag", {0.0});
}

MapSnapshot readBag(const Options& options) {
  auto map = cuboid_mapping_ros::readRecordedMap(options.input, options.recorded,
                                                 showProgress("messages read"));
  for (const std::string& note : map.notes) std::cerr << "map_convert: " << note << std::endl;
  return std::move(map.snapshot);
}
#endif

/// Reads the map of a file; of a store only the requested pages.
MapSnapshot readInput(const Options& options) {
#ifdef CUBOID_MAPPING_READS_BAGS
  if (cuboid_mapping_ros::isBagFile(options.input)) return readBag(options);
  if (!options.recorded.topic.empty() || !options.recorded.server.empty() ||
      !std::isinf(options.recorded.at_s)) {
    throw std::runtime_error("--topic, --server and --at are for rosbags: " + options.input +
                             " is none");
  }
#endif
#ifdef CUBOID_MAPPING_READS_CLOUDS
  if (isPointCloudFile(options.input)) {
    if (options.resolution_m <= 0.0) {
      throw std::runtime_error(options.input +
                               " is a cloud of points: give the edge of a voxel with --resolution");
    }
    return readPointCloudMap(options.input, options.resolution_m, options.model);
  }
#endif
  if (!isSqliteFile(options.input) || options.min_m.empty()) {
    return readMapFile(options.input, options.model).snapshot;
  }
  const MapStore store(options.input, StoreAccess::kRead);
  const auto part = partOf(options, store.head()->resolution_m);
  return readStore(store, SnapshotLimits::none(), *part);
}

int convertToBoxes(const Options& options) {
  MapSnapshot map = readInput(options);
  throwIfInterrupted();
  if (!options.frame_id.empty()) map.frame_id = options.frame_id;
  const auto part = partOf(options, map.resolution_m);
  const std::string content = writeBoxes(options.output, map, part, options.boxes);
  std::cout << options.output << ": " << content << std::endl;
  return 0;
}

int convert(const Options& options) {
  if (options.resolution_m > 0.0 && !isPointCloudFile(options.input)) {
    throw std::runtime_error("--resolution is for .pcd: the voxels of " + options.input +
                             " keep their size");
  }
  const auto format = formatOfName(options.output);
  const bool are_boxes = isBoxOutput(options.output, options.boxes);
  if (!format && !are_boxes) {
    throw std::runtime_error(options.output + ": its name must end in one of " + knownEndings() +
                             "; or, for boxes, " + knownSceneEndings());
  }
  checkReplaceable(options.output);
  if (are_boxes) return convertToBoxes(options);
  if (format == MapFormat::kStore && isSqliteFile(options.input)) return copyStore(options);
  MapSnapshot map = readInput(options);
  throwIfInterrupted();
  if (const auto part = partOf(options, map.resolution_m)) {
    map.bricks = cut(map.bricks, *part);
    map.cuboids.clear();
  }
  if (!options.frame_id.empty()) map.frame_id = options.frame_id;
  const std::size_t num_bytes = writeMapFile(options.output, map, showProgress("bricks written"));
  std::cout << options.output << ": " << describeContent(map, *format) << ", " << num_bytes
            << " bytes; " << options.input << " has " << std::filesystem::file_size(options.input)
            << " bytes" << std::endl;
  return 0;
}

int run(int argc, char** argv) {
  Options options;
  CommandLine line("map_convert",
                   "Converts a map, or a part of it; the extension of the output selects the "
                   "format. A store (.sqlite) is copied to another one page by page.");
  line.addArgument("input", options.input,
                   "map: .cuboids, .sqlite, .ot or .bt; a cloud of points, .pcd; or, with ROS, a "
                   "rosbag of cuboid_map and cuboid_map_updates");
  line.addArgument(
      "output", options.output,
      "one of " + knownEndings() + "; or, for occupied space as boxes, " + knownSceneEndings());
  line.addText("frame", options.frame_id, "name of the map's frame, for formats that keep one");
  line.addNumber("resolution", options.resolution_m, "edge of a voxel in metres, for .pcd",
                 {1e-3, 1e2});
  line.addNumber("sensor_model/min", options.model.alpha_min,
                 "lowest probability, for maps from OctoMap and .pcd", {0.001, 0.499});
  line.addNumber("sensor_model/max", options.model.alpha_max,
                 "highest probability, for maps from OctoMap and .pcd", {0.501, 0.999});
  line.addPoint("min", options.min_m, "least x, y and z of the part, in metres");
  line.addPoint("max", options.max_m, "greatest x, y and z of the part, in metres");
  line.addFlag("joined", options.boxes.are_joined,
               ".csv: cuboids joined across bricks, walls as walls");
  line.addNumber("boxes", options.boxes.max_boxes,
                 "maximum number of boxes, which cover all occupied space and add little volume; "
                 "without it, all joined cuboids, or in a .csv without --joined those of the map",
                 {1, 1e6});
  line.addTexts("keep-free", options.boxes.keep_free,
                "with --boxes: a box that must stay free, such as the robot: 'min_x min_y min_z "
                "max_x max_y max_z', in metres");
  line.addList(
      "keep-passages", options.boxes.keep_passages_m,
      "with --boxes: edges x,y,z of a robot's box in metres, or one number for all; what it can "
      "reach in the map stays reachable beside the boxes, or the lost places are named; 0: not "
      "checked",
      {0.0, 1e3});
#ifdef CUBOID_MAPPING_READS_BAGS
  addBagOptions(line, options.recorded);
#endif
  if (const auto status = line.parse(argc, argv)) return *status;
  if (options.min_m.empty() != options.max_m.empty()) {
    throw std::runtime_error("give both --min and --max, or neither");
  }
  return convert(options);
}

}  // namespace
}  // namespace cuboid_mapping

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("map_convert", argc, argv, cuboid_mapping::run);
}
