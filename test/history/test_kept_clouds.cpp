// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/history/kept_clouds.h"

#include "cuboid_mapping/io/map_file_error.h"
#include "data_sets/scan_dataset.h"
#include "support/full_disk.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <iostream>
#include <limits>

namespace cuboid_mapping {
namespace {

using test::Random;

std::vector<Eigen::Vector3f> randomPoints(Random& random, int count, double size_m) {
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < count; ++i) {
    const auto coordinate = [&] { return static_cast<float>(random.real(-size_m, size_m)); };
    points.emplace_back(coordinate(), coordinate(), coordinate());
  }
  return points;
}

std::vector<Scan> randomScans(Random& random, double step_m) {
  std::vector<Scan> scans(static_cast<std::size_t>(random.integer(0, 3)));
  for (Scan& scan : scans) {
    scan.origin = randomPoints(random, 1, 2.0).front();
    scan.points = randomPoints(random, random.integer(0, 200), 50.0);
    scan.no_returns = randomPoints(random, random.integer(0, 20), 5.0);
    scan.open_ends = randomPoints(random, random.integer(0, 20), 5.0);
    scan.free_points = randomPoints(random, random.integer(0, 20), 1.0);
    roundScan(scan, step_m);
  }
  return scans;
}

void expectSame(const std::vector<Scan>& a, const std::vector<Scan>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].anchor_map, b[i].anchor_map);
    EXPECT_EQ(a[i].origin, b[i].origin);
    EXPECT_EQ(a[i].points, b[i].points);
    EXPECT_EQ(a[i].no_returns, b[i].no_returns);
    EXPECT_EQ(a[i].open_ends, b[i].open_ends);
    EXPECT_EQ(a[i].free_points, b[i].free_points);
  }
}

TEST(KeptClouds, giveBackRoundedScansBitByBit) {
  Random random(61);
  KeptClouds clouds(0.0125);
  std::vector<std::vector<Scan>> all;
  for (std::uint64_t number = 0; number < 100; ++number) {
    all.push_back(randomScans(random, clouds.step_m()));
    const std::size_t num_bytes = clouds.add(number, all.back());
    EXPECT_EQ(clouds.read(number).size(), num_bytes);
  }
  for (std::uint64_t number = 0; number < 100; ++number) {
    expectSame(unpackScans(clouds.read(number), clouds.step_m()), all[number]);
  }
  clouds.removeBefore(4);
  EXPECT_THROW((void)clouds.read(3), MapFileError);
  EXPECT_FALSE(clouds.read(4).empty());
  clouds.clear();
  EXPECT_THROW((void)clouds.read(4), MapFileError);
}

TEST(KeptClouds, thatAreThereStayReadableWhenTheDiskIsFull) {
  Random random(64);
  KeptClouds clouds(0.0125);
  std::vector<std::vector<Scan>> all;
  const auto add = [&](int num_points) {
    std::vector<Scan> scans(1);
    scans[0].points = randomPoints(random, num_points, 50.0);
    roundScan(scans[0], clouds.step_m());
    all.push_back(std::move(scans));
    (void)clouds.add(all.size() - 1, all.back());
  };
  const auto readAll = [&] {
    for (std::uint64_t number = 0; number < all.size(); ++number) {
      expectSame(unpackScans(clouds.read(number), clouds.step_m()), all[number]);
    }
  };
  for (int i = 0; i < 40; ++i) add(20000);  // More than SQLite keeps in memory.
  std::size_t num_failed = 0;
  {
    const test::FullDisk full;
    for (int i = 0; i < 40; ++i) {
      try {
        add(random.integer(1, 200000));
      } catch (const MapFileError&) {
        all.pop_back();
        ++num_failed;
      }
    }
  }
  EXPECT_GT(num_failed, 10U);
  readAll();
  for (int i = 0; i < 10; ++i) add(20000);
  readAll();
}

TEST(KeptClouds, areRoundedByHalfAStepAndOnce) {
  Random random(62);
  Scan scan;
  scan.points = randomPoints(random, 1000, 90.0);
  Scan rounded = scan;
  roundScan(rounded, 0.01);
  ASSERT_EQ(rounded.points.size(), 1000U);
  for (std::size_t i = 0; i < 1000; ++i) {
    EXPECT_LE((rounded.points[i] - scan.points[i]).cwiseAbs().maxCoeff(), 0.005 + 1e-5);
  }
  Scan twice = rounded;
  roundScan(twice, 0.01);
  EXPECT_EQ(twice.points, rounded.points);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float far = std::numeric_limits<float>::infinity();
  scan.points = {{nan, 0, 0}, {0, far, 0}, {0, 0, -3e7F}, {1, 2, 3}};
  roundScan(scan, 0.01);
  EXPECT_EQ(scan.points.size(), 1U) << "not finite, or too far for a whole number";
}

/// A blocked sensor measures one point again and again: zstd takes 18,000 times less for these.
TEST(KeptClouds, giveBackCloudsOfOnePoint) {
  std::vector<Scan> scans(1);
  scans[0].points.assign(std::size_t{640} * 480, {0.25F, 0.0F, -0.5F});
  expectSame(unpackScans(packScans(scans, 0.0125), 0.0125), scans);
}

TEST(KeptClouds, refuseDamagedBytes) {
  Random random(63);
  std::vector<Scan> scans = randomScans(random, 0.01);
  scans.emplace_back().points = randomPoints(random, 50, 5.0);
  roundScan(scans.back(), 0.01);
  const std::string bytes = packScans(scans, 0.01);
  for (int i = 0; i < 2000; ++i) {
    std::string damaged = bytes;
    if (random.chance(0.5)) damaged.resize(random.index(bytes.size()));
    if (!damaged.empty())
      damaged[random.index(damaged.size())] ^= static_cast<char>(1 << random.integer(0, 7));
    try {
      (void)unpackScans(damaged, 0.01);
    } catch (const MapFileError&) {
    }
  }
  EXPECT_THROW((void)unpackScans("", 0.01), MapFileError);
}

/// Size of real clouds, compared with x, y and z as floats.
TEST(KeptClouds, takeLessThanAFifthOfTheirFloats) {
  const char* folder = std::getenv("CUBOID_DATA_DIR");
  if (folder == nullptr) GTEST_SKIP() << "CUBOID_DATA_DIR is not set";
  const std::pair<const char*, double> sets[] = {
      {"kitti_0005_city", 0.2}, {"kitti_0005_city", 0.1}, {"muehlburger_tor_standing", 0.2}};
  for (const auto& [name, resolution_m] : sets) {
    const auto dataset = openScanDataset(std::string(folder) + '/' + name);
    std::size_t num_bytes = 0;
    std::size_t num_points = 0;
    for (std::size_t i = 0; i < std::min<std::size_t>(dataset->size(), 5); ++i) {
      Scan scan;
      scan.points = dataset->read(i).points_sensor;
      num_points += scan.points.size();
      roundScan(scan, resolution_m / 16);
      num_bytes += packScans({scan}, resolution_m / 16).size();
    }
    std::cout << name << ", " << resolution_m << " m: " << 1.0 * num_bytes / num_points
              << " bytes a point" << std::endl;
    EXPECT_LT(num_bytes, num_points * 12 / 5) << name << ' ' << resolution_m;
  }
}

}  // namespace
}  // namespace cuboid_mapping
