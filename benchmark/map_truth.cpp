// SPDX-License-Identifier: BSD-3-Clause
// How true a map is: precision and recall of its occupied voxels against the surfaces of a simulated world, or
// against a map that scans were made from, with OctoMap's rule for what beams clear, and with others.
#include "command_line.h"

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/scan/scan_update.h"
#include "data_sets/scan_dataset.h"
#include "simulation/lidar.h"

#include <octomap/OcTree.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <vector>

namespace cuboid_mapping::bench {
namespace {

struct TruthOptions {
  std::string dataset;  ///< A folder; empty: the simulated world.
  std::string truth;    ///< A .bt of it.
  int seed = 1;
  int rings = 32;
  int clouds = 90;
  double resolution_m = 0.1;
  double noise_m = 0.01;
  std::vector<double> margins_m = {0.2, 0.4, 0.6, 1.0, 2.0};
};

/// Voxels, brick by brick.
using VoxelSet = std::unordered_map<Cell, BrickMask, CellHash>;

BrickMask maskOf(const VoxelSet& set, const Cell& brick) {
  const auto found = set.find(brick);
  return found == set.end() ? BrickMask() : found->second;
}

/// Clouds of one lap. The door is left out: where it moves, nothing is true for all times.
std::vector<Scan> makeClouds(const World& world, const TruthOptions& options) {
  LidarConfig config;
  config.rings = options.rings;
  config.range_noise_m = options.noise_m;
  const Lidar lidar(config);
  std::vector<Scan> scans;
  for (int i = 0; i < options.clouds; ++i) {
    throwIfInterrupted();
    const double time_s = i * world.lapDuration() / options.clouds;
    Eigen::Isometry3d T_map_lidar = world.computeRobotPose(time_s);
    T_map_lidar.translate(Eigen::Vector3d(0.1, 0.0, 1.0));
    std::vector<Solid> solids = world.computeSolids(time_s);
    solids.erase(std::remove_if(solids.begin(), solids.end(),
                                [](const Solid& solid) { return solid.kind == SolidKind::kDoor; }),
                 solids.end());
    const LidarCloud cloud = lidar.computeCloud(solids, T_map_lidar, static_cast<std::uint64_t>(i));
    std::vector<Eigen::Vector3f> points;
    for (const LidarPoint& point : cloud.points) {
      if (std::isfinite(point.x)) points.emplace_back(point.x, point.y, point.z);
    }
    scans.push_back(makeScan(T_map_lidar, T_map_lidar.translation(), points));
  }
  return scans;
}

/// Whether a cube shares space with a shape, to a sixteenth of its edge.
bool touches(const std::vector<const Shape*>& shapes, const Eigen::Vector3d& center,
             double half_edge_m, int levels = 3) {
  std::vector<const Shape*> near;
  for (const Shape* shape : shapes) {
    const double distance_m = computeSignedDistance(*shape, center);
    if (distance_m <= 0.0) return true;
    if (distance_m <= half_edge_m * std::sqrt(3.0)) near.push_back(shape);
  }
  if (near.empty() || levels == 0) return !near.empty();
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d side(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5,
                               corner & 4 ? 0.5 : -0.5);
    if (touches(near, center + side * half_edge_m, 0.5 * half_edge_m, levels - 1)) return true;
  }
  return false;
}

/// Which voxels of a part of a brick are truly occupied.
using Truth = std::function<BrickMask(const Cell& brick, const BrickMask& part)>;

/// Those in which there is something that does not move.
Truth truthOf(const World& world, const Grid& grid) {
  return [&world, grid](const Cell& brick, const BrickMask& part) {
    const MetricBox box = grid.toMetricBox(brickBox(brick));
    std::vector<const Shape*> shapes;
    for (const Solid& solid : world.fixedSolids()) {
      const MetricBox bounds = computeBounds(solid.shape);
      const bool is_near = (bounds.min_m.array() <= box.max_m.array()).all() &&
                           (bounds.max_m.array() >= box.min_m.array()).all();
      if (is_near) shapes.push_back(&solid.shape);
    }
    BrickMask mask;
    forEachCell(brick, part, [&](const Cell& cell) {
      const Eigen::Vector3d center = grid.centerOf(CellBox::ofCell(cell));
      if (touches(shapes, center, 0.5 * grid.resolution())) mask.set(voxelIndex(cell));
    });
    return mask;
  };
}

/// Those that an octree says are occupied.
Truth truthOf(const octomap::OcTree& tree, const Grid& grid) {
  return [&tree, grid](const Cell& brick, const BrickMask& part) {
    BrickMask mask;
    forEachCell(brick, part, [&](const Cell& cell) {
      const Eigen::Vector3d center = grid.centerOf(CellBox::ofCell(cell));
      const octomap::OcTreeNode* node = tree.search(center.x(), center.y(), center.z());
      if (node != nullptr && tree.isNodeOccupied(node)) mask.set(voxelIndex(cell));
    });
    return mask;
  };
}

/// The set and all voxels that are at most so many voxels away along each axis.
VoxelSet enlarged(const VoxelSet& set, int voxels) {
  const Cell reach{voxels, voxels, voxels};
  VoxelSet result;
  for (const auto& [brick, mask] : set) {
    forEachCell(brick, mask, [&result, &reach](const Cell& cell) {
      const CellBox box{cell - reach, cell + reach + Cell{1, 1, 1}};
      forEachBrick(box, [&](const Cell& near) {
        result[near] |= BrickMask::ofBox(intersect(box, brickBox(near)));
      });
    });
  }
  return result;
}

/// What beams do not clear.
enum class Rule { kOctomap, kKeepSurfaces, kEndMargin, kEndsEarly, kBesideHits };

struct Variant {
  Rule rule;
  double margin_m;

