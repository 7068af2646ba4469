// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/map_merge.h"

#include "cuboid_mapping/geometry/box_faces.h"
#include "cuboid_mapping/geometry/voxel_motion.h"
#include "cuboid_mapping/map/locked_boxes.h"
#include "cuboid_mapping/parallel/parallel_for.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace cuboid_mapping {
namespace {

/// A transform between two grids, in units of voxels.
struct CellMotion {
  Eigen::Isometry3d T_target_map;
  bool is_exact;  ///< Maps voxels to voxels; the transform has whole numbers then.
};

CellMotion toCellMotion(const Eigen::Isometry3d& T_target_map, double resolution_m) {
  if (const auto exact = VoxelMotion::of(T_target_map, resolution_m)) {
    return {exact->transform(), true};
  }
  CellMotion motion{T_target_map, false};
  motion.T_target_map.translation() /= resolution_m;
  if (!motion.T_target_map.matrix().allFinite() || !T_target_map.linear().isUnitary(1e-6) ||
      T_target_map.linear().determinant() < 0.0) {
    throw std::invalid_argument(
        "the transform must be a rotation and a translation in finite numbers");
  }
  return motion;
}

/// Bounding box of a moved box.
Eigen::AlignedBox3d moved(const CellBox& box, const Eigen::Isometry3d& T_target_map) {
  Eigen::AlignedBox3d around;
  for (int corner = 0; corner < 8; ++corner) {
    around.extend(T_target_map *
                  toVector({(corner & 1 ? box.max : box.min).x, (corner & 2 ? box.max : box.min).y,
                            (corner & 4 ? box.max : box.min).z}));
  }
  return around;
}

/// Voxels of the box around a moved box, within the limits of a map.
CellBox coverMoved(const CellBox& box, const Eigen::Isometry3d& T_target_map) {
  const Eigen::AlignedBox3d around = moved(box, T_target_map);
  const Eigen::Vector3d limit = Eigen::Vector3d::Constant(Grid::kMaxCell);
  return {floorOf(around.min().cwiseMax(-limit).cwiseMin(limit)),
          floorOf(around.max().array().ceil().matrix().cwiseMax(-limit).cwiseMin(limit))};
}

/// Voxels that a moved brick may touch.
CellBox coverMovedBrick(const Cell& brick, const Eigen::Isometry3d& T_target_map) {
  const Eigen::AlignedBox3d around = moved(brickBox(brick), T_target_map);
  if (around.min().minCoeff() < kAllCells.min.x + 1.0 ||
      around.max().maxCoeff() > kAllCells.max.x - 1.0) {
    throw std::invalid_argument("the transform takes the map beyond the limits of a map");
  }
  return {floorOf(around.min()), floorOf(around.max().array().ceil())};
}

/// Bricks that a moved map may touch, along the Morton curve.
std::vector<VoxelBrick> findTargets(const MapSnapshot& map, const Eigen::Isometry3d& T_target_map) {
  std::vector<VoxelBrick> targets;
  for (const VoxelBrick& brick : map.bricks) {
    forEachBrick(coverMovedBrick(brick.brick, T_target_map), [&](const Cell& target) {
      targets.push_back({target, {}});
    });
  }
  sortBricks(targets);
  const auto is_same = [](const auto& a, const auto& b) { return a.brick == b.brick; };
  targets.erase(std::unique(targets.begin(), targets.end(), is_same), targets.end());
  return targets;
}

/// Reads voxels at places of another frame. Const functions may run side by side.
class Sampler {
 public:
  Sampler(const std::vector<VoxelBrick>& bricks, const CellMotion& motion)
      : to_source_(motion.T_target_map.inverse()), is_exact_(motion.is_exact) {
    VoxelStore::PendingChange change = voxels_.prepareReplace(kAllCells, bricks, {});
    voxels_.reserve(change);
    voxels_.commit(change, [](const auto& /*brick*/) {});
  }

  [[nodiscard]] PackedVoxels read(const Cell& brick) const {
    return is_exact_ ? gather(brick) : sample(brick);
  }

