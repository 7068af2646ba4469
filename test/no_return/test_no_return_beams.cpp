// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/no_return_beams.h"

#include "support/random.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>
#include <functional>
#include <limits>

namespace cuboid_mapping {
namespace {

using test::Random;

constexpr double kDegree_rad = M_PI / 180.0;
const Eigen::Vector3f kNoReturn =
    Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());

/// Direction of the beam of a row and a column.
using BeamFunction = std::function<Eigen::Vector3d(int row, int column)>;
/// Whether a beam is reflected.
using ReturnFunction = std::function<bool(int row, int column)>;

struct Cloud {
  int width;
  int height;
  std::vector<Eigen::Vector3f> points;

  Eigen::Vector3f& at(int row, int column) {
    return points[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(column)];
  }
};

Cloud makeCloud(int width, int height, Random& random, const BeamFunction& beam,
                const ReturnFunction& is_return) {
  Cloud cloud{width, height, {}};
  cloud.points.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
                      kNoReturn);
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      if (!is_return(row, column)) continue;
      cloud.at(row, column) = (beam(row, column) * random.real(1.0, 80.0)).cast<float>();
    }
  }
  return cloud;
}

NoReturnBeams estimate(const Cloud& cloud) {
  return estimateNoReturnBeams(cloud.points, static_cast<std::size_t>(cloud.width),
                               static_cast<std::size_t>(cloud.height));
}

double angleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// Greatest angle between estimated and true beams; checks that they are the beams without return.
double maxError(const Cloud& cloud, const BeamFunction& beam, const NoReturnBeams& estimated) {
  double max_error_rad = 0.0;
  for (const NoReturnBeams::Beam& found : estimated.beams) {
    EXPECT_FALSE(cloud.points[found.index].allFinite());
    EXPECT_NEAR(found.direction.norm(), 1.0F, 1e-5F);
    const int index = static_cast<int>(found.index);
    const Eigen::Vector3d truth = beam(index / cloud.width, index % cloud.width);
    max_error_rad = std::max(max_error_rad, angleBetween(found.direction.cast<double>(), truth));
  }
  return max_error_rad;
}

std::size_t countNoReturns(const Cloud& cloud) {
  std::size_t count = 0;
  for (const Eigen::Vector3f& point : cloud.points) count += point.allFinite() ? 0 : 1;
  return count;
}

Eigen::Vector3d fromAngles(double azimuth_rad, double elevation_rad) {
  return {std::cos(elevation_rad) * std::cos(azimuth_rad),
          std::cos(elevation_rad) * std::sin(azimuth_rad), std::sin(elevation_rad)};
}

/// Elevation of one of 32 lasers with unequal spacing, denser in the middle as in real lidars.
double elevationOf(int row) {
  const double x = (row - 15.5) / 15.5;
  return -(10.0 * x + 10.0 * x * x * x) * kDegree_rad;
}

/// A lidar with 512 columns in one turn.
BeamFunction makeLidar(double start_rad, int turns) {
  return [=](int row, int column) {
    return fromAngles(start_rad + turns * 2.0 * M_PI * column / 512.0, elevationOf(row));
  };
}

TEST(NoReturnBeams, ALidarIsFoundWhateverItsStartAndTurn) {
  Random random(1);
  for (const double start_rad : {0.0, 1.0, 3.1, -2.5}) {
    for (const int turns : {1, -1}) {
      const BeamFunction beam = makeLidar(start_rad, turns);
      // Removes every third beam, and all beams of a third of the turn.
      const Cloud cloud = makeCloud(512, 32, random, beam, [&](int, int column) {
        return random.chance(0.67) && (column < 200 || column > 370);
      });
      const NoReturnBeams found = estimate(cloud);
      EXPECT_EQ(found.layout, BeamLayout::kSphericalRows);
      EXPECT_EQ(found.beams.size(), countNoReturns(cloud));
      EXPECT_EQ(found.num_skipped, 0U);
      EXPECT_LT(found.residual_rad, 1e-4);
      EXPECT_LT(maxError(cloud, beam, found), 1e-4);
    }
  }
}

