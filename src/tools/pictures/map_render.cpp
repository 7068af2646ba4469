// SPDX-License-Identifier: BSD-3-Clause
// Draws a map into a PNG or PPM, without a display.
#include "command_line.h"
#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/map_files.h"
#include "joined_lookup.h"
#include "pictures/map_picture.h"
#include "pictures/picture_cells.h"
#include "pictures/picture_legend.h"
#include "progress_bar.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <optional>
#include <thread>

namespace cuboid_mapping {
namespace {

struct Options {
  std::string map;
  std::string picture;
  std::vector<double> eye;
  std::vector<double> target;
  double angle_deg = 60.0;
  double range_m = 200.0;
  double min_z_m = -std::numeric_limits<double>::infinity();
  double max_z_m = std::numeric_limits<double>::infinity();
  std::string colors = "height";
  std::string cells = "cuboids";
  bool has_edges = false;
  bool is_bare = false;
  PictureSize size;
};

const Choices kColorNames{"height", "probability", "size", "class"};  // As in PictureColors.

const Choices kCellNames{"cuboids", "joined", "octomap", "voxels"};  // As in PictureCells.

PictureCells toCells(const std::string& name) {
  const auto found = std::find(kCellNames.begin(), kCellNames.end(), name);
  return static_cast<PictureCells>(found - kCellNames.begin());
}

PictureColors toColors(const std::string& name) {
  const auto found = std::find(kColorNames.begin(), kColorNames.end(), name);
  return static_cast<PictureColors>(found - kColorNames.begin());
}

/// The cells between two heights.
CellBox slabOf(const MapSnapshot& snapshot, const Options& options) {
  const auto limit = [&](double z_m) {
    const double cell = std::floor(z_m / snapshot.resolution_m + 1e-6);
    constexpr double kMax = Grid::kMaxCell;
    return static_cast<std::int32_t>(std::clamp(cell, -kMax, kMax));
  };
  CellBox slab = kAllCells;
  slab.min.z = limit(options.min_z_m);
  slab.max.z = limit(options.max_z_m);
  return slab;
}

Camera makeCamera(const CuboidMap& map, const Options& options) {
  if (options.eye.empty()) return makeTopCamera(map, options.size);
  constexpr double kRadPerDegree = 3.14159265358979323846 / 180.0;
  const Eigen::Vector3d eye(options.eye.data());
  const Eigen::Vector3d target(options.target.data());
  if ((target - eye).norm() < 1e-6) {
    throw std::runtime_error("--look-at and --eye must be different points");
  }
  Camera camera = makeCameraAt(eye, target, options.range_m);
  camera.vertical_angle_rad = options.angle_deg * kRadPerDegree;
  return camera;
}

int findLongestEdges(const std::vector<Cuboid>& cuboids) {
  int longest = 0;
  for (const Cuboid& cuboid : cuboids) {
    const Cell edges = cuboid.box.size();
    longest = std::max(longest, edges.x + edges.y + edges.z);
  }
  return longest;
}

bool isFinite(const std::vector<double>& numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); });
}

void check(const Options& options) {
  if (!isFinite(options.eye) || !isFinite(options.target)) {
    throw std::runtime_error("--eye and --look-at must be finite numbers");
  }
  if (std::isnan(options.min_z_m) || std::isnan(options.max_z_m)) {
    throw std::runtime_error("--min-z and --max-z must be numbers");
  }
  const bool shows_cells =
      options.has_edges || options.colors == "size" || options.colors == "probability";
  if (options.cells != "cuboids" && !shows_cells) {
    throw std::runtime_error(
        "--cells shows nothing: add --edges, or --color-by size or probability");
  }
  if (!isPictureName(options.picture)) {
    throw std::runtime_error(options.picture + ": its name must end in .png or .ppm");
  }
  checkReplaceable(options.picture);
}

int render(const Options& options) {
  check(options);
  PictureStyle style;
  style.colors = toColors(options.colors);
  style.cells = toCells(options.cells);
  style.has_edges = options.has_edges;
  style.has_free = !options.is_bare;
  style.samples = options.has_edges ? 3 : 1;
  const MapSnapshot snapshot = readMapFile(options.map).snapshot;
  throwIfInterrupted();
  MapConfig config;
  config.resolution_m = snapshot.resolution_m;
  CuboidMap map(config);
  map.replace(slabOf(snapshot, options), snapshot.bricks);
  if (map.voxels().size() == 0)
    throw std::runtime_error(options.map + ": there is nothing to draw");
  throwIfInterrupted();
  const int threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const Camera camera = makeCamera(map, options);
  style.heights = findHeightRange(map);
  std::optional<JoinedLookup> joined;
  if (style.cells == PictureCells::kJoined) {
    style.joined = &joined.emplace(map);
    style.longest_edges = findLongestEdges(joined->cuboids());
  }
  Picture picture =
      renderMap(map, camera, style, options.size, threads, showProgress("rows drawn"));
  if (!options.is_bare) drawLegend(picture, style, camera.ortho_height_m);
  replaceFile(options.picture, toPictureFile(picture, options.picture));
  std::cout << options.picture << ": " << picture.width << " x " << picture.height << " pixels, "
            << countCells(map, style) << " occupied cells (" << options.cells << ')' << std::endl;
  return 0;
}

int run(int argc, char** argv) {
  Options options;
  CommandLine line(
      "map_render",
      "Draws a map as PNG or PPM, without a screen: from straight above, or from a point.\nColours "
      "of occupied voxels: --color-by. Free space is light grey, unknown space is white.");
  line.addArgument("map", options.map, "map: .cuboids, .sqlite, .ot or .bt");
  line.addArgument("picture", options.picture, "picture to write: .png or .ppm");
  line.addPoint("eye", options.eye, "position of the camera, in metres");
  line.addPoint("look-at", options.target, "point in the middle of the picture, in metres");
  line.addNumber("angle", options.angle_deg, "height of the view in degrees, with --eye", {1, 170});
  line.addNumber("range", options.range_m, "largest distance from the camera in metres, with --eye",
                 {0.01, 1e5});
  line.addNumber("min-z", options.min_z_m, "leave out everything below this height in metres");
  line.addNumber("max-z", options.max_z_m,
                 "leave out everything above this height in metres, such as a ceiling");
  line.addText("color-by", options.colors, "meaning of the colours", kColorNames);
  line.addText(
      "cells", options.cells,
      "cells for --edges, and for colours by size or probability: cuboids of the map, cuboids "
      "joined across bricks, leaves of OctoMap's octree, or voxels",
      kCellNames);
  line.addFlag("bare", options.is_bare, "draw occupied cells only: no free space, no legend");
  line.addFlag("edges", options.has_edges, "draw the edges of cells, smoothed");
  line.addNumber("width", options.size.width, "width of the picture in pixels", {1, 16384});
  line.addNumber("height", options.size.height, "height of the picture in pixels", {1, 16384});
  if (const auto status = line.parse(argc, argv)) return *status;
  if (options.eye.empty() != options.target.empty()) {
    throw std::runtime_error("give both --eye and --look-at, or neither");
  }
  return render(options);
}

}  // namespace
}  // namespace cuboid_mapping

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("map_render", argc, argv, cuboid_mapping::run);
}