  [[nodiscard]] std::string name() const {
    char text[64];
    const char* const names[] = {"as OctoMap", "keep_surfaces", "end margin %.1f m",
                                 "beams end %.1f m early", "not beside hits, %.1f m"};
    std::snprintf(text, sizeof(text), names[static_cast<int>(rule)], margin_m);
    return text;
  }
};

/// Takes the misses away that lie at most `voxels` from a hit of the same cloud, along each axis.
void spareBesideHits(ScanUpdate& update, int voxels) {
  VoxelSet hits;
  for (const BrickUpdate& brick : update.bricks) hits[brick.brick] = brick.hits;
  const VoxelSet spared = enlarged(hits, voxels);
  for (BrickUpdate& brick : update.bricks) {
    brick.misses = brick.misses.without(maskOf(spared, brick.brick));
  }
}

/// A map, made by one rule.
class Attempt {
 public:
  Attempt(const Variant& variant, const MapConfig& config)
      : variant_(variant), map_(config), updater_(map_.grid(), rangesOf(variant)) {}

  void integrate(const Scan& scan) {
    ScanUpdate update = updater_.compute(scan);
    if (variant_.rule == Rule::kEndsEarly) {
      for (BrickUpdate& brick : update.bricks) brick.grazes = {};
    } else if (variant_.rule == Rule::kBesideHits) {
      spareBesideHits(update,
                      static_cast<int>(std::lround(variant_.margin_m / map_.grid().resolution())));
    }
    for (const BrickUpdate& brick : update.bricks) {
      if (!brick.hits.isEmpty()) hits_[brick.brick] |= brick.hits;
    }
    map_.apply(update);
  }

  [[nodiscard]] const Variant& variant() const { return variant_; }
  [[nodiscard]] const CuboidMap& map() const { return map_; }
  /// Voxels that a beam has ever hit: the same for all rules.
  [[nodiscard]] const VoxelSet& hits() const { return hits_; }

 private:
  static BeamRanges rangesOf(const Variant& variant) {
    BeamRanges ranges;
    const bool has_margin = variant.rule == Rule::kEndMargin || variant.rule == Rule::kEndsEarly;
    if (has_margin) ranges.end_margin_m = variant.margin_m;
    ranges.keep_surfaces = variant.rule == Rule::kKeepSurfaces;
    return ranges;
  }