TEST(NoReturnBeams, RandomLidarsAreFound) {
  constexpr std::size_t kCases = 200;
  std::size_t num_found = 0;
  for (std::size_t i = 0; i < kCases; ++i) {
    SCOPED_TRACE(test::seedNote(i));
    Random random(1000 + i);
    const int width = random.integer(100, 700);
    const int height = random.integer(4, 40);
    const double start_rad = random.real(-4.0, 4.0);
    const double view_rad = random.real(0.5, 2.0 * M_PI) * (random.chance(0.5) ? 1.0 : -1.0);
    const double lowest_rad = random.real(-0.5, 0.0);
    const double row_step_rad = random.real(0.002, 0.02);
    std::vector<double> row_offsets_rad;
    row_offsets_rad.reserve(static_cast<std::size_t>(height));
    for (int row = 0; row < height; ++row) row_offsets_rad.push_back(random.real(-0.05, 0.05));
    const bool is_swapped = random.chance(0.5);
    const BeamFunction beam = [&](int row, int column) {
      if (is_swapped) std::swap(row, column);
      return fromAngles(
          start_rad + row_offsets_rad[static_cast<std::size_t>(row)] + view_rad * column / width,
          lowest_rad + row_step_rad * row);
    };
    const double share = random.real(0.2, 0.95);
    const Cloud cloud = makeCloud(is_swapped ? height : width, is_swapped ? width : height, random,
                                  beam, [&](int, int) { return random.chance(share); });
    const NoReturnBeams found = estimate(cloud);
    EXPECT_EQ(found.beams.size(), countNoReturns(cloud));
    EXPECT_LT(maxError(cloud, beam, found), 1e-3);
    const auto layout = is_swapped ? BeamLayout::kSphericalColumns : BeamLayout::kSphericalRows;
    num_found += found.layout == layout ? 1 : 0;
  }
  EXPECT_EQ(num_found, kCases);
}

TEST(NoReturnBeams, RowsWithoutReturnComeFromTheirNeighbours) {
  Random random(2);
  const BeamFunction even = [](int row, int column) {
    return fromAngles(2.0 * M_PI * column / 512.0, (5.0 - row) * kDegree_rad);
  };
  const Cloud cloud = makeCloud(512, 32, random, even, [](int row, int column) {
    return row >= 6 && row < 28 && row != 12 && row != 13 && column % 3 != 0;
  });
  const NoReturnBeams found = estimate(cloud);
  EXPECT_EQ(found.beams.size(), countNoReturns(cloud));
  EXPECT_LT(maxError(cloud, even, found), 1e-4);

  // Unequal spacing: within the step to the next row, 2 degrees at the edge.
  const BeamFunction uneven = makeLidar(0.0, 1);
  const Cloud upper_missing =
      makeCloud(512, 32, random, uneven, [](int row, int) { return row >= 1 && row != 16; });
  const NoReturnBeams found_uneven = estimate(upper_missing);
  EXPECT_EQ(found_uneven.beams.size(), 2U * 512U);
  EXPECT_LT(maxError(upper_missing, uneven, found_uneven), 2.0 * kDegree_rad);
}

TEST(NoReturnBeams, RowsTooFarFromKnownOnesAreSkipped) {
  Random random(3);
  const BeamFunction beam = makeLidar(0.0, 1);
  const Cloud cloud =
      makeCloud(512, 32, random, beam, [](int row, int) { return row >= 14 && row < 18; });
  const NoReturnBeams found = estimate(cloud);
  EXPECT_EQ(found.beams.size(), 2U * 3U * 512U) << "three steps known, three more each way";
  EXPECT_EQ(found.num_skipped, 22U * 512U);
}

TEST(NoReturnBeams, ARowWithoutReturnIsSkippedWhereRowsAreNotInOrder) {
  Random random(4);
  // The lasers of some lidars fire alternately up and down.
  const BeamFunction beam = [](int row, int column) {
    return fromAngles(2.0 * M_PI * column / 512.0,
                      (row % 2 == 0 ? -15.0 + row : row) * kDegree_rad);
  };
  const Cloud cloud = makeCloud(512, 16, random, beam,
                                [](int row, int column) { return row != 5 && column % 2 == 0; });
  const NoReturnBeams found = estimate(cloud);
  EXPECT_EQ(found.beams.size(), 15U * 256U);
  EXPECT_EQ(found.num_skipped, 512U);
  EXPECT_LT(maxError(cloud, beam, found), 1e-4);
}

/// A camera of 64 x 48 pixels of 1.4 degrees in the middle.
BeamFunction makeCamera(bool is_body_frame) {
  return [=](int row, int column) -> Eigen::Vector3d {
    const double right = (column - 31.0) / 40.0;
    const double down = (row - 25.0) / 40.0;
    const Eigen::Vector3d optical(right, down, 1.0);
    return is_body_frame ? Eigen::Vector3d(1.0, -right, -down).normalized() : optical.normalized();
  };
}