 private:
  /// The voxels of a brick, gathered from the bricks of the source.
  [[nodiscard]] PackedVoxels gather(const Cell& brick) const {
    const Cell first = sourceOf(brick);
    const Cell last = sourceOf(brick + Cell{7, 7, 7});
    const CellBox from{
        {std::min(first.x, last.x), std::min(first.y, last.y), std::min(first.z, last.z)},
        {std::max(first.x, last.x) + 1, std::max(first.y, last.y) + 1,
         std::max(first.z, last.z) + 1}};
    // Change of voxelIndex() by a step along an axis of the source.
    const Eigen::Vector3i steps =
        (to_source_.linear() * Eigen::Vector3d(1.0, 8.0, 64.0)).array().round().cast<int>();
    BrickMask known;
    VoxelValues values{};
    VoxelValues others;
    forEachBrick(from, [&](const Cell& source) {
      const PackedVoxels* voxels = voxels_.find(source);
      if (voxels == nullptr) return;
      voxels->getValues(others);
      const BrickMask part = BrickMask::ofBox(intersect(from, brickBox(source)));
      (voxels->known() & part).forEach([&](int voxel) {
        const Cell offset = cellAt(source, voxel) - first;
        const int to = steps.x() * offset.x + steps.y() * offset.y + steps.z() * offset.z;
        known.set(to);
        values[static_cast<std::size_t>(to)] = others[static_cast<std::size_t>(voxel)];
      });
    });
    return {known, values};
  }

  [[nodiscard]] PackedVoxels sample(const Cell& brick) const {
    BrickMask known;
    VoxelValues values{};
    for (int voxel = 0; voxel < kBrickVoxels; ++voxel) {
      const auto log_odds = voxels_.logOddsAt(sourceOf(cellAt(brick, voxel)));
      if (!log_odds) continue;
      known.set(voxel);
      values[static_cast<std::size_t>(voxel)] = *log_odds;
    }
    return {known, values};
  }

  [[nodiscard]] Cell sourceOf(const Cell& cell) const {
    return floorOf(to_source_ * (toVector(cell) + Eigen::Vector3d::Constant(0.5)));
  }

  Eigen::Isometry3d to_source_;
  bool is_exact_;
  VoxelStore voxels_;
};

/// Fills bricks with several threads.
void readAll(const Sampler& sampler, int threads, const ProgressListener& listener,
             std::vector<VoxelBrick>& targets) {
  constexpr std::size_t kPartBricks = 256;
  const std::size_t num_parts = (targets.size() + kPartBricks - 1) / kPartBricks;
  std::mutex mutex;
  std::uint64_t num_done = 0;
  parallelFor(num_parts, threads, [&](std::size_t part) {
    const std::size_t end = std::min(targets.size(), (part + 1) * kPartBricks);
    for (std::size_t i = part * kPartBricks; i < end; ++i) {
      targets[i].voxels = sampler.read(targets[i].brick);
    }
    if (!listener) return;
    const std::lock_guard<std::mutex> lock(mutex);
    listener(++num_done, num_parts);
  });
}

float apply(MergeRule rule, float first, float second) {
  switch (rule) {
    case MergeRule::kLater: return second;
    case MergeRule::kOccupied: return std::max(first, second);
    default: return first + second;
  }
}

/// Merges two bricks, either of which may have no known voxel.
PackedVoxels mergeBricks(const PackedVoxels& first, const PackedVoxels& second, MergeRule rule,
                         const SensorModel& model) {
  const BrickMask both = first.known() & second.known();
  VoxelValues values;
  VoxelValues others;
  first.getValues(values);
  second.getValues(others);
  second.known().forEach([&](int voxel) {
    const auto at = static_cast<std::size_t>(voxel);
    values[at] = both.test(voxel) ? apply(rule, values[at], others[at]) : others[at];
  });
  const BrickMask known = first.known() | second.known();
  known.forEach([&](int voxel) {
    float& value = values[static_cast<std::size_t>(voxel)];
    value = std::clamp(value, model.min(), model.max());
  });
  return {known, values};
}

}  // namespace

