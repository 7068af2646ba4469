// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/window/map_window.h"
#include "support/random_bricks.h"
#include "support/snapshots.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping::test {

inline MapSnapshot headOf(const MapConfig& config) {
  return {config.resolution_m, config.sensor_model, config.environment, "map", {}};
}

/// A window and its map, and a map without a window that gets the same changes.
struct WindowPair {
  WindowPair(const MapConfig& map_config, const WindowConfig& window_config, std::string store_file)
      : config(window_config), file(std::move(store_file)), plain(map_config), map(map_config) {
    open();
  }

  void open() {
    auto store =
        config.outside == OutsideWindow::kKeep ? openStoreOf(headOf(map.config()), file) : nullptr;
    window = std::make_unique<MapWindow>(config, std::move(store), map);
  }

  /// Restarts, as a program that ends and is started again.
  void startAgain() {
    EXPECT_TRUE(window->save());
    window.reset();
    map.clear();
    open();
  }

  void integrate(const ScanUpdate& update, const Eigen::Vector3d& center) {
    plain.apply(update);
    changes = {};
    const ScanUpdate& admitted = window->admit(update, center, changes);
    CuboidMap::PendingChange change = map.prepare(admitted, map.sensorModel());
    window->commit(change, changes);
  }

  void replace(const CellBox& box, const std::vector<UniformBox>& boxes) {
    plain.replace(box, boxes);
    window->edit(
        box, [&] { return map.replace(box, boxes); }, changes);
  }

  void clear() {
    plain.clear();
    window->replaceAll([&] { return map.clear(); }, changes);
    (void)window->save();
  }

  /// Voxels of store and memory as one map.
  [[nodiscard]] std::map<Cell, float> voxels() const {
    MapSnapshot snapshot = takeSnapshot(map, "");
    for (const Cell& page : window->storedPages()) window->addStored(page, {}, snapshot);
    sortBricks(snapshot.bricks);
    EXPECT_FALSE(findFault(snapshot));
    return voxelsOf(snapshot.bricks);
  }

  WindowConfig config;
  std::string file;
  CuboidMap plain;
  CuboidMap map;
  std::unique_ptr<MapWindow> window;
  ChangeSet changes;
};

inline MapConfig randomConfig(Random& random) {
  MapConfig config;
  config.resolution_m = 0.1;
  config.environment = random.chance(0.7) ? Environment::kDynamic : Environment::kStatic;
  config.fusion = random.chance(0.6)   ? FusionKind::kClass
                  : random.chance(0.5) ? FusionKind::kGrowth
                                       : FusionKind::kNone;
  return config;
}

/// A walk of the window, with updates around it, and some far away.
struct Walk {
  explicit Walk(Random& walk_random) : random(walk_random) {}

  void step(WindowPair& pair) {
    for (int axis = 0; axis < 2; ++axis) {
      place[axis] = std::clamp(place[axis] + random.integer(-4, 4), -60, 60);
    }
    const Cell around = random.chance(0.05) ? Cell{random.integer(-60, 60), place.y, 0} : place;
    const Cell reach{random.integer(1, 12), random.integer(1, 12), 3};
    const ScanUpdate update = randomUpdate(random, {around - reach, around + reach}, 40);
    pair.integrate(update, pair.map.grid().toMetres(center()));
  }

  [[nodiscard]] Eigen::Vector3d center() const {
    return kBrickEdge * Eigen::Vector3d(place.x, place.y, place.z);
  }

  Random& random;
  Cell place;  ///< Place in bricks.
};

inline MapConfig tenthOfAMetre() {
  MapConfig config;
  config.resolution_m = 0.1;
  return config;
}

/// A cloud of one brick with all voxels occupied.
inline ScanUpdate updateOf(const Cell& brick) {
  ScanUpdate update;
  update.bricks.push_back({brick, BrickMask::all(), {}});
  return update;
}

inline Eigen::Vector3d placeOf(const WindowPair& pair, const Cell& cell) {
  return pair.map.grid().centerOf(CellBox::ofCell(cell));
}

}  // namespace cuboid_mapping::test
