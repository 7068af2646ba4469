// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/closed_path.h"

#include <gtest/gtest.h>

#include <cmath>

namespace cuboid_mapping {
namespace {

using Eigen::Vector2d;

/// A square of 4 m, anticlockwise, with rounded corners of 1 m.
ClosedPath makeSquare() { return {{{0, 0}, {4, 0}, {4, 4}, {0, 4}}, 1.0}; }

void expectPlace(const ClosedPath::Place& place, const Vector2d& position_m, double heading_rad) {
  EXPECT_NEAR((place.position_m - position_m).norm(), 0.0, 1e-12) << place.position_m.transpose();
  EXPECT_NEAR(std::remainder(place.heading_rad - heading_rad, 2 * M_PI), 0.0, 1e-12);
}

TEST(ClosedPath, joinsLegsByArcs) {
  const ClosedPath square = makeSquare();
  const double quarter = M_PI / 2;
  EXPECT_NEAR(square.length(), 4 * 2 + 4 * quarter, 1e-12);
  expectPlace(square.computePlace(0.0), {1, 0}, 0.0);
  expectPlace(square.computePlace(1.5), {2.5, 0}, 0.0);
  const double middle = std::sqrt(0.5);
  expectPlace(square.computePlace(2 + quarter / 2), {3 + middle, 1 - middle}, M_PI / 4);
  expectPlace(square.computePlace(2 + quarter + 1), {4, 2}, M_PI / 2);
  expectPlace(square.computePlace(3 * (2 + quarter) + 0.5), {0, 2.5}, -M_PI / 2);
}

TEST(ClosedPath, turnsRightToo) {
  const ClosedPath clockwise({{0, 0}, {0, 4}, {4, 4}, {4, 0}}, 1.0);
  const double middle = std::sqrt(0.5);
  expectPlace(clockwise.computePlace(2 + M_PI / 4), {1 - middle, 3 + middle}, M_PI / 4);
  expectPlace(clockwise.computePlace(2 + M_PI / 2 + 1), {2, 4}, 0.0);
}

TEST(ClosedPath, goesRoundAgain) {
  const ClosedPath square = makeSquare();
  for (const double distance : {0.3, 2.7, 9.0}) {
    const ClosedPath::Place place = square.computePlace(distance);
    expectPlace(square.computePlace(distance + 3 * square.length()), place.position_m,
                place.heading_rad);
    expectPlace(square.computePlace(distance - 2 * square.length()), place.position_m,
                place.heading_rad);
  }
}

TEST(ClosedPath, hasNoJumps) {
  const ClosedPath path({{0, 0}, {5, -1}, {9, 3}, {4, 2.5}, {2, 6}}, 0.4);
  constexpr double kStep = 0.01;
  ClosedPath::Place last = path.computePlace(0.0);
  for (double way = kStep; way < 2 * path.length(); way += kStep) {
    const ClosedPath::Place place = path.computePlace(way);
    const Vector2d step = place.position_m - last.position_m;
    ASSERT_NEAR(step.norm(), kStep, 1e-5);
    const double turn = std::remainder(place.heading_rad - last.heading_rad, 2 * M_PI);
    ASSERT_LE(std::abs(turn), kStep / 0.4 + 1e-9);
    const double middle = last.heading_rad + turn / 2;
    ASSERT_NEAR(step.x(), kStep * std::cos(middle), 1e-4);
    ASSERT_NEAR(step.y(), kStep * std::sin(middle), 1e-4);
    last = place;
  }
}

}  // namespace
}  // namespace cuboid_mapping
