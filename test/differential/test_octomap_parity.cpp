// SPDX-License-Identifier: BSD-3-Clause
// The map and OctoMap get the same clouds and must agree in every voxel.
#include "cuboid_mapping/interop/octomap_parity.h"
#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/scan/scan_update.h"
#include "data_sets/scan_dataset.h"
#include "support/map_invariants.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <random>
#include <string>

namespace cuboid_mapping {
namespace {

constexpr double kNoLimit = std::numeric_limits<double>::infinity();

/// The map and OctoMap side by side.
class Pair {
 public:
  Pair(const MapConfig& config, double max_range_m)
      : map_(config),
        updater_(map_.grid(), max_range_m, 1, config.beamSampling()),
        octomap_(makeOctomap(config)),
        max_range_m_(max_range_m) {}

  void insert(const Scan& scan) {
    map_.apply(updater_.compute(scan));
    insertIntoOctomap(scan, max_range_m_, octomap_);
  }

  /// Voxels of both maps, invariants of the map, volumes of the bounds add up.
  void expectAgreement() const {
    const Agreement agreement = compareWithOctomap(map_, octomap_);
    EXPECT_GT(agreement.voxels, 0.0);
    EXPECT_EQ(agreement.known_mismatch, 0.0);
    EXPECT_EQ(agreement.class_mismatch, 0.0);
    EXPECT_LE(agreement.max_log_odds_difference, 1e-3);
    EXPECT_EQ(checkMap(map_), std::vector<std::string>{});
    const CellBox bounds = *map_.bounds();
    const BoxQueryResult all = *queryCells(map_, bounds, Budget::unlimited());
    const double voxel_m3 = map_.grid().voxelVolume();
    EXPECT_NEAR((all.free_volume_m3 + all.occupied_volume_m3) / voxel_m3, agreement.voxels, 0.5);
    EXPECT_NEAR(all.free_volume_m3 / voxel_m3, map_.voxels().numFreeVoxels(), 0.5);
    EXPECT_NEAR(all.occupied_volume_m3 / voxel_m3, map_.voxels().numOccupiedVoxels(), 0.5);
    EXPECT_NEAR((all.free_volume_m3 + all.occupied_volume_m3 + all.unknown_volume_m3) / voxel_m3,
                bounds.numVoxels(), 1e-6 * bounds.numVoxels());
  }

 private:
  CuboidMap map_;
  ScanUpdater updater_;
  octomap::OcTree octomap_;
  double max_range_m_;
};

/// Random clouds that are hard on a ray walk, from a few origins so that they contradict each other.
class RandomClouds {
 public:
  RandomClouds(unsigned seed, double resolution_m)
      : random_(seed), resolution_m_(static_cast<float>(resolution_m)) {}

  Scan next() {
    Scan scan;
    scan.origin = randomPoint();
    for (int i = 0; i < 40; ++i) scan.points.push_back(endPoint(scan.origin));
    // The next origin lies at a point of this cloud.
    origins_.push_back(scan.points.back());
    return scan;
  }

 private:
  float uniform(float lower, float upper) {
    return std::uniform_real_distribution<float>(lower, upper)(random_);
  }
  int below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(random_); }

  Eigen::Vector3f randomPoint() {
    if (!origins_.empty() && below(2) == 0) {
      return origins_[static_cast<std::size_t>(below(static_cast<int>(origins_.size())))];
    }
    return {uniform(-2.0F, 2.0F), uniform(-2.0F, 2.0F), uniform(-1.0F, 1.0F)};
  }

