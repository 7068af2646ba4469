// SPDX-License-Identifier: BSD-3-Clause
#include "run.h"

#include "command_line.h"
#include "machine.h"
#include "timing.h"

#include "cuboid_mapping/fusion/cuboid_tree.h"
#include "cuboid_mapping/interop/octomap_parity.h"
#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/scan/scan_update.h"
#include "evaluation/rtree.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace cuboid_mapping::bench {
namespace {

using nlohmann::json;

constexpr double kNoLimit = std::numeric_limits<double>::infinity();

/// How many cells there are by size: place i counts those of 2^i to 2^(i+1) - 1 voxels.
class SizeHistogram {
 public:
  void count(double voxels) {
    const auto place = static_cast<std::size_t>(std::log2(voxels));
    if (place >= counts_.size()) counts_.resize(place + 1, 0);
    ++counts_[place];
  }
  [[nodiscard]] const std::vector<std::size_t>& counts() const { return counts_; }

 private:
  std::vector<std::size_t> counts_;
};

json describe(const RunSpec& spec, const std::vector<Scan>& scans) {
  std::size_t num_points = 0;
  for (const Scan& scan : scans) num_points += scan.points.size();
  json run{{"map", spec.is_octomap ? "octomap" : "cuboid_mapping"},
           {"resolution_m", spec.map.resolution_m},
           {"rotation_deg", spec.rotation_deg},
           {"clouds", scans.size()},
           {"points", num_points},
           {"commit", describeMachine().commit}};
  if (spec.is_octomap) return run;
  run["M"] = spec.map.rtree.max_branches;
  if (spec.reading) {
    run["map"] = "paper";
    run["environment"] = toString(Environment::kStatic);
    run["step"] = toString(spec.reading->step);
    run["gap_free"] = spec.reading->is_gap_free;
    run["along"] = spec.reading->grows_along;
    run["samples_per_m"] = spec.map.growth.sampling.per_m;
    return run;
  }
  run["fusion"] = toString(spec.map.fusion);
  run["environment"] = toString(spec.map.environment);
  if (spec.map.fusion == FusionKind::kGrowth) {
    run["step"] = toString(spec.growth.step);
    run["search"] = toText(spec.growth.search);
    run["starters"] = toString(spec.growth.starters);
    run["samples_per_m"] = spec.map.growth.sampling.per_m;
    run["seed"] = spec.map.growth.sampling.seed;
    run["settle_clouds"] = spec.map.growth.settle_clouds;
  }
  return run;
}

void addInsertion(double cpu_s, json& run) {
  run["insert_cpu_s"] = cpu_s;
  run["insert_us_per_point"] = 1e6 * cpu_s / run["points"].get<double>();
}

/// The voxels of OctoMap's bounding box: x y z / r^3 of the paper, Section V.
double fullGridCells(const octomap::OcTree& tree) {
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;
  const_cast<octomap::OcTree&>(tree).getMetricSize(x, y, z);
  return std::round(x * y * z / std::pow(tree.getResolution(), 3));
}

double visitOccupied(const octomap::OcTree& tree) {
  double sum = 0.0;
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
    if (tree.isNodeOccupied(*leaf)) sum += leaf.getX();
  }
  return sum;
}

template <typename TreeT>
double visitOccupied(const TreeT& tree) {
  double sum = 0.0;
  visitAll(tree, CuboidFilter::kOccupied, [&sum](const Cuboid& cuboid) {
    sum += cuboid.box.min.x;
    return Visit::kContinue;
  });
  return sum;
}

std::size_t nodesOfPointQuery(const InnerTree& tree, int level, NodeIndex index,
                              const CellBox& voxel) {
  std::size_t num_nodes = 1;
  if (level == 0) return num_nodes;
  const Node& node = tree.node(index);
  for (SlotSet slots = node.findOverlapping(voxel); slots != 0; slots = withoutFirst(slots)) {
    num_nodes += nodesOfPointQuery(tree, level - 1, node.child()[firstSlot(slots)], voxel);
  }
  return num_nodes;
}

const InnerTree& innerOf(const RTree& tree) { return tree.inner(); }
const InnerTree& innerOf(const CuboidMap& map) { return map.cuboids().inner(); }

TreeSize sizeOf(const RTree& tree) {
  return {tree.height(), tree.numLeafNodes(), tree.inner().size(), tree.numBytes()};
}