bool moveMap(const Eigen::Isometry3d& T_target_map, MapSnapshot& map, int threads,
             const ProgressListener& listener) {
  const CellMotion motion = toCellMotion(T_target_map, map.resolution_m);
  std::vector<VoxelBrick> targets = findTargets(map, motion.T_target_map);
  readAll(Sampler(map.bricks, motion), threads, listener, targets);
  const auto is_empty = [](const VoxelBrick& brick) { return brick.voxels.isEmpty(); };
  targets.erase(std::remove_if(targets.begin(), targets.end(), is_empty), targets.end());
  LockedBoxes locked;
  for (const CellBox& box : map.locked) locked.add(coverMoved(box, motion.T_target_map));
  map.locked = locked.boxes();
  map.bricks = std::move(targets);
  map.cuboids.clear();
  map.fusion = FusionKind::kClass;
  return motion.is_exact;
}

const char* toString(MergeRule rule) {
  switch (rule) {
    case MergeRule::kLater: return "later";
    case MergeRule::kOccupied: return "occupied";
    default: return "sum";
  }
}

std::optional<MergeRule> mergeRuleOfName(const std::string& name) {
  for (const MergeRule rule : {MergeRule::kSum, MergeRule::kLater, MergeRule::kOccupied}) {
    if (name == toString(rule)) return rule;
  }
  return std::nullopt;
}

MapOverlap mergeMaps(MapSnapshot& target, const MapSnapshot& source, MergeRule rule) {
  if (std::abs(target.resolution_m - source.resolution_m) > 1e-9 * target.resolution_m) {
    std::ostringstream text;
    text << "the maps have different resolutions, " << target.resolution_m << " and "
         << source.resolution_m << " m: make both with one resolution";
    throw std::invalid_argument(text.str());
  }
  const SensorModel model(target.sensor_model, target.environment);
  const PackedVoxels nothing;
  std::vector<VoxelBrick> merged;
  MapOverlap overlap;
  auto a = target.bricks.cbegin();
  auto b = source.bricks.cbegin();
  while (a != target.bricks.cend() || b != source.bricks.cend()) {
    const bool is_a = b == source.bricks.cend() ||
                      (a != target.bricks.cend() && !isBeforeOnMortonCurve(b->brick, a->brick));
    const bool is_b = b != source.bricks.cend() && (!is_a || b->brick == a->brick);
    const PackedVoxels& from_a = is_a ? a->voxels : nothing;
    const PackedVoxels& from_b = is_b ? b->voxels : nothing;
    merged.push_back({is_a ? a->brick : b->brick, mergeBricks(from_a, from_b, rule, model)});
    const BrickMask both = from_a.known() & from_b.known();
    overlap.known_to_both += both.count();
    overlap.other_class += ((from_a.occupied() ^ from_b.occupied()) & both).count();
    overlap.only_in_first += from_a.known().without(both).count();
    overlap.only_in_second += from_b.known().without(both).count();
    if (is_a) ++a;
    if (is_b) ++b;
  }
  LockedBoxes locked;
  for (const std::vector<CellBox>* boxes : {&std::as_const(target).locked, &source.locked}) {
    for (const CellBox& box : *boxes) locked.add(box);
  }
  target.locked = locked.boxes();
  target.bricks = std::move(merged);
  target.cuboids.clear();
  target.fusion = FusionKind::kClass;
  return overlap;
}

std::string describeMotion(bool is_exact) {
  return is_exact ? "moved by whole voxels: exact"
                  : "moved and resampled: voxels lie up to 0.9 voxels from where they were";
}

std::string describe(const MapOverlap& overlap, MergeRule rule) {
  std::ostringstream text;
  text.precision(15);
  text << overlap.known_to_both << " voxels known to both (" << overlap.other_class
       << " of another class), " << overlap.only_in_first << " to the first alone, "
       << overlap.only_in_second << " to the second alone; rule '" << toString(rule)
       << "'. This is not the map that one mapper with all clouds would have made";
  return text.str();
}

}  // namespace cuboid_mapping