TEST(NoReturnBeams, ADepthImageIsFoundInOpticalAndBodyFrames) {
  Random random(5);
  for (const bool is_body_frame : {false, true}) {
    const BeamFunction beam = makeCamera(is_body_frame);
    // The upper left quarter is sky.
    const Cloud cloud = makeCloud(64, 48, random, beam, [&](int row, int column) {
      return random.chance(0.8) && (row > 24 || column > 32);
    });
    const NoReturnBeams found = estimate(cloud);
    EXPECT_EQ(found.layout, is_body_frame ? BeamLayout::kPinholeBody : BeamLayout::kPinholeOptical);
    EXPECT_EQ(found.beams.size(), countNoReturns(cloud));
    EXPECT_LT(maxError(cloud, beam, found), 1e-4);
  }
}

/// Moves every point by up to `noise_rad` seen from the sensor.
void addNoise(Cloud& cloud, double noise_rad, Random& random) {
  for (Eigen::Vector3f& point : cloud.points) {
    const Eigen::Vector3d noise(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
    point += (noise * noise_rad * point.norm()).cast<float>();
  }
}

TEST(NoReturnBeams, NoiseBelowTheLimitIsAveragedAndAboveItRefused) {
  Random random(6);
  const BeamFunction beam = makeLidar(1.0, 1);
  const auto make_noisy = [&](double noise_rad) {
    Cloud cloud = makeCloud(512, 32, random, beam, [](int, int column) { return column % 3 != 0; });
    addNoise(cloud, noise_rad, random);
    return cloud;
  };
  const Cloud little = make_noisy(0.8 * kDegree_rad);  // RMS of 0.65 degrees in two angles.
  const NoReturnBeams found = estimate(little);
  EXPECT_NEAR(found.residual_rad, 0.65 * kDegree_rad, 0.05 * kDegree_rad);
  EXPECT_EQ(found.beams.size(), countNoReturns(little));
  EXPECT_LT(maxError(little, beam, found), 0.2 * kDegree_rad);

  const Cloud much = make_noisy(1.5 * kDegree_rad);
  const NoReturnBeams refused = estimate(much);
  EXPECT_EQ(refused.layout, BeamLayout::kUnknown);
  EXPECT_TRUE(refused.beams.empty());
  EXPECT_EQ(refused.num_skipped, countNoReturns(much));
}

TEST(NoReturnBeams, AGapOfMoreThanHalfATurnIsNoHindrance) {
  Random random(11);
  for (const int turns : {1, -1}) {
    const BeamFunction beam = makeLidar(2.0, turns);
    const Cloud cloud = makeCloud(512, 32, random, beam,
                                  [](int, int column) { return column < 100 || column > 400; });
    const NoReturnBeams found = estimate(cloud);
    EXPECT_EQ(found.beams.size(), countNoReturns(cloud));
    EXPECT_LT(maxError(cloud, beam, found), 1e-4);
  }
}

TEST(NoReturnBeams, NoiseOfTheAzimuthCountsLessHighUp) {
  Random random(12);
  const BeamFunction beam = [](int row, int column) {
    return fromAngles(2.0 * M_PI * column / 512.0, (65.0 + row) * kDegree_rad);
  };
  // 1.7 degrees RMS about the axis are 0.6 degrees seen from the sensor.
  const BeamFunction noisy_beam = [&](int row, int column) {
    const double noise_rad = random.real(-3.0, 3.0) * kDegree_rad;
    return fromAngles(2.0 * M_PI * column / 512.0 + noise_rad, (65.0 + row) * kDegree_rad);
  };
  const Cloud cloud =
      makeCloud(512, 8, random, noisy_beam, [](int, int column) { return column % 3 != 0; });
  const NoReturnBeams found = estimate(cloud);
  EXPECT_EQ(found.beams.size(), countNoReturns(cloud));
  EXPECT_NEAR(found.residual_rad, 0.64 * kDegree_rad, 0.1 * kDegree_rad);
  EXPECT_LT(maxError(cloud, beam, found), 0.2 * kDegree_rad);
}

TEST(NoReturnBeams, ACloudOutsideItsSensorFrameIsRefused) {
  Random random(7);
  Cloud cloud = makeCloud(512, 32, random, makeLidar(0.0, 1),
                          [](int, int column) { return column % 2 == 0; });
  for (Eigen::Vector3f& point : cloud.points) point += Eigen::Vector3f(5.0F, 0.0F, 2.0F);
  EXPECT_EQ(estimate(cloud).layout, BeamLayout::kUnknown);
}

TEST(NoReturnBeams, PointsWithoutOrderAreRefused) {
  for (const auto& [width, height] : {std::pair(300, 2), std::pair(2, 300), std::pair(50, 40)}) {
    Random random(8);
    const BeamFunction anywhere = [&](int, int) {
      return fromAngles(random.real(-3.0, 3.0), random.real(-1.0, 1.0));
    };
    const Cloud cloud =
        makeCloud(width, height, random, anywhere, [&](int, int) { return random.chance(0.5); });
    EXPECT_EQ(estimate(cloud).layout, BeamLayout::kUnknown) << width << " x " << height;
  }
}

TEST(NoReturnBeams, ARowOfTwoPointsDoesNotSpeakForManyOfOne) {
  Random random(13);
  const BeamFunction beam = [&](int row, int column) {
    return row == 50 ? fromAngles(0.01 * column, 0.0)
                     : fromAngles(random.real(-3.0, 3.0), random.real(-1.0, 1.0));
  };
  const Cloud cloud = makeCloud(8, 100, random, beam, [](int row, int column) {
    return column == row % 8 || (row == 50 && column == row % 8 + 1);
  });
  EXPECT_EQ(estimate(cloud).layout, BeamLayout::kUnknown);
}

TEST(NoReturnBeams, TooFewOrTooCrowdedPointsAreRefused) {
  Random random(9);
  const BeamFunction beam = makeLidar(0.0, 1);
  const auto layout_of = [&](const ReturnFunction& is_return) {
    return estimate(makeCloud(512, 32, random, beam, is_return)).layout;
  };
  // 5 % of 512 x 32 are 819.2.
  EXPECT_EQ(layout_of([](int row, int column) { return row == 3 && column < 512; }),
            BeamLayout::kUnknown);
  EXPECT_EQ(layout_of([](int row, int column) { return column % 32 == 0 && row < 26; }),
            BeamLayout::kUnknown);
  // A quarter of the columns are 128.
  EXPECT_EQ(layout_of([](int, int column) { return column < 127; }), BeamLayout::kUnknown);
  EXPECT_EQ(layout_of([](int, int column) { return column < 129; }), BeamLayout::kSphericalRows);
}

TEST(NoReturnBeams, InfiniteAndZeroPointsAreNoReturns) {
  Random random(10);
  const BeamFunction beam = makeLidar(0.0, 1);
  Cloud cloud = makeCloud(512, 32, random, beam, [](int, int) { return true; });
  EXPECT_EQ(estimate(cloud).layout, BeamLayout::kUnknown) << "there is none to estimate";
  cloud.at(3, 7).setZero();
  cloud.at(5, 9).x() = std::numeric_limits<float>::infinity();
  cloud.at(5, 10).z() = std::numeric_limits<float>::quiet_NaN();
  const NoReturnBeams found = estimate(cloud);
  ASSERT_EQ(found.beams.size(), 3U);
  EXPECT_LT(angleBetween(found.beams[0].direction.cast<double>(), beam(3, 7)), 1e-4);
  EXPECT_LT(angleBetween(found.beams[1].direction.cast<double>(), beam(5, 9)), 1e-4);
  EXPECT_LT(angleBetween(found.beams[2].direction.cast<double>(), beam(5, 10)), 1e-4);
}

TEST(NoReturnBeams, AnySizeAndAnyNumbersAreTaken) {
  constexpr std::size_t kCases = 2000;
  std::size_t num_done = 0;
  for (std::size_t i = 0; i < kCases; ++i) {
    SCOPED_TRACE(test::seedNote(i));
    Random random(5000 + i);
    const int width = random.integer(0, 30);
    const int height = random.integer(0, 30);
    const float scale = std::pow(10.0F, static_cast<float>(random.integer(-45, 38)));
    Cloud cloud{width, height, {}};
    for (int k = 0; k < width * height; ++k) {
      const bool is_return = random.chance(0.8);
      const Eigen::Vector3d point(random.integer(-1, 1), random.integer(-1, 1), random.real(-1, 1));
      cloud.points.push_back(is_return ? Eigen::Vector3f(point.cast<float>() * scale) : kNoReturn);
    }
    const NoReturnBeams found = estimate(cloud);
    EXPECT_GE(found.beams.size() + found.num_skipped, countNoReturns(cloud));
    for (const auto& beam : found.beams) EXPECT_NEAR(beam.direction.norm(), 1.0F, 1e-5F);
    ++num_done;
  }
  EXPECT_EQ(num_done, kCases);
}

}  // namespace
}  // namespace cuboid_mapping
