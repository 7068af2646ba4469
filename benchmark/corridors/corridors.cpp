// SPDX-License-Identifier: BSD-3-Clause
// Corridors between random places of known free space: this map, the leaves of OctoMap, single voxels.
#include "corridors/leaf_corridor.h"
#include "corridors/voxel_path.h"

#include "command_line.h"
#include "dataset.h"
#include "machine.h"
#include "measurement.h"
#include "octomap_update.h"
#include "result_file.h"
#include "timing.h"

#include "cuboid_mapping/interop/octomap_parity.h"
#include "cuboid_mapping/query/corridor_boxes.h"
#include "cuboid_mapping/query/corridor_query.h"
#include "cuboid_mapping/query/path_query.h"
#include "cuboid_mapping/scan/scan_update.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <random>
#include <stdexcept>
#include <unordered_map>

namespace cuboid_mapping::bench {
namespace {

using nlohmann::json;
using octomap::OcTree;

struct Options : Measurement {
  int pairs = 50;
  double change_m = 1.0;
  unsigned int seed = 1;
};

struct Pair {
  Cell start;
  Cell goal;
};

/// The same voxels in both maps, always.
struct Maps {
  CuboidMap ours;
  OcTree octomap;

  [[nodiscard]] Eigen::Vector3d centerOf(const Cell& cell) const {
    return ours.grid().centerOf(CellBox::ofCell(cell));
  }
  [[nodiscard]] Eigen::Vector3d robot_m() const {
    return Eigen::Vector3d::Constant(ours.grid().resolution());
  }
};

Maps makeMaps(const Options& options) {
  MapConfig config;
  config.resolution_m = options.resolution_m;
  Maps maps{CuboidMap(config), makeOctomap(config)};
  ScanUpdater updater(maps.ours.grid());
  for (const Scan& scan : readScans({options.dataset, "", "", options.max_clouds, 1})) {
    throwIfInterrupted();
    const ScanUpdate& update = updater.compute(scan);
    maps.ours.apply(update);
    updateOctomap(update, maps.octomap);
  }
  return maps;
}

/// A way of one of the maps.
struct Plan {
  bool is_found = false;
  std::vector<CellBox> boxes;  ///< What the map says is free: boxes, leaves, voxels.
  std::vector<Eigen::Vector3d> path_map;
  double length_m = 0.0;
  std::size_t num_reached = 0;
};

Plan planOurs(const Maps& maps, const Pair& pair) {
  CorridorTask task;
  task.start_map = maps.centerOf(pair.start);
  task.goal_map = maps.centerOf(pair.goal);
  task.size_m = maps.robot_m();
  auto answer = findCorridor(maps.ours, task, UnknownPolicy::kObstacle, Budget::unlimited());
  Corridor& found = answer.value;
  return {answer.isFound(), std::move(found.boxes), std::move(found.path_map), found.length_m,
          found.num_visited};
}

Plan planLeaves(const Maps& maps, const Pair& pair) {
  LeafCorridor found = findLeafCorridor(maps.octomap, pair.start, pair.goal);
  Plan plan{found.is_found, std::move(found.leaves), {}, 0.0, found.num_reached};
  if (!plan.is_found) return plan;
  const CorridorPortals portals =
      findPortals(maps.ours.grid(), linkLeaves(plan.boxes), Cell{1, 1, 1});
  plan.path_map = pullTight(portals, maps.centerOf(pair.start), maps.centerOf(pair.goal));
  plan.length_m = lengthOf(plan.path_map);
  return plan;
}

Plan planVoxels(const Maps& maps, const Pair& pair) {
  const VoxelPath found = findVoxelPath(maps.ours.voxels(), pair.start, pair.goal);
  Plan plan{!found.voxels.empty(),
            {},
            {},
            found.length * maps.ours.grid().resolution(),
            found.num_reached};
  for (const Cell& voxel : found.voxels) {
    plan.boxes.push_back(CellBox::ofCell(voxel));
    plan.path_map.push_back(maps.centerOf(voxel));
  }
  return plan;
}

struct Planner {
  const char* map;
  Plan (*plan)(const Maps&, const Pair&);
};
constexpr Planner kPlanners[] = {
    {"voxels", planVoxels}, {"cuboid_mapping", planOurs}, {"octomap", planLeaves}};

/// Volume of all boxes together, in voxels.
double countVoxels(const std::vector<CellBox>& boxes) {
  std::unordered_map<Cell, BrickMask, CellHash> bricks;
  for (const CellBox& box : boxes) {
    forEachBrick(box, [&](const Cell& brick) {
      BrickMask& mask = bricks[brick];
      mask = mask | BrickMask::ofBox(intersect(box, brickBox(brick)));
    });
  }
  double count = 0.0;
  for (const auto& [brick, mask] : bricks) count += mask.count();
  return count;
}

/// Whether all that a plan says is true in both maps: its boxes are free, voxel by voxel, and so is what
/// the robot sweeps on its path from start to goal.
bool isRight(const Maps& maps, const Pair& pair, const Plan& plan) {
  if (!plan.is_found) return true;
  const Obstacles obstacles(maps.ours, UnknownPolicy::kObstacle, Budget::unlimited());
  for (const CellBox& box : plan.boxes) {
    if (obstacles.isAny(box) || countFree(maps.octomap, box) != box.numVoxels()) return false;
  }
  const auto swept = checkPath(maps.ours, plan.path_map, maps.robot_m(), UnknownPolicy::kObstacle,
                               Budget::unlimited());
  return swept.isNotFound() && plan.path_map.front() == maps.centerOf(pair.start) &&
         plan.path_map.back() == maps.centerOf(pair.goal);
}

json describe(const Maps& maps, const Plan& plan, double cpu_s) {
  json report{{"found", plan.is_found}, {"reached", plan.num_reached}, {"plan_ms", 1e3 * cpu_s}};
  if (!plan.is_found) return report;
  report["boxes"] = plan.boxes.size();
  report["volume_m3"] = countVoxels(plan.boxes) * maps.ours.grid().voxelVolume();
  report["length_m"] = plan.length_m;
  return report;
}

/// Plans of all maps, in the order of kPlanners, and a row for each.
struct Round {
  std::vector<Plan> plans;
  std::vector<json> rows;
};

/// @throws std::logic_error when a plan is wrong, or not all maps find one.
Round planAll(const Maps& maps, const Pair& pair) {
  Round round;
  for (const Planner& planner : kPlanners) {
    throwIfInterrupted();
    Plan plan;
    const double cpu_s = timeOf([&] { plan = planner.plan(maps, pair); }).cpu_s;
    if (!isRight(maps, pair, plan)) throw std::logic_error(std::string(planner.map) + " is wrong");
    round.rows.push_back(describe(maps, plan, cpu_s));
    round.plans.push_back(std::move(plan));
    if (round.plans.back().is_found != round.plans.front().is_found) {
      throw std::logic_error(std::string(planner.map) +
                             " finds what voxels do not, or the reverse");
    }
  }
  return round;
}

/// Makes a box occupied in both maps. @return CPU milliseconds, by map.
json occupy(const CellBox& box, Maps& maps) {
  const float occupied = maps.ours.sensorModel().max();
  const double ours_s = timeOf([&] { maps.ours.replace(box, {{box, occupied}}); }).cpu_s;
  const double octomap_s =
      timeOf([&] {
        forEachBrick(box, [&](const Cell& brick) {
          forEachCell(brick, BrickMask::ofBox(intersect(box, brickBox(brick))),
                      [&](const Cell& cell) { maps.octomap.setNodeValue(toKey(cell), occupied); });
        });
      }).cpu_s;
  return {{"cuboid_mapping", 1e3 * ours_s}, {"octomap", 1e3 * octomap_s}};
}

/// Puts a box in the middle of the shortest path, and plans again. Start and goal stay free.
void replan(const Options& options, const Pair& pair, Maps& maps, Round& round) {
  const std::vector<CellBox>& way = round.plans.front().boxes;
  const auto room = std::max(0, static_cast<int>(options.change_m / options.resolution_m / 2.0));
  const Cell middle = way[way.size() / 2].min;
  const CellBox change{middle - Cell{room, room, room},
                       middle + Cell{room + 1, room + 1, room + 1}};
  if (change.contains(pair.start) || change.contains(pair.goal)) return;
  const json update_ms = occupy(change, maps);
  const Round again = planAll(maps, pair);
  for (std::size_t i = 0; i < round.plans.size(); ++i) {
    const Plan& before = round.plans[i];
    json& row = round.rows[i];
    row["is_corridor_hit"] =
        std::any_of(before.boxes.begin(), before.boxes.end(),
                    [&](const CellBox& box) { return box.intersects(change); });
    row["is_path_hit"] = checkPath(maps.ours, before.path_map, maps.robot_m(),
                                   UnknownPolicy::kObstacle, Budget::unlimited())
                             .isFound();
    row["again"] = again.rows[i];
    if (update_ms.contains(kPlanners[i].map)) row["update_ms"] = update_ms[kPlanners[i].map];
  }
}

std::vector<Cell> freeVoxels(const CuboidMap& map) {
  std::vector<Cell> cells;
  map.voxels().forEach([&](const VoxelBrick& brick) {
    forEachCell(brick.brick, brick.voxels.free(), [&](const Cell& cell) { cells.push_back(cell); });
  });
  std::sort(cells.begin(), cells.end());
  return cells;
}

json measure(const Options& options) {
  Maps maps = makeMaps(options);
  const std::vector<Cell> places = freeVoxels(maps.ours);
  if (places.size() < 2) throw std::runtime_error("the map has no free space");
  std::mt19937_64 random(options.seed);
  const auto draw = [&] {
    for (;;) {  // What was occupied since is passed over.
      const Cell& place = places[random() % places.size()];
      if (maps.ours.voxels().at(place) == Occupancy::kFree) return place;
    }
  };
  json rows = json::array();
  for (int number = 0; number < options.pairs; ++number) {
    const Cell start = draw();
    const Pair pair{start, draw()};
    Round round = planAll(maps, pair);
    if (round.plans.front().is_found) replan(options, pair, maps, round);
    for (std::size_t i = 0; i < round.rows.size(); ++i) {
      json& row = round.rows[i];
      row["map"] = kPlanners[i].map;
      row["pair"] = number;
      row["distance_m"] = (maps.centerOf(pair.goal) - maps.centerOf(pair.start)).norm();
      rows.push_back(std::move(row));
    }
  }
  if (!compareWithOctomap(maps.ours, maps.octomap).isExact()) {
    throw std::logic_error("the maps differ");
  }
  return {{"resolution_m", options.resolution_m},
          {"change_m", options.change_m},
          {"commit", describeMachine().commit},
          {"rows", rows}};
}

int run(int argc, char** argv) {
  Options options;
  CommandLine line("corridors",
                   "Compares paths between random places: corridors of this map, OctoMap's leaves, "
                   "and the shortest path from voxel to voxel.");
  declareMeasurement(line, options);
  line.addNumber("pairs", options.pairs, "number of pairs of start and goal", {1, 1e6});
  line.addNumber("change", options.change_m,
                 "edge of a box placed in the way before planning again [m]", {0.001, 1000.0});
  line.addNumber("seed", options.seed, "seed of the random places");
  if (const auto status = line.parse(argc, argv)) return *status;
  writeOrPrint(options.out, [&options] { return measure(options).dump(1) + '\n'; });
  return 0;
}

}  // namespace
}  // namespace cuboid_mapping::bench

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("corridors", argc, argv, cuboid_mapping::bench::run);
}