/// The tree of Figure 7 (a), in which every cell is a leaf branch. For growth it is built from the cells at the end: the
/// map's own leaf nodes are bricks.
TreeSize sizeOf(const CuboidMap& map) {
  if (map.config().fusion != FusionKind::kGrowth) return measureTree(map);
  RTree tree(map.config().rtree);
  visitAll(map, CuboidFilter::kAll, [&tree](const Cuboid& cuboid) {
    tree.insert(cuboid);
    return Visit::kContinue;
  });
  return sizeOf(tree);
}

/// Nodes that a search for one voxel looks into, on average over the least voxels of the cells; the
/// height of the tree if no boxes of nodes overlapped.
template <typename TreeT>
double meanNodesOfPointQuery(const TreeT& tree) {
  const InnerTree& inner = innerOf(tree);
  double num_nodes = 0.0;
  double num_cells = 0.0;
  visitAll(tree, CuboidFilter::kAll, [&](const Cuboid& cuboid) {
    num_nodes += static_cast<double>(nodesOfPointQuery(inner, inner.height() - 1, inner.root(),
                                                       CellBox::ofCell(cuboid.box.min)));
    ++num_cells;
    return Visit::kContinue;
  });
  return num_nodes / num_cells;
}

/// What can be said of the R-tree when all clouds are in.
template <typename TreeT>
void addTree(const TreeT& tree, const TreeSize& size, double min_query_s, json& run) {
  SizeHistogram sizes;
  std::size_t num_cells = 0;
  std::size_t num_occupied = 0;
  double num_voxels = 0.0;
  visitAll(tree, CuboidFilter::kAll, [&](const Cuboid& cuboid) {
    sizes.count(cuboid.box.numVoxels());
    ++num_cells;
    num_voxels += cuboid.box.numVoxels();
    num_occupied += cuboid.isOccupied() ? 1 : 0;
    return Visit::kContinue;
  });
  run["cells"] = num_cells;
  run["occupied_cells"] = num_occupied;
  run["free_cells"] = num_cells - num_occupied;
  run["voxels"] = num_voxels;
  run["hierarchy_nodes"] = size.leaf_nodes + size.inner_nodes;
  run["height"] = size.height;
  run["nodes_of_point_query"] = meanNodesOfPointQuery(tree);
  run["access_occupied_ms"] =
      1e3 * cpuTimeOfOne_s([&] { return visitOccupied(tree); }, min_query_s);
  run["size_histogram"] = sizes.counts();
}

}  // namespace

std::string nameOf(const RunSpec& spec) {
  std::ostringstream name;
  const char* map = spec.reading ? "paper" : toString(spec.map.fusion);
  name << (spec.is_octomap ? "octomap" : map) << "_" << spec.map.resolution_m << "m";
  if (spec.rotation_deg != 0.0) name << "_rotated" << spec.rotation_deg;
  if (spec.is_octomap) return name.str();
  name << "_M" << spec.map.rtree.max_branches;
  if (spec.reading) {
    name << "_" << toString(spec.reading->step) << (spec.reading->is_gap_free ? "_full" : "_gaps")
         << (spec.reading->grows_along ? "_along" : "_across");
    if (spec.map.growth.sampling.per_m != GrowthConfig().sampling.per_m) {
      name << "_T" << spec.map.growth.sampling.per_m;
    }
    return name.str();
  }
  if (spec.map.environment == Environment::kStatic) name << "_static";
  if (spec.map.fusion != FusionKind::kGrowth) return name.str();
  std::string search = toText(spec.growth.search);
  search.erase(std::remove(search.begin(), search.end(), ' '), search.end());
  name << "_" << toString(spec.growth.step) << "_" << search << "_"
       << toString(spec.growth.starters);
  if (spec.map.growth.settle_clouds != GrowthConfig().settle_clouds) {
    name << "_settle" << spec.map.growth.settle_clouds;
  }
  if (spec.map.growth.sampling.seed != GrowthConfig().sampling.seed) {
    name << "_seed" << spec.map.growth.sampling.seed;
  }
  return name.str();
}

std::vector<Scan> rotate(const std::vector<Scan>& scans, double angle_deg) {
  const Eigen::AngleAxisf rotation(static_cast<float>(angle_deg * M_PI / 180.0),
                                   Eigen::Vector3f::UnitZ());
  std::vector<Scan> rotated = scans;
  for (Scan& scan : rotated) {
    if (!scan.anchor_map.isZero()) {
      throw std::runtime_error(
          "clouds more than 512 m from the origin, where OctoMap is not exact: move the origin of "
          "the poses");
    }
    if (angle_deg == 0.0) continue;
    scan.origin = rotation * scan.origin;
    for (Eigen::Vector3f& point : scan.points) point = rotation * point;
  }
  return rotated;
}

