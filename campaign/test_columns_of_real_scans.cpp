// SPDX-License-Identifier: BSD-3-Clause
// Real scans, thinned, turned and moved: columns observe what the walk of each beam observes.
//
// CUBOID_MAPPING_CLOUDS sets the number of clouds of each set: 1 by default.
#include "cuboid_mapping/scan/scan_update.h"
#include "data_sets/scan_dataset.h"
#include "support/random_shapes.h"
#include "support/same_updates.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>

namespace cuboid_mapping::campaign {
namespace {

using test::Random;

constexpr double kUncut = std::numeric_limits<double>::infinity();

struct Set {
  const char* name;
  double resolution_m;
  double max_range_m;
};

std::size_t numClouds() {
  const char* text = std::getenv("CUBOID_MAPPING_CLOUDS");
  return text == nullptr ? 1 : std::strtoull(text, nullptr, 10);
}

/// A copy with every n-th point, turned, on borders of voxels, or far from the origin of the map.
Scan change(const ScanDataset::Item& item, double resolution_m, std::size_t every, Random& random) {
  Eigen::Isometry3d T_map_sensor = item.T_map_sensor;
  if (random.chance(0.3)) {
    const Eigen::Vector3d axis = test::randomDirection(random).normalized();
    T_map_sensor.rotate(Eigen::AngleAxisd(random.real(0.0, 6.3), axis));
  }
  if (random.chance(0.2)) {
    const Eigen::Vector3d voxels = T_map_sensor.translation() / resolution_m;
    T_map_sensor.translation() = voxels.array().round() * resolution_m;
  }
  if (random.chance(0.2)) T_map_sensor.pretranslate(Eigen::Vector3d(1e6, -1e6, 1e6));
  std::vector<Eigen::Vector3f> points;
  for (std::size_t i = 0; i < item.points_sensor.size(); i += every) {
    points.push_back(item.points_sensor[i]);
  }
  return makeScan(T_map_sensor, T_map_sensor.translation(), points);
}

TEST(ColumnWalk, givesTheUpdateOfTheWalkForRealScans) {
  const char* folder = std::getenv("CUBOID_DATA_DIR");
  if (folder == nullptr) GTEST_SKIP() << "CUBOID_DATA_DIR is not set";
  constexpr Set kSets[] = {{"rgbd_7scenes", 0.05, 2.5},    {"rgbd_7scenes", 0.02, 1.5},
                           {"sim_fr079", 0.05, 5.0},       {"sim_fr079", 0.1, 5.0},
                           {"kitti_0005_city", 0.2, 30.0}, {"muehlburger_tor_standing", 0.2, 20.0}};
  Random random(66);
  std::size_t num_cases = 0;
  std::size_t num_slabs = 0;
  for (const Set& set : kSets) {
    const auto dataset = openScanDataset(std::string(folder) + "/" + set.name);
    const Grid grid(set.resolution_m);
    for (std::size_t i = 0; i < std::min(dataset->size(), numClouds()); ++i) {
      const ScanDataset::Item item = dataset->read(i);
      for (const std::size_t every : {1U, 2U, 4U}) {
        SCOPED_TRACE(set.name + std::string(", scan ") + std::to_string(i) + ", every " +
                     std::to_string(every) + test::seedNote(num_cases));
        const Scan scan = change(item, set.resolution_m, every, random);
        const double max_range_m = random.chance(0.3) ? set.max_range_m : kUncut;
        const BeamRanges ranges{max_range_m, 0.0, random.chance(0.5)};
        ScanUpdater columns(grid, ranges, random.integer(1, 8));
        columns.setColumnUse(ColumnUse::kAlways);
        ScanUpdater walk(grid, ranges);
        walk.setColumnUse(ColumnUse::kNever);
        ASSERT_EQ(test::findDifference(columns.compute(scan), walk.compute(scan)), "");
        num_slabs += columns.numColumnSlabs();
        ++num_cases;
      }
    }
  }
  EXPECT_GE(num_cases, 3 * std::size(kSets));
  EXPECT_GT(num_slabs, num_cases);
}

}  // namespace
}  // namespace cuboid_mapping::campaign
