// SPDX-License-Identifier: BSD-3-Clause
// The oracle of the map: one number for each known voxel, in a hash map.
#pragma once

#include "cuboid_mapping/occupancy/cuboid.h"
#include "cuboid_mapping/occupancy/sensor_model.h"
#include "cuboid_mapping/scan/scan_update.h"

#include <algorithm>
#include <optional>
#include <unordered_map>
#include <vector>

namespace cuboid_mapping::test {

struct CellHash {
  std::size_t operator()(const Cell& cell) const {
    std::uint64_t hash = static_cast<std::uint32_t>(cell.x);
    hash = hash * 0x9E3779B97F4A7C15ULL + static_cast<std::uint32_t>(cell.y);
    hash = hash * 0x9E3779B97F4A7C15ULL + static_cast<std::uint32_t>(cell.z);
    return static_cast<std::size_t>(hash ^ hash >> 32);
  }
};

/// The voxels that a cloud observes; true for a hit, which wins over a miss.
using ObservedCells = std::unordered_map<Cell, bool, CellHash>;

/// Calls visit(cell) for every cell of a small box.
template <typename VisitorT>
void visitCells(const CellBox& box, VisitorT visit) {
  for (std::int32_t z = box.min.z; z < box.max.z; ++z) {
    for (std::int32_t y = box.min.y; y < box.max.y; ++y) {
      for (std::int32_t x = box.min.x; x < box.max.x; ++x) visit(Cell{x, y, z});
    }
  }
}

[[nodiscard]] inline bool isInMask(const BrickMask& mask, const Cell& cell) {
  return mask.test(voxelIndex(cell));
}

/// The observed voxels of an update, one by one.
[[nodiscard]] inline ObservedCells toObservedCells(const ScanUpdate& update) {
  ObservedCells cells;
  for (const BrickUpdate& brick : update.bricks) {
    visitCells(brickBox(brick.brick), [&](const Cell& cell) {
      if (isInMask(brick.hits, cell)) {
        cells[cell] = true;
      } else if (isInMask(brick.misses, cell)) {
        cells[cell] = false;
      }
    });
  }
  return cells;
}

/// Model of a CuboidMap, voxel by voxel, without cuboids.
class VoxelMap {
 public:
  explicit VoxelMap(const SensorModel& sensor_model) : model_(sensor_model) {
    log_odds_.max_load_factor(0.25F);
  }

  /// @return Number of changed voxels.
  std::size_t apply(const ScanUpdate& update) {
    std::size_t num_changed = 0;
    for (const auto& [cell, is_hit] : toObservedCells(update)) {
      const auto [voxel, is_new] = log_odds_.emplace(cell, 0.0F);
      const float before = voxel->second;
      const bool is_stable = before <= model_.min() || before >= model_.max();
      if (!is_stable || model_.environment() == Environment::kDynamic) {
        const float sum = before + (is_hit ? model_.hit() : model_.miss());
        voxel->second = std::min(std::max(sum, model_.min()), model_.max());
      }
      num_changed += is_new || voxel->second != before ? 1 : 0;
    }
    return num_changed;
  }

  void clear() { log_odds_.clear(); }

  /// Sets another sensor model for later clouds.
  void setSensorModel(const SensorModel& model) { model_ = model; }

  /// Gives a voxel a value; nothing makes it unknown.
  void set(const Cell& cell, const std::optional<float>& log_odds) {
    if (log_odds) {
      log_odds_[cell] = *log_odds;
    } else {
      log_odds_.erase(cell);
    }
  }

  /// Replaces everything inside a box by boxes.
  void replace(const CellBox& box, const std::vector<UniformBox>& boxes) {
    for (auto voxel = log_odds_.begin(); voxel != log_odds_.end();) {
      voxel = box.contains(voxel->first) ? log_odds_.erase(voxel) : std::next(voxel);
    }
    for (const UniformBox& uniform : boxes) {
      visitCells(uniform.box, [&](const Cell& cell) { log_odds_[cell] = uniform.log_odds; });
    }
  }

  /// Log-odds of a voxel; nothing if it is unknown.
  [[nodiscard]] std::optional<float> find(const Cell& cell) const {
    const auto found = log_odds_.find(cell);
    return found == log_odds_.end() ? std::nullopt : std::optional<float>(found->second);
  }

  [[nodiscard]] Occupancy occupancyAt(const Cell& cell) const {
    const auto log_odds = find(cell);
    return log_odds ? classify(*log_odds) : Occupancy::kUnknown;
  }

  [[nodiscard]] const std::unordered_map<Cell, float, CellHash>& voxels() const {
    return log_odds_;
  }

 private:
  SensorModel model_;
  std::unordered_map<Cell, float, CellHash> log_odds_;
};

}  // namespace cuboid_mapping::test