json runOctomap(const RunSpec& spec, const std::vector<Scan>& scans, double min_query_s,
                octomap::OcTree& tree) {
  json run = describe(spec, scans);
  double cpu_s = 0.0;
  json cells_over_time = json::array();
  for (const Scan& scan : scans) {
    throwIfInterrupted();
    cpu_s += timeOf([&] { insertIntoOctomap(scan, kNoLimit, tree); }).cpu_s;
    cells_over_time.push_back(tree.getNumLeafNodes());
  }
  addInsertion(cpu_s, run);
  run["cells_over_time"] = std::move(cells_over_time);
  SizeHistogram sizes;
  std::size_t num_cells = 0;
  std::size_t num_occupied = 0;
  double num_voxels = 0.0;
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
    const double voxels = std::pow(8.0, tree.getTreeDepth() - leaf.getDepth());
    sizes.count(voxels);
    num_voxels += voxels;
    ++num_cells;
    num_occupied += tree.isNodeOccupied(*leaf) ? 1 : 0;
  }
  run["cells"] = num_cells;
  run["occupied_cells"] = num_occupied;
  run["free_cells"] = num_cells - num_occupied;
  run["hierarchy_nodes"] = tree.size() - num_cells;
  run["voxels"] = num_voxels;
  run["full_grid_cells"] = fullGridCells(tree);
  run["access_occupied_ms"] =
      1e3 * cpuTimeOfOne_s([&] { return visitOccupied(tree); }, min_query_s);
  run["size_histogram"] = sizes.counts();
  // Without compression every voxel is a leaf. The copy goes at once: it is large.
  octomap::OcTree uncompressed(tree);
  uncompressed.expand();
  run["cells_uncompressed"] = num_voxels;
  run["hierarchy_nodes_uncompressed"] = uncompressed.size() - static_cast<std::size_t>(num_voxels);
  return run;
}

json runCuboidMap(const RunSpec& spec, const std::vector<Scan>& scans, double min_query_s,
                  const octomap::OcTree& octomap) {
  json run = describe(spec, scans);
  MapConfig config = spec.map;
  const BeamSampling sampling = config.beamSampling();
  config.growth.rules = makeRules(spec.growth, sampling.seed);
  CuboidMap map(config);
  ScanUpdater updater(map.grid(), kNoLimit, 1,
                      spec.growth.starters == GrowthStarters::kSampled ? sampling : BeamSampling());
  double cpu_s = 0.0;
  json cells_over_time = json::array();
  for (const Scan& scan : scans) {
    throwIfInterrupted();
    cpu_s += timeOf([&] { map.apply(updater.compute(scan)); }).cpu_s;
    cells_over_time.push_back(countCuboids(map).total());
  }
  addInsertion(cpu_s, run);
  run["cells_over_time"] = std::move(cells_over_time);
  addTree(map, sizeOf(map), min_query_s, run);
  run["bytes"] = map.numBytes();
  if (config.environment == Environment::kDynamic) {
    const Agreement agreement = compareWithOctomap(map, octomap);
    run["known_mismatch"] = agreement.known_mismatch;
    run["class_mismatch"] = agreement.class_mismatch;
    run["max_log_odds_difference"] = agreement.max_log_odds_difference;
  }
  return run;
}

json runPaperGrid(const RunSpec& spec, const std::vector<Scan>& scans, double min_query_s) {
  json run = describe(spec, scans);
  const MapConfig& config = spec.map;
  const Grid grid(config.resolution_m);
  PaperGrid paper(SensorModel(config.sensor_model, Environment::kStatic), config.rtree,
                  *spec.reading);
  ScanUpdater updater(grid, kNoLimit, 1, config.growth.sampling);
  double cpu_s = 0.0;
  json cells_over_time = json::array();
  for (const Scan& scan : scans) {
    throwIfInterrupted();
    cpu_s += timeOf([&] {
               const ScanUpdate& update = updater.compute(scan);
               paper.update(update);
               paper.fuse(startersOf(update));
             }).cpu_s;
    cells_over_time.push_back(paper.tree().size());
  }
  addInsertion(cpu_s, run);
  run["cells_over_time"] = std::move(cells_over_time);
  addTree(paper.tree(), sizeOf(paper.tree()), min_query_s, run);
  return run;
}

}  // namespace cuboid_mapping::bench
