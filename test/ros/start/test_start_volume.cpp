// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/start/start_volume.h"

#include "cuboid_mapping/scan/scan_filter.h"
#include "ros/parameter_groups.h"

#include <gtest/gtest.h>

#include <cmath>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::CellBox;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::MapConfig;
using cuboid_mapping::Occupancy;
using cuboid_mapping::UniformBox;

const MetricBox kStartBox{{-0.6, -0.4, 0.0}, {0.6, 0.4, 0.8}};

CuboidMap makeStartMap() {
  MapConfig config;
  config.resolution_m = 0.1;
  return CuboidMap(config);
}

TEST(StartVolume, FreesWhatIsUnknownInTheTurnedBoxAndNothingElse) {
  CuboidMap map = makeStartMap();
  const CellBox seen{{0, 0, 0}, {2, 2, 2}};
  map.replace(seen, {UniformBox{seen, 1.5F}});
  Eigen::Isometry3d T_map_base(Eigen::Translation3d(0.3, -0.2, 0.1));
  T_map_base.rotate(Eigen::AngleAxisd(0.6, Eigen::Vector3d::UnitZ()));
  const ChangeSet changes = freeUnknown(map, T_map_base, kStartBox);
  EXPECT_EQ(changes.revision, map.revision());
  EXPECT_FALSE(changes.bricks.empty());
  std::size_t num_free = 0;
  for (int x = -15; x < 20; ++x) {
    for (int y = -15; y < 15; ++y) {
      for (int z = -5; z < 15; ++z) {
        const cuboid_mapping::Cell cell{x, y, z};
        const bool is_inside =
            isInside(kStartBox, T_map_base.inverse() * map.grid().centerOf(CellBox::ofCell(cell)));
        const Occupancy wanted = seen.contains(cell) ? Occupancy::kOccupied
                                 : is_inside         ? Occupancy::kFree
                                                     : Occupancy::kUnknown;
        ASSERT_EQ(map.voxels().at(cell), wanted) << x << ' ' << y << ' ' << z;
        if (wanted == Occupancy::kFree) ++num_free;
      }
    }
  }
  EXPECT_GT(num_free, 500U);
  EXPECT_EQ(map.voxels().logOddsAt({3, -2, 2}), map.sensorModel().miss());
  const auto revision = map.revision();
  freeUnknown(map, T_map_base, kStartBox);
  EXPECT_EQ(map.revision(), revision) << "nothing is unknown any more";
}

TEST(StartVolume, GetsItsParameter) {
  const std::string box = "-0.6 -0.6 0 0.6 0.6 0.8";
  EXPECT_EQ(readInto<StartParameters>({{"start_free", box}}).box, box);
}

TEST(StartVolume, RefusesABoxOfTooManyVoxels) {
  LoadedParameters loaded;
  EXPECT_TRUE(StartVolume::check(loaded).empty());
  EXPECT_FALSE(StartVolume::isOn(loaded.parameters));
  loaded.parameters.of<StartParameters>().box = " -0.6 -0.6 0 0.6 0.6 0.8 ";
  EXPECT_TRUE(StartVolume::check(loaded).empty());
  EXPECT_TRUE(StartVolume::isOn(loaded.parameters));
  loaded.parameters.of<StartParameters>().box = "0 0 0 1e4 1e4 1e4";
  EXPECT_EQ(StartVolume::check(loaded).size(), 1U);
}

}  // namespace
}  // namespace cuboid_mapping_ros