  Variant variant_;
  CuboidMap map_;
  ScanUpdater updater_;
  VoxelSet hits_;
};

double ratio(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

/// What all attempts are compared with.
struct Reference {
  VoxelSet known;       ///< By OctoMap's rule; that of all the others.
  VoxelSet solid;       ///< Those of them that are truly occupied.
  VoxelSet near_solid;  ///< And their neighbours.
};

Reference makeReference(const CuboidMap& map, const Truth& truth) {
  Reference reference;
  map.voxels().forEach([&](const VoxelBrick& brick) {
    reference.known[brick.brick] = brick.voxels.known();
    reference.solid[brick.brick] = truth(brick.brick, brick.voxels.known());
  });
  reference.near_solid = enlarged(reference.solid, 1);
  return reference;
}

void print(const Attempt& attempt, const Reference& reference) {
  std::size_t occupied = 0;
  std::size_t right = 0;
  std::size_t nearly_right = 0;
  std::size_t seen = 0;
  std::size_t open = 0;
  std::size_t free = 0;
  for (const auto& [brick, known] : reference.known) {
    const BrickMask solid = maskOf(reference.solid, brick);
    const BrickMask hit = maskOf(attempt.hits(), brick);
    const PackedVoxels* own = attempt.map().voxels().find(brick);
    const BrickMask own_occupied = own == nullptr ? BrickMask() : own->occupied();
    const BrickMask own_free = own == nullptr ? BrickMask() : own->free();
    const auto count = [](const BrickMask& mask) { return static_cast<std::size_t>(mask.count()); };
    occupied += count(own_occupied);
    right += count(own_occupied & solid);
    nearly_right += count(own_occupied & maskOf(reference.near_solid, brick));
    seen += count(hit & solid);
    open += count(known.without(solid));
    free += count(own_free.without(solid));
  }
  std::printf("| %s | %zu | %.1f | %.1f | %.1f | %.1f |\n", attempt.variant().name().c_str(),
              occupied, 100.0 * ratio(right, occupied), 100.0 * ratio(nearly_right, occupied),
              100.0 * ratio(right, seen), 100.0 * ratio(free, open));
}

void measure(const TruthOptions& options, const std::vector<Scan>& scans, const Truth& truth) {
  std::vector<Variant> variants = {{Rule::kOctomap, 0.0}, {Rule::kKeepSurfaces, 0.0}};
  for (const Rule rule : {Rule::kEndMargin, Rule::kEndsEarly, Rule::kBesideHits}) {
    for (const double margin_m : options.margins_m) variants.push_back({rule, margin_m});
  }
  MapConfig config;
  config.resolution_m = options.resolution_m;
  std::optional<Reference> reference;
  std::printf(
      "| rule at %.2f m | occupied voxels | precision %% | to a voxel | recall %% | free space %% "
      "|\n",
      options.resolution_m);
  std::printf("|---|---|---|---|---|---|\n");
  for (const Variant& variant : variants) {
    Attempt attempt(variant, config);
    for (const Scan& scan : scans) {
      throwIfInterrupted();
      attempt.integrate(scan);
    }
    if (!reference) reference = makeReference(attempt.map(), truth);
    print(attempt, *reference);
  }
}

std::vector<Scan> readDataset(const std::string& path) {
  const auto dataset = openScanDataset(path);
  std::vector<Scan> scans;
  for (std::size_t i = 0; i < dataset->size(); ++i) {
    throwIfInterrupted();
    const ScanDataset::Item item = dataset->read(i);
    scans.push_back(
        makeScan(item.T_map_sensor, item.T_map_sensor.translation(), item.points_sensor));
  }
  return scans;
}

/// @throws std::runtime_error  when the octree cannot be read, or is of another resolution.
void measureDataset(TruthOptions options) {
  octomap::OcTree tree(0.1);
  if (!tree.readBinary(options.truth)) throw std::runtime_error("cannot read " + options.truth);
  options.resolution_m = tree.getResolution();
  measure(options, readDataset(options.dataset), truthOf(tree, Grid(options.resolution_m)));
}

int run(int argc, char** argv) {
  TruthOptions options;
  CommandLine line(
      "map_truth",
      "Precision and recall of occupied voxels: of a simulated drive against its surfaces, or of a "
      "data set\nagainst the octree from which it was made.\nPrecision to a voxel: share of "
      "occupied voxels beside a right one. Recall: share of hit voxels with\nan object in them "
      "that are occupied. Free space: share of observed empty voxels that are free.");
  line.addText("dataset", options.dataset, "a folder of scans instead of the simulated drive");
  line.addText("truth", options.truth,
               "the .bt file from which the data set was made; sets the resolution");
  line.addNumber("seed", options.seed, "seed of the simulated world", {0, 1e9});
  line.addNumber("rings", options.rings, "number of rings of the lidar", {1, 1024});
  line.addNumber("clouds", options.clouds, "number of clouds of a lap", {1, 10000});
  line.addNumber("resolution", options.resolution_m, "edge of a voxel [m]", {0.01, 1.0});
  line.addNumber("noise", options.noise_m, "standard deviation of ranges [m]", {0.0, 1.0});
  line.addList("margins", options.margins_m, "margins of each rule [m]", {0.01, 100.0});
  if (const auto status = line.parse(argc, argv)) return *status;
  if (options.dataset.empty() != options.truth.empty()) {
    throw std::runtime_error("--dataset and --truth go together");
  }
  if (!options.dataset.empty()) {
    measureDataset(options);
  } else {
    const World world(static_cast<std::uint64_t>(options.seed));
    measure(options, makeClouds(world, options), truthOf(world, Grid(options.resolution_m)));
  }
  return 0;
}

}  // namespace
}  // namespace cuboid_mapping::bench

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("map_truth", argc, argv, cuboid_mapping::bench::run);
}