  Eigen::Vector3f endPoint(const Eigen::Vector3f& origin) {
    Eigen::Vector3f end{uniform(-4.0F, 4.0F), uniform(-4.0F, 4.0F), uniform(-2.0F, 2.0F)};
    switch (below(6)) {
      case 0:  // Parallel to an axis.
        for (const int axis : {0, 1, 2}) {
          if (axis != axis_) end[axis] = origin[axis];
        }
        axis_ = (axis_ + 1) % 3;
        return end;
      case 1:  // On the borders of voxels.
        for (int axis = 0; axis < 3; ++axis) {
          end[axis] = std::round(end[axis] / resolution_m_) * resolution_m_;
        }
        return end;
      case 2: return origin;  // No length.
      case 3:                 // Through edges and corners.
        return origin + uniform(-3.0F, 3.0F) * Eigen::Vector3f(1.0F, below(2) == 0 ? 1.0F : -1.0F,
                                                               below(2) == 0 ? 1.0F : 0.0F);
      case 4: return origin + 0.3F * resolution_m_ * (end - origin).normalized();  // Very short.
      default: return end;
    }
  }

  std::mt19937 random_;
  float resolution_m_;
  int axis_ = 0;
  std::vector<Eigen::Vector3f> origins_;
};

TEST(OctomapParity, RandomCloudsAgreeInEveryVoxel) {
  constexpr unsigned kSeeds = 1200;
  const double resolutions_m[] = {0.05, 0.1, 0.2, 0.3};
  unsigned num_cases = 0;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    MapConfig config;
    config.resolution_m = resolutions_m[seed % 4];
    constexpr FusionKind kKinds[] = {FusionKind::kClass, FusionKind::kGrowth, FusionKind::kNone};
    config.fusion = kKinds[seed / 4 % 3];
    Pair pair(config, seed % 3 == 0 ? 1.5 : kNoLimit);
    RandomClouds clouds(seed, config.resolution_m);
    for (int i = 0; i < 6; ++i) pair.insert(clouds.next());
    pair.expectAgreement();
    ASSERT_FALSE(HasFailure()) << "seed " << seed;
    ++num_cases;
  }
  EXPECT_EQ(num_cases, kSeeds);
}

/// A real data set with a suitable resolution and range.
struct RealCase {
  const char* dataset;
  double resolution_m;
  double max_range_m;
  std::size_t step;  ///< Every which cloud is inserted.
};

class RealScans : public testing::TestWithParam<RealCase> {};

TEST_P(RealScans, AgreeInEveryVoxelAfterEveryTenthCloud) {
  const char* folder = std::getenv("CUBOID_DATA_DIR");
  if (folder == nullptr) GTEST_SKIP() << "CUBOID_DATA_DIR is not set: no real scans to test with";
  const RealCase& param = GetParam();
  const auto dataset = openScanDataset(std::string(folder) + "/" + param.dataset);
  MapConfig config;
  config.resolution_m = param.resolution_m;
  for (const double max_range_m : {kNoLimit, param.max_range_m}) {
    config.fusion = max_range_m == kNoLimit ? FusionKind::kClass : FusionKind::kGrowth;
    Pair pair(config, max_range_m);
    const std::size_t num_clouds = dataset->size() / param.step;
    for (std::size_t i = 0; i < num_clouds; ++i) {
      const ScanDataset::Item item = dataset->read(i * param.step);
      pair.insert(makeScan(item.T_map_sensor, item.T_map_sensor.translation(), item.points_sensor));
      if (i % 10 == 9 || i + 1 == num_clouds) pair.expectAgreement();
      ASSERT_FALSE(HasFailure()) << "cloud " << i << ", max range " << max_range_m;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Sets, RealScans,
    testing::Values(RealCase{"kitti_0005_city", 0.2, 20.0, 1},
                    // OctoMap takes minutes for all clouds, which are from one place.
                    RealCase{"muehlburger_tor_standing", 0.2, 20.0, 2},
                    RealCase{"sim_fr079", 0.1, 4.0, 1}, RealCase{"rgbd_7scenes", 0.05, 2.0, 1}),
    [](const auto& sets) { return std::string(sets.param.dataset); });

}  // namespace
}  // namespace cuboid_mapping
