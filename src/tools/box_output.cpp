// SPDX-License-Identifier: BSD-3-Clause
#include "box_output.h"

#include "box_scenes.h"
#include "cuboid_mapping/boxes/box_cover.h"
#include "cuboid_mapping/boxes/joined_cuboids.h"
#include "cuboid_mapping/io/csv_format.h"
#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/io/text.h"

#include <algorithm>
#include <stdexcept>

namespace cuboid_mapping {
namespace {

bool isCsv(const std::string& file) { return formatOfName(file) == MapFormat::kCsv; }

std::vector<CellBox> toKeepFree(const std::vector<std::string>& texts, const Grid& grid) {
  std::vector<CellBox> boxes;
  for (const std::string& text : texts) {
    std::istringstream in(text);
    in.imbue(std::locale::classic());
    MetricBox box;
    for (Eigen::Vector3d* corner : {&box.min_m, &box.max_m}) {
      in >> corner->x() >> corner->y() >> corner->z();
    }
    const auto cells = grid.toCellBox(box);
    if (!in || !(in >> std::ws).eof() || !cells) {
      throw std::runtime_error("--keep-free '" + text +
                               "': must be six finite numbers in quotes, the least x y z and the "
                               "greatest, in metres");
    }
    boxes.push_back(*cells);
  }
  return boxes;
}

Eigen::Vector3d toEdges(const std::vector<double>& edges_m) {
  if (edges_m.size() == 1) return Eigen::Vector3d::Constant(edges_m[0]);
  if (edges_m.size() == 3) return Eigen::Vector3d(edges_m.data());
  throw std::runtime_error("--keep-passages needs one number, or three: x,y,z");
}

BoxCover cover(const CuboidMap& map, const CellBox& region, const BoxOptions& options) {
  CoverTask task;
  task.max_boxes = options.max_boxes;
  task.region = region;
  task.keep_free = toKeepFree(options.keep_free, map.grid());
  task.keep_passages_m = toEdges(options.keep_passages_m);
  const auto found = coverOccupied(map, task, Budget::unlimited());
  if (!found.fault.empty()) throw std::runtime_error("--keep-passages: " + found.fault);
  if (found.isNotFound()) {
    throw std::runtime_error(
        "--boxes " + std::to_string(options.max_boxes) +
        " is not enough, because of --keep-free or of voxels far from all others: " +
        std::to_string(found.value.boxes.size()) +
        " would be; or choose a part with --min and --max");
  }
  return found.value;
}

std::string describe(const BoxCover& cover, const Grid& grid) {
  const auto volume = [](double volume_m3) {
    std::ostringstream out;
    out.precision(3);
    out << volume_m3 << " m3";
    return out.str();
  };
  const std::size_t count = cover.boxes.size();
  std::string text = std::to_string(count) + (count == 1 ? " box, " : " boxes, ") +
                     volume(cover.occupied_volume_m3) + " occupied, " +
                     volume(cover.added_volume_m3) + " added";
  if (cover.left_out_volume_m3 > 0.0) {
    text += ", " + volume(cover.left_out_volume_m3) + " occupied left out by --keep-free";
  }
  constexpr std::size_t kMostNamed = 10;
  for (std::size_t i = 0; i < std::min(cover.lost.size(), kMostNamed); ++i) {
    std::ostringstream out;
    out << grid.centerOf(cover.lost[i]).transpose();
    text += "\nno longer reachable beside the boxes (--keep-passages): " + out.str();
  }
  if (cover.lost.size() > kMostNamed) {
    text += "\nand " + counted(cover.lost.size() - kMostNamed, "other place");
  }
  return text;
}

}  // namespace

bool isBoxOutput(const std::string& file, const BoxOptions& options) {
  const bool is_scene = sceneFormatOfName(file).has_value();
  if (options.max_boxes > 0 && !is_scene && !isCsv(file)) {
    throw std::runtime_error("--boxes is for " + knownSceneEndings() + " and .csv");
  }
  if (options.are_joined && !isCsv(file)) {
    throw std::runtime_error(is_scene ? "--joined is for .csv: boxes of a scene are always joined"
                                      : "--joined is for .csv");
  }
  if (options.are_joined && options.max_boxes > 0) {
    throw std::runtime_error("give --joined or --boxes, not both");
  }
  const bool has_keeping =
      !options.keep_free.empty() || options.keep_passages_m != BoxOptions().keep_passages_m;
  if (has_keeping && options.max_boxes == 0) {
    throw std::runtime_error("--keep-free and --keep-passages go with --boxes");
  }
  return is_scene || options.are_joined || options.max_boxes > 0;
}

std::string writeBoxes(const std::string& file, const MapSnapshot& snapshot,
                       const std::optional<CellBox>& part, const BoxOptions& options) {
  MapConfig config;
  config.resolution_m = snapshot.resolution_m;
  config.fuse = FusionTime::kWhenRead;
  CuboidMap map(config);
  map.replace(kAllCells, snapshot.bricks);
  const CellBox region = part.value_or(kAllCells);
  std::vector<Cuboid> cuboids;
  std::string description;
  if (options.max_boxes > 0) {
    const BoxCover found = cover(map, region, options);
    for (const CellBox& box : found.boxes) cuboids.push_back({box, Occupancy::kOccupied});
    description = describe(found, map.grid());
  } else {
    const CuboidFilter classes = options.are_joined ? CuboidFilter::kAll : CuboidFilter::kOccupied;
    cuboids = joinCuboids(map, region, classes, Budget::unlimited()).value;
    description = counted(cuboids.size(), "joined cuboid");
  }
  if (isCsv(file)) {
    replaceFile(file, toCsv(map, cuboids));
    return description;
  }
  BoxScene scene;
  scene.frame_id = snapshot.frame_id;
  for (const Cuboid& cuboid : cuboids) scene.boxes.push_back(map.grid().toMetricBox(cuboid.box));
  replaceFile(file, toSceneText(scene, *sceneFormatOfName(file)));
  return description;
}

}  // namespace cuboid_mapping
