// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/shape.h"

#include "support/random.h"

#include <gtest/gtest.h>

#include <cmath>

namespace cuboid_mapping {
namespace {

using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

const MetricBox kBox{{1, -1, -1}, {2, 1, 1}};
const RotatedBox kDiamond{{3, 0, 0}, {1, 1, 1}, M_PI / 4};
const Cylinder kCylinder{{4, 0}, 1, 0, 2};

double rangeTo(const Shape& shape, const Vector3d& start, const Vector3d& direction) {
  return computeRange(shape, Beam(start, direction));
}

TEST(BoxRange, isDistanceToTheFaceInFront) {
  EXPECT_DOUBLE_EQ(rangeTo(kBox, {0, 0, 0}, {1, 0, 0}), 1.0);
  EXPECT_DOUBLE_EQ(rangeTo(kBox, {5, 0, 0}, {-3, 0, 0}), 3.0);  // the direction may have any length
  EXPECT_DOUBLE_EQ(rangeTo(kBox, {1.5, 0, 5}, {0, 0, -1}), 4.0);
  EXPECT_DOUBLE_EQ(rangeTo(kBox, {0, 0, 0}, {2, 1, 0}), std::sqrt(1.25));
}

TEST(BoxRange, isInfiniteBesideAndBehind) {
  EXPECT_EQ(rangeTo(kBox, {0, 0, 0}, {-1, 0, 0}), kInfinity);
  EXPECT_EQ(rangeTo(kBox, {0, 1.5, 0}, {1, 0, 0}), kInfinity);
  EXPECT_EQ(rangeTo(kBox, {0, 0, 0}, {2, 3, 0}), kInfinity);
}

TEST(BoxRange, isZeroInside) {
  EXPECT_EQ(rangeTo(kBox, {1.5, 0, 0}, {1, 0, 0}), 0.0);
  EXPECT_EQ(rangeTo(kBox, {1.5, 0, 0}, {-0.3, 0.2, 0.9}), 0.0);
}

TEST(TurnedBoxRange, isDistanceToTheTurnedFace) {
  EXPECT_NEAR(rangeTo(kDiamond, {0, 0, 0}, {1, 0, 0}), 3 - std::sqrt(2), 1e-12);
  EXPECT_NEAR(rangeTo(kDiamond, {0, 1, 0}, {1, 0, 0}), 4 - std::sqrt(2), 1e-12);
  EXPECT_NEAR(rangeTo(kDiamond, {3, 0, 7}, {0, 0, -1}), 6.0, 1e-12);
  // A quarter turn swaps length and width.
  const RotatedBox long_box{{0, 5, 0}, {2, 0.5, 1}, M_PI / 2};
  EXPECT_NEAR(rangeTo(long_box, {0, 0, 0}, {0, 1, 0}), 3.0, 1e-12);
  EXPECT_NEAR(rangeTo(long_box, {-4, 5, 0}, {1, 0, 0}), 3.5, 1e-12);
}

TEST(TurnedBoxRange, turnsAnticlockwise) {
  const RotatedBox pointer{{0, 0, 0}, {4, 0.1, 1}, M_PI / 6};
  EXPECT_NEAR(rangeTo(pointer, {std::sqrt(3), 1, 5}, {0, 0, -1}), 4.0, 1e-12);
  EXPECT_EQ(rangeTo(pointer, {std::sqrt(3), -1, 5}, {0, 0, -1}), kInfinity);
}

TEST(TurnedBoxRange, knowsBesideBehindAndInside) {
  EXPECT_EQ(rangeTo(kDiamond, {0, 1.5, 0}, {1, 0, 0}), kInfinity);
  EXPECT_EQ(rangeTo(kDiamond, {0, 0, 0}, {-1, 0, 0}), kInfinity);
  EXPECT_EQ(rangeTo(kDiamond, {4.3, 0, 0}, {1, 0, 0}), 0.0);
}

TEST(CylinderRange, isDistanceToMantleOrCap) {
  EXPECT_DOUBLE_EQ(rangeTo(kCylinder, {0, 0, 1}, {1, 0, 0}), 3.0);
  EXPECT_DOUBLE_EQ(rangeTo(kCylinder, {0, 0.6, 1}, {1, 0, 0}), 3.2);
  EXPECT_DOUBLE_EQ(rangeTo(kCylinder, {4, 0.5, 5}, {0, 0, -1}), 3.0);
  EXPECT_DOUBLE_EQ(rangeTo(kCylinder, {4, 0.5, -5}, {0, 0, 1}), 5.0);
  EXPECT_DOUBLE_EQ(rangeTo(kCylinder, {0, 0, 4}, {1, 0, -1}), 3 * std::sqrt(2));  // mantle
  EXPECT_DOUBLE_EQ(rangeTo(kCylinder, {2.5, 0, 4}, {1, 0, -2}), std::sqrt(5.0));  // upper cap
}

TEST(CylinderRange, isInfiniteBesideAboveAndBehind) {
  EXPECT_EQ(rangeTo(kCylinder, {0, 1.1, 1}, {1, 0, 0}), kInfinity);
  EXPECT_EQ(rangeTo(kCylinder, {0, 0, 2.1}, {1, 0, 0}), kInfinity);
  EXPECT_EQ(rangeTo(kCylinder, {4, 1.5, 5}, {0, 0, -1}), kInfinity);
  EXPECT_EQ(rangeTo(kCylinder, {0, 0, 1}, {-1, 0, 0}), kInfinity);
  EXPECT_EQ(rangeTo(kCylinder, {0, 0, 1}, {1, 0, 2}), kInfinity);  // over the top
}

TEST(CylinderRange, isZeroInside) {
  EXPECT_EQ(rangeTo(kCylinder, {4.5, 0, 1}, {1, 0, 0}), 0.0);
  EXPECT_EQ(rangeTo(kCylinder, {4.5, 0, 1}, {0, 0, 1}), 0.0);
}

TEST(SignedDistance, isPositiveOutsideAndNegativeInside) {
  EXPECT_DOUBLE_EQ(computeSignedDistance(kBox, {0, 0, 0}), 1.0);
  EXPECT_DOUBLE_EQ(computeSignedDistance(kBox, {5, 5, 0}), 5.0);  // from the edge
  EXPECT_DOUBLE_EQ(computeSignedDistance(kBox, {1.4, 0, 0}), -0.4);
  EXPECT_NEAR(computeSignedDistance(kDiamond, {0, 0, 0}), 3 - std::sqrt(2), 1e-12);
  EXPECT_NEAR(computeSignedDistance(kDiamond, {3, 0, 0}), -1.0, 1e-12);
  EXPECT_DOUBLE_EQ(computeSignedDistance(kCylinder, {0, 0, 1}), 3.0);
  EXPECT_DOUBLE_EQ(computeSignedDistance(kCylinder, {4, 4, 6}), 5.0);  // from the rim
  EXPECT_NEAR(computeSignedDistance(kCylinder, {4, 0, 1.8}), -0.2, 1e-12);
}

TEST(Bounds, touchTheShapeOnAllSides) {
  const MetricBox diamond = computeBounds(kDiamond);
  const double reach = std::sqrt(2);
  EXPECT_TRUE(diamond.min_m.isApprox(Vector3d(3 - reach, -reach, -1)));
  EXPECT_TRUE(diamond.max_m.isApprox(Vector3d(3 + reach, reach, 1)));
  const MetricBox cylinder = computeBounds(kCylinder);
  EXPECT_EQ(cylinder.min_m, Vector3d(3, -1, 0));
  EXPECT_EQ(cylinder.max_m, Vector3d(5, 1, 2));
  EXPECT_EQ(computeBounds(kBox).min_m, kBox.min_m);
  EXPECT_EQ(computeBounds(kBox).max_m, kBox.max_m);
}

TEST(Moved, movesEveryShapeByTheOffset) {
  const Vector3d offset(0.5, -2, 3);
  for (const Shape& shape : {Shape(kBox), Shape(kDiamond), Shape(kCylinder)}) {
    const Shape moved = computeMoved(shape, offset);
    for (const Vector3d& point :
         {Vector3d(0.3, 0.7, 0.9), Vector3d(3.2, 0.1, 0.4), Vector3d(4.1, 0.2, -0.7)}) {
      EXPECT_NEAR(computeSignedDistance(moved, point + offset), computeSignedDistance(shape, point),
                  1e-12);
    }
  }
}

Shape makeRandomShape(test::Random& random) {
  const Vector3d center(random.real(-3, 3), random.real(-3, 3), random.real(-3, 3));
  const Vector3d half(random.real(0.1, 2), random.real(0.1, 2), random.real(0.1, 2));
  switch (random.integer(0, 2)) {
    case 0: return MetricBox{center - half, center + half};
    case 1: return RotatedBox{center, half, random.real(-4, 4)};
    default:
      return Cylinder{center.head<2>(), half.x(), center.z() - half.z(), center.z() + half.z()};
  }
}

/// Range found by steps along the beam that cannot pass through the surface.
double computeRangeByMarching(const Shape& shape, const Beam& beam) {
  double range = 0.0;
  for (int step = 0; step < 5000 && range < 50.0; ++step) {
    const double distance = computeSignedDistance(shape, beam.start + range * beam.direction);
    if (distance < 1e-8) return range;
    range += distance;
  }
  return kInfinity;
}

TEST(Range, agreesWithMarchingAlongTheBeam) {
  test::Random random(17);
  int hits = 0;
  int misses = 0;
  int inside = 0;
  for (int i = 0; i < 30000; ++i) {
    const Shape shape = makeRandomShape(random);
    const Vector3d start(random.real(-6, 6), random.real(-6, 6), random.real(-6, 6));
    const Vector3d aim(random.real(-3, 3), random.real(-3, 3), random.real(-3, 3));
    Vector3d direction = aim - start;
    if (i % 5 == 0) direction[random.integer(0, 2)] = 0.0;
    const Beam beam(start, direction);
    const double range = computeRange(shape, beam);
    const double marched = computeRangeByMarching(shape, beam);
    if (range == kInfinity) {
      ASSERT_EQ(marched, kInfinity) << test::seedNote(i);
      ++misses;
    } else {
      ASSERT_NEAR(range, marched, 1e-4) << test::seedNote(i);
      ASSERT_LE(computeSignedDistance(shape, beam.start + range * beam.direction), 1e-9);
      ++(range == 0.0 ? inside : hits);
    }
  }
  EXPECT_GT(hits, 2000);
  EXPECT_GT(misses, 2000);
  EXPECT_GT(inside, 100);
}

}  // namespace
}  // namespace cuboid_mapping
